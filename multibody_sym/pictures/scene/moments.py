"""The forms that the moments of inertia of a body without a shape tell: tops, boxes, discs, balls, rods."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from multibody_sym.mechanics.references import moves_in_plane
from multibody_sym.model.bodies import Body, mass_of
from multibody_sym.model.joints import Spherical
from multibody_sym.pictures.scene.items import Block, ConeBody, Disc, Form, Polyline, Sphere, Symbol, Vector, vector
from multibody_sym.pictures.scene.stage import PlacedSystem
from multibody_sym.scalars.arrays import Floats

_THIN: Final = 0.05
"""Below this part of its moment across, the moment about its axis is that of a rod."""
_THINNEST: Final = 0.03
_ALIKE: Final = 0.02
"""A rod with the moment of a body ends at a joint that is nearer to its end than this part of its length."""
_LUMP: Final = 0.15
"""A body whose radius of gyration is below this part of its arm is a lump at its end."""
_ECCENTRIC: Final = 0.2
"""The centre of mass of a wheel is nearer to its axle than this part of its radius of gyration."""
_UNIT: Final = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def top(stage: PlacedSystem, name: str, body: Body) -> ConeBody | None:
    """Return the cone of a top: it stands on a point of its axis, about which it turns freely, and is no thin rod.

    Its centre of mass is at three quarters of its height, its radius that of a cone with its moment about the axis.
    """
    joint, mass = stage.carrying(name), stage.number(mass_of(body).mass)
    if joint is None or not isinstance(joint, Spherical) or not stage.is_ground(joint.parent) or body.inertia is None:
        return None
    moments = _tensor(stage, body)
    tip, centre = np.array(stage.place(joint.child).point), np.array(stage.centre(name))
    height = float(np.linalg.norm(centre - tip))
    if height == 0.0 or mass <= 0.0:
        return None
    axis = (centre - tip) / height
    if float(stage.turned(stage.number_of(name), axis) @ stage.gravity) >= 0.0:  # it hangs
        return None
    about, across = float(axis @ moments @ axis), (float(np.trace(moments)) - float(axis @ moments @ axis)) / 2.0
    round_ = np.allclose(moments, across * np.eye(3) + (about - across) * np.outer(axis, axis), atol=1e-9 * across)
    if not round_ or about < _THIN * across:
        return None
    radius = float(np.clip(np.sqrt(10.0 / 3.0 * about / mass), 0.3 * height, 1.2 * height))
    return ConeBody(vector(tip), vector(axis), radius, 4.0 / 3.0 * height)


def at_its_centre(stage: PlacedSystem, name: str, body: Body) -> Block | Disc | None:
    """Return the box with the moments of a body that flies in space, the disc with that of one that spins there."""
    joint, mass = stage.carrying(name), stage.number(mass_of(body).mass)
    if joint is None or body.inertia is None or mass <= 0.0 or moves_in_plane(stage.system):
        return None
    moments = np.array([stage.number(node) for node in body.inertia[:3]])
    centre, size = stage.centre(name), stage.lengths.get("size", 1.0)
    if joint.kind == "free" and any(moments):
        squares = 6.0 * (moments.sum() - 2.0 * moments) / mass
        largest = float(np.sqrt(max(squares)))
        sizes = np.sqrt(np.maximum(squares, (_THINNEST * largest) ** 2))
        return Block(centre, _UNIT, (float(sizes[0]), float(sizes[1]), float(sizes[2])))
    if joint.kind == "revolute":
        axis = stage.axis(stage.place(joint.child), joint.steps[0].turns[0])
        radius = float(np.sqrt(2.0 * float(moments @ np.square(axis)) / mass))
        return Disc(centre, axis, radius) if _THINNEST * size < radius < size else None
    return None


def on_an_arm(stage: PlacedSystem, name: str, body: Body, place: Vector, *, whole: bool) -> Iterator[Form]:
    """Yield the forms of a body that one place holds: a wheel out of balance, a ball on its arm, else a rod.

    The rod goes through its centre of mass and has its moment; it begins at its place, or behind it where that is
    within the rod. One that is not `whole` ends at its centre.
    """
    centre, joint = np.array(stage.centre(name)), stage.carrying(name)
    arm = float(np.linalg.norm(centre - place))
    mass, axis = stage.number(mass_of(body).mass), (centre - place) / arm
    moments = _tensor(stage, body)
    about = float(axis @ moments @ axis)
    across = float(moments[2, 2]) if moves_in_plane(stage.system) else (float(np.trace(moments)) - about) / 2.0
    gyration = float(np.sqrt(max(across, 0.0) / mass)) if mass > 0.0 else 0.0
    if arm < _ECCENTRIC * gyration and joint is not None and joint.kind == "revolute":
        axle = stage.axis(stage.place(joint.child), joint.steps[0].turns[0])
        large = stage.is_ground(joint.parent)  # one on a mass without a size has none
        yield Disc(place, axle, float(np.sqrt(2.0) * gyration)) if large else Symbol("rotor", place, axle)
        return
    radius = float(np.sqrt(2.5) * gyration)
    if across > 0.0 and np.allclose(moments, across * np.eye(3), atol=1e-9 * across) and radius < arm:
        yield Polyline((place, vector(centre - radius * axis)))
        yield Sphere(vector(centre), radius)
        return
    half = float(np.sqrt(3.0) * gyration)
    slender = moves_in_plane(stage.system) or about < _THIN * across
    is_rod = whole and slender and _LUMP * arm < half
    far = centre + half * axis if is_rod else centre
    within = is_rod and half > (1.0 + _ALIKE) * arm
    yield Polyline((vector(centre - half * axis) if within else place, vector(far)))


def rod_beyond(stage: PlacedSystem, name: str, body: Body, places: Sequence[Vector]) -> list[Vector]:
    """Return the places of a body, and the free end of the uniform rod that it is: it begins at one of them.

    In the plane, where all of them are on its line through the centre of mass.
    """
    mass, centre = stage.number(mass_of(body).mass), np.array(stage.centre(name))
    ways = np.array(places) - centre
    reach = np.linalg.norm(ways, axis=1)
    first = int(np.argmax(reach))
    if body.inertia is None or mass <= 0.0 or reach[first] == 0.0 or not moves_in_plane(stage.system):
        return [*places]
    half, axis = float(np.sqrt(3.0 * max(stage.number(body.inertia[2]), 0.0) / mass)), ways[first] / reach[first]
    on_line = float(np.abs(np.cross(ways, axis)).max()) < _ALIKE * half
    is_rod = on_line and abs(reach[first] - half) < _ALIKE * half
    bare = min(float((ways @ axis).min()) + half, half) > _ALIKE * half
    return [*places, vector(centre - half * axis)] if is_rod and bare else [*places]


def _tensor(stage: PlacedSystem, body: Body) -> Floats:
    """Return the moments of inertia of a body about its centre of mass (3, 3), in its axes."""
    assert body.inertia is not None
    xx, yy, zz, xy, xz, yz = (stage.number(node) for node in body.inertia)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
