"""Composite bodies and recursive Newton-Euler: mass matrix and velocity terms of a tree.

Each column of M is the wrench that accelerates the rigid composite of all bodies a joint carries (Walker and Orin,
1982; Featherstone, Rigid Body Dynamics Algorithms, section 6.2).
"""

from __future__ import annotations

from collections.abc import Sequence

from multibody_sym.dynamics.formalisms.equations import EquationsOfMotion, equations
from multibody_sym.dynamics.formalisms.inertia import RigidInertia, base_inertias
from multibody_sym.mechanics.alignment import economical_motion
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion, State, accelerations, motion_of, partial_velocities, spread
from multibody_sym.mechanics.points import Wrench, carried_wrenches, joint_projection, to_parent
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.scalars.vectors import S, add, apply, cross, dot, negate, scale, subtract

# ----------------------------------------------------------------------------------------------------------------------
# Recursive Newton-Euler: the forces that given accelerations need, and the wrench that every joint transmits.
#
# Source: Luh, Walker and Paul (1980); in the form of Featherstone, Rigid Body Dynamics Algorithms, section 5.3, with
# accelerations of points instead of spatial ones.


def inertia_wrenches(motion: Motion, udot: Sequence[S]) -> list[Wrench]:
    """Return each body's rate of momentum: (m a_C, J alpha + omega x J omega + c x m a_C), about its origin."""
    wrenches = []
    for moved, mass, (a, alpha) in zip(motion.bodies, motion.masses, accelerations(motion, udot), strict=True):
        force = scale(mass.mass, add(a, apply(spread(alpha, moved.w_WB), mass.com)))
        spin = cross(moved.w_WB, apply(mass.inertia, moved.w_WB))
        wrenches.append((force, add(add(apply(mass.inertia, alpha), spin), cross(mass.com, force))))
    return wrenches


def inverse_dynamics(motion: Motion, udot: Sequence[S]) -> list[S]:
    """Return M udot + c (nu): the generalised forces that the accelerations need."""
    return joint_projection(motion, carried_wrenches(motion, inertia_wrenches(motion, udot)))


def needed_wrenches(motion: Motion, udot: Sequence[S], of_body: Sequence[Wrench]) -> list[Wrench]:
    """Return the wrench that each body needs for udot, less its weight and the wrenches `of_body` on it."""
    reached = accelerations(motion, udot, negate(motion.gravity))
    found = []
    for moved, inertia, (a, alpha), given in zip(motion.bodies, base_inertias(motion), reached, of_body, strict=True):
        force, moment = inertia.rate_of_momentum(a, spread(alpha, moved.w_WB))
        found.append((subtract(force, given[0]), subtract(moment, given[1])))
    return found


def joint_wrenches(motion: Motion, udot: Sequence[S], of_body: Sequence[Wrench]) -> list[Wrench]:
    """Return the wrench of each joint on its child, in the child's axes about its origin: reactions and drives.

    `of_body` holds all other wrenches on the bodies: applied ones and those of rows.
    """
    left = unbalanced_wrenches(motion, udot, of_body)
    return carried_wrenches(motion, [(negate(force), negate(moment)) for force, moment in left])


def unbalanced_wrenches(motion: Motion, udot: Sequence[S], of_body: Sequence[Wrench]) -> list[Wrench]:
    """Return the wrenches `of_body` less those that the bodies' accelerations need."""
    needed = inertia_wrenches(motion, udot)
    return [(subtract(given[0], n[0]), subtract(given[1], n[1])) for n, given in zip(needed, of_body, strict=True)]


# ----------------------------------------------------------------------------------------------------------------------

def composite_body(mechanism: Mechanism, state: State) -> EquationsOfMotion:
    motion = economical_motion(mechanism, state)
    forces = applied_generalized_forces(motion, applied_forces(motion))
    at_rest = [0] * len(state.u)
    velocity_terms = inverse_dynamics(motion, at_rest)
    own = applied_forces(motion, weight=False)
    needed = joint_projection(motion, carried_wrenches(motion, needed_wrenches(motion, at_rest, own.of_body)))
    forcing = [q - c for q, c in zip(own.of_speed, needed, strict=True)]  # Q - c in one pass
    return equations(motion, mass_matrix(motion), forces, velocity_terms, row_motions(motion), forcing)


def mass_matrix(motion: Motion) -> list[list[S]]:
    """Return M (nu x nu, symmetric)."""
    bodies = motion.mechanism.bodies
    composites = _composites(motion)
    matrix: list[list[S]] = [[0] * len(motion.state.u) for _ in motion.state.u]
    for index, body in enumerate(bodies):
        for k, *partial in zip(body.u, motion.bodies[index].linear, motion.bodies[index].angular, strict=True):
            place, wrench = index, composites[index].wrench(*partial)
            while place >= 0:  # projected on the joints of this body and of all that carry it
                force, moment = wrench
                moved = motion.bodies[place]
                for j, linear, angular in zip(bodies[place].u, moved.linear, moved.angular, strict=True):
                    if j <= k:
                        matrix[j][k] = matrix[k][j] = dot(linear, force) + dot(angular, moment)
                place, wrench = bodies[place].parent, to_parent(moved, wrench)
    return matrix


def mass_diagonal(motion: Motion) -> list[S]:
    """Return the diagonal of M (nu), in time linear in the number of bodies."""
    diagonal = []
    for moved, composite in zip(motion.bodies, _composites(motion), strict=True):
        for linear, angular in zip(moved.linear, moved.angular, strict=True):
            force, moment = composite.wrench(linear, angular)
            diagonal.append(dot(linear, force) + dot(angular, moment))
    return diagonal


def _composites(motion: Motion) -> list[RigidInertia]:
    found = base_inertias(motion)
    for index in range(len(found) - 1, -1, -1):
        parent, moved = motion.mechanism.bodies[index].parent, motion.bodies[index]
        if parent >= 0:
            found[parent] = found[parent].plus(found[index].moved(moved.R_PB, moved.p_PB))
    return found


# ----------------------------------------------------------------------------------------------------------------------
# d'Alembert's principle in Lagrange's form, the general equation of dynamics: without T or a recursion of forces.
#
# On virtual displacements the applied and inertia forces of all bodies do no work:
#
#     sum (F - m a_C) . dr_C + (mu - J alpha - omega x J omega) . dtheta = 0
#
# Each body's forces are projected on its own partial velocities dv_C/du_k, domega/du_k of all speeds that move it:
#
#     M_kl = sum m v_k . v_l + omega_k . J omega_l
#
# Source: Wittenburg, Dynamics of Multibody Systems, section 5.2.


def dalembert_lagrange(mechanism: Mechanism, state: State) -> EquationsOfMotion:
    motion = motion_of(mechanism, state)
    count = len(state.u)
    matrix: list[list[S]] = [[0] * count for _ in range(count)]
    forces = applied_forces(motion)
    active, inertial = list(forces.of_speed), [0] * count
    needed = inertia_wrenches(motion, [0] * count)
    for index, partials in enumerate(partial_velocities(motion)):
        mass = motion.masses[index]
        at_com = {k: (add(v, cross(w, mass.com)), w) for k, (v, w) in partials.items()}
        for l, (v, w) in at_com.items():
            momentum, spin = scale(mass.mass, v), apply(mass.inertia, w)
            for k, (linear, angular) in at_com.items():
                if k <= l:
                    matrix[k][l] = matrix[k][l] + (dot(linear, momentum) + dot(angular, spin))
                    matrix[l][k] = matrix[k][l]
        for k, (linear, angular) in partials.items():
            force, moment = forces.of_body[index]
            active[k] = active[k] + (dot(linear, force) + dot(angular, moment))
            force, moment = needed[index]
            inertial[k] = inertial[k] + (dot(linear, force) + dot(angular, moment))
    return equations(motion, matrix, active, inertial, row_motions(motion))
