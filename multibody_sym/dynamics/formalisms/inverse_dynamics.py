"""Recursive Newton-Euler: the forces that given accelerations need, and the wrench that every joint transmits.

Source: Luh, Walker and Paul (1980); in the form of Featherstone, Rigid Body Dynamics Algorithms, section 5.3, with
accelerations of points instead of spatial ones.
"""

from __future__ import annotations

from collections.abc import Sequence

from multibody_sym.dynamics.inertia.base_parameters import base_inertias
from multibody_sym.kinematics.loads import applied
from multibody_sym.kinematics.motion import BodyMass, BodyMotion, Motion, accelerations, spread
from multibody_sym.kinematics.wrenches import Wrench, carried, joint_projection
from multibody_sym.scalars.vectors import S, Vec, add, apply, cross, negate, scale, subtract


def inertia_wrenches(motion: Motion, udot: Sequence[S]) -> list[Wrench]:
    """Return each body's rate of momentum: (m a_C, J alpha + omega x J omega + c x m a_C), about its origin."""
    bodies = zip(motion.bodies, motion.masses, accelerations(motion, udot), strict=True)
    return [inertia_wrench(moved, mass, *reached) for moved, mass, reached in bodies]


def inertia_wrench(moved: BodyMotion, mass: BodyMass, a: Vec, alpha: Vec) -> Wrench:
    """Return one body's rate of momentum."""
    force = scale(mass.mass, add(a, apply(spread(alpha, moved.w_WB), mass.com)))
    spin = cross(moved.w_WB, apply(mass.inertia, moved.w_WB))
    return force, add(add(apply(mass.inertia, alpha), spin), cross(mass.com, force))


def inverse_dynamics(motion: Motion, udot: Sequence[S]) -> list[S]:
    """Return M udot + c (nu): the generalised forces that the accelerations need."""
    return joint_projection(motion, carried(motion, inertia_wrenches(motion, udot)))


def forcing(motion: Motion) -> list[S]:
    """Return f = Q - c (nu) in one pass: applied forces less inertia forces without udot."""
    forces = applied(motion, weight=False)
    needed = joint_projection(motion, carried(motion, bias_wrenches(motion, forces.of_body)))
    return [q - c for q, c in zip(forces.of_speed, needed, strict=True)]


def bias_wrenches(motion: Motion, of_body: Sequence[Wrench]) -> list[Wrench]:
    """Return what each body needs without udot, less its weight and the wrenches on it."""
    reached = accelerations(motion, [0] * len(motion.state.u), negate(motion.gravity))
    found = []
    for moved, inertia, (a, alpha), given in zip(motion.bodies, base_inertias(motion), reached, of_body, strict=True):
        force, moment = inertia.rate_of_momentum(a, spread(alpha, moved.w_WB))
        found.append((subtract(force, given[0]), subtract(moment, given[1])))
    return found


def joint_wrenches(motion: Motion, udot: Sequence[S], of_body: Sequence[Wrench]) -> list[Wrench]:
    """Return the wrench of each joint on its child, in the child's axes about its origin: reactions and drives.

    `of_body` holds everything else that acts on the bodies: applied wrenches and those of rows.
    """
    left = unbalanced_wrenches(motion, udot, of_body)
    return carried(motion, [(negate(force), negate(moment)) for force, moment in left])


def unbalanced_wrenches(motion: Motion, udot: Sequence[S], of_body: Sequence[Wrench]) -> list[Wrench]:
    """Return what acts on each body, `of_body`, less what its acceleration needs."""
    needed = inertia_wrenches(motion, udot)
    return [(subtract(given[0], n[0]), subtract(given[1], n[1])) for n, given in zip(needed, of_body, strict=True)]
