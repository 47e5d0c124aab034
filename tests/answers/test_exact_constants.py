"""Exact constants stay exact from the model's text to the printed formula: roots, multiples of pi, acos."""

from __future__ import annotations

import math
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

SWING = """
multibody_sym: 1
name: swing
gravity: [0, 0, -g]
parameters: {{g: 9.81, l: {{value: 0.2, positive: true}}, m: {{value: 1, positive: true}}, x: 0.6, y: 0.5}}
bodies: {{rod: {{mass: m, com: [0, 0, -l], inertia: {{Ixx: m*l^2/12, Iyy: m*l^2/6, Izz: m*l^2/4}}}}}}
joints: {{A: {{type: revolute, parent: ground, child: rod, axis: {axis}, q: phi, initial: {{q: "{start}"}}}}}}
ask: {{turned: phi + 0.3*pi}}
"""


def swing(axis: str = "y", start: str = "0") -> mbs.System:
    return mbs.loads(SWING.format(axis=axis, start=start))


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


@pytest.mark.parametrize("axis", ["[sqrt(3)/2, 1/2, 0]", "[sqrt(3), 1, 0]", "[3, sqrt(3), 0]"])
def test_an_axis_with_roots_gives_a_rational_inertia(axis: str) -> None:
    """J = m l^2 (1/12 3/4 + 1/6 1/4) + m l^2 = 53/48 m l^2 about the axis."""
    derived = write_document(derivation_document(mbs.derive(swing(axis)), steps=True), "text")
    assert "    53*m*l^2*phi''/48 + m*g*l*sin(phi) = 0" in derived
    assert not any(x in derived for x in ("0.8660", "real(", "0.5"))
    assert "sqrt(3)" in derived
    found = mbs.solve(swing(axis, "pi/6"))
    assert str(found.accelerations["phi"]).startswith("-24*g/(53*l) = ")
    formulas = [text(x.expression) for x in found.reactions["A"].values() if x.expression is not None]
    assert len(formulas) == 6
    assert not any("real(" in formula or "." in formula for formula in formulas)


def test_an_oblique_axis_in_the_plane_of_all_three() -> None:
    derived = write_document(derivation_document(mbs.derive(swing("[1, 1, 2]")), steps=True), "text")
    assert "0.408" not in derived
    assert "sqrt(6)" in derived


@pytest.mark.parametrize(
    ("start", "sine"),
    [
        ("acos(x)", "sqrt(1 - x^2)"),
        ("asin(x)", "x"),
        ("pi/2 - acos(x)", "x"),
        ("acos(x) + pi", "-sqrt(1 - x^2)"),
        ("2*asin(x)", "2*x*sqrt(1 - x^2)"),
        ("atan(x)", "x/sqrt(1 + x^2)"),
        ("atan2(x, y)", "x/sqrt(x^2 + y^2)"),
        ("acos(x) + acos(y)", "sqrt(1 - x^2)*y + x*sqrt(1 - y^2)"),
        ("acos(x)/2", "sqrt((1 - x)/2)"),
    ],
)
def test_functions_of_inverse_functions_are_algebraic(start: str, sine: str) -> None:
    """phi'' = -m g l sin(phi) / (7/6 m l^2) with sin(phi) by hand."""
    value = mbs.solve(swing(start=start)).accelerations["phi"]
    assert value.expression is not None
    if start != "acos(x)/2":
        assert not any(word in text(value.expression) for word in ("acos", "asin", "atan", "sin", "cos"))
    for x, y in ((0.6, 0.5), (0.1, 0.9)):
        given = {symbol("g"): 9.81, symbol("l"): 0.2, symbol("x"): x, symbol("y"): y}
        by_hand = -9.81 * evaluate_float([parse(sine)], given)[0] / (7 / 6 * 0.2)
        assert evaluate_float([value.expression], given)[0] == pytest.approx(by_hand, rel=1e-12)


def test_multiples_of_pi_are_spelt_in_one_way() -> None:
    found = mbs.solve(swing(start="36 deg")).answers["turned"]
    assert found.as_json()["expression"] == "pi/2"
    assert mbs.solve(swing(start="0.2*pi + y")).answers["turned"].as_json()["expression"] == "pi/2 + y"
    assert mbs.solve(swing(start="y")).answers["turned"].as_json()["expression"] == "3*pi/10 + y"


LIFTED = """
multibody_sym: 1
name: lifted
gravity: [0, -g, 0]
parameters: {{g: 9.81, m: {{value: 3, positive: true}}, a: 0.2, h: {{value: 0.7, positive: true}}}}
bodies: {{ground: {{points: {{top: [0, h, 0]}}}}, load: {{mass: m}}}}
joints: {{slide: {{type: prismatic, parent: ground, child: load, axis: x, q: s, initial: {{q: 0.2}}}}}}
forces: {{push: {{type: force, on: load, value: ["{push}", 0, 0]}}}}
"""


@pytest.mark.parametrize(
    ("push", "printed"),
    [
        ("2*g*m*(a - 0.001)", "2*g*(a - 0.001)"),
        ("m*g*(0.2 + a)/0.4", "5*g*(a + 0.2)/2"),
        ("m*(0.2 - 0.4905*a)", "0.2 - 0.4905*a"),
        ("g*m*(91*a - 29.1)/a", "g*(91*a - 29.1)/a"),
        ("m/sqrt((a - s)^2 + h^2)", "1/sqrt(a^2 + h^2 + 0.04 - 2*a/5)"),
        ("7*m*a^2/5", "7*a^2/5"),
        ("m*(4*a + h)/3", "(4*a + h)/3"),
        ("m*g/5", "g/5"),
    ],
)
def test_decimals_of_the_model_are_printed_as_decimals(push: str, printed: str) -> None:
    value = mbs.solve(mbs.loads(LIFTED.format(push=push))).accelerations["s"]
    assert value.expression is not None
    assert text(value.expression) == printed
    rng = np.random.default_rng(3)
    for _ in range(3):
        a, h, g, m = rng.uniform(0.3, 2.0, 4)
        given = {symbol("a"): a, symbol("h"): h, symbol("g"): g, symbol("m"): m, symbol("s"): 0.2}
        by_hand = evaluate_float([parse(f"({push})/m")], given)[0]
        assert evaluate_float([value.expression], given)[0] == pytest.approx(by_hand, rel=1e-12)
    assert math.isfinite(value.value or 0.0)


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
