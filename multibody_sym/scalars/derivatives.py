"""Exact derivatives of Node expressions, forward (tangents) and reverse (gradients)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Final

from multibody_sym.scalars.elementary import cos, exp, log, sign, sin, table, where
from multibody_sym.scalars.node import (
    ONE,
    TWO,
    ZERO,
    Node,
    absolute,
    add,
    divide,
    less,
    less_equal,
    multiply,
    negate,
    number,
    power,
    sqrt,
    subtract,
)
from multibody_sym.scalars.traversal import postorder

_KINKS: Final = ("abs", "sign", "min", "max", "less", "less_equal", "where", "table")


@lru_cache(maxsize=4096)
def _has_kink(a: Node) -> bool:
    """Tell whether an expression may stay zero over a whole region, as max(x, 0) and |x| + x do."""
    return any(n.op in _KINKS for n in postorder([a]))


def _slope_of_root(a: Node, slope: Callable[[Node], Node], base: Node, applies: Node = ONE) -> Node:
    """Return slope(base), infinite at base = 0; where it `applies`, and `a` of which base is made has a kink, 0 there.

    A one-sided law, sqrt(max(x, 0)), is at zero over a whole region: what is infinite there times the derivative
    of `max`, zero, would be no number. At the very edge the slope on the flat side is as right as the infinite one.
    """
    if applies.shadow == 0.0 or not _has_kink(a):
        return slope(base)
    flat = where(applies, less_equal(absolute(base), ZERO), ZERO)
    return where(flat, ZERO, slope(where(flat, ONE, base)))


def _power_partials(n: Node, a: Node, b: Node) -> tuple[Node, Node]:
    is_root = less(multiply(b, subtract(b, ONE)), ZERO)
    left = _slope_of_root(a, lambda base: multiply(b, power(base, subtract(b, ONE))), a, is_root)
    return left, ZERO if b.shadow is not None else multiply(n, _slope_of_root(a, log, a))


def _sqrt_partials(n: Node, a: Node) -> tuple[Node]:
    return (_slope_of_root(a, lambda root: divide(ONE, multiply(TWO, root)), n),)


def _asin_slope(a: Node) -> Node:
    return _slope_of_root(a, lambda root: divide(ONE, root), sqrt(subtract(ONE, power(a, TWO))))


def _atan2_partials(n: Node, y: Node, x: Node) -> tuple[Node, Node]:
    square = add(power(x, TWO), power(y, TWO))
    return divide(x, square), negate(divide(y, square))


def _choice(condition: Node) -> tuple[Node, Node]:
    return where(condition, ONE, ZERO), where(condition, ZERO, ONE)


_PARTIALS: Final[dict[str, Callable[..., tuple[Node, ...]]]] = {
    "neg": lambda n, a: (number(-1),),
    "add": lambda n, a, b: (ONE, ONE),
    "mul": lambda n, a, b: (b, a),
    "div": lambda n, a, b: (divide(ONE, b), negate(divide(n, b))),
    "pow": _power_partials,
    "sin": lambda n, a: (cos(a),),
    "cos": lambda n, a: (negate(sin(a)),),
    "tan": lambda n, a: (add(ONE, power(n, TWO)),),
    "asin": lambda n, a: (_asin_slope(a),),
    "acos": lambda n, a: (negate(_asin_slope(a)),),
    "atan": lambda n, a: (divide(ONE, add(ONE, power(a, TWO))),),
    "atan2": _atan2_partials,
    "sinh": lambda n, a: (divide(add(exp(a), exp(negate(a))), TWO),),
    "cosh": lambda n, a: (divide(subtract(exp(a), exp(negate(a))), TWO),),
    "tanh": lambda n, a: (subtract(ONE, power(n, TWO)),),
    "exp": lambda n, a: (n,),
    "log": lambda n, a: (divide(ONE, a),),
    "sqrt": _sqrt_partials,
    "abs": lambda n, a: (sign(a),),
    "sign": lambda n, a: (ZERO,),
    "min": lambda n, a, b: _choice(less_equal(a, b)),
    "max": lambda n, a, b: _choice(less_equal(b, a)),
    "less": lambda n, a, b: (ZERO, ZERO),
    "less_equal": lambda n, a, b: (ZERO, ZERO),
    "where": lambda n, c, a, b: (ZERO, *_choice(c)),
    "table": lambda n, a: (table(n.data[0], n.data[1] + 1, a),),
}


_CHOICES: Final[dict[str, Callable[..., Node]]] = {
    "min": less_equal,
    "max": lambda a, b: less_equal(b, a),
    "where": lambda c, _a, _b: c,
}
"""The condition on which the first of the last two operands is chosen."""


def partials(node: Node) -> tuple[Node, ...]:
    """Return the derivatives of an operation with respect to each of its operands."""
    return _PARTIALS[node.op](node, *node.args)


def tangents(nodes: Iterable[Node], seeds: Mapping[Node, Node]) -> list[Node]:
    """Return the derivatives of `nodes` along the direction `seeds` (leaf -> its rate); other leaves are constant.

    With seeds {x: 1} this is d/dx; with {q: qdot, qdot: qddot, t: 1} it is the total derivative in time.
    """
    roots = list(nodes)
    rates: dict[Node, Node] = {}
    for n in postorder(roots):
        if not n.args:
            rates[n] = seeds.get(n, ZERO)
        elif all(rates[a] is ZERO for a in n.args):
            rates[n] = ZERO
        else:
            rates[n] = _combined(n, [rates[a] for a in n.args])
    return [rates[n] for n in roots]


def _combined(n: Node, rates: Sequence[Node]) -> Node:
    if n.op == "where":
        return where(n.args[0], rates[1], rates[2])
    total = ZERO
    for partial, rate in zip(partials(n), rates, strict=True):
        if rate is not ZERO:
            total = add(total, multiply(partial, rate))
    return total


def derivative(node: Node, leaf: Node) -> Node:
    """Return the partial derivative of `node` with respect to one leaf."""
    return tangents([node], {leaf: ONE})[0]


def gradient(node: Node, leaves: Sequence[Node]) -> list[Node]:
    """Return the partial derivatives of one `node` with respect to each leaf, in one backward pass."""
    return adjoints([(node, ONE)], leaves)


def pulled_back(n: Node, weight: Node) -> list[Node]:
    """Return the weights that an operation's operands get from its own: weight times each partial derivative.

    What is not chosen gets the weight 0, whatever its partial derivatives are: they may be no number there.
    """
    if n.op in _CHOICES:
        condition = _CHOICES[n.op](*n.args)
        chosen = [where(condition, weight, ZERO), where(condition, ZERO, weight)]
        return [ZERO, *chosen] if n.op == "where" else chosen
    return [_weighted(weight, partial) for partial in partials(n)]


def _weighted(weight: Node, partial: Node) -> Node:
    """Return weight * partial; 0 where the weight is 0 because something else was chosen."""
    if weight.op == "where" and ZERO in weight.args[1:] and partial.shadow is None:
        condition, first, second = weight.args
        return where(condition, _weighted(first, partial), _weighted(second, partial))
    if partial.shadow is None and _is_of_choices(weight):
        return where(less_equal(absolute(weight), ZERO), ZERO, multiply(weight, partial))
    return multiply(weight, partial)


def _is_of_choices(weight: Node) -> bool:
    """Tell whether every summand is 0 where something else was chosen."""
    rest = [weight]
    while rest:
        n = rest.pop()
        if n.op in ("add", "neg"):
            rest.extend(n.args)
        elif n.op == "mul":
            rest.append(n.args[n.args[0].shadow is not None])
        elif n.op != "where" or ZERO not in n.args[1:]:
            return False
    return True


def adjoints(seeds: Iterable[tuple[Node, Node]], leaves: Sequence[Node]) -> list[Node]:
    """Return, for each leaf, the sum over `seeds` (node, weight) of weight times d node / d leaf."""
    pairs = list(seeds)
    weights: dict[Node, Node] = {}
    for n, weight in pairs:
        weights[n] = add(weights.get(n, ZERO), weight)
    for n in reversed(list(postorder(n for n, _ in pairs))):
        weight = weights.get(n, ZERO)
        if weight is ZERO or not n.args or n.shadow is not None:
            continue
        for a, pulled in zip(n.args, pulled_back(n, weight), strict=True):
            if pulled is not ZERO:
                weights[a] = add(weights.get(a, ZERO), pulled)
    return [weights.get(leaf, ZERO) for leaf in leaves]
