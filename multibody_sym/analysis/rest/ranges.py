"""The values of a parameter at which rest is possible: intervals, and the limits passed at their ends, in words.

In: a Position and the name of a parameter. Out: Ranges; the least values of one parameter over those of another.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from itertools import pairwise
from math import copysign, hypot, inf, pi
from typing import Final, Literal

import numpy as np

from multibody_sym.analysis.rest.ends import beyond, sharpen_end
from multibody_sym.analysis.rest.statics import (
    Direction,
    FrictionCurve,
    Position,
    PressingSides,
    Range,
    RestEnd,
    RestLimit,
    Statics,
    join_about_pi,
    standings,
    unite_ranges,
)
from multibody_sym.errors import NoSolutionError
from multibody_sym.mechanics.law_elements import LawElement
from multibody_sym.mechanics.motion import Motion, accelerations
from multibody_sym.mechanics.points import position
from multibody_sym.mechanics.row_kinematics import row_motion, row_motions
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.model.bodies import GROUND
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.linear_inequalities import (
    Conditions,
    ConditionsAt,
    Interval,
    IntervalEnd,
    contradiction,
    extremes,
    feasible_set,
    nearest,
)
from multibody_sym.scalars.node import Node, slot
from multibody_sym.scalars.rank import least_squares
from multibody_sym.scalars.vectors import ZERO_VECTOR, Vec, add, apply_transposed, combination

Kind = Literal["none", "coefficient", "load", "angle", "other"]
"""How the conditions depend on the parameter: not; in coefficients alone, which all grow with it; linearly in forces
alone; with period 2 pi; any other way."""

_STEPS: Final = {"coefficient": 32, "angle": 144, "other": 128, "again": 8}
_FARTHEST: Final = 1e4
"""How many times its declared value a parameter is taken at most, where nothing says more."""
_ALIKE: Final = 1e-11
_ROUNDING: Final = 1e-14
"""The part of the largest force below which all forces together are none."""
_PROBES: Final = (0.731, 1.0, 1.317, 1.893)
_FAR_PROBES: Final = (3.1, 5.3, 9.7, 31.0, 107.0, 1009.0, _FARTHEST)
_CUTS: Final = 20
_SETTLED: Final = 1e-13
_TOUCHING: Final = 1e-7
"""The part of the parameter's size by which a range may be as wide as what touches there may be apart."""
_BEYOND: Final = 1e-6
"""The part of a range by which it is looked at from beyond its ends."""


@dataclass(frozen=True)
class Ranges:
    """The ranges of a parameter in which rest is possible, ascending, and the `searched` interval of values.

    Where there is none `against` are the limits that contradict balance at the declared value, at the largest one of
    coefficients; None where no balance is known there.
    """

    parameter: str
    kind: Kind
    ranges: tuple[Range, ...]
    searched: tuple[float, float]
    against: tuple[RestLimit, ...] | None = None


@dataclass(frozen=True)
class RestSearch:
    """The search for values of the parameter `name`, `others` being as declared or given."""

    position: Position
    name: str
    others: Mapping[str, float]

    @cached_property
    def moves(self) -> bool:
        """Whether positions depend on the parameter or on the others."""
        return any(map(self.position.moves_with, (self.name, *self.others)))

    def at(self, limits: Sequence[RestLimit]) -> ConditionsAt:
        """Return the conditions as a function of the parameter."""
        known: dict[float, Conditions | None] = {}

        def conditions(value: float) -> Conditions | None:
            if value not in known:
                found = self.position.conditions({**self.others, self.name: value}, limits, self.moves)
                known[value] = None if found is None else replace(found, nothing=_ROUNDING * self.largest)
            return known[value]

        return conditions

    @property
    def value(self) -> float:
        """The value of the parameter as it is declared or given."""
        return self.others.get(self.name, self.position.value[self.name])

    @cached_property
    def looks(self) -> list[Conditions | None]:
        """The conditions for the first choice of pressing sides, at some values of the parameter."""
        limits = self.position.statics.limits(self.position.statics.choices()[0])
        return [self.position.conditions({**self.others, self.name: x}, limits, self.moves) for x in self.probes]

    @cached_property
    def largest(self) -> float:
        """The largest force without those that hold, at some values of the parameter."""
        return max((float(np.abs(x.right).max(initial=0.0)) for x in self.looks if x is not None), default=0.0)

    @property
    def size(self) -> float:
        return abs(self.value) or 1.0

    def found(self) -> Ranges:
        kind, low, searched = self.kind, self.least, self.searched
        ranges = [x for x in self.ranges() if not low == x[0].value == x[1].value == 0.0]  # no load, or no body
        if kind == "angle":
            about, turn = join_about_pi(ranges)
            return Ranges(self.name, kind, tuple(about), turn)
        told = (low, inf) if kind in ("none", "coefficient", "load") else searched
        return Ranges(self.name, kind, tuple(ranges), told, None if ranges else self.against())

    def against(self) -> tuple[RestLimit, ...] | None:
        """Return the limits that contradict balance, for the first choice of pressing sides for which some do.

        Limits of friction count only where others do not: a contact that lifts off is past those of friction, too.
        """
        value = self.searched[1] if self.kind == "coefficient" else self.value
        for choice in self.position.statics.choices():
            every = self.position.statics.limits(choice)
            for limits in ([x for x in every if x.kind != "cone"], every):
                conditions = self.at(limits)(value)
                found = None if conditions is None else contradiction(conditions)
                if found is not None:
                    return tuple(limits[k] for k in found.cone)
        return None

    def ranges(self) -> list[Range]:
        """Return the ranges for all choices of pressing sides, put together, but for values without a start."""
        choices, searched = self.position.statics.choices(), self.searched
        found = unite_ranges([found for choice in choices for found in self.widened(choice, self.kind, searched)])
        found = [self.at_meeting(pair) for pair in found]
        return [x for x in found if x[0].value < x[1].value or self.has_start(x[0].value)]

    def has_start(self, value: float) -> bool:
        """Return whether the model has a start at a value of the parameter."""
        return self.position.has_start({**self.others, self.name: value})

    @cached_property
    def least(self) -> float:
        """The least value that the parameter may have, or that is looked at where a positive one is declared."""
        signed = self.kind != "other" or self.value <= 0.0 or self.is_place
        return -inf if signed and not self.is_positive() else 0.0

    @property
    def searched(self) -> tuple[float, float]:
        """The interval in which values are tried."""
        far = _FARTHEST * self.size
        return (-pi, pi) if self.kind == "angle" else (max(self.least, -far), far)

    def grid(self, kind: Kind, searched: tuple[float, float]) -> list[float]:
        """Return the values that are tried first."""
        low, high = searched
        if kind == "angle":
            return [float(x) for x in np.linspace(low, high, _STEPS[kind] + 1)]
        steps = _STEPS.get(kind, _STEPS["other"])
        parts = np.arange(steps) / steps
        upper = [*(self.size * parts / (1.0 - parts)).tolist(), high]
        return upper if low >= 0.0 else [*(-x for x in reversed(upper)), *upper]

    # --- how conditions depend on the parameter -----------------------------------------------------------------

    @cached_property
    def kind(self) -> Kind:
        """How the conditions depend on the parameter."""
        statics = self.position.statics
        conditions = self.at(statics.limits(statics.choices()[0]))
        if self.touch_changes or any(look is None for look in self.looks):
            return "angle" if self.has_period(conditions) else "other"
        parts = [(x.equal, x.right, x.cone) for x in self.looks if x is not None]
        same = [all(_alike(one[k], other[k]) for one, other in pairwise(parts)) for k in range(3)]
        if all(same) and not self.bends:
            return "none"
        if same == [True, True, False] and self.coefficients_grow():
            return "coefficient"
        is_linear = same == [True, False, True] and not self.bends
        if is_linear:
            (a, b), (x, y) = _PROBES[:2], (part[1] for part in parts[:2])
            line = (x + (y - x) * (probe - a) / (b - a) for probe in _PROBES)
            is_linear = all(_alike(value, part[1]) for value, part in zip(line, parts, strict=True))
        if is_linear:
            return "load"
        return "angle" if self.has_period(conditions) else "other"

    def coefficients_grow(self) -> bool:
        """Return whether no coefficient of friction becomes less where the parameter grows, as far as is searched."""
        looks = [*self.probes, *(self.size * far for far in _FAR_PROBES)]
        values = [found for x in looks if (found := self._coefficients(x)) is not None]
        return all((b >= a).all() for a, b in pairwise(values))

    def _coefficients(self, value: float) -> Floats | None:
        """Return the coefficients of friction at a value of the parameter, None where they are past all floats."""
        static = [part.static for element in self.position.mechanism.one_way for part in element.frictions]
        motion = self.position.motion({**self.others, self.name: value}, self.moves)
        try:
            return None if motion is None else np.array(motion.state.values(static), dtype=float)
        except OverflowError:
            return None

    @property
    def probes(self) -> list[float]:
        return [copysign(self.size, self.value) * probe for probe in _PROBES]

    @cached_property
    def is_place(self) -> bool:
        """Whether the parameter says where bodies are, and nothing else: no size, mass, force or coefficient."""
        limits = self.position.statics.limits(self.position.statics.choices()[0])
        here, there = (
            self.position.conditions({**self.others, self.name: x}, limits, moves=False)
            for x in (self.value, self.value + self.size)
        )
        return self.moves and here is not None and _same(here, there)

    @cached_property
    def meetings(self) -> list[float]:
        """The values at which a gap is zero that is none beside them: something may rest there alone."""
        if not self.touch_changes:
            return []
        from scipy.optimize import brentq  # scipy takes longer to import than most answers take

        def gap(k: int, value: float) -> float:
            gaps = self.gaps(value)
            return 0.0 if gaps is None else float(gaps[k])

        looks = [(x, gaps) for x in self.grid(self.kind, self.searched) if (gaps := self.gaps(x)) is not None]
        found = set[float]()
        for (low, here), (high, there) in pairwise(looks):
            turned = (np.sign(here) != np.sign(there)) & (np.abs(there - here) > _ALIKE * self.size)
            for k in turned.nonzero()[0].tolist():
                found.add(brentq(partial(gap, k), low, high, xtol=4.0 * EPSILON * max(abs(low), abs(high))))
        return sorted(map(float, found))

    def at_meeting(self, known: Range) -> Range:
        """Return a range as one value where it is no wider than the tolerance of touching makes it."""
        low, high = known
        within = [x for x in self.meetings if low.value <= x <= high.value]
        if not within or high.value - low.value > _TOUCHING * max(self.size, abs(high.value)):
            return known
        return replace(low, value=within[0]), replace(high, value=within[0])

    def gaps(self, value: float) -> Floats | None:
        return self.position.gaps({**self.others, self.name: value}, self.moves)

    @property
    def touch_changes(self) -> bool:
        """Whether gaps, or distances to the ends of faces, depend on the parameter, so that contacts may change."""
        ways = [self.position.ways({**self.others, self.name: x}, self.moves) for x in (self.value, *self.probes)]
        near = [np.concatenate(x) for x in ways if x is not None]
        return any(not _alike(one, other) for one, other in pairwise(near))

    @cached_property
    def bends(self) -> bool:
        """Whether a force bends or jumps at some value of the parameter, so that a few values do not show its form."""
        mechanism = self.position.mechanism
        varied: set[Node] = set()
        for k, entry in enumerate(mechanism.parameters):
            if entry.name == self.name or (entry.value is not None and varied & {*leaves([entry.value], "slot")}):
                varied.add(slot("parameters", k))
        switching = {*leaves(self.position.kinks, "slot")}
        return bool(varied & switching) or (self.moves and any(leaf.data[0] == "q" for leaf in switching))

    def has_period(self, conditions: ConditionsAt) -> bool:
        """Return whether conditions change, and are the same a full turn later."""
        pairs = [(conditions(probe), conditions(probe + 2 * pi)) for probe in (*_PROBES, *self.probes)]
        changes = any(not _same(here, pairs[0][0]) for here, _ in pairs)
        return changes and all(_same(here, there) for here, there in pairs)

    def is_positive(self) -> bool:
        """Return whether the parameter may not be negative: declared so, or masses or friction would be."""
        entry = next(entry for entry in self.position.mechanism.parameters if entry.name == self.name)
        if entry.positive:
            return True
        motion = self.position.motion({**self.others, self.name: -self.size}, self.moves)
        if motion is None:
            return False
        elements = self.position.mechanism.one_way
        rubbing = [part.static for element in elements for part in element.frictions]
        rubbing += [force for element in elements for force in element.constant_forces]
        return any(x < 0.0 for x in (*motion.state.values(rubbing), *(mass.mass for mass in motion.masses)))

    # --- search -------------------------------------------------------------------------------------------------

    def widened(self, choice: PressingSides, kind: Kind, searched: tuple[float, float]) -> list[Range]:
        """Return the ranges for a choice, widened at each end by turning directions that press into those of forces."""
        found = self.of_choice(choice, kind, searched)
        if not choice.directions:
            return found
        return [
            (self.moved(pair[0], pair[1].value, searched), self.moved(pair[1], pair[0].value, searched))
            for pair in found
        ]

    def moved(self, end: RestEnd, inside: float, searched: tuple[float, float]) -> RestEnd:
        """Return an end with directions turned until it stays where it is; `inside` is the other end of its range."""
        for _ in range(_CUTS):
            choice = self.turned(end)
            if choice is None:
                break
            limits = self.position.statics.limits(choice)
            step = 0.5 * max(min(abs(end.value - inside), 1e3 * self.size), 1e-3 * self.size)
            beyond = end.value + (step if end.value > inside else -step)
            beyond = min(max(beyond, searched[0]), searched[1])
            found = feasible_set(self.at(limits), [end.value, 0.5 * (end.value + beyond), beyond])
            ends = [pair[beyond > end.value] for pair in _rest_ends(found, limits, choice)]
            farther = [x for x in ends if x.limits and (x.value - end.value) * (beyond - end.value) > 0.0]
            if not farther or abs(farther[0].value - end.value) <= _SETTLED * abs(end.value):
                break
            end = farther[0]
        return end

    def turned(self, end: RestEnd) -> PressingSides | None:
        """Return the choice with the directions of the forces at an end; None where nothing curved gives way there."""
        curves = [x.curve for x in end.limits if x.curve is not None and x.curve.pressing[0] in end.choice.directions]
        conditions = self.at(self.position.statics.limits(end.choice))(end.value) if curves else None
        if conditions is None:
            return None
        forces, directions = nearest(conditions), dict(end.choice.directions)
        for curve in curves:
            x, y = (float(forces[k]) for k in curve.pressing)
            if hypot(x, y) > 0.0:
                directions[curve.pressing[0]] = (x / hypot(x, y), y / hypot(x, y))
        return PressingSides(end.choice.sides, directions)

    def of_choice(self, choice: PressingSides, kind: Kind, searched: tuple[float, float]) -> list[Range]:
        """Return the ranges for one choice of pressing sides, circles cut again until their ends stay."""
        cuts = dict(self.position.statics.cuts)
        limits = self.position.statics.limits(choice, cuts)
        found = _rest_ends(self.intervals(self.at(limits), kind, searched), limits, choice)
        sharp = [sharpen_end(self.at, end, limits) if cuts else end for pair in found for end in pair]
        for _ in range(_CUTS):
            if not self.cut_again(cuts, [end for pair in found for end in pair], sharp, limits):
                break
            limits = self.position.statics.limits(choice, cuts)
            found = [part for each in found for part in self.left_of(each, limits, choice)]
            sharp = [sharpen_end(self.at, end, limits) for pair in found for end in pair]
        return list(zip(sharp[::2], sharp[1::2], strict=True))

    def left_of(self, known: Range, limits: Sequence[RestLimit], choice: PressingSides) -> list[Range]:
        """Return the parts of a range that remain when circles are cut again; without bound it stays so.

        Values begin a little beyond its ends: at an end itself the loss by a new cut is lost in rounding.
        """
        low, high = known[0].value, known[1].value
        first = low if low > -inf else min(high, 0.0) - _FARTHEST * self.size
        last = high if high < inf else max(low, 0.0) + _FARTHEST * self.size
        parts = np.arange(_STEPS["again"] + 1) / _STEPS["again"]
        shrunk = parts if high < inf else parts / (1.0 + 1e3 * (1.0 - parts))
        inner = first + (last - first) * shrunk[1:-1]
        aside = _BEYOND * (last - first) if low > -inf and high < inf else _BEYOND * abs(low if high == inf else high)
        grid = [first - aside if known[0].limits else first, *inner.tolist(), last + aside if known[1].limits else last]
        return [
            (
                known[0] if not (a.limits or a.equal) and a.value == grid[0] else a,
                known[1] if not (b.limits or b.equal) and b.value == grid[-1] else b,
            )
            for a, b in _rest_ends(feasible_set(self.at(limits), grid), limits, choice)
        ]

    def cut_again(
        self,
        cuts: dict[str, tuple[Direction, ...]],
        ends: Sequence[RestEnd],
        sharp: Sequence[RestEnd],
        limits: Sequence[RestLimit],
    ) -> bool:
        """Add the directions in which circles are pressed upon at ends; return whether there is a new one.

        `sharp` are the ends as far as they are known: at those on circles no force is beyond one.
        """
        changed = False
        for end, known in zip(ends, sharp, strict=True):
            for part, (x, y) in () if known.on_circles else self.pressed(end, limits):
                length = hypot(x, y)
                if length > 0.0 and all(hypot(x / length - a, y / length - b) > _ALIKE for a, b in cuts[part]):
                    cuts[part] = (*cuts[part], (x / length, y / length))
                    changed = True
        return changed

    def pressed(self, end: RestEnd, limits: Sequence[RestLimit]) -> Iterator[tuple[str, Direction]]:
        """Yield the directions in which circles are pressed upon at an end: by forces, and in what contradicts.

        Corners of one contact may each take what another one is kept from: all are pressed as their sum is, too.
        """
        weights: dict[str, Direction] = {}
        curves: dict[str, FrictionCurve] = {}
        groups: dict[str, list[str]] = {}
        for limit, weight in zip(end.limits, end.shares, strict=True):
            if limit.along is not None and limit.curve is not None:
                x, y = weights.get(limit.part, (0.0, 0.0))
                weights[limit.part] = (x + weight * limit.along[0], y + weight * limit.along[1])
                curves[limit.part] = limit.curve
                if limit.part not in (parts := groups.setdefault(limit.group, [])):
                    parts.append(limit.part)
        conditions = self.at(limits)(end.value) if self.position.statics.cuts and end.limits else None
        if conditions is not None:
            forces = nearest(conditions)
            yield from beyond(forces, conditions, limits)
            pressed = {part: [float(forces[k]) for k in curve.rubbing] for part, curve in curves.items()}
            yield from ((part, (x, y)) for part, (x, y) in pressed.items())
            for parts in groups.values():
                x, y = (sum(along) for along in zip(*(pressed[part] for part in parts), strict=True))
                yield from ((part, (x, y)) for part in parts)
        yield from weights.items()

    def intervals(self, conditions: ConditionsAt, kind: Kind, searched: tuple[float, float]) -> list[Interval]:
        low = searched[0]
        if kind == "none":
            found = conditions(self.value)
            possible = found is not None and contradiction(found) is None
            return [Interval(IntervalEnd(-inf if low < 0.0 else low), IntervalEnd(inf))] if possible else []
        if kind == "load":
            return self.of_load(conditions, low)
        found_all = feasible_set(conditions, sorted({*self.grid(kind, searched), *self.meetings}))
        if kind == "coefficient" and found_all:  # more of it holds whatever less of it does
            return [Interval(found_all[0].low, IntervalEnd(inf))]
        return found_all

    def of_load(self, conditions: ConditionsAt, low: float) -> list[Interval]:
        """Return the one interval of a parameter on which forces depend linearly."""
        here, there = conditions(self.size), conditions(2.0 * self.size)
        assert here is not None
        assert there is not None
        along = (there.right - here.right) / self.size
        still = Conditions(here.equal, here.right - self.size * along, here.cone)
        bound = 0.0 if low == 0.0 else -inf
        found = extremes(still, along, bound, self.size)
        if found is None:
            return []
        least, most = found
        aside = 1e-3 * max([self.size, *(abs(x) for x in found if abs(x) < inf)])
        first = max(bound, least - aside) if least > -inf else min(most, 0.0) - self.size
        last = most + aside if most < inf else max(least, 0.0) + self.size
        inner = 0.5 * (max(first, least) + min(last, most))
        intervals = feasible_set(
            lambda p: Conditions(still.equal, still.right + p * along, still.cone), [first, inner, last]
        )
        return [
            Interval(IntervalEnd(-inf) if least == -inf else x.low, IntervalEnd(inf) if most == inf else x.high)
            for x in intervals
        ]


def _alike(a: Floats, b: Floats) -> bool:
    return a.shape == b.shape and bool(np.abs(a - b).max(initial=0.0) <= _ALIKE * np.abs(b).max(initial=0.0))


def _same(a: Conditions | None, b: Conditions | None) -> bool:
    """Return whether conditions are the same; None are those where there is no position."""
    if a is None or b is None:
        return a is b
    return _alike(a.equal, b.equal) and _alike(a.right, b.right) and _alike(a.cone, b.cone)


def _rest_ends(
    intervals: Sequence[Interval], limits: Sequence[RestLimit], choice: PressingSides
) -> list[tuple[RestEnd, RestEnd]]:
    """Return the ends of intervals with the limits that give way there."""

    def of(end: IntervalEnd) -> RestEnd:
        against = end.gives_way
        if against is None:
            return RestEnd(end.value)
        return RestEnd(end.value, against.equal, tuple(limits[k] for k in against.cone), choice, against.shares)

    return [(of(x.low), of(x.high)) for x in intervals]


# --- the least values of a parameter, a force say, that hold and that end rest, over all values of another one -------

_SHARP: Final = 1e-10
_LEVEL: Final = 1e-9
_HUGE: Final = 1e100


@dataclass(frozen=True)
class Least:
    """The least `end` over the values of the parameter `vary`, at its value `at`, of ranges of rest of `least`.

    `side`: 0 for the ends from which on it holds, 1 for those at which rest ends. `falls`: that value is the last one
    that was tried, and the end still falls there: none is least.
    """

    least: str
    vary: str
    side: Literal[0, 1]
    end: RestEnd
    at: float
    kind: Kind
    falls: bool = False


def least_ends(position: Position, least: str, vary: str) -> tuple[Least | None, Least | None]:
    """Return the least value >= 0 that holds and the least one that ends rest, over the values of another parameter.

    The first is None where 0 holds at each value at which there is rest, the second where rest never ends. Of equal
    ones that whose other parameter is nearest to its declared value. Raises NoSolutionError where nothing holds.
    """
    search = RestSearch(position, vary, {least: position.value[least]})
    grid = search.grid(search.kind, search.searched)
    grid = grid if search.kind == "coefficient" else [*grid[:-1:2], grid[-1]]
    known: dict[float, Range | None] = {}

    def range_at(x: float) -> Range | None:
        if x not in known:
            known[x] = first_range(position, least, {vary: x})
        return known[x]

    looked = [there for x in grid if (there := range_at(x)) is not None]
    if not looked:
        raise NoSolutionError(f"rest is possible at no {least} >= 0, whatever {vary} is", number="N110")

    def lowest(side: Literal[0, 1]) -> Least | None:
        def end(x: float) -> RestEnd | None:
            there = range_at(x)
            return None if there is None else there[side]

        found = list(_minima(end, grid))
        if not found:
            return None
        low = min(end.value for _, end in found)
        level = [pair for pair in found if not _less(low, pair[1].value)]
        at, first = min(level, key=lambda pair: abs(pair[0] - position.value[vary]))
        return Least(least, vary, side, first, at, search.kind, search.kind != "angle" and _falls(grid, end, at))

    return None if all(low.value == 0.0 for low, _ in looked) else lowest(0), lowest(1)


def first_range(position: Position, least: str, others: dict[str, float]) -> Range | None:
    """Return the first range of rest from 0 upwards: from 0 itself where it holds, to infinity where rest never ends.

    None where there is no such position, or no rest.
    """
    search = RestSearch(position, least, others)
    if all(look is None for look in search.looks) or not position.has_start(others):
        return None
    for low, high in search.ranges():
        if high.value > 0.0 or (high.value == 0.0 and search.has_start(0.0)):
            is_last = not (high.limits or high.equal) and high.value >= search.searched[1]
            return low if low.value > 0.0 else RestEnd(0.0), RestEnd(inf) if is_last else high
    return None


Ends = Callable[[float], RestEnd | None]


def _less(low: float, high: float) -> bool:
    """Return whether a value is less than another one by more than rounding."""
    return high > low + _LEVEL * abs(low)


def _value(end: RestEnd | None) -> float:
    """Return the value of an end, infinite where there is no rest."""
    return inf if end is None else end.value


def _falls(grid: Sequence[float], end: Ends, at: float) -> bool:
    """Return whether a place is the last one tried in a direction, and the end still falls there.

    Zero has nothing beyond it, unless the tried values begin below.
    """
    for inward, last in ((1, grid[:2]), (-1, grid[-1:])):
        here = next((x for x in last if end(x) is not None), 0.0)
        if at == here != 0.0 and _less(_value(end(here)), _value(end(grid[grid.index(here) + inward]))):
            return True
    return False


def _minima(end: Ends, grid: Sequence[float]) -> Iterator[tuple[float, RestEnd]]:
    """Yield the places and ends of local minima, sharpened between their neighbours."""
    from scipy.optimize import minimize_scalar

    for k, x in enumerate(grid):
        here, low, high = end(x), grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)]
        beside = [_value(end(y)) for y in (low, high)]
        if here is None or here.value == inf or _less(min(beside), here.value):
            continue
        if here.value == 0.0 or not _less(here.value, max(beside)):  # nothing is less, or all is level
            yield x, here
            continue
        options = {"xatol": _SHARP * max(abs(low), abs(high))}
        sharp = minimize_scalar(
            lambda y: min(_value(end(float(y))), _HUGE), bounds=(low, high), method="bounded", options=options
        )
        there = end(float(sharp.x))
        yield (float(sharp.x), there) if there is not None and there.value < here.value else (x, here)


# --- what gives way beyond an end of a range of rest, in words -------------------------------------------------------

_CAUSES_LEVEL: Final = 1e-6
_STANDS: Final = 3
NOTHING: Final = "nothing holds it at other values"


def causes(statics: Statics, limits: Sequence[RestLimit], motion: Motion | None) -> tuple[str, ...]:
    """Return what gives way where these limits are passed; edges are named from the `motion` at the end of the range.

    Smooth contacts are named where nothing else gives way.
    """
    parts = (part for element in statics.mechanism.one_way for part in element.frictions)
    smooth = {part.name for part in parts if not part.rubs}
    rough = [limit for limit in limits if limit.kind != "cone" or limit.part not in smooth]
    found = dict.fromkeys(_causes(statics, rough, motion)) or dict.fromkeys(_causes(statics, limits, motion))
    return tuple(found) or (NOTHING,)


def _causes(statics: Statics, limits: Sequence[RestLimit], motion: Motion | None) -> Iterator[str]:
    for limit in limits:
        if limit.kind == "cone":
            elements = [x for x in statics.mechanism.one_way if (x.group or x.name) == limit.group]
            ways = [x.along for x in limits if x.group == limit.group and x.along is not None]
            # a contact that slips along several directions turns
            turns = len(ways) > 1 and float(np.ptp(np.array(ways), axis=0).max()) > _CAUSES_LEVEL
            yield f"slips at {limit.group if len(elements) > 1 else limit.part}{', turning' if turns else ''}"
        elif limit.kind == "side":
            yield f"{limit.group} presses on its other side"
        elif limit.of == "rope":
            yield f"{limit.group} slackens"
        elif limit.of == "stop":
            yield f"{limit.group} leaves its stop"
        else:
            yield from _lift_off(statics, limit, limits, motion)


def _lift_off(statics: Statics, limit: RestLimit, limits: Sequence[RestLimit], motion: Motion | None) -> Iterator[str]:
    """Yield what happens where a contact opens: its body lifts off, or tips about the corners that stay.

    On three corners it stands, and something else gives way.
    """
    corners = [] if motion is None else _touching_elements(statics, motion)
    corners = [x for x in corners if (x.group or x.name) == limit.group]
    opened = {other.part for other in limits if other.group == limit.group and other.kind == "force"}
    stay = [element for element in corners if element.name not in opened]
    if motion is None or not stay:
        yield f"lifts off at {limit.group}"
        return
    if len(stay) >= _STANDS:
        return
    away = [element for element in corners if element.name in opened]
    body = _tipping_body(statics, motion, (away, stay), limits)
    own = [element for element in stay if _touches(element).body == body]
    what = "corner" if len(stay) == 1 and len(corners) > 2 else "edge"
    word = f"{_side(motion, _middle(motion, own or stay) - _middle(motion, away))}{what}"
    about = f"its {word}" if own else f"the {word} of {_name(statics, _touches(stay[0]).body)}"
    yield f"{_name(statics, body)} tips about {about}"


def _name(statics: Statics, body: int) -> str:
    return statics.mechanism.bodies[body].name if body >= 0 else GROUND


def _tipping_body(
    statics: Statics,
    motion: Motion,
    parts: tuple[Sequence[LawElement], Sequence[LawElement]],
    limits: Sequence[RestLimit],
) -> int:
    """Return which of the two bodies of a contact turns most where its parts open, of `parts` the first.

    Rows hold but for elements that do not touch, friction that does not rub, and limits that are passed.
    """
    away, stay = parts
    bias = accelerations(motion, [0.0] * len(motion.state.u))
    passed = {(limit.kind == "cone", limit.part) for limit in limits}
    closed = {element.name for element in _touching_elements(statics, motion)}
    loose = set[int]()
    for element in statics.mechanism.one_way:
        if (False, element.name) in passed or (element.unilateral and element.name not in closed):
            loose |= set(map(id, element.rows))
        for part in element.frictions:
            if (True, part.name) in passed or not part.rubs:
                loose |= set(map(id, part.rows))
    rows = [row for row in statics.mechanism.rows if id(row) not in loose]
    held = [found.jacobian for found in (row_motion(row, motion, bias) for row in rows) if found.kinematic]
    opening = [row_motion(element.normals[0], motion, bias).jacobian for element in away]
    wanted = [1.0] * len(opening) + [0.0] * len(held)
    speeds = least_squares(np.array([*opening, *held], dtype=float), np.array(wanted))
    spins: dict[int, Vec] = {-1: ZERO_VECTOR}
    for k, (body, moved) in enumerate(zip(motion.mechanism.bodies, motion.bodies, strict=True)):
        carried = apply_transposed(moved.R_PB, spins[body.parent])
        spins[k] = add(carried, combination(moved.angular, [float(speeds[n]) for n in body.u]))
    turning = {k: float(np.linalg.norm(np.array(w, dtype=float))) for k, w in spins.items()}
    bodies = dict.fromkeys(point.body for element in (*away, *stay) for point in element.normals[0].points)
    most = max(turning[body] for body in bodies)
    return next(k for k in bodies if turning[k] >= (1.0 - _CAUSES_LEVEL) * most)


def _touching_elements(statics: Statics, motion: Motion) -> list[LawElement]:
    """Return the unilateral elements that touch."""
    return [x for x, how in standings(statics, motion, row_motions(motion)) if how == "touching"]


def _touches(element: LawElement) -> Marker:
    """Return the place of the surface that is not flat, at which its body touches."""
    row = element.normals[0]
    if row.surfaces is not None:
        return next((x.place for x in row.surfaces if x.plane is None), row.surfaces[0].place)
    return row.points[0]


def _middle(motion: Motion, elements: Sequence[LawElement]) -> Floats:
    """Return the middle of the places where elements touch (world axes)."""
    places = [np.array(position(motion, _touches(element)), dtype=float) for element in elements]
    return np.asarray(np.mean(places, axis=0))


def _side(motion: Motion, towards: Floats) -> str:
    """Return on which side an edge lies: lower or upper where gravity tells, else right or left along ground's x."""
    gravity = np.array(motion.gravity, dtype=float)
    pulled = float(np.linalg.norm(gravity))
    length = float(np.linalg.norm(towards)) or 1.0
    if pulled > 0.0 and abs(towards @ gravity) > _CAUSES_LEVEL * length * pulled:
        return "lower " if towards @ gravity > 0.0 else "upper "
    if abs(towards[0]) > _CAUSES_LEVEL * length:
        return "right " if towards[0] > 0.0 else "left "
    return ""
