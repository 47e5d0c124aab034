"""An expression of answers as a function of a parameter or of a start value: by its formula, and by runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from time import process_time
from typing import Final

from multibody_sym.algebra.quotients import PRECISE, Letter, NoClosedFormError, why_none
from multibody_sym.algebra.roots import roots
from multibody_sym.answers.ask.extremes import ANYWHERE, UNKNOWN, ExtremeQuestion
from multibody_sym.answers.ask.forced_questions import FORCED_QUESTIONS
from multibody_sym.answers.ask.from_runs import Simulated
from multibody_sym.answers.ask.linear_systems import AskedModes
from multibody_sym.answers.ask.named_answers import with_answers
from multibody_sym.answers.ask.number_questions import NUMBER_QUESTIONS
from multibody_sym.answers.ask.phase_space import ActionQuestion
from multibody_sym.answers.ask.question import AskedMotion, NeverError, NumberQuestion, RunNumbers
from multibody_sym.answers.instant.instant import AGREEMENT, SolvedInstant
from multibody_sym.answers.instant.letters import put_in, quotient_of, state_names
from multibody_sym.derivation.symbolic_start import limits_of
from multibody_sym.errors import ExpressionError, InputError, MultibodyError, NoSolutionError
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.vocabulary import in_order, named_by
from multibody_sym.model.fields import Names
from multibody_sym.model.settings import Ask
from multibody_sym.model.system import System
from multibody_sym.motion.runs.run import FailedRunError
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, UNDEFINED
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.scalars.sign_changes import Bounded, bound_rounding
from multibody_sym.stages import doing
from multibody_sym.text.values import Value

VARIED: Final = "varied expression"
"""The name under which the expression is asked; no name of a model has a space."""

_LONGEST: Final = 8.0
"""Seconds of work after which a search without bounds ends."""

NAMED_QUESTIONS: Final[tuple[type[NumberQuestion], ...]] = (
    *NUMBER_QUESTIONS,
    ActionQuestion,
    ExtremeQuestion,
    *FORCED_QUESTIONS,
)
"""The kinds whose answers an expression may name."""


def number_question(ask: Ask) -> NumberQuestion | None:
    """Return a question whose answer is a number; None for those of other kinds."""
    return next((found for kind in NAMED_QUESTIONS if (found := kind.parse(ask)) is not None), None)


@dataclass(frozen=True)
class VariedAnswer:
    """An `expression` of answers as a function of the parameter, coordinate or speed `name`.

    `known`: the answers that it names, at the declared value. `extremes`: the questions among them that `ask` lacks.
    """

    motion: AskedMotion
    name: str
    expression: Node
    known: Mapping[str, Value]
    extremes: Mapping[str, Ask]

    @property
    def solved(self) -> SolvedInstant:
        """The start with the declared value."""
        return self.motion.solved

    @cached_property
    def sample(self) -> float:
        """The declared value of what varies."""
        begin, names = self.solved.begin, state_names(self.solved.mechanism)
        starts = dict(zip(names, (*begin.q, *begin.u), strict=True))
        if self.name in starts:
            return float(starts[self.name])
        return self.solved.number(symbol(self.name))

    def bounds(self, between: tuple[Node, ...] | None) -> tuple[float, float] | None:
        """Return two bounds as numbers, the lower first."""
        if between is None:
            return None
        low, high = map(self.solved.number, between)
        return min(low, high), max(low, high)

    @cached_property
    def limits(self) -> tuple[float, float]:
        """The least and the greatest value that may be taken."""
        mechanism = self.solved.mechanism
        return ANYWHERE if self.name in state_names(mechanism) else limits_of(mechanism, self.name)

    @cached_property
    def asked(self) -> Ask:
        """The expression as a question."""
        return Ask(value=self.expression)

    @cached_property
    def needed_system(self) -> System:
        """The system that is asked only what the expression needs."""
        asked = {**self.solved.system.ask, **self.extremes}
        asked[VARIED] = self.asked
        needed = [VARIED]
        for name in needed:
            needed += sorted(named_by(asked[name], asked, self.solved.mechanism.symbols).difference(needed))
        return self.solved.system.with_fields({"ask": Names({name: asked[name] for name in needed})})

    def changed(self, value: float) -> System:
        """Return the system that is asked what the expression needs, at a value of what varies."""
        change = {self.name: value}
        is_parameter = self.name in self.solved.system.parameters
        return (Overrides(parameters=change) if is_parameter else Overrides(initial=change)).of(self.needed_system)

    # --- in numbers -----------------------------------------------------------------------------------------------

    def value(self, at: float) -> float:
        """Return the expression at a value of what varies, nan where there is no such motion, or answer."""
        if at not in self._values:
            doing(f"{self.name} = {at:.6g}")
            self._values[at] = self._value(at)
        return self._values[at]

    @cached_property
    def _values(self) -> dict[float, float]:
        return {}

    def _value(self, at: float) -> float:
        if not self._is_of_runs:
            again = self.solved_at(at).value
            return UNKNOWN if again is None else again
        try:
            found, self._notes[at] = self._by_runs(self.changed(at), is_coarse=False)
            return found
        except FailedRunError as failed:
            self.failed[at] = failed.message
            return UNKNOWN
        except (MultibodyError, NeverError, *UNDEFINED):
            return UNKNOWN

    @cached_property
    def failed(self) -> dict[float, str]:
        """Why runs fail, by the values at which they do."""
        return {}

    @property
    def failing(self) -> str:
        """That runs failed, and how the first of them did; else nothing."""
        if not self.failed:
            return ""
        value, reason = next(iter(self.failed.items()))
        tried = f"{len(self.failed)} of the {len(self._values)} values tried"
        return f"; {tried} have no answer, as {value:.6g}, since runs fail: {reason}"

    def _by_runs(self, system: System, *, is_coarse: bool) -> tuple[float, list[str]]:
        """Return the expression of a system, and the notes on the answers there."""
        numbers, modes = RunNumbers(Simulated(system, is_coarse)), AskedModes(system)
        answers: dict[str, Value] = {}
        there: list[str] = []
        for name in in_order(system.ask, self.solved.mechanism.symbols):
            named = with_answers(system.ask[name], answers, self.solved.mechanism.symbols)
            question = None if named is None else number_question(modes.put_in(named[0])[0])
            if question is None:
                return UNKNOWN, []
            before = len(numbers.notes)
            answers[name] = question.number(numbers)
            there += [f"there {name}: {note}" for note in numbers.notes[before:]]
        value = answers[VARIED].value
        return (UNKNOWN if value is None else value), there

    @cached_property
    def _notes(self) -> dict[float, list[str]]:
        return {}

    def notes(self, at: float) -> list[str]:
        """Return the notes on the answers at a value of what varies."""
        if at not in self._notes:
            self.value(at)
        failed = self.failed.get(at)
        unconfirmed = [] if failed is None else [f"by formulas, since the run that would confirm it fails: {failed}"]
        return [*unconfirmed, *dict.fromkeys(self._notes.get(at, ()))]

    def noise(self, at: float) -> float:
        """Return by how much the expression may be off, as coarser runs show it; unknown where these fail."""
        try:
            coarse, _ = self._by_runs(self.changed(at), is_coarse=True)
        except (MultibodyError, NeverError, *UNDEFINED):
            return UNKNOWN
        return Simulated(self.needed_system).part_of_coarser * abs(coarse - self.value(at))

    # --- in closed form -------------------------------------------------------------------------------------------

    @cached_property
    def unit(self) -> str:
        """The unit of the expression."""
        if self.expression.op == "symbol" and self.expression.data in self.known:
            return self.known[str(self.expression.data)].unit
        forms = {symbol(name): x.expression for name, x in self.known.items() if x.expression is not None}
        return self.motion.unit_of(put_in(self.expression, forms)) if len(forms) == len(self.known) else ""

    @property
    def formula(self) -> Node | None:
        """The expression in the model's symbols, None where it has no formula with what varies in it."""
        node = self.closed
        return node if node is not None and symbol(self.name) in leaves([node], "symbol") else None

    @cached_property
    def closed(self) -> Node | None:
        """The expression in the model's symbols, None where an answer has no formula."""
        if any(x.expression is None for x in self.known.values()):
            return None
        try:
            asked, closed = AskedModes(self.solved.system, self.solved.symbolic.letters).put_in(self.asked)
        except NoSolutionError:
            return None  # the value that the model has need not oscillate where others do
        if not closed:
            return None
        assert asked.value is not None
        formulas = {symbol(name): x.expression for name, x in self.known.items() if x.expression is not None}
        node = put_in(asked.value, formulas)
        letters = self.solved.symbolic.letters
        if leaves([node], "quantity") or any(x not in letters for x in leaves([node], "symbol")):
            return None
        return node

    def of_formula(self, node: Node, at: float) -> float:
        """Return a formula at a value of what varies, nan where it has none."""
        return value_of({**self.solved.sample, symbol(self.name): at}, node)

    def rounding(self, node: Node, at: float) -> float:
        """Return the effect of rounding on a formula at a value of what varies."""
        sample = {**self.solved.sample, symbol(self.name): at}
        return bound_rounding([node], {x: Bounded(y, EPSILON * abs(y)) for x, y in sample.items()})[0].bound

    @cached_property
    def _is_of_runs(self) -> bool:
        """Whether runs have all answers that the expression needs, which are none that are found themselves."""
        return all(number_question(ask) is not None for ask in self.needed_system.ask.values())

    def confirmed(self, at: float) -> float:
        """Return the expression by runs; where these fail, of answers there that hold without reservation."""
        found = self.value(at)
        again = self.solved_at(at, unreserved=True).value if at in self.failed else found
        return UNKNOWN if again is None else again

    def solved_at(self, at: float, *, unreserved: bool = False) -> Value:
        """Return the expression as `solve` answers it at a value of what varies, `unreserved`: without remarks."""
        try:
            _, answers, remarks = self.motion.solve(self.changed(at))
        except (MultibodyError, *UNDEFINED):
            return Value(None)
        return Value(None) if unreserved and remarks else answers[VARIED]


class OutOfTimeError(Exception):
    """A search without bounds has taken longer than people wait; the text says how far it came."""


class Patience:
    """A function that raises OutOfTimeError once `_LONGEST` seconds of work have passed since it was made."""

    def __init__(self, function: Callable[[float], float]) -> None:
        self._function, self._begun = function, process_time()
        self._tried: list[float] = []

    def __call__(self, at: float) -> float:
        if self._tried and process_time() - self._begun > _LONGEST:
            low, high = min(self._tried), max(self._tried)
            raise OutOfTimeError(f"from {low:.6g} to {high:.6g} in {_LONGEST:g} s; say where: between: [.., ..]")
        self._tried.append(at)
        return self._function(at)


def value_of(sample: Mapping[Node, float], formula: Node) -> float:
    """Return the value of a formula, nan where it has none."""
    try:
        return evaluate_float([formula], sample)[0]
    except (ExpressionError, *UNDEFINED):
        return UNKNOWN


def root_near(node: Node, unknown: Node, value: float, solved: SolvedInstant) -> Node | None:
    """Return the root of a formula as an expression, None where there is none with this value."""
    return next(roots_near(node, unknown, value, solved), None)


def roots_near(node: Node, unknown: Node, value: float, solved: SolvedInstant) -> Iterator[Node]:
    """Yield expressions of the root of a formula that has this value."""
    letters = dict(solved.symbolic.letters)
    letters[unknown] = Letter(unknown, PRECISE.mpf(value), letters[unknown].positive)
    try:
        for root in roots(quotient_of(node, letters), unknown):
            if abs(evaluate_float([root], solved.sample)[0] - value) <= AGREEMENT * abs(value):
                yield root
    except (NoClosedFormError, InputError, *UNDEFINED) as reason:
        solved.reasons[why_none(reason)] = None
