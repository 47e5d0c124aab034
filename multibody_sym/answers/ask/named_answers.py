"""Answers in the questions that name them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import field, replace

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.inequalities import surely_positive, under_roots
from multibody_sym.algebra.quotient_functions import with_whole_angles
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.instant.letters import TIME, put_in, state_names
from multibody_sym.derivation.symbolic_start import ClosedForms, any_state, closed_forms, unknowns
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.mechanics.motion import motion_of
from multibody_sym.mechanics.vocabulary import named_by
from multibody_sym.model.fields import Names
from multibody_sym.model.settings import Ask
from multibody_sym.model.system import System, with_expressions
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node, as_node, real, symbol
from multibody_sym.text.values import Value


def with_answers(
    question: Ask, answers: Mapping[str, Value], taken: Collection[Node], asked: Mapping[str, Node] | None = None
) -> tuple[Ask, bool] | None:
    """Return a question with answers in the place of their names, and whether each of them had a closed form.

    A question about the start has what was `asked` in the place of the names of these answers. None where an answer has
    no value. An expression that is asked as a function of a parameter keeps its names: its place alone is put in.
    """
    let, is_varied = question.let, question.varied is not None
    place = None if let is None else let.to
    letters = () if place is None else leaves([place], "symbol")
    of_place = {str(x.data) for x in letters if x not in taken and x.data in answers}
    named = of_place if is_varied else named_by(question, answers, taken)
    if not named:
        return question, True
    if any(answers[name].value is None for name in named):
        return None
    of_start = not is_varied and question.value is not None and question.when is None and question.after is None
    again = {name: node for name, node in (asked or {}).items() if of_start and name in named}
    forms = {name: answers[name].expression or real(answers[name].value or 0.0) for name in named}
    known = {symbol(name): again.get(name) or form for name, form in forms.items()}
    found: Ask
    if is_varied and let is not None and place is not None:
        found = replace(question, let=replace(let, to=put_in(place, known)))
    else:
        found = with_expressions(question, lambda node: put_in(node, known))
    return found, all(name in again or answers[name].expression is not None for name in named)


def questions_beside(system: System, answers: Mapping[str, Value], taken: Collection[Node]) -> Names:
    """Return the questions of a system without those that have `answers`, which stand in place of their names.

    Questions that name an answer without a value are left out.
    """
    named = {name: with_answers(x, answers, taken) for name, x in system.ask.items() if name not in answers}
    return Names({name: asked[0] for name, asked in named.items() if asked is not None})


def in_parameters(system: System, value: Value) -> Node | None:
    """Return the formula of a value where it is of parameters alone."""
    found = value.expression
    known = found is not None and all(leaf.data in system.parameters for leaf in leaves([found], "symbol"))
    return found if known else None


# ----------------------------------------------------------------------------------------------------------------------
# The equations of motion in closed form at any state, and what a formula of time takes for granted of parameters.


@dataclass(frozen=True, eq=False)
class Anywhere:
    """The equations of motion in closed form at any state: time, coordinates and speeds keep their names."""

    solved: SolvedInstant
    forms: ClosedForms
    instant: StateQuantities

    @property
    def variables(self) -> frozenset[Node]:
        """Time, coordinates and speeds."""
        return frozenset((TIME, *map(symbol, state_names(self.solved.mechanism))))

    def of(self, asked: Node) -> Quotient:
        """Return an expression of the model at any state. Raises NoClosedFormError."""
        return self.forms.of([as_node(self.solved.asked(asked)(self.instant)[""])])[0]

    def letter(self, node: Node) -> Quotient:
        """Return time, a coordinate or a speed as a quotient."""
        return self.forms.known[node]

    def constant(self, a: Quotient) -> bool:
        """Return whether a quotient is of parameters alone."""
        return not a.symbols & self.variables

    @contextmanager
    def assuming(self, granted: Granted) -> Iterator[None]:
        """Note the signs that are decided meanwhile as taken for granted, apart from those of the equations."""
        signs, self.forms.field.positive = self.forms.field.positive, granted.positive
        try:
            yield
        finally:
            self.forms.field.positive = signs


def anywhere(solved: SolvedInstant, q: Sequence[float], u: Sequence[float]) -> Anywhere | None:
    """Return a system's equations at any state like one that it comes to, whose signs of |u| and such they have.

    None where they have no closed form, poses are quaternions, or declared states move beside them.
    """
    mechanism = solved.mechanism
    if solved.forms is None or mechanism.rates or any(body.quaternions for body in mechanism.bodies):
        return None
    general = any_state(mechanism, replace(solved.begin, q=tuple(q), u=tuple(u)), solved.nodes.motion.state)
    try:
        forms = closed_forms(mechanism, general)
        names = map(symbol, state_names(mechanism))
        values = [as_node(x) for x in (*general.state.q, *general.state.u)]
        forms.known.update(zip(names, forms.of(values), strict=True))  # those that constraints hold have no letters
    except NoClosedFormError:
        return None
    return Anywhere(solved, forms, StateQuantities(motion_of(mechanism, general.state), *unknowns(mechanism)))


@dataclass(eq=False)
class Granted:
    """What the formulas of one coordinate take for granted: what is `positive`, what vanishes and what does not.

    `equal` holds what is zero at the sample, though not for all parameters; `unequal` what divides.
    """

    positive: list[Quotient] = field(default_factory=list)
    equal: list[Quotient] = field(default_factory=list)
    unequal: list[Quotient] = field(default_factory=list)

    def vanishes(self, a: Quotient) -> bool:
        """Return whether a quotient is zero at the sample, and take it for granted."""
        if a.vanishes and not a.is_zero:
            self.equal.append(a.field.whole(a.above))
        return a.vanishes

    def differs(self, a: Quotient) -> None:
        """Take for granted that a quotient is not zero, which may be so for other parameters."""
        above = a.field.whole(a.above)
        if not (surely_positive(above) or surely_positive(-above)):
            self.unequal.append(above)

    def written(self, a: Quotient) -> Node:
        """Return a quotient as an expression, and take for granted that its roots are real."""
        self.positive.extend(x.value for x in under_roots([a]))
        return book_form(with_whole_angles(a))
