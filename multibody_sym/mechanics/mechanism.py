"""What is a Mechanism: bodies in tree order, coordinates, loads and rows, as they follow from a System alone.

Every expression in it is written in slots: `t[0]`, `q[i]`, `u[i]`, `parameters[i]`, `inputs[i]`. Names stay in tables.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field
from enum import Enum
from functools import cached_property, wraps
from typing import ClassVar, Final, TypeVar

from multibody_sym.errors import ModelError, Where
from multibody_sym.mechanics.law_elements import LawElement, Mode, StruckImpacts
from multibody_sym.mechanics.load_records import Load
from multibody_sym.mechanics.row_records import AngleRow, CutJoint, Marker, PositionRow, Row
from multibody_sym.model.bodies import GROUND, Mass, Pose
from multibody_sym.model.fields import Point
from multibody_sym.model.state_words import StateCondition
from multibody_sym.model.steps import FreeStep, Step, free_steps
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.node import ZERO, Node, as_node, slot, symbol
from multibody_sym.text.units import Dimension, rate_unit

# ----------------------------------------------------------------------------------------------------------------------
# Constants of a run that its start measures, in the parameter vector beside the declared parameters.


@dataclass(frozen=True)
class RopeSide:
    """On which side of a wheel a rope runs: 1 where it turns to the left about its axis, -1 to the right.

    The centre is inside the bend; 0 where the rope runs straight back, or its neighbours are in line with the centre.
    """

    rope: str
    pulley: str
    unit: ClassVar[str] = "1"


@dataclass(frozen=True)
class RopeLength:
    """How long the path of a rope is, for ropes that declare no length; `row` is the name of its row.

    Where it `winds` on wheels, whose turning counts to it, it may be of either sign.
    """

    row: str
    winds: bool = False
    unit: ClassVar[str] = "m"


@dataclass(frozen=True)
class TangentDirection:
    """The angle from the grip's `across` at which a rope leaves a wheel, at the end (0 or 1) of the row's path."""

    row: str
    end: int
    unit: ClassVar[str] = "rad"


@dataclass(frozen=True)
class WrapAngle:
    """Around how much of a rough wheel a rope lies, full turns included; `row` is that of its slip."""

    row: str
    unit: ClassVar[str] = "rad"


@dataclass(frozen=True)
class TangentAngle:
    """By how much the tangent t1 of a plane on a body that turns leads `across` about `normal` (plane's body's axes).

    At the start t1 is ground's x as far as it lies in the plane, or its y where x is normal to the plane; then the body
    carries it along. Both vectors are of length one and normal to each other.
    """

    plane: Marker
    normal: Point
    across: Point
    unit: ClassVar[str] = "rad"


Measure = RopeSide | RopeLength | TangentDirection | WrapAngle | TangentAngle


# ----------------------------------------------------------------------------------------------------------------------
# The parameter vector by name: what the model declares, the start measures, a run chooses; numbers of many bodies.


ARRAY: Final = "parameters"
INDEPENDENT: Final = "most independent rows"
"""How many rows are independent anywhere: all of them, unless the start finds fewer."""
ALPHA, BETA = "Baumgarte alpha", "Baumgarte beta"


class Source(Enum):
    """Who gives a parameter its value."""

    DECLARED = "the model"
    MEASURED = "the start"
    CHOSEN = "the run"
    LITERAL = "a number in the model"


@dataclass(frozen=True)
class ParameterEntry:
    """An entry of the parameter vector; `value` is an expression of entries before it, None if there is no default.

    `measure` is that of the start; `dimension` is None where no unit was given.
    """

    name: str
    value: Node | None
    positive: bool = False
    source: Source = Source.DECLARED
    measure: Measure | None = None
    dimension: Dimension | None = None


@dataclass(frozen=True)
class ParameterVector:
    """The entries in their order. Those with a blank in their name are not declared: no model can name them."""

    entries: tuple[ParameterEntry, ...]

    def __iter__(self) -> Iterator[ParameterEntry]:
        return iter(self.entries)

    def __len__(self) -> int:
        return len(self.entries)

    def __getitem__(self, place: int) -> ParameterEntry:
        return self.entries[place]

    @cached_property
    def places(self) -> Mapping[str, int]:
        """The place of each entry by its name."""
        return {entry.name: place for place, entry in enumerate(self.entries)}

    def places_from(self, *sources: Source) -> list[int]:
        """Return the places of the entries whose values come from some of the sources."""
        return [place for place, entry in enumerate(self.entries) if entry.source in sources]

    def slot(self, name: str) -> Node:
        """Return the leaf that stands for an entry in expressions."""
        return slot(ARRAY, self.places[name])

    def value(self, values: Sequence[float], name: str) -> float:
        """Return an entry of the vector `values` (np)."""
        return float(values[self.places[name]])

    def with_measured(self, measures: Mapping[str, Measure]) -> ParameterVector:
        """Return the vector with the constants that the start measures, by the names of their constraints."""
        added = []
        for name, what in measures.items():
            positive = isinstance(what, RopeLength) and not what.winds
            added.append(ParameterEntry(measured_name(name, what), None, positive, Source.MEASURED, what))
        return ParameterVector((*self.entries, *added))

    @property
    def constants(self) -> list[Node]:
        """The values of the constant part, which is the last of the vector."""
        return [entry.value for entry in self.entries if entry.source is Source.LITERAL and entry.value is not None]

    def with_constants(self, values: Mapping[str, Node]) -> ParameterVector:
        """Return the vector with a constant part: numbers that the model writes and never names, last of all."""
        added = (ParameterEntry(name, value, source=Source.LITERAL) for name, value in values.items())
        return ParameterVector((*self.entries, *added))

    def with_rows(self, count: int) -> ParameterVector:
        """Return the vector with the entries that a run chooses for rows, if there are any."""
        if not count:
            return self
        independent = ParameterEntry(INDEPENDENT, as_node(count), source=Source.CHOSEN)
        if INDEPENDENT in self.places:
            return ParameterVector(tuple(independent if e.name == INDEPENDENT else e for e in self.entries))
        coefficients = (ParameterEntry(name, None, source=Source.CHOSEN) for name in (ALPHA, BETA))
        return ParameterVector((*self.entries, independent, *coefficients))

    def independent_rows(self, values: Sequence[float]) -> int:
        """Return how many rows are independent anywhere, by the vector `values` (np); 0 where there are no rows."""
        return int(self.value(values, INDEPENDENT)) if INDEPENDENT in self.places else 0

    def changed(self, values: Sequence[float], new: Mapping[str, float]) -> list[float]:
        """Return the vector `values` (np) with `new` values of some entries."""
        found = list(values)
        for name, value in new.items():
            found[self.places[name]] = value
        return found


def measured_name(name: str, measure: Measure) -> str:
    """Return the name of the entry for a constant that the start measures of a constraint, or of a part of one."""
    if isinstance(measure, RopeLength):
        return f"length of {name}"
    if isinstance(measure, RopeSide):
        return f"side of {name}"
    return f"angle of {name}.t1" if isinstance(measure, TangentAngle) else f"angle of {name}"


# ----------------------------------------------------------------------------------------------------------------------

TIME: Final = slot("t", 0)
NORMAL: Final = "normal"
"""One more component of the reaction of a joint that guides along a curve: the force across it."""


@dataclass(frozen=True)
class Coordinate:
    """A coordinate: its name, joint, unit and initial value (an expression of parameters).

    It is `known` where it is given and marked so. A declared state is a coordinate without joint and speed, but with a
    `rate` of its own; its unit is empty where none is known.
    """

    name: str
    joint: str
    unit: str
    initial: Node
    given: bool
    known: bool
    rate: Node | None = None

    @property
    def path(self) -> tuple[str, ...]:
        """Where the model declares it: its joint, or the state."""
        return ("joints", self.joint) if self.rate is None else ("states", self.name)


@dataclass(frozen=True)
class Speed:
    """A speed, as a coordinate; it is `known` where it is given and its coordinate is marked so."""

    name: str
    joint: str
    unit: str
    initial: Node
    given: bool
    known: bool

    @property
    def path(self) -> tuple[str, ...]:
        """Where the model declares it: its joint."""
        return ("joints", self.joint)


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
        """For each step, if it is prescribed, its place, rate and second derivative."""
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
        """Whether a prescribed step, or its guide, moves, so that its drive does work."""
        return any(step.drifts for step in self.steps) or any(g is not None and g[1] is not ZERO for g in self.given)


def double_name(child: str, joint: str) -> str:
    """Return the name of the massless double of a joint's child."""
    return f"double of {child} at {joint}"


@dataclass(frozen=True)
class Withheld:
    """The `components` of a joint's reaction that are not determined, `because` of which constraints (name, kind)."""

    components: tuple[str, ...]
    because: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Mechanism:
    """A system resolved: bodies in tree order (parents first), coordinates, speeds, parameters, inputs, loads, rows.

    Behind the coordinates of the joints, in the same order as in the model, stand the declared states.

    `symbols` gives the slot or the measured expression of each name in expressions, first of rates such as `phi'`;
    `markers` every named point and frame. `stops` are functions that become
    positive where the run ends, `kinks` functions at whose zeros forces or inputs bend or jump, `fades` those at whose
    zeros they become as good as constant. In absolute coordinates `relative` is the same system in those of its
    joints, in which its start is declared. `minimum_norm`: where rows are redundant, multipliers of least norm are
    asked for. `withheld`: by joint, reactions that are not determined; `untold` outputs name one of them and are not
    among `outputs`. `run_outputs` name work or impulses, which add up along a run, and are not among `outputs` either.
    `driving_inputs` are those that motions and constraints name, where their expressions stand; `input_dimensions` are
    stated ones. Rows of `one_way` elements are among `rows` only in a `mode` (`in_mode`), in which the speeds at the
    places `held` stay zero. With `mode_numbers` all rows are there, and numbers of these names say which act
    (`in_every_mode`). `state_stops` end the run where an element enters a state. `impact` strikes at the start.
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
    one_way: tuple[LawElement, ...] = ()
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

    @cached_property
    def rates(self) -> tuple[Node, ...]:
        """The rates of the declared states, which are the last of the coordinates."""
        return tuple(c.rate for c in self.coordinates if c.rate is not None)

    @property
    def rate_units(self) -> dict[str, str]:
        """The units of the rates of all speeds and declared states, by their names."""
        states = {c.name: rate_unit(c.unit) for c in self.coordinates if c.rate is not None}
        return {**{speed.name: f"{speed.unit}^2" for speed in self.speeds}, **states}

    @property
    def drives(self) -> tuple[str, ...]:
        """The joints (and ground) that move as prescribed, and so do work on the system."""
        return tuple(body.joint_name for body in self.bodies if body.driven)

    @property
    def bears_nothing(self) -> bool:
        """Whether nothing has mass and no force is declared: only drives and constraints could exert forces."""
        masses = (x for body in self.bodies for x in (body.mass.mass, *body.mass.inertia))
        return not self.loads and all(x is ZERO for x in masses)

    def speed_place(self, name: str) -> int | None:
        """Return the place of a speed, or of a coordinate's rate; None for those that are measured."""
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

    @property
    def doubles(self) -> dict[str, int]:
        """The joints whose coordinates massless doubles keep, each with the number of its speeds and their rows."""
        return {body.joint_name: len(body.u) for body in self.bodies if body.is_double}

    @cached_property
    def _one_way_paths(self) -> Mapping[str, tuple[str, str]]:
        """Where each row of an element with a law is declared, by the row's name."""
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


def verify_without_states(mechanism: Mechanism, why: str) -> None:
    """Raise ModelError at the first declared state; `why` says what has no place for it, and what has."""
    for coordinate in mechanism.coordinates:
        if coordinate.rate is not None:
            where = Where(path=coordinate.path)
            raise ModelError(f"{coordinate.name!r} is a state beside the motion: {why}", where=where, number="M120")


def normal_forces(mechanism: Mechanism) -> dict[str, Row]:
    """Return the rows that keep rolling wheels on their track, by name: a negative multiplier pulls."""
    rows = [row for row in mechanism.rows if row.surfaces and row.is_holonomic]
    return {row.name: row for row in rows if row.name not in mechanism._one_way_paths}


# ----------------------------------------------------------------------------------------------------------------------
# What depends on a mechanism alone, found once as long as it lives.

Found = TypeVar("Found")


def once(find: Callable[[Mechanism], Found]) -> Callable[[Mechanism], Found]:
    """Return a function that keeps its result for each mechanism, by identity; nothing may change the result."""
    known: dict[int, Found] = {}

    @wraps(find)
    def found(mechanism: Mechanism) -> Found:
        key = id(mechanism)
        if key not in known:
            known[key] = find(mechanism)
            weakref.finalize(mechanism, known.pop, key, None)
        return known[key]

    return found
