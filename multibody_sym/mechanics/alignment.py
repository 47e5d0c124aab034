"""A mechanism described in axes in which its motion takes few operations.

Every body gets axes that are parallel to its parent's at zero coordinates, or as near to that as lets its joint move
along or about one of them, and an origin on its joint. Rotation matrices and positions are then full of exact zeros
and ones. Coordinates, speeds and multipliers keep their meaning: only what is said in a body's own axes changes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from functools import singledispatch
from typing import Any, Final

from multibody_sym.mechanics.load_records import Load
from multibody_sym.mechanics.mechanism import Mechanism, TreeBody
from multibody_sym.mechanics.motion import Motion, State, invariant_directions, motion_of
from multibody_sym.mechanics.points import as_point
from multibody_sym.mechanics.row_records import BodyFace, ContactSurface, Marker, RopeBend, RoughWheel, Row, Sliding
from multibody_sym.model.bodies import IDENTITY, ORIGIN, Mass, Pose, Rotation
from multibody_sym.model.fields import Point
from multibody_sym.model.steps import Step
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import is_exactly
from multibody_sym.scalars.node import Node, as_node, real
from multibody_sym.scalars.vectors import (
    UNIT_MATRIX,
    ZERO_VECTOR,
    Mat,
    Vec,
    add,
    apply,
    apply_transposed,
    cross,
    product,
    subtract,
    symmetric,
    transpose,
    turned_symmetric,
)

_ROUNDING: Final = 1e-14
"""Elements of rotations that are nearer than this to -1, 0 or 1 are these numbers, rounded."""


@dataclass(frozen=True)
class AlignedAxes:
    """New axes of a body: `turn` maps components along the declared axes to those along the new ones; `origin` is the
    new origin, in the declared axes."""

    turn: Mat = UNIT_MATRIX
    origin: Vec = ZERO_VECTOR

    def vector(self, v: Sequence[Node]) -> Point:
        return as_point(apply(self.turn, v))

    def pose(self, declared: Pose) -> Pose:
        rotation = _round_rotation(product(self.turn, _matrix(declared.rotation)))
        return Pose(self.point(declared.position), rotation)

    def point(self, declared: Point) -> Point:
        return self.vector(subtract(declared, self.origin)) if self.origin is not ZERO_VECTOR else self.vector(declared)

    def mass(self, declared: Mass) -> Mass:
        if self.turn is UNIT_MATRIX:
            return replace(declared, com=self.point(declared.com))
        J = turned_symmetric(self.turn, symmetric(declared.inertia))
        inertia = (J[0][0], J[1][1], J[2][2], J[0][1], J[0][2], J[1][2])
        return Mass(declared.mass, self.point(declared.com), tuple(map(as_node, inertia)))


def align_bodies(mechanism: Mechanism) -> Mechanism:
    """Return an equivalent mechanism whose bodies have axes and origins that suit their joints.

    Bodies whose joints' directions depend on parameters keep their declared axes.
    """
    axes = {-1: AlignedAxes()}
    bodies = []
    for index, body in enumerate(mechanism.bodies):
        on_parent = axes[body.parent].pose(body.frame_on_parent)
        axes[index], joined = _align_body(body, on_parent)
        bodies.append(replace(joined, mass=axes[index].mass(body.mass)))
    return replace(
        mechanism,
        bodies=tuple(bodies),
        markers={name: _in_axes(marker, axes) for name, marker in mechanism.markers.items()},
        loads=_in_axes(mechanism.loads, axes),
        rows=_in_axes(mechanism.rows, axes),
    )


def economical_motion(mechanism: Mechanism, state: State) -> Motion:
    """Return the motion at a state; over Nodes, which become code, that of the aligned mechanism."""
    return motion_of(align_bodies(mechanism) if state.scalar is Node else mechanism, state)


def _align_body(body: TreeBody, on_parent: Pose) -> tuple[AlignedAxes, TreeBody]:
    """Return a body's new axes, and the body with its joint described in them and in the parent's new ones."""
    on_body = body.frame_on_body
    directions = [d for step in body.steps for d in (*step.slides, *step.turns)]
    if any(x.shadow is None for d in (*on_parent.rotation, *on_body.rotation, *directions) for x in d):
        return AlignedAxes(), replace(body, frame_on_parent=on_parent)
    turn_F, turn_M = _matrix(on_parent.rotation), _matrix(on_body.rotation)
    turns = [axis for step in body.steps for axis in step.turns]
    # Q turns the axes of the joint's frames into those in which it is computed. At best Q = R_PF: body and parent are
    # parallel at zero coordinates; a joint whose first turn is not about one of the parent's axes turns on by the
    # smallest angle that makes it so. Speeds that are components along the child's axes keep these.
    if body.speeds_in_own_axes:
        turn = UNIT_MATRIX
    elif not turns:
        turn = turn_F
    else:
        turn = _matrix(_round_rotation(product(_to_coordinate_axis(apply(turn_F, turns[0])), turn_F)))
    steps = tuple(step.with_directions(lambda d: _round_direction(apply(turn, d))) for step in body.steps)
    rotation = _round_rotation(product(turn_F, transpose(turn)))
    shift = _shift(steps, apply_transposed(_matrix(rotation), on_parent.position))
    position, origin = on_parent.position, on_body.position
    if shift is not ZERO_VECTOR:
        position = as_point(add(position, apply(_matrix(rotation), shift)))
        origin = as_point(add(origin, apply(turn_M, apply_transposed(turn, shift))))
    to_new = _matrix(_round_rotation(product(turn, transpose(turn_M))))
    axes = AlignedAxes(to_new, ZERO_VECTOR if origin is ORIGIN else origin)
    return axes, replace(body, steps=steps, frame_on_parent=Pose(position, rotation), frame_on_body=Pose())


def _to_coordinate_axis(direction: Vec) -> Mat:
    """Return the smallest rotation that brings a unit vector onto a coordinate axis."""
    n = [float(x.shadow or 0) for x in _round_direction(direction)]
    k = max(range(3), key=lambda i: abs(n[i]))
    if abs(n[k]) == 1:
        return UNIT_MATRIX
    target = [math.copysign(1.0, n[k]) if i == k else 0.0 for i in range(3)]
    x, y, z = cross(n, target)  # R = E + [v] + [v]^2 / (1 + c) with v = n x e, c = n . e
    scaled = 1 / (1 + abs(n[k]))
    return (
        (1 - scaled * (y * y + z * z), scaled * x * y - z, scaled * x * z + y),
        (scaled * x * y + z, 1 - scaled * (x * x + z * z), scaled * y * z - x),
        (scaled * x * z - y, scaled * y * z + x, 1 - scaled * (x * x + y * y)),
    )


def _shift(steps: Sequence[Step], p: Sequence[Node]) -> Vec:
    """Return how far a joint's frames may be moved, along directions that it keeps, so that more of p_PF is zero."""
    known = [x if x.shadow is not None else 0 for x in map(as_node, p)]
    if len(steps) > 1:
        return ZERO_VECTOR
    for step in steps:
        kept = [any(is_exactly(d[k] * d[k], 1) for d in invariant_directions(step)) for k in range(3)]
        known = [x if keep else 0 for x, keep in zip(known, kept, strict=True)]
    return ZERO_VECTOR if all(is_exactly(x, 0) for x in known) else (-known[0], -known[1], -known[2])


def _round_rotation(rotation: Mat) -> Rotation:
    rows = _round_direction(rotation[0]), _round_direction(rotation[1]), _round_direction(rotation[2])
    return IDENTITY if rows == IDENTITY else rows


def _matrix(rotation: Rotation) -> Mat:
    """Return a rotation for products, which skip the unit matrix."""
    return UNIT_MATRIX if rotation is IDENTITY else rotation


def _round_direction(direction: Sequence[Any]) -> Point:
    """Return a direction in numbers where it has some, those near -1, 0 and 1 being these."""
    found = []
    for x in map(as_node, direction):
        if x.shadow is not None and x.op != "number":
            nearest = round(x.shadow)
            x = as_node(nearest) if abs(x.shadow - nearest) < _ROUNDING else real(x.shadow)
        found.append(x)
    return found[0], found[1], found[2]


@singledispatch
def _in_axes(part: Any, axes: Mapping[int, AlignedAxes]) -> Any:
    """Return a part of a mechanism with its poses in new axes of their bodies.

    Components along the axes of its own markers stay.
    """
    body, vectors = (part.axes_of, part.vectors) if isinstance(part, Load) else (None, ())
    if isinstance(part, (Row, BodyFace, ContactSurface, Sliding, Load)) and (body is None or vectors):
        new = {f.name: _in_axes(getattr(part, f.name), axes) for f in fields(part)}
        given_along = {} if body is None else {name: axes[body].vector(getattr(part, name)) for name in vectors}
        return replace(part, **new | given_along)
    if isinstance(part, _PLAIN):
        return part
    raise TypeError(f"nothing says how {type(part).__name__} is described in other axes")


_PLAIN: Final = (str, int, float, Node, type(None))


@_in_axes.register(tuple)
def _(part: tuple[Any, ...], axes: Mapping[int, AlignedAxes]) -> Any:
    return tuple(_in_axes(x, axes) for x in part)


@_in_axes.register
def _(part: Marker, axes: Mapping[int, AlignedAxes]) -> Marker:
    return replace(part, pose=axes[part.body].pose(part.pose))


@_in_axes.register
def _(part: RopeBend, axes: Mapping[int, AlignedAxes]) -> RopeBend:
    new = {name: _in_axes(getattr(part, name), axes) for name in ("at", "beside", "grip")}
    return replace(part, **new, axis=axes[part.at.body].vector(part.axis))


@_in_axes.register
def _(part: RoughWheel, axes: Mapping[int, AlignedAxes]) -> RoughWheel:
    return replace(part, frame=_in_axes(part.frame, axes))


