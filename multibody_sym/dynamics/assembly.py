"""Assembly: coordinates with phi = 0 and speeds with H u = -phi_t from declared ones, in floats.

Which declared values are held is one rule for both: those marked `known`; without marks those that were given, in
their order, as long as the rest can close; if all were given, none, and the change is the smallest in the norm of the
mass matrix.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from multibody_sym.dynamics.block_ldl import tree_factors
from multibody_sym.dynamics.composite_body import mass_matrix
from multibody_sym.dynamics.equations import MassFactors
from multibody_sym.dynamics.factorization import factorized
from multibody_sym.dynamics.forward_dynamics import UNDEFINED
from multibody_sym.dynamics.massless import completed_matrix, massless_speeds
from multibody_sym.errors import ModelError, NoSolutionError, Where
from multibody_sym.kinematics.motion import Motion, coordinate_rates, motion_of
from multibody_sym.kinematics.relative import direction
from multibody_sym.kinematics.rows import RowMotion, row_motions
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.mechanism import AngleRow, Mechanism, TreeBody, is_holonomic
from multibody_sym.program.solve import solve
from multibody_sym.scalars.vectors import dot

Floats = npt.NDArray[np.float64]

NEAR: Final = 1e-6
"""Values that are all given are projected onto the rows when they miss them by less than this."""
_CLOSED: Final = 1e-10
_STEPS: Final = 60
_HALVINGS: Final = 8
_SLOW: Final = 0.95
_SLOW_STEPS: Final = 4
"""Newton's method gives up where so many steps on end leave more than this part of phi."""
_RESTARTS: Final = 6
_LARGEST_STEP: Final = 1.0
_SEED: Final = 1
_DAMPING: Final = 1e-2
_DEPENDENT: Final = 1e-8


@dataclass(frozen=True)
class Assembled:
    """Coordinates or speeds that satisfy the rows; names of those held and found; the largest change of a given one."""

    values: Floats
    held: tuple[str, ...] = ()
    found: tuple[str, ...] = ()
    shift: float = 0.0


@dataclass(frozen=True)
class Rows:
    """Those rows of a mechanism that are to be closed, for given parameters, at the start or another time."""

    mechanism: Mechanism
    parameters: Sequence[float]
    active: Sequence[int]
    t: float = 0.0

    def motion(self, q: Floats, u: Floats) -> Motion:
        """Return the motion of all bodies."""
        state = state_of(self.mechanism, float, self.t, q.tolist(), u.tolist(), self.parameters)
        return motion_of(self.mechanism, state)

    def of(self, motion: Motion) -> list[RowMotion]:
        """Return the active rows."""
        rows = row_motions(motion) if self.active else []
        return [rows[k] for k in self.active]

    def holonomic(self) -> Rows:
        """Return those of the rows that restrict positions."""
        every = self.mechanism.rows
        return replace(self, active=[k for k in self.active if is_holonomic(every[k])])

    def at(self, q: Floats) -> tuple[Floats, Floats] | None:
        """Return phi (s) and H (s x n) of holonomic rows at rest, None where they have no value."""
        try:
            rows = self.of(self.motion(q, np.zeros(len(self.mechanism.speeds))))
        except UNDEFINED:
            return None
        phi, jacobian = np.array([row.phi for row in rows], dtype=float), self.jacobian(rows)
        return (phi, jacobian) if np.isfinite(phi).all() and np.isfinite(jacobian).all() else None

    def jacobian(self, rows: Iterable[RowMotion]) -> Floats:
        """Return H (s x n) of rows."""
        return np.array([row.jacobian for row in rows], dtype=float).reshape(-1, len(self.mechanism.speeds))

    def failure(self, what: str, residuals: Floats | None) -> NoSolutionError:
        """Return the error that names the residuals of rows which cannot be closed."""
        names = [self.mechanism.rows[k].name for k in self.active]
        missed = ["no position was found at which they have a value"]
        if residuals is not None:
            pairs = zip(names, residuals, strict=True)
            missed = [f"{name} misses by {abs(x):.6g}" for name, x in pairs if abs(x) > _CLOSED]
        return NoSolutionError(f"{what}: {', '.join(missed)}", where=Where(path=("constraints",)))


class _Item(NamedTuple):
    """What is held or found together: a coordinate or speed, or a quaternion; its places in q or u, and its speeds."""

    names: tuple[str, ...]
    places: tuple[int, ...]
    speeds: tuple[int, ...]
    given: bool
    known: bool


Solver = Callable[[Floats, Floats], Floats]
Close = Callable[[Sequence[int], bool], Floats | None]
"""Find values with these speeds free; weighted by the mass matrix or not. None where the rows do not close."""


# --- positions -----------------------------------------------------------------------------------------------------


def assembled_position(rows: Rows, q: Floats) -> Assembled:
    """Return coordinates with phi = 0, from declared ones. Raises NoSolutionError with the residuals by name."""
    rows = rows.holonomic()
    if not rows.active:
        return Assembled(q)
    start = rows.at(q)
    phi = start[0] if start is not None else np.full(len(rows.active), math.inf)

    def close(free: Sequence[int], weighted: bool) -> Floats | None:
        return _closed(rows, q, free, weighted)

    found = _chosen(_position_items(rows.mechanism), _generic_jacobian(rows, q), phi, close)
    if found is None:
        raise rows.failure("the start values do not satisfy the constraints", start[0] if start is not None else None)
    return _compared(q, *found)


def _generic_jacobian(rows: Rows, q: Floats) -> Floats | None:
    """Return |H| beside q, where columns that vanish at q itself (a rod along an axis) do not."""
    count = len(rows.mechanism.speeds)
    near = rows.at(moved(rows.mechanism, q, np.random.default_rng(_SEED).uniform(0.01, 0.1, count)))
    return None if near is None else near[1]


def _position_items(mechanism: Mechanism) -> list[_Item]:
    items = []
    for body in mechanism.bodies:
        for places, speeds in _groups(body):
            declared = [mechanism.coordinates[i] for i in places]
            names = tuple(c.name for c in declared)
            items.append(_Item(names, places, speeds, declared[0].given, declared[0].known))
    return items


def _groups(body: TreeBody) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Return the coordinates that can be held on their own, each with its speeds; a quaternion is held as a whole."""
    groups: list[tuple[tuple[int, ...], tuple[int, ...]]] = []
    groups += [((i,), (k,)) for i, k in zip(body.step_q, body.step_u, strict=True)]
    return [*groups, (body.quaternion, body.u[-3:])] if body.ball else groups


def _closed(rows: Rows, start: Floats, free: Sequence[int], weighted: bool) -> Floats | None:
    """Return coordinates with phi = 0 by Newton's method on the free speeds, from other guesses if the first fails."""
    rng = np.random.default_rng(_SEED)
    q = start
    for restart in range(_RESTARTS + 1 if len(free) >= len(rows.active) else 1):
        if restart:
            change = np.zeros(len(rows.mechanism.speeds))
            change[list(free)] = rng.normal(size=len(free)) * restart / _RESTARTS
            q = moved(rows.mechanism, start, change)
        found = _newton(rows, q, free, weighted)
        if found is not None and not _turned_over(rows, found):
            return found
    return None


def _turned_over(rows: Rows, q: Floats) -> bool:
    """Return whether a cut joint's frames satisfy its rows with an axis that they share pointing opposite ways."""
    angles = [row for row in (rows.mechanism.rows[k] for k in rows.active) if isinstance(row, AngleRow)]
    if not angles:
        return False
    motion = rows.motion(q, np.zeros(len(rows.mechanism.speeds)))
    for row in angles:
        if row.shared is not None and dot(*(direction(motion, frame, row.shared) for frame in row.frames)) < 0.0:
            return True
    return False


def closed_near(rows: Rows, q: Floats) -> Floats | None:
    """Return coordinates with phi = 0 near q, None where Newton's method finds none."""
    rows = rows.holonomic()
    return _newton(rows, q, range(len(rows.mechanism.speeds)), weighted=False) if rows.active else q


def _newton(rows: Rows, q: Floats, free: Sequence[int], weighted: bool) -> Floats | None:
    here, slow = rows.at(q), 0
    for _ in range(_STEPS):
        if here is None:
            return None
        phi, jacobian = here
        closed, size = _is_closed(phi, jacobian, q), float(np.linalg.norm(phi))
        step = _least_change(rows, q, jacobian, -phi, free, weighted, _damped)
        step *= min(1.0, _LARGEST_STEP / max(float(np.abs(step).max(initial=0.0)), _LARGEST_STEP))
        ahead = _line_search(rows, q, step, size)
        slow = slow + 1 if ahead is None or float(np.linalg.norm(ahead[1][0])) > _SLOW * size else 0
        if ahead is None or slow >= _SLOW_STEPS:
            return q if closed else None
        q, here = ahead
    return None


def _line_search(rows: Rows, q: Floats, step: Floats, size: float) -> tuple[Floats, tuple[Floats, Floats]] | None:
    """Return the farthest of ever smaller steps that brings phi down, None where none does."""
    for halving in range(_HALVINGS):
        ahead = moved(rows.mechanism, q, step / 2**halving)
        there = rows.at(ahead)
        if there is not None and float(np.linalg.norm(there[0])) < size:
            return ahead, there
    return None


def _is_closed(phi: Floats, jacobian: Floats, values: Floats) -> bool:
    """Return whether phi is small beside what the row makes of values of their own size."""
    sizes = np.abs(jacobian).sum(axis=1) * max(1.0, float(np.abs(values).max(initial=0.0)))
    return bool((np.abs(phi) <= _CLOSED * np.maximum(1.0, sizes)).all())


def moved(mechanism: Mechanism, q: Floats, change: Floats) -> Floats:
    """Return q moved by a small change of the speeds' integrals, quaternions normalised."""
    found: Floats = q + np.array(coordinate_rates(mechanism, q.tolist(), change.tolist()), dtype=float)
    normalize(mechanism, found)
    return found


def normalize(mechanism: Mechanism, q: Floats) -> None:
    """Give every quaternion in q unit length. Raises ModelError naming the joint of one that is zero."""
    for body in mechanism.bodies:
        if body.ball:
            places = list(body.quaternion)
            length = float(np.linalg.norm(q[places]))
            if length == 0.0:
                where = Where(path=("joints", body.joint_name, "initial", "q"))
                raise ModelError("the quaternion is zero; no rotation is [1, 0, 0, 0]", where=where)
            q[places] /= length


# --- speeds --------------------------------------------------------------------------------------------------------


def assembled_speeds(rows: Rows, q: Floats, u: Floats) -> Assembled:
    """Return speeds with H u = -phi_t, from declared ones. Raises NoSolutionError with the residuals by name."""
    if not rows.active:
        return Assembled(u)
    moving = rows.of(rows.motion(q, u))
    phidot, jacobian = np.array([row.phidot for row in moving], dtype=float), rows.jacobian(moving)

    def close(free: Sequence[int], weighted: bool) -> Floats | None:
        change = _least_change(rows, q, jacobian, -phidot, free, weighted, _exact)
        found: Floats = np.add(u, change)
        return found if _is_closed(phidot + jacobian @ change, jacobian, u) else None

    chosen = _chosen(_speed_items(rows.mechanism), jacobian, phidot, close)
    if chosen is None:
        raise rows.failure("the initial speeds do not satisfy the constraints", phidot)
    return _compared(u, *chosen)


def _speed_items(mechanism: Mechanism) -> list[_Item]:
    known = {c.joint for c in mechanism.coordinates if c.known}
    return [_Item((s.name,), (k,), (k,), s.given, s.given and s.joint in known) for k, s in enumerate(mechanism.speeds)]


# --- both ----------------------------------------------------------------------------------------------------------


def _chosen(
    items: Sequence[_Item], jacobian: Floats | None, residual: Floats, close: Close
) -> tuple[Floats, Sequence[_Item], Sequence[_Item]] | None:
    """Return closed values, the items held, and those that could have moved; None where nothing closes."""
    concerned = [item for item in items if jacobian is None or np.abs(jacobian[:, list(item.speeds)]).max() > 0]
    given = [item for item in concerned if item.given]
    known = [item for item in concerned if item.known]

    def attempt(held: Sequence[_Item]) -> Floats | None:
        fixed = {k for item in held for k in item.speeds}
        free = [k for item in items for k in item.speeds if k not in fixed]
        return close(free, not held)

    if known or (given and len(given) == len(concerned)):
        near = bool((np.abs(residual) <= NEAR).all())
        values = attempt(known) if known or near else None
        return None if values is None else (values, known, concerned)
    held, values = given, attempt(given)
    if values is None and given:
        held, values = _held_one_by_one(given, attempt)
    return None if values is None else (values, held, concerned)


def _held_one_by_one(
    given: Sequence[_Item], attempt: Callable[[Sequence[_Item]], Floats | None]
) -> tuple[list[_Item], Floats | None]:
    held: list[_Item] = []
    values = attempt(held)
    for item in given if values is not None else ():
        trial = attempt([*held, item])
        if trial is not None:
            held, values = [*held, item], trial
    return held, values


def _compared(
    declared: Floats, values: Floats, held: Sequence[_Item], concerned: Sequence[_Item]
) -> Assembled:
    found = [item for item in concerned if item not in held]
    changes = [float(np.abs(values - declared)[list(item.places)].max()) for item in found if item.given]
    names = [tuple(name for item in part for name in item.names) for part in (held, found)]
    return Assembled(values, names[0], names[1], max(changes, default=0.0))


def _weights(motion: Motion) -> MassFactors:
    if massless_speeds(motion.mechanism):
        return factorized(completed_matrix(motion, mass_matrix(motion), row_motions(motion)))
    return tree_factors(motion)


def _least_change(
    rows: Rows, q: Floats, jacobian: Floats, wanted: Floats, free: Sequence[int], weighted: bool, solver: Solver
) -> Floats:
    """Return the smallest change of the free speeds with H change = wanted, as `solver` finds it."""
    change = np.zeros(len(rows.mechanism.speeds))
    if weighted:
        factors = _weights(rows.motion(q, change))
        matrix = np.array([factors.weighted(row) for row in jacobian.tolist()], dtype=float)
        return np.array(factors.unweighted(solver(matrix, wanted).tolist()), dtype=float)
    if free:
        change[list(free)] = solver(jacobian[:, list(free)], wanted)
    return change


def _exact(matrix: Floats, wanted: Floats) -> Floats:
    """Return the smallest x with A x = r over rows that are independent to rounding."""
    return solve(matrix, wanted).solution


def _damped(matrix: Floats, wanted: Floats) -> Floats:
    """Return A^T (A A^T + mu E)^-1 r with mu -> 0 as |r|^2, over rows of unit length (Levenberg, Marquardt).

    Rows that are dependent where they hold are independent beside it, and would lead Newton's method astray.
    """
    lengths = np.linalg.norm(matrix, axis=1)
    lengths[lengths == 0.0] = 1.0
    u, sizes, v = np.linalg.svd(matrix / lengths[:, None], full_matrices=False)
    damping = min(_DAMPING, float(wanted @ wanted))
    gains = np.where(sizes > _DEPENDENT, sizes / (sizes * sizes + damping + (sizes == 0.0)), 0.0)
    step: Floats = v.T @ (gains * (u.T @ (wanted / lengths)))
    return step
