"""Mechanism: what follows from a System's declarations alone. Bodies in tree order, coordinates, loads and rows.

Every expression in it is written in slots: `t[0]`, `q[i]`, `u[i]`, `parameters[i]`, `inputs[i]`. Names stay in tables.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

from multibody_sym.errors import ModelError, suggestion
from multibody_sym.model.bodies import GROUND, ORIGIN, Mass, Pose
from multibody_sym.model.elements import Point
from multibody_sym.model.joints import Step
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.node import ZERO, Node, quantity, slot

TIME: Final = slot("t", 0)
COMPONENTS: Final = ("fx", "fy", "fz", "mx", "my", "mz")
"""The components of a reaction: force and moment."""


@dataclass(frozen=True)
class Coordinate:
    """A coordinate: its name, joint, unit and initial value (an expression of parameters)."""

    name: str
    joint: str
    unit: str
    initial: Node
    given: bool
    known: bool


@dataclass(frozen=True)
class Speed:
    """A speed: its name, joint, unit and initial value (an expression of parameters)."""

    name: str
    joint: str
    unit: str
    initial: Node
    given: bool


@dataclass(frozen=True)
class Limit:
    """The range of a joint's `coordinate`, and the largest size of its `speed`, by name; None is no limit."""

    joint: str
    coordinate: str
    speed: str
    lower: Node | None
    upper: Node | None
    velocity: Node | None


@dataclass(frozen=True)
class Marker:
    """A pose fixed on a body; body -1 is a ground at rest."""

    name: str
    body: int
    pose: Pose


NOWHERE: Final = Marker("", -1, Pose())


@dataclass(frozen=True)
class TreeBody:
    """A body and the joint that carries it: frame F on the parent, frame M on the body, coinciding at zero coordinates.

    The joint moves by `steps` (unit axes), then freely about M's origin if it is a `ball`. `q` and `u` are the places
    of its coordinates and speeds among those of the mechanism. A ground that moves is such a body too, joined to the
    world by prescribed steps. A massless `is_double`, which rows hold to the body that it doubles, keeps a joint's
    coordinates where other joints carry its child.
    """

    name: str
    parent: int
    joint_name: str
    steps: tuple[Step, ...]
    ball: bool
    frame_on_parent: Pose
    frame_on_body: Pose
    mass: Mass
    q: tuple[int, ...]
    u: tuple[int, ...]
    is_double: bool = False

    @property
    def quaternion(self) -> tuple[int, ...]:
        """The positions of the unit quaternion, if there is one, in the mechanism's coordinates."""
        return self.q[-4:] if self.ball else ()

    @property
    def step_q(self) -> tuple[int, ...]:
        """The positions of the coordinates of its steps; those of prescribed ones are missing."""
        return self.q[:-4] if self.ball else self.q

    @property
    def step_u(self) -> tuple[int, ...]:
        """The positions of their rates among the speeds."""
        return self.u[:-3] if self.ball else self.u

    @cached_property
    def given(self) -> tuple[tuple[Node, Node, Node] | None, ...]:
        """For each step, if it is prescribed, what its coordinate would be, its rate and the rate of that."""
        found: list[tuple[Node, Node, Node] | None] = []
        for step in self.steps:
            if step.motion is None:
                found.append(None)
            else:
                rate = derivative(step.motion, TIME)
                found.append((step.motion, rate, derivative(rate, TIME)))
        return tuple(found)

    @property
    def driven(self) -> bool:
        """Whether a prescribed step moves, so that its drive does work."""
        return any(given is not None and given[1] is not ZERO for given in self.given)


# --- loads ---------------------------------------------------------------------------------------------------------


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


# --- rows ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class DistanceRow:
    """phi = value - |a - b|; the multiplier is the tension."""

    name: str
    ends: tuple[Marker, Marker]
    value: Node


@dataclass(frozen=True)
class Bend:
    """A place on a rope's path: a marker, and the pulley's radius and axis where it is a wheel."""

    at: Marker
    radius: Node
    axis: Point


@dataclass(frozen=True)
class RopeRow:
    """phi = length - (length of the path); the multiplier is the tension."""

    name: str
    path: tuple[Bend, ...]
    length: Node


@dataclass(frozen=True)
class ExpressionRow:
    """phi = zero, an expression of q and t; the multiplier has the unit that the expression gives it.

    With `no_place` nothing says where its force acts; otherwise it drives the joints whose coordinates it names.
    """

    name: str
    zero: Node
    no_place: bool = False


@dataclass(frozen=True)
class GearRow(ExpressionRow):
    """The same for two wheels whose teeth touch at the `pitch` point of the body that their axes stay on.

    A unit multiplier is `force` (that body's axes) at the pitch point: times -1, 0 or 1 on each of some bodies (`on`),
    and times such a factor what each joint's child gets of it that its reaction does not (`beside`). In a tree
    (`in_tree`) these bodies are the wheels; other joints' rows hold the force back, as H is that of drives in joints.
    """

    pitch: Marker = NOWHERE
    force: Point = ORIGIN
    on: tuple[tuple[int, int], ...] = ()
    beside: tuple[tuple[str, int], ...] = ()
    in_tree: bool = True


@dataclass(frozen=True)
class VelocityRow:
    """psi = zero, an expression of q, u and t that is linear in u: a nonholonomic constraint; `no_place` as above."""

    name: str
    zero: Node
    no_place: bool = False


@dataclass(frozen=True)
class PositionRow:
    """phi = axis . (p_M - p_F): frame M's origin stays where it is along an axis of frame F.

    The multiplier is the component of the force on M's body along the axis.
    """

    name: str
    frames: tuple[Marker, Marker]
    axis: Point


@dataclass(frozen=True)
class AngleRow:
    """phi = e . d - value: a direction e of frame F and a direction d of frame M keep their angle.

    The multiplier is the moment on M's body along d x e, if that is of length one. Where frames could satisfy the row
    turned over, `shared` is an axis of both that must not point opposite ways.
    """

    name: str
    frames: tuple[Marker, Marker]
    directions: tuple[Point, Point]
    value: Node = ZERO
    shared: Point | None = None


@dataclass(frozen=True)
class RollingRow:
    """Where a ball, or the sharp rim of a disc about `axis`, touches a plane, both bodies have one velocity `along`.

    `along` is a direction fixed in the plane's frame. Along the normal the row is holonomic (the gap stays closed);
    across it is not. The multiplier is that component of the force on the rolling body.
    """

    name: str
    wheel: Marker
    axis: Point | None
    radius: Node
    plane: Marker
    normal: Point
    along: Point


Row = DistanceRow | RopeRow | ExpressionRow | VelocityRow | PositionRow | AngleRow | RollingRow


def is_holonomic(row: Row) -> bool:
    """Return whether a row restricts positions, not speeds only."""
    return not isinstance(row, VelocityRow) and (not isinstance(row, RollingRow) or row.along == row.normal)


@dataclass(frozen=True)
class Drive:
    """What row number `row` exerts on a freedom of a joint for a unit multiplier: a force `factor` on its `rate`."""

    row: int
    rate: Node
    factor: Node


@dataclass(frozen=True)
class CutJoint:
    """A joint without coordinates of its own: its frames on parent and child, and which rows stand for it.

    `drives` are what rows that name coordinates exert on its freedoms, `teeth` the rows of gears whose force at the
    teeth its reaction is without, with the factor of that force on its child.
    """

    name: str
    frames: tuple[Marker, Marker]
    rows: range
    drives: tuple[Drive, ...] = ()
    teeth: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class ParameterEntry:
    """An entry of the parameter vector: `value` is an expression of the entries before it.

    None marks what is computed from the start (a rope's length) or chosen for a run (Baumgarte's coefficients).
    """

    name: str
    value: Node | None
    positive: bool


def double_name(child: str, joint: str) -> str:
    """Return what the massless double of a joint's child is called."""
    return f"double of {child} at {joint}"


@dataclass(frozen=True)
class Withheld:
    """The `components` of a joint's reaction that are not determined, `because` of which constraints (name, kind)."""

    components: tuple[str, ...]
    because: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Mechanism:
    """A system resolved: bodies in tree order (parents first), coordinates, speeds, parameters, inputs, loads, rows.

    `symbols` gives the slot of each name that expressions may use, or what it measures; `markers` every named point and
    frame. `stops` are functions that become positive where the run ends, `kinks` functions at whose zeros forces or
    inputs bend or jump. In absolute coordinates `relative` is the same system in those of its joints, in which its
    start is declared. `minimum_norm`: where rows are redundant, multipliers of least norm are asked for. `withheld`:
    by joint, reactions that are not determined; `untold` outputs name such and are not among `outputs`.
    """

    name: str
    gravity: Point
    bodies: tuple[TreeBody, ...]
    markers: Mapping[str, Marker]
    coordinates: tuple[Coordinate, ...]
    speeds: tuple[Speed, ...]
    parameters: tuple[ParameterEntry, ...]
    inputs: Mapping[str, Node]
    outputs: Mapping[str, Node]
    stops: Mapping[str, Node]
    kinks: tuple[Node, ...]
    loads: tuple[Load, ...]
    rows: tuple[Row, ...]
    limits: tuple[Limit, ...]
    cuts: tuple[CutJoint, ...]
    symbols: Mapping[Node, Node]
    minimum_norm: bool
    relative: Mechanism | None = None
    withheld: Mapping[str, Withheld] = field(default_factory=dict)
    untold: tuple[str, ...] = ()

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The declared joints, and a ground that moves: those of the tree in their order, then the cut ones."""
        own = (*(body.joint_name for body in self.bodies), *(cut.name for cut in self.cuts))
        return own if self.relative is None else tuple(name for name in own if name in self.relative.joint_names)

    @property
    def drives(self) -> tuple[str, ...]:
        """The joints (and ground) that move as prescribed, and so do work on the system."""
        return tuple(body.joint_name for body in self.bodies if body.driven)

    def row_path(self, row: int) -> tuple[str, str]:
        """Return where the model declares a row: the joint that was cut, or the constraint."""
        cut = next((cut.name for cut in self.cuts if row in cut.rows), None) or self._doubled(self.rows[row])
        return ("constraints", self.rows[row].name.partition(".")[0]) if cut is None else ("joints", cut)

    def _doubled(self, row: Row) -> str | None:
        """Return the cut joint whose massless double of its child a row holds to the child itself."""
        if not isinstance(row, (PositionRow, AngleRow)) or row.frames[0].body < 0:
            return None
        held = self.bodies[row.frames[0].body]
        return held.joint_name if held.name == double_name(row.frames[1].name, held.joint_name) else None

    def body_index(self, name: str) -> int:
        """Return the position of a body in tree order; ground at rest is -1. Raises ModelError for an unknown name."""
        for index, body in enumerate(self.bodies):
            if body.name == name:
                return index
        if name == GROUND:
            return -1
        raise ModelError(f"no body is called {name!r}{suggestion(name, [b.name for b in self.bodies])}")


def normal_forces(mechanism: Mechanism) -> dict[str, RollingRow]:
    """Return the rows that keep rolling wheels on their planes, by name: a negative multiplier pulls."""
    rows = [row for row in mechanism.rows if isinstance(row, RollingRow)]
    return {row.name: row for row in rows if row.along == row.normal}
