"""Where an expression has a kink or a jump: the switching functions of its comparisons, choices and absolute values.

And where a smooth one fades, which is as good as a kink to whoever takes steps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from sys import float_info
from typing import Final, NamedTuple

from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import cos, leaves, maximum, minimum, postorder, table
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import FLOAT_OPERATIONS, ONE, TWO, ZERO, Node, absolute, add, number, power, subtract

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


# ----------------------------------------------------------------------------------------------------------------------
# Where functions of time without comparisons may jump or bend all the same: at their branch points and poles.


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
    exponent = n.args[1].shadow if n.op == "pow" else None
    if n.op in ("asin", "acos"):
        left = subtract(ONE, power(n.args[0], TWO))
        yield Branch(derivative(n.args[0], time), left, 1.0)
    elif n.op == "acosh":
        yield Branch(derivative(n.args[0], time), subtract(n.args[0], ONE), 1.0)
    elif n.op == "sqrt" or (exponent is not None and not exponent.is_integer()):
        yield Branch(derivative(n.args[0], time), n.args[0])
    elif n.op == "tan":
        yield Branch(cos(n.args[0]))
    elif n.op == "atan2":
        yield from map(Branch, n.args)
    elif n.op in _BOUNDED_AT_POLES:
        yield from (Branch(d) for part in postorder(n.args) for d in _denominators(part))


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


# ----------------------------------------------------------------------------------------------------------------------
# Values of Nodes over floats, each with a bound of its rounding: what is no more than that cannot be told from 0.


Operation = Callable[..., float]


class Bounded(NamedTuple):
    """A number that is known to within `bound`, to first order."""

    value: float
    bound: float


def bound_rounding(nodes: Iterable[Node], leaf: Mapping[Node, Bounded]) -> list[Bounded]:
    """Return Nodes with bounds of their rounding, given those of their leaves; the bound is inf where there is none."""
    roots = list(nodes)
    found: dict[Node, Bounded] = {}
    for n in postorder(roots):
        if n in leaf:
            found[n] = leaf[n]
        elif n.shadow is not None:
            whole = n.op == "number" and isinstance(n.data, int)
            found[n] = Bounded(n.shadow, 0.0 if whole else float_info.epsilon * abs(n.shadow))
        elif n.args:
            found[n] = _bound_operation(n, [found[a] for a in n.args])
        else:
            found[n] = Bounded(math.nan, math.inf)
    return [found[root] for root in roots]


def _bound_operation(n: Node, operands: list[Bounded]) -> Bounded:
    """Return an operation: its rounding, and by how much it changes where each operand changes by its bound."""
    op, values, operation = n.op, [x.value for x in operands], partial(FLOAT_OPERATIONS[n.op], *n.own)
    try:
        value = operation(*values)
        if op in ("add", "neg"):
            change = sum(x.bound for x in operands)
        elif op == "mul":
            (a, da), (b, db) = operands
            change = abs(a) * db + abs(b) * da
        else:
            change = sum(_change(operation, values, k, x.bound, value) for k, x in enumerate(operands))
    except (ArithmeticError, ValueError):
        return Bounded(math.nan, math.inf)
    return Bounded(value, float_info.epsilon * abs(value) + change)


def _change(operation: Operation, values: list[float], k: int, bound: float, value: float) -> float:
    """Return by how much an operation changes at most where operand k changes by its bound, to either side."""
    if bound == 0.0:
        return 0.0
    sides = ([*values[:k], values[k] + side, *values[k + 1 :]] for side in (bound, -bound))
    return max(abs(operation(*moved) - value) for moved in sides)


# ----------------------------------------------------------------------------------------------------------------------
# Where a function of one variable changes its sign: looks at it until it is certain to keep one.
#
# A function that has one sign at both ends of a piece, and changes at rates known there, is certain to keep it if its
# rates differ too little from its mean rate to bend it to zero, or if they say that it rises or falls all the way. A
# piece of which neither is true is halved.


PROBE: Final = 2.0**-10  # part of a piece over which rates at its ends are measured
LEAST_PROBE: Final = 2.0**-18  # part of a step over which rates within it are measured at least, ...
MOST_PROBE: Final = 2.0**-5  # ... and of half a piece over which at most: rounding must not say what they are
LEAST_PIECE: Final = 2.0**-40  # part of a step that is not halved any more
MOST_LOOKS: Final = 1000  # halvings in a step for one function, which is zero but for round-off if they do not suffice
PIECES: Final = 64  # of a time, in which zeros are looked for

Function = Callable[[float], float]


@dataclass(frozen=True)
class Look:
    """A function's value at theta, a part of the step, and its rates before and after it."""

    theta: float
    value: float
    before: float
    after: float


def first_seen(value: Callable[[float], float], start: Look, end: Look, unseen: float = 0.0) -> float | None:
    """Return a part of the step at which a function is negative, near the first there is; None if it never is.

    What is no farther than `unseen` from zero all along a piece is zero there but for round-off.
    """
    left = iter(range(MOST_LOOKS))
    return _sign_change(value, start, end, unseen, left)


def _sign_change(value: Callable[[float], float], a: Look, b: Look, unseen: float, left: Iterator[int]) -> float | None:
    if b.value < 0.0:
        return b.theta
    width = b.theta - a.theta
    change, rise, fall = b.value - a.value, a.after * width, b.before * width
    bend = max(abs(rise - change), abs(fall - change))
    if a.value <= unseen and b.value <= unseen and bend <= unseen:
        return None
    if not (min(a.value, b.value) < bend and bend > 0.5 * abs(change)) or not width > LEAST_PIECE:
        return None
    if next(left, None) is None:
        return None
    half = 0.5 * width
    middle, probe = a.theta + half, max(PROBE * half, min(MOST_PROBE * half, LEAST_PROBE))
    here, before, after = value(middle), value(middle - probe), value(middle + probe)
    if before < 0.0:
        return middle - probe
    look = Look(middle, here, (here - before) / probe, (after - here) / probe)
    found = _sign_change(value, a, look, unseen, left)
    return _sign_change(value, look, b, unseen, left) if found is None else found


def looks_at_ends(value: Callable[[float], float], start: float, end: float) -> tuple[Look, Look]:
    """Return the looks at the ends of a step, where a function of its parts has the values `start` and `end`."""
    rise, fall = (value(PROBE) - start) / PROBE, (end - value(1.0 - PROBE)) / PROBE
    return Look(0.0, start, rise, rise), Look(1.0, end, fall, fall)


def zeros(g: Function, t_end: float) -> Iterator[float]:
    """Yield the times in (0, t_end) at which g changes its sign, in their order."""
    side = 0.0
    for start, end in pairwise([t_end * k / PIECES for k in range(PIECES + 1)]):
        while start < end:
            side = side or _sign(g(start)) or _sign(g(start + PROBE * (end - start)))
            high = _other_side(g, side, start, end)
            if high is None:
                break
            low = start
            while low < (middle := 0.5 * (low + high)) < high:
                low, high = (low, middle) if side * g(middle) < 0.0 else (middle, high)
            if 0.0 < low < t_end:
                yield high
            start, side = high, -side


def _other_side(g: Function, side: float, start: float, end: float) -> float | None:
    """Return a time in [start, end] at which g is seen on the other side of zero; None if it never is."""
    width = end - start

    def value(theta: float) -> float:
        return side * g(start + theta * width)

    theta = first_seen(value, *looks_at_ends(value, max(value(0.0), 0.0), value(1.0)))
    return None if theta is None else start + theta * width


def _sign(value: float) -> float:
    return float((value > 0.0) - (value < 0.0))
