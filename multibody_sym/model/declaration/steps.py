"""Elementary motions, of which every joint is made."""

from __future__ import annotations

from dataclasses import dataclass

from multibody_sym.model.declaration.values import Point
from multibody_sym.scalars.node import ZERO, Node


@dataclass(frozen=True)
class Step:
    """An elementary motion by one coordinate: `translate` along, `rotate` about or `screw` along and about `axis`.

    A screw advances by `lead` a radian. `letter` ends the coordinate's name where the joint has several. With `motion`,
    an expression of t, it moves as given and has no coordinate.
    """

    kind: str
    axis: Point
    letter: str = ""
    lead: Node = ZERO
    motion: Node | None = None

    @property
    def unit(self) -> str:
        """The unit of the coordinate."""
        return "m" if self.kind == "translate" else "rad"
