"""Block L^T D L along the tree: M^-1 applied in time linear in the number of bodies, M never formed.

The mass matrix of a tree factorises along it; its pivots are those of each joint's V = A^T M* A, where M* is the
articulated inertia of everything the joint carries. V is never inverted: the freedoms of a joint are eliminated one by
one, which is V's own L D L^T, and each takes its symmetric share U U^T / d from M* (21 elements).

Sources: Vereshchagin (1974); Shimanovskii (2017); Featherstone, Rigid Body Dynamics Algorithms, chapter 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from multibody_sym.dynamics.equations import TreeDynamics, tree_dynamics
from multibody_sym.dynamics.inverse_dynamics import forcing
from multibody_sym.dynamics.massless import massless_speeds
from multibody_sym.errors import NoSolutionError
from multibody_sym.kinematics.motion import BodyMass, BodyMotion, Motion, motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import State
from multibody_sym.kinematics.vectors import (
    ZERO_VECTOR,
    Mat,
    S,
    Vec,
    add,
    apply,
    apply_transposed,
    cross,
    dot,
    matrix_sum,
    product,
    scale,
    steiner,
    subtract,
    symmetric,
    transpose,
)
from multibody_sym.kinematics.wrenches import Wrench
from multibody_sym.model.mechanism import Mechanism
from multibody_sym.scalars.functions import sqrt


def block_ldl(mechanism: Mechanism, state: State) -> TreeDynamics:
    """Return the dynamics at a state. Raises NoSolutionError where a freedom without mass is left to rows to hold."""
    if massless_speeds(mechanism):
        raise NoSolutionError("block_ldl needs inertia in every direction; choose composite_body")
    motion = motion_of(mechanism, state)
    return tree_dynamics(motion, tree_factors(motion), forcing(motion), row_motions(motion))


@dataclass(frozen=True)
class Inertia:
    """A symmetric 6 x 6 inertia: force = linear a + coupling alpha, moment = coupling^T a + angular alpha."""

    linear: Mat
    coupling: Mat
    angular: Mat

    def wrench(self, a: Vec, alpha: Vec) -> Wrench:
        """Return the wrench for an acceleration of the reference point and an angular acceleration."""
        force = add(apply(self.linear, a), apply(self.coupling, alpha))
        return force, add(apply_transposed(self.coupling, a), apply(self.angular, alpha))

    def plus(self, other: Inertia) -> Inertia:
        """Return the sum."""
        return Inertia(
            matrix_sum(self.linear, other.linear),
            matrix_sum(self.coupling, other.coupling),
            matrix_sum(self.angular, other.angular),
        )

    def without(self, wrench: Wrench, gain: Wrench) -> Inertia:
        """Return the inertia that is left when one freedom is eliminated: M - U K^T with K = U / d."""
        (force, moment), (k_force, k_moment) = wrench, gain
        shares = [[_share(force[i], k_force[i], moment[j], k_moment[j]) for j in range(3)] for i in range(3)]
        coupling = [subtract(row, share) for row, share in zip(self.coupling, shares, strict=True)]
        return Inertia(
            _lower_difference(self.linear, force, k_force),
            (coupling[0], coupling[1], coupling[2]),
            _lower_difference(self.angular, moment, k_moment),
        )


@dataclass(frozen=True)
class Freedom:
    """One eliminated freedom of a body: its speed, partial velocity A, pivot d and gain K = U / d."""

    speed: int
    linear: Vec
    angular: Vec
    pivot: S
    gain: Wrench


@dataclass(frozen=True)
class TreeFactors:
    """The factorised mass matrix of a tree: the freedoms of each body, in tree order."""

    motion: Motion
    freedoms: tuple[tuple[Freedom, ...], ...]

    def solve(self, right: Sequence[S]) -> list[S]:
        """Return M^-1 right (n)."""
        return self._outward([e / d for e, d in zip(self._inward(right), self._pivots(), strict=True)])

    def weighted(self, right: Sequence[S]) -> list[S]:
        """Return D^-1/2 L^-T right (n)."""
        return [e / sqrt(d) for e, d in zip(self._inward(right), self._pivots(), strict=True)]

    def unweighted(self, x: Sequence[S]) -> list[S]:
        """Return L^-1 D^-1/2 x (n)."""
        return self._outward([value / sqrt(d) for value, d in zip(x, self._pivots(), strict=True)])

    def _pivots(self) -> list[S]:
        return [freedom.pivot for of_body in self.freedoms for freedom in of_body]

    def _inward(self, right: Sequence[S]) -> list[S]:
        """Return e = Q + A^T p of every freedom, from the leaves to the root; p -= K e."""
        carried: list[Wrench] = [_NOTHING] * len(self.freedoms)
        remaining = list(right)
        for index in range(len(carried) - 1, -1, -1):
            force, moment = carried[index]
            for freedom in reversed(self.freedoms[index]):
                e = right[freedom.speed] + (dot(freedom.linear, force) + dot(freedom.angular, moment))
                remaining[freedom.speed] = e
                lost = _scaled(freedom.gain, e)
                force, moment = subtract(force, lost[0]), subtract(moment, lost[1])
            parent = self.motion.mechanism.bodies[index].parent
            if parent >= 0:
                handed, known = _to_parent(self.motion.bodies[index], (force, moment)), carried[parent]
                carried[parent] = add(known[0], handed[0]), add(known[1], handed[1])
        return remaining

    def _outward(self, x: Sequence[S]) -> list[S]:
        """Return udot from x = e / d, from the root to the leaves: udot = x - K . a, a += A udot."""
        udot = list(x)
        reached: list[tuple[Vec, Vec]] = []
        for index, body in enumerate(self.motion.mechanism.bodies):
            a, alpha = _from_parent(self.motion.bodies[index], reached[body.parent]) if body.parent >= 0 else _NOTHING
            for freedom in self.freedoms[index]:
                rate = x[freedom.speed] - (dot(freedom.gain[0], a) + dot(freedom.gain[1], alpha))
                a, alpha = add(a, scale(rate, freedom.linear)), add(alpha, scale(rate, freedom.angular))
                udot[freedom.speed] = rate
            reached.append((a, alpha))
        return udot


def tree_factors(motion: Motion) -> TreeFactors:
    """Return the factors of a tree's mass matrix, from the leaves to the root."""
    inertias = [_rigid(mass) for mass in motion.masses]
    freedoms: list[tuple[Freedom, ...]] = [()] * len(inertias)
    for index in range(len(inertias) - 1, -1, -1):
        body, moved = motion.mechanism.bodies[index], motion.bodies[index]
        freedoms[index], left = _eliminated(body.u, moved, inertias[index])
        if body.parent >= 0:
            inertias[body.parent] = inertias[body.parent].plus(_moved(left, moved.R_PB, moved.p_PB))
    return TreeFactors(motion, tuple(freedoms))


def _eliminated(speeds: Sequence[int], moved: BodyMotion, inertia: Inertia) -> tuple[tuple[Freedom, ...], Inertia]:
    """Return a joint's freedoms, the last eliminated first, and the inertia that the parent feels through it."""
    freedoms = []
    for speed, linear, angular in reversed(list(zip(speeds, moved.linear, moved.angular, strict=True))):
        force, moment = inertia.wrench(linear, angular)
        pivot = dot(linear, force) + dot(angular, moment)
        gain = _over(force, pivot), _over(moment, pivot)
        freedoms.append(Freedom(speed, linear, angular, pivot, gain))
        inertia = inertia.without((force, moment), gain)
    return tuple(reversed(freedoms)), inertia


def _rigid(mass: BodyMass) -> Inertia:
    m, (x, y, z) = mass.mass, scale(mass.mass, mass.com)
    coupling: Mat = ((0, z, -y), (-z, 0, x), (y, -x, 0))
    about_origin = matrix_sum(mass.inertia, steiner((x, y, z), mass.com))
    return Inertia(((m, 0, 0), (0, m, 0), (0, 0, m)), coupling, about_origin)


def _moved(inertia: Inertia, R: Mat, p: Vec) -> Inertia:
    """Return a child's inertia about the parent's origin, in the parent's axes.

    With P = [p] and turned blocks L, C, J: L' = L, C' = C - L P, J' = J + P C' - C^T P.
    """
    linear, angular = _symmetrized(_turned(inertia.linear, R)), _symmetrized(_turned(inertia.angular, R))
    coupling = _turned(inertia.coupling, R)
    shifted = matrix_sum(coupling, _minus_times_cross(linear, p))
    arm = _cross_times(p, shifted)
    back = _minus_times_cross(transpose(coupling), p)
    return Inertia(linear, shifted, _symmetrized(matrix_sum(angular, matrix_sum(arm, back))))


def _turned(m: Mat, R: Mat) -> Mat:
    return product(product(R, m), transpose(R))


def _symmetrized(m: Mat) -> Mat:
    """Return the matrix with its lower triangle read for the upper one."""
    return symmetric((m[0][0], m[1][1], m[2][2], m[1][0], m[2][0], m[2][1]))


def _minus_times_cross(m: Mat, p: Vec) -> Mat:
    """Return -M [p]: each row r becomes p x r."""
    return cross(p, m[0]), cross(p, m[1]), cross(p, m[2])


def _cross_times(p: Vec, m: Mat) -> Mat:
    """Return [p] M: each column c becomes p x c."""
    columns = [cross(p, column) for column in transpose(m)]
    return transpose((columns[0], columns[1], columns[2]))


def _lower_difference(m: Mat, u: Vec, k: Vec) -> Mat:
    """Return M - u k^T for symmetric M and u k^T; each element of a triangle is formed once."""
    places = ((0, 0), (1, 1), (2, 2), (1, 0), (2, 0), (2, 1))
    return symmetric([m[i][j] - _share(u[i], k[i], u[j], k[j]) for i, j in places])


def _over(u: Vec, pivot: S) -> Vec:
    """Return U / d; the component that is the pivot itself becomes an exact 1."""
    inverse = 1 / pivot
    x, y, z = (1 if component is pivot else component * inverse for component in u)
    return x, y, z


def _share(u_i: S, k_i: S, u_j: S, k_j: S) -> S:
    """Return u_i u_j / d; through an exact 1 it is the element itself, so that the eliminated row becomes exactly 0."""
    return u_j if k_i == 1 else u_i * k_j


def _scaled(wrench: Wrench, factor: S) -> Wrench:
    return scale(factor, wrench[0]), scale(factor, wrench[1])


def _to_parent(moved: BodyMotion, wrench: Wrench) -> Wrench:
    force = apply(moved.R_PB, wrench[0])
    return force, add(apply(moved.R_PB, wrench[1]), cross(moved.p_PB, force))


def _from_parent(moved: BodyMotion, parent: tuple[Vec, Vec]) -> tuple[Vec, Vec]:
    a, alpha = parent
    return apply_transposed(moved.R_PB, add(a, cross(alpha, moved.p_PB))), apply_transposed(moved.R_PB, alpha)


_NOTHING = (ZERO_VECTOR, ZERO_VECTOR)
