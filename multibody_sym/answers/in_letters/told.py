"""Values of a solved start with formulas in letters where they have none in what is given alone."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from typing import Any

from multibody_sym.answers.in_letters.record import Definition
from multibody_sym.answers.instant import AGREEMENT, Solved
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.expressions.values import Value
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.scalars.traversal import leaves


def told(
    solved: Solved,
    ask: Callable[[Instant], Mapping[str, Any]],
    units: Mapping[str, str],
    numbers: Collection[str] = (),
    least: float = 0.0,
) -> dict[str, Value]:
    """Return what `ask` finds at the instant as `Solved.values` does, with formulas in letters where there are none.

    What is in `numbers` gets none. Forces up to `least` (N) are none.
    """
    found = solved.values(ask, units, least)
    return {name: x if name in numbers else _in_letters(solved, ask, name, x) for name, x in found.items()}


def _in_letters(solved: Solved, ask: Callable[[Instant], Mapping[str, Any]], name: str, value: Value) -> Value:
    """Return a number with its formula in letters; what vanishes, and what is not unique, has none."""
    if value.expression is not None or not value.value or not value.unique:
        return value
    found = solved.lettered.found
    form = None if found is None else found.of(ask, name)
    if found is None or form is None:
        return value
    near = abs(evaluate_float([form], found.letters.values)[0] - value.value) <= AGREEMENT * abs(value.value)
    return replace(value, expression=form) if near else value


def told_of_state(solved: Solved, name: str, value: Value) -> Value:
    """Return the start value of a coordinate or speed that constraints determine with its formula in letters."""
    if value.expression is not None or not value.value:
        return value
    found = solved.lettered.found
    known = None if found is None else found.definitions.get(symbol(name))
    return value if known is None or known.expression is None else replace(value, expression=known.expression)


def is_lettered(solved: Solved, value: Value) -> bool:
    """Return whether a formula names letters that the model and its start do not have."""
    named = leaves([value.expression], "symbol") if value.expression is not None else []
    return any(x not in solved.symbolic.letters for x in named)


def definitions(solved: Solved, values: Iterable[Value]) -> dict[str, Definition]:
    """Return what the letters of formulas stand for, those of values and of these definitions."""
    forms = [x.expression for x in values if x.expression is not None and is_lettered(solved, x)]
    found = solved.lettered.found if forms else None
    return {} if found is None else {str(node.data): one for node, one in found.needed(forms).items()}
