"""Momenta of bodies and of speeds, and Jacobi's integral, over any scalar.

    P = sum m v_C        L_A = sum (J omega + (r_C - r_A) x m v_C)        p_k = dT/du_k        h = sum p_k u_k - T + V

L_A about any point A has the velocities that the world sees, whether A moves or not: dL_A/dt = M_A - v_A x P.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from multibody_sym.kinematics.energy import kinetic_energy, potential_energy
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.wrenches import Wrench, generalized_forces
from multibody_sym.records import dataclass
from multibody_sym.scalars.vectors import ZERO_VECTOR, S, Vec, add, apply, cross, scale, subtract


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
