"""Methods as data: what construction refuses, and what the continuous extensions promise."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from test_order_conditions import symmetry

from multibody_sym.motion.methods.explicit import EXPLICIT, RungeKutta, density, hermite, rooted_trees, stage_weights

METHODS = {name: make() for name, make in EXPLICIT.items()}
RK4, DP = METHODS["rk4"], METHODS["dormand_prince"]


def test_the_table_holds_the_methods_of_the_first_release():
    orders = {name: (m.order, m.error_order, m.dense_order) for name, m in METHODS.items()}
    assert orders == {
        "explicit_euler": (1, 0, 1),
        "midpoint": (2, 0, 2),
        "heun": (2, 0, 2),
        "rk4": (4, 0, 3),
        "bogacki_shampine": (3, 2, 3),
        "dormand_prince": (5, 4, 4),
        "dormand_prince_8": (8, 7, 7),
    }


def test_another_explicit_method_is_one_more_record():
    rows = ((), (Fraction(1, 3),), (Fraction(0), Fraction(2, 3)), (Fraction(1, 4), Fraction(0), Fraction(3, 4)))
    c = tuple(sum(row, Fraction(0)) for row in rows)
    b = (*rows[-1], Fraction(0))
    assert RungeKutta("heun3", rows, c, 3, hermite(b), 3).tableau.order == 3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"order": 3}, "the order is 3"),
        ({"order": 5}, "the order is 5"),
        ({"c": (Fraction(0), Fraction(1, 2), Fraction(1, 2), Fraction(1, 2), Fraction(1))}, "c_i is the sum"),
        ({"dense_order": 4}, "extension has order 4"),
        ({"dense": RK4.dense[:-1]}, "one entry a stage"),
        ({"dense": tuple((*row[:-1], row[-1] + 1) for row in RK4.dense)}, "ends at x_new"),
        ({"A": (*RK4.A[:-1], RK4.A[-1][:-1])}, "row i of A"),
        ({"error_order": 3}, "an error estimate has an order"),
        ({"error": RK4.A[-1], "error_order": 2}, "error has one entry a stage"),
    ],
)
def test_construction_refuses_what_is_not_true(change, message):
    with pytest.raises(ValueError, match=message):
        replace(RK4, **change)


def test_construction_refuses_a_wrong_embedded_order():
    with pytest.raises(ValueError, match="the embedded order is 3"):
        replace(DP, error_order=3)
    with pytest.raises(ValueError, match="the order is 5"):
        replace(DP, A=(*DP.A[:-1], (*DP.A[-1][:-2], DP.A[-1][-2] + 1, DP.A[-1][-1] - 1)))


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_extensions_join_with_the_slopes_at_both_ends(method):
    at_start = [row[0] for row in method.dense]
    at_end = [sum(power * x for power, x in enumerate(row, 1)) for row in method.dense]
    more = [0] * len(method.extra)
    near = {"abs": 1e-20} if method.decimals else {"abs": 0, "rel": 0}
    assert at_start == pytest.approx([1, *[0] * (method.stages - 1), *more], **near)
    assert at_end == pytest.approx([*[0] * (method.stages - 1), 1, *more], **near)


def mean_square(dense):
    """The fifth-order error coefficients of an extension of Dormand-Prince, squared and averaged over the step."""
    weights = stage_weights(DP.A, 5)
    total = Fraction(0)
    for tree in rooted_trees(5):
        error = [sum(row[k] * phi for row, phi in zip(dense, weights[tree], strict=True)) for k in range(4)]
        error = [x / symmetry(tree) for x in (*error, Fraction(-1, density(tree)))]
        total += sum(x * y / (i + j + 3) for i, x in enumerate(error) for j, y in enumerate(error))
    return total


def test_the_extension_of_dormand_prince_is_the_best_of_its_family():
    family = [Fraction(x) for x in ["-71/1440", "0", "568/3339", "-71/48", "17253/8480", "-176/105", "1"]]

    def member(s):
        bump = ((0, x, -2 * x, x) for x in (s * f for f in family))
        return tuple(
            tuple(a + b for a, b in zip(row, extra, strict=True)) for row, extra in zip(DP.dense, bump, strict=True)
        )

    replace(DP, dense=member(Fraction(1, 3)))  # is an extension of order 4 as well
    step = Fraction(1, 1000)
    here, before, after = (mean_square(member(s)) for s in (Fraction(0), -step, step))
    assert before == after > here


def test_the_floating_point_tableau_is_the_exact_one():
    tableau = DP.tableau
    assert tableau.A.shape == (7, 7)
    assert tableau.A[6, 4] == float(Fraction(-2187, 6784))
    np.testing.assert_allclose(tableau.A.sum(axis=1), tableau.c, rtol=1e-14)
    assert abs(tableau.error.sum()) < 1e-16
    assert DP.tableau.end_in_error
    assert not RK4.tableau.end_in_error
