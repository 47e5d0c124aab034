"""Order conditions of Runge-Kutta methods over all rooted trees, exactly for coefficients that are Fractions.

A rooted tree is the sorted tuple of its branches, each a tree; `()` is the single node. A method with coefficients
A, weights b and nodes c = A 1 has order p when every tree t of at most p nodes satisfies

    sum_i b_i Phi_i(t) = 1 / gamma(t)
    Phi_i((t1, .., tm)) = prod_k sum_j a_ij Phi_j(tk),   gamma((t1, .., tm)) = |t| prod_k gamma(tk)

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section II.2.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import cache
from math import prod
from typing import Any, TypeVar

Tree = tuple["Tree", ...]
Number = TypeVar("Number", Fraction, float)


@cache
def rooted_trees(size: int) -> tuple[Tree, ...]:
    """Return every rooted tree of `size` nodes once (1, 1, 2, 4, 9, 20, 48, ... of them), in a fixed order."""
    if size == 1:
        return ((),)
    return tuple(sorted({larger for tree in rooted_trees(size - 1) for larger in _with_one_more_leaf(tree)}))


def _with_one_more_leaf(tree: Tree) -> Iterator[Tree]:
    yield tuple(sorted((*tree, ())))
    for index, branch in enumerate(tree):
        for larger in _with_one_more_leaf(branch):
            yield tuple(sorted((*tree[:index], larger, *tree[index + 1 :])))


@cache
def node_count(tree: Tree) -> int:
    """Return |t|, the number of nodes of `tree`."""
    return 1 + sum(map(node_count, tree))


@cache
def density(tree: Tree) -> int:
    """Return gamma(t), the product over all nodes of the number of nodes above and including it."""
    return node_count(tree) * prod(map(density, tree))


def stage_weights(A: Sequence[Sequence[Number]], size: int) -> dict[Tree, list[Number]]:
    """Return Phi_i(t) by stage for every tree of at most `size` nodes of the method with coefficients `A`."""
    weights: dict[Tree, list[Number]] = {}
    branches: dict[Tree, list[Number]] = {}
    scalar: Any = next((type(a) for row in A for a in row), Fraction)
    zero, one = scalar(0), scalar(1)
    for nodes in range(1, size + 1):
        for tree in rooted_trees(nodes):
            phi = [prod((branches[t][i] for t in tree), start=one) for i in range(len(A))]
            weights[tree] = phi
            branches[tree] = [sum((a * p for a, p in zip(row, phi, strict=False) if a and p), zero) for row in A]
    return weights


def reached_order(weights: dict[Tree, list[Number]], b: Sequence[Number], tolerance: float = 0.0) -> int:
    """Return the order of the method with weights `b`, as far as the trees in `weights` can tell.

    Conditions count as satisfied to within `tolerance`.
    """
    wrong = (node_count(t) - 1 for t, phi in weights.items() if not _equal(_dot(b, phi), t, tolerance))
    return min(wrong, default=max(map(node_count, weights)))


def reached_dense_order(
    weights: dict[Tree, list[Number]], dense: Sequence[Sequence[Number]], tolerance: float = 0.0
) -> int:
    """Return the order of the extension b_i(theta) = sum_k dense[i][k] theta^(k+1), as far as `weights` can tell.

    It is p when sum_i b_i(theta) Phi_i(t) = theta^|t| / gamma(t) as polynomials for every tree of at most p nodes,
    to within `tolerance` for each coefficient.
    """
    columns = list(enumerate(zip(*dense, strict=True), 1))
    wrong = (
        node_count(t) - 1
        for t, phi in weights.items()
        if node_count(t) > len(columns)
        or any(not _equal(_dot(c, phi), t if k == node_count(t) else None, tolerance) for k, c in columns)
    )
    return min(wrong, default=max(map(node_count, weights)))


def _equal(value: Number, tree: Tree | None, tolerance: float) -> bool:
    """Tell whether `value` is 1 / gamma of the tree, or 0 without one."""
    wanted = Fraction(1, density(tree)) if tree is not None else Fraction(0)
    return bool(abs(value - wanted) <= tolerance)


def _dot(a: Sequence[Number], b: Sequence[Number]) -> Number:
    zero: Any = 0
    return sum((x * y for x, y in zip(a, b, strict=True) if x and y), zero)
