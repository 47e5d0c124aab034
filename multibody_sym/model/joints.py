"""Joints: ends, elementary steps, names and start values of coordinates, limits, prescribed motion; and each kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, Final

from multibody_sym.errors import ModelError, at
from multibody_sym.model.argument_checks import OTHERWISE
from multibody_sym.model.contacts_and_impacts import verify_restitution
from multibody_sym.model.fields import (
    Choice,
    Count,
    Direction,
    Element,
    Flag,
    Flags,
    ListOf,
    OneOf,
    OptionalScalars,
    Point,
    Record,
    Scalar,
    Text,
    holds,
)
from multibody_sym.model.steps import (
    Ball,
    Curve,
    CurveField,
    Follow,
    FreeStep,
    Rotate,
    ScrewStep,
    Step,
    Translate,
    free_steps,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import PI, ZERO, Node
from multibody_sym.text.printer import text


@dataclass(frozen=True)
class Joint(Element):
    """A joint from a body, point or frame of the parent to one of the child; both coincide at zero coordinates.

    All but parent and child is given by keyword: a letter behind them could be an axis or the name of a coordinate.
    Where joints close a loop one of them is cut and becomes constraints: the one marked `cut`.
    """

    kind: ClassVar[str]

    parent: str = holds(Text(), says="the body, point or frame that carries the joint", such="ground")
    child: str = holds(Text(), says="the body, point or frame that it carries", such="crank")
    cut: bool = holds(
        Flag(), False, keyword=True, such="true",
        says="whether this joint closes a loop by constraints, instead of having coordinates",
    )

    @property
    def steps(self) -> tuple[Step, ...]:
        """The elementary motions of this kind of joint, from the parent outward."""
        return ()

    @property
    def moves(self) -> tuple[Step, ...]:
        """The elementary motions, with prescribed motions put in."""
        return self.steps

    @property
    def stops(self) -> Limits | None:
        """Its limits, if stops act there."""
        return None

    @cached_property
    def free_steps(self) -> tuple[FreeStep, ...]:
        """The elementary motions with coordinates, and the places of these in the joint."""
        return free_steps(self.moves)

    @property
    def coordinate_suffixes(self) -> tuple[str, ...]:
        """The ends of the default names of its coordinates, which begin with the joint's name."""
        letters = [coordinate.letter for free in self.free_steps for coordinate in free.step.coordinates]
        several = any(len(step.coordinates) > 1 for step in self.steps) or len(self.steps) > 1
        return tuple(f"_{letter}" for letter in letters) if several else ("",) * len(letters)

    @property
    def speed_suffixes(self) -> tuple[str | None, ...]:
        """The ends of the names of its speeds; None where a speed is a coordinate's rate."""
        letters = (speed.letter for free in self.free_steps for speed in free.step.speeds)
        return tuple(None if letter is None else f"_{letter}" for letter in letters)

    @property
    def coordinate_units(self) -> tuple[str, ...]:
        """The units of its coordinates, in their order."""
        return tuple(coordinate.unit for free in self.free_steps for coordinate in free.step.coordinates)

    @property
    def speed_units(self) -> tuple[str, ...]:
        """The units of its speeds, in their order."""
        return tuple(speed.unit for free in self.free_steps for speed in free.step.speeds)

    @property
    def zero_coordinates(self) -> tuple[int, ...]:
        """The coordinates at which both frames coincide."""
        return tuple(coordinate.zero for free in self.free_steps for coordinate in free.step.coordinates)


def effort_unit(speed: str) -> str:
    """Return the unit of the force or moment that does work along a speed of the unit `speed`."""
    return "N" if speed == "m/s" else "N*m"


@dataclass(frozen=True)
class Initial(Element):
    """The state of a joint at t = 0: `q` of its coordinates, `u` of its speeds; null (None) is solved for.

    Missing values are always solved for. Given values are kept before missing ones, and never change for their sake;
    those that are `known` do not change at all when closed loops are assembled.
    """

    meant: ClassVar[Mapping[str, str]] = {
        OTHERWISE: "start values of coordinates stand under q, of speeds under u: {q: 30 deg, u: 2}"
    }

    q: tuple[Node | None, ...] | None = holds(
        OptionalScalars(), None, such="30 deg",
        says="start values of the coordinates, in m or rad; null leaves one to be found",
    )
    u: tuple[Node | None, ...] | None = holds(
        OptionalScalars(), None, such="2",
        says="start values of the speeds, in m/s or rad/s; null leaves one to be found",
    )
    known: bool | tuple[bool, ...] = holds(
        Flags(), False, such="true",
        says="whether given values are kept when closed loops are assembled; a list says so one by one",
    )

    def values(self, name: str, count: int) -> tuple[Node | None, ...]:
        """Return the values under the key `name` (q, u), None for each missing one."""
        given: tuple[Node | None, ...] | None = getattr(self, name)
        return given or (None,) * count

    def marks(self, count: int) -> tuple[bool, ...]:
        """Return for each coordinate whether it is marked as known, if it is given."""
        return self.known if isinstance(self.known, tuple) else (self.known,) * count


@dataclass(frozen=True)
class Limits(Element):
    """How far (`lower`, `upper`), how fast (`velocity`) and with how much force or moment (`effort`) a joint may move.

    Stops keep the joint between `lower` and `upper`. They only push, and the joint rebounds from them with
    `restitution`. With `acts=False` nothing stops the joint, nor does `velocity`: `check` and the summary of a run
    report positions and speeds beyond the limits. `effort` is for programs that choose a drive.
    """

    meant: ClassVar[Mapping[str, str]] = {"min": "lower", "max": "upper", "e": "restitution"}

    lower: Node | None = holds(Scalar(), None, says="the lower stop of the coordinate, in m or rad", such="0")
    upper: Node | None = holds(Scalar(), None, says="the upper stop of the coordinate, in m or rad", such="0.5")
    velocity: Node | None = holds(
        Scalar(), None, says="the largest speed, in m/s or rad/s; runs report larger ones", such="2"
    )
    effort: Node | None = holds(
        Scalar(), None, such="50",
        says="the largest force or moment of a drive, in N or N*m; kept for programs that choose one",
    )
    restitution: Node | None = holds(
        Scalar(""), None, says="which part of the speed a stop gives back, 0 to 1; 0 if left out", such="0.3"
    )
    acts: bool = holds(
        Flag(), True, says="whether the stops act; otherwise runs only report positions beyond them", such="false"
    )

    def verify(self) -> None:
        verify_restitution("restitution", self.restitution)
        if self.lower is None or self.upper is None or self.lower.shadow is None or self.upper.shadow is None:
            return
        if self.lower.shadow > self.upper.shadow:
            raise ModelError(
                f"the lower limit {text(self.lower)} is above the upper one {text(self.upper)}", number="M109"
            )


@dataclass(frozen=True, kw_only=True)
class MovingJoint(Joint):
    """A joint with freedom: names and initial values of its coordinates.

    `motion` prescribes how it moves: an expression of t and parameters, or a list of one for each translation and
    rotation in turn, in which null (None) leaves that one free. What is prescribed has no coordinate; its drive shows
    in the joint's reaction.
    """

    q: tuple[str, ...] | None = holds(
        ListOf(Text(), least=1), None, says="names of its coordinates, one or a list", such="phi"
    )
    motion: tuple[Node | None, ...] | None = holds(
        OptionalScalars(), None, such="2*t",
        says="how it is driven: an expression of t, or one for each freedom with null where it is free",
    )
    initial: Initial | None = holds(Record(Initial), None, says="where it starts and how fast", such="{q: 30 deg}")
    limits: Limits | None = holds(
        Record(Limits), None, says="how far, how fast and how strongly it may move", such="{lower: 0, upper: 1}"
    )
    label: str | None = holds(Text(), None, says="the letter or name that pictures show", such="A")
    q_label: tuple[str, ...] | None = holds(
        ListOf(Text(), least=1), None, says="the book's letters of its coordinates, one or a list", such="x_1"
    )

    @property
    def with_more(self) -> str:
        """The advice how to give it more coordinates, empty where there is none."""
        return ""

    @property
    def _instead(self) -> str:
        """What to write in place of a coordinate that a joint does not have."""
        given = [text(x) for x in self.motion or () if x is not None]
        if len(given) != 1 or not self.q:
            return "leave it out"
        (name, *_), (place,) = self.q, given
        return (
            f"`motion: {place}` says where it is, so leave q out and write {place} for {name}; or keep q: {name} and "
            f"write constraints: {{drive: {{type: motion, joint: .., value: {place}}}}} instead of motion"
        )

    @property
    def stops(self) -> Limits | None:
        limits = self.limits
        bounded = limits is not None and limits.acts and not limits.lower is limits.upper is None
        return limits if bounded and self.free_steps else None

    @property
    def moves(self) -> tuple[Step, ...]:
        if self.motion is None:
            return self.steps
        given = iter(self.motion)
        return tuple(step.with_motion(next(given)) if step.may_be_prescribed else step for step in self.steps)

    def verify(self) -> None:
        self._verify_motion()
        if self.limits is not None and [len(step.speeds) for step in self.steps] != [1]:
            raise ModelError(
                f"limits are for joints with one freedom; a {self.kind} joint has more", number="M110"
            ).under("limits")
        coordinates, speeds = len(self.coordinate_units), len(self.speed_units)
        if self.q is not None and len(self.q) != coordinates:
            if coordinates == 0:
                message = f"{self._named} has no coordinate to give a name: {self._instead}"
                raise ModelError(message, number="M110").under("q")
            advice = self.with_more if len(self.q) > coordinates else ""
            message = f"{self._named} has {coordinates} coordinates, q names {len(self.q)}{advice}"
            raise ModelError(message, number="M110")
        if self.q_label is not None and len(self.q_label) != coordinates:
            message = f"{self._named} has {coordinates} coordinates, q_label gives {len(self.q_label)} letters"
            raise ModelError(message, number="M110").under("q_label")
        if self.initial is not None:
            with at("initial"):
                self._verify_initial(self.initial, {"q": coordinates, "u": speeds, "known": coordinates})
        for (*section, name), units in self._units().items():
            element = getattr(self, section[0]) if section else self
            if element is not None and units:
                with at(*section):
                    element.verify_unit(name, units)

    def _units(self) -> dict[tuple[str, ...], tuple[str, ...]]:
        """Return the units of the given start values, motions and limits, by their paths."""
        units: dict[tuple[str, ...], tuple[str, ...]]
        units = {("initial", "q"): self.coordinate_units, ("initial", "u"): self.speed_units}
        if self.motion is not None:
            units["motion",] = tuple(step.coordinates[0].unit for step in self.steps if step.may_be_prescribed)
        if self.limits is not None:
            (step,) = self.steps
            coordinate, speed = step.coordinates[0].unit, step.speeds[0].unit
            of_limits = {"lower": coordinate, "upper": coordinate, "velocity": speed, "effort": effort_unit(speed)}
            units |= {("limits", name): (unit,) for name, unit in of_limits.items()}
        return units

    def unit_at(self, path: Sequence[str]) -> str | None:
        """Return the unit at a path inside the joint, None where it does not depend on the joint."""
        for steps, units in self._units().items():
            if tuple(path[: len(steps)]) == steps:
                return units[int(path[-1]) if len(path) > len(steps) else 0]
        return None

    def _verify_initial(self, initial: Initial, counts: Mapping[str, int]) -> None:
        """Raise ModelError for a list of another length, and for one with a part of a quaternion."""
        for name, wanted in counts.items():
            given = getattr(initial, name)
            if not isinstance(given, tuple):
                continue
            with at(name):
                if len(given) != wanted:
                    counted = f"{wanted} initial values here, got {len(given)}"
                    raise ModelError(f"{self._named} needs {counted}; null (None) leaves one out")
                for free in self.free_steps if name != "u" else ():
                    if free.step.unit_quaternion and len({given[k] is None or given[k] is False for k in free.q}) > 1:
                        raise ModelError(
                            "the last four are one quaternion (w, x, y, z): give all four or none", number="M110"
                        )

    @property
    def _named(self) -> str:
        return f"a {self.kind} joint" + (" whose motion is prescribed" if self.motion is not None else "")

    def _verify_motion(self) -> None:
        """Raise ModelError unless `motion` has an entry for each step that may be prescribed."""
        may_be = [step.may_be_prescribed for step in self.steps]
        if self.motion is None or len(self.motion) == sum(may_be):
            return
        with at("motion"):
            if not all(may_be):
                raise ModelError(
                    f"the rotation of a {self.kind} joint is a quaternion, which cannot be prescribed; choose three "
                    "angles instead (angles: xyz)"
                )
            raise ModelError(
                f"a {self.kind} joint moves by {len(may_be)} translations and rotations: give a motion or null for "
                f"each, got {len(self.motion)}",
                number="M110",
            )


# ----------------------------------------------------------------------------------------------------------------------
# Joints: each is declared as itself and moves by elementary steps, the last a ball where three angles would fail.
#
# Frame F stands on the parent, frame M on the child; at zero coordinates they coincide. The steps lead from F to M:
# each translates along, rotates about, or screws along an axis that the steps before it have moved.


_AXES: Final = {letter: Direction().accept(letter) for letter in "xyz"}
_X, _Y, _Z = _AXES.values()


@dataclass(frozen=True, kw_only=True)
class Revolute(MovingJoint):
    """A hinge: rotation by q about `axis` (components in the parent's attachment frame), z unless it is given."""

    kind: ClassVar[str] = "revolute"
    axis: Point = holds(Direction(), "z", says="the axis of the hinge, in the axes of the parent's frame", such="z")

    @property
    def steps(self) -> tuple[Step, ...]:
        return (Rotate(self.axis),)


@dataclass(frozen=True, kw_only=True)
class AxialJoint(MovingJoint):
    """A joint that slides along `axis` (components in the parent's attachment frame), which must be given.

    Planes have a normal to turn about, but no direction of their own to slide along.
    """

    axis: Point = holds(
        Direction(), None, says="along which axis of the parent's frame it slides; must be given", such="x"
    )

    def verify(self) -> None:
        if self.axis is None:
            message = f"it is missing: say along which direction the {self.kind} joint slides, such as axis: x"
            raise ModelError(message, number="M102").under("axis")
        super().verify()


@dataclass(frozen=True, kw_only=True)
class Prismatic(AxialJoint):
    """A slider: translation by q along `axis` (components in the parent's attachment frame)."""

    kind: ClassVar[str] = "prismatic"

    @property
    def steps(self) -> tuple[Step, ...]:
        return (Translate(self.axis),)


@dataclass(frozen=True, kw_only=True)
class Screw(AxialJoint):
    """A nut on a screw: rotation by q about `axis` advances it by `pitch` a turn."""

    kind: ClassVar[str] = "screw"
    pitch: Node = holds(Scalar("m"), says="how far it advances with each turn", such="5 mm")

    @property
    def steps(self) -> tuple[Step, ...]:
        return (ScrewStep(self.axis, lead=self.pitch / (2 * PI)),)


@dataclass(frozen=True, kw_only=True)
class Cylindrical(AxialJoint):
    """A sleeve on a shaft: z along and phi about `axis`."""

    kind: ClassVar[str] = "cylindrical"

    @property
    def steps(self) -> tuple[Step, ...]:
        return Translate(self.axis, "z"), Rotate(self.axis, "phi")


@dataclass(frozen=True, kw_only=True)
class Universal(MovingJoint):
    """A cardan joint: rotation about the first of `axes` (the parent's), then about the second, turned by it."""

    kind: ClassVar[str] = "universal"
    axes: tuple[Point, ...] = holds(
        ListOf(Direction(), 2, 2), ("x", "y"), such="[x, y]",
        says="both axes: the parent's, and the child's, which the first one turns",
    )

    @property
    def steps(self) -> tuple[Step, ...]:
        return Rotate(self.axes[0], "1"), Rotate(self.axes[1], "2")


@dataclass(frozen=True, kw_only=True)
class Planar(MovingJoint):
    """Motion in the x-y plane of the parent's attachment frame: x, y along its axes, then rotation theta about z."""

    kind: ClassVar[str] = "planar"

    @property
    def steps(self) -> tuple[Step, ...]:
        return Translate(_X, "x"), Translate(_Y, "y"), Rotate(_Z, "theta")


@dataclass(frozen=True, kw_only=True)
class PointJoint(MovingJoint):
    """A particle that moves along the `axes` of the parent's attachment frame, in a plane (xy) or in space (xyz).

    It does not turn, and so needs no inertia.
    """

    kind: ClassVar[str] = "point"
    axes: str = holds(
        Choice(("xy", "xz", "yz", "xyz")), "xy", says="the axes along which the particle moves", such="xyz"
    )

    @property
    def steps(self) -> tuple[Step, ...]:
        return tuple(Translate(_AXES[letter], letter) for letter in self.axes)

    @property
    def with_more(self) -> str:
        return "; in space write axes: xyz" if len(self.axes) < 3 else ""


@dataclass(frozen=True, kw_only=True)
class CurveJoint(MovingJoint):
    """A bead on a wire: the child's frame stays on a `curve` in the parent's; the coordinate is the curve's parameter.

    The child, usually a particle, does not turn unless `turns` says so. With `tangent` its x axis stays tangent to a
    curve in the x-y plane; with `free` it turns about z.
    """

    kind: ClassVar[str] = "curve"
    curve: Curve = holds(CurveField(), says="the wire, as an expression of x or of a parameter", such='{y: "x^2/2"}')
    turns: str | None = holds(
        Choice(("tangent", "free")), None, such="tangent",
        says="tangent: the child turns with the wire; free: it turns as it likes; else not at all",
    )

    @property
    def steps(self) -> tuple[Step, ...]:
        leaf, along = self.curve.leaf, self.turns == "tangent"
        follow = Follow.along(self.curve, leaf.data[1][0], turns_along=along)
        return (follow, Rotate(_Z, "theta")) if self.turns == "free" else (follow,)

    def verify(self) -> None:
        if self.turns == "tangent" and self.curve.place[2] is not ZERO:
            advice = "a curve with a z has no one frame that turns with it; leave turns out, or turns: free"
            raise ModelError(advice).under("turns")
        super().verify()


@dataclass(frozen=True)
class Angles(Text):
    """Three axes of successive rotations, written as letters: `xyz`, `zxz`, ...; no two neighbours alike."""

    def accept(self, value: Any) -> str:
        word = super().accept(value)
        if len(word) != 3 or set(word) - set("xyz") or word[0] == word[1] or word[1] == word[2]:
            raise ModelError(f"{word!r} names no three successive axes: write xyz, zxz, zyx or the like", number="M103")
        return word


def _free_rotation(angles: str | None) -> tuple[Step, ...]:
    """Return a ball, or three rotations where `angles` are chosen."""
    return (Ball(),) if angles is None else tuple(Rotate(_AXES[x], str(k)) for k, x in enumerate(angles, 1))


@dataclass(frozen=True, kw_only=True)
class Spherical(MovingJoint):
    """A ball joint: unit quaternion (w first) as coordinates, angular velocity in the child's axes as speeds.

    With `angles`, such as `zxz`, three successive rotations instead (singular where the first and third axis align).
    """

    kind: ClassVar[str] = "spherical"
    angles: str | None = holds(
        Angles(), None, says="three successive rotations as coordinates, instead of a quaternion", such="zxz"
    )

    @property
    def steps(self) -> tuple[Step, ...]:
        return _free_rotation(self.angles)


@dataclass(frozen=True, kw_only=True)
class Free(MovingJoint):
    """No joint at all: position and its speed along the parent's axes, then a ball (or three `angles`).

    Without `q` the coordinates of joint J are `J_x`, `J_y`, `J_z` and the quaternion `J_qw`, `J_qx`, `J_qy`, `J_qz`.
    Its speeds are `u_J_x`, `u_J_y`, `u_J_z` and the angular velocity `J_wx`, `J_wy`, `J_wz`. With `angles`, `J_1`,
    `J_2`, `J_3` and `u_J_1`, `u_J_2`, `u_J_3` replace quaternion and angular velocity.
    """

    kind: ClassVar[str] = "free"
    angles: str | None = holds(
        Angles(), None, says="three successive rotations as coordinates, instead of a quaternion", such="zyx"
    )

    @property
    def steps(self) -> tuple[Step, ...]:
        return (Translate(_X, "x"), Translate(_Y, "y"), Translate(_Z, "z"), *_free_rotation(self.angles))


@dataclass(frozen=True, kw_only=True)
class Direct(Element):
    """One freedom of a custom joint: `translate` along or `rotate` about a direction, which with a `pitch` a turn is a
    screw; or a way along a `curve`."""

    translate: Point | None = holds(Direction(), None, says="the direction along which it slides", such="x")
    rotate: Point | None = holds(Direction(), None, says="the axis about which it turns", such="z")
    pitch: Node | None = holds(
        Scalar("m"), None, says="how far it advances with each turn about that axis", such="5 mm"
    )
    curve: Curve | None = holds(CurveField(), None, says="the curve along which it moves", such='{y: "x^2/2"}')

    def verify(self) -> None:
        if sum(x is not None for x in (self.translate, self.rotate, self.curve)) != 1:
            raise ModelError(
                "a freedom is {translate: axis} or {rotate: axis}, the latter perhaps with a pitch, or {curve: ..}"
            )
        if self.rotate is None and self.pitch is not None:
            raise ModelError("a pitch goes with rotate", number="M110")

    def step(self, letter: str) -> Step:
        """Return its motion; `letter` ends the names of its coordinate and speed."""
        if self.curve is not None:
            return Follow.along(self.curve, letter)
        if self.translate is not None:
            return Translate(self.translate, letter)
        assert self.rotate is not None
        if self.pitch is None:
            return Rotate(self.rotate, letter)
        return ScrewStep(self.rotate, letter, lead=self.pitch / (2 * PI))


@dataclass(frozen=True, kw_only=True)
class Custom(MovingJoint):
    """A joint made of its freedoms, one after the other: `free: [{translate: x}, {rotate: z}]`."""

    kind: ClassVar[str] = "custom"
    free: tuple[Direct, ...] = holds(
        ListOf(Record(Direct)), (), such="[{translate: x}, {rotate: z}]",
        says="its freedoms in order, each moved by the ones before",
    )

    @property
    def steps(self) -> tuple[Step, ...]:
        return tuple(freedom.step(str(k)) for k, freedom in enumerate(self.free, 1))

    def verify(self) -> None:
        if not self.free:
            raise ModelError("free is missing: list the freedoms", number="M102")
        super().verify()


@dataclass(frozen=True, kw_only=True)
class Fixed(Joint):
    """A weld: no freedom."""

    kind: ClassVar[str] = "fixed"
    label: str | None = holds(Text(), None, says="the letter or name that pictures show", such="W")


JOINTS: Final = OneOf(
    {
        cls.kind: cls
        for cls in (
            *(Revolute, Prismatic, Screw, Cylindrical, Universal, Planar, PointJoint, CurveJoint),
            *(Spherical, Free, Custom, Fixed),
        )
    },
    {
        "hinge": "revolute",
        "pin": "revolute",
        "continuous": "revolute",
        "slider": "prismatic",
        "cardan": "universal",
        "ball": "spherical",
        "floating": "free",
        "weld": "fixed",
    },
    {
        **dict.fromkeys(("rotation", "rotational", "rotary", "rotating"), "revolute"),
        **dict.fromkeys(("translation", "translational", "linear", "sliding"), "prismatic"),
        "rigid": "fixed",
    },
)


# ----------------------------------------------------------------------------------------------------------------------
# The moving frame where a curve is touched, which no file declares.


@dataclass(frozen=True, kw_only=True)
class Foot(CurveJoint):
    """The joint of a massless frame whose x is the tangent of a curve where that is nearest to something else.

    It belongs to the contact or constraint `owner`, and follows the curve that the end number `end` of its two ends
    `between` names.
    """

    kind: ClassVar[str] = "foot"
    owner: str = holds(Text(), says="the contact or constraint whose place it follows", such="c1")
    between: tuple[str, ...] = holds(ListOf(Text(), 2, 2), says="the two ends of that contact", such="[a, b]")
    end: int = holds(Count(0), says="which of the two is the curve", such="0")
