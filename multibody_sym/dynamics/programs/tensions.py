"""Tensions of ropes: one for each run, one more for each wheel between its ends on which a run rubs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.rows import friction_on
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.rows import RopeRow
from multibody_sym.model.mechanism.sliding_rows import SlidingRow
from multibody_sym.scalars.node import ONE
from multibody_sym.scalars.vectors import S


def ropes(mechanism: Mechanism) -> Iterator[RopeRow]:
    """Yield the rows of all runs of ropes, those too that are slack in the mechanism's mode."""
    plain = [row.normal if isinstance(row, SlidingRow) else row for row in mechanism.rows]
    slack = [row for element in mechanism.one_way for row in element.normals]
    named = {row.name: row for row in (*plain, *slack) if isinstance(row, RopeRow)}
    yield from named.values()


def tensions(motion: Motion, multipliers: Sequence[S], row: RopeRow) -> list[S]:
    """Return the tensions of a run of rope along its path: of one that rubs before and behind each rough wheel."""
    places = {row.name: k for k, row in enumerate(motion.mechanism.rows)}
    if row.name not in places:
        return [0 for _ in row.components]
    mean = multipliers[places[row.name]]
    if not row.rubs:
        return [mean]
    (half,) = motion.state.values([ONE / 2])
    halves: list[S] = []
    for slip in row.rubs:
        parts = [half * (factor * multipliers[k]) for k, factor in friction_on(slip, motion)]
        halves.append(parts[0] if parts else 0)
    return [sum(halves[k:], sum((-x for x in halves[:k]), mean)) for k in range(len(halves) + 1)]


def tensions_by_name(motion: Motion, multipliers: Sequence[S]) -> Mapping[str, S]:
    """Return every tension by what it is asked by: the rope, or `rope.1`, `rope.2`, ... along its path."""
    return {
        name: tension
        for row in ropes(motion.mechanism)
        for name, tension in zip(row.asked, tensions(motion, multipliers, row), strict=True)
    }
