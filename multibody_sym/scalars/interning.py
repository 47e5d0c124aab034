"""Expressions that are one object where they are equal: how they lie in memory, and the table that knows them all.

Two of them are equal exactly when they are the same object, whichever threads made them. Operands of `+` and `*` stand
in the order of keys, which depend on structure only, never on names' hashes, addresses or history. Nor do they depend
on the values of constants other than 0, 1 and -1: what is derived with other numbers is the same but for these.
"""

from __future__ import annotations

import gc
import math
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from sys import getrefcount
from threading import RLock
from typing import Any, Final, Self, TypeVar

from multibody_sym.errors import ExpressionError

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
    "exp log sqrt abs sign min max less less_equal where table"
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
            known += [intern(cls, "slot", (), (array, k)) for k in range(len(known), end)]
            _arrays[array] = known
    return known[begin:end]


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
def uncollected() -> Iterator[None]:
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
    "table": lambda function, order, a: function.value(order, a),
}
_SHOWN: Final = {"neg": "-", "pow": "power", "add": "sum", "mul": "product", "div": "quotient"}
