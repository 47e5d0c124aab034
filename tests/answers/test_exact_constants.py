"""Exact constants of expressions, and the decimals that literals of a model make together."""

from __future__ import annotations

import re

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.documents.derivation import derivation_document
from multibody_sym.documents.document import write_document
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import text


@pytest.mark.parametrize(
    ("written", "printed"),
    [
        ("(sqrt(3)/2)^2", "0.75"),
        ("sqrt(12)", "2*sqrt(3)"),
        ("1/sqrt(2)", "sqrt(2)/2"),
        ("sqrt(2)*sqrt(6)", "2*sqrt(3)"),
        ("sqrt(1/3)", "sqrt(3)/3"),
        ("(1/sqrt(6))^3", "sqrt(6)/36"),
        ("sqrt(3)/2 + sqrt(12)", "5*sqrt(3)/2"),
        ("sqrt(3) - sqrt(12)/2", "0"),
        ("-sqrt(3) + sqrt(3)/4", "-3*sqrt(3)/4"),
        ("x/sqrt(2)", "x/sqrt(2)"),
        ("0.3*pi", "3*pi/10"),
        ("36*pi/180", "pi/5"),
        ("sqrt(0.57735026919)", "sqrt(0.57735026919)"),
    ],
)
def test_constants_are_simplified_exactly_and_read_back(written: str, printed: str) -> None:
    node = parse(written)
    assert text(node) == printed
    assert parse(printed) is node


LITERALS = """
multibody_sym: 1
name: literals
gravity: [0, -g, 0]
parameters: {g: 9.81, m: {value: 1.3, positive: true}}
bodies:
  arm: {mass: m, com: [0.12345, -0.45678, 0], inertia: {Izz: 0.0123457}, points: {end: [0.23456, -0.87654, 0]}}
  ball: {mass: 0.3217, inertia: {Izz: 0.0043219}, com: [0.05, 0.0321, 0]}
joints:
  A: {type: revolute, parent: ground, child: arm, axis: z, q: theta, initial: {q: 30 deg}}
  B: {type: revolute, parent: arm.end, child: ball, axis: z, q: psi, initial: {q: 20 deg}}
"""


def test_numbers_that_literals_make_together_are_decimals_in_formulas() -> None:
    """No whole number of more digits than a literal has, in solve and derive; the formulas keep their values."""
    system = mbs.loads(LITERALS)
    derived = write_document(derivation_document(mbs.derive(system), steps=True), "text")
    formulas = {k: x.expression for k, x in mbs.solve(system).accelerations.items() if x.expression is not None}
    assert "theta" in formulas
    assert not re.search(r"(?<![.\d])\d{9,}", "".join((derived, *map(text, formulas.values()))))
    for m in (0.4, 1.3, 5.7):
        elsewhere = mbs.solve(system, {"m": m}).accelerations
        for name, formula in formulas.items():
            value = evaluate_float([formula], {symbol("g"): 9.81, symbol("m"): m})[0]
            assert value == pytest.approx(elsewhere[name].value, rel=1e-9)


def test_a_kinetic_energy_of_long_numbers_is_the_one_by_hand() -> None:
    derived = write_document(derivation_document(mbs.derive(mbs.loads(LITERALS)), steps=True), "text")
    (line,) = [line for line in derived.splitlines() if line.startswith("    T = ")]
    (energy,) = [parse(line.removeprefix("    T = ").replace("theta'", "w").replace("psi'", "v"))]
    theta, psi, w, v, m = 0.3, -1.1, 0.7, 1.9, 1.3
    end, com = complex(0.23456, -0.87654), complex(0.05, 0.0321) * np.exp(1j * psi)
    squares = abs(complex(0.12345, -0.45678) * w) ** 2, abs(end * w + com * (w + v)) ** 2
    by_hand = (m * squares[0] + 0.3217 * squares[1] + 0.0123457 * w**2 + 0.0043219 * (w + v) ** 2) / 2
    letters = {"theta": theta, "psi": psi, "w": w, "v": v, "m": m}
    assert evaluate_float([energy], {symbol(k): x for k, x in letters.items()})[0] == pytest.approx(by_hand, rel=1e-14)
