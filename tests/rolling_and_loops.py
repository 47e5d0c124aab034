"""Models whose constraints hold: balls and discs rolling on planes, fixed and carried, and closed linkages."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

import multibody_sym as mbs

Rng = np.random.Generator


def rolling(seed: int) -> mbs.System:
    """Return one to three balls or discs on a plane of ground or of a cart that it carries."""
    rng = np.random.default_rng([seed, 1])
    up = _direction(rng) if seed % 3 else np.array([0.0, 1.0, 0.0])
    plane = mbs.Surface(plane=[0, 0, 0], normal=_plain(up))
    bodies: dict[str, mbs.Body] = {}
    joints: dict[str, Any] = {}
    if seed % 5 == 1:  # along its own plane, so that what rolls on it stays above
        along = np.cross(up, _direction(rng))
        bodies["cart"] = mbs.Body(mass=_between(rng, 0.1, 10), surfaces={"table": plane})
        joints["rail"] = mbs.Prismatic("ground", "cart", axis=_plain(along / np.linalg.norm(along)))
    else:
        bodies["ground"] = mbs.Body(surfaces={"table": plane})
    constraints, forces = {}, {}
    for k in range(int(rng.integers(1, 4))):
        name, radius = f"b{k}", _between(rng, 0.02, 0.5)
        ball = bool(rng.integers(0, 2))
        bodies[name] = _roller(rng, radius, ball, eccentric=rng.uniform() < 0.3)
        joints[f"J{k}"] = _ride(rng, name, up, radius, k)
        constraints[f"roll{k}"] = mbs.Rolling(f"{name}.skin", f"{'cart' if 'cart' in bodies else 'ground'}.table")
        if rng.uniform() < 0.3:
            forces[f"pull{k}"] = mbs.Force(on=name, value=_plain(rng.normal(size=3)))
    gravity = [0, 0, 0] if seed % 7 == 0 else _plain(-9.81 * up)
    return mbs.System(
        f"rolling_{seed}", gravity=gravity, bodies=bodies, joints=joints, constraints=constraints, forces=forces
    )


def _roller(rng: Rng, radius: float, ball: bool, eccentric: bool) -> mbs.Body:
    mass = 10.0 ** rng.uniform(-3, 2)
    surface = mbs.Surface(sphere=radius) if ball else mbs.Surface(disc=radius, axis="z")
    about, across = mass * radius**2 * rng.uniform(0.3, 0.5), mass * radius**2 * rng.uniform(0.25, 0.4)
    moments = (about, about, about) if ball and not eccentric else (across, across, about)
    com = _plain(radius * rng.uniform(-0.3, 0.3, 3)) if eccentric else [0, 0, 0]
    inertia = dict(zip(("Ixx", "Iyy", "Izz"), map(float, moments), strict=True))
    return mbs.Body(mass=mass, com=com, inertia=inertia, surfaces={"skin": surface})


def _ride(rng: Rng, name: str, up: np.ndarray, radius: float, k: int) -> mbs.Free:
    """Return a free joint whose disc stands near upright; rows put it onto the plane."""
    flat = np.cross(up, _direction(rng))
    axis = flat / np.linalg.norm(flat) + 0.2 * rng.normal(size=3)
    place = radius * up + 3.0 * k * flat
    turned = _quaternion_to(axis / np.linalg.norm(axis))
    rest = rng.uniform() < 0.2
    speeds = [0.0] * 6 if rest else _plain(rng.normal(size=6) * [1, 1, 1, 3, 3, 3])
    return mbs.Free("ground", name, initial={"q": [*_plain(place), *_plain(turned)], "u": speeds})


def _quaternion_to(axis: np.ndarray) -> np.ndarray:
    """Return the shortest turn (w, x, y, z) that takes z to an axis."""
    z = np.array([0.0, 0.0, 1.0])
    found = np.concatenate([[1.0 + z @ axis], np.cross(z, axis)])
    return found / np.linalg.norm(found)


def linkage(seed: int) -> mbs.System:
    """Return a closed chain of three to six bars with hinges, flat or with balls at every other pin, driven or not."""
    rng = np.random.default_rng([seed, 2])
    count, flat = int(rng.integers(3, 7)), seed % 3 != 0
    corners = [_corner(rng, k, count + 1, flat) for k in range(count + 1)]
    bodies: dict[str, mbs.Body] = {"ground": mbs.Body(points={"o": _plain(corners[0]), "end": _plain(corners[-1])})}
    joints: dict[str, Any] = {}
    for k, (a, b) in enumerate(itertools.pairwise(corners)):
        mass, arm = 10.0 ** rng.uniform(-3, 3), b - a
        inertia = mass * float(arm @ arm) / 12
        bodies[f"bar{k}"] = mbs.Body(
            mass=mass, com=_plain(arm / 2), inertia=_moments(inertia), points={"pin": _plain(arm)}
        )
        joints[f"P{k}"] = _pin("ground.o" if k == 0 else f"bar{k - 1}.pin", f"bar{k}", ball=not flat and k % 2 == 1)
    joints["last"] = _pin("ground.end", f"bar{count - 1}.pin", ball=not flat, cut=True)
    forces = {"motor": mbs.Torque(joint="P0", value=_between(rng, -2, 2))} if seed % 2 else {}
    spring = mbs.SpringDamper(between=["bar0.pin", "ground.end"], stiffness=_between(rng, 1, 1e3), damping=1.0)
    if seed % 4 == 1:
        forces["spring"] = spring
    return mbs.System(f"linkage_{seed}", gravity=[0, -9.81, 0], bodies=bodies, joints=joints, forces=forces)


def _corner(rng: Rng, k: int, of: int, flat: bool) -> np.ndarray:
    angle, size = np.pi * k / (of - 1), rng.uniform(0.6, 1.4)
    return np.array([-size * np.cos(angle), size * np.sin(angle), 0.0 if flat else rng.uniform(-0.3, 0.3)])


def _pin(parent: str, child: str, *, ball: bool, cut: bool = False) -> Any:
    if ball:
        return mbs.Spherical(parent, child, cut=cut)
    return mbs.Revolute(parent, child, axis="z", cut=cut)


def _moments(value: float) -> Mapping[str, float]:
    return {"Ixx": value, "Iyy": value, "Izz": value}


def _direction(rng: Rng) -> np.ndarray:
    found = rng.normal(size=3)
    return found / np.linalg.norm(found)


def _between(rng: Rng, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def _plain(values: Sequence[float] | np.ndarray) -> list[float]:
    return [float(x) for x in values]

FOUR_BAR = """
multibody_sym: 1
name: four_bar
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {right: [0.9, 0, 0]}}
  crank: {mass: 0.3, com: [0.15, 0, 0], inertia: {Izz: 0.002}, points: {end: [0.3, 0, 0]}}
  coupler: {mass: 0.8, com: [0.4, 0, 0], inertia: {Izz: 0.04}, points: {end: [0.8, 0, 0]}}
  rocker: {mass: 0.6, com: [0.3, 0, 0], inertia: {Izz: 0.02}, points: {end: [0.6, 0, 0]}}
joints:
  a: {type: revolute, parent: ground, child: crank, q: a, initial: {q: 0.7}}
  b: {type: revolute, parent: crank.end, child: coupler, q: b, initial: {q: 0}}
  c: {type: revolute, parent: ground.right, child: rocker, q: c, initial: {q: 1.5}}
  d: {type: revolute, parent: coupler.end, child: rocker.end}
"""
"""A linkage of four bars as a file; its last joint closes the loop."""
