"""Bodies as they are declared: mass, inertia or a standard shape, points, frames, surfaces; ground's motion."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar, Final, cast

from multibody_sym.errors import ModelError, at
from multibody_sym.model.fields import (
    Choice,
    Direction,
    Element,
    Flag,
    ListOf,
    MapOf,
    Point,
    Record,
    Scalar,
    Scalars,
    Text,
    Vector,
    describe,
    fields_tree,
    from_fields,
    holds,
    scalar,
    verify_keys,
)
from multibody_sym.model.steps import Curve, CurveField
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import sqrt, substitute
from multibody_sym.scalars.node import ONE, ZERO, Node, quantity, symbol
from multibody_sym.scalars.vectors import product, rotation_about
from multibody_sym.text.printer import text

# ----------------------------------------------------------------------------------------------------------------------
# Surfaces of bodies: where they touch others, roll and rub.


_KINDS: Final = ("sphere", "disc", "plane", "segment", "point", "revolution", "curve", "outline")
FROM_AXIS: Final = quantity("distance from the axis", ())
"""The leaf of `s` in profiles, distinct from a parameter of that name."""
_S: Final = symbol("s")


@dataclass(frozen=True)
class ProfileField:
    """A height along an axis as an expression of parameters and of `s`, the distance from the axis."""

    unit: str = "m"

    def accept(self, value: Any) -> Node:
        return substitute(scalar(value, self.unit), {_S: FROM_AXIS})

    def tree(self, value: Node) -> str:
        return text(substitute(value, {FROM_AXIS: _S}))


@dataclass(frozen=True)
class EndField(Vector):
    """A place in body axes, or the name of a point of the body."""

    def accept(self, value: Any) -> Any:
        if isinstance(value, str) and value.isidentifier():
            return value
        return super().accept(value)

    def tree(self, value: Any) -> Any:
        return value if isinstance(value, str) else super().tree(value)


@dataclass(frozen=True, kw_only=True)
class Surface(Element):
    """A surface of a body, in body axes: a ball, the sharp rim of a disc about `axis`, a plane, a segment, a point.

    `revolution`, such as `0.5*s^2`, is the height along `axis` over `centre` of a surface of revolution, at the
    distance s from the axis. Points lie on it. In a plane model s is the distance along x if the axis is y, of any
    sign. A plane may end in a plane model. A segment, a thin bar, touches there on both sides if its `normal` is z,
    else on that of the normal. In space the `normal` of one of two crossing bars decides which lies above: the first
    lies where the normal of the second points, or, if that is z, the second lies against the normal of the first.

    A `curve`, in a plane model, touches points, discs and outlines on one `side` of its direction: left, which is above
    `{y: f(x)}`, or right. An `outline` is that of the body, such as an ellipse. It runs once around, counter-clockwise,
    as its parameter grows by 2 pi, and touches on its outside. Both start from `centre`.
    """

    sphere: Node | None = holds(Scalar("m"), None, says="a ball of this radius", such="r")
    disc: Node | None = holds(Scalar("m"), None, says="the rim of a disc of this radius", such="r")
    axis: Point = holds(Direction(), "z", says="the axis of a disc or of what is round, in body axes", such="z")
    centre: Point = holds(
        Vector("m"), (0, 0, 0), such="[l, 0, 0]",
        says="the centre of a ball or disc, or where a curve or height starts, in body axes",
    )
    plane: Point | None = holds(
        Vector("m"), None, says="a place through which the plane leads, in body axes", such="[0, 0, 0]"
    )
    normal: Point = holds(
        Direction(), "z", such="y",
        says="the normal of a plane, out of the body; of a segment, the side that is touched",
    )
    between: tuple[Point | str, ...] | None = holds(
        ListOf(EndField("m"), 2, 2), None, such="[[0, 0, 0], [l, 0, 0]]",
        says="the two ends of a plane, as places or names of points",
    )
    segment: tuple[Point | str, ...] | None = holds(
        ListOf(EndField("m"), 2, 2), None, such="[p, q]",
        says="the two ends of a thin bar, as places or names of points",
    )
    point: Point | None = holds(Vector("m"), None, says="a point, as a place in body axes", such="[0, 0, 0]")
    inside: bool = holds(
        Flag(), False, says="whether a ball or disc is touched from inside, as a bowl or drum is", such="true"
    )
    revolution: Node | None = holds(
        ProfileField(), None, says="height along the axis as an expression of s, the distance from it", such="0.5*s^2"
    )
    curve: Curve | None = holds(
        CurveField(), None, says="a curve in a plane model that is touched from one side", such='{y: "x^2/2"}'
    )
    outline: Curve | None = holds(
        CurveField(), None, such="{x: a*cos(s), y: b*sin(s), parameter: s}",
        says="the whole outline of the body, counter-clockwise, touched from outside",
    )
    side: str = holds(
        Choice(("left", "right")), "left", says="on which side of its way a curve is touched", such="right"
    )

    @property
    def guide(self) -> Curve | None:
        """The curve that is touched, None where it is a plane, a ball or the like."""
        return self.curve or self.outline

    @property
    def touched_on_left(self) -> bool:
        """Whether what touches a curve is on the left of its way."""
        return self.outline is None and self.side == "left"

    @property
    def kind(self) -> str:
        """The key that says which surface it is, such as `sphere`."""
        return next(kind for kind in _KINDS if getattr(self, kind) is not None)

    @property
    def radius(self) -> Node:
        """The radius (m) of a sphere or disc."""
        radius = self.sphere if self.disc is None else self.disc
        assert radius is not None
        return radius

    def verify(self) -> None:
        if sum(getattr(self, kind) is not None for kind in _KINDS) != 1:
            places = "plane: [x, y, z], segment: [p, q], point: [x, y, z]"
            raise ModelError(
                f"a surface is one of sphere: radius, disc: radius, {places}, revolution: height, "
                "curve: {y: f(x)}, outline: {x: .., y: .., parameter: s}",
                number="M110",
            )
        for kind in ("sphere", "disc"):
            radius = getattr(self, kind)
            if radius is not None and radius.shadow is not None and radius.shadow <= 0:
                message = f"a radius of {text(radius)}: what is round has a positive one, {{point: [x, y, z]}} none"
                raise ModelError(message, number="M114").under(kind)
        if self.inside and self.sphere is None and self.disc is None:
            raise ModelError(
                "a sphere or a disc may be touched from inside, nothing else", number="M114"
            ).under("inside")
        for word in ("curve", "outline"):
            guide = getattr(self, word)
            if guide is not None and guide.place[2] is not ZERO:
                raise ModelError(
                    "a curve that touches lies in the x-y plane of its body; leave z out", number="M110"
                ).under(word)
        if self.side != "left" and self.curve is None:
            raise ModelError("a curve has sides; an outline is touched from outside", number="M114").under("side")
        if self.between is not None and self.plane is None:
            raise ModelError(
                "a plane may end between two places; a segment has its ends already", number="M114"
            ).under("between")


# ----------------------------------------------------------------------------------------------------------------------

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
            raise ModelError(f"expected a map of {', '.join(_INERTIA)}, got {describe(value)}", number="M103")
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
    """A mass that varies (Meshchersky): an expression of time or coordinates, with the velocity of the mass flow.

    Without `at` every particle leaves or joins where the declared mass, `com` and inertia change. With `at` all of it
    passes that point of the body. The flow inside the body has no swirl; Coriolis forces and jet damping follow from
    the rates of mass, `com` and inertia.
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
            raise ModelError(f"expected a map such as {{rod: l, mass: m}}, got {describe(value)}", number="M103")
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

    `motion` is for the body called ground alone: a lift, a shaker, a turntable. A mass that varies is a `VariableMass`,
    and com, inertia and sizes vary only with it. World axes are the inertial ones, in which gravity is given and which
    ground leaves when it moves.
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
        """Return places on the body, given as points or by their names, as points (m)."""
        return tuple(self.points[place] if isinstance(place, str) else place for place in places)

    @property
    def varying(self) -> VariableMass | None:
        """How the mass varies; None where it does not."""
        mass = self.mass if self.shape is None else self.shape.mass
        return mass if isinstance(mass, VariableMass) else None


# ----------------------------------------------------------------------------------------------------------------------
# Masses and poses of declared bodies: standard shapes, named points and frames, unit directions.


GROUND: Final = "ground"
COM: Final = "com"
OWN_POINTS: Final = ("origin", COM)
"""The points that every body has, unless it declares others of these names."""
Rotation = tuple[Point, Point, Point]

ORIGIN: Final[Point] = (ZERO, ZERO, ZERO)
IDENTITY: Final[Rotation] = ((ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE))


@dataclass(frozen=True)
class Pose:
    """Position and orientation of a frame on a body: p = position + rotation x (rows of `rotation` are rows)."""

    position: Point = ORIGIN
    rotation: Rotation = IDENTITY


@dataclass(frozen=True)
class Mass:
    """Mass, centre of mass, and inertia (Ixx, Iyy, Izz, Ixy, Ixz, Iyz) about it, all in body axes."""

    mass: Node
    com: Point
    inertia: tuple[Node, ...]

    @cached_property
    def moving_leaves(self) -> tuple[Node, ...]:
        """The slots in it that change along a motion."""
        named = leaves((self.mass, *self.com, *self.inertia), "slot")
        return tuple(leaf for leaf in named if leaf.data[0] != "parameters")


NO_MASS: Final = Mass(ZERO, ORIGIN, (ZERO,) * 6)


def mass_of(body: Body) -> Mass:
    """Return a declared body's mass, centre and inertia; a body without inertia is a particle at `com`.

    Source of the principal moments of homogeneous shapes: any table of moments of inertia.
    """
    shape = body.shape
    if shape is None:
        return Mass(_mass_value(body.mass), body.com or ORIGIN, body.inertia or (ZERO,) * 6)
    m, sizes, centre = _mass_value(shape.mass), shape.sizes, ORIGIN
    square = sizes[0] ** 2
    match shape.kind:
        case "rod":
            centre = (sizes[0] / 2, ZERO, ZERO)
            moments = (ZERO, m * square / 12, m * square / 12)
        case "box":
            x, y, z = (size**2 for size in sizes)
            moments = (m * (y + z) / 12, m * (x + z) / 12, m * (x + y) / 12)
        case "cylinder":
            across = m * (3 * square + sizes[1] ** 2) / 12
            moments = (across, across, m * square / 2)
        case "disc" | "ring":
            axial = m * square / 2 if shape.kind == "disc" else m * square
            moments = (axial / 2, axial / 2, axial)
        case _:
            moments = (m * square * (Fraction(2, 5) if shape.kind == "sphere" else Fraction(2, 3)),) * 3
    return Mass(m, body.com or centre, (*moments, ZERO, ZERO, ZERO))


def centre_moves(body: Body, parameters: Container[str]) -> bool:
    """Return whether the mass of a body varies and its centre moves in it; expressions in names or slots."""
    if body.varying is None:
        return False
    named = leaves(mass_of(body).com, "slot", "symbol")
    return any(x.data[0] != "parameters" if x.op == "slot" else x.data not in parameters for x in named)


def used_up(body: str) -> str:
    """Return the name of the stop that ends a run where a body's mass is used up."""
    return f"mass of {body}"


def _mass_value(mass: Node | VariableMass | None) -> Node:
    return mass.value if isinstance(mass, VariableMass) else mass or ZERO


def unit_vector(v: Point) -> Point:
    """Return v / |v|, with exact components where they are."""
    length = sqrt(v[0] ** 2 + v[1] ** 2 + v[2] ** 2)
    return v[0] / length, v[1] / length, v[2] / length


def pose_of(frame: Frame) -> Pose:
    rotation = IDENTITY
    for turn in frame.rotate:
        rotation = product(rotation, rotation_about(unit_vector(turn.axis), turn.angle))
    return Pose(frame.position, rotation)
