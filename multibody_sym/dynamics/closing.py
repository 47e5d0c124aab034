"""Closing: coordinates displaced by Newton's method until rows hold, in floats.

In: a Mechanism's rows, parameters, coordinates to begin with. Out: coordinates with phi = 0, or None.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import Final, NamedTuple, TypeVar

import numpy as np

from multibody_sym.dynamics.formalisms.articulated_body import tree_factors
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.formalisms.constrained import correction, in_floats
from multibody_sym.dynamics.formalisms.equations import MassFactors, completed_matrix, massless_speeds
from multibody_sym.dynamics.programs.system import ClosingRows, CompiledRows
from multibody_sym.errors import ModelError, Where
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion, coordinate_rates, motion_of, state_of
from multibody_sym.mechanics.points import direction, position
from multibody_sym.mechanics.row_kinematics import RowMotion, constraint_jacobian, power_terms, row_motions
from multibody_sym.mechanics.row_records import AngleRow, ExpressionRow
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, UNDEFINED, Floats
from multibody_sym.scalars.rank import DRAWN, SLOPES, clear_least_norm, damped_solution, least_squares, rank
from multibody_sym.scalars.vectors import dot, factorize

Solver = Callable[[Floats, Floats], Floats]
Found = TypeVar("Found")

CLOSED: Final = 1e-13
"""Rows are closed if they are missed by less than this part of their size, ..."""
WRITTEN: Final = 1e-11
"""... or this one, where no motion changes it: numbers of twelve digits leave so much."""
_STEPS: Final = 60
_HALVINGS: Final = 8
_SLOW: Final = 0.95
_SLOW_STEPS: Final = 4
"""Newton's method gives up where so many steps on end leave more than this part of phi."""
_RESTARTS: Final = 12
_SPREAD: Final = 0.2
"""The guesses of each restart lie by this much farther from the first."""
_LARGEST_STEP: Final = 1.0
_TRIALS: Final = 200
_SOFTEST: Final = 1e-3
_FELT: Final = 1e-13
_STIFFEST: Final = 1e12
_TINY: Final = 1e-9
_SEED: Final = 1
_DAMPING: Final = 1e-2


class Residual(NamedTuple):
    """Residuals of rows (s), and the sizes of their terms (s), which tell residuals from rounding."""

    residuals: Floats
    sizes: Floats

    def within(self, part: float) -> bool:
        """Return whether every row is missed by no more than this part of its size."""
        return bool((np.abs(self.residuals) <= part * self.sizes).all())

    def closed(self, jacobian: Floats) -> bool:
        """Return whether rows are closed, but for rounding in the file that no change by their H (s x n) undoes."""
        if self.within(CLOSED) or not self.within(WRITTEN):
            return self.within(CLOSED)
        reached = jacobian @ least_squares(jacobian, self.residuals, SLOPES)
        return Residual(reached, self.sizes).within(CLOSED)


class Moving(NamedTuple):
    """phidot (s), H (s x n) and the sizes of the terms of phidot (s) of rows at a state."""

    phidot: Floats
    jacobian: Floats
    terms: Floats


@dataclass(frozen=True)
class ConstraintRows:
    """The `active` rows of a mechanism are to be closed, for given parameters, at the start or another time.

    Rows that define forces are not active: they close nothing. Their numbers come from the kinematics of all bodies in
    Python, or from `compiled` Programs.
    """

    mechanism: Mechanism
    parameters: Sequence[float]
    active: Sequence[int]
    t: float = 0.0
    compiled: CompiledRows | None = None

    def __post_init__(self) -> None:
        if not all(row.restricts for row in self.mechanism.rows):
            restricting = [k for k in self.active if self.mechanism.rows[k].restricts]
            object.__setattr__(self, "active", restricting)

    def motion(self, q: Floats, u: Floats) -> Motion:
        state = state_of(self.mechanism, float, self.t, q.tolist(), u.tolist(), self.parameters)
        return motion_of(self.mechanism, state)

    @cached_property
    def at_rest(self) -> Callable[[Floats], Motion]:
        """The motion at rest in a position; the last one is remembered."""
        speeds = np.zeros(len(self.mechanism.speeds))
        return _remember_last(lambda q: self.motion(q, speeds))

    def of(self, motion: Motion) -> list[RowMotion]:
        rows = row_motions(motion) if self.active else []
        return [rows[k] for k in self.active]

    def holonomic(self) -> ConstraintRows:
        every = self.mechanism.rows
        return replace(self, active=[k for k in self.active if every[k].is_holonomic])

    @property
    def acting(self) -> int:
        """How many of the active rows do not vanish everywhere; all of them without Programs."""
        if self.compiled is None:
            return len(self.active)
        return int(self.compiled.acting[list(self.active)].sum())

    def numbers(self, q: Floats, u: Floats | None = None) -> ClosingRows | None:
        """Return all rows in numbers by compiled Programs; None without these, and where some have no value."""
        if self.compiled is None:
            return None
        speeds = np.zeros(len(self.mechanism.speeds)) if u is None else u
        found = self.compiled.at(self.t, q, speeds, self.parameters)
        return found if found.finite else None

    @cached_property
    def at(self) -> Callable[[Floats], tuple[Floats, Floats] | None]:
        """phi (s) and H (s x n) of holonomic rows at rest in a position, None without values; the last one is kept."""
        return _remember_last(self._at)

    def _at(self, q: Floats) -> tuple[Floats, Floats] | None:
        if self.compiled is not None:
            found = self.numbers(q)
            return None if found is None else (found.phi[list(self.active)], found.jacobian[list(self.active)])
        try:
            rows = self.of(self.at_rest(q))
        except UNDEFINED:
            return None
        phi, jacobian = np.array([row.phi for row in rows], dtype=float), self.jacobian(rows)
        return (phi, jacobian) if np.isfinite(phi).all() and np.isfinite(jacobian).all() else None

    def moving(self, q: Floats, u: Floats) -> Moving:
        found = self.numbers(q, u)
        if found is not None:
            here = list(self.active)
            return Moving(found.phidot[here], found.jacobian[here], found.power[here])
        motion = self.motion(q, u)
        rows = self.of(motion)
        phidot = np.array([row.phidot for row in rows], dtype=float)
        return Moving(phidot, self.jacobian(rows), np.array(power_terms(motion, rows), dtype=float))

    def jacobian(self, rows: Sequence[RowMotion]) -> Floats:
        """Return H (s x n) of rows, without the rounding of rows that move nothing."""
        return constraint_jacobian(rows).reshape(len(rows), len(self.mechanism.speeds))

    def missed(self, q: Floats, least: float = 0.0) -> Residual | None:
        """Return phi of holonomic rows with the model's length as their size, or |H| by lengths for expressions.

        The length is the farthest distance of a body or named point from the origin, `least` (m) or more; a direction
        has size one. None where the rows have no value.
        """
        here = self.at(q)
        if here is None:
            return None
        length = max(least, self.length(q))
        sizes = np.abs(here[1]) @ np.array([length if speed.unit == "m/s" else 1.0 for speed in self.mechanism.speeds])
        for j, row in enumerate(self.mechanism.rows[k] for k in self.active):
            if not isinstance(row, ExpressionRow):
                sizes[j] = 1.0 if isinstance(row, AngleRow) else length
        return Residual(here[0], sizes)

    def length(self, q: Floats) -> float:
        """Return how far the farthest body or named point is from the origin."""
        found = self.numbers(q)
        if found is not None:
            return found.length
        motion = self.at_rest(q)
        points = [*(position(motion, x) for x in self.mechanism.markers.values()), *(p for _, p in motion.poses)]
        return float(np.linalg.norm(np.array(points, dtype=float), axis=1).max(initial=0.0))


def _remember_last(find: Callable[[Floats], Found]) -> Callable[[Floats], Found]:
    found = lru_cache(maxsize=1)(lambda key: find(np.frombuffer(key)))
    return lambda q: found(q.tobytes())


def closed_from(rows: ConstraintRows, start: Floats, free: Sequence[int], weighted: bool) -> Floats | None:
    """Return coordinates with phi = 0 by Newton's method on the free speeds, from other guesses if the first fails."""
    rng = np.random.default_rng(_SEED)
    tries = [(True, 0.0), (False, 0.0)] if weighted else [(False, 0.0)]
    jacobian = generic_jacobian(rows, start)
    every = range(len(rows.mechanism.speeds))
    if free and (jacobian is None or suffice(jacobian, free, every)):
        tries += [(False, _SPREAD * k) for k in range(1, _RESTARTS + 1)]
    for by_mass, spread in tries:
        change = np.zeros(len(rows.mechanism.speeds))
        change[list(free)] = spread * rng.normal(size=len(free))
        found = _newton(rows, displaced(rows.mechanism, start, change), free, by_mass)
        if found is not None and not _turned_over(rows, found):
            return found
    return None


def suffice(jacobian: Floats, free: Sequence[int], among: Sequence[int]) -> bool:
    """Return whether the free speeds alone give rows, by a `jacobian`, all rates that the speeds `among` them give."""
    if len(free) == len(among):
        return True
    of_free, of_all = (rank(jacobian[:, list(which)], DRAWN) for which in (free, among))
    return of_free == of_all


def generic_jacobian(rows: ConstraintRows, q: Floats) -> Floats | None:
    """Return H beside q, where columns do not vanish that do so at q itself (a rod along an axis)."""
    count = len(rows.mechanism.speeds)
    near = rows.at(displaced(rows.mechanism, q, np.random.default_rng(_SEED).uniform(0.01, 0.1, count)))
    return None if near is None else near[1]


def _turned_over(rows: ConstraintRows, q: Floats) -> bool:
    """Return whether the axis that a cut joint's frames share points opposite ways in them, though its rows hold."""
    angles = [row for row in (rows.mechanism.rows[k] for k in rows.active) if isinstance(row, AngleRow)]
    if not angles:
        return False
    found = rows.numbers(q)
    if found is not None:
        return bool((found.aligned[list(rows.active)] < 0.0).any())
    motion = rows.at_rest(q)
    for row in angles:
        if row.shared is not None and dot(*(direction(motion, frame, row.shared) for frame in row.frames)) < 0.0:
            return True
    return False


def closed_near(rows: ConstraintRows, q: Floats) -> Floats | None:
    """Return coordinates with phi = 0 near q, None where Newton's method finds none, or joints turned over."""
    rows = rows.holonomic()
    found = _newton(rows, q, range(len(rows.mechanism.speeds)), weighted=False) if rows.active else q
    return None if found is None or _turned_over(rows, found) else found


def _newton(rows: ConstraintRows, q: Floats, free: Sequence[int], weighted: bool) -> Floats | None:
    """Return coordinates with phi = 0 by Newton's method from q on, None where it does not converge."""
    here, slow = rows.at(q), 0
    begun = 0.0 if here is None else rows.length(q)  # all may come to the origin, where the model has no length
    for _ in range(_STEPS):
        if here is None:
            return None
        phi, jacobian = here
        size = float(np.linalg.norm(phi))
        step = least_change(rows, q, jacobian, -phi, free, weighted, _damped_step)
        if _is_rounding(step):  # a phi near zero could be followed far below its rounding
            missed = rows.missed(q, begun)
            if missed is not None and missed.within(EPSILON):
                return q
        step *= min(1.0, _LARGEST_STEP / max(float(np.abs(step).max(initial=0.0)), _LARGEST_STEP))
        for halving in range(1 if _is_rounding(step) else _HALVINGS):  # a part of rounding is no better than the whole
            ahead = displaced(rows.mechanism, q, step / 2**halving)
            there = rows.at(ahead)
            if there is not None and float(np.linalg.norm(there[0])) < size:
                break
        else:
            break
        slow = slow + 1 if float(np.linalg.norm(there[0])) > _SLOW * size else 0
        if slow >= _SLOW_STEPS:
            break
        q, here = ahead, there
    missed = None if here is None else rows.missed(q, begun)
    return q if missed is not None and here is not None and missed.closed(here[1]) else None


def _is_rounding(step: Floats) -> bool:
    return float(np.abs(step).max(initial=0.0)) < _TINY


def least_missed(rows: ConstraintRows, q: Floats, free: Sequence[int] | None = None) -> Floats | None:
    """Return coordinates near q, displaced by the free speeds (all), at which |phi| is least; None without values.

    Source: Levenberg, Marquardt.
    """
    here, stiffness = rows.at(q), _SOFTEST
    places = slice(None) if free is None else list(free)
    for _ in range(_TRIALS):
        if here is None:
            return None
        phi, jacobian = here[0], here[1][:, places]
        square = jacobian.T @ jacobian
        felt = max(stiffness, _FELT * float(np.diagonal(square).max(initial=0.0)))  # or rounding loses it
        step = np.zeros(len(rows.mechanism.speeds))
        step[places] = np.linalg.solve(square + felt * np.eye(len(square)), -jacobian.T @ phi)
        ahead = displaced(rows.mechanism, q, step)
        if (ahead == q).all():  # and so are stiffer steps
            break
        there = rows.at(ahead)
        if there is not None and float(there[0] @ there[0]) < float(phi @ phi):
            q, here, stiffness = ahead, there, 0.1 * stiffness
        else:
            stiffness = 10.0 * felt
        if stiffness > _STIFFEST:
            break
    return q


def best_guess(rows: ConstraintRows, q: Floats, unknown: Sequence[int]) -> Floats:
    """Return q displaced by the `unknown` speeds to where the rows are missed least, by searches from all around.

    A position in which a joint is turned over is taken for want of others: its rows are missed as little.
    """
    rng, count = np.random.default_rng(_SEED), len(rows.mechanism.speeds)
    found, least = q, (True, math.inf)
    for number in range(_RESTARTS):
        change = np.zeros(count)
        change[list(unknown)] = (number > 0) * rng.uniform(-math.pi, math.pi, len(unknown))
        near = least_missed(rows, displaced(rows.mechanism, q, change), unknown)
        here = None if near is None else rows.at(near)
        if near is None or here is None:
            continue
        missed = _turned_over(rows, near), float(here[0] @ here[0])
        if missed < least:
            found, least = near, missed
    return found


def displaced(mechanism: Mechanism, q: Floats, change: Floats) -> Floats:
    """Return q displaced by a small change of the speeds' integrals, quaternions normalised."""
    found: Floats = q + np.array(coordinate_rates(mechanism, q.tolist(), change.tolist()), dtype=float)
    normalize(mechanism, found)
    return found


def normalize(mechanism: Mechanism, q: Floats) -> None:
    """Give every quaternion in q unit length. Raises ModelError naming the joint of one that is zero."""
    for body in mechanism.bodies:
        for places in map(list, body.quaternions):
            length = float(np.linalg.norm(q[places]))
            if length == 0.0:
                where = Where(path=("joints", body.joint_name, "initial", "q"))
                raise ModelError("the quaternion is zero; no rotation is [1, 0, 0, 0]", where=where, number="M119")
            q[places] /= length


def least_change(
    rows: ConstraintRows,
    q: Floats,
    jacobian: Floats,
    wanted: Floats,
    free: Sequence[int],
    weighted: bool,
    solver: Solver,
) -> Floats:
    """Return the smallest change of the free speeds with H change = wanted, as `solver` finds it."""
    change = np.zeros(len(rows.mechanism.speeds))
    if weighted and (here := rows.numbers(q)) is not None:
        assert rows.compiled is not None
        least = solver(here.weighted[list(rows.active)], wanted)
        return rows.compiled.change(rows.t, q, change, rows.parameters, least)
    if weighted:
        motion = rows.motion(q, change)
        weights: MassFactors
        if massless_speeds(motion.mechanism):
            weights = factorize(completed_matrix(motion, mass_matrix(motion), row_motions(motion)))
        else:
            weights = tree_factors(motion)
        found = correction(weights, jacobian.tolist(), lambda A: solver(np.array(A, dtype=float), wanted).tolist())
        return np.array(found, dtype=float)
    if free:
        change[list(free)] = solver(jacobian[:, list(free)], wanted)
    return change


def least_norm(matrix: Floats, wanted: Floats) -> Floats:
    """Return the smallest x with A x = r over rows that are independent to rounding."""
    found = clear_least_norm(matrix, wanted)
    if found is not None:
        return found
    return in_floats(matrix.tolist(), wanted.tolist(), matrix.shape[1]).solution


def _damped_step(matrix: Floats, wanted: Floats) -> Floats:
    """Return A^T (A A^T + mu E)^-1 r with mu -> 0 as |r|^2 (Levenberg, Marquardt).

    Rows that are dependent where they hold are independent nearby, and would lead Newton's method astray.
    """
    return damped_solution(matrix, wanted, min(_DAMPING, float(wanted @ wanted)))
