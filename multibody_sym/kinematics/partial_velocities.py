"""Partial velocities: how each body moves at unit speed of one freedom and, just so, accelerates at unit udot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from multibody_sym.kinematics.motion import Motion, from_parent
from multibody_sym.scalars.vectors import Vec

PartialVelocities = Mapping[int, tuple[Vec, Vec]]
"""For each speed that moves a body: velocity of its origin and angular velocity at unit speed, in its axes."""
_TURNS: Final = 3
_LOCKED: Final = 1e-3
"""The volume that the axes of three turns span, below which they do not span space."""


def partial_velocities(motion: Motion) -> list[PartialVelocities]:
    """Return each body's partial velocities with respect to the speeds that move it."""
    found: list[PartialVelocities] = []
    for body, moved in zip(motion.mechanism.bodies, motion.bodies, strict=True):
        parent = found[body.parent] if body.parent >= 0 else {}
        carried = {k: from_parent(moved, partial) for k, partial in parent.items()}
        own = dict(zip(body.u, zip(moved.linear, moved.angular, strict=True), strict=True))
        found.append({**carried, **own})
    return found


def locked(motion: Motion, place: int) -> str | None:
    """Return that the first and the third of a body's three successive turns have one axis, over floats; else None."""
    body, moved = motion.mechanism.bodies[place], motion.bodies[place]
    turns = [free for free in body.free_steps if free.step.is_hinge]
    axes = [moved.angular[body.u.index(free.u[0])] for free in turns]
    if len(turns) != _TURNS or abs(np.linalg.det(np.array(axes, dtype=float))) > _LOCKED:
        return None
    first, _, third = (motion.mechanism.coordinates[free.q[0]].name for free in turns)
    return (
        f"{first} and {third} turn {body.name} about one axis there, and their rates have no bound: leave out "
        f"angles: of joint {body.joint_name}, which then has a quaternion, or choose others"
    )
