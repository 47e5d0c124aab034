"""What is written is what was meant: text goes back through the model's own parser, LaTeX has its braces."""

from __future__ import annotations

import random
from typing import Any

import pytest
import sympy
from random_formulas import random_formula
from textbook import double_pendulum, hanging_mass, top

from multibody_sym.algebra.writers import LatexScript, TextScript, decimal
from multibody_sym.derivation.notation import dotted, escaped, latex_name, notation_of, symbols_of, upright
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.text.parser import parse

VALUES = {"m1": 1.1, "k": 0.7, "l": 1.7, "a": 0.3, "b": -1.1, "u": 0.6, "v": -0.8}
EXTRA = [
    lambda x, y: sympy.Abs(x) * sympy.sign(y),
    lambda x, y: sympy.Piecewise((x, x < y), (y * 2, True)),
    lambda x, y: sympy.Min(x, y) - sympy.Max(x, 2 * y),
    lambda x, y: sympy.atan2(x, y**2 + 1) + sympy.exp(-(x**2)),
    lambda x, y: -(x + y) / (2 * (1 + x**2)) - sympy.pi * x / 3,
    lambda x, y: sympy.Rational(981, 100) * x - sympy.Rational(13, 17) * y,
]


def text_of(expression: Any) -> str:
    return TextScript({}, {}).shown(expression)


def assert_text_means(expression: Any) -> None:
    """Parse what was written and compare values."""
    node = parse(text_of(expression))
    found = evaluate_float([node], {leaf: VALUES[leaf.data] for leaf in leaves([node], "symbol")})[0]
    at = {s: VALUES[s.name] for s in expression.free_symbols}
    assert found == pytest.approx(float(expression.evalf(20, subs=at)), rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("seed", range(100, 160))
def test_text_means_the_expression(seed: int) -> None:
    rng = random.Random(seed)
    assert_text_means(random_formula(rng, 4) * (1 - 3 * random_formula(rng, 2)) ** 2)


@pytest.mark.parametrize("make", EXTRA)
def test_text_of_functions(make: Any) -> None:
    a, b = sympy.symbols("a b", real=True)
    assert_text_means(make(a, b))


@pytest.mark.parametrize("seed", range(200, 220))
def test_latex_braces_balance(seed: int) -> None:
    shown = LatexScript({}, {}).shown(random_formula(random.Random(seed), 5))
    depth = 0
    for c in shown:
        depth += (c == "{") - (c == "}")
        assert depth >= 0
    assert depth == 0
    assert shown.count(r"\left") == shown.count(r"\right")


@pytest.mark.parametrize(
    ("name", "latex"),
    [
        ("theta", r"\theta"), ("theta1", r"\theta_{1}"), ("theta_rel", r"\theta_{\mathrm{rel}}"), ("m", "m"),
        ("m_12", "m_{12}"), ("Jxx2", r"\mathrm{Jxx}_{2}"), ("a_b_c", "a_{b,c}"), ("lambda", r"\lambda"), ("E", "E"),
        ("q_phi", r"q_{\phi}"), ("crank_angle", r"\phi_{\mathrm{crank}}"),
        ("u_crank_angle", r"u_{\phi,\mathrm{crank}}"), ("xa", "x_{a}"),
        ("pin_force_2", r"\text{pin force}_{2}"), ("F_max_x", r"F_{\mathrm{max},x}"),
    ],
)
def test_names_in_latex(name: str, latex: str) -> None:
    assert latex_name(name) == latex


def test_hostile_words_hold_no_commands() -> None:
    assert escaped(r"\input{x} 50% $y$ #1 a_b^c~") == (
        r"\textbackslash{}input\{x\} 50\% \$y\$ \#1 a\_b\textasciicircum{}c\textasciitilde{}"
    )
    assert upright("rod 1}") == r"\text{rod 1\}}"


def test_rates_carry_primes_and_dots() -> None:
    resolved = mechanism(double_pendulum())
    symbols = symbols_of(resolved)
    notation = notation_of(resolved, symbols, labels={"q1": "alpha"})
    u, a = symbols.speeds[0], symbols.accelerations[0]
    assert [notation.text(u), notation.text(a)] == ["q1'", "q1''"]
    assert [notation.latex(u), notation.latex(a)] == [r"\dot{\alpha}", r"\ddot{\alpha}"]
    assert notation.latex(symbols.speeds[1] ** 2) == r"\dot{q}_{2}^{2}"


def test_angular_velocities_and_multipliers() -> None:
    resolved = mechanism(top())
    symbols = symbols_of(resolved)
    notation = notation_of(resolved, symbols)
    assert [notation.latex(x) for x in symbols.speeds] == [r"\omega_{x}", r"\omega_{y}", r"\omega_{z}"]
    assert notation.text(symbols.accelerations[0]) == "ball_wx'"
    resolved = mechanism(hanging_mass())
    symbols = symbols_of(resolved)
    assert notation_of(resolved, symbols).latex(symbols.multipliers[0]) == r"\lambda_{\mathrm{rod}}"


@pytest.mark.parametrize(
    ("value", "shown"), [("981/100", "9.81"), ("1/80", "0.0125"), ("12", "12"), ("1/3", None), ("1/2", "0.5")]
)
def test_decimals(value: str, shown: str | None) -> None:
    assert decimal(sympy.Rational(value)) == shown


@pytest.mark.parametrize(
    ("name", "latex"),
    [
        ("theta_1", r"\ddot{\theta}_{1}"), ("crank_angle", r"\ddot{\phi}_{\mathrm{crank}}"), ("m", r"\ddot{m}"),
        ("_A", r"\ddot{\text{\_A}}"), ("50%_x", r"\ddot{\text{50\%\_x}}"), ("{_x", r"\ddot{\text{\{\_x}}"),
        ("pin_force_2", r"\ddot{\text{pin force}}_{2}"),
    ],
)  # fmt: skip
def test_dots_stand_over_the_letter_whatever_it_is(name: str, latex: str) -> None:
    assert dotted(latex_name(name), "ddot") == latex
