"""The examples move as other routes say: elliptic functions, equations of motion by hand, known frequencies."""

from __future__ import annotations

import numpy as np
import pytest
from runs import Floats, G, by_hand, simulated
from scipy.special import ellipj, ellipk, roots_laguerre
from twins import from_file

import multibody_sym as mbs


def pendulum_angle(amplitude: float, omega: float, t: Floats) -> Floats:
    """Return the angle of a pendulum released from rest: sin(theta/2) = k sn(K + omega t, k)."""
    k = np.sin(amplitude / 2)
    sn, _, _, _ = ellipj(ellipk(k**2) + omega * t, k**2)
    return np.asarray(2 * np.arcsin(k * sn))


def test_pendulum_follows_elliptic_functions() -> None:
    run = simulated("pendulum", 6.0, samples=61)
    theta = pendulum_angle(np.pi / 3, np.sqrt(G / 1.0), run.t)
    assert np.abs(run["theta"] - theta).max() < 1e-9
    assert np.abs(run["height"] + np.cos(theta)).max() < 1e-9
    axial = G * (3 * np.cos(theta) - 2 * np.cos(np.pi / 3))  # tension from the energy integral
    assert np.abs(run["pull"] - axial * np.cos(theta)).max() < 1e-7


def test_pendulum_in_x_and_y_is_the_same_pendulum() -> None:
    run = simulated("pendulum_xy", 2.0, samples=21)
    theta = pendulum_angle(np.pi / 3, np.sqrt(G / 1.0), run.t)
    assert np.abs(run["x"] - np.sin(theta)).max() < 1e-8
    assert np.abs(run["y"] + np.cos(theta)).max() < 1e-8
    assert np.abs(run["pull"] - G * (3 * np.cos(theta) - 1)).max() < 1e-6
    assert run.drift["position"] < 1e-12


def test_double_pendulum_follows_the_book_s_equations() -> None:
    def accelerations(t: float, q: Floats, u: Floats) -> list[float]:
        # masses 1 kg, lengths 1 m, absolute angles a, b
        (a, b), (p, r) = q, u
        c, s = np.cos(a - b), np.sin(a - b)
        matrix = [[2.0, c], [c, 1.0]]
        right = [-(r**2) * s - 2 * G * np.sin(a), p**2 * s - G * np.sin(b)]
        return list(np.linalg.solve(matrix, right))

    run = simulated("double_pendulum", 2.0, samples=21)
    a, b = by_hand(accelerations, [np.pi / 2, np.pi / 2], run.t)
    assert np.abs(run["theta1"] - a).max() < 1e-8
    assert np.abs(run["theta2"] - (b - a)).max() < 1e-8


def test_cart_pole_follows_equations_by_hand() -> None:
    M, m, l, F, w = 1.0, 0.2, 1.0, 2.0, 3.0

    def accelerations(t: float, q: Floats, u: Floats) -> list[float]:
        # a uniform rod at angle theta from x: T = (M + m) v^2/2 - m l v theta' sin(theta)/2 + m l^2 theta'^2/6
        s, c = np.sin(q[1]), np.cos(q[1])
        matrix = [[M + m, -m * l * s / 2], [-m * l * s / 2, m * l**2 / 3]]
        right = [F * np.cos(w * t) + m * l * c * u[1] ** 2 / 2, -m * G * l * c / 2]
        return list(np.linalg.solve(matrix, right))

    run = simulated("cart_pole", 3.0, samples=31)
    x, theta = by_hand(accelerations, [0.0, np.radians(95)], run.t)
    assert np.abs(run["x"] - x).max() < 1e-8
    assert np.abs(run["theta"] - theta).max() < 1e-8


def test_elastic_pendulum_follows_equations_by_hand() -> None:
    m, k, l = 0.5, 40.0, 1.0

    def accelerations(t: float, q: Floats, u: Floats) -> list[float]:
        (theta, r), (omega, v) = q, u
        return [-(G * np.sin(theta) + 2 * v * omega) / r, r * omega**2 + G * np.cos(theta) - k / m * (r - l)]

    run = simulated("elastic_pendulum", 4.0, samples=41)
    theta, r = by_hand(accelerations, [np.radians(40), 1.2], run.t)
    assert np.abs(run["theta"] - theta).max() < 1e-8
    assert np.abs(run["r"] - r).max() < 1e-8
    assert run.drift["energy"] < 1e-8


def test_the_top_precesses_steadily() -> None:
    run = simulated("spinning_top", 0.4, samples=41)
    w, x, y, z = (run[f"tip_q{letter}"] for letter in "wxyz")
    axis = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x**2 + y**2)])  # third column of R
    tilt, angle = np.radians(30), 4.0 * run.t
    steady = np.array([np.sin(tilt) * np.sin(angle), -np.sin(tilt) * np.cos(angle), np.full_like(angle, np.cos(tilt))])
    assert np.abs(axis - steady).max() < 1e-8
    assert np.ptp(run["vertical"]) < 1e-9


def test_small_swings_of_the_chain_have_laguerre_s_frequencies() -> None:
    """n equal masses at equal distances on a string: omega^2 = (g/l) x with L_n(x) = 0."""
    rates = mbs.compile(mbs.state_derivative(from_file("chain")), backend="python")
    step, n = 1e-5, 10
    columns = [rates(0.0, np.eye(2 * n)[k] * step)[n:] / step for k in range(n)]
    squares = np.sort(np.linalg.eigvals(-np.array(columns).T).real)
    assert squares == pytest.approx(G / 0.2 * roots_laguerre(n)[0], rel=1e-7)


def test_the_falling_chain_keeps_its_energy() -> None:
    run = simulated("chain", 0.2, samples=11)
    assert run.drift["energy"] < 1e-9
    assert run["end_height"][-1] < run["end_height"][0]
