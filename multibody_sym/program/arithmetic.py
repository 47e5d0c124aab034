"""The operations of Nodes on floats that may be infinite or nan, as C performs them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from multibody_sym.program.floats import (
    acos,
    asin,
    cos,
    cosh,
    divide,
    exp,
    log,
    pow,
    power,
    sign,
    sin,
    sinh,
    sqrt,
    tan,
)
from multibody_sym.scalars.interning import FLOAT_OPERATIONS
from multibody_sym.scalars.node import Node

__all__ = ["OPERATIONS", "integer_exponent", "power"]

_LARGEST_EXPONENT: Final = 2**31


def integer_exponent(node: Node) -> int | None:
    """Return n where `node` is a power x^n that is computed by multiplication, else None."""
    exponent = node.args[1]
    if exponent.op == "number" and isinstance(exponent.data, int) and 0 < exponent.data < _LARGEST_EXPONENT:
        return exponent.data
    return None


OPERATIONS: Final[dict[str, Callable[..., float]]] = FLOAT_OPERATIONS | {
    "div": divide, "pow": pow, "sqrt": sqrt, "sin": sin, "cos": cos, "tan": tan, "asin": asin, "acos": acos,
    "exp": exp, "log": log, "sinh": sinh, "cosh": cosh, "sign": sign,
}
"""Every operation of a Node on floats that may be infinite or nan; `abs`, `min` and `max` are Python's own."""
