"""What a joint lets happen, over any scalar: the motion of its frame M relative to F, step by step.

Vectors that describe the motion are in M's axes. One rule serves all joints: a joint is its elementary steps, and a
ball if free rotation follows them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from multibody_sym.records import dataclass
from multibody_sym.scalars.rotations import turned
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
    product,
    scale,
    subtract,
)


@dataclass(frozen=True)
class JointMotion:
    """The motion of M relative to F.

    `rotation` R_FM, `position` of M in F's axes; `linear[k]`, `angular[k]`: velocity and angular velocity of M for a
    unit speed u[k], in M's axes; `given_linear`, `given_angular`: what prescribed steps add to them; `turning`: its
    whole angular velocity; `linear_bias`, `angular_bias`: its acceleration and angular acceleration relative to F
    without udot.
    """

    rotation: Mat = UNIT_MATRIX
    position: Vec = ZERO_VECTOR
    linear: tuple[Vec, ...] = ()
    angular: tuple[Vec, ...] = ()
    given_linear: Vec = ZERO_VECTOR
    given_angular: Vec = ZERO_VECTOR
    turning: Vec = ZERO_VECTOR
    linear_bias: Vec = ZERO_VECTOR
    angular_bias: Vec = ZERO_VECTOR


def translated(before: JointMotion, axis: Vec, q: S, u: S) -> JointMotion:
    """Return the motion when M has moved on by q along a unit axis: the velocity of M gains u a + omega x q a."""
    return _moved(before, scale(q, axis), axis, scale(u, axis))


def _moved(before: JointMotion, arm: Vec, way: Vec, along: Vec) -> JointMotion:
    """Return the motion when M has moved on by an arm that changes by `way` a unit speed, and now at the rate `along`.

    What the arm's rate changes by itself is left out.
    """
    w = before.turning
    bias = add(cross(before.angular_bias, arm), cross(w, add(cross(w, arm), add(along, along))))
    return replace(
        before,
        position=add(before.position, apply(before.rotation, arm)),
        linear=(*(add(v, cross(w_k, arm)) for v, w_k in zip(before.linear, before.angular, strict=True)), way),
        angular=(*before.angular, ZERO_VECTOR),
        given_linear=add(before.given_linear, cross(before.given_angular, arm)),
        linear_bias=add(before.linear_bias, bias),
    )


@dataclass(frozen=True)
class Way:
    """How a vector (or, in its last component, an angle) follows a parameter s and t: derivatives along s and in t."""

    s: Vec
    t: Vec
    ss: Vec
    st: Vec
    tt: Vec

    def rate(self, u: S) -> Vec:
        """Return its rate where s' = u."""
        return add(scale(u, self.s), self.t)

    def bias(self, u: S) -> Vec:
        """Return the rate of that, without s''."""
        return add(scale(u, add(scale(u, self.ss), scale(2, self.st))), self.tt)


def followed(before: JointMotion, place: Vec, way: Way, u: S) -> JointMotion:
    """Return the motion when M has moved on to a place on a curve, by its parameter, whose rate is u."""
    moved = _moved(before, place, way.s, way.rate(u))
    return replace(
        moved, given_linear=add(moved.given_linear, way.t), linear_bias=add(moved.linear_bias, way.bias(u))
    )


def turned_along(moved: JointMotion, rotation: Mat, axis: Vec, angle: Way, u: S) -> JointMotion:
    """Return the motion when M, which its last step has moved by the speed u, has turned about an axis by an angle."""
    found = rotated(moved, rotation, (axis,), (angle.rate(u)[2],))
    given, bias = scale(angle.t[2], axis), scale(angle.bias(u)[2], axis)
    return replace(
        found,
        linear=found.linear[:-1],
        angular=(*found.angular[:-2], scale(angle.s[2], axis)),
        given_angular=add(found.given_angular, given),
        angular_bias=add(found.angular_bias, bias),
    )


def rotated(before: JointMotion, rotation: Mat, axes: Sequence[Vec], u: Sequence[S]) -> JointMotion:
    """Return the motion when M has turned: angular velocity sum u_k a_k, with the axes a_k constant in the new M."""
    carried = apply_transposed(rotation, before.turning)
    own: Vec = ZERO_VECTOR
    for axis, rate in zip(axes, u, strict=True):
        own = add(own, scale(rate, axis))
    return JointMotion(
        rotation=product(before.rotation, rotation),
        position=before.position,
        linear=(*(apply_transposed(rotation, v) for v in before.linear), *(ZERO_VECTOR for _ in axes)),
        angular=(*(apply_transposed(rotation, w) for w in before.angular), *axes),
        given_linear=apply_transposed(rotation, before.given_linear),
        given_angular=apply_transposed(rotation, before.given_angular),
        turning=add(carried, own),
        linear_bias=apply_transposed(rotation, before.linear_bias),
        angular_bias=add(apply_transposed(rotation, before.angular_bias), cross(carried, own)),
    )


def screwed(before: JointMotion, axis: Vec, lead: S, q: S, u: S) -> JointMotion:
    """Return the motion when M has turned by q about a unit axis and advanced by lead q along it."""
    moved = translated(before, axis, lead * q, lead * u)
    turned_too = rotated(moved, turned(axis, q), (axis,), (u,))
    return replace(
        turned_too,
        linear=(*turned_too.linear[:-2], scale(lead, axis)),
        angular=(*turned_too.angular[:-2], axis),
    )


def prescribed(after: JointMotion, rate: S, acceleration: S) -> JointMotion:
    """Return the motion where the last step, which has moved at `rate`, is not free but moves so by itself."""
    (*linear, v), (*angular, w) = after.linear, after.angular
    return replace(
        after,
        linear=tuple(linear),
        angular=tuple(angular),
        given_linear=add(after.given_linear, scale(rate, v)),
        given_angular=add(after.given_angular, scale(rate, w)),
        linear_bias=add(after.linear_bias, scale(acceleration, v)),
        angular_bias=add(after.angular_bias, scale(acceleration, w)),
    )


def seen_from(joint: JointMotion, R_BM: Mat, p_BM: Vec) -> JointMotion:
    """Return the velocities and accelerations of another point of the moving body instead of M, in its axes.

    M stands at p_BM from that point, turned by R_BM.
    """
    if R_BM is UNIT_MATRIX and p_BM is ZERO_VECTOR:
        return joint
    angular = tuple(apply(R_BM, w) for w in joint.angular)
    linear = tuple(subtract(apply(R_BM, v), cross(w, p_BM)) for v, w in zip(joint.linear, angular, strict=True))
    turning, angular_bias = apply(R_BM, joint.turning), apply(R_BM, joint.angular_bias)
    given_angular = apply(R_BM, joint.given_angular)
    offset = add(cross(angular_bias, p_BM), cross(turning, cross(turning, p_BM)))
    return replace(
        joint,
        linear=linear,
        angular=angular,
        given_linear=subtract(apply(R_BM, joint.given_linear), cross(given_angular, p_BM)),
        given_angular=given_angular,
        turning=turning,
        linear_bias=subtract(apply(R_BM, joint.linear_bias), offset),
        angular_bias=angular_bias,
    )
