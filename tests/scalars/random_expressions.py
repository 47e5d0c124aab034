"""Random expressions of a few symbols whose values are real and moderate everywhere."""

from __future__ import annotations

import numpy as np

from multibody_sym.scalars import functions as f
from multibody_sym.scalars.node import Node, as_node, symbol

LEAVES = [symbol(name) for name in "xyz"]


def tanh(a: Node) -> Node:
    return f.apply("tanh", a)


UNARY = [
    f.sin,
    f.cos,
    tanh,
    f.atan,
    f.absolute,
    f.sign,
    lambda a: f.tan(f.atan(a) / 2),
    lambda a: f.asin(tanh(a) / 2),
    lambda a: f.acos(tanh(a) / 2),
    lambda a: f.apply("sinh", f.sin(a)),
    lambda a: f.apply("cosh", f.sin(a)),
    lambda a: f.apply("asinh", a),
    lambda a: f.apply("acosh", a**2 + 2),
    lambda a: f.apply("atanh", tanh(a) / 2),
    lambda a: f.exp(f.sin(a)),
    lambda a: f.log(f.absolute(a) + 2),
    lambda a: f.sqrt(a**2 + 1),
    lambda a: a**3,
    lambda a: -a,
]
BINARY = [
    lambda a, b: a + b,
    lambda a, b: a - b,
    lambda a, b: a * b,
    lambda a, b: a / (b**2 + 1),
    lambda a, b: f.atan2(a, b**2 + 1),
    lambda a, b: (a**2 + 1) ** f.sin(b),
    f.minimum,
    f.maximum,
    lambda a, b: f.where(a < b, a + 2, b),
    lambda a, b: f.where(a <= b, a * b, a),
]


def random_expression(rng: np.random.Generator, depth: int = 5) -> Node:
    if depth == 0 or rng.random() < 0.1:
        constant = as_node(round(float(rng.uniform(-3, 3)), 1))
        return constant if rng.random() < 0.3 else LEAVES[int(rng.integers(3))]
    if rng.random() < 0.4:
        return UNARY[int(rng.integers(len(UNARY)))](random_expression(rng, depth - 1))
    operands = (random_expression(rng, depth - 1) for _ in range(2))
    return BINARY[int(rng.integers(len(BINARY)))](*operands)


def random_point(rng: np.random.Generator) -> dict[Node, float]:
    return {leaf: float(rng.uniform(-2, 2)) for leaf in LEAVES}
