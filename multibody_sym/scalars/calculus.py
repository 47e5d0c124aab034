"""Exact derivatives of Node expressions, forward (tangents) and reverse (gradients)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Final

from multibody_sym.scalars.elementary import cos, cosh, exp, leaves, log, postorder, sign, sin, table, where
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import (
    ONE,
    TWO,
    ZERO,
    Node,
    absolute,
    add,
    as_node,
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
    "asinh": lambda n, a: (divide(ONE, sqrt(add(power(a, TWO), ONE))),),
    "acosh": lambda n, a: (_slope_of_root(a, lambda x: divide(ONE, x), sqrt(subtract(power(a, TWO), ONE))),),
    "atanh": lambda n, a: (divide(ONE, subtract(ONE, power(a, TWO))),),
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
            rates[n] = _total_rate(n, [rates[a] for a in n.args])
    return [rates[n] for n in roots]


def _total_rate(n: Node, rates: Sequence[Node]) -> Node:
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
    return [_weigh(weight, partial) for partial in partials(n)]


def _weigh(weight: Node, partial: Node) -> Node:
    """Return weight * partial; 0 where the weight is 0 because something else was chosen."""
    if weight.op == "where" and ZERO in weight.args[1:] and partial.shadow is None:
        condition, first, second = weight.args
        return where(condition, _weigh(first, partial), _weigh(second, partial))
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


# ----------------------------------------------------------------------------------------------------------------------
# Antiderivatives of laws F(x) in closed form, of the kinds that forces have, over Nodes.
#
# Sums of c x^n, c (a x + b)^n, x^n times exp, sin or cos of a x + b, x F(a x^2 + b), tanh, |a x + b|, and the one-
# sided max(0, a x + b) and min; products of sums are multiplied out. What is found is differentiated back and
# compared.


_MOST_TERMS: Final = 60
_HIGHEST: Final = 24
"""Powers past which no product is multiplied out."""
_LEAVES: Final = ("slot", "quantity", "symbol")
_SAME: Final = 1e-9
_LOOKED_AT: Final = (0.37, 0.83, 1.71)
"""Places at which an antiderivative is differentiated back, in numbers."""

_Product = tuple[tuple[Node, Fraction], ...]
"""Functions of x with their exponents."""
_Sum = dict[_Product, Node]
"""Products with their factors, in which there is no x."""


def antiderivative(law: Node, x: Node) -> Node | None:
    """Return V with dV/dx = law for x > 0, everything else held constant; None where no rule finds one."""
    for opened in (False, True):
        terms = _terms(law, x, opened=opened)
        parts = [] if terms is None else [(c, _of_product(product, x)) for product, c in terms.items()]
        if not parts or any(found is None for _, found in parts):
            continue
        total = ZERO
        for factor, found in parts:
            total = total + factor * as_node(found)
        if _differentiates_back(total, law, x):
            return total
    return None


def _depends(node: Node, x: Node) -> bool:
    return any(leaf is x for leaf in leaves([node], *_LEAVES))


# --- sums of products ----------------------------------------------------------------------------------------------


def _terms(node: Node, x: Node, *, opened: bool) -> _Sum | None:
    """Return a law as a sum of products, powers of sums multiplied out if `opened`; None where they are too many."""
    if not _depends(node, x):
        return {(): node}
    parts = [_terms(part, x, opened=opened) for part in node.args] if node.op in ("neg", "add", "mul") else []
    if any(part is None for part in parts):
        return None
    if node.op == "neg":
        return {product: c * -ONE for product, c in parts[0].items()} if parts[0] is not None else None
    if node.op == "add":
        return _add_sums([part for part in parts if part is not None])
    if node.op == "mul":
        return _multiply_sums(parts[0], parts[1])
    if node.op == "div":
        above = _terms(node.args[0], x, opened=opened)
        return _multiply_sums(above, _reciprocal(node.args[1], x))
    base, n = _power_of(node)
    if opened and base.op == "add" and n.denominator == 1 and 0 < n <= _HIGHEST:
        once = _terms(base, x, opened=True)
        found = once
        for _ in range(int(n) - 1):
            found = _multiply_sums(found, once)
        return found
    return {((base, n),): ONE}


def _reciprocal(below: Node, x: Node) -> _Sum:
    """Return 1/below, with its factors taken apart."""
    factor, product = ONE, _Product()
    for part in _factors(below):
        if _depends(part, x):
            base, n = _power_of(part)
            product = _join_products(product, ((base, -n),))
        else:
            factor = factor / part
    return {product: factor}


def _factors(node: Node) -> Iterator[Node]:
    if node.op == "mul":
        for part in node.args:
            yield from _factors(part)
    elif node.op == "neg":
        yield -ONE
        yield from _factors(node.args[0])
    else:
        yield node


def _join_products(a: _Product, b: _Product) -> _Product:
    """Return a product of products; the same functions have one exponent, in an order that does not matter."""
    exponents: dict[Node, Fraction] = {}
    growth = ZERO
    for base, n in (*a, *b):
        if base.op == "exp":
            growth = growth + number(n) * base.args[0]
        else:
            exponents[base] = exponents.get(base, Fraction(0)) + n
    if growth is not ZERO:
        exponents[exp(growth)] = Fraction(1)
    return tuple(sorted(((base, n) for base, n in exponents.items() if n), key=str))


def _add_sums(parts: Iterable[_Sum]) -> _Sum | None:
    found: _Sum = {}
    for part in parts:
        for product, c in part.items():
            found[product] = found.get(product, ZERO) + c
    return found if len(found) <= _MOST_TERMS else None


def _multiply_sums(left: _Sum | None, right: _Sum | None) -> _Sum | None:
    if left is None or right is None:
        return None
    return _add_sums({_join_products(p, q): a * b} for p, a in left.items() for q, b in right.items())


# --- one product ---------------------------------------------------------------------------------------------------


def _of_product(product: _Product, x: Node) -> Node | None:
    """Return the antiderivative of a product: x^n times at most one other function of x."""
    n = sum((e for base, e in product if base is x), Fraction(0))
    others = [(base, e) for base, e in product if base is not x]
    if not others:
        return log(x) if n == -1 else power(x, number(n + 1)) / number(n + 1)
    if len(others) > 1:
        return None
    ((base, exponent),) = others
    slope = derivative(base, x)
    if n == 0 and not _depends(slope, x) and slope is not ZERO:
        return _over(_of_power_of_linear(base, exponent), slope)
    if n == 1 and _is_square(base, x):
        return _over(_of_power_of_linear(base, exponent), derivative(slope, x))
    return _of_function(base, n, x) if exponent == 1 else None


def _over(a: Node, b: Node) -> Node:
    """Return a / b, where b may be a fraction itself."""
    if b.op == "neg":
        return -_over(a, b.args[0])
    return a * b.args[1] / b.args[0] if b.op == "div" else a / b


def _power_of(node: Node) -> tuple[Node, Fraction]:
    """Return a node as a power of a base, with a number as exponent."""
    if node.op == "sqrt":
        base, exponent = _power_of(node.args[0])
        return base, exponent / 2
    if node.op == "pow" and node.args[1].op == "number":
        base, exponent = _power_of(node.args[0])
        return base, exponent * Fraction(node.args[1].data)
    return node, Fraction(1)


def _of_power_of_linear(base: Node, n: Fraction) -> Node:
    """Return the antiderivative of base^n with respect to base, which may have any sign."""
    return log(absolute(base)) if n == -1 else power(base, number(n + 1)) / number(n + 1)


def _is_square(base: Node, x: Node) -> bool:
    """Return whether a base is a x^2 + b."""
    slope = derivative(base, x)
    curvature = derivative(slope, x)
    if curvature is ZERO or _depends(curvature, x):
        return False
    (at_zero,) = evaluate([slope], lambda leaf: ZERO if leaf is x else leaf)
    return at_zero is ZERO


def _of_function(node: Node, n: Fraction, x: Node) -> Node | None:
    """Return the antiderivative of x^n f(g(x))."""
    if node.op in ("max", "min"):
        return _one_sided(node, x) if n == 0 else None
    if len(node.args) != 1:
        return None
    (inner,) = node.args
    slope = derivative(inner, x)
    if n == 1 and _is_square(inner, x):
        outer = _simple(node.op, inner)
        return None if outer is None else _over(outer, derivative(slope, x))
    if slope is ZERO or _depends(slope, x) or n < 0 or n.denominator != 1:
        return None
    if node.op == "abs" and n == 0:
        return _over(inner * absolute(inner) / TWO, slope)
    return _by_parts(node.op, inner, slope, int(n), x)


def _by_parts(op: str, inner: Node, slope: Node, n: int, x: Node) -> Node | None:
    """Return the antiderivative of x^n f(inner), inner linear: by parts n times, x^n F - n x^(n - 1) ..."""
    total, factor, current = ZERO, ONE, op
    sign = ONE
    for k in range(n, -1, -1):
        outer = _simple(current, inner)
        if outer is None or (k and current not in ("exp", "sin", "cos")):
            return None
        part = sign * factor * power(x, number(k)) * outer
        for _ in range(n - k + 1):
            part = _over(part, slope)
        total = total + part
        factor, sign = factor * number(k), -sign
        # the function whose antiderivative follows, with its sign
        sign, current = {"sin": (-sign, "cos"), "cos": (sign, "sin")}.get(current, (sign, current))
    return total


def _simple(op: str, inner: Node) -> Node | None:
    """Return the antiderivative of f(g) with respect to g."""
    if op == "exp":
        return exp(inner)
    if op == "sin":
        return -cos(inner)
    if op == "cos":
        return sin(inner)
    if op == "tanh":
        return log(cosh(inner))
    return None


def _one_sided(node: Node, x: Node) -> Node | None:
    """Return the antiderivative of max(0, a x + b) or min: the same squared over 2 a."""
    a, b = node.args
    inner = b if a is ZERO else a if b is ZERO else None
    if inner is None:
        return None
    slope = derivative(inner, x)
    return None if slope is ZERO or _depends(slope, x) else _over(power(node, TWO) / TWO, slope)


# --- the proof -----------------------------------------------------------------------------------------------------


def _differentiates_back(found: Node, law: Node, x: Node) -> bool:
    """Return whether the slope of what was found is the law, at several places and values of everything else."""
    slope = as_node(derivative(found, x))
    others = [leaf for leaf in leaves([slope, law], *_LEAVES) if leaf is not x]
    for place in _LOOKED_AT:
        given = {leaf: 0.61 + 0.23 * math.sin(5.0 * k + place) for k, leaf in enumerate(others)}
        try:
            left, right = evaluate_float([slope, law], {**given, x: place})
        except (ArithmeticError, ValueError):
            return False
        if not abs(left - right) <= _SAME * (1.0 + abs(right)):
            return False
    return True
