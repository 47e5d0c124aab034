"""The operations of Nodes on floats that may be infinite or nan, as C performs them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, MutableMapping
from typing import Final

from multibody_sym.program.floats import acos, asin, cos, cosh, divide, exp, log, pow, power, sign, sin, sinh, sqrt, tan
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import FLOAT_OPERATIONS, Node

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


# ----------------------------------------------------------------------------------------------------------------------
# Infix: prints the operations of an Assign as one expression of a language, with no parenthesis too many.


PRODUCTS: Final = (2, 3)
"""Exponents that are written as products of the operand, which must be an atom for it."""
_SUM: Final = 1
_PRODUCT: Final = 2
_ATOM: Final = 3


@dataclass(frozen=True)
class Language:
    """How a language writes what differs: names of functions, a choice, a comparison as a number, a truth.

    `functions` maps an operation to the name of its function where that is not the operation's own; `choice` has the
    fields condition, yes and no; `power`, for an integer n that is not written as a product, x and n; `truth`, for a
    number that serves as a condition, x. Division is an operator unless `functions` has a name for it. `table` returns
    the text of a tabulated function, or its derivative of an order, of x.
    """

    functions: Mapping[str, str]
    choice: str
    power: str
    truth: str
    table: Callable[..., str]


_COMPARISONS: Final = {"less": "<", "less_equal": "<="}


def expression(nodes: tuple[Node, ...], names: MutableMapping[Node, str], language: Language) -> str:
    """Return the text of the last of `nodes` with the others inline; `names` holds the text of every atom.

    The order of operations is that of the Nodes, so that the result is the same to the last bit.
    """
    levels: dict[Node, int] = {}
    for node in nodes:
        op = node.op
        if op == "mul":
            a, b = node.args
            left = f"({names[a]})" if a in levels and levels[a] < _PRODUCT else names[a]
            names[node] = f"{left}*({names[b]})" if b in levels and levels[b] < _ATOM else f"{left}*{names[b]}"
            levels[node] = _PRODUCT
        elif op == "add":
            a, b = node.args
            sign, b = ("-", b.args[0]) if b.op == "neg" and b in levels else ("+", b)
            right = f"({names[b]})" if b in levels and levels[b] < _PRODUCT else names[b]
            names[node] = f"{names[a]} {sign} {right}"
            levels[node] = _SUM
        else:
            names[node], levels[node] = _rarer(node, names, levels, language)
    return names[nodes[-1]]


def _operand(node: Node, least: int, names: Mapping[Node, str], levels: Mapping[Node, int]) -> str:
    text = names[node]
    return text if levels.get(node, _ATOM) >= least else f"({text})"


def _rarer(node: Node, names: Mapping[Node, str], levels: Mapping[Node, int], language: Language) -> tuple[str, int]:
    op, args = node.op, node.args
    if op == "neg":
        return "-" + _operand(args[0], _ATOM, names, levels), _PRODUCT
    if op == "div" and op not in language.functions:
        return f"{_operand(args[0], _PRODUCT, names, levels)}/{_operand(args[1], _ATOM, names, levels)}", _PRODUCT
    if op == "where":
        compared = args[0] in levels and args[0].op in _COMPARISONS
        condition = _comparison(args[0], names) if compared else language.truth.format(x=names[args[0]])
        return language.choice.format(condition=condition, yes=names[args[1]], no=names[args[2]]), _ATOM
    if op == "table":
        return language.table(*node.own, names[args[0]]), _ATOM
    if op in _COMPARISONS:
        return language.choice.format(condition=_comparison(node, names), yes="1.0", no="0.0"), _ATOM
    exponent = integer_exponent(node) if op == "pow" else None
    if exponent is None:
        return f"{language.functions.get(op, op)}({', '.join(names[a] for a in args)})", _ATOM
    if exponent in PRODUCTS and args[0] not in levels:
        return "*".join([names[args[0]]] * exponent), _PRODUCT
    return language.power.format(x=names[args[0]], n=exponent), _ATOM


def _comparison(node: Node, names: Mapping[Node, str]) -> str:
    return f"{names[node.args[0]]} {_COMPARISONS[node.op]} {names[node.args[1]]}"


class Texts(dict[Node, str]):
    """The text of every Node that has one by now; constants are written as floats that read back the same."""

    def __missing__(self, node: Node) -> str:
        if node.shadow is None:
            raise KeyError(node)
        return repr(node.shadow)
