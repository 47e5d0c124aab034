"""Symbolic expressions as a NumPy function, in which every symbol is a Dummy: no name becomes code."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import chain
from typing import Any

import numpy as np
import sympy
from numpy.typing import ArrayLike

from multibody_sym.algebra.budget import Budget
from multibody_sym.algebra.subexpressions import Subexpressions, value_of
from multibody_sym.dynamics.derivation.symbols import Symbols
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.scalars.rows import Tabulated
from multibody_sym.scalars.sympy_bridge import TableFunction


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
    expressions = [*(e for _, e in shared), *chain(*wanted)]
    found = dict.fromkeys(part.func for e in expressions for part in e.atoms(TableFunction))
    own = {f: sympy.Function(f"table_{k}") for k, f in enumerate(found, 1)}
    shared = [(x, _renamed(e, own)) for x, e in shared]
    wanted = [[_renamed(e, own) for e in part] for part in wanted]
    tables = {stand_in.__name__: partial(_values, *f.own) for f, stand_in in own.items()}
    compiled: Callable[..., Any] = sympy.lambdify(
        arguments, wanted, modules=[tables, "numpy"], cse=lambda expressions: (shared, list(expressions))
    )
    return compiled


def _renamed(expression: Any, own: Mapping[Any, Any]) -> Any:
    for f, stand_in in own.items():
        expression = expression.replace(f, stand_in)
    return expression


def _values(function: Tabulated, order: int, at: ArrayLike) -> Any:
    return np.reshape(function.values(order, np.ravel(at).tolist()), np.shape(at))
