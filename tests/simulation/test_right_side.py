"""The compiled state derivative under another library's integrators, with other parameters and inputs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import multibody_sym as mbs

EXAMPLES = Path(__file__).parents[2] / "examples"
DRIVEN = (
    "{multibody_sym: 1, name: m, parameters: {m: 2 kg, F0: 6, k: 2, weight: k*m}, bodies: {b: {mass: weight}},"
    " joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {q: 1, u: 2}}},"
    " forces: {f: {type: torque, joint: j, value: F}}, inputs: {F: F0*t}}"
)


def test_scipy_integrates_the_motion_that_simulate_gives() -> None:
    system = mbs.load(EXAMPLES / "double_pendulum.yaml")
    rhs = mbs.compile(mbs.state_derivative(system))
    run = mbs.simulate(system, t_end=2, rtol=1e-11)
    other = solve_ivp(rhs, (0, 2), rhs.x0, method="DOP853", rtol=1e-11, atol=1e-11)
    assert rhs.names == ("theta1", "theta2", "u_theta1", "u_theta2")
    assert np.abs(other.y[:2, -1] - run.q[-1]).max() < 1e-8


@pytest.mark.parametrize("backend", ["c", "python"])
def test_parameters_and_inputs_stand_in_place_of_the_system_s(backend) -> None:
    rhs = mbs.compile(mbs.state_derivative(mbs.loads(DRIVEN)), backend=backend)
    assert np.allclose(rhs(2.0, [1, 3]), [3, 12 / 4])
    assert np.allclose(rhs(2.0, [1, 3], parameters={"F0": 12}), [3, 6])
    assert np.allclose(rhs(2.0, [1, 3], parameters={"k": 1}), [3, 6])
    assert np.allclose(rhs(2.0, [1, 3], parameters=[2, 6, 2, 1]), [3, 12])
    assert np.allclose(rhs(2.0, [1, 3], inputs={"F": 8}), [3, 2])
    assert np.allclose(rhs(2.0, [1, 3], inputs=[4]), [3, 1])
    assert np.allclose(rhs(2.0, [1, 3]), [3, 3])


def test_formalisms_give_the_same_rates() -> None:
    system = mbs.load(EXAMPLES / "double_pendulum.yaml")
    x = [0.3, -0.5, 1.0, 2.0]
    rates = [mbs.compile(mbs.state_derivative(system, formalism=f))(0.0, x) for f in (None, "lagrange", "block_ldl")]
    assert np.allclose(rates[0], rates[1], rtol=1e-12)
    assert np.allclose(rates[0], rates[2], rtol=1e-12)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"parameters": {"kk": 1}}, "kk"),
        ({"parameters": [1, 2]}, r"4 parameters \(m, F0, k, weight\)"),
        ({"inputs": {"G": 1}}, "no input 'G'"),
        ({"inputs": [1, 2]}, r"1 inputs \(F\)"),
        ({"x": [1, 2, 3]}, "shape"),
    ],
)
def test_wrong_arguments(given, message: str) -> None:
    rhs = mbs.compile(mbs.state_derivative(mbs.loads(DRIVEN)), backend="python")
    with pytest.raises(mbs.InputError, match=message):
        rhs(0.0, **{"x": [1, 2], **given})
