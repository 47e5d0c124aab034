"""Units are told as they were declared: a mass flow in kg/s, a damping in N*s/m, which are the same dimension."""

from __future__ import annotations

import pickle

import pytest

import multibody_sym as mbs
from multibody_sym.text.units import Dimension, parse_unit

MODEL = """
multibody_sym: 1
name: sand
parameters: {n: 500 g/s, c: 3 N*s/m, k: 20 kg/s^2, M: 2 kg, twice: 2*n}
bodies: {cart: {mass: M}}
joints: {rail: {type: prismatic, parent: ground, child: cart, axis: x, q: x, initial: {q: 0.1 m, u: 2 m/s}}}
forces: {air: {type: drag, on: cart, linear: c}, spring: {type: spring_damper, joint: rail, stiffness: k}}
outputs: {flow: n, both: twice, drag: c, push: n*u_x}
ask: {flow: n, both: twice, drag: c, push: n*u_x}
simulation: {t_end: 0.1 s}
"""
TOLD = {"flow": "kg/s", "both": "kg/s", "drag": "N*s/m", "push": "N"}


@pytest.mark.parametrize(
    ("unit", "told"),
    [("kg/s", "kg/s"), ("g/min", "kg/s"), ("N*s/m", "N*s/m"), ("N/m", "N/m"), ("kg/s^2", "kg/s^2"), ("J/s", "W")],
)
def test_dimensions_print_with_the_names_they_were_written_with(unit: str, told: str) -> None:
    dimension = parse_unit(unit)[1]
    assert str(dimension) == told
    assert dimension == Dimension(*dimension)
    assert hash(dimension) == hash(Dimension(*dimension))
    assert str(pickle.loads(pickle.dumps(dimension))) == told


def test_runs_answers_and_files_tell_units_as_declared() -> None:
    system = mbs.loads(MODEL)
    solution = mbs.solve(system)
    assert {name: value.unit for name, value in solution.answers.items()} == TOLD
    run = mbs.simulate(system, samples=2)
    assert {name: run.output_units[name] for name in TOLD} == TOLD
    written = mbs.dumps(system)
    assert "n: 0.5 kg/s" in written
    assert "c: 3 N*s/m" in written
    assert "k: 20 kg/s^2" in written
    assert mbs.loads(written) == system
