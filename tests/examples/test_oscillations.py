"""The examples of small oscillations, each against its formula by hand."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, radians, sin, sqrt

import numpy as np
import pytest
from mpmath import mp, quad
from twins import from_file

import multibody_sym as mbs

G = 9.81
_PERIODS = (
    "{multibody_sym: 1, name: x, ask: {omega: frequency(1), T: period(1), twice: 2*period(1), other: W/frequency(1)}}"
)


def answers(name: str, **parameters: float) -> dict[str, float | None]:
    return {key: found.value for key, found in mbs.solve(from_file(name), parameters=parameters).answers.items()}


def formula(name: str, answer: str) -> str:
    return mbs.solve(from_file(name)).answers[answer].as_json()["expression"]


def test_coupled_pendulums() -> None:
    found = answers("coupled_pendulums")
    low, high = sqrt(G), sqrt(G + 2 * 5 * 0.4**2)
    assert found == pytest.approx({"w1": low, "w2": high, "beat": 2 * pi / (high - low)}, rel=1e-12)
    half = found["beat"] / 2
    run = mbs.simulate(from_file("coupled_pendulums"), t_end=half, initial={"phi1": 1e-4}, backend="python")
    assert abs(run["phi2"]).max() == pytest.approx(1e-4, rel=0.01)  # after half a beat the other has all the motion


def test_frequencies_and_their_beat_have_one_root() -> None:
    assert formula("coupled_pendulums", "w2") == "sqrt((g*l*m + 2*k*a^2)/m)/l"
    assert formula("coupled_pendulums", "beat") == "2*l*pi/(sqrt((g*l*m + 2*k*a^2)/m) - sqrt(g*l))"


def test_the_nodding_of_a_top_has_one_root_in_its_frequency_and_periods() -> None:
    """omega^2 = W^2 - 2 m g h cos(theta)/B + (m g h/(B W))^2 with B = A + m h^2, at other values too."""
    system = replace(from_file("nutating_top"), ask=mbs.loads(_PERIODS).ask)
    values = {"g": 3.7, "m": 0.21, "h": 0.07, "A": 4.3e-4, "C": 1.9e-4, "W": 11.0}
    found = mbs.solve(system, parameters=values).answers
    told = {key: each.as_json()["expression"] for key, each in found.items()}
    root = told["omega"]
    assert root.startswith("sqrt(W^2 + ")
    assert told == {"omega": root, "T": f"2*pi/{root}", "twice": f"4*pi/{root}", "other": f"W/{root}"}
    g, m, h, A, _, W = values.values()
    B, weight = A + m * h**2, m * g * h
    omega = sqrt(W**2 - 2 * weight * cos(radians(30)) / B + (weight / (B * W)) ** 2)
    wanted = {"omega": omega, "T": 2 * pi / omega, "twice": 4 * pi / omega, "other": W / omega}
    assert {key: each.value for key, each in found.items()} == pytest.approx(wanted, rel=1e-12)


def test_wedge_and_spring() -> None:
    assert formula("wedge_and_spring", "T") == "2*pi*sqrt(m*(M + m*sin(theta)^2)/(k*(M + m)))"
    assert answers("wedge_and_spring")["T"] == pytest.approx(2 * pi * sqrt((3 + 0.25) / (40 * 4)), rel=1e-12)


def test_disc_in_a_hollow() -> None:
    """The swing of 20 deg by energy: theta'^2 = 2 w^2 (cos(theta) - cos(a)), which is a pendulum's."""
    found = answers("disc_in_a_hollow")
    w, a = sqrt(2 * G / (3 * 0.8)), radians(20)
    assert formula("disc_in_a_hollow", "omega") == "sqrt(2*g/(3*(R - r)))"
    assert found["omega"] == pytest.approx(w, rel=1e-12)
    swing = 4 / w * quad(lambda x: 1 / mp.sqrt(1 - (mp.sin(a / 2) * mp.sin(x)) ** 2), [0, mp.pi / 2])
    assert found["swing"] == pytest.approx(float(swing), rel=1e-10)


def test_triatomic_molecule() -> None:
    assert answers("triatomic_molecule")["ratio"] == pytest.approx(sqrt((12 + 2 * 16) / 12), rel=1e-12)
    assert formula("triatomic_molecule", "ratio") == "sqrt((M + 2*m)/M)"


def test_governor() -> None:
    m, l, J, a = 1.0, 0.3, 0.05, radians(40)
    square = G * sin(a) ** 2 / (l * cos(a)) * (J + 2 * m * l**2 * (1 + 3 * cos(a) ** 2))
    wanted = sqrt(square / (J + 2 * m * l**2 * sin(a) ** 2))
    assert answers("governor")["omega"] == pytest.approx(wanted, rel=1e-12)
    aside = {"theta": a + 1e-5, "psi": -a - 1e-5}
    run = mbs.simulate(from_file("governor"), t_end=2 * pi / wanted, initial=aside, backend="python")
    assert run["theta"][-1] - run["theta"][0] == pytest.approx(0.0, abs=1e-8)  # back after its period


@pytest.mark.parametrize("n", [2.0, 1.0, 2.5])
def test_nearly_a_circle(n: float) -> None:
    assert answers("nearly_a_circle", n=n)["angle"] == pytest.approx(2 * pi / sqrt(3 - n), rel=1e-12)
    assert formula("nearly_a_circle", "angle") == "2*pi/sqrt(3 - n)"


def test_an_orbit_under_a_steeper_law_is_unstable() -> None:
    modes = mbs.modes(from_file("nearly_a_circle"), parameters={"n": 4})
    assert modes.stable is False
    assert modes.conditions == ("n > 3",)


def test_nutating_top() -> None:
    m, h, A, W, theta = 0.3, 0.04, 3e-4, 5.0, radians(30)
    B = A + m * h**2
    wanted = sqrt(W**2 - 2 * m * G * h * cos(theta) / B + (m * G * h / (B * W)) ** 2)
    assert answers("nutating_top")["omega"] == pytest.approx(wanted, rel=1e-12)


def test_vibration_absorber() -> None:
    """X = F (ka - ma w^2)/((k + ka - M w^2 + i c w)(ka - ma w^2) - ka^2); the absorber moves by F/ka where X = 0."""
    M, k, c, ma, ka, w, force = 20.0, 5e4, 100.0, 2.0, 6000.0, 50.0, 0.1 * 0.05 * 2500
    held = ka - ma * w**2
    X = force * held / ((k + ka - M * w**2 + 1j * c * w) * held - ka**2)
    found = answers("vibration_absorber")
    ratio = -np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [
        -np.array([[(k + ka) / M, -ka / M], [-ka / ma, ka / ma]]), -np.diag([c / M, 0.0])]]))
    slow = min((x for x in ratio if x.imag > 0), key=abs)
    wanted = {"A": abs(X), "Aa": abs(X * ka / held), "lag": -np.angle(X), "rests": sqrt(ka / ma), "tuned": ma * w**2}
    assert found == pytest.approx({**wanted, "z": slow.real / abs(slow)}, rel=1e-12)
    tuned = answers("vibration_absorber", ka=5000.0)
    assert tuned["A"] == 0.0
    assert tuned["Aa"] == pytest.approx(force / 5000, rel=1e-12)
    assert tuned["lag"] is None
