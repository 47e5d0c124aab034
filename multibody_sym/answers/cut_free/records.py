"""Records of bodies cut free: what pulls at them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.scene.items import Anchor

Body = int
Key = tuple[str, ...]
"""What a force is: weight, load, joint with its component, tension, row."""
Values = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, eq=False)
class Pull:
    """A force or couple (`turns`) on a body at a place: `value` times `way` (world), which is the way of its letter.

    `path` is where it is declared. `both`: a figure of the whole has it at both ends, as it has pulls of ropes. `open`:
    it is not unique; its value is one of those that are possible, or unknown (nan).
    """

    key: Key
    path: tuple[str, ...]
    at: Anchor
    way: Floats
    value: float
    turns: bool
    both: bool = False
    open: bool = False

    @property
    def vector(self) -> Floats:
        """The force or couple (world)."""
        return self.value * self.way

    @property
    def size(self) -> float:
        """Its size in N or N*m."""
        return float(np.linalg.norm(self.vector))

    @property
    def is_applied(self) -> bool:
        """Whether it is a weight or a declared force, no reaction."""
        return self.key[0] in ("weight", "load", "drive")
