"""Nodes between processes: pickled each once, rebuilt by their constructors, however deep they stand.

A pickler calls itself for whatever an object holds, which ends at the limit of recursion for a sum of a few hundred
terms. So the first Node it meets brings along all Nodes below it, operands first: when the turn of each has come, the
pickler knows its operands already. Later ones bring along what is new. No pickle says how a Node lies in memory.
"""

from __future__ import annotations

import copyreg
import threading
from collections.abc import Callable, Iterator
from dataclasses import is_dataclass
from typing import Any, Final
from weakref import ReferenceType, ref

from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import PI, Node, nodes_among, number, quantity, real, slot, symbol, symbol_with

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

    A pickler that has not met it asks how to write it: that is how a new one is told from one that goes on.
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
