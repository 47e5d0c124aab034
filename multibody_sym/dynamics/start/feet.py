"""Feet at the start: the parameters of curves that are touched or guide points, found where these are.

Of a curve many places satisfy what its foot has to: it is across the way to each place that is nearest, or farthest.
Rows are closed from the nearest of many places along it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from multibody_sym.dynamics.start.constants import valued
from multibody_sym.errors import ModelError, at
from multibody_sym.kinematics.contacts import touch
from multibody_sym.kinematics.guides.touched import fits
from multibody_sym.kinematics.motion import Motion, accelerations, pose
from multibody_sym.kinematics.points import position
from multibody_sym.kinematics.relative import direction
from multibody_sym.kinematics.state import State
from multibody_sym.model.declaration.curves.follow import Follow
from multibody_sym.model.mechanism.contact_rows import Bent, ContactRow, Flat, Round, Skin
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.rows import PositionRow
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.records import dataclass

_PLACES: Final = 360
"""How many places are looked at along a curve: a degree of an outline apart."""
_WIDE: Final = 4.0
"""How much farther than what touches it a curve is looked at whose parameter is a length."""
_CLOSED: Final = 1e-6
"""The part of its radius by which what touches may be off its curve at the start."""
_SIDES: Final = {True: 1.0, False: -1.0}


@dataclass(frozen=True)
class _Along:
    """Places along the curve of a foot: parameters (n), positions and unit tangents (n x 3, world axes)."""

    coordinate: int
    parameters: Floats
    places: Floats
    ways: Floats

    def normals(self, skin: Bent) -> Floats:
        """Return the normals (n x 3) towards what touches it."""
        turned = np.column_stack([-self.ways[:, 1], self.ways[:, 0], np.zeros(len(self.ways))])
        return _SIDES[skin.left] * turned


def has_curves(mechanism: Mechanism) -> bool:
    """Return whether curves guide anything, or are touched."""
    return any(isinstance(step, Follow) for body in mechanism.bodies for step in body.steps)


def with_feet(motion: Motion, q: Floats) -> Floats:
    """Return coordinates with those of feet where their curves are nearest to what touches them, or is guided."""
    found = q.copy()
    for coordinates, parameters in _found(motion):
        found[coordinates] = parameters
    return found


def verify_ways(mechanism: Mechanism, state: State) -> None:
    """Raise ModelError where a curve has no value, or leads nowhere: in a cusp its bead has no direction to move in."""
    for body in mechanism.bodies:
        for free in body.free_steps:
            step = free.step
            if not isinstance(step, Follow):
                continue
            s, (name, unit) = state.q[free.q[0]], step.leaf.data[1]
            with at("joints", body.joint_name, "curve"), valued():
                *place, x, y, z = state.values((*step.place, *step.rates.s), {step.leaf: s})
                if x == y == z == 0.0:
                    raise ModelError(
                        f"the curve has a cusp, or stops, at {name} = {s:.6g} {unit}, where nothing tells which way it "
                        f"leads from {_listed(place)} m; start beside it",
                        number="M114",
                    )


def _listed(place: Sequence[float]) -> str:
    return f"({', '.join(f'{x:.6g}' for x in place)})"


def verify_fits(motion: Motion) -> None:
    """Raise ModelError for a hollow that bends more than the ball or disc that touches it."""
    mechanism = motion.mechanism
    if not any(body.is_foot for body in mechanism.bodies):
        return
    bias = accelerations(motion, [0.0] * len(motion.state.u))
    paths = [(mechanism.row_path(k), row) for k, row in enumerate(mechanism.rows)]
    paths += [(element.path, row) for element in mechanism.one_way for row in element.normals]
    for path, row in paths:
        for fit in fits(motion, [row]):
            if fit.ratio >= 1.0 and touch(fit.row.skins, motion, bias).gap <= _CLOSED * fit.radius:
                with at(*path):
                    raise ModelError(f"{fit.text}; {fit.advice}, or start elsewhere", number="M114")


def _found(motion: Motion) -> Iterator[tuple[list[int], list[float]]]:
    mechanism = motion.mechanism
    one_way = (row for element in mechanism.one_way for row in element.normals)
    for row in (*mechanism.rows, *one_way):
        if isinstance(row, ContactRow) and row.along == "normal":
            skins = row.skins
            bent = [skin for skin in skins if isinstance(skin, Bent)]
            if len(bent) == 2:
                yield from _both(motion, bent)
            elif bent:
                yield from _one(motion, bent[0], skins[1] if skins[0] is bent[0] else skins[0])
        elif isinstance(row, PositionRow) and _is_foot(mechanism, row.frames[0]) and row.name.endswith(".x"):
            yield from _nearest(motion, row.frames)


def _is_foot(mechanism: Mechanism, marker: Marker) -> bool:
    return marker.body >= 0 and mechanism.bodies[marker.body].is_foot


def _nearest(
    motion: Motion, frames: tuple[Marker, Marker], *, farthest: bool = False
) -> Iterator[tuple[list[int], list[float]]]:
    target = np.array(position(motion, frames[1]), dtype=float)
    along = _along(motion, frames[0], target)
    if along is not None:
        away = np.linalg.norm(along.places - target, axis=1)
        yield _chosen(along, -away if farthest else away)


def _one(motion: Motion, bent: Bent, other: Skin) -> Iterator[tuple[list[int], list[float]]]:
    """Yield where an outline is lowest over a plane, or a curve nearest to a centre, or farthest from a hollow's."""
    if not isinstance(other, Flat):
        yield from _nearest(motion, (bent.foot, other.place), farthest=isinstance(other, Round) and other.inside)
        return
    normal = np.array(direction(motion, other.place, other.normal), dtype=float)
    along = _along(motion, bent.foot, np.array(position(motion, other.place), dtype=float))
    if along is not None:
        yield _chosen(along, along.places @ normal)


def _both(motion: Motion, bent: Sequence[Bent]) -> Iterator[tuple[list[int], list[float]]]:
    """Yield where two curves face each other, nearest of all."""
    first, second = bent
    centres = [np.array(position(motion, skin.place), dtype=float) for skin in bent]
    one, other = _along(motion, first.foot, centres[1]), _along(motion, second.foot, centres[0])
    if one is None or other is None:
        return
    apart = one.places[:, None, :] - other.places[None, :, :]
    size = max(float(np.ptp(one.places, axis=0).max()), float(np.ptp(other.places, axis=0).max()))
    facing = one.normals(first) @ other.normals(second).T
    missed = np.linalg.norm(apart, axis=2) + size * (1.0 + facing)
    i, k = np.unravel_index(int(np.nanargmin(missed)), missed.shape)
    yield [one.coordinate, other.coordinate], [float(one.parameters[i]), float(other.parameters[k])]


def _chosen(along: _Along, height: Floats) -> tuple[list[int], list[float]]:
    return [along.coordinate], [float(along.parameters[int(np.nanargmin(height))])]


def _along(motion: Motion, foot: Marker, target: Floats) -> _Along | None:
    """Return places along the curve of a foot: once around, or as far as a target is away and more."""
    body = motion.mechanism.bodies[foot.body]
    step = body.steps[0]
    assert isinstance(step, Follow)
    R, p = (np.array(x, dtype=float) for x in _carrier(motion, foot.body))
    axes = np.array([motion.state.values(axis) for axis in step.axes], dtype=float)
    local = axes @ R.T @ (target - p)
    if step.unit == "rad":
        around, middle = 2.0 * np.pi, 0.0
    else:
        own = [k for k, x in enumerate(step.place) if x is step.leaf]
        middle = float(local[own[0]]) if own else 0.0
        around = _WIDE * max(1.0, float(np.linalg.norm(local)))
    found = []
    for s in middle + around * (np.arange(_PLACES) / _PLACES - 0.5):
        try:
            values = motion.state.values((*step.place, *step.rates.s), {step.leaf: float(s)})
        except UNDEFINED:
            continue
        found.append((s, *values))
    table = np.array([row for row in found if np.isfinite(row).all()], dtype=float)
    if not len(table):
        return None
    ways = table[:, 4:] / np.maximum(np.linalg.norm(table[:, 4:], axis=1, keepdims=True), 1e-300)
    return _Along(body.q[0], table[:, 0], p + table[:, 1:4] @ axes @ R.T, ways @ axes @ R.T)


def _carrier(motion: Motion, index: int) -> tuple[Sequence[Sequence[float]], Sequence[float]]:
    """Return the pose of the frame that carries a foot's curve."""
    body = motion.mechanism.bodies[index]
    R_PF, p_PF = pose(motion.state, body.frame_on_parent)
    if body.parent < 0:
        return R_PF, p_PF
    R_WP, p_WP = (np.array(x, dtype=float) for x in motion.poses[body.parent])
    return (R_WP @ np.array(R_PF, dtype=float)).tolist(), (p_WP + R_WP @ np.array(p_PF, dtype=float)).tolist()
