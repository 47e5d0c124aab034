"""Coordinates and speeds as formulas: of the time, where equations of motion have a known solution.

One coordinate at a time, whose acceleration depends on no other one: linear with constant coefficients, or separable.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import field, replace
from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.conditions import Condition, comparison, reduced, relation
from multibody_sym.algebra.quotient_functions import sign
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.algebra.solving.roots import rate
from multibody_sym.answers.closed_form import WORK
from multibody_sym.answers.instant import Solved
from multibody_sym.answers.questions.anywhere import TIME, Anywhere, Granted, anywhere
from multibody_sym.answers.questions.linear_courses import Linear
from multibody_sym.answers.questions.separable_courses import BySpeed
from multibody_sym.answers.questions.simulated_motion import Simulated
from multibody_sym.answers.questions.timed_courses import WithTime
from multibody_sym.errors import ExpressionError
from multibody_sym.model.declaration.states import VERBS, WAYS
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import PI, TWO, Node, as_node, multiply, symbol
from multibody_sym.scalars.traversal import leaves
from multibody_sym.simulation.trajectory import Trajectory

_LOOKS: Final = 41
_FITS: Final = 1e-7
"""To which part of the largest value a formula is what a run shows."""
_SIGNS: Final = 101
_NO_SPEED: Final = 1e-9
"""The part of its largest value below which what has a sign in the equations is zero."""
_NO_TIME: Final = 1e-12
"""The part of a run before whose end a state that changes has not lasted at all."""
_FIRST_LOOK: Final = 40
"""The first sample at which it is looked for equations whose signs hold from the start on."""


@dataclass(frozen=True, eq=False)
class InTime:
    """A coordinate or speed as a `formula` of t, which takes for granted what is `granted`.

    It holds until a time `until` (None: as long as was looked) at which the sign `ending` fails, as that of a speed.
    """

    formula: Node
    granted: Granted
    until: float | None = None
    ending: str = ""

    def conditions(self) -> Iterator[str]:
        """Yield what is to hold of parameters and of time, for people."""
        yield from map(str, least_conditions(self.granted.positive))
        for word, group in (("==", self.granted.equal), ("!=", self.granted.unequal)):
            yield from dict.fromkeys(relation(x, word) for x in group)
        if self.until is not None:
            yield f"while {self.ending}, until t = {self.until:.6g} s"


def formulas_of_time(there: Anywhere) -> Mapping[Node, InTime]:
    """Return coordinates and speeds, by their symbols, as formulas of t, where equations have a known solution."""
    mechanism, state = there.solved.mechanism, there.solved.nodes.motion.state
    found: dict[Node, InTime] = {}
    for k, (coordinate, speed) in enumerate(zip(mechanism.coordinates, mechanism.speeds, strict=True)):
        q, u = symbol(coordinate.name), symbol(speed.name)
        signs = there.forms.field.positive
        granted = Granted()
        there.forms.field.positive = granted.positive  # those that this coordinate's formulas add
        try:
            course = _course(there, granted, k, (q, u), (as_node(state.q[k]), as_node(state.u[k])))
        except NoClosedFormError:
            continue
        finally:
            there.forms.field.positive = signs
        found |= course
    return found


@dataclass(frozen=True, eq=False)
class Shown:
    """A `run` up to its sample `last`, where a state changes first, and the equations `there` as they begin."""

    solved: Solved
    run: Trajectory
    last: int
    there: Anywhere | None
    _differ: dict[Quotient, bool] = field(default_factory=dict)

    @classmethod
    def of(cls, solved: Solved, motion: Simulated) -> Shown:
        """Return what a run shows of a solved system: its equations half way, or earlier where signs differ."""
        run = motion.whole
        until = min((float(change["t"]) for change in run.changes), default=run.t_final)
        last = int(np.searchsorted(run.t, until, side="right")) - 1
        found = cls(solved, run, last, None)
        place = last // 2
        while until > _NO_TIME * run.t_final:
            there = anywhere(solved, *found._state(place))
            found = cls(solved, run, last, there)
            if there is None or place < _FIRST_LOOK or not found._ends_before(place):
                return found
            place //= 4
        return found

    def _state(self, place: int) -> tuple[list[float], list[float]]:
        mechanism = self.solved.mechanism
        groups = (mechanism.coordinates, mechanism.speeds)
        q, u = ([float(self.run[x.name][place]) for x in group] for group in groups)
        return q, u

    def _ends_before(self, place: int) -> bool:
        return min(self._signs.values(), default=math.inf) <= float(self.run.t[place])

    @cached_property
    def _signs(self) -> dict[Quotient, float]:
        """The times from which on signs of what moves are others than in the equations, where they come to that."""
        found = {}
        for positive in self.there.forms.field.positive if self.there is not None else ():
            if self.there is not None and not self.there.constant(positive):
                time = self._fails(book_form(positive))
                if time is not None:
                    found[positive] = time
        return found

    def _fails(self, node: Node) -> float | None:
        """Return the time at which what is positive turns negative, None where it does not."""
        looked = np.unique(np.linspace(0, self.last, _SIGNS).astype(int))
        values = self._values(node, looked)
        little = _NO_SPEED * float(np.abs(values).max())
        others = np.flatnonzero(~(values >= -little))
        if not len(others):
            return None
        near = np.arange(looked[max(others[0] - 1, 0)], looked[others[0]] + 1)
        values = self._values(node, near)
        k = int(np.flatnonzero(~(values >= -little))[0])
        if k == 0:
            return 0.0
        t, (before, after) = self.run.t[near[k - 1 : k + 1]], values[k - 1 : k + 1]
        return float(t[0] + (t[1] - t[0]) * before / (before - after)) if np.isfinite(after) else float(t[0])

    def _values(self, node: Node, looked: Sequence[int] | Floats) -> Floats:
        """Return the values of an expression at samples of the run."""
        assert self.there is not None
        named = {*leaves([node], "symbol")} & self.there.variables - {TIME}
        series = {TIME: self.run.t, **{x: self.run[str(x.data)] for x in named}}
        known = self.solved.sample
        return np.array(
            [evaluate_float([node], {**known, **{x: float(y[k]) for x, y in series.items()}})[0] for k in looked]
        )

    def _matters(self, positive: Quotient) -> bool:
        """Return whether the equations are others where a sign fails: that of the length of a damper has no say."""
        if positive not in self._differ:
            node, looked = book_form(positive), np.unique(np.linspace(0, self.last, _SIGNS).astype(int))
            place = int(looked[int(np.argmin(self._values(node, looked)))])
            other = anywhere(self.solved, *self._state(place))
            pairs = zip(self.there.forms.udot, other.forms.udot, strict=True) if self.there and other else None
            kept = other is None or any(book_form(x) is node for x in other.forms.field.positive)
            self._differ[positive] = kept or any(book_form(a) is not book_form(b) for a, b in pairs or ())
        return self._differ[positive]

    def confirmed(self, formulas: Mapping[Node, InTime]) -> dict[Node, InTime]:
        """Return formulas of time without those that are not what the run shows."""
        found = {}
        for node, each in formulas.items():
            until, ending = self._end(node)
            last = self.last if until is None else int(np.searchsorted(self.run.t, until)) - 1
            looked = np.unique(np.linspace(0, max(last, 0), _LOOKS).astype(int))
            shown = self.run[str(node.data)][looked]
            if _fits(each.formula, self.solved.sample, self.run.t[looked], shown):
                found[node] = replace(each, until=until, ending=ending)
        return found

    def _end(self, node: Node) -> tuple[float | None, str]:
        """Return until when formulas of a coordinate, or a speed, hold for its signs, and the sign that fails then."""
        mechanism = self.solved.mechanism
        names = zip(mechanism.coordinates, mechanism.speeds, strict=True)
        own = next({symbol(q.name), symbol(u.name)} for q, u in names if node.data in (q.name, u.name))
        ends = [(time, comparison(x)) for x, time in self._signs.items() if own & x.symbols and self._matters(x)]
        return min(ends, default=(None, ""), key=lambda each: each[0] or 0.0)


def least_conditions(positive: Sequence[Quotient]) -> list[Condition]:
    """Return as few conditions as say that quotients are positive."""
    if not positive:
        return []
    positive[0].field.work += WORK
    conditions = [Condition(x, strict=True, under_root=True) for x in positive]
    try:
        return reduced(conditions)
    except NoClosedFormError:
        return conditions


def held_until(motion: Simulated) -> str:
    """Return until when formulas of time are those of a motion in which states may change, as a run shows it."""
    run = motion.whole
    if not run.changes:
        return f"of the motion without a change of state, of which there is none until t = {run.t_final:.6g} s"
    first = float(run.changes[0]["t"])
    begun = dict.fromkeys(_begun(each["element"], each["kind"]) for each in run.changes if float(each["t"]) == first)
    return f"of the motion until the first change of state: {', '.join(begun)} at t = {first:.6g} s"


def _begun(element: str, kind: str) -> str:
    """Return what an element begins to do, for people."""
    verb = min((verb for verb, words in VERBS.items() if kind in words), key=lambda x: len(VERBS[x]), default=kind)
    return f"{element} {verb} {WAYS.get(kind[-1], '')}".rstrip()


def formula_of_period(solved: Solved, coordinate: str, number: float) -> Node | None:
    """Return 2 pi/sqrt(-A) for a coordinate with q'' = A q + c, where it has the number's value; else None."""
    names = [c.name for c in solved.mechanism.coordinates]
    there = anywhere(solved, solved.begin.q, solved.begin.u) if coordinate in names else None
    if there is None or len(names) != len(solved.mechanism.speeds):
        return None
    q, acceleration = symbol(coordinate), there.forms.udot[names.index(coordinate)]
    if acceleration.symbols & (there.variables - {q}):
        return None
    try:
        slope = rate(acceleration, q)
        if slope.symbols & there.variables or slope.is_zero or sign(slope) > 0:
            return None
        formula = multiply(multiply(TWO, PI), BUILD["sqrt"](Granted().written(-slope.power(-1))))
        near = abs(evaluate_float([formula], solved.sample)[0] - number) <= _FITS * number
    except (NoClosedFormError, ExpressionError, *UNDEFINED):
        return None
    return formula if near else None


def _fits(formula: Node, sample: Mapping[Node, float], t: Floats, shown: Floats) -> bool:
    """Return whether a formula has the values of a run."""
    try:
        told = [evaluate_float([formula], {**sample, TIME: float(x)})[0] for x in t]
    except (ExpressionError, *UNDEFINED):
        return False
    return bool(np.abs(np.array(told) - shown).max() <= _FITS * max(1e-300, float(np.abs(shown).max())))


def _course(
    there: Anywhere, granted: Granted, k: int, own: tuple[Node, Node], start: tuple[Node, Node]
) -> dict[Node, InTime]:
    """Return a coordinate and its speed, `own`, from a `start` on as formulas of time, as far as they are known."""
    acceleration, (q, u) = there.forms.udot[k], own
    if acceleration.symbols & (there.variables - {q, u, TIME}):
        return {}
    by_q, by_u = rate(acceleration, q), rate(acceleration, u)
    course: tuple[Node, Node] | None = None
    if there.constant(by_u) and there.constant(by_q):
        rest = acceleration - by_q * there.letter(q) - by_u * there.letter(u)
        with suppress(NoClosedFormError):
            way = Linear(there, granted, by_q, by_u, rest).course(*start)
            course = None if way is None else (way, derivative(way, TIME))
    elif by_q.is_zero and TIME not in acceleration.symbols:
        course = BySpeed(there, granted, u, *start).course(acceleration)
    if course is not None:
        return {node: InTime(formula, granted) for node, formula in zip(own, course, strict=True)}
    return _course_with_time(there, granted, own, start, acceleration) if by_q.is_zero else {}


def _course_with_time(
    there: Anywhere, granted: Granted, own: tuple[Node, Node], start: tuple[Node, Node], acceleration: Quotient
) -> dict[Node, InTime]:
    """Return a speed as a formula of time, and its coordinate where the integral is known."""
    q, u = own
    speed = WithTime(there, granted, u, *start).speed(acceleration)
    if speed is None:
        return {}
    found = {u: InTime(speed, granted)}
    more = replace(granted, equal=[*granted.equal], unequal=[*granted.unequal])
    with suppress(NoClosedFormError):
        found[q] = InTime(WithTime(there, more, u, *start).way(speed), more)
    return found
