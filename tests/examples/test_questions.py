"""The examples that ask what happens later, each against its formula by hand."""

from __future__ import annotations

from math import atan, cos, pi, sin, sqrt, tan, tanh

import pytest
from twins import from_file

import multibody_sym as mbs

G = 9.81


def test_loop_the_loop() -> None:
    found = mbs.solve(from_file("loop_the_loop")).answers
    m, R, v = 0.2, 0.7, 6.5
    assert found["least"].value == pytest.approx(m * v**2 / R - 5 * m * G, rel=1e-9)
    assert found["most"].value == pytest.approx(m * v**2 / R + m * G, rel=1e-9)
    assert found["half_way"].value == pytest.approx(sqrt(v**2 - 2 * G * R), rel=1e-9)
    assert found["needed"].value == pytest.approx(sqrt(5 * G * R), rel=1e-12)
    assert str(found["needed"]).startswith("sqrt(5*R*g) = ")


def test_over_a_wall() -> None:
    found = mbs.solve(from_file("over_a_wall")).answers
    v, a, d, h = 20.0, 50 * pi / 180, 30.0, 8.0
    assert found["height"].value == pytest.approx((v * sin(a)) ** 2 / 2 / G, rel=1e-9)
    assert found["flight"].value == pytest.approx(2 * v * sin(a) / G, rel=1e-9)
    assert found["range"].value == pytest.approx(v**2 * sin(2 * a) / G, rel=1e-9)
    assert found["at_the_wall"].value == pytest.approx(d * tan(a) - G * d**2 / 2 / (v * cos(a)) ** 2, rel=1e-9)
    assert found["descent"].value == pytest.approx(-v * sin(a), rel=1e-9)
    assert found["needed"].value == pytest.approx(d / cos(a) * sqrt(G / 2 / (d * tan(a) - h)), rel=1e-9)
    low = atan((v**2 - sqrt(v**4 - (G * d) ** 2)) / (G * d))
    assert found["angle"].value == pytest.approx(low, rel=1e-9)
    assert all(x.expression is not None for x in found.values())


def test_parachutist() -> None:
    found = mbs.solve(from_file("parachutist")).answers
    assert str(found["fall"]) == "-m/k*log(cosh(t*sqrt(g*k/m)))"
    final = sqrt(80 * G / 30)
    assert found["speed"].value == pytest.approx(final * tanh(3 * G / final), rel=1e-9)
    k = found["canopy"].value
    assert k is not None
    assert sqrt(80 * G / k) * tanh(3 * G / sqrt(80 * G / k)) == pytest.approx(6, rel=1e-9)


def test_driven_oscillator() -> None:
    found = mbs.solve(from_file("driven_oscillator")).answers
    amplitude = 4 / sqrt((50 - 2 * 9) ** 2 + 81)
    assert found["amplitude"].value == pytest.approx(amplitude, rel=1e-12)
    assert found["late"].value == pytest.approx(amplitude, rel=1e-4)
    assert found["farthest"].value is not None
    assert found["farthest"].value > amplitude
    assert found["motion"].as_json()["expression"] is not None
