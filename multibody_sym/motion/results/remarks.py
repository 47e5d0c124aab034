"""What samples of a run show that no real mechanism does, or no number says: each as an event with its first time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.motion.results.samples import Samples
from multibody_sym.scalars.arrays import Floats

NO_VALUE: Final = "no value"
PULLING: Final = "wheel would pull"
PUSHING: Final = "rope would push"
ENERGY: Final = "energy grows"
TOO_FAR: Final = "too far for its steps"
EDGES_CROSS: Final = "edges cross"

_ROUNDING: Final = 1e-9
_PART: Final = 0.1
_GROWTH: Final = 1e5


def pushing_ropes(run: Samples) -> list[dict[str, Any]]:
    """Return each rope's first sample at which it would push: a real one goes slack there."""
    tensions = run.tensions.items()
    return _first(run, PUSHING, {name: x < -_ROUNDING * np.abs(x).max(initial=0.0) for name, x in tensions})


def pulling_wheels(run: Samples) -> list[dict[str, Any]]:
    """Return each rolling row's first sample at which its plane would hold the wheel back: a real one lifts off there.

    Beyond rounding of all constraints' forces, and of T + V over the wheel's radius.
    """
    if not run.ready.told.rolls or len(run) == 0:
        return []
    energy = np.abs(run.kinetic_energy) + np.abs(run.potential_energy)
    largest = np.max([np.abs(force) for force in run.multipliers.values()], axis=0)
    found: dict[str, NDArray[np.bool_]] = {}
    for name, radius in run.ready.wheels.items():
        felt = largest + (energy / radius if radius > 0.0 else 0.0)
        found[name] = run.multipliers[name] < -_ROUNDING * np.nanmax(felt, initial=0.0)
    return _first(run, PULLING, found)


def outputs_without_value(run: Samples) -> list[dict[str, Any]]:
    """Return each output's first sample at which it is no finite number, but for outputs of withheld reactions."""
    untold = run.ready.told.untold
    return _first(run, NO_VALUE, {name: ~np.isfinite(x) for name, x in run.outputs.items() if name not in untold})


def growing_energy(run: Samples, accuracy: float) -> list[dict[str, Any]]:
    """Return the first sample at which energy has come from nowhere, if it has; `accuracy` is that of the run.

    Where nothing drives the mechanism: T + V rises above the least that it was by a tenth of the greatest T, and by
    more than the accuracy of V. Else, where nothing is given in time: T grows 1e5 times past all energies of the first
    half; a force that lasts from the start gives at most a few dozen times there.
    """
    told, kinetic, total = run.ready.told, run.kinetic_energy, run.energy
    kept = np.isfinite(kinetic) & np.isfinite(total)
    driven = told.driven
    if told.drives or not kept.any() or (driven and told.moved_by_time):
        return []
    if not kept.all():
        kinetic, total = kinetic[kept], total[kept]
    felt = accuracy * np.maximum(1.0, _accumulate(np.maximum, np.abs(total - kinetic)))
    if driven:
        half = (len(kinetic) + 1) // 2
        first = (kinetic + np.abs(total - kinetic))[:half]
        grown = kinetic > _GROWTH * (float(first.max()) + felt[half - 1])
        grown[:half] = False
    else:
        rise = total.copy()
        rise -= _accumulate(np.minimum, total.copy())
        enough = bool(rise.max() > _PART * kinetic.max() + felt[-1])
        felt += _PART * _accumulate(np.maximum, kinetic.copy())
        grown = (rise > felt) & enough
    at = np.flatnonzero(kept)[grown]
    return [{"t": float(run.t[at[0]]), "kind": ENERGY, "element": "total energy"}] if len(at) else []


def coordinates_too_far(
    run: Samples, pairs: Sequence[tuple[int, int]], step: float, least: float
) -> list[dict[str, Any]]:
    """Return each coordinate's first sample at which the numbers beside it are further away than it moves in a step.

    `pairs`: indices of coordinates and of the speeds that are their rates; `step`: the mean step of the run in s. A
    speed that is never above the `least` moves nothing. Such a coordinate stands still, or moves by leaps.
    """
    names, found = run.ready.told.coordinates, {}
    for a, b in pairs:
        fastest = float(np.nanmax(np.abs(run.u[:, b]), initial=0.0))
        if fastest > least and step > 0.0:
            found[names[a]] = np.spacing(np.abs(run.q[:, a])) > fastest * step
    return _first(run, TOO_FAR, found)


def accuracy_of(step: float | None, rtol: float, atol: float) -> float:
    """Return how exactly a method was asked to integrate; fixed steps are not asked at all."""
    return math.sqrt(_ROUNDING) if step else max(_ROUNDING, rtol, atol)


def _first(run: Samples, kind: str, held: Mapping[str, NDArray[np.bool_]]) -> list[dict[str, Any]]:
    """Return for each element the first sample at which something holds (m,), as an event."""
    at = {name: np.flatnonzero(holds) for name, holds in held.items()}
    return [{"t": float(run.t[k[0]]), "kind": kind, "element": name} for name, k in at.items() if len(k)]


def _accumulate(extreme: np.ufunc, values: Floats) -> Floats:
    """Return the extreme of values up to each, in their place: a run may have a million."""
    extreme.accumulate(values, out=values)
    return values
