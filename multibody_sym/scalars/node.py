"""Expressions that are one object where they are equal: how they lie in memory, and the table that knows them all.

Two of them are equal exactly when they are the same object, whichever threads made them. Operands of `+` and `*` stand
in the order of keys, which depend on structure only, never on names' hashes, addresses or history. Nor do they depend
on the values of constants other than 0, 1 and -1: what is derived with other numbers is the same but for these.
"""

from __future__ import annotations

import gc
import math
import operator
import os
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from decimal import Decimal
from fractions import Fraction
from sys import getrefcount
from threading import RLock
from typing import Any, Final, Self, TypeVar

from multibody_sym.errors import ArgumentError, ExpressionError, short_repr

_HELD_BY_ONE: Final = 2  # the reference of a table or list and the argument of getrefcount
_SMALLEST_LIMIT: Final = 200_000
_TOLD_APART: Final = (0, 1, -1)
_table: dict[tuple[Any, ...], Any] = {}
_limit = [_SMALLEST_LIMIT]
_arrays: dict[str, list[Any]] = {}
"""The slots of each array from the first on, as far as they were asked for in a row."""
_changing = RLock()
"""Held while the table changes (it is read without): a finaliser or signal handler may come back here meanwhile."""
if hasattr(os, "register_at_fork"):  # a child must not inherit a lock that a thread holds which it has not
    os.register_at_fork(
        before=_changing.acquire, after_in_parent=_changing.release, after_in_child=_changing.release
    )


class Interned:
    """A scalar expression: `op`, operands `args`, and for leaves and tables `data`.

    Leaves: `number` (int or Fraction), `real` (float), `pi`, `symbol` (a name of the model), `declared` (a symbol that
    carries its declaration), `slot` ((array, index): an element of a program's input or a temporary), `quantity`
    ((function, names): asked of the moving system, such as `reaction(C, fx)`). The data of a `table` are the function
    and the order of the derivative. `key` orders operands; `shadow` is the float value of a constant expression, else
    None.
    """

    __slots__ = ("args", "data", "key", "op", "shadow")

    op: str
    args: tuple[Self, ...]
    data: Any
    key: int
    shadow: float | None

    @property
    def own(self) -> tuple[Any, ...]:
        """What an operation has beside its operands, before which constructors and functions of `op` take it."""
        return self.data if self.op == "table" else ()

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError("a Node never changes")

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: object) -> Self:
        return self

    def __repr__(self) -> str:
        if self.op in ("number", "real", "symbol"):
            return str(self.data)
        if self.op == "declared":
            return str(self.data[0])
        if self.op == "slot":
            return f"{self.data[0]}[{self.data[1]}]"
        if self.op == "quantity":
            function, names = self.data
            return f"{', '.join(names)}{function}" if function[0] == "'" else f"{function}({', '.join(names)})"
        return f"{self.op}({', '.join(map(repr, (*self.own, *self.args)))})" if self.args else self.op


E = TypeVar("E", bound=Interned)

_OPERATIONS: Final = (
    "number real pi symbol declared slot quantity neg add mul div pow sin cos tan asin acos atan atan2 sinh cosh tanh "
    "exp log sqrt abs sign min max less less_equal where table "
    "asinh acosh atanh"
).split()
_CODE: Final = {name: code for code, name in enumerate(_OPERATIONS, 1)}
_set_op, _set_args, _set_data, _set_key, _set_shadow = (
    vars(Interned)[name].__set__ for name in ("op", "args", "data", "key", "shadow")
)


def intern(cls: type[E], op: str, args: tuple[E, ...], data: Any = None) -> E:
    """Return the expression `op` of `args` or, of a leaf, with `data`: the one there is, or a new one."""
    identity = (op, data, args)
    found: E | None = _table.get(identity)
    if found is not None:
        return found
    node = object.__new__(cls)
    _set_op(node, op)
    _set_args(node, args)
    _set_data(node, data)
    if len(args) == 2:  # most are, and this function makes every Node
        key = hash((_CODE[op], args[0].key, args[1].key))
    elif op == "table":
        key = hash((_data_key(data[0].called(data[1])), args[0].key))
    else:
        key = hash((_CODE[op], *[a.key for a in args])) if args else _leaf_key(op, data)
    _set_key(node, key)
    _set_shadow(node, None if args and args[-1].shadow is None else _shadow(op, args, data))
    with _changing:
        if len(_table) >= _limit[0]:
            forget_unused()
        kept: E = _table.setdefault(identity, node)  # another thread's, if it was first
        return kept


def intern_slots(cls: type[E], array: str, begin: int, end: int) -> list[E]:
    """Return the slots of an array in a row, which are looked up all at once."""
    known = _arrays.get(array, [])
    if len(known) < end:
        with _changing:
            known = _arrays.get(array, [])
            known += _made_slots(cls, array, len(known), end)
            _arrays[array] = known
    return known[begin:end]


def _made_slots(cls: type[E], array: str, begin: int, end: int) -> list[E]:
    """Return what `intern` gives for slots of an array in a row; a large mechanism has some 100,000 of them."""
    if len(_table) + end - begin >= _limit[0]:
        forget_unused()
    code, head, found = _CODE["slot"], repr((array, 0))[:-2], list[E]()
    for k in range(begin, end):
        data = (array, k)
        node: E | None = _table.get(("slot", data, ()))
        if node is None:
            node = object.__new__(cls)
            _set_op(node, "slot")
            _set_args(node, ())
            _set_data(node, data)
            _set_key(node, hash((code, _text_key(f"{head}{k})"))))
            _set_shadow(node, None)
            node = _table.setdefault(("slot", data, ()), node)
        found.append(node)
    return found


def in_order(a: E, b: E) -> tuple[E, E]:
    """Return two operands in the order of their keys; of those that only constants tell apart, by the first of them."""
    if a.key == b.key:
        return (a, b) if _precedes(a, b) else (b, a)
    return (a, b) if a.key < b.key else (b, a)


def _precedes(a: Interned, b: Interned) -> bool:
    pairs, seen = [(a, b)], set()
    while pairs:
        x, y = pair = pairs.pop()
        if x is y or pair in seen:
            continue
        if not x.args or x.op != y.op or len(x.args) != len(y.args) or x.data != y.data:
            return (x.op, _value_key(x)) < (y.op, _value_key(y))
        seen.add(pair)
        pairs += zip(reversed(x.args), reversed(y.args), strict=True)
    return True


def forget_unused() -> None:
    """Drop the Nodes that only the table holds: newest first, so that operands go after what used them.

    What another thread finds in the table just before it leaves it goes back; until then that thread's equals wait.
    """
    _arrays.clear()
    stack = list(_table)
    while stack:
        identity = stack.pop()
        if getrefcount(_table[identity]) == _HELD_BY_ONE:
            taken = [_table.pop(identity)]
            if getrefcount(taken[0]) != _HELD_BY_ONE:
                _table[identity] = taken[0]
            taken.clear()  # else it would hold its operands, whose turn is next
    _limit[0] = max(_SMALLEST_LIMIT, 2 * len(_table))


@contextmanager
def without_collection() -> Iterator[None]:
    """Let nobody look for circles of references meanwhile: expressions have none, and a million take a second a time.

    Afterwards this is as it was before.
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


def _leaf_key(op: str, data: Any) -> int:
    if op in ("number", "real") and data not in _TOLD_APART:
        return hash(_CODE["number"])
    return hash((_CODE[op], _data_key(data)))


def _value_key(node: Interned) -> tuple[int, float, str]:
    """Return what orders leaves of one key: constants by value, others, whose keys hardly agree, by their text."""
    return len(node.args), 0.0 if node.shadow is None else node.shadow, repr(node.data)


def _data_key(data: Any) -> int:
    """Return an integer that depends on `data` only: str hashes change with every process, those of numbers do not."""
    if data is None:
        return 0
    if isinstance(data, (int, float, Fraction)):
        return hash(data)
    text = data if isinstance(data, str) else repr(data if isinstance(data[1], (int, tuple)) else data[0])
    return _text_key(text)


def _text_key(text: str) -> int:
    return int.from_bytes(text.encode("utf-8", "surrogatepass"), "big") % ((1 << 61) - 1)


def _shadow(op: str, args: tuple[Interned, ...], data: Any) -> float | None:
    if not args:
        if op == "pi":
            return math.pi
        return finite_float(data) if op in ("number", "real") else None
    for a in args:
        if a.shadow is None:
            return None
    return constant_value(op, [a.shadow for a in args if a.shadow is not None])


def constant_value(op: str, values: list[float]) -> float:
    """Return the operation of floats; raises ExpressionError where it has no finite real value."""
    try:
        result = float(FLOAT_OPERATIONS[op](*values))
    except (ArithmeticError, ValueError):
        result = math.nan
    if not math.isfinite(result):
        shown = ", ".join(f"{v:g}" for v in values)
        raise ExpressionError(f"{_SHOWN.get(op, op)}({shown}) is not a finite real number", number="E105")
    return result


def finite_float(value: Fraction | float) -> float:
    """Return a constant as a float; raises ExpressionError where it is too large."""
    try:
        return float(value)
    except OverflowError:
        raise ExpressionError("a constant is too large for a floating-point number", number="E105") from None


FLOAT_OPERATIONS: Final[dict[str, Callable[..., float]]] = {
    "neg": lambda a: -a,
    "add": lambda a, b: a + b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "pow": math.pow,
    "sin": math.sin, "cos": math.cos, "tan": math.tan, "asin": math.asin, "acos": math.acos, "atan": math.atan,
    "atan2": math.atan2, "sinh": math.sinh, "cosh": math.cosh, "tanh": math.tanh, "asinh": math.asinh,
    "acosh": math.acosh, "atanh": math.atanh, "exp": math.exp, "log": math.log,
    "sqrt": math.sqrt, "abs": abs, "min": min, "max": max,
    "sign": lambda a: float((a > 0) - (a < 0)),
    "less": lambda a, b: float(a < b),
    "less_equal": lambda a, b: float(a <= b),
    "where": lambda condition, a, b: a if condition else b,
    "table": lambda function, order, a: function.value(order, a),
}
_SHOWN: Final = {"neg": "-", "pow": "power", "add": "sum", "mul": "product", "div": "quotient"}


# ----------------------------------------------------------------------------------------------------------------------
# Numbers of other kinds as Python's own: NumPy's, arrays without dimensions, decimals.


_LARGEST_EXPONENT: Final = 400


def unbox(value: Any) -> Any:
    """Return what an array without dimensions or a number of NumPy's holds, a decimal exactly, all else as it is.

    Raises ExpressionError for a decimal that no float comes near to.
    """
    if isinstance(value, Decimal):
        if not value.is_finite():
            return math.nan if value.is_nan() else float(value)
        if value and abs(value.adjusted()) > _LARGEST_EXPONENT:  # written out it might fill all memory
            raise ExpressionError(f"{short_repr(value)} is past what floating-point numbers hold", number="E105")
        return Fraction(value) if value else Fraction(0)
    item = getattr(value, "item", None)
    if not callable(item) or getattr(value, "ndim", None) != 0:
        return value
    held = item()
    return float(held) if type(held) is type(value) and hasattr(held, "is_integer") else held  # a long double


# ----------------------------------------------------------------------------------------------------------------------
# Node: the immutable, hash-consed scalar expression that models are declared in and programs are made of.
#
# Constants from text are exact Fractions. Constructors fold constants and the rules of 0 and 1, and pull signs
# outward.


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

    def __abs__(self) -> Node:
        return absolute(self)

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
    held = unbox(value)
    if held is not value:
        return as_node(held)
    raise ArgumentError(f"{short_repr(value)} is not a number or an expression")


# --- leaves -----------------------------------------------------------------------------------------------------


def nodes_among(parts: Iterable[object]) -> list[Node]:
    """Return the Nodes among some parts."""
    return [part for part in parts if isinstance(part, Node)]


def named_nodes(parts: Mapping[str, object]) -> dict[str, Node]:
    """Return the Nodes among some parts, by their names."""
    return {name: part for name, part in parts.items() if isinstance(part, Node)}


def constant_of(x: object) -> float | None:
    """Return a number, or the value of a Node that is a constant; None for all else."""
    if isinstance(x, Node):
        return x.shadow
    return float(x) if isinstance(x, (int, float)) else None


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
    if a.op == b.op == "mul" and a.args[0] is b.args[0] and a.args[1].op == b.args[1].op == "pow" and _is_circle(
        a.args[1], b.args[1]
    ):
        return a.args[0]
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
