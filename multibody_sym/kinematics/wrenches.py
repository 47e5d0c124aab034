"""Wrenches on bodies and their projection on the speeds (virtual power), in one backward recursion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from multibody_sym.kinematics.motion import BodyMotion, Motion
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.scalars.vectors import (
    ZERO_VECTOR,
    S,
    Vec,
    add,
    apply,
    apply_transposed,
    cross,
    dot,
    negate,
    subtract,
)

Wrench = tuple[Vec, Vec]
"""(force, moment about the body's origin), in body axes."""
NO_WRENCH: Final[Wrench] = (ZERO_VECTOR, ZERO_VECTOR)


class Wrenches:
    """Wrenches collected body by body while forces are gathered; ground takes and forgets."""

    def __init__(self, count: int) -> None:
        self.of_body: list[Wrench] = [NO_WRENCH] * count

    def add(self, body: int, force: Vec, moment: Vec) -> None:
        """Add a wrench in body axes about the body's origin."""
        if body >= 0:
            f, m = self.of_body[body]
            self.of_body[body] = (add(f, force), add(m, moment))


def add_force(wrenches: Wrenches, motion: Motion, marker: Marker, force: Vec) -> None:
    """Add a force with world components that acts at a marker."""
    if marker.body >= 0:
        in_body = apply_transposed(motion.rotation(marker.body), force)
        wrenches.add(marker.body, in_body, cross(motion.point(marker), in_body))


def add_force_at(wrenches: Wrenches, motion: Motion, body: int, place: Vec, force: Vec) -> None:
    """Add a force that acts on a body at a place in space (world axes)."""
    if body >= 0:
        R_WB, p_WB = motion.poses[body]
        in_body = apply_transposed(R_WB, force)
        wrenches.add(body, in_body, cross(apply_transposed(R_WB, subtract(place, p_WB)), in_body))


def add_moment(wrenches: Wrenches, motion: Motion, body: int, moment: Vec) -> None:
    """Add a moment (world axes) on a body."""
    wrenches.add(body, ZERO_VECTOR, apply_transposed(motion.rotation(body), moment))


def add_pair(wrenches: Wrenches, motion: Motion, ends: Sequence[Marker], force: Vec) -> None:
    """Add a force (world components) on the first of two markers and its opposite on the second."""
    add_force(wrenches, motion, ends[0], force)
    add_force(wrenches, motion, ends[1], negate(force))


def generalized_forces(motion: Motion, of_body: Sequence[Wrench]) -> list[S]:
    """Return the generalised forces of wrenches: Q_k = sum F . dv/du_k + M . domega/du_k."""
    return joint_projection(motion, carried(motion, of_body))


def carried(motion: Motion, of_body: Sequence[Wrench]) -> list[Wrench]:
    """Return, for each body, the sum of the wrenches on it and on all bodies it carries, about its origin.

    Rows act on few bodies: where none is carried it stays NO_WRENCH.
    """
    total = list(of_body)
    for index in range(len(total) - 1, -1, -1):
        parent = motion.mechanism.bodies[index].parent
        if parent >= 0 and total[index] is not NO_WRENCH:
            force, moment = to_parent(motion.bodies[index], total[index])
            total[parent] = (add(total[parent][0], force), add(total[parent][1], moment))
    return total


def to_parent(moved: BodyMotion, wrench: Wrench) -> Wrench:
    """Return a wrench about the parent's origin, in the parent's axes."""
    force = apply(moved.R_PB, wrench[0])
    return force, add(apply(moved.R_PB, wrench[1]), cross(moved.p_PB, force))


def joint_projection(motion: Motion, wrenches: Sequence[Wrench]) -> list[S]:
    """Return A^T R: the components of each body's wrench along the free directions of its joint."""
    projected: list[S] = []
    for moved, wrench in zip(motion.bodies, wrenches, strict=True):
        if wrench is NO_WRENCH:
            projected += [0] * len(moved.linear)
            continue
        force, moment = wrench
        for linear, angular in zip(moved.linear, moved.angular, strict=True):
            projected.append(dot(linear, force) + dot(angular, moment))
    return projected
