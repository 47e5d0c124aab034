"""Examples in which something moves as prescribed: equations by hand, closed forms of reactions, Jacobi's integral."""

from __future__ import annotations

import numpy as np
import pytest
from runs import Floats, G, by_hand, simulated


def test_the_scale_reads_what_the_lift_s_acceleration_adds() -> None:
    h, T, m = 12.0, 8.0, 70.0
    run = simulated("lift", T, samples=33)
    phase = 2 * np.pi * run.t / T
    assert run["reading"] == pytest.approx(m * (G + h * 2 * np.pi / T**2 * np.sin(phase)), rel=1e-12)
    assert run["speed"] == pytest.approx(h / T * (1 - np.cos(phase)), abs=1e-12)


def test_the_bead_climbs_as_the_equation_by_hand_says() -> None:
    m, R, w = 0.1, 0.3, 8.0

    def accelerations(t: float, q: Floats, u: Floats) -> list[float]:
        return [np.sin(q[0]) * (w**2 * np.cos(q[0]) - G / R)]

    run = simulated("bead_on_hoop", 4.0, samples=81)
    (theta,) = by_hand(accelerations, [np.radians(2)], run.t)
    assert np.abs(run["theta"] - theta).max() < 1e-8
    assert theta.max() > np.arccos(G / (R * w**2))
    turning = m * R**2 * w * np.sin(2 * run["theta"]) * run["u_theta"]  # d/dt of m (R sin(theta))^2 w
    assert np.abs(run["motor"] - turning).max() < 1e-10
    assert np.ptp(run["jacobi"]) < 1e-10
    assert np.ptp(run["energy"]) > 0.1


def test_the_housing_follows_equations_by_hand() -> None:
    shake, w, M, m, e, spin, k, c = 1e-3, 60.0, 8.0, 2.0, 0.5e-3, 157.08, 2e4, 60.0

    def accelerations(t: float, q: Floats, u: Floats) -> list[float]:
        floor, unbalance = -shake * w**2 * np.sin(w * t), m * e * spin**2 * np.sin(spin * t)
        return [(-k * q[0] - c * u[0] + unbalance) / (M + m) - floor - G]

    run = simulated("shaken_rotor", 0.5, samples=51)
    (y,) = by_hand(accelerations, [-(M + m) * G / k], run.t)
    assert np.abs(run["y"] - y).max() < 1e-10
    assert np.abs(run["height"] - y - shake * np.sin(w * run.t)).max() < 1e-10
    assert np.abs(run["floor"] + k * run["y"] + c * run["u_y"]).max() < 1e-6
