"""Runs that differ in numbers alone: resolved and compiled once, started together, many at a time.

Which numbers these are is told by name; the first of them shows what the others have in common. A start that a quick
look clears is what is declared. Others are none of a family: they are resolved and started one by one.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from functools import cached_property, partial
from typing import Any, Final, NamedTuple, Protocol

import numpy as np

from multibody_sym.derivation.routes import formalism_name
from multibody_sym.dynamics.closing import normalize
from multibody_sym.dynamics.programs.system import CompiledRows, with_constants
from multibody_sym.dynamics.start.number_checks import (
    check_numbers,
    is_driven,
    is_plain,
    is_plain_but_for_loops,
    quick_look,
)
from multibody_sym.dynamics.start.parameters import evaluation_order, value_or_nan
from multibody_sym.dynamics.start.start import Start, start_from
from multibody_sym.dynamics.start.state import StartState
from multibody_sym.dynamics.start.time_functions import motions
from multibody_sym.errors import MultibodyError
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.law_elements import Mode
from multibody_sym.mechanics.mechanism import Mechanism, Source
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.system import System
from multibody_sym.motion.loop.integrate import Integration, Leg, loop_for
from multibody_sym.motion.loop.native_loop import NativeProblem, address, native_loop, piece_of, statistics_of
from multibody_sym.motion.loop.problem import Problem
from multibody_sym.motion.prepare.problem import compile_mechanism, problem_of, settings_of
from multibody_sym.motion.prepare.records import LegSamples, Numbers, PreparedSystem, ResolvedAlone, RunLabels
from multibody_sym.motion.prepare.settings import form_of, stabilises
from multibody_sym.motion.results.samples import SingleRun
from multibody_sym.program import loading
from multibody_sym.program.backend import PORTABLE, Native
from multibody_sym.program.loading import Compiled
from multibody_sym.program.native import StateStruct
from multibody_sym.program.runtime_constants import Status
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, slot, symbol

_STATE: Final = np.dtype(StateStruct)


@dataclass(frozen=True, eq=False)
class Each:
    """What came of n runs that are `like` one: samples (n, m, nq + nu), the states (n, nq + nu) and what they reached.

    `done`: of which that is all; one that is not done within a few steps, meets an event or fails is for `integrate`.
    """

    like: Problem
    samples: Floats
    ends: Floats
    states: Any
    done: list[bool]

    @cached_property
    def t(self) -> Floats:
        """The times of samples (m,)."""
        return self.like.times()

    @cached_property
    def q(self) -> Floats:
        """Coordinates (n, m, nq)."""
        return self.samples[:, :, : len(self.like.q0)]

    @cached_property
    def u(self) -> Floats:
        """Speeds (n, m, nu)."""
        return self.samples[:, :, len(self.like.q0) :]

    def integration(self, k: int) -> Integration:
        """Return what `integrate` does of run number k, if it is done."""
        q_final, u_final = np.split(self.ends[k], [len(self.like.q0)])
        taken = partial(statistics_of, self.like, self.states[k])
        return Integration(self.t, self.q[k], self.u[k], self.states[k].t, q_final, u_final, taken, None)


def integrate_each(like: Problem, parameters: Floats, q0: Floats, u0: Floats) -> Each | None:
    """Return what comes of the problem with other numbers: parameters (n, np), q0 (n, nq), u0 (n, nu).

    None where no single call does it.
    """
    count = len(parameters)
    if loop_for(like) is not native_loop or like.begun or like.jump or like.course or any(like.terminal):
        return None
    native, x0 = NativeProblem(like.again()), np.hstack([q0, u0])
    width = x0.shape[1]
    samples, ends = np.empty((count, like.sample_count, width)), np.empty((count, width))
    states, work = (StateStruct * count)(), np.empty(native.work)
    given = np.ascontiguousarray(parameters)
    native.library.mbs_integrate_each(
        native.handle,
        ctypes.c_longlong(count),
        None,
        address(given),
        ctypes.c_longlong(given.shape[1]),
        address(x0),
        ctypes.byref(states),
        address(work),
        ctypes.c_longlong(piece_of(like)),
        address(samples),
        address(ends),
    )
    found: Any = np.frombuffer(memoryview(states), dtype=_STATE)
    done = (found["status"] == Status.DONE) & (found["event"] < 0) & (found["passed"] == 0)
    done &= found["sample"] == like.sample_count
    return Each(like, samples, ends, states, done.tolist())


# ----------------------------------------------------------------------------------------------------------------------
# Where the numbers of a plain mechanism come from, and which of them are fit to start with.


Values = Mapping[str, Sequence[float]]
"""Values of some runs by name: of each name as many."""


@dataclass(frozen=True, eq=False)
class Layout:
    """Where the numbers of a plain mechanism come from: those that are `varied`, those that follow, and all others."""

    mechanism: Mechanism
    formalism: str
    compiled: Compiled
    look: Compiled
    varied: tuple[str, ...]
    initial: tuple[str, ...]

    def numbers(self, parameters: Values, initial: Values, count: int) -> Numbers:
        """Return parameters (count, np), coordinates (count, nq) and speeds (count, nu); nan where there is none."""
        found = np.tile(self._constants, (count, 1))
        for name, values in parameters.items():
            found[:, self.mechanism.parameters.places[name]] = values
        state = np.tile(self._start, (count, 1))
        for name, values in initial.items():
            state[:, self._places[name]] = values
        for k in range(count) if self._following or self._named else ():
            self._follow(found[k], state[k])
        q, u = np.split(state, [len(self.mechanism.coordinates)], axis=1)
        q, u = np.ascontiguousarray(q), np.ascontiguousarray(u)
        if any(body.quaternions for body in self.mechanism.bodies):
            for k in range(count):
                normalize(self.mechanism, q[k])
        return Numbers(found, q, u)

    def cleared(self, numbers: Numbers) -> Any:
        """Return which starts (count,) are cleared."""
        inputs = np.zeros(len(self.mechanism.inputs))
        given = numbers.q0, numbers.u0, numbers.parameters
        finite, positive = self.look.map("quick_look", 0.0, *given, inputs, np.empty(0))
        fine = [np.isfinite(values).all(axis=1) for values in (*given, finite)]
        declared = numbers.parameters[:, self._positive] > 0.0
        return np.all([*fine, declared.all(axis=1), (positive > 0.0).all(axis=1)], axis=0)

    def _follow(self, parameters: Floats, state: Floats) -> None:
        """Fill in what follows from other parameters."""
        values = {slot("parameters", k): x for k, x in enumerate(parameters.tolist())}
        for k, node in self._following:
            parameters[k] = values[slot("parameters", k)] = value_or_nan(node, values)
        for k, node in self._named:
            state[k] = value_or_nan(node, values)

    @cached_property
    def _constants(self) -> Floats:
        chosen = [entry.value is None and entry.source is Source.CHOSEN for entry in self.mechanism.parameters]
        values = [entry.value for entry in self.mechanism.parameters]
        return np.array([0.0 if run else _constant(node) for run, node in zip(chosen, values, strict=True)])

    @cached_property
    def _following(self) -> list[tuple[int, Node]]:
        """The parameters that follow from others, each after those it names."""
        entries, given = self.mechanism.parameters, dict.fromkeys(self.varied, 0.0)
        order = evaluation_order(self.mechanism, given)
        pairs = [(k, entries[k].value) for k in order if entries[k].name not in given]
        return [(k, node) for k, node in pairs if node is not None and node.shadow is None]

    @cached_property
    def _state(self) -> list[Node]:
        begun = [coordinate.initial for coordinate in self.mechanism.coordinates]
        return begun + [speed.initial for speed in self.mechanism.speeds]

    @cached_property
    def _places(self) -> dict[str, int]:
        named = [coordinate.name for coordinate in self.mechanism.coordinates]
        return {name: k for k, name in enumerate([*named, *(speed.name for speed in self.mechanism.speeds)])}

    @cached_property
    def _start(self) -> Floats:
        return np.array([_constant(node) for node in self._state], dtype=float)

    @cached_property
    def _named(self) -> list[tuple[int, Node]]:
        """The places of coordinates and speeds that begin where an expression of parameters says."""
        varied = {self._places[name] for name in self.initial}
        return [(k, node) for k, node in enumerate(self._state) if node.shadow is None and k not in varied]

    @cached_property
    def _positive(self) -> list[int]:
        declared = enumerate(self.mechanism.parameters)
        return [k for k, entry in declared if entry.positive and entry.source is Source.DECLARED]


def _constant(node: Node | None) -> float:
    """Return the value of a constant, nan of what is none."""
    if node is None or node.shadow is None:
        return np.nan
    try:
        return evaluate_float([node], {})[0]
    except UNDEFINED:
        return np.nan


# ----------------------------------------------------------------------------------------------------------------------
# Runs of a family: numbers in arrays of many; what one of them was made of is put together when somebody asks.


class Kin(Protocol):
    """The varied system that runs have in common."""

    @property
    def told(self) -> RunLabels: ...
    def ready(self, numbers: Numbers, declared: Numbers, start: Start | None) -> PreparedSystem: ...
    def problem(self, ready: PreparedSystem) -> Problem: ...


@dataclass(frozen=True, eq=False)
class Batch:
    """Runs of one system: the `declared` numbers, those with which they begin, and the result of `each`.

    `starts`: the closed loops, None where runs begin as declared. `each`: None unless one call integrates all.
    """

    kin: Kin
    declared: Numbers
    numbers: Numbers
    starts: Sequence[Start | None]
    each: Each | None

    def ready(self, k: int) -> PreparedSystem:
        """Return run number k, ready."""
        return self.kin.ready(self.numbers.of(k), self.declared.of(k), self.starts[k])

    @property
    def integrated(self) -> Each:
        """The result of the runs, if they are done."""
        assert self.each is not None
        return self.each

    @cached_property
    def asked(self) -> slice:
        """Which samples of the runs, if they are done, were asked for: all have those of the first one."""
        return self.kin.problem(self.ready(0)).asked(0, self.integrated.t)


class VariedRun:
    """Run number k of a batch."""

    parts: Final[Sequence[LegSamples]] = ()
    modes: Final = None
    begun: Final[tuple[Mapping[str, Any], ...]] = ()
    legs: Final[Sequence[Leg]] = ()
    failure: Final = None

    def __init__(self, batch: Batch, k: int) -> None:
        self._batch, self._k = batch, k

    def __reduce__(self) -> Any:
        """Return what copies it: a run made alone, without those that were integrated with it."""
        return SingleRun, (self.ready, self.problem, self.integration)

    @property
    def done(self) -> bool:
        """Whether it is integrated already."""
        return self._batch.each is not None and self._batch.each.done[self._k]

    @property
    def told(self) -> RunLabels:
        """Names and units."""
        return self._batch.kin.told

    @cached_property
    def ready(self) -> PreparedSystem:
        """The prepared system."""
        return self._batch.ready(self._k)

    @cached_property
    def problem(self) -> Problem:
        """Its problem."""
        return self._batch.kin.problem(self.ready)

    @cached_property
    def integration(self) -> Integration:
        """Its integration, if it is done."""
        return self._batch.integrated.integration(self._k)

    @property
    def parameters(self) -> Floats:
        """The parameter vector (np,)."""
        return self.problem.parameters

    @property
    def t(self) -> Floats:
        """The times of samples (m,), if it is done."""
        return self._batch.integrated.t

    @property
    def q(self) -> Floats:
        """Coordinates (m, nq), if it is done."""
        found: Floats = self._batch.integrated.q[self._k]
        return found

    @property
    def u(self) -> Floats:
        """Speeds (m, nu), if it is done."""
        found: Floats = self._batch.integrated.u[self._k]
        return found

    @property
    def asked(self) -> slice:
        """Which of its samples were asked for, if it is done."""
        return self._batch.asked


def numbers_of(starts: Sequence[Start]) -> Numbers:
    """Return the numbers with which runs begin: parameters (n, np), coordinates (n, nq) and speeds (n, nu)."""
    columns = ([getattr(start, name) for start in starts] for name in ("parameters", "q", "u"))
    return Numbers(*(np.array(rows, dtype=float) for rows in columns))


_LEAST: Final = 32
_MOST: Final = 256
_NUMBERS: Final = 1024
"""Runs that are integrated by one call: so many that what it costs is nothing, so few that they end soon.

Those of small systems, which do, are as many as have so many numbers in their states.
"""


class _Varied(NamedTuple):
    """The system, its mechanism, and the names that are varied."""

    system: System
    base: Mechanism
    parameters: tuple[str, ...]
    initial: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class VariedSystem:
    """The `system`, of which these `parameters`, and these coordinates and speeds at the start, are varied."""

    system: System
    parameters: tuple[str, ...]
    initial: tuple[str, ...]
    formalism: str | None = None
    code: Native = PORTABLE
    _first: list[Problem] = field(default_factory=list)

    def members(self, parameters: Values, initial: Values) -> Iterator[VariedRun | None]:
        """Yield the runs with these values, ready; None for those that have to be examined."""
        count = len(next(iter((*parameters.values(), *initial.values()))))
        if not self._is_plain and not self._closes:
            yield from [None] * count
            return
        layout = self._layout
        numbers = layout.numbers(parameters, initial, count)
        with np.errstate(all="ignore"):
            clear = layout.cleared(numbers)
        together = max(_LEAST, min(_MOST, _NUMBERS // max(1, numbers.q0.shape[1] + numbers.u0.shape[1])))
        for begin in range(0, count, together):
            here = slice(begin, begin + together)
            yield from self._together(Numbers(*(x[here] for x in numbers)), clear[here])

    def _together(self, declared: Numbers, clear: Any) -> Iterator[VariedRun | None]:
        """Yield runs, those integrated already that one call does."""
        starts = self._starts(declared, np.flatnonzero(clear).tolist())
        batch = self._batch(declared.of(list(starts)), list(starts.values()))
        members = {k: VariedRun(batch, place) for place, k in enumerate(starts)}
        yield from map(members.get, range(len(clear)))

    def _batch(self, declared: Numbers, starts: Sequence[Start | None]) -> Batch:
        """Return runs, integrated where one call does that."""
        closed, each = [start for start in starts if start is not None], None
        numbers = numbers_of(closed) if closed else declared
        if len(starts) > 1 and self._settled:
            first = self.ready(numbers.of(0), declared.of(0), starts[0])
            each = integrate_each(self.problem(first), *numbers)
        return Batch(self, declared, numbers, starts, each)

    def _starts(self, declared: Numbers, places: list[int]) -> dict[int, Start | None]:
        """Return how loops are closed, by place, None where there are none; runs left out have to be examined."""
        if not self._closes:
            return dict.fromkeys(places)
        found = {k: self._start(declared.of(k)) for k in places}
        return {k: start for k, start in found.items() if start is not None}

    def _start(self, own: Numbers) -> Start | None:
        """Return how a run starts whose loops are closed from what is declared; None of one that has to be examined."""
        try:
            begin = start_from(self._rows, own.parameters.tolist(), own.q0, own.u0, project=self._projects)
        except (MultibodyError, *UNDEFINED):
            return None
        independent = self._mechanism.parameters.independent_rows(begin.parameters)
        if begin.rank < independent:
            return None
        one = self.ready(numbers_of([begin]).of(0), own, begin)
        return begin if self.problem(one).independent == independent else None

    def ready(self, numbers: Numbers, declared: Numbers, start: Start | None) -> PreparedSystem:
        """Return the prepared system that starts with these numbers: as declared, or with its loops closed."""
        layout = self._layout
        begun = partial(_begun, self._varied, declared, start)
        return PreparedSystem(layout.formalism, layout.compiled, numbers, begun, self.told)

    @cached_property
    def told(self) -> RunLabels:
        """Names and units of all runs."""
        return RunLabels(ResolvedAlone(self._mechanism))

    @cached_property
    def _varied(self) -> _Varied:
        return _Varied(self.system, self._mechanism, self.parameters, self.initial)

    @cached_property
    def _changed(self) -> System:
        """The system with placeholders for varied names; only their positions matter."""
        given = dict.fromkeys(self.parameters, 1.0), dict.fromkeys(self.initial, 0.0)
        return Overrides(*given).of(self.system)

    @cached_property
    def _is_plain(self) -> bool:
        if self.system.impact is not None:
            return False
        try:
            return is_plain(self._mechanism) and (not is_driven(self._mechanism) or self._is_driven_alike)
        except MultibodyError:  # which is told of each run by itself
            return False

    @cached_property
    def _is_driven_alike(self) -> bool:
        """Whether prescribed motions are possible, and the same in all runs. Raises ModelError where they are not."""
        kept = {name: x for name, x in self.system.parameters.items() if x.value.shadow is not None}
        alike = {symbol(name) for name in ("t", *kept) if name not in self.parameters}
        if not alike.issuperset(leaves(motions(self.system), "symbol")):
            return False
        check_numbers(self.system)
        return True

    @cached_property
    def _closes(self) -> bool:
        """Whether there are loops that Programs close, and that stay closed without coefficients of each run's own."""
        if self._is_plain or self.system.impact is not None:
            return False
        try:
            loops = is_plain_but_for_loops(self._changed, self._mechanism)
            return loops and not stabilises(self.system.simulation)
        except MultibodyError:  # which is told of each run by itself
            return False

    @cached_property
    def _rows(self) -> CompiledRows:
        return CompiledRows(self._mechanism, self._layout.compiled.functions)

    @property
    def _projects(self) -> bool:
        return self.system.simulation.project

    @cached_property
    def _mechanism(self) -> Mechanism:
        return with_constants(mechanism(self._changed))

    @cached_property
    def _layout(self) -> Layout:
        resolved = self._mechanism
        name, form = formalism_name(self.formalism, resolved), form_of(self.system.simulation, constrained=self._closes)
        programs = compile_mechanism(resolved, name, form, self.code)
        looked = {"quick_look": quick_look(self._changed, resolved)}
        look = loading.load(looked, self.code)
        return Layout(resolved, name, programs, look, self.parameters, self.initial)

    @cached_property
    def _settled(self) -> bool:
        """Whether the settings of all runs are the same."""
        return all(node.shadow is not None for node in self.system.simulation.numbers)

    def problem(self, ready: PreparedSystem) -> Problem:
        """Return the problem of a run; all but its numbers is that of the first, unless settings name parameters."""
        if not self._settled:
            return problem_of(ready, settings_of(ready))
        if not self._first:
            self._first.append(problem_of(ready, settings_of(ready)))
        return self._first[0].with_numbers(ready.parameters, ready.q0, ready.u0)


def _begun(varied: _Varied, own: Numbers, begin: Start | None) -> tuple[System, StartState]:
    """Return how a run of a family, declared by its `own` numbers, started: its system, and the state at its start."""
    system, base, parameters, initial = varied
    places = {each.name: x for each, x in zip(base.coordinates, own.q0.tolist(), strict=True)}
    places |= {each.name: x for each, x in zip(base.speeds, own.u0.tolist(), strict=True)}
    values = {name: own.parameters[base.parameters.places[name]].item() for name in parameters}
    changed = Overrides(values, {name: places[name] for name in initial}).of(system)
    resolved = with_constants(mechanism(changed))
    if begin is None:
        vector, q, u = (tuple(x.tolist()) for x in own)
        begin = Start(vector, q, u, (), (), {}, 0)
    return changed, StartState(resolved, begin, (Mode({}),))
