"""Loads: forces with their places found."""

from __future__ import annotations

from dataclasses import dataclass

from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.scalars.node import Node, quantity


@dataclass(frozen=True)
class PointForce:
    """A force with components along the axes of body `axes`, acting at a marker."""

    name: str
    at: Marker
    value: Point
    axes: int


@dataclass(frozen=True)
class BodyTorque:
    """A torque with components along the axes of body `axes`, acting on a body."""

    name: str
    body: int
    value: Point
    axes: int


@dataclass(frozen=True)
class JointForce:
    """A generalised force on a freedom of a joint (on the child and back on the parent), whose `rate` is linear in u.

    Its generalised force on speed k is value d(rate)/du_k.
    """

    name: str
    joint: str
    rate: Node
    value: Node


@dataclass(frozen=True)
class PointSpring:
    """A spring and damper in parallel that pull two markers together."""

    name: str
    ends: tuple[Marker, Marker]
    stiffness: Node
    damping: Node
    length: Node


@dataclass(frozen=True)
class JointSpring:
    """A spring and damper in parallel on a freedom of a joint: its `coordinate`, and its `rate`, linear in u."""

    name: str
    joint: str
    coordinate: Node
    rate: Node
    stiffness: Node
    damping: Node
    rest: Node


@dataclass(frozen=True)
class PointDrag:
    """F = -(linear + quadratic |v|) v at a marker that moves with v."""

    name: str
    at: Marker
    linear: Node
    quadratic: Node


@dataclass(frozen=True)
class PointPull:
    """A force that pulls two markers together; `value` names their distance and its rate as `span_leaves` do."""

    name: str
    ends: tuple[Marker, Marker]
    value: Node


Load = PointForce | BodyTorque | JointForce | PointSpring | JointSpring | PointDrag | PointPull


def span_leaves(load: str) -> tuple[Node, Node]:
    """Return the leaves that stand for the distance of the points that a load pulls together, and for its rate."""
    return quantity("span", (load,)), quantity("span_rate", (load,))
