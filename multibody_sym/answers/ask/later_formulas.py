"""Closed forms of what happens later: moments, values at them and extremes, where numbers have found them already.

Along a course all coordinates and speeds are formulas of one variable: of the time, where equations of motion have
known solutions; else, with one freedom and energy conserved, of the coordinate itself,

    u^2 = 2 (E - V(q)) / M(q),

M being the generalised mass. The value of the variable at the moment is a root near the number that is known.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import field, replace
from typing import Final, Self

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.inequalities import surely_positive
from multibody_sym.algebra.quotient_functions import exact, with_whole_angles
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Quotient
from multibody_sym.algebra.roots import roots
from multibody_sym.answers.ask.courses import InTime, least_conditions
from multibody_sym.answers.ask.linear_systems import Courses
from multibody_sym.answers.ask.named_answers import Anywhere
from multibody_sym.answers.ask.working import equation, other_times, solving_lines, written
from multibody_sym.answers.instant.instant import AGREEMENT
from multibody_sym.answers.instant.letters import TIME, put_in, quotient_of
from multibody_sym.answers.records import Formula, Line, Sentence
from multibody_sym.derivation.symbolic_start import WORK, ActingForces
from multibody_sym.mechanics.law_elements import LawElement
from multibody_sym.model.fields import AXES
from multibody_sym.model.state_words import VERBS, Moment, StateCondition, moment_text
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import BUILD, leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ZERO, Node, as_node, quantity, symbol
from multibody_sym.scalars.sign_changes import is_condition, switching_function
from multibody_sym.text.printer import text

# ----------------------------------------------------------------------------------------------------------------------
# Coordinates and speeds as formulas of one variable, and where on such a course something happens.


NO_TIME: Final = "the time has no formula"
_POLISHED: Final = 4
_PLAIN: Final = 40
"""Letters of an equation in steps up to which it stands as it was put together."""
_ZERO: Final = 1e-14
_NEAR: Final = 1e-6
"""How near, relative to its size or 1, a number must be to a root that it is taken for."""


@dataclass(frozen=True, eq=False)
class MotionFormulas:
    """Coordinates and speeds as formulas of one variable, which has the value `at` at the moment.

    `known` gives the formula of each, None where it has none. `turning` vanishes where the speed does, if that is so at
    the moment. `beside`: a value of the variable near by, at which formulas are simplified where they are no fractions
    of zeros; None leaves them as they are. `used` are the formulas put in so far. Values rest on `signs` of moving
    quantities, which say of parameters what `moving` holds.
    """

    there: Anywhere
    variable: Node
    known: Callable[[Node], InTime | None]
    at: float
    turning: Node | None = None
    beside: float | None = None
    used: dict[Node, InTime] = field(default_factory=dict)
    signs: list[Quotient] = field(default_factory=list)
    moving: list[str] = field(default_factory=list)
    law: Callable[[Collection[Node]], Iterable[Line]] = lambda _nodes: ()
    places: list[Line] = field(default_factory=list)
    asked: list[Line] = field(default_factory=list)

    def lines(self) -> Iterator[Line]:
        """Yield the laws that give the formulas used, the place of the moment, and what was asked along the course."""
        yield from self.law(self.used)
        yield from self.asked
        yield from self.places

    def along(self, asked: Node, words: str = "") -> Node:
        """Return an expression of the model, asked for in `words` or by itself, as a formula of the variable.

        Raises NoClosedFormError.
        """
        found, moving = self._along(asked), self.there.variables - {self.variable}
        if leaves([asked], "quantity") or (asked.op != "symbol" and moving.intersection(leaves([asked], "symbol"))):
            self.asked[:] = [Formula((found,) if words else (asked, found), before=(words or "along the motion",))]
        return found

    def _along(self, asked: Node) -> Node:
        known = len(self.there.forms.field.positive)
        found = self.there.of(asked)
        self.signs.extend(x for x in self.there.forms.field.positive[known:] if not self.there.constant(x))
        return self.put_in(found)

    def put_in(self, asked: Quotient) -> Node:
        """Return what there is at any state as a formula of the variable. Raises NoClosedFormError."""
        found = book_form(with_whole_angles(asked))
        for node in (x for x in leaves([found], "symbol") if x in self.there.variables - {self.variable}):
            formula = self.known(node)
            if formula is None:
                raise NoClosedFormError("what is asked for depends on a coordinate whose course has no formula")
            self.used[node] = formula
        known = put_in(found, {node: each.formula for node, each in self.used.items()})
        return known if self.beside is None else in_book_form(self.there, known, {self.variable: self.beside})

    def granted(self) -> Iterator[str]:
        """Yield what the formulas of time that were used take for granted of parameters, each once."""
        used = [replace(each, until=None) for each in self.used.values()]
        yield from dict.fromkeys((*(condition for each in used for condition in each.conditions()), *self.moving))

    def place(self, zero: Node, where: str = "at the moment", sides: tuple[Node, Node] | None = None) -> Node:
        """Return the variable's value, near `at`, at which a formula of it vanishes. Raises NoClosedFormError.

        `where` and the `sides` of its equation are how a book writes that.
        """
        solved = self.there.solved
        at = self._polished(zero)
        vanishing = in_letters(self.there, zero, {self.variable: at})
        every = {root: evaluate_float([root], solved.sample)[0] for root in roots(vanishing, self.variable)}
        for root, value in every.items():
            if abs(value - at) <= AGREEMENT * max(1.0, abs(at)):
                others = {x: y for x, y in every.items() if x is not root and self.variable is TIME}
                so = equation(self.variable, root, "so")
                if len(text(zero)) > _PLAIN:
                    zero = min(zero, book_form(with_whole_angles(vanishing)), key=lambda x: len(text(x)))
                between = solving_lines(zero, self.variable, root, solved.symbolic.letters, solved.sample)
                self.places[:] = equation(*(sides or (zero, ZERO)), where), *between, so, *other_times(at, others)
                return root
        raise NoClosedFormError(f"the moment is a root of no known kind in {self.variable.data}")

    def place_after(self, time: Node) -> Node:
        """Return the variable's value after a time. Raises NoClosedFormError."""
        if self.variable is not TIME:
            raise NoClosedFormError(NO_TIME)
        return time

    def place_when(self, moment: Moment) -> Node:
        """Return the variable's value at a moment. Raises NoClosedFormError."""
        if isinstance(moment, Mapping):
            ((coordinate, value),) = moment.items()
            if self.variable is symbol(coordinate):
                return value
            place = self._along(symbol(coordinate))
            return self.place(place - value, f"{coordinate} = {text(value)} when", (place, value))
        for vanishing in self._boundaries(moment):
            try:
                zero = self.put_in(vanishing)
                if zero is ZERO and self.turning is not None:
                    return self.place(self.turning, "the motion turns where")
                if not isinstance(moment, StateCondition):
                    return self.place(zero)
                place = self.place(zero, f"{moment_text(moment)} when")
                if _WITHOUT_FORCE.issuperset(moment.words):
                    pressing = quantity("reaction", (moment.element, "normal"))
                    self.places.insert(0, Formula((pressing, zero), before=("along the motion",)))
                return place
            except NoClosedFormError:
                continue
        raise NoClosedFormError("the moment has no formula")

    def _boundaries(self, moment: Node | StateCondition) -> Iterator[Quotient]:
        """Yield what vanishes when a condition becomes true, or a state begins. Raises NoClosedFormError."""
        if isinstance(moment, StateCondition):
            yield from self.there.forms.of(begins_where(ActingForces.at(self.there.instant), moment))
            return
        waiting = [moment]
        while waiting:
            node = waiting.pop()
            if node.op in ("min", "max") and is_condition(node):
                waiting.extend(node.args)
            else:
                yield self.there.of(switching_function(node))

    def _polished(self, zero: Node) -> float:
        if (self.there.variables - {self.variable}).intersection(leaves([zero], "symbol")):
            raise NoClosedFormError("what is asked for depends on a coordinate whose course has no formula")
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
        signs = [put_in(self.put_in(sign), {self.variable: place}) for sign in (*self.signs, *self._signs_of_time())]
        found, *positive = exact(field, [put_in(formula, {self.variable: place}), *signs], known)
        unsure = [x for x in positive if not surely_positive(field.whole(x.above * x.below))]
        self.moving.extend(map(str, least_conditions(unsure)))
        return found

    def _signs_of_time(self) -> Iterator[Quotient]:
        """Yield the signs on which the equations rest of functions of time alone, as of an input until it ends."""
        if self.variable is TIME:
            others = self.there.variables - {TIME}
            yield from (x for x in self.there.forms.field.positive if TIME in x.symbols and not x.symbols & others)


def in_book_form(there: Anywhere, node: Node, values: Mapping[Node, float]) -> Node:
    """Return an expression of parameters and of what has values near by in its book form. Raises NoClosedFormError."""
    return book_form(with_whole_angles(in_letters(there, node, values)))


def in_letters(there: Anywhere, node: Node, values: Mapping[Node, float]) -> Quotient:
    near = {x: Letter(x, PRECISE.mpf(y)) for x, y in values.items()}
    return quotient_of(node, {**there.solved.symbolic.letters, **near})


# ----------------------------------------------------------------------------------------------------------------------
# What is asked for, and what vanishes at a moment.


def component_along(function: str, point: str, direction: tuple[Node, ...]) -> Node:
    """Return the component of a quantity of a point along a direction of any length."""
    parts = [x * quantity(function, (point, axis)) for x, axis in zip(direction, AXES, strict=True)]
    return sum(parts, ZERO) / BUILD["sqrt"](sum((x * x for x in direction), ZERO))


_WITHOUT_SLIP: Final = frozenset(word for verb in ("sticks", "rolls", "grips") for word in VERBS[verb])
_WITH_SLIP: Final = frozenset(word for verb in ("slides", "slips") for word in VERBS[verb])
_WITHOUT_FORCE: Final = frozenset(word for verb in ("opens", "slackens", "frees") for word in VERBS[verb])


def begins_where(acting: ActingForces, condition: StateCondition) -> Iterator[Node]:
    """Yield what vanishes where a state begins: a speed of slip, a force of its limit, pressing force, or distance."""
    for element in acting.mechanism.one_way:
        parts = [part for part in element.frictions if condition.element in (element.name, part.name)]
        if _WITHOUT_SLIP.issuperset(condition.words):
            yield from (as_node(acting.row(part.rows[0]).phidot) for part in parts if len(part.rows) == 1)
        elif _WITH_SLIP.issuperset(condition.words):
            for part in (part for part in parts if len(part.rows) == 1):
                force, most = as_node(acting.friction(part)[0]), as_node(acting.most(element, part))
                yield from (force - most, force + most)
        elif condition.element == element.name and element.unilateral:
            opens = _WITHOUT_FORCE.issuperset(condition.words)
            yield as_node(acting.normal(element) if opens else acting.row(element.normals[0]).zero)


# ----------------------------------------------------------------------------------------------------------------------
# Infinitely many bounces of a contact that loses a part of its speed each time, in closed form.
#
# Between impacts the gap has a constant acceleration -a. The first impact, at t1 with the speed v1, is the moment of a
# formula of time; the speeds e v1, e^2 v1, .. last 2 e v1/a, .. and rise e^2 v1^2/(2 a), ..: two geometric series,
#
#     T = t1 + 2 e v1/(a (1 - e))        way = way to t1 + e^2 v1^2/(a (1 - e^2))


@dataclass(frozen=True)
class Bounces:
    """The gap of an `element` as a formula of time up to the first impact, at `first` with the `speed`.

    `acceleration` is a, `restitution` e; `flight` has the formulas of time.
    """

    element: LawElement
    flight: MotionFormulas
    gap: Node
    first: Node
    speed: Node
    acceleration: Node
    restitution: Node

    @classmethod
    def of(cls, there: Anywhere, courses: Courses, run: Trajectory) -> Self | None:
        """Return the bounces of a run that changes by impacts of one element alone until it closes; else None.

        Raises NoClosedFormError.
        """
        names = {str(change["element"]) for change in run.changes}
        kinds = [str(change["kind"]) for change in run.changes]
        element = next((x for x in there.solved.mechanism.one_way if names == {x.name}), None)
        if element is None or kinds.count("impact") < 2 or set(kinds) != {"impact", "closed"}:
            return None
        at = min(float(change["t"]) for change in run.changes)
        flight = MotionFormulas(there, TIME, courses.of, at, law=courses.equations)
        row = ActingForces.at(there.instant).row(element.normals[0])
        gap = flight.put_in(there.forms.of([as_node(row.zero)])[0])
        rate = derivative(gap, TIME)
        acceleration = written(there.forms.of([-derivative(rate, TIME)])[0])
        if TIME in leaves([acceleration], "symbol"):
            raise NoClosedFormError("between impacts no acceleration is constant")
        first = flight.place(gap, "the first impact is where")
        (restitution,) = there.instant.motion.state.values([element.restitution])
        speed = written(there.forms.of([-put_in(rate, {TIME: first})])[0])
        return cls(element, flight, gap, first, speed, acceleration, as_node(restitution))

    @property
    def end(self) -> Node:
        """The time at which the last of them ends."""
        e, v = self.restitution, self.speed
        return self.first + 2 * (e * v) / (self.acceleration * (1 - e))

    @property
    def way(self) -> Node:
        """The way of a point along the normal until then."""
        start = put_in(self.gap, {TIME: ZERO})
        rising = put_in(derivative(self.gap, TIME), {TIME: ZERO})
        solved = self.flight.there.solved
        up = rising * rising / self.acceleration if solved.number(rising) > 0.0 else ZERO
        e = self.restitution * self.restitution
        square = self.speed * self.speed
        return start + up + e * square / (self.acceleration * (1 - e))

    def course(self, at: float) -> BouncingFormulas:
        """Return formulas of time that go on through the bounces."""
        flight = self.flight
        return BouncingFormulas(flight.there, TIME, flight.known, at, law=self.lines, bounces=self)

    def lines(self, used: Collection[Node]) -> Iterator[Line]:
        """Yield the flight to the first impact, and the series of the others."""
        yield from self.flight.law(used or {symbol(x.name) for x in self.flight.there.solved.mechanism.coordinates})
        yield from self.flight.places
        yield equation(symbol("v1"), self.speed, f"{self.element.name} strikes with the speed")
        e, v, a = self.restitution, symbol("v1"), self.acceleration
        yield Sentence(("each impact leaves ", e, " of the speed; in flight the gap has the acceleration ", -a))
        flights = 2 * (e * v) / a
        yield Sentence(("the flights take ", flights, ", and each ", e, " of the one before: a geometric series"))
        ways = e * e * (v * v) / a
        yield Sentence(("their ways are ", ways, ", and each ", e * e, " of the one before"))


@dataclass(frozen=True, eq=False)
class BouncingFormulas(MotionFormulas):
    """Formulas of time of coordinates that the bounces leave alone, and the end of the bounces as a moment."""

    bounces: Bounces | None = None

    def place_when(self, moment: Moment) -> Node:
        bounces = self.bounces
        assert bounces is not None
        if isinstance(moment, StateCondition) and moment.closes and moment.element == bounces.element.name:
            return bounces.end
        raise NoClosedFormError("the moment has no formula")
