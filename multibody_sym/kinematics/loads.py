"""Loads: what forces, torques, springs and dampers exert, as wrenches on bodies and forces on speeds."""

from __future__ import annotations

from collections.abc import Iterable
from functools import singledispatch
from typing import Final

from multibody_sym.errors import at
from multibody_sym.kinematics.masses.flow import flow_wrench
from multibody_sym.kinematics.motion import Motion, pose
from multibody_sym.kinematics.points import position, velocity
from multibody_sym.kinematics.wrenches import Wrench, Wrenches, add_force, add_force_at, add_pair, generalized_forces
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.loads import (
    BodyTorque,
    JointForce,
    JointPotential,
    JointSpring,
    Load,
    MassFlow,
    PlacePotential,
    PointDrag,
    PointForce,
    PointPull,
    PointSpring,
    place_leaves,
    span_leaves,
)
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import gradient
from multibody_sym.scalars.functions import absolute, sqrt
from multibody_sym.scalars.node import ZERO, Node
from multibody_sym.scalars.traversal import leaves
from multibody_sym.scalars.vectors import (
    ZERO_VECTOR,
    Mat,
    S,
    Vec,
    apply,
    apply_transposed,
    cross,
    dot,
    negate,
    product,
    scale,
    subtract,
)

TINY: Final = 1e-300
"""What is added to v^2 so that |v| has a derivative at v = 0; everywhere else it is rounded away."""


@dataclass(frozen=True)
class Applied:
    """Applied forces: a wrench for each body (body axes, about its origin) and a force for each speed."""

    of_body: list[Wrench]
    of_speed: list[S]


def applied(motion: Motion, loads: Iterable[Load] | None = None, *, weight: bool = True) -> Applied:
    """Return what the loads (default: all) and, where asked for, gravity exert at a state."""
    wrenches = Wrenches(len(motion.bodies))
    of_speed: list[S] = [0] * len(motion.state.u)
    for load in motion.mechanism.loads if loads is None else loads:
        with at(*load.path):
            exert(load, motion, wrenches, of_speed)
    if weight:
        _add_weight(motion, wrenches)
    return Applied(wrenches.of_body, of_speed)


def applied_generalized_forces(motion: Motion, forces: Applied) -> list[S]:
    """Return the generalised forces of applied wrenches and joint forces together (nu)."""
    projected = generalized_forces(motion, forces.of_body)
    return [a + b for a, b in zip(projected, forces.of_speed, strict=True)]


def _add_weight(motion: Motion, wrenches: Wrenches) -> None:
    for index, (moved, mass) in enumerate(zip(motion.bodies, motion.masses, strict=True)):
        force = scale(mass.mass, moved.gravity)
        wrenches.add(index, force, cross(mass.com, force))


@singledispatch
def exert(load: Load, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    """Add what one load exerts."""
    raise TypeError(f"no force law for {type(load).__name__}")


@exert.register
def _(load: PointForce, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    add_force(wrenches, motion, load.at, apply(motion.rotation(load.axes), _three(motion, load.value)))


@exert.register
def _(load: BodyTorque, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    world = apply(motion.rotation(load.axes), _three(motion, load.value))
    wrenches.add(load.body, ZERO_VECTOR, apply_transposed(motion.rotation(load.body), world))


@exert.register
def _(load: JointForce, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    add_drive(motion, load.rate, motion.state.values([load.value])[0], of_speed)


@exert.register
def _(load: JointSpring, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    stiffness, damping, rest = motion.state.values([load.stiffness, load.damping, load.rest])
    coordinate, rate = motion.state.values([load.coordinate, load.rate])
    add_drive(motion, load.rate, -(stiffness * (coordinate - rest) + damping * rate), of_speed)


def add_drive(motion: Motion, rate: Node, force: S, of_speed: list[S]) -> None:
    """Add a generalised force on a rate that is linear in the speeds: force d(rate)/du_k on each of them."""
    speeds = [leaf for leaf in leaves([rate], "slot") if leaf.data[0] == "u"]
    for leaf, slope in zip(speeds, motion.state.values(gradient(rate, speeds)), strict=True):
        of_speed[leaf.data[1]] = of_speed[leaf.data[1]] + slope * force


@exert.register
def _(load: PointSpring, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    stiffness, damping, rest = motion.state.values([load.stiffness, load.damping, load.length])
    if load.length is ZERO and load.damping is ZERO:  # F = k d, which has a value where the points coincide
        add_pair(wrenches, motion, load.ends, scale(stiffness, apart(motion, load.ends)))
        return
    length, direction = span(motion, load.ends, load.straight)
    pull = stiffness * (length - rest) + damping * span_rate(motion, load.ends, direction)
    add_pair(wrenches, motion, load.ends, scale(pull, direction))


@exert.register
def _(load: PointPull, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    length, direction = span(motion, load.ends, load.straight)
    known = zip(span_leaves(load.name), (length, span_rate(motion, load.ends, direction)), strict=True)
    (pull,) = motion.state.values([load.value], dict(known))
    add_pair(wrenches, motion, load.ends, scale(pull, direction))


@exert.register
def _(load: JointPotential, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    for rate, slope in load.slopes:
        add_drive(motion, rate, -motion.state.values([slope])[0], of_speed)


@exert.register
def _(load: PlacePotential, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    x, y, z = motion.state.values(load.slopes, own_leaves(load, motion))
    force = apply(_axes_of(motion, load.frame), scale(-1, (x, y, z)))
    add_force(wrenches, motion, load.at, force)
    add_force_at(wrenches, motion, load.frame.body, position(motion, load.at), negate(force))


def own_leaves(load: Load, motion: Motion) -> dict[Node, S]:
    """Return what the leaves of its own stand for in the potential of a load: a distance, a place."""
    if isinstance(load, PointPull):
        return {span_leaves(load.name)[0]: span(motion, load.ends, load.straight)[0]}
    if isinstance(load, PlacePotential):
        return dict(zip(place_leaves(load.name), place(load, motion), strict=True))
    return {}


def place(load: PlacePotential, motion: Motion) -> Vec:
    """Return the place of the point on which a potential depends, in its frame."""
    return apply_transposed(_axes_of(motion, load.frame), apart(motion, (load.frame, load.at)))


def _axes_of(motion: Motion, frame: Marker) -> Mat:
    """Return R_WF of a frame on a body."""
    return product(motion.rotation(frame.body), pose(motion.state, frame.pose)[0])


@exert.register
def _(load: PointDrag, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    linear, quadratic = motion.state.values([load.linear, load.quadratic])
    v = velocity(motion, load.at)
    factor = linear if load.quadratic is ZERO else linear + quadratic * _size(v)
    add_force(wrenches, motion, load.at, scale(-factor, v))


@exert.register
def _(load: MassFlow, motion: Motion, wrenches: Wrenches, of_speed: list[S]) -> None:
    wrenches.add(load.body, *flow_wrench(load, motion))


def _size(v: Vec) -> S:
    """Return |v|, with the derivative zero where v is zero."""
    parts = [x for x in v if (x.shadow if isinstance(x, Node) else x) != 0]
    if len(parts) < 2:
        return absolute(parts[0]) if parts else 0
    return sqrt(dot(v, v) + TINY)


def span_rate(motion: Motion, ends: tuple[Marker, Marker], direction: Vec) -> S:
    """Return the rate of the distance of two markers, given the unit vector from the first to the second."""
    return dot(direction, subtract(velocity(motion, ends[1]), velocity(motion, ends[0])))


def span(motion: Motion, ends: tuple[Marker, Marker], straight: Point | None = None) -> tuple[S, Vec]:
    """Return the distance of two markers and the unit vector from the first to the second (world axes).

    `straight` is that vector where it is known and constant.
    """
    difference = apart(motion, ends)
    if straight is not None:
        direction = _three(motion, straight)
        return dot(direction, difference), direction
    length = sqrt(dot(difference, difference))
    return length, (difference[0] / length, difference[1] / length, difference[2] / length)


def apart(motion: Motion, ends: tuple[Marker, Marker]) -> Vec:
    """Return the vector from the first marker to the second (world axes)."""
    return subtract(position(motion, ends[1]), position(motion, ends[0]))


def _three(motion: Motion, nodes: tuple[Node, Node, Node]) -> Vec:
    x, y, z = motion.state.values(nodes)
    return x, y, z
