"""C and D, sampled systems, transfer functions, Bode's plots and trim against closed forms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import solve_continuous_lyapunov, solve_discrete_lyapunov

import multibody_sym as mbs

MASS = """
multibody_sym: 1
name: oscillator
parameters: {m: 2, c: 0.6, k: 50}
bodies: {block: {mass: m}}
joints: {guide: {type: prismatic, parent: ground, child: block, axis: x, q: x}}
forces:
  spring: {type: spring_damper, joint: guide, stiffness: k, damping: c}
  push: {type: force, on: block, value: [F, 0, 0]}
inputs: {F: 0}
outputs: {place: x, felt: "k*x + c*u_x", acceleration: "acceleration(block, x)"}
"""
ARM = """
multibody_sym: 1
name: arm
gravity: [0, -9.81, 0]
bodies:
  upper: {mass: 2, com: [0.3, 0, 0], inertia: {Izz: 0.03}, points: {end: [0.6, 0, 0]}}
  lower: {mass: 1, com: [0.2, 0, 0], inertia: {Izz: 0.01}}
joints:
  A: {type: revolute, parent: ground, child: upper, q: a}
  B: {type: revolute, parent: upper.end, child: lower, q: b, initial: {q: -1.2}}
forces:
  shoulder: {type: torque, joint: A, value: tau}
inputs: {tau: 0}
"""


def oscillator() -> mbs.System:
    return mbs.loads(MASS)


def test_outputs_have_c_and_d_of_their_definitions() -> None:
    found = mbs.linearize(oscillator())
    assert (found.states, found.inputs, found.outputs) == (("x", "u_x"), ("F",), ("place", "felt", "acceleration"))
    np.testing.assert_allclose(found.C, [[1, 0], [50, 0.6], [-25, -0.3]], rtol=1e-14)
    np.testing.assert_allclose(found.D, [[0], [0], [0.5]], rtol=1e-14)
    assert found.as_json()["D"] == [[0.0], [0.0], [0.5]]
    fed_back = mbs.linearize(oscillator(), inputs={"F": "-3*x"})  # a declared input follows the state
    np.testing.assert_allclose(fed_back.C[2], [-26.5, -0.3], rtol=1e-14)


def test_transfer_functions_are_those_of_the_oscillator() -> None:
    found = mbs.linearize(oscillator())
    numerator, denominator = found.transfer_function("place", "F")
    np.testing.assert_allclose(denominator, [1, 0.3, 25], rtol=1e-14)
    np.testing.assert_allclose(numerator, [0, 0, 0.5], atol=1e-14)
    np.testing.assert_allclose(found.transfer_function("felt", "F")[0], [0, 0.3, 25], atol=1e-13)
    s = np.array([[1j, 2 + 1j], [5j, 100.0]])
    np.testing.assert_allclose(found.response(s)[..., 0, 0], 1 / (2 * s**2 + 0.6 * s + 50), rtol=1e-13)
    with pytest.raises(mbs.InputError, match=r"no output 'plac'; did you mean place"):
        found.transfer_function("plac", "F")


def test_bode_has_gain_and_phase(tmp_path: Path) -> None:
    """At the undamped frequency 5 rad/s the phase is -90 deg and the gain 1/(c w)."""
    found = mbs.bode(oscillator(), [0.001, 5.0, 5000.0], outputs="place")
    np.testing.assert_allclose(found.gain[:, 0, 0], [1 / 50, 1 / 3, 1 / (2 * 5000**2)], rtol=1e-6)
    np.testing.assert_allclose(found.phase[:, 0, 0], [0, -np.pi / 2, -np.pi], atol=1e-4)
    np.testing.assert_allclose(found.decibels, 20 * np.log10(found.gain))
    every = mbs.bode(oscillator())
    assert every.response.shape == (400, 3, 1)
    assert every.omega[[0, -1]] == pytest.approx([0.5, 50.0])
    every.plot(tmp_path / "bode.png")
    assert (tmp_path / "bode.png").stat().st_size > 1000
    for wrong in ([0.0], [-1.0], [np.nan], [[1.0]]):
        with pytest.raises(mbs.InputError, match="positive angular frequency"):
            mbs.bode(oscillator(), wrong)
    with pytest.raises(mbs.InputError, match="needs an input"):
        mbs.bode(mbs.loads(ARM.replace("value: tau", "value: 0").replace("inputs: {tau: 0}", "")), at="equilibrium")


def test_samples_are_those_of_the_motion_between_them() -> None:
    """Held inputs: integrate x' = A x + B w over one step."""
    found = mbs.linearize(oscillator())
    dt, x, w = 0.13, np.array([0.2, -0.7]), np.array([3.0])
    run = solve_ivp(lambda _, y: found.A @ y + found.B @ w, (0, dt), x, rtol=1e-12, atol=1e-13)
    sampled = found.discrete(dt)
    assert np.array_equal(sampled.A, found.discrete("130 ms").A)
    np.testing.assert_allclose(sampled.A @ x + sampled.B @ w, run.y[:, -1], rtol=1e-10)
    np.testing.assert_allclose(np.sort_complex(sampled.eigenvalues), np.sort_complex(np.exp(dt * found.eigenvalues)))
    np.testing.assert_allclose(mbs.bode(sampled, [1e-4]).gain[0, 0], 1 / 50, rtol=1e-6)
    for wrong, match in ((0.0, "a time in s"), (np.inf, "a time in s|not a finite"), ("soon", "dt")):
        with pytest.raises(mbs.InputError, match=match):
            found.discrete(wrong)
    with pytest.raises(mbs.InputError, match="these are samples each"):
        sampled.discrete(dt)


def test_a_moving_system_has_the_slopes_of_the_moment() -> None:
    """A pendulum on its way: theta'' = -g/l sin(theta), whose slope is -g/l cos(theta)."""
    text = "multibody_sym: 1\nname: p\ngravity: [0, -9.81, 0]\nbodies: {bob: {mass: 1, com: [0, -0.5, 0]}}\n"
    text += "joints: {A: {type: revolute, parent: ground, child: bob, q: a, initial: {q: 1, u: 2}}}\n"
    text += "forces: {f: {type: torque, joint: A, value: tau}}\ninputs: {tau: 0}\n"
    system = mbs.loads(text)
    with pytest.raises(mbs.NoSolutionError, match="no equilibrium and no steady motion"):
        mbs.linearize(system)
    found = mbs.linearize(system, moving=True)
    np.testing.assert_allclose(found.A, [[0, 1], [-9.81 / 0.5 * np.cos(1), 0]], atol=1e-14)
    assert not found.steady
    for asked in (lambda: mbs.bode(found), lambda: found.discrete(0.1), lambda: found.response(1j), found.to_control):
        with pytest.raises(mbs.NoSolutionError, match=r"A \.\. D are those of a moment of a motion"):
            asked()


def test_trim_finds_the_inputs_that_hold_a_position() -> None:
    """The lower link hangs down by itself; the shoulder holds the moment of all weight."""
    held = mbs.trim(mbs.loads(ARM), {"a": "20 deg"})
    a = np.radians(20)
    assert held.state["b"] == pytest.approx(-np.pi / 2 - a, rel=1e-12)
    assert held.inputs["tau"] == pytest.approx(9.81 * np.cos(a) * (2 * 0.3 + 1 * 0.6), rel=1e-12)
    here = mbs.linearize(mbs.loads(ARM), at=held.state, inputs=held.inputs)
    np.testing.assert_array_equal(held.linearize().A, here.A)
    assert max(map(abs, here.accelerations.values())) < 1e-12
    with pytest.raises(mbs.NoSolutionError, match=r"at: no values of tau were found"):
        mbs.trim(mbs.loads(ARM), {"a": 0, "b": 0})
    with pytest.raises(mbs.InputError, match="no input 'tou'; did you mean tau"):
        mbs.trim(mbs.loads(ARM), {"a": 0}, unknown="tou")
    assert mbs.trim(mbs.loads(ARM), {"a": "20 deg"}, unknown=["tau", "tau"]).inputs == held.inputs
    with pytest.raises(mbs.NoSolutionError, match="at: no position was found in which no speed changes there"):
        mbs.trim(mbs.loads(ARM.replace("inputs: {tau: 0}", "").replace("value: tau", "value: 0")), {"a": 0})


def test_trim_closes_loops() -> None:
    """The crank of a four-bar at an angle: the power of the weight is that of the torque."""
    system = mbs.load(Path(__file__).parents[2] / "examples" / "four_bar.yaml")
    joint = next(iter(system.joints))
    drive = {"drive": mbs.Torque(mbs.variable("tau"), joint=joint)}
    system = replace(system, forces={**system.forces, **drive}, inputs={**system.inputs, "tau": 0})
    name = mbs.mechanism(system).coordinates[0].name
    held = mbs.trim(system, {name: 1.0}, unknown="tau")
    assert held.state[name] == pytest.approx(1.0, abs=1e-15)
    q = [held.state[each.name] for each in mbs.mechanism(system).coordinates]
    at = 0.0, q, [0.0] * len(mbs.mechanism(system).speeds)
    assert np.abs(mbs.function(system, "constraints", backend="python")(*at).phi).max() < 1e-13
    rates = mbs.function(system, "state_derivative", backend="python")(*at, inputs=held.inputs)
    assert np.abs(rates.udot).max() < 1e-10


def test_trim_keeps_given_speeds() -> None:
    """A vehicle at 20 m/s against drag c u^2, geared to a rotor that turns against d u: by power."""
    text = """
multibody_sym: 1
name: vehicle
parameters: {c: 0.4, d: 0.02, ratio: 5}
bodies: {car: {mass: 900}, rotor: {mass: 1, inertia: {Izz: 0.3}}}
joints:
  road: {type: prismatic, parent: ground, child: car, axis: x, q: x}
  shaft: {type: revolute, parent: ground, child: rotor, q: turn}
forces:
  air: {type: force, on: car, value: [-c*u_x*abs(u_x), 0, 0]}
  oil: {type: torque, joint: shaft, value: -d*u_turn}
  motor: {type: torque, joint: shaft, value: M}
constraints: {gear: {type: coupler, joints: {road: ratio, shaft: -1}, value: 0}}
inputs: {M: 0}
"""
    held = mbs.trim(mbs.loads(text), {"x": 3, "u_x": "20 m/s"})
    assert held.state == pytest.approx({"x": 3, "turn": 15, "u_x": 20, "u_turn": 100}, rel=1e-12)
    assert held.inputs["M"] == pytest.approx((0.4 * 20**3 + 0.02 * 100**2) / 100, rel=1e-12)
    assert mbs.trim(mbs.loads(text), {"u_turn": 100}).inputs == pytest.approx(held.inputs, rel=1e-12)
    near = mbs.linearize(mbs.loads(text), at=held.state, inputs=held.inputs)
    mass = 900 + 0.3 * 5**2
    assert near.steady
    assert near.eigenvalues.real.min() == pytest.approx(-(2 * 0.4 * 20 + 0.02 * 5**2) / mass, rel=1e-12)


def test_trim_stays_within_the_limits_of_joints() -> None:
    """Weight and a spring alone hold the arm at two angles, the roots of k (b - b0) = m g l cos(b): one is allowed."""
    text = """
multibody_sym: 1
name: arm
gravity: [0, -9.81, 0]
bodies: {arm: {mass: 1, com: [0.5, 0, 0], inertia: {Izz: 0.1}}}
joints: {J: {type: revolute, parent: ground, child: arm, q: b, limits: {lower: LOWER, upper: 3}, initial: {q: -0.8}}}
forces: {spring: {type: spring_damper, joint: J, stiffness: 4, length: -1}, motor: {type: torque, joint: J, value: M}}
inputs: {M: 0, idle: 0}
"""
    free, narrow = (mbs.loads(text.replace("LOWER", lower)) for lower in ("-4", "-1"))
    found = mbs.trim(free, unknown="idle").state["b"]
    assert 4 * (found + 1) == pytest.approx(-9.81 * 0.5 * np.cos(found), rel=1e-12)
    assert found < -1
    with pytest.raises(mbs.NoSolutionError, match=r"no values of idle were found .* within the limits of b"):
        mbs.trim(narrow, unknown="idle")
    held = mbs.trim(narrow, unknown="M")
    b = held.state["b"]
    assert -1 <= b <= 3
    assert held.inputs["M"] == pytest.approx(4 * (b + 1) + 9.81 * 0.5 * np.cos(b), rel=1e-12)
    with pytest.raises(mbs.NoSolutionError, match="at: b = -2 is past the limit of joint J, -1 rad"):
        mbs.trim(narrow, {"b": -2})


def test_feedback_is_a_law_of_the_inputs() -> None:
    system = mbs.loads(MASS.replace("inputs: {F: 0}", "inputs: {F: 25}"))
    near = mbs.linearize(system, at={"x": 0.5})  # k x = 25 N
    law = near.feedback([[30, 4]])
    closed = mbs.linearize(system, at={"x": 0.5}, inputs=law)
    np.testing.assert_allclose(closed.A, [[0, 1], [-(50 + 30) / 2, -(0.6 + 4) / 2]], rtol=1e-15)
    assert max(map(abs, closed.accelerations.values())) < 1e-14
    assert near.input_values == {"F": 25.0}
    for wrong, of, match in (
        ([1], near, r"K has the shape \(1, 1\), not \(1, 2\)"),
        ([[1, 2]], near.discrete(0.1), "a law of samples is no expression"),
    ):
        with pytest.raises(mbs.InputError, match=match):
            of.feedback(wrong)
    text = "multibody_sym: 1\nname: ball\nbodies: {b: {mass: 1, inertia: {Ixx: 1, Iyy: 1, Izz: 1}}}\n"
    text += "joints: {J: {type: spherical, parent: ground, child: b}}\ninputs: {M: 0}\n"
    text += "forces: {m: {type: torque, on: b, value: [M, 0, 0]}}\n"
    with pytest.raises(mbs.InputError, match=r"J\.rx is no coordinate"):
        mbs.linearize(mbs.loads(text)).feedback(np.zeros((1, 6)))


def test_an_lqr_costs_as_little_as_its_riccati_equation_says() -> None:
    """x^T P x is the cost from x on: P solves Lyapunov's equation of the closed loop, and any other law costs more."""
    near, Q, R = mbs.linearize(mbs.loads(MASS)), np.diag([4.0, 1.0]), np.array([[0.3]])
    for system, solve in ((near, solve_continuous_lyapunov), (near.discrete(0.1), solve_discrete_lyapunov)):
        K = system.lqr(Q, R)

        def cost(K: np.ndarray, system: mbs.Linearization = system, solve: Any = solve) -> float:
            sign = -1.0 if system.dt is None else 1.0
            return float(np.trace(solve((system.A - system.B @ K).T, sign * (Q + K.T @ R @ K))))

        assert all(cost(K + d) > cost(K) for d in 1e-3 * np.array([[[1, 0]], [[-1, 0]], [[0, 1]], [[0, -1]]]))
    for wrong in (([1, 1], R), (np.array([[1, 1], [0, 1]]), R), (Q, np.eye(2))):
        with pytest.raises(mbs.InputError, match=r"is a symmetric matrix|Q is not symmetric"):
            near.lqr(*wrong)
    with pytest.raises(mbs.InputError, match="R is not positive definite"):
        near.lqr(Q, [[0.0]])


def test_an_output_without_a_slope_is_named() -> None:
    with pytest.raises(mbs.NoSolutionError, match="C has no value in this state: v has no derivative there"):
        mbs.linearize(mbs.loads(MASS.replace("outputs: {", "outputs: {v: sqrt(u_x^2 + x^2), ")))


def test_transfer_matrices_take_numbers_alone() -> None:
    near = mbs.linearize(mbs.loads(MASS))
    for wrong in ("1j", None, ["a"], [[1], [2, 3]]):
        with pytest.raises(mbs.InputError, match="s is to be numbers"):
            near.response(wrong)  # type: ignore[arg-type]
    with pytest.raises(mbs.InputError, match="K is to be finite"):
        near.feedback([[np.nan, 1]])


def test_trim_leaves_prescribed_motions_as_they_are() -> None:
    """A hinge below a cart that is driven with a = 0.4 m/s^2: M = m g l sin(th) + m a l cos(th)."""
    text = """
multibody_sym: 1
name: driven
gravity: [0, -9.81, 0]
bodies: {cart: {mass: 1}, bob: {mass: 2, com: [0, -0.5, 0]}}
joints:
  slide: {type: prismatic, parent: ground, child: cart, axis: x, motion: w}
  hinge: {type: revolute, parent: cart, child: bob, q: th}
inputs: {w: 0.2*t^2, M: 0}
forces: {m: {type: torque, joint: hinge, value: M}}
"""
    held = mbs.trim(mbs.loads(text), {"th": 0.3})
    assert held.inputs == pytest.approx({"M": 9.81 * np.sin(0.3) + 0.4 * np.cos(0.3)}, rel=1e-12)
    with pytest.raises(mbs.InputError, match="w drives a motion or a constraint"):
        mbs.trim(mbs.loads(text), {"th": 0.3}, unknown="w")


def test_weights_of_a_law_that_make_none_are_refused() -> None:
    """A pendulum without damper: no weight of the states leaves its eigenvalues on the imaginary axis."""
    text = """
multibody_sym: 1
name: pendulum
gravity: [0, -9.81, 0]
bodies: {bob: {mass: 1, com: [0, -1, 0]}}
joints: {h: {type: revolute, parent: ground, child: bob, q: x}}
inputs: {F: 0}
forces: {f: {type: torque, joint: h, value: F}}
"""
    near = mbs.linearize(mbs.loads(text))
    for found in (near, near.discrete(0.01)):
        with pytest.raises(mbs.NoSolutionError, match=r"A - B K keeps the eigenvalue .* that Q leaves out a weight"):
            found.lqr(np.zeros((2, 2)), [[1]])
        with pytest.raises(mbs.InputError, match=r"Q is not symmetric: \[0, 1\] and \[1, 0\] are 2, 0"):
            found.lqr([[1, 2], [0, 1]], [[1]])
        with pytest.raises(mbs.InputError, match="R is not positive definite: its least eigenvalue is -1"):
            found.lqr(np.eye(2), [[-1]])
    assert near.lqr(np.diag([0.0, 1.0]), [[1]]) == pytest.approx(np.array([[0.0, 1.0]]), abs=1e-9)  # P = diag(g/l, 1)
