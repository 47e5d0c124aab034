"""Stops: the limits of joints that hold, where they stand on the parent and which way of the child they bar."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from multibody_sym.kinematics.joints import JointMotion
from multibody_sym.kinematics.steps import stepped
from multibody_sym.model.declaration.joint import MovingJoint
from multibody_sym.model.declaration.parameters import in_letters, letters_of
from multibody_sym.model.resolution.spanning_tree import coordinate_names
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scalars.node import Node
from multibody_sym.scene.forms import Axes, Face, Rail, Stop, Symbol, TurnStop, Vector, unit, vector
from multibody_sym.scene.items import Item
from multibody_sym.scene.joints import Held, held
from multibody_sym.scene.marks import away, letters
from multibody_sym.scene.stage import Stage

_SIDES: Final = (("lower", -1.0, "≥"), ("upper", 1.0, "≤"))
_STILL: Final = 1e-9


def stop_items(
    stage: Stage, bodies: Sequence[Item], places: Mapping[str, Sequence[Vector]]
) -> Iterator[Item]:
    """Yield the stops of each joint, on its parent; `bodies` are the items of bodies, whose fronts meet them.

    Limits that do not act are no stops, and one that nothing of a body would show, such as of a disc about its middle,
    is not seen.
    """
    book = letters_of(stage.system.parameters)
    for name, joint in stage.system.joints.items():
        limits = joint.stops if isinstance(joint, MovingJoint) else None
        for word, side, sign in _SIDES if limits is not None else ():
            node: Node | None = getattr(limits, word)
            value = math.nan if node is None else stage.number(node, math.nan)
            if node is None or not math.isfinite(value):
                continue
            made = held(stage, name)
            form = _form(made, value, side, bodies, places)
            if form is not None:
                told, path = _told(node, value, joint.coordinate_units[0], book), ("joints", name, "limits", word)
                label, on_ground = f"{coordinate_names(name, joint)[0]} {sign} {told}", stage.is_ground(joint.parent)
                yield Item("stop", f"{name}.{word}", label, path, made.parent.body, form, made.bodies, on_ground)


def _told(node: Node, value: float, unit_of: str, book: Mapping[str, str]) -> str:
    """Return a limit as a figure has it: its letters, else the number with its unit, of angles in degrees."""
    named = letters(node)
    if named or value == 0.0:
        return in_letters(named, book) or "0"
    told = f"{math.degrees(value):.4g}°" if unit_of == "rad" else f"{value:.4g} {unit_of}".rstrip()
    return told.replace("-", "−")


def _form(
    made: Held, value: float, side: float, bodies: Sequence[Item], places: Mapping[str, Sequence[Vector]]
) -> Stop | TurnStop | None:
    """Return where a stop stands: across the way on which the joint goes there, or beside the rod that turns."""
    (free,) = made.joint.free_steps
    moved = stepped(free.step, JointMotion(), [value], [0.0], made.stage.motion.state)
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


def _front(made: Held, ahead: Floats, bodies: Sequence[Item]) -> float:
    """Return how far what has a size reaches ahead of the joint's place on the child (m), zero where nothing does."""
    stage, child = made.stage, made.child.body
    way = stage.turned(made.parent.body, vector(ahead))
    at = stage.world(child, made.child.point)
    reaches = [0.0]
    for item in bodies:
        rod = not getattr(item.form, "closed", True)
        if item.body == child and not rod and not isinstance(item.form, (Axes, Face, Rail, Symbol)):
            reaches += [float((stage.world(child, point) - at) @ way) for point in item.form.bounds]
    return max(reaches)
