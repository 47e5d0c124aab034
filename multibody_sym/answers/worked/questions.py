"""Answers to `ask` as steps of a solution: each question by its law, in the letters of the other steps."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import takewhile
from typing import Any, Final

import sympy

from multibody_sym.answers.ask.working import IMAGINARY, OMEGA, OMEGA_0, ZETA, WorkedAnswer
from multibody_sym.answers.instant.letters import acceleration_names
from multibody_sym.answers.records import Formula, Line, Sentence, Worked, WorkedStep, formulas_in
from multibody_sym.answers.worked.equations import model_letters
from multibody_sym.derivation.notation import COORDINATE, Label, Symbols, latex_name
from multibody_sym.mechanics.mechanism import TIME, Mechanism
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.scalars.sympy_bridge import to_sympy
from multibody_sym.text.printer import text
from multibody_sym.text.values import Quantity, Value


def with_questions(
    worked: Worked,
    mechanism: Mechanism,
    symbols: Symbols,
    answers: Mapping[str, Value],
    asked: Mapping[str, WorkedAnswer],
    undefined: Collection[str] = (),
    lines: Mapping[str, Sequence[Line]] | None = None,
) -> Worked:
    """Return a solution's steps with one more for each question that has an answer; `lines`: those of its working.

    A formula that names a letter that steps leave `undefined` is left out, as the lines before it say the same.
    """
    spelt, steps, before = _Spelling(mechanism, symbols, undefined), list[WorkedStep](), dict[str, list[Line]]()
    for name, each in asked.items():
        found = {part: answers[f"{name}{part}"] for part in each.parts if f"{name}{part}" in answers}
        if found:
            worked_out = each.working.lines() if lines is None else lines[name]
            told = [*spelt.lines(name, each, found, worked_out)]
            steps.append(WorkedStep(f"{name}: {each.asked}", tuple(_less_repeated(told, before)), is_later=True))
            before[name] = told
    spelling = {**worked.notation.spelling, **spelt.spelling}
    notation = replace(worked.notation, spelling=spelling, places={**spelt.places, **worked.notation.places})
    return replace(worked, steps=(*worked.steps, *steps), notation=notation)


_REPEATED: Final = 3
"""From so many equal lines on, a step names the one before that has them."""


def _less_repeated(lines: list[Line], before: Mapping[str, list[Line]]) -> list[Line]:
    """Return lines, the first ones as one sentence where a step before begins with them, and the last formula there."""
    alike = {
        name: sum(1 for _ in takewhile(bool, (a == b for a, b in zip(lines, others, strict=False))))
        for name, others in before.items()
    }
    name = max(alike, key=lambda each: alike[each], default="")
    if not name or alike[name] < _REPEATED:
        return lines
    shared = lines[: alike[name]]
    formulas = formulas_in(shared)
    words = f"as for {name}"
    last = replace(formulas[-1], before=(f"{words}, down to",)) if formulas else Sentence((words,))
    return [last, *lines[alike[name] :]]


_SO: Final = ("so",)


class _Spelling:
    """Lines over Nodes in sympy; `spelling`: how symbols are spelt that other steps do not have."""

    def __init__(self, mechanism: Mechanism, symbols: Symbols, undefined: Collection[str]) -> None:
        self._undefined = set(map(symbol, undefined))
        self._leaves = model_letters(mechanism, symbols)
        self._leaves.update(zip(map(symbol, mechanism.inputs), symbols.inputs, strict=True))
        names = acceleration_names(mechanism)
        self._leaves.update((symbol(f"{name}''"), s) for name, s in zip(names, symbols.accelerations, strict=True))
        self._leaves[TIME] = symbols.time
        self.spelling: dict[Any, Label] = {}
        self._named(OMEGA, "omega")
        self._constants = [self._named(node, text(node)) for node in (IMAGINARY, ZETA, OMEGA_0)]

    @property
    def places(self) -> dict[Any, tuple[int, int]]:
        """The places of those symbols: constants stand before all letters, the others with the coordinates."""
        return {s: (COORDINATE, k) for k, s in enumerate(self.spelling) if s not in self._constants}

    def _named(self, node: Node, name: str) -> Any:
        """Return the symbol of a leaf that steps do not have."""
        made = self._leaves[node] = sympy.Symbol(f"asked {name}", real=True)
        latex = latex_name(name) if node.op == "symbol" else rf"\mathrm{{{name}}}"
        self.spelling[made] = Label(name, latex)
        return made

    def lines(
        self, name: str, asked: WorkedAnswer, answers: Mapping[str, Value], worked: Sequence[Line]
    ) -> Iterator[Line]:
        """Yield the lines of a question that is `worked` out, and its answers by the ends of their names."""
        lines = list(map(self._line, worked))
        for end, answer in answers.items():
            if answer.value is None and answer.expression is None:
                yield from lines
                yield from (Sentence((note,)) for note in asked.working.notes)
            else:
                yield from self._result(f"{name}{end}", asked, answer, lines)
            lines = []

    def _result(self, name: str, asked: WorkedAnswer, answer: Value, lines: list[Line]) -> Iterator[Line]:
        number = answer.value
        if number is not None and answer.expression is None and abs(number) <= answer.error:
            number = 0.0  # within its error
        value = None if number is None else Quantity(number, answer.unit)
        sides = [self._answer(name)]
        at_start = asked.at_start
        if at_start is not None and leaves([at_start], "quantity") and text(at_start) == asked.asked:
            sides.append(self._in_sympy(at_start))  # without answers put into it
        if answer.expression is not None and not self._undefined.intersection(leaves([answer.expression], "symbol")):
            expression = self._in_sympy(answer.expression)
            if value is None or not expression.is_Rational:
                sides.append(expression)
        last, before = lines[-1] if lines else None, ()
        if isinstance(last, Formula) and len(last.sides) > 1 and last.sides[-1] == sides[-1]:
            lines.pop()  # the answer says the same
            before = last.before if last.before != _SO else ()
        yield from lines
        yield Formula(tuple(sides), value=value, before=before)

    def _line(self, line: Line) -> Line:
        if isinstance(line, Formula):
            return replace(line, sides=tuple(map(self._in_sympy, line.sides)))
        return Sentence(tuple(x if isinstance(x, (str, Quantity)) else self._in_sympy(x) for x in line.words))

    def _answer(self, name: str) -> Any:
        return self._named(symbol(f"answer {name}"), name)

    def _in_sympy(self, node: Node) -> Any:
        for leaf in leaves([node], "quantity") + leaves([node], "symbol"):
            if leaf not in self._leaves:
                self._named(leaf, text(leaf))
        return to_sympy(node, self._leaves)
