"""Ropes that run over a wheel which could turn, and do not turn it: frictionless pulleys on bodies that are wheels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.rope_path import Bend
from multibody_sym.model.mechanism.rows import RopeRow
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import least_squares
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, slot
from multibody_sym.scalars.traversal import leaves
from multibody_sym.scalars.vectors import Vec

_ROUNDING: Final = 1e-9


def slipped_wheels(mechanism: Mechanism, parameters: Sequence[float]) -> list[str]:
    """Return for each rope and each wheel that it slips over what that means; `parameters` (np) in numbers.

    A pulley's body is a wheel where its joint lets it turn about the pulley's axis with the centre at rest; one
    without a radius, only if its centre of mass is there too. A wheel whose coordinate a constraint names is tied.
    A rough pulley turns its wheel by friction.
    """
    declared = mechanism.relative or mechanism
    if not any(bend.at.body >= 0 for row in declared.rows if isinstance(row, RopeRow) for bend in row.path[1:-1]):
        return []
    known = {slot("parameters", k): value for k, value in enumerate(parameters)}
    q = [evaluate_float([c.initial], known)[0] for c in declared.coordinates]
    motion = motion_of(declared, state_of(declared, float, 0.0, q, [0.0] * len(declared.speeds), parameters))
    tied = _tied(declared)
    found: dict[tuple[str, str], None] = {}
    for row in motion.mechanism.rows:
        for bend in row.path[1:-1] if isinstance(row, RopeRow) else ():
            frictionless = bend.grip is None and not bend.rough
            if frictionless and bend.at.body >= 0 and any(q not in tied for q in _turning(motion, bend)):
                found[row.name, motion.mechanism.bodies[bend.at.body].name] = None
    return [
        f"rope {rope} slips over {wheel} without turning it: a pulley is without friction whatever it stands on. "
        f"Let it turn with the rope (a pulley {{body: {wheel}, radius: ..}}), or put it on what carries {wheel}"
        for rope, wheel in found
    ]


def _turning(motion: Motion, bend: Bend) -> Iterator[int]:
    """Yield a coordinate of each freedom of its own joint by which a pulley's body turns about the pulley's axis."""
    body, moved = motion.mechanism.bodies[bend.at.body], motion.bodies[bend.at.body]
    centre = np.array(motion.point(bend.at), dtype=float)
    radius, *components = (float(x) for x in motion.state.values([bend.radius, *bend.axis]))
    com = np.array(motion.masses[bend.at.body].com, dtype=float) - centre
    axis = np.array(components)
    if radius == 0.0 and np.linalg.norm(np.cross(axis, com)) > _ROUNDING * (1.0 + float(np.linalg.norm(centre))):
        return
    partial = dict(zip(body.u, zip(moved.linear, moved.angular, strict=True), strict=True))
    for free in body.free_steps:
        linear, angular = zip(*(partial[k] for k in free.u), strict=True)
        if _turns(linear, angular, centre, axis):
            yield free.q[-1]


def _turns(linear: Sequence[Vec], angular: Sequence[Vec], centre: Floats, axis: Floats) -> bool:
    """Return whether freedoms (n x 3 each, of the body's origin) turn a body about an axis through a centre."""
    spin = np.array(angular, dtype=float)
    moving = np.array(linear, dtype=float) + np.cross(spin, centre)
    wanted = np.concatenate([axis, np.zeros(3)])
    rates = np.hstack([spin, moving]).T
    missed = wanted - rates @ least_squares(rates, wanted)
    return float(np.linalg.norm(missed)) <= _ROUNDING


def _tied(mechanism: Mechanism) -> set[int]:
    """Return the coordinates that constraints name, or whose speeds they name."""
    named: list[Node] = []
    for row in mechanism.rows:
        named += row.laws
    found = {leaf.data for leaf in leaves(named, "slot")}
    tied = {place for array, place in found if array == "q"}
    for body in mechanism.bodies:
        tied.update(free.q[-1] for free in body.free_steps if any(("u", u) in found for u in free.u))
    return tied
