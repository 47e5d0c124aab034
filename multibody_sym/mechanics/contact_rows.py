"""Rows of contacts: what of two bodies touches, and along which directions they push, rub and roll.

Every contact is one of a centre with a radius (zero: a point; hollow: a drum, a bowl) or the rim of a disc with a
plane, a centre with a radius, the side of a bar in space or, if it is a point, a smooth surface; of two such bars that
cross; or of a curve in a plane model with a plane, a centre with a radius or another curve. How they move is in
`mechanics/contact_geometry.py`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import ClassVar, Final, Literal

from multibody_sym.mechanics.law_elements import OneWay
from multibody_sym.mechanics.row_records import Marker, Multiplier, WithoutLine
from multibody_sym.model.fields import Point
from multibody_sym.model.steps import is_upright
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO, Node, slot

_FACES: Final = 6
"""Of a box."""


@dataclass(frozen=True)
class Skin:
    """What of a body touches: `place` is its centre, or a place in it."""

    place: Marker


@dataclass(frozen=True)
class Round(Skin):
    """A ball, in a plane model also the rim of a disc, about a centre; a point if the radius is 0; `inside` hollow."""

    radius: Node = ZERO
    inside: bool = False


@dataclass(frozen=True)
class Rim(Skin):
    """The sharp rim of a disc about an `axis`, in space; one that `rolls`, by a constraint, never lies flat."""

    radius: Node
    axis: Point
    rolls: bool = False


@dataclass(frozen=True)
class Face:
    """A plane through a place with a unit normal."""

    place: Marker
    normal: Point


@dataclass(frozen=True)
class Flat(Skin):
    """A plane with its unit normal; in a plane model it may end at two places.

    `beside` are the other faces of its body: points touch it only where they are nearest to it, outside being near. In
    space it ends at those that it meets.
    `at_end`: a particle at its very end, to rounding, touches it, as nothing begins there that it may slide along.
    """

    normal: Point
    ends: tuple[Marker, Marker] | None = None
    beside: tuple[Face, ...] = ()
    at_end: bool = False


@dataclass(frozen=True)
class Tip(Flat):
    """A point that another point meets: a plane through it across the direction in which they came together.

    Nothing but a run knows that, so that the components of its normal are parameters of runs. At a `corner`
    of a box a point hardly moves where that lies on another body.
    """

    corner: bool = False


@dataclass(frozen=True)
class Edge(Skin):
    """A segment in space, of a thin bar or an edge, from its place to a `tip`.

    Of two that cross one says by where it is `facing` on which side of it the other one is. `between` are the normals
    of the two faces that meet in the edge of a box, between which it is touched.
    """

    tip: Marker
    facing: Point | None = None
    between: tuple[Point, ...] = ()


LOCAL: Final = (slot("local", 0), slot("local", 1), slot("local", 2))
"""What stands for the coordinates of a point in a body's axes, from a place of it."""


@dataclass(frozen=True)
class Level(Skin):
    """A smooth surface where a `function` of the `LOCAL` coordinates is zero; it is positive outside, in m.

    With its `gradient`, and its second derivatives xx, yy, zz, xy, xz, yz.
    """

    function: Node
    gradient: Point
    second: tuple[Node, ...]


@dataclass(frozen=True)
class Bent(Skin):
    """A curve in a plane model, which the `foot` follows: a frame of a massless body whose x is the tangent.

    What touches it is where the foot's y points, or, unless it is on the `left`, where y points away from. `closed`
    ones are outlines of their bodies.
    """

    foot: Marker
    left: bool = True
    closed: bool = False


ContactDirection = Literal["normal", "t1", "t2", "roll1", "roll2"]


@dataclass(frozen=True)
class ContactRow(WithoutLine):
    """Two bodies' material velocity, first relative to second, along a direction where their skins are nearest.

    Along the normal, from the second to the first, phi is the gap. Tangents t1 and t2 = normal x t1 rub. Where one
    skin is a plane `across` is t1 in its axes, for a normal from the second to the first; without it the contact is
    `upright` (t1 = normal x z, in a plane model) or t1 is ground's x as far as it lies across the normal. `inner`, a
    place inside the body whose corner touches a face, is above that face.
    """

    unit: ClassVar[str | None] = "N"

    name: str
    skins: tuple[Skin, Skin]
    along: ContactDirection
    across: Point | None = None
    upright: bool = True
    inner: Marker | None = None

    @property
    def multiplier(self) -> Multiplier:
        return "force"

    @property
    def is_holonomic(self) -> bool:
        return self.along == "normal"

    @property
    def acts_in_plane(self) -> bool:
        return self.along not in ("t2", "roll2") and not (self.across is not None and is_upright(self.across))

    @property
    def points(self) -> tuple[Marker, ...]:
        tips = (skin.tip for skin in self.skins if isinstance(skin, Edge))
        feet = (skin.foot for skin in self.skins if isinstance(skin, Bent))
        return (*(skin.place for skin in self.skins), *tips, *feet)

    @property
    def laws(self) -> tuple[Node, ...]:
        return ()

    @property
    def tip(self) -> Tip | None:
        """The second skin where two points meet, which has no normal of its own."""
        second = self.skins[1]
        return second if isinstance(second, Tip) else None

    @property
    def rim(self) -> Rim | None:
        """The skin that is the rim of a disc in space."""
        return next((skin for skin in self.skins if isinstance(skin, Rim)), None)

    @property
    def radii(self) -> tuple[Node, ...]:
        return tuple(s.radius for s in self.skins if isinstance(s, (Round, Rim)) and s.radius is not ZERO)


@dataclass(frozen=True)
class TurningRow(ContactRow):
    """The first body's angular velocity relative to the second, about normal x t: forward rolling along t."""

    unit: ClassVar[str | None] = "N*m"


def is_curved(skin: Skin) -> bool:
    """Return whether a skin is a centre with a radius that is not zero."""
    return isinstance(skin, Round) and skin.radius is not ZERO


def is_point(skin: Skin) -> bool:
    """Return whether a skin is a point."""
    return isinstance(skin, Round) and skin.radius is ZERO


def boxes_that_touch(elements: Iterable[OneWay]) -> dict[str, tuple[Sequence[Face], Sequence[Face]]]:
    """Return the contacts of two boxes in space among elements by name, with the faces of both."""
    boxes: dict[str, dict[int, Sequence[Face]]] = {}
    for element in elements:
        for row in element.normals:
            for skin in row.skins if isinstance(row, ContactRow) else ():
                if isinstance(skin, Flat) and len(skin.beside) == _FACES - 1:
                    faces = (Face(skin.place, skin.normal), *skin.beside)
                    boxes.setdefault(element.group, {}).setdefault(skin.place.body, faces)
    pairs = ((name, tuple(of_body.values())) for name, of_body in boxes.items())
    return {name: (faces[0], faces[1]) for name, faces in pairs if len(faces) == 2}
