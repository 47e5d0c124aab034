"""Compiled functions take real numbers: what has an imaginary part, or is text, is refused and not cut down to fit."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs

EXAMPLES = Path(__file__).parents[2] / "examples"
DRIVEN = mbs.loads(
    "{multibody_sym: 1, name: m, parameters: {m: 2, F0: 6}, bodies: {b: {mass: m}},"
    " joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x}},"
    " forces: {f: {type: torque, joint: j, value: F}}, inputs: {F: F0*t}}"
)
NOT_REAL: list[Any] = [
    1j, 1 + 0j, np.complex128(1), np.array([1.0, 2j]), [1.0, 2j], np.array([1.0, 2j], dtype=object), "1", ["1", "2"],
    np.array(["1", "2"]), np.array(["1", "2"], dtype=object), b"1", [b"1", b"2"], None, [None, 1.0], {}, object(),
    np.array(["2020-01-01", "2020-01-02"], dtype="datetime64[s]"), [[1.0], [1.0, 2.0]],
]


def refused(function: Any, *arguments: Any, **named: Any) -> None:
    with pytest.raises(mbs.InputError, match=r"real numbers|is missing"):
        function(*arguments, **named)


@pytest.mark.parametrize("backend", ["c", "python"])
def test_a_state_derivative_takes_real_numbers(backend: Any) -> None:
    rhs = mbs.compile(mbs.state_derivative(DRIVEN), backend=backend)
    for wrong in NOT_REAL:
        refused(rhs, wrong, [1, 2])
        refused(rhs, 0, wrong)
        if not isinstance(wrong, str):  # a text with a unit, or without one
            refused(rhs, 0, [1, 2], {"F0": wrong})
            refused(rhs, 0, [1, 2], None, {"F": wrong})
        if wrong is not None and not isinstance(wrong, dict):
            refused(rhs, 0, [1, 2], wrong)
            refused(rhs, 0, [1, 2], None, wrong)
    for right in ([1, 2], (1.0, Fraction(2)), np.array([1, 2], dtype=np.int32), np.array([1, 2], dtype=np.float32)):
        assert rhs(np.int64(1), right, {"F0": Fraction(8)}).tolist() == [2.0, 4.0]


@pytest.mark.parametrize("backend", ["c", "python"])
def test_functions_of_trees_take_real_numbers(backend: Any) -> None:
    M = mbs.compile(mbs.mass_matrix(DRIVEN), backend=backend)
    forces = mbs.compile(mbs.inverse_dynamics(DRIVEN), backend=backend)
    for wrong in (x for x in NOT_REAL if x is not None):
        refused(M, 0, wrong, [0])
        refused(M, 0, [0], wrong)
        refused(forces, 0, [0], [0], wrong)


@pytest.mark.parametrize("result", ["accelerations", "terms"])
def test_lambdified_equations_take_real_numbers(result: str) -> None:
    function = mbs.derive(DRIVEN).lambdify(result)
    for wrong in NOT_REAL:
        refused(function, wrong, [0])
        refused(function, [0], wrong)
        refused(function, [0], [0], wrong)
        if wrong is not None:
            refused(function, [0], [0], 0, wrong)
    with pytest.raises(mbs.InputError, match=r"q has the shape \(2,\), not \(1,\)"):
        function([0, 1], [0])
    with pytest.raises(mbs.InputError, match=r"parameters has the shape \(1,\), not \(2,\)"):
        function([0], [0], 0, [1])
    with pytest.raises(mbs.InputError, match="'accelerations' or 'terms', got 'mass'"):
        mbs.derive(DRIVEN).lambdify("mass")


def test_the_answer_to_a_complex_step_would_be_wrong() -> None:
    """A complex step gives a derivative where a function is analytic; a step that is lost gives zero."""
    rhs = mbs.compile(mbs.state_derivative(mbs.load(EXAMPLES / "pendulum.yaml")), backend="python")
    with pytest.raises(mbs.InputError, match="x is to be real numbers, got complex ones"):
        rhs(0.0, rhs.x0 + np.array([1e-20j, 0]))
