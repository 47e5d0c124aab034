"""Joints: each is declared as itself and moves by elementary steps, the last a ball where three angles would fail.

Frame F stands on the parent, frame M on the child; at zero coordinates they coincide. The steps lead from F to M: each
translates along, rotates about, or screws along an axis that the steps before it have moved.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, ClassVar, Final

from multibody_sym.errors import ModelError
from multibody_sym.model.declaration.curves.curve import Curve, CurveField
from multibody_sym.model.declaration.curves.follow import Follow
from multibody_sym.model.declaration.fields import Element, ListOf, OneOf, Record, holds
from multibody_sym.model.declaration.joint import Joint, MovingJoint
from multibody_sym.model.declaration.steps import Ball, Rotate, Step, Translate
from multibody_sym.model.declaration.steps import Screw as ScrewStep
from multibody_sym.model.declaration.values import Choice, Direction, Point, Scalar, Text
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import PI, ZERO, Node

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

    The child does not turn, as suits a particle, unless it `turns`: with the `tangent`, which stays its x axis, of a
    curve in the x-y plane, or `free`, about z.
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
class Angles:
    """Three axes of successive rotations, written as letters: `xyz`, `zxz`, ...; no two neighbours alike."""

    def accept(self, value: Any) -> str:
        word = Text().accept(value)
        if len(word) != 3 or set(word) - set("xyz") or word[0] == word[1] or word[1] == word[2]:
            raise ModelError(f"{word!r} names no three successive axes: write xyz, zxz, zyx or the like", number="M103")
        return word

    def tree(self, value: str) -> str:
        return value


def _turning_freely(angles: str | None) -> tuple[Step, ...]:
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
        return _turning_freely(self.angles)


@dataclass(frozen=True, kw_only=True)
class Free(MovingJoint):
    """No joint at all: position and its speed along the parent's axes, then a ball (or three `angles`)."""

    kind: ClassVar[str] = "free"
    angles: str | None = holds(
        Angles(), None, says="three successive rotations as coordinates, instead of a quaternion", such="zyx"
    )

    @property
    def steps(self) -> tuple[Step, ...]:
        return (Translate(_X, "x"), Translate(_Y, "y"), Translate(_Z, "z"), *_turning_freely(self.angles))


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
        """Return the freedom as a step."""
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


def _by_kind(classes: Iterable[type[Joint]]) -> Mapping[str, type[Joint]]:
    return {cls.kind: cls for cls in classes}


JOINTS: Final = OneOf(
    _by_kind(
        (
            *(Revolute, Prismatic, Screw, Cylindrical, Universal, Planar, PointJoint, CurveJoint),
            *(Spherical, Free, Custom, Fixed),
        )
    ),
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
