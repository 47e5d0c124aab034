"""Functions of Nodes, each folded where its value is exact, and every constructor by the operation it makes."""

from __future__ import annotations

import copyreg
import math
import threading
from collections.abc import Callable, Container, Iterable, Iterator
from dataclasses import is_dataclass
from fractions import Fraction
from typing import Any, Final
from weakref import ReferenceType, ref

from multibody_sym.scalars.node import (
    FLOAT_OPERATIONS,
    ONE,
    PI,
    ZERO,
    E,
    Exact,
    Node,
    absolute,
    add,
    divide,
    in_order,
    intern,
    less,
    less_equal,
    multiply,
    negate,
    nodes_among,
    number,
    power,
    quantity,
    real,
    slot,
    sqrt,
    symbol,
    symbol_with,
    unary,
)
from multibody_sym.scalars.tabulated import Tabulated


def _odd(op: str, a: Node) -> Node:
    if a is ZERO:
        return ZERO
    if a.op == "neg":
        return negate(BUILD[op](a.args[0]))
    if a.op in ("number", "real") and a.data < 0:
        return negate(BUILD[op](negate(a)))
    return unary(op, a)


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
    return unary("cos", a)


def sign(a: Node) -> Node:
    """Return -1, 0 or 1."""
    if a.shadow is not None:
        return number((a.shadow > 0) - (a.shadow < 0))
    if a.op == "neg":
        return negate(sign(a.args[0]))
    return intern(Node, "sign", (a,))


def exp(a: Node) -> Node:
    """Return e^a."""
    return ONE if a is ZERO else unary("exp", a)


def log(a: Node) -> Node:
    """Return the natural logarithm of a."""
    return ZERO if a is ONE else unary("log", a)


def asin(a: Node) -> Node:
    """Return the arc sine of a, pi/2 of 1."""
    return divide(PI, number(2)) if a is ONE else _odd("asin", a)


def acos(a: Node) -> Node:
    """Return the arc cosine of a, 0 of 1 and pi/2 of 0."""
    return ZERO if a is ONE else divide(PI, number(2)) if a is ZERO else unary("acos", a)


def atan(a: Node) -> Node:
    """Return the arc tangent of a, pi/4 of 1."""
    return divide(PI, number(4)) if a is ONE else _odd("atan", a)


def cosh(a: Node) -> Node:
    """Return the hyperbolic cosine of a."""
    return ONE if a is ZERO else unary("cosh", a)


def acosh(a: Node) -> Node:
    """Return the inverse hyperbolic cosine of a, 0 of 1."""
    return ZERO if a is ONE else unary("acosh", a)


def atan2(y: Node, x: Node) -> Node:
    """Return the angle of the point (x, y)."""
    if y.op == "real" and x.op == "real":
        return real(math.atan2(y.data, x.data))
    if y is ZERO and x.shadow is not None and x.shadow > 0:
        return ZERO
    return intern(Node, "atan2", (y, x))


def _extreme(op: str, a: Node, b: Node) -> Node:
    if a is b:
        return a
    if a.shadow is not None and b.shadow is not None:
        return a if FLOAT_OPERATIONS[op](a.shadow, b.shadow) == a.shadow else b
    return intern(Node, op, in_order(a, b))


def minimum(a: Node, b: Node) -> Node:
    """Return the smaller of a and b."""
    return _extreme("min", a, b)


def maximum(a: Node, b: Node) -> Node:
    """Return the larger of a and b."""
    return _extreme("max", a, b)


def where(condition: Node, a: Node, b: Node) -> Node:
    """Return a where the condition holds, else b."""
    if condition.shadow is not None:
        return a if condition.shadow else b
    return a if a is b else intern(Node, "where", (condition, a, b))


def table(function: Tabulated, order: int, a: Node) -> Node:
    """Return a tabulated function of a, or the derivative of an order; of a constant its value, exactly on lines."""
    if order > function.degree:
        return ZERO
    return intern(Node, "table", (a,), (function, order)) if a.shadow is None else function.piece(order, a.shadow, a)


BUILD: Final[dict[str, Callable[..., Node]]] = {
    "neg": negate, "add": add, "mul": multiply, "div": divide, "pow": power, "sin": sin, "cos": cos,
    "tan": lambda a: _odd("tan", a), "asin": asin, "acos": acos, "atan": atan,
    "atan2": atan2, "sinh": lambda a: _odd("sinh", a), "cosh": cosh, "tanh": lambda a: _odd("tanh", a),
    "asinh": lambda a: _odd("asinh", a), "acosh": acosh, "atanh": lambda a: _odd("atanh", a), "exp": exp, "log": log,
    "sqrt": sqrt, "abs": absolute, "sign": sign, "min": minimum, "max": maximum, "less": less,
    "less_equal": less_equal, "where": where, "table": table,
}


# ----------------------------------------------------------------------------------------------------------------------
# Ways through expressions: each part once however often it is shared, and without recursion however deep it is.


def postorder(roots: Iterable[E], known: Container[E] = ()) -> Iterator[E]:
    """Yield every expression below `roots` once, operands before the expressions that use them (no recursion).

    What is `known` is neither yielded nor looked into.
    """
    seen: set[E] = set()
    stack: list[tuple[E, bool]] = []
    for root in roots:
        if not root.args:
            if root not in seen and root not in known:
                seen.add(root)
                yield root
            continue
        stack.append((root, False))
        while stack:
            node, ready = stack.pop()
            if ready:
                yield node
            elif node not in seen and node not in known:
                seen.add(node)
                stack.append((node, True))
                stack.extend((a, False) for a in reversed(node.args) if a not in seen)


def leaves(roots: Iterable[E], *ops: str) -> list[E]:
    """Return the leaves below `roots` whose op is one of `ops`, in the order in which they are met."""
    return [node for node in postorder(roots) if node.op in ops]


def flatten(op: str, node: E) -> list[E]:
    """Return the operands of a nested `op`, left to right, as one list."""
    operands, stack = [], [node]
    while stack:
        top = stack.pop()
        if top.op == op:
            stack.extend(reversed(top.args))
        else:
            operands.append(top)
    return operands


# ----------------------------------------------------------------------------------------------------------------------
# Nodes between processes: pickled each once, rebuilt by their constructors, however deep they stand.


_LEAVES: Final[dict[str, Callable[[Any], Node]]] = {
    "number": number,
    "real": real,
    "pi": lambda _: PI,
    "symbol": symbol,
    "declared": lambda data: symbol_with(*data),
    "slot": lambda data: slot(*data),
    "quantity": lambda data: quantity(*data),
}


class _Brought:
    """The Nodes that a pickler has got. It stands in every pickle of Nodes, so it lives as long as its pickler does.

    A pickler that has not met it asks how to write it, so that a new one differs from one that goes on.
    """

    __slots__ = ("__weakref__", "asked", "nodes", "written")

    def __init__(self) -> None:
        self.nodes: set[Node] = set()
        self.asked: Node = PI
        self.written = False

    def __reduce__(self) -> tuple[Any, ...]:
        if self.written:  # by another pickler that is still there: this one gets its own
            return (_Brought, (), (_next(self.asked),))
        self.written = True
        return (_Brought, (), self.new_below(self.asked))

    def __setstate__(self, brought: object) -> None:
        """Keep nothing: what was brought along is read by now, and that is all it is for."""

    def new_below(self, root: Node) -> tuple[Node, ...]:
        """Return the Nodes below `root` that the pickler has not got, operands first, and note them with `root`."""
        found: list[Node] = []
        stack = [(root, False)]
        while stack:
            node, ready = stack.pop()
            if ready:
                found.append(node)
            elif node not in self.nodes:
                self.nodes.add(node)
                stack.append((node, True))
                stack.extend((a, False) for a in _held_nodes(node) if a not in self.nodes)
        return tuple(found[:-1])


class _AtWork(threading.local):
    """What the pickler at work in this thread has got, as long as it lives."""

    brought: ReferenceType[_Brought] | None = None


_at_work: Final = _AtWork()


def _held_nodes(node: Node) -> Iterator[Node]:
    """Yield the operands of a Node, or what the declaration holds that a symbol brings along."""
    if node.args:
        yield from node.args
    elif node.op == "declared" and is_dataclass(node.data[1]):
        yield from nodes_among(vars(node.data[1]).values())


def _reduce(node: Node) -> tuple[Any, ...]:
    brought = None if _at_work.brought is None else _at_work.brought()
    below: tuple[Node, ...] = ()
    if brought is None:  # the pickler will ask the new one for what is below
        brought = _next(node)
    else:
        brought.asked = node
        below = brought.new_below(node)
    if node.args:
        return _operation, (brought, below, node.op, *node.own, *node.args)
    return _leaf, (brought, below, node.op, node.data)


def _next(asked: Node) -> _Brought:
    """Return what a pickler that begins with the Node `asked` has got, now that it is at work."""
    brought = _Brought()
    brought.asked = asked
    _at_work.brought = ref(brought)
    return brought


def _operation(brought: object, below: object, op: str, *args: Any) -> Node:
    return BUILD[op](*args)


def _leaf(brought: object, below: object, op: str, data: Any) -> Node:
    return _LEAVES[op](data)


def register() -> None:
    """Tell `pickle` and what is built on it how to write a Node."""
    copyreg.pickle(Node, _reduce)
