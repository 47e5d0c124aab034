"""Directions in words: up, to the right, or their components."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from multibody_sym.algebra.quotients import Quotient
from multibody_sym.answers.worked.exactly import Exactly, unit_sign
from multibody_sym.answers.worked.record import Words

_LEFT_RIGHT: Final = {(0, 1): "to the right", (0, -1): "to the left"}
_LONGEST: Final = 40


def short(direction: Words, instead: Words) -> Words:
    """Return a direction, or other words where its components are long."""
    return direction if sum(len(str(word)) for word in direction) <= _LONGEST else instead


class Directions:
    """How directions are called, given which way is up (world, the sign of each axis; zeros where there is no up)."""

    def __init__(self, exactly: Exactly, gravity: Sequence[Quotient], *, plane: bool) -> None:
        signs = [-s for s in unit_sign(gravity)]
        self._up = signs if sum(map(abs, signs)) == 1 else [0, 0, 0]
        self._exactly, self.plane = exactly, plane

    def of(self, vector: Sequence[Quotient]) -> tuple[Quotient, Words]:
        """Return a vector's size and direction; the size of one along no axis is 1 and the words hold components."""
        signs = unit_sign(vector)
        along = [k for k in range(3) if signs[k]]
        if len(along) == 1:
            k = along[0]
            return vector[k] * signs[k], (self._word(k, signs[k]),)
        return self._exactly.constant(1), ("along ", *self.components(vector))

    def turning(self, vector: Sequence[Quotient]) -> tuple[Quotient, Words]:
        """Return the size and direction of a moment."""
        size, words = self.of(vector)
        if self.plane and not vector[2].is_zero:
            return size, ("counter-clockwise" if vector[2].sample > 0 else "clockwise",)
        return size, words

    def _word(self, axis: int, sign: int) -> str:
        if self._up[axis]:
            return "up" if sign == self._up[axis] else "down"
        upright = self.plane and axis == 0 and (self._up[1] == 1 or not any(self._up))
        letter = "xyz"[axis]
        return _LEFT_RIGHT[0, sign] if upright else f"along {letter}" if sign > 0 else f"against {letter}"

    def components(self, vector: Sequence[Quotient]) -> Words:
        """Return a vector's components in brackets, two in the plane."""
        shown: list[Any] = ["("]
        for k, x in enumerate(vector[: 2 if self.plane else 3]):
            shown += [", "] if k else []
            shown.append(self._exactly.written(x))
        return (*shown, ")")
