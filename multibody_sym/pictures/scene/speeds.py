"""Speeds at the start and given motions as they are seen: arrows along ways, bows about axes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.model.system import t
from multibody_sym.pictures.scene.forces import Arrow, components, constant_law, letter_of
from multibody_sym.pictures.scene.items import Anchor, ArrowItem, Path, Vector, unit, vector
from multibody_sym.pictures.scene.joints import PlacedJoint, counts_freely, is_polar, placed_joint
from multibody_sym.pictures.scene.letters import (
    driven_by,
    is_letter,
    letters,
    short_formula,
    speed_letter,
    steady_rate,
    turned_by,
)
from multibody_sym.pictures.scene.moments import top
from multibody_sym.pictures.scene.stage import PlacedSystem
from multibody_sym.pictures.scene.touched import velocity_of
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import ZERO, Node

_SPEED: Final = "v_0"
"""The letter of a speed at the start that has none."""
_SPIN: Final = "omega_0"
"""That of an angular velocity."""
_OVER: Final = 1.3
"""Where the spin of a top is seen, in its heights."""


def speed_items(stage: PlacedSystem) -> Iterator[Arrow]:
    """Yield the speeds at the start and the steady ones of driven joints, with letters of their own or usual ones."""
    for name in stage.system.joints:
        yield from _speeds(_Given(stage, placed_joint(stage, name)))


@dataclass(frozen=True)
class _Given:
    """The speeds that a joint is given: at the start, or a steady one where it is driven."""

    stage: PlacedSystem
    joint: PlacedJoint

    @property
    def driven(self) -> Node | None:
        return driven_by(self.stage, self.joint.name)

    @property
    def nodes(self) -> list[Node]:
        """What is declared, zero for what is not; the rate of a steady motion."""
        if self.driven is not None:
            rate = steady_rate(self.driven)
            return [] if rate is None else [rate]
        initial = getattr(self.joint.joint, "initial", None)
        declared = () if initial is None or initial.u is None else initial.u
        return [ZERO if node is None else node for node in declared]

    @property
    def path(self) -> Path:
        return "joints", self.joint.name, "initial", "u"

    def arrow(self, letter: str, at: Anchor, world: Floats, *, turning: bool = False) -> Iterator[Arrow]:
        """Yield a speed (3) in the world at a place of a body, nothing where it is zero."""
        if np.any(world):
            item = ArrowItem("velocity", self.joint.name, letter, self.path, at, vector(world), turning=turning)
            yield item, constant_law(world)


def _speeds(given: _Given) -> Iterator[Arrow]:
    stage, made, nodes = given.stage, given.joint, given.nodes
    if given.driven is not None and not nodes and made.joint.kind == "prismatic":
        yield from _drives(given, given.driven)
    if not any(stage.number(node) for node in nodes):
        return
    body = stage.declared(stage.body(made.joint.child))
    particle = body.inertia is None and body.shape is None and stage.is_ground(made.joint.parent)
    if particle and not made.slides and len(made.turns) > 1:
        centre = stage.centre(stage.body(made.joint.child))  # a bob on a string
        yield from given.arrow(_SPEED, Anchor(made.child.body, centre), _velocity(given, centre))
    elif made.joint.kind == "spherical":
        yield from _spins(given, nodes)
    elif made.turns and not made.slides and len(nodes) == 1:
        yield from _turns(given, nodes[0])
    elif made.joint.kind == "planar" and len(nodes) == 3 and speed_letter(stage, nodes[2]):
        yield from _turns(given, nodes[2])
    elif made.joint.kind == "free":
        yield from _free_spins(given, nodes[3:])
    elif made.joint.kind == "custom" and made.slides and made.turns:
        across = len(nodes) == 2 and is_polar(stage, made.joint) and nodes[1].shadow == 0
        swung = list(_swung(given, nodes[0])) if across else []
        end = Anchor(made.child.body, made.child.point)
        yield from swung or given.arrow(_SPEED, end, _velocity(given, end.point))
        return
    if made.slides and made.joint.kind in ("point", "planar", "free", "prismatic"):
        yield from _ways(given, nodes[: len(made.slides)])


def _velocity(given: _Given, point: Vector) -> Floats:
    """Return the velocity of a point of the child at the start (3)."""
    return velocity_of(given.stage, replace(given.joint.child, point=point))


def _turns(given: _Given, rate: Node) -> Iterator[Arrow]:
    """Yield the spin of a hinge, or the speed of what it carries where that is given or free."""
    stage, made = given.stage, given.joint
    swung = list(_swung(given, rate))
    if swung:
        yield from swung
        return
    spin = stage.turned(made.parent.body, stage.number(rate) * np.array(made.on_parent(made.turns[-1])))
    at = Anchor(made.child.body, made.child.point)
    yield from given.arrow(speed_letter(stage, rate) or _spin_letter(given), at, spin, turning=True)


def _spin_letter(given: _Given) -> str:
    """Return the letter of a spin that has none: omega with the index of its coordinate where several have none."""
    stage, bare = given.stage, []
    for name in stage.system.joints:
        other = _Given(stage, placed_joint(stage, name))
        if other.joint.turns and not other.joint.slides and any(stage.number(node) for node in other.nodes):
            bare += [name] if not speed_letter(stage, other.nodes[-1]) else []
    if len(bare) < 2:
        return "omega" if given.driven is not None else _SPIN
    q: Sequence[str] = getattr(given.joint.joint, "q", None) or ()
    lettered = len(q) == 1 and is_letter(stage.system, q[0])
    return f"omega_{q[0] if lettered else bare.index(given.joint.name) + 1}"


def _spins(given: _Given, nodes: Sequence[Node]) -> Iterator[Arrow]:
    """Yield the angular velocities at a ball joint: about an axis of ground and one of the body by Euler's angles.

    Of components along the axes of the body those that have a letter, and the spin of a top.
    """
    stage, made = given.stage, given.joint
    order: str | None = getattr(made.joint, "angles", None)
    name = stage.body(made.joint.child)
    cone = top(stage, name, stage.declared(name))
    tip = Anchor(made.child.body, made.child.point)
    high = np.array(tip.point) if cone is None else np.array(cone.tip) + _OVER * cone.height * np.array(cone.axis)
    over = Anchor(tip.body, vector(high))
    for k, node in enumerate(nodes):
        letter, number = speed_letter(stage, node), stage.number(node)
        axis, own = np.eye(3)["xyz".index(order[k]) if order else k], bool(order) and k == 0
        body, way = (made.parent.body, made.parent.turned(axis)) if own else (made.child.body, vector(axis))
        world = stage.turned(body, way)
        along = cone is not None and abs(float(np.array(cone.axis) @ axis)) > 0.999 and not own
        if order is not None and k == 1:
            continue  # about the line of nodes
        if letter or along or (cone is None and k == 2):
            yield from given.arrow(letter or _SPIN, over if along else tip, number * world, turning=True)


def _free_spins(given: _Given, nodes: Sequence[Node]) -> Iterator[Arrow]:
    """Yield the angular velocities of what flies: those with a letter about axes of the body, else their sum."""
    stage, made = given.stage, given.joint
    if getattr(made.joint, "angles", None):
        return
    at = Anchor(made.child.body, made.child.point)
    parts = [stage.number(node) * np.eye(3)[k] for k, node in enumerate(nodes)]
    named = [(speed_letter(stage, node), part) for node, part in zip(nodes, parts, strict=True)]
    if any(letter for letter, _ in named):
        for letter, part in named:
            if letter:
                yield from given.arrow(letter, at, stage.turned(made.child.body, part), turning=True)
        return
    whole = sum(parts, np.zeros(3))
    yield from given.arrow(_SPIN, at, stage.turned(made.child.body, whole), turning=True)


def _ways(given: _Given, speeds: Sequence[Node]) -> Iterator[Arrow]:
    """Yield the speed of what slides or flies, or its components where each has a letter."""
    stage, made = given.stage, given.joint
    at, ways = Anchor(made.child.body, made.child.point), [made.on_parent(axis) for axis in made.slides]
    own = [stage.number(node) * np.array(way) for node, way in zip(speeds, ways, strict=True)]
    parts = components(stage, speeds)
    if parts:
        for k, letter in parts:
            yield from given.arrow(letter, at, stage.turned(made.parent.body, own[k]))
        return
    turned = turned_by(tuple(speeds))
    world = stage.turned(made.parent.body, sum(own, np.zeros(3)))
    for item, law in given.arrow(letter_of(_SPEED, tuple(speeds)), at, world):
        if turned is not None and len(made.slides) == 2:
            axis = np.copysign(1.0, stage.number(speeds[turned.cosine])) * np.array(ways[turned.cosine])
            item = replace(item, angle=turned.angle, beside=Anchor(made.parent.body, vector(axis)))
        yield item, law


def _swung(given: _Given, rate: Node) -> Iterator[Arrow]:
    """Yield the speed v of what turns at v/R and is at R from the axis, and v_0 of a free particle; of another none."""
    stage, made = given.stage, given.joint
    speed, reach = rate.args if rate.op == "div" else (ZERO, ZERO)
    about = stage.turned(made.parent.body, np.array(unit(made.on_parent(made.turns[-1]))))
    base, own = stage.world(made.parent.body, made.parent.point), stage.body(made.joint.child)
    ends = [(made.child.body, stage.centre(own))]
    for name, joint in stage.system.joints.items():  # what slides on an arm
        if joint.kind == "prismatic" and stage.body(joint.parent) == own:
            ends.append((stage.number_of(stage.body(joint.child)), placed_joint(stage, name).child.point))
    for body, point in ends:
        arm = stage.world(body, point) - base
        arm = arm - float(arm @ about) * about
        size = float(np.linalg.norm(arm))
        named = letters(reach).isidentifier() and size > 0.0 and abs(size - stage.number(reach)) < 1e-6 * size
        letter = speed_letter(stage, speed) if named else ""
        if letter or (size > 0.0 and counts_freely(stage, own)):
            way = stage.number(rate) * np.cross(about, arm)
            yield from given.arrow(letter or _SPEED, Anchor(body, point), way)
            return


def _drives(given: _Given, driven: Node) -> Iterator[Arrow]:
    """Yield the motion that a slider is given if that is short, or its constant acceleration."""
    stage, made = given.stage, given.joint
    acceleration = derivative(derivative(driven, t), t)
    label, sign = short_formula(driven, stage.system.inputs), 1.0
    if t not in leaves([acceleration], "symbol"):
        label, sign = speed_letter(stage, acceleration), float(np.sign(stage.number(acceleration)))
    if label and sign:
        way = sign * np.array(stage.turned(made.parent.body, made.on_parent(made.slides[0])))
        at, path = Anchor(made.child.body, made.child.point), ("joints", made.name, "motion")
        yield ArrowItem("velocity", made.name, label, path, at, vector(way)), constant_law(way)
