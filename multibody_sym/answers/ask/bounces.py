"""Infinitely many bounces of a contact that loses a part of its speed each time, in closed form.

Between impacts the gap has a constant acceleration -a. The first impact, at t1 with the speed v1, is the moment of a
formula of time; the speeds e v1, e^2 v1, .. last 2 e v1/a, .. and rise e^2 v1^2/(2 a), ..: two geometric series,

    T = t1 + 2 e v1/(a (1 - e))        way = way to t1 + e^2 v1^2/(a (1 - e^2))
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Self

from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.answers.ask.later_formulas import MotionFormulas
from multibody_sym.answers.ask.linear_systems import Courses
from multibody_sym.answers.ask.named_answers import Anywhere
from multibody_sym.answers.ask.working import equation, written
from multibody_sym.answers.instant.letters import TIME, put_in
from multibody_sym.answers.records import Line, Sentence
from multibody_sym.derivation.symbolic_start import ActingForces
from multibody_sym.mechanics.law_elements import LawElement
from multibody_sym.model.state_words import Moment, StateCondition
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import ONE, TWO, ZERO, Node, add, as_node, divide, multiply, negate, subtract, symbol


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
        acceleration = written(there.forms.of([negate(derivative(rate, TIME))])[0])
        if TIME in leaves([acceleration], "symbol"):
            raise NoClosedFormError("between impacts no acceleration is constant")
        first = flight.place(gap, "the first impact is where")
        (restitution,) = there.instant.motion.state.values([element.restitution])
        speed = written(there.forms.of([negate(put_in(rate, {TIME: first}))])[0])
        return cls(element, flight, gap, first, speed, acceleration, as_node(restitution))

    @property
    def end(self) -> Node:
        """The time at which the last of them ends."""
        e, v = self.restitution, self.speed
        return add(self.first, divide(multiply(TWO, multiply(e, v)), multiply(self.acceleration, subtract(ONE, e))))

    @property
    def way(self) -> Node:
        """The way of a point along the normal until then."""
        start = put_in(self.gap, {TIME: ZERO})
        rising = put_in(derivative(self.gap, TIME), {TIME: ZERO})
        solved = self.flight.there.solved
        up = divide(multiply(rising, rising), self.acceleration) if solved.number(rising) > 0.0 else ZERO
        e = multiply(self.restitution, self.restitution)
        square = multiply(self.speed, self.speed)
        return add(add(start, up), divide(multiply(e, square), multiply(self.acceleration, subtract(ONE, e))))

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
        yield Sentence(("each impact leaves ", e, " of the speed; in flight the gap has the acceleration ", negate(a)))
        flights = divide(multiply(TWO, multiply(e, v)), a)
        yield Sentence(("the flights take ", flights, ", and each ", e, " of the one before: a geometric series"))
        ways = divide(multiply(multiply(e, e), multiply(v, v)), a)
        yield Sentence(("their ways are ", ways, ", and each ", multiply(e, e), " of the one before"))


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
