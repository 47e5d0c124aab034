"""Stage: a system with its mechanism and numbers, from which what is seen is built: places and sizes as floats."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from functools import cached_property

import numpy as np

from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.dynamics.start.state import closed_at
from multibody_sym.errors import NoSolutionError
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.declaration.bodies import Body
from multibody_sym.model.declaration.joint import Joint
from multibody_sym.model.declaration.system import System
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.mass import GROUND, mass_of
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.resolution.references import BARE, References
from multibody_sym.model.resolution.spanning_tree import body_part
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node
from multibody_sym.scene.forms import Values, Vector, vector


@dataclass(frozen=True)
class Place:
    """A frame on a body: its position and the directions of its axes (columns), in the body's axes."""

    body: int
    point: Vector
    rotation: Floats

    def turned(self, direction: Values) -> Vector:
        """Return a direction of the frame in the body's axes."""
        return vector(self.rotation @ np.asarray(direction, dtype=float))


@dataclass(frozen=True, eq=False)
class Stage:
    """A system, its mechanism, and the state (usually the start) that gives numbers to what it declares."""

    system: System
    mechanism: Mechanism
    begin: Start
    lengths: dict[str, float] = field(default_factory=dict)
    ended: list[Floats] = field(default_factory=list)
    """Points in the world of guides that have ends, beside which others need not be drawn further."""

    @cached_property
    def motion(self) -> Motion:
        """The motion of all bodies at the start."""
        begin = self.begin
        return motion_of(
            self.mechanism, state_of(self.mechanism, float, 0.0, begin.q, begin.u, begin.parameters)
        )

    @cached_property
    def poses(self) -> Floats:
        """The poses of the bodies at the start, and of the world (nb + 1, 3, 4)."""
        return poses_of(self.motion)

    @cached_property
    def known(self) -> Mapping[Node, float]:
        """What each name of the model stands for at the start."""
        symbols, slots = zip(*self.mechanism.symbols.items(), strict=True)
        found = {}
        for symbol, slot in zip(symbols, slots, strict=True):
            try:
                found[symbol] = float(self.motion.state.values([slot])[0])
            except (*UNDEFINED, KeyError):
                found[symbol] = math.nan
        return found

    @cached_property
    def references(self) -> References:
        """What references to points and frames stand for, in names."""
        numbers = {name: self.number_of(name) for name in (*self.system.bodies, GROUND)}
        return References(self.system, numbers, {})

    @cached_property
    def numbers(self) -> Mapping[str, int]:
        """The places of the bodies in tree order, by name."""
        return {body.name: k for k, body in enumerate(self.mechanism.bodies)}

    def number_of(self, body: str) -> int:
        """Return the place of a body; a ground at rest is -1."""
        return self.numbers.get(body, -1)

    def number(self, node: Node, otherwise: float = 0.0) -> float:
        """Return the value of an expression at the start, `otherwise` where it has none."""
        if node.shadow is not None:
            return float(node.shadow)
        try:
            found = evaluate_float([node], self.known)[0]
        except (*UNDEFINED, KeyError):
            return otherwise
        return found if math.isfinite(found) else otherwise

    def vector(self, point: Point) -> Vector:
        """Return the values of three expressions."""
        x, y, z = (self.number(node) for node in point)
        return x, y, z

    def place(self, reference: str) -> Place:
        """Return where a body, point or frame is."""
        marker = self.references.marker(reference)
        rows = [self.vector(row) for row in marker.pose.rotation]
        return Place(marker.body, self.vector(marker.pose.position), np.array(rows))

    def body(self, reference: str) -> str:
        """Return the name of the body that a reference leads to."""
        return body_part(reference, self.system.bodies)[0]

    def is_ground(self, reference: str) -> bool:
        """Return whether a reference leads to ground."""
        return self.body(reference) == GROUND

    def declared(self, body: str) -> Body:
        """Return what is declared of a body, nothing of one that is named only."""
        return self.system.bodies.get(body, BARE)

    def centre(self, body: str) -> Vector:
        """Return the centre of mass of a body, in its axes."""
        return self.vector(mass_of(self.declared(body)).com)

    def world(self, body: int, point: Values) -> Floats:
        """Return where a point of a body is at the start."""
        found: Floats = self.poses[body][:, :3] @ np.asarray(point, dtype=float) + self.poses[body][:, 3]
        return found

    def turned(self, body: int, direction: Values) -> Floats:
        """Return a direction of a body in the world at the start."""
        found: Floats = self.poses[body][:, :3] @ np.asarray(direction, dtype=float)
        return found

    @cached_property
    def gravity(self) -> Floats:
        """The vector of gravity."""
        return np.array(self.vector(self.system.gravity))

    def carrying(self, body: str) -> Joint | None:
        """Return the joint whose child a body is: the one of the tree, if there are several."""
        found = [joint for joint in self.system.joints.values() if self.body(joint.child) == body]
        return next((joint for joint in found if not joint.cut), found[0] if found else None)


def poses_of(motion: Motion) -> Floats:
    """Return the poses of the bodies, and of the world at the end (nb + 1, 3, 4)."""
    found = np.zeros((len(motion.bodies) + 1, 3, 4))
    found[-1, :, :3] = np.eye(3)
    for k, (rotation, place) in enumerate(motion.poses):
        found[k, :, :3] = rotation
        found[k, :, 3] = place
    return found


def drawn_start(mechanism: Mechanism, overrides: Mapping[str, float] | None, *, project: bool) -> Start:
    """Return the start of a mechanism, with contacts closed that it nearly closes."""
    base = mechanism.relative or mechanism
    begin = start(mechanism, overrides, project=project)
    if mechanism.relative is not None or not base.one_way:
        return begin
    try:
        return closed_at(base, begin, overrides, project=project)[1]
    except NoSolutionError:
        return begin
