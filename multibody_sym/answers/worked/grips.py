"""Tensions of ropes that rub on wheels, as a book has them: one on each side of a rough wheel, with belt friction."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.ropes import pull, segments, wheel_at
from multibody_sym.kinematics.rows import coefficients, friction_factors, row_motion
from multibody_sym.kinematics.wrenches import Wrench
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import FrictionPart
from multibody_sym.model.mechanism.rope_rows import RopeSlipRow
from multibody_sym.model.mechanism.rows import RopeRow
from multibody_sym.model.mechanism.sliding_rows import SlidingRow
from multibody_sym.records import dataclass
from multibody_sym.scalars.limits import tension_ratio
from multibody_sym.scalars.vectors import S, Vec


@dataclass(frozen=True)
class Grip:
    """A rough wheel under a rope: the row of its `slip`, and the symbols of the tensions before and behind it."""

    slip: str
    before: Any
    behind: Any
    slides: bool


def rubbing(mechanism: Mechanism) -> Collection[str]:
    """Return the ropes that rub on wheels; their runs have a tension each, and one more for each rough wheel."""
    plain = (row.normal if isinstance(row, SlidingRow) else row for row in mechanism.rows)
    return {row.told[0] for row in plain if isinstance(row, RopeRow) and row.rubs}


def tension_wrenches(row: RopeRow, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> Iterator[list[Wrench]]:
    """Yield the wrenches on all bodies of a unit of each tension of a run, along its path; they act at the rims."""
    parts, _ = segments(motion, row.path, row.straight)
    rough = [k for k, bend in enumerate(row.path[1:-1], 1) if bend.rough] if row.rubs else []
    for k in rough:
        wheel = wheel_at(motion, row.path, k)
        parts[k - 1] = replace(parts[k - 1], grips=(parts[k - 1].grips[0], wheel))
        parts[k] = replace(parts[k], grips=(wheel, parts[k].grips[1]))
    cuts = [0, *rough, len(parts)]
    for first, last in pairwise(cuts):
        yield pull(motion, parts[first:last], [1] * (last - first), bias).of_body


def slipping_ratio(slip: str, motion: Motion, bias: Sequence[tuple[Vec, Vec]]) -> tuple[bool, S] | None:
    """Return where a rope slips whether its tension is greater before the wheel, and how many times: exp(mu wrap).

    None where it grips. Where friction is smooth near rest the tension before it is told by that behind it.
    """
    rows = (row for row in motion.mechanism.rows if isinstance(row, SlidingRow))
    for sliding in (each for row in rows for each in row.frictions if each.rows[0].name == slip):
        along = [row_motion(row, motion, bias) for row in sliding.rows]
        (coefficient,) = friction_factors(replace(sliding, sense=-1), along, motion)
        return sliding.sense < 0 or sliding.regularised is not None, tension_ratio(coefficient)
    return None


def gripping_ratio(part: FrictionPart, motion: Motion) -> S:
    """Return how many times the less tension the greater one may be where a rope grips a wheel."""
    (static,) = coefficients(motion, part.rows, [part.static])
    return tension_ratio(static)


def is_grip(part: FrictionPart) -> bool:
    """Return whether friction is that of a rope on a rough wheel."""
    return isinstance(part.rows[0], RopeSlipRow)
