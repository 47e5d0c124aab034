"""What a picture shows beside the mechanism itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from multibody_sym.records import dataclass
from multibody_sym.scene.items import ArrowItem, Path


@dataclass(frozen=True)
class Shown:
    """What a picture shows: `names` of bodies and joints, weights and other `forces`, `reactions` at its instant.

    `not_unique` tells of which elements they could be others too, and how that is shown; `undrawn` are the letters of
    those that are left out. What is declared at or under a path of `marked` stands out, with a word beside it.
    """

    names: bool = True
    forces: bool = False
    reactions: tuple[ArrowItem, ...] = ()
    not_unique: tuple[str, ...] = ()
    undrawn: tuple[str, ...] = ()
    marked: Mapping[Path, str] = field(default_factory=dict)

    def mark_of(self, path: Path) -> str | None:
        """Return the word of what is declared at a path, None where nothing marks it."""
        return next((word for marked, word in self.marked.items() if path[: len(marked)] == marked), None)
