"""Forces that a mode leaves open: admissible ones among them, and what of them, or of the motion, is unique.

zeta = zeta_0 + W t fulfils a mode's equations for all t (W: what they do not see). Inequalities on forces are linear in
t but for those of circles, of normals of either sign, and of joints in which the length of a reaction R presses.
Circles are taken with 16 edges (26 faces) where forces are chosen, and judged exactly afterwards. |R| >= e.R for every
unit vector e, and equal along R: friction in joints is bounded by mu e.R, which is linear, with e along the R of the
pass before (the convex-concave procedure). Where uniqueness is asked for none of the three is a bound.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import Final

import numpy as np

from multibody_sym.contact_laws.problem import (
    IN_SPACE,
    STICKS,
    Flags,
    ModeArrays,
    Places,
    Scaled,
    ScaledFriction,
    beyond,
    limits_of,
)
from multibody_sym.contact_laws.solve_mode import ModeSolution, force_tolerance, gap_tolerance, sticking
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.limits import TIED, Kind
from multibody_sym.scalars.linear_inequalities import Cone, inner_point, linear_program, nonnegative_least_squares
from multibody_sym.scalars.rank import ROUNDED, null_space, row_space

_EDGES: Final = 16
_CUBE: Final = np.array([way for way in product((1.0, 0.0, -1.0), repeat=3) if any(way)])
_POLYHEDRON: Final = _CUBE / np.linalg.norm(_CUBE, axis=1)[:, None]
_INSIDE: Final = float(1.0 / np.linalg.norm([1.0, np.sqrt(2.0) - 1.0, np.sqrt(3.0) - np.sqrt(2.0)]))
"""How far the 26 faces of a polyhedron across these directions are from its centre inside the unit sphere."""
_INNER: Final = float(np.cos(np.pi / _EDGES))
"""How far the edges of a polygon in a unit circle are from its middle."""
_OUTER: Final = 1.0
"""And those of one around it."""
NEAR: Final = 1e-9
"""Margins below this part of the largest force may be none: whether they can be made larger is asked."""
SEEN: Final = 1e-9
"""What a combination of forces changes by less than this part of the largest is not changed by it."""


CLOSER: Final = 0.999
"""The part of what friction in joints exceeded its bounds by that the next pass may leave."""
HUGE: Final = 1e6
"""Forces that are so many times the largest of a mode are none."""


Ways = Mapping[int, Floats]
"""By the numbers of parts in whose joints the length of a reaction presses: unit vectors along these."""


def admissible_solution(problem: Scaled, trial: ModeSolution) -> ModeSolution | None:
    """Return the trial with other forces, and the motion that these lead to, so that all inequalities hold.

    None where none are found; where friction sticks in joints that a reaction's length presses there may be others.
    """
    scale = _scale(trial)
    free = trial.idle.shape[1]
    along = _along_reactions(problem, trial, scale)
    if along is None:
        return None
    t = _within(problem, trial, scale, _INNER, along)
    circles = any(part.in_space for part in problem.parts)
    if t is None and circles and free > 1:
        t = _within(problem, trial, scale, _OUTER, along)
        t = None if t is None else _in_circles(problem, trial, scale, t, along)
    if t is None:
        return None
    x, z = trial.x + trial.moved @ (t * scale), trial.z + trial.forces @ (trial.idle @ (t * scale))
    return replace(trial, x=x, z=z, a=problem.A @ x + problem.D @ z - problem.r)


def _along_reactions(problem: Scaled, trial: ModeSolution, scale: float) -> Ways | None:
    """Return the directions of reactions with which friction that sticks in joints keeps its bounds.

    Without directions friction is bounded by zero: the first pass makes it least, each further one no larger beside its
    bounds than the one before. None where it does not come within them.
    """
    parts = [part for part in _sticking_parts(problem, trial) if part.norm]
    along: Ways = {part.number: np.zeros(len(part.normals)) for part in parts}
    least = np.inf
    while parts:
        t, beyond = _nearest(problem, trial, scale, along)
        if not beyond < CLOSER * least:
            return None
        z = trial.z + trial.forces @ trial.idle @ (t * scale)
        along = {part.number: part.along(z) for part in parts}
        if beyond <= ROUNDED:
            return along
        least = beyond
    return along


def _nearest(problem: Scaled, trial: ModeSolution, scale: float, along: Ways) -> tuple[Floats, float]:
    """Return combinations (j) of open forces, over `scale`, that exceed bounds of friction in joints least.

    Then by how much in all; inf where other inequalities have no solution.
    """
    present, slopes = _limits(problem, trial, _INNER)
    forces = trial.forces @ trial.idle
    bounds = [_cone(problem, problem.parts[k], trial, _INNER, along) for k in along]
    rows, free, count = np.vstack(bounds), trial.idle.shape[1], len(along)
    excess = np.repeat(np.eye(count), [len(each) for each in bounds], axis=0)
    left = np.block([[-slopes, np.zeros((len(slopes), count))], [-rows @ forces, -excess]])
    found = linear_program(
        np.concatenate([np.zeros(free), np.ones(count)]),
        [*[(None, None)] * free, *[(0.0, None)] * count],
        below=(left, np.concatenate([present, rows @ trial.z]) / scale),
    )
    return (found.x[:free], found.value) if found.status == 0 else (np.zeros(free), np.inf)


def _within(problem: Scaled, trial: ModeSolution, scale: float, edges: float, along: Ways) -> Floats | None:
    """Return combinations (j) of open forces, over `scale`, with which all inequalities hold; None without any."""
    present, slopes = _limits(problem, trial, edges, along)
    free = trial.idle.shape[1]
    if free == 1:
        low, high = _interval(present / scale, slopes[:, 0])
        return np.array([_inside(low, high)]) if low <= high + 1e-12 else None
    if _certainly_none(present / scale, slopes):
        return None
    # The largest margin, so that rounding of the chosen forces breaks none of them where there is room.
    found = linear_program(
        np.append(np.zeros(free), -1.0),
        [*[(None, None)] * free, (-1e-9, 1e-3)],
        below=(np.column_stack([-slopes, np.ones(len(slopes))]), present / scale),
    )
    if found.status != 0:
        return None
    t = found.x[:free]
    if any(part.enough for part in problem.parts):  # along what nothing limits a program may go anywhere
        limited = row_space(slopes, SEEN)
        t = limited.T @ (limited @ t)
    return t


def _in_circles(problem: Scaled, trial: ModeSolution, scale: float, t: Floats, along: Ways) -> Floats:
    """Return such combinations with the circles as they are, from those of polygons around them."""
    present, slopes = _limits(problem, trial, None)
    forces = trial.forces @ trial.idle
    values, ways, cones = [present / scale], [slopes], [Cone((), (k,), (1.0,)) for k in range(len(present))]
    count = len(present)
    for part in _parts_with_bounds(problem, trial, along):
        row, own = _friction_bound(problem, part, trial, along), np.eye(problem.count)[part.rows]
        both = np.vstack([own, row])
        values.append(both @ trial.z / scale)
        ways.append(both @ forces)
        cones.append(Cone(tuple(range(count, count + len(own))), (count + len(own),), (1.0,)))
        count += len(both)
    moved = np.vstack(ways)
    found = inner_point(np.concatenate(values) + moved @ t, moved, cones)
    return t + found.taken


def _certainly_none(present: Floats, slopes: Floats) -> bool:
    """Return whether a sum y >= 0 of the inequalities present + slopes t >= -1e-9 holds for no t that is not huge.

    By Farkas' lemma there is one where they have no solution; linear programs take ten times as long to find none.
    """
    sizes = np.maximum(np.abs(slopes).max(axis=1, initial=0.0), np.abs(present)) + 1e-300
    rows = np.column_stack([slopes, present + 1e-9]) / sizes[:, None]
    try:
        y, _ = nonnegative_least_squares(rows.T, np.append(np.zeros(slopes.shape[1]), -1.0))
    except RuntimeError:  # too many steps
        return False
    *left, sum_ = (rows.T @ y).tolist()
    return bool(sum_ < -0.5 and HUGE * float(np.abs(left).sum()) < -sum_)


def _interval(present: Floats, slopes: Floats) -> tuple[float, float]:
    """Return between what t has present + slopes t >= 0; of what no t changes nothing is asked."""
    steep = np.abs(slopes) > SEEN * float(np.abs(slopes).max(initial=0.0))
    ends = -present[steep] / slopes[steep]
    up = slopes[steep] > 0.0
    return float(ends[up].max(initial=-np.inf)), float(ends[~up].min(initial=np.inf))


def _inside(low: float, high: float) -> float:
    """Return a number inside an interval that may have no ends."""
    if np.isfinite(low) and np.isfinite(high):
        return (low + high) / 2.0
    return low + 1.0 + abs(low) if np.isfinite(low) else high - 1.0 - abs(high) if np.isfinite(high) else 0.0


def _scale(trial: ModeSolution) -> float:
    return max(trial.largest, force_tolerance(trial, 0.0) / ROUNDED)


def open_forces(problem: Scaled, trial: ModeSolution, state: ModeSolution) -> tuple[Flags, Flags]:
    """Return (m) which forces have other admissible values beside those of a state, and which of these move things.

    `trial` is that of the state's mode by what moves.
    """
    none = np.zeros(problem.count, dtype=bool)
    if not trial.idle.shape[1]:
        return none, none
    here = replace(trial, x=state.x, z=state.z, a=state.a)
    ways = _free_directions(problem, here)
    changes, moves = trial.forces @ trial.idle @ ways, trial.moved @ ways
    sizes = np.abs(changes).max(axis=1, initial=0.0)
    seen = sizes > SEEN * float(sizes.max(initial=0.0))
    moving = np.linalg.norm(moves, axis=0) > SEEN * np.maximum(np.linalg.norm(changes, axis=0), 1e-300)
    columns = np.abs(changes[:, moving]).max(axis=1, initial=0.0)
    return seen & (sizes > 0.0), (columns > SEEN * float(columns.max(initial=0.0))) & bool(moving.any())


def _free_directions(problem: Scaled, trial: ModeSolution) -> Floats:
    """Return an orthonormal basis of the t in whose directions admissible forces lie.

    Inequalities that hold with equality for all admissible forces take directions away: those whose margins cannot be
    made positive, all of them together in the first pass, the remaining ones in the following ones.
    """
    margins, slopes = _limits(problem, trial, None)
    present = margins / _scale(trial)
    touched = np.abs(slopes).max(axis=1, initial=0.0) > SEEN * float(np.abs(slopes).max(initial=0.0))
    held = touched & (present <= NEAR)
    free = trial.idle.shape[1]
    if not slopes.any():  # nothing limits them
        return np.eye(free)
    if free == 1:
        low, high = _interval(np.maximum(present, 0.0), slopes[:, 0])
        return np.eye(1) if high - low > NEAR / float(np.abs(slopes).max()) else np.zeros((1, 0))
    while held.any():
        count = int(held.sum())
        made = np.zeros((len(slopes), count))  # margin_i - slope_i t <= present_i, no margin where one is positive
        made[np.flatnonzero(held), np.arange(count)] = 1.0
        found = linear_program(
            np.concatenate([np.zeros(free), -np.ones(count)]),
            [*[(-1e3, 1e3)] * free, *[(0.0, 1e-3)] * count],
            below=(np.column_stack([-slopes, made])[touched], np.maximum(present[touched], 0.0)),
        )
        margin = found.x[free:] if found.status == 0 else np.zeros(count)
        if not (margin > 1e-9).any():
            break
        held[np.flatnonzero(held)[margin > 1e-9]] = False
    return null_space(slopes[held], SEEN) if held.any() else np.eye(free)


def _limits(
    problem: Scaled, trial: ModeSolution, edges: float | None, along: Ways | None = None
) -> tuple[Floats, Floats]:
    """Return what must be >= 0: the values (i) of a trial, and their slopes (i, j) by t.

    Circles have edges so far from their middles (of their radius), or are left out.
    """
    z, x = trial.forces @ trial.idle, trial.moved
    here = limits_of(problem, trial.mode, trial.mu, trial.z, trial.a)
    changes = limits_of(problem, trial.mode, trial.mu, z.T, (problem.A @ x + problem.D @ z).T)
    found = dict[Kind, tuple[Floats, Floats]]()
    for now, change in zip(here, changes, strict=True):
        asked = now.asked & (problem.table.sizes == 1) if now.kind == "slip" else now.asked
        found[now.kind] = now.values[asked], change.values[:, asked].T
    parts = [part for part in _parts_with_bounds(problem, trial, along or {}) if edges is not None or not part.in_space]
    none = np.zeros((0, problem.count))
    cones = np.vstack([none, *(_cone(problem, part, trial, edges, along or {}) for part in parts)])
    found["cone"] = cones @ trial.z, cones @ z
    in_order = [found[kind] for kind in ("force", "cone", "side", "gap", "slip")]
    values, slopes = (np.concatenate(each) for each in zip(*in_order, strict=True))
    slopes[np.abs(slopes) <= SEEN * np.abs(z).max(axis=0, initial=0.0)] = 0.0  # rounding of what is changed
    return values, slopes


def _sticking_parts(problem: Scaled, trial: ModeSolution) -> list[ScaledFriction]:
    """Return the parts that stick and whose forces have bounds."""
    stuck = sticking(problem, trial.mode, trial.mu)
    return [part for part in problem.parts if stuck[part.rows[0]] and not part.enough]


def _parts_with_bounds(problem: Scaled, trial: ModeSolution, along: Ways) -> list[ScaledFriction]:
    """Return the parts that stick and whose forces are bounded by sums of normal forces, or `along` reactions."""
    return [part for part in _sticking_parts(problem, trial) if not part.norm or part.number in along]


def _friction_bound(problem: Scaled, part: ScaledFriction, trial: ModeSolution, along: Ways) -> Floats:
    """Return (m) by the forces what those of a part that sticks may be at most."""
    return part.bound(float(trial.mu[part.number]), part.weights(trial.mode.sides, along), problem.count)


def _cone(problem: Scaled, part: ScaledFriction, trial: ModeSolution, edges: float | None, along: Ways) -> Floats:
    """Return (k, m) by the forces what must be >= 0 of a part that sticks."""
    if edges is None or not part.in_space:
        ways, factor = np.array([[1.0], [-1.0]]), 1.0
    elif len(part.rows) == 2:
        angles = 2.0 * np.pi * np.arange(_EDGES) / _EDGES
        ways, factor = np.column_stack([np.cos(angles), np.sin(angles)]), edges
    else:
        ways, factor = _POLYHEDRON, _INSIDE if edges < 1.0 else 1.0
    return part.cone(factor * _friction_bound(problem, part, trial, along), ways)


# ----------------------------------------------------------------------------------------------------------------------
# Ties: where two modes fit an instant, their rates decide.
#
# On pairs that are both zero, and with A, C and D as they are,
#
#     a' = A y + D z' + g,   y = C^T z'      (g: how a changes while z does not)
#
# is a problem of the same kind: 0 <= a_n' beside 0 <= z_n'; 0 <= mu N' + s z_t' beside s a_t' >= 0 where friction is
# at its limit mu N = -s z_t (in space along z_t; across it a_t' = 0); Coulomb's law of z_t' where N = 0. All else of
# the mode stays as it is: active rows have a' = 0, what slides follows its normals.
#
# Where exact numbers tell what is left at a limit, too little for floats, the same problem has g = 0 and 0 <= d +
# z_n', 0 <= d + mu N' + s z_t' with that d: its changes z' are those that the forces need to be within their limits.


@dataclass(frozen=True)
class Ties:
    """Rows of closed contacts and taut ropes without force; parts that stick with all the friction there can be."""

    normals: tuple[int, ...]
    parts: tuple[int, ...]

    def __bool__(self) -> bool:
        return bool(self.normals or self.parts)

    def rows(self, problem: Scaled) -> tuple[int, ...]:
        return tuple(sorted((*self.normals, *(int(problem.parts[k].rows[0]) for k in self.parts))))


def tied_limits(problem: Scaled, trial: ModeSolution, mode: ModeArrays, unsure: Flags) -> Ties:
    """Return what is at its limit: a and z are both zero, of forces that are unique."""
    force = force_tolerance(trial, TIED)
    gap = gap_tolerance(trial, TIED)
    closed = problem.unilateral[mode.sides[problem.unilateral] > 0]
    still = (np.abs(trial.z[closed]) <= force) & (np.abs(trial.a[closed]) <= gap[closed]) & ~unsure[closed]
    table = problem.table
    stuck = problem.of_all_rows(sticking(problem, mode, trial.mu) & ~unsure) & ~table.held
    pressed, size = problem.pressed(trial.z), problem.rubbing(trial.z)
    left = np.abs(beyond(size, pressed, trial.mu))
    limit = left <= 10.0 * TIED * np.maximum(size, trial.mu * pressed) + force
    parts = np.flatnonzero(stuck & (np.minimum(trial.mu, 1.0) * pressed > force) & limit)
    known = [int(k) for k in parts if not unsure[problem.parts[k].normals].any()]
    return Ties(tuple(int(k) for k in closed[still]), tuple(known))


@dataclass(frozen=True)
class RateProblem:
    """The problem of rates, and of which parts its parts are; rows of parts at their limit are along the slip."""

    problem: Scaled
    parts: tuple[int, ...]


def rate_problem(
    problem: Scaled, trial: ModeSolution, mode: ModeArrays, ties: Ties, g: Floats, left: Floats
) -> RateProblem:
    """Return the problem of rates; its rows are those of the problem, without laws where the mode keeps them out.

    `left` (m) is what is left at limits of forces, negative where they are beyond.
    """
    made = _Rates(problem, trial, mode, ties)
    for part in problem.parts:
        made.take(part)
    active = mode.sides[problem.unilateral] > 0
    loose = np.isin(problem.unilateral, ties.normals)
    held, one_way = np.array(made.held, dtype=np.intp), np.array(made.one_way, dtype=np.intp)
    kinematic = np.concatenate([problem.kinematic, problem.unilateral[active & ~loose], held])
    unilateral = np.concatenate([problem.unilateral[loose], one_way])
    asked = replace(
        problem,
        A=made.A,
        C=made.C,
        D=made.D,
        r=made.A @ (made.C.T @ left) + made.D @ left - made.along_slip(g),
        kinematic=np.sort(kinematic).astype(np.intp),
        unilateral=np.sort(unilateral).astype(np.intp),
        both=np.zeros(0, dtype=np.intp),
        parts=tuple(replace(part, number=k) for k, part in enumerate(made.parts)),
    )
    return RateProblem(asked, tuple(part.number for part in made.parts))


class _Rates:
    """The rows of the problem of rates, while parts are taken into them one by one."""

    def __init__(self, problem: Scaled, trial: ModeSolution, mode: ModeArrays, ties: Ties) -> None:
        self.problem, self.trial, self.mode, self.ties = problem, trial, mode, ties
        self.A, self.C, self.D = problem.A.copy(), problem.C.copy(), problem.D.copy()
        self.turned = list[tuple[Places, Floats]]()
        self.held, self.one_way = list[int](), list[int]()
        self.parts = list[ScaledFriction]()
        self.stuck = sticking(problem, mode, trial.mu)

    def take(self, part: ScaledFriction) -> None:
        """Let a part slide with its normals, hold it, or leave its friction to be found."""
        z, mu = self.trial.z, self.trial.mu[part.number]
        if not mu or not self.problem.pressed_parts(self.mode.sides)[part.number]:
            return
        if self.mode.slips[part.number] != STICKS:
            self._follow(part, -mu * self.mode.way(part))
        elif set(part.normals.tolist()) <= set(self.ties.normals) and not part.in_space:
            self.parts.append(replace(part, static=mu, kinetic=mu))
        elif part.number in self.ties.parts:
            way = against(z[part.rows])
            self._follow(part, -mu * way)
            self._turn(part.rows, way)
            self.one_way.append(int(part.rows[0]))
            self.held += part.rows[1:].tolist()
        else:
            self.held += part.rows.tolist()

    def _turn(self, rows: Places, way: Floats) -> None:
        """Let the first of a part's rows be along a unit vector, the others across it."""
        frame = np.vstack([way, null_space(way[None], ROUNDED).T])
        self.A[rows], self.C[rows] = frame @ self.A[rows], frame @ self.C[rows]
        self.D[:, rows] = self.D[:, rows] @ frame.T
        self.D[rows] = frame @ self.D[rows]
        self.turned.append((rows, frame))

    def along_slip(self, a: Floats) -> Floats:
        """Return what rows (m) have, along and across the slip of parts at their limits."""
        a = a.copy()
        for rows, frame in self.turned:
            a[rows] = frame @ a[rows]
        return a

    def _follow(self, part: ScaledFriction, exerts: Floats) -> None:
        """Let the normals exert the part's friction too."""
        z = self.trial.z
        weights = part.weights(z, {part.number: part.along(z)})
        for normal, weight in zip(part.normals, weights, strict=True):
            self.C[normal] += weight * exerts @ self.C[part.rows]
            self.D[:, normal] += weight * self.D[:, part.rows] @ exerts


def against(friction: Floats) -> Floats:
    """Return the unit vector in which a part begins to slip at the limit of its friction."""
    return np.asarray(-friction / np.linalg.norm(friction), dtype=float)


def mode_with_rates(
    problem: Scaled,
    before: tuple[ModeSolution, ModeArrays, Ties],
    rates: RateProblem,
    after: tuple[ModeSolution, ModeArrays],
) -> tuple[ModeArrays, Ties]:
    """Return the mode that the rates say, from the state without them and theirs, and what they leave tied."""
    old, mode, ties = before
    trial, labels = after
    mode = mode.copy()
    gap = gap_tolerance(trial, TIED)
    still = (np.abs(trial.a) <= gap) & (np.abs(trial.z) <= force_tolerance(trial, TIED))
    for k in ties.normals:
        mode.sides[k] = labels.sides[k]
    for number in ties.parts:
        part = problem.parts[number]
        if not labels.sides[part.rows[0]]:
            _slips(mode, part, against(old.z[part.rows]))
    for k, number in enumerate(rates.parts):
        if labels.slips[k] != STICKS:
            _slips(mode, problem.parts[number], np.array([float(labels.slips[k])]))
    parts = [k for k in ties.parts if still[problem.parts[k].rows[0]]]
    return mode, Ties(tuple(k for k in ties.normals if still[k]), tuple(parts))


def _slips(mode: ModeArrays, part: ScaledFriction, way: Floats) -> None:
    """Let a part slip along a unit vector."""
    mode.slips[part.number] = IN_SPACE if part.in_space else int(way[0])
    if part.in_space:
        mode.direction(part)[:] = way
    mode.sides[part.rows] = 0
