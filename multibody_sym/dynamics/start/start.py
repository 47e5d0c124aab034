"""Start: parameter values, and the coordinates and speeds at t = 0 that satisfy all constraints, in floats."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from multibody_sym.dynamics.constraints.closing import Rows, normalize
from multibody_sym.dynamics.constraints.contradiction import contradictions_named, verify_consistent
from multibody_sym.dynamics.constraints.row_numbers import CompiledRows
from multibody_sym.dynamics.constraints.row_values import verify_direction, verify_lengths, verify_values
from multibody_sym.dynamics.constraints.singular import generic_rank, verify_regular
from multibody_sym.dynamics.formalisms.forward_dynamics import verify_inertia
from multibody_sym.dynamics.start.absolute_state import absolute_state
from multibody_sym.dynamics.start.assembly import assembled_position, assembled_speeds
from multibody_sym.dynamics.start.constants import measured_rows, valued, verify_sides, with_constants, with_sides
from multibody_sym.dynamics.start.feet import has_curves, verify_fits, verify_ways, with_feet
from multibody_sym.dynamics.start.parameters import parameter_values, value_or_nan
from multibody_sym.errors import ModelError, Where, at
from multibody_sym.kinematics.loads import applied
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.mechanism.mass import GROUND
from multibody_sym.model.mechanism.mechanism import TIME, Coordinate, Mechanism, Speed
from multibody_sym.model.mechanism.parameters import INDEPENDENT
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import slot

T = TypeVar("T", Coordinate, Speed)


@dataclass(frozen=True)
class Start:
    """The state at t = 0: parameter vector (np), q (nq), u (nu).

    `held` names the coordinates and speeds that kept their declared values while constraints were closed, `assembled`
    those that were found; `shifts` tells by how much values that were given changed. `rank` of the rows: where it is
    less than the generic one, among the parameters, the start is a singular position.
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
    """Return the state at t = 0: declared values, with what the constraints need of the others.

    Coordinates marked `known` keep their values; others that are given are held in their order as long as the rest can
    close. If all are given and miss the constraints by less than 1e-6, those not marked change as little as possible;
    if none is marked, and whenever `project` asks for it, all do, in the norm of the mass matrix.
    Ropes without a length and tangents that a body carries along are measured in the assembled position.
    `compiled`: the rows of this mechanism by Programs, with which the same is found sooner.
    Raises NoSolutionError (constraints that contradict each other, by name, or do not close, with residuals by name; a
    speed that no inertia resists) and ModelError (values that are not finite or not positive).
    """
    if mechanism.relative is not None:
        return in_absolute_coordinates(mechanism, start(mechanism.relative, overrides, project=project))
    declared = parameter_values(mechanism, overrides or {})
    _verify_motions(mechanism, declared)
    q, u = _declared_state(mechanism, declared)
    if has_curves(mechanism):
        verify_ways(mechanism, state_of(mechanism, float, 0.0, q.tolist(), u.tolist(), declared))
        q = with_feet(Rows(mechanism, declared, []).motion(q, u), q)
    return _closed(mechanism, declared, q, u, measure=True, project=project, compiled=compiled)


def start_from(
    compiled: CompiledRows, parameters: Sequence[float], q: Floats, u: Floats, *, project: bool
) -> Start:
    """Return what `start` does where parameters (np), q (nq) and u (nu) are those declared, and nothing is prescribed.

    Raises as it does.
    """
    return _closed(compiled.mechanism, parameters, q, u, measure=True, project=project, compiled=compiled)


def start_beside(mechanism: Mechanism, begin: Start, values: Mapping[str, float]) -> Start:
    """Return the state beside a start, with its parameters, in which these coordinates and speeds have these values.

    The others keep those of the start as far as the constraints let them, given ones first. Raises NoSolutionError.
    """
    declared: list[Coordinate | Speed] = [*mechanism.coordinates, *mechanism.speeds]
    pairs = zip(declared, (*begin.q, *begin.u), strict=True)
    found = np.array([values.get(each.name, x) for each, x in pairs], dtype=float)
    q, u = np.split(found, [len(mechanism.coordinates)])
    normalize(mechanism, q)
    marked = replace(
        mechanism,
        coordinates=tuple(_marked(c, values) for c in mechanism.coordinates),
        speeds=tuple(_marked(s, values) for s in mechanism.speeds),
    )
    near = _closed(marked, begin.parameters, q, u, measure=False, project=False)
    # from there once more: what the way from the start leaves of its speeds is no rounding of the small ones there
    q, u = np.array(near.q, dtype=float), np.array(near.u, dtype=float)
    exact = _closed(marked, near.parameters, q, u, measure=False, project=False)
    return replace(exact, shifts={})


def _marked(each: T, values: Mapping[str, float]) -> T:
    """Return a coordinate or speed as known where it has a value here."""
    return replace(each, given=each.given or each.name in values, known=each.name in values)


def _closed(
    mechanism: Mechanism,
    declared: Sequence[float],
    q: Floats,
    u: Floats,
    *,
    measure: bool,
    project: bool,
    compiled: CompiledRows | None = None,
) -> Start:
    """Return the state that satisfies all constraints, from a declared one; with constants measured there if asked."""
    measured = measured_rows(mechanism) if measure else frozenset()
    active = [k for k in range(len(mechanism.rows)) if k not in measured]
    rows = Rows(mechanism, with_sides(mechanism, declared, q) if measure else declared, active, compiled=compiled)
    _verify_inertia(rows, q, u)
    if any(row.declared_length is not None for row in mechanism.rows):
        verify_lengths(rows.motion(q, u))
    with contradictions_named(rows, q, u):
        position = assembled_position(rows, q, project=project)
        # a guess may lie on the other side of a wheel
        if measure and (there := with_sides(mechanism, declared, position.values)) != list(rows.parameters):
            rows = replace(rows, parameters=there)
            position = assembled_position(rows, q, project=project)
            verify_sides(mechanism, there, position.values)
    _verify_values(rows, position.values, u)
    if rows.active:
        _verify_inertia(rows, position.values, u)
    parameters = with_constants(mechanism, declared, position.values) if measure else list(declared)
    every = Rows(mechanism, parameters, range(len(mechanism.rows)), compiled=compiled)
    with contradictions_named(every, position.values, u):
        speeds = assembled_speeds(every, position.values, u, project=project)
    rank = 0
    if mechanism.rows:
        rank, most = _ranks(every, position.values, speeds.values)
        parameters = mechanism.parameters.changed(parameters, {INDEPENDENT: float(most)})
    _verify_forces(every, position.values, speeds.values)
    return Start(
        tuple(parameters),
        tuple(position.values.tolist()),
        tuple(speeds.values.tolist()),
        (*position.held, *speeds.held),
        (*position.found, *speeds.found),
        {**position.shifts, **speeds.shifts},
        rank,
    )


def _ranks(rows: Rows, q: Floats, u: Floats) -> tuple[int, int]:
    """Return how many rows are independent at a start, and nearby. Raises NoSolutionError where some contradict others.

    Those that define forces are counted.
    """
    here, generic = generic_rank(rows, q)
    verify_consistent(rows, q, u, generic)
    defining = len(rows.mechanism.rows) - len(rows.active)
    return here + defining, generic + defining


def in_absolute_coordinates(mechanism: Mechanism, joints: Start) -> Start:
    """Return the start of a mechanism that is known in the coordinates of the joints, in which it is declared."""
    assert mechanism.relative is not None
    entries = zip(mechanism.relative.parameters, joints.parameters, strict=True)
    values = {entry.name: value for entry, value in entries}
    parameters = [values.get(entry.name, 0.0) for entry in mechanism.parameters]
    relative = Rows(mechanism.relative, joints.parameters, [])
    motion = relative.motion(np.array(joints.q, dtype=float), np.array(joints.u, dtype=float))
    q, u = absolute_state(mechanism, motion, parameters)
    parameters = with_constants(mechanism, parameters, q)
    return ranked(
        mechanism, replace(joints, parameters=tuple(parameters), q=tuple(q.tolist()), u=tuple(u.tolist()), rank=0)
    )


def ranked(mechanism: Mechanism, begin: Start) -> Start:
    """Return a start with the rank of the rows, those that define forces counted, and of the same nearby.

    Rows of what holds one way only may depend on each other for an instant: which of them hold on, their laws decide.
    """
    if not mechanism.rows:
        return begin
    defining = sum(not row.restricts for row in mechanism.rows)
    q = np.array(begin.q, dtype=float)
    rank, generic = generic_rank(Rows(mechanism, begin.parameters, range(len(mechanism.rows))), q)
    if rank < generic and mechanism.mode is not None:
        one_way = {row.name for element in mechanism.one_way for row in element.rows}
        both_ways = [k for k, row in enumerate(mechanism.rows) if row.name not in one_way]
        own, own_generic = generic_rank(Rows(mechanism, begin.parameters, both_ways), q)
        generic = rank + own_generic - own
    parameters = mechanism.parameters.changed(begin.parameters, {INDEPENDENT: float(generic + defining)})
    return replace(begin, parameters=tuple(parameters), rank=rank + defining)


def verify_regular_start(mechanism: Mechanism, begin: Start, called: str = "the start") -> None:
    """Raise NoSolutionError where rows depend on each other in a state that are independent beside it, by name."""
    if mechanism.rows:
        rows = Rows(mechanism, begin.parameters, range(len(mechanism.rows)))
        generic = mechanism.parameters.independent_rows(begin.parameters)
        verify_regular(rows, np.array(begin.q, dtype=float), begin.rank, generic, called)


def _verify_motions(mechanism: Mechanism, parameters: Sequence[float]) -> None:
    """Raise ModelError where a prescribed motion, its rate or its acceleration has no value at the start."""
    values = {TIME: 0.0, **{slot("parameters", i): value for i, value in enumerate(parameters)}}
    for body in mechanism.bodies:
        place = ("bodies",) if body.joint_name == GROUND else ("joints",)
        for given in body.given:
            with at(*place, body.joint_name, "motion"), valued():
                evaluate_float(given or (), values)


def _verify_values(rows: Rows, q: Floats, u: Floats) -> None:
    """Raise ModelError naming the first row that has no value; finite numbers tell nothing of points that coincide."""
    of_all = rows.mechanism.rows
    if of_all and (rows.numbers(q, u) is None or any(row.line for row in of_all)):
        verify_values(rows.motion(q, u))


def _verify_inertia(rows: Rows, q: Floats, u: Floats) -> None:
    found = rows.numbers(q, u)
    if found is not None and found.has_inertia:
        return
    motion = rows.motion(q, u)
    try:
        with valued():
            verify_inertia(motion)
    except ModelError:
        verify_values(motion)
        raise


def _verify_forces(rows: Rows, q: Floats, u: Floats) -> None:
    if rows.mechanism.loads or any(body.is_foot for body in rows.mechanism.bodies):
        motion = rows.motion(q, u)
        _verify_loads(motion)
        verify_fits(motion)


def _verify_loads(motion: Motion) -> None:
    for load in motion.mechanism.loads:
        with at(*load.path):
            verify_direction(motion, load)
            with valued():
                applied(motion, [load])


# --- declared state ------------------------------------------------------------------------------------------------


def _declared_state(mechanism: Mechanism, parameters: Sequence[float]) -> tuple[Floats, Floats]:
    """Return q with unit quaternions, and u, as declared."""
    values = {slot("parameters", i): value for i, value in enumerate(parameters)}
    found = []
    declared: Sequence[Coordinate | Speed] = (*mechanism.coordinates, *mechanism.speeds)
    for named in declared:
        value = value_or_nan(named.initial, values)
        if not math.isfinite(value):
            where = Where(path=("joints", named.joint, "initial"))
            raise ModelError(f"the initial value of {named.name} is not finite", where=where, number="M119")
        found.append(value)
    q, u = np.split(np.array(found, dtype=float), [len(mechanism.coordinates)])
    normalize(mechanism, q)
    return q, u
