"""`solve` where constraints determine start values: formulas hold for all parameters, and what was changed is told."""

from __future__ import annotations

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.documents.solution import solution_text
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, symbol

CRANK = """
multibody_sym: 1
name: crank
gravity: [0, 0, -9.81]
parameters: {{r: {{value: 0.1 m, positive: true}}, rate: 10, l: {{value: 0.2 m, positive: true}}, m: 1 kg}}
bodies:
  crank: {{mass: 2, inertia: {{Izz: 0.03}}, points: {{pin: [r, 0, 0]}}}}
  rod: {{mass: m, inertia: {{Izz: 0.01}}, points: {{pin: [{rod}, 0, 0]}}}}
  slider: {{mass: 1}}
joints:
  A: {{type: revolute, parent: ground, child: crank, axis: z, q: phi, initial: {{q: {phi}, u: rate, known: true}}}}
  B: {{type: revolute, parent: crank.pin, child: rod, axis: z, q: psi, initial: {{q: {psi}}}}}
  D: {{type: prismatic, parent: ground, child: slider, axis: x, q: s, initial: {{q: {s}}}}}
  C: {{type: revolute, parent: rod.pin, child: slider, axis: z, cut: true}}
"""
GUESSES = {
    "right by chance": {"rod": "l", "phi": "90 deg", "psi": "-120 deg", "s": "0.17"},
    "in line, with a literal length": {"rod": "0.2", "phi": "0", "psi": "0", "s": "0.3"},
    "in line": {"rod": "l", "phi": "0", "psi": "0", "s": "0.1"},
    "in line, turned back": {"rod": "l", "phi": "180 deg", "psi": "180 deg", "s": "0.1"},
}


def names_and_values(solution: mbs.Solution, parameters: dict[str, float]) -> dict[Node, float]:
    found = {**parameters, **solution.coordinates, **solution.speeds}
    return {symbol(name): value for name, value in found.items()}


@pytest.mark.parametrize("guess", GUESSES)
def test_formulas_of_a_loop_hold_for_other_parameters(guess: str) -> None:
    """No number that assembling found stands in a formula, nor a guess that is right for one length only."""
    system, rng = mbs.loads(CRANK.format(**GUESSES[guess])), np.random.default_rng(1)
    formulas = mbs.solve(system).accelerations
    assert all(value.expression is not None for value in formulas.values())
    for _ in range(4):
        drawn = rng.uniform(0.5, 1.5, 4)
        given = {"r": 0.1 * drawn[0], "rate": 10 * drawn[1], "l": 0.2 * drawn[2], "m": drawn[3]}
        elsewhere = mbs.solve(system, given)
        letters = names_and_values(elsewhere, given)
        for name, value in elsewhere.accelerations.items():
            formula = formulas[name].expression
            assert formula is not None
            assert value.value is not None
            assert evaluate_float([formula], letters)[0] == pytest.approx(value.value, rel=1e-9, abs=1e-9), name


def test_what_rows_determine_is_shown_with_its_closed_form_or_its_number() -> None:
    found = mbs.solve(mbs.loads(CRANK.format(**GUESSES["right by chance"])))
    lines = solution_text(found).splitlines()
    assert lines[1] == "given start values were changed to satisfy the constraints: s by 0.00321 m"
    assert {"  psi = -(asin(r/l) + pi/2) = -120 deg"} <= set(lines)
    assert next(line for line in lines if line.startswith("  s = ")).endswith(" = 0.173205 m")
    assert found.assembled["u_s"].as_json() == {"value": pytest.approx(-1.0), "expression": "-r*rate", "unit": "m/s"}
    assert found.as_json()["shifts"] == {"s": pytest.approx(np.sqrt(0.03) - 0.17)}
    in_line = mbs.solve(mbs.loads(CRANK.format(**GUESSES["in line"]))).assembled
    assert {name: str(value) for name, value in in_line.items()}["s"] == "l + r = 0.3 m"


def test_given_values_that_are_right_stay_as_they_were_declared() -> None:
    pendulum = mbs.solve(mbs.loads("""
multibody_sym: 1
name: pendulum
gravity: [0, -g, 0]
parameters: {g: 9.81, m: 1, l: {value: 2, positive: true}, tilt: 30 deg}
bodies: {bob: {mass: m}, slide: {}}
joints:
  along: {type: prismatic, parent: ground, child: slide, axis: x, q: x, initial: {q: l*sin(tilt)}}
  up: {type: prismatic, parent: slide, child: bob, axis: y, q: y, initial: {q: -l*cos(tilt)}}
constraints: {rod: {type: distance, between: [ground, bob], value: l}}
"""))
    assert (pendulum.assembled, pendulum.shifts) == ({}, {})
    assert str(pendulum.accelerations["y"]).startswith("-g*sin(tilt)^2 = ")
