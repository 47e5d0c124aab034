"""The only door between Nodes and sympy: whitelisted, memoised, exact both ways. sympy is imported when it is used."""

from __future__ import annotations

import copyreg
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import lru_cache
from typing import Any, Final

import sympy

from multibody_sym.errors import ExpressionError
from multibody_sym.scalars.elementary import BUILD, postorder
from multibody_sym.scalars.node import ONE, PI, Node, number, real, symbol
from multibody_sym.scalars.tabulated import Tabulated

_CONDITIONS: Final = (sympy.core.relational.Relational, sympy.And, sympy.Or, type(sympy.true), type(sympy.false))


def _extreme(joined: Callable[..., Any], extreme: Callable[..., Any], a: Any, b: Any) -> Any:
    """Return the least or greatest of two numbers; of two conditions that is what `and` or `or` makes of them."""
    return (joined if isinstance(a, _CONDITIONS) and isinstance(b, _CONDITIONS) else extreme)(a, b)


class _OfTables(type(sympy.Function)):  # type: ignore[misc]
    """The class of classes of tabulated functions, by which `pickle` knows them."""


class TableFunction(sympy.Function, metaclass=_OfTables):  # type: ignore[misc]
    """A tabulated function of one argument, or its derivative of an order, which its class holds as `own`."""

    own: tuple[Tabulated, int]
    nargs = 1
    is_real = True

    def fdiff(self, argindex: int = 1) -> Any:
        function, order = self.own
        return table_function(function, order + 1)(*self.args)

    def _eval_evalf(self, prec: int) -> Any:
        function, order = self.own
        argument = self.args[0].evalf(prec)
        return sympy.Float(function.value(order, float(argument)), prec) if argument.is_Number else None


@lru_cache(maxsize=1024)
def table_function(function: Tabulated, order: int) -> Any:
    """Return a tabulated function, or its derivative of an order, as one of sympy's."""
    if order > function.degree:
        return lambda _: sympy.S.Zero
    return _OfTables(function.called(order), (TableFunction,), {"own": (function, order)})


copyreg.pickle(_OfTables, lambda cls: (table_function, cls.own))


SYMPY_OPERATIONS: Final[dict[str, Callable[..., Any]]] = {
    "neg": lambda a: -a,
    "add": lambda a, b: a + b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "pow": sympy.Pow,
    "sin": sympy.sin, "cos": sympy.cos, "tan": sympy.tan, "asin": sympy.asin, "acos": sympy.acos,
    "atan": sympy.atan, "atan2": sympy.atan2, "sinh": sympy.sinh, "cosh": sympy.cosh, "tanh": sympy.tanh,
    "asinh": sympy.asinh, "acosh": sympy.acosh, "atanh": sympy.atanh,
    "exp": sympy.exp, "log": sympy.log, "sqrt": sympy.sqrt, "abs": sympy.Abs, "sign": sympy.sign,
    "min": lambda a, b: _extreme(sympy.And, sympy.Min, a, b), "max": lambda a, b: _extreme(sympy.Or, sympy.Max, a, b),
    "less": sympy.StrictLessThan,
    "less_equal": sympy.LessThan,
    "where": lambda c, a, b: sympy.Piecewise((a, c), (b, True)),
    "table": lambda function, order, a: table_function(function, order)(a),
}
"""The operations of a Node on sympy expressions."""

_FROM: Final[dict[Any, str]] = {
    sympy.sin: "sin", sympy.cos: "cos", sympy.tan: "tan", sympy.asin: "asin", sympy.acos: "acos",
    sympy.atan: "atan", sympy.atan2: "atan2", sympy.sinh: "sinh", sympy.cosh: "cosh", sympy.tanh: "tanh",
    sympy.asinh: "asinh", sympy.acosh: "acosh", sympy.atanh: "atanh",
    sympy.exp: "exp", sympy.log: "log", sympy.Abs: "abs", sympy.sign: "sign", sympy.Pow: "pow",
    sympy.StrictLessThan: "less", sympy.LessThan: "less_equal", sympy.ITE: "where",
}
_ROOT: Final = 2
_CHAINED: Final[dict[Any, str]] = {
    sympy.Add: "add", sympy.Min: "min", sympy.Max: "max", sympy.And: "min", sympy.Or: "max",
}
"""What takes any number of operands; conditions are 1 and 0."""


def to_sympy(node: Node, leaves: Mapping[Node, Any]) -> Any:
    """Return `node` as a sympy expression; symbols, slots and quantities become what `leaves` holds for them.

    A symbol that `leaves` does not hold becomes `Symbol(name, real=True)`. Raises KeyError for other unknown leaves.
    """
    values: dict[Node, Any] = {}
    for n in postorder([node]):
        if n.args:
            values[n] = SYMPY_OPERATIONS[n.op](*n.own, *(values[a] for a in n.args))
        elif n in leaves:
            values[n] = leaves[n]
        else:
            values[n] = _leaf_to_sympy(n)
    return values[node]


def _leaf_to_sympy(n: Node) -> Any:
    if n.op == "number":
        return sympy.Rational(n.data.numerator, n.data.denominator)
    if n.op == "real":
        return sympy.Float(n.data)
    if n is PI:
        return sympy.pi
    if n.op == "symbol":
        return sympy.Symbol(n.data, real=True)
    raise KeyError(n)


def from_sympy(expression: Any, leaves: Mapping[Any, Node] | None = None) -> Node:
    """Return a sympy expression as a Node; symbols become what `leaves` holds, else the symbol of their name.

    Raises ExpressionError for a function or object that has no counterpart here.
    """
    known = leaves or {}
    values: dict[Any, Node] = {}
    stack = [(expression, False)]
    while stack:
        e, ready = stack.pop()
        if e in values:
            continue
        if e in known or not e.args:
            values[e] = known[e] if e in known else _leaf_from_sympy(e)
        elif ready:
            values[e] = _combine(e, [values[a] for a in _operands(e)])
        else:
            stack.append((e, True))
            stack.extend((a, False) for a in _operands(e))
    return values[expression]


def _operands(e: Any) -> tuple[Any, ...]:
    if isinstance(e, sympy.Piecewise):
        return tuple(part for pair in e.args for part in pair.args)
    return tuple(e.args)


def _combine(e: Any, args: list[Node]) -> Node:
    if isinstance(e, sympy.Mul):
        return _product(args)
    if e.func in _CHAINED:
        return _chain(_CHAINED[e.func], args)
    if isinstance(e, sympy.Piecewise):
        return _piecewise(e, args)
    if isinstance(e, sympy.Not):
        return 1 - args[0]
    if e.func in (sympy.StrictGreaterThan, sympy.GreaterThan):
        return BUILD["less" if e.func is sympy.StrictGreaterThan else "less_equal"](args[1], args[0])
    if isinstance(e, sympy.Pow) and e.exp.is_Rational and (e.exp.is_negative or e.exp.q == _ROOT):
        return _quotient_or_root(args[0], e.exp)
    if isinstance(e, TableFunction):
        return BUILD["table"](*e.own, *args)
    if e.func not in _FROM:
        raise ExpressionError(f"sympy's {e.func.__name__} has no counterpart in the expression language", number="E105")
    return BUILD[_FROM[e.func]](*args)


def _chain(op: str, args: list[Node]) -> Node:
    total = args[0]
    for a in args[1:]:
        total = BUILD[op](total, a)
    return total


def _product(args: list[Node]) -> Node:
    """Return a product with one quotient for all its reciprocals."""
    below = [a.args[1] for a in args if a.op == "div" and a.args[0] is ONE]
    above = [a for a in args if not (a.op == "div" and a.args[0] is ONE)]
    numerator = _chain("mul", above) if above else ONE
    return BUILD["div"](numerator, _chain("mul", below)) if below else numerator


def _quotient_or_root(base: Node, exponent: Any) -> Node:
    """Return base^exponent by division and square root, which cost less than a general power and round better."""
    if exponent.is_negative:
        return BUILD["div"](number(1), _quotient_or_root(base, -exponent))
    if exponent.q == _ROOT:
        return BUILD["pow"](BUILD["sqrt"](base), number(int(exponent.p)))
    return BUILD["pow"](base, number(Fraction(int(exponent.p), int(exponent.q))))


def _piecewise(e: Any, args: list[Node]) -> Node:
    if e.args[-1].cond is not sympy.true:
        raise ExpressionError("a Piecewise needs a last piece that always holds", number="E105")
    value = args[-2]
    for k in range(len(e.args) - 2, -1, -1):
        value = BUILD["where"](args[2 * k + 1], args[2 * k], value)
    return value


def _leaf_from_sympy(e: Any) -> Node:
    if isinstance(e, sympy.Symbol):
        return symbol(e.name)
    if isinstance(e, sympy.Rational):
        return number(Fraction(int(e.p), int(e.q)))
    if isinstance(e, sympy.Float):
        return real(float(e))
    if e is sympy.pi:
        return PI
    if e is sympy.E:
        return BUILD["exp"](number(1))
    if e in (sympy.true, sympy.false):
        return number(int(bool(e)))
    raise ExpressionError(f"{e} has no counterpart in the expression language", number="E105")
