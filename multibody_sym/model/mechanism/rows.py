"""Rows: what each scalar constraint equation says, and which of them stand for joints that were cut.

Each kind has the `unit` of its multiplier in SI; None where its expression, `zero`, gives it one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, Literal

from multibody_sym.model.declaration.steps import is_flat, is_upright
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.markers import NOWHERE, Marker
from multibody_sym.model.mechanism.mass import ORIGIN
from multibody_sym.model.mechanism.rope_path import Bend
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO, Node

Multiplier = Literal["rope", "rod", "force", "multiplier"]


@dataclass(frozen=True)
class Row(ABC):
    """A scalar constraint equation: what all that handles rows asks of one. How it moves is in `kinematics/rows.py`."""

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
