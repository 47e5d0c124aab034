"""Node: the immutable, hash-consed scalar expression that models are declared in and programs are made of.

Two Nodes are equal exactly when they are the same object, whichever threads made them. Constants from text are exact
Fractions; operands of `+` and `*` stand in an order that depends on structure only, never on names' hashes, addresses
or history.
"""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Callable, Hashable, Iterable, Iterator
from fractions import Fraction
from sys import getrefcount
from threading import RLock
from typing import Any, Final

from multibody_sym.errors import ArgumentError, ExpressionError, shown

Exact = int | Fraction
_NUMBERS: Final = frozenset({"number", "real"})
_EXACT_BITS: Final = 256
_HELD_BY_ONE: Final = 2  # the reference of a table or list and the argument of getrefcount
_LARGEST_FACTORED: Final = 10**12
_LARGEST_DIVISOR: Final = 1000
_SMALLEST_LIMIT: Final = 200_000
_table: dict[tuple[Any, ...], Node] = {}
_limit = [_SMALLEST_LIMIT]
_changing = RLock()
"""Held while the table changes (it is read without): a finaliser or signal handler may come back here meanwhile."""
if hasattr(os, "register_at_fork"):  # a child must not inherit a lock that a thread holds which it has not
    os.register_at_fork(
        before=_changing.acquire, after_in_parent=_changing.release, after_in_child=_changing.release
    )


class Node:
    """A scalar expression: `op`, operands `args`, and for leaves `data`.

    Leaves: `number` (int or Fraction), `real` (float), `pi`, `symbol` (a name of the model), `declared` (a symbol that
    carries its declaration), `slot` ((array, index): an element of a program's input or a temporary), `quantity`
    ((function, names): asked of the moving system, such as `reaction(C, fx)`). `key` orders operands; `shadow` is the
    float value of a constant expression, else None.
    """

    __slots__ = ("args", "data", "key", "op", "shadow")

    op: str
    args: tuple[Node, ...]
    data: Any
    key: int
    shadow: float | None

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError("a Node never changes")

    def __copy__(self) -> Node:
        return self

    def __deepcopy__(self, memo: object) -> Node:
        return self

    def __repr__(self) -> str:
        if self.op in ("number", "real", "symbol"):
            return str(self.data)
        if self.op == "declared":
            return str(self.data[0])
        if self.op == "slot":
            return f"{self.data[0]}[{self.data[1]}]"
        if self.op == "quantity":
            return f"{self.data[0]}({', '.join(self.data[1])})"
        return f"{self.op}({', '.join(map(repr, self.args))})" if self.args else self.op

    def __bool__(self) -> bool:
        if self.op in ("less", "less_equal"):
            raise ArgumentError("the truth of a comparison of expressions is not known; use where(condition, a, b)")
        return True

    def __add__(self, other: object) -> Node:
        return add(self, other) if isinstance(other, Node) else _binary(add, self, other)

    def __radd__(self, other: object) -> Node:
        return _binary(add, other, self)

    def __sub__(self, other: object) -> Node:
        return subtract(self, other) if isinstance(other, Node) else _binary(subtract, self, other)

    def __rsub__(self, other: object) -> Node:
        return _binary(subtract, other, self)

    def __mul__(self, other: object) -> Node:
        return multiply(self, other) if isinstance(other, Node) else _binary(multiply, self, other)

    def __rmul__(self, other: object) -> Node:
        return _binary(multiply, other, self)

    def __truediv__(self, other: object) -> Node:
        return divide(self, other) if isinstance(other, Node) else _binary(divide, self, other)

    def __rtruediv__(self, other: object) -> Node:
        return _binary(divide, other, self)

    def __pow__(self, other: object) -> Node:
        return _binary(power, self, other)

    def __rpow__(self, other: object) -> Node:
        return _binary(power, other, self)

    def __neg__(self) -> Node:
        return negate(self)

    def __pos__(self) -> Node:
        return self

    def __lt__(self, other: object) -> Node:
        return _binary(less, self, other)

    def __le__(self, other: object) -> Node:
        return _binary(less_equal, self, other)

    def __gt__(self, other: object) -> Node:
        return _binary(less, other, self)

    def __ge__(self, other: object) -> Node:
        return _binary(less_equal, other, self)


def _binary(operation: Callable[[Node, Node], Node], a: object, b: object) -> Node:
    try:
        left, right = as_node(a), as_node(b)
    except ArgumentError:
        if any(str(type(x).__module__).startswith("sympy.") for x in (a, b)):  # which would look for a meaning
            raise ArgumentError("expressions of sympy and of multibody_sym do not mix: write it all in one") from None
        return NotImplemented  # type: ignore[no-any-return]
    return operation(left, right)


def as_node(value: object) -> Node:
    """Return `value` as a Node: a Node, int, Fraction or float (read as the decimal it prints as).

    Raises ArgumentError for everything else, strings and bools included, and ExpressionError for nan and inf.
    """
    if isinstance(value, Node):
        return value
    if value.__class__ is int and value in _SMALL:
        return _SMALL[value]
    if isinstance(value, (int, Fraction)) and not isinstance(value, bool):
        return number(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ExpressionError(f"{value} is not a finite number")
        return number(Fraction(repr(float(value))))
    held = unboxed(value)
    if held is not value:
        return as_node(held)
    raise ArgumentError(f"{shown(value)} is not a number or an expression")


def unboxed(value: Any) -> Any:
    """Return what an array without dimensions or a number of NumPy's holds, and everything else as it is."""
    item = getattr(value, "item", None)
    if not callable(item) or getattr(value, "ndim", None) != 0:
        return value
    held = item()
    return float(held) if type(held) is type(value) and hasattr(held, "is_integer") else held  # a long double


# --- leaves -----------------------------------------------------------------------------------------------------


def number(value: Exact) -> Node:
    """Return the exact constant `value`."""
    if isinstance(value, Fraction) and value.denominator == 1:
        value = value.numerator
    return _intern("number", (), value)


def real(value: float) -> Node:
    """Return the floating-point constant `value`, which must be finite."""
    if not math.isfinite(value):
        raise ExpressionError(f"{value} is not a finite number")
    return _intern("real", (), float(value))


def symbol(name: str) -> Node:
    """Return the leaf that stands for the model's parameter, coordinate, speed, input or time called `name`."""
    return _intern("symbol", (), name)


def symbol_with(name: str, declaration: Hashable) -> Node:
    """Return a symbol that brings its declaration along until a system takes it in (see `model.system`)."""
    return _intern("declared", (), (name, declaration))


def slot(array: str, index: int) -> Node:
    """Return the leaf that stands for element `index` of a program's input or temporary `array`."""
    return _intern("slot", (), (array, index))


def quantity(function: str, names: Iterable[str]) -> Node:
    """Return the leaf that stands for a quantity of the moving system, such as `position(rod.pin, x)`."""
    return _intern("quantity", (), (function, tuple(names)))


# --- construction -----------------------------------------------------------------------------------------------

_OPERATIONS: Final = (
    "number real pi symbol declared slot quantity neg add mul div pow sin cos tan asin acos atan atan2 sinh cosh tanh "
    "exp log sqrt abs sign min max less less_equal where"
).split()
_CODE: Final = {name: code for code, name in enumerate(_OPERATIONS, 1)}
_set_op, _set_args, _set_data, _set_key, _set_shadow = (
    vars(Node)[name].__set__ for name in ("op", "args", "data", "key", "shadow")
)


def _intern(op: str, args: tuple[Node, ...], data: Any = None) -> Node:
    identity = (op, data, args)
    found = _table.get(identity)
    if found is not None:
        return found
    node = object.__new__(Node)
    _set_op(node, op)
    _set_args(node, args)
    _set_data(node, data)
    if len(args) == 2:  # most are, and this function makes every Node
        key = hash((_CODE[op], args[0].key, args[1].key))
    else:
        key = hash((_CODE[op], *[a.key for a in args])) if args else hash((_CODE[op], _data_key(data)))
    _set_key(node, key)
    _set_shadow(node, None if args and args[-1].shadow is None else _shadow(op, args, data))
    with _changing:
        if len(_table) >= _limit[0]:
            _forget_unused()
        return _table.setdefault(identity, node)  # another thread's, if it was first


def _forget_unused() -> None:
    """Drop the Nodes that only the table holds: newest first, so that operands go after what used them.

    What another thread finds in the table just before it leaves it goes back; until then that thread's equals wait.
    """
    stack = list(_table)
    while stack:
        identity = stack.pop()
        if getrefcount(_table[identity]) == _HELD_BY_ONE:
            taken = [_table.pop(identity)]
            if getrefcount(taken[0]) != _HELD_BY_ONE:
                _table[identity] = taken[0]
            taken.clear()  # else it would hold its operands, whose turn is next
    _limit[0] = max(_SMALLEST_LIMIT, 2 * len(_table))


def _data_key(data: Any) -> int:
    """Return an integer that depends on `data` only: str hashes change with every process, those of numbers do not."""
    if data is None:
        return 0
    if isinstance(data, (int, float, Fraction)):
        return hash(data)
    text = data if isinstance(data, str) else repr(data if isinstance(data[1], (int, tuple)) else data[0])
    return int.from_bytes(text.encode("utf-8", "surrogatepass"), "big") % ((1 << 61) - 1)


def _shadow(op: str, args: tuple[Node, ...], data: Any) -> float | None:
    if not args:
        if op == "pi":
            return math.pi
        return _float(data) if op in ("number", "real") else None
    for a in args:
        if a.shadow is None:
            return None
    return _constant_value(op, [a.shadow for a in args if a.shadow is not None])


def _constant_value(op: str, values: list[float]) -> float:
    try:
        result = float(FLOAT_OPERATIONS[op](*values))
    except (ArithmeticError, ValueError):
        result = math.nan
    if not math.isfinite(result):
        shown = ", ".join(f"{v:g}" for v in values)
        raise ExpressionError(f"{_SHOWN.get(op, op)}({shown}) is not a finite real number")
    return result


def _float(value: Exact | float) -> float:
    try:
        return float(value)
    except OverflowError:
        raise ExpressionError("a constant is too large for a floating-point number") from None


def _number_or_real(value: Exact) -> Node:
    """Return the constant exactly, or as a float once its digits have outgrown every use."""
    big = value.numerator.bit_length() > _EXACT_BITS or value.denominator.bit_length() > _EXACT_BITS
    return real(_float(value)) if big else number(value)


def _constant(op: Callable[[Any, Any], Any], a: Node, b: Node) -> Node:
    """Return the operation of two constants, exactly where both are exact."""
    if a.op == "number" and b.op == "number":
        return _number_or_real(op(a.data, b.data))
    return real(op(float(a.data), float(b.data)))


def add(a: Node, b: Node) -> Node:
    """Return a + b; signs are pulled outward, so a + (-b) prints as a difference."""
    if a is ZERO:
        return b
    if b is ZERO:
        return a
    if a.op in _NUMBERS and b.op in _NUMBERS:
        return _constant(operator.add, a, b)
    if a is b:
        return multiply(TWO, a)
    if a.op == "neg":
        if a.args[0] is b:
            return ZERO
        if b.op == "neg":
            return negate(add(a.args[0], b.args[0]))
        return add(b, a)
    if b.op == "neg":
        return ZERO if b.args[0] is a else _difference(a, b)
    if a.op == "pow" and b.op == "pow" and _is_circle(a, b):
        return ONE
    if a.shadow is not None and b.shadow is not None and (total := _surds_added(a, b)) is not None:
        return total
    return _intern("add", (a, b) if a.key <= b.key else (b, a))


def _difference(a: Node, b: Node) -> Node:
    """Return a + b for b = -c."""
    first, second = (_surd(a), _surd(b.args[0])) if a.shadow is not None and b.shadow is not None else (None, None)
    if first is None or second is None or first[1] != second[1]:
        return _intern("add", (a, b))
    return multiply(number(first[0] - second[0]), sqrt(number(first[1])))


def _surds_added(a: Node, b: Node) -> Node | None:
    """Return the sum of c sqrt(n) and d sqrt(n) for the same n, None for all else."""
    first, second = _surd(a), _surd(b)
    if first is None or second is None or first[1] != second[1]:
        return None
    return multiply(number(first[0] + second[0]), sqrt(number(first[1])))


def _is_circle(a: Node, b: Node) -> bool:
    """Return whether a + b is sin^2 x + cos^2 x."""
    x, y = a.args[0], b.args[0]
    return a.args[1] is b.args[1] is TWO and {x.op, y.op} == {"sin", "cos"} and x.args == y.args


def subtract(a: Node, b: Node) -> Node:
    """Return a - b."""
    return ZERO if a is b else add(a, negate(b))


def negate(a: Node) -> Node:
    """Return -a."""
    if a.op == "neg":
        return a.args[0]
    if a.op == "number":
        return number(-a.data)
    if a.op == "real":
        return real(-a.data)
    return _intern("neg", (a,))


def multiply(a: Node, b: Node) -> Node:
    """Return a b; a constant factor stands first, and x x is x^2."""
    if b.op in _NUMBERS:
        return _scaled(b, a)
    if a.op in _NUMBERS:
        return _scaled(a, b)
    if a.op == "neg":
        return negate(multiply(a.args[0], b))
    if b.op == "neg":
        return negate(multiply(a, b.args[0]))
    if a is b:
        return power(a, TWO)
    if a.op == b.op == "sqrt" and a.args[0].op == b.args[0].op == "number":
        return sqrt(multiply(a.args[0], b.args[0]))
    if b.op == "mul" and b.args[0].op in _NUMBERS:
        return multiply(b.args[0], multiply(b.args[1], a))
    if a.op == "mul" and a.args[0].op in _NUMBERS:
        return multiply(a.args[0], multiply(a.args[1], b))
    return _intern("mul", (a, b) if a.key <= b.key else (b, a))


def _scaled(factor: Node, b: Node) -> Node:
    if factor is ZERO or b is ZERO:
        return ZERO
    if factor is ONE:
        return b
    if b.op in _NUMBERS:
        return _constant(operator.mul, factor, b)
    if factor.data < 0:
        return negate(_scaled(negate(factor), b))
    if b.op == "neg":
        return negate(_scaled(factor, b.args[0]))
    if b.op == "mul" and b.args[0].op in _NUMBERS:
        return multiply(multiply(factor, b.args[0]), b.args[1])
    return _intern("mul", (factor, b))


def divide(a: Node, b: Node) -> Node:
    """Return a / b; division by a constant becomes a constant factor."""
    if b.shadow == 0:
        raise ExpressionError("division by zero")
    if b.op == "number":
        return multiply(number(Fraction(1, 1) / b.data), a)
    if b.op == "real":
        return multiply(real(1.0 / b.data), a)
    if a is ZERO:
        return ZERO
    if a is b:
        return ONE
    if a.op == "neg":
        return negate(divide(a.args[0], b))
    if b.op == "neg":
        return negate(divide(a, b.args[0]))
    if a.shadow is not None and (root := _surd(b)) is not None:
        return multiply(number(1 / (root[0] * root[1])), multiply(a, sqrt(number(root[1]))))
    return _intern("div", (a, b))


def _surd(a: Node) -> tuple[Fraction, int] | None:
    """Return (c, n) of a constant c sqrt(n), None for anything else."""
    factor, root = a.args if a.op == "mul" else (ONE, a)
    if factor.op != "number" or root.op != "sqrt" or not isinstance(root.args[0].data, int):
        return None
    return Fraction(factor.data), root.args[0].data


def power(a: Node, b: Node) -> Node:
    """Return a^b."""
    if b is ZERO:
        return ONE
    if b is ONE:
        return a
    if a is ONE:
        return ONE
    if b.op == "number":
        if isinstance(b.data, int):
            return _integer_power(a, b.data)
        if b.data == Fraction(1, 2):
            return sqrt(a)
    if a is ZERO and b.shadow is not None and b.shadow > 0:
        return ZERO
    return _intern("pow", (a, b))


def _integer_power(a: Node, n: int) -> Node:
    if a.op == "number":
        if abs(n) * a.data.numerator.bit_length() > 4096 or abs(n) * a.data.denominator.bit_length() > 4096:
            return real(_constant_value("pow", [_float(a.data), float(n)]))
        if a is ZERO and n < 0:
            raise ExpressionError("division by zero")
        return _number_or_real(Fraction(a.data) ** n)
    if n < 0:
        return divide(ONE, _integer_power(a, -n))
    if a.op == "neg":
        inner = power(a.args[0], number(n))
        return inner if n % 2 == 0 else negate(inner)
    if a.op == "pow" and a.args[1].op == "number" and isinstance(a.args[1].data, int):
        return power(a.args[0], number(a.args[1].data * n))
    if a.op == "sqrt" and n == 2:
        return a.args[0]
    if a.shadow is not None and (root := _surd(a)) is not None:
        whole = multiply(_integer_power(number(root[0]), n), _integer_power(number(root[1]), n // 2))
        return multiply(whole, sqrt(number(root[1]))) if n % 2 else whole
    return a if n == 1 else _intern("pow", (a, number(n)))


# --- functions --------------------------------------------------------------------------------------------------


def _unary(op: str, a: Node) -> Node:
    if a.op == "real":
        return real(_constant_value(op, [a.data]))
    return _intern(op, (a,))


def _odd(op: str, a: Node) -> Node:
    if a is ZERO:
        return ZERO
    if a.op == "neg":
        return negate(_odd(op, a.args[0]))
    if a.op in ("number", "real") and a.data < 0:
        return negate(_odd(op, negate(a)))
    return _unary(op, a)


def _turns(a: Node) -> Fraction | None:
    """Return a / pi where `a` is a rational multiple of pi."""
    if a is PI:
        return Fraction(1)
    if a.op == "mul" and a.args[1] is PI and a.args[0].op == "number":
        return Fraction(a.args[0].data)
    return None


_SINES: Final[dict[Fraction, Exact]] = {
    Fraction(k, 6): Fraction(v, 2) for k, v in ((0, 0), (1, 1), (3, 2), (5, 1), (6, 0), (7, -1), (9, -2), (11, -1))
}


def sin(a: Node) -> Node:
    """Return sin a, exactly at the rational multiples of pi where it is rational."""
    if a.op == "neg":
        return negate(sin(a.args[0]))
    turns = _turns(a)
    if turns is not None and turns % 2 in _SINES:
        return number(_SINES[turns % 2])
    return _odd("sin", a)


def cos(a: Node) -> Node:
    """Return cos a, exactly at the rational multiples of pi where it is rational."""
    if a is ZERO:
        return ONE
    if a.op == "neg":
        return cos(a.args[0])
    turns = _turns(a)
    if turns is not None and (turns + Fraction(1, 2)) % 2 in _SINES:
        return number(_SINES[(turns + Fraction(1, 2)) % 2])
    if a.op in ("number", "real") and a.data < 0:
        return cos(negate(a))
    return _unary("cos", a)


def sqrt(a: Node) -> Node:
    """Return the square root of `a`, exactly where `a` is the square of a rational."""
    if a.op == "number" and a.data >= 0:
        roots = math.isqrt(a.data.numerator), math.isqrt(a.data.denominator)
        if roots[0] ** 2 == a.data.numerator and roots[1] ** 2 == a.data.denominator:
            return number(Fraction(*roots))
        outside, inside = _square_part(a.data.numerator * a.data.denominator)
        if inside < _LARGEST_FACTORED and (outside != 1 or a.data.denominator != 1):
            return multiply(number(Fraction(outside, a.data.denominator)), _intern("sqrt", (number(inside),)))
    if a.op == "pow" and a.args[1] is TWO:
        return absolute(a.args[0])
    return _unary("sqrt", a)


def _square_part(n: int) -> tuple[int, int]:
    """Return (s, r) with n = s^2 r, r without small squares; (1, n) for what is too large to be looked at."""
    outside, k = 1, 2
    while n < _LARGEST_FACTORED and k * k <= n and k < _LARGEST_DIVISOR:
        if n % (k * k) == 0:
            outside, n = outside * k, n // (k * k)
        else:
            k += 1
    return outside, n


def absolute(a: Node) -> Node:
    """Return |a|."""
    if a.op == "number":
        return number(abs(a.data))
    if a.op in ("neg", "abs"):
        return absolute(a.args[0]) if a.op == "neg" else a
    return _unary("abs", a)


def sign(a: Node) -> Node:
    """Return -1, 0 or 1."""
    if a.shadow is not None:
        return number((a.shadow > 0) - (a.shadow < 0))
    if a.op == "neg":
        return negate(sign(a.args[0]))
    return _intern("sign", (a,))


def exp(a: Node) -> Node:
    """Return e^a."""
    return ONE if a is ZERO else _unary("exp", a)


def log(a: Node) -> Node:
    """Return the natural logarithm of a."""
    return ZERO if a is ONE else _unary("log", a)


def acos(a: Node) -> Node:
    """Return the arc cosine of a."""
    return ZERO if a is ONE else _unary("acos", a)


def cosh(a: Node) -> Node:
    """Return the hyperbolic cosine of a."""
    return ONE if a is ZERO else _unary("cosh", a)


def atan2(y: Node, x: Node) -> Node:
    """Return the angle of the point (x, y)."""
    if y.op == "real" and x.op == "real":
        return real(math.atan2(y.data, x.data))
    if y is ZERO and x.shadow is not None and x.shadow > 0:
        return ZERO
    return _intern("atan2", (y, x))


def _extreme(op: str, a: Node, b: Node) -> Node:
    if a is b:
        return a
    if a.shadow is not None and b.shadow is not None:
        return a if FLOAT_OPERATIONS[op](a.shadow, b.shadow) == a.shadow else b
    return _intern(op, (a, b) if a.key <= b.key else (b, a))


def minimum(a: Node, b: Node) -> Node:
    """Return the smaller of a and b."""
    return _extreme("min", a, b)


def maximum(a: Node, b: Node) -> Node:
    """Return the larger of a and b."""
    return _extreme("max", a, b)


def less(a: Node, b: Node) -> Node:
    """Return the condition a < b (1 or 0 as a number)."""
    return _intern("less", (a, b))


def less_equal(a: Node, b: Node) -> Node:
    """Return the condition a <= b (1 or 0 as a number)."""
    return _intern("less_equal", (a, b))


def where(condition: Node, a: Node, b: Node) -> Node:
    """Return a where the condition holds, else b."""
    if condition.shadow is not None:
        return a if condition.shadow else b
    return a if a is b else _intern("where", (condition, a, b))


def _float_where(condition: float, a: float, b: float) -> float:
    return a if condition else b


def _float_power(a: float, b: float) -> float:
    return math.pow(a, b)


FLOAT_OPERATIONS: Final[dict[str, Callable[..., float]]] = {
    "neg": lambda a: -a,
    "add": lambda a, b: a + b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "pow": _float_power,
    "sin": math.sin, "cos": math.cos, "tan": math.tan, "asin": math.asin, "acos": math.acos, "atan": math.atan,
    "atan2": math.atan2, "sinh": math.sinh, "cosh": math.cosh, "tanh": math.tanh, "exp": math.exp, "log": math.log,
    "sqrt": math.sqrt, "abs": abs, "min": min, "max": max,
    "sign": lambda a: float((a > 0) - (a < 0)),
    "less": lambda a, b: float(a < b),
    "less_equal": lambda a, b: float(a <= b),
    "where": _float_where,
}

BUILD: Final[dict[str, Callable[..., Node]]] = {
    "neg": negate, "add": add, "mul": multiply, "div": divide, "pow": power, "sin": sin, "cos": cos,
    "tan": lambda a: _odd("tan", a), "asin": lambda a: _odd("asin", a), "acos": acos, "atan": lambda a: _odd("atan", a),
    "atan2": atan2, "sinh": lambda a: _odd("sinh", a), "cosh": cosh, "tanh": lambda a: _odd("tanh", a), "exp": exp,
    "log": log, "sqrt": sqrt, "abs": absolute, "sign": sign, "min": minimum, "max": maximum, "less": less,
    "less_equal": less_equal, "where": where,
}
_SHOWN: Final = {"neg": "-", "pow": "power", "add": "sum", "mul": "product", "div": "quotient"}

ZERO: Final = number(0)
ONE: Final = number(1)
TWO: Final = number(2)
_SMALL: Final[dict[object, Node]] = {n: number(n) for n in range(-2, 5)}
PI: Final = _intern("pi", ())


# --- traversal --------------------------------------------------------------------------------------------------


def postorder(roots: Iterable[Node]) -> Iterator[Node]:
    """Yield every Node below `roots` once, operands before the expressions that use them (no recursion)."""
    seen: set[Node] = set()
    stack: list[tuple[Node, bool]] = []
    for root in roots:
        stack.append((root, False))
        while stack:
            node, ready = stack.pop()
            if ready:
                yield node
            elif node not in seen:
                seen.add(node)
                stack.append((node, True))
                stack.extend((a, False) for a in reversed(node.args) if a not in seen)


def leaves(roots: Iterable[Node], *ops: str) -> list[Node]:
    """Return the leaves below `roots` whose op is one of `ops`, in the order in which they are met."""
    return [node for node in postorder(roots) if node.op in ops]


def flatten(op: str, node: Node) -> list[Node]:
    """Return the operands of a nested `op`, left to right, as one list."""
    operands, stack = [], [node]
    while stack:
        top = stack.pop()
        if top.op == op:
            stack.extend(reversed(top.args))
        else:
            operands.append(top)
    return operands
