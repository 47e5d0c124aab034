"""Hybrid dynamics: some joints' accelerations are given, the others' forces; the tree is swept once.

With all accelerations given it is inverse dynamics, with none forward dynamics.

Source: Featherstone, Rigid Body Dynamics Algorithms, section 9.2.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from multibody_sym.dynamics.inverse_dynamics import unbalanced_wrenches
from multibody_sym.dynamics.sweep import Sweep, swept_joints
from multibody_sym.kinematics.loads import applied
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.wrenches import joint_projection
from multibody_sym.scalars.vectors import S


def hybrid_dynamics(motion: Motion, given: Collection[int], udot: Sequence[S]) -> tuple[list[S], list[S]]:
    """Return all accelerations (nu), and the generalised forces (nu) that hold the given ones.

    The joints of the bodies `given` have the accelerations `udot` (nu; the others' are not read), all others move
    under the loads. The forces come on top of the loads; they are zero where nothing is given.
    """
    held = {k for index in given for k in motion.mechanism.bodies[index].u}
    begin = [x if k in held else 0 for k, x in enumerate(udot)]
    forces = applied(motion)
    found, wrenches = Sweep(motion, swept_joints(motion, given)).swept(
        unbalanced_wrenches(motion, begin, forces.of_body), forces.of_speed
    )
    transmitted = joint_projection(motion, wrenches)
    needed = [
        transmitted[k] - drive if k in held else 0 for k, drive in enumerate(forces.of_speed)
    ]
    return [a + b for a, b in zip(begin, found, strict=True)], needed
