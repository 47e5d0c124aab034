"""Symbolic expressions as a NumPy function, in which every symbol is a Dummy: no name becomes code."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import sympy


def numpy_function(
    time: Any,
    groups: Sequence[Sequence[Any]],
    definitions: Sequence[tuple[Any, Any]],
    numbers: Mapping[Any, Any],
    lists: Sequence[Sequence[Any]],
) -> Callable[..., Any]:
    """Return the function of time and of groups of symbols that gives lists of expressions.

    `definitions`: named parts of them, each after those that it names; `numbers`: symbols that stand for constants.
    """
    given = (time, *(x for group in groups for x in group))
    dummies = {x: sympy.Dummy() for x in (*given, *(x for x, _ in definitions))}
    replaced = {**{symbol: sympy.Float(float(value)) for symbol, value in numbers.items()}, **dummies}
    shared = [(dummies[x], e.xreplace(replaced)) for x, e in definitions]
    wanted = [[x.xreplace(replaced) for x in part] for part in lists]
    arguments = [dummies[time], *([dummies[x] for x in group] for group in groups)]
    compiled: Callable[..., Any] = sympy.lambdify(
        arguments, wanted, modules="numpy", cse=lambda expressions: (shared, list(expressions))
    )
    return compiled
