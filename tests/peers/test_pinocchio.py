"""Random trees against Pinocchio: mass matrix, accelerations, energies, momentum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.programs.quantities import quantities
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body, Frame, Turn
from multibody_sym.model.joints import Free, Prismatic, Revolute, Spherical
from multibody_sym.model.system import System
from multibody_sym.scalars.node import quantity

pin = pytest.importorskip("pinocchio", reason="the peer pinocchio (extra: peers) is not installed")

GRAVITY = [0.3, -0.2, -9.81]


@dataclass
class Twins:
    """The same random tree declared here and there."""

    system: System
    model: Any


@dataclass
class Link:
    """One body with its joint, as drawn."""

    parent: str
    kind: type
    axis: np.ndarray
    place: np.ndarray
    turn: np.ndarray
    angle: float
    mass: float
    com: np.ndarray
    inertia: np.ndarray


def random_link(rng: np.random.Generator, parents: list[str]) -> Link:
    """Return a link with a random joint, frame and inertia."""
    a, b, c = rng.uniform(0.01, 1, 3)
    principal, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    mass = float(rng.uniform(0.1, 10))
    inertia = mass * principal @ np.diag([b + c, a + c, a + b]) @ principal.T
    kind = [Revolute, Prismatic, Spherical, Free][int(rng.choice(4, p=[0.5, 0.2, 0.2, 0.1]))]
    axis, place, turn = rng.normal(size=(3, 3))
    parent = parents[int(rng.integers(len(parents)))]
    return Link(parent, kind, axis, place, turn, float(rng.uniform(-3, 3)), mass, rng.normal(size=3) * 0.3, inertia)


def random_twins(rng: np.random.Generator, count: int) -> Twins:
    """Return a tree of `count` bodies here and there, theirs with its joints in our tree order."""
    links: dict[str, Link] = {}
    for k in range(count):
        links[f"b{k}"] = random_link(rng, ["ground", *links][-3:])
    system = declared(links)
    order = [body.name for body in mechanism(system).bodies]
    return Twins(system, theirs({name: links[name] for name in order}))


def declared(links: dict[str, Link]) -> System:
    """Return the tree as our System."""
    frames: dict[str, dict[str, Frame]] = {name: {} for name in ("ground", *links)}
    for name, link in links.items():
        frames[link.parent][f"to_{name}"] = Frame(list(link.place), [Turn(list(link.turn), link.angle)])
    bodies = {"ground": Body(frames=frames["ground"])}
    for name, link in links.items():
        elements = [link.inertia[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        bodies[name] = Body(mass=link.mass, com=list(link.com), inertia=elements, frames=frames[name])
    joints = {}
    for name, link in links.items():
        axis = {"axis": list(link.axis)} if link.kind in (Revolute, Prismatic) else {}
        joints[f"j{name}"] = link.kind(f"{link.parent}.to_{name}", name, **axis)
    return System("random", gravity=GRAVITY, bodies=bodies, joints=joints)


def theirs(links: dict[str, Link]) -> Any:
    """Return the tree as Pinocchio's model."""
    model, numbers = pin.Model(), {"ground": 0}
    model.gravity.linear = np.array(GRAVITY)
    for name, link in links.items():
        rotation = pin.AngleAxis(link.angle, link.turn / np.linalg.norm(link.turn)).toRotationMatrix()
        joint = _their_joint(link.kind, link.axis)
        numbers[name] = model.addJoint(numbers[link.parent], joint, pin.SE3(rotation, link.place), name)
        model.appendBodyToJoint(numbers[name], pin.Inertia(link.mass, link.com, link.inertia), pin.SE3.Identity())
    return model


def _their_joint(kind: type, axis: np.ndarray) -> Any:
    unit = axis / np.linalg.norm(axis)
    if kind is Revolute:
        return pin.JointModelRevoluteUnaligned(*unit)
    if kind is Prismatic:
        return pin.JointModelPrismaticUnaligned(*unit)
    return pin.JointModelSpherical() if kind is Spherical else pin.JointModelFreeFlyer()


@dataclass
class Instant:
    """A random state in both conventions; `rotations` maps our speeds to theirs (free: parent's axes to body axes)."""

    q: list[float]
    u: list[float]
    their_q: np.ndarray
    their_v: np.ndarray
    rotations: np.ndarray
    rates: np.ndarray


def random_instant(rng: np.random.Generator, resolved: Any) -> Instant:
    """Return a state; their quaternion is (x, y, z, w), their free joint's linear speed is in body axes."""
    q: list[float] = []
    u = list(rng.normal(size=len(resolved.speeds)))
    their_q: list[float] = []
    rotations, rates = np.eye(len(u)), np.zeros(len(u))
    for body in resolved.bodies:
        moves = list(rng.normal(size=len(body.rate_pairs)))
        quaternion = rng.normal(size=4 * len(body.quaternions))
        quaternion = list(quaternion / np.linalg.norm(quaternion)) if len(quaternion) else []
        q += moves + quaternion
        their_q += moves + quaternion[1:] + quaternion[:1]
        if body.quaternions and moves:
            R = pin.Quaternion(*quaternion).toRotationMatrix()
            first, spin = body.u[0], np.array([u[k] for k in body.u[3:]])
            rotations[first : first + 3, first : first + 3] = R.T
            rates[first : first + 3] = -np.cross(spin, R.T @ np.array([u[k] for k in body.u[:3]]))
    return Instant(q, u, np.array(their_q), rotations @ np.array(u), rotations, rates)


@pytest.mark.parametrize("seed", range(25))
def test_random_tree(seed: int) -> None:
    rng = np.random.default_rng(seed)
    twins = random_twins(rng, int(rng.integers(1, 9)))
    resolved = mechanism(twins.system)
    data = twins.model.createData()
    at = random_instant(rng, resolved)
    state = state_of(resolved, float, 0.0, at.q, at.u, [])
    mass_matrix = pin.crba(twins.model, data, at.their_q, pin.Convention.WORLD)
    mass_matrix = np.triu(mass_matrix) + np.triu(mass_matrix, 1).T
    wanted = at.rotations.T @ mass_matrix @ at.rotations
    their_rates = pin.aba(twins.model, data, at.their_q, at.their_v, np.zeros(len(at.u)))
    udot = np.linalg.solve(at.rotations, their_rates - at.rates)
    for name in ("composite_body", "block_ldl"):
        dynamics = FORMALISMS[name](resolved, state)
        found = np.array(dynamics.bias_acceleration)
        np.testing.assert_allclose(found, udot, rtol=1e-9, atol=1e-9 * np.abs(udot).max())
    formed = np.array(FORMALISMS["composite_body"](resolved, state).mass_matrix)
    np.testing.assert_allclose(formed, wanted, rtol=1e-10, atol=1e-10 * np.abs(wanted).max())
    _assert_energies_and_momenta(twins.model, data, at, motion_of(resolved, state))


def _assert_energies_and_momenta(model: Any, data: Any, at: Instant, motion: Any) -> None:
    kinetic = pin.computeKineticEnergy(model, data, at.their_q, at.their_v)
    potential = pin.computePotentialEnergy(model, data, at.their_q)
    assert kinetic_energy(motion) == pytest.approx(kinetic, rel=1e-11)
    assert potential_energy(motion) == pytest.approx(potential, rel=1e-10, abs=1e-10)
    centroidal = pin.computeCentroidalMomentum(model, data, at.their_q, at.their_v)
    com = pin.centerOfMass(model, data, at.their_q)
    names = [quantity("momentum", axis) for axis in "xyz"] + [quantity("angular_momentum", axis) for axis in "xyz"]
    found = list(quantities(motion, [0.0] * len(at.u), [], names).values())
    about_origin = centroidal.angular + np.cross(com, centroidal.linear)
    np.testing.assert_allclose(found[:3], centroidal.linear, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found[3:], about_origin, rtol=1e-9, atol=1e-9 * np.abs(about_origin).max())
