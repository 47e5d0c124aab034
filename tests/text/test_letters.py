"""Names of symbols as a book writes them: one reading for LaTeX, MathML and figures."""

from __future__ import annotations

import re
from html import unescape

import pytest

import multibody_sym as mbs
from multibody_sym.derivation.notation import latex_name
from multibody_sym.documents.derivation import derivation_document
from multibody_sym.documents.document import worked_document, write_document
from multibody_sym.documents.formulas import latex_in_mathml, mathml_name
from multibody_sym.pictures.page.picture import TextMark, letters
from multibody_sym.text.printer import GREEK, read_parts


def read(mathml: str) -> str:
    return unescape(re.sub("<[^>]*>", "", mathml))


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("theta1", ["theta", "1"]), ("θ₁", ["theta", "1"]), ("θ_1", ["theta", "1"]), ("m_A_x", ["m", "A", "x"]),
        ("crank_angle_2", ["phi", "crank", "2"]), ("u_crank_angle", ["u", "phi", "crank"]), ("angle", ["angle"]),
        ("pin_force", ["pin force"]), ("u_theta1", ["u", "theta", "1"]), ("über_weg", ["über weg"]), ("_A", ["_A"]),
        ("q_φ", ["q", "phi"]), ("中1", ["中", "1"]), ("xa", ["x", "a"]), ("xa1", ["x", "a", "1"]), ("up", ["up"]),
        ("phia", ["phi", "a"]), ("mus", ["mu", "s"]), ("pin", ["pin"]), ("psi", ["psi"]), ("AB", ["AB"]),
        ("th", ["theta"]), ("u_ph1", ["u", "phi", "1"]), ("om_0", ["omega", "0"]), ("al", ["alpha"]), ("be", ["be"]),
    ],
)  # fmt: skip
def test_a_name_is_a_letter_with_what_stands_below(name: str, parts: list[str]) -> None:
    assert read_parts(name) == parts


@pytest.mark.parametrize("name", ["theta1", "θ₁", "m_A_x", "crank_angle_2", "lambda_rod", "q_φ", "ö_2", "u_th"])
def test_figures_and_formulas_show_the_same_letters(name: str) -> None:
    drawn = "".join(text for text, _ in letters(name))
    assert read(mathml_name(name)) == drawn
    spelt = latex_name(name)
    for word, letter in GREEK.items():
        spelt = re.sub(rf"\\{word}(?![a-z])", letter, spelt)
    assert re.sub(r"\\mathrm|\\text|[{}_]", "", spelt) == drawn


@pytest.mark.parametrize(
    ("latex", "shown"),
    [
        (r"\frac{\partial T}{\partial \dot{\theta}_{1}}", "∂T∂θ˙1"), (r"\lambda_{\mathrm{rod}}", "λrod"),
        (r"\left(N^T \frac{\partial V}{\partial q}\right)_{x}", "(NT∂V∂q)x"), (r"F_{\text{a\_b},x}", "Fa_b,x"),
        (r"p_{\text{\textbackslash{}input\{x\}}}", r"p\input{x}"), ("N{}'", "N′"), (r"\dot{\varphi}_{a}", "φ˙a"),
        (r"1.5\,\mathrm{kg}", "1.5kg"), (r"\text{<b>}", "<b>"), ("_", ""), (r"\frac", ""), (r"x^{", "x"),
    ],
)  # fmt: skip
def test_labels_in_latex_are_read(latex: str, shown: str) -> None:
    assert read(latex_in_mathml(latex)) == shown


PENDULUM = """
multibody_sym: 1
name: p
gravity: [0, -g, 0]
parameters: {g: 9.81, len: {value: 2, label: ℓ}, mass: {value: 1, label: m_A}}
bodies: {bob: {mass: mass, com: [0, -len, 0]}}
joints:
  hinge: {type: revolute, parent: ground, child: bob, q: swing_angle, q_label: beta_0, label: B, initial: {q: 0.3}}
"""


def test_what_a_parameter_or_coordinate_is_labelled_stands_in_latex_and_in_html() -> None:
    """A coordinate's label stands in figures and stages of a derivation, too."""
    system = mbs.loads(PENDULUM)
    equations, steps = mbs.derive(system), mbs.solve(system, steps=True).steps
    assert steps is not None
    documents = derivation_document(equations), worked_document(steps)
    for latex in (write_document(each, "latex") for each in documents):
        assert "m_{A}" in latex
        assert r"\mathrm{mass}" not in latex
    assert r"\sin \beta_{0}" in write_document(documents[0], "latex")
    assert r"\ddot{\beta}_{0}" in write_document(documents[0], "latex")
    drawn = [mark.runs for mark in mbs.draw(system).picture.marks if isinstance(mark, TextMark)]
    assert (("β", "italic"), ("0", "subscript")) in drawn
    with pytest.raises(mbs.ModelError, match=r"q_label: .* has 1 coordinates, q_label gives 2 letters"):
        mbs.loads(PENDULUM.replace("q_label: beta_0", "q_label: [a, b]"))
    for page in (write_document(each, "html") for each in documents):
        assert "<msub><mi>m</mi><mrow><mi>A</mi></mrow></msub>" in page
        assert "ℓ" in page
        assert "mass<" not in page
