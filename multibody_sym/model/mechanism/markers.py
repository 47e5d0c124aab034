"""Poses fixed on bodies."""

from __future__ import annotations

from typing import Final

from multibody_sym.model.mechanism.mass import Pose
from multibody_sym.records import dataclass


@dataclass(frozen=True)
class Marker:
    """A pose fixed on a body; body -1 is a ground at rest."""

    name: str
    body: int
    pose: Pose


NOWHERE: Final = Marker("", -1, Pose())
