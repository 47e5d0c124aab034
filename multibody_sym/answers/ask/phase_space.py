"""`ask: {action: theta}`, `{bracket: [f, g]}`, `{canonical: {Q: .., P: ..}}`: coordinates q and momenta p.

    J = 1/(2 pi) closed integral of p dq        frequency = dE/dJ = 2 pi/T
    {f, g} = sum of df/dq dg/dp - df/dp dg/dq

The action J is an adiabatic invariant: it stays while parameters change slowly. A transformation is canonical where
{Q, P} = 1 for each pair, and all other brackets of new letters vanish. Speeds and other quantities in f and g are
put in as functions of q and p.

Source: Goldstein, Classical Mechanics, sections 9.4 and 9.5.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, partial
from itertools import combinations
from typing import Final, NamedTuple, Self

from multibody_sym.algebra.quotient_functions import exact_solve, sign, sqrt
from multibody_sym.algebra.quotients import PRECISE, Letter, NoClosedFormError, Quotient, why_none
from multibody_sym.analysis.modes.modes import NoPeriodError, RestingError
from multibody_sym.answers.ask.energy_integral import NEAR_REST, ToAndFro
from multibody_sym.answers.ask.later_formulas import in_book_form
from multibody_sym.answers.ask.named_answers import Anywhere, anywhere
from multibody_sym.answers.ask.number_questions import AdvanceQuestion, PeriodQuestion
from multibody_sym.answers.ask.question import (
    AskedMotion,
    NeverError,
    NumberQuestion,
    Question,
    RunNumbers,
    SingleQuestion,
)
from multibody_sym.answers.ask.working import OMEGA, Working, equation, written
from multibody_sym.answers.instant.instant import SolvedInstant, with_letters
from multibody_sym.answers.instant.letters import TIME, put_in, state_names
from multibody_sym.answers.records import Formula, Line, Sentence
from multibody_sym.derivation.canonical import cyclic_speeds
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.programs.quantities import generalized_momenta
from multibody_sym.errors import ExpressionError, ModelError, at
from multibody_sym.model.settings import MOMENTUM, Ask
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ONE, PI, ZERO, Node, as_node, quantity, subtract, symbol
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value

# ----------------------------------------------------------------------------------------------------------------------
# The action of a coordinate, and the frequency dE/dJ of its angle variable; in steps both as functions of the energy.


FREQUENCY: Final = ".frequency"
"""The end of the name of the second answer."""
_ACTION: Final = symbol("J")


@dataclass(frozen=True)
class ActionQuestion(NumberQuestion):
    """The action of a coordinate, and the frequency of its angle."""

    keys = ("action",)

    coordinate: str

    def words(self) -> str:
        return f"the action of {self.coordinate}"

    @property
    def momentum(self) -> Node:
        """The momentum of the coordinate."""
        return quantity("generalized_momentum", (self.coordinate,))

    def unit(self, motion: AskedMotion) -> str:
        return motion.unit_of(symbol(self.coordinate) * self.momentum)

    def number(self, numbers: RunNumbers) -> Value:
        try:
            with at("action"):
                found = numbers.motion.swing(self.coordinate).action
        except RestingError:
            return Value(0.0)
        except NoPeriodError as reason:
            raise NeverError(str(reason)) from None
        numbers.accuracy.append(f"its number is known {found.how}")
        return found.value("")

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        return self.answers(motion, working)[""]

    def answers(self, motion: AskedMotion, working: Working) -> Mapping[str, Value]:
        unit, mechanism = self.unit(motion), motion.solved.mechanism
        pairs = {u: q for body in mechanism.bodies for q, u in body.rate_pairs}
        cyclic = [mechanism.coordinates[pairs[u]].name for u in cyclic_speeds(mechanism) if u in pairs]
        if self.coordinate in cyclic:
            return self._of_cyclic(motion, unit, cyclic, working)
        numbers = RunNumbers(motion.simulated)
        try:
            found = numbers.with_error(self)
            if found.value == 0.0:
                return self._at_rest(motion, unit, working)
            period = numbers.with_error(PeriodQuestion(self.coordinate))
        except NeverError as reason:
            swing = ToAndFro.of(motion.solved, self.coordinate)
            known = None if swing is None else swing.by_elliptic_integrals()
            if swing is None or known is None:
                working.notes.append(str(reason))
                return {"": Value(None, unit=unit)}
            working.notes.append(NEAR_REST)
            working.steps.append(partial(self._lines, swing, closed=False))
            return {"": Value(known[1], unit=unit), FREQUENCY: Value(2 * math.pi / known[0], unit="rad/s")}
        assert period.value is not None
        swing = ToAndFro.of(motion.solved, self.coordinate)
        formula = None if swing is None else swing.confirmed(swing.action, found.value or 0.0)
        seconds = None if swing is None else swing.confirmed(partial(swing.whole, TIME), period.value)
        frequency = Value(2 * math.pi / period.value, error=2 * math.pi * period.error / period.value**2)
        form = None
        if swing is not None and seconds is not None:
            form = in_book_form(swing.freedom.there, 2 * PI / seconds, {})
        if formula is None:
            working.notes.append(numbers.accuracy[0])
        if swing is None:
            working.steps.append(lambda: [Sentence(("the integral of p dq over a period, by 2 pi",))])
            working.steps.append(lambda: numbers.lines(replace(found, unit=unit), period.value or 0.0))
        else:
            working.steps.append(lambda: self._lines(swing, closed=formula is not None))
        return {
            "": replace(motion.with_formula(found, formula), unit=unit),
            FREQUENCY: replace(motion.with_formula(frequency, form), unit="rad/s"),
        }

    def _at_rest(self, motion: AskedMotion, unit: str, working: Working) -> Mapping[str, Value]:
        """Return no action, and the frequency to which those of small swings tend; neither where these would grow."""
        nothing = {"": Value(0.0, ZERO, unit)}
        swing = ToAndFro.of(motion.solved, self.coordinate)
        try:
            square = None if swing is None else swing.square_at_rest()
        except (NoClosedFormError, ExpressionError, *UNDEFINED):
            square = None
        if square is None:
            working.notes.append(f"{self.coordinate} does not move, and nothing is known of small swings")
            return nothing
        if sign(square) < 0:
            working.notes.append(f"{self.coordinate} does not move, and would not return: its rest is unstable")
            return {"": Value(None, unit=unit)}
        working.notes.append(f"{self.coordinate} does not move; the frequency is the limit of that of small swings")
        form = written(sqrt(square))
        return {**nothing, FREQUENCY: Value(evaluate_float([form], motion.solved.sample)[0], form, "rad/s")}

    def _lines(self, swing: ToAndFro, *, closed: bool) -> Iterator[Line]:
        """Yield the energy, J by the energy, and the derivative that is the frequency."""
        with suppress(NoClosedFormError):
            swing = swing.by_energy()
        freedom = swing.freedom
        yield from freedom.lines([])
        momentum = freedom.inertia * freedom.speed
        yield Sentence((_ACTION, " is the integral of ", momentum, " by ", freedom.variable, " over a period, by 2 pi"))
        if not closed:
            yield Sentence(("it is no elementary function that is known: numbers integrate it",))
            yield from swing.elliptic_lines()
            return
        action = swing.action()
        if freedom.energy is None:
            yield equation(_ACTION, action)
            return
        yield equation(_ACTION, action, "by the energy")
        yield Sentence((action, " stays constant while parameters change slowly: an adiabatic invariant"))
        ratio = symbol("dE") / symbol("dJ")
        yield Formula((OMEGA, ratio, swing.rate_by_energy(action)), before=("the angle variable grows with",))

    def _of_cyclic(self, motion: AskedMotion, unit: str, cyclic: list[str], working: Working) -> Mapping[str, Value]:
        """Return the momentum, which is conserved, and the mean rate of the coordinate."""
        solved = motion.solved
        found = with_letters(solved, solved.asked(self.momentum), {"": unit})[""]
        working.steps.append(lambda: [Sentence((f"nothing depends on {self.coordinate}: J is its momentum",))])
        others = [x.name for x in solved.mechanism.coordinates if x.name not in cyclic]
        if not others or (len(others) == 1 and _rests(motion, others[0])):
            rate = with_letters(solved, solved.asked(quantity("'", (self.coordinate,))), {"": "rad/s"})[""]
            return {"": found, FREQUENCY: rate}
        if len(others) > 1:
            working.notes.append(f"{self.coordinate} advances beside {', '.join(others)}, which have no one period")
            return {"": found}
        advance = AdvanceQuestion(self.coordinate, others[0])
        moved, period = (x.answer(motion, Working()) for x in (advance, PeriodQuestion(others[0])))
        if moved.value is None or period.value is None:
            working.notes.append(f"{others[0]} has no period, by which the mean rate of {self.coordinate} is known")
            return {"": found}
        error = moved.error / period.value + abs(moved.value) * period.error / period.value**2
        rate = Value(moved.value / period.value, unit="rad/s", error=error)
        there = motion.courses.shown.there
        if there is not None and moved.expression is not None and period.expression is not None:
            form = in_book_form(there, moved.expression / period.expression, {})
            rate = replace(motion.with_formula(rate, form), unit="rad/s")
        words = f"its mean rate: the advance of {self.coordinate} in a period of {others[0]}, by that period"
        working.steps.append(lambda: [Sentence((words,))])
        return {"": found, FREQUENCY: rate}


def _rests(motion: AskedMotion, coordinate: str) -> bool:
    """Return whether a coordinate keeps its value in the motion from the start."""
    try:
        motion.simulated.swing(coordinate).period  # noqa: B018 - raises where there is none
    except RestingError:
        return True
    except NoPeriodError:
        pass
    return False


# ----------------------------------------------------------------------------------------------------------------------
# Brackets and canonical transformations.


class Conjugate(NamedTuple):
    """A coordinate with its speed and its momentum, which `quantity` names."""

    coordinate: Node
    speed: Node
    momentum: Node
    quantity: Node


_TERMS: Final = 6
"""So many terms of a bracket are written in steps at most."""


@dataclass(frozen=True, eq=False)
class PhaseSpace:
    """Coordinates and momenta of a system of independent coordinates, whose speeds are their rates."""

    there: Anywhere
    pairs: tuple[Conjugate, ...]

    @classmethod
    def of(cls, solved: SolvedInstant) -> PhaseSpace:
        """Return the phase space of a system. Raises NoClosedFormError, which says why it has none."""
        mechanism, there = solved.mechanism, anywhere(solved, solved.begin.q, solved.begin.u)
        rates = [pair for body in mechanism.bodies for pair in body.rate_pairs]
        if there is None or len(rates) != len(mechanism.speeds) or mechanism.rows:
            raise NoClosedFormError("brackets need coordinates without constraints, whose rates are the speeds")
        rates.sort(key=lambda pair: pair[1])
        names = [(mechanism.coordinates[q].name, mechanism.speeds[u].name) for q, u in rates]
        pairs = [
            Conjugate(symbol(q), symbol(u), symbol(f"{MOMENTUM}{q}"), quantity("generalized_momentum", (q,)))
            for q, u in names
        ]
        return cls(there, tuple(pairs))

    @cached_property
    def momenta(self) -> dict[Node, Node]:
        """Each momentum as a function of coordinates and speeds."""
        found = generalized_momenta(self.there.instant.motion)
        return {x.momentum: as_node(p) for x, p in zip(self.pairs, found, strict=True)}

    @cached_property
    def speeds(self) -> dict[Node, Node]:
        """Each speed as a function of coordinates and momenta. Raises NoClosedFormError."""
        forms, sample = self.there.forms, self.there.solved.sample
        begin, mechanism = self.there.solved.begin, self.there.solved.mechanism
        sample |= zip(map(symbol, state_names(mechanism)), (*begin.q, *begin.u), strict=True)
        matrix = mass_matrix(self.there.instant.motion)
        at_rest = {x.speed: ZERO for x in self.pairs}
        right: list[Quotient] = []
        for momentum, found in self.momenta.items():
            if momentum not in forms.known:
                value = evaluate_float([found], sample)[0]
                letter = Letter(momentum, PRECISE.mpf(value) + PRECISE.mpf(1) / (97 + len(right)))
                forms.known[momentum] = forms.field.letter(momentum, letter)
            right.append(forms.known[momentum] - forms.of([put_in(found, at_rest)])[0])
        left = [forms.of([as_node(x) for x in row]) for row in matrix]
        solved = exact_solve(left, right)
        return {x.speed: written(u) for x, u in zip(self.pairs, solved, strict=True)}

    def of_state(self, asked: Node) -> Node:
        """Return an expression of the model and of momenta as a function of q and p. Raises NoClosedFormError."""
        named = put_in(asked, {x.momentum: x.quantity for x in self.pairs})
        found = as_node(self.there.solved.asked(named)(self.there.instant)[""])
        if leaves([found], "slot"):
            raise NoClosedFormError(f"{text(asked)} depends on accelerations or forces")
        return written(self.exactly(put_in(found, self.speeds)))

    def exactly(self, node: Node) -> Quotient:
        """Return a function of q and p as a quotient. Raises NoClosedFormError."""
        return self.there.forms.of([node])[0]

    def terms(self, f: Node, g: Node) -> Iterator[tuple[Conjugate, Node]]:
        """Yield df/dq dg/dp - df/dp dg/dq of each pair, of functions of q and p, where a product is not zero."""
        for pair in self.pairs:
            q, p = pair.coordinate, pair.momentum
            parts = derivative(f, q) * derivative(g, p), derivative(f, p) * derivative(g, q)
            if parts != (ZERO, ZERO):
                yield pair, subtract(*parts)

    def bracket(self, f: Node, g: Node) -> Node:
        """Return {f, g} of functions of q and p. Raises NoClosedFormError."""
        return written(self.exactly(sum((x for _, x in self.terms(f, g)), ZERO)))

    def value(self, motion: AskedMotion, found: Node, unit: str) -> Value:
        """Return a function of q and p, with its number where it depends on parameters alone."""
        if set(leaves([found], "symbol")) <= set(motion.solved.sample):
            return Value(evaluate_float([found], motion.solved.sample)[0], found, unit)
        return Value(None, found, unit)

    def unit(self, motion: AskedMotion, f: Node, g: Node) -> str:
        """Return the SI unit of {f, g}."""
        pair, named = self.pairs[0], {x.momentum: x.quantity for x in self.pairs}
        product = put_in(f, named) * put_in(g, named)
        return motion.unit_of(product / (pair.coordinate * pair.quantity))

    def lines(self, asked: Mapping[Node, Node]) -> Iterator[Line]:
        """Yield the momenta, the speeds where needed, and what was asked as functions of q and p."""
        for momentum, found in self.momenta.items():
            yield equation(momentum, written(self.exactly(found)), "the momentum")
        for expression, found in asked.items():
            if expression is not found:
                yield equation(expression, found, "by coordinates and momenta")


def _bracket_text(f: object, g: object) -> str:
    return f"{{{f}, {g}}}"


@dataclass(frozen=True)
class BracketQuestion(SingleQuestion):
    """The Poisson bracket of two functions."""

    is_of_start = True

    f: Node
    g: Node

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.bracket is None else cls(*ask.bracket)

    def words(self) -> str:
        return f"the Poisson bracket {_bracket_text(text(self.f), text(self.g))}"

    def unit(self, motion: AskedMotion) -> str:
        try:
            return PhaseSpace.of(motion.solved).unit(motion, self.f, self.g)
        except NoClosedFormError:
            return ""

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        try:
            space = PhaseSpace.of(motion.solved)
            functions = {x: space.of_state(x) for x in (self.f, self.g)}
            f, g = functions[self.f], functions[self.g]
            found = space.bracket(f, g)
        except (NoClosedFormError, ExpressionError, *UNDEFINED) as reason:
            working.notes.append(why_none(reason))
            return Value(None)
        working.steps.append(lambda: self._lines(space, functions))
        return space.value(motion, found, space.unit(motion, self.f, self.g))

    def _lines(self, space: PhaseSpace, functions: Mapping[Node, Node]) -> Iterator[Line]:
        yield from space.lines(functions)
        f, g = functions[self.f], functions[self.g]
        yield Sentence(("the sum of df/dq*dg/dp - df/dp*dg/dq, for each coordinate",))
        terms = [*space.terms(f, g)]
        for pair, term in terms[:_TERMS] if len(terms) > 1 else ():
            yield Sentence(("from ", pair.coordinate, ": ", written(space.exactly(term))))


@dataclass(frozen=True)
class CanonicalQuestion(Question):
    """Whether new coordinates and momenta are canonical: their brackets."""

    keys = ("canonical",)
    is_of_start = True

    new: Mapping[str, Node]

    def words(self) -> str:
        return f"whether {', '.join(self.new)} are canonical"

    def answers(self, motion: AskedMotion, working: Working) -> Mapping[str, Value]:
        names = [*self.new]
        pairs = [*zip(names[::2], names[1::2], strict=True)]
        try:
            space = PhaseSpace.of(motion.solved)
            if len(pairs) > len(space.pairs):
                raise ModelError(f"{len(pairs)} pairs for {len(space.pairs)} coordinates", number="M103")
            new = {name: space.of_state(x) for name, x in self.new.items()}
            brackets = {(a, b): space.bracket(new[a], new[b]) for a, b in combinations(names, 2)}
        except (NoClosedFormError, ExpressionError, *UNDEFINED) as reason:
            working.notes.append(why_none(reason))
            return {"": Value(None)}
        wrong = {x: b for x, b in brackets.items() if b != (ONE if x in pairs else ZERO)}
        if wrong:
            told = ", ".join(f"{_bracket_text(*x)} = {text(b)}" for x, b in wrong.items())
            working.notes.append(f"not canonical: {told}")
        else:
            few = "" if len(pairs) == len(space.pairs) else f", {len(pairs)} of {len(space.pairs)} pairs"
            working.notes.append(f"canonical{few}: {{Q, P}} = 1 for each pair, all other brackets vanish")
        working.steps.append(lambda: self._lines(space, new, brackets))
        return {f".{a}_{b}": space.value(motion, brackets[a, b], "") for a, b in pairs}

    def _lines(
        self, space: PhaseSpace, new: Mapping[str, Node], brackets: Mapping[tuple[str, str], Node]
    ) -> Iterator[Line]:
        yield from space.lines({self.new[name]: x for name, x in new.items()})
        for (a, b), found in brackets.items():
            yield equation(symbol(_bracket_text(a, b)), found)


PHASE_SPACE_QUESTIONS: Final = (BracketQuestion, CanonicalQuestion)
