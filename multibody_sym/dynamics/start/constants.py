"""Constants of a run, measured in the assembled position: lengths of ropes, angles of tangents."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final

import numpy as np

from multibody_sym.dynamics.constraints.closing import Rows
from multibody_sym.errors import ModelError, at
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.ropes import NoDirectionError, segments, sides, tangent_direction, wrap_angle
from multibody_sym.kinematics.surface_angles import tangent_angle, tangent_components
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.mass import IDENTITY
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.rope_rows import RopeSlipRow
from multibody_sym.model.mechanism.rows import RopeRow
from multibody_sym.model.mechanism.start_constants import Measure, RopeLength, TangentAngle, TangentDirection, WrapAngle
from multibody_sym.numerics.arrays import UNDEFINED, Floats

_PARALLEL: Final = 1e-9


def measured_rows(mechanism: Mechanism) -> frozenset[int]:
    """Return the rows that any position satisfies, because their ropes take their lengths from it."""
    ropes = {m.row for entry in mechanism.parameters if isinstance(m := entry.measure, RopeLength)}
    return frozenset(k for k, row in enumerate(mechanism.rows) if row.name in ropes)


def with_constants(mechanism: Mechanism, parameters: Sequence[float], q: Floats) -> list[float]:
    """Return the parameter vector (np) with what is measured in the position q (nq) in place of its zeros.

    Raises ModelError where an expression has no finite value there.
    """
    measures = [(place, entry.measure) for place, entry in enumerate(mechanism.parameters) if entry.measure]
    found = list(parameters)
    # lengths come last: what is wound counts from the direction of the tangent
    for kinds in ((TangentAngle, TangentDirection, WrapAngle), (RopeLength,)):
        asked = [(place, measure) for place, measure in measures if isinstance(measure, kinds)]
        if asked:
            with valued():
                motion = Rows(mechanism, found, []).motion(q, np.zeros(len(mechanism.speeds)))
                for place, measure in asked:
                    found[place] = _measured(motion, measure)
    return found


def seen_axis(motion: Motion, measure: TangentAngle) -> Point:
    """Return the axis of ground that the tangent t1 follows at a state in floats: x, or y where x is normal to it."""
    x, y, _ = IDENTITY
    return x if np.hypot(*tangent_components(motion, measure, x)) >= _PARALLEL else y


def _measured(motion: Motion, measure: Measure) -> float:
    if isinstance(measure, TangentAngle):
        return float(tangent_angle(motion, measure, seen_axis(motion, measure))) + 0.0  # no -0
    slackening = [(row, element.path) for element in motion.mechanism.one_way for row in element.rows]
    taut = [(row, motion.mechanism.row_path(k)) for k, row in enumerate(motion.mechanism.rows)]
    row, path = next((row, path) for row, path in (*slackening, *taut) if row.name == measure.row)
    with at(*path):
        if isinstance(row, RopeSlipRow):
            _verify_side(motion, row.rope, row.bend)
            return float(wrap_angle(motion, row.rope, row.bend))
        assert isinstance(row, RopeRow)
        if isinstance(measure, TangentDirection):
            _verify_side(motion, row, -measure.end)
            return float(tangent_direction(motion, row, measure.end)) + 0.0
        return float(segments(motion, row.path)[1])


def _verify_side(motion: Motion, rope: RopeRow, bend: int) -> None:
    """Raise ModelError where nothing tells on which side of a wheel a rope runs, with both readings."""
    if sides(motion, rope.path)[bend] != 0:
        return
    name = rope.path[bend].pulley
    with at("path"):
        raise ModelError(
            f"what comes before pulley {name} on the path and what comes behind lie in one line with its centre, so "
            f'that no bend tells on which side the rope runs: wrap: {{{name}: "+"}} leads it counter-clockwise about '
            f'the axis, wrap: {{{name}: "-"}} clockwise',
            number="M115",
        )


@contextmanager
def valued() -> Iterator[None]:
    """Raise ModelError where an expression inside has no finite value, or a rope leads nowhere."""
    try:
        yield
    except NoDirectionError:
        raise
    except UNDEFINED as error:
        raise ModelError(f"an expression has no finite value at the start ({error})", number="M115") from None
