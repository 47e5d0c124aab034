"""Whether conditions can hold together, and at which values of a parameter: against brute force and by hand."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest

from multibody_sym.scalars import linear_inequalities
from multibody_sym.scalars.linear_inequalities import Conditions, contradiction, extremes, feasible_set


def holds(conditions: Conditions) -> bool:
    """Return by brute force over vertices whether some x satisfies the conditions: a basis of equalities and limits."""
    equal, right, cone = conditions.equal, conditions.right, conditions.cone
    n = equal.shape[1]
    for count in range(n + 1):
        for active in combinations(range(len(cone)), count):
            matrix = np.vstack([equal, cone[list(active)]])
            x = np.linalg.lstsq(matrix, np.concatenate([right, np.zeros(count)]), rcond=None)[0]
            if np.abs(equal @ x - right).max() < 1e-9 and (cone @ x).min(initial=0.0) > -1e-9:
                return True
    return False


def drawn(rng: np.random.Generator) -> Conditions:
    equal, cone = rng.integers(-2, 3, (2, 4)).astype(float), rng.integers(-2, 3, (4, 4)).astype(float)
    return Conditions(equal, rng.integers(-3, 4, 2).astype(float), cone)


def test_what_can_hold_together_and_what_cannot_by_brute_force():
    rng, seen = np.random.default_rng(4), {True: 0, False: 0}
    for _ in range(150):
        conditions = drawn(rng)
        against = contradiction(conditions)
        seen[against is None] += 1
        assert (against is None) == holds(conditions)
    assert min(seen.values()) > 20


def test_what_holds_together_takes_no_linear_program(monkeypatch: pytest.MonkeyPatch) -> None:
    """Brute force knows what holds; least squares find an x there at a tenth of the cost."""
    taken: list[bool] = []
    program = linear_inequalities.linear_program

    def counted(*given: Any, **named: Any) -> Any:
        taken.append(True)
        return program(*given, **named)

    monkeypatch.setattr(linear_inequalities, "linear_program", counted)
    rng = np.random.default_rng(11)
    for _ in range(60):
        conditions = drawn(rng)
        taken.clear()
        contradiction(conditions)
        assert bool(taken) != holds(conditions)


def test_a_contradiction_proves_itself():
    """Farkas: weights of equalities and inequalities whose rows add to nothing, while the right sides do not."""
    rng = np.random.default_rng(7)
    for _ in range(150):
        conditions = drawn(rng)
        against = contradiction(conditions)
        if against is None:
            continue
        weights = against.weights_in(conditions)
        count = len(against.equal)
        assert np.abs(weights @ conditions.rows(against)).max() <= 1e-12 * np.abs(weights).max()
        assert (weights[count:] > 0.0).all()
        assert weights[:count] @ conditions.right[list(against.equal)] > 0.0
        assert np.linalg.matrix_rank(conditions.rows(against)) == len(weights) - 1


def block(mu: float, angle: float) -> Conditions:
    """Return the conditions of rest of a block on a slope: normal force and friction, up the slope."""
    limits = [[1.0, 0.0], [mu, -1.0], [mu, 1.0]]
    return Conditions(np.eye(2), 20.0 * np.array([np.cos(angle), np.sin(angle)]), np.array(limits))


def test_ends_are_found_to_the_last_bits():
    (found,) = feasible_set(lambda mu: block(mu, 0.5), np.linspace(0.0, 3.0, 20).tolist())
    assert found.low.value == pytest.approx(np.tan(0.5), rel=1e-15)
    assert (found.high.value, found.high.gives_way) == (3.0, None)
    assert found.low.gives_way is not None
    assert (found.low.gives_way.equal, found.low.gives_way.cone) == ((0, 1), (1,))


def test_several_intervals():
    """Forces -p (p - 1)(p - 3)(p - 4), 4 - p and 1 that may only push: p from 0 to 1 and from 3 to 4."""

    def conditions(p: float) -> Conditions:
        return Conditions(np.eye(3), np.array([-p * (p - 1.0) * (p - 3.0) * (p - 4.0), 4.0 - p, 1.0]), np.eye(3))

    found = feasible_set(conditions, [-1.0, -0.3, 0.4, 1.7, 2.2, 3.5, 5.0])
    pairs = [(x.low.value, x.high.value) for x in found]
    assert [low for low, _ in pairs] == pytest.approx([0.0, 3.0], abs=1e-14)
    assert [high for _, high in pairs] == pytest.approx([1.0, 4.0], abs=1e-14)


def test_a_value_that_stands_alone_between_two_contradictions():
    """Friction 1 under a unit load that one coefficient, p, and another, 2 - p, allow: p = 1 alone."""

    def conditions(p: float) -> Conditions:
        limits = np.array([[p, -1.0], [2.0 - p, -1.0]])
        return Conditions(np.eye(2), np.array([1.0, 1.0]), limits)

    (found,) = feasible_set(conditions, [-0.7, 0.45, 1.6, 2.9])
    assert (found.low.value, found.high.value) == pytest.approx((1.0, 1.0), rel=1e-15)


def test_equal_loads_alone_balance_each_other():
    """Two loads on a string: its tension is the weight of either, whatever the grid is."""

    def conditions(load: float) -> Conditions:
        return Conditions(np.array([[1.0], [1.0]]), np.array([20.0, 10.0 * load]), np.array([[1.0]]))

    (found,) = feasible_set(conditions, [0.1, 1.1, 3.1, 7.0])
    assert (found.low.value, found.high.value) == pytest.approx((2.0, 2.0), rel=1e-15)


def test_what_holds_at_all_values_but_the_first_begins_there():
    """A length that may be as small as one likes but not 0: the range begins at 0, not at the least float."""
    (found,) = feasible_set(lambda p: None if p == 0.0 else block(1.0, 0.5), [0.0, 1.0, 2.0])
    assert (found.low.value, found.high.value) == (0.0, 2.0)
    (found,) = feasible_set(lambda p: block(p, 1e-300 if p > 0.0 else 0.1), [0.0, 1.0, 2.0])
    assert (found.low.value, found.high.value) == (0.0, 2.0)


def test_extremes_of_what_is_linear():
    still = Conditions(np.eye(2), np.array([20.0, 0.0]), np.array([[1.0, 0.0], [0.3, -1.0], [0.3, 1.0]]))
    assert extremes(still, np.array([0.0, 1.0]), -np.inf, 1.0) == pytest.approx((-6.0, 6.0))
    assert extremes(still, np.array([1.0, 0.1]), 0.0, 1.0) == pytest.approx((0.0, np.inf))
    assert extremes(still, np.array([-1.0, 0.0]), 21.0, 1.0) is None
