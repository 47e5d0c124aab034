"""`ask: {b: {bracket: [f, g]}}`, `{canonical: {Q: .., P: ..}}`: functions of coordinates q and momenta p.

    {f, g} = sum of df/dq dg/dp - df/dp dg/dq

A transformation is canonical where {Q, P} = 1 for each pair, and all other brackets of new letters vanish. Speeds and
other quantities in f and g are put in as functions of q and p.

Source: Goldstein, Classical Mechanics, sections 9.4 and 9.5.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property, reduce
from itertools import combinations
from typing import Final, NamedTuple, Self

from multibody_sym.algebra.quotient_functions import exact_solve
from multibody_sym.algebra.quotients import PRECISE, Letter, NoClosedFormError, Quotient, why_none
from multibody_sym.answers.ask.named_answers import Anywhere, anywhere
from multibody_sym.answers.ask.question import AskedMotion, Question, SingleQuestion
from multibody_sym.answers.ask.working import Working, equation, written
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.instant.letters import put_in
from multibody_sym.answers.records import Line, Sentence
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.programs.quantities import generalized_momenta
from multibody_sym.errors import ExpressionError, ModelError
from multibody_sym.model.settings import MOMENTUM, Ask
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ONE, ZERO, Node, add, as_node, divide, multiply, quantity, subtract, symbol
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value


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
        names = [*(x.name for x in mechanism.coordinates), *(x.name for x in mechanism.speeds)]
        sample |= {symbol(name): x for name, x in zip(names, (*begin.q, *begin.u), strict=True)}
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
            parts = multiply(derivative(f, q), derivative(g, p)), multiply(derivative(f, p), derivative(g, q))
            if parts != (ZERO, ZERO):
                yield pair, subtract(*parts)

    def bracket(self, f: Node, g: Node) -> Node:
        """Return {f, g} of functions of q and p. Raises NoClosedFormError."""
        return written(self.exactly(reduce(add, (x for _, x in self.terms(f, g)), ZERO)))

    def value(self, motion: AskedMotion, found: Node, unit: str) -> Value:
        """Return a function of q and p, with its number where it depends on parameters alone."""
        if set(leaves([found], "symbol")) <= set(motion.solved.sample):
            return Value(evaluate_float([found], motion.solved.sample)[0], found, unit)
        return Value(None, found, unit)

    def unit(self, motion: AskedMotion, f: Node, g: Node) -> str:
        """Return the SI unit of {f, g}."""
        pair, named = self.pairs[0], {x.momentum: x.quantity for x in self.pairs}
        product = multiply(put_in(f, named), put_in(g, named))
        return motion.unit_of(divide(product, multiply(pair.coordinate, pair.quantity)))

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

    f: Node
    g: Node

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.bracket is None else cls(*ask.bracket)

    def words(self) -> str:
        return f"the Poisson bracket {_bracket_text(text(self.f), text(self.g))}"

    def is_later(self) -> bool:
        return False

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

    new: Mapping[str, Node]

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.canonical is None else cls(ask.canonical)

    def words(self) -> str:
        return f"whether {', '.join(self.new)} are canonical"

    def is_later(self) -> bool:
        return False

    def unit(self, _motion: AskedMotion) -> str:
        return ""

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
