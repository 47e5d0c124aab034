"""What sweeps through a Program share, forward with rates and backward with weights."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from multibody_sym.program.progressions import Window
from multibody_sym.program.statements import Array, Assign, Callee, Loop, Scan
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO, Node, add, multiply

Vector = tuple[Node, ...]


def resumed(program: Callee, name: str, further: Iterable[Array]) -> Trace:
    """Return a Trace in which the calls, solves and scans of `program` are done already."""
    trace = Trace(name, (*program.inputs, *further))
    for statement in program.statements:
        if not isinstance(statement, Assign):
            trace.adopt(statement)
    return trace


def unused(name: str, suffix: str, names: Iterable[str]) -> str:
    """Return `name` with suffixes, so many that it is none of `names`."""
    used = set(names)
    name += suffix
    while name in used:
        name += suffix
    return name


def known(value: Node, inner: Node) -> Node:
    """Return what a callee returns; a constant needs no call."""
    return value if inner.shadow is None else inner


@dataclass(frozen=True)
class Layout:
    """Where the arrays of a scan are in its derivative, by their number, and where those of their rates or weights."""

    first: Mapping[int, int]
    second: Mapping[int, int]

    @staticmethod
    def of(scan: Scan, *moved: Sequence[int]) -> Layout:
        """Return the layout in which the given arrays, results and work space are each followed by those `moved`."""
        first: dict[int, int] = {}
        second: dict[int, int] = {}
        parts = map(len, (scan.given, scan.targets, scan.work))
        for size, twice in zip(parts, moved, strict=True):
            first |= {len(first) + k: len(first) + len(second) + k for k in range(size)}
            second |= {number: len(first) + len(second) + k for k, number in enumerate(twice)}
        return Layout(first, second)

    def kept(self, window: Window) -> Window:
        """Return the window on the array itself."""
        return replace(window, array=self.first[window.array])

    def behind_gate(self, loop: Loop) -> Loop:
        """Return a loop behind its gate in the derivative."""
        return loop if loop.gate is None else replace(loop, gate=self.kept(loop.gate))

    def other(self, window: Window) -> Window:
        """Return the window on the array of its rates or weights."""
        return replace(window, array=self.second[window.array])


def put(rates: dict[Node, Node], nodes: Sequence[Node], values: Sequence[Node]) -> None:
    """Set the rates of `nodes`; what is zero is left out."""
    rates.update((n, value) for n, value in zip(nodes, values, strict=True) if value is not ZERO)


def taken(rates: Mapping[Node, Node], nodes: Iterable[Node]) -> Vector:
    """Return the rates of `nodes`; what has none stands still."""
    return tuple(rates.get(node, ZERO) for node in nodes)


def dot(a: Iterable[Node], b: Iterable[Node]) -> Node:
    """Return the sum of the products of two vectors' elements."""
    total = ZERO
    for x, y in zip(a, b, strict=True):
        if x is not ZERO and y is not ZERO:
            total = add(total, multiply(x, y))
    return total