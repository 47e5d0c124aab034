"""Collocation methods as data: what construction refuses, and their coefficients by other routes."""

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

from multibody_sym.motion.methods.explicit import density, rooted_trees, stage_weights
from multibody_sym.motion.methods.multistep import IMPLICIT, surd

METHODS = {name: make() for name, make in IMPLICIT.items()}
EVERY = pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)


def test_the_table_holds_these_methods():
    found = {name: (m.order, m.error_order, m.dense_order, m.stiffly_accurate) for name, m in METHODS.items()}
    assert found == {
        "implicit_euler": (1, 1, 1, True),
        "implicit_midpoint": (2, 0, 2, False),
        "trapezoid": (2, 0, 2, True),
        "gauss_4": (4, 0, 3, False),
        "gauss_6": (6, 0, 3, False),
        "radau_3": (3, 2, 2, True),
        "radau_5": (5, 3, 3, True),
    }


@EVERY
def test_the_order_conditions_of_rooted_trees_hold_to_the_order_and_no_further(method):
    """Another route than the simplifying conditions that construction checks."""
    A, b = np.array(method.A, dtype=float), np.array(method.b, dtype=float)
    weights = stage_weights(A.tolist(), method.order + 1)
    for size in range(1, method.order + 2):
        errors = [abs(float(b @ np.array(weights[t])) - 1 / density(t)) for t in rooted_trees(size)]
        assert (max(errors) < 1e-15 * 10) == (size <= method.order)


def test_published_coefficients():
    gauss, radau = METHODS["gauss_4"], METHODS["radau_5"]
    wanted = [[1 / 4, 1 / 4 - sqrt(3) / 6], [1 / 4 + sqrt(3) / 6, 1 / 4]]
    np.testing.assert_allclose(np.array(gauss.A, dtype=float), wanted, rtol=1e-15)
    r = sqrt(6)
    wanted = [
        [(88 - 7 * r) / 360, (296 - 169 * r) / 1800, (-2 + 3 * r) / 225],
        [(296 + 169 * r) / 1800, (88 + 7 * r) / 360, (-2 - 3 * r) / 225],
        [(16 - r) / 36, (16 + r) / 36, 1 / 9],
    ]
    np.testing.assert_allclose(np.array(radau.A, dtype=float), wanted, rtol=2e-15)
    scheme = radau.scheme
    np.testing.assert_allclose(scheme.error, [(-13 - 7 * r) / 3, (-13 + 7 * r) / 3, -1 / 3], rtol=1e-13)
    assert scheme.gamma == pytest.approx(3.637834252744496, rel=1e-14)
    assert (scheme.alpha, scheme.beta) == pytest.approx((2.681082873627752, 3.050430199247411), rel=1e-14)


@EVERY
def test_the_transformed_matrix_is_the_inverse_of_the_coefficients(method):
    s = method.scheme
    blocks = np.zeros_like(s.W)
    single = len(blocks) % 2
    blocks[:single, :single] = s.gamma
    if s.beta:
        blocks[single:, single:] = [[s.alpha, -s.beta], [s.beta, s.alpha]]
    np.testing.assert_allclose(s.T @ blocks @ s.T_inverse, s.W, atol=1e-13)
    explicit = method.stages - len(s.c)
    A = np.array(method.A, dtype=float)[explicit:, explicit:]
    np.testing.assert_allclose(s.W @ A, np.eye(len(s.c)), atol=1e-13)


@EVERY
@pytest.mark.parametrize("z", [-1e-3, -1.0, -30.0, 5j, -1e8])
def test_stability(method, z):
    """|R(z)| <= 1 in the left half plane; on the axis Gauss methods keep it at 1; Radau methods and Euler damp."""
    A, b = np.array(method.A, dtype=float), np.array(method.b, dtype=float)
    size = abs(1 + z * (b @ np.linalg.solve(np.eye(len(b)) - z * A, np.ones(len(b)))))
    assert size <= 1 + 1e-7
    damps = method.error_order > 0
    if z == 5j:
        assert (abs(size - 1) < 1e-14) != damps
    if z == -1e8:
        assert (size < 1e-6) == damps


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("gauss_4", {"order": 3}, "the order is 3"),
        ("gauss_4", {"order": 5}, r"B\(5\) holds"),
        ("gauss_4", {"c": (surd("1/2"), surd("1/4"))}, "nodes increase"),
        ("radau_5", {"error_order": 2}, "order of the stages"),
        ("radau_3", {"c": (surd("1/3"), surd("4/3"))}, "in the step"),
    ],
)
def test_construction_refuses_what_is_not_true(name, change, message):
    with pytest.raises(ValueError, match=message):
        replace(METHODS[name], **change)


def test_surds_are_a_field():
    x, y = surd("1/2", "-1/3", 5), surd("2", "7/4", 5)
    assert (x * y) / y == x
    assert (x + y) - y == x
    assert (x**3) == x * x * x
    assert float(x / y) == pytest.approx((1 / 2 - sqrt(5) / 3) / (2 + 7 / 4 * sqrt(5)), rel=1e-15)
