"""Friction in joints of several freedoms: a plate that slides on a plane, and a cross that turns on two pins.

A plate rubs against the velocity of the joint's point with mu times the normal force. Each pin of a universal joint is
a journal, on which the force across it presses.
"""

from __future__ import annotations

from multibody_sym.errors import ModelError
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.force_rows import BrakingRow, ReactionRow, RubbingRow
from multibody_sym.model.mechanism.mass import ORIGIN, unit_vector
from multibody_sym.model.mechanism.one_way import FrictionPart
from multibody_sym.model.resolution.cuts import normals_of
from multibody_sym.model.resolution.one_way.rubbing import Made, Rubbing, aligned
from multibody_sym.scalars.node import as_node
from multibody_sym.scalars.rotations import turned
from multibody_sym.scalars.vectors import Vec, apply, cross


def plate(asked: Rubbing) -> Made:
    """Return the friction of what slides on a plane, and perhaps turns on it."""
    if asked.flat:
        raise ModelError(
            f"nothing presses along the normal of {asked.element.joint!r} in a model that stays in its plane; let a "
            "contact rub, or give the model what leaves the plane: a weight, a force"
        ).under("joint")
    asked.without("length", "pads are for sliders and hinges; a plane joint rubs with the force along its normal")
    moves = asked.joint.moves
    first, second = (unit_vector(step.slides[0]) for step in moves[:2])
    normal: Point = unit_vector(_nodes(cross(first, second)))
    if not aligned(cross(normal, first), second) or not all(aligned(step.turns[0], normal) for step in moves[2:]):
        raise asked.another()
    rows = tuple(RubbingRow(f"{asked.name}.friction{k}", rate) for k, rate in enumerate(asked.rates[:2], 1))
    return asked.reactions([(normal, ORIGIN)]), [asked.part(rows, range(1))]


def two_pins(asked: Rubbing) -> Made:
    """Return the friction of the two pins of a universal joint, on each of which the force across it presses."""
    asked.without("length", "bearings a length apart are for hinges; the pins rub with the joint's force alone")
    radius = asked.radius("a universal joint rubs on its two pins: give their radius")
    first, second = (unit_vector(step.turns[0]) for step in asked.joint.moves)
    angle = asked.freedoms[0].coordinate
    assert angle is not None
    turn = turned(first, angle)
    across = [normals_of(first), tuple(_nodes(apply(turn, n)) for n in normals_of(second))]
    normals: list[ReactionRow] = []
    parts: list[FrictionPart] = []
    for k, (pair, rate) in enumerate(zip(across, asked.rates, strict=True), 1):
        name = f"{asked.name}.pin{k}"
        normals += asked.reactions([(n, ORIGIN) for n in pair], name)
        row = BrakingRow(f"{name}.friction", rate)
        parts.append(asked.part((row,), range(2 * k - 2, 2 * k), radius, norm=True, name=name))
    return normals, parts


def _nodes(vector: Vec) -> Point:
    x, y, z = (as_node(v) for v in vector)
    return x, y, z
