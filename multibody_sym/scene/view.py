"""Views: the plane of a plane model against gravity, else a look from in front and above."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from multibody_sym.model.mechanism.mass import GROUND
from multibody_sym.model.resolution.plane import moves_in_plane
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import unit
from multibody_sym.scene.items import View
from multibody_sym.scene.stage import Stage

_AZIMUTHS: Final = (30.0, -60.0)
_ELEVATION: Final = 22.0
"""From where space is seen (deg): angles that neither hide axes behind each other nor make lengths alike."""
_APART: Final = 0.02
"""Places nearer than this part of the whole are one on the page."""
_CLEARLY: Final = 0.8
"""The second azimuth is taken where places crowd by so much less."""


def is_plane(stage: Stage) -> bool:
    """Return whether all moves in a plane: the x-y plane, or another one across a common axis."""
    return moves_in_plane(stage.system) or _normal(stage) is not None


def natural_view(stage: Stage) -> View:
    """Return the view that a scene is drawn in unless another is asked for."""
    if moves_in_plane(stage.system):
        return _flat(np.array([0.0, 0.0, 1.0]), stage.gravity)
    normal = _normal(stage)
    if normal is not None:
        return _flat(normal, stage.gravity)
    first, second = (turned_view(azimuth, _ELEVATION, _up(stage.gravity)) for azimuth in _AZIMUTHS)
    places = _places(stage)
    return second if _crowd(second, places) < _CLEARLY * _crowd(first, places) else first


def _places(stage: Stage) -> Floats:
    """Return where joints and centres of mass are at the start (n, 3), each place once, in sizes of the whole."""
    frames = (stage.place(joint.parent) for joint in stage.system.joints.values())
    found = [stage.world(place.body, place.point) for place in frames]
    found += [stage.world(stage.number_of(name), stage.centre(name)) for name in stage.system.bodies if name != GROUND]
    size = float(np.linalg.norm(np.ptp(found, axis=0))) if found else 0.0
    if not size > 0.0:
        return np.zeros((0, 3))
    scaled = np.unique(np.round(np.array(found) / size, 6), axis=0)
    return np.asarray(scaled)


def _crowd(view: View, places: Floats) -> float:
    """Return how near to each other places (n, 3) are on the page: the sum of one over squared distances."""
    seen = view.project(places)
    squares = ((seen[:, None] - seen[None]) ** 2).sum(-1)[np.triu_indices(len(seen), 1)]
    return float((1.0 / (squares + _APART**2)).sum())


def _up(gravity: Floats) -> Floats:
    """Return the direction against gravity; z where there is none."""
    size = float(np.linalg.norm(gravity))
    return np.array([0.0, 0.0, 1.0]) if size == 0.0 else -gravity / size


def _flat(normal: Floats, gravity: Floats) -> View:
    """Return the view against a normal, gravity down where it lies in the plane."""
    flat = gravity - (gravity @ normal) * normal
    if np.linalg.norm(flat) > 1e-9 * (1.0 + np.linalg.norm(gravity)):
        up = -flat
    else:
        up = np.array([0.0, 1.0, 0.0]) if abs(normal[1]) < 0.5 else np.array([0.0, 0.0, 1.0])
    up = np.array(unit(up))
    return View(unit(np.cross(up, normal)), unit(up))


def _normal(stage: Stage) -> Floats | None:
    """Return the axis about which everything turns, along which nothing slides and across which all places lie."""
    axes, ways, places = [], [], []
    for joint in stage.system.joints.values():
        if joint.cut:
            continue
        place = stage.place(joint.parent)
        places.append(stage.world(place.body, place.point))
        for step in joint.steps:
            axes += [stage.turned(place.body, place.turned(unit(stage.vector(axis)))) for axis in step.turns]
            ways += [stage.turned(place.body, place.turned(unit(stage.vector(axis)))) for axis in step.slides]
    if not axes:
        return None
    normal = axes[0] if axes[0].sum() > 0.0 else -axes[0]
    if np.allclose(normal, (0.0, 1.0, 0.0)):
        normal = -normal  # x to the right and z up are seen against y
    parallel = all(abs(float(axis @ normal)) > 1.0 - 1e-9 for axis in axes)
    level = all(abs(float(way @ normal)) < 1e-9 for way in ways)
    heights = [float(place @ normal) for place in places]
    tilted = abs(float(stage.gravity @ normal)) > 1e-9 * (1.0 + float(np.linalg.norm(stage.gravity)))
    flat = max(heights) - min(heights) < 1e-9 * (1.0 + max(map(abs, heights)))
    return normal if parallel and level and flat and not tilted else None


def turned_view(azimuth: float, elevation: float, up: Sequence[float] | Floats = (0.0, 0.0, 1.0)) -> View:
    """Return the view from an azimuth around `up` (deg, 0: x points at the reader) and an elevation above (deg)."""
    axis = np.array(unit(up))
    first = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 0.0, 1.0])
    first = np.array(unit(first - (first @ axis) * axis))
    second = np.cross(axis, first)
    a, e = math.radians(azimuth), math.radians(elevation)
    level = math.cos(a) * first + math.sin(a) * second
    towards = math.cos(e) * level + math.sin(e) * axis
    right = -math.sin(a) * first + math.cos(a) * second
    return View(unit(right), unit(np.cross(towards, right)))
