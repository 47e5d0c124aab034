"""Ends of ranges of rest at which friction in space is on its circle: from tangents near them to the ends themselves.

In: an end by tangents. Out: the end. At it a motion y of the system begins, with weights w, that no forces z resist:

    E z = r        E^T y + sum of w (mu e_n - d . e_t) + sum of w G = 0        t = mu n d,  |d| = 1,  G z = 0

The parameter is one more unknown: Newton's method begins at the tangents, which need not be many then.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from math import copysign, hypot
from typing import Final

import numpy as np

from multibody_sym.analysis.rest.statics import Direction, Position, RestEnd, RestLimit
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.linear_inequalities import (
    Conditions,
    ConditionsAt,
    contradiction,
    linear_program,
    nearest,
    nonnegative_least_squares,
)
from multibody_sym.scalars.rank import least_squares

_ONE_WAY: Final = 1.0 - 1e-9
"""The part of the weights of tangents from which on their sum along the plane is that of one direction."""
_NOTHING: Final = 1e-7
"""The part of the largest force that is none."""
_TURNS: Final = 20
_NEAR: Final = 1e-2
"""The part of its size by which an end of tangents may be off the end itself."""
_DONE: Final = 1e-15
_LEFT: Final = 1e-11
"""What may be left of conditions of like size where an end fulfils them."""
_DEPENDENT: Final = 1e-10
_STEP: Final = 1e-6
_ROUNDED: Final = 1e-10
_RESISTED: Final = 1e-9
"""The part of the largest weight of limits up to which no force is missing that keeps a motion from what it goes to."""
_BEYOND: Final = 1e-9
"""The part of the largest force by which friction on a circle may seem to be beyond it."""


def sharpen_end(
    at: Callable[[Sequence[RestLimit]], ConditionsAt], end: RestEnd, limits: Sequence[RestLimit]
) -> RestEnd:
    """Return an end of tangents with its limits gathered, on the circles themselves where that end is found.

    `at` returns the conditions for limits as a function of the parameter.
    """
    one = _gather(at, end, limits)
    if end.choice.directions or not any(limit.along is not None for limit in one.limits):
        return one
    try:
        found = _Newton(at(one.limits), one, at, limits).found()
    except (ArithmeticError, np.linalg.LinAlgError):
        return one
    return found if found is not None and _holds(at(limits)(found.value), limits, found) else one


def _holds(conditions: Conditions | None, limits: Sequence[RestLimit], end: RestEnd) -> bool:
    """Return whether forces on the circles of an end, and within all other limits, balance there."""
    if conditions is None:
        return False
    rows = []
    for limit in end.limits:
        for k in limit.idle and (limit.terms[0][0], *limit.idle):
            rows.append(np.eye(conditions.equal.shape[1])[k])
        if limit.along is not None and limit.curve is not None:
            own = next(row.copy() for row, x in zip(conditions.cone, limits, strict=True) if x.curve == limit.curve)
            own[list(limit.curve.rubbing)] = 0.0
            rows += [np.eye(len(own))[k] - x * own for k, x in zip(limit.curve.rubbing, limit.along, strict=True)]
    equal = np.vstack([conditions.equal, *rows])
    right = np.concatenate([conditions.right, np.zeros(len(rows))])
    whole = Conditions(equal, right, conditions.cone, conditions.nothing)
    return contradiction(whole) is None and not any(beyond(nearest(whole), conditions, limits))


def beyond(forces: Floats, conditions: Conditions, limits: Sequence[RestLimit]) -> Iterator[tuple[str, Direction]]:
    """Yield the friction parts beyond their circles, and their directions, of forces within the tangents."""
    size, seen = float(np.abs(forces).max(initial=0.0)), set[str]()
    for row, limit in zip(conditions.cone, limits, strict=True):
        if limit.along is None or limit.curve is None or limit.part in seen:
            continue
        seen.add(limit.part)
        rubbing = list(limit.curve.rubbing)
        most = float(row @ forces - row[rubbing] @ forces[rubbing])
        x, y = forces[rubbing].tolist()
        if hypot(x, y) > most + _BEYOND * size:
            yield limit.part, (x, y)


def _gather(at: Callable[[Sequence[RestLimit]], ConditionsAt], end: RestEnd, limits: Sequence[RestLimit]) -> RestEnd:
    """Return an end with one limit for each part that gives way: slip along one direction, or no force at all.

    Tangents of one circle that are not one direction meet where there is no force: the contact opens.
    """
    slips: dict[str, list[tuple[RestLimit, float]]] = {}
    found = dict[RestLimit, float]()
    for limit, share in zip(end.limits, end.shares, strict=True):
        if limit.kind == "cone":
            slips.setdefault(limit.part, []).append((limit, share))
        else:
            found[limit] = share
    conditions = at(limits)(end.value) if any(len(several) > 1 for several in slips.values()) else None
    forces = None if conditions is None else np.abs(nearest(conditions))
    for several in slips.values():
        slip, whole = several[0][0], sum(share for _, share in several)
        opened = next((x for x in limits if x.idle and x.terms[0][0] == slip.terms[0][0]), None)
        x = y = 0.0
        for number, (limit, share) in enumerate(several):
            way = limit.along or ((-1.0) ** number, 0.0)  # along a line there are two, each other's opposite
            x, y = x + share * way[0], y + share * way[1]
        length = hypot(x, y)
        bare = forces is not None and forces[slip.terms[0][0]] <= _NOTHING * forces.max()
        if opened is not None and (opened in found or (bare and length < _ONE_WAY * whole)):
            found[opened] = found.get(opened, 0.0) + whole
        elif slip.along is None or not length > 0.0:
            found |= dict(several)
        else:
            found[slip.turned_to(_along_axis(x / length, y / length))] = whole
    return replace(end, limits=tuple(found), shares=tuple(found.values()))


def _along_axis(x: float, y: float) -> Direction:
    """Return a direction, exactly an axis where it is one but for rounding."""
    if min(abs(x), abs(y)) > _ROUNDED:
        return (x, y)
    return (copysign(1.0, x), 0.0) if abs(x) > abs(y) else (0.0, copysign(1.0, y))


@dataclass(frozen=True)
class _Newton:
    """Unknowns are the parameter, z (kept columns), y, weights, and the directions of what slips."""

    at: ConditionsAt
    end: RestEnd
    of: Callable[[Sequence[RestLimit]], ConditionsAt]
    limits: Sequence[RestLimit]

    @cached_property
    def first(self) -> Conditions:
        """The conditions at the end of tangents."""
        return self.conditions(self.end.value)

    def conditions(self, value: float) -> Conditions:
        found = self.at(value)
        if found is None:
            raise ArithmeticError("there are no conditions here")
        return found

    @cached_property
    def slips(self) -> list[int]:
        """The limits that are on a circle, by number."""
        return [k for k, limit in enumerate(self.end.limits) if limit.along is not None]

    @cached_property
    def straight(self) -> list[int]:
        """The other limits, without those of forces that are nothing."""
        return [k for k, x in enumerate(self.end.limits) if x.along is None and not x.idle]

    @cached_property
    def kept(self) -> list[int]:
        """The multipliers that may be forces."""
        gone = {k for x in self.end.limits if x.idle for k in (x.terms[0][0], *x.idle)}
        return [k for k in range(self.first.equal.shape[1]) if k not in gone]

    @cached_property
    def rubbing(self) -> list[list[int]]:
        """For what slips, the places of its two components among the kept multipliers."""
        curves = [self.end.limits[k].curve for k in self.slips]
        return [[self.kept.index(row) for row in curve.rubbing] for curve in curves if curve is not None]

    @cached_property
    def scales(self) -> tuple[Floats, float]:
        """Factors of the equations, and the size of forces."""
        lengths = np.linalg.norm(self.first.equal, axis=1)
        rows = 1.0 / np.where(lengths > 0.0, lengths, 1.0)
        return rows, float(np.abs(rows * self.first.right).max(initial=0.0)) or 1.0

    def parts(self, value: float) -> tuple[Floats, Floats, Floats, Floats]:
        """Return E, r, the rows of straight limits, and those of mu n of what slips, scaled."""
        found, (rows, size) = self.conditions(value), self.scales
        pressing = found.cone[self.slips][:, self.kept]
        for k, places in enumerate(self.rubbing):
            pressing[k, places] = 0.0
        equal = rows[:, None] * found.equal[:, self.kept]
        return equal, rows * found.right / size, found.cone[self.straight][:, self.kept], pressing

    @cached_property
    def begin(self) -> Floats:
        """The unknowns at the end of tangents."""
        E, r, G, C = self.parts(self.end.value)
        weights = np.array([self.end.shares[k] for k in (*self.straight, *self.slips)])
        ways = np.array([self.end.limits[k].along for k in self.slips], dtype=float).reshape(-1, 2)
        pulled = np.vstack([G, C])
        slides = []
        for k, places in enumerate(self.rubbing):
            pulled[len(G) + k, places] -= ways[k]
            slides.append(np.eye(len(self.kept))[places] - np.outer(ways[k], C[k]))
        fixed = np.vstack([E, G, *slides])
        z = least_squares(fixed, np.concatenate([r, np.zeros(len(fixed) - len(r))]))
        y = least_squares(E.T, -pulled.T @ weights)
        length = float(np.linalg.norm(y))
        if not length > 0.0:
            raise ArithmeticError("nothing moves")
        return np.concatenate([[self.end.value], z, y / length, weights / length, ways.ravel()])

    @cached_property
    def places(self) -> list[int]:
        """Where the unknowns after the parameter end: z, y, weights."""
        counts = [1, len(self.kept), len(self.first.equal), len(self.straight) + len(self.slips)]
        return [sum(counts[: k + 1]) for k in range(len(counts))]

    def left(self, X: Floats, parts: tuple[Floats, Floats, Floats, Floats]) -> Floats:
        """Return the residuals of all conditions."""
        E, r, G, C = parts
        _, z, y, weights, ways = np.split(X, self.places)
        ways = ways.reshape(-1, 2)
        moves = E.T @ y + np.vstack([G, C]).T @ weights
        slides = []
        for k, places in enumerate(self.rubbing):
            moves[places] -= weights[len(G) + k] * ways[k]
            slides.append(z[places] - (C[k] @ z) * ways[k])
        whole = [(ways * ways).sum(axis=1) - 1.0, [y @ np.split(self.begin, self.places)[2] - 1.0]]
        return np.concatenate([E @ z - r, moves, G @ z, *slides, *whole])

    def slope(self, X: Floats) -> Floats:
        """Return the derivative of the residuals: of bilinear conditions, and along the parameter by difference."""
        parts = self.parts(float(X[0]))
        step = _STEP * max(abs(float(X[0])), abs(self.end.value)) or _STEP
        ahead, behind = (self.left(X, self.parts(float(X[0]) + sign * step)) for sign in (1.0, -1.0))
        columns = [(ahead - behind) / (2.0 * step)]
        for k in range(1, len(X)):
            unit = np.zeros(len(X))
            unit[k] = 1.0
            # Conditions are at most of second degree: a central difference of any length is exact.
            columns.append((self.left(X + unit, parts) - self.left(X - unit, parts)) / 2.0)
        return np.array(columns).T

    def found(self) -> RestEnd | None:
        """Return the end where Newton's method settles near, with weights that still contradict."""
        X = self.begin.copy()
        size = abs(self.end.value) or 1.0
        for _ in range(_TURNS):
            step = least_squares(self.slope(X), -self.left(X, self.parts(float(X[0]))), _DEPENDENT)
            X += step
            if abs(X[0] - self.end.value) > _NEAR * size:
                return None
            if abs(step[0]) <= _DONE * size and np.abs(step).max() <= _LEFT:
                break
        left = np.abs(self.left(X, self.parts(float(X[0])))).max()
        _, _, _, weights, ways = np.split(X, self.places)
        if left > _LEFT or weights.min(initial=0.0) < -_LEFT:
            return None
        turned = list(self.end.limits)
        for k, (x, y) in zip(self.slips, ways.reshape(-1, 2).tolist(), strict=True):
            turned[k] = turned[k].turned_to(_along_axis(x, y))
        if not self.contradicts(X, turned):
            return None
        return replace(self.end, value=float(X[0]), limits=tuple(turned), on_circles=True)

    def contradicts(self, X: Floats, turned: Sequence[RestLimit]) -> bool:
        """Return whether forces that were taken to be none could not resist the motion y either.

        If one of them can, rest is possible beyond, by other forces.
        """
        gone = [k for k in range(self.first.equal.shape[1]) if k not in self.kept]
        if not gone:
            return True
        _, _, y, weights, _ = np.split(X, self.places)
        in_order = [turned[k] for k in (*self.straight, *self.slips)]
        given = self.of(in_order)(float(X[0]))
        if given is None:
            return False
        pulled = (self.scales[0][:, None] * given.equal).T @ y + given.cone.T @ weights
        against = list(self.limits)  # tangents of circles where the motion pulls most
        for k, limit in enumerate(self.limits):
            if limit.along is not None and limit.curve is not None:
                x, y = pulled[list(limit.curve.rubbing)].tolist()
                size = hypot(x, y)
                against[k] = limit.turned_to((x / size, y / size)) if size > 0.0 else limit
        bounds = self.of(against)(float(X[0]))
        assert bounds is not None
        own = np.array([not row[self.kept].any() for row in bounds.cone], dtype=bool)
        _, left = nonnegative_least_squares(bounds.cone[own][:, gone].T, -pulled[gone])
        return bool(left <= _RESISTED * float(np.abs(weights).max(initial=0.0)))


# --- ends that do not belong to their range of rest: towards them forces grow without bound --------------------------

_WAYS: Final = (1e-4, 1e-5)
"""How far inside an end (of its size, 1 at least) forces are compared, and at twice that."""
_POLE: Final = 1e-2
"""By how much the forces there may differ from those of a pole of first order, of which one is twice the other."""


def open_end(position: Position, name: str, end: RestEnd, outward: int) -> tuple[float, float] | None:
    """Return the pole of the least forces at an end of a range, and its error; None where they stay finite there."""
    found = [end.value]
    for way in _WAYS:
        near = found[-1] - outward * way * max(abs(end.value), 1.0)
        far = 2 * near - found[-1]
        one, two = (_least_force(position, name, end, x) for x in (near, far))
        if one is None or two is None or not abs(one - 2 * two) <= _POLE * one:
            return None
        found.append((one * near - two * far) / (one - two))
    return found[-1], abs(found[-1] - found[-2]) * _WAYS[1] / _WAYS[0]


def _least_force(position: Position, name: str, end: RestEnd, value: float) -> float | None:
    """Return the least size of the largest force that fulfils the conditions at a value, None where none does."""
    conditions = position.conditions({name: value}, position.statics.limits(end.choice), moves=True)
    if conditions is None:
        return None
    n = conditions.equal.shape[1]
    one = np.ones((n, 1))
    upper = np.vstack(
        [
            np.hstack([-conditions.cone, np.zeros((len(conditions.cone), 1))]),
            np.hstack([np.eye(n), -one]),
            np.hstack([-np.eye(n), -one]),
        ]
    )
    equal = np.hstack([conditions.equal, np.zeros((len(conditions.equal), 1))])
    cost = np.r_[np.zeros(n), 1.0]
    free = [(None, None)] * len(cost)
    found = linear_program(cost, free, below=(upper, np.zeros(len(upper))), equal=(equal, conditions.right))
    return found.value if found.status == 0 else None
