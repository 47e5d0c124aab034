"""Runs that differ in numbers alone: resolved and compiled once, started together, many at a time.

Which numbers these are is told by name; the first of them shows what the others have in common. A start that a quick
look clears is what is declared. Others are none of a family: they are resolved and started one by one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import field
from functools import cached_property, partial
from typing import Any, Final, NamedTuple

import numpy as np

from multibody_sym.dynamics.constraints.row_numbers import CompiledRows
from multibody_sym.dynamics.programs.literals import with_constants
from multibody_sym.dynamics.start.examined import examined
from multibody_sym.dynamics.start.quick import is_driven, is_plain, is_plain_but_for_loops, quick_look
from multibody_sym.dynamics.start.smooth_motions import motions
from multibody_sym.dynamics.start.start import Start, start_from
from multibody_sym.dynamics.start.state import StartState
from multibody_sym.errors import MultibodyError
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import Mode
from multibody_sym.model.resolution.changes import Changes
from multibody_sym.model.resolution.resolve import mechanism
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.records import dataclass
from multibody_sym.runtime import loading
from multibody_sym.runtime.loading import Backend
from multibody_sym.runtime.native_runs import integrate_each
from multibody_sym.runtime.problem import Problem
from multibody_sym.scalars.node import symbol
from multibody_sym.scalars.traversal import leaves
from multibody_sym.simulation.families.layout import Layout, Values
from multibody_sym.simulation.families.members import Batch, Member, numbers_of
from multibody_sym.simulation.problem import problem_of, settings_of
from multibody_sym.simulation.recall import compiled, formalism_name
from multibody_sym.simulation.runs.runnable import Numbers, Runnable
from multibody_sym.simulation.runs.told import Alone, Told
from multibody_sym.simulation.settings import form_of, stabilises

_LEAST: Final = 32
_MOST: Final = 256
_NUMBERS: Final = 1024
"""Runs that are integrated by one call: so many that what it costs is nothing, so few that they end soon.

Those of small systems, which do, are as many as have so many numbers in their states.
"""


class _Varied(NamedTuple):
    """What the runs of a family are made of."""

    system: System
    base: Mechanism
    parameters: tuple[str, ...]
    initial: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Family:
    """The `system` with other values of these `parameters`, and of these coordinates and speeds at the start."""

    system: System
    parameters: tuple[str, ...]
    initial: tuple[str, ...]
    formalism: str | None = None
    native: bool = False
    backend: Backend | None = None
    _first: list[Problem] = field(default_factory=list)

    def members(self, parameters: Values, initial: Values) -> Iterator[Member | None]:
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

    def _together(self, declared: Numbers, clear: Any) -> Iterator[Member | None]:
        """Yield runs, those integrated already that one call does."""
        starts = self._starts(declared, np.flatnonzero(clear).tolist())
        batch = self._batch(declared.of(list(starts)), list(starts.values()))
        members = {k: Member(batch, place) for place, k in enumerate(starts)}
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

    def ready(self, numbers: Numbers, declared: Numbers, start: Start | None) -> Runnable:
        """Return a run that starts with these numbers: as it is declared, or as its loops were closed."""
        layout = self._layout
        begun = partial(_begun, self._varied, declared, start)
        return Runnable(layout.formalism, layout.compiled, numbers, begun, self.told)

    @cached_property
    def told(self) -> Told:
        """What is told of all runs."""
        return Told(Alone(self._mechanism))

    @cached_property
    def _varied(self) -> _Varied:
        return _Varied(self.system, self._mechanism, self.parameters, self.initial)

    @cached_property
    def _changed(self) -> System:
        """The system with values given to what is varied, whatever they are: what stands where is what counts."""
        given = dict.fromkeys(self.parameters, 1.0), dict.fromkeys(self.initial, 0.0)
        return Changes(*given).of(self.system)

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
        examined(self.system)
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
        programs = compiled(resolved, name, form, native=self.native, backend=self.backend)
        looked = {"quick_look": quick_look(self._changed, resolved)}
        look = loading.load(looked, native=self.native, backend=self.backend)
        return Layout(resolved, name, programs, look, self.parameters, self.initial)

    @cached_property
    def _settled(self) -> bool:
        """Whether the settings of all runs are the same."""
        settings = self.system.simulation
        given = (getattr(settings, name) for name in ("t_end", "step", "rtol", "atol", "samples"))
        return all(node is None or node.shadow is not None for node in given)

    def problem(self, ready: Runnable) -> Problem:
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
    changed = Changes(values, {name: places[name] for name in initial}).of(system)
    resolved = with_constants(mechanism(changed))
    if begin is None:
        vector, q, u = (tuple(x.tolist()) for x in own)
        begin = Start(vector, q, u, (), (), {}, 0)
    return changed, StartState(resolved, begin, (Mode({}),))
