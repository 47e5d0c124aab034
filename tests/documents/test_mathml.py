"""Expressions as MathML: well formed, with names and texts that are text."""

from __future__ import annotations

import random
import re
from html import unescape
from html.entities import html5
from xml.etree import ElementTree

import pytest
import sympy
from random_formulas import random_formula

from multibody_sym.documents.formulas import MathmlScript, mathml_name


def tree(content: str) -> ElementTree.Element:
    """What a browser reads; entities by name are those of HTML."""
    named = re.sub(r"&([A-Za-z]+);", lambda x: x[0] if x[1] in ("lt", "gt", "amp") else html5[f"{x[1]};"], content)
    return ElementTree.fromstring(f"<math>{named}</math>")


def words(content: str) -> str:
    return unescape("".join(tree(content).itertext()))


@pytest.mark.parametrize("seed", range(20))
def test_random_formulas_are_well_formed(seed: int) -> None:
    assert words(MathmlScript({}, {}).shown(random_formula(random.Random(seed), 5)))


def test_a_formula_is_read_as_it_is_meant() -> None:
    m1, m2, g = sympy.symbols("m_1 m_2 g")
    script = MathmlScript({s: mathml_name(s.name) for s in (m1, m2, g)}, {})
    assert words(script.shown(g * (m2 - m1) / (m1 + m2))).replace(" ", "") == "g(m2−m1)m1+m2"
    assert words(script.shown(sympy.sqrt(2 * g))) == "2g"
    assert words(script.shown(-sympy.sin(g) ** 2)).replace("\u2061", "") == "−sin2(g)"
    case = script.shown(sympy.Piecewise((1, g > 0), (2, True)))
    assert words(case) == "{1where\xa0g>02else"
    assert "<mtable>" in script.shown(sympy.Matrix([[1, g], [0, m1]]))


@pytest.mark.parametrize(
    ("name", "read"),
    [("theta", "θ"), ("theta1'", "θ˙1"), ("m_ab''", "m¨ab"), ("dT/dx'", "dT/dx'"), ("</mi><b>", "</mi><b>")],
)
def test_names(name: str, read: str) -> None:
    assert words(mathml_name(name)) == read
