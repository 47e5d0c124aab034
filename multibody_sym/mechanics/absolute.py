"""Absolute coordinates: every body moves freely relative to ground, and every declared joint restricts that.

In the plane a body's coordinates are its centre of mass (x, y) and an angle, in space that and a unit quaternion (the
origin instead where the centre moves in the body). A joint's own coordinates are measured then: they are expressions of
those of the bodies that it joins. Quaternions count no whole turns: in space a joint that turns about axes keeps its
coordinates.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import combinations
from typing import Final

from multibody_sym.errors import ModelError
from multibody_sym.mechanics.mechanism import TreeBody
from multibody_sym.mechanics.references import BARE, References, in_plane
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.mechanics.spanning_tree import body_part, coordinate_names, has_rows, speed_names
from multibody_sym.model.bodies import GROUND, IDENTITY, ORIGIN, Frame, Turn, centre_moves, mass_of, unit_vector
from multibody_sym.model.contacts_and_impacts import copies
from multibody_sym.model.fields import Names, Point
from multibody_sym.model.joints import Foot, Free, Joint, Planar
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import tangents
from multibody_sym.scalars.functions import cos, sin
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, slot, symbol
from multibody_sym.scalars.vectors import (
    UNIT_MATRIX,
    ZERO_VECTOR,
    Mat,
    Vec,
    add,
    apply,
    apply_transposed,
    conjugate,
    dot,
    product,
    quaternion_product,
    quaternion_rates,
    quaternion_rotation,
    rotation_about,
    subtract,
    transpose,
)

# ----------------------------------------------------------------------------------------------------------------------
# Joints' coordinates and speeds as expressions of the poses of the bodies that they join.
#
# Translations are components of the way from frame F on the parent to frame M on the child, an angle in the plane or a
# ball's quaternion that of M's axes from F's. Rates are exact derivatives, and a ball's the relative angular velocity.


def has_formula(joint: Joint, *, plane: bool) -> bool:
    """Return whether a joint's coordinates follow from the poses of its bodies, one by one.

    They do where each of its steps says so, and its translations are along axes normal to each other.
    """
    axes = [unit_vector(axis) for step in joint.steps for axis in step.slides]
    across = all(as_node(dot(a, b)).shadow == 0 for a, b in combinations(axes, 2))
    return across and all(step.is_measured(plane=plane) for step in joint.steps)


def relative_coordinates(references: References, bodies: Sequence[TreeBody], joints: Iterable[str]) -> dict[Node, Node]:
    """Return the expression of each coordinate and speed of joints, by its symbol; `bodies` are free, or a ground."""
    poses = [_Pose(body) if body.q else None for body in bodies]  # a ground that moves has no coordinates
    rates = {place: rate for pose in poses if pose for place, rate in pose.rates.items()}
    found: dict[Node, Node] = {}
    for name in joints:
        joint = references.system.joints[name]
        ends = []
        for marker in references.frames(name):
            body, frame = body_part(marker.name, references.system.bodies)
            frames = references.system.bodies.get(body, BARE).frames
            turns = frames[frame].rotate if frame in frames else ()
            ends.append(_Attached(poses[marker.body] if marker.body >= 0 else None, marker, turns))
        between = _Between(*ends)
        coordinates = between.coordinates(joint)
        speeds = between.speeds(joint, tangents(coordinates, rates))
        found.update(zip(map(symbol, coordinate_names(name, joint)), coordinates, strict=True))
        found.update(zip(map(symbol, speed_names(name, joint)), speeds, strict=True))
    return found


@dataclass(frozen=True)
class _Pose:
    """The pose of a body that is carried freely from ground, relative to it."""

    body: TreeBody

    @cached_property
    def q(self) -> list[Node]:
        return [slot("q", k) for k in self.body.q]

    @cached_property
    def u(self) -> list[Node]:
        return [slot("u", k) for k in self.body.u]

    @property
    def in_plane(self) -> bool:
        """Whether it is carried in the plane, by x, y and an angle."""
        return not self.body.quaternions

    @cached_property
    def centre(self) -> Vec:
        """The position of the centre of mass, in ground's axes."""
        return (*self.q[:2], ZERO) if self.in_plane else (*self.q[:3],)  # type: ignore[return-value]

    @cached_property
    def rotation(self) -> Mat:
        """R_GB."""
        return rotation_about(IDENTITY[2], self.q[2]) if self.in_plane else quaternion_rotation(self.q[3:])

    @property
    def rates(self) -> dict[Node, Node]:
        turning = self.u[2:] if self.in_plane else quaternion_rates(self.q[3:], self.u[3:])
        count = len(self.q) - len(turning)
        return dict(zip(self.q, (*self.u[:count], *turning), strict=True))


@dataclass(frozen=True)
class _Attached:
    """A joint's frame on a body, or on ground (None)."""

    pose: _Pose | None
    marker: Marker
    turns: tuple[Turn, ...]

    @cached_property
    def position(self) -> Vec:
        """The frame's origin, in ground's axes."""
        point = self.marker.pose.position
        if self.pose is None:
            return point
        return add(self.pose.centre, apply(self.pose.rotation, subtract(point, self.pose.body.frame_on_body.position)))

    @cached_property
    def rotation(self) -> Mat:
        """The frame's axes, in ground's."""
        return product(self.pose.rotation if self.pose else UNIT_MATRIX, self.marker.pose.rotation)

    @cached_property
    def angle(self) -> Node:
        """The angle of the frame's axes from ground's, in the plane."""
        own = self.pose.q[2] if self.pose else ZERO
        return sum((turn.angle * unit_vector(turn.axis)[2] for turn in self.turns), own)

    @cached_property
    def quaternion(self) -> Sequence[Node]:
        """The unit quaternion of the frame's axes from ground's, in space."""
        found: Sequence[Node] = self.pose.q[3:] if self.pose else (ONE, ZERO, ZERO, ZERO)
        for turn in self.turns:
            half = turn.angle / 2
            x, y, z = (as_node(sin(half)) * x for x in unit_vector(turn.axis))
            found = quaternion_product(found, (as_node(cos(half)), x, y, z))
        return found

    @cached_property
    def turning(self) -> Vec:
        """The frame's angular velocity relative to ground in space, in its own axes."""
        if self.pose is None:
            return ZERO_VECTOR
        return apply_transposed(self.marker.pose.rotation, self.pose.u[3:])


@dataclass(frozen=True)
class _Between:
    """Frame M of a joint's child relative to frame F of its parent; a joint's steps read their coordinates from it."""

    F: _Attached
    M: _Attached

    def coordinates(self, joint: Joint) -> list[Node]:
        return [x for step in joint.steps for x in step.with_directions(unit_vector).measured(self)]

    def speeds(self, joint: Joint, rates: Sequence[Node]) -> list[Node]:
        pairs = [(free.step, [rates[k] for k in free.q]) for free in joint.free_steps]
        return [x for step, own in pairs for x in step.measured_speeds(self, own)]

    def way(self, axis: Point) -> Node:
        """Return how far M is from F along a unit axis of F."""
        return as_node(dot(apply(self.F.rotation, axis), self._way))

    @cached_property
    def _way(self) -> Vec:
        return subtract(self.M.position, self.F.position)

    @property
    def angle(self) -> Node:
        """The angle from F to M about z, in the plane."""
        return self.M.angle - self.F.angle

    @property
    def turning(self) -> Vec:
        """The angular velocity of M relative to F, in the axes of M."""
        return subtract(self.M.turning, apply_transposed(self.rotation, self.F.turning))

    @cached_property
    def rotation(self) -> Mat:
        """R_FM."""
        return product(transpose(self.F.rotation), self.M.rotation)

    @cached_property
    def quaternion(self) -> Sequence[Node]:
        """The unit quaternion of R_FM."""
        return quaternion_product(conjugate(self.F.quaternion), self.M.quaternion)


# ----------------------------------------------------------------------------------------------------------------------

_CENTRE: Final = "centre of mass"
_MOST: Final = 8
"""How many names an error lists."""
_IN_PLANE: Final = ("x", "y", "angle")
_IN_SPACE: Final = ("x", "y", "z", "qw", "qx", "qy", "qz")


@dataclass(frozen=True)
class Freed:
    """A system whose bodies are carried by joints from ground that leave them free, all its own joints being cut.

    The coordinates of `measured` joints follow from the poses of the bodies; `doubled` joints keep theirs, which do not
    follow, or no rows can stand for them.
    """

    system: System
    plane: bool
    doubled: frozenset[str]
    measured: frozenset[str]


def freed_bodies(system: System, carrying: Iterable[str]) -> Freed:
    """Return a system with its bodies freed, whose joints `carrying` bodies have coordinates of their own.

    `_free` follows a body's name where its coordinates' would be taken, or a contact has it.
    """
    plane = in_plane(system)
    bodies = dict(system.bodies)
    for name, body in system.bodies.items():
        if name != GROUND:
            place = ORIGIN if centre_moves(body, system.parameters) else mass_of(body).com
            bodies[name] = replace(body, frames=Names({**body.frames, _CENTRE: Frame(position=place)}))
    touching = {name for _, name, _ in copies(system.contacts)}
    carriers: dict[str, Joint] = {}
    feet = {joint.child for joint in system.joints.values() if isinstance(joint, Foot)}  # which follow other bodies
    for name in (name for name in system.bodies if name != GROUND and name not in feet):
        taken = _names({**system.joints, **carriers}) | {*system.parameters, *system.inputs, *system.joints, *touching}
        word = re.sub(r"[^A-Za-z0-9_]", "_", name)  # as it can stand in expressions
        word = word if word[0].isalpha() else f"body_{word}"
        while not taken.isdisjoint((word, *_names({word: _carrier(name, word, plane)}))):
            word += "_free"
        carriers[word] = _carrier(name, word, plane)
    cut = {
        name: joint if isinstance(joint, Foot) else replace(joint, cut=True) for name, joint in system.joints.items()
    }
    freed = replace(system, bodies=Names(bodies), joints=Names({**carriers, **cut}))
    joints = system.joints.items()
    told = frozenset(name for name, joint in joints if has_rows(joint) and has_formula(joint, plane=plane))
    return Freed(freed, plane, frozenset(carrying) - told, told)


def unknown_coordinate(name: str, system: System, known: Iterable[str]) -> ModelError:
    """Return the error for a name that no coordinate or speed of a system's joints has; `known` are those they have."""
    freed = freed_bodies(system, ()).system.joints.items()
    if name in _names({key: joint for key, joint in freed if key not in system.joints}):
        listed = list(known)
        names = ", ".join(listed[:_MOST]) + (" .." if len(listed) > _MOST else "")
        return ModelError(
            f"{name!r} is of a body in absolute coordinates; a state is given in those of joints: {names}; "
            "runs and equilibria in relative coordinates tell it in them",
            number="M117",
        )
    return ModelError(f"no coordinate or speed is called {name!r}", number="M117", word=name, known=known)


def _carrier(body: str, word: str, plane: bool) -> Joint:
    """Return the joint that leaves a body free; the names of its coordinates begin with `word`."""
    kind, letters = (Planar, _IN_PLANE) if plane else (Free, _IN_SPACE)
    return kind(GROUND, f"{body}.{_CENTRE}", q=tuple(f"{word}_{letter}" for letter in letters))


def _names(joints: Mapping[str, Joint]) -> set[str]:
    pairs = joints.items()
    return {x for name, joint in pairs for x in (*coordinate_names(name, joint), *speed_names(name, joint))}
