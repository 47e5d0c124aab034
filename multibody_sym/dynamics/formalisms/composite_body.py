"""Composite bodies and recursive Newton-Euler: mass matrix and velocity terms of a tree.

Each column of M is the wrench that accelerates the rigid composite of all bodies a joint carries (Walker and Orin,
1982; Featherstone, Rigid Body Dynamics Algorithms, section 6.2).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Protocol, Self, TypeVar

from multibody_sym.dynamics.formalisms.equations import EquationsOfMotion, equations
from multibody_sym.dynamics.formalisms.inertia import RigidInertia, base_inertias, rigid_inertia
from multibody_sym.mechanics.alignment import economical_motion
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import (
    BodyMotion,
    Motion,
    State,
    accelerations,
    motion_of,
    partial_velocities,
    spread,
)
from multibody_sym.mechanics.points import Wrench, carried_wrenches, joint_projection, power, to_parent
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.records import dataclass
from multibody_sym.scalars.vectors import S, add, apply, cross, negate, scale, subtract


class Summed(Protocol):
    """What bodies hand on to those that carry them."""

    def plus(self, other: Self, /) -> Self: ...


T = TypeVar("T", bound=Summed)


def summed_inward(motion: Motion, parts: Iterable[T], hand_on: Callable[[int, T], T]) -> list[T]:
    """Return what each body has with what it carries hands on, from the leaves to the root.

    `hand_on` takes a body's number and its sum, and returns what its parent gets.
    """
    found = list(parts)
    for index in range(len(found) - 1, -1, -1):
        handed, parent = hand_on(index, found[index]), motion.mechanism.bodies[index].parent
        if parent >= 0:
            found[parent] = found[parent].plus(handed)
    return found


def wrench_sum(a: Wrench, b: Wrench) -> Wrench:
    return add(a[0], b[0]), add(a[1], b[1])


def wrench_difference(a: Wrench, b: Wrench) -> Wrench:
    return subtract(a[0], b[0]), subtract(a[1], b[1])


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
        found.append(wrench_difference(inertia.rate_of_momentum(a, spread(alpha, moved.w_WB)), given))
    return found


def joint_wrenches(motion: Motion, udot: Sequence[S], of_body: Sequence[Wrench]) -> list[Wrench]:
    """Return the wrench of each joint on its child, in the child's axes about its origin: reactions and drives.

    `of_body` holds all other wrenches on the bodies: applied ones and those of rows.
    """
    left = unbalanced_wrenches(motion, udot, of_body)
    return carried_wrenches(motion, [(negate(force), negate(moment)) for force, moment in left])


def unbalanced_wrenches(motion: Motion, udot: Sequence[S], of_body: Sequence[Wrench]) -> list[Wrench]:
    """Return the wrenches `of_body` less those that the bodies' accelerations need."""
    return [wrench_difference(*pair) for pair in zip(of_body, inertia_wrenches(motion, udot), strict=True)]


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
                moved = motion.bodies[place]
                for j, linear, angular in zip(bodies[place].u, moved.linear, moved.angular, strict=True):
                    if j <= k:
                        matrix[j][k] = matrix[k][j] = power(linear, angular, wrench)
                place, wrench = bodies[place].parent, to_parent(moved, wrench)
    return matrix


def mass_diagonal(motion: Motion) -> list[S]:
    """Return the diagonal of M (nu), in time linear in the number of bodies."""
    return [
        power(linear, angular, composite.wrench(linear, angular))
        for moved, composite in zip(motion.bodies, _composites(motion), strict=True)
        for linear, angular in zip(moved.linear, moved.angular, strict=True)
    ]


def _composites(motion: Motion) -> list[RigidInertia]:
    def hand_on(index: int, inertia: RigidInertia) -> RigidInertia:
        return inertia.moved(motion.bodies[index].R_PB, motion.bodies[index].p_PB)

    return summed_inward(motion, base_inertias(motion), hand_on)


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
            momentum = scale(mass.mass, v), apply(mass.inertia, w)
            for k, partial in at_com.items():
                if k <= l:
                    matrix[k][l] = matrix[k][l] + power(*partial, momentum)
                    matrix[l][k] = matrix[k][l]
        for k, partial in partials.items():
            active[k] = active[k] + power(*partial, forces.of_body[index])
            inertial[k] = inertial[k] + power(*partial, needed[index])
    return equations(motion, matrix, active, inertial, row_motions(motion))


# ----------------------------------------------------------------------------------------------------------------------
# Newton and Euler body by body: every body cut free, the six components of every joint's wrench unknown.
#
#     M_i w_i = f_i + R_i - sum C_j R_j     each body i and the joints j it carries; w_i = J_i udot + velocity terms
#     A_i^T R_i = Q_i                       each joint and its drives
#
# These are 6 N + n equations for udot (n) and all R (6 N). Each R_i stands alone in its own body's equations: the
# reactions are eliminated first, from the leaves inward, as linear functions of udot, and n equations for udot remain.




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
    # R_i without loads, about the body's origin: rates of momentum, summed inward
    reactions = summed_inward(motion, free_bodies(motion), lambda index, wrench: wrench.to_parent(motion.bodies[index]))
    for body, moved, reaction in zip(motion.mechanism.bodies, motion.bodies, reactions, strict=True):
        for k, linear, angular in zip(body.u, moved.linear, moved.angular, strict=True):
            velocity_terms[k] = power(linear, angular, reaction.rest)
            for l, wrench in reaction.columns.items():
                matrix[k][l] = power(linear, angular, wrench)
    return matrix, velocity_terms


@dataclass(frozen=True)
class LinearWrench:
    """A wrench that is linear in the accelerations: the sum of columns[k] udot_k, and `rest`."""

    columns: Mapping[int, Wrench]
    rest: Wrench

    def plus(self, other: LinearWrench) -> LinearWrench:
        columns = dict(self.columns)
        for k, wrench in other.columns.items():
            columns[k] = wrench_sum(columns[k], wrench) if k in columns else wrench
        return LinearWrench(columns, wrench_sum(self.rest, other.rest))

    def to_parent(self, moved: BodyMotion) -> LinearWrench:
        """Return the wrench about the parent's origin, in the parent's axes."""
        columns = {k: to_parent(moved, wrench) for k, wrench in self.columns.items()}
        return LinearWrench(columns, to_parent(moved, self.rest))


def free_bodies(motion: Motion) -> list[LinearWrench]:
    """Return the rate of momentum M_i w_i of every body by itself, about its origin, in its axes."""
    at_rest = inertia_wrenches(motion, [0] * len(motion.state.u))
    momenta = []
    for mass, partials, rest in zip(motion.masses, partial_velocities(motion), at_rest, strict=True):
        inertia = rigid_inertia(mass)
        momenta.append(LinearWrench({k: inertia.wrench(*partial) for k, partial in partials.items()}, rest))
    return momenta
