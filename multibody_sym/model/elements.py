"""The elements a model is declared with: bodies, joints, forces, constraints. Their fields are the keys of the file."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from multibody_sym.errors import ModelError, at
from multibody_sym.expressions.parser import parse_scalar
from multibody_sym.expressions.printer import text
from multibody_sym.expressions.units import DIMENSIONLESS, Dimension, parse_unit
from multibody_sym.model.slots import (
    Choice,
    Direction,
    Element,
    Flag,
    ListOf,
    MapOf,
    OneOf,
    Record,
    Scalar,
    ScalarOrVector,
    Scalars,
    Text,
    Vector,
    described,
    fields_tree,
    from_fields,
    holds,
    is_text,
    scalar,
)
from multibody_sym.scalars.node import Node

Point = tuple[Node, Node, Node]


# --- parameters ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class DimensionSlot:
    """The dimension of a parameter, written as a unit that has it, such as `N*m` or `rad`."""

    def accept(self, value: Any) -> Dimension:
        return value if isinstance(value, Dimension) else parse_unit(Text().accept(value))[1]

    def tree(self, value: Dimension) -> str:
        return "rad" if value == DIMENSIONLESS else str(value)


@dataclass(frozen=True)
class Parameter(Element):
    """A named number: its value (SI) or an expression of others, its dimension where stated, its sign where known."""

    value: Node = holds(Scalar())
    dimension: Dimension | None = holds(DimensionSlot(), None)
    positive: bool = holds(Flag(), False)
    label: str | None = holds(Text(), None)


@dataclass(frozen=True)
class ParameterSlot:
    """A parameter: a number, `1 kg`, an expression of others, or the long form with `value`, `positive`, `label`."""

    def accept(self, value: Any) -> Parameter:
        if isinstance(value, Parameter):
            return value
        if not isinstance(value, Mapping):
            return _parameter({"value": value})
        if value.get("value") is None or is_text(value["value"], ""):
            raise ModelError("a parameter needs a sample value: write value: and a number")
        return _parameter(value)

    def tree(self, value: Parameter) -> Any:
        tree = fields_tree(value)
        if value.dimension is not None and _DECIMAL.fullmatch(tree["value"]):
            tree["value"] = f"{tree['value']} {tree.pop('dimension')}"
        return tree["value"] if set(tree) == {"value"} else tree


_DECIMAL: Final = re.compile(r"-?[0-9]+(\.[0-9]+)?")


def _parameter(tree: Mapping[str, Any]) -> Parameter:
    content, value = dict(tree), tree["value"]
    if value is None or is_text(value, ""):
        raise ModelError("a parameter needs a sample value")
    if isinstance(value, str):
        content["value"], dimension = parse_scalar(value)
        if dimension is not None:
            content.setdefault("dimension", dimension)
    parameter = from_fields(Parameter, content)
    assert isinstance(parameter, Parameter)
    return parameter


# --- bodies --------------------------------------------------------------------------------------------------------

_INERTIA: Final = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")


@dataclass(frozen=True)
class InertiaSlot:
    """Tensor elements Ixx .. Iyz about the centre of mass in body axes (Ixy = -integral of x y dm); held as six."""

    unit: str = "kg*m^2"
    keys: tuple[str, ...] = _INERTIA

    def accept(self, value: Any) -> tuple[Node, ...]:
        if isinstance(value, (list, tuple)) and len(value) == 6:
            return tuple(scalar(x, self.unit) for x in value)
        if not isinstance(value, Mapping):
            raise ModelError(f"expected a map of {', '.join(_INERTIA)}, got {described(value)}")
        for key in value:
            if key not in _INERTIA:
                raise ModelError(f"unknown key {key!r}; known: {', '.join(_INERTIA)}")
        elements = []
        for key in _INERTIA:
            with at(key):
                elements.append(scalar(value.get(key, 0), self.unit))
        return tuple(elements)

    def tree(self, value: tuple[Node, ...]) -> dict[str, str]:
        return {key: text(x) for key, x in zip(_INERTIA, value, strict=True) if x.shadow != 0}


SHAPES: Final[Mapping[str, tuple[str, ...]]] = {
    "rod": ("length",),
    "disc": ("radius",),
    "ring": ("radius",),
    "cylinder": ("radius", "length"),
    "sphere": ("radius",),
    "shell": ("radius",),
    "box": ("x", "y", "z"),
}
"""The shapes and their sizes. A rod lies along x from the body's origin; the others have their centre there, axis z."""


@dataclass(frozen=True)
class Shape(Element):
    """A homogeneous body of a standard shape: its kind, its sizes in the order of `SHAPES`, its mass."""

    kind: str = holds(Choice(tuple(SHAPES)))
    sizes: tuple[Node, ...] = holds(Scalars("m"))
    mass: Node = holds(Scalar("kg"))

    def verify(self) -> None:
        wanted = SHAPES[self.kind]
        if len(self.sizes) != len(wanted):
            raise ModelError(f"a {self.kind} needs {', '.join(wanted)}, got {len(self.sizes)} numbers")

    def written(self) -> Iterator[tuple[tuple[str, ...], Any, str | None]]:
        yield (self.kind,), self.sizes[0] if len(self.sizes) == 1 else self.sizes, "m"
        yield ("mass",), self.mass, "kg"


@dataclass(frozen=True)
class ShapeSlot:
    """A shape, written `{rod: l, mass: m}` or `{cylinder: [r, l], mass: m}`."""

    def accept(self, value: Any) -> Shape:
        if isinstance(value, Shape):
            return value
        if not isinstance(value, Mapping):
            raise ModelError(f"expected a map such as {{rod: l, mass: m}}, got {described(value)}")
        kinds = [key for key in value if key != "mass"]
        if len(kinds) != 1 or kinds[0] not in SHAPES:
            raise ModelError(f"expected one of {', '.join(SHAPES)} and a mass, got {', '.join(map(str, value))}")
        if "mass" not in value:
            raise ModelError("the shape's mass is missing")
        with at(kinds[0]):
            sizes = Scalars("m").accept(value[kinds[0]])
        return Shape(kinds[0], sizes, value["mass"])

    def tree(self, value: Shape) -> dict[str, Any]:
        return {value.kind: Scalars().tree(value.sizes), "mass": text(value.mass)}


@dataclass(frozen=True)
class Turn(Element):
    """A rotation by `angle` about `axis`."""

    axis: Point = holds(Direction())
    angle: Node = holds(Scalar(""))


@dataclass(frozen=True)
class Frame(Element):
    """A named position and orientation on a body: turns in order, each about the axes the ones before have turned."""

    position: Point = holds(Vector("m"), (0, 0, 0))
    rotate: tuple[Turn, ...] = holds(ListOf(Record(Turn)), ())


@dataclass(frozen=True)
class GroundMotion(Element):
    """How ground moves in inertial space: its origin at (x, y, z), then turned (expressions of t and parameters).

    Turns come in order, each about the axes that the ones before have turned. Gravity does not turn with ground: it
    keeps its direction in inertial space.
    """

    x: Node = holds(Scalar("m"), 0)
    y: Node = holds(Scalar("m"), 0)
    z: Node = holds(Scalar("m"), 0)
    turn: tuple[Turn, ...] = holds(ListOf(Record(Turn)), ())


@dataclass(frozen=True, kw_only=True)
class Surface(Element):
    """A surface of a body: a ball, the sharp rim of a disc about `axis`, or a plane through a place with a `normal`.

    Balls and discs have their centre at `centre`; everything in body axes.
    """

    sphere: Node | None = holds(Scalar("m"), None)
    disc: Node | None = holds(Scalar("m"), None)
    axis: Point = holds(Direction(), "z")
    centre: Point = holds(Vector("m"), (0, 0, 0))
    plane: Point | None = holds(Vector("m"), None)
    normal: Point = holds(Direction(), "z")

    def verify(self) -> None:
        if sum(x is not None for x in (self.sphere, self.disc, self.plane)) != 1:
            raise ModelError("a surface is one of sphere: radius, disc: radius, plane: [x, y, z]")


@dataclass(frozen=True)
class Body(Element):
    """A rigid body, or a particle at `com` where no inertia is given.

    `com` and `points` are in body axes from the body's origin; the inertia is about the centre of mass in body axes.
    A `shape` gives mass, com and inertia instead. `motion` is for the body called ground alone: a lift, a shaker, a
    turntable. World axes are the inertial ones, in which gravity is given and which ground leaves when it moves.
    """

    mass: Node | None = holds(Scalar("kg"), None)
    com: Point | None = holds(Vector("m"), None)
    inertia: tuple[Node, ...] | None = holds(InertiaSlot(), None)
    shape: Shape | None = holds(ShapeSlot(), None)
    points: Mapping[str, Point] = holds(MapOf(Vector("m")), None)
    frames: Mapping[str, Frame] = holds(MapOf(Record(Frame)), None)
    motion: GroundMotion | None = holds(Record(GroundMotion), None)
    surfaces: Mapping[str, Surface] = holds(MapOf(Record(Surface)), None)
    label: str | None = holds(Text(), None)

    def __post_init__(self) -> None:
        for name in ("points", "frames", "surfaces"):
            if getattr(self, name) is None:
                object.__setattr__(self, name, {})
        super().__post_init__()

    def verify(self) -> None:
        if self.shape is not None and (self.mass is not None or self.inertia is not None):
            raise ModelError("a shape gives the mass and inertia: leave out mass and inertia, or the shape")
        for name in self.points:
            if name in self.frames:
                raise ModelError(f"{name!r} is both a point and a frame")


# --- forces --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Force(Element):
    """A force with components along the axes of `frame` (a body, default ground), acting at a point of a body.

    Without `at` it acts at the centre of mass.
    """

    on: str = holds(Text())
    value: Point = holds(Vector("N"))
    at: str | None = holds(Text(), None)
    frame: str = holds(Text(), "ground")


@dataclass(frozen=True)
class Torque(Element):
    """A torque: `value` (one number) about the freedom of a joint, on its child and back on its parent; or on a body.

    A joint with several freedoms takes it (or a force, along a translation) at the one that `freedom` names by its
    coordinate or speed. On a body `value` has three components along the axes of `frame` (a body, default ground).
    """

    value: Node | Point = holds(ScalarOrVector("N*m"))
    joint: str | None = holds(Text(), None)
    freedom: str | None = holds(Text(), None)
    on: str | None = holds(Text(), None)
    frame: str = holds(Text(), "ground")

    def verify(self) -> None:
        if (self.joint is None) == (self.on is None):
            raise ModelError("a torque acts either in a joint (joint:) or on a body (on:)")
        _freedom_of_joint(self.freedom, self.joint)
        if (self.joint is None) == isinstance(self.value, Node):
            raise ModelError("a joint's torque is one number, a body's torque a list of three")


@dataclass(frozen=True)
class SpringDamper(Element):
    """F = stiffness (length - l0) + damping d(length)/dt, pulling two points together, or acting in a joint.

    In a joint the coordinate of its freedom stands for the length and `length` for the unloaded coordinate; `freedom`
    names the coordinate where there are several.
    """

    stiffness: Node = holds(Scalar())
    between: tuple[str, ...] | None = holds(ListOf(Text(), 2, 2), None)
    joint: str | None = holds(Text(), None)
    freedom: str | None = holds(Text(), None)
    damping: Node = holds(Scalar(), 0)
    length: Node = holds(Scalar(), 0)

    def verify(self) -> None:
        _one_place(self.between, self.joint)
        _freedom_of_joint(self.freedom, self.joint)


@dataclass(frozen=True)
class Damper(Element):
    """F = damping d(length)/dt between two points, or against the speed of a joint's freedom."""

    damping: Node = holds(Scalar())
    between: tuple[str, ...] | None = holds(ListOf(Text(), 2, 2), None)
    joint: str | None = holds(Text(), None)
    freedom: str | None = holds(Text(), None)

    def verify(self) -> None:
        _one_place(self.between, self.joint)
        _freedom_of_joint(self.freedom, self.joint)


@dataclass(frozen=True)
class Pull(Element):
    """A force that pulls two points together, by any law: `value` may name their `distance` and `distance_rate`.

    All it does counts as work, none as potential energy.
    """

    between: tuple[str, ...] = holds(ListOf(Text(), 2, 2))
    value: Node = holds(Scalar("N"))


@dataclass(frozen=True)
class Drag(Element):
    """F = -(linear + quadratic |v|) v at a point of a body, v its velocity in inertial space.

    Without `at` it acts at the centre of mass.
    """

    on: str = holds(Text())
    at: str | None = holds(Text(), None)
    linear: Node = holds(Scalar("kg/s"), 0)
    quadratic: Node = holds(Scalar("kg/m"), 0)


@dataclass(frozen=True)
class Motor(Element):
    """A direct-current motor in a joint: torque = gear constant (voltage - constant gear u) / resistance.

    `constant` is that of the torque (N m/A) and of the induced voltage (V s/rad); the motor turns `gear` times as fast
    as the joint, whose speed is u. Its inductance and own inertia are left out.
    """

    joint: str = holds(Text())
    voltage: Node = holds(Scalar(), keyword=True)
    resistance: Node = holds(Scalar(), keyword=True)
    constant: Node = holds(Scalar(), keyword=True)
    gear: Node = holds(Scalar(), 1, keyword=True)
    freedom: str | None = holds(Text(), None, keyword=True)


def _freedom_of_joint(freedom: object, joint: object) -> None:
    if freedom is not None and joint is None:
        raise ModelError("freedom goes with joint").under("freedom")


def _one_place(between: object, joint: object) -> None:
    if (between is None) == (joint is None):
        raise ModelError("it acts either between two points (between: [a, b]) or in a joint (joint:)")


# --- constraints ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Pulley(Element):
    """A massless, frictionless pulley at a point; without a radius the rope bends at the point itself.

    With a radius the rope lies in the plane normal to `axis` (of the body that carries it) and wraps the side on
    which the pulley's centre is inside the bend.
    """

    at: str = holds(Text())
    radius: Node = holds(Scalar("m"), 0)
    axis: Point = holds(Direction(), "z")


# --- questions and settings ----------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Ask(Element):
    """A question that `solve` answers.

    `value`: an expression at the given instant; `of` and `after`: the path of a body in a time; `when`: the time at
    which a coordinate reaches a value; `of` and `at`: the speed of a body when it does.
    """

    value: Node | None = holds(Scalar(), None)
    of: str | None = holds(Text(), None)
    after: Node | None = holds(Scalar("s"), None)
    when: Mapping[str, Node] | None = holds(MapOf(Scalar()), None)
    at: Mapping[str, Node] | None = holds(MapOf(Scalar()), None)

    def verify(self) -> None:
        given = tuple(name for name in ("value", "of", "after", "when", "at") if getattr(self, name) is not None)
        if given not in (("value",), ("of", "after"), ("when",), ("of", "at")):
            forms = "{of: body, after: time}, {coordinate: value} or {of: body, at: {coordinate: value}}"
            raise ModelError(f"ask with an expression, {forms}")
        for condition in (self.when, self.at):
            if condition is not None and len(condition) != 1:
                raise ModelError("name one coordinate and its value, such as {x: 2 m}")


@dataclass(frozen=True)
class AskSlot:
    """A question, written as an expression, `{of: block, after: 4 s}`, `{x: 2 m}` or `{of: block, at: {x: 2 m}}`."""

    def accept(self, value: Any) -> Ask:
        if isinstance(value, Ask):
            return value
        if not isinstance(value, Mapping):
            return Ask(value=value)
        if "of" in value:
            return Ask(**_known(value, ("of", "after", "at")))
        return Ask(when=value)

    def tree(self, value: Ask) -> Any:
        if value.value is not None:
            return text(value.value)
        if value.when is not None:
            return MapOf(Scalar()).tree(value.when)
        answer: dict[str, Any] = {"of": value.of}
        if value.after is not None:
            answer["after"] = text(value.after)
        if value.at is not None:
            answer["at"] = MapOf(Scalar()).tree(value.at)
        return answer


def _known(value: Mapping[str, Any], keys: tuple[str, ...]) -> dict[str, Any]:
    for key in value:
        if key not in keys:
            with at(key):
                raise ModelError(f"unknown key {key!r}; known: {', '.join(keys)}")
    return dict(value)


@dataclass(frozen=True)
class Baumgarte(Element):
    """Baumgarte's stabilisation: gamma - 2 alpha phidot - beta^2 phi; without alpha it is chosen from the step."""

    alpha: Node | None = holds(Scalar("1/s"), None)
    beta: Node | None = holds(Scalar("1/s"), None)


@dataclass(frozen=True, kw_only=True)
class Stabilisation(Element):
    """How constraints are kept: `projection` after each step, `baumgarte`, or `index_2`, as part of the equations."""

    baumgarte: Baumgarte | None = holds(Record(Baumgarte), None)
    projection: bool | None = holds(Flag(), None)
    index_2: bool | None = holds(Flag(), None)

    def verify(self) -> None:
        chosen = {"baumgarte": self.baumgarte is not None, "projection": self.projection, "index_2": self.index_2}
        if sum(map(bool, chosen.values())) > 1:
            names = [name for name, asked in chosen.items() if asked]
            raise ModelError(f"choose {' or '.join(names)}, not {'both' if len(names) == 2 else 'all of them'}")


MULTIPLIERS: Final = ("basic", "minimum_norm")
"""Those of redundant rows are zero; or those of all rows, times the rows' lengths, have the least norm."""
COORDINATES: Final = ("relative", "absolute")


@dataclass(frozen=True, kw_only=True)
class Settings(Element):
    """How a system is simulated, unless the call says otherwise.

    `coordinates` are those of joints from body to body, or of each body, which every joint restricts.
    `project` lets every start value change, known ones too, as little as constraints need.
    `multipliers` says which are taken where rows are redundant and others serve equally well.
    """

    t_end: Node = holds(Scalar("s"), 10)
    step: Node | None = holds(Scalar("s"), None)
    rtol: Node | None = holds(Scalar(""), None)
    atol: Node | None = holds(Scalar(""), None)
    method: str = holds(Text(), "dormand_prince")
    samples: Node = holds(Scalar(""), 1001)
    coordinates: str = holds(Choice(COORDINATES), COORDINATES[0])
    constraints: Stabilisation | None = holds(Record(Stabilisation), None)
    project: bool = holds(Flag(), False)
    multipliers: str = holds(Choice(MULTIPLIERS), MULTIPLIERS[0])


FORCES: Final = OneOf(
    {
        "force": Force,
        "torque": Torque,
        "spring_damper": SpringDamper,
        "damper": Damper,
        "pull": Pull,
        "drag": Drag,
        "motor": Motor,
    },
    {"spring": "spring_damper"},
)
