"""Node: the immutable, hash-consed scalar expression that models are declared in and programs are made of.

Constants from text are exact Fractions. Constructors fold constants and the rules of 0 and 1, and pull signs outward.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Hashable, Iterable
from fractions import Fraction
from typing import Any, Final

from multibody_sym.errors import ArgumentError, ExpressionError, shown
from multibody_sym.scalars.interning import Interned, constant_value, finite_float, in_order, intern, intern_slots
from multibody_sym.scalars.plain_numbers import unboxed

Exact = int | Fraction
_NUMBERS: Final = frozenset({"number", "real"})
_EXACT_BITS: Final = 256
_LARGEST_FACTORED: Final = 10**12
_LARGEST_DIVISOR: Final = 1000


class Node(Interned):
    """A scalar expression with its operators; see `Interned` for what it holds."""

    __slots__ = ()

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
    """Return `value` as a Node: a Node, int, Fraction, Decimal or float (read as the decimal it prints as).

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
            raise ExpressionError(f"{value} is not a finite number", number="E105")
        return number(Fraction(repr(float(value))))
    held = unboxed(value)
    if held is not value:
        return as_node(held)
    raise ArgumentError(f"{shown(value)} is not a number or an expression")


# --- leaves -----------------------------------------------------------------------------------------------------


def number(value: Exact) -> Node:
    """Return the exact constant `value`."""
    if isinstance(value, Fraction) and value.denominator == 1:
        value = value.numerator
    return intern(Node, "number", (), value)


def real(value: float) -> Node:
    """Return the floating-point constant `value`, which must be finite."""
    if not math.isfinite(value):
        raise ExpressionError(f"{value} is not a finite number", number="E105")
    return intern(Node, "real", (), float(value))


def symbol(name: str) -> Node:
    """Return the leaf that stands for the model's parameter, coordinate, speed, input or time called `name`."""
    return intern(Node, "symbol", (), name)


def symbol_with(name: str, declaration: Hashable) -> Node:
    """Return a symbol that brings its declaration along until a system takes it in (see `model.system`)."""
    return intern(Node, "declared", (), (name, declaration))


def slot(array: str, index: int) -> Node:
    """Return the leaf that stands for element `index` of a program's input or temporary `array`."""
    return intern(Node, "slot", (), (array, index))


def slots(array: str, count: int, begin: int = 0) -> tuple[Node, ...]:
    """Return the leaves that stand for `count` elements of an array, one after the other, from one on."""
    return tuple(intern_slots(Node, array, begin, begin + count))


def quantity(function: str, names: Iterable[str]) -> Node:
    """Return the leaf that stands for a quantity of the moving system, such as `position(rod.pin, x)`."""
    return intern(Node, "quantity", (), (function, tuple(names)))


# --- arithmetic -------------------------------------------------------------------------------------------------


def _number_or_real(value: Exact) -> Node:
    """Return the constant exactly, or as a float once its digits have outgrown every use."""
    big = value.numerator.bit_length() > _EXACT_BITS or value.denominator.bit_length() > _EXACT_BITS
    return real(finite_float(value)) if big else number(value)


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
    return intern(Node, "add", in_order(a, b))


def _difference(a: Node, b: Node) -> Node:
    """Return a + b for b = -c."""
    first, second = (_surd(a), _surd(b.args[0])) if a.shadow is not None and b.shadow is not None else (None, None)
    if first is None or second is None or first[1] != second[1]:
        return intern(Node, "add", (a, b))
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
    return intern(Node, "neg", (a,))


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
    return intern(Node, "mul", in_order(a, b))


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
    return intern(Node, "mul", (factor, b))


def divide(a: Node, b: Node) -> Node:
    """Return a / b; division by a constant becomes a constant factor."""
    if b.shadow == 0:
        raise ExpressionError("division by zero", number="E105")
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
    return intern(Node, "div", (a, b))


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
    return intern(Node, "pow", (a, b))


def _integer_power(a: Node, n: int) -> Node:
    if a.op == "number":
        if abs(n) * a.data.numerator.bit_length() > 4096 or abs(n) * a.data.denominator.bit_length() > 4096:
            return real(constant_value("pow", [finite_float(a.data), float(n)]))
        if a is ZERO and n < 0:
            raise ExpressionError("division by zero", number="E105")
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
    return a if n == 1 else intern(Node, "pow", (a, number(n)))


def sqrt(a: Node) -> Node:
    """Return the square root of `a`, exactly where `a` is the square of a rational."""
    if a.op == "number" and a.data >= 0:
        roots = math.isqrt(a.data.numerator), math.isqrt(a.data.denominator)
        if roots[0] ** 2 == a.data.numerator and roots[1] ** 2 == a.data.denominator:
            return number(Fraction(*roots))
        outside, inside = _square_part(a.data.numerator * a.data.denominator)
        if inside < _LARGEST_FACTORED and (outside != 1 or a.data.denominator != 1):
            return multiply(number(Fraction(outside, a.data.denominator)), intern(Node, "sqrt", (number(inside),)))
    if a.op == "pow" and a.args[1] is TWO:
        return absolute(a.args[0])
    return unary("sqrt", a)


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
    return unary("abs", a)


def unary(op: str, a: Node) -> Node:
    """Return a function of one operand that no rule simplifies; of a floating-point constant its value."""
    if a.op == "real":
        return real(constant_value(op, [a.data]))
    return intern(Node, op, (a,))


def less(a: Node, b: Node) -> Node:
    """Return the condition a < b (1 or 0 as a number)."""
    return intern(Node, "less", (a, b))


def less_equal(a: Node, b: Node) -> Node:
    """Return the condition a <= b (1 or 0 as a number)."""
    return intern(Node, "less_equal", (a, b))


ZERO: Final = number(0)
ONE: Final = number(1)
TWO: Final = number(2)
_SMALL: Final[dict[object, Node]] = {n: number(n) for n in range(-2, 5)}
PI: Final = intern(Node, "pi", ())
