"""Surfaces of bodies: where they touch others, roll and rub."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from multibody_sym.errors import ModelError
from multibody_sym.model.declaration.fields import Element, ListOf, holds
from multibody_sym.model.declaration.values import Direction, Flag, Point, Scalar, Vector
from multibody_sym.scalars.node import Node

_KINDS: Final = ("sphere", "disc", "plane", "segment", "point")


@dataclass(frozen=True, kw_only=True)
class Surface(Element):
    """A surface of a body, in body axes: a ball, the sharp rim of a disc about `axis`, a plane, a segment, a point.

    Balls and discs have their centre at `centre`; what touches them `inside` is in a bowl or a drum. A plane goes
    through a place and has a `normal`, which points away from the body; in a plane model it may end at the two places
    `between`. A segment, a thin bar, leads from place to place.
    """

    sphere: Node | None = holds(Scalar("m"), None)
    disc: Node | None = holds(Scalar("m"), None)
    axis: Point = holds(Direction(), "z")
    centre: Point = holds(Vector("m"), (0, 0, 0))
    plane: Point | None = holds(Vector("m"), None)
    normal: Point = holds(Direction(), "z")
    between: tuple[Point, ...] | None = holds(ListOf(Vector("m"), 2, 2), None)
    segment: tuple[Point, ...] | None = holds(ListOf(Vector("m"), 2, 2), None)
    point: Point | None = holds(Vector("m"), None)
    inside: bool = holds(Flag(), False)

    @property
    def kind(self) -> str:
        """Which of the kinds it is: sphere, disc, plane, segment or point."""
        return next(kind for kind in _KINDS if getattr(self, kind) is not None)

    @property
    def radius(self) -> Node:
        """The radius of a ball or disc."""
        found = self.sphere if self.disc is None else self.disc
        assert found is not None
        return found

    def verify(self) -> None:
        if sum(getattr(self, kind) is not None for kind in _KINDS) != 1:
            wanted = "sphere: radius, disc: radius, plane: [x, y, z], segment: [p, q], point: [x, y, z]"
            raise ModelError(f"a surface is one of {wanted}")
        if self.inside and self.sphere is None and self.disc is None:
            raise ModelError("a sphere or a disc may be touched from inside, nothing else").under("inside")
        if self.between is not None and self.plane is None:
            raise ModelError("a plane may end between two places; a segment has its ends already").under("between")
