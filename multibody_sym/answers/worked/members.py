"""Members of bodies at rest in a plane: on two-force members forces act along one line, on three-force ones they meet.

In: a solved start. Out: what stands on each body: the line of two forces with tension or compression, the place where
three lines of action meet, or that nothing acts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Any, Final, NamedTuple

from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.dynamics.programs.quantities import Exertion, StateQuantities
from multibody_sym.mechanics.points import NO_WRENCH
from multibody_sym.scalars.functions import sqrt
from multibody_sym.scalars.vectors import S, apply, cross
from multibody_sym.text.values import Value

_NOTHING: Final = 1e-9
"""The part of the largest force on all bodies below which one is none."""
_TWO, _THREE = 2, 3


class PlaneForce(NamedTuple):
    """X and Y (N) of a force in the plane, and its moment m about the origin (N m): its line is x Y - y X = m."""

    X: Any
    Y: Any
    m: Any


class Member(NamedTuple):
    """A body with what acts on it.

    Two `elements` pull or press it along one line with the force `size`, tension positive; the lines of three meet at
    `place`, which is empty where they are parallel. Without an element nothing acts.
    """

    body: str
    elements: tuple[str, ...]
    size: Value | None = None
    place: Mapping[str, Value] | None = None


def members(solved: SolvedInstant) -> Iterator[Member]:
    """Yield the bodies at rest in the plane on which nothing, two or three elements act by forces alone."""
    bodies = [(k, body.name) for k, body in enumerate(solved.mechanism.bodies) if not (body.is_double or body.is_foot)]
    found = {k: _forces(solved.numbers, k) for k, _ in bodies}
    largest = max((math.hypot(f.X, f.Y) for own in found.values() for f in own.values()), default=0.0)
    for k, name in bodies:
        if any(_differ(found[k], _forces(other, k), largest) for other in solved.others):
            continue
        acting = tuple(each for each, f in found[k].items() if math.hypot(f.X, f.Y) > _NOTHING * largest)
        if any(abs(f.m) > 0.0 and each not in acting and _is_couple(f, largest) for each, f in found[k].items()):
            continue
        if not acting:
            if largest > 0.0:
                yield Member(name, ())
        elif len(acting) == _TWO:
            size = _size(solved, k, acting)
            if size is not None:
                yield Member(name, acting, size=size)
        elif len(acting) == _THREE and _has_extent(solved.numbers, k, acting):
            yield Member(name, acting, place=_meeting(solved, k, acting, largest))


def _has_extent(instant: StateQuantities, k: int, acting: tuple[str, ...]) -> bool:
    """Return whether elements act at several places of a body, which is no node."""
    places = [place for each in acting if (place := _place(instant, k, each)) is not None]
    return any(math.dist(places[0], place) > 0.0 for place in places[1:])


def _differ(own: Mapping[str, PlaneForce], other: Mapping[str, PlaneForce], largest: float) -> bool:
    """Return whether forces are not unique."""
    pairs = ((own[name], other[name]) for name in own)
    return any(abs(a - b) > _NOTHING * largest for one, two in pairs for a, b in zip(one, two, strict=True))


def _is_couple(force: PlaneForce, largest: float) -> bool:
    return bool(abs(force.m) > _NOTHING * largest)


def _forces(instant: StateQuantities, k: int) -> dict[str, PlaneForce]:
    """Return what acts on a body by its elements, over the scalar of an instant; normal force and friction as one."""
    found: dict[str, PlaneForce] = {}
    rotation, origin = instant.motion.poses[k]
    for each in instant.exertions:
        if each.of_body[k] is NO_WRENCH:
            continue
        force, moment = (apply(rotation, x) for x in each.of_body[k])
        m = moment[2] + cross(origin, force)[2]
        own = found.get(_name(each), PlaneForce(0, 0, 0))
        found[_name(each)] = PlaneForce(own.X + force[0], own.Y + force[1], own.m + m)
    return found


def _name(each: Exertion) -> str:
    return each.path[1]


def _size(solved: SolvedInstant, k: int, acting: tuple[str, ...]) -> Value | None:
    """Return the force along the line of two, tension positive; None where they act at one place or by a couple."""
    places = [_place(solved.numbers, k, each) for each in acting]
    first, second = places
    if first is None or second is None:
        return None
    way = [b - a for a, b in zip(first, second, strict=True)]
    force, length = _forces(solved.numbers, k)[acting[1]], math.hypot(*way)
    along = force.X * way[0] + force.Y * way[1]
    if abs(abs(along) - length * math.hypot(force.X, force.Y)) > _NOTHING * abs(along) or length == 0.0:
        return None

    def ask(instant: StateQuantities) -> Mapping[str, Any]:
        own, ends = _forces(instant, k)[acting[1]], [_place(instant, k, each) for each in acting]
        (a, b), (c, d) = [end for end in ends if end is not None]
        x, y = c - a, d - b
        return {"": (own.X * x + own.Y * y) / sqrt(x * x + y * y)}

    return solved.values(ask, {"": "N"})[""]


def _meeting(solved: SolvedInstant, k: int, acting: tuple[str, ...], largest: float) -> Mapping[str, Value]:
    """Return where the lines of action of three forces meet (m), by axis; nothing where they are parallel."""
    numbers = _forces(solved.numbers, k)

    def turned(pair: tuple[str, str]) -> float:
        one, other = (numbers[each] for each in pair)
        return float(abs(one.X * other.Y - one.Y * other.X))

    pair = max(combinations(acting, 2), key=turned)
    if turned(pair) <= _NOTHING * largest * largest:
        return {}

    def ask(instant: StateQuantities) -> Mapping[str, Any]:
        one, other = (_forces(instant, k)[each] for each in pair)
        across = one.X * other.Y - other.X * one.Y
        x, y = one.X * other.m - other.X * one.m, one.Y * other.m - other.Y * one.m
        return {"x": x / across, "y": y / across}

    return solved.values(ask, {"x": "m", "y": "m"})


def _place(instant: StateQuantities, k: int, element: str) -> tuple[S, S] | None:
    """Return where an element acts on a body; None where it has no one place."""
    own = {
        marker.pose.position: marker
        for each in instant.exertions
        if _name(each) == element
        for marker in each.points
        if marker.body == k
    }
    if len(own) != 1:
        return None
    rotation, origin = instant.motion.poses[k]
    at = apply(rotation, instant.motion.point(next(iter(own.values()))))
    return origin[0] + at[0], origin[1] + at[1]
