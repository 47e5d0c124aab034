"""Names and sentences in the letters of a book."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.derivation.notation import Label
from multibody_sym.documents.document import LatexWriter
from multibody_sym.documents.letters import SystemLetters
from multibody_sym.text.parser import parse

SYSTEM = mbs.loads(
    "{multibody_sym: 1, name: s, parameters: {m1: 1 kg, k0: {value: 2, label: mu_0}, a: 1}, bodies: {b: {mass: m1}},"
    " joints: {A: {type: prismatic, parent: ground, child: b, axis: x, q: x1}}}"
)


@pytest.mark.parametrize(
    ("name", "latex"),
    [
        ("x1''", r"\ddot{x}_{1}"),
        ("u_x1", r"\dot{x}_{1}"),
        ("a_x1", r"\ddot{x}_{1}"),
        ("k0", r"\mu_{0}"),
        ("tension(string)", r"T_{\mathrm{string}}"),
        ("normal(c.corner2)", r"N_{\text{c.corner2}}"),
        ("friction_2(c)", r"F_{\mathrm{c},2}"),
        ("fy(A)", "A_{y}"),
        ("velocity(bob, x)", r"\dot{x}_{\mathrm{bob}}"),
        ("total_energy()", r"\text{total energy}"),
        ("generalized_momentum(x1)", r"\text{generalized momentum}\left(x_{1}\right)"),
    ],
)
def test_names_have_letters(name: str, latex: str) -> None:
    assert SystemLetters(SYSTEM, ["x1"]).label(name).latex == latex


@pytest.mark.parametrize(
    ("line", "typeset"),
    [
        ("a block at rest", []),
        ("constraints kept: |phi| <= 1.2e-15", [r"|\varphi|", r"\le", r"1.2 \cdot 10^{-15}"]),
        ("phi = 0; the multiplier is positive", [r"\varphi"]),
        ("t = 2 s: x1 is reached", ["t", "x_{1}"]),
        ("friction(A) is not unique; hint: dormand_prince", [r"F_{\mathrm{A}}", r"\text{dormand prince}"]),
    ],
)
def test_sentences_keep_their_words(line: str, typeset: list[str]) -> None:
    words = SystemLetters(SYSTEM, ["x1"]).words(line)
    assert [word.latex for word in words if isinstance(word, Label)] == typeset
    assert "".join(word.text if isinstance(word, Label) else word for word in words) == line


def test_conditions_are_formulas() -> None:
    letters = SystemLetters(SYSTEM, ["x1"])
    words = letters.condition("abs(friction(A)) <= k0*normal(A) + m1*x1''")
    written = LatexWriter(letters.notation).words(words)
    assert r"\left|F_{\mathrm{A}}\right|" in written
    assert r"m_{1} \ddot{x}_{1}" in written
    assert r"\mu_{0} N_{\mathrm{A}}" in written
    assert letters.expression(parse("2*m1")).has(2)
