"""Plans of velocities and accelerations of a linkage whose questions name some: vectors to scale from one origin."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Final

from multibody_sym.answers.instant.instant import SolvedInstant, solved_start
from multibody_sym.mechanics.references import moves_in_plane
from multibody_sym.model.bodies import GROUND
from multibody_sym.model.joints import Revolute
from multibody_sym.model.system import System
from multibody_sym.pictures.diagrams import VectorPlan
from multibody_sym.scalars.node import quantity

_KINDS: Final = {"velocity": ("velocities", "m/s"), "acceleration": ("accelerations", "m/s^2")}


def motion_diagrams(system: System) -> list[VectorPlan]:
    """Return a plan of each kind that questions are about, of plane models: moving pins, and the points asked for."""
    asked = {kind: [x for ask in system.ask.values() if (x := getattr(ask, kind)) is not None] for kind in _KINDS}
    if not any(asked.values()) or not moves_in_plane(system):
        return []
    solved, pins = solved_start(system), list(_pins(system))
    found = []
    for kind, names in asked.items():
        if names:
            points = {name: _vector(solved, kind, name) for name in dict.fromkeys([*(pin for pin, _ in pins), *names])}
            if any(x or y for x, y in points.values()):
                found.append(VectorPlan(*_KINDS[kind], points, list(_joined(points, pins))))
    return found


def _pins(system: System) -> Iterator[tuple[str, str]]:
    """Yield the points of moving bodies about which others turn, with these bodies."""
    for joint in system.joints.values():
        if isinstance(joint, Revolute) and "." in joint.parent and joint.parent.partition(".")[0] != GROUND:
            yield joint.parent, joint.child.partition(".")[0]


def _joined(points: dict[str, tuple[float, float]], pins: list[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """Yield neighbours among the points of each body."""
    of_body: dict[str, list[str]] = {}
    for pin, child in pins:
        of_body.setdefault(child, []).append(pin)
    for name in points:
        of_body.setdefault(name.partition(".")[0], []).append(name)
    for names in of_body.values():
        yield from pairwise(dict.fromkeys(names))


def _vector(solved: SolvedInstant, kind: str, name: str) -> tuple[float, float]:
    return solved.number(quantity(kind, (name, "x"))), solved.number(quantity(kind, (name, "y")))
