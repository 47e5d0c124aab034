"""Rows of ropes that slip: over a rough wheel or drum the tension changes along the rope."""

from __future__ import annotations

from typing import ClassVar

from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.rows import Multiplier, RopeRow, Row
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node


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
