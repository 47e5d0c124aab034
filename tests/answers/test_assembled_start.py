"""A start that constraints determine keeps its formulas: a crank's rod and slider, against the triangle they make."""

from __future__ import annotations

import math
import random

import pytest

import multibody_sym as mbs
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.text.printer import text

SLIDER = """
multibody_sym: 1
name: slider
gravity: [0, -g, 0]
parameters:
  g: {value: 10 m/s^2, positive: true}
  m1: {value: 1 kg, positive: true}
  m3: {value: 2 kg, positive: true}
  r: {value: 0.1 m, positive: true}
  l: {value: 0.3 m, positive: true}
  w: {value: 10 rad/s, positive: true}
  a: 30 deg
bodies:
  crank: {mass: m1, com: [r/2, 0, 0], inertia: {Izz: m1*r^2/12}, points: {pin: [r, 0, 0]}}
  rod: {points: {pin: [l, 0, 0]}}
  slider: {mass: m3}
joints:
  A: {type: revolute, parent: ground, child: crank, axis: z, q: phi, initial: {q: a, u: w, known: true}}
  B: {type: revolute, parent: crank.pin, child: rod, axis: z, q: psi}
  D: {type: prismatic, parent: ground, child: slider, axis: x, q: s}
  C: {type: revolute, parent: rod.pin, child: slider, axis: z, cut: true}
ask: {v: u_s}
"""


@pytest.fixture(scope="module")
def solution() -> mbs.Solution:
    return mbs.solve(mbs.loads(SLIDER))


def test_the_places_of_a_closed_loop_have_their_formulas(solution: mbs.Solution) -> None:
    found = {name: value.expression for name, value in solution.assembled.items()}
    assert text(found["s"]) == "r*cos(a) + sqrt(l^2 - r^2*sin(a)^2)"
    assert text(found["psi"]) == "-(a + asin(r*sin(a)/l))"
    assert text(found["u_s"]) == text(solution.answers["v"].expression)


def test_its_speeds_are_those_of_the_triangle(solution: mbs.Solution) -> None:
    """u_s = ds/dt and u_psi = dpsi/dt with da/dt = w, by the law of sines for the rod's angle."""
    formulas: dict[str, Node] = {name: solution.assembled[name].expression for name in ("u_s", "u_psi")}
    rng = random.Random(0)
    for _ in range(20):
        r, l, w, a = rng.uniform(0.1, 1), rng.uniform(1.1, 3), rng.uniform(-3, 3), rng.uniform(-1.5, 1.5)
        at = {symbol(name): value for name, value in zip("rlwa", (r, l, w, a), strict=True)}
        leaning = math.asin(r * math.sin(a) / l)
        turning = r * w * math.cos(a) / (l * math.cos(leaning))
        expected = [-r * w * math.sin(a) - l * math.sin(leaning) * turning, -w - turning]
        assert evaluate_float(list(formulas.values()), at) == pytest.approx(expected, rel=1e-12, abs=1e-14)
