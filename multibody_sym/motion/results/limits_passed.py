"""What a motion passes, and when: limits of joints, edges of boxes. Few runs need this, and load it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np

from multibody_sym.mechanics.law_elements import boxes_that_touch
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion, motion_of, state_of
from multibody_sym.mechanics.points import position
from multibody_sym.mechanics.row_records import BodyFace
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.motion.results.samples import EDGES_CROSS, Samples
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import slot

ERROR_OF_A_RUN: Final = 1e-9
"""How far beyond a limit a motion that rests there may be found."""


class PassedLimit(NamedTuple):
    """A limit (`lower`, `upper` or `velocity`) of a joint, `bound` in its SI unit, passed first at a sample."""

    joint: str
    limit: str
    bound: float
    unit: str
    sample: int


def limits_passed(
    mechanism: Mechanism, parameters: Sequence[float] | Floats, samples: Callable[[str], Floats]
) -> list[PassedLimit]:
    """Return the limits that a motion passes; `samples` gives those (m,) of a coordinate or speed by name."""
    units = MechanismUnits(mechanism).state
    values = {slot("parameters", i): float(x) for i, x in enumerate(parameters)}
    found = []
    for limit in mechanism.limits:
        position, speed = samples(limit.coordinate), np.abs(samples(limit.speed))
        sides = (("lower", limit.lower, position, -1), ("upper", limit.upper, position, 1))
        for name, declared, size, side in (*sides, ("velocity", limit.velocity, speed, 1)):
            unit = units[limit.coordinate if size is position else limit.speed]
            if declared is not None:
                bound = evaluate_float([declared], values)[0]
                beyond = np.flatnonzero(side * (size - bound) > ERROR_OF_A_RUN)
                found += [PassedLimit(limit.joint, name, bound, unit, int(k)) for k in beyond[:1]]
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Boxes in space whose edges pass into each other in a run: their corners touch faces, edges only what is declared.


_MOST: Final = 200
"""At how many samples it is looked, evenly spaced: each takes the places of all bodies anew."""
_DEPTH: Final = 1e-6
"""The part of a box by which an edge of another one is in it more than by the rounding of what touches."""
_ALONG: Final = ((1, 2), (0, 2), (0, 1))


def crossed_boxes(run: Samples) -> list[dict[str, Any]]:
    """Return for each contact of two boxes the first sample looked at in which an edge of one leads through the other.

    Both its ends are outside, so that no corner tells.
    """
    mechanism = run.ready.mechanism
    pairs = boxes_that_touch(mechanism.one_way)
    found: dict[str, float] = {}
    for k in np.unique(np.linspace(0, len(run) - 1, min(len(run), _MOST)).astype(int)).tolist() if pairs else ():
        at, q, u = float(run.t[k]), run.q[k].tolist(), run.u[k].tolist()
        motion = motion_of(mechanism, state_of(mechanism, float, at, q, u, run.parameters.tolist()))
        for name, faces in pairs.items():
            if name in found:
                continue
            first, second = (_Box.of(motion, sides) for sides in faces)
            if first.depth(second.edges()) > _DEPTH or second.depth(first.edges()) > _DEPTH:
                found[name] = at
    return [{"t": t, "kind": EDGES_CROSS, "element": name} for name, t in found.items()]


@dataclass(frozen=True)
class _Box:
    """A box in world axes: its `centre` (3,), and the ways from there to three faces, `halves` (3, 3)."""

    centre: Floats
    halves: Floats

    @classmethod
    def of(cls, motion: Motion, faces: Sequence[BodyFace]) -> _Box:
        """Return the box between six faces."""
        middles = np.array([position(motion, face.place) for face in faces], dtype=float)
        ways = middles - middles.mean(axis=0)
        halves: list[Floats] = []
        for way in ways:
            if all(abs(way @ other) <= 0.5 * (way @ way) for other in halves):
                halves.append(way)
        return cls(middles.mean(axis=0), np.array(halves))

    def edges(self) -> Floats:
        """Return the ends of the twelve edges (12, 2, 3)."""
        return np.array(
            [
                [self.centre + s * self.halves[b] + t * self.halves[c] + end * self.halves[a] for end in (-1.0, 1.0)]
                for a, (b, c) in enumerate(_ALONG)
                for s, t in product((-1.0, 1.0), repeat=2)
            ]
        )

    def depth(self, edges: Floats) -> float:
        """Return how deep the deepest of edges (n, 2, 3) leads through, relative to the box; 0 where none does."""
        scaled = (edges - self.centre) @ (self.halves / (self.halves**2).sum(axis=1)[:, None]).T
        before, whole = scaled[:, 0], scaled[:, 1] - scaled[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            crossed = np.stack([(-1.0 - before) / whole, (1.0 - before) / whole])
        still, inside = np.abs(whole) < _DEPTH, np.abs(before) < 1.0
        first = np.where(still, np.where(inside, 0.0, 1.0), crossed.min(axis=0)).max(axis=1)
        last = np.where(still, np.where(inside, 1.0, 0.0), crossed.max(axis=0)).min(axis=1)
        middle = before + ((first + last) / 2)[:, None] * whole
        leads = (first > 0.0) & (last < 1.0) & (first < last)
        return float((1.0 - np.abs(middle).max(axis=1))[leads].max(initial=0.0))
