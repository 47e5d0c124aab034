"""What is said where no position of equilibrium was found: that there may be others, or why there seem to be none."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Final

import numpy as np

from multibody_sym.analysis.deviations import Flow
from multibody_sym.dynamics.constraints.closing import Rows, closed_near
from multibody_sym.errors import NoSolutionError
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import UNDEFINED, Floats

_POSITIONS: Final = 4
_ALIKE: Final = 1e-9
_MOST_NAMED: Final = 4


def none_found(
    flow: Flow, rows: Rows, guesses: Iterable[Floats], *, in_time: bool, one_way: str = ""
) -> NoSolutionError:
    """Return the error for a search that found nothing from guesses (nq): the start, and others with open rows.

    `one_way`: what is to be said of what holds one way only, `tried` or `stood`.
    """
    start, *tried = islice(guesses, 2 * _POSITIONS)
    found = list(islice(_accelerations(flow, rows, [start, *tried]), _POSITIONS))
    size = max((float(np.abs(x).max(initial=0.0)) for x in found), default=0.0)
    if size > 0.0 and len(found) == _POSITIONS and all((np.abs(x - found[0]) <= _ALIKE * size).all() for x in found):
        alike = f"in {len(found)} positions the system at rest accelerates alike ({_named(flow, found[0], size)})"
        return NoSolutionError(f"no position of equilibrium was found: {alike}{one_way}", number="N109")
    where = f"near the start{' in the time of a search' if in_time else ''}{_inputs(flow, start)}"
    return NoSolutionError(
        f"no position of equilibrium was found {where}{one_way}; give other initial coordinates", number="N109"
    )


def tried(mechanism: Mechanism, sets: tuple[int, int], *, in_time: bool) -> str:
    """Return how many `sets` of what may close were tried closed, of how many, and where friction is asked about.

    `in_time`: whether the time of a search ended before it had looked everywhere.
    """
    names, (count, every) = _closing(mechanism), sets
    either = f", and none with {names} closed either" if names else ""
    either += ", each for a part of that time" if in_time and every > 1 else ""
    if count < every:
        either = f"; of {every} sets of {names} that may be closed {count} {'were' if count > 1 else 'was'} tried"
    rubbing = left_out(mechanism)
    rub = f"; friction ({', '.join(rubbing[:_MOST_NAMED])}) is left out: equilibrium --vary NAME tells what it holds"
    return either + (rub if rubbing else "")


def left_out(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the declared elements whose friction is left out; what rolls goes on rolling."""
    rubbing = (x for x in mechanism.one_way if x.frictions and x.path[0] != "constraints")
    return tuple(dict.fromkeys(x.path[-1] for x in rubbing))


def stood(mechanism: Mechanism) -> str:
    """Return that what holds one way only was taken as it is at the start."""
    names = _closing(mechanism)
    return f", with {names} closed or open as at the start (equilibrium tells where else it rests)" if names else ""


def _closing(mechanism: Mechanism) -> str:
    """Return the names of what may close."""
    closing = [x.name for x in mechanism.one_way if x.unilateral]
    return ", ".join(closing[:_MOST_NAMED]) + (", .." if len(closing) > _MOST_NAMED else "")


def _accelerations(flow: Flow, rows: Rows, tried: Iterable[Floats]) -> Iterator[Floats]:
    """Yield the accelerations (nu) at rest in the positions that close the rows."""
    for guess in tried:
        try:
            q = closed_near(rows, guess)
            if q is not None:
                yield flow.accelerations(q, np.zeros(len(rows.mechanism.speeds)))
        except (*UNDEFINED, np.linalg.LinAlgError):
            continue


def _named(flow: Flow, udot: Floats, size: float) -> str:
    pairs = zip(flow.mechanism.speeds, udot.tolist(), strict=True)
    moving = [f"{speed.name}' = {x:.6g} {speed.unit}^2" for speed, x in pairs if abs(x) > _ALIKE * size]
    return ", ".join([*moving[:_MOST_NAMED], *(["..."] if len(moving) > _MOST_NAMED else [])])


def _inputs(flow: Flow, q: Floats) -> str:
    """Return which inputs act, and that they do so as at the start."""
    values = np.ravel(flow.known(q, np.zeros(len(flow.mechanism.speeds)))[4])
    acting = [f"{name} = {x:.6g}" for name, x in zip(flow.mechanism.inputs, values.tolist(), strict=True) if x]
    return f" under {', '.join(acting)}, as at t = 0" if acting else ""
