"""What a wire exerts on its bead across itself."""

from __future__ import annotations

from multibody_sym.kinematics.state import State
from multibody_sym.model.declaration.curves.follow import Follow
from multibody_sym.model.mechanism.mechanism import TreeBody
from multibody_sym.scalars.functions import sqrt
from multibody_sym.scalars.node import ZERO
from multibody_sym.scalars.vectors import S, Vec, combination, dot, scale, subtract


def force_across(body: TreeBody, state: State, force: Vec) -> S | None:
    """Return the part of a joint's force (axes of its frame on the parent) across the curve on which it guides, if any.

    Of a curve in its x-y plane the component along the normal, z x tangent: to the left of the way; of one in space the
    size of the force across it.
    """
    step = body.steps[0] if body.steps else None
    if not isinstance(step, Follow):
        return None
    (s,) = [state.q[body.q[0]]] if step.motion is None else state.values([step.motion])
    axes = [(x, y, z) for x, y, z in (state.values(axis) for axis in step.axes)]
    if step.place[2] is ZERO:
        cosine, sine = state.values(step.tangent, {step.leaf: s})
        return cosine * dot(axes[1], force) - sine * dot(axes[0], force)
    way = combination(axes, state.values(step.rates.s, {step.leaf: s}))
    across = subtract(force, scale(dot(way, force) / dot(way, way), way))
    return sqrt(dot(across, across))
