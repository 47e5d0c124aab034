"""Rows of what slides: the force of a normal row brings friction along."""

from __future__ import annotations

from typing import ClassVar

from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.rows import Multiplier, Row
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node


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
