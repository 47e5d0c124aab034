"""Frequencies and periods of small oscillations in questions: `ask: {omega: frequency(1), T: period(1)}`."""

from __future__ import annotations

from collections.abc import Collection
from functools import cached_property

from multibody_sym.answers.small_motions.record import Modes
from multibody_sym.answers.small_motions.small_motion import SmallMotion
from multibody_sym.errors import NoSolutionError
from multibody_sym.expressions.quantities import QUANTITIES
from multibody_sym.expressions.values import Value
from multibody_sym.model.declaration.settings import Ask
from multibody_sym.model.declaration.system import System, expressions, with_expressions
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import Node, real
from multibody_sym.scalars.traversal import leaves


@dataclass(frozen=True)
class AskedModes:
    """What the small oscillations about the start of a system, or about the state beside it, are asked.

    `letters`: the symbols that formulas may name.
    """

    system: System
    letters: Collection[Node] = ()

    @cached_property
    def modes(self) -> Modes:
        """The small motions. Raises NoSolutionError where there are none."""
        return SmallMotion.of(self.system).told()

    def value(self, leaf: Node) -> Value:
        """Return the frequency or period that a quantity asks for. Raises NoSolutionError without such a mode."""
        found = self.modes.frequencies if leaf.data[0] == "frequency" else self.modes.periods
        number = int(leaf.data[1][0])
        if number > len(found):
            count = {0: "no mode oscillates", 1: "one mode oscillates"}.get(len(found), f"{len(found)} modes oscillate")
            raise NoSolutionError(f"{leaf}: {count} in small motions about the {self.modes.about}", number="N111")
        return found[number - 1]

    def put_in(self, question: Ask) -> tuple[Ask, bool]:
        """Return a question with values in the place of frequencies and periods, and whether all had closed forms.

        Those that name coordinates of the state about which they are have none here: at the start these are others.
        """
        known: dict[Node, Node] = {}
        closed = True
        for leaf in modes_named(question):
            value = self.value(leaf)
            parts = leaves([value.expression], "symbol") if value.expression is not None else []
            whole = value.expression if all(x in self.letters for x in parts) else None
            closed = closed and whole is not None
            known[leaf] = whole if whole is not None else real(float(value.value or 0.0))
        changed: Ask = with_expressions(
            question, lambda node: evaluate([node], lambda leaf: known.get(leaf, leaf))[0]
        )
        return changed, closed

    def remarks(self) -> list[str]:
        """Return what the answers rest on: the state, where it is not the start, and the conditions of stability."""
        found = [f"{condition}, else small motions grow" for condition in self.modes.conditions]
        if self.modes.found:
            place = ", ".join(f"{name} = {value}" for name, value in self.modes.at.items())
            found.insert(0, f"small oscillations are those about the {self.modes.about} at {place}, beside the start")
        return [*found, *(note for note in self.modes.notes if "numbers only" not in note)]


def modes_named(question: Ask) -> list[Node]:
    """Return the frequencies and periods that a question names."""
    named = leaves([written.node for written in expressions(question)], "quantity")
    return [leaf for leaf in named if QUANTITIES[leaf.data[0]].of_mode] if named else []
