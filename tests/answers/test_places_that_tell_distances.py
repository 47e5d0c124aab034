"""Small motions in parameters alone: what the position says of feet on curves and of distances is put in."""

from __future__ import annotations

from math import sqrt

import pytest

import multibody_sym as mbs
from multibody_sym.text.printer import text

ELLIPSE = """
multibody_sym: 1
name: ellipse
gravity: [0, -g, 0]
parameters: {g: {value: 9.81 m/s^2, positive: true}, a: {value: 0.5 m, positive: true},
  b: {value: 0.3 m, positive: true}, m: {value: 2 kg, positive: true}}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  wheel: {mass: m, inertia: {Izz: m*(a^2 + b^2)/4},
          surfaces: {rim: {outline: {x: a*cos(s), y: b*sin(s), parameter: s}}}}
joints: {free: {type: planar, parent: ground, child: wheel, q: [x, y, phi], initial: {q: [0, b, 0]}}}
constraints: {rolls: {type: rolling, body: wheel, on: ground.floor}}
"""
MOLECULE = """
multibody_sym: 1
name: molecule
parameters: {m: {value: 1 kg, positive: true}, M: {value: 3 kg, positive: true}, e: {value: 2, positive: true},
  s: {value: 1.1, positive: true}}
bodies: {a: {mass: m}, b: {mass: M}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: x, q: x1}
  B: {type: prismatic, parent: ground, child: b, axis: x, q: x2, initial: {q: 1.2}}
forces: {lj: {type: potential, between: [a, b], value: "e*((s/distance)^12 - 2*(s/distance)^6)"}}
"""


def test_a_rolling_ellipse_swings_by_its_axes() -> None:
    """The rim's radius of curvature below is a^2/b: omega^2 = m g (a^2/b - b)/(J + m b^2)."""
    found = mbs.modes(mbs.loads(ELLIPSE))
    a, b, g = 0.5, 0.3, 9.81
    assert found.frequencies[0].value == pytest.approx(sqrt(g * (a**2 / b - b) / ((a**2 + b**2) / 4 + b**2)), rel=1e-12)
    assert found.frequencies[0].expression is not None
    assert "rolls_s" not in text(found.frequencies[0].expression)
    assert found.conditions == ("a > b",)
    assert not any("formulas hold where" in note for note in found.notes)


def test_a_molecule_swings_about_its_distance() -> None:
    """V'' = 72 e/s^2 at the distance s, and 1/m + 1/M is the mobility."""
    found = mbs.modes(mbs.loads(MOLECULE))
    formula = found.frequencies[0].expression
    assert formula is not None
    assert len(text(formula)) <= 1.5 * len("6*sqrt(2*e*(M + m)/(M*m))/s")
    assert found.frequencies[0].value == pytest.approx(sqrt(72 * 2 * (1 + 1 / 3)) / 1.1, rel=1e-12)
    assert found.conditions == ()
    assert text(found.at["x2"].expression) == "s + x1"
