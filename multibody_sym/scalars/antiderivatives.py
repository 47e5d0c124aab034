"""Antiderivatives of laws F(x) in closed form, of the kinds that forces have, over Nodes.

Sums of c x^n, c (a x + b)^n, x^n times exp, sin or cos of a x + b, x F(a x^2 + b), tanh, |a x + b|, and the one-sided
max(0, a x + b) and min; products of sums are multiplied out. What is found is differentiated back and compared.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from fractions import Fraction
from typing import Final

from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.elementary import cos, cosh, exp, log, sin
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import ONE, TWO, ZERO, Node, absolute, as_node, number, power
from multibody_sym.scalars.traversal import leaves

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
        return _scaled(parts[0], -ONE)
    if node.op == "add":
        return _added([part for part in parts if part is not None])
    if node.op == "mul":
        return _multiplied(parts[0], parts[1])
    if node.op == "div":
        above = _terms(node.args[0], x, opened=opened)
        return _multiplied(above, _reciprocal(node.args[1], x))
    base, n = _power_of(node)
    if opened and base.op == "add" and n.denominator == 1 and 0 < n <= _HIGHEST:
        once = _terms(base, x, opened=True)
        found = once
        for _ in range(int(n) - 1):
            found = _multiplied(found, once)
        return found
    return {((base, n),): ONE}


def _reciprocal(below: Node, x: Node) -> _Sum:
    """Return 1/below, with its factors taken apart."""
    factor, product = ONE, _Product()
    for part in _factors(below):
        if _depends(part, x):
            base, n = _power_of(part)
            product = _joined(product, ((base, -n),))
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


def _joined(a: _Product, b: _Product) -> _Product:
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


def _scaled(terms: _Sum | None, factor: Node) -> _Sum | None:
    return None if terms is None else {product: c * factor for product, c in terms.items()}


def _added(parts: Iterable[_Sum]) -> _Sum | None:
    found: _Sum = {}
    for part in parts:
        for product, c in part.items():
            found[product] = found.get(product, ZERO) + c
    return found if len(found) <= _MOST_TERMS else None


def _multiplied(left: _Sum | None, right: _Sum | None) -> _Sum | None:
    if left is None or right is None:
        return None
    return _added({_joined(p, q): a * b} for p, a in left.items() for q, b in right.items())


# --- one product ---------------------------------------------------------------------------------------------------


def _of_product(product: _Product, x: Node) -> Node | None:
    """Return the antiderivative of a product: x^n times at most one other function of x."""
    n = sum((e for base, e in product if base is x), Fraction(0))
    others = [(base, e) for base, e in product if base is not x]
    if not others:
        return _of_power(x, n)
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


def _of_power(x: Node, n: Fraction) -> Node:
    return log(x) if n == -1 else power(x, number(n + 1)) / number(n + 1)


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
        sign, current = _next(current, sign)
    return total


def _next(op: str, sign: Node) -> tuple[Node, str]:
    """Return the function whose antiderivative follows in integration by parts, with its sign."""
    return {"exp": (sign, "exp"), "sin": (-sign, "cos"), "cos": (sign, "sin")}.get(op, (sign, op))


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
