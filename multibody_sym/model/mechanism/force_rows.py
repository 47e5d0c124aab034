"""Rows of friction in joints: those that define what a reaction presses with, and those along which it rubs."""

from __future__ import annotations

from typing import ClassVar

from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.rows import Multiplier, Row, VelocityRow
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ONE, ZERO, Node


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
