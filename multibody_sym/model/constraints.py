"""Constraints that are declared beside the joints: rods, ropes, guides, rolling, prescribed motion, expressions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Final

from multibody_sym.errors import ModelError, at
from multibody_sym.model.contacts_and_impacts import (
    Coefficient,
    CoefficientField,
    Contact,
    KineticField,
    verify_coefficients,
    verify_friction,
    verify_not_negative,
    verify_restitution,
    verify_rod_length,
)
from multibody_sym.model.fields import (
    AXES,
    Choice,
    Count,
    Direction,
    Element,
    Flag,
    ListOf,
    MapOf,
    Names,
    OneOf,
    OneOrMap,
    Point,
    Record,
    Scalar,
    Text,
    holds,
)
from multibody_sym.model.steps import Curve, CurveField
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO, Node
from multibody_sym.text.printer import text


def _acts(words: str) -> Any:
    """Return the field that drives joints along their own axes."""
    return holds(Choice(("in_joints",)), None, says=f"in_joints: {words}", such="in_joints")


@dataclass(frozen=True)
class Distance(Element):
    """A massless rigid rod: the distance of two points equals `value`; its multiplier is the rod's tension."""

    between: tuple[str, ...] = holds(
        ListOf(Text(), 2, 2), says="the two points that the rod joins", such="[a.pin, b.pin]"
    )
    value: Node = holds(Scalar("m"), says="how far apart they stay, not 0", such="l")

    def verify(self) -> None:
        verify_not_negative("value", self.value)
        verify_rod_length(self.value.shadow)


@dataclass(frozen=True)
class Rope(Element):
    """A massless rope from end to end of `path` over pulleys; its multiplier is the tension.

    It is taut, unless it may go `slack`; one that becomes taut with a speed rebounds and is slack again. A pulley on a
    `body` grips: the tensions on both sides of it differ. A drum that `wind` names and the path does not is put at its
    end: `path: [ground.hand], wind: [axle]`. `wrap` is needed at drums, and where the centre is not inside the bend at
    the start. The rope keeps its side, and a run ends where it comes off.
    """

    meant: ClassVar[Mapping[str, str]] = {"rough": "it belongs to the pulley: pulleys: {P: {.., rough: mu}}"}

    path: tuple[str, ...] = holds(
        ListOf(Text(), 1), such="[block, P1, load]",
        says="its ends, points of bodies or drums, and the pulleys or points between them in order",
    )
    length: Node | None = holds(
        Scalar("m"), None, says="its whole length; if left out it fits the initial positions", such="3 m"
    )
    slack: bool = holds(Flag(), False, says="whether it may go slack, so that it only pulls", such="true")
    wind: tuple[str, ...] = holds(
        ListOf(Text(), 0, 2), (), says="pulleys on bodies at ends of the path on which it winds", such="[drum]"
    )
    wrap: Mapping[str, str] = holds(
        OneOrMap(Choice(("+", "-"))), Names(), such='{drum: "+"}',
        says="how it runs about pulleys' axes in path order: + counter-clockwise, - clockwise; for all or by name",
    )
    turns: Mapping[str, int] = holds(
        OneOrMap(Count(0)), Names(), such="{post: 2}",
        says="full turns more that it lies around pulleys, for all or by name",
    )
    label: str | None = holds(Text(), None, says="the letter of its tension in formulas", such="T_1")
    restitution: Node | None = holds(
        Scalar(""), None, keyword=True, such="0.5",
        says="the part of the speed with which it goes taut that it gives back (0 to 1, 0 if left out); slack: true",
    )

    def verify(self) -> None:
        verify_not_negative("length", self.length)
        verify_restitution("restitution", self.restitution)
        if len(self.route) < 2:
            with at("path"):
                raise ModelError(f"expected a list of at least 2, got {len(self.path)}", number="M103")

    @property
    def route(self) -> tuple[str, ...]:
        """The path from end to end, with a drum that `path` does not name at its end."""
        beyond = [name for name in self.wind if name not in (self.path[0], self.path[-1])]
        return (*self.path, *beyond)


@dataclass(frozen=True)
class Expression(Element):
    """A holonomic constraint: the expression of coordinates and t equals zero.

    It determines generalised forces, but not their place. Reactions of joints that depend on the place are withheld.
    `acts="in_joints"` drives each joint along its own axes, and determines them.
    """

    zero: Node = holds(Scalar(), says="the expression of coordinates and t that stays zero", such="x1 + x2 - L")
    acts: str | None = _acts("joints are driven along their own axes, so that their reactions are known")


@dataclass(frozen=True)
class Gear(Element):
    """Two joints with one freedom each in mesh: q_1 = ratio q_2 + value; wheels that touch outside turn oppositely.

    The multiplier is the moment (or force) of the gear on the first joint; on the second it acts -ratio times. `acts`
    is that of `Expression`.

    `radii` are those of wheels on revolute joints that both lead to one body, which carries them. The force then acts
    where the wheels touch, across the line from axis to axis, and bearings have their reactions (oblique flanks are
    neglected). Axes are parallel, or meet (bevel wheels). For a planet in a ring that is ground, the arm's joint stands
    for the ring. `at`, a point of the carrying body, selects the plane across the axes, or the side of their
    intersection, in which the wheels touch.
    """

    joints: tuple[str, ...] = holds(
        ListOf(Text(), 2, 2), says="the two joints, of one freedom each, that mesh", such="[A, B]"
    )
    ratio: Node = holds(
        Scalar(), such="-2",
        says="how many times as fast the first turns as the second; negative where wheels touch outside",
    )
    value: Node = holds(Scalar(), 0, says="the first coordinate where the second is zero", such="0")
    acts: str | None = _acts("the gear acts along the joints' own axes, so that reactions are known")
    radii: tuple[Node, ...] | None = holds(
        ListOf(Scalar("m"), 2, 2), None, such="[r1, r2]",
        says="radii of both wheels: the force acts at the tooth, and bearings have their reactions",
    )
    at: str | None = holds(
        Text(), None, such="frame.mesh",
        says="a point of the carrying body that says where along the axes the wheels touch",
    )

    def verify(self) -> None:
        if self.radii is not None and self.acts is not None:
            raise ModelError("the gear's force acts at the tooth or in the joints: give radii or acts").under("acts")
        if self.radii is None and self.at is not None:
            raise ModelError("a point where wheels touch goes with radii; give them too", number="M110").under("at")
        if self.ratio is ZERO:
            message = "with a ratio of 0 the first joint could not turn; it turns ratio times as fast as the second"
            raise ModelError(message, number="M109").under("ratio")


@dataclass(frozen=True)
class Coupler(Element):
    """Joints with one freedom each whose coordinates are tied: the sum of factor times q over `joints` equals `value`.

    The multiplier acts on each joint as factor times its own. `acts` is that of `Expression`.
    """

    joints: Mapping[str, Node] = holds(
        MapOf(Scalar()), says="joints of one freedom each, with the factors of their coordinates", such="{A: 1, B: 3}"
    )
    value: Node = holds(Scalar(), 0, says="the constant value of the sum of factor times coordinate", such="0")
    acts: str | None = _acts("it acts along the joints' own axes, so that reactions are known")

    def verify(self) -> None:
        if not self.joints:
            raise ModelError("name the joints with their factors, such as {A: 1, B: -2}", number="M102").under("joints")


@dataclass(frozen=True)
class Line(Element):
    """A line on a body: `through` a point of it, along a `direction` in its axes."""

    through: str = holds(Text(), says="a point of the body, through which the line leads", such="ground.o")
    direction: Point = holds(Direction(), says="its direction, in the axes of that body", such="[1, 1, 0]")


@dataclass(frozen=True)
class PointOnLine(Element):
    """A point of one body stays on a line of another; both multipliers are forces on the point's body."""

    components: ClassVar[tuple[str, ...]] = ("n1", "n2")

    point: str = holds(Text(), says="the point that stays on the line", such="rod.end")
    line: Line = holds(Record(Line), says="the line, on another body", such="{through: ground.o, direction: x}")


@dataclass(frozen=True)
class Plane(Element):
    """A plane on a body: `through` a point of it, with a `normal` in its axes."""

    through: str = holds(Text(), says="a point of the body, through which the plane leads", such="ground.o")
    normal: Point = holds(Direction(), says="its normal, in the axes of that body", such="z")


@dataclass(frozen=True)
class PointInPlane(Element):
    """A point of one body stays in a plane of another; the multiplier is the force on the point's body."""

    point: str = holds(Text(), says="the point that stays in the plane", such="rod.end")
    plane: Plane = holds(Record(Plane), says="the plane, on another body", such="{through: ground.o, normal: z}")


@dataclass(frozen=True)
class OnCurve(Element):
    """A point of one body stays on a `curve` of another, `on` a body, point or frame of it (ground).

    Its multipliers `x`, `y` and `z` are the components of the force on the point, along the axes of the body with the
    curve; `normal(NAME.foot)` is the force across it. The parameter is a coordinate. At the start it is that of the
    nearest point of the curve.
    """

    components: ClassVar[tuple[str, ...]] = AXES

    point: str = holds(Text(), says="the point that stays on the curve", such="rod.end")
    curve: Curve = holds(CurveField(), says="the curve, as an expression of x or of a parameter", such='{y: "x^2/2"}')
    on: str = holds(Text(), "ground", says="the body, point or frame that carries the curve", such="ground")


@dataclass(frozen=True)
class Rolling(Element):
    """A ball or disc (`body`, or a surface of it) rolls on a plane or another one (`on`), never slips or lifts off.

    Its multipliers are the components of the force on the rolling body: `n` along the normal, and two across it. In a
    plane model t1 is normal x z (uphill). In space t1 is ground's x at the start, projected onto the plane (ground's y
    if the normal is x there), and moves with the plane; t2 = normal x t1.

    With coefficients of friction, `static` and `kinetic`, it is a contact, which may slip and lift off.
    """

    components: ClassVar[tuple[str, ...]] = ("n", "t1", "t2")

    body: str = holds(
        Text(), says="the ball or disc that rolls: a body whose shape is one, or a surface", such="wheel.rim"
    )
    on: str = holds(Text(), says="the surface on which it rolls", such="ground.table")
    static: Coefficient | None = holds(
        CoefficientField(), None, keyword=True, such="mu",
        says="coefficient of friction at rest, or enough; with it it slips and lifts off; the kinetic one if left out",
    )
    kinetic: Node | None = holds(
        KineticField(""), None, keyword=True, such="mu",
        says="coefficient of friction while it slips; the static one if left out",
    )

    @property
    def contact(self) -> Contact | None:
        """The contact that stands for it where it may slip."""
        if self.static is None and self.kinetic is None:
            return None
        return Contact((self.body, self.on), static=self.static, kinetic=self.kinetic)

    def verify(self) -> None:
        _ = self.contact  # refuses coefficients that contradict each other


@dataclass(frozen=True)
class PrescribedMotion(Element):
    """The coordinate of a joint with one freedom follows an expression of time; the multiplier is the drive's force."""

    joint: str = holds(Text(), says="the joint, of one freedom, that is driven", such="A")
    value: Node = holds(Scalar(), says="its coordinate as an expression of t; m or rad", such="2*t")


@dataclass(frozen=True)
class VelocityConstraint(Element):
    """A nonholonomic constraint: an expression that is linear in the speeds equals zero. `acts` as for `Expression`."""

    zero: Node = holds(Scalar(), says="an expression, linear in the speeds, that stays zero", such="u_x - r*u_phi")
    acts: str | None = _acts("it acts along the joints' own axes, so that reactions are known")


def row_names(name: str, element: Element) -> list[str]:
    """Return the names of a constraint's rows: its own, or one with each component."""
    components: tuple[str, ...] = getattr(element, "components", ())
    return [f"{name}.{component}" for component in components] or [name]


CONSTRAINTS: Final = OneOf(
    {
        "distance": Distance,
        "rope": Rope,
        "point_on_line": PointOnLine,
        "point_in_plane": PointInPlane,
        "on_curve": OnCurve,
        "rolling": Rolling,
        "gear": Gear,
        "coupler": Coupler,
        "motion": PrescribedMotion,
        "expression": Expression,
        "velocity": VelocityConstraint,
    },
    {},
    {
        **dict.fromkeys(("rod", "bar", "link", "rigid"), "distance"),
        **dict.fromkeys(("string", "cable", "cord", "belt"), "rope"),
        **dict.fromkeys(("roll", "wheel", "rolls"), "rolling"),
        **dict.fromkeys(("gears", "transmission", "ratio"), "gear"),
        "nonholonomic": "velocity",
        "holonomic": "expression",
        **dict.fromkeys(("fixed", "weld", "revolute", "hinge", "prismatic"), "a joint, under joints:"),
    },
)


@dataclass(frozen=True)
class Roughness(Element):
    """Coefficients of friction of a rope on a drum; one that is left out is the other."""

    static: Node | None = holds(
        Scalar(""), None, says="coefficient of friction while the rope does not slip", such="0.3"
    )
    kinetic: Node | None = holds(Scalar(""), None, says="coefficient of friction while the rope slips", such="0.25")

    def verify(self) -> None:
        if self.static is None and self.kinetic is None:
            raise ModelError("give static, kinetic or both", number="M102")
        verify_friction(static=self.static, kinetic=self.kinetic)
        verify_coefficients(self.sticking, self.sliding)

    @property
    def sticking(self) -> Node:
        return self.static if self.static is not None else self.sliding

    @property
    def sliding(self) -> Node:
        sliding = self.kinetic if self.kinetic is not None else self.static
        assert sliding is not None
        return sliding


@dataclass(frozen=True)
class RoughnessField:
    """Both coefficients, or one number for both."""

    def accept(self, value: Any) -> Roughness:
        if isinstance(value, (Mapping, Roughness)):
            roughness = Record(Roughness).accept(value)
            assert isinstance(roughness, Roughness)
            return roughness
        return Roughness(static=value)

    def tree(self, value: Roughness) -> Any:
        return text(value.sticking) if value.kinetic is None else Record(Roughness).tree(value)


@dataclass(frozen=True)
class Pulley(Element):
    """A pulley on the paths of ropes: at a point, massless and frictionless, or on a `body` that turns with the rope.

    At a point it needs no radius: the rope bends at the point itself. With a radius the rope lies in the plane normal
    to `axis` (of the body that carries it, or is it), on the side on which the pulley's centre is inside the bend. On a
    `body`, or a point of it, at the centre, the rope grips: the difference of its tensions turns the wheel. With
    `rough` coefficients of friction (one, or `static` and `kinetic`) it slips where one tension exceeds exp(coefficient
    * wrap) times the other. A rough pulley at a point is a drum that stands still.
    """

    at: str | None = holds(
        Text(), None, says="the point that holds a pulley without mass and friction", such="ground.top"
    )
    radius: Node = holds(Scalar("m"), 0, says="its radius; a pulley at a point may do without", such="0.1 m")
    axis: Point = holds(Direction(), "z", says="its axis, in the axes of the body that carries it or is it", such="z")
    body: str | None = holds(Text(), None, says="the wheel that turns with its rope", such="wheel")
    rough: Roughness | None = holds(
        RoughnessField(), None, such="0.3",
        says="friction of the rope on it: one coefficient, or static and kinetic; without it the rope never slips",
    )

    def verify(self) -> None:
        if self.at is None and self.body is None:
            raise ModelError(
                "say where it is: at: a point (massless, without friction), or body: the wheel that turns with the rope"
            )
        if self.at is not None and self.body is not None:
            raise ModelError(
                "at is a massless pulley's place, body a wheel that turns; give one of them", number="M110"
            ).under("body")
        if self.body is not None and self.radius.shadow == 0:
            raise ModelError("a wheel that turns with its rope needs its radius", number="M110").under("radius")
        if self.rough is not None and self.radius.shadow == 0:
            raise ModelError(
                "a rope rubs on a drum around which it lies; give its radius", number="M110"
            ).under("radius")

    @property
    def turns(self) -> bool:
        """Whether it is a body that turns, so that ropes may wind on it."""
        return self.body is not None

    @property
    def grips(self) -> bool:
        """Whether it always turns with a rope that runs over it."""
        return self.body is not None and self.rough is None

    @property
    def is_held(self) -> bool:
        """Whether a point holds it."""
        return self.body is None
