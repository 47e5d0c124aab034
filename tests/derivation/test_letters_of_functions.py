"""Functions, matrices and momenta have other letters than what the model names."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.documents.derivation import derivation_document
from multibody_sym.documents.document import write_document

MODEL = """
multibody_sym: 1
name: letters
parameters: {p: {value: 2, positive: true}, H: 3, T: 1, V: 2, p_x: 2, L: 1, q: 2}
bodies: {b: {mass: p}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {q: 0.1}}}
forces: {s: {type: spring_damper, joint: j, stiffness: H*p_x*L*q + T + V}}
"""


def test_hamiltons_function_is_not_the_parameter_of_that_letter() -> None:
    told = write_document(derivation_document(mbs.derive(mbs.loads(MODEL), method="hamilton")), "text")
    lines = [line.strip() for line in told.splitlines()]
    assert "T_ = p*x'^2/2" in lines
    assert "H_ = p_x_^2/(2*p) + (H*p_x*L*q + T + V)*x^2/2" in lines
    assert "H_ = T_ + V_; it is constant" in lines
    assert "by definition: p_k = dT_/du" in lines
    assert "in general: q' = dH_/dp_k, p_k' = -dH_/dq" in lines
    assert "x' = p_x_/p" in lines
    assert not [line for line in lines if line.startswith(("H =", "T =", "V =", "p ="))]


@pytest.mark.parametrize("method", ["lagrange", "multipliers"])
def test_energies_are_not_the_parameters_of_those_letters(method: str) -> None:
    equations = mbs.derive(mbs.loads(MODEL), method=method)
    shown = [equation.left for step in equations.steps for equation in step.equations]
    lefts = {left.text for left in shown if hasattr(left, "text")}
    assert {"T_", "V_"} <= lefts
    assert not {"T", "V", "dT/dx"} & lefts
    assert r"\mathcal{T}" in {left.latex for left in shown if hasattr(left, "latex")}


def test_letters_that_are_free_stay() -> None:
    free = MODEL.replace("H: 3, T: 1, V: 2, p_x: 2, L: 1", "h: 3, t1: 1, v: 2, k: 2, l: 1")
    free = free.replace("H*p_x*L*q + T + V", "h*k*l*q + t1 + v")
    told = write_document(derivation_document(mbs.derive(mbs.loads(free), method="hamilton")), "text")
    assert "H = T + V; it is constant" in told
    assert "p_x = p*x'" in told
