"""Expressions without a finite value: which part has none, and with which values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from multibody_sym.errors import ExpressionError
from multibody_sym.expressions.printer import text
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.traversal import leaves, postorder

ARITHMETIC: Final = (ArithmeticError, ValueError, ExpressionError)
"""What arithmetic raises; numpy raises ValueErrors where it meets infinities."""
_SHOWN: Final = 60


def value_or_none(node: Node, known: Mapping[Node, float]) -> float | None:
    """Return the value of an expression; None where it has none, or names what is not known."""
    try:
        return evaluate_float([node], known)[0]
    except (*ARITHMETIC, KeyError):
        return None


def undefined_text(node: Node, known: Mapping[Node, float], name: str | None = None) -> str:
    """Return what of an expression, or of what has it and a name, has no finite value, and with which values."""
    told = _brief(node) if name is None else name
    for n in postorder([node]):
        found = n.shadow if n.shadow is not None else known.get(n) if not n.args else value_or_none(n, known)
        if found is None or not math.isfinite(found):
            named = [f"{leaf} = {known[leaf]:g}" for leaf in leaves([n], "symbol")]
            part = "" if n is node and name is None else f", for {_brief(n)} has none"
            return f"{told} has no finite value{part}{' with ' * bool(named)}{', '.join(named)}"
    return f"{told} has no finite value"


def _brief(node: Node) -> str:
    shown = text(node)
    return shown if len(shown) <= _SHOWN else f"{shown[:_SHOWN]}..."
