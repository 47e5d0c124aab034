"""Rooted trees and order conditions against what is known about them in closed form."""

from collections import Counter
from fractions import Fraction
from math import factorial, prod

import pytest

from multibody_sym.motion.methods.explicit import (
    EXPLICIT,
    density,
    node_count,
    reached_dense_order,
    reached_order,
    rooted_trees,
    stage_weights,
)

METHODS = {name: make() for name, make in EXPLICIT.items()}


def symmetry(tree):
    return prod(factorial(many) * symmetry(branch) ** many for branch, many in Counter(tree).items())


@pytest.mark.parametrize(("size", "count"), list(enumerate((1, 1, 2, 4, 9, 20, 48, 115, 286), 1)))
def test_there_are_as_many_rooted_trees_as_combinatorics_says(size, count):
    trees = rooted_trees(size)
    assert len(set(trees)) == len(trees) == count
    assert all(node_count(tree) == size for tree in trees)


@pytest.mark.parametrize("size", range(1, 8))
def test_monotonic_labellings_of_all_trees_are_the_permutations_of_all_nodes_but_the_root(size):
    labellings = [Fraction(factorial(size), density(t) * symmetry(t)) for t in rooted_trees(size)]
    assert sum(labellings) == factorial(size - 1)


def test_bushy_and_tall_trees_give_the_quadrature_and_exponential_conditions():
    method = METHODS["rk4"]
    weights = stage_weights(method.A, 4)
    bushy, tall = ((), (), ()), ((((),),),)
    assert weights[bushy] == [c**3 for c in method.c]
    assert (density(bushy), density(tall)) == (4, 24)
    assert weights[tall][3] == Fraction(1, 4)  # a43 a32 a21


def test_order_is_lost_with_any_changed_coefficient():
    method = METHODS["dormand_prince"]
    b = (*method.A[-1], Fraction(0))
    for row in range(2, 6):
        for column in range(row):
            changed = [list(r) for r in method.A]
            changed[row][column] += Fraction(1, 10**9)
            assert reached_order(stage_weights(changed, 6), b) < 5


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_each_method_has_exactly_the_order_it_claims(method):
    """In rational arithmetic also where the coefficients are decimals, published with thirty digits."""
    tolerance, more = (1e-25, 1) if method.decimals else (0.0, 2)
    weights = stage_weights((*method.A, *method.extra), method.order + more)
    b = (*method.A[-1], *[Fraction(0)] * (1 + len(method.extra)))
    assert reached_order(weights, b, tolerance) == method.order
    assert reached_dense_order(weights, method.dense, tolerance) == method.dense_order
    for error, order in ((method.error, method.fine_order), (method.coarse, method.coarse_order)):
        if error is not None:
            b_hat = [x - e for x, e in zip(b, (*error, *b[method.stages :]), strict=True)]
            assert reached_order(weights, b_hat, tolerance) == order
