"""The compiled state derivative under another library's integrators, with other parameters and inputs."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import multibody_sym as mbs
from multibody_sym.motion import function_values as arguments

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


LADEN = """
multibody_sym: 1
name: laden
parameters: {m: 2, b: m/2, J: 0.1, hole: 0.5}
bodies:
  arm: {mass: m, com: [0, -1, 0], inertia: {Izz: J}}
  taken: {mass: HOLE, com: [0, -1, 0]}
  bob: {mass: b, com: [0, -1, 0]}
joints:
  A: {type: revolute, parent: ground, child: arm, axis: z, q: th, initial: {q: 0.3}}
  W: {type: fixed, parent: arm, child: taken}
  B: {type: revolute, parent: arm, child: bob, axis: z, q: ph}
"""


@pytest.mark.parametrize(("coordinates", "hole"), [("relative", "-hole"), ("absolute", "0.5 - hole")])
def test_masses_given_to_a_call_are_judged_as_declared_ones_are(coordinates: str, hole: str) -> None:
    text = LADEN.replace("HOLE", hole)
    rhs = mbs.compile(
        mbs.state_derivative(mbs.loads(f"{text}simulation: {{coordinates: {coordinates}}}\n")), backend="python"
    )
    matrix = mbs.compile(mbs.mass_matrix(mbs.loads(text)), backend="python")
    own = dict(zip([p.name for p in rhs.ready.mechanism.parameters], rhs.ready.parameters.tolist(), strict=True))
    calls = (
        lambda values: rhs(0.0, rhs.x0, parameters=values),
        lambda values: rhs(0.0, rhs.x0, parameters=list({**own, **values}.values())),
        lambda values: matrix(0.0, [0, 0], [0, 0], parameters=values),
    )
    rates = rhs(0.0, rhs.x0, parameters={"hole": 0.1})
    for wrong, what in (
        ({"m": -1.0}, "the mass of arm together with taken is -1"),
        ({"b": -0.5}, "the mass of bob is -0.5 kg; no mass is negative"),
        ({"J": -3.0}, "of arm together with taken are "),
        ({"hole": 3.5}, "the mass of arm together with taken is -1"),
    ):
        for call in calls:
            with pytest.raises(mbs.ModelError, match=re.escape(what)) as caught:
                call(wrong)
            assert caught.value.where.path[0] == "bodies"
    assert np.array_equal(rhs(0.0, rhs.x0, parameters={"hole": 0.1}), rates)


def test_absolute_coordinates_name_a_hole_which_is_no_body_by_itself() -> None:
    text = LADEN.replace("HOLE", "0.1 - hole") + "simulation: {coordinates: absolute}\n"
    for question in (mbs.check, lambda system: mbs.simulate(system, t_end=0.1, backend="python")):
        with pytest.raises(mbs.ModelError, match="taken counts only together with arm") as caught:
            question(mbs.loads(text))
        assert caught.value.where.path == ("bodies", "taken")
    rhs = mbs.compile(mbs.state_derivative(mbs.loads(text.replace("hole: 0.5", "hole: 0"))), backend="python")
    with pytest.raises(mbs.ModelError, match="taken counts only together with arm"):
        rhs(0.0, rhs.x0, parameters={"hole": 0.2})
    assert np.isfinite(rhs(0.0, rhs.x0, parameters={"hole": 0.05})).all()


def test_values_that_were_judged_are_not_judged_again(monkeypatch: pytest.MonkeyPatch) -> None:
    rhs = mbs.compile(mbs.state_derivative(mbs.loads(LADEN.replace("HOLE", "0"))), backend="python")
    judged = []
    monkeypatch.setattr(arguments, "verify_bodies", lambda _mechanism, values: judged.append(values[0]))
    for mass in (2.0, 3.0, 3.0, 3.0, 4.0):
        rhs(0.0, rhs.x0, parameters={"m": mass})
    rhs(0.0, rhs.x0)
    assert judged == [2.0, 3.0, 4.0]
