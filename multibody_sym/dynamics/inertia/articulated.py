"""Inertias of articulated bodies: symmetric 6 x 6, about a body's origin and in its axes, as blocks of 3 x 3."""

from __future__ import annotations

from multibody_sym.dynamics.inertia.rigid import RigidInertia, about_origin
from multibody_sym.kinematics.motion import BodyMass
from multibody_sym.kinematics.wrenches import Wrench
from multibody_sym.records import dataclass
from multibody_sym.scalars.tensors import lower_triangle, turned_symmetric, turned_tensor
from multibody_sym.scalars.vectors import (
    Mat,
    S,
    Vec,
    add,
    apply,
    apply_transposed,
    cross,
    matrix_sum,
    subtract,
    symmetric,
    transpose,
)


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

    def moved(self, R: Mat, p: Vec) -> Inertia:
        """Return a child's inertia about the parent's origin, in the parent's axes.

        With P = [p] and turned blocks L, C, J: L' = L, C' = C - L P, J' = J + P C' - C^T P.
        """
        linear, angular = turned_symmetric(R, self.linear), turned_symmetric(R, self.angular)
        coupling = turned_tensor(R, self.coupling)
        shifted = matrix_sum(coupling, _minus_times_cross(linear, p))
        arm = _cross_times(p, shifted)
        back = _minus_times_cross(transpose(coupling), p)
        return Inertia(linear, shifted, lower_triangle(matrix_sum(angular, matrix_sum(arm, back))))


def rigid_inertia(mass: BodyMass) -> Inertia:
    """Return the inertia of a body alone."""
    return articulated(about_origin(mass))


def articulated(rigid: RigidInertia) -> Inertia:
    """Return a rigid body's inertia [[m E, -m c~], [m c~, J]], J about the origin."""
    m, (x, y, z) = rigid.mass, rigid.moment
    return Inertia(((m, 0, 0), (0, m, 0), (0, 0, m)), ((0, z, -y), (-z, 0, x), (y, -x, 0)), rigid.inertia)


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


def _share(u_i: S, k_i: S, u_j: S, k_j: S) -> S:
    """Return u_i u_j / d; through an exact 1 it is the element itself, so that the eliminated row becomes exactly 0."""
    return u_j if k_i == 1 else u_i * k_j
