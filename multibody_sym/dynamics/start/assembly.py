"""Assembly: coordinates with phi = 0 and speeds with H u = -phi_t from declared ones, in floats.

Which declared values are held is one rule for both: those marked `known`, and of the others that were given, in their
order, those that leave the rest free to close; with nothing marked, all that were given if they close. Where all were
given and the rows nearly close, those that are not marked change as little as possible instead. None are held, and the
change is the smallest in the norm of the mass matrix, where that is asked for, or nothing is marked there.

Where nothing closes, the elements are named for whose rows together no positions are found: what is left when those
that change nothing are out.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from typing import Final, NamedTuple

import numpy as np

from multibody_sym.dynamics.closing import (
    CLOSED,
    ConstraintRows,
    Residual,
    best_guess,
    closed_from,
    generic_jacobian,
    least_change,
    least_norm,
    suffice,
)
from multibody_sym.dynamics.start.parameters import verify_values
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.mechanics.mechanism import Mechanism, TreeBody
from multibody_sym.mechanics.motion import Motion, state_of
from multibody_sym.mechanics.points import angular_velocity, position, velocity
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.model.bodies import GROUND, Pose
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.scalars.vectors import rotation_quaternion

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
