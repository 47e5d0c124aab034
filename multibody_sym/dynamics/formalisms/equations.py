"""The equations of motion that every formalism returns, over any scalar, with or without the mass matrix itself.

M udot = Q - c + H^T lambda        H udot = gamma        qdot = N u
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cache
from random import Random
from typing import Final, Protocol

import numpy as np

from multibody_sym.errors import NoSolutionError
from multibody_sym.mechanics.mechanism import Mechanism, TreeBody, once
from multibody_sym.mechanics.motion import (
    Motion,
    State,
    body_mass,
    body_motion,
    motion_of,
    moving_parent,
    partial_velocities,
    qdot_of,
    state_of,
)
from multibody_sym.mechanics.row_kinematics import RowMotion
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.node import ZERO
from multibody_sym.scalars.rank import DRAWN, vanishes
from multibody_sym.scalars.vectors import (
    UNIT_MATRIX,
    ZERO_VECTOR,
    Mat,
    S,
    add,
    apply,
    apply_transposed,
    cross,
    factorize,
)

# ----------------------------------------------------------------------------------------------------------------------
# Freedoms without mass that rows hold: the carrier of a massless movable pulley, the turning of a particle.
#
# M is singular there, the equations are not. With H udot = gamma they are equivalent to
#
#     (M + w H^T H) udot = f + w H^T gamma + H^T lambda        H udot = gamma
#
# with the same udot and lambda and, for w > 0, a positive definite matrix: wherever [[M, -H^T], [H, 0]] is regular,
# and with dependent rows as well.


_SEED: Final = 3
_LIGHTER: Final = 1024
"""How many times lighter than all bodies together the rows' weight w is."""


@once
def massless_speeds(mechanism: Mechanism) -> tuple[int, ...]:
    """Return the speeds that no inertia resists, whatever the position and the values of the parameters.

    They move only bodies declared without mass and inertia; or they turn the last body of a branch about axes without
    inertia, as those of a particle's free joint; or they move a massless carrier as freedoms beyond it move its load.
    """
    carriers: set[int] = set()
    found: list[int] = []
    shared: list[int] = []
    drawn = cache(lambda: _generic_state(mechanism))
    for index in range(len(mechanism.bodies) - 1, -1, -1):
        body = mechanism.bodies[index]
        massless = {body.mass.mass, *body.mass.inertia} == {ZERO}
        if index not in carriers:
            found += body.u if massless else _without_inertia(body, drawn)
        elif massless:
            shared += body.u
        if index in carriers or not massless:
            carriers.add(body.parent)
    return tuple(sorted({*found, *(_without_pivot(mechanism) & set(shared) if shared else ())}))


def _without_pivot(mechanism: Mechanism) -> set[int]:
    """Return the speeds at which M = L^T D L, begun at the tips, has no pivot in a generic state.

    M is the sum of J^T diag(m, I) J about the centres of mass.
    """
    m = np.zeros((len(mechanism.speeds), len(mechanism.speeds)))
    try:
        motion = motion_of(mechanism, _generic_state(mechanism))
        for partials, mass in zip(partial_velocities(motion), motion.masses, strict=True):
            pairs = [[*add(v, cross(w, mass.com)), *w] for v, w in partials.values()]
            at_com = np.array(pairs, dtype=float).reshape(-1, 6)
            momenta = at_com.copy()
            momenta[:, :3] *= float(mass.mass)
            momenta[:, 3:] = at_com[:, 3:] @ np.array(mass.inertia, dtype=float)
            m[np.ix_(list(partials), list(partials))] += at_com @ momenta.T
    except UNDEFINED:
        return set()
    return set(vanishing_pivots(m, DRAWN))


def vanishing_pivots(matrix: Floats, part: float) -> Iterator[int]:
    """Yield, from the last on, where M = L^T D L has no more than this part of its diagonal element as a pivot."""
    m = matrix.copy()
    for k in range(len(m) - 1, -1, -1):
        if vanishes(m[k, k], matrix[k, k], part):
            yield k
        else:
            m[:k, :k] -= np.outer(m[:k, k], m[k, :k] / m[k, k])


def _without_inertia(body: TreeBody, drawn: Callable[[], State]) -> list[int]:
    """Return the speeds of a body's joint that give the body no momentum beyond that of the speeds before them.

    Judged in a generic state, at `drawn` coordinates and parameters; none where the momenta have no value.
    """
    slides = len(body.u) == 1 and all(free.step.slides and not free.step.turns for free in body.free_steps)
    if ZERO not in (body.mass.mass, *body.mass.inertia[:3]) or (slides and body.mass.mass is not ZERO):
        return []
    try:
        state = drawn()
        moved = body_motion(body, moving_parent(ZERO_VECTOR, ZERO_VECTOR, ZERO_VECTOR), state)
        mass = body_mass(body, state)
        momenta = [  # and angular momentum about the centre of mass, for each unit speed
            np.array([*(mass.mass * x for x in add(v, cross(w, mass.com))), *apply(mass.inertia, w)], dtype=float)
            for v, w in zip(moved.linear, moved.angular, strict=True)
        ]
    except UNDEFINED:
        return []
    found, basis = [], np.zeros((6, 0))
    for k, momentum in zip(body.u, momenta, strict=True):
        rest = momentum - basis @ (basis.T @ momentum)
        length = float(np.linalg.norm(rest))
        if vanishes(length, max(1.0, float(np.linalg.norm(momentum))), DRAWN):
            found.append(k)
        else:
            basis = np.column_stack([basis, rest / length])
    return found


def _generic_state(mechanism: Mechanism) -> State:
    draw = Random(_SEED).uniform  # every run comes here, and importing NumPy's takes longer than all draws
    sizes = len(mechanism.coordinates), len(mechanism.parameters)
    q, parameters = ([draw(0.5, 1.5) for _ in range(size)] for size in sizes)
    inputs, u = [0.0] * len(mechanism.inputs), [0.0] * len(mechanism.speeds)
    return state_of(mechanism, float, 0.5, q, u, parameters, inputs)


def verify_massive(mechanism: Mechanism, formalism: str) -> None:
    """Raise NoSolutionError where rows hold a freedom without mass, for a formalism that divides by it."""
    if massless_speeds(mechanism):
        raise NoSolutionError(f"{formalism} needs inertia in every direction; choose composite_body", number="N102")


def completed_matrix(motion: Motion, matrix: list[list[S]], rows: Sequence[RowMotion]) -> list[list[S]]:
    """Return M + w H^T H where there are massless speeds, else M."""
    weight, held = _completing(motion, rows)
    return [
        [m + weight * sum((row.jacobian[i] * row.jacobian[j] for row in held), 0) for j, m in enumerate(line)]
        for i, line in enumerate(matrix)
    ] if held else matrix


def _completing(motion: Motion, rows: Sequence[RowMotion]) -> tuple[S, list[RowMotion]]:
    """Return w, small beside the masses, so that it rounds away little of the motion of light bodies, and the rows.

    Without massless speeds there are none.
    """
    if not rows or not massless_speeds(motion.mechanism):
        return 0, []
    has_mass = any(body.mass.mass != ZERO for body in motion.mechanism.bodies)
    weight = sum((mass.mass for mass in motion.masses), 0) / _LIGHTER if has_mass else 1
    return weight, [row for row in rows if row.kinematic]


# ----------------------------------------------------------------------------------------------------------------------


class MassFactors(Protocol):
    """A factorised mass matrix M = G^T G, formed or not."""

    def solve(self, right: Sequence[S]) -> list[S]:
        """Return M^-1 right (n)."""

    def weighted(self, right: Sequence[S]) -> list[S]:
        """Return G^-T right (n): forces in the coordinates in which the mass matrix is the unit matrix."""

    def unweighted(self, x: Sequence[S]) -> list[S]:
        """Return G^-1 x (n): accelerations from those coordinates."""


@dataclass(frozen=True)
class FrictionTerms:
    """Equations M udot = f + C^T lambda, H udot + D lambda = gamma with other forces than H^T lambda.

    `exerts` C (s x n) and `coupling` D (s x s). Rows `beside` others form a vector of multipliers; each exerts its
    force times its component of that vector's direction.
    """

    exerts: list[list[S]]
    coupling: list[list[S]]
    beside: Mapping[int, tuple[int, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class TreeDynamics:
    """The dynamics at a state; n speeds, s rows.

    `factors` apply M^-1; `forcing` f = Q - c (n), `rows` (s) with H_j and gamma_j, `rates` qdot; and the names of
    coordinates, speeds and rows.
    """

    factors: MassFactors
    forcing: list[S]
    rows: list[RowMotion]
    rates: list[S]
    coordinates: tuple[str, ...]
    speeds: tuple[str, ...]
    row_names: tuple[str, ...]

    @property
    def bias_acceleration(self) -> list[S]:
        """M^-1 f (n): the accelerations without rows."""
        return self.factors.solve(self.forcing)

    @property
    def constraint_jacobian(self) -> list[list[S]]:
        """H (s x n)."""
        return [row.jacobian for row in self.rows]

    @property
    def friction(self) -> FrictionTerms | None:
        """The forces that rows exert and define, where these are not all H^T lambda; None where they are."""
        if all(row.exerts is None and not row.coupling for row in self.rows):
            return None
        count = range(len(self.rows))
        coupling = [[row.coupling.get(k, 0) for k in count] for row in self.rows]
        beside = {k: row.beside for k, row in enumerate(self.rows) if row.beside}
        return FrictionTerms([row.forces for row in self.rows], coupling, beside)

    @property
    def constraint_forcing(self) -> list[S]:
        """gamma (s)."""
        return [row.gamma for row in self.rows]


@dataclass(frozen=True)
class EquationsOfMotion(TreeDynamics):
    """The dynamics with `mass_matrix` M (n x n) formed, and f in parts: `applied` Q (n), `velocity_terms` c (n)."""

    mass_matrix: list[list[S]]
    applied: list[S]
    velocity_terms: list[S]


Formalism = Callable[[Mechanism, State], TreeDynamics]
"""A route from a mechanism to its dynamics at a state, over the state's scalar."""


def equations(
    motion: Motion,
    mass_matrix: list[list[S]],
    applied: Sequence[S],
    velocity_terms: Sequence[S],
    rows: list[RowMotion],
    forcing: Sequence[S] | None = None,
) -> EquationsOfMotion:
    """Return the equations of motion of a mechanism at a state, with the names it declares.

    `forcing` is Q - c where a formalism gives both as a whole. Where rows hold freedoms without mass, the equations are
    completed (`completed_matrix`), so that their matrix is regular.
    """
    matrix = completed_matrix(motion, mass_matrix, rows)
    if forcing is None:
        forcing = [q - c for q, c in zip(applied, velocity_terms, strict=True)]
    weight, held = _completing(motion, rows)
    forces, left = (  # Q + w H^T gamma
        [q + weight * sum((row.jacobian[k] * row.gamma for row in held), 0) if held else q for k, q in enumerate(part)]
        for part in (applied, forcing)
    )
    tree = tree_dynamics(motion, factorize(matrix), left, rows)
    return EquationsOfMotion(**vars(tree), mass_matrix=matrix, applied=forces, velocity_terms=list(velocity_terms))


def coupled_groups(sets: Iterable[set[int]]) -> list[set[int]]:
    """Return the unions of sets that have members in common, as of speeds that rows join; no two unions do."""
    groups: list[set[int]] = []
    for each in sets:
        apart = [other for other in groups if not other & each]
        groups = [*apart, each.union(*(other for other in groups if other & each))]
    return groups


def tree_dynamics(motion: Motion, factors: MassFactors, forcing: list[S], rows: list[RowMotion]) -> TreeDynamics:
    """Return the dynamics of a mechanism at a state, with the names it declares."""
    mechanism, state = motion.mechanism, motion.state
    return TreeDynamics(
        factors,
        forcing,
        rows,
        qdot_of(state, mechanism),
        tuple(c.name for c in mechanism.coordinates),
        tuple(s.name for s in mechanism.speeds),
        tuple(row.name for row in mechanism.rows),
    )


# ----------------------------------------------------------------------------------------------------------------------
# Accelerations of bodies that move freely in space, sought along their own axes.
#
# The speeds of a free joint are along the parent's axes, so that their partial velocities turn with the body. With
# udot = T x, where x is along the body's axes, these are constant: (T^T M T) x = T^T f.


@dataclass(frozen=True)
class BodyAxes:
    """Three `speeds` of a body along directions at right angles, the rows of `directions` in the body's axes."""

    body: int
    speeds: tuple[int, ...]
    directions: Mat

    def rates(self, x: Sequence[S]) -> list[S]:
        """Return T x."""
        return self._with(x, apply(self.directions, [x[k] for k in self.speeds]))

    def forces(self, right: Sequence[S]) -> list[S]:
        """Return T^T right."""
        return self._with(right, apply_transposed(self.directions, [right[k] for k in self.speeds]))

    def _with(self, x: Sequence[S], values: Sequence[S]) -> list[S]:
        changed = list(x)
        for k, value in zip(self.speeds, values, strict=True):
            changed[k] = value
        return changed


def along_body_axes(motion: Motion) -> tuple[Motion, tuple[BodyAxes, ...]]:
    """Return the motion with partial velocities of free bodies along their own axes, and T of these bodies."""
    bodies, axes = list(motion.bodies), []
    for index, (body, moved) in enumerate(zip(motion.mechanism.bodies, motion.bodies, strict=True)):
        moves, turns = body.steps[:3], body.steps[3:]
        slides = [[abs(x.shadow or 0.0) for x in axis] for step in moves for axis in step.slides]
        if (  # it moves along x, y and z, in any order, and then turns
            sorted(slides, reverse=True) == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
            and not any(step.turns or not step.is_independent for step in moves)
            and not any(step.slides for step in turns)
            and bool(turns)
            and not any(body.given)
        ):
            x, y, z, *others = moved.linear
            axes.append(BodyAxes(index, body.u[:3], (x, y, z)))
            bodies[index] = replace(moved, linear=(*UNIT_MATRIX, *others))
    return replace(motion, bodies=tuple(bodies)), tuple(axes)
