"""The state at the start: which one-way elements are closed, and which then act, stick or slide by their laws.

Contacts and ropes that the start values miss by little are closed first, by changing values that are not `known`. The
elements that then touch, and all friction in joints, pose the problem of the laws. In: a Mechanism in no mode. Out: a
StartState, with the mechanism in the mode that was found.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import field, replace
from functools import cached_property, partial
from itertools import chain, combinations, islice
from typing import TYPE_CHECKING, Final

from multibody_sym.dynamics.formalisms.articulated_body import tree_dynamics_of
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.system import CompiledRows, with_constants
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.dynamics.start.parameters import value_at, verify_contact_values
from multibody_sym.dynamics.start.start import ROUNDING, Start, in_absolute_coordinates, start, with_rank
from multibody_sym.errors import ModelError, NoSolutionError, Where, gathered
from multibody_sym.mechanics.law_elements import LawElement, Mode
from multibody_sym.mechanics.mechanism import INDEPENDENT, Mechanism
from multibody_sym.mechanics.modes import in_mode, mode_of_words, mode_words
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.model.system import System
from multibody_sym.program.runtime_constants import TOUCHING
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import as_node, slot

if TYPE_CHECKING:
    from multibody_sym.contact_laws.problem import LawStates, Verdict
    from multibody_sym.dynamics.contact.contact_problem import OneWayRows, Posed, Scale

NEAR: Final = 1e-3
"""The part of the model's size by which a contact may be missed at the start and is closed all the same."""
_CLOSED: Final = 1e-12
_MOST_LEFT: Final = 12
"""Up to so many gaps that a start nearly closes are closed: more are those of a heap, and stay as given."""
_IN_SPACE: Final = 4
"""With more friction parts at rest in space one state is enough, and the result says that others were not searched."""
_BEYOND: Final = "; start from a little beyond, or with the speed at which it slides"
_STRIKES: Final = "; as a restitution is declared, a run begins with an impact without collision (simulate)"
_HOW: Final[Mapping[str, tuple[str, str]]] = {
    "rope": ("begins {:.3g} m longer than the rope is", "give it its length, or other positions (initial: {q: ..})"),
    "stop": ("begins {:.3g} beyond its stop", "start it between its limits (initial: {q: ..}), or write acts: false"),
}
_BLAMED: Final = 64
"""Sets of elements that are tried for a smallest one without a state."""


@dataclass(frozen=True, eq=False)
class StartState:
    """A system at its start: `declared` in no mode, and the `modes` that the laws allow, the first of which counts.

    Without one-way elements there is one empty mode, and `posed` and `found` are None. `begin` is the start of the
    declared mechanism; `closing` names the elements that strike as the run begins, with their speeds (m/s, rad/s).
    """

    declared: Mechanism
    begin: Start
    modes: tuple[Mode, ...]
    posed: Posed | None = None
    found: LawStates | None = None
    closing: Mapping[str, float] = field(default_factory=dict)

    @property
    def mode(self) -> Mode:
        """The mode at the start. Raises NoSolutionError where there is none."""
        if not self.modes:
            assert self.found is not None
            blamed = self._blamed()
            names = f" ({', '.join(x.name for x in blamed)})" if len(blamed) > 1 else ""
            advice = _STRIKES if self.wedged else self._collide if self.found.proved else _BEYOND
            raise NoSolutionError(
                f"at the start {self.found.why_none}{advice}{names}",
                where=Where(path=blamed[0].path),
                number="N107",
            )
        return self.modes[0]

    @property
    def _collide(self) -> str:
        """Advice that an impact may begin the motion, where friction jams and no closed element collides."""
        assert self.posed is not None
        closed = [x for x in self.posed.elements if x.unilateral]
        rub = any(part.rubs for element in closed for part in element.frictions)
        collide = any(element.collides for element in closed)
        if not rub or collide:
            return ""
        from multibody_sym.contact_laws.problem import COLLIDE

        return f"; where friction jams, {COLLIDE} (simulate)"

    @cached_property
    def wedged(self) -> bool:
        """Whether no forces fulfil the laws, but impulses may: a run begins with an impact without collision."""
        if self.posed is None or self.found is None:
            return False
        return self.posed.rows.wedged([x for x in self.posed.elements if x.unilateral], self.found)

    @property
    def before_a_run(self) -> StartState:
        """The state from which a run begins, which decides the first mode: nothing acts where all is `wedged`."""
        return replace(self, modes=(Mode({}),)) if self.wedged else self

    def _blamed(self) -> Sequence[LawElement]:
        """Return a smallest set of closed elements for which no state fulfils the laws; all after many attempts."""
        assert self.posed is not None
        closed = [x for x in self.posed.elements if x.unilateral]
        rows = rows_at(self.declared.relative or self.declared, self.begin)
        sets = chain.from_iterable(combinations(closed, size) for size in range(1, len(closed) + 1))
        for some in islice(sets, _BLAMED):
            if not _law_states(_posed_at(rows, [x.name for x in some])).states:
                return some
        return closed or self.declared.one_way

    @cached_property
    def mechanism(self) -> Mechanism:
        return mechanism_in_mode(self.declared, self.mode)

    @cached_property
    def start(self) -> Start:
        return start_in_mode(self.mechanism, self.declared.relative or self.declared, self.begin)

    @property
    def in_joints(self) -> tuple[Mechanism, Start]:
        """The mechanism in its mode and its start in the coordinates of joints, whatever a run is in."""
        own = self.mechanism.relative
        if own is None:
            return self.mechanism, self.start
        assert self.declared.relative is not None
        return own, start_in_mode(own, self.declared.relative, self.begin)

    @property
    def strikes(self) -> str:
        """A remark on the elements that strike at the start; empty where none does."""
        units = {x.name: "rad/s" if x.normals[0].unit == "N*m" else "m/s" for x in self.declared.one_way}
        text = ", ".join(f"{name} closes with {v:.6g} {units[name]}" for name, v in self.closing.items())
        return text and (
            f"{text}: that is an impact, which is left out here: this is how things would go on without it. Write "
            "impact: closing to be told what it does (a run begins with it), or let it begin without that speed"
        )

    @property
    def words(self) -> dict[str, str]:
        """The mode in words: one for each one-way element and each friction part in it."""
        return mode_words(self.declared.one_way, self.mode)

    def motion(self, number: int) -> tuple[Floats, dict[str, float]] | None:
        """Return the accelerations (nu,) and multipliers by row of a state; None where its mode determines both."""
        if self.posed is None or self.found is None or not self.found.free:
            return None
        state = self.found.states[number]
        forces = dict(zip(self.posed.names, state.z.tolist(), strict=True))
        from multibody_sym.dynamics.contact.contact_problem import accelerations_of

        return accelerations_of(self.posed.dynamics, state.x), forces

    @property
    def verdict(self) -> Verdict:
        """Whether the laws leave one motion or several."""
        return "one" if self.found is None else self.found.verdict

    @property
    def others(self) -> tuple[dict[str, str], ...]:
        """The words of the other modes that fulfil all laws."""
        return tuple(mode_words(self.declared.one_way, mode) for mode in self.modes[1:])


def state_at(
    declared: Mechanism,
    *,
    project: bool = False,
    overrides: Mapping[str, float] | None = None,
    search: Callable[[Posed], LawStates] | None = None,
    compiled: CompiledRows | None = None,
) -> StartState:
    """Return a mechanism at its start with the modes that the laws of its one-way elements allow.

    `compiled`: its rows by Programs, where it has no one-way elements. Raises what `start` raises, and ModelError for
    bodies that begin inside each other, and ropes and stops beyond their limits.
    """
    base = declared.relative or declared
    if not base.one_way:
        return StartState(declared, start(base, overrides, project=project, compiled=compiled), (Mode({}),))
    from multibody_sym.dynamics.start.initial_geometry import verify_outside  # which few systems need

    begin, rows = _nearly_touching(base, start(base, overrides, project=project), overrides, project)
    verify_contact_values(base.one_way, partial(value_at, rows.motion))
    wrong = gathered()
    with wrong:
        verify_outside(rows.motion, rows.scale.length * TOUCHING)
    for element in base.one_way:
        if element.unilateral and element.kind in _HOW and rows.standing(element) == "inside":
            how, advice = _HOW[element.kind]
            message = f"{element.name} {how.format(-rows.gap(element))}; {advice}"
            with wrong:
                raise ModelError(message, where=Where(path=element.path), number="M119")
    wrong.told()
    problem = _posed_at(rows, rows.touching())
    closing = {x.name: -rows.rate(x) for x in problem.elements if x.unilateral and rows.sense(x) < 0}
    _verify_rough(problem, list(closing))
    found = search(problem) if search is not None else _law_states(problem)
    modes = tuple(problem.mode(state) for state in found.states)
    return StartState(declared, begin, modes, problem, found, closing)


def _posed_at(rows: OneWayRows, closed: Collection[str]) -> Posed:
    from multibody_sym.dynamics.contact.contact_problem import Posed

    return Posed.at(rows, closed)


def _law_states(problem: Posed, left: Mapping[str, float] | None = None) -> LawStates:
    """Return the states that fulfil the laws; `left` are exact values at limits, by rows."""
    from multibody_sym.contact_laws.search import find  # which a run without laws does not need

    known = {problem.names.index(name): value for name, value in (left or {}).items()}
    in_space = sum(len(part.rows) > 1 and part.rests for part in problem.problem.parts)
    every = in_space <= _IN_SPACE  # each of them takes Newton's method
    return find(problem.problem, every=every, drift=problem.drift, left=known)


def examined_state(system: System, *, left: Mapping[str, float] | None = None) -> StartState:
    """Return the state of a system at its start, after checks of its numbers.

    `left`: exact values at limits, by rows, which decide there.
    """
    search = None if left is None else partial(_law_states, left=left)
    return state_at(check_numbers(system), project=system.simulation.project, search=search)


def with_numbers_as_data(state: StartState) -> StartState:
    """Return a start whose mechanism has its literal numbers in the parameter vector, where these are handed over."""
    declared = with_constants(state.declared)
    if declared is state.declared:
        return state
    values = evaluate_float(declared.parameters.constants, {})
    return replace(state, declared=declared, begin=replace(state.begin, parameters=(*state.begin.parameters, *values)))


def rows_at(base: Mechanism, begin: Start, scale: Scale | None = None) -> OneWayRows:
    """Return the rows of one-way elements at a start, with the model's sizes there or a given `scale`."""
    state = state_of(base, float, 0.0, begin.q, begin.u, begin.parameters)
    from multibody_sym.dynamics.contact.contact_problem import one_way_rows

    return one_way_rows(base, motion_of(base, state), scale)


def mechanism_in_mode(declared: Mechanism, mode: Mode) -> Mechanism:
    """Return a mechanism in a mode; itself without one-way elements."""
    if not declared.one_way:
        return declared
    found = in_mode(declared, mode)
    return found if declared.relative is None else replace(found, relative=in_mode(declared.relative, mode))


def start_in_mode(mechanism: Mechanism, base: Mechanism, begin: Start) -> Start:
    """Return the start of a mechanism in a mode, with its parameters and rank, from that of its `base` in no mode."""
    if mechanism.mode is None:
        return begin if mechanism.relative is None else in_absolute_coordinates(mechanism, begin)
    own = mechanism.relative or mechanism
    known = dict(zip((entry.name for entry in base.parameters), begin.parameters, strict=True))
    names = enumerate(entry.name for entry in own.parameters)
    values = {slot("parameters", k): known[name] for k, name in names if name in known and name != INDEPENDENT}
    for k, entry in enumerate(own.parameters):  # what the mode brings; a declared one may name others declared after it
        place = slot("parameters", k)
        if place not in values:
            values[place] = evaluate_float([entry.value], values)[0] if entry.value is not None else 0.0
    parameters = [values[slot("parameters", k)] for k in range(len(own.parameters))]
    found = with_rank(own, replace(begin, parameters=tuple(parameters)))
    return found if mechanism.relative is None else in_absolute_coordinates(mechanism, found)


# --- closing what is nearly closed ---------------------------------------------------------------------------------


def _nearly_touching(
    base: Mechanism, begin: Start, overrides: Mapping[str, float] | None, project: bool
) -> tuple[Start, OneWayRows]:
    """Return the start with nearly closed contacts and ropes closed, and free speeds along them; and its rows.

    Elements that bounce and close strike instead: a body that moves towards another one does not make it move.
    """
    rows = rows_at(base, begin)
    near, found = _nearly_closed(rows, begin, overrides, project)
    rows = rows if found is begin else rows_at(base, found)
    near = [x for x in near if rows.standing(x) != "closing" or not rows.restitution(x) > 0.0]
    moving = [element for element in near if rows.standing(element) in ("closing", "leaving")]
    free = [speed for speed in base.speeds if not speed.given]
    if not moving or not free:
        return found, rows
    with suppress(NoSolutionError):
        slowed = start(_with_fixed(_with_closed(base, near), found, begin, speeds=True), overrides, project=project)
        found = replace(found, u=slowed.u, assembled=slowed.assembled, held=slowed.held)
        return found, rows_at(base, found)
    return found, rows


def closed_at(base: Mechanism, begin: Start, *, project: bool = False) -> tuple[list[LawElement], Start]:
    """Return the contacts and ropes that a start nearly closes, and the start with them closed and its own speeds."""
    return _nearly_closed(rows_at(base, begin), begin, None, project)


def _nearly_closed(
    rows: OneWayRows, begin: Start, overrides: Mapping[str, float] | None, project: bool
) -> tuple[list[LawElement], Start]:
    base, found = rows.mechanism, begin
    closable = (x for x in base.one_way if x.unilateral and not x.open and x.kind != "stop")
    near = [x for x in closable if abs(rows.gap(x)) <= rows.allowed_gap(x, NEAR) and rows.reaches(x)]
    left = [gap for gap in map(rows.gap, near) if abs(gap) > _CLOSED * rows.scale.length]
    if left and (len(left) <= _MOST_LEFT or min(left) < 0.0):
        with suppress(NoSolutionError):
            closed = start(_with_closed(base, near), overrides, project=project)
            found = start(_with_fixed(base, closed, begin), overrides, project=project)
            pairs = zip(base.coordinates, begin.q, found.q, strict=True)
            moved = {c.name: (c.given, x - q) for c, q, x in pairs if abs(x - q) > ROUNDING * max(1.0, abs(q))}
            shifts = {name: begin.shifts.get(name, 0.0) + by for name, (given, by) in moved.items() if given}
            held = tuple(name for name in begin.held if name not in moved)
            assembled = tuple(dict.fromkeys((*begin.assembled, *moved)))
            found = replace(found, shifts={**begin.shifts, **shifts}, held=held, assembled=assembled)
    return near, found


def _with_closed(base: Mechanism, near: Sequence[LawElement]) -> Mechanism:
    rows = (*base.rows, *(element.normals[0] for element in near))
    return replace(base, rows=rows, parameters=base.parameters.with_rows(len(rows)))


def _with_fixed(mechanism: Mechanism, found: Start, declared: Start, *, speeds: bool = False) -> Mechanism:
    """Return a mechanism that starts at found coordinates, and with `speeds` at the given speeds."""
    coordinates = tuple(
        replace(c, initial=as_node(x), given=True, known=True)
        for c, x in zip(mechanism.coordinates, found.q, strict=True)
    )
    if not speeds:
        return replace(mechanism, coordinates=coordinates)
    kept = tuple(
        replace(s, initial=as_node(x), known=s.given) for s, x in zip(mechanism.speeds, declared.u, strict=True)
    )
    return replace(mechanism, coordinates=coordinates, speeds=kept)


def _verify_rough(problem: Posed, closing: Sequence[str]) -> None:
    """Raise ModelError for the first `static: enough` part that slips as the motion begins, unless it strikes then."""
    laws = dict(zip((part.name for part in problem.parts), problem.problem.parts, strict=True))
    for element in problem.elements:
        for part in element.frictions:
            law = laws.get(part.name)
            if law is not None and law.enough and not law.rests and element.name not in closing:
                speed, unit = math.hypot(*law.velocity), "rad/s" if part.rows[0].unit == "N*m" else "m/s"
                raise ModelError(
                    f"{part.name} slips at {speed:.6g} {unit} at the start, but `static: enough` never lets it slip; "
                    "give other start speeds, or a coefficient",
                    where=Where(path=element.path),
                    number="M119",
                )


# ----------------------------------------------------------------------------------------------------------------------
# The mode that words give: which elements touch, stick or slide, in place of the states that the laws allow.


_PASSES: Final = 8
"""Friction turns reactions by little: their signs settle at once, or not at all."""


def given_mode(declared: Mechanism, begin: Start, words: Mapping[str, str]) -> Mode:
    """Return the mode with these words; elements without one are open, and friction without one sticks.

    Raises InputError for unknown names and words, NoSolutionError where reactions of joints have no consistent signs.
    """
    base, mode = declared.relative or declared, mode_of_words(declared.one_way, words)
    rubbing = [x for x in base.one_way if not x.unilateral]
    if not rubbing:
        return mode
    for _ in range(_PASSES):
        mechanism = mechanism_in_mode(base, mode)
        there = start_in_mode(mechanism, base, begin)
        state = state_of(mechanism, float, 0.0, there.q, there.u, there.parameters)
        forces = forward_dynamics(tree_dynamics_of(mechanism, state)).multipliers.tolist()
        signs = {row.name: -1 if force < 0.0 else 1 for row, force in zip(mechanism.rows, forces, strict=True)}
        normals = (row.name for element in rubbing for row in element.normals if row.name in signs)
        found = {**mode.sides, **{name: signs[name] for name in normals}}
        if found == mode.sides:
            return mode
        mode = replace(mode, sides=found)
    raise NoSolutionError(
        f"the reaction in {rubbing[0].joint or rubbing[0].name} has no sign that its friction leaves as it is in this "
        "mode; choose another one",
        number="N107",
    )
