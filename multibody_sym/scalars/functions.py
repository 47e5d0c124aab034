"""Functions that work on every scalar alike: float, Node and sympy expression."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from typing import Any, Final, TypeVar

from multibody_sym.errors import ArgumentError, ExpressionError, UndefinedValueError, short_repr
from multibody_sym.scalars import node as _node
from multibody_sym.scalars.elementary import BUILD, leaves, postorder
from multibody_sym.scalars.node import FLOAT_OPERATIONS, Node, as_node, unbox

S = TypeVar("S")
"""A scalar: float, Node or sympy.Expr. Plain integers are welcome among all three."""


def node_of(value: object) -> Node:
    """Return a number, Node or sympy expression as a Node.

    Raises ArgumentError for everything else, ExpressionError for what has no counterpart in the expression language.
    """
    if not _is_sympy(value):
        return as_node(value)
    from multibody_sym.scalars.sympy_bridge import from_sympy

    node = from_sympy(value)
    for leaf in leaves([node], "symbol"):
        if not _SYMBOL.fullmatch(leaf.data):
            raise ExpressionError(
                f"the symbol {short_repr(leaf.data)} cannot stand in expressions: use letters, digits, _", number="E105"
            )
    return node


_SYMBOL: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_EXACT_AT_INTEGERS: Final = {("sin", 0): 0, ("cos", 0): 1, ("sqrt", 0): 0, ("sqrt", 1): 1}


def apply(op: str, *values: Any, own: tuple[Any, ...] = ()) -> Any:
    """Return the operation `op` (a Node's op, with its `own`) of the values, in the richest scalar among them.

    Raises ArgumentError for what is no scalar, text above all, and UndefinedValueError where there is no real value.
    """
    if any(isinstance(v, Node) for v in values):
        try:
            return BUILD[op](*own, *(as_node(v) for v in values))
        except ArgumentError:
            return BUILD[op](*own, *(node_of(_scalar(op, v)) for v in values))
    if all(isinstance(v, (int, float)) for v in values):
        exact = _EXACT_AT_INTEGERS.get((op, values[0])) if isinstance(values[0], int) else None
        return exact if exact is not None else _of_floats(op, values, own)
    scalars = [_scalar(op, v) for v in values]
    if not any(map(_is_sympy, scalars)):
        return _of_floats(op, scalars, own)
    from multibody_sym.scalars.sympy_bridge import SYMPY_OPERATIONS

    try:
        return SYMPY_OPERATIONS[op](*own, *scalars)
    except (TypeError, ValueError) as problem:
        raise UndefinedValueError(f"{op} has no real value here: {problem}", number="E105") from None


_OF_CONDITIONS: Final = ("where", "min", "max")
"""What takes conditions: these are 1 and 0, so that the lesser of two is both."""


def _of_floats(op: str, values: Iterable[Any], own: tuple[Any, ...]) -> float:
    try:
        return FLOAT_OPERATIONS[op](*own, *values)
    except (ArithmeticError, ValueError):
        listed = ", ".join(map(short_repr, values))
        raise UndefinedValueError(f"{op}({listed}) is not a finite real number", number="E105") from None


def _is_sympy(value: object) -> bool:
    """Return whether a value is a scalar or a condition of sympy's, which is not imported to find that out."""
    if isinstance(value, (int, float, str, Node)) or "sympy" not in sys.modules:
        return False
    from sympy import Expr
    from sympy.logic.boolalg import Boolean

    return isinstance(value, (Expr, Boolean))


def _scalar(op: str, value: Any) -> Any:
    """Return a number as int, float or Fraction, and an expression as it is; raises ArgumentError for all else.

    Nothing that sympy would turn into an expression by reading its text may come past here: reading is running.
    """
    if isinstance(value, Node) or (_is_sympy(value) and (op in _OF_CONDITIONS or hasattr(value, "as_coefficient"))):
        return value
    held = unbox(value)
    if isinstance(held, (int, float, Fraction)):
        return held
    text = ", no text" if isinstance(held, str) else ""
    raise ArgumentError(
        f"{op} takes numbers and expressions{text} (parameters(...) and variable(...) make symbols); "
        f"got {short_repr(held)}"
    )


def sin(a: Any) -> Any:
    """Return sin a, of a in rad.

    Raises InputError for what is no number or expression, and where it has no real value.
    """
    return apply("sin", a)


def cos(a: Any) -> Any:
    """Return cos a, of a in rad.

    Raises InputError for what is no number or expression, and where it has no real value.
    """
    return apply("cos", a)


def tan(a: Any) -> Any:
    """Return tan a, of a in rad.

    Raises InputError for what is no number or expression, and where it has no real value.
    """
    return apply("tan", a)


def asin(a: Any) -> Any:
    """Return the arc sine of a in rad.

    Raises InputError for what is no number or expression, and where it has no real value.
    """
    return apply("asin", a)


def acos(a: Any) -> Any:
    """Return the arc cosine of a in rad.

    Raises InputError for what is no number or expression, and where it has no real value.
    """
    return apply("acos", a)


def atan(a: Any) -> Any:
    """Return the arc tangent of a in rad.

    Raises InputError for what is no number or expression, and where it has no real value.
    """
    return apply("atan", a)


def atan2(y: Any, x: Any) -> Any:
    """Return the angle of the point (x, y) in rad.

    Raises InputError for what is no number or expression, and where it has no real value.
    """
    return apply("atan2", y, x)


def exp(a: Any) -> Any:
    """Return e^a.

    Raises InputError for what is no number or expression, and where it has no real value.
    """
    return apply("exp", a)


def log(a: Any) -> Any:
    """Return the natural logarithm of a.

    Raises InputError for what is no number or expression, and where it has no real value.
    """
    return apply("log", a)


def sqrt(a: Any) -> Any:
    """Return the square root of a.

    Raises InputError for what is no number or expression, and where it has no real value.
    """
    return apply("sqrt", a)


def absolute(a: Any) -> Any:
    """Return |a|.

    Raises InputError for what is no number or expression, and where it has no real value.
    """
    return apply("abs", a)


def sign(a: Any) -> Any:
    """Return -1, 0 or 1.

    Raises InputError for what is no number or expression, and where it has no real value.
    """
    return apply("sign", a)


def minimum(a: Any, b: Any) -> Any:
    """Return the smaller of a and b.

    Raises InputError for what is no number or expression, and where it has no real value.
    """
    return apply("min", a, b)


def maximum(a: Any, b: Any) -> Any:
    """Return the larger of a and b.

    Raises InputError for what is no number or expression, and where it has no real value.
    """
    return apply("max", a, b)


def where(condition: Any, a: Any, b: Any) -> Any:
    """Return a where the condition holds, else b.

    Raises InputError for what is no number or expression, and where it has no real value.
    """
    return apply("where", condition, a, b)


def less(a: Any, b: Any) -> Any:
    """Return the condition a < b."""
    return apply("less", a, b)


def is_exactly(x: Any, value: Any) -> bool:
    """Return whether x is known to be this value; an expression that merely happens to equal it is not."""
    return x is as_node(value) if isinstance(x, Node) else bool(x == value)


def is_zero(x: Any) -> bool:
    """Return whether x is zero, or an expression that is a constant of this value."""
    return bool((x.shadow if isinstance(x, Node) else x) == 0)


def evaluate(nodes: Iterable[Node], leaf: Mapping[Node, Any] | Callable[[Node], Any], scalar: type = Node) -> list[Any]:
    """Return `nodes` over `scalar` (float, Node or sympy.Expr), each leaf replaced by what `leaf` gives for it.

    With Node this is substitution; with float, evaluation; with sympy.Expr, translation (constants stay exact).
    Raises KeyError for a leaf that a mapping does not hold.
    """
    if scalar is float:
        return evaluate_float(nodes, _Looked(leaf) if callable(leaf) else leaf)
    roots = list(nodes)
    find = leaf if callable(leaf) else leaf.__getitem__
    if scalar is not Node:
        from multibody_sym.scalars.sympy_bridge import to_sympy
    values: dict[Node, Any] = {}
    for n in postorder(roots):
        if n.shadow is not None:
            values[n] = n if scalar is Node else to_sympy(n, {})
        elif n.args:
            values[n] = apply(n.op, *(values[a] for a in n.args), own=n.own)
        else:
            values[n] = find(n)
    return [values[n] for n in roots]


def substitute(node: Node, meant: Mapping[Node, Node]) -> Node:
    """Return an expression with others in the place of leaves."""
    return as_node(evaluate([node], lambda leaf: meant.get(leaf, leaf))[0]) if node.args else meant.get(node, node)


class _Looked(dict[Node, float]):
    """A mapping that asks a function for what it does not hold."""

    def __init__(self, find: Callable[[Node], float]) -> None:
        super().__init__()
        self.find = find

    def __missing__(self, key: Node) -> float:
        return self.find(key)


def evaluate_float(nodes: Iterable[Node], leaf: Mapping[Node, float]) -> list[float]:
    """Return the float values of `nodes`, given those of their leaves.

    Of a choice only what is chosen needs a value. Raises ArithmeticError or ValueError where what is needed has none.
    """
    roots = list(nodes)
    values: dict[Node, float] = {}
    stack = []
    for n in reversed(roots):  # most are constants and slots
        if n.shadow is not None:
            values[n] = n.shadow
        elif n.args:
            stack.append(n)
        else:
            values[n] = float(leaf[n])
    while stack:  # as `postorder`, but neither what is below a constant is visited nor what is not chosen
        n = stack[-1]
        if n in values:
            stack.pop()
        elif n.shadow is not None:
            values[n] = n.shadow
        elif not n.args:
            values[n] = float(leaf[n])
        elif n.op == "where" and n.args[0] in values:
            chosen = n.args[1 if values[n.args[0]] else 2]
            if chosen in values:
                values[n] = values[chosen]
            else:
                stack.append(chosen)
        elif wanted := [a for a in (n.args[:1] if n.op == "where" else n.args) if a not in values]:
            stack.extend(wanted[::-1])
        else:
            values[n] = FLOAT_OPERATIONS[n.op](*n.own, *[values[a] for a in n.args])
    return [values[n] for n in roots]


pi = _node.PI
