"""Joints as they are seen: a symbol on the parent, and what it runs along. A kind of joint is an entry in _SIGNS."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Final

import numpy as np

from multibody_sym.mechanics.spanning_tree import coordinate_names
from multibody_sym.model.contacts_and_impacts import Contact, copies
from multibody_sym.model.fields import Point
from multibody_sym.model.forces import Damper, Friction, SpringDamper
from multibody_sym.model.joints import CurveJoint, Custom, Joint, Limits
from multibody_sym.pictures.scene.items import Axes, Form, Item, Polyline, Rail, Role, Symbol, Vector, vector
from multibody_sym.pictures.scene.stage import FrameOnBody, Stage, curve_points
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.node import ZERO, symbol

_MARGIN: Final = 0.06
"""How far guides without ends reach beyond those with ends, in the size of these."""


@dataclass(frozen=True)
class PlacedJoint:
    """A joint that is drawn: its name, both frames, and the coordinates at the start."""

    stage: Stage
    name: str
    joint: Joint
    parent: FrameOnBody
    child: FrameOnBody
    values: tuple[float, ...]

    @property
    def on_ground(self) -> bool:
        """Whether one of both bodies is ground."""
        return any(map(self.stage.is_ground, (self.joint.parent, self.joint.child)))

    @property
    def bodies(self) -> tuple[int, int]:
        """Both bodies."""
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
        """Return an item of the joint on one of both bodies."""
        label = getattr(self.joint, "label", None) or self.name
        place = self.child if on_child else self.parent
        return Item(role, self.name, label, ("joints", self.name), place.body, form, self.bodies, self.on_ground)

    def sign_on_child(self, kind: str, axis: Point) -> Item:
        """Return a symbol about an axis at the joint's place on the child."""
        return self.item("joint", Symbol(kind, self.child.point, self.stage.axis(self.child, axis)), on_child=True)


def joint_items(stage: Stage) -> Iterator[Item]:
    """Yield what is seen of each joint."""
    for name, joint in stage.system.joints.items():
        yield from _SIGNS.get(joint.kind, _free_axes)(placed_joint(stage, name))


def placed_joint(stage: Stage, name: str) -> PlacedJoint:
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


def _free_axes(joint: PlacedJoint) -> Iterator[Item]:
    """Yield the axes along which what is free moves, at the joint's place on its parent."""
    axes = tuple(joint.on_parent(axis) for axis in joint.slides)
    yield joint.item("joint", Axes(joint.parent.point, axes, coordinate_names(joint.name, joint.joint)))


def _slider(joint: PlacedJoint) -> Iterator[Item]:
    """Yield the rail on the parent, and the block on the child."""
    axis = joint.on_parent(joint.slides[0])
    yield from _slide(joint, axis, joint.values)
    light = is_led(joint.stage, joint.joint) or (joint.on_ground and _hangs(joint, axis))
    yield joint.sign_on_child("hanger" if light else "slider", joint.slides[0])


def _slide(joint: PlacedJoint, axis: Vector, values: tuple[float, ...]) -> Iterator[Item]:
    """Yield the rail along which a joint slides on its parent."""
    known = values and math.isfinite(values[0])
    way = values[0] if known else float(joint.way @ joint.stage.turned(joint.parent.body, axis))
    low, high = min(0.0, way), max(0.0, way)
    limits: Limits | None = getattr(joint.joint, "limits", None)
    if limits is not None:
        ends = [joint.stage.number(end) for end in (limits.lower, limits.upper) if end is not None]
        low, high = (min(ends), max(ends)) if len(ends) == 2 else (min(low, *ends), max(high, *ends))
    light = is_led(joint.stage, joint.joint) or (joint.on_ground and _hangs(joint, axis))
    yield joint.item("guide", Rail(joint.parent.point, axis, (low, high), light))


def is_led(stage: Stage, joint: Joint) -> bool:
    """Return whether what slides hangs on a spring or rope that moves with its parent, so that no rail is seen.

    Such a parent turns with the line and has no mass, or it is a rod of which the spring is a part.
    """
    if stage.is_ground(joint.parent):
        return False
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


def _hangs(joint: PlacedJoint, axis: Vector) -> bool:
    """Return whether the child hangs or falls along gravity and nothing pushes it aside, so that no rail is seen.

    Where there is no gravity a ball flies straight.
    """
    stage, body = joint.stage, joint.stage.body(joint.joint.child)
    along = stage.turned(joint.parent.body, axis)
    size = float(np.linalg.norm(stage.gravity))
    if size == 0.0:
        return is_ball(stage, body)
    if abs(float(along @ stage.gravity)) < 0.999 * size:
        return False
    if any(isinstance(f, Friction) and f.joint == joint.name for f in stage.system.forces.values()):
        return False
    others = [other for name, other in stage.system.joints.items() if name != joint.name]
    return not any(body in (stage.body(other.parent), stage.body(other.child)) for other in others)


def is_ball(stage: Stage, name: str) -> bool:
    """Return whether a body without a size touches others and bounces from all of them without rubbing."""
    touching = [contact for _, _, contact in copies(stage.system.contacts) if name in contact.between]
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
    yield joint.item("guide", wire_of(joint))
    yield joint.item("joint", Symbol("bead", joint.child.point), on_child=True)


def _custom(joint: PlacedJoint) -> Iterator[Item]:
    """Yield rails for what slides before anything turns, and one sign for what turns: a pin, a cross or a ball."""
    assert isinstance(joint.joint, Custom)
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


_SIGNS: Final[Mapping[str, Callable[[PlacedJoint], Iterator[Item]]]] = {
    "revolute": _sign("pin", on_ground="pivot"),
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
