"""Closed forms of what happens later: moments, values at them and extremes, where numbers have found them already.

Along a course all coordinates and speeds are formulas of one variable: of the time, where equations of motion have
known solutions; else, with one freedom and energy conserved, of the coordinate itself,

    u^2 = 2 (E - V(q)) / M(q),

M being the generalised mass. The value of the variable at the moment is a root near the number that is known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import field, replace
from functools import reduce
from typing import Final, NoReturn

import numpy as np

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.factors import factored
from multibody_sym.algebra.positivity import surely_positive
from multibody_sym.algebra.quotient_functions import doubled, exact
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Quotient, why_none
from multibody_sym.algebra.solving.roots import roots
from multibody_sym.answers.closed_form import WORK
from multibody_sym.answers.instant import AGREEMENT, Solved
from multibody_sym.answers.one_way import Acting
from multibody_sym.answers.questions.anywhere import TIME, Anywhere, Granted, anywhere
from multibody_sym.answers.questions.coupled import Courses
from multibody_sym.answers.questions.courses import InTime, least_conditions
from multibody_sym.answers.questions.naming import put_in
from multibody_sym.answers.questions.shortest_courses import shortest_course
from multibody_sym.answers.questions.simulated_motion import Simulated
from multibody_sym.errors import ExpressionError
from multibody_sym.expressions.printer import text
from multibody_sym.expressions.quantities import of_run
from multibody_sym.expressions.values import Value
from multibody_sym.kinematics.energy import kinetic_energy, potential_energy
from multibody_sym.kinematics.rows import coefficients
from multibody_sym.model.declaration.settings import Ask
from multibody_sym.model.declaration.states import Moment, StateCondition
from multibody_sym.model.declaration.values import AXES
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.kinks import is_condition, switching_function
from multibody_sym.scalars.node import (
    ONE,
    TWO,
    ZERO,
    Node,
    add,
    as_node,
    divide,
    multiply,
    negate,
    quantity,
    subtract,
    symbol,
)
from multibody_sym.scalars.traversal import leaves

_POLISHED: Final = 4
_TURNS: Final = 1e-7
"""The part of its largest value below which a speed is zero."""
_ZERO: Final = 1e-14
_FOUND: Final = 1e-8
"""How near, relative to it, a closed form must come to a number of runs."""
_LONGEST: Final = 400
"""Letters of a formula that tells more than its number does."""
_SHORT: Final = 60
"""Letters of a formula for which it is looked for no shorter one."""
_NEAR: Final = 1e-6
"""How near, relative to its size or 1, a number must be to a root that it is taken for."""


@dataclass(frozen=True, eq=False)
class Course:
    """Coordinates and speeds as formulas of one variable, which has the value `at` at the moment.

    `known` gives the formula of each, None where it has none. `turning` vanishes where the speed does, if that is so at
    the moment. `used` are those that have been put in, `signs` those of what moves that values rest on, and `moving`
    what these say of parameters.
    """

    there: Anywhere
    variable: Node
    known: Callable[[Node], InTime | None]
    at: float
    turning: Node | None = None
    used: dict[Node, InTime] = field(default_factory=dict)
    signs: list[Quotient] = field(default_factory=list)
    moving: list[str] = field(default_factory=list)

    def along(self, asked: Node) -> Node:
        """Return an expression of the model as a formula of the variable. Raises NoClosedFormError."""
        known = len(self.there.forms.field.positive)
        found = self.there.of(asked)
        self.signs.extend(x for x in self.there.forms.field.positive[known:] if not self.there.constant(x))
        return self.put_in(found)

    def put_in(self, asked: Quotient) -> Node:
        """Return what there is at any state as a formula of the variable. Raises NoClosedFormError."""
        found = book_form(doubled(asked))
        for node in (x for x in leaves([found], "symbol") if x in self.there.variables - {self.variable}):
            formula = self.known(node)
            if formula is None:
                raise NoClosedFormError("what is asked for depends on a coordinate whose course has no formula")
            self.used[node] = formula
        return put_in(found, {node: each.formula for node, each in self.used.items()})

    def granted(self) -> Iterator[str]:
        """Yield what the formulas of time that were used take for granted of parameters, each once."""
        used = [replace(each, until=None) for each in self.used.values()]
        yield from dict.fromkeys((*(condition for each in used for condition in each.conditions()), *self.moving))

    def place(self, zero: Node) -> Node:
        """Return the variable's value, near `at`, at which a formula of it vanishes. Raises NoClosedFormError."""
        solved = self.there.solved
        at = self._polished(zero)
        letters = {**solved.symbolic.letters, self.variable: Letter(self.variable, PRECISE.mpf(at))}
        field = Field(WORK)
        known = {node: field.letter(node, letter) for node, letter in letters.items()}
        (equation,) = exact(field, [zero], known)
        for root in roots(equation, self.variable):
            if abs(evaluate_float([root], solved.sample)[0] - at) <= AGREEMENT * max(1.0, abs(at)):
                return root
        raise NoClosedFormError(f"the moment is a root of no known kind in {self.variable.data}")

    def _polished(self, zero: Node) -> float:
        """Return the root near `at`, to rounding."""
        slope, x = derivative(zero, self.variable), self.at
        sample = self.there.solved.sample
        for _ in range(_POLISHED):
            value, rate = evaluate_float([zero, slope], {**sample, self.variable: x})
            x -= value / rate if rate else 0.0
        if abs(x) <= _ZERO:
            x = 0.0
        if abs(x - self.at) > _NEAR * max(1.0, abs(self.at)):
            raise NoClosedFormError("the formula vanishes elsewhere than the motion shows")
        return x

    def value(self, formula: Node, place: Node) -> Quotient:
        """Return a formula of the variable at a place. Raises NoClosedFormError."""
        field = Field(WORK)
        known = {node: field.letter(node, letter) for node, letter in self.there.solved.symbolic.letters.items()}
        signs = [put_in(self.put_in(sign), {self.variable: place}) for sign in self.signs]
        found, *positive = exact(field, [put_in(formula, {self.variable: place}), *signs], known)
        unsure = [x for x in positive if not surely_positive(field.whole(x.above * x.below))]
        self.moving.extend(map(str, least_conditions(unsure)))
        return found


def course_of_energy(there: Anywhere, q: float, u: float) -> Course | None:
    """Return the speed of the one freedom by its coordinate, with the sign of u; None where energy does not tell it."""
    mechanism = there.solved.mechanism
    if len(mechanism.coordinates) != 1 or len(mechanism.speeds) != 1 or mechanism.drives:
        return None
    coordinate, speed = symbol(mechanism.coordinates[0].name), symbol(mechanism.speeds[0].name)
    motion, start = there.instant.motion, there.solved.nodes.motion
    energy = as_node(kinetic_energy(start)), as_node(potential_energy(start))
    moving, stored = as_node(kinetic_energy(motion)), as_node(potential_energy(motion))
    mass = multiply(TWO, put_in(moving, {speed: ONE}))
    if put_in(moving, {speed: ZERO}) is not ZERO or leaves([mass, stored], "symbol").count(TIME):
        return None
    granted = _energy_kept(there, mass, stored)
    if granted is None:
        return None
    square = divide(multiply(TWO, subtract(add(*energy), stored)), mass)
    root = BUILD["sqrt"](square)
    along = ZERO if u == 0.0 else (root if u > 0.0 else negate(root))
    known = {speed: InTime(along, granted)}
    return Course(there, coordinate, known.get, q, square if u == 0.0 else None, used=dict(known))


def _energy_kept(there: Anywhere, mass: Node, stored: Node) -> Granted | None:
    """Return what M q'' + M' u^2/2 + V' = 0 takes for granted of parameters, None where it is not so."""
    mechanism, granted = there.solved.mechanism, Granted()
    coordinate, speed = symbol(mechanism.coordinates[0].name), symbol(mechanism.speeds[0].name)
    try:
        slopes = (derivative(mass, coordinate), derivative(stored, coordinate))
        M, growth, slope = there.forms.of([mass, *slopes])
        lost = M * there.forms.udot[0] + growth * there.letter(speed).power(2) / 2 + slope
    except NoClosedFormError:
        return granted
    if lost.is_zero:
        return granted
    factors = (lost.field.whole(lost.field.in_ring(p)) for p, _ in factored(lost.above)[1])
    zero = next((x for x in factors if there.constant(x) and granted.vanishes(x)), None)
    return None if zero is None else granted


@dataclass(frozen=True, eq=False)
class LaterForms:
    """Closed forms of answers that runs of a solved system gave; `told` collects what they take for granted."""

    solved: Solved
    motion: Simulated
    courses: Courses
    told: list[str] = field(default_factory=list)

    def of(self, question: Ask, number: Value, time: float) -> Node | None:
        """Return the closed form of an answer, of what happens at a time, None where none has the number's value."""
        if number.value is None or self.motion.changes_before(time * (1.0 - _FOUND)) is not None:
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
        if len(q) == len(u) == 1:
            fastest = float(np.abs(run[mechanism.speeds[0].name]).max())
            course = course_of_energy(there, q[0], 0.0 if abs(u[0]) <= _TURNS * fastest else u[0])
            if course is not None:
                yield course

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
        if abs(float(closed.sample) - number) > _FOUND * abs(number):
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


_WITHOUT_SLIP: Final = ("sticks", "rolls", "grips")
_WITH_SLIP: Final = ("slides", "slips")
_WITHOUT_FORCE: Final = ("opens", "slackens", "frees")


def begins_where(acting: Acting, condition: StateCondition) -> Iterator[Node]:
    """Yield what vanishes where a state begins.

    The speed of slipping, what friction lacks to its limit, or the force
    that presses, or the distance.
    """
    for element in acting.mechanism.one_way:
        parts = [part for part in element.frictions if condition.element in (element.name, part.name)]
        if condition.verb in _WITHOUT_SLIP:
            yield from (as_node(acting.rows[part.rows[0].name].phidot) for part in parts if len(part.rows) == 1)
        elif condition.verb in _WITH_SLIP:
            yield from (x for part in parts if len(part.rows) == 1 for x in _beyond_limit(acting, element, part))
        elif condition.element == element.name and element.unilateral:
            opens = condition.verb in _WITHOUT_FORCE
            yield as_node(acting.normal(element) if opens else acting.rows[element.normals[0].name].phi)


def _beyond_limit(acting: Acting, element: OneWay, part: FrictionPart) -> Iterator[Node]:
    """Yield what friction lacks to its limit either way."""
    (static,) = coefficients(acting.motion, part.rows, [part.static])
    force, most = as_node(acting.friction(part)[0]), as_node(static * acting.pressing(element, part))
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
