"""Momenta of bodies and of speeds, and Jacobi's integral, over any scalar.

    P = sum m v_C        L_A = sum (J omega + (r_C - r_A) x m v_C)        p_k = dT/du_k        h = sum p_k u_k - T + V

L_A about any point A has the velocities that the world sees, whether A moves or not: dL_A/dt = M_A - v_A x P.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Final

from multibody_sym.dynamics.formalisms.composite_body import joint_wrenches
from multibody_sym.dynamics.programs.reactions import acting
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy
from multibody_sym.mechanics.forces import applied_forces
from multibody_sym.mechanics.joint_friction import along_reactions
from multibody_sym.mechanics.load_records import MassFlow
from multibody_sym.mechanics.motion import Motion
from multibody_sym.mechanics.points import NO_WRENCH, Wrench, generalized_forces, to_parent
from multibody_sym.mechanics.row_kinematics import RowMotion
from multibody_sym.mechanics.variable_mass import carried_energy, carried_momentum
from multibody_sym.records import dataclass
from multibody_sym.scalars.vectors import ZERO_VECTOR, S, Vec, add, apply, cross, dot, negate, scale, subtract
from multibody_sym.text.parser import WEIGHT


@dataclass(frozen=True)
class Momentum:
    """A body's `mass`, the place of its centre of mass, its momentum and its `spin` J omega, in world axes."""

    mass: S
    com: Vec
    momentum: Vec
    spin: Vec


def body_momenta(motion: Motion) -> list[Momentum]:
    """Return the momenta of all bodies, in tree order."""
    found = []
    for index, (moved, mass) in enumerate(zip(motion.bodies, motion.masses, strict=True)):
        R, p = motion.poses[index]
        momentum = apply(R, scale(mass.mass, add(moved.v_WB, cross(moved.w_WB, mass.com))))
        spin = apply(R, apply(mass.inertia, moved.w_WB))
        found.append(Momentum(mass.mass, add(p, apply(R, mass.com)), momentum, spin))
    return found


def momentum(parts: Iterable[Momentum]) -> Vec:
    """Return P of some bodies together."""
    return total(part.momentum for part in parts)


def angular_momentum(parts: Iterable[Momentum], about: Vec = ZERO_VECTOR) -> Vec:
    """Return L of some bodies together about a place (world axes)."""
    return total(add(part.spin, cross(subtract(part.com, about), part.momentum)) for part in parts)


def centre_of_mass(parts: Sequence[Momentum]) -> Vec:
    """Return the centre of mass of some bodies together, sum(m r)/sum(m)."""
    x, y, z = total(scale(part.mass, part.com) for part in parts)
    mass = sum(part.mass for part in parts)
    return x / mass, y / mass, z / mass


def total(vectors: Iterable[Vec]) -> Vec:
    """Return the sum of vectors."""
    found = ZERO_VECTOR
    for vector in vectors:
        found = add(found, vector)
    return found


def generalized_momenta(motion: Motion) -> list[S]:
    """Return p_k = dT/du_k (nu): the bodies' momenta along their partial velocities."""
    return generalized_forces(motion, [_about_origin(motion, index) for index in range(len(motion.bodies))])


def _about_origin(motion: Motion, index: int) -> Wrench:
    """Return a body's momentum and its angular momentum about its own origin, in its axes."""
    moved, mass = motion.bodies[index], motion.masses[index]
    linear = scale(mass.mass, add(moved.v_WB, cross(moved.w_WB, mass.com)))
    return linear, add(apply(mass.inertia, moved.w_WB), cross(mass.com, linear))


def jacobi_integral(motion: Motion) -> S:
    """Return h = sum p_k u_k - T + V, which is T + V where nothing moves as prescribed.

    T = T2 + T1 + T0 by powers of the speeds, so that h = T2 - T0 + V, and sum p_k u_k = 2 T2 + T1.
    """
    along = sum((p * u for p, u in zip(generalized_momenta(motion), motion.state.u, strict=True)), 0)
    return along - kinetic_energy(motion) + potential_energy(motion)


# ----------------------------------------------------------------------------------------------------------------------
# What each element exerts on each body, and its power: forces, the weight, constraints, contacts and joints.
#
# The wrenches on a body together are the rate of its momentum, and all powers that of the kinetic energy; for that,
# what leaves or joins a body of variable mass exerts its reactive force and the momentum that it takes along or
# brings. A joint has the power of its prescribed motion; motors, springs and friction in it have their own, though its
# wrench holds them too.


SECTIONS: Final = ("gravity", "forces", "constraints", "contacts", "bodies", "joints")
"""Where elements are declared, in the order in which one of several of a name is meant."""
Path = tuple[str, str]


@dataclass(frozen=True)
class Exertion:
    """What an element, declared at `path`, exerts: `of_body`, wrenches (body axes, about its origin), and its `power`.

    `from_outside`: it is the weight, a load or a row, or a joint on ground; what inner joints exert cancels. `contact`:
    the name of the one that a row belongs to, which is not that of `path` where contacts repeat.
    """

    path: Path
    of_body: Sequence[Wrench]
    power: S
    from_outside: bool = True
    contact: str = ""


def exertions(
    motion: Motion, udot: Sequence[S], rows: Sequence[RowMotion], multipliers: Sequence[S]
) -> list[Exertion]:
    """Return what acts at a state with its accelerations (nu) and multipliers (ns), element by element."""
    weighed = applied_forces(motion, ()).of_body
    found = [Exertion(("gravity", WEIGHT), weighed, power_of(motion, weighed))]
    for load in motion.mechanism.loads:
        forces = applied_forces(motion, [load], weight=False)
        along = sum((force * u for force, u in zip(forces.of_speed, motion.state.u, strict=True)), 0)
        own = Exertion(load.path, forces.of_body, power_of(motion, forces.of_body) + along)
        found.append(_with_mass(motion, load, own) if isinstance(load, MassFlow) else own)
    return [*found, *_of_rows(motion, rows, multipliers), *_of_joints(motion, udot, rows, multipliers)]


def _with_mass(motion: Motion, flow: MassFlow, own: Exertion) -> Exertion:
    """Return what a flow of mass exerts, with the momentum and the kinetic energy that the mass takes or brings."""
    of_body = list(own.of_body)
    force, moment = carried_momentum(motion, flow.body)
    of_body[flow.body] = add(of_body[flow.body][0], force), add(of_body[flow.body][1], moment)
    return replace(own, of_body=of_body, power=own.power + carried_energy(motion, flow.body))


def _of_rows(motion: Motion, rows: Sequence[RowMotion], multipliers: Sequence[S]) -> list[Exertion]:
    beside = {k: row.beside for k, row in enumerate(rows) if row.beside}
    pushing = along_reactions([row.forces for row in rows], beside, multipliers)
    found = []
    for k, (row, multiplier) in enumerate(zip(rows, multipliers, strict=True)):
        of_body = [_times(multiplier, wrench) for wrench in row.of_body]
        told = generalized_forces(motion, row.of_body)
        along = sum((pushing[k][j] - told[j]) * u for j, u in enumerate(motion.state.u))
        power = power_of(motion, of_body) + multiplier * along
        path = motion.mechanism.row_path(k)
        contact = motion.mechanism.rows[k].name.partition(".")[0] if path[0] == "contacts" else ""
        found.append(Exertion(path, of_body, power, contact=contact))
    return found


def _of_joints(
    motion: Motion, udot: Sequence[S], rows: Sequence[RowMotion], multipliers: Sequence[S]
) -> list[Exertion]:
    """Return what the tree's joints exert, on their children and back on these' parents."""
    transmitted = joint_wrenches(motion, udot, acting(motion, rows, multipliers))
    found = []
    for index, (body, moved) in enumerate(zip(motion.mechanism.bodies, motion.bodies, strict=True)):
        force, moment = transmitted[index]
        of_body = [NO_WRENCH] * len(motion.bodies)
        of_body[index] = transmitted[index]
        if body.parent >= 0:
            back, turning_back = to_parent(moved, transmitted[index])
            of_body[body.parent] = (negate(back), negate(turning_back))
        power = dot(moved.given_linear, force) + dot(moved.given_angular, moment)
        found.append(Exertion(("joints", body.joint_name), of_body, power, body.parent < 0))
    return found


def _times(factor: S, wrench: Wrench) -> Wrench:
    if wrench is NO_WRENCH:
        return wrench
    force, moment = wrench
    return scale(factor, force), scale(factor, moment)


def power_of(motion: Motion, of_body: Sequence[Wrench]) -> S:
    """Return the power of wrenches on the bodies: F . v + M . omega."""
    power: S = 0
    for moved, wrench in zip(motion.bodies, of_body, strict=True):
        if wrench is not NO_WRENCH:
            power = power + dot(moved.v_WB, wrench[0]) + dot(moved.w_WB, wrench[1])
    return power


def resultant(motion: Motion, of_body: Sequence[Wrench]) -> tuple[Vec, Vec]:
    """Return the sum of wrenches on the bodies, and of their moments about the origin, in world axes."""
    force, moment = ZERO_VECTOR, ZERO_VECTOR
    for index, wrench in enumerate(of_body):
        if wrench is NO_WRENCH:
            continue
        R, p = motion.poses[index]
        own = apply(R, wrench[0])
        force, moment = add(force, own), add(moment, add(apply(R, wrench[1]), cross(p, own)))
    return force, moment
