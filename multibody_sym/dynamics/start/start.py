"""Start: parameter values, and the coordinates and speeds at t = 0 that satisfy all constraints, in floats.

In: a Mechanism, values in place of declared ones. Out: a Start, or the error of what has no value or does not close;
and random states around a start, at which routes and theorems are compared.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import field, replace
from typing import Final, NamedTuple, TypeVar

import numpy as np

from multibody_sym.dynamics.closing import (
    CLOSED,
    ConstraintRows,
    Residual,
    best_guess,
    closed_from,
    closed_near,
    displaced,
    generic_jacobian,
    least_change,
    least_norm,
    normalize,
    suffice,
)
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics, verify_inertia
from multibody_sym.dynamics.programs.system import CompiledRows
from multibody_sym.dynamics.start.parameters import (
    parameter_values,
    require_values,
    value_or_nan,
    verify_direction,
    verify_lengths,
    verify_values,
)
from multibody_sym.errors import ModelError, MultibodyError, NoSolutionError, Where, at
from multibody_sym.mechanics.forces import applied_forces
from multibody_sym.mechanics.mechanism import INDEPENDENT, TIME, Coordinate, Mechanism, Speed, TreeBody
from multibody_sym.mechanics.motion import Motion, State, state_of
from multibody_sym.mechanics.points import angular_velocity, position, velocity
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.model.bodies import GROUND, Pose
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, slot, symbol
from multibody_sym.scalars.rank import GROWING, ROUNDED, least_squares, worth
from multibody_sym.scalars.vectors import rotation_quaternion

T = TypeVar("T", Coordinate, Speed)


@dataclass(frozen=True)
class Start:
    """The state at t = 0: parameter vector (np), q (nq), u (nu).

    `held` names the coordinates and speeds that kept their declared values while constraints were closed, `assembled`
    those that were found; `shifts` are the changes of given values. `rank` of the rows: where it is less than the
    generic one, which is among the parameters, the start is a singular position.
    """

    parameters: tuple[float, ...]
    q: tuple[float, ...]
    u: tuple[float, ...]
    held: tuple[str, ...]
    assembled: tuple[str, ...]
    shifts: Mapping[str, float]
    rank: int

    @property
    def shift(self) -> float:
        """The largest change of a value that was given."""
        return max(map(abs, self.shifts.values()), default=0.0)


def start(
    mechanism: Mechanism,
    overrides: Mapping[str, float] | None = None,
    *,
    project: bool = False,
    compiled: CompiledRows | None = None,
) -> Start:
    """Return the state at t = 0: declared values, and others such that the constraints hold.

    Coordinates marked `known` keep their values; others that are given are held in their order as long as the rest can
    close. If all are given and miss the constraints by less than 1e-6, those not marked change as little as possible;
    if none is marked, and whenever `project` asks for it, all do, in the norm of the mass matrix.
    Ropes without a length and tangents that a body carries along are measured in the assembled position.
    `compiled`: the rows of this mechanism by Programs, which give the same sooner.
    Raises NoSolutionError (constraints that contradict each other, by name, or do not close, with residuals by name; a
    speed that no inertia resists) and ModelError (values that are not finite or not positive).
    """
    if mechanism.relative is not None:
        return in_absolute_coordinates(mechanism, start(mechanism.relative, overrides, project=project))
    declared = parameter_values(mechanism, overrides or {})
    values = {TIME: 0.0, **{slot("parameters", i): value for i, value in enumerate(declared)}}
    for body in mechanism.bodies:
        place = ("bodies",) if body.joint_name == GROUND else ("joints",)
        for given in body.given:
            with at(*place, body.joint_name, "motion"), require_values():
                evaluate_float(given or (), values)
    q, u = _declared_state(mechanism, declared)
    if any(step.curve is not None for body in mechanism.bodies for step in body.steps):
        from multibody_sym.dynamics.start.initial_geometry import verify_ways, with_feet

        verify_ways(mechanism, state_of(mechanism, float, 0.0, q.tolist(), u.tolist(), declared))
        q = with_feet(ConstraintRows(mechanism, declared, []).motion(q, u), q)
    return _close_rows(mechanism, declared, q, u, measure=True, project=project, compiled=compiled)


def start_from(
    compiled: CompiledRows, parameters: Sequence[float], q: Floats, u: Floats, *, project: bool
) -> Start:
    """Return and raise as `start` does, from declared parameters (np), q (nq) and u (nu); no motion is prescribed."""
    return _close_rows(compiled.mechanism, parameters, q, u, measure=True, project=project, compiled=compiled)


def start_beside(mechanism: Mechanism, begin: Start, values: Mapping[str, float]) -> Start:
    """Return the state beside a start, with its parameters, with these values of coordinates and speeds.

    The others keep those of the start as far as the constraints allow, given ones first. Raises NoSolutionError.
    """
    declared: list[Coordinate | Speed] = [*mechanism.coordinates, *mechanism.speeds]
    pairs = zip(declared, (*begin.q, *begin.u), strict=True)
    found = np.array([values.get(each.name, x) for each, x in pairs], dtype=float)
    q, u = np.split(found, [len(mechanism.coordinates)])
    normalize(mechanism, q)
    marked = replace(
        mechanism,
        coordinates=tuple(_as_known(c, values) for c in mechanism.coordinates),
        speeds=tuple(_as_known(s, values) for s in mechanism.speeds),
    )
    near = _close_rows(marked, begin.parameters, q, u, measure=False, project=False)
    # from there once more: the change from the start leaves more than the rounding of small speeds
    q, u = np.array(near.q, dtype=float), np.array(near.u, dtype=float)
    exact = _close_rows(marked, near.parameters, q, u, measure=False, project=False)
    return replace(exact, shifts={})


def _as_known(each: T, values: Mapping[str, float]) -> T:
    return replace(each, given=each.given or each.name in values, known=each.name in values)


def _close_rows(
    mechanism: Mechanism,
    declared: Sequence[float],
    q: Floats,
    u: Floats,
    *,
    measure: bool,
    project: bool,
    compiled: CompiledRows | None = None,
) -> Start:
    """Return the state that satisfies all constraints, from a declared one; `measure`s constants there."""
    if measure := measure and any(entry.measure is not None for entry in mechanism.parameters):
        from multibody_sym.dynamics.start import initial_geometry as geometry  # which few systems need
    measured = geometry.measured_rows(mechanism) if measure else frozenset()
    active = [k for k in range(len(mechanism.rows)) if k not in measured]
    known = geometry.with_sides(mechanism, declared, q) if measure else declared
    rows = ConstraintRows(mechanism, known, active, compiled=compiled)
    _verify_inertia(rows, q, u)
    if any(row.declared_length is not None for row in mechanism.rows):
        verify_lengths(rows.motion(q, u))
    with contradictions_named(rows, q, u):
        position = assembled_position(rows, q, project=project)
        # a guess may lie on the other side of a wheel
        if measure and (there := geometry.with_sides(mechanism, declared, position.values)) != list(rows.parameters):
            rows = replace(rows, parameters=there)
            position = assembled_position(rows, q, project=project)
            geometry.verify_sides(mechanism, there, position.values)
    of_all = rows.mechanism.rows
    if of_all and (rows.numbers(position.values, u) is None or any(row.line for row in of_all)):
        verify_values(rows.motion(position.values, u))
    if rows.active:
        _verify_inertia(rows, position.values, u)
    parameters = geometry.with_constants(mechanism, declared, position.values) if measure else list(declared)
    every = ConstraintRows(mechanism, parameters, range(len(mechanism.rows)), compiled=compiled)
    with contradictions_named(every, position.values, u):
        speeds = assembled_speeds(every, position.values, u, project=project)
    rank = 0
    if mechanism.rows:
        from multibody_sym.dynamics.redundancy import contradiction_of, generic_rank

        here, generic = generic_rank(every, position.values)
        if generic < every.acting:
            wrong = contradiction_of(every, position.values, speeds.values, generic)
            if wrong is not None:
                raise wrong.error(mechanism, "at the start")
        defining = len(mechanism.rows) - len(every.active)  # rows that define forces are counted
        rank = here + defining
        parameters = mechanism.parameters.changed(parameters, {INDEPENDENT: float(generic + defining)})
    if mechanism.loads or any(body.is_foot for body in mechanism.bodies):
        _verify_loads(every.motion(position.values, speeds.values))
    return Start(
        tuple(parameters),
        tuple(position.values.tolist()),
        tuple(speeds.values.tolist()),
        (*position.held, *speeds.held),
        (*position.found, *speeds.found),
        {**position.shifts, **speeds.shifts},
        rank,
    )


def in_absolute_coordinates(mechanism: Mechanism, joints: Start) -> Start:
    """Return the start of a mechanism in absolute coordinates from that in the coordinates of its joints."""
    assert mechanism.relative is not None
    entries = zip(mechanism.relative.parameters, joints.parameters, strict=True)
    values = {entry.name: value for entry, value in entries}
    parameters = [values.get(entry.name, 0.0) for entry in mechanism.parameters]
    relative = ConstraintRows(mechanism.relative, joints.parameters, [])
    motion = relative.motion(np.array(joints.q, dtype=float), np.array(joints.u, dtype=float))
    q, u = absolute_state(mechanism, motion, parameters)
    from multibody_sym.dynamics.start.initial_geometry import with_constants

    parameters = with_constants(mechanism, parameters, q)
    return with_rank(
        mechanism, replace(joints, parameters=tuple(parameters), q=tuple(q.tolist()), u=tuple(u.tolist()), rank=0)
    )


def with_rank(mechanism: Mechanism, begin: Start) -> Start:
    """Return a start with the rank of the rows there, and the generic one among the parameters.

    Rows that define forces are counted. Rows of one-way elements may depend on each other for an instant: laws decide
    which of them hold on.
    """
    if not mechanism.rows:
        return begin
    from multibody_sym.dynamics.redundancy import generic_rank

    defining = sum(not row.restricts for row in mechanism.rows)
    q = np.array(begin.q, dtype=float)
    rank, generic = generic_rank(ConstraintRows(mechanism, begin.parameters, range(len(mechanism.rows))), q)
    if rank < generic and mechanism.mode is not None:
        one_way = {row.name for element in mechanism.one_way for row in element.rows}
        both_ways = [k for k, row in enumerate(mechanism.rows) if row.name not in one_way]
        own, own_generic = generic_rank(ConstraintRows(mechanism, begin.parameters, both_ways), q)
        generic = rank + own_generic - own
    parameters = mechanism.parameters.changed(begin.parameters, {INDEPENDENT: float(generic + defining)})
    return replace(begin, parameters=tuple(parameters), rank=rank + defining)


def verify_regular_start(mechanism: Mechanism, begin: Start, called: str = "the start") -> None:
    """Raise NoSolutionError, by name, where rows depend on each other that are independent beside this state."""
    if mechanism.rows:
        from multibody_sym.dynamics.redundancy import verify_regular

        rows = ConstraintRows(mechanism, begin.parameters, range(len(mechanism.rows)))
        generic = mechanism.parameters.independent_rows(begin.parameters)
        verify_regular(rows, np.array(begin.q, dtype=float), begin.rank, generic, called)


@contextmanager
def contradictions_named(rows: ConstraintRows, q: Floats, u: Floats) -> Iterator[None]:
    """Raise NoSolutionError with the names of contradicting rows in place of an error that they cause."""
    try:
        yield
    except NoSolutionError:
        from multibody_sym.dynamics.redundancy import contradiction_of

        found = contradiction_of(rows, q, u)
        if found is None:
            raise
        raise found.error(rows.mechanism, "at the start") from None


def _verify_inertia(rows: ConstraintRows, q: Floats, u: Floats) -> None:
    found = rows.numbers(q, u)
    if found is not None and found.has_inertia:
        return
    motion = rows.motion(q, u)
    try:
        with require_values():
            verify_inertia(motion)
    except ModelError:
        verify_values(motion)
        raise


def _verify_loads(motion: Motion) -> None:
    """Raise ModelError where a load has no value or direction, or a curve does not fit the one that it touches."""
    for load in motion.mechanism.loads:
        with at(*load.path):
            verify_direction(motion, load)
            with require_values():
                applied_forces(motion, [load])
    if any(body.is_foot for body in motion.mechanism.bodies):
        from multibody_sym.dynamics.start.initial_geometry import verify_fits

        verify_fits(motion)


# --- declared state ------------------------------------------------------------------------------------------------


def _declared_state(mechanism: Mechanism, parameters: Sequence[float]) -> tuple[Floats, Floats]:
    values = {slot("parameters", i): value for i, value in enumerate(parameters)}
    found = []
    declared: Sequence[Coordinate | Speed] = (*mechanism.coordinates, *mechanism.speeds)
    for named in declared:
        value = value_or_nan(named.initial, values)
        if not math.isfinite(value):
            where = Where(path=(*named.path, "initial"))
            raise ModelError(f"the initial value of {named.name} is not finite", where=where, number="M119")
        found.append(value)
    q, u = np.split(np.array(found, dtype=float), [len(mechanism.coordinates)])
    normalize(mechanism, q)
    return q, u


# ----------------------------------------------------------------------------------------------------------------------
# Random states of a mechanism, at which routes and theorems are compared.


_TRIES: Final = 20
_REJECTED: Final = 10
"""After so many rejected states constraints are closed no more: where they hold, rows may nearly depend on others."""
_OF_STATES: Final = 0.5
"""How far declared states are drawn from their start, as a part of it; of those that start at zero, of 1."""
_STILL: Final = 1e-13
"""Of speeds that are drawn from -1 to 1, the rounding that is left of one that rows hold."""


def sampled_states(mechanism: Mechanism, begin: Start, count: int, seed: int = 0) -> list[State]:
    """Return the state at the start and up to `count` random ones around it, over floats.

    Speeds satisfy H u = -phi_t, coordinates phi = 0 where Newton's method brings them there (the equations of motion
    hold without). States are rejected at which a declared expression has no value, M is singular, or no reactions
    satisfy the law of friction; after many of these phi = 0 is not required.
    """
    rng = np.random.default_rng(seed)
    states = [state_of(mechanism, float, 0.0, begin.q, begin.u, begin.parameters)]
    rejected = 0
    for _ in range(_TRIES * count):
        if len(states) > count:
            break
        try:
            states.append(_near(mechanism, begin, rng, closes=rejected < _REJECTED))
        except (*UNDEFINED, MultibodyError):
            rejected += 1
    return states


def _near(mechanism: Mechanism, begin: Start, rng: np.random.Generator, *, closes: bool) -> State:
    """Return a random state; raises an error at rows that are nearly dependent, and where friction jams."""
    change, u = (rng.uniform(-1.0, 1.0, len(mechanism.speeds)) for _ in range(2))
    rows = ConstraintRows(mechanism, begin.parameters, range(len(mechanism.rows)), float(rng.uniform(0.0, 1.0)))
    apart = displaced(mechanism, np.array(begin.q, dtype=float), change)
    if mechanism.rates:
        states = apart[-len(mechanism.rates) :]
        states += rng.uniform(-_OF_STATES, _OF_STATES, len(states)) * np.where(states == 0.0, 1.0, np.abs(states))
    closed = closed_near(rows, apart) if closes else None
    if closed is None and any(body.is_foot for body in mechanism.bodies):
        raise ValueError("a curve is not where its foot is, and what touches it is told by that")
    q = apart if closed is None else closed
    jacobian, phidot = _kinematic_rows(rows.motion(q, u))
    speeds = u + least_squares(jacobian, -phidot, GROWING)
    motion = rows.motion(q, np.where(np.abs(speeds) > _STILL, speeds, 0.0))
    verify_inertia(motion)
    sizes = worth(_kinematic_rows(motion)[0])
    if ((sizes > ROUNDED) & (sizes < GROWING)).any():
        raise ValueError("a nearly singular position")
    applied_forces(motion)
    dynamics = composite_body(motion.mechanism, motion.state)
    if dynamics.friction is not None and dynamics.friction.beside and not forward_dynamics(dynamics).settled:
        raise ValueError("friction jams")
    return motion.state


def _kinematic_rows(motion: Motion) -> tuple[Floats, Floats]:
    """Return H (s x n) and phidot (s) of the rows that restrict the motion: others define forces."""
    rows = [row for row in row_motions(motion) if row.kinematic]
    jacobian = np.array([row.jacobian for row in rows], dtype=float).reshape(len(rows), len(motion.state.u))
    return jacobian, np.array([row.phidot for row in rows], dtype=float)


# ----------------------------------------------------------------------------------------------------------------------
# Assembly: coordinates with phi = 0 and speeds with H u = -phi_t from declared ones, in floats.
#
# Which declared values are held is one rule for both: those marked `known`, and of the others that were given, in
# their order, those that leave the rest free to close; with nothing marked, all that were given if they close. Where
# all were given and the rows nearly close, those that are not marked change as little as possible instead. None are
# held, and the change is the smallest in the norm of the mass matrix, where that is asked for, or nothing is marked.
#
# Where nothing closes, the elements are named for whose rows together no positions are found: what is left when those
# that change nothing are out.



NEAR: Final = 1e-6
"""Values that are all given change as little as possible where rows are missed by less than this part of their size."""
_LEAST: Final = 0.01
"""No speed counts as smaller than this part of the largest, from which it has its rounding."""
ROUNDING: Final = 1e-14
"""Smaller changes of given values, against one or the value, are not told."""
_ELEMENTS: Final = 6
_SPEEDS: Final = 12
"""Systems with more are not searched for what keeps them open: each element costs a search from many guesses."""


@dataclass(frozen=True)
class Assembled:
    """Coordinates or speeds that satisfy the rows; names of those held and found; by how much given ones changed."""

    values: Floats
    held: tuple[str, ...] = ()
    found: tuple[str, ...] = ()
    shifts: Mapping[str, float] = field(default_factory=dict)


class NotClosedError(NoSolutionError):
    """Start values cannot be changed such that they satisfy the constraints."""

    number = "N101"


class _Item(NamedTuple):
    """What is held or found together: a coordinate or speed, or a quaternion; its places in q or u, and its speeds."""

    names: tuple[str, ...]
    places: tuple[int, ...]
    speeds: tuple[int, ...]
    given: bool
    known: bool


Close = Callable[[Sequence[int], bool], Floats | None]
"""Find values with these speeds free; weighted by the mass matrix or not. None where the rows do not close."""


# --- positions -----------------------------------------------------------------------------------------------------


def assembled_position(rows: ConstraintRows, q: Floats, *, project: bool = False) -> Assembled:
    """Return coordinates with phi = 0, from declared ones.

    Raises NoSolutionError with the residuals by name, or ModelError naming a row without any where nothing closes.
    """
    rows = rows.holonomic()
    if not rows.active:
        return Assembled(q)
    missed = rows.missed(q)
    items = []
    for body in rows.mechanism.bodies:
        for step in body.free_steps:  # a quaternion is held as a whole
            declared = [rows.mechanism.coordinates[i] for i in step.q]
            names = tuple(c.name for c in declared)
            items.append(_Item(names, step.q, step.u, declared[0].given, declared[0].known))
    unknown = [k for item in items if not item.given for k in item.speeds]

    @functools.cache
    def guess() -> Floats:
        return best_guess(rows, q, unknown)

    def close(free: Sequence[int], weighted: bool) -> Floats | None:
        found = None
        if unknown and len(unknown) < len(free):  # what is not given gives way first
            found = closed_from(rows, guess(), free, weighted)
        return closed_from(rows, q, free, weighted) if found is None else found

    found = _choose_items(items, generic_jacobian(rows, q), missed, close, project)
    if found is None and missed is None:
        verify_values(rows.motion(q, np.zeros(len(rows.mechanism.speeds))))
    if found is None:
        raise _not_closed(rows, q)
    return _assembled_from(q, items, *found)


def _not_closed(rows: ConstraintRows, q: Floats) -> NoSolutionError:
    """Return the error that names the fewest elements found that no positions satisfy, or all rows that are missed."""
    known = any(c.known for c in rows.mechanism.coordinates)  # which may be all that keeps the rows from closing
    fewest = (None if known else unclosable(rows, q)) or rows
    names = list(dict.fromkeys(rows.mechanism.row_path(k)[1] for k in fewest.active))
    what = "the start values do not satisfy the constraints"
    if fewest is not rows and len(names) > 1:
        listed = f"{', '.join(names[:-1])} and {names[-1]}"
        what = f"no positions were found that satisfy {listed} together, though they were without any one of them"
    elif not known and len(names) == 1:
        what = f"no positions were found that satisfy {names[0]}, from the start values on"
    cure = "" if known else "; give other lengths, or start values nearer to where it closes (initial: {q: ..})"
    return _failure(fewest, what, fewest.missed(q), cure)


# --- speeds --------------------------------------------------------------------------------------------------------


def assembled_speeds(rows: ConstraintRows, q: Floats, u: Floats, *, project: bool = False) -> Assembled:
    """Return speeds with H u = -phi_t, from declared ones. Raises NoSolutionError with the residuals by name."""
    if not rows.active:
        return Assembled(u)
    phidot, jacobian, power = rows.moving(q, u)
    terms = np.abs(phidot - jacobian @ u) + power

    def missed(values: Floats) -> Residual:
        sizes = np.abs(values) + _LEAST * np.abs(values).max(initial=0.0)
        return Residual(phidot + jacobian @ (values - u), np.abs(jacobian) @ sizes + terms)

    def close(free: Sequence[int], weighted: bool) -> Floats | None:
        found: Floats = u + least_change(rows, q, jacobian, -phidot, free, weighted, least_norm)
        # rounding of the change may open small rows that the declared speeds close
        return next((values for values in (found, u) if missed(values).closed(jacobian)), None)

    items = [_Item((s.name,), (k,), (k,), s.given, s.known) for k, s in enumerate(rows.mechanism.speeds)]
    chosen = _choose_items(items, jacobian, missed(u), close, project)
    if chosen is None:
        raise _failure(rows, "the initial speeds do not satisfy the constraints", missed(u))
    return _assembled_from(u, items, *chosen)


# --- both ----------------------------------------------------------------------------------------------------------


def _choose_items(
    items: Sequence[_Item], jacobian: Floats | None, missed: Residual | None, close: Close, project: bool
) -> tuple[Floats, Sequence[_Item], Sequence[_Item]] | None:
    """Return closed values, the items held, and those that could have moved; None where nothing closes."""
    concerned = [item for item in items if jacobian is None or np.abs(jacobian[:, list(item.speeds)]).max() > 0]
    given = [item for item in concerned if item.given]
    known = [item for item in concerned if item.known]
    near = len(given) == len(concerned) and missed is not None and missed.within(NEAR)

    def attempt(held: Sequence[_Item]) -> Floats | None:
        fixed = {k for item in held for k in item.speeds}
        free = [k for item in items for k in item.speeds if k not in fixed]
        return close(free, not held)

    marked: Sequence[_Item] = [] if project else known
    unmarked: Sequence[_Item] = [] if project or near else [item for item in given if not item.known]
    if marked:  # of the others those beside which the rest moves the rows as freely as before
        taken = {k for item in marked for k in item.speeds}
        free = [k for item in items for k in item.speeds if k not in taken]
        room: list[_Item] = []
        for item in unmarked:
            left = [k for k in free if k not in item.speeds]
            if jacobian is not None and suffice(jacobian, left, free):
                room, free = [*room, item], left
        unmarked = room
    held: Sequence[_Item] = [*marked, *unmarked]
    values = attempt(held)
    if values is None and unmarked:  # as many of them as close, one by one
        held, values = marked, attempt(marked)
        for item in unmarked if values is not None else ():
            trial = attempt([*held, item])
            if trial is not None:
                held, values = [*held, item], trial
    return None if values is None else (values, held, concerned)


def _assembled_from(
    declared: Floats, items: Sequence[_Item], values: Floats, held: Sequence[_Item], concerned: Sequence[_Item]
) -> Assembled:
    """Return what was held and found: what rows concern, and what moved along because it shares mass with that."""
    changed = np.abs(values - declared) > ROUNDING * np.maximum(1.0, np.abs(declared))
    found = [item for item in items if item not in held and (item in concerned or changed[list(item.places)].any())]
    given = [pair for item in found if item.given for pair in zip(item.names, item.places, strict=True)]
    shifts = {name: float(values[k] - declared[k]) for name, k in given if changed[k]}
    names = [tuple(name for item in part for name in item.names) for part in (held, found)]
    return Assembled(values, names[0], names[1], shifts)


def _failure(rows: ConstraintRows, what: str, missed: Residual | None, cure: str = "") -> NoSolutionError:
    """Return the error that names the residuals of rows which cannot be closed, at the place of the first."""
    if missed is None:
        where = Where(path=rows.mechanism.row_path(rows.active[0]))
        return NotClosedError(f"{what}: they have no value there", where=where)
    pairs = zip(rows.active, missed.residuals, missed.sizes, strict=True)
    still_open = {k: residual for k, residual, size in pairs if not abs(residual) <= CLOSED * size}
    names = [row.name for row in rows.mechanism.rows]
    listed = [f"{names[k]} misses by {abs(residual):.6g}" for k, residual in still_open.items()]
    known = any(c.known for c in rows.mechanism.coordinates)
    freed = "; leave out `known` where values may change, or put all onto the constraints (--project)"
    advice = freed if known else cure
    reasons = ", ".join(listed) or "a joint that closes a loop is turned over"
    where = Where(path=rows.mechanism.row_path(next(iter(still_open), rows.active[0])))
    return NotClosedError(f"{what}: {reasons}{advice}", where=where)


# --- what does not close -------------------------------------------------------------------------------------------


def unclosable(rows: ConstraintRows, q: Floats) -> ConstraintRows | None:
    """Return those of rows that do not close which still do not, though they do without any one of their elements.

    None where there are too many to try.
    """
    elements = list(dict.fromkeys(rows.mechanism.row_path(k) for k in rows.active))
    if len(elements) > _ELEMENTS or len(rows.mechanism.speeds) > _SPEEDS:
        return None
    for element in elements:
        rest = replace(rows, active=[k for k in rows.active if rows.mechanism.row_path(k) != element])
        every = range(len(rest.mechanism.speeds))
        if rest.active and closed_from(rest, q, every, weighted=False) is None:
            rows = rest
    return rows


# ----------------------------------------------------------------------------------------------------------------------
# Absolute coordinates and speeds of a state that is known in the joints' own, in floats.
#
# Poses tell angles up to whole turns and unit quaternions up to their sign: these are chosen so that joints measure
# what their coordinates are.


_TURN: Final = 2 * math.pi
_DIGITS: Final = 6
"""Decimals in which misfits are compared; the smaller turn is taken where they are alike."""


def absolute_state(mechanism: Mechanism, motion: Motion, parameters: Sequence[float]) -> tuple[Floats, Floats]:
    """Return q and u of a mechanism in absolute coordinates, given the motion of the one in its joints' own."""
    joints, state = motion.mechanism, motion.state
    names = (*(c.name for c in joints.coordinates), *(s.name for s in joints.speeds))
    known = dict(zip(names, (*state.q, *state.u), strict=True))
    q = np.array([known.get(c.name, 0.0) for c in mechanism.coordinates], dtype=float)
    u = np.array([known.get(s.name, 0.0) for s in mechanism.speeds], dtype=float)
    places = {body.name: index for index, body in enumerate(joints.bodies)}
    free = {body.name: body for body in mechanism.bodies if body.joint_name not in mechanism.joint_names}
    for body in free.values():
        q[list(body.q)], u[list(body.u)] = _body_coordinates(motion, places[body.name], body)
    for carried in joints.bodies:  # parents first
        if carried.name in free:
            measured = [c.name for c in joints.coordinates if c.joint == carried.joint_name]
            wanted = {mechanism.symbols[symbol(name)]: known[name] for name in measured}
            poses = _same_poses(free[carried.name], q, list(wanted.values()))
            q = min(poses, key=_Misfit(mechanism, parameters, wanted))
    return q, u


def _body_coordinates(motion: Motion, index: int, free: TreeBody) -> tuple[Floats, Floats]:
    """Return coordinates and speeds of one body relative to ground: its centre of mass, then how it is turned."""
    ground = motion.mechanism.body_index(GROUND)
    centre = Marker(free.name, index, Pose(free.frame_on_body.position))
    origin = Marker(GROUND, ground, Pose())
    R_WG, R_WB = (np.array(motion.rotation(k), dtype=float) for k in (ground, index))
    spin = np.array(angular_velocity(motion, ground), dtype=float)
    way = np.subtract(position(motion, centre), position(motion, origin))
    v = R_WG.T @ (np.subtract(velocity(motion, centre), velocity(motion, origin)) - np.cross(spin, way))
    w = np.array(angular_velocity(motion, index), dtype=float) - spin
    p, R_GB = R_WG.T @ way, R_WG.T @ R_WB
    if not free.quaternions:
        angle = math.atan2(R_GB[1, 0], R_GB[0, 0])
        return np.array([p[0], p[1], angle]), np.array([v[0], v[1], w @ R_WG[:, 2]])
    return np.array([*p, *rotation_quaternion(R_GB.tolist())]), np.array([*v, *(R_WB.T @ w)])


def _same_poses(body: TreeBody, q: Floats, angles: Sequence[float]) -> list[Floats]:
    """Return coordinates that turn a body by whole turns, or change its quaternion's sign."""
    for places in body.quaternions:
        change = np.ones_like(q)
        change[list(places)] = -1.0
        return [q, q * change]
    most = 1 + math.ceil(max((abs(x) for x in (*angles, q[body.q[2]])), default=0.0) / _TURN)
    unit = np.zeros_like(q)
    unit[body.q[2]] = _TURN
    return sorted((q + k * unit for k in range(-most, most + 1)), key=lambda each: abs(float((each - q) @ unit)))


@dataclass(frozen=True)
class _Misfit:
    """How far what joints measure at coordinates q is from what is `wanted` of it."""

    mechanism: Mechanism
    parameters: Sequence[float]
    wanted: Mapping[Node, float]

    def __call__(self, q: Floats) -> float:
        at_rest = [0.0] * len(self.mechanism.speeds)
        state = state_of(self.mechanism, float, 0.0, q.tolist(), at_rest, self.parameters)
        found = np.array(state.values(list(self.wanted)), dtype=float)
        return float(np.abs(found - np.array(list(self.wanted.values()))).round(_DIGITS).sum())
