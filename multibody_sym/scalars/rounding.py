"""Values of Nodes over floats, each with a bound of its rounding: what is no more than that cannot be told from 0."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from sys import float_info
from typing import Final, NamedTuple

from multibody_sym.scalars.interning import FLOAT_OPERATIONS
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.traversal import postorder

EPSILON: Final = float_info.epsilon
Operation = Callable[..., float]


class Bounded(NamedTuple):
    """A number that is known to within `bound`, to first order."""

    value: float
    bound: float


def bounded(nodes: Iterable[Node], leaf: Mapping[Node, Bounded]) -> list[Bounded]:
    """Return Nodes with bounds of their rounding, given those of their leaves; the bound is inf where there is none."""
    roots = list(nodes)
    found: dict[Node, Bounded] = {}
    for n in postorder(roots):
        if n in leaf:
            found[n] = leaf[n]
        elif n.shadow is not None:
            whole = n.op == "number" and isinstance(n.data, int)
            found[n] = Bounded(n.shadow, 0.0 if whole else EPSILON * abs(n.shadow))
        elif n.args:
            found[n] = _operated(n, [found[a] for a in n.args])
        else:
            found[n] = Bounded(math.nan, math.inf)
    return [found[root] for root in roots]


def _operated(n: Node, operands: list[Bounded]) -> Bounded:
    """Return an operation: its rounding, and by how much it changes where each operand changes by its bound."""
    op, values, operation = n.op, [x.value for x in operands], partial(FLOAT_OPERATIONS[n.op], *n.own)
    try:
        value = operation(*values)
        if op in ("add", "neg"):
            change = sum(x.bound for x in operands)
        elif op == "mul":
            (a, da), (b, db) = operands
            change = abs(a) * db + abs(b) * da
        else:
            change = sum(_change(operation, values, k, x.bound, value) for k, x in enumerate(operands))
    except (ArithmeticError, ValueError):
        return Bounded(math.nan, math.inf)
    return Bounded(value, EPSILON * abs(value) + change)


def _change(operation: Operation, values: list[float], k: int, bound: float, value: float) -> float:
    """Return by how much an operation changes at most where operand k changes by its bound, to either side."""
    if bound == 0.0:
        return 0.0
    sides = ([*values[:k], values[k] + side, *values[k + 1 :]] for side in (bound, -bound))
    return max(abs(operation(*moved) - value) for moved in sides)
