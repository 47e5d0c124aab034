"""What a joint lets happen, over any scalar: the motion of its frame M relative to F, step by step.

Vectors that describe the motion are in M's axes. One rule serves all joints: a joint is its elementary steps, and a
ball if free rotation follows them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

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
    arm, w = scale(q, axis), before.turning
    along = scale(u, axis)
    bias = add(cross(before.angular_bias, arm), cross(w, add(cross(w, arm), add(along, along))))
    return replace(
        before,
        position=add(before.position, apply(before.rotation, arm)),
        linear=(*(add(v, cross(w_k, arm)) for v, w_k in zip(before.linear, before.angular, strict=True)), axis),
        angular=(*before.angular, ZERO_VECTOR),
        given_linear=add(before.given_linear, cross(before.given_angular, arm)),
        linear_bias=add(before.linear_bias, bias),
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
