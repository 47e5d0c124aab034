"""Poinsot's construction for a body of a system that turns without moments, from its start."""

from __future__ import annotations

from typing import Final

import numpy as np

from multibody_sym.answers.ask.principal_axes import inertia_in_numbers
from multibody_sym.answers.instant.instant import solved_start
from multibody_sym.errors import NoSolutionError
from multibody_sym.model.fields import AXES
from multibody_sym.model.system import System
from multibody_sym.pictures.polhodes import Polhodes
from multibody_sym.scalars.node import quantity

_FREE: Final = 1e-9
"""The part of omega x J omega and J alpha below which their sum is no moment."""


def polhodes_of(system: System, body: str) -> Polhodes:
    """Return the polhodes of a body. Raises ModelError for an unknown one, NoSolutionError where it is not free."""
    solved = solved_start(system)
    motion, place = solved.numbers.motion, solved.mechanism.body_index(body)
    world = np.array(motion.poses[place][0], dtype=float)
    tensor = inertia_in_numbers(motion, (place,))
    omega, alpha = (
        world.T @ np.array([solved.number(quantity(name, (body, axis))) for axis in AXES])
        for name in ("angular_velocity", "angular_acceleration")
    )
    turning, grown = np.cross(omega, tensor @ omega), tensor @ alpha
    if np.abs(turning + grown).max() > _FREE * float(np.abs([turning, grown]).max()):
        raise NoSolutionError(f"moments about its centre of mass act on {body}: it does not turn freely", number="N111")
    moments, axes = np.linalg.eigh(tensor)
    if not omega.any() or not moments[0] > 0.0:
        why = "does not turn" if not omega.any() else "has a moment of inertia that is zero"
        raise NoSolutionError(f"{body} {why}: it has no energy ellipsoid", number="N111")
    return Polhodes(body, moments, axes.T @ omega)
