"""Questions with one number: a time, a speed, a path, a value, a period; steps of forces in structures at rest."""

from __future__ import annotations

import operator
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial, reduce
from typing import Final, Self

import numpy as np

from multibody_sym.algebra.quotient_functions import exact_solve, sign
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.algebra.roots import rate
from multibody_sym.analysis.modes.modes import NoPeriodError
from multibody_sym.answers.ask.courses import FITS
from multibody_sym.answers.ask.energy_integral import NEAR_REST, ToAndFro
from multibody_sym.answers.ask.kinematics import kinematic_lines
from multibody_sym.answers.ask.later_formulas import BouncingFormulas, MotionFormulas, component_along
from multibody_sym.answers.ask.linear_systems import shortest_course
from multibody_sym.answers.ask.named_answers import Granted, anywhere
from multibody_sym.answers.ask.question import (
    MOMENT,
    ROUNDING,
    AskedMotion,
    LaterQuestion,
    NeverError,
    NumberQuestion,
    RunNumbers,
    UniformQuestion,
)
from multibody_sym.answers.ask.uniform_motion import UniformMotion
from multibody_sym.answers.ask.working import OMEGA, Working, acceleration, direction_text, equation, time_text, written
from multibody_sym.answers.instant.instant import AGREEMENT, SolvedInstant, with_letters
from multibody_sym.answers.instant.letters import TIME, acceleration_names, put_in
from multibody_sym.answers.records import Formula, Line, Sentence
from multibody_sym.derivation.symbolic_start import linear_equations
from multibody_sym.errors import ExpressionError, at
from multibody_sym.mechanics.gears import undetermined_reactions
from multibody_sym.model.fields import AXES, Point
from multibody_sym.model.settings import Ask
from multibody_sym.model.state_words import Moment, moment_text
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.elementary import BUILD, leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import PI, ZERO, Node, as_node, quantity, symbol
from multibody_sym.scalars.rank import CLOSED, rank
from multibody_sym.text.parser import of_run
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value


@dataclass(frozen=True)
class TimeQuestion(UniformQuestion):
    """The time at which a moment comes."""

    si_unit = "s"

    when: Moment

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.when is None or ask.value is not None else cls(ask.when)

    def words(self) -> str:
        return f"the time at which {moment_text(self.when)}"

    @property
    def moment(self) -> Moment:
        return self.when

    def time(self, numbers: RunNumbers, _number: Value) -> float:
        return numbers.time(self.when)

    def number(self, numbers: RunNumbers) -> Value:
        return Value(numbers.time(self.when))

    def rounding(self, numbers: RunNumbers) -> float:
        return MOMENT * numbers.time(self.when)

    def formula(self, course: MotionFormulas, _time: float) -> Quotient:
        place = course.place_when(self.when)
        return course.value(course.along(TIME), place)

    def uniform_time(self, uniform: UniformMotion) -> Quotient | None:
        return uniform.time_of(self.when)

    def uniform_answer(self, _uniform: UniformMotion, time: Quotient) -> Quotient:
        return time

    def confirms(self, uniform: UniformMotion, time: float, _answer: float) -> bool:
        assert isinstance(self.when, Mapping)
        ((coordinate, value),) = self.when.items()
        solved = uniform.solved
        k = uniform.place(coordinate)
        way = solved.number(value) - solved.begin.q[k]
        gone = [solved.begin.u[k] * time, solved.numbers.udot[k] * time * time / 2]
        return bool(abs(sum(gone) - way) <= AGREEMENT * max(map(abs, gone)))


# ----------------------------------------------------------------------------------------------------------------------
# `ask: {of: block, at: {x: 2 m}}`: the speed of a body at a moment, or its velocity `along` a direction.


@dataclass(frozen=True)
class SpeedQuestion(UniformQuestion):
    """The speed of a point at a moment; with `along`, its velocity that way, which has a sign."""

    si_unit = "m/s"

    of: str
    at: Moment
    along: Point | None

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.of is None or ask.at is None or isinstance(ask.at, str) else cls(ask.of, ask.at, ask.along)

    def words(self) -> str:
        way = "speed of" if self.along is None else f"velocity along {direction_text(self.along)} of"
        return f"{way} {self.of} when {moment_text(self.at)}"

    @property
    def moment(self) -> Moment:
        return self.at

    def time(self, numbers: RunNumbers, _number: Value) -> float:
        return numbers.time(self.at)

    def number(self, numbers: RunNumbers) -> Value:
        time = numbers.time(self.at)
        if self.along is None:
            return Value(numbers.motion.speed(self.of, time))
        return Value(numbers.motion.velocity(self.of, time, numbers.direction(self.along)))

    def formula(self, course: MotionFormulas, _time: float) -> Quotient:
        place = course.place_when(self.at)
        return course.value(course.along(self._expression(), f"velocity of {self.of}"), place)

    def _expression(self) -> Node:
        if self.along is not None:
            return component_along("velocity", self.of, self.along)
        parts = [quantity("velocity", (self.of, axis)) for axis in AXES]
        return BUILD["sqrt"](sum((x * x for x in parts), ZERO))

    def is_uniform(self) -> bool:
        return self.along is None and super().is_uniform()

    def uniform_time(self, uniform: UniformMotion) -> Quotient | None:
        return uniform.time_of(self.at)

    def uniform_answer(self, uniform: UniformMotion, time: Quotient) -> Quotient | None:
        return uniform.speed(self.of, time)

    def uniform_lines(self, uniform: UniformMotion, time: Quotient, answer: Quotient) -> Iterator[Line]:
        assert isinstance(self.at, Mapping)
        yield from uniform.speed_lines(self.of, self.at, time, answer)

    def confirms(self, uniform: UniformMotion, time: float, answer: float) -> bool:
        v, a = uniform.rates(self.of)
        return bool(abs(float(np.linalg.norm(v + a * time)) - answer) <= AGREEMENT * answer)


# ----------------------------------------------------------------------------------------------------------------------
# `ask: {of: block, after: 4 s}`: the path of a body in a time, or its displacement `along` a direction.


_TINY: Final = 1e-300


@dataclass(frozen=True)
class PathQuestion(UniformQuestion):
    """The length of the path of a point `after` a time; with `along`, its displacement that way, which has a sign."""

    si_unit = "m"

    of: str
    after: Node
    along: Point | None

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.of is None or ask.after is None else cls(ask.of, ask.after, ask.along)

    def words(self) -> str:
        way = "way" if self.along is None else f"displacement along {direction_text(self.along)}"
        return f"{way} of {self.of} after {time_text(self.after)}"

    def by_runs(self, motion: AskedMotion, working: Working) -> Value:
        return Value(0.0) if motion.solved.rests else super().by_runs(motion, working)

    def time(self, numbers: RunNumbers, _number: Value) -> float:
        return numbers.motion.number(self.after)

    def number(self, numbers: RunNumbers) -> Value:
        time = numbers.motion.number(self.after)
        if self.along is None:
            return Value(numbers.motion.path(self.of, time))
        return Value(numbers.motion.displacement(self.of, time, numbers.direction(self.along)))

    def formula(self, course: MotionFormulas, _time: float) -> Quotient:
        if self.along is None:
            if isinstance(course, BouncingFormulas) and course.bounces is not None:
                return course.value(course.bounces.way, ZERO)
            raise NoClosedFormError("a path has no formula")
        place = course.along(component_along("position", self.of, self.along), f"place of {self.of}")
        moved = place - put_in(place, {course.variable: ZERO})
        return course.value(moved, course.place_after(self.after))

    def is_uniform(self) -> bool:
        return self.along is None

    def uniform_time(self, uniform: UniformMotion) -> Quotient:
        return uniform.given(self.after)

    def uniform_answer(self, uniform: UniformMotion, time: Quotient) -> Quotient | None:
        return uniform.path(self.of, time)

    def uniform_lines(self, uniform: UniformMotion, _time: Quotient, _answer: Quotient) -> Iterator[Line]:
        yield from uniform.path_lines(self.of)

    def confirms(self, uniform: UniformMotion, time: float, answer: float) -> bool:
        v, a = uniform.rates(self.of)
        turn = min(max(-float(v @ a) / max(float(a @ a), _TINY), 0.0), time)
        there, end = (v * t + a * t * t / 2 for t in (turn, time))
        return abs(float(np.linalg.norm(there) + np.linalg.norm(end - there)) - answer) <= AGREEMENT * answer


# ----------------------------------------------------------------------------------------------------------------------
# `ask: fx(A)`, `{value: x, after: 2 s}`, `{value: x, when: y < 0}`: an expression at the start, a time or a moment.


_WITHHELD = "it hangs on a reaction that is withheld"


@dataclass(frozen=True)
class StartValueQuestion(NumberQuestion):
    """The value of an expression at the start."""

    value: Node

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.value is None or ask.when is not None or ask.after is not None else cls(ask.value)

    def words(self) -> str:
        return text(self.value)

    def unit(self, motion: AskedMotion) -> str:
        return motion.unit_of(self.value)

    def at_start(self) -> Node:
        return self.value

    def number(self, numbers: RunNumbers) -> Value:
        return Value(numbers.motion.value(self.value, 0.0))

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        if undetermined_reactions(motion.solved.mechanism.withheld, self.value):
            working.notes.append(_WITHHELD)
            return Value(None)
        if motion.solved.needs_no_forces:
            working.steps.append(lambda: kinematic_lines(motion.solved, self.value))
        if motion.solved.is_structure:
            working.steps.append(lambda: virtual_work_lines(motion.solved, self.value))
        try:
            found = with_letters(motion.solved, motion.solved.asked(self.value), {"": self.unit(motion)})[""]
        except UNDEFINED as error:
            working.notes.append(f"it has no value at the start: {error}")
            return Value(None)
        if not found.unique:
            working.steps.append(lambda: open_force_lines(motion.solved))
        return found


class _LaterValueQuestion(LaterQuestion):
    """The value of an expression later."""

    value: Node

    def unit(self, motion: AskedMotion) -> str:
        return motion.unit_of(self.value)

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        if undetermined_reactions(motion.solved.mechanism.withheld, self.value):
            working.notes.append(_WITHHELD)
            return Value(None)
        return super().answer(motion, working)

    def is_of_run(self) -> bool:
        return of_run(self.value)


@dataclass(frozen=True)
class ValueAfterQuestion(_LaterValueQuestion):
    """The value of an expression `after` a time."""

    keys = ("value", "after")

    value: Node
    after: Node

    def words(self) -> str:
        return f"{text(self.value)} after {time_text(self.after)}"

    def time(self, numbers: RunNumbers, _number: Value) -> float:
        return numbers.motion.number(self.after)

    def number(self, numbers: RunNumbers) -> Value:
        return Value(numbers.motion.value(self.value, numbers.motion.number(self.after)))

    def rounding(self, numbers: RunNumbers) -> float:
        time = numbers.motion.number(self.after)
        return ROUNDING * numbers.motion.largest_and_rate(self.value, None, time)[0]

    def formula(self, course: MotionFormulas, _time: float) -> Quotient:
        place = course.place_after(self.after)
        return course.value(course.along(self.value), place)

    def shorter(self, found: Node, course: MotionFormulas) -> Node:
        """Return the formula of time, as a book writes it, with the time put in where that is shorter."""
        if course.variable is not TIME or self.after.shadow is not None:
            return found
        solved = course.there.solved
        number = evaluate_float([found], solved.sample)[0]
        written = put_in(shortest_course(course.along(self.value), solved.symbolic.letters), {TIME: self.after})
        near = abs(evaluate_float([written], solved.sample)[0] - number) <= AGREEMENT * abs(number)
        return written if near and len(text(written)) < len(text(found)) else found


@dataclass(frozen=True)
class ValueWhenQuestion(_LaterValueQuestion):
    """The value of an expression at a moment."""

    keys = ("value", "when")

    value: Node
    when: Moment

    def words(self) -> str:
        return f"{text(self.value)} when {moment_text(self.when)}"

    def time(self, numbers: RunNumbers, _number: Value) -> float:
        return numbers.time(self.when, self.value)

    def number(self, numbers: RunNumbers) -> Value:
        found = numbers.motion.value_at(self.when, self.value)
        if found is None:
            raise numbers.never(self.when)
        return Value(found)

    def rounding(self, numbers: RunNumbers) -> float:
        time = numbers.time(self.when, self.value)
        largest, rate = numbers.motion.largest_and_rate(self.value, self.when, time)
        return ROUNDING * largest + MOMENT * time * rate

    def formula(self, course: MotionFormulas, _time: float) -> Quotient:
        place = course.place_when(self.when)
        return course.value(course.along(self.value), place)


# ----------------------------------------------------------------------------------------------------------------------
# `ask: {period_of: phi}`: the period of a coordinate in the motion from the start, whatever its amplitude.


@dataclass(frozen=True)
class PeriodQuestion(NumberQuestion):
    """The period of a coordinate."""

    keys = ("period_of",)
    si_unit = "s"

    coordinate: str

    def words(self) -> str:
        return f"the period of {self.coordinate}"

    def number(self, numbers: RunNumbers) -> Value:
        try:
            with at("period_of"):
                found = numbers.motion.swing(self.coordinate).period
        except NoPeriodError as reason:
            raise NeverError(str(reason)) from None
        numbers.accuracy.append(f"its number is known {found.how}")
        return found.value("s")

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        numbers = RunNumbers(motion.simulated)
        try:
            found = numbers.with_error(self)
        except NeverError as reason:
            near = self._near_rest(motion, working)
            working.notes.extend([str(reason)] if near is None else [])
            return near or Value(None, unit="s")
        harmonic = self._formula(motion.solved, found.value or 0.0)
        swing = ToAndFro.of(motion.solved, self.coordinate) if harmonic is None else None
        formula = harmonic if swing is None else swing.confirmed(partial(swing.whole, TIME), found.value or 0.0)
        told = replace(found, unit="s")
        working.steps.append(lambda: self._lines(motion.solved, numbers, told, swing, by_formula=harmonic is not None))
        working.notes.extend(numbers.accuracy if formula is None else ())
        return replace(motion.with_formula(found, formula), unit="s")

    def _near_rest(self, motion: AskedMotion, working: Working) -> Value | None:
        """Return the period of a pendulum that turns so near to upright that runs lose it; else None."""
        swing = ToAndFro.of(motion.solved, self.coordinate)
        known = None if swing is None else swing.by_elliptic_integrals()
        if swing is None or known is None:
            return None
        working.notes.append(NEAR_REST)
        working.steps.extend((lambda: swing.lines(TIME), swing.elliptic_lines))
        return Value(known[0], unit="s")

    def _lines(
        self, solved: SolvedInstant, numbers: RunNumbers, found: Value, swing: ToAndFro | None, *, by_formula: bool
    ) -> Iterator[Line]:
        """Yield q'' = A q + c, which swings with omega^2 = -A; for other equations the energy integral, or the run."""
        if swing is not None:
            yield from swing.lines(TIME)
            if found.error:
                yield Sentence((f"by quadrature, to {found.error:.0e} s",))
            return
        there = anywhere(solved, solved.begin.q, solved.begin.u) if by_formula else None
        if there is None:
            yield from numbers.lines(found, found.value or 0.0)
            return
        k = [c.name for c in solved.mechanism.coordinates].index(self.coordinate)
        moved = there.forms.udot[k]
        yield equation(acceleration(solved.mechanism, k), written(moved), "at any place")
        slope = written(-rate(moved, symbol(self.coordinate)))
        yield equation(OMEGA * OMEGA, slope, "a harmonic oscillation with")
        yield equation(symbol("T"), 2 * PI / OMEGA)

    def _formula(self, solved: SolvedInstant, number: float) -> Node | None:
        """Return 2 pi/sqrt(-A) where the coordinate has q'' = A q + c and this is the number; else None."""
        names = [c.name for c in solved.mechanism.coordinates]
        there = anywhere(solved, solved.begin.q, solved.begin.u) if self.coordinate in names else None
        if there is None or len(names) != len(solved.mechanism.speeds):
            return None
        q, acceleration = symbol(self.coordinate), there.forms.udot[names.index(self.coordinate)]
        if acceleration.symbols & (there.variables - {q}):
            return None
        try:
            slope = rate(acceleration, q)
            if slope.symbols & there.variables or slope.is_zero or sign(slope) > 0:
                return None
            formula = 2 * PI * BUILD["sqrt"](Granted().written(-slope.power(-1)))
            near = abs(evaluate_float([formula], solved.sample)[0] - number) <= FITS * number
        except (NoClosedFormError, ExpressionError, *UNDEFINED):
            return None
        return formula if near else None


# ----------------------------------------------------------------------------------------------------------------------
# `ask: {advance: phi, of: r}`: how far a coordinate goes in a period of another, such as the angle between apsides.


@dataclass(frozen=True)
class AdvanceQuestion(NumberQuestion):
    """The growth of a coordinate in a period of another."""

    keys = ("advance", "of")

    coordinate: str
    of: str

    def words(self) -> str:
        return f"the advance of {self.coordinate} in a period of {self.of}"

    def unit(self, motion: AskedMotion) -> str:
        return motion.unit_of(symbol(self.coordinate))

    def number(self, numbers: RunNumbers) -> Value:
        period = PeriodQuestion(self.of).number(numbers).value
        assert period is not None
        node, motion = symbol(self.coordinate), numbers.motion
        return Value(motion.value(node, period) - motion.value(node, 0.0))

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        numbers = RunNumbers(motion.simulated)
        try:
            found = numbers.with_error(self)
        except NeverError as reason:
            working.notes.append(str(reason))
            return Value(None, unit=self.unit(motion))
        swing = ToAndFro.of(motion.solved, self.of)
        node = symbol(self.coordinate)
        formula = None if swing is None else swing.confirmed(partial(swing.whole, node), found.value or 0.0)
        if swing is not None and formula is not None:
            working.steps.append(lambda: swing.lines(node))
        else:
            told = replace(found, unit=self.unit(motion))
            working.steps.append(lambda: numbers.lines(told, PeriodQuestion(self.of).number(numbers).value or 0.0))
        return replace(motion.with_formula(found, formula), unit=self.unit(motion))


# ----------------------------------------------------------------------------------------------------------------------
# Steps of a force in a structure at rest: virtual work of what one support left free, and why a force is open.


_MOST_FREEDOMS: Final = 6
_OF_ROWS: Final = ("multiplier", "tension")


def open_force_lines(solved: SolvedInstant) -> Iterator[Line]:
    """Yield why a force is not unique."""
    count = len(solved.others)
    forces = f"{count} force{'s' if count > 1 else ''}"
    if any(element.frictions for element in solved.mechanism.one_way):
        yield Sentence((f"not unique: equilibrium leaves {forces} open, as contacts that stick share what they bear",))
        return
    yield Sentence((f"not unique: equilibrium leaves {forces} open (statically indeterminate to the degree {count})",))
    yield Sentence(("the deformation decides, which rigid bodies do not have",))


def virtual_work_lines(solved: SolvedInstant, asked: Node) -> Iterator[Line]:
    """Yield the force of a constraint by virtual work: without it a structure of several bodies has one freedom.

    Nothing where several forces are asked for, or constraints depend on each other. Raises NoClosedFormError.
    """
    named = [x for x in leaves([asked], "quantity") if x.data[0] in _OF_ROWS]
    rows = [k for k, row in enumerate(solved.mechanism.rows) if len(named) == 1 and row.name == named[0].data[1][0]]
    size = len(solved.mechanism.speeds)
    if not rows or len(solved.mechanism.rows) != size or not 1 < size <= _MOST_FREEDOMS or solved.forms is None:
        return
    matrix, right = linear_equations(solved.nodes.motion)
    jacobian = [solved.forms.of(map(as_node, row[:size])) for row in matrix[size:]]
    forces = solved.forms.of(map(as_node, right[:size]))
    held = [row for k, row in enumerate(jacobian) if k != rows[0]]
    sizes = np.array([[float(x.sample) for x in row] for row in held])
    free = next(k for k in range(size) if rank(np.delete(sizes, k, axis=1), CLOSED) == len(held))
    others = [k for k in range(size) if k != free]
    moved = exact_solve([[row[k] for k in others] for row in held], [-row[free] for row in held])
    ratios = {free: solved.forms.field.constant(1), **dict(zip(others, moved, strict=True))}
    yield Sentence((f"virtual work: without {named[0].data[1][0]} one freedom is left",))
    names = [symbol(f"delta_{name}") for name in acceleration_names(solved.mechanism)]
    for k in others:
        yield equation(names[k], written(ratios[k]) * names[free])
    work, arm = (reduce(operator.add, (x[k] * ratios[k] for k in range(size))) for x in (forces, jacobian[rows[0]]))
    total = written(work) + written(arm) * quantity(*named[0].data)
    yield Formula((symbol("delta_W"), total * names[free], ZERO))


NUMBER_QUESTIONS: Final[tuple[type[NumberQuestion], ...]] = (
    StartValueQuestion,
    ValueAfterQuestion,
    ValueWhenQuestion,
    TimeQuestion,
    PathQuestion,
    SpeedQuestion,
    PeriodQuestion,
    AdvanceQuestion,
)
"""The kinds of this file: the first that takes the keys of a question is its kind."""
