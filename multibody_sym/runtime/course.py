"""What the loop in C has to know to go on at switches that were decided before: records for `turns.h`."""

from __future__ import annotations

from typing import NamedTuple

from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass

FORCE, LENGTH, ANGLE, SPEED = range(4)
Rule = tuple[int, int]
"""By what a switching function may exceed zero: a part of forces, of the model's size, or of the speed along a row."""


class Rub(NamedTuple):
    """The places of a normal and a tangent, the number of a friction part, which way it slides; whether from rest."""

    normal: int
    tangent: int
    part: int
    sense: int = 0
    begins: bool = False


@dataclass(frozen=True)
class ActiveRows:
    """What acts in a mode, by places among all rows: `mbs_acting`.

    `active` ones have a = 0, `pressing` and `apart` are normals.
    """

    active: tuple[int, ...] = ()
    slides: tuple[Rub, ...] = ()
    sticks: tuple[Rub, ...] = ()
    pressing: tuple[int, ...] = ()
    apart: tuple[int, ...] = ()


@dataclass(frozen=True)
class KnownTurn:
    """A switch that was decided: `mbs_turn`."""

    to: int
    touching: tuple[int, ...]
    kept: tuple[int, ...]
    rows: tuple[int, ...]
    signs: tuple[tuple[int, int], ...]
    after: ActiveRows
    before: ActiveRows
    cause: int
    way: int


@dataclass(frozen=True)
class Passage:
    """A turn that was taken: when, to which mode, after so many samples and steps, and the state (nq + nu,) then.

    `speed` is the largest that was met, `margins` those of the mode from then on.
    """

    time: float
    to: int
    written: int
    steps: int
    x: Floats
    speed: float
    margins: tuple[float, ...]
