"""Numbers that are no fractions, which stand where exact ones would be too long, are written by their decimals."""

from __future__ import annotations

import sympy

from multibody_sym.algebra.writers import LatexScript, TextScript

ROOT = sympy.sqrt(3)
NUMBER = sympy.Float("0.1234567")


def test_floats_are_written_alone_and_before_roots() -> None:
    text = TextScript({}, {})
    assert text.shown(NUMBER) == "0.1234567"
    assert text.shown(-NUMBER * ROOT) == "-0.1234567*sqrt(3)"
    assert text.shown(1 - NUMBER * ROOT) == "1 - 0.1234567*sqrt(3)"
    assert text.shown(sympy.Float(0.25)) == "1/4"
    assert "0.1234567" in LatexScript({}, {}).shown(NUMBER * ROOT)
