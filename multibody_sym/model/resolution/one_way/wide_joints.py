"""Friction in joints of several freedoms: plates that slide on a plane, balls, and crosses that turn on two pins.

A plate rubs against the velocity of the joint's point with mu times the normal force N. One that bears on a ring of a
radius r rubs about its normal too: force F and couple C together have the size (F^2 + (C/r)^2)^(1/2) = mu N while it
slides, against the velocity and r times the angular velocity. A ball in its socket rubs with mu r |F| against the
angular velocity. Each pin of a universal joint is a journal, on which the force across it presses; so it is with
freedoms of custom joints, one on the other, of which those that slide are guides.
"""

from __future__ import annotations

from collections.abc import Sequence

from multibody_sym.errors import ModelError
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.force_rows import BrakingRow, ReactionRow, RubbingRow
from multibody_sym.model.mechanism.mass import ORIGIN, unit_vector
from multibody_sym.model.mechanism.one_way import FrictionPart
from multibody_sym.model.resolution.one_way.rubbing import Made, Rubbing, aligned
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node
from multibody_sym.scalars.rotations import turned
from multibody_sym.scalars.vectors import UNIT_MATRIX, Mat, Vec, add, apply, cross, product, scale


def plate(asked: Rubbing) -> Made:
    """Return the friction of what slides on a plane, and perhaps turns on it."""
    if asked.flat:
        raise ModelError(
            f"nothing presses along the normal of {asked.element.joint!r} in a model that stays in its plane; let a "
            "contact rub, or give the model what leaves the plane: a weight, a force",
            number="M114",
        ).under("joint")
    asked.without("length", "pads are for sliders and hinges; a plane joint rubs with the force along its normal")
    moves, radius = asked.joint.moves, asked.element.radius
    if len(moves) == 2:
        asked.without("radius", f"{asked.element.joint!r} does not turn, so that nothing rubs at a radius")
    first, second = (unit_vector(step.slides[0]) for step in moves[:2])
    normal: Point = unit_vector(_nodes(cross(first, second)))
    if not aligned(cross(normal, first), second) or not all(aligned(step.turns[0], normal) for step in moves[2:]):
        return stacked(asked)
    speeds = [*asked.rates[:2], *([] if radius is None else [radius * asked.rates[2]])]
    rows = tuple(RubbingRow(f"{asked.name}.friction{k}", speed) for k, speed in enumerate(speeds, 1))
    return asked.reactions([(normal, ORIGIN)]), [asked.part(rows, range(1))]


def ball(asked: Rubbing) -> Made:
    """Return the friction of a ball in its socket, against its angular velocity."""
    asked.without("length", "a ball has none; give its radius")
    radius = asked.radius("a ball rubs at its radius: give it")
    rows = tuple(BrakingRow(f"{asked.name}.friction{k}", speed) for k, speed in enumerate(_turning(asked), 1))
    units = ((ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE))
    return asked.reactions([(unit, ORIGIN) for unit in units]), [asked.part(rows, range(3), radius, norm=True)]


def _turning(asked: Rubbing) -> Sequence[Node]:
    """Return the angular velocity along axes at right angles: the child's, the parent's where angles are chosen."""
    if len(asked.joint.moves) == 1:
        return asked.rates
    R: Mat = UNIT_MATRIX
    total: Vec = (ZERO, ZERO, ZERO)
    for step, freedom in zip(asked.joint.moves, asked.freedoms, strict=True):
        assert freedom.coordinate is not None
        axis = unit_vector(step.turns[0])
        total = add(total, scale(freedom.rate, apply(R, axis)))
        R = product(R, turned(axis, freedom.coordinate))
    return _nodes(total)


def two_pins(asked: Rubbing) -> Made:
    """Return the friction of the two pins of a universal joint, on each of which the force across it presses."""
    asked.without("length", "bearings a length apart are for hinges; the pins rub with the joint's force alone")
    asked.radius("a universal joint rubs on its two pins: give their radius")
    return stacked(asked)


def stacked(asked: Rubbing) -> Made:
    """Return the friction of freedoms one on the other: guides and pins, each pressed by the force across it."""
    asked.without("length", "pads and bearings a length apart are for joints with one freedom")
    normals: list[ReactionRow] = []
    parts: list[FrictionPart] = []
    R: Mat = UNIT_MATRIX
    for k, (step, freedom) in enumerate(zip(asked.joint.moves, asked.freedoms, strict=True), 1):
        axis, turns = unit_vector((*step.turns, *step.slides)[0]), bool(step.turns)
        across = asked.across(axis, flat=asked.flat and not turns)
        name = f"{asked.name}.{'pin' if turns else 'slide'}{k}"
        own = range(len(normals), len(normals) + len(across))
        normals += asked.reactions([(_nodes(apply(R, n)), ORIGIN) for n in across], name)
        row = (BrakingRow if turns else RubbingRow)(f"{name}.friction", freedom.rate)
        arm = asked.radius("what turns rubs on a pin: give its radius") if turns else ONE
        parts.append(asked.part((row,), own, arm, norm=len(across) > 1, name=name))
        if turns:
            assert freedom.coordinate is not None
            R = product(R, turned(axis, freedom.coordinate))
    return normals, parts


def _nodes(vector: Vec) -> Point:
    x, y, z = (as_node(v) for v in vector)
    return x, y, z
