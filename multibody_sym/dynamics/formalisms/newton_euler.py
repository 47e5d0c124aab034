"""Newton and Euler body by body: every body cut free, the six components of every joint's wrench unknown.

    M_i w_i = f_i + R_i - sum C_j R_j     each body i and the joints j it carries; w_i = J_i udot + velocity terms
    A_i^T R_i = Q_i                       each joint and its drives

These are 6 N + n equations for udot (n) and all R (6 N). Each R_i stands alone in its own body's equations: the
reactions are eliminated first, from the leaves inward, as linear functions of udot, and n equations for udot remain.
"""

from __future__ import annotations

from collections.abc import Mapping

from multibody_sym.dynamics.formalisms.composite_body import inertia_wrenches
from multibody_sym.dynamics.formalisms.equations import EquationsOfMotion, equations
from multibody_sym.dynamics.formalisms.inertia import rigid_inertia
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import BodyMotion, Motion, State, motion_of, partial_velocities
from multibody_sym.mechanics.points import Wrench, to_parent
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.records import dataclass
from multibody_sym.scalars.vectors import S, add, dot


def newton_euler(mechanism: Mechanism, state: State) -> EquationsOfMotion:
    motion = motion_of(mechanism, state)
    forces = applied_generalized_forces(motion, applied_forces(motion))
    matrix, velocity_terms = without_reactions(motion)
    return equations(motion, matrix, forces, velocity_terms, row_motions(motion))


def without_reactions(motion: Motion) -> tuple[list[list[S]], list[S]]:
    """Return M (nu x nu) and the velocity terms c (nu) of A^T R = Q, with the reactions eliminated."""
    count = len(motion.state.u)
    matrix: list[list[S]] = [[0] * count for _ in range(count)]
    velocity_terms: list[S] = [0] * count
    for body, moved, reaction in zip(motion.mechanism.bodies, motion.bodies, inertial_reactions(motion), strict=True):
        for k, linear, angular in zip(body.u, moved.linear, moved.angular, strict=True):
            velocity_terms[k] = dot(linear, reaction.rest[0]) + dot(angular, reaction.rest[1])
            for l, (force, moment) in reaction.columns.items():
                matrix[k][l] = dot(linear, force) + dot(angular, moment)
    return matrix, velocity_terms


@dataclass(frozen=True)
class LinearWrench:
    """A wrench that is linear in the accelerations: the sum of columns[k] udot_k, and `rest`."""

    columns: Mapping[int, Wrench]
    rest: Wrench

    def plus(self, other: LinearWrench) -> LinearWrench:
        columns = dict(self.columns)
        for k, wrench in other.columns.items():
            columns[k] = _sum(columns[k], wrench) if k in columns else wrench
        return LinearWrench(columns, _sum(self.rest, other.rest))

    def to_parent(self, moved: BodyMotion) -> LinearWrench:
        """Return the wrench about the parent's origin, in the parent's axes."""
        columns = {k: to_parent(moved, wrench) for k, wrench in self.columns.items()}
        return LinearWrench(columns, to_parent(moved, self.rest))


def inertial_reactions(motion: Motion) -> list[LinearWrench]:
    """Return the joints' R_i without loads, about the body's origin: rates of momentum, summed inward."""
    reactions = free_bodies(motion)
    for index in range(len(reactions) - 1, -1, -1):
        parent = motion.mechanism.bodies[index].parent
        if parent >= 0:
            reactions[parent] = reactions[parent].plus(reactions[index].to_parent(motion.bodies[index]))
    return reactions


def free_bodies(motion: Motion) -> list[LinearWrench]:
    """Return the rate of momentum M_i w_i of every body by itself, about its origin, in its axes."""
    at_rest = inertia_wrenches(motion, [0] * len(motion.state.u))
    momenta = []
    for mass, partials, rest in zip(motion.masses, partial_velocities(motion), at_rest, strict=True):
        inertia = rigid_inertia(mass)
        momenta.append(LinearWrench({k: inertia.wrench(*partial) for k, partial in partials.items()}, rest))
    return momenta

def _sum(a: Wrench, b: Wrench) -> Wrench:
    return add(a[0], b[0]), add(a[1], b[1])
