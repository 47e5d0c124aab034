"""Masses and poses of declared bodies: standard shapes, named points and frames, unit directions."""

from __future__ import annotations

from collections.abc import Container
from fractions import Fraction
from functools import cached_property
from typing import Final

from multibody_sym.model.declaration.bodies import Body, Frame, Shape, VariableMass
from multibody_sym.model.declaration.values import Point
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import sqrt
from multibody_sym.scalars.node import ONE, ZERO, Node
from multibody_sym.scalars.rotations import turned
from multibody_sym.scalars.traversal import leaves
from multibody_sym.scalars.vectors import product

GROUND: Final = "ground"
COM: Final = "com"
OWN_POINTS: Final = ("origin", COM)
"""The points that every body has, unless it declares others of these names."""
Rotation = tuple[Point, Point, Point]

ORIGIN: Final[Point] = (ZERO, ZERO, ZERO)
IDENTITY: Final[Rotation] = ((ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE))


@dataclass(frozen=True)
class Pose:
    """Position and orientation of a frame on a body: p = position + rotation x (rows of `rotation` are rows)."""

    position: Point = ORIGIN
    rotation: Rotation = IDENTITY


@dataclass(frozen=True)
class Mass:
    """Mass, centre of mass, and inertia (Ixx, Iyy, Izz, Ixy, Ixz, Iyz) about it, all in body axes."""

    mass: Node
    com: Point
    inertia: tuple[Node, ...]

    @cached_property
    def moving_leaves(self) -> tuple[Node, ...]:
        """What changes along a motion, of all that it names in slots."""
        named = leaves((self.mass, *self.com, *self.inertia), "slot")
        return tuple(leaf for leaf in named if leaf.data[0] != "parameters")


NO_MASS: Final = Mass(ZERO, ORIGIN, (ZERO,) * 6)


def mass_of(body: Body) -> Mass:
    """Return what a body's declaration says of its mass; a body without inertia is a particle at `com`."""
    if body.shape is None:
        return Mass(_number(body.mass), body.com or ORIGIN, body.inertia or (ZERO,) * 6)
    length = body.shape.sizes[0]
    natural = (length / 2, ZERO, ZERO) if body.shape.kind == "rod" else ORIGIN
    return Mass(_number(body.shape.mass), body.com or natural, (*_shape_inertia(body.shape), ZERO, ZERO, ZERO))


def centre_moves(body: Body, parameters: Container[str]) -> bool:
    """Return whether the centre of mass of a body whose mass varies moves in it; expressions in names or slots."""
    if body.varying is None:
        return False
    named = leaves(mass_of(body).com, "slot", "symbol")
    return any(x.data[0] != "parameters" if x.op == "slot" else x.data not in parameters for x in named)


def used_up(body: str) -> str:
    """Return what the stop is called that ends a run where nothing is left of a body's mass."""
    return f"mass of {body}"


def _number(mass: Node | VariableMass | None) -> Node:
    return mass.value if isinstance(mass, VariableMass) else mass or ZERO


def _shape_inertia(shape: Shape) -> tuple[Node, Node, Node]:
    """Return the principal moments of a homogeneous body; source: any table of moments of inertia."""
    m, sizes = _number(shape.mass), shape.sizes
    square = sizes[0] ** 2
    if shape.kind == "rod":
        return ZERO, m * square / 12, m * square / 12
    if shape.kind == "box":
        x, y, z = (size**2 for size in sizes)
        return m * (y + z) / 12, m * (x + z) / 12, m * (x + y) / 12
    if shape.kind == "cylinder":
        across = m * (3 * square + sizes[1] ** 2) / 12
        return across, across, m * square / 2
    if shape.kind in ("disc", "ring"):
        axial = m * square / 2 if shape.kind == "disc" else m * square
        return axial / 2, axial / 2, axial
    all_round = m * square * (Fraction(2, 5) if shape.kind == "sphere" else Fraction(2, 3))
    return all_round, all_round, all_round


def unit_vector(v: Point) -> Point:
    """Return v / |v|, with exact components where they are."""
    length = sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
    return v[0] / length, v[1] / length, v[2] / length


def pose_of(frame: Frame) -> Pose:
    """Return a declared frame as a pose."""
    rotation = IDENTITY
    for turn in frame.rotate:
        rotation = product(rotation, turned(unit_vector(turn.axis), turn.angle))
    return Pose(frame.position, rotation)
