"""Bodies as they are declared: mass, inertia or a standard shape, points, frames, surfaces; ground's motion."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Final, cast

from multibody_sym.errors import ModelError, at
from multibody_sym.expressions.printer import text
from multibody_sym.model.declaration.fields import (
    Element,
    ListOf,
    MapOf,
    Record,
    fields_tree,
    from_fields,
    holds,
    verify_keys,
)
from multibody_sym.model.declaration.surfaces import Surface
from multibody_sym.model.declaration.values import (
    Choice,
    Direction,
    Point,
    Scalar,
    Scalars,
    Text,
    Vector,
    described,
    scalar,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node

_INERTIA: Final = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")


@dataclass(frozen=True)
class InertiaField:
    """Tensor elements Ixx .. Iyz about the centre of mass in body axes (Ixy = -integral of x y dm); held as six."""

    unit: str = "kg*m^2"
    keys: tuple[str, ...] = _INERTIA

    def accept(self, value: Any) -> tuple[Node, ...]:
        if isinstance(value, (list, tuple)) and len(value) == 6:
            return tuple(scalar(x, self.unit) for x in value)
        if not isinstance(value, Mapping):
            raise ModelError(f"expected a map of {', '.join(_INERTIA)}, got {described(value)}", number="M103")
        verify_keys(value, _INERTIA, {"Iyx": "Ixy", "Izx": "Ixz", "Izy": "Iyz", "I": "Izz"})
        elements = []
        for key in _INERTIA:
            with at(key):
                elements.append(scalar(value.get(key, 0), self.unit))
        return tuple(elements)

    def tree(self, value: tuple[Node, ...]) -> dict[str, str]:
        return {key: text(x) for key, x in zip(_INERTIA, value, strict=True) if x.shadow != 0}


@dataclass(frozen=True)
class VariableMass(Element):
    """A mass that varies (Meshchersky): its `value` names the time or coordinates, and what leaves or joins moves.

    Either `relative_velocity`, that of what leaves or joins relative to the body where it does so, along the axes of
    `frame` (a body, or a frame of one; by default the body itself); or `absolute_velocity`, that relative to inertial
    space (axes of ground by default). Without `at` every particle leaves or joins where the declared mass, `com` and
    inertia lose or gain it. `at` a point of the body all of it passes there; what is lost elsewhere has flowed there
    through the body, without swirl: Coriolis forces and jet damping follow from the rates of mass, `com` and inertia.
    """

    meant: ClassVar[Mapping[str, str]] = {
        "mass": "value",
        "velocity": "write relative_velocity (to the body) or absolute_velocity (to inertial space)",
    }

    value: Node = holds(Scalar("kg"), says="the mass as an expression of t or coordinates", such="m0 - b*t")
    relative_velocity: Point | None = holds(
        Vector("m/s"), None, such="[0, -w, 0]",
        says="velocity of what leaves or joins, relative to the body there; along the axes of frame",
    )
    absolute_velocity: Point | None = holds(
        Vector("m/s"), None, says="velocity of what leaves or joins, relative to inertial space", such="[0, 0, 0]"
    )
    frame: str | None = holds(
        Text(), None, such="ground",
        says="the body, or frame of one, along whose axes the velocity is; if left out the body itself, or ground",
    )
    at: str | None = holds(
        Text(), None, says="the point of the body where all mass leaves or joins", such="rocket.nozzle"
    )

    def verify(self) -> None:
        if (self.relative_velocity is None) == (self.absolute_velocity is None):
            raise ModelError(
                "a mass that varies says how what leaves or joins moves: either relative_velocity (to the body; "
                "[0, 0, 0] where it only drops off) or absolute_velocity ([0, 0, 0] for what lies at rest)",
                number="M110",
            )


@dataclass(frozen=True)
class MassField:
    """A mass: one number or expression, or a map that tells how it varies."""

    unit: str = "kg"

    def accept(self, value: Any) -> Node | VariableMass:
        if isinstance(value, VariableMass):
            return value
        if isinstance(value, Mapping):
            return cast(VariableMass, from_fields(VariableMass, value))
        return scalar(value, self.unit)

    def tree(self, value: Node | VariableMass) -> Any:
        return fields_tree(value) if isinstance(value, VariableMass) else text(value)


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

    kind: str = holds(Choice(tuple(SHAPES)), says="which shape it is; in a file it is the key itself", such="rod")
    sizes: tuple[Node, ...] = holds(
        Scalars("m"), says="its sizes in order: a length, a radius, radius and length, or three edges", such="[r, l]"
    )
    mass: Node | VariableMass = holds(MassField(), says="the mass of the shape", such="2 kg")

    def verify(self) -> None:
        wanted = SHAPES[self.kind]
        if len(self.sizes) != len(wanted):
            sizes = f"[{', '.join(wanted)}]" if wanted[1:] else wanted[0]
            raise ModelError(f"a {self.kind} has {len(wanted)} sizes, got {len(self.sizes)}: {self.kind}: {sizes}",
                             number="M110")

    def written(self) -> Iterator[tuple[tuple[str, ...], Any, str | None]]:
        yield (self.kind,), self.sizes[0] if len(self.sizes) == 1 else self.sizes, "m"
        yield ("mass",), self.mass, "kg"


@dataclass(frozen=True)
class ShapeField:
    """A shape, written `{rod: l, mass: m}` or `{cylinder: [r, l], mass: m}`."""

    def accept(self, value: Any) -> Shape:
        if isinstance(value, Shape):
            return value
        if not isinstance(value, Mapping):
            raise ModelError(f"expected a map such as {{rod: l, mass: m}}, got {described(value)}", number="M103")
        verify_keys(value, (*SHAPES, "mass"))
        kinds = [key for key in value if key != "mass"]
        if len(kinds) != 1:
            raise ModelError(
                f"expected one of {', '.join(SHAPES)} and a mass, got {', '.join(map(str, value))}", number="M103"
            )
        if "mass" not in value:
            raise ModelError("the shape's mass is missing", number="M102")
        with at(kinds[0]):
            sizes = Scalars("m").accept(value[kinds[0]])
        return Shape(kinds[0], sizes, value["mass"])

    def tree(self, value: Shape) -> dict[str, Any]:
        return {value.kind: Scalars().tree(value.sizes), "mass": MassField().tree(value.mass)}


@dataclass(frozen=True)
class Turn(Element):
    """A rotation by `angle` about `axis`."""

    axis: Point = holds(Direction(), says="the axis about which it turns", such="z")
    angle: Node = holds(Scalar(""), says="by how much it turns, counter-clockwise about the axis", such="30 deg")


@dataclass(frozen=True)
class Frame(Element):
    """A named position and orientation on a body: turns in order, each about the axes the ones before have turned."""

    position: Point = holds(
        Vector("m"), (0, 0, 0), says="where the frame is, in body axes from the body's origin", such="[l, 0, 0]"
    )
    rotate: tuple[Turn, ...] = holds(
        ListOf(Record(Turn)), (), such="[{axis: z, angle: 30 deg}]",
        says="turns that lead to its orientation, each about axes that the ones before have turned",
    )


@dataclass(frozen=True)
class GroundMotion(Element):
    """How ground moves in inertial space: its origin at (x, y, z), then turned (expressions of t and parameters).

    Turns come in order, each about the axes that the ones before have turned. Gravity does not turn with ground: it
    keeps its direction in inertial space.
    """

    x: Node = holds(Scalar("m"), 0, says="how far ground's origin moves along x in inertial space", such="A*sin(w*t)")
    y: Node = holds(Scalar("m"), 0, says="how far ground's origin moves along y in inertial space", such="A*sin(w*t)")
    z: Node = holds(Scalar("m"), 0, says="how far ground's origin moves along z in inertial space", such="A*sin(w*t)")
    turn: tuple[Turn, ...] = holds(
        ListOf(Record(Turn)), (), such="[{axis: z, angle: W*t}]",
        says="how ground turns, each turn about axes that the ones before have turned",
    )


@dataclass(frozen=True)
class Body(Element):
    """A rigid body, or a particle at `com` where no inertia is given.

    `com` and `points` are in body axes from the body's origin; the inertia is about the centre of mass in body axes.
    A `shape` gives mass, com and inertia instead. `motion` is for the body called ground alone: a lift, a shaker, a
    turntable. A mass that varies is a `VariableMass`, and com, inertia and sizes vary only with it. World
    axes are the inertial ones, in which gravity is given and which ground leaves when it moves.
    """

    mass: Node | VariableMass | None = holds(
        MassField(), None, says="its mass: a number, an expression, or a map that says how it varies", such="2 kg"
    )
    com: Point | None = holds(
        Vector("m"), None, says="centre of mass, in body axes from the body's origin", such="[l/2, 0, 0]"
    )
    inertia: tuple[Node, ...] | None = holds(
        InertiaField(), None, such="{Izz: m*l^2/12}",
        says="moments and products of inertia about the centre of mass, in body axes; those left out are zero",
    )
    shape: Shape | None = holds(
        ShapeField(), None, such="{rod: l, mass: m}",
        says="a homogeneous shape, which gives mass, centre of mass and inertia",
    )
    points: Mapping[str, Point] = holds(
        MapOf(Vector("m")), None, says="named points, in body axes from the body's origin", such="{pin: [l, 0, 0]}"
    )
    frames: Mapping[str, Frame] = holds(
        MapOf(Record(Frame)), None, such="{incline: {rotate: [{axis: z, angle: 30 deg}]}}",
        says="named frames: a position and an orientation each",
    )
    motion: GroundMotion | None = holds(
        Record(GroundMotion), None, says="for ground alone: how it moves in inertial space", such="{y: A*sin(w*t)}"
    )
    surfaces: Mapping[str, Surface] = holds(
        MapOf(Record(Surface)), None, such="{rim: {disc: r}}",
        says="named surfaces, where the body touches others or rolls",
    )
    label: str | None = holds(Text(), None, says="the letter or name that pictures show", such="wheel")

    def __post_init__(self) -> None:
        for name in ("points", "frames", "surfaces"):
            if getattr(self, name) is None:
                object.__setattr__(self, name, {})
        super().__post_init__()

    def verify(self) -> None:
        if self.shape is not None and (self.mass is not None or self.inertia is not None):
            raise ModelError(
                "a shape gives the mass and inertia: leave out mass and inertia, or the shape", number="M110"
            )
        for name in self.points:
            if name in self.frames:
                raise ModelError(f"{name!r} is both a point and a frame", number="M108")
        for name, surface in self.surfaces.items():
            for kind in ("segment", "between"):
                for k, end in enumerate(getattr(surface, kind) or ()):
                    if isinstance(end, str) and end not in self.points:
                        with at("surfaces", name, kind, k):
                            raise ModelError(
                                f"the body has no point {end!r}", number="M106", word=end, known=self.points
                            )

    def ends(self, places: tuple[Point | str, ...]) -> tuple[Point, ...]:
        """Return the ends of a surface in body axes."""
        return tuple(self.points[place] if isinstance(place, str) else place for place in places)

    @property
    def varying(self) -> VariableMass | None:
        """How the mass varies; None where it does not."""
        mass = self.mass if self.shape is None else self.shape.mass
        return mass if isinstance(mass, VariableMass) else None
