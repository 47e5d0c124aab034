"""Slip that turns in an impact, by quadrature over its direction, is the solution of its equations in the impulse."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from multibody_sym.contact_laws.routh_method import COMPRESSED, Goal, Normal, TurnedSlip, follow_turning_slip, turns


def stepped(K: np.ndarray, mu: float, v: np.ndarray, at: Normal, way: TurnedSlip) -> np.ndarray:
    """Return v_n, v_t (2), p_t (2), W and the loss by friction at the same normal impulse, by steps of order 8."""

    def rates(_: float, y: np.ndarray) -> list[float]:
        speed = float(np.hypot(y[1], y[2]))
        f = np.array([1.0, -mu * y[1] / speed, -mu * y[2] / speed])
        return [*(K @ f), f[1], f[2], y[0], mu * speed]

    y0, dp = [at.v, *v, 0.0, 0.0, 0.0, 0.0], way.at.p - at.p
    found = solve_ivp(rates, (0.0, dp), y0, method="DOP853", rtol=1e-13, atol=1e-13 * float(np.abs(v).max()))
    assert found.success
    return np.asarray(found.y[:, -1])


@pytest.mark.parametrize("seed", range(40))
def test_it_is_the_solution_in_small_steps(seed: int) -> None:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(3, 4)) * 10.0 ** rng.uniform(-1, 1, size=(3, 1))
    K, mu, v = A @ A.T, 10.0 ** rng.uniform(-2, 0.5), rng.normal(size=2) * 10.0 ** rng.uniform(-1, 1)
    at = Normal(-(10.0 ** rng.uniform(-2, 1)))
    goal = (COMPRESSED, Goal("p", 10.0 ** rng.uniform(-3, 0)), Goal("v", 0.3 * abs(at.v)))[seed % 3]
    assert turns(K, mu, v)
    way = follow_turning_slip(K, mu, v, at, goal)
    speeds, impulses = abs(at.v) + np.abs(v).max(), way.at.p * max(1.0, mu)
    if not way.velocity.any():  # slip has stopped, where steps of order 8 do not lead
        assert K[1:, 0] * way.at.p + K[1:, 1:] @ way.impulse == pytest.approx(-v, abs=1e-12 * speeds)
        return
    y = stepped(K, mu, v, at, way)
    assert [way.at.v, *way.velocity] == pytest.approx(y[:3], abs=1e-11 * speeds)
    assert way.impulse == pytest.approx(y[3:5], abs=1e-11 * impulses)
    assert [way.at.W, way.lost] == pytest.approx(y[5:], abs=1e-11 * impulses * speeds)
    assert not way.ended or goal.missing(way.at) == 0.0


def test_an_end_at_once_is_as_exact() -> None:
    """What closes a million times slower than it slips ends in a part of the first panel that is as small."""
    K, mu, v = np.diag([3.0, 1.0, 2.0]) + 0.3, 0.4, np.array([50.0, -80.0])
    way = follow_turning_slip(K, mu, v, Normal(-1e-5), COMPRESSED)
    y = stepped(K, mu, v, Normal(-1e-5), way)
    assert way.ended
    assert abs(y[0]) < 1e-16


@pytest.mark.parametrize("power", range(1, 14))
def test_slip_that_leaves_a_direction_in_which_it_would_stay_is_as_exact(power: int) -> None:
    """Beside such a direction it turns by next to nothing, until it is far from it."""
    K, mu = np.array([[1.03, 0.284, 0.165], [0.284, 0.501, -0.263], [0.165, -0.263, 0.673]]), 0.42

    def across(phi: float) -> float:
        """Return how fast slip along phi turns away."""
        e = np.array([np.cos(phi), np.sin(phi)])
        a = K[1:, 0] - mu * (K[1:, 1:] @ e)
        return float(e[0] * a[1] - e[1] * a[0])

    stays = float(brentq(across, -3.5, -2.0, xtol=1e-16))
    for beside in (10.0**-power, -(10.0**-power)):
        phi = stays + beside
        assert across(phi) * beside > 0.0
        for closing in (-2.4, -20.0):
            v = np.array([np.cos(phi), np.sin(phi)])
            way = follow_turning_slip(K, mu, v, Normal(closing), COMPRESSED)
            if not way.velocity.any():
                assert K[1:, 0] * way.at.p + K[1:, 1:] @ way.impulse == pytest.approx(-v, abs=1e-12)
                continue
            y = stepped(K, mu, v, Normal(closing), way)
            assert [way.at.v, *way.velocity] == pytest.approx(y[:3], abs=1e-11 * abs(closing))
