"""Random formulas over sympy, of the kinds that mechanics makes."""

from __future__ import annotations

import random
from typing import Any

import sympy
from sympy import cos, sin

m1, k, L = sympy.symbols("m1 k l", positive=True)
a, b, u, v = sympy.symbols("a b u v", real=True)

_LEAVES = [m1, k, L, a, u, v, sympy.Integer(2), sympy.Rational(1, 2), sin(a), cos(a), sin(b), cos(b)]


def random_formula(rng: random.Random, depth: int) -> Any:
    """Return a formula of sums, products, roots, quotients and sines, `depth` operations deep."""
    kind = rng.random()
    if depth == 0 or kind < 0.15:
        return rng.choice(_LEAVES)
    first, second = (random_formula(rng, depth - 1) for _ in range(2))
    makers = [
        (0.50, lambda: first + second),
        (0.80, lambda: first * second),
        (0.85, lambda: first**2),
        (0.88, lambda: sympy.sqrt(first**2 + second**2 + 1)),
        (0.92, lambda: 1 / (first**2 + 1)),
        (0.96, lambda: (first**2 + second**2 + 3) ** sympy.Rational(-3, 2)),
        (1.00, lambda: sin(first + second)),
    ]
    return next(make for limit, make in makers if kind < limit)()
