"""`find`: a value of a parameter, coordinate or speed for which an equation holds; a formula where there is one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import islice, pairwise
from math import copysign, inf, isfinite, log2, nan
from typing import Final

import numpy as np

from multibody_sym import errors
from multibody_sym.algebra.quotient_functions import exact
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, why_none
from multibody_sym.algebra.roots import roots
from multibody_sym.answers.ask.from_runs import Simulated
from multibody_sym.answers.ask.in_numbers import InNumbers, NeverError
from multibody_sym.answers.ask.linear_systems import AskedModes
from multibody_sym.answers.ask.named_answers import put_in, with_answers
from multibody_sym.answers.instant.conditions import conditions_of_mode
from multibody_sym.answers.instant.instant import AGREEMENT, Solved
from multibody_sym.answers.instant.letters import free_name
from multibody_sym.derivation.symbolic_start import WORK, limits_of
from multibody_sym.errors import ExpressionError, InputError, MultibodyError, at
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.questions import in_order, named_by
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.mechanics.vocabulary import Dimensions
from multibody_sym.model.fields import Names, dimension_of_unit
from multibody_sym.model.parameters import Parameter
from multibody_sym.model.settings import Ask, Equation
from multibody_sym.model.system import System
from multibody_sym.motion.runs.run import FailedRunError
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, UNDEFINED
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, real, subtract, symbol
from multibody_sym.scalars.sign_changes import Bounded, bounded
from multibody_sym.text.units import given_in
from multibody_sym.text.values import Value

# ----------------------------------------------------------------------------------------------------------------------
# For which value: the parameter or start value for which an equation between answers holds.


_FIRST: Final = 0.05
_GROWTH: Final = 1.6
_WIDENED: Final = 14
_PARTS: Final = 24
_HALVINGS: Final = 8
"""How closely the place is looked for from which on a function has no value: a zero may lie before it."""
_MOST: Final = 4
_ACCURACY: Final = 4 * float(np.finfo(float).eps)
_FINE: Final = 1e-13
"""The part of a root to which it is looked for by runs, which are not more accurate."""
_NO_ROOT: Final = 1e-5
"""The part of the values beside it that is left at a change of sign which is a jump, or a pole, and no zero."""
_NOTHING: Final = 1e-10
"""The part of the largest value met that is zero to rounding, where a function vanishes over a whole range."""
_ROUNDING: Final = 1e-2
"""The part of that which runs leave of what vanishes, beside places where it is exactly zero."""
_RISE: Final = 1e3
"""How many times what is left in such a range a value beside it is at least."""
_BESIDE: Final = 0.1
"""The part of a bracket by which a function must vanish on from its end, for that to be in such a range."""
_EDGE: Final = 1e-12
"""The part of the end of such a range to which it is looked for."""
_SLOPE: Final = 1e-4
"""How far beside a zero, relative to it, a function's growth is looked at."""
_UNSURE: Final = 1e-6
"""The part of a zero that is its error where its function has no growth that tells, or coarser runs end otherwise."""
_JUMP: Final = 0.1
"""A power of the distance with which a function hardly grows beside a range in which it vanishes: it jumps there."""
TOLERATED: Final = 1e-8
"""The part of such an end that is its error: there forces break inequalities, which hold to less than this."""
_SHRUNK: Final = 0.25
"""The part of a bracket that its parts need not be halved at."""


Point = tuple[float, float]
ANYWHERE: Final[Point] = (-inf, inf)


@dataclass(frozen=True)
class Zero:
    """Where a function vanishes, and what is left of it there; `through`: it does so all the way from there to here.

    `other`: the end of that range on the other side, None where `through` is as far as was looked.
    `noise`: the part of the function's value that is none. `fine`: to which part of it the place was looked for.
    """

    at: float
    residual: float
    through: float | None = None
    noise: float = 0.0
    fine: float = 0.0
    other: Zero | None = None

    @property
    def ended(self) -> bool:
        """Whether both ends of the range are known in which the function vanishes."""
        return self.other is not None

    def error(self, function: Callable[[float], float], noise: float) -> float:
        """Return how far the place may be off where values of a function may be off by `noise`, or what is left there.

        Beside its zero a function grows like |x|^p: what it takes there to grow by the noise is the error.
        """
        size = abs(self.at) or 1.0
        sides = (1.0, -1.0) if self.through is None else (1.0,) if self.through <= self.at else (-1.0,)
        unsure = max(noise, self.noise, abs(self.residual))
        for side in sides if isfinite(unsure) else ():
            way = side * _SLOPE * size
            far, near = (abs(function(self.at + x) - self.residual) for x in (way, way / 2))
            if far > near > 0.0 and isfinite(far):
                power = log2(far / near)
                if self.through is not None and power < _JUMP:
                    return TOLERATED * size
                power = max(power, 1.0)
                return self.fine * size + abs(way) * float((unsure / far) ** (1.0 / power))
        return _UNSURE * size


def zeros(
    function: Callable[[float], float],
    sample: float,
    bounds: tuple[float, float] | None,
    *,
    cheap: bool = False,
    size: float = 0.0,
    limits: Point = ANYWHERE,
) -> list[Zero]:
    """Return where a function vanishes: all that a scan between bounds shows, the nearest to the sample first.

    Without bounds the one that is met first on ways out from the sample, to both sides up to `limits`; of a function
    that is `cheap` a few. Where the function is nan, it has no value. Of a range in which it vanishes everywhere, the
    end is returned, of two ends the upper one. `size`: how large the terms are that cancel where it vanishes.
    """
    if bounds is not None:
        points = [(x, function(x)) for x in map(float, np.linspace(*bounds, _PARTS + 1))]
        walk: Iterator[_Seen] = _between(function, points, size)
    else:
        walk = _outwards(function, sample, size, limits)
    fine = _ACCURACY if cheap else _FINE
    met = (zero for seen in walk if (zero := _met(function, seen, fine)) is not None)
    found = list(islice(met, None if bounds is not None else _MOST if cheap else 1))
    if found and bounds is None and found[-1].through is not None:  # the other end of the range too
        found += islice(met, 1)
    return _apart(sorted({zero.at: zero for zero in found}.values(), key=lambda zero: abs(zero.at - sample)))


def _apart(found: list[Zero]) -> list[Zero]:
    """Return zeros without those that lie in a range in which all are, of whose two ends the upper is kept."""
    ranges: list[Zero] = []
    for zero in (each for each in found if each.through is not None):
        same = next((k for k, other in enumerate(ranges) if _overlap(other, zero)), None)
        if same is None:
            ranges.append(zero)
        else:
            low, high = sorted((ranges[same], zero), key=lambda each: each.at)
            ranges[same] = replace(high, through=low.at, other=low)
    alone = [each for each in found if each.through is None and not any(_overlap(each, x) for x in ranges)]
    order = [zero.at for zero in found]
    return sorted([*ranges, *alone], key=lambda each: order.index(each.at))


def _overlap(one: Zero, two: Zero) -> bool:
    ends = [sorted((x.at, x.at if x.through is None else x.through)) for x in (one, two)]
    return max(low for low, _ in ends) <= min(high for _, high in ends)


def vanishes_about(
    function: Callable[[float], float], sample: float, bounds: tuple[float, float] | None, little: float
) -> bool:
    """Return whether a function is `little` at the sample, and wherever it has a value among some that lie about it."""
    if not abs(function(sample)) <= little:
        return False
    width = abs(sample) / 2 or 0.5
    low, high = bounds if bounds is not None else (sample - width, sample + width)
    known = [x for part in _ABOUT if isfinite(x := function(low + (high - low) * part))]
    far = reach(sample) if bounds is None else ()
    if len(known) < _ENOUGH or any(abs(x) > little for x in known):
        return False
    return not any(abs(function(x)) > little for x in far)


_ABOUT: Final = (0.0, 0.137, 0.391, 0.618, 0.853, 1.0)
"""Where between bounds a function is looked at that may vanish everywhere."""
_ENOUGH: Final = 4


def reach(sample: float, limits: Point = ANYWHERE) -> tuple[float, float]:
    """Return the least and the largest value that are tried without bounds, but for `limits`."""
    way = _FIRST * (abs(sample) or 1.0) * (_GROWTH**_WIDENED - 1) / (_GROWTH - 1)
    return max(sample - way, limits[0]), min(sample + way, limits[1])


def _changes(a: Point, b: Point) -> bool:
    return isfinite(a[1]) and isfinite(b[1]) and (a[1] == 0.0 or a[1] * b[1] < 0.0)


@dataclass(frozen=True)
class _Seen:
    """A bracket among the points at which a function of so large terms was looked at, in their order."""

    a: Point
    b: Point
    points: Sequence[Point]
    size: float

    @property
    def little(self) -> float:
        """What is zero to rounding."""
        seen = (abs(y) for _, y in (*self.points, self.a, self.b) if isfinite(y))
        return _NOTHING * max(self.size, max(seen, default=0.0))

    @property
    def is_nothing(self) -> bool:
        """Whether both ends are rounding of the terms that cancel: no root, but within a range."""
        return max(abs(self.a[1]), abs(self.b[1])) <= _NOTHING * self.size

    def noise(self, end: float, through: float) -> float:
        """Return the largest value met in a range in which the function vanishes."""
        low, high = sorted((end, through))
        return max((abs(y) for x, y in self.points if low <= x <= high), default=0.0)

    def through(self, end: Point, other: Point) -> float:
        """Return how far the function vanishes from an end of the bracket on, away from the other."""
        side = 1.0 if end[0] > other[0] else -1.0
        beyond = sorted((x for x in self.points if (x[0] - end[0]) * side > 0.0), key=lambda x: x[0] * side)
        last = end[0]
        for x, y in beyond:
            if not abs(y) <= self.little:
                break
            last = x
        return last


def _between(function: Callable[[float], float], points: list[Point], size: float) -> Iterator[_Seen]:
    """Yield the brackets of points in turn."""
    return (_Seen(*_with_values(function, a, b), points, size) for a, b in pairwise(points))


def _outwards(function: Callable[[float], float], sample: float, size: float, limits: Point) -> Iterator[_Seen]:
    """Yield the brackets that are met on the way from the sample outwards, to one side and the other in turn."""
    low, high = limits if limits[0] <= sample <= limits[1] else ANYWHERE
    here = (sample, function(sample))
    points = [here]
    ends = {1.0: here, -1.0: here}
    step = _FIRST * (abs(sample) or 1.0)
    for k in range(_WIDENED):
        before = ends
        ways = {side: min(max(last[0] + side * step, low), high) for side, last in before.items()}
        ends = {side: (x, function(x)) for side, x in ways.items() if x != before[side][0]}
        points += ends.values()
        if k == 0 and here[1] == 0.0 and all(not abs(y) <= _NOTHING * size for _, y in ends.values()):
            yield _Seen(here, here, points, size)
        for side, end in ends.items():
            yield _Seen(*_with_values(function, before[side], end), tuple(sorted(points)), size)
        step *= _GROWTH


def _with_values(function: Callable[[float], float], a: Point, b: Point) -> tuple[Point, Point]:
    """Return two points; for one without a value, the last on the way there that has one, or another sign."""
    if isfinite(a[1]) == isfinite(b[1]):
        return a, b
    known, without = (a, b[0]) if isfinite(a[1]) else (b, a[0])
    begin = last = known
    for _ in range(_HALVINGS):
        x = (last[0] + without) / 2
        value = function(x)
        if not isfinite(value):
            without = x
            continue
        last = (x, value)
        if _changes(begin, last):
            break
    return (begin, last) if known is a else (last, begin)


def _met(function: Callable[[float], float], seen: _Seen, fine: float) -> Zero | None:
    """Return the zero in a bracket, the end of a range in which the function vanishes where one ends there."""
    edge = _edge(function, seen)
    if edge is not None:
        return edge
    return _zero(function, seen.a, seen.b, fine) if _changes(seen.a, seen.b) and not seen.is_nothing else None


def _edge(function: Callable[[float], float], seen: _Seen) -> Zero | None:
    """Return the end of a range in which a function vanishes, to rounding, None where none ends in a bracket.

    It vanishes at one end of the bracket, and on from there as well: that tells a range from a zero that was hit.
    """
    zero, other = sorted((seen.a, seen.b), key=lambda x: abs(x[1]))
    if not (isfinite(zero[1]) and isfinite(other[1]) and abs(zero[1]) <= seen.little < abs(other[1])):
        return None
    through = seen.through(zero, other)
    way = _BESIDE * (zero[0] - other[0]) if through != zero[0] else _BESIDE * (other[0] - zero[0])
    beside = function(zero[0] + way)
    left = max(abs(zero[1]), abs(beside), seen.noise(zero[0], through))
    if not left <= min(seen.little, abs(other[1]) / _RISE):
        return None
    little = max(4 * left, _ROUNDING * seen.little)
    return Zero(*_last_within(function, zero, other, little), through, noise=little, fine=_EDGE)


def _last_within(function: Callable[[float], float], inside: Point, outside: Point, little: float) -> Point:
    """Return the last point from `inside` on, to rounding, at which a function is `little`; it is not so outside.

    Outside it grows from there on: a line through the last two points outside tells where, to its curvature, and it is
    looked at by as much to both sides of that; halves are taken where this shrinks the bracket little.
    """
    whole, before = abs(outside[0] - inside[0]), outside
    while abs(width := outside[0] - inside[0]) > (fine := _EDGE * max(abs(outside[0]), abs(inside[0]))):
        looked = [inside[0] + width / 2]
        if before[1] != outside[1]:
            slope = (outside[1] - before[1]) / (outside[0] - before[0])
            end = outside[0] - outside[1] / slope
            curved = 2 * abs((outside[0] - end) * (before[0] - end)) / whole
            aside = copysign(max(curved, 2 * little / abs(slope), fine / 4), width)
            if (end - inside[0] + aside) * width > 0.0:
                looked = [end + aside, end - aside, *looked]
        for x in looked:
            if not min(inside[0], outside[0]) < x < max(inside[0], outside[0]):
                continue
            there = (x, function(x))
            if abs(there[1]) <= little:
                inside = there
            else:
                before, outside = outside if abs(outside[1]) > _RISE * little else before, there
            if abs(outside[0] - inside[0]) <= _SHRUNK * abs(width):
                break
    return inside


def _zero(function: Callable[[float], float], a: Point, b: Point, fine: float) -> Zero | None:
    """Return the zero in a bracket, None where the function jumps there."""
    if a[1] == 0.0:
        return Zero(a[0], 0.0, fine=fine)
    from scipy.optimize import brentq  # scipy takes longer to import than most answers take

    known = dict((a, b))

    def remembered(x: float) -> float:
        if x not in known:
            known[x] = function(x)
        return known[x]

    try:
        root = float(brentq(remembered, a[0], b[0], xtol=fine * max(abs(a[0]), abs(b[0])), rtol=fine))
    except ValueError:
        return None
    left = remembered(root)
    return Zero(root, left, fine=fine) if abs(left) <= _NO_ROOT * max(abs(a[1]), abs(b[1])) else None


UNKNOWN: Final = nan
"""The value of a function where it has none."""


# ----------------------------------------------------------------------------------------------------------------------

_LEFT: Final = "left - right"
_FOUND_VALUES_NOTHING: Final = 1e-9
"""The part of the answers that an equation names below which its sides are the same."""
_ASIDE: Final = 0.01
"""How far from a value that runs found, relative to it, the formulas are made of which it is a root."""
_HOLDS: Final = 1e-6
"""The part of its size at the sample that a formula's equation may miss in numbers where that formula holds."""


def extremes_of(equation: Equation) -> dict[str, Ask]:
    """Return the extremes that an equation asks for, as questions of their own."""
    found = equation.extremes.items()
    return {name: Ask(max=x.of) if x.kind == "max" else Ask(min=x.of) for name, x in found}


@dataclass(frozen=True)
class Search:
    """What is looked for in a solved system; `known`: the answers that the equation names, by their names.

    `solve` answers the questions of another system, and tells what is to be said of the answers.
    """

    solved: Solved
    question: Ask
    known: Mapping[str, Value]
    solve: Callable[[System], tuple[Solved, Mapping[str, Value], list[str]]]

    def found(self) -> tuple[Value, list[str]]:
        """Return the value, and what is to be said of it."""
        self._verify_units()
        little = _FOUND_VALUES_NOTHING * max((abs(x.value or 0.0) for x in self.known.values()), default=0.0)
        if vanishes_about(self.residual, self.sample, self.bounds, little):
            return Value(None), [f"any value of {self.name} will do: {self.equation} holds for all that were tried"]
        formula = self._by_formula()
        if formula is not None:
            return formula
        found = zeros(self.residual, self.sample, self.bounds, size=self._size, limits=self.limits)
        if not found:
            told = f"no value of {self.name} was found for which {self.equation} {self._where}{self._failing}"
            return Value(None), [told]
        value, *others = (self._by_runs(zero) for zero in found)
        how = self._first(value, found, others, *([self._missed(found, "by runs")] if value.expression is None else []))
        return value, [*how, *self._told(found[0].at)]

    def _by_runs(self, zero: Zero) -> Value:
        """Return a value that runs found; where it has a formula, the formula's own value."""
        expression = self._by_formula_beside(zero)
        return self._number(zero, self.residual, self._noise(zero.at)) if expression is None else self._of(expression)

    def _of(self, expression: Node) -> Value:
        return Value(evaluate_float([expression], self.solved.sample)[0], expression, self._unit)

    def _number(self, zero: Zero, function: Callable[[float], float], noise: float) -> Value:
        return Value(zero.at, unit=self._unit, error=zero.error(function, noise))

    def _noise(self, value: float) -> float:
        """Return by how much left - right may be off at a value, as coarser runs show it; unknown where these fail."""
        try:
            coarse, _ = self._difference(self._changed(value), is_coarse=True)
        except (MultibodyError, NeverError, *UNDEFINED):
            return UNKNOWN
        return Simulated(self._posed).part_of_coarser * abs(coarse - self.residual(value))

    @cached_property
    def _unit(self) -> str:
        (unit,) = MechanismUnits(self.solved.mechanism).of([symbol(self.name)])
        return unit

    @cached_property
    def _size(self) -> float:
        """How large the quantities are whose extremes the equation names, along the motion of the sample."""
        quantities = [x.of for x in self.equation.extremes.values()]
        asked = [Ask(max=of) for of in quantities] + [Ask(min=of) for of in quantities]
        if not asked:
            return 0.0
        names = {f"extreme_{k}": each for k, each in enumerate(asked)}
        try:
            _, answers, _ = self.solve(self._posed.with_fields({"ask": Names(names)}))
        except (MultibodyError, *UNDEFINED):
            return 0.0
        return max((abs(answers[name].value or 0.0) for name in names), default=0.0)

    # --- what is looked for ---------------------------------------------------------------------------------------

    @property
    def name(self) -> str:
        """What a value is looked for of."""
        assert self.question.find is not None
        return self.question.find

    @property
    def equation(self) -> Equation:
        """What holds there."""
        assert self.question.so is not None
        return self.question.so

    @cached_property
    def sample(self) -> float:
        """The value that the model has."""
        starts = dict(zip(self._start_names, (*self.solved.begin.q, *self.solved.begin.u), strict=True))
        if self.name in starts:
            return float(starts[self.name])
        return self.solved.number(symbol(self.name))

    @property
    def bounds(self) -> tuple[float, float] | None:
        """The bounds between which it is looked for."""
        if self.question.between is None:
            return None
        low, high = map(self.solved.number, self.question.between)
        return min(low, high), max(low, high)

    @cached_property
    def limits(self) -> tuple[float, float]:
        """The least and the greatest value that it may have."""
        return ANYWHERE if self.name in self._start_names else limits_of(self.solved.mechanism, self.name)

    @property
    def _start_names(self) -> list[str]:
        mechanism = self.solved.mechanism
        return [*(c.name for c in mechanism.coordinates), *(s.name for s in mechanism.speeds)]

    @property
    def _where(self) -> str:
        if self.bounds is None:
            low, high = reach(self.sample, self.limits)
            return f"from {low:.6g} to {high:.6g}, on the way out from {self.sample:.6g}; say where: between: [.., ..]"
        return "between {:.6g} and {:.6g}".format(*self.bounds)

    @property
    def _failing(self) -> str:
        """Return that runs failed where it was looked for, and how the first of them did; else nothing."""
        if not self._failed:
            return ""
        value, reason = next(iter(self._failed.items()))
        tried = f"{len(self._failed)} of the {len(self._known)} values tried"
        return f"; {tried} have no answer, as {value:.6g}, since runs fail: {reason}"

    def _missed(self, found: list[Zero], how: str) -> str:
        return f"{how}; the sides of {self.equation} differ by {abs(found[0].residual):.1e} there"

    def _first(self, value: Value, found: list[Zero], others: list[Value], *told: str) -> list[str]:
        """Return that other values were not looked for, or which they are, after what is `told`."""
        if self.bounds is not None:
            return [*told, *self._others(value, found, others)]
        first = f"the first on the way out from {self.sample:.6g}, others were not looked for (between: ..)"
        return ["; ".join((*told, first)), *self._range(value, found[0])]

    def _others(self, value: Value, found: list[Zero], others: list[Value]) -> list[str]:
        told = [_place(*pair) for pair in zip(others, found[1:], strict=True)]
        return [*self._range(value, found[0]), *([f"others are {', '.join(told)}"] if told else [])]

    def _range(self, value: Value, zero: Zero) -> list[str]:
        """Return that the equation holds in a whole range, of which the value is an end."""
        if zero.through is None:
            return []
        if zero.other is not None:
            low = self._by_runs(zero.other)
            return [f"{self.equation} holds for every {self.name} from {low} to {value}"]
        side = "above" if zero.through > zero.at else "below"
        what = f"{self.equation} holds there and for every {self.name} {side}"
        return [f"{what}, as far as was looked: {'to' if side == 'above' else 'down to'} {zero.through:.6g}"]

    def _verify_units(self) -> None:
        """Raise ModelError where the sides of the equation are in different units, with those of answers."""
        of_answers = {symbol(name): given_in(dimension_of_unit(x.unit)) for name, x in self.known.items() if x.unit}
        with at("so"):
            Dimensions(self.solved.system).verify_sides(self.equation, of_answers)

    # --- in numbers -----------------------------------------------------------------------------------------------

    def residual(self, value: float) -> float:
        """Return left - right at a value of what is looked for, nan where there is no such motion, or answer."""
        if value not in self._known:
            self._known[value] = self._residual(value)
        return self._known[value]

    @cached_property
    def _known(self) -> dict[float, float]:
        return {}

    def _residual(self, value: float) -> float:
        try:
            left, self._told_at[value] = self._difference(self._changed(value), is_coarse=False)
            return left
        except FailedRunError as failed:
            self._failed[value] = failed.message
            return UNKNOWN
        except (MultibodyError, NeverError, *UNDEFINED):
            return UNKNOWN

    def _changed(self, value: float) -> System:
        """Return the system that is asked what the equation needs, at a value of what is looked for."""
        change = {self.name: value}
        is_parameter = self.name in self.solved.system.parameters
        return (Overrides(parameters=change) if is_parameter else Overrides(initial=change)).of(self._posed)

    @cached_property
    def _failed(self) -> dict[float, str]:
        """Why runs fail, by the values at which they do."""
        return {}

    def _difference(self, system: System, *, is_coarse: bool) -> tuple[float, list[str]]:
        """Return left - right of a system, and what is to be said of the answers there."""
        numbers, modes = InNumbers(Simulated(system, is_coarse)), AskedModes(system)
        answers: dict[str, Value] = {}
        there: list[str] = []
        for name in in_order(system.ask, self.solved.mechanism.symbols):
            named = with_answers(system.ask[name], answers, self.solved.mechanism.symbols)
            if named is None:
                return UNKNOWN, []
            before = len(numbers.told)
            answers[name] = numbers.answer(modes.put_in(named[0])[0])
            there += [f"there {name}: {told}" for told in numbers.told[before:]]
        value = answers[_LEFT].value
        return (UNKNOWN if value is None else value), there

    @cached_property
    def _told_at(self) -> dict[float, list[str]]:
        return {}

    def _told(self, value: float) -> list[str]:
        """Return what is to be said of the answers at a value that was found."""
        if value not in self._told_at:
            self.residual(value)
        failed = self._failed.get(value)
        unconfirmed = [] if failed is None else [f"by formulas, since the run that would confirm it fails: {failed}"]
        return [*unconfirmed, *dict.fromkeys(self._told_at.get(value, ()))]

    @property
    def _asked(self) -> Ask:
        """What is to vanish, as a question."""
        return Ask(value=subtract(self.equation.left, self.equation.right))

    @cached_property
    def _posed(self) -> System:
        """The system that is asked only what the equation needs."""
        asked = {**self.solved.system.ask, **extremes_of(self.equation)}
        asked[_LEFT] = self._asked
        needed = [_LEFT]
        for name in needed:
            needed += sorted(named_by(asked[name], asked, self.solved.mechanism.symbols).difference(needed))
        return self.solved.system.with_fields({"ask": Names({name: asked[name] for name in needed})})

    # --- in closed form -------------------------------------------------------------------------------------------

    def _by_formula(self) -> tuple[Value, list[str]] | None:
        """Return the value where the answers have formulas that hold there too."""
        node = self._formula()
        if node is None:
            return None
        sample = self.solved.sample

        def value(x: float) -> float:
            try:
                return evaluate_float([node], {**sample, symbol(self.name): x})[0]
            except (ExpressionError, *UNDEFINED):
                return UNKNOWN

        found = zeros(value, self.sample, self.bounds, cheap=True, limits=self.limits)
        scale = abs(value(self.sample))
        found = [x for x in found if abs(self._confirmed(x.at)) <= _HOLDS * scale]
        if not found:
            return None
        expression = self._root(node, symbol(self.name), found[0].at, self.solved)
        how = [] if expression is not None else [self._missed(found, "by its formula, in numbers")]
        first, *others = (self._number(x, value, self._rounding(node, x.at)) for x in found)
        first = first if expression is None else self._of(expression)
        return first, [*how, *self._others(first, found, others), *self._told(found[0].at)]

    def _rounding(self, node: Node, value: float) -> float:
        """Return what rounding makes of a formula at a value."""
        sample = {**self.solved.sample, symbol(self.name): value}
        return bounded([node], {x: Bounded(y, EPSILON * abs(y)) for x, y in sample.items()})[0].bound

    def _confirmed(self, value: float) -> float:
        """Return left - right at a value by runs; where these fail, of answers there that hold without reservation."""
        left = self.residual(value)
        if value not in self._failed:
            return left
        try:
            _, answers, remarks = self.solve(self._changed(value))
        except (MultibodyError, *UNDEFINED):
            return UNKNOWN
        again = answers[_LEFT].value
        return UNKNOWN if again is None or remarks else again

    def _formula(self) -> Node | None:
        """Return left - right in the model's symbols, None where an answer has no formula."""
        if any(x.expression is None for x in self.known.values()):
            return None
        try:
            asked, closed = AskedModes(self.solved.system, self.solved.symbolic.letters).put_in(self._asked)
        except errors.NoSolutionError:
            return None  # the value that the model has need not oscillate where others do
        if not closed:
            return None
        difference = asked.value
        assert difference is not None
        formulas = {symbol(name): x.expression for name, x in self.known.items() if x.expression is not None}
        node = put_in(difference, formulas)
        letters = self.solved.symbolic.letters
        if leaves([node], "quantity") or any(x not in letters for x in leaves([node], "symbol")):
            return None
        return node if symbol(self.name) in leaves([node], "symbol") else None

    def _by_formula_beside(self, zero: Zero) -> Node | None:
        """Return a value that runs found as the root of the formula which the equation has beside it.

        Outside of a range in which it holds throughout.
        """
        aside = _ASIDE * (abs(zero.at) or 1.0)
        sides = (1.0, -1.0) if zero.through is None else (1.0,) if zero.through <= zero.at else (-1.0,)
        for side in sides:
            try:
                expression = self._root_beside(zero, zero.at + side * aside)
            except (MultibodyError, *UNDEFINED):
                continue
            if expression is not None:
                return expression
        return None

    def _root_beside(self, zero: Zero, beside: float) -> Node | None:
        """Return a zero as the root of the formula that left - right has where what is looked for is `beside` it.

        The end of a range in which that vanishes may be where a condition comes to hold under which it has the formula.
        """
        system, unknown = self._with_letter(beside)
        solved, answers, _ = self.solve(system)
        node = answers[_LEFT].expression
        found = None if node is None else self._root_near(node, unknown, zero.at, beside, solved, AGREEMENT)
        if found is not None or zero.through is None:
            return found
        forms = (solved.value_of(condition.value) for condition in conditions_of_mode(solved))
        nodes = (form.expression for form in forms if form is not None and form.expression is not None)
        roots = (self._root_near(x, unknown, zero.at, beside, solved, TOLERATED) for x in nodes)
        return next((root for root in roots if root is not None), None)

    def _root_near(
        self, node: Node, unknown: Node, value: float, beside: float, solved: Solved, part: float
    ) -> Node | None:
        """Return the root of a formula that is a value, to a `part` of it, as an expression."""

        def left(x: float) -> float:
            return evaluate_float([node], {**solved.sample, unknown: x})[0]

        reach = 2 * abs(beside - value)
        near = zeros(left, beside, (value - reach, value + reach), cheap=True)
        at = min((x.at for x in near), key=lambda x: abs(x - value), default=UNKNOWN)
        return self._root(node, unknown, at, solved) if abs(at - value) <= part * abs(value) else None

    def _with_letter(self, value: float) -> tuple[System, Node]:
        """Return the system that is asked what the equation needs, at a value that a parameter has, and its symbol."""
        if self.name in self._posed.parameters:
            return Overrides(parameters={self.name: value}).of(self._posed), symbol(self.name)
        name = free_name(f"{self.name}_0", {str(x.data) for x in self.solved.mechanism.symbols} | {*self._posed.ask})
        more = Names({**self._posed.parameters, name: Parameter(value=real(value))})
        return Overrides(initial={self.name: symbol(name)}).of(replace(self._posed, parameters=more)), symbol(name)

    def _root(self, node: Node, unknown: Node, value: float, solved: Solved) -> Node | None:
        """Return the root as an expression, None where there is none whose value it is."""
        letters = dict(solved.symbolic.letters)
        letters[unknown] = Letter(unknown, PRECISE.mpf(value), letters[unknown].positive)
        field = Field(WORK)
        try:
            known = {x: field.letter(x, letter) for x, letter in letters.items()}
            (equation,) = exact(field, [node], known)
            for root in roots(equation, unknown):
                if abs(evaluate_float([root], self.solved.sample)[0] - value) <= AGREEMENT * abs(value):
                    return root
        except (NoClosedFormError, InputError, *UNDEFINED) as reason:
            self.solved.reasons[why_none(reason)] = None
        return None


def _place(value: Value, zero: Zero) -> str:
    """Return where a function vanishes, for people."""
    return str(value) if zero.through is None else f"{value} to {zero.through:.6g}"
