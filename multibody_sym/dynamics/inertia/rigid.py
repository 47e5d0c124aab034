"""Inertias of rigid bodies: mass, first moment and second moments about a body's origin, in its axes."""

from __future__ import annotations

from multibody_sym.kinematics.motion import BodyMass
from multibody_sym.kinematics.wrenches import Wrench
from multibody_sym.records import dataclass
from multibody_sym.scalars.tensors import lower_triangle, turned_symmetric
from multibody_sym.scalars.vectors import (
    ZERO_VECTOR,
    Mat,
    S,
    Vec,
    add,
    apply,
    cross,
    matrix_sum,
    scale,
    steiner,
)


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
        """Return both as one."""
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
    """Return a body's inertia about its origin."""
    moment = scale(mass.mass, mass.com)
    return RigidInertia(mass.mass, moment, matrix_sum(mass.inertia, steiner(moment, mass.com)))


NOTHING = RigidInertia(0, ZERO_VECTOR, (ZERO_VECTOR, ZERO_VECTOR, ZERO_VECTOR))
