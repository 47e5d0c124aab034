"""Friction in joints: which parts of a joint's own reaction press, and what rubs.

A guide rubs with the force across its axis; with pads, so far apart on the child, each takes half of that force and its
share of the couple. A journal rubs about its axis at a radius, or two bearings do, a sleeve along and about it. On a
screw's thread, steep by tan a = lead / radius, a force N normal to the flank and T along it make the axial force
N cos a + T sin a.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Final

from multibody_sym.errors import at
from multibody_sym.model.declaration.curves.follow import Follow
from multibody_sym.model.declaration.forces import Friction
from multibody_sym.model.declaration.joints import Custom, Spherical
from multibody_sym.model.declaration.steps import Rotate, Screw, Step, Translate
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.force_rows import BrakingRow, ReactionRow, RubbingRow
from multibody_sym.model.mechanism.mass import ORIGIN, unit_vector
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.model.resolution.cuts import normals_of
from multibody_sym.model.resolution.one_way.rubbing import NOWHERE_YET, Made, Rubbing, aligned
from multibody_sym.model.resolution.one_way.wide_joints import ball, plate, stacked, two_pins
from multibody_sym.model.resolution.plane import in_plane
from multibody_sym.model.resolution.references import References
from multibody_sym.scalars.functions import sqrt
from multibody_sym.scalars.node import ONE, ZERO, Node
from multibody_sym.scalars.vectors import cross, dot, scale, subtract

SIDE_WORDS: Final = ("pressed", "0")
_UP: Final[Point] = (ZERO, ZERO, ONE)


def joint_frictions(references: References) -> Iterator[OneWay]:
    """Yield the friction of joints that is declared."""
    flat = references.plane or in_plane(references.system)
    for name, element in references.system.forces.items():
        if isinstance(element, Friction):
            with at("forces", name):
                yield _friction(name, element, references, flat)


def _friction(name: str, element: Friction, references: References, flat: bool) -> OneWay:
    with at("joint"):
        references.verify_joint(element.joint)
    joint = references.system.joints[element.joint]
    kinds = tuple(type(step) for step in joint.moves)
    make = ball if isinstance(joint, Spherical) else _MAKERS.get(kinds)
    if make is None and kinds and set(kinds) <= {Translate, Rotate} and isinstance(joint, Custom):
        make = stacked
    asked = Rubbing(name, element, joint, tuple(references.freedoms(element.joint).values()), flat)
    if make is None or any(step.motion is not None for step in joint.moves):
        raise asked.another()
    normals, parts = make(asked)
    frames = references.carried_frames(element.joint)
    return OneWay(
        name,
        "friction",
        ("forces", name),
        tuple(replace(row, frames=frames) for row in normals),
        unilateral=False,
        frictions=tuple(parts),
        words=SIDE_WORDS,
        group=name,
        joint=element.joint,
    )


def _guide(asked: Rubbing) -> Made:
    asked.without("radius", "a slider has none; give the length over which its pads are apart, or nothing")
    axis = unit_vector(asked.joint.moves[0].slides[0])
    across, row = asked.across(axis), RubbingRow(f"{asked.name}.friction", asked.rates[0])
    if asked.element.length is None:
        normals = asked.reactions([(n, ORIGIN) for n in across])
        return normals, [asked.part((row,), range(len(normals)), norm=len(normals) > 1)]
    return _pads(asked, axis, across, row)


def _journal(asked: Rubbing) -> Made:
    radius = asked.radius("a hinge rubs on a journal: give its radius")
    axis, row = unit_vector(asked.joint.moves[0].turns[0]), BrakingRow(f"{asked.name}.friction", asked.rates[0])
    if asked.element.length is None:
        normals = asked.reactions([(n, ORIGIN) for n in normals_of(axis)])
        return normals, [asked.part((row,), range(2), radius, norm=True)]
    return _pads(asked, axis, normals_of(axis), row, radius)


def _pads(asked: Rubbing, axis: Point, across: Sequence[Point], row: Row, arm: Node = ONE) -> Made:
    """Return the reactions of two pads or bearings a length apart along an axis, and their friction.

    In a plane it is one friction of both, in space one of each, from its own reaction across the axis.
    """
    name, length = asked.name, asked.element.length
    assert length is not None
    shares = [[_pad(axis, n, side / length) for n in across] for side in (ONE, -ONE)]
    normals = [x for k, pad in enumerate(shares, 1) for x in asked.reactions(pad, f"{name}.pad{k}")]
    if len(across) == 1:
        return normals, [asked.part((row,), range(2), arm)]
    rows = [replace(row, name=f"{name}.pad{k}.friction") for k in (1, 2)]
    return normals, [
        asked.part((each,), range(2 * k - 2, 2 * k), arm, norm=True, name=f"{name}.pad{k}")
        for k, each in enumerate(rows, 1)
    ]


def _pad(axis: Point, normal: Point, share: Node) -> tuple[Point, Point]:
    """Return the force along a normal of a pad as part of the force and of the moment that both transmit."""
    about = scale(share, cross(axis, normal))
    half = scale(ONE / 2, normal)
    return half, about


def _sleeve(asked: Rubbing) -> Made:
    asked.without("length", "pads are for sliders; give a radius, with which it rubs about its axis as well")
    axis = unit_vector(asked.joint.moves[0].slides[0])
    if not aligned(axis, unit_vector(asked.joint.moves[1].turns[0])):
        return stacked(asked)
    normals = asked.reactions([(n, ORIGIN) for n in normals_of(axis)])
    rows: tuple[Row, ...] = (RubbingRow(f"{asked.name}.along", asked.rates[0]),)
    if asked.element.radius is not None:
        rows += (RubbingRow(f"{asked.name}.about", asked.element.radius * asked.rates[1]),)
    return normals, [asked.part(rows, range(2), norm=True)]


def _thread(asked: Rubbing) -> Made:
    asked.without("length", "a screw has none; give the mean radius of its thread")
    radius = asked.radius("a screw rubs on its thread: give its mean radius")
    (step,) = asked.joint.moves
    assert isinstance(step, Screw)
    size = sqrt(radius**2 + step.lead**2)
    cosine, sine = radius / size, step.lead / size
    rubbing = RubbingRow(f"{asked.name}.friction", size * asked.rates[0])
    axis = unit_vector(step.slides[0])
    normal = ReactionRow(
        f"{asked.name}.normal", asked.element.joint, NOWHERE_YET, axis, ORIGIN, cosine, sine, rubbing.name
    )
    return [normal], [asked.part((rubbing,), range(1))]


def _wire(asked: Rubbing) -> Made:
    """Return what presses across a curve: the one component in its plane, or the force less its part along the way."""
    for field in ("radius", "length"):
        asked.without(field, "a bead on a wire rubs with the force across the wire; leave it out")
    step, (coordinate, *_) = asked.joint.moves[0], asked.freedoms
    assert isinstance(step, Follow)
    assert coordinate.coordinate is not None
    way = step.at(coordinate.coordinate).way
    length = sqrt(dot(way, way))
    x, y, z = scale(1 / length, way)
    row = RubbingRow(f"{asked.name}.friction", length * coordinate.rate)
    if asked.flat:
        normals = asked.reactions([((-y, x, ZERO), ORIGIN)])
        return normals, [asked.part((row,), range(1))]
    parts = [subtract(axis, scale(part, (x, y, z))) for axis, part in zip(step.axes, (x, y, z), strict=True)]
    normals = asked.reactions([((a, b, c), ORIGIN) for a, b, c in parts])
    return normals, [asked.part((row,), range(3), norm=True)]


_MAKERS: Final[dict[tuple[type[Step], ...], Callable[[Rubbing], Made]]] = {
    (Translate,): _guide,
    (Rotate,): _journal,
    (Translate, Rotate): _sleeve,
    (Screw,): _thread,
    (Follow,): _wire,
    (Follow, Rotate): _wire,
    (Translate, Translate): plate,
    (Translate, Translate, Rotate): plate,
    (Rotate, Rotate): two_pins,
}
