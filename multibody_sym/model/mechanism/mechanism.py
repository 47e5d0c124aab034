"""Mechanism: what follows from a System's declarations alone. Bodies in tree order, coordinates, loads and rows.

Every expression in it is written in slots: `t[0]`, `q[i]`, `u[i]`, `parameters[i]`, `inputs[i]`. Names stay in tables.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from functools import cached_property
from typing import Final

from multibody_sym.errors import ModelError
from multibody_sym.expressions.units import Dimension
from multibody_sym.model.declaration.states import StateCondition
from multibody_sym.model.declaration.steps import FreeStep, Step, free_steps
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.contact_rows import ContactRow
from multibody_sym.model.mechanism.impacts import StruckImpacts
from multibody_sym.model.mechanism.loads import Load
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import GROUND, Mass, Pose
from multibody_sym.model.mechanism.one_way import Mode, OneWay
from multibody_sym.model.mechanism.parameters import ParameterVector
from multibody_sym.model.mechanism.rows import AngleRow, CutJoint, PositionRow, Row
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.node import ZERO, Node, slot, symbol

TIME: Final = slot("t", 0)
NORMAL: Final = "normal"
"""What else there is of the reaction of a joint that guides along a curve: the force across it."""


@dataclass(frozen=True)
class Coordinate:
    """A coordinate: its name, joint, unit and initial value (an expression of parameters).

    It is `known` where it is given and marked so.
    """

    name: str
    joint: str
    unit: str
    initial: Node
    given: bool
    known: bool


@dataclass(frozen=True)
class Speed:
    """A speed: its name, joint, unit and initial value (an expression of parameters).

    It is `known` where it is given and what it is the rate of is marked so.
    """

    name: str
    joint: str
    unit: str
    initial: Node
    given: bool
    known: bool


@dataclass(frozen=True)
class JointLimit:
    """The range of a joint's `coordinate`, and the largest size of its `speed`, by name; None is no limit."""

    joint: str
    coordinate: str
    speed: str
    lower: Node | None
    upper: Node | None
    velocity: Node | None


@dataclass(frozen=True)
class TreeBody:
    """A body and the joint that carries it: frame F on the parent, frame M on the body, coinciding at zero coordinates.

    The joint moves by `steps` (unit axes). `q` and `u` are the places of its coordinates and speeds among those of the
    mechanism. A ground that moves is such a body too, joined to the world by prescribed steps. A massless `is_double`,
    which rows hold to the body that it doubles, keeps a joint's coordinates where other joints carry its child. A
    massless one that `is_foot` follows where a curve is touched, or guides a point.
    """

    name: str
    parent: int
    joint_name: str
    steps: tuple[Step, ...]
    frame_on_parent: Pose
    frame_on_body: Pose
    mass: Mass
    q: tuple[int, ...]
    u: tuple[int, ...]
    is_double: bool = False
    is_foot: bool = False

    @cached_property
    def free_steps(self) -> tuple[FreeStep, ...]:
        """The steps that are not prescribed, with the places of their coordinates and speeds in the mechanism."""
        return free_steps(self.steps, self.q, self.u)

    @property
    def rate_pairs(self) -> tuple[tuple[int, int], ...]:
        """The places of coordinates with those of the speeds that are their rates."""
        return tuple(pair for free in self.free_steps for pair in free.rate_pairs)

    @property
    def speeds_in_own_axes(self) -> bool:
        """Whether speeds of its joint are components along the axes of frame M, which then keeps its axes."""
        return any(step.in_child_axes for step in self.steps)

    @property
    def quaternions(self) -> tuple[tuple[int, ...], ...]:
        """The places of the coordinates that are unit quaternions (w first)."""
        return tuple(free.q for free in self.free_steps if free.step.unit_quaternion)

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
        """Whether a prescribed step moves, or what guides it does, so that its drive does work."""
        return any(step.drifts for step in self.steps) or any(g is not None and g[1] is not ZERO for g in self.given)


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

    `symbols` gives the slot of each name that expressions may use, or what it measures, first of rates such as `phi'`,
    which have a name of their own, too; `markers` every named point and frame. `stops` are functions that become
    positive where the run ends, `kinks` functions at whose zeros forces or inputs bend or jump, `fades` those at whose
    zeros they become as good as constant. In absolute coordinates `relative` is the same system in those of its
    joints, in which its start is declared. `minimum_norm`: where rows are redundant, multipliers of least norm are
    asked for. `withheld`: by joint, reactions that are not determined; `untold` outputs name such and are not among
    `outputs`. `run_outputs` name what adds up along a run, work and impulses, and are not among `outputs` either.
    `driving_inputs` are those that motions and constraints name, where their expressions stand; `input_dimensions` are
    stated ones.
    Of `one_way` elements none is among `rows` until a `mode` says which hold (`in_mode`); in a mode the speeds at the
    places `held` stay zero. With `mode_numbers` all rows are there, and numbers of these names say which act
    (`in_every_mode`). `state_stops` end the run where an element begins to be in a state. `impact` is what
    strikes at the start, which no motion asks for.
    """

    name: str
    gravity: Point
    bodies: tuple[TreeBody, ...]
    markers: Mapping[str, Marker]
    coordinates: tuple[Coordinate, ...]
    speeds: tuple[Speed, ...]
    parameters: ParameterVector
    inputs: Mapping[str, Node]
    outputs: Mapping[str, Node]
    stops: Mapping[str, Node]
    kinks: tuple[Node, ...]
    fades: tuple[Node, ...]
    loads: tuple[Load, ...]
    rows: tuple[Row, ...]
    limits: tuple[JointLimit, ...]
    cuts: tuple[CutJoint, ...]
    symbols: Mapping[Node, Node]
    minimum_norm: bool
    relative: Mechanism | None = None
    withheld: Mapping[str, Withheld] = field(default_factory=dict)
    untold: tuple[str, ...] = ()
    run_outputs: Mapping[str, Node] = field(default_factory=dict)
    driving_inputs: tuple[str, ...] = ()
    one_way: tuple[OneWay, ...] = ()
    mode: Mode | None = None
    held: tuple[int, ...] = ()
    state_stops: Mapping[str, StateCondition] = field(default_factory=dict)
    impact: StruckImpacts | None = None
    mode_numbers: tuple[str, ...] = ()
    input_dimensions: Mapping[str, Dimension] = field(default_factory=dict)

    def __repr__(self) -> str:
        parts = f"{len(self.bodies)} bodies, {len(self.coordinates)} coordinates, {len(self.rows)} rows"
        return f"<Mechanism of {self.name}: {parts}>"

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The declared joints, and a ground that moves: those of the tree in their order, then the cut ones."""
        own = (*(body.joint_name for body in self.bodies), *(cut.name for cut in self.cuts))
        return own if self.relative is None else tuple(name for name in own if name in self.relative.joint_names)

    @property
    def drives(self) -> tuple[str, ...]:
        """The joints (and ground) that move as prescribed, and so do work on the system."""
        return tuple(body.joint_name for body in self.bodies if body.driven)

    def speed_place(self, name: str) -> int | None:
        """Return the place of a speed, or of the speed that is the rate of a coordinate; None of what is measured."""
        leaf = self.symbols.get(symbol(name))
        if leaf is None or leaf.op != "slot":
            return None
        rates = dict(pair for body in self.bodies for pair in body.rate_pairs)
        return leaf.data[1] if leaf.data[0] == "u" else rates.get(leaf.data[1])

    def row_path(self, row: int) -> tuple[str, str]:
        """Return where the model declares a row: the joint that was cut, or the constraint."""
        if self.rows[row].name in self._one_way_paths:
            return self._one_way_paths[self.rows[row].name]
        cut = next((cut.name for cut in self.cuts if row in cut.rows), None) or self._doubled(self.rows[row])
        return ("constraints", self.rows[row].name.partition(".")[0]) if cut is None else ("joints", cut)

    @cached_property
    def _one_way_paths(self) -> Mapping[str, tuple[str, str]]:
        """Where each row of what holds one way only is declared, by the row's name."""
        return {row.name: element.path for element in self.one_way for row in element.rows}

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
        raise ModelError(f"no body is called {name!r}", number="M106", word=name, known=[b.name for b in self.bodies])


def normal_forces(mechanism: Mechanism) -> dict[str, ContactRow]:
    """Return the rows that keep rolling wheels on what they roll on, by name: a negative multiplier pulls."""
    rows = [row for row in mechanism.rows if isinstance(row, ContactRow) and row.is_holonomic]
    return {row.name: row for row in rows if row.name not in mechanism._one_way_paths}
