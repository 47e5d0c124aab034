"""Springs whose moving end lies beyond their other end: positions that a formula has, and a real spring hardly."""

from __future__ import annotations

from functools import singledispatch
from typing import Final

import numpy as np

from multibody_sym.analysis.places import Places
from multibody_sym.analysis.steadiness import displaced
from multibody_sym.kinematics.points import position
from multibody_sym.model.mechanism.loads import JointSpring, Load, PointSpring
from multibody_sym.numerics.arrays import Floats

_STEP: Final = 1e-4
_LINE: Final = 1e-5


def passed(places: Places, q: Floats) -> tuple[str, ...]:
    """Return the springs that are beyond their other end in a position.

    In a joint's sliding freedom: those whose length would have another sign than unloaded. Between points: those whose
    end moves on a line through the other and is on the other side of it than at the start.
    """
    found = []
    for load in places.mechanism.loads:
        if load.spring is not None and _is_passed(load, places, q):
            found.append(load.name)
    return tuple(found)


@singledispatch
def _is_passed(spring: Load, places: Places, q: Floats) -> bool:
    raise TypeError(f"nothing says when {type(spring).__name__} is beyond its other end")


@_is_passed.register
def _(spring: JointSpring, places: Places, q: Floats) -> bool:
    return _reversed(places, spring, q)


@_is_passed.register
def _(spring: PointSpring, places: Places, q: Floats) -> bool:
    return any(_crossed(places, spring, q, end.body) for end in spring.ends)


def _reversed(places: Places, spring: JointSpring, q: Floats) -> bool:
    coordinates = places.mechanism.coordinates
    slides = all(c.unit == "m" for c in coordinates if c.joint == spring.joint)
    rest, length, stiffness = places.motion(q).state.values([spring.rest, spring.coordinate, spring.stiffness])
    return slides and stiffness != 0 and rest * length < 0 and abs(length) > _LINE * abs(rest)


def _crossed(places: Places, spring: PointSpring, q: Floats, body: int) -> bool:
    """Return whether a spring, seen from a body, lies on the same line as at the start and points the other way."""
    before, now = (_spanned(places, spring, x, body) for x in (places.start, q))
    sizes = np.linalg.norm(before) * np.linalg.norm(now)
    if sizes == 0.0 or before @ now >= 0.0 or np.linalg.norm(np.cross(before, now)) > _LINE * sizes:
        return False
    axis = before / np.linalg.norm(before)
    return all(_on_line(places, spring, x, body, axis) for x in (places.start, q))


def _on_line(places: Places, spring: PointSpring, q: Floats, body: int, axis: Floats) -> bool:
    """Return whether the spring's ends move along its own line only, whatever moves."""
    zeros = np.zeros(len(places.mechanism.speeds))
    columns = places.flow.tangents(q, zeros).X[: len(zeros)]
    here = _spanned(places, spring, q, body)
    for column in columns.T:
        size = float(np.abs(column).max(initial=0.0))
        if size > 0.0:
            there = _spanned(places, spring, displaced(places.mechanism, q, _STEP * column / size), body)
            aside = np.cross(axis, there - here)
            if float(np.linalg.norm(aside)) > _LINE * _STEP * max(places.length, float(np.linalg.norm(there - here))):
                return False
    return True


def _spanned(places: Places, spring: PointSpring, q: Floats, body: int) -> Floats:
    """Return the vector from end to end of a spring, in a body's axes."""
    motion = places.motion(q)
    ends = [np.array(position(motion, end), dtype=float) for end in spring.ends]
    found: Floats = np.array(motion.rotation(body), dtype=float).T @ (ends[1] - ends[0])
    return found
