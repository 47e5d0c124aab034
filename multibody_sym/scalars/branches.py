"""Where functions of time without comparisons may jump or bend all the same: at their branch points and poles."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.elementary import cos
from multibody_sym.scalars.node import ONE, TWO, Node, absolute, power, subtract
from multibody_sym.scalars.traversal import postorder

_BOUNDED_AT_POLES: Final = ("atan", "tanh", "exp")


@dataclass(frozen=True)
class Branch:
    """An expression may jump or bend where `switch` changes its sign and `touching`, if given, is zero as well.

    `touching` is never negative. `scale` is the size of what it is a difference of, if that is known.
    """

    switch: Node
    touching: Node | None = None
    scale: float = 0.0


def branches(nodes: Iterable[Node], time: Node) -> list[Branch]:
    """Return where expressions of time may jump or bend without comparing anything, each once.

    An arc sine or cosine bends where its argument turns back at 1 or -1, a root where its argument turns back at zero.
    A tangent jumps at its poles, atan2(y, x) where y changes its sign or both do, and a function that is bounded at a
    pole of its argument may jump there.
    """
    found = (b for n in postorder(nodes) if n.shadow is None for b in _branches(n, time))
    return [b for b in dict.fromkeys(found) if b.switch.shadow is None]


def poles(nodes: Iterable[Node], time: Node) -> list[Branch]:
    """Return where expressions of time may pass every bound: at the zeros of their denominators, each once.

    A factor of a denominator changes its sign there, or it turns back, so that its size touches zero.
    """
    factors = [f for n in postorder(nodes) for d in _denominators(n) for f in _factors(d) if f.shadow is None]
    found = (b for f in factors for b in (Branch(f), Branch(derivative(f, time), absolute(f))))
    return [b for b in dict.fromkeys(found) if b.switch.shadow is None]


def _branches(n: Node, time: Node) -> Iterator[Branch]:
    if n.op in ("asin", "acos"):
        left = subtract(ONE, power(n.args[0], TWO))
        yield Branch(derivative(n.args[0], time), left, 1.0)
    elif _is_root(n):
        yield Branch(derivative(n.args[0], time), n.args[0])
    elif n.op == "tan":
        yield Branch(cos(n.args[0]))
    elif n.op == "atan2":
        yield from map(Branch, n.args)
    elif n.op in _BOUNDED_AT_POLES:
        yield from (Branch(d) for part in postorder(n.args) for d in _denominators(part))


def _is_root(n: Node) -> bool:
    exponent = n.args[1].shadow if n.op == "pow" else None
    return n.op == "sqrt" or (exponent is not None and not exponent.is_integer())


def _denominators(n: Node) -> Iterator[Node]:
    if n.op == "div":
        yield n.args[1]
    elif n.op == "pow" and n.args[1].shadow is not None and n.args[1].shadow < 0.0:
        yield n.args[0]


def _factors(n: Node) -> Iterator[Node]:
    """Yield what is zero where a denominator is."""
    if n.op in ("mul", "div", "neg", "abs", "sqrt", "pow"):
        yield from (f for part in (n.args if n.op == "mul" else n.args[:1]) for f in _factors(part))
    else:
        yield n
