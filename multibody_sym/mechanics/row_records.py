"""Rows: what each scalar constraint equation says, and which of them stand for joints that were cut.

Each kind has the `unit` of its multiplier in SI; None where its expression, `zero`, gives it one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, Final, Literal

from multibody_sym.model.bodies import ORIGIN, Pose
from multibody_sym.model.fields import Point
from multibody_sym.model.steps import is_flat, is_upright
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ONE, ZERO, Node

# ----------------------------------------------------------------------------------------------------------------------
# Poses fixed on bodies.


@dataclass(frozen=True)
class Marker:
    """A pose fixed on a body; body -1 is a ground at rest."""

    name: str
    body: int
    pose: Pose


NOWHERE: Final = Marker("", -1, Pose())


# ----------------------------------------------------------------------------------------------------------------------
# The path of a rope: the places where it bends, and how far wheels that it grips have turned.


@dataclass(frozen=True)
class Grip:
    """The end of a run of rope on a wheel that turns with it, or on a drum.

    `angle` is how far the wheel has turned about its axis in the axes of `frame`, on a body that keeps the axis, from
    wherever it is zero. There the tangent's direction is counted from `across` (a unit vector, as `axis`, normal to
    it) less `start`, what that was at the start.
    """

    frame: Marker
    axis: Point
    across: Point
    angle: Node
    start: Node


@dataclass(frozen=True)
class Bend:
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
    grip: Grip | None = None
    turns: int = 0
    massless: bool = True
    rough: bool = False


def leaves_wheel(row: str, pulley: str) -> str:
    """Return what the stop is called that ends a run where a rope lies around none of a wheel any more."""
    return f"{row} leaves {pulley}"


# ----------------------------------------------------------------------------------------------------------------------

Multiplier = Literal["rope", "rod", "force", "multiplier"]


@dataclass(frozen=True)
class Row(ABC):
    """A scalar constraint equation: what all that handles rows asks of one (motion: `mechanics/row_kinematics.py`)."""

    unit: ClassVar[str | None]

    name: str

    @property
    @abstractmethod
    def multiplier(self) -> Multiplier:
        """What its multiplier is: a rope's tension, a rod's, another force or moment, or what its expression makes."""

    @property
    @abstractmethod
    def is_holonomic(self) -> bool:
        """Whether it restricts positions, not speeds only."""

    @property
    @abstractmethod
    def acts_in_plane(self) -> bool:
        """Whether it restricts anything where bodies stay in the plane z = 0."""

    @property
    def restricts(self) -> bool:
        """Whether it restricts motion; others define a force."""
        return True

    @property
    @abstractmethod
    def points(self) -> tuple[Marker, ...]:
        """The points of bodies at which it acts."""

    @property
    @abstractmethod
    def line(self) -> tuple[Marker, ...]:
        """Points that it joins one after the other by straight lines, each of which needs a direction."""

    @property
    @abstractmethod
    def laws(self) -> tuple[Node, ...]:
        """What is declared in it that time, inputs, coordinates or speeds may change."""

    @property
    @abstractmethod
    def declared_length(self) -> Node | None:
        """What cannot be negative because it is a length between points."""

    @property
    @abstractmethod
    def radii(self) -> tuple[Node, ...]:
        """The radii on which something runs in it."""


class WithoutLine(Row):
    """A row that has no length."""

    @property
    def line(self) -> tuple[Marker, ...]:
        return ()

    @property
    def declared_length(self) -> Node | None:
        return None


class _OfExpression(WithoutLine):
    """A row that is an expression which is `zero`."""

    zero: Node

    @property
    def multiplier(self) -> Multiplier:
        return "multiplier"

    @property
    def acts_in_plane(self) -> bool:
        return True

    @property
    def points(self) -> tuple[Marker, ...]:
        return ()

    @property
    def laws(self) -> tuple[Node, ...]:
        return (self.zero,)

    @property
    def radii(self) -> tuple[Node, ...]:
        return ()


class _OfFrames(WithoutLine):
    """A row between a frame of one body and a frame of another that restricts how they stand."""

    frames: tuple[Marker, Marker]

    @property
    def multiplier(self) -> Multiplier:
        return "force"

    @property
    def is_holonomic(self) -> bool:
        return True

    @property
    def points(self) -> tuple[Marker, ...]:
        return self.frames

    @property
    def laws(self) -> tuple[Node, ...]:
        return ()

    @property
    def radii(self) -> tuple[Node, ...]:
        return ()


@dataclass(frozen=True)
class DistanceRow(Row):
    """phi = value - |a - b|; the multiplier is the tension. `straight` is the direction (world), known and constant."""

    unit: ClassVar[str | None] = "N"

    name: str
    ends: tuple[Marker, Marker]
    value: Node
    straight: Point | None = None

    @property
    def multiplier(self) -> Multiplier:
        return "rod"

    @property
    def is_holonomic(self) -> bool:
        return True

    @property
    def acts_in_plane(self) -> bool:
        return True

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

    @property
    def radii(self) -> tuple[Node, ...]:
        return ()


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

    name: str
    path: tuple[Bend, ...]
    length: Node
    rope: str = ""
    run: int = 0
    straight: tuple[Point | None, ...] = ()
    rubs: tuple[str, ...] = ()
    label: str = ""

    @property
    def multiplier(self) -> Multiplier:
        return "rope"

    @property
    def is_holonomic(self) -> bool:
        return True

    @property
    def acts_in_plane(self) -> bool:
        return True

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
    def told(self) -> tuple[str, str]:
        """The declared rope, and what its tension in this run, its first one, is called among its reactions."""
        return self.rope or self.name, self.components[0]

    @property
    def components(self) -> tuple[str, ...]:
        """What each tension of this row is called among the rope's reactions."""
        numbers = range(self.run, self.run + 1 + len(self.rubs))
        return tuple(f"tension{k}" for k in numbers) if self.run else ("tension",)

    @property
    def asked(self) -> tuple[str, ...]:
        """What each tension of this row is asked by: the rope's name, or that with a number."""
        return tuple(f"{self.told[0]}.{self.run + k}" if self.run else self.name for k in range(len(self.components)))

    @property
    def winds(self) -> bool:
        """Whether it ends on a wheel that turns with it."""
        return any(bend.grip is not None for bend in self.path)


@dataclass(frozen=True)
class ExpressionRow(_OfExpression):
    """phi = zero, an expression of q and t; the multiplier has the unit that the expression gives it.

    With `no_place` nothing says where its force acts; otherwise it drives the joints whose coordinates it names.
    """

    unit: ClassVar[str | None] = None

    name: str
    zero: Node
    no_place: bool = False

    @property
    def is_holonomic(self) -> bool:
        return True


@dataclass(frozen=True)
class GearRow(ExpressionRow):
    """The same for two wheels whose teeth touch at the `pitch` point of the body that their axes stay on.

    A unit multiplier is `force` (that body's axes) at the pitch point: times -1, 0 or 1 on each of some bodies (`on`),
    and times such a factor what each joint's child gets of it that its reaction does not (`beside`). In a tree
    (`in_tree`) these bodies are the wheels; other joints' rows hold the force back, as H is that of drives in joints.
    """

    pitch: Marker = NOWHERE
    force: Point = ORIGIN
    on: tuple[tuple[int, int], ...] = ()
    beside: tuple[tuple[str, int], ...] = ()
    in_tree: bool = True


@dataclass(frozen=True)
class VelocityRow(_OfExpression):
    """psi = zero, an expression of q, u and t that is linear in u: a nonholonomic constraint; `no_place` as above."""

    unit: ClassVar[str | None] = None

    name: str
    zero: Node
    no_place: bool = False

    @property
    def is_holonomic(self) -> bool:
        return False


@dataclass(frozen=True)
class PositionRow(_OfFrames):
    """phi = axis . (p_M - p_F): frame M's origin stays where it is along an axis of frame F.

    The multiplier is the component of the force on M's body along the axis.
    """

    unit: ClassVar[str | None] = "N"

    name: str
    frames: tuple[Marker, Marker]
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

    name: str
    frames: tuple[Marker, Marker]
    directions: tuple[Point, Point]
    value: Node = ZERO
    shared: Point | None = None

    @property
    def acts_in_plane(self) -> bool:
        return all(map(is_flat, self.directions))


@dataclass(frozen=True)
class Drive:
    """What row number `row` exerts on a freedom of a joint for a unit multiplier: a force `factor` on its `rate`."""

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
# Rows of what slides: the force of a normal row brings friction along.


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
class SlidingRow(Row):
    """The row `normal` of something that slides: its unit multiplier exerts the normal force and the friction too."""

    unit: ClassVar[str | None] = "N"

    name: str
    normal: Row
    frictions: tuple[Sliding, ...]

    @property
    def multiplier(self) -> Multiplier:
        return self.normal.multiplier

    @property
    def restricts(self) -> bool:
        return self.normal.restricts

    @property
    def is_holonomic(self) -> bool:
        return self.normal.is_holonomic

    @property
    def acts_in_plane(self) -> bool:
        return self.normal.acts_in_plane

    @property
    def points(self) -> tuple[Marker, ...]:
        return self.normal.points

    @property
    def line(self) -> tuple[Marker, ...]:
        return self.normal.line

    @property
    def laws(self) -> tuple[Node, ...]:
        return (*self.normal.laws, *(sliding.coefficient for sliding in self.frictions))

    @property
    def declared_length(self) -> Node | None:
        return self.normal.declared_length

    @property
    def radii(self) -> tuple[Node, ...]:
        return self.normal.radii


# ----------------------------------------------------------------------------------------------------------------------
# Rows of friction in joints: those that define what a reaction presses with, and those along which it rubs.


@dataclass(frozen=True)
class ReactionRow(Row):
    """The multiplier z is part of a joint's reaction on its child, F about the joint's point there M:

        force . F + moment . M = share z + rubbing * (the multiplier of the row named `rubs`)

    `force` and `moment` are components along the axes of the first of `frames`, the joint's on its parent and child.
    """

    unit: ClassVar[str | None] = "N"

    name: str
    joint: str
    frames: tuple[Marker, Marker]
    force: Point
    moment: Point
    share: Node = ONE
    rubbing: Node = ZERO
    rubs: str = ""

    @property
    def multiplier(self) -> Multiplier:
        return "force"

    @property
    def restricts(self) -> bool:
        return False

    @property
    def is_holonomic(self) -> bool:
        return False

    @property
    def acts_in_plane(self) -> bool:
        return True

    @property
    def points(self) -> tuple[Marker, ...]:
        return ()

    @property
    def line(self) -> tuple[Marker, ...]:
        return ()

    @property
    def laws(self) -> tuple[Node, ...]:
        return ()

    @property
    def declared_length(self) -> Node | None:
        return None

    @property
    def radii(self) -> tuple[Node, ...]:
        return ()


@dataclass(frozen=True)
class RubbingRow(VelocityRow):
    """What rubs in a joint sticks: a speed (m/s) is zero; the multiplier is the force of friction."""

    unit: ClassVar[str | None] = "N"


@dataclass(frozen=True)
class BrakingRow(VelocityRow):
    """The same for what turns: an angular velocity is zero; the multiplier is the moment of friction."""

    unit: ClassVar[str | None] = "N*m"


# ----------------------------------------------------------------------------------------------------------------------
# Rows of ropes that slip: over a rough wheel or drum the tension changes along the rope.


@dataclass(frozen=True)
class RopeSlipRow(Row):
    """psi = how fast a rope runs over the rough wheel at a bend of its path, ahead of the rim, in path order.

    The multiplier is the friction on the rope, in path order too: all tensions before the wheel are half of it higher
    than the row `rope`'s multiplier, all behind it half of it lower. `wrap` is the slot of how far the rope lies around
    the wheel at the start, for which the present angle may stand.
    """

    unit: ClassVar[str | None] = "N"

    name: str
    rope: RopeRow
    bend: int
    wrap: Node

    @property
    def multiplier(self) -> Multiplier:
        return "force"

    @property
    def is_holonomic(self) -> bool:
        return False

    @property
    def acts_in_plane(self) -> bool:
        return True

    @property
    def points(self) -> tuple[Marker, ...]:
        return self.rope.points

    @property
    def line(self) -> tuple[Marker, ...]:
        return self.rope.line

    @property
    def laws(self) -> tuple[Node, ...]:
        return ()

    @property
    def declared_length(self) -> Node | None:
        return None

    @property
    def radii(self) -> tuple[Node, ...]:
        return self.rope.radii


@dataclass(frozen=True)
class MeanTensionRow(Row):
    """The multiplier is the mean N of the tensions before and behind one of several rough wheels on a run of rope.

    That of its row `rope` is the mean of the first tension and the last one: N is that, and half of the friction on the
    wheels farther on (`ahead`, names of the rows of their slip), less half of that on those before (`passed`).
    """

    unit: ClassVar[str | None] = "N"

    name: str
    rope: str
    passed: tuple[str, ...]
    ahead: tuple[str, ...]

    @property
    def multiplier(self) -> Multiplier:
        return "force"

    @property
    def restricts(self) -> bool:
        return False

    @property
    def is_holonomic(self) -> bool:
        return False

    @property
    def acts_in_plane(self) -> bool:
        return True

    @property
    def points(self) -> tuple[Marker, ...]:
        return ()

    @property
    def line(self) -> tuple[Marker, ...]:
        return ()

    @property
    def laws(self) -> tuple[Node, ...]:
        return ()

    @property
    def declared_length(self) -> Node | None:
        return None

    @property
    def radii(self) -> tuple[Node, ...]:
        return ()
