"""Base inertial parameters: what a joint cannot feel of its body's inertia belongs to the parent.

A weld hands over everything; a hinge the mass, the first moment along its axis and a rod on it; a slide the inertia;
a ball the mass. The equations of motion stay the same, and fewer numbers enter them.

Source: Gautier and Khalil (1990), Direct calculation of minimum set of inertial parameters of serial robots.
"""

from __future__ import annotations

from multibody_sym.dynamics.inertia.rigid import NOTHING, RigidInertia, about_origin
from multibody_sym.kinematics.motion import BodyMotion, Motion
from multibody_sym.model.mechanism.mechanism import TreeBody
from multibody_sym.scalars.functions import is_exactly
from multibody_sym.scalars.node import ZERO, Node
from multibody_sym.scalars.vectors import UNIT_MATRIX, ZERO_VECTOR, Vec, scale, steiner, symmetric


def base_inertias(motion: Motion) -> list[RigidInertia]:
    """Return inertias of all bodies that give the same equations of motion, with few numbers in them.

    Where a body's numbers are parameters or floats it keeps its own: sums of them would take operations.
    """
    found = [about_origin(mass) for mass in motion.masses]
    for index in range(len(found) - 1, -1, -1):
        body, moved = motion.mechanism.bodies[index], motion.bodies[index]
        if _is_known(found[index]):
            found[index], handed = handed_over(body, moved, found[index])
            if body.parent >= 0:
                found[body.parent] = found[body.parent].plus(handed)
    return found


def handed_over(body: TreeBody, moved: BodyMotion, inertia: RigidInertia) -> tuple[RigidInertia, RigidInertia]:
    """Return what the joint feels of a body's inertia, in the body's axes, and the rest, in the parent's."""
    if not body.steps:
        return NOTHING, inertia.moved(moved.R_PB, moved.p_PB)
    if len(body.steps) == 1 and not body.steps[0].turns:
        turning = RigidInertia(0, ZERO_VECTOR, inertia.inertia)
        return RigidInertia(inertia.mass, inertia.moment, NOTHING.inertia), turning.moved(moved.R_PB, ZERO_VECTOR)
    if not any(step.slides for step in body.steps) and all(x is ZERO for x in body.frame_on_body.position):
        axis = _coordinate_axis(moved.angular[0]) if len(body.u) == len(body.steps) == 1 else None
        return _at_a_point(inertia, moved) if axis is None else _on_an_axis(axis, inertia, moved)
    return inertia, NOTHING


def _is_known(inertia: RigidInertia) -> bool:
    numbers = (inertia.mass, *inertia.moment, *(x for row in inertia.inertia for x in row))
    return all(isinstance(x, int) or (isinstance(x, Node) and x.shadow is not None) for x in numbers)


def _coordinate_axis(direction: Vec) -> int | None:
    across = [k for k in range(3) if not is_exactly(direction[k], 0)]
    return across[0] if len(across) == 1 else None


def _at_a_point(inertia: RigidInertia, moved: BodyMotion) -> tuple[RigidInertia, RigidInertia]:
    """Split off the mass, at the body's origin, about which it turns."""
    handed = RigidInertia(inertia.mass, ZERO_VECTOR, NOTHING.inertia).moved(UNIT_MATRIX, moved.p_PB)
    return RigidInertia(0, inertia.moment, inertia.inertia), handed


def _on_an_axis(k: int, inertia: RigidInertia, moved: BodyMotion) -> tuple[RigidInertia, RigidInertia]:
    """Split off a mass, a first moment and a thin rod, all on the coordinate axis k about which the body turns.

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
