"""Start: parameter values, and the coordinates and speeds at t = 0 that satisfy all constraints, in floats.

In: a Mechanism, values in place of declared ones. Out: a Start, or the error of what has no value or does not close;
and random states around a start, at which routes and theorems are compared.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Final, TypeVar

import numpy as np

from multibody_sym.dynamics.closing import ConstraintRows, closed_near, displaced, normalize
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics, verify_inertia
from multibody_sym.dynamics.programs.system import CompiledRows
from multibody_sym.dynamics.start.assembly import absolute_state, assembled_position, assembled_speeds
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
from multibody_sym.mechanics.mechanism import INDEPENDENT, TIME, Coordinate, Mechanism, Speed
from multibody_sym.mechanics.motion import Motion, State, state_of
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.model.bodies import GROUND
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import slot
from multibody_sym.scalars.rank import GROWING, ROUNDED, least_squares, worth

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
    """Return a coordinate or speed as known where it has a value here."""
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
    """Return q and u as declared, with unit quaternions."""
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
