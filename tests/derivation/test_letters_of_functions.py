"""Energies have other letters than parameters of the model."""

from __future__ import annotations

import pytest

import multibody_sym as mbs

MODEL = """
multibody_sym: 1
name: letters
parameters: {p: {value: 2, positive: true}, H: 3, T: 1, V: 2, p_x: 2, L: 1, q: 2}
bodies: {b: {mass: p}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {q: 0.1}}}
forces: {s: {type: spring_damper, joint: j, stiffness: H*p_x*L*q + T + V}}
"""


@pytest.mark.parametrize("method", ["lagrange", "multipliers"])
def test_energies_are_not_the_parameters_of_those_letters(method: str) -> None:
    equations = mbs.derive(mbs.loads(MODEL), method=method)
    shown = [equation.left for step in equations.steps for equation in step.equations]
    lefts = {left.text for left in shown if hasattr(left, "text")}
    assert {"T_", "V_"} <= lefts
    assert not {"T", "V", "dT/dx"} & lefts
    assert r"\mathcal{T}" in {left.latex for left in shown if hasattr(left, "latex")}
