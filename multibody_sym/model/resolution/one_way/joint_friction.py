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

from multibody_sym.errors import ModelError, at
from multibody_sym.model.declaration.forces import Friction
from multibody_sym.model.declaration.joint import Joint
from multibody_sym.model.declaration.steps import Rotate, Screw, Step, Translate
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.force_rows import BrakingRow, ReactionRow, RubbingRow
from multibody_sym.model.mechanism.markers import NOWHERE
from multibody_sym.model.mechanism.mass import ORIGIN, unit_vector
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.model.resolution.cuts import normals_of
from multibody_sym.model.resolution.plane import in_plane
from multibody_sym.model.resolution.references import References
from multibody_sym.scalars.functions import sqrt
from multibody_sym.scalars.node import ONE, ZERO, Node
from multibody_sym.scalars.vectors import cross, scale

SIDE_WORDS: Final = ("pressed", "0")
_UP: Final[Point] = (ZERO, ZERO, ONE)
_NOWHERE: Final = (NOWHERE, NOWHERE)


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
    make = _MAKERS.get(tuple(type(step) for step in joint.moves))
    if make is None or any(step.motion is not None for step in joint.moves):
        raise ModelError(
            f"friction is for joints that slide along an axis, turn about one, or both, by coordinates of their own: "
            f"prismatic, revolute, cylindrical, screw; {element.joint!r} is another, or prescribed"
        ).under("joint")
    normals, parts = make(name, element, joint, _rates(element.joint, references), flat)
    frames = references.carried_frames(element.joint)
    normals = [replace(row, frames=frames) for row in normals]
    return OneWay(
        name,
        "friction",
        ("forces", name),
        tuple(normals),
        unilateral=False,
        frictions=tuple(parts),
        words=SIDE_WORDS,
        group=name,
        joint=element.joint,
    )


def _rates(joint: str, references: References) -> list[Node]:
    return [freedom.rate for freedom in references.freedoms(joint).values()]


def _across(axis: Point, flat: bool) -> tuple[Point, ...]:
    """Return unit vectors across an axis: one where nothing leaves the plane."""
    if flat and axis[2] is ZERO:
        x, y, z = cross(_UP, axis)
        return ((x, y, z),)
    return normals_of(axis)


def _guide(
    name: str, element: Friction, joint: Joint, rates: Sequence[Node], flat: bool
) -> tuple[list[ReactionRow], list[FrictionPart]]:
    _without(element, "radius", "a slider has none; give the length over which its pads are apart, or nothing")
    axis = unit_vector(joint.moves[0].slides[0])
    across, row = _across(axis, flat), RubbingRow(f"{name}.friction", rates[0])
    if element.length is None:
        normals = _reactions(name, element, [(n, ORIGIN) for n in across])
        return normals, [_part(name, element, (row,), range(len(normals)), norm=len(normals) > 1)]
    return _pads(name, element, axis, across, row)


def _journal(
    name: str, element: Friction, joint: Joint, rates: Sequence[Node], flat: bool
) -> tuple[list[ReactionRow], list[FrictionPart]]:
    radius = _radius(element, "a hinge rubs on a journal: give its radius")
    axis, row = unit_vector(joint.moves[0].turns[0]), BrakingRow(f"{name}.friction", rates[0])
    if element.length is None:
        normals = _reactions(name, element, [(n, ORIGIN) for n in normals_of(axis)])
        return normals, [_part(name, element, (row,), range(2), radius, norm=True)]
    return _pads(name, element, axis, normals_of(axis), row, radius)


def _pads(
    name: str, element: Friction, axis: Point, across: Sequence[Point], row: Row, arm: Node = ONE
) -> tuple[list[ReactionRow], list[FrictionPart]]:
    """Return the reactions of two pads or bearings a length apart along an axis, and their friction.

    In a plane it is one friction of both, in space one of each, from its own reaction across the axis.
    """
    assert element.length is not None
    shares = [[_pad(axis, n, side / element.length) for n in across] for side in (ONE, -ONE)]
    normals = [x for k, pad in enumerate(shares, 1) for x in _reactions(f"{name}.pad{k}", element, pad)]
    if len(across) == 1:
        return normals, [_part(name, element, (row,), range(2), arm)]
    rows = [replace(row, name=f"{name}.pad{k}.friction") for k in (1, 2)]
    return normals, [
        _part(f"{name}.pad{k}", element, (each,), range(2 * k - 2, 2 * k), arm, norm=True)
        for k, each in enumerate(rows, 1)
    ]


def _pad(axis: Point, normal: Point, share: Node) -> tuple[Point, Point]:
    """Return the force along a normal of a pad as part of the force and of the moment that both transmit."""
    about = scale(share, cross(axis, normal))
    half = scale(ONE / 2, normal)
    return half, about


def _sleeve(
    name: str, element: Friction, joint: Joint, rates: Sequence[Node], flat: bool
) -> tuple[list[ReactionRow], list[FrictionPart]]:
    _without(element, "length", "pads are for sliders; give a radius, with which it rubs about its axis as well")
    normals = _reactions(name, element, [(n, ORIGIN) for n in normals_of(unit_vector(joint.moves[0].slides[0]))])
    rows: tuple[Row, ...] = (RubbingRow(f"{name}.along", rates[0]),)
    if element.radius is not None:
        rows += (RubbingRow(f"{name}.about", element.radius * rates[1]),)
    return normals, [_part(name, element, rows, range(2), norm=True)]


def _thread(
    name: str, element: Friction, joint: Joint, rates: Sequence[Node], flat: bool
) -> tuple[list[ReactionRow], list[FrictionPart]]:
    _without(element, "length", "a screw has none; give the mean radius of its thread")
    radius = _radius(element, "a screw rubs on its thread: give its mean radius")
    (step,) = joint.moves
    assert isinstance(step, Screw)
    size = sqrt(radius**2 + step.lead**2)
    cosine, sine = radius / size, step.lead / size
    rubbing = RubbingRow(f"{name}.friction", size * rates[0])
    axis = unit_vector(step.slides[0])
    normal = ReactionRow(f"{name}.normal", element.joint, _NOWHERE, axis, ORIGIN, cosine, sine, rubbing.name)
    return [normal], [_part(name, element, (rubbing,), range(1))]


_Maker = Callable[
    [str, Friction, Joint, Sequence[Node], bool], tuple[list[ReactionRow], list[FrictionPart]]
]
_MAKERS: Final[dict[tuple[type[Step], ...], _Maker]] = {
    (Translate,): _guide,
    (Rotate,): _journal,
    (Translate, Rotate): _sleeve,
    (Screw,): _thread,
}


def _reactions(name: str, element: Friction, shares: Sequence[tuple[Point, Point]]) -> list[ReactionRow]:
    names = [f"{name}.normal"] if len(shares) == 1 else [f"{name}.normal{k}" for k in range(1, len(shares) + 1)]
    pairs = zip(names, shares, strict=True)
    return [ReactionRow(row, element.joint, _NOWHERE, force, moment) for row, (force, moment) in pairs]


def _part(
    name: str, element: Friction, rows: tuple[Row, ...], normals: range, arm: Node = ONE, *, norm: bool = False
) -> FrictionPart:
    """Return the friction of some normals at an arm; a coefficient that is left out is the other."""
    enough = isinstance(element.static, str)
    static = ZERO if isinstance(element.static, str) else element.static
    kinetic = element.kinetic if element.kinetic is not None else static
    static = static if static is not None else kinetic
    assert static is not None
    assert kinetic is not None
    return FrictionPart(
        name, rows, arm * static, arm * kinetic, enough, tuple(normals), norm, regularised=element.regularised
    )


def _radius(element: Friction, advice: str) -> Node:
    if element.radius is None:
        raise ModelError(advice).under("radius")
    return element.radius


def _without(element: Friction, field: str, advice: str) -> None:
    if getattr(element, field) is not None:
        raise ModelError(advice).under(field)
