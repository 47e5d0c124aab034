"""What are the rows of a mechanism: scalar constraint equations, surfaces in contact, rows that stand for joints cut?

Each kind of row answers the questions of `Row`, by class data where the answer is the same for all of its kind. How
rows move is in `mechanics/row_kinematics.py`, where surfaces touch in `mechanics/contact_geometry.py`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from operator import attrgetter
from typing import Any, ClassVar, Final, Literal

from multibody_sym.model.bodies import ORIGIN, Pose
from multibody_sym.model.fields import Point
from multibody_sym.model.steps import is_flat, is_upright
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ONE, ZERO, Node, slot


@dataclass(frozen=True)
class Marker:
    """A pose fixed on a body; body -1 is a ground at rest."""

    name: str
    body: int
    pose: Pose


NOWHERE: Final = Marker("", -1, Pose())

# ----------------------------------------------------------------------------------------------------------------------
# What of a body touches.
#
# Every contact is one of a centre with a radius (zero: a point; hollow: a drum, a bowl) or the rim of a disc with a
# plane, a centre with a radius, the side of a bar in space or, if it is a point, a smooth surface; of two such bars
# that cross; or of a curve in a plane model with a plane, a centre with a radius or another curve.


@dataclass(frozen=True)
class ContactSurface:
    """A part of a body that touches: `place` is its centre, or a place in it."""

    place: Marker

    @property
    def plane(self) -> PlaneSurface | None:
        """It, if it is a plane."""
        return None


@dataclass(frozen=True)
class RoundSurface(ContactSurface):
    """A ball, in a plane model also the rim of a disc, about a centre; a point if the radius is 0; `inside` hollow."""

    radius: Node = ZERO
    inside: bool = False


@dataclass(frozen=True)
class Rim(ContactSurface):
    """The sharp rim of a disc about an `axis`, in space; one that `rolls`, by a constraint, never lies flat."""

    radius: Node
    axis: Point
    rolls: bool = False


@dataclass(frozen=True)
class BodyFace:
    """A plane through a place with a unit normal."""

    place: Marker
    normal: Point


@dataclass(frozen=True)
class PlaneSurface(ContactSurface):
    """A plane with its unit normal; in a plane model it may end at two places.

    `beside` are the other faces of its body: points touch it only where they are nearest to it, outside being near. In
    space it ends at those that it meets. `at_end`: a particle at its very end, to rounding, touches it, for no other
    face begins there.
    """

    normal: Point
    ends: tuple[Marker, Marker] | None = None
    beside: tuple[BodyFace, ...] = ()
    at_end: bool = False

    @property
    def plane(self) -> PlaneSurface:
        return self


@dataclass(frozen=True)
class Vertex(PlaneSurface):
    """A point that another point meets: a plane through it across the direction in which they came together.

    Only a run knows that direction, so that the components of the normal are parameters of runs. At a `corner` of a
    box a point hardly moves where that lies on another body.
    """

    corner: bool = False


@dataclass(frozen=True)
class Edge(ContactSurface):
    """A segment in space, of a thin bar or an edge, from its place to a `tip`.

    Of two that cross one says by where it is `facing` on which side of it the other one is. `between` are the normals
    of the two faces that meet in the edge of a box, between which it is touched.
    """

    tip: Marker
    facing: Point | None = None
    between: tuple[Point, ...] = ()


LOCAL: Final = (slot("local", 0), slot("local", 1), slot("local", 2))
"""The coordinates of a point in a body's axes, from a place of it."""


@dataclass(frozen=True)
class Level(ContactSurface):
    """A smooth surface where a `function` of the `LOCAL` coordinates is zero; it is positive outside, in m.

    With its `gradient`, and its second derivatives xx, yy, zz, xy, xz, yz.
    """

    function: Node
    gradient: Point
    second: tuple[Node, ...]


@dataclass(frozen=True)
class Bent(ContactSurface):
    """A curve in a plane model, which the `foot` follows: a frame of a massless body whose x is the tangent.

    It is touched where the foot's y points, or, unless on the `left`, where y points away from. `closed` curves are
    outlines of their bodies.
    """

    foot: Marker
    left: bool = True
    closed: bool = False


SurfacePair = tuple[ContactSurface, ContactSurface]


def plane_of(surfaces: Iterable[ContactSurface]) -> PlaneSurface | None:
    """Return the first of some surfaces that is a plane."""
    return next((surface.plane for surface in surfaces if surface.plane is not None), None)


def is_curved(surface: ContactSurface) -> bool:
    """Return whether a surface is a centre with a radius that is not zero."""
    return isinstance(surface, RoundSurface) and surface.radius is not ZERO


def is_point(surface: ContactSurface) -> bool:
    """Return whether a surface is a point."""
    return isinstance(surface, RoundSurface) and surface.radius is ZERO


# ----------------------------------------------------------------------------------------------------------------------
# The questions that every row answers.

Multiplier = Literal["rope", "rod", "force", "multiplier"]


@dataclass(frozen=True)
class Row(ABC):
    """A scalar constraint equation; `unit` is its multiplier's (SI), None where an expression, `zero`, gives it one."""

    unit: ClassVar[str | None]

    name: str

    @property
    @abstractmethod
    def multiplier(self) -> Multiplier:
        """A rope's or rod's tension, another force or moment, or a multiplier whose unit the expression makes."""

    @property
    @abstractmethod
    def is_holonomic(self) -> bool:
        """Whether it restricts positions, not speeds only."""

    @property
    @abstractmethod
    def acts_in_plane(self) -> bool:
        """Whether it restricts anything where bodies stay in the plane z = 0."""

    @property
    @abstractmethod
    def points(self) -> tuple[Marker, ...]:
        """The points of bodies at which it acts."""

    @property
    @abstractmethod
    def laws(self) -> tuple[Node, ...]:
        """The declared expressions in it that time, inputs, coordinates or speeds may change."""

    @property
    def restricts(self) -> bool:
        """Whether it restricts motion; others define a force."""
        return True

    @property
    def line(self) -> tuple[Marker, ...]:
        """Points that it joins one after the other by straight lines, each of which needs a direction."""
        return ()

    @property
    def declared_length(self) -> Node | None:
        """A length between points, which cannot be negative."""
        return None

    @property
    def radii(self) -> tuple[Node, ...]:
        """The radii on which something runs in it."""
        return ()

    @property
    def plain(self) -> Row:
        """The row without the friction that its force brings along."""
        return self

    @property
    def sliding(self) -> tuple[Sliding, ...]:
        """The friction that its force brings along where something slides."""
        return ()

    @property
    def surfaces(self) -> SurfacePair | None:
        """The surfaces of both bodies in a contact."""
        return None

    @property
    def tip(self) -> Vertex | None:
        """The second surface where two points meet, which has no normal of its own."""
        return None

    @property
    def rim(self) -> Rim | None:
        """The surface that is the rim of a disc in space."""
        return None

    @property
    def rope_run(self) -> RopeRow | None:
        """It, if it is a rope, or a run of one between wheels."""
        return None

    @property
    def rope_slip(self) -> RopeSlipRow | None:
        """It, if it is the slip of a rope on a rough wheel."""
        return None

    @property
    def expression(self) -> Node | None:
        """What it holds at zero, if it is declared by an expression of coordinates and speeds."""
        return None


# ----------------------------------------------------------------------------------------------------------------------
# Rows of expressions of coordinates and speeds.


@dataclass(frozen=True)
class _OfExpression(Row):
    """A row that is an expression which is `zero`.

    With `no_place` nothing says where its force acts; otherwise it drives the joints whose coordinates it names.
    """

    unit: ClassVar[str | None] = None
    multiplier: ClassVar[Multiplier] = "multiplier"
    acts_in_plane: ClassVar[bool] = True
    points: ClassVar[tuple[Marker, ...]] = ()

    zero: Node
    no_place: bool = False

    @property
    def expression(self) -> Node:
        return self.zero

    @property
    def laws(self) -> tuple[Node, ...]:
        return (self.zero,)


@dataclass(frozen=True)
class ExpressionRow(_OfExpression):
    """phi = zero, an expression of q and t; the multiplier has the unit that the expression gives it."""

    is_holonomic: ClassVar[bool] = True


@dataclass(frozen=True)
class GearRow(ExpressionRow):
    """The same for two wheels whose teeth touch at the `pitch` point of the body that their axes stay on.

    A unit multiplier is `force` (that body's axes) at the pitch point: times -1, 0 or 1 on each of some bodies (`on`),
    and times the factors `beside` on children of joints, beside their reactions. In a tree (`in_tree`) these bodies are
    the wheels; other joints' rows hold the force back, as H is that of drives in joints.
    """

    pitch: Marker = NOWHERE
    force: Point = ORIGIN
    on: tuple[tuple[int, int], ...] = ()
    beside: tuple[tuple[str, int], ...] = ()
    in_tree: bool = True


@dataclass(frozen=True)
class VelocityRow(_OfExpression):
    """psi = zero, an expression of q, u and t that is linear in u: a nonholonomic constraint."""

    is_holonomic: ClassVar[bool] = False


@dataclass(frozen=True)
class RubbingRow(VelocityRow):
    """Friction in a joint sticks: a speed (m/s) is zero; the multiplier is the force of friction."""

    unit: ClassVar[str | None] = "N"


@dataclass(frozen=True)
class BrakingRow(VelocityRow):
    """The same for turning: an angular velocity is zero; the multiplier is the moment of friction."""

    unit: ClassVar[str | None] = "N*m"


# ----------------------------------------------------------------------------------------------------------------------
# Rows between points and frames of bodies.


@dataclass(frozen=True)
class DistanceRow(Row):
    """phi = value - |a - b|; the multiplier is the tension. `straight` is the direction (world), known and constant."""

    unit: ClassVar[str | None] = "N"
    multiplier: ClassVar[Multiplier] = "rod"
    is_holonomic: ClassVar[bool] = True
    acts_in_plane: ClassVar[bool] = True

    ends: tuple[Marker, Marker]
    value: Node
    straight: Point | None = None

    @property
    def points(self) -> tuple[Marker, ...]:
        return self.ends

    @property
    def line(self) -> tuple[Marker, ...]:
        return self.ends

    @property
    def laws(self) -> tuple[Node, ...]:
        return (self.value,)

    @property
    def declared_length(self) -> Node | None:
        return self.value


@dataclass(frozen=True)
class _OfFrames(Row):
    """A row between a frame F of one body and a frame M of another that restricts how they stand."""

    multiplier: ClassVar[Multiplier] = "force"
    is_holonomic: ClassVar[bool] = True
    laws: ClassVar[tuple[Node, ...]] = ()

    frames: tuple[Marker, Marker]

    @property
    def points(self) -> tuple[Marker, ...]:
        return self.frames


@dataclass(frozen=True)
class PositionRow(_OfFrames):
    """phi = axis . (p_M - p_F): frame M's origin stays where it is along an axis of frame F.

    The multiplier is the component of the force on M's body along the axis.
    """

    unit: ClassVar[str | None] = "N"

    axis: Point

    @property
    def acts_in_plane(self) -> bool:
        return not is_upright(self.axis)


@dataclass(frozen=True)
class AngleRow(_OfFrames):
    """phi = e . d - value: a direction e of frame F and a direction d of frame M keep their angle.

    The multiplier is the moment on M's body along d x e, if that is of length one. Where frames could satisfy the row
    turned over, `shared` is an axis of both that must not point opposite ways.
    """

    unit: ClassVar[str | None] = "N*m"

    directions: tuple[Point, Point]
    value: Node = ZERO
    shared: Point | None = None

    @property
    def acts_in_plane(self) -> bool:
        return all(map(is_flat, self.directions))


@dataclass(frozen=True)
class Drive:
    """The generalised force of a unit multiplier of row number `row` on a freedom: `factor` on its `rate`."""

    row: int
    rate: Node
    factor: Node


@dataclass(frozen=True)
class CutJoint:
    """A joint without coordinates of its own: its frames on parent and child, and which rows stand for it.

    `drives` are what rows that name coordinates exert on its freedoms, `teeth` the rows of gears whose force at the
    teeth its reaction is without, with the factor of that force on its child.
    """

    name: str
    frames: tuple[Marker, Marker]
    rows: range
    drives: tuple[Drive, ...] = ()
    teeth: tuple[tuple[int, int], ...] = ()


# ----------------------------------------------------------------------------------------------------------------------
# Rows of contacts: along which directions two bodies push, rub and roll.

ContactDirection = Literal["normal", "t1", "t2", "roll1", "roll2"]


@dataclass(frozen=True)
class ContactRow(Row):
    """Two bodies' material velocity, first relative to second, along a direction where their surfaces are nearest.

    Along the normal, from the second to the first, phi is the gap. Tangents t1 and t2 = normal x t1 rub. Where one
    surface is a plane `across` is t1 in its axes, for a normal from the second to the first; without it the contact is
    `upright` (t1 = normal x z, in a plane model) or t1 is ground's x as far as it lies across the normal. `inner`, a
    place inside the body whose corner touches a face, is above that face.
    """

    unit: ClassVar[str | None] = "N"
    multiplier: ClassVar[Multiplier] = "force"
    laws: ClassVar[tuple[Node, ...]] = ()

    skins: SurfacePair
    along: ContactDirection
    across: Point | None = None
    upright: bool = True
    inner: Marker | None = None

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
    def radii(self) -> tuple[Node, ...]:
        return tuple(s.radius for s in self.skins if isinstance(s, (RoundSurface, Rim)) and s.radius is not ZERO)

    @property
    def surfaces(self) -> SurfacePair:
        return self.skins

    @property
    def tip(self) -> Vertex | None:
        second = self.skins[1]
        return second if isinstance(second, Vertex) else None

    @property
    def rim(self) -> Rim | None:
        return next((skin for skin in self.skins if isinstance(skin, Rim)), None)


@dataclass(frozen=True)
class TurningRow(ContactRow):
    """The first body's angular velocity relative to the second, about normal x t: forward rolling along t."""

    unit: ClassVar[str | None] = "N*m"


# ----------------------------------------------------------------------------------------------------------------------
# Rows of ropes: the places where a rope bends, and how far wheels that it grips have turned. Over a rough wheel or drum
# the rope may slip, and the tension changes along it.


@dataclass(frozen=True)
class RoughWheel:
    """The end of a run of rope on a wheel that turns with it, or on a drum.

    `angle` is how far the wheel has turned about its axis in the axes of `frame`, on a body that keeps the axis, from
    wherever it is zero. There the tangent's direction is counted from `across` (a unit vector, as `axis`, normal to
    it) less `start`, its value at the start.
    """

    frame: Marker
    axis: Point
    across: Point
    angle: Node
    start: Node


@dataclass(frozen=True)
class RopeBend:
    """A place on a rope's path: a marker, and the pulley's name, radius and axis where it is a wheel.

    The rope turns about the axis to the left (`side` 1) or to the right (-1); where that is not given, the start
    measures on which side the centre is inside the bend between the neighbours `beside` it. At the end of a run it may
    `grip` the wheel. It lies around it by full `turns` more. A pulley at a point is `massless`; over a `rough` one the
    rope may slip.
    """

    at: Marker
    radius: Node
    axis: Point
    pulley: str = ""
    side: Node = ZERO
    beside: tuple[Marker, Marker] | None = None
    grip: RoughWheel | None = None
    turns: int = 0
    massless: bool = True
    rough: bool = False


@dataclass(frozen=True)
class RopeRow(Row):
    """phi = length - (length of the path); the multiplier is the tension.

    A rope that grips wheels has a row for each run between them, number `run` of `rope` (0: it is all of it). What is
    wound on a wheel at an end of its path counts to the path's length. `straight` are the directions (world) of pieces
    that keep theirs, as far as they were found. One that rubs on rough wheels has another tension before and behind
    each, and the multiplier is the mean of the first and the last; `rubs` are the names of the rows of its slip.
    `label` is the letter of the tension that the model gives.
    """

    unit: ClassVar[str | None] = "N"
    multiplier: ClassVar[Multiplier] = "rope"
    is_holonomic: ClassVar[bool] = True
    acts_in_plane: ClassVar[bool] = True

    path: tuple[RopeBend, ...]
    length: Node
    rope: str = ""
    run: int = 0
    straight: tuple[Point | None, ...] = ()
    rubs: tuple[str, ...] = ()
    label: str = ""

    @property
    def points(self) -> tuple[Marker, ...]:
        return tuple(bend.at for bend in self.path)

    @property
    def line(self) -> tuple[Marker, ...]:
        return self.points

    @property
    def laws(self) -> tuple[Node, ...]:
        return (self.length,)

    @property
    def declared_length(self) -> Node | None:
        return None if self.winds else self.length

    @property
    def radii(self) -> tuple[Node, ...]:
        return tuple(bend.radius for bend in self.path)

    @property
    def rope_run(self) -> RopeRow:
        return self

    @property
    def told(self) -> tuple[str, str]:
        """The declared rope, and the name of the first tension in this run among its reactions."""
        return self.rope or self.name, self.components[0]

    @property
    def components(self) -> tuple[str, ...]:
        """The name of each tension of this row among the rope's reactions."""
        numbers = range(self.run, self.run + 1 + len(self.rubs))
        return tuple(f"tension{k}" for k in numbers) if self.run else ("tension",)

    @property
    def asked(self) -> tuple[str, ...]:
        """The name by which expressions ask for each tension: the rope's, or that with a number."""
        return tuple(f"{self.told[0]}.{self.run + k}" if self.run else self.name for k in range(len(self.components)))

    @property
    def winds(self) -> bool:
        """Whether it ends on a wheel that turns with it."""
        return any(bend.grip is not None for bend in self.path)


@dataclass(frozen=True)
class RopeSlipRow(Row):
    """psi = how fast a rope runs over the rough wheel at a bend of its path, ahead of the rim, in path order.

    The multiplier is the friction on the rope, in path order too: all tensions before the wheel are half of it higher
    than the row `rope`'s multiplier, all behind it half of it lower. `wrap` is the slot of how far the rope lies around
    the wheel at the start, for which the present angle may stand.
    """

    unit: ClassVar[str | None] = "N"
    multiplier: ClassVar[Multiplier] = "force"
    is_holonomic: ClassVar[bool] = False
    acts_in_plane: ClassVar[bool] = True
    laws: ClassVar[tuple[Node, ...]] = ()

    rope: RopeRow
    bend: int
    wrap: Node

    @property
    def rope_slip(self) -> RopeSlipRow:
        return self

    @property
    def points(self) -> tuple[Marker, ...]:
        return self.rope.points

    @property
    def line(self) -> tuple[Marker, ...]:
        return self.rope.line

    @property
    def radii(self) -> tuple[Node, ...]:
        return self.rope.radii


# ----------------------------------------------------------------------------------------------------------------------
# Rows that define what presses where something rubs: they restrict nothing.


@dataclass(frozen=True)
class _OfForces(Row):
    """A row whose multiplier is a force that other multipliers define."""

    unit: ClassVar[str | None] = "N"
    multiplier: ClassVar[Multiplier] = "force"
    restricts: ClassVar[bool] = False
    is_holonomic: ClassVar[bool] = False
    acts_in_plane: ClassVar[bool] = True
    points: ClassVar[tuple[Marker, ...]] = ()


@dataclass(frozen=True)
class ReactionRow(_OfForces):
    """The multiplier z is part of a joint's reaction on its child, F about the joint's point there M:

        force . F + moment . M + constant = share z + rubbing * (the multiplier of the row named `rubs`)

    `force` and `moment` are components along the axes of the first of `frames`, the joint's on its parent and child.
    """

    laws: ClassVar[tuple[Node, ...]] = ()

    joint: str
    frames: tuple[Marker, Marker]
    force: Point
    moment: Point
    share: Node = ONE
    rubbing: Node = ZERO
    rubs: str = ""
    constant: Node = ZERO


@dataclass(frozen=True)
class ConstantMomentRow(ReactionRow):
    """The multiplier is a constant moment."""

    unit: ClassVar[str | None] = "N*m"


@dataclass(frozen=True)
class MeanTensionRow(_OfForces):
    """The multiplier is the mean N of the tensions before and behind one of several rough wheels on a run of rope.

    That of its row `rope` is the mean of the first tension and the last one: N is that, and half of the friction on the
    wheels farther on (`ahead`, names of the rows of their slip), less half of that on those before (`passed`).
    """

    laws: ClassVar[tuple[Node, ...]] = ()

    rope: str
    passed: tuple[str, ...]
    ahead: tuple[str, ...]


# ----------------------------------------------------------------------------------------------------------------------
# Rows around other rows; of what slides, the force of a normal row brings friction along.


def _of_inner_row(name: str) -> Any:
    """Return the property of a row around another one that is the same as that one's."""
    return property(attrgetter(f"of.{name}"))


@dataclass(frozen=True)
class RowAround(Row):
    """A row that answers for another one, `of`, which it changes."""

    of: Row

    multiplier = _of_inner_row("multiplier")
    restricts = _of_inner_row("restricts")
    is_holonomic = _of_inner_row("is_holonomic")
    acts_in_plane = _of_inner_row("acts_in_plane")
    points = _of_inner_row("points")
    line = _of_inner_row("line")
    declared_length = _of_inner_row("declared_length")
    radii = _of_inner_row("radii")

    @property
    def unit(self) -> str | None:  # type: ignore[override]
        return self.of.unit or "N"


@dataclass(frozen=True)
class Sliding:
    """Friction while it slides: along one row with a `sense`, the sign of v_t, or along several against v_t.

    `coefficient` times the normal force acts. `starts` is where to it slides in space from rest (a unit vector).
    With `wrap` the coefficient is tanh(coefficient phi / 2), phi being the wrap of that row's rope. With those of the
    rows named `beside` the multiplier of the sliding row makes a vector, whose length presses. `regularised` by a speed
    e the force is along -v / sqrt(v^2 + e^2).
    """

    rows: tuple[Row, ...]
    coefficient: Node
    sense: int
    wrap: int | None = None
    starts: tuple[Node, ...] | None = None
    beside: tuple[str, ...] = ()
    regularised: Node | None = None


@dataclass(frozen=True)
class SlidingRow(RowAround):
    """The normal row `of` something that slides: its unit multiplier exerts the normal force and the friction too."""

    frictions: tuple[Sliding, ...]

    @property
    def plain(self) -> Row:
        return self.of

    @property
    def sliding(self) -> tuple[Sliding, ...]:
        return self.frictions

    @property
    def laws(self) -> tuple[Node, ...]:
        return (*self.of.laws, *(sliding.coefficient for sliding in self.frictions))
