"""Momenta of bodies and of speeds, and Jacobi's integral, over any scalar.

    P = sum m v_C        L_A = sum (J omega + (r_C - r_A) x m v_C)        p_k = dT/du_k        h = sum p_k u_k - T + V

L_A about any point A has the velocities that the world sees, whether A moves or not: dL_A/dt = M_A - v_A x P.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from multibody_sym.dynamics.formalisms.composite_body import joint_wrenches
from multibody_sym.dynamics.programs.reactions import wrenches_on_bodies
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
    found = ZERO_VECTOR
    for vector in vectors:
        found = add(found, vector)
    return found


def generalized_momenta(motion: Motion) -> list[S]:
    """Return p_k = dT/du_k (nu): the bodies' momenta along their partial velocities."""
    momenta: list[Wrench] = []  # with the angular momentum about the body's origin, in its axes
    for moved, mass in zip(motion.bodies, motion.masses, strict=True):
        linear = scale(mass.mass, add(moved.v_WB, cross(moved.w_WB, mass.com)))
        momenta.append((linear, add(apply(mass.inertia, moved.w_WB), cross(mass.com, linear))))
    return generalized_forces(motion, momenta)


def jacobi_integral(motion: Motion) -> S:
    """Return h = sum p_k u_k - T + V, which is T + V where nothing moves as prescribed.

    T = T2 + T1 + T0 by powers of the speeds, so that h = T2 - T0 + V, and sum p_k u_k = 2 T2 + T1.
    """
    along = sum((p * u for p, u in zip(generalized_momenta(motion), motion.state.u, strict=True)), 0)
    return along - kinetic_energy(motion) + potential_energy(motion)


# ----------------------------------------------------------------------------------------------------------------------
# The wrenches of each element on each body, and its power: forces, the weight, constraints, contacts and joints.
#
# The wrenches on a body together are the rate of its momentum, and all powers that of the kinetic energy; so mass that
# leaves or joins a body exerts its reactive force and the momentum that it takes along or brings. A joint has the power
# of its prescribed motion; motors, springs and friction in it have their own, though its wrench holds them too.


SECTIONS: Final = ("gravity", "forces", "constraints", "contacts", "bodies", "joints")
"""Where elements are declared; of several with one name, the first in this order counts."""
Path = tuple[str, str]


@dataclass(frozen=True)
class Exertion:
    """The effect of an element declared at `path`: wrenches `of_body` (body axes, about its origin), and its `power`.

    `from_outside`: it is the weight, a load or a row, or a joint on ground; wrenches of inner joints cancel. `contact`:
    the name of a row's contact, which is not that of `path` where contacts repeat.
    """

    path: Path
    of_body: Sequence[Wrench]
    power: S
    from_outside: bool = True
    contact: str = ""


def exertions(
    motion: Motion, udot: Sequence[S], rows: Sequence[RowMotion], multipliers: Sequence[S]
) -> list[Exertion]:
    """Return the effects of all elements at a state with its accelerations (nu) and multipliers (ns)."""
    weighed = applied_forces(motion, ()).of_body
    found = [Exertion(("gravity", WEIGHT), weighed, power_of(motion, weighed))]
    for load in motion.mechanism.loads:
        forces = applied_forces(motion, [load], weight=False)
        along = sum((force * u for force, u in zip(forces.of_speed, motion.state.u, strict=True)), 0)
        of_body, power = list(forces.of_body), power_of(motion, forces.of_body) + along
        if isinstance(load, MassFlow):  # the mass takes along or brings momentum and kinetic energy
            force, moment = carried_momentum(motion, load.body)
            of_body[load.body] = add(of_body[load.body][0], force), add(of_body[load.body][1], moment)
            power = power + carried_energy(motion, load.body)
        found.append(Exertion(load.path, of_body, power))
    beside = {k: row.beside for k, row in enumerate(rows) if row.beside}
    pushing = along_reactions([row.forces for row in rows], beside, multipliers)
    for k, (row, multiplier) in enumerate(zip(rows, multipliers, strict=True)):
        of_body = [
            w if w is NO_WRENCH else (scale(multiplier, w[0]), scale(multiplier, w[1])) for w in row.of_body
        ]
        by_bodies = generalized_forces(motion, row.of_body)
        along = sum((pushing[k][j] - by_bodies[j]) * u for j, u in enumerate(motion.state.u))
        power = power_of(motion, of_body) + multiplier * along
        path = motion.mechanism.row_path(k)
        contact = motion.mechanism.rows[k].name.partition(".")[0] if path[0] == "contacts" else ""
        found.append(Exertion(path, of_body, power, contact=contact))
    transmitted = joint_wrenches(motion, udot, wrenches_on_bodies(motion, rows, multipliers))
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
