"""Whether positions of equilibrium that were found are all there are, where that can be known.

Forces at rest that are affine in the coordinates, with one regular root, have no other. One angle under forces that are
a trigonometric polynomial of it has as many positions as that has zeros on the unit circle. Hinges with parallel axes,
each body hung from the one before, under gravity alone: in the bodies' angles from the vertical V is a sum of cosines
of one angle each, so that every body stands or hangs, in 2^n ways. That forces are such is seen from the expressions
they are, not from their values somewhere: a weak cubic term far away or a narrow pulse would escape samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.analysis.degrees import polynomial_degree, wave_degree
from multibody_sym.analysis.places import Places
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.kinematics.loads import applied, applied_generalized_forces
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.state import state_of
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.numerics.rank import exact, rank
from multibody_sym.scalars.node import ZERO, Node, as_node, slot

_ROUNDING: Final = 1e-9
_WAVES: Final = 64
_FEW: Final = 16
"""The largest degree whose zeros are counted, from so many values on a circle."""
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


def _at_rest(places: Places) -> Motion:
    """Return the motion at rest over Nodes, with numbers for all but the coordinates."""
    mechanism = places.mechanism
    q = [slot("q", k) for k in range(len(places.start))]
    parameters = [as_node(float(x)) for x in places.rows.parameters]
    return motion_of(mechanism, state_of(mechanism, Node, ZERO, q, [ZERO] * len(mechanism.speeds), parameters))


def _written_forces(places: Places) -> tuple[list[Node], list[Node]]:
    """Return the generalised forces at rest as expressions, and the coordinates in them."""
    motion = _at_rest(places)
    return [as_node(x) for x in composite_body(places.mechanism, motion.state).forcing], list(motion.state.q)


def _affine(places: Places) -> bool:
    """Return whether the forces at rest are affine in the coordinates, and determine them."""
    forces, coordinates = _written_forces(places)
    degree = polynomial_degree(forces, coordinates)
    if degree is None or degree > 1:
        return False
    scale = np.where(places.lengths, places.length, 1.0)
    here = _forces(places, places.start)
    slope = np.array([_forces(places, places.start + step) - here for step in np.diag(scale)])
    return rank(slope, exact(slope)) == len(here)


def _zeros_on_circle(places: Places) -> int | None:
    """Return how many zeros the forces on one angle have, if they are a trigonometric polynomial of low degree."""
    forces, (angle,) = _written_forces(places)
    highest = wave_degree(forces, angle)
    if highest is None or highest > _FEW:
        return None
    angles = 2 * np.pi * np.arange(_WAVES) / _WAVES
    values = np.array([_forces(places, np.array([x]))[0] for x in angles])
    waves = np.fft.fft(values) / _WAVES
    size = float(np.abs(waves).max())
    degree = max((k for k in range(highest + 1) if abs(waves[k]) > _ROUNDING * size), default=0)
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
    """Return whether declared forces act at rest, or may: what they do is not seen to be nothing."""
    motion = _at_rest(places)
    forces = applied_generalized_forces(motion, applied(motion, weight=False))
    return any(as_node(x).shadow != 0 for x in forces)
