"""Displacements of a ball against derivatives by central differences."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.motion.integrator.flow import Pairing

BALL = Pairing(4, (), ((0, 0),))
AXIS = np.array([0.36, 0.48, 0.8])


def phi(t: float) -> np.ndarray:
    return np.array([0.3 + t - 0.5 * t**2, 0.2 * np.sin(3 * t), -0.4 + 0.7 * t])


def start() -> np.ndarray:
    return np.array([0.5, -0.5, 0.1, 0.7]) / np.linalg.norm([0.5, -0.5, 0.1, 0.7])


def angular_velocity(scale: float, t: float) -> np.ndarray:
    """Return w from the quaternion's rate: (0, w) = 2 conj(q) q'."""
    d = 1e-5
    q, rate = BALL.moved(start(), scale * phi(t)), np.zeros(4)
    for weight, k in ((8, 1), (-8, -1), (-1, 2), (1, -2)):
        rate += weight * BALL.moved(start(), scale * phi(t + k * d)) / (12 * d)
    vector = q[0] * rate[1:] - rate[0] * q[1:] - np.cross(q[1:], rate[1:])
    return 2 * vector


@pytest.mark.parametrize("scale", [1e-3, 0.01, 0.5, 1.0, 1.3, 3.0])
def test_speeds_and_second_derivatives(scale: float) -> None:
    t, d = 0.3, 1e-4
    now, first, second = phi(t), (phi(t + d) - phi(t - d)) / (2 * d), (phi(t + d) - 2 * phi(t) + phi(t - d)) / d**2
    w = BALL.speeds(scale * now, scale * first)
    np.testing.assert_allclose(w, angular_velocity(scale, t), rtol=1e-6, atol=1e-8 * scale)
    wdot = (angular_velocity(scale, t + d) - angular_velocity(scale, t - d)) / (2 * d)
    np.testing.assert_allclose(BALL.accelerations(scale * now, w, wdot), scale * second, rtol=1e-4, atol=1e-4 * scale)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-3, 1.0, 3.1])
def test_a_displacement_leads_to_where_it_was_measured(angle: float) -> None:
    there = BALL.moved(start(), angle * AXIS)
    assert np.linalg.norm(there) == pytest.approx(1.0, abs=1e-15)
    for sign in (1, -1):  # both quaternions are the same orientation
        np.testing.assert_allclose(BALL.displacement(start(), sign * there, 3), angle * AXIS, atol=1e-14)
    assert BALL.farthest_turn(angle * AXIS) == pytest.approx(angle)
