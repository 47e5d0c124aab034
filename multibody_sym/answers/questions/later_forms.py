"""Closed forms of what happens later: moments, values at them and extremes, where numbers have found them already.

Along a course all coordinates and speeds are formulas of one variable: of the time, where equations of motion have
known solutions; else, with one freedom and energy conserved, of the coordinate itself,

    u^2 = 2 (E - V(q)) / M(q),

M being the generalised mass. The value of the variable at the moment is a root near the number that is known.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from functools import reduce
from typing import Final, NoReturn

import numpy as np

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient, why_none
from multibody_sym.answers.instant import AGREEMENT, Solved
from multibody_sym.answers.one_way import Acting
from multibody_sym.answers.questions.along_courses import Course
from multibody_sym.answers.questions.anywhere import TIME, Anywhere, anywhere
from multibody_sym.answers.questions.coupled import Courses
from multibody_sym.answers.questions.energy_courses import course_of_energy, courses_on_curve
from multibody_sym.answers.questions.naming import put_in
from multibody_sym.answers.questions.shortest_courses import shortest_course
from multibody_sym.answers.questions.simulated_motion import Simulated
from multibody_sym.errors import ExpressionError
from multibody_sym.expressions.printer import text
from multibody_sym.expressions.quantities import of_run
from multibody_sym.expressions.values import Value
from multibody_sym.model.declaration.settings import Ask
from multibody_sym.model.declaration.states import VERBS, Moment, StateCondition
from multibody_sym.model.declaration.values import AXES
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.kinks import is_condition, switching_function
from multibody_sym.scalars.node import (
    ZERO,
    Node,
    add,
    as_node,
    divide,
    multiply,
    quantity,
    subtract,
    symbol,
)

_BESIDE: Final = 0.9
"""The part of the time to a moment at which a state is regular in which the motion may turn there."""
_TURNS: Final = 1e-7
"""The part of its largest value below which a speed is zero."""
FOUND: Final = 1e-8
"""How near, relative to it, a closed form must come to a number of runs."""
_LONGEST: Final = 400
"""Letters of a formula that tells more than its number does."""
_SHORT: Final = 60
"""Letters of a formula for which it is looked for no shorter one."""


@dataclass(frozen=True, eq=False)
class LaterForms:
    """Closed forms of answers that runs of a solved system gave; `told` collects what they take for granted."""

    solved: Solved
    motion: Simulated
    courses: Courses
    told: list[str] = field(default_factory=list)

    def of(self, question: Ask, number: Value, time: float) -> Node | None:
        """Return the closed form of an answer, of what happens at a time, None where none has the number's value."""
        if number.value is None or self.motion.changes_before(time * (1.0 - FOUND)) is not None:
            return None
        if any(of_run(node) for node in (question.value, question.max, question.min) if node is not None):
            return None
        if time == 0.0 and number.t is not None:
            return self._at_start(question)
        shortest: tuple[Node, list[str]] | None = None
        for course in self._courses(time):
            try:
                found = self._confirmed(self._closed(course, question, time), number.value)
                found = self._shorter(found, course, question)
            except (NoClosedFormError, ExpressionError, *UNDEFINED) as reason:
                self.solved.reasons.setdefault(why_none(reason))
                continue
            if found is not None and (shortest is None or len(text(found)) < len(text(shortest[0]))):
                shortest = found, list(course.granted())
            if shortest is not None and len(text(shortest[0])) <= _SHORT:
                break
        if shortest is None:
            return None
        if len(text(shortest[0])) > _LONGEST:
            self.solved.reasons.setdefault("the closed form is too long")
            return None
        self.told.extend(shortest[1])
        return shortest[0]

    def _at_start(self, question: Ask) -> Node | None:
        """Return the extreme that is the value at the start."""
        asked = _asked(question)
        assert asked is not None
        return self.solved.values(self.solved.asked(asked), {})[""].expression

    def _courses(self, time: float) -> Iterator[Course]:
        """Yield the courses that are known, at a time."""
        mechanism, run = self.solved.mechanism, self.motion.until(time)
        q, u = ([float(run[x.name][-1]) for x in group] for group in (mechanism.coordinates, mechanism.speeds))
        there = anywhere(self.solved, q, u)
        if there is None:
            return
        if self.courses.alone or len(q) > 1:
            yield Course(there, TIME, self.courses.of, time)
        fastest = [float(np.abs(run[x.name]).max()) for x in mechanism.speeds]
        u = [0.0 if abs(x) <= _TURNS * most else x for x, most in zip(u, fastest, strict=True)]
        if len(q) == len(u) == 1:
            course = course_of_energy(there, q[0], u[0])
            if course is not None:
                yield course
        elif len(q) == len(u) and mechanism.rows:
            place = int(_BESIDE * (len(run.t) - 1))
            before = [[float(run[x.name][place]) for x in group] for group in (mechanism.coordinates, mechanism.speeds)]
            yield from courses_on_curve(there, (q, u), (before[0], before[1]))

    def _closed(self, course: Course, question: Ask, time: float) -> Quotient:
        if question.of is not None and question.after is not None and question.along is not None:
            return self._displacement(course, _component("position", question.of, question.along), question.after)
        asked = _asked(question)
        if question.max is not None or question.min is not None:
            assert asked is not None
            along = course.along(asked)
            return course.value(along, self._extreme_place(course, question, along, time))
        place = self._place(course, question.when if question.when is not None else question.at, question.after)
        if asked is None:
            return course.value(TIME, place) if course.variable is TIME else _no_time()
        return course.value(course.along(asked), place)

    def _shorter(self, found: Node | None, course: Course, question: Ask) -> Node | None:
        """Return the formula of time, as a book writes it, with the time put in where that is shorter."""
        asked, after = question.value, question.after
        if found is None or len(text(found)) <= _SHORT or course.variable is not TIME:
            return found
        if asked is None or after is None or after.shadow is not None:
            return found
        letters, number = self.solved.symbolic.letters, evaluate_float([found], self.solved.sample)[0]
        written = put_in(shortest_course(course.along(asked), letters, TIME), {TIME: after})
        near = abs(evaluate_float([written], self.solved.sample)[0] - number) <= AGREEMENT * abs(number)
        return written if near and len(text(written)) < len(text(found)) else found

    def _displacement(self, course: Course, component: Node, time: Node) -> Quotient:
        along = course.along(component)
        moved = subtract(along, put_in(along, {course.variable: ZERO}))
        return course.value(moved, self._place(course, None, time))

    def _place(self, course: Course, moment: Moment | None, time: Node | None) -> Node:
        """Return the value of the variable at a moment, or a time."""
        if time is not None:
            return time if course.variable is TIME else _no_time()
        if isinstance(moment, Mapping):
            ((coordinate, value),) = moment.items()
            zero = subtract(symbol(coordinate), value)
            return value if course.variable is symbol(coordinate) else course.place(course.along(zero))
        for vanishing in self._boundaries(course.there, moment):
            try:
                return course.place(course.put_in(vanishing))
            except NoClosedFormError:
                continue
        raise NoClosedFormError("the moment has no formula")

    @staticmethod
    def _boundaries(there: Anywhere, moment: Moment | None) -> Iterator[Quotient]:
        """Yield what vanishes when a condition becomes true, or a state begins. Raises NoClosedFormError."""
        if isinstance(moment, StateCondition):
            yield from there.forms.of(begins_where(Acting.at(there.instant), moment))
        elif isinstance(moment, Node):
            yield from map(there.of, boundaries(moment))

    def _extreme_place(self, course: Course, question: Ask, along: Node, time: float) -> Node:
        """Return where an extreme is: at the start, at an end that was given, where the speed turns, or flat."""
        ends = [x for x in (question.after, question.until) if x is not None]
        for end in ends:
            timed = isinstance(end, Node) and not is_condition(end)
            if isinstance(end, Node) and timed and abs(self.solved.number(end) - time) <= AGREEMENT * time:
                return self._place(course, None, end)
        if course.turning is not None:
            return course.place(course.turning)
        try:
            return course.place(derivative(along, course.variable))
        except NoClosedFormError:
            if question.until is None or (isinstance(question.until, Node) and not is_condition(question.until)):
                raise  # an end that is a time is none at which the extreme is, as it was compared before
            return self._place(course, question.until, None)

    def _confirmed(self, closed: Quotient, number: float) -> Node | None:
        """Return a closed form as an expression where it is the number that was found, else None."""
        if abs(float(closed.sample) - number) > FOUND * abs(number):
            return None
        value = self.solved.value_of(closed)
        return None if value is None else value.expression


def _no_time() -> NoReturn:
    raise NoClosedFormError("the time has no formula")


def _asked(question: Ask) -> Node | None:
    """Return the expression that is asked for at a moment, None for the moment itself."""
    for node in (question.value, question.max, question.min):
        if node is not None:
            return node
    if question.of is None:
        return None
    if question.at is None:
        raise NoClosedFormError("a path has no formula")
    if question.along is not None:
        return _component("velocity", question.of, question.along)
    parts = [quantity("velocity", (question.of, axis)) for axis in AXES]
    return BUILD["sqrt"](reduce(add, (multiply(x, x) for x in parts)))


def _component(function: str, point: str, direction: tuple[Node, ...]) -> Node:
    """Return the component of a quantity of a point along a direction of any length."""
    parts = [multiply(x, quantity(function, (point, axis))) for x, axis in zip(direction, AXES, strict=True)]
    return divide(reduce(add, parts), BUILD["sqrt"](reduce(add, (multiply(x, x) for x in direction))))


_WITHOUT_SLIP: Final = frozenset(word for verb in ("sticks", "rolls", "grips") for word in VERBS[verb])
_WITH_SLIP: Final = frozenset(word for verb in ("slides", "slips") for word in VERBS[verb])
_WITHOUT_FORCE: Final = frozenset(word for verb in ("opens", "slackens", "frees") for word in VERBS[verb])


def begins_where(acting: Acting, condition: StateCondition) -> Iterator[Node]:
    """Yield what vanishes where a state begins.

    The speed of slipping, what friction lacks to its limit, or the force
    that presses, or the distance.
    """
    for element in acting.mechanism.one_way:
        parts = [part for part in element.frictions if condition.element in (element.name, part.name)]
        if _WITHOUT_SLIP.issuperset(condition.words):
            yield from (as_node(acting.row(part.rows[0]).phidot) for part in parts if len(part.rows) == 1)
        elif _WITH_SLIP.issuperset(condition.words):
            yield from (x for part in parts if len(part.rows) == 1 for x in _beyond_limit(acting, element, part))
        elif condition.element == element.name and element.unilateral:
            opens = _WITHOUT_FORCE.issuperset(condition.words)
            yield as_node(acting.normal(element) if opens else acting.row(element.normals[0]).phi)


def _beyond_limit(acting: Acting, element: OneWay, part: FrictionPart) -> Iterator[Node]:
    """Yield what friction lacks to its limit either way."""
    force, most = as_node(acting.friction(part)[0]), as_node(acting.most(element, part))
    yield from (subtract(force, most), add(force, most))


def boundaries(condition: Node) -> Iterator[Node]:
    """Yield functions of the model one of which vanishes where a condition becomes true."""
    waiting = [condition]
    while waiting:
        node = waiting.pop()
        if node.op in ("min", "max") and is_condition(node):
            waiting.extend(node.args)
        else:
            yield switching_function(node)
