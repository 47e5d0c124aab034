"""Inertias of rigid and of articulated bodies about a body's origin, in its axes, and base inertial parameters."""

from __future__ import annotations

from typing import Final

from multibody_sym.mechanics.mechanism import TreeBody
from multibody_sym.mechanics.motion import BodyMass, BodyMotion, Motion
from multibody_sym.mechanics.points import Wrench
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import is_exactly
from multibody_sym.scalars.node import ZERO, Node, constant_of
from multibody_sym.scalars.vectors import (
    UNIT_MATRIX,
    ZERO_VECTOR,
    Mat,
    S,
    Vec,
    add,
    apply,
    apply_transposed,
    cross,
    lower_triangle,
    matrix_sum,
    scale,
    steiner,
    subtract,
    symmetric,
    transpose,
    turned_symmetric,
    turned_tensor,
)

TRIANGLE: Final = ((0, 0), (1, 1), (2, 2), (1, 0), (2, 0), (2, 1))
"""Places of the six elements of a symmetric matrix."""


@dataclass(frozen=True)
class RigidInertia:
    """Mass m, first moment h = m c and inertia J about the body's origin, in the body's axes.

    All three are linear in the distribution of mass, so that inertias add; they need not be those of a real body.
    """

    mass: S
    moment: Vec
    inertia: Mat

    def wrench(self, linear: Vec, angular: Vec) -> Wrench:
        """Return the wrench that gives the body, at rest, these accelerations of its origin and of rotation."""
        force = add(scale(self.mass, linear), cross(angular, self.moment))
        return force, add(apply(self.inertia, angular), cross(self.moment, linear))

    def rate_of_momentum(self, a: Vec, spread: Mat) -> Wrench:
        """Return (m a + S h, 2 axial(S E) + h x a) of a moving body, with `spread` S = [alpha] + [omega][omega].

        E = tr(J)/2 - J is the integral of r r^T dm, and 2 axial(S E) = J alpha + omega x J omega in fewer operations.
        """
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = self.inertia
        half = (xx + yy + zz) / 2
        (sxx, sxy, sxz), (syx, syy, syz), (szx, szy, szz) = spread
        turning = (  # each coefficient of E once
            szy * (half - yy) - syz * (half - zz) + (syy - szz) * yz + syx * xz - szx * xy,
            sxz * (half - zz) - szx * (half - xx) + (szz - sxx) * xz + szy * xy - sxy * yz,
            syx * (half - xx) - sxy * (half - yy) + (sxx - syy) * xy + sxz * yz - syz * xz,
        )
        return add(scale(self.mass, a), apply(spread, self.moment)), add(turning, cross(self.moment, a))

    def plus(self, other: RigidInertia) -> RigidInertia:
        return RigidInertia(
            self.mass + other.mass, add(self.moment, other.moment), matrix_sum(self.inertia, other.inertia)
        )

    def moved(self, R: Mat, p: Vec) -> RigidInertia:
        """Return the same in the parent's axes: with h = R m c, J' = R J R^T - [p][h] - [h][p] - m [p][p]."""
        h = apply(R, self.moment)
        moment = add(h, scale(self.mass, p))
        shift = lower_triangle(matrix_sum(steiner(h, p), steiner(p, moment)))
        return RigidInertia(self.mass, moment, matrix_sum(turned_symmetric(R, self.inertia), shift))


def about_origin(mass: BodyMass) -> RigidInertia:
    moment = scale(mass.mass, mass.com)
    return RigidInertia(mass.mass, moment, matrix_sum(mass.inertia, steiner(moment, mass.com)))


NOTHING = RigidInertia(0, ZERO_VECTOR, (ZERO_VECTOR, ZERO_VECTOR, ZERO_VECTOR))


# ----------------------------------------------------------------------------------------------------------------------
# Inertias of articulated bodies: symmetric 6 x 6, about a body's origin and in its axes, as blocks of 3 x 3.


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
        columns = [cross(p, column) for column in transpose(shifted)]
        arm = transpose((columns[0], columns[1], columns[2]))
        back = _minus_times_cross(transpose(coupling), p)
        return Inertia(linear, shifted, lower_triangle(matrix_sum(angular, matrix_sum(arm, back))))


def rigid_inertia(mass: BodyMass) -> Inertia:
    return articulated_inertia(about_origin(mass))


def articulated_inertia(rigid: RigidInertia) -> Inertia:
    """Return a rigid body's inertia [[m E, -m c~], [m c~, J]], J about the origin."""
    m, (x, y, z) = rigid.mass, rigid.moment
    return Inertia(((m, 0, 0), (0, m, 0), (0, 0, m)), ((0, z, -y), (-z, 0, x), (y, -x, 0)), rigid.inertia)


def _minus_times_cross(m: Mat, p: Vec) -> Mat:
    """Return -M [p]: each row r becomes p x r."""
    return cross(p, m[0]), cross(p, m[1]), cross(p, m[2])


def _lower_difference(m: Mat, u: Vec, k: Vec) -> Mat:
    """Return M - u k^T for symmetric M and u k^T; each element of a triangle is formed once."""
    return symmetric([m[i][j] - _share(u[i], k[i], u[j], k[j]) for i, j in TRIANGLE])


def _share(u_i: S, k_i: S, u_j: S, k_j: S) -> S:
    """Return u_i u_j / d; through an exact 1 it is the element itself, so that the eliminated row becomes exactly 0."""
    return u_j if k_i == 1 else u_i * k_j


# ----------------------------------------------------------------------------------------------------------------------
# Base inertial parameters: the part of a body's inertia that its joint cannot feel belongs to the parent.
#
# A weld hands over everything; a hinge the mass, the first moment along its axis and a rod on it; a slide the inertia;
# a ball the mass. The equations of motion stay the same, and fewer numbers enter them.
#
# Source: Gautier and Khalil (1990), Direct calculation of minimum set of inertial parameters of serial robots.


def base_inertias(motion: Motion) -> list[RigidInertia]:
    """Return inertias of all bodies that give the same equations of motion, with few numbers in them.

    Bodies whose numbers are parameters or floats keep their own: sums of them would take operations.
    """
    found = [about_origin(mass) for mass in motion.masses]
    for index in range(len(found) - 1, -1, -1):
        body, own = motion.mechanism.bodies[index], found[index]
        numbers = (own.mass, *own.moment, *(x for row in own.inertia for x in row))
        if motion.state.scalar is Node and all(constant_of(x) is not None for x in numbers):
            found[index], handed = split_at_joint(body, motion.bodies[index], own)
            if body.parent >= 0:
                found[body.parent] = found[body.parent].plus(handed)
    return found


def split_at_joint(body: TreeBody, moved: BodyMotion, inertia: RigidInertia) -> tuple[RigidInertia, RigidInertia]:
    """Return the part of a body's inertia that its joint feels, in the body's axes, and the rest, in the parent's."""
    if not body.steps:
        return NOTHING, inertia.moved(moved.R_PB, moved.p_PB)
    if len(body.steps) == 1 and not body.steps[0].turns:
        turning = RigidInertia(0, ZERO_VECTOR, inertia.inertia)
        return RigidInertia(inertia.mass, inertia.moment, NOTHING.inertia), turning.moved(moved.R_PB, ZERO_VECTOR)
    if not any(step.slides for step in body.steps) and all(x is ZERO for x in body.frame_on_body.position):
        if len(body.u) == len(body.steps) == 1:
            along = [k for k in range(3) if not is_exactly(moved.angular[0][k], 0)]
            if len(along) == 1:  # it turns about a coordinate axis
                return _split_on_axis(along[0], inertia, moved)
        handed = RigidInertia(inertia.mass, ZERO_VECTOR, NOTHING.inertia).moved(UNIT_MATRIX, moved.p_PB)
        return RigidInertia(0, inertia.moment, inertia.inertia), handed
    return inertia, NOTHING


def _split_on_axis(k: int, inertia: RigidInertia, moved: BodyMotion) -> tuple[RigidInertia, RigidInertia]:
    """Split off a mass, a first moment and a thin rod on the coordinate axis k about which the body turns.

    The rod takes the second moment along the axis, integral z^2 dm = (Jxx + Jyy - Jzz) / 2 for the axis z.
    """
    J = inertia.inertia
    rod = (J[0][0] + J[1][1] + J[2][2]) / 2 - J[k][k]
    diagonal = [J[i][i] if i == k else J[i][i] - rod for i in range(3)]
    x, y, z = (0 if i == k else m for i, m in enumerate(inertia.moment))
    kept = RigidInertia(0, (x, y, z), symmetric([*diagonal, J[1][0], J[2][0], J[2][1]]))
    axis = (moved.R_PB[0][k], moved.R_PB[1][k], moved.R_PB[2][k])
    on_axis = RigidInertia(inertia.mass, scale(inertia.moment[k], axis), steiner(scale(rod, axis), axis))
    return kept, on_axis.moved(UNIT_MATRIX, moved.p_PB)
