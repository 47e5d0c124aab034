"""The elementary motion along a curve."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import NamedTuple, Self

from multibody_sym.model.declaration.curves.curve import Curve
from multibody_sym.model.declaration.joint import Joint
from multibody_sym.model.declaration.steps import Apart, OneCoordinate, is_flat, is_upright
from multibody_sym.model.declaration.values import Point
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import tangents
from multibody_sym.scalars.functions import atan2, evaluate, sqrt
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, slot

_TIME = slot("t", 0)
_UNITS: tuple[Point, ...] = ((ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE))


class Rates(NamedTuple):
    """The derivatives of expressions of a curve's parameter s and of t: along s, in t, and the second ones."""

    s: tuple[Node, ...]
    t: tuple[Node, ...]
    ss: tuple[Node, ...]
    st: tuple[Node, ...]
    tt: tuple[Node, ...]


class At(NamedTuple):
    """A place on a curve, and the derivative of the place along the parameter there."""

    place: Point
    way: Point


def rates(nodes: Sequence[Node], leaf: Node) -> Rates:
    """Return the derivatives of expressions of a curve's parameter `leaf` and of t."""
    s, t = (tuple(tangents(nodes, {each: ONE})) for each in (leaf, _TIME))
    ss, st = (tuple(tangents(s, {each: ONE})) for each in (leaf, _TIME))
    return Rates(s, t, ss, st, tuple(tangents(t, {_TIME: ONE})))


@dataclass(frozen=True)
class Follow(OneCoordinate):
    """A way along a curve by its parameter; with `turns_along`, in a plane, M turns so that its x is the tangent.

    `place` are expressions of the parameter's `leaf` along `axes`, unit vectors. (`axis` is that about which a tangent
    in a plane turns.)
    """

    place: Point = (ZERO, ZERO, ZERO)
    leaf: Node = ZERO
    across: tuple[Point, Point] = (_UNITS[0], _UNITS[1])
    turns_along: bool = field(default=False, kw_only=True)

    @classmethod
    def along(cls, curve: Curve, letter: str = "", *, turns_along: bool = False) -> Follow:
        """Return the step along a declared curve."""
        return cls(_UNITS[2], letter, place=curve.place, leaf=curve.leaf, turns_along=turns_along)

    @property
    def axes(self) -> tuple[Point, Point, Point]:
        """The unit vectors along which `place` has its components."""
        return *self.across, self.axis

    @property
    def unit(self) -> str:
        name: str = self.leaf.data[1][1]
        return name

    @cached_property
    def rates(self) -> Rates:
        """The derivatives of the place."""
        return rates(self.place, self.leaf)

    @cached_property
    def tangent(self) -> tuple[Node, Node]:
        """The unit tangent's components along the first two axes, of a curve in their plane."""
        x, y, _ = self.rates.s
        length = sqrt(x * x + y * y)
        return x / length, y / length

    def at(self, s: Node) -> At:
        """Return where it leads, and which way, at the parameter's value s."""
        nodes = (*self.place, *self.rates.s)
        found = [as_node(x) for x in evaluate(nodes, lambda leaf: s if leaf is self.leaf else leaf)]
        return At((found[0], found[1], found[2]), (found[3], found[4], found[5]))

    @cached_property
    def turning(self) -> Rates:
        """The derivatives of the tangent's angle, of a curve in a plane."""
        x, y, _ = self.rates.s
        return rates((atan2(y, x),), self.leaf)

    def with_directions(self, change: Callable[[Point], Point]) -> Self:
        x, y, z = map(change, self.axes)
        return replace(self, axis=z, across=(x, y))

    @property
    def slides(self) -> tuple[Point, ...]:
        return tuple(axis for axis, way in zip(self.axes, self.rates.s, strict=True) if way is not ZERO)

    @property
    def turns(self) -> tuple[Point, ...]:
        return (self.axis,) if self.turns_along else ()

    @property
    def is_independent(self) -> bool:
        return False

    @property
    def drifts(self) -> bool:
        return any(way is not ZERO for way in self.rates.t)

    @property
    def is_hinge(self) -> bool:
        return False

    @property
    def stays_in_plane(self) -> bool:
        moved = [axis for axis, way in zip(self.axes, self.place, strict=True) if way is not ZERO]
        return all(map(is_flat, moved)) and (is_upright(self.axis) or not self.turns_along)

    def is_measured(self, *, plane: bool) -> bool:
        return False

    def measured(self, apart: Apart) -> Sequence[Node]:
        raise TypeError("no rows stand for a curve, so that it always keeps its coordinate")


def guides(joint: Joint) -> bool:
    """Return whether a joint guides along a curve in its frame on the parent."""
    return bool(joint.steps) and isinstance(joint.steps[0], Follow)
