"""Composite bodies and recursive Newton-Euler: mass matrix and velocity terms of a tree.

Each column of M is the wrench that accelerates the rigid composite of all bodies a joint carries (Walker and Orin,
1982; Featherstone, Rigid Body Dynamics Algorithms, section 6.2).
"""

from __future__ import annotations

from multibody_sym.dynamics.formalisms.equations import EquationsOfMotion, equations
from multibody_sym.dynamics.formalisms.inverse_dynamics import forcing, inverse_dynamics
from multibody_sym.dynamics.inertia.base_parameters import base_inertias
from multibody_sym.dynamics.inertia.rigid import RigidInertia
from multibody_sym.kinematics.alignment import economical_motion
from multibody_sym.kinematics.loads import applied, applied_generalized_forces
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import State
from multibody_sym.kinematics.wrenches import Wrench, to_parent
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.scalars.vectors import (
    S,
    dot,
)


def composite_body(mechanism: Mechanism, state: State) -> EquationsOfMotion:
    """Return the equations of motion at a state."""
    motion = economical_motion(mechanism, state)
    forces = applied_generalized_forces(motion, applied(motion))
    velocity_terms = inverse_dynamics(motion, [0] * len(state.u))
    return equations(motion, mass_matrix(motion), forces, velocity_terms, row_motions(motion), forcing(motion))


def mass_matrix(motion: Motion) -> list[list[S]]:
    """Return M (nu x nu, symmetric)."""
    bodies = motion.mechanism.bodies
    composites = _composites(motion)
    matrix: list[list[S]] = [[0] * len(motion.state.u) for _ in motion.state.u]
    for index, body in enumerate(bodies):
        moved = motion.bodies[index]
        for k, linear, angular in zip(body.u, moved.linear, moved.angular, strict=True):
            _fill_column(matrix, motion, index, k, composites[index].wrench(linear, angular))
    return matrix


def mass_diagonal(motion: Motion) -> list[S]:
    """Return the diagonal of M (nu), in time linear in the number of bodies."""
    diagonal = []
    for moved, composite in zip(motion.bodies, _composites(motion), strict=True):
        for linear, angular in zip(moved.linear, moved.angular, strict=True):
            force, moment = composite.wrench(linear, angular)
            diagonal.append(dot(linear, force) + dot(angular, moment))
    return diagonal


def _fill_column(matrix: list[list[S]], motion: Motion, index: int, k: int, wrench: Wrench) -> None:
    """Project the wrench of column k on the joint of body `index` and of all bodies that carry it."""
    while index >= 0:
        body, moved = motion.mechanism.bodies[index], motion.bodies[index]
        force, moment = wrench
        for j, linear, angular in zip(body.u, moved.linear, moved.angular, strict=True):
            if j <= k:
                matrix[j][k] = matrix[k][j] = dot(linear, force) + dot(angular, moment)
        wrench = to_parent(moved, wrench)
        index = body.parent


def _composites(motion: Motion) -> list[RigidInertia]:
    found = base_inertias(motion)
    for index in range(len(found) - 1, -1, -1):
        parent, moved = motion.mechanism.bodies[index].parent, motion.bodies[index]
        if parent >= 0:
            found[parent] = found[parent].plus(found[index].moved(moved.R_PB, moved.p_PB))
    return found
