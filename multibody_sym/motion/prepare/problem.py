"""The initial value problem of a run: settings in numbers, and how its constraints are kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass, replace
from enum import Enum
from fractions import Fraction
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from multibody_sym.derivation.routes import FORMALISMS, formalism_name, verify_formalism
from multibody_sym.dynamics.programs.reactions import switchings
from multibody_sym.dynamics.programs.system import CompiledRows, closes_by_programs, with_constants
from multibody_sym.dynamics.start.number_checks import check_numbers, on_numbers
from multibody_sym.dynamics.start.parameters import ARITHMETIC
from multibody_sym.dynamics.start.start import verify_regular_start
from multibody_sym.dynamics.start.state import StartState, state_at, with_numbers_as_data
from multibody_sym.errors import ModelError, MultibodyError, at
from multibody_sym.mechanics.law_elements import Mode
from multibody_sym.mechanics.mechanism import (
    TIME,
    Coordinate,
    JointLimit,
    Mechanism,
    ParameterEntry,
    Speed,
    once,
    verify_without_states,
)
from multibody_sym.model.system import System
from multibody_sym.motion.integrator.flow import Pairing
from multibody_sym.motion.loop.integrate import integrate
from multibody_sym.motion.loop.problem import NO_MODE, Loop, ModeNumbers, Problem
from multibody_sym.motion.methods.table import METHODS, MOREAU, OF_SECOND_ORDER
from multibody_sym.motion.prepare.records import Numbers, PreparedSystem
from multibody_sym.motion.prepare.settings import (
    RunSettings,
    default_step,
    form_of,
    run_settings,
    steps_over_contacts,
    verify_contacts,
)
from multibody_sym.program import loading
from multibody_sym.program.backend import PORTABLE, Native
from multibody_sym.program.cache import digest
from multibody_sym.program.loading import Compiled
from multibody_sym.program.runtime_constants import Status
from multibody_sym.scalars.elementary import postorder
from multibody_sym.scalars.node import Node, symbol, without_collection
from multibody_sym.scalars.sign_changes import known_zeros
from multibody_sym.stages import log, stage

if TYPE_CHECKING:
    from multibody_sym.motion.switching.law_mechanism import LawMechanism
    from multibody_sym.program.program import Program
    from multibody_sym.program.programs import Form

_BY_FIXED_STEP: Final = 0.05
_BY_MEAN_STEP: Final = 0.01
_MOST_NUMBERS: Final = 250_000_000  # two gigabytes of samples
_MOST_STEPS: Final = 200_000_000


def settings_of(ready: PreparedSystem) -> RunSettings:
    """Return the settings of a system in numbers. Raises ModelError."""
    found = run_settings(ready.system.simulation, ready.parameter_values)
    stepped = steps_over_contacts(ready.system.simulation, ready.state.declared)
    if not stepped or found.method.name == MOREAU or ready.state.posed is None:
        return found
    return replace(found, method=METHODS[MOREAU], step=default_step(ready.state.posed.rows))


def problem_of(ready: PreparedSystem, settings: RunSettings) -> Problem:
    """Return the problem of a run; with rows it projects each step, or stabilises them (Baumgarte 1972) if asked.

    Raises ModelError for more samples than memory holds, more steps than a life has time for, where nothing moves, and
    where a prescribed motion jumps, or its speed does;
    NoSolutionError where the start is a singular position.
    """
    _verify_size(ready, settings)
    if settings.method.name in OF_SECOND_ORDER:
        why = f"{settings.method.name} takes equations of second order only; choose another method"
        verify_without_states(ready.mechanism, why)
    if ready.start.assembled:  # what is declared is examined already
        from multibody_sym.dynamics.start.time_functions import verify_mass_laws, verify_motions

        names = (symbol(coordinate.name) for coordinate in ready.mechanism.coordinates)
        values = {**dict(zip(names, ready.q0.tolist(), strict=True)), **ready.parameter_values}
        verify_motions(ready.system, values, settings.t_end)
        verify_mass_laws(ready.system, values, settings.t_end)
    verify_regular_start(ready.mechanism, ready.start)
    mechanism, constrained = ready.mechanism, bool(ready.mechanism.rows)
    margins = (0.0,) * (len(switchings(mechanism)) if ready.laws is None else ready.laws.functions)
    parameters, mode = ready.parameters, NO_MODE
    if ready.laws is not None:
        parameters, numbers = ready.laws.numbers(mechanism, parameters)
        mode = ModeNumbers.of(numbers, {})
    problem = Problem(
        compiled=ready.compiled,
        method=settings.method,
        t0=0.0,
        t_end=settings.t_end,
        q0=ready.q0,
        u0=ready.u0,
        parameters=parameters,
        mode=mode,
        step=settings.step,
        rtol=settings.rtol,
        atol=settings.atol,
        samples=settings.samples,
        project=constrained and settings.project,
        max_steps=_MOST_STEPS,
        independent=float(ready.mechanism.parameters.independent_rows(ready.start.parameters)),
        terminal=terminal_of(mechanism, len(margins)),
        margins=margins,
        moments=knots_before(mechanism, settings.t_end),
        pairs=pairing_of(ready.mechanism),
    )
    if not constrained or settings.baumgarte is None or ready.state.declared.one_way:
        return problem
    alpha, beta = settings.baumgarte.chosen(lambda: own_coefficient(problem))
    return replace(problem, parameters=ready.stabilised_by(alpha, beta))


def terminal_of(mechanism: Mechanism, switches: int) -> tuple[bool, ...]:
    """Return for each value of `events` whether a run stops there; the last are `switches` of a mode."""
    kinks = len(mechanism.kinks) + len(mechanism.fades)
    return (True,) * len(mechanism.stops) + (False,) * kinks + (True,) * switches


def knots_before(mechanism: Mechanism, t_end: float) -> tuple[float, ...]:
    """Return the knots of long tables of time, over which no step leads: one function has them all as its zeros."""
    letters = {g: [n for n in postorder([g]) if not n.args and n.shadow is None] for g in mechanism.kinks}
    tables = [g for g in mechanism.kinks if g.op == "table" and letters[g] == [TIME]]
    return tuple(sorted({t for g in tables for t in known_zeros(g, TIME, {}) or () if 0.0 < t < t_end}))


def pairing_of(mechanism: Mechanism) -> Pairing:
    """Return which speeds are rates of which coordinates. Raises TypeError for a step of other kinds."""
    plain: list[tuple[int, int]] = []
    balls: list[tuple[int, int]] = []
    for body in mechanism.bodies:
        plain += body.rate_pairs
        for free in (free for free in body.free_steps if not free.step.speeds_are_rates):
            if not free.step.unit_quaternion:
                raise TypeError(f"nothing says how methods take the coordinates of {type(free.step).__name__} on")
            balls.append((free.q[0], free.u[0]))
    return Pairing(len(mechanism.coordinates), tuple(plain), tuple(balls))


def _verify_size(ready: PreparedSystem, settings: RunSettings) -> None:
    width = len(ready.q0) + len(ready.u0)
    if width == 0 and not ready.mechanism.drives:
        raise ModelError("nothing can move: no joint has freedom", number="M117").under("joints")
    with at("simulation"):
        most = _MOST_NUMBERS // max(width, 1)
        count = settings.samples if isinstance(settings.samples, int) else len(settings.samples.times)
        if count > most:
            raise ModelError(f"{count} samples are too many; at most {most}", number="M109").under("samples")
        if settings.step is not None and settings.t_end / settings.step > _MOST_STEPS:
            raise ModelError(f"{settings.t_end / settings.step:.3g} steps are too many", number="M117").under("step")


def own_coefficient(problem: Problem, loop: Loop | None = None) -> float:
    """Return alpha = beta: 0.05/h for a fixed step; else 0.01/h with the mean accepted step h of a run without it.

    It is a constant of the run, for tied to the current step it would shorten the step that it is chosen from.
    """
    if problem.step is not None:
        return _BY_FIXED_STEP / problem.step
    pilot = integrate(replace(problem, samples=2), loop=loop)
    if pilot.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    mean_step = pilot.statistics.mean_step
    return _BY_MEAN_STEP / mean_step if mean_step > 0.0 else 0.0


# ----------------------------------------------------------------------------------------------------------------------
# A system ready to run: resolved, its parameters in numbers, its start assembled, its Programs compiled.


_FEW: Final = 30
"""Speeds of a model that is soon walked through in Python: what is wrong with its start is told before it is compiled.
"""


@on_numbers
@without_collection()
def prepare_system(
    system: System,
    formalism: str | None = None,
    code: Native = PORTABLE,
    *,
    modes: bool = False,
) -> PreparedSystem:
    """Return the system ready to run by a formalism, compiled as `code` says.

    `modes`: its Programs are those of all modes of what holds one way only, where one set of them serves these; else
    they are those of the mode at its start. Raises InputError for what the model contradicts, and NoSolutionError where
    no start satisfies the constraints or a free direction has no inertia.
    """
    verify_formalism(formalism)
    finding = _Programs(system, formalism, code)
    with stage("start"):
        state, made = _state_at_start(system, finding)
    state = with_numbers_as_data(state.before_a_run)
    laws = None
    if modes and steps_over_contacts(system.simulation, state.declared):
        verify_contacts(state.declared)
    if modes and state.declared.one_way:
        from multibody_sym.motion.switching.law_mechanism import LawMechanism  # which few runs need

        laws = LawMechanism.of(state.declared, system.simulation)
    if laws is not None and laws.served:
        name, programs = finding.of_all_modes(laws)
    else:
        laws, (name, programs) = None, made or finding.made(state.mechanism)
    begin = state.start
    numbers = Numbers(*(np.array(values, dtype=float) for values in (begin.parameters, begin.q, begin.u)))
    return PreparedSystem(name, programs, numbers, partial(_both, system, state), laws=laws)


Made = tuple[str, Compiled]
"""The name of a formalism, and a mechanism's Programs by it."""


class _Programs(NamedTuple):
    """How a system's Programs are found: those of a mechanism `made`, or only recalled."""

    system: System
    formalism: str | None
    code: Native

    def made(self, mechanism: Mechanism) -> Made:
        name = formalism_name(self.formalism, mechanism)
        return name, compile_mechanism(mechanism, name, self._form(mechanism), self.code)

    def of_all_modes(self, laws: LawMechanism) -> Made:
        assert laws.served is not None
        name = formalism_name(self.formalism, laws.every or laws.declared)
        found = recall_laws(laws.declared, (name, laws.served), self.code)
        return name, found.compiled

    def recalled(self, mechanism: Mechanism) -> Made | None:
        name = formalism_name(self.formalism, mechanism)
        found = recall_programs(mechanism, name, self._form(mechanism), self.code)
        return None if found is None else (name, found)

    def _form(self, mechanism: Mechanism) -> Form:
        rows = any(row.restricts for row in mechanism.rows)
        return form_of(self.system.simulation, constrained=rows, varies=mechanism.mode is not None)


def _state_at_start(system: System, programs: _Programs) -> tuple[StartState, Made | None]:
    """Return the state at the start, and the Programs if loops were closed by them, which they are where that can be.

    Whatever is wrong is told as where it cannot; of few bodies, before anything is compiled.
    """
    declared = check_numbers(system)
    found = partial(state_at, declared, project=system.simulation.project)
    if not closes_by_programs(declared):
        return found(), None
    data = with_constants(declared)
    made = programs.recalled(data)
    if made is None and len(declared.speeds) <= _FEW:
        found()
    with suppress(MultibodyError, *ARITHMETIC):
        made = made or programs.made(data)
        compiled = CompiledRows(data, made[1].functions)
        return state_at(data, project=system.simulation.project, compiled=compiled), made
    return found(), made


def _both(system: System, state: StartState) -> tuple[System, StartState]:  # no closure, to be pickled
    return system, state


# ----------------------------------------------------------------------------------------------------------------------
# Programs of a mechanism, compiled: recalled from the cache by its structure, or derived once.


_NUMBERS: Final[Mapping[type, frozenset[str]]] = {
    Mechanism: frozenset({"name"}),
    ParameterEntry: frozenset({"value", "dimension"}),
    Coordinate: frozenset({"initial", "given", "known"}),
    Speed: frozenset({"initial", "given", "known"}),
    JointLimit: frozenset({"lower", "upper", "velocity"}),
    Mode: frozenset({"directions", "shares"}),
}
"""What no Program follows from: a title, what is handed over as numbers and its unit, what is looked at after a run."""


def compile_mechanism(
    mechanism: Mechanism,
    formalism: str,
    form: Form = "explicit",
    code: Native = PORTABLE,
) -> Compiled:
    """Return a mechanism's Programs by a formalism, ready to be called, with those that a method needs for its `form`.

    What was derived for a mechanism of the same structure is recalled, whatever its parameters' values and start. Those
    are among them from which the start values of its loops are found.
    """
    recalled = recall_programs(mechanism, formalism, form, code)
    if recalled is not None:
        return recalled
    loading.begin(_parts(mechanism, form), code)
    from multibody_sym.dynamics.programs.system import (
        closing_programs,
        programs,  # a run that recalls needs none of it
    )

    log("derive %s by %s, %s", mechanism.name, formalism, form)
    with without_collection():
        with stage("derive"):
            derived, closing = programs(mechanism, FORMALISMS[formalism], form).of_runs(), closing_programs(mechanism)
        made = loading.load(derived, code, rare=closing, multistep=form == "multistep")
    loading.remember(structure_key(mechanism, formalism, form), made, {})
    return replace(made, remake=partial(compile_mechanism, mechanism, formalism, form))


def recall_programs(
    mechanism: Mechanism,
    formalism: str,
    form: Form = "explicit",
    code: Native = PORTABLE,
) -> Compiled | None:
    """Return what `compiled` does where it is in the cache, else None."""
    recalled = loading.recall(structure_key(mechanism, formalism, form), code)
    if recalled is None:
        return None
    again = partial(compile_mechanism, mechanism, formalism, form)
    return replace(recalled.compiled, wanted=code, remake=again)


def recall_laws(
    mechanism: Mechanism,
    served: tuple[str, Form] | None = None,
    code: Native = PORTABLE,
) -> loading.Recalled:
    """Return the Programs `inputs` and `laws` of a mechanism in no mode, recalled likewise, ready to be called.

    With them are the places of the entries of each of its matrices (see `law_program`), and if all its modes are to be
    `served`, by a formalism and for the form of a method, the Programs of these (see `every_mode_programs`), or those
    of the motion without contacts.
    """
    formalism, form = served or ("", "explicit")
    key = structure_key(mechanism, f"laws {formalism}", form)
    recalled = loading.recall(key, code)
    again = partial(_recompile_laws, mechanism, served)
    if recalled is not None:
        return replace(recalled, compiled=replace(recalled.compiled, wanted=code, remake=again))
    modes = {"rows", "events"} if form != "impulses" else set[str]()
    loading.begin(_parts(mechanism, form) | modes | {"laws"}, code)
    from multibody_sym.dynamics.programs.every_mode import every_mode_programs
    from multibody_sym.dynamics.programs.law_programs import law_program, row_program
    from multibody_sym.dynamics.programs.system import inputs_program, programs

    log("derive the laws of %s%s, %s", mechanism.name, f" and its modes by {formalism}" if formalism else "", form)
    with without_collection():
        after: dict[str, Program] = {}
        with stage("derive"):
            if formalism and form != "impulses":
                derived, places, after = every_mode_programs(mechanism, FORMALISMS[formalism])
            else:
                program, places = law_program(mechanism, row_program(mechanism))
                free = programs(mechanism, FORMALISMS[formalism]).of_runs() if formalism else {}
                derived = {"inputs": inputs_program(mechanism), **free, "laws": program}
        made = loading.load(derived, code, rare=after, multistep=form == "multistep")
    loading.remember(key, made, places)
    return loading.Recalled(replace(made, remake=again), places)


def _parts(mechanism: Mechanism, form: Form) -> set[str]:
    """Return the parts of the runtime that Programs of a mechanism enter for sure (see `program.target_layout`)."""
    events = bool(mechanism.stops or mechanism.kinks or mechanism.fades or mechanism.mode is not None)
    implicit = form in ("implicit", "index_2")
    entered = {"rows": bool(mechanism.rows) or events or implicit, "events": events, "implicit": implicit}
    return {part for part, enters in entered.items() if enters} | ({"multistep"} & {form})


def _recompile_laws(mechanism: Mechanism, served: tuple[str, Form] | None, code: Native) -> Compiled:
    return recall_laws(mechanism, served, code).compiled


def structure_key(mechanism: Mechanism, formalism: str, form: Form = "explicit") -> str:
    """Return a hash of what Programs follow from: the mechanism but for its numbers, the formalism and the form.

    A declaration will not do: which joint a loop is cut at depends on starts, questions and whatever else names joints.
    """
    return digest("mechanism", formalism, form, _structure(mechanism))


@once
def _structure(mechanism: Mechanism) -> str:
    """Return a hash of a mechanism but for its numbers."""
    written = _Written()
    written.add(mechanism)
    return digest("structure", "\n".join(written.lines))


_WORDS: Final = frozenset({str, int, bool, type(None)})


class _Written:
    """Parts of a mechanism as lines that tell it from every other; a Node is written once, then by its number."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._numbers: dict[Node, int] = {}
        self._fields: dict[type, Callable[[Any], tuple[Any, ...]]] = {}

    def add(self, *parts: Any) -> None:
        """Write parts, with the sizes of what they hold, so that nothing moves from one part to the next unseen."""
        for part in parts:  # most are of the first kinds: to ask what others are takes longer than to write them
            kind = type(part)
            if kind is Node:
                number = self._numbers.get(part)
                self.lines.append(f"node {self._number(part) if number is None else number}")
            elif kind in _WORDS:
                self.lines.append(repr(part))
            elif kind is tuple:
                self.lines.append(f"tuple {len(part)}")
                self.add(*part)
            elif kind in self._fields or is_dataclass(part):
                self.lines.append(kind.__name__)
                self.add(*self._contents_of(part))
            elif isinstance(part, Mapping):
                self.lines.append(f"map {len(part)}")
                self.add(*part.items())
            elif isinstance(part, tuple):
                self.lines.append(f"tuple {len(part)}")
                self.add(*part)
            else:
                assert part is None or isinstance(part, (str, int, Fraction, range, Enum)), part
                self.lines.append(repr(part))

    def _contents_of(self, part: Any) -> tuple[Any, ...]:
        kind = type(part)
        if kind not in self._fields:
            left_out = _NUMBERS.get(kind, frozenset())
            names = [f.name for f in fields(part) if f.name not in left_out]
            self._fields[kind] = attrgetter("__class__", "__class__", *names)  # of two at least it is a tuple
        return self._fields[kind](part)[2:]

    def _number(self, root: Node) -> int:
        """Return the Node's number after those of its operands, writing what has none yet (no recursion)."""
        stack = [root]
        while stack:
            node = stack[-1]
            missing = [a for a in node.args if a not in self._numbers]
            if not missing or node in self._numbers:
                stack.pop()
            stack.extend(missing)
            if not missing and node not in self._numbers:
                self.lines.append(f"{node.op} {node.data!r} {[self._numbers[a] for a in node.args]}")
                self._numbers[node] = len(self._numbers)
        return self._numbers[root]
