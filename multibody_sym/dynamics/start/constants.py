"""Constants of a run, measured in the assembled position: lengths and sides of ropes, angles of tangents."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final

import numpy as np

from multibody_sym.dynamics.constraints.closing import Rows
from multibody_sym.errors import ModelError, at
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.ropes import (
    NoDirectionError,
    inner_side,
    segments,
    sides,
    tangent_direction,
    wrap_angle,
)
from multibody_sym.kinematics.surface_angles import tangent_angle, tangent_components
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.mass import IDENTITY
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.rope_rows import RopeSlipRow
from multibody_sym.model.mechanism.rows import RopeRow
from multibody_sym.model.mechanism.start_constants import (
    Measure,
    RopeLength,
    RopeSide,
    TangentAngle,
    TangentDirection,
    WrapAngle,
)
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
    found = with_sides(mechanism, parameters, q)
    # lengths come last: what is wound counts from the direction of the tangent
    for kinds in ((TangentAngle, TangentDirection, WrapAngle), (RopeLength,)):
        found = _with(mechanism, found, q, kinds)
    return found


def with_sides(mechanism: Mechanism, parameters: Sequence[float], q: Floats) -> list[float]:
    """Return the parameter vector (np) with the sides on which ropes have wheels inside their bends in a position."""
    return _with(mechanism, parameters, q, (RopeSide,))


def verify_sides(mechanism: Mechanism, parameters: Sequence[float], q: Floats) -> None:
    """Raise ModelError where the sides that ropes have in a position are not those with which it was found."""
    there = with_sides(mechanism, parameters, q)
    found = (e.measure for e, x, y in zip(mechanism.parameters, parameters, there, strict=True) if x != y)
    for measure in (measure for measure in found if isinstance(measure, RopeSide)):
        with at("constraints", measure.rope, "path"):
            raise _which_side(measure.pulley, "start values and what the constraints make of them lie on both sides")


def _which_side(pulley: str, why: str) -> ModelError:
    return ModelError(
        f'{why}, so that no bend tells on which side the rope runs: wrap: {{{pulley}: "+"}} leads it counter-clockwise '
        f'about the axis, wrap: {{{pulley}: "-"}} clockwise',
        number="M115",
    )


def _with(
    mechanism: Mechanism, parameters: Sequence[float], q: Floats, kinds: tuple[type[Measure], ...]
) -> list[float]:
    """Return the parameter vector (np) with what some kinds of measure find in the position q (nq)."""
    found = list(parameters)
    asked = [(k, entry.measure) for k, entry in enumerate(mechanism.parameters) if isinstance(entry.measure, kinds)]
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
    if isinstance(measure, RopeSide):
        ropes = (row for row, _ in (*slackening, *taut) if isinstance(row, RopeRow) and row.told[0] == measure.rope)
        return float(inner_side(motion, next(b for row in ropes for b in row.path if b.pulley == measure.pulley)))
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
        before = f"what comes before pulley {name} on the path and what comes behind lie in one line with its centre"
        raise _which_side(name, before)


@contextmanager
def valued() -> Iterator[None]:
    """Raise ModelError where an expression inside has no finite value, or a rope leads nowhere."""
    try:
        yield
    except NoDirectionError:
        raise
    except UNDEFINED as error:
        divides = isinstance(error, ZeroDivisionError)
        why = "it divides by zero" if divides else "a root, power, logarithm or the like has none there"
        cure = "correct it, or start elsewhere (initial: {q: ..})"
        raise ModelError(f"an expression has no finite value at the start: {why}; {cure}", number="M115") from None
