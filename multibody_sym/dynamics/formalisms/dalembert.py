"""d'Alembert's principle in Lagrange's form, the general equation of dynamics: no T, no recursion of forces.

On virtual displacements the applied and inertia forces of all bodies do no work:

    sum (F - m a_C) . dr_C + (mu - J alpha - omega x J omega) . dtheta = 0

Each body's forces are projected on its own partial velocities dv_C/du_k, domega/du_k of all speeds that move it:

    M_kl = sum m v_k . v_l + omega_k . J omega_l

Source: Wittenburg, Dynamics of Multibody Systems, section 5.2.
"""

from __future__ import annotations

from multibody_sym.dynamics.formalisms.equations import EquationsOfMotion, equations
from multibody_sym.dynamics.formalisms.inverse_dynamics import inertia_wrenches
from multibody_sym.kinematics.loads import applied
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.partial_velocities import PartialVelocities, partial_velocities
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import State
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.scalars.vectors import S, add, apply, cross, dot, scale


def dalembert_lagrange(mechanism: Mechanism, state: State) -> EquationsOfMotion:
    """Return the equations of motion at a state."""
    motion = motion_of(mechanism, state)
    count = len(state.u)
    matrix: list[list[S]] = [[0] * count for _ in range(count)]
    forces = applied(motion)
    active, inertial = list(forces.of_speed), [0] * count
    needed = inertia_wrenches(motion, [0] * count)
    for index, partials in enumerate(partial_velocities(motion)):
        _add_inertia(matrix, motion, index, partials)
        for k, (linear, angular) in partials.items():
            force, moment = forces.of_body[index]
            active[k] = active[k] + (dot(linear, force) + dot(angular, moment))
            force, moment = needed[index]
            inertial[k] = inertial[k] + (dot(linear, force) + dot(angular, moment))
    return equations(motion, matrix, active, inertial, row_motions(motion))


def _add_inertia(matrix: list[list[S]], motion: Motion, index: int, partials: PartialVelocities) -> None:
    """Add one body's m v_k . v_l + omega_k . J omega_l, of the centre of mass, for all pairs of its speeds."""
    mass = motion.masses[index]
    at_com = {k: (add(v, cross(w, mass.com)), w) for k, (v, w) in partials.items()}
    for l, (v, w) in at_com.items():
        momentum, spin = scale(mass.mass, v), apply(mass.inertia, w)
        for k, (linear, angular) in at_com.items():
            if k <= l:
                matrix[k][l] = matrix[k][l] + (dot(linear, momentum) + dot(angular, spin))
                matrix[l][k] = matrix[k][l]
