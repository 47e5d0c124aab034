"""Where an expression has a kink or a jump: the switching functions of its comparisons, choices and absolute values.

And where a smooth one fades, which is as good as a kink to whoever takes steps.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Final

from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.elementary import maximum, minimum, table
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ZERO, Node, add, number, subtract
from multibody_sym.scalars.traversal import leaves, postorder

_COMPARISONS: Final = ("less", "less_equal")
_FADED: Final = 36  # exp(-36) is round-off beside 1
_SATURATED: Final = 20  # so is 1 - tanh(20)
FEW_KNOTS: Final = 64
"""Knots of a table up to which each has a function of its own, so that no step leads over a narrow pulse unseen."""
_JOINED: Final = {"min": minimum, "max": maximum}


def is_condition(n: Node) -> bool:
    """Tell whether an expression is a comparison, or several joined by `and` and `or`: their least, their greatest."""
    return n.op in _COMPARISONS or (n.op in _JOINED and all(map(is_condition, n.args)))


def switching_function(condition: Node) -> Node:
    """Return g with g > 0 where a condition holds: b - a of a < b and a <= b, the least or greatest of joined ones."""
    a, b = condition.args
    if condition.op in _COMPARISONS:
        return subtract(b, a)
    return _JOINED[condition.op](switching_function(a), switching_function(b))


def switching_functions(nodes: Iterable[Node]) -> list[Node]:
    """Return functions at whose zeros the expressions may have a kink or a jump, each once, nested ones too.

    They are b - a of a < b, max(a, b) and min(a, b), a of |a| and sign(a), and the distance from the knots at which the
    slope of a table jumps. Functions of constants alone switch nothing, nor do min and max of conditions, which combine
    the truth of what is listed already.
    """
    found: dict[Node, None] = {}
    for n in postorder(nodes):
        if n.op == "table":
            found.update(dict.fromkeys(at_knots(n)))
            continue
        sides = _sides(n)
        if sides is not None and subtract(*sides) not in found:
            found[subtract(sides[1], sides[0])] = None
    return [g for g in found if g.shadow is None]


def at_knots(n: Node) -> list[Node]:
    """Return the functions that change their signs where the slope of a table jumps: one each, or one of many knots."""
    bends = n.data[0].bends
    if len(bends.rows) > FEW_KNOTS:
        return [table(bends, 0, n.args[0])]
    return [subtract(n.args[0], knot) for knot, _ in bends.rows]


def known_zeros(g: Node, time: Node, values: Mapping[Node, float]) -> Sequence[float] | None:
    """Return the zeros of a switching function that tells them: of one linear in time, or of a table's knots then.

    `values` by symbols; symbols without one count as zero. None for all other functions.
    """
    inner, knots = (g.args[0], g.data[0].columns[0]) if g.op == "table" else (g, (0.0,))
    rate = derivative(inner, time)
    if rate.shadow is None or switching_functions([inner]):
        return None
    known = {**dict.fromkeys(leaves([inner], "symbol"), 0.0), **values, time: 0.0}
    (first,) = evaluate_float([inner], known)
    return [(knot - first) / rate.shadow for knot in knots] if rate.shadow else ()


def fading_functions(nodes: Iterable[Node]) -> list[Node]:
    """Return functions at whose zeros smooth parts of expressions become as good as constant, each once.

    exp(g) is as good as nothing below g = -36, and tanh(g) and 1/cosh(g) change no more beyond g = -20 and 20. Who
    goes on from there at the pace that a constant allows may step over all of a narrow law.
    """
    found: dict[Node, None] = {}
    for n in postorder(nodes):
        if n.op == "exp":
            found[add(n.args[0], number(_FADED))] = None
        elif n.op in ("tanh", "cosh", "sinh"):
            found.update(dict.fromkeys(add(n.args[0], number(x)) for x in (-_SATURATED, _SATURATED)))
    return [g for g in found if g.shadow is None]


def _sides(n: Node) -> tuple[Node, ...] | None:
    """Return what a node compares, if it switches."""
    if n.op in _COMPARISONS:
        return n.args
    if n.op in ("min", "max"):
        return None if all(map(_is_truth, n.args)) else n.args
    return (ZERO, n.args[0]) if n.op in ("abs", "sign") and not _is_truth(n.args[0]) else None


def _is_truth(n: Node) -> bool:
    """Tell whether a value is the truth of something, which jumps where what it is made of switches."""
    if n.op in ("neg", "min", "max", "add", "mul", "pow", "where"):
        return all(map(_is_truth, n.args))
    return n.op in _COMPARISONS or n.op == "sign" or n.shadow is not None
