"""What contacts and friction allow, over any scalar: numbers, Nodes, exact quotients, expressions of sympy.

    presses        N = sum of |n|, or the length of these normal forces as a vector
    sticks         static N - |F| >= 0
    slides         F = -kinetic N v/|v|
    creeps         F = -kinetic N v / sqrt(v . v + least^2), as with a coefficient that vanishes with the speed
    grips          T1 <= k T2 on a rough wheel, with k = exp(mu wrap)

A rope's friction on a wheel is T1 - T2 over N, the mean of both, so that its coefficient is 2 (k - 1)/(k + 1).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal

from multibody_sym.scalars.functions import absolute, sqrt
from multibody_sym.scalars.node import ZERO
from multibody_sym.scalars.vectors import S

Kind = Literal["force", "gap", "cone", "slip", "side"]
"""What must not be negative: a normal force; the distance of what is apart; what friction that sticks leaves of its
cone; slip along the way that it takes; a reaction towards the side on which it presses."""
OF_FORCES: Final[tuple[Kind, ...]] = ("force", "cone", "side")
"""The kinds that are measured by forces; the others are by motion."""

ACCEPTED: Final = 1e-10
"""Inequalities hold to this part of the terms of their row, and of the largest force."""
TIED: Final = 1e-12
"""What is left of terms is zero below this part of them: some thousand roundings."""
TOGETHER: Final = 1e-9
"""Closing speeds that differ by less than this part are struck together."""
CONNECTED: Final = 1e-12
"""The part of their lengths below which what one row pushes does not move another."""

_BOUNDLESS: Final = 1e-17
"""What stands for 2 - coefficient over floats where k is beyond 1e16, and that rounds to 0."""


def length(values: Sequence[S]) -> S:
    """Return the size of a number or the length of a vector."""
    return absolute(values[0]) if len(values) == 1 else sqrt(sum(x * x for x in values))


def pressing(forces: Sequence[S], sides: Sequence[S], *, norm: bool = False) -> S:
    """Return N of normal forces with the signs that they have on their sides, 0 where that is not known.

    The length of a vector of which one component alone does not vanish identically is that by its side.
    """
    if norm and sum(x is not ZERO for x in forces) > 1:
        return length(forces)
    return sum(_size(x, side) for x, side in zip(forces, sides, strict=True))


def _size(force: S, side: S) -> S:
    if isinstance(side, int):
        return force if side > 0 else -force if side else absolute(force)
    return side * force + (1 - side * side) * absolute(force)


def most(static: S, N: S) -> S:
    """Return how large friction can be."""
    return static * N


def room(static: S, N: S, friction: Sequence[S]) -> S:
    """Return by how much friction along its rows is below that, negative beyond it."""
    return most(static, N) - length(friction)


def towards(side: S, force: S) -> S:
    """Return a reaction towards the side on which it presses, minus its size where it presses on none (0) yet."""
    return side * force - (1 - side * side) * absolute(force)


def along(way: Sequence[S], rates: Sequence[S]) -> S:
    """Return the rate along a direction of the rates along rows."""
    return sum(x * rate for x, rate in zip(way, rates, strict=True))


def sliding(kinetic: S, velocity: Sequence[S], speed: S = 1) -> list[S]:
    """Return friction for a unit normal force along each row, for a velocity of that speed."""
    return [-kinetic * v / speed for v in velocity]


def creep_coefficient(kinetic: S, velocity: Sequence[S], least: S) -> S:
    """Return the coefficient that friction has which creeps."""
    return kinetic * length(velocity) / length([*velocity, least])


def grip_coefficient(ratio: S) -> S:
    """Return the coefficient of a rope whose tensions on both sides of a wheel have a ratio at most."""
    return 2 * (ratio - 1) / (ratio + 1)


def tension_ratio(coefficient: S) -> S:
    """Return that ratio."""
    less = _BOUNDLESS if isinstance(coefficient, float) and coefficient >= 2.0 else 2 - coefficient
    return (2 + coefficient) / less
