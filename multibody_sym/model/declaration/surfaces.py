"""Surfaces of bodies: where they touch others, roll and rub."""

from __future__ import annotations

from typing import Any, Final

from multibody_sym.errors import ModelError
from multibody_sym.expressions.printer import text
from multibody_sym.model.declaration.curves.curve import Curve, CurveField
from multibody_sym.model.declaration.fields import Element, ListOf, holds
from multibody_sym.model.declaration.values import Choice, Direction, Flag, Point, Scalar, Vector, scalar
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO, Node, quantity, symbol

_KINDS: Final = ("sphere", "disc", "plane", "segment", "point", "revolution", "curve", "outline")
FROM_AXIS: Final = quantity("distance from the axis", ())
"""What stands for `s` in profiles: no parameter, though one may have that name."""
_S: Final = symbol("s")


@dataclass(frozen=True)
class ProfileField:
    """A height along an axis as an expression of parameters and of `s`, the distance from the axis."""

    unit: str = "m"

    def accept(self, value: Any) -> Node:
        return _exchanged(scalar(value, self.unit), _S, FROM_AXIS)

    def tree(self, value: Node) -> str:
        return text(_exchanged(value, FROM_AXIS, _S))


def _exchanged(node: Node, old: Node, new: Node) -> Node:
    found: Node = evaluate([node], lambda leaf: new if leaf is old else leaf)[0]
    return found


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

    `revolution`, such as `0.5*s^2`, is the height along `axis` over `centre` of a surface that is round about the axis,
    at the distance s from it; points lie on it. In a plane model s is the way along x if the axis is y, of any sign.
    Balls and discs have their centre at `centre`; what touches them `inside` is in a bowl or a drum. A plane goes
    through a place and has a `normal`, which points away from the body; in a plane model it may end at the two places
    `between`. A segment, a thin bar, leads from place to place. Such ends are places or points of the body by name. In
    a plane model it is touched on both sides if its `normal` is z, else where that points; in space the first of two
    bars that cross lies where the normal of the second points, or the second against that of the first if the second's
    is z.

    A `curve`, in a plane model, is touched by points, discs and outlines on one `side` of its way: left, which is above
    `{y: f(x)}`, or right. An `outline` is that of the body, such as an ellipse, once around counter-clockwise as its
    parameter grows by 2 pi, and is touched from outside. Both start from `centre`.
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
        """The curve that it is, if it is one."""
        return self.curve or self.outline

    @property
    def touched_on_left(self) -> bool:
        """Whether what touches a curve is on the left of its way."""
        return self.outline is None and self.side == "left"

    @property
    def kind(self) -> str:
        """Which of the kinds it is: sphere, disc, plane, segment, point, revolution, curve or outline."""
        return next(kind for kind in _KINDS if getattr(self, kind) is not None)

    @property
    def radius(self) -> Node:
        """The radius of a ball or disc."""
        found = self.sphere if self.disc is None else self.disc
        assert found is not None
        return found

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
                told = f"a radius of {text(radius)}: what is round has a positive one, {{point: [x, y, z]}} none"
                raise ModelError(told, number="M114").under(kind)
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
