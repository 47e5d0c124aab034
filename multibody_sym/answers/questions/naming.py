"""Answers in the questions that name them."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from multibody_sym.errors import ModelError, at
from multibody_sym.expressions.values import Value
from multibody_sym.model.declaration.settings import Ask
from multibody_sym.model.declaration.system import expressions, with_expressions
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import Node, real, symbol
from multibody_sym.scalars.traversal import leaves


def in_order(questions: Mapping[str, Ask], taken: Collection[Node]) -> list[str]:
    """Return the names of questions so that those come first which others name; `taken` are symbols of the model.

    Raises ModelError where questions name each other in a circle.
    """
    needed = {name: named_by(question, questions, taken) for name, question in questions.items()}
    ordered: list[str] = []
    while len(ordered) < len(questions):
        ready = [name for name in questions if name not in ordered and needed[name].issubset(ordered)]
        if not ready:
            circle = [name for name in questions if name not in ordered]
            with at("ask", circle[0]):
                what = (
                    f"the answers of {', '.join(circle)} name each other" if circle[1:] else "the answer names itself"
                )
                raise ModelError(f"{what}: none of them comes first", number="M110")
        ordered += ready
    return ordered


def named_by(question: Ask, questions: Mapping[str, Ask], taken: Collection[Node]) -> set[str]:
    """Return the names of answers that the expressions of a question name."""
    named = leaves([written.node for written in expressions(question)], "symbol")
    return {str(leaf.data) for leaf in named if leaf not in taken and leaf.data in questions}


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
