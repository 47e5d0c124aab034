"""Symbolic expressions as a NumPy function, in which every symbol is a Dummy: no name becomes code."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import sympy

from multibody_sym.algebra.budget import Budget
from multibody_sym.algebra.subexpressions import Subexpressions, value_of
from multibody_sym.dynamics.derivation.symbols import Symbols
from multibody_sym.model.mechanism.mechanism import Mechanism


def declared_inputs(mechanism: Mechanism, symbols: Symbols) -> tuple[list[tuple[Any, Any]], dict[Any, Any]]:
    """Return the inputs of a mechanism as definitions, each after those that it names, and the numbers in them."""
    declared = Subexpressions("input ", Budget())
    inputs = declared.translated(list(mechanism.inputs.values()), symbols.slots)
    definitions = [*declared.definitions.items(), *zip(symbols.inputs, inputs, strict=True)]
    return definitions, {symbol: value_of(node) for symbol, node in declared.numbers.items()}


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
