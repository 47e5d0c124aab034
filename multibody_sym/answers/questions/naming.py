"""Answers in the questions that name them."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from multibody_sym.expressions.values import Value
from multibody_sym.model.declaration.settings import Ask
from multibody_sym.model.declaration.system import with_expressions
from multibody_sym.model.resolution.questions import named_by
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import Node, real, symbol


def with_answers(
    question: Ask, answers: Mapping[str, Value], taken: Collection[Node], asked: Mapping[str, Node] | None = None
) -> tuple[Ask, bool] | None:
    """Return a question with answers in the place of their names, and whether each of them had a closed form.

    A question about the start has what was `asked` in the place of the names of these answers. None where an answer has
    no value.
    """
    named = named_by(question, dict.fromkeys(answers, question), taken)
    if question.so is not None or not named:
        return question, True
    if any(answers[name].value is None for name in named):
        return None
    at_start = question.value is not None and question.when is None and question.after is None
    again = {name: node for name, node in (asked or {}).items() if at_start and name in named}
    known = {symbol(name): again.get(name) or _node(answers[name]) for name in named}
    found: Ask = with_expressions(question, lambda node: put_in(node, known))
    return found, all(name in again or answers[name].expression is not None for name in named)


def _node(answer: Value) -> Node:
    """Return an answer's closed form, or its number."""
    if answer.expression is not None:
        return answer.expression
    assert answer.value is not None
    return real(answer.value)


def put_in(node: Node, known: Mapping[Node, Node]) -> Node:
    """Return an expression with others in the place of symbols."""
    found: Node = evaluate([node], lambda leaf: known.get(leaf, leaf))[0]
    return found
