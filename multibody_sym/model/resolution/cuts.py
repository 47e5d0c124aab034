"""Cut joints: the rows that stand for a joint which closes a loop, named after it.

A joint that moves along straight directions first and then turns restricts what is left: its child's frame M keeps
its place along the normals of those directions in the parent's frame F, and M's axes their angles to F's.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

from multibody_sym.model.declaration.joint import Joint
from multibody_sym.model.declaration.values import AXES, Point
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import unit_vector
from multibody_sym.model.mechanism.rows import AngleRow, PositionRow, Row
from multibody_sym.scalars.node import ONE, ZERO
from multibody_sym.scalars.vectors import cross, dot

_X: Final[Point] = (ONE, ZERO, ZERO)
_Y: Final[Point] = (ZERO, ONE, ZERO)
_Z: Final[Point] = (ZERO, ZERO, ONE)
_UNITS: Final = (_X, _Y, _Z)
_NOT_PARALLEL: Final = 1e-9


def has_rows(joint: Joint) -> bool:
    """Return whether rows without coordinates of their own can stand for a joint.

    Not for screws, motion that is prescribed, motion along directions that have turned, and turns about one axis twice.
    """
    if joint.moves != joint.steps:
        return False
    first_turn = next((k for k, step in enumerate(joint.steps) if step.turns), len(joint.steps))
    straight = not any(step.slides for step in joint.steps[first_turn:])
    turns = [axis for step in joint.steps for axis in step.turns]
    free = all(step.is_independent for step in joint.steps)
    return straight and free and len(turns) <= 3 and not any(_parallel(a, b) for a, b in pairwise(turns))


def cut_rows(name: str, joint: Joint, frames: tuple[Marker, Marker]) -> list[Row]:
    """Return the rows that stand for a joint between frame F of its parent and frame M of its child."""
    moves = [unit_vector(axis) for step in joint.steps for axis in step.slides]
    turns = [unit_vector(axis) for step in joint.steps for axis in step.turns]
    rows: list[Row] = []
    for letter, axis in zip(*_normals(moves, ("x", "y", "z"), "n"), strict=True):
        rows.append(PositionRow(f"{name}.{letter}", frames, axis))
    return rows if len(turns) == 3 else rows + _angle_rows(name, turns, frames)


def welded_rows(name: str, frames: tuple[Marker, Marker]) -> list[Row]:
    """Return the rows that hold frame M in frame F."""
    positions: list[Row] = [
        PositionRow(f"{name}.{letter}", frames, axis) for letter, axis in zip(AXES, _UNITS, strict=True)
    ]
    return positions + _angle_rows(name, (), frames)


def _angle_rows(name: str, axes: Sequence[Point], frames: tuple[Marker, Marker]) -> list[Row]:
    """Return the rows under which M turns relative to F about these unit axes only."""
    if not axes:
        pairs = zip(AXES, ((_Z, _Y), (_X, _Z), (_Y, _X)), _UNITS, strict=True)
        return [AngleRow(f"{name}.r{letter}", frames, pair, shared=axis) for letter, pair, axis in pairs]
    if len(axes) == 1:
        letters, normals = _normals(axes, ("rx", "ry", "rz"), "r")
        return [
            AngleRow(f"{name}.{letter}", frames, (cross(normal, axes[0]), axes[0]), shared=axes[0])
            for letter, normal in zip(letters, normals, strict=True)
        ]
    return [AngleRow(f"{name}.r", frames, (axes[0], axes[1]), dot(axes[0], axes[1]))]


def normals_of(axis: Point) -> tuple[Point, Point]:
    """Return two unit vectors normal to a direction and to each other."""
    first, second = _normals([unit_vector(axis)], AXES, "")[1]
    return first, second


def _normals(axes: Sequence[Point], letters: tuple[str, str, str], other: str) -> tuple[list[str], list[Point]]:
    """Return unit vectors that with `axes` span space, with their names: coordinate axes where they will do."""
    plain = [k for k, unit in enumerate(_UNITS) if all(dot(unit, axis) is ZERO for axis in axes)]
    if len(plain) == 3 - len(axes):
        return [letters[k] for k in plain], [_UNITS[k] for k in plain]
    if len(axes) == 2:
        normals = [unit_vector(cross(*axes))]
    else:
        first = _UNITS[plain[0]] if plain else unit_vector(cross(axes[0], _least_aligned(axes[0])))
        normals = [first, unit_vector(cross(axes[0], first))]
    return [f"{other}{k}" for k in range(1, len(normals) + 1)], normals


def _least_aligned(axis: Point) -> Point:
    """Return the coordinate axis along which a unit vector has its smallest known component."""
    sizes = [abs(float(x.shadow)) if x.shadow is not None else 1.0 for x in axis]
    return _UNITS[sizes.index(min(sizes))]


def _parallel(a: Point, b: Point) -> bool:
    shadows = [x.shadow for x in cross(a, b)]
    return all(x is not None and abs(x) < _NOT_PARALLEL for x in shadows)
