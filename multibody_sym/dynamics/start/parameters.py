"""Values of parameters: defaults and overrides evaluated in the order of what refers to what."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from multibody_sym.dynamics.start.undefined import undefined_text
from multibody_sym.errors import ModelError, Where
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.parameters import Source
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import Node, slot, symbol
from multibody_sym.scalars.traversal import leaves


def parameter_values(mechanism: Mechanism, overrides: Mapping[str, float]) -> list[float]:
    """Return the parameter vector (np): declared values, expressions of others evaluated, `overrides` by name.

    What is not declared (lengths of ropes that are measured, Baumgarte's coefficients) is zero.
    Raises ModelError for unknown names, circles, values that are not finite, and `positive` ones that are not.
    """
    entries = mechanism.parameters
    _verify_overrides(mechanism, overrides)
    values = {slot("parameters", i): 0.0 for i, entry in enumerate(entries) if entry.value is None}
    for index in evaluation_order(mechanism, overrides):
        name, declared = entries[index].name, entries[index].value
        value = overrides[name] if name in overrides else value_or_nan(declared, values)
        if not math.isfinite(value):
            raise _parameter_error(name, _why_undefined(mechanism, index, values, overrides))
        if entries[index].positive and value <= 0:
            raise _parameter_error(name, f"{name} = {value:g}, but it is declared positive")
        values[slot("parameters", index)] = float(value)
    return [values[slot("parameters", i)] for i in range(len(entries))]


def value_or_nan(expression: Node | None, values: Mapping[Node, float]) -> float:
    """Return the value of an expression, nan where it has none."""
    assert expression is not None
    try:
        return evaluate_float([expression], values)[0]
    except UNDEFINED:
        return math.nan


def _why_undefined(
    mechanism: Mechanism, index: int, values: Mapping[Node, float], overrides: Mapping[str, float]
) -> str:
    """Return why a parameter has no finite value: which part of its expression, with the values of those it names."""
    name, declared = mechanism.parameters[index].name, mechanism.parameters[index].value
    if name in overrides or declared is None:
        return f"{name} has no finite value: {overrides[name]:g} was given"
    symbols = {slot("parameters", k): symbol(entry.name) for k, entry in enumerate(mechanism.parameters)}
    known = {symbols[leaf]: x for leaf, x in values.items()}
    return undefined_text(evaluate([declared], symbols)[0], known, name)


def _parameter_error(name: str, message: str) -> ModelError:
    return ModelError(message, where=Where(path=("parameters", name)), number="M119")


def _verify_overrides(mechanism: Mechanism, overrides: Mapping[str, float]) -> None:
    declared = [entry.name for entry in mechanism.parameters if entry.source is Source.DECLARED]
    for name in overrides:
        if name not in declared:
            raise ModelError(f"no parameter is called {name!r}", number="M106", word=name, known=declared)


def evaluation_order(mechanism: Mechanism, overrides: Mapping[str, float]) -> list[int]:
    """Return the declared parameters' positions, each after those that its expression names. Raises ModelError."""
    needed = [
        [] if entry.value is None or entry.name in overrides else [n.data[1] for n in leaves([entry.value], "slot")]
        for entry in mechanism.parameters
    ]
    done: set[int] = {i for i, entry in enumerate(mechanism.parameters) if entry.value is None}
    order: list[int] = []
    for root in range(len(needed)):
        path = {} if root in done else {root: None}
        while path:
            index = next(reversed(path))
            missing = next((i for i in needed[index] if i not in done), None)
            if missing is None:
                path.popitem()
                order.append(index)
                done.add(index)
            elif missing in path:
                names = [mechanism.parameters[i].name for i in path]
                raise _circle([*names[list(path).index(missing) :], mechanism.parameters[missing].name])
            else:
                path[missing] = None
    return order


def _circle(names: Sequence[str]) -> ModelError:
    return _parameter_error(names[0], f"parameters depend on each other in a circle: {' -> '.join(names)}")
