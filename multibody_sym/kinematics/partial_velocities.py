"""Partial velocities: how each body moves at unit speed of one freedom and, just so, accelerates at unit udot."""

from __future__ import annotations

from collections.abc import Mapping

from multibody_sym.kinematics.motion import Motion, from_parent
from multibody_sym.scalars.vectors import Vec

PartialVelocities = Mapping[int, tuple[Vec, Vec]]
"""For each speed that moves a body: velocity of its origin and angular velocity at unit speed, in its axes."""


def partial_velocities(motion: Motion) -> list[PartialVelocities]:
    """Return each body's partial velocities with respect to the speeds that move it."""
    found: list[PartialVelocities] = []
    for body, moved in zip(motion.mechanism.bodies, motion.bodies, strict=True):
        parent = found[body.parent] if body.parent >= 0 else {}
        carried = {k: from_parent(moved, partial) for k, partial in parent.items()}
        own = dict(zip(body.u, zip(moved.linear, moved.angular, strict=True), strict=True))
        found.append({**carried, **own})
    return found
