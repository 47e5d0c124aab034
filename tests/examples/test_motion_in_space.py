"""The spatial examples move as other routes say: elliptic functions, turning points, equations of motion by hand."""

from __future__ import annotations

import numpy as np
import pytest
from runs import Floats, G, by_hand, simulated
from scipy.special import ellipj, ellipk


def test_the_spherical_pendulum_turns_at_the_roots_of_its_cubic() -> None:
    """(1 - c^2) (2 E/(m l^2) + 2 g c/l) = (L/(m l^2))^2 with c = cos(theta), where theta' = 0."""
    rate, c = 3.0, 0.5
    energy, momentum = rate**2 * (1 - c**2) / 2 - G * c, rate * (1 - c**2)
    roots = np.roots([-2 * G, -2 * energy, 2 * G, 2 * energy - momentum**2])
    lowest, highest = sorted(-root for root in roots if abs(root) < 1)
    run = simulated("spherical_pendulum", 4.0, samples=4001)
    assert run["height"].max() == pytest.approx(highest, abs=1e-9)
    assert run["height"].min() == pytest.approx(lowest, abs=1e-5)  # a sample beside the turning point
    assert run["height"].min() >= lowest - 1e-9
    assert np.abs(run["vertical"] - momentum).max() < 1e-9


def free_rotation(A: float, B: float, C: float, spin: float, wobble: float, t: Floats) -> Floats:
    """Return the angular velocity (3, m) of a free body with A < B < C that starts with (0, spin, wobble).

    Source: Landau and Lifshitz, Mechanics, section 37, started where the first component vanishes.
    """
    energy, square = B * spin**2 + C * wobble**2, (B * spin) ** 2 + (C * wobble) ** 2  # 2 T, L^2
    rate = np.sqrt((C - B) * (square - energy * A) / (A * B * C))
    m = (B - A) * (energy * C - square) / ((C - B) * (square - energy * A))
    sn, cn, dn, _ = ellipj(ellipk(m) + rate * t, m)
    return np.array([
        np.sqrt((energy * C - square) / (A * (C - A))) * cn,
        np.sqrt((energy * C - square) / (B * (C - B))) * sn,
        np.sqrt((square - energy * A) / (C * (C - A))) * dn,
    ])


def assert_rotates_freely(t_end: float, tolerance: float) -> None:
    run = simulated("tennis_racket", t_end, samples=101)
    exact = free_rotation(0.0012, 0.0164, 0.0175, 15.0, 0.05, run.t)
    found = np.array([run[f"flight_w{axis}"] for axis in "xyz"])
    assert np.abs(found - exact).max() < tolerance
    assert exact[1].min() < -14  # it turned over


def test_the_racket_turns_over_as_elliptic_functions_say() -> None:
    assert_rotates_freely(2.0, 1e-8)


def test_the_racket_flies_as_a_stone_does() -> None:
    run = simulated("tennis_racket", 2.0, samples=21)
    assert np.abs(run["height"] - (10 * run.t - G / 2 * run.t**2)).max() < 1e-10


def test_the_gyroscope_precesses_with_its_axis_level() -> None:
    """The weight's moment m g h reaches the rotor through its bearings and turns its angular momentum."""
    run = simulated("gyroscope", 2.0, samples=41)
    assert np.abs(run["theta"] - np.pi / 2).max() < 1e-9
    assert np.abs(run["psi"] - 2.0 * run.t).max() < 1e-9
    assert np.abs(np.abs(run["bearing"]) - 0.2 * G * 0.05).max() < 1e-9


def test_furuta_s_pendulum_follows_equations_by_hand() -> None:
    M, r, m, l, T0, w = 0.25, 0.2, 0.1, 0.3, 0.15, 6.0

    def accelerations(t: float, q: Floats, u: Floats) -> list[float]:
        # a uniform rod at (r, s sin(theta), -s cos(theta)), 0 <= s <= l, in axes that turn with the arm
        (_, theta), (p, v) = q, u
        s, c = np.sin(theta), np.cos(theta)
        half, third = m * r * l / 2, m * l**2 / 3
        matrix = [[(M / 3 + m) * r**2 + third * s**2, half * c], [half * c, third]]
        right = [
            T0 * np.cos(w * t) - 2 * third * s * c * p * v + half * s * v**2,
            third * s * c * p**2 - m * G * l / 2 * s,
        ]
        return list(np.linalg.solve(matrix, right))

    run = simulated("furuta", 1.5, samples=31)
    phi, theta = by_hand(accelerations, [0.0, np.radians(170)], run.t)
    assert np.abs(run["phi"] - phi).max() < 1e-7
    assert np.abs(run["theta"] - theta).max() < 1e-7


def test_the_spatial_chain_keeps_energy_and_vertical_angular_momentum() -> None:
    run = simulated("spatial_chain", 0.25, samples=6)
    assert run.drift["energy"] < 1e-9
    assert np.ptp(run["vertical"]) < 1e-10
    assert run["end"][-1] != run["end"][0]


def test_the_swinging_load_follows_equations_by_hand() -> None:
    M, m = 3.0, 1.0

    def accelerations(t: float, q: Floats, u: Floats) -> list[float]:
        # one rope: the load rises as r grows
        (r, theta), (v, omega) = q, u
        return [
            (m * r * omega**2 + m * G * np.cos(theta) - M * G) / (M + m),
            -(2 * v * omega + G * np.sin(theta)) / r,
        ]

    run = simulated("swinging_atwood", 1.0, samples=21)
    r, theta = by_hand(accelerations, [1.0, np.pi / 2], run.t)
    assert np.abs(run["r"] - r).max() < 1e-7
    assert np.abs(run["theta"] - theta).max() < 1e-7
    assert np.abs(run["s"] - (3.0 - r)).max() < 1e-7
    assert np.ptp(run["second"]) < 1e-8  # a constant of motion for M = 3 m: Tufillaro (1986)
