"""Joints as they are seen (`_SIGNS`), and the lengths, angles and coordinates that a figure names."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.mechanics.motion import JointMotion, after_step
from multibody_sym.mechanics.spanning_tree import coordinate_names, letters_of
from multibody_sym.model.bodies import GROUND, SHAPES, Body, mass_of
from multibody_sym.model.constraints import Distance, Gear
from multibody_sym.model.contacts_and_impacts import Contact, copies
from multibody_sym.model.fields import Point
from multibody_sym.model.forces import Damper, SpringDamper
from multibody_sym.model.joints import CurveJoint, Custom, Joint, Limits, Prismatic
from multibody_sym.model.parameters import in_letters
from multibody_sym.pictures.scene.items import (
    Anchor,
    AngleMark,
    Axes,
    Form,
    Item,
    NamedLength,
    Polyline,
    Rail,
    Role,
    Stop,
    Symbol,
    TurnStop,
    Vector,
    across,
    unit,
    vector,
)
from multibody_sym.pictures.scene.letters import (
    asked_names,
    circle_of,
    curve_equation,
    driven_by,
    given_motion,
    is_letter,
    is_titled,
    letter_of,
    letters,
    semi_axes,
    slopes,
    start_angle,
    start_letter,
    turned_by,
)
from multibody_sym.pictures.scene.masses import is_upright, ride_of, rubbing_length
from multibody_sym.pictures.scene.stage import FrameOnBody, PlacedSystem, curve_points, is_bead_on_ring, same
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.node import ONE, ZERO, Node, symbol
from multibody_sym.text.printer import text

_LIFTED: Final = 1e-6
"""The part of a load on something that slides, against its weight, from which on it is lifted."""
_ROUND: Final = ("disc", "sphere")
_MARGIN: Final = 0.06
"""How far guides without ends reach beyond those with ends, in the size of these."""


@dataclass(frozen=True)
class PlacedJoint:
    """A joint that is drawn: its name, both frames, and the coordinates at the start."""

    stage: PlacedSystem
    name: str
    joint: Joint
    parent: FrameOnBody
    child: FrameOnBody
    values: tuple[float, ...]

    @property
    def on_ground(self) -> bool:
        return any(map(self.stage.is_ground, (self.joint.parent, self.joint.child)))

    @property
    def bodies(self) -> tuple[int, int]:
        return self.parent.body, self.child.body

    @property
    def turns(self) -> list[Point]:
        """The axes about which it turns."""
        return [axis for step in self.joint.steps for axis in step.turns]

    @property
    def slides(self) -> list[Point]:
        """The axes along which it slides."""
        return [axis for step in self.joint.steps for axis in step.slides]

    @property
    def way(self) -> Floats:
        """The vector (world) from the parent's frame to the child's at the start."""
        stage, parent, child = self.stage, self.parent, self.child
        return stage.world(child.body, child.point) - stage.world(parent.body, parent.point)

    def on_parent(self, axis: Point) -> Vector:
        """Return the unit vector along an axis in the axes of the parent."""
        return self.stage.axis(self.parent, axis)

    def item(self, role: Role, form: Form, *, on_child: bool = False) -> Item:
        label = getattr(self.joint, "label", None) or self.name
        place = self.child if on_child else self.parent
        path, titled = ("joints", self.name), is_titled(self.joint, self.name, self.joint.kind)
        return Item(role, self.name, label, path, place.body, form, self.bodies, self.on_ground, titled=titled)

    def sign_on_child(self, kind: str, axis: Point) -> Item:
        """Return a symbol about an axis at the joint's place on the child."""
        return self.item("joint", Symbol(kind, self.child.point, self.stage.axis(self.child, axis)), on_child=True)


def joint_items(stage: PlacedSystem) -> Iterator[Item]:
    for name, joint in stage.system.joints.items():
        if joint.kind not in _SIGNS:
            raise TypeError(f"no picture of joints of the kind {joint.kind}")
        yield from _SIGNS[joint.kind](placed_joint(stage, name))


def placed_joint(stage: PlacedSystem, name: str) -> PlacedJoint:
    """Return a joint with its places and coordinates at the start."""
    joint = stage.system.joints[name]
    names = coordinate_names(name, joint)
    values = tuple(stage.known.get(symbol(q), math.nan) for q in names)
    return PlacedJoint(stage, name, joint, stage.place(joint.parent), stage.place(joint.child), values)


def _sign(kind: str, on_ground: str = "") -> Callable[[PlacedJoint], Iterator[Item]]:
    """Return what makes one symbol at the joint's place on its parent, about its first axis; another `on_ground`."""

    def items(joint: PlacedJoint) -> Iterator[Item]:
        axes = [axis for step in joint.joint.steps for axis in (*step.turns, *step.slides)]
        axis = joint.on_parent(axes[0]) if axes else (0.0, 0.0, 1.0)
        along = joint.on_parent(axes[1]) if len(axes) > 1 else joint.parent.turned((1.0, 0.0, 0.0))
        shown = on_ground if joint.on_ground and on_ground else kind
        yield joint.item("joint", Symbol(shown, joint.parent.point, axis, along))

    return items


def _hinge(joint: PlacedJoint) -> Iterator[Item]:
    """Yield a pin at the joint's place; of what turns about the axis of a ring, on that, a bead."""
    body = joint.stage.body(joint.joint.child)
    if is_bead_on_ring(joint.stage, body):
        yield joint.item("joint", Symbol("bead", joint.stage.centre(body)), on_child=True)
    elif counts_freely(joint.stage, body):
        yield joint.item("joint", Symbol("origin", joint.parent.point))
    else:
        yield from _sign("pin", on_ground="pivot")(joint)


def _free_axes(joint: PlacedJoint) -> Iterator[Item]:
    """Yield the axes along which what is free moves, at the joint's place on its parent."""
    axes = tuple(joint.on_parent(axis) for axis in joint.slides)
    yield joint.item("joint", Axes(joint.parent.point, axes, coordinate_names(joint.name, joint.joint)))


def _slider(joint: PlacedJoint) -> Iterator[Item]:
    """Yield the rail on the parent, and the block on the child."""
    axis = joint.on_parent(joint.slides[0])
    yield from _slide(joint, axis, joint.values)
    yield joint.sign_on_child("hanger" if _is_light(joint, axis) else "slider", joint.slides[0])


def _is_light(joint: PlacedJoint, axis: Vector) -> bool:
    """Return whether no rail is seen on which a body slides."""
    stage, counted = joint.stage, counts_freely(joint.stage, joint.stage.body(joint.joint.child))
    if ride_of(stage, stage.body(joint.joint.child)) == "belt":
        return True
    return counted or is_led(stage, joint.joint) or (joint.on_ground and _hangs(joint, axis))


def _slide(joint: PlacedJoint, axis: Vector, values: tuple[float, ...]) -> Iterator[Item]:
    """Yield the rail along which a joint slides on its parent."""
    known = values and math.isfinite(values[0])
    way = values[0] if known else float(joint.way @ joint.stage.turned(joint.parent.body, axis))
    low, high = min(0.0, way), max(0.0, way)
    limits: Limits | None = getattr(joint.joint, "limits", None)
    if limits is not None:
        ends = [joint.stage.number(end) for end in (limits.lower, limits.upper) if end is not None]
        low, high = (min(ends), max(ends)) if len(ends) == 2 else (min(low, *ends), max(high, *ends))
    stage, light = joint.stage, _is_light(joint, axis)
    carrier = stage.carrying(stage.body(joint.joint.parent))
    polar = carrier is not None and carrier.kind == "revolute" and counts_freely(stage, stage.body(joint.joint.parent))
    bar = is_ring(stage, joint.joint) or _is_column(stage, joint.joint)
    yield joint.item("guide", Rail(joint.parent.point, axis, (low, high), light, bar, polar))


def _is_column(stage: PlacedSystem, joint: Joint) -> bool:
    """Return whether a slider is a sleeve on an upright column."""
    upright = isinstance(joint, Prismatic) and stage.is_ground(joint.parent) and is_upright(stage, joint)
    return upright and rubbing_length(stage, joint) > 0.0


def is_led(stage: PlacedSystem, joint: Joint) -> bool:
    """Return whether what slides hangs on a spring or rope that moves with its parent, so that no rail is seen.

    Such a parent turns with the line and has no mass, or it is a rod of which the spring is a part.
    """
    if stage.is_ground(joint.parent):
        return False
    if counts_freely(stage, stage.body(joint.parent)):
        return True
    child, parent = stage.body(joint.child), stage.declared(stage.body(joint.parent))
    (name,) = (key for key, each in stage.system.joints.items() if each is joint)
    springs = (e for e in stage.system.forces.values() if isinstance(e, (SpringDamper, Damper)))
    bare = parent.inertia is None and parent.shape is None
    block = parent.mass is not None and bare and not parent.points  # on which another one slides
    if any(e.joint == name for e in springs) and stage.declared(child).inertia is None and not block:
        return True
    lines = (*stage.system.constraints.values(), *stage.system.forces.values())
    ends = [end for e in lines for end in (getattr(e, "path", None) or getattr(e, "between", None) or ())]
    carried = any(stage.body(end) == child for end in ends if end not in stage.system.pulleys)
    return parent.mass is None and bare and carried


def counts_freely(stage: PlacedSystem, body: str) -> bool:
    """Return whether a body is none, but a coordinate of a free particle, such as the angle beside its distance.

    Without a mass it turns or slides freely on ground and carries a particle on a slider: it can hold that nowhere.
    """
    declared, joint = stage.declared(body), stage.carrying(body)
    if joint is None or joint.kind not in ("revolute", "prismatic") or not stage.is_ground(joint.parent):
        return False
    if mass_of(declared).mass.shadow != 0 or declared.inertia is not None or declared.points or declared.surfaces:
        return False

    def held_by(held: str) -> set[str]:
        return {key for key, each in stage.system.joints.items() if held in map(stage.body, (each.parent, each.child))}

    names = held_by(body)
    (own,) = (name for name in names if stage.system.joints[name] is joint)
    carried = [stage.system.joints[name] for name in names - {own}]
    if len(carried) != 1 or not isinstance(carried[0], Prismatic) or stage.body(carried[0].parent) != body:
        return False
    child = stage.body(carried[0].child)
    moved = stage.declared(child)
    particle = len(held_by(child)) == 1 and moved.inertia is None and moved.shape is None
    forces, lines = stage.system.forces.values(), stage.system.constraints.values()
    held = [getattr(each, "joint", None) for each in (*forces, *lines)]
    ropes = [end for each in (*forces, *lines) for end in (getattr(each, "path", None) or ())]
    tied = {stage.body(end) for end in ropes if end not in stage.system.pulleys}
    driven = any(driven_by(stage, name) is not None for name in names)
    return particle and not driven and names.isdisjoint(held) and child not in tied


def is_ring(stage: PlacedSystem, joint: Joint) -> bool:
    """Return whether what slides on ground has no size and is lifted from its way at the start: a block would come off.

    It is a ring on a bar then.
    """
    body = stage.body(joint.child)
    declared = stage.declared(body)
    bare = declared.inertia is None and declared.shape is None and not declared.points and not declared.surfaces
    if not isinstance(joint, Prismatic) or not bare or not stage.is_ground(joint.parent):
        return False
    place = stage.place(joint.parent)
    along = stage.turned(place.body, stage.axis(place, joint.steps[0].slides[0]))
    pressed = stage.gravity - float(stage.gravity @ along) * along
    size = float(np.linalg.norm(stage.load_on(body)))
    return float(stage.load_on(body) @ pressed) < -_LIFTED * size * float(np.linalg.norm(pressed))


def _hangs(joint: PlacedJoint, axis: Vector) -> bool:
    """Return whether the child hangs or falls along gravity and nothing pushes it aside, so that no rail is seen.

    Where there is no gravity a ball flies straight, and so do particles that springs join to each other alone.
    """
    stage, body = joint.stage, joint.stage.body(joint.joint.child)
    along = stage.turned(joint.parent.body, axis)
    size = float(np.linalg.norm(stage.gravity))
    if size == 0.0:
        return is_particle(stage, body)
    if abs(float(along @ stage.gravity)) < 0.999 * size:
        return False
    if any(friction.joint == joint.name for friction in stage.system.frictions.values()):
        return False
    others = [other for name, other in stage.system.joints.items() if name != joint.name]
    return not any(body in (stage.body(other.parent), stage.body(other.child)) for other in others)


def is_particle(stage: PlacedSystem, body: str) -> bool:
    """Return whether a body on a slider is a ball or an atom, no block."""
    return is_ball(stage, body) or (not np.any(stage.gravity) and _is_afloat(stage, body))


def _is_afloat(stage: PlacedSystem, body: str) -> bool:
    """Return whether springs join a particle to others, and nothing joins any of them to ground: a molecule."""
    springs = [each for each in stage.system.forces.values() if isinstance(each, SpringDamper) and each.between]
    joined, pairs = {body}, [{*map(stage.body, each.between or ())} for each in springs]
    for _ in pairs:
        joined |= {name for pair in pairs if pair & joined for name in pair}
    held = [getattr(each, "joint", None) for each in stage.system.forces.values()]
    joints = [(name, each) for name, each in stage.system.joints.items() if stage.body(each.child) in joined]
    loose = all(name not in held and driven_by(stage, name) is None for name, _ in joints)
    free = loose and all(each.kind == "prismatic" for _, each in joints)
    ends = {end for _, _, contact in copies(stage.system.contacts) for end in map(stage.body, contact.between)}
    bare = all(stage.declared(name).shape is None and stage.declared(name).inertia is None for name in joined)
    return len(joined) > 1 and GROUND not in joined and free and bare and joined.isdisjoint(ends)


def is_ball(stage: PlacedSystem, name: str) -> bool:
    """Return whether a body without a size, or a ball, touches others and bounces from all without rubbing."""
    balls = [f"{name}.{word}" for word, surface in stage.declared(name).surfaces.items() if surface.kind in _ROUND]
    places = {name, *balls}
    touching = [contact for _, _, contact in copies(stage.system.contacts) if places & {*contact.between}]
    return bool(touching) and all(map(bounces, touching))


def bounces(contact: Contact) -> bool:
    """Return whether what touches bounces without rubbing, as a ball does."""
    return contact.restitution not in (None, ZERO) and contact.static is None and contact.kinetic is None


def _screw(joint: PlacedJoint) -> Iterator[Item]:
    yield from _slide(joint, joint.on_parent(joint.turns[0]), ())
    yield from _sign("nut")(joint)


def _cylindrical(joint: PlacedJoint) -> Iterator[Item]:
    yield from _slide(joint, joint.on_parent(joint.slides[0]), joint.values[:1])
    yield joint.sign_on_child("sleeve", joint.slides[0])


def wire_of(joint: PlacedJoint) -> Polyline:
    """Return the curve along which a joint guides its child, in the axes of its parent."""
    assert isinstance(joint.joint, CurveJoint)
    near = joint.values[0] if joint.values else None
    curve, base = joint.joint.curve, np.array(joint.parent.point)
    points = [vector(base + joint.parent.turned(point)) for point in curve_points(joint.stage, curve, near)]
    if curve.unit_of_parameter != "rad" and joint.stage.ended:  # no longer than what has ends beside it
        ended = np.array(joint.stage.ended)
        low, high = ended.min(axis=0), ended.max(axis=0)
        margin = _MARGIN * float(np.linalg.norm(high - low))
        seen = [joint.stage.world(joint.parent.body, point) for point in points]
        inside = [np.all(point >= low - margin) and np.all(point <= high + margin) for point in seen]
        kept = [point for point, is_near in zip(points, inside, strict=True) if is_near]
        points = kept if len(kept) > 1 else points
    return Polyline(tuple(points))


def _wire(joint: PlacedJoint) -> Iterator[Item]:
    assert isinstance(joint.joint, CurveJoint)
    equation = curve_equation(joint.joint.curve)
    yield replace(joint.item("guide", wire_of(joint)), letters=equation)
    if equation:
        axes = joint.parent.turned((1.0, 0.0, 0.0)), joint.parent.turned((0.0, 1.0, 0.0))
        yield joint.item("guide", Axes(joint.parent.point, axes, ("x", "y"), of_equation=True))
    yield joint.item("joint", Symbol("bead", joint.child.point), on_child=True)


def _custom(joint: PlacedJoint) -> Iterator[Item]:
    """Yield rails for what slides before anything turns, and one sign for what turns: a pin, a cross or a ball."""
    assert isinstance(joint.joint, Custom)
    if is_polar(joint.stage, joint.joint):
        yield from _polar(joint)
        return
    turns: list[Point] = []
    screws: list[Point] = []
    for freedom in joint.joint.free:
        if freedom.translate is not None and not turns:
            yield from _slide(joint, joint.on_parent(freedom.translate), ())
        elif freedom.rotate is not None:
            (turns if freedom.pitch is None else screws).append(freedom.rotate)
    slides = any(freedom.rotate is None for freedom in joint.joint.free)
    if turns and not slides:
        kind = {1: "pin", 2: "cardan"}.get(len(turns), "ball_joint")
        grounded = {"pin": "pivot", "ball_joint": "ball_pivot"}.get(kind, kind) if joint.on_ground else kind
        axis, along = joint.on_parent(turns[0]), joint.on_parent(turns[-1])
        yield joint.item("joint", Symbol(grounded, joint.parent.point, axis, along))
    elif turns:
        yield joint.sign_on_child("pin", turns[0])
    elif screws:
        yield joint.sign_on_child("nut", screws[0])
    else:
        yield from _free_axes(joint)


def is_polar(stage: PlacedSystem, joint: Joint) -> bool:
    """Return whether a joint is an angle and a distance, square to its axis, of a particle on ground."""
    if not isinstance(joint, Custom) or not stage.is_ground(joint.parent) or len(joint.free) != 2:
        return False
    (turn, away), body = joint.free, stage.declared(stage.body(joint.child))
    if turn.rotate is None or turn.pitch is not None or away.translate is None:
        return False
    square = abs(float(np.dot(unit(stage.vector(turn.rotate)), unit(stage.vector(away.translate))))) < _STILL
    return square and body.inertia is None and body.shape is None


def _polar(joint: PlacedJoint) -> Iterator[Item]:
    """Yield the origin of polar coordinates, the line to the particle, and its place."""
    distance = float(np.linalg.norm(joint.way))
    seen = unit(joint.way @ joint.stage.poses[joint.parent.body][:, :3])
    axis = seen if distance > 0.0 else joint.on_parent(joint.slides[0])
    yield joint.item("guide", Rail(joint.parent.point, axis, (0.0, distance), light=True, polar=True))
    yield joint.item("joint", Symbol("origin", joint.parent.point))
    yield joint.sign_on_child("hanger", joint.slides[0])


_SIGNS: Final[Mapping[str, Callable[[PlacedJoint], Iterator[Item]]]] = {
    "revolute": _hinge,
    "prismatic": _slider,
    "screw": _screw,
    "cylindrical": _cylindrical,
    "universal": _sign("cardan"),
    "spherical": _sign("ball_joint", on_ground="ball_pivot"),
    "curve": _wire,
    "custom": _custom,
    "fixed": _sign("weld"),
    "planar": _free_axes,
    "point": _free_axes,
    "free": _free_axes,
}
"""What is seen of each kind of joint."""


# ----------------------------------------------------------------------------------------------------------------------
# What a figure names beside its parts: lengths by their letters, angles, and the coordinates of joints.


_SIZES: Final[Mapping[str, tuple[tuple[Vector, Vector], ...]]] = {
    "rod": (((-0.5, 0.0, 0.0), (0.5, 0.0, 0.0)),),
    "box": tuple(
        (vector(-0.5 * np.eye(3)[k]), vector(0.5 * np.eye(3)[k])) for k in range(3)
    ),
}
"""Between which places (from the centre, in units of a size) sizes of a shape lie; those of round ones are radii."""


def dimensions(stage: PlacedSystem, places: Mapping[str, Sequence[Vector]]) -> tuple[NamedLength, ...]:
    """Return the lengths that the model names, each letter once: plain letters first, where they are radii."""
    found = [*_sizes(stage), *_points(stage), *_radii(stage)]
    order = sorted(range(len(found)), key=lambda k: (len(found[k].label), not found[k].radius, k))
    taken = {q for name, joint in stage.system.joints.items() for q in coordinate_names(name, joint)}
    kept = []
    for k in order:
        words = set(re.findall("[A-Za-z_][A-Za-z_0-9]*", found[k].label))
        ends = (vector(stage.world(end.body, end.point)) for end in (found[k].a, found[k].b))
        if not words <= taken and not same(*ends):
            taken |= words
            kept.append(k)
    return tuple(found[k] for k in sorted(kept))


def _sizes(stage: PlacedSystem) -> Iterator[NamedLength]:
    for name, body in stage.system.bodies.items():
        if body.shape is None:
            continue
        kind, sizes, number = body.shape.kind, body.shape.sizes, stage.number_of(name)
        for k, size in enumerate(sizes):
            label = letters(size)
            if not label:
                continue
            if kind in _SIZES:
                centre = np.array(stage.centre(name))
                ends = [Anchor(number, vector(centre + stage.number(size) * np.array(end))) for end in _SIZES[kind][k]]
                others = np.array([stage.number(each) for each in sizes]) if kind == "box" else np.zeros(3)
                beyond = vector(np.where(np.arange(3) == k, 0.0, others / 2))
                yield NamedLength(f"{name}.{SHAPES[kind][k]}", label, ends[0], ends[1], beyond=beyond)
            elif k == 0:
                yield radius_of(f"{name}.radius", label, number, stage.centre(name), stage.number(size))


def radius_of(
    name: str, label: str, body: int, centre: Vector, radius: float, angle: float = 0.7, axis: Vector = (0.0, 0.0, 1.0)
) -> NamedLength:
    """Return a radius about an axis at an angle from x, or from what is across the axis beside x and y."""
    e1 = np.array(across(axis))
    e2 = np.cross(unit(axis), e1)
    rim = vector(np.array(centre) + radius * (np.cos(angle) * e1 + np.sin(angle) * e2))
    return NamedLength(name, label, Anchor(body, centre), Anchor(body, rim), radius=True)


def _radii(stage: PlacedSystem) -> Iterator[NamedLength]:
    """Yield the radii of surfaces and pulleys."""
    for name, body in stage.system.bodies.items():
        for word, surface in body.surfaces.items():
            if surface.kind in ("disc", "sphere") and letters(surface.radius):
                centre, radius = stage.vector(surface.centre), stage.number(surface.radius)
                number = stage.number_of(name)
                angle = -2.3 if surface.inside else 0.7  # a bowl is drawn below its middle
                axis = unit(stage.vector(surface.axis)) if surface.kind == "disc" else (0.0, 0.0, 1.0)
                yield radius_of(f"{name}.{word}", letters(surface.radius), number, centre, radius, angle, axis)
            if surface.segment is not None:
                yield from _segment_length(stage, f"{name}.{word}", *surface.segment)
            for k, label in semi_axes(surface.outline) if surface.outline is not None else ():
                end = stage.number(stage.system.parameters[label].value) * np.eye(3)[k]
                ends = Anchor(stage.number_of(name), (0.0, 0.0, 0.0)), Anchor(stage.number_of(name), vector(end))
                yield NamedLength(f"{name}.{word}", label, *ends, radius=True)
    for name, pulley in stage.system.pulleys.items():
        if letters(pulley.radius):
            place = stage.place(pulley.at or pulley.body or GROUND)
            yield radius_of(name, letters(pulley.radius), place.body, place.point, stage.number(pulley.radius))
    for name, joint in stage.system.joints.items():
        circle = circle_of(joint.curve) if isinstance(joint, CurveJoint) else None
        if circle is not None and circle.size in stage.system.parameters:
            place, axes = stage.place(joint.parent), np.eye(3)
            axis = place.turned(np.cross(axes[circle.cosine], axes[circle.sine]))
            radius = stage.number(stage.system.parameters[circle.size].value)
            yield radius_of(name, circle.size, place.body, place.point, radius, axis=axis)
    for name, element in stage.system.constraints.items():
        if isinstance(element, Gear):
            for joint_name, pitch in zip(element.joints, element.radii or (), strict=False):  # of wheels in mesh
                place, label = stage.place(stage.system.joints[joint_name].child), letters(pitch)
                if label:
                    yield radius_of(joint_name, label, place.body, place.point, stage.number(pitch), 2.3)
        if isinstance(element, Distance) and letters(element.value):
            first, second = (end.anchor for end in map(stage.place, element.between))
            yield NamedLength(name, letters(element.value), first, second)


def _segment_length(stage: PlacedSystem, name: str, start: Point | str, stop: Point | str) -> Iterator[NamedLength]:
    """Yield the length of a thin bar along an axis of its body, where it is a letter."""
    if isinstance(start, str) or isinstance(stop, str):
        return
    number = stage.number_of(name.partition(".")[0])
    found = [letter_of(b - a) for a, b in zip(start, stop, strict=True) if (b - a).shadow != 0]
    if len(found) == 1 and found[0]:
        ends = Anchor(number, stage.vector(start)), Anchor(number, stage.vector(stop))
        yield NamedLength(name, found[0], *ends)


def _points(stage: PlacedSystem) -> Iterator[NamedLength]:
    """Yield the ways along a body's axes to its points and its centre of mass, where each is one expression.

    They begin at the origin; where an expression is no letter, but the way from an end of the shape or from another
    point is one, there. A point at a distance and an angle has that distance.
    """
    for name, body in stage.system.bodies.items():
        number = stage.number_of(name)
        declared: dict[str, Point] = dict(body.points)
        if body.com is not None and body.shape is None:
            declared = {**declared, "com": body.com}
        for word, point in declared.items():
            given, at = [k for k in range(3) if point[k].shadow != 0], stage.vector(point)
            turned = turned_by(point)
            if turned is not None and turned.size.isidentifier():
                start = vector(np.where(np.isin(np.arange(3), given), 0.0, at))
                yield NamedLength(f"{name}.{word}", turned.size, Anchor(number, start), Anchor(number, at))
                continue
            for k in given if len(given) <= 2 else ():
                label, origin = _shortest(letters(point[k]), point[k], _marks_along(body, k))
                if label:
                    start = vector([stage.number(origin) if i == k else x for i, x in enumerate(at)])
                    ends = Anchor(number, start), Anchor(number, at)
                    yield NamedLength(f"{name}.{word}", label, *ends, component=text(point[k]))


def _marks_along(body: Body, axis: int) -> list[Node]:
    """Return where along an axis of a body its shape ends, and its other points are."""
    found = [point[axis] for point in body.points.values()]
    if body.shape is not None and body.shape.kind in _SIZES and axis < len(_SIZES[body.shape.kind]):
        centre, half = mass_of(body).com[axis], body.shape.sizes[axis] / 2
        found = [centre - half, centre + half, *found]
    return found


def _shortest(label: str, end: Node, others: Sequence[Node]) -> tuple[str, Node]:
    """Return a length's letters and where it begins: zero, or where it is a letter from one of the others."""
    if not label or label.isidentifier():
        return label, ZERO
    found = ((letter, other) for other in others if (letter := letter_of(end - other)))
    return next(found, (label, ZERO))


# --- coordinates and angles ----------------------------------------------------------------------------------------


def ways(stage: PlacedSystem, taken: Collection[str]) -> Iterator[NamedLength]:
    """Yield the coordinates of sliders, from the place on the parent to that on the child, and places of the start.

    These are coordinates of what moves freely or on a curve, by letters that are not `taken`.
    """
    asked = asked_names(stage.system)
    yield from _start_places(stage, taken)
    for name, joint in stage.system.joints.items():
        steps = [free.step for free in joint.free_steps]
        slides = len(steps) == 1 and len(steps[0].slides) == 1 and not steps[0].turns
        if not slides and not is_polar(stage, joint):
            continue
        made = placed_joint(stage, name)
        label = coordinate_names(name, joint)[-1]
        a, b = made.parent.anchor, made.child.anchor
        given, unnamed = start_letter(stage, joint), is_unnamed(stage, name, asked)
        yield NamedLength(label, label, a, b, coordinate=True, start_label=given, unnamed=unnamed)
        if not given:
            yield from _start_below(stage, made, a)


def _start_below(stage: PlacedSystem, made: PlacedJoint, datum: Anchor) -> Iterator[NamedLength]:
    """Yield how far what is round slides at the start from a datum that it will touch: h of h + r."""
    shape, initial = stage.declared(stage.body(made.joint.child)).shape, getattr(made.joint, "initial", None)
    if shape is None or shape.kind not in _ROUND or initial is None or not initial.q or not made.slides:
        return
    letter, radius = letter_of(initial.q[-1] - shape.sizes[0]), stage.number(shape.sizes[0])
    if letter:
        near = np.array(made.child.point) - radius * np.array(stage.axis(made.child, made.slides[0]))
        end = Anchor(made.child.body, vector(near))
        yield NamedLength(f"{made.name}.{letter}", "", datum, end, start_label=letter)


def _start_places(stage: PlacedSystem, taken: Collection[str]) -> Iterator[NamedLength]:
    """Yield how far from the axes of ground what moves freely, or on a curve over an axis, is at the start."""
    seen = {*taken}
    for name, joint in stage.system.joints.items():
        initial, made = getattr(joint, "initial", None), placed_joint(stage, name)
        over_x = isinstance(joint, CurveJoint) and bool(curve_equation(joint.curve))
        if initial is None or made.parent.body >= 0 or not (joint.kind in ("point", "planar") or over_x):
            continue
        axes = [made.on_parent((ONE, ZERO, ZERO))] if over_x else [made.on_parent(axis) for axis in made.slides]
        end = stage.world(made.child.body, made.child.point)
        for axis, node in zip(axes, initial.q or (), strict=False):
            label = "" if node is None else letters(node)
            if label.isidentifier() and is_letter(stage.system, label) and label not in seen:
                seen.add(label)
                foot = end - float((end - np.array(made.parent.point)) @ axis) * np.array(axis)
                b = made.child.anchor
                yield NamedLength(f"{name}.{label}", "", Anchor(-1, vector(foot)), b, start_label=label)


def is_unnamed(stage: PlacedSystem, name: str, asked: frozenset[str]) -> bool:
    """Return whether the coordinate of a joint has no letter: the model gives none, the joint's name is no such letter.

    A name that is `asked` about is one, but that of a pin is the pin's.
    """
    joint = stage.system.joints[name]
    given = getattr(joint, "q", None) or getattr(joint, "q_label", None)
    return not given and (is_titled(joint, name, joint.kind) or not (name in asked or is_letter(stage.system, name)))


def angles(stage: PlacedSystem, places: Mapping[str, Sequence[Vector]]) -> Iterator[AngleMark]:
    """Yield the angles of hinges, of frames that are turned and of slopes, of a body each letter once."""
    seen: set[tuple[int, str]] = set()
    hinges = (*_hinge_angles(stage, places), *_tilts(stage), *_polar_angles(stage))
    for each in (*hinges, *slopes(stage), *_frame_angles(stage), *_start_angles(stage)):
        if each.coordinate or (each.at.body, each.label) not in seen:
            seen.add((each.at.body, each.label))
            yield each


def _hinge_angles(stage: PlacedSystem, places: Mapping[str, Sequence[Vector]]) -> Iterator[AngleMark]:
    """Yield the angles of hinges, driven ones too, and those at which what moves in the plane starts."""
    asked, own_names = asked_names(stage.system), {coordinate.name for coordinate in stage.mechanism.coordinates}
    for name, joint in stage.system.joints.items():
        driven, made, given = given_motion(stage, name), placed_joint(stage, name), start_letter(stage, joint)
        sign, base = "", 0.0
        if not given:  # it is negative, or counted from another axis, such as that of -x: pi - beta
            given, base = start_angle(stage, joint)
            sign = "-"
            if joint.kind != "planar":
                given, base = "" if base else given, 0.0
        turning = [*joint.steps] if driven else [each.step for each in joint.free_steps]
        planar = joint.kind == "planar" and bool(given)
        if not planar and (len(turning) != 1 or not turning[0].is_hinge):
            continue
        label = driven or coordinate_names(name, joint)[-1]
        if not driven and label not in own_names and stage.mechanism.relative is None:
            continue
        if stage.is_structure and not given:
            continue  # nothing turns
        axis: Floats = np.array(unit(stage.vector(made.turns[0])))
        there = away(stage, stage.body(joint.child), made.child.point, places)
        if there is None:
            continue
        own = made.child.rotation.T @ there  # in frame M, which is F's at zero
        own = own - (own @ axis) * axis
        if np.linalg.norm(own) < 1e-9:
            continue
        begin = np.cos(base) * own + np.sin(base) * np.cross(axis, own)
        start, stop = made.parent.turned(unit(begin)), made.child.turned(unit(own))
        place = made.child if planar else made.parent
        at = place.anchor
        ends, about = (Anchor(made.parent.body, start), Anchor(made.child.body, stop)), made.parent.turned(axis)
        unnamed = not driven and is_unnamed(stage, name, asked)
        shown = given if planar or unnamed or not given else f"{label} = {sign}{given}"
        yield AngleMark(name if driven else label, label, at, *ends, about, start_label=shown, unnamed=unnamed)


def _polar_angles(stage: PlacedSystem) -> Iterator[AngleMark]:
    """Yield the angles of polar coordinates."""
    for name, joint in stage.system.joints.items():
        if is_polar(stage, joint):
            made, label = placed_joint(stage, name), coordinate_names(name, joint)[0]
            axis = np.array(unit(stage.vector(made.slides[0])))
            ends = Anchor(made.parent.body, made.parent.turned(axis)), Anchor(made.child.body, made.child.turned(axis))
            about = made.parent.turned(unit(stage.vector(made.turns[0])))
            yield AngleMark(label, label, made.parent.anchor, *ends, about)


def _tilts(stage: PlacedSystem) -> Iterator[AngleMark]:
    """Yield the tilts of bodies on ball joints: between an axis of ground and that of the body, by Euler's angles."""
    for name, joint in stage.system.joints.items():
        order = getattr(joint, "angles", None) if joint.kind == "spherical" else None
        initial = getattr(joint, "initial", None)
        if not order or order[0] != order[2] or initial is None or not initial.q:
            continue
        axis = vector(np.eye(3)["xyz".index(order[0])])
        made, label = placed_joint(stage, name), coordinate_names(name, joint)[1]
        found = letters(initial.q[1])
        shown = found if found.isidentifier() and is_letter(stage.system, found) else ""
        ends = Anchor(made.parent.body, made.parent.turned(axis)), Anchor(made.child.body, made.child.turned(axis))
        at = made.parent.anchor
        yield AngleMark(label, label, at, *ends, (0.0, 0.0, 0.0), start_label=shown)


def _start_angles(stage: PlacedSystem) -> Iterator[AngleMark]:
    """Yield the angles at which ropes and rods start, to particles at r*cos(a), r*sin(a) from an axis."""
    lines = stage.system.constraints.values()
    tied = [{*(getattr(each, "path", None) or getattr(each, "between", None) or ())} for each in lines]
    for name, joint in stage.system.joints.items():
        initial = getattr(joint, "initial", None)
        turned = turned_by(initial.q) if joint.kind == "point" and initial is not None else None
        if turned is None or not is_letter(stage.system, turned.angle) or {joint.parent, joint.child} not in tied:
            continue
        made = placed_joint(stage, name)
        place = np.array(made.values)
        axes = [np.array(made.on_parent(axis)) for axis in made.slides]
        start = np.sign(place[turned.cosine]) * axes[turned.cosine]
        stop = sum((x * axis for x, axis in zip(place, axes, strict=True)), np.zeros(3))
        at, low, high = (Anchor(made.parent.body, x) for x in (made.parent.point, vector(start), unit(stop)))
        yield AngleMark(name, "", at, low, high, (0.0, 0.0, 0.0), start_label=turned.angle)


def _frame_angles(stage: PlacedSystem) -> Iterator[AngleMark]:
    """Yield the angles by which frames of bodies are turned, named by a letter."""
    for name, body in stage.system.bodies.items():
        for word, frame in body.frames.items():
            if len(frame.rotate) != 1 or not letters(frame.rotate[0].angle):
                continue
            about = unit(stage.vector(frame.rotate[0].axis))
            first: Vector = (0.0, 1.0, 0.0) if abs(about[0]) > 0.9 else (1.0, 0.0, 0.0)
            place = stage.place(f"{name}.{word}")
            at, begin, end = (Anchor(place.body, x) for x in (place.point, first, place.turned(first)))
            yield AngleMark(f"{name}.{word}", letters(frame.rotate[0].angle), at, begin, end, about, coordinate=False)


def away(stage: PlacedSystem, body: str, place: Vector, places: Mapping[str, Sequence[Vector]]) -> Floats | None:
    """Return the direction from a joint's place to what is farthest of its child: the way that its rod goes."""
    candidates = [*places.get(body, ()), stage.centre(body)]
    shape = stage.declared(body).shape
    if shape is not None and shape.kind == "rod":
        candidates.append((stage.number(shape.sizes[0]), 0.0, 0.0))
    ways_there = [np.subtract(other, place) for other in candidates]
    if not any(np.linalg.norm(way) > 1e-9 for way in ways_there):  # what has no size points at what it carries
        carried = (stage.place(each.child) for each in stage.system.joints.values() if stage.body(each.parent) == body)
        pose = stage.poses[stage.number_of(body)]
        ways_there += [(stage.world(x.body, x.point) - pose[:, 3]) @ pose[:, :3] - place for x in carried]
    farthest = max(ways_there, key=lambda way: float(np.linalg.norm(way)))
    return farthest if np.linalg.norm(farthest) > 1e-9 else None


# ----------------------------------------------------------------------------------------------------------------------
# Stops: the limits of joints that hold, where they stand on the parent and which way of the child they bar.


_SIDES: Final = (("lower", -1.0, "≥"), ("upper", 1.0, "≤"))
_STILL: Final = 1e-9


def stop_items(
    stage: PlacedSystem, bodies: Sequence[Item], places: Mapping[str, Sequence[Vector]]
) -> Iterator[Item]:
    """Yield the stops of each joint, on its parent; `bodies` are the items of bodies, whose fronts meet them.

    Limits that do not act are no stops, and one that nothing of a body would show, such as of a disc about its middle,
    is not seen.
    """
    book = letters_of(stage.system)
    for name, joint in stage.system.joints.items():
        limits = joint.stops
        for word, side, sign in _SIDES if limits is not None else ():
            node: Node | None = getattr(limits, word)
            value = math.nan if node is None else stage.number(node, math.nan)
            if node is None or not math.isfinite(value):
                continue
            made = placed_joint(stage, name)
            form = _form(made, value, side, bodies, places)
            if form is not None:
                limit = in_letters(letters(node), book) or _number_with_unit(value, joint.coordinate_units[0])
                coordinate = coordinate_names(name, joint)[0]
                label, path = f"{book.get(coordinate, coordinate)} {sign} {limit}", ("joints", name, "limits", word)
                on_ground = stage.is_ground(joint.parent)
                yield Item("stop", f"{name}.{word}", label, path, made.parent.body, form, made.bodies, on_ground)


def _number_with_unit(value: float, unit_of: str) -> str:
    """Return a limit in digits, of angles in degrees."""
    if value == 0.0:
        return "0"
    number = f"{math.degrees(value):.4g}°" if unit_of == "rad" else f"{value:.4g} {unit_of}".rstrip()
    return number.replace("-", "−")


def _form(
    made: PlacedJoint, value: float, side: float, bodies: Sequence[Item], places: Mapping[str, Sequence[Vector]]
) -> Stop | TurnStop | None:
    """Return where a stop stands: across the way on which the joint goes there, or beside the rod that turns."""
    (free,) = made.joint.free_steps
    moved = after_step(free.step, JointMotion(), [value], [0.0], made.stage.motion.state)
    rotation = np.array(moved.rotation, dtype=float)
    way = rotation @ np.array(moved.linear[0], dtype=float)
    axis = rotation @ np.array(moved.angular[0], dtype=float)
    base, turned = np.array(made.parent.point), made.parent.turned
    if float(np.linalg.norm(way)) > _STILL:
        at = vector(base + turned(np.array(moved.position, dtype=float)))
        ahead = side * np.array(turned(unit(way)))
        return Stop(at, vector(ahead), made.child.point, _front(made, ahead, bodies))
    there = away(made.stage, made.stage.body(made.joint.child), made.child.point, places)
    if there is None:
        return None
    own = made.child.rotation.T @ there
    own = own - float(own @ unit(axis)) * np.array(unit(axis))
    reach = float(np.linalg.norm(own))
    if reach < _STILL:
        return None
    spin = vector(side * np.array(turned(unit(axis))))
    return TurnStop(vector(base), spin, turned(unit(rotation @ own)), made.child.turned(unit(own)), reach)


def _front(made: PlacedJoint, ahead: Floats, bodies: Sequence[Item]) -> float:
    """Return how far what has a size reaches ahead of the joint's place on the child (m), zero where nothing does."""
    stage, child = made.stage, made.child.body
    way = stage.turned(made.parent.body, vector(ahead))
    at = stage.world(child, made.child.point)
    reaches = [0.0]
    for item in bodies:
        rod = not getattr(item.form, "closed", True)
        if item.body == child and not rod and item.form.sized:
            reaches += [float((stage.world(child, point) - at) @ way) for point in item.form.bounds]
    return max(reaches)
