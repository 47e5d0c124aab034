"""Whether a run goes by time stepping (`motion.runs.contact_steps`), and by which step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from multibody_sym.errors import ModelError
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.model.settings import Settings
from multibody_sym.motion.methods.table import AUTO, MOREAU
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import ZERO

if TYPE_CHECKING:  # runs without contacts need none of it
    from multibody_sym.dynamics.contact.contact_problem import OneWayRows

MANY_CONTACTS: Final = 1000
"""Contacts, closed or not, of a run that goes by time stepping where neither method nor step nor tolerance is given."""
_BY_SIZE: Final = 1.6e-3
"""The part of the time in which the fastest passes the model's size, or something falls through it, that is a step."""
_OF_FORCES: Final = frozenset(
    {"acceleration", "angular_acceleration", "''", "reaction", "tension", "multiplier", "power"}
)
"""Quantities that steps do not tell: forces and accelerations at an instant."""


def steps_over_contacts(settings: Settings, declared: Mechanism) -> bool:
    """Return whether a run goes by time stepping: by the method that is asked for, or since contacts are many."""
    if settings.method == MOREAU:
        return True
    left = settings.method == AUTO and not any((settings.step, settings.rtol, settings.atol))
    many = sum(x.unilateral for x in declared.one_way) > MANY_CONTACTS
    return left and many and not any(_refused(declared).values())


def default_step(rows: OneWayRows) -> float:
    """Return the step (s) of a run that asks for none, by the contacts at its start."""
    length, gravity = rows.scale.length, np.array(rows.motion.gravity, dtype=float)
    return _BY_SIZE * length / max(rows.scale.speed, math.sqrt(float(np.linalg.norm(gravity)) * length))


def verify_contacts(declared: Mechanism) -> None:
    """Raise ModelError for what time stepping does not take."""
    for what, names in _refused(declared).items():
        if names:
            raise refusal(f"takes no {what} ({', '.join(names[:3])})")
    if not any(x.unilateral for x in declared.one_way):
        raise refusal("steps over contacts, and nothing here touches")


def refusal(why: str) -> ModelError:
    """Return the error of what time stepping does not take."""
    error = ModelError(f"method {MOREAU} {why}: choose another method", number="M117")
    error.under("method").under("simulation")
    return error


def _refused(declared: Mechanism) -> dict[str, Sequence[str]]:
    """Return what time stepping does not take, by its names."""
    parts = [part for x in declared.one_way for part in x.frictions if part.rubs]
    count = len(declared.coordinates) - len(declared.rates)
    return {
        "constraints": [row.name for row in declared.rows],
        "friction in joints": [x.name for x in declared.one_way if not x.unilateral],
        "stops that end a run": [*declared.stops, *declared.state_stops],
        "declared states": [x.name for x in declared.coordinates[count:]],
        "outputs that add up along a run": list(declared.run_outputs),
        "outputs of forces and accelerations": [
            name
            for name, value in declared.outputs.items()
            if any(leaf.data[0] in _OF_FORCES for leaf in leaves([value], "quantity"))
        ],
        "friction that is regularised": [part.name for part in parts if part.regularised is not None],
        "friction by several forces": [x.name for x in parts if x.normals != (0,) or x.wrap is not None],
        "tangential restitution": [x.name for x in declared.one_way if x.tangential_restitution is not ZERO],
    }
