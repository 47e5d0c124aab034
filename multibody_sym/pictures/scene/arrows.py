"""Arrows: gravity, forces, torques and given impulses, and what they are at a state. A load is an entry in _LAWS."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import numpy as np

from multibody_sym.mechanics.load_records import BodyTorque, JointForce, Load, PointDrag, PointForce
from multibody_sym.mechanics.motion import Motion
from multibody_sym.mechanics.points import velocity
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.model.bodies import GROUND as GROUND_NAME
from multibody_sym.pictures.scene.items import GROUND, ZERO, Anchor, ArrowItem, Vector, vector
from multibody_sym.pictures.scene.joints import placed_joint
from multibody_sym.pictures.scene.stage import Stage
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node, as_node
from multibody_sym.text.printer import text

_LONGEST: Final = 12
_FREE: Final = ("point", "planar")
"""Joints that leave a body free to fly."""
_SPEED: Final = "v_0"
"""The letter of a speed at the start that has none."""
_TURNED: Final = re.compile(r"-?(\w+)\*(cos|sin)\((.+)\)")
"""A component of what is turned by an angle."""


@dataclass(frozen=True)
class ArrowLaw:
    """What an arrow is at a state: three expressions along the axes of a body, or one along an axis of it."""

    nodes: tuple[Node, ...]
    body: int
    axis: Vector | None = None
    moves: Marker | None = None

    def vector(self, motion: Motion) -> Floats:
        """Return it in the world (3), zero where it has no value."""
        try:
            if self.moves is not None:
                return -np.array(velocity(motion, self.moves), dtype=float)
            values = np.array(motion.state.values(self.nodes), dtype=float)
        except (*UNDEFINED, KeyError):
            return np.zeros(3)
        own = values if self.axis is None else values[0] * np.array(self.axis)
        found: Floats = np.array(motion.rotation(self.body), dtype=float) @ own
        return found


    def way(self, motion: Motion) -> Floats:
        """Return the direction in the world (3) in which it counts, zero where it has more than one component."""
        given = [k for k, node in enumerate(self.nodes) if node.shadow != 0]
        if self.moves is not None or len(given) != 1:
            return np.zeros(3)
        sign = -1.0 if text(self.nodes[given[0]]).startswith("-") else 1.0
        own = sign * (np.eye(3)[given[0]] if self.axis is None else np.array(self.axis))
        found: Floats = np.array(motion.rotation(self.body), dtype=float) @ own
        return found


Arrow = tuple[ArrowItem, ArrowLaw]


def arrow_items(stage: Stage) -> Iterator[Arrow]:
    """Yield gravity, loads, given impulses, prescribed motions of ground and given speeds at the start."""
    if np.any(stage.gravity):
        law = ArrowLaw(tuple(stage.mechanism.gravity), GROUND)
        yield _item(stage, "gravity", "gravity", "g", ("gravity",), Anchor(GROUND, ZERO), law)
    for load in stage.mechanism.loads:
        make = _LAWS.get(type(load))
        if make is not None and load.path[0] == "forces":
            yield from make(stage, load)
    yield from _impulses(stage)
    motion = stage.declared(GROUND_NAME).motion
    for k, node in enumerate(() if motion is None else (motion.x, motion.y, motion.z)):
        if node.shadow != 0:
            path, law = ("bodies", GROUND_NAME, "motion", "xyz"[k]), _constant(np.eye(3)[k])
            yield _item(stage, "motion", GROUND_NAME, GROUND_NAME, path, Anchor(GROUND, ZERO), law)
    yield from _start_speeds(stage)


def _item(
    stage: Stage, role: Any, name: str, label: str, path: tuple[str, ...], at: Anchor, law: ArrowLaw
) -> Arrow:
    motion = stage.motion
    return ArrowItem(role, name, label, path, at, vector(law.vector(motion)), vector(law.way(motion))), law


def letter_of(name: str, declared: Any) -> str:
    """Return the letter of a force: its value where that is short, the size of one at an angle, else its name."""
    nodes = [node for node in (declared if isinstance(declared, tuple) else (declared,)) if node.shadow != 0]
    if len(nodes) == 1 and leaves(nodes, "symbol"):
        found = text(nodes[0]).removeprefix("-")
        if len(found) <= _LONGEST and "^" not in found:
            return found
    turned = [found.groups() for found in (_TURNED.fullmatch(text(node)) for node in nodes) if found]
    if len(nodes) == len(turned) == 2 and turned[0][::2] == turned[1][::2] and turned[0][1] != turned[1][1]:
        return str(turned[0][0])  # F*cos(a), F*sin(a): a force F at an angle
    return name


def _anchor(stage: Stage, marker: Marker) -> Anchor:
    return Anchor(marker.body, vector(stage.motion.point(marker)))


def _force(stage: Stage, load: PointForce) -> Iterator[Arrow]:
    label = letter_of(load.name, getattr(stage.system.forces.get(load.name), "value", ()))
    law = ArrowLaw(tuple(load.value), load.axes)
    yield _item(stage, "force", load.name, label, load.path, _anchor(stage, load.at), law)


def _torque(stage: Stage, load: BodyTorque) -> Iterator[Arrow]:
    label = letter_of(load.name, getattr(stage.system.forces.get(load.name), "value", ()))
    name = stage.mechanism.bodies[load.body].name if load.body >= 0 else "ground"
    centre = Anchor(load.body, stage.centre(name) if name in stage.system.bodies else ZERO)
    yield _item(stage, "torque", load.name, label, load.path, centre, ArrowLaw(tuple(load.value), load.axes))


def _in_joint(stage: Stage, load: JointForce) -> Iterator[Arrow]:
    """Yield the force or torque in a joint, on its child along the axis of the freedom."""
    element = stage.system.forces.get(load.name)
    if load.joint not in stage.system.joints:
        return
    made = placed_joint(stage, load.joint)
    freedom = getattr(element, "freedom", None)
    steps = [free.step for free in made.joint.free_steps] or list(made.joint.steps)
    names = [name for free in made.joint.free_steps for name in (made.name + f"_{free.step.coordinates[0].letter}",)]
    given = getattr(made.joint, "q", None) or names
    step = next((s for s, n in zip(steps, given, strict=False) if freedom in (n, f"u_{n}")), steps[0])
    axes = step.turns or step.slides
    if not axes:
        return
    law = ArrowLaw((load.value,), made.parent.body, made.on_parent(axes[0]))
    label = letter_of(load.name, getattr(element, "value", ()))
    role, at = "torque" if step.turns else "force", Anchor(made.child.body, made.child.point)
    yield _item(stage, role, load.name, label, load.path, at, law)


def _drag(stage: Stage, load: PointDrag) -> Iterator[Arrow]:
    law = ArrowLaw((), -1, moves=load.at)
    yield _item(stage, "drag", load.name, load.name, load.path, _anchor(stage, load.at), law)


_LAWS: Final[Mapping[type[Load], Callable[[Stage, Any], Iterator[Arrow]]]] = {
    PointForce: _force,
    BodyTorque: _torque,
    JointForce: _in_joint,
    PointDrag: _drag,
}
"""The arrow of each kind of load; others run between points and are strands."""


def _impulses(stage: Stage) -> Iterator[Arrow]:
    """Yield the given impulses of an impact."""
    if stage.system.impact is None:
        return
    for name, impact in stage.system.impact.strikes.items():
        if impact.impulse is not None and impact.at is not None:
            place = stage.place(impact.at)
            axes = stage.place(impact.frame or GROUND_NAME)
            own = stage.turned(axes.body, axes.turned(stage.vector(impact.impulse)))
            at, path = Anchor(place.body, place.point), stage.system.impact.path(name)
            yield ArrowItem("impulse", name, letter_of(name, impact.impulse), path, at, vector(own)), _constant(own)


def _start_speeds(stage: Stage) -> Iterator[Arrow]:
    """Yield the speeds that are given at the start to what moves freely."""
    for name, joint in stage.system.joints.items():
        made, given = placed_joint(stage, name), getattr(joint, "initial", None)
        if joint.kind not in _FREE or given is None or given.u is None:
            continue
        speeds = [as_node(0.0) if node is None else node for node in given.u[: len(made.slides)]]
        ways = [made.on_parent(axis) for axis in made.slides]
        own = sum((stage.number(node) * np.array(way) for node, way in zip(speeds, ways, strict=True)), np.zeros(3))
        at, path = Anchor(made.child.body, made.child.point), ("joints", name, "initial", "u")
        world = vector(stage.turned(made.parent.body, own))
        letter = letter_of(_SPEED, tuple(speeds))
        yield ArrowItem("velocity", name, letter, path, at, world), _constant(np.array(world))


def _constant(value: Floats) -> ArrowLaw:
    return ArrowLaw(tuple(as_node(float(x)) for x in value), GROUND)

