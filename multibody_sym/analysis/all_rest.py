"""Whether positions of equilibrium that were found are all there are, where that can be known.

Forces at rest that are affine in the coordinates, with one regular root, have no other. One angle under forces that are
a trigonometric polynomial of it has as many positions as that has zeros on the unit circle. Hinges with parallel axes,
each body hung from the one before, under gravity alone: in the bodies' angles from the vertical V is a sum of cosines
of one angle each, so that every body stands or hangs, in 2^n ways.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.analysis.places import Places
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.kinematics.loads import applied, applied_generalized_forces
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.numerics.rank import exact, rank

_SAMPLES: Final = 4
_SEED: Final = 13
_ROUNDING: Final = 1e-9
_WAVES: Final = 64
_FEW: Final = 16
"""The largest degree that so many values on a circle tell from a function that is no polynomial."""
_ON_CIRCLE: Final = 1e-6


def are_all(places: Places, found: Sequence[Floats], free: Sequence[npt.NDArray[np.bool_]]) -> bool:
    """Return whether it is proved that these positions, none of which has others beside it, are all."""
    mechanism = places.mechanism
    if not mechanism.coordinates:
        return True
    if mechanism.rows or mechanism.kinks or any(x.any() for x in free):
        return False
    if any(body.quaternions for body in mechanism.bodies):
        return False
    try:
        return len(found) == _count(places)
    except UNDEFINED:
        return False


def _count(places: Places) -> int | None:
    """Return how many positions of equilibrium there are, None where it is not known."""
    if _affine(places):
        return 1
    if len(places.start) == 1 and places.periodic[0]:
        return _zeros_on_circle(places)
    return 2 ** len(places.start) if _hangs(places) else None


def _forces(places: Places, q: Floats) -> Floats:
    """Return the generalised forces (nu) at rest, with what prescribed motions exert."""
    motion = places.motion(q)
    return np.array(composite_body(places.mechanism, motion.state).forcing, dtype=float)


def _affine(places: Places) -> bool:
    """Return whether the forces at rest are affine in the coordinates, and determine them."""
    rng, size = np.random.default_rng(_SEED), len(places.start)
    scale = np.where(places.lengths, places.length, 1.0)
    here = _forces(places, places.start)
    columns = [_forces(places, places.start + scale * unit) - here for unit in np.eye(size)]
    slope = np.array(columns).T
    for _ in range(_SAMPLES):
        change = 10.0 * rng.uniform(-1.0, 1.0, size)
        there = _forces(places, places.start + scale * change)
        scatter = np.abs(slope) @ np.abs(change) + np.abs(here)
        if (np.abs(there - here - slope @ change) > _ROUNDING * scatter).any():
            return False
    return rank(slope, exact(slope)) == size


def _zeros_on_circle(places: Places) -> int | None:
    """Return how many zeros the forces on one angle have, if they are a trigonometric polynomial of low degree."""
    angles = 2 * np.pi * np.arange(_WAVES) / _WAVES
    values = np.array([_forces(places, np.array([x]))[0] for x in angles])
    waves = np.fft.fft(values) / _WAVES
    size = float(np.abs(waves).max())
    if size == 0.0 or np.abs(waves[_FEW + 1 : -_FEW]).max() > _ROUNDING * size:
        return None
    degree = max(k for k in range(_FEW + 1) if abs(waves[k]) > _ROUNDING * size)
    roots = np.roots([waves[k] for k in range(degree, -degree - 1, -1)])
    on_circle = np.abs(np.abs(roots) - 1.0) < _ON_CIRCLE
    apart = np.abs(roots[:, None] - roots[None, :]) + 2.0 * np.eye(len(roots))
    return int(on_circle.sum()) if degree and apart.min() > np.sqrt(_ON_CIRCLE) else None


def _hangs(places: Places) -> bool:
    """Return whether every coordinate turns a body about one direction, and nothing but gravity acts at rest."""
    mechanism = places.mechanism
    for body in mechanism.bodies:
        if len(body.steps) != len(body.free_steps) or [step.is_hinge for step in body.steps] not in ([], [True]):
            return False
    return _parallel(places) and not _pushed(places)


def _parallel(places: Places) -> bool:
    motion, axes = places.motion(places.start), []
    for index, (body, moved) in enumerate(zip(places.mechanism.bodies, motion.bodies, strict=True)):
        if body.q:
            axes.append(np.array(motion.rotation(index), dtype=float) @ np.array(moved.angular[0], dtype=float))
    return all(np.linalg.norm(np.cross(axes[0], axis)) < _ROUNDING for axis in axes[1:])


def _pushed(places: Places) -> bool:
    """Return whether declared forces act at rest, seen in a few positions."""
    rng = np.random.default_rng(_SEED)
    for _ in range(_SAMPLES):
        motion = places.motion(rng.uniform(-np.pi, np.pi, len(places.start)))
        forces = applied_generalized_forces(motion, applied(motion, weight=False))
        if np.abs(np.array(forces, dtype=float)).max(initial=0.0) > 0.0:
            return True
    return False
