"""Composite bodies and recursive Newton-Euler: mass matrix and velocity terms of a tree.

Each column of M is the wrench that accelerates the rigid composite of all bodies a joint carries (Walker and Orin,
1982; Featherstone, Rigid Body Dynamics Algorithms, section 6.2).
"""

from __future__ import annotations

from dataclasses import dataclass

from multibody_sym.dynamics.equations import EquationsOfMotion, equations
from multibody_sym.dynamics.inverse_dynamics import inverse_dynamics
from multibody_sym.kinematics.loads import applied, applied_generalized_forces
from multibody_sym.kinematics.motion import BodyMass, Motion, motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import State
from multibody_sym.kinematics.vectors import (
    Mat,
    S,
    Vec,
    add,
    apply,
    cross,
    dot,
    matrix_sum,
    product,
    scale,
    steiner,
    transpose,
)
from multibody_sym.kinematics.wrenches import Wrench, to_parent
from multibody_sym.model.mechanism import Mechanism


def composite_body(mechanism: Mechanism, state: State) -> EquationsOfMotion:
    """Return the equations of motion at a state."""
    motion = motion_of(mechanism, state)
    forces = applied_generalized_forces(motion, applied(motion))
    velocity_terms = inverse_dynamics(motion, [0] * len(state.u))
    return equations(motion, mass_matrix(motion), forces, velocity_terms, row_motions(motion))


@dataclass(frozen=True)
class Composite:
    """Mass, first moment m c and inertia about the body's origin of a rigid composite, in the body's axes."""

    mass: S
    moment: Vec
    inertia: Mat

    def wrench(self, linear: Vec, angular: Vec) -> Wrench:
        """Return the wrench that gives the composite, at rest, these accelerations of its origin and of rotation."""
        force = add(scale(self.mass, linear), cross(angular, self.moment))
        return force, add(apply(self.inertia, angular), cross(self.moment, linear))


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


def _composites(motion: Motion) -> list[Composite]:
    found = [_single(mass) for mass in motion.masses]
    for index in range(len(found) - 1, -1, -1):
        parent = motion.mechanism.bodies[index].parent
        if parent >= 0:
            found[parent] = _joined(found[parent], found[index], motion.bodies[index].R_PB, motion.bodies[index].p_PB)
    return found


def _single(mass: BodyMass) -> Composite:
    moment = scale(mass.mass, mass.com)
    return Composite(mass.mass, moment, matrix_sum(mass.inertia, steiner(moment, mass.com)))


def _joined(parent: Composite, child: Composite, R: Mat, p: Vec) -> Composite:
    """Return both as one, in the parent's axes: with h = R m c, J' = R J R^T - [p][h] - [h][p] - m [p][p]."""
    h = apply(R, child.moment)
    moment = add(h, scale(child.mass, p))
    turned = product(product(R, child.inertia), transpose(R))
    shifted = matrix_sum(turned, matrix_sum(steiner(h, p), steiner(p, moment)))
    return Composite(parent.mass + child.mass, add(parent.moment, moment), matrix_sum(parent.inertia, shifted))
