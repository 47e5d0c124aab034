"""What joints' coordinates and speeds are in absolute coordinates: expressions of the poses of the bodies they join.

Translations are components of the way from frame F on the parent to frame M on the child, an angle in the plane or a
ball's quaternion that of M's axes from F's. Rates are exact derivatives, and a ball's the relative angular velocity.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property

from multibody_sym.model.declaration.bodies import Turn
from multibody_sym.model.declaration.joint import Joint
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import unit_vector
from multibody_sym.model.mechanism.mechanism import TreeBody
from multibody_sym.model.resolution.references import BARE, References
from multibody_sym.model.resolution.spanning_tree import body_part, coordinate_names, speed_names
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import tangents
from multibody_sym.scalars.functions import cos, sin
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, slot, symbol
from multibody_sym.scalars.rotations import (
    conjugate,
    quaternion_product,
    quaternion_rates,
    quaternion_rotation,
    turned,
)
from multibody_sym.scalars.vectors import (
    UNIT_MATRIX,
    ZERO_VECTOR,
    Mat,
    Vec,
    add,
    apply,
    apply_transposed,
    dot,
    product,
    subtract,
    transpose,
)

_UP = (ZERO, ZERO, ONE)


def has_formula(joint: Joint, *, plane: bool) -> bool:
    """Return whether a joint's coordinates follow from the poses of its bodies, one by one.

    They do where each of its steps says so, and its translations are along axes normal to each other.
    """
    moves = [axis for step in joint.steps for axis in step.slides]
    told = all(step.is_measured(plane=plane) for step in joint.steps)
    return told and all(_normal(a, b) for i, a in enumerate(moves) for b in moves[:i])


def measured(references: References, bodies: Sequence[TreeBody], joints: Iterable[str]) -> dict[Node, Node]:
    """Return the expression of each coordinate and speed of joints, by its symbol; `bodies` are free, or a ground."""
    poses = [_Pose(body) if body.q else None for body in bodies]  # a ground that moves has no coordinates
    rates = {place: rate for pose in poses if pose for place, rate in pose.rates.items()}
    found: dict[Node, Node] = {}
    for name in joints:
        joint = references.system.joints[name]
        F, M = (
            _Attached(poses[marker.body] if marker.body >= 0 else None, marker, _turns(references, marker))
            for marker in references.frames(name)
        )
        between = _Between(F, M)
        coordinates = between.coordinates(joint)
        speeds = between.speeds(joint, tangents(coordinates, rates))
        found.update(zip(map(symbol, coordinate_names(name, joint)), coordinates, strict=True))
        found.update(zip(map(symbol, speed_names(name, joint)), speeds, strict=True))
    return found


def _turns(references: References, marker: Marker) -> tuple[Turn, ...]:
    """Return the turns of a frame on its body."""
    name, part = body_part(marker.name, references.system.bodies)
    frames = references.system.bodies.get(name, BARE).frames
    return frames[part].rotate if part in frames else ()


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
        return turned(_UP, self.q[2]) if self.in_plane else quaternion_rotation(self.q[3:])

    @property
    def rates(self) -> dict[Node, Node]:
        """The rate of each coordinate."""
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
    """Frame M of a joint's child relative to frame F of its parent: what the joint's steps ask for."""

    F: _Attached
    M: _Attached

    def coordinates(self, joint: Joint) -> list[Node]:
        """Return the joint's coordinates."""
        return [x for step in joint.steps for x in step.with_directions(unit_vector).measured(self)]

    def speeds(self, joint: Joint, rates: Sequence[Node]) -> list[Node]:
        """Return the joint's speeds, given the rates of its coordinates."""
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


def _normal(a: Point, b: Point) -> bool:
    return as_node(dot(unit_vector(a), unit_vector(b))).shadow == 0
