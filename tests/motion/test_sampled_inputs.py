"""Runs whose inputs functions give, sampled and held: closed forms, the Stepper, feedback without samples, impacts."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import multibody_sym as mbs

SPRING = """multibody_sym: 1
name: spring
gravity: [0, 0, 0]
parameters: {m: 2 kg, k: 3 N/m, c: 0.4 N*s/m}
bodies: {body: {mass: m}}
joints: {rail: {type: prismatic, parent: ground, child: body, axis: x, q: x, initial: {q: 1, u: 0.5}}}
inputs: {F: 0 N, wind: 0 N}
forces:
  coil: {type: spring_damper, joint: rail, stiffness: k, damping: c}
  push: {type: force, on: body, value: [F + wind, 0, 0]}
outputs: {power: F*u_x, done: work(push)}
stop: {far: x > 3}
simulation: {t_end: 2 s, samples: 201, rtol: 1e-12, atol: 1e-12}
"""
BALL = """multibody_sym: 1
name: ball
gravity: [0, -10, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  ball: {mass: 1 kg}
joints:
  free: {type: point, parent: ground, child: ball, q: [x, y]}
inputs: {F: 0 N, lift: 0 N}
forces:
  push: {type: force, on: ball, value: [F, lift, 0]}
contacts:
  c: {between: [ball, ground.floor], static: 0.5, kinetic: 0.4, restitution: 0.5}
outputs: {friction: friction(c)}
simulation: {t_end: 1.5 s, samples: 31}
"""
WITHOUT_WORK = SPRING.replace(", done: work(push)", "")
"""The same without the integral of a fine motion, which takes ten times as long as the run."""
P, D, EVERY = 30.0, 6.0, 0.02


def pd(t: float, q: np.ndarray, u: np.ndarray) -> Any:
    return -P * q[0] - D * u[0]


def held(every: float = EVERY, **laws: Any) -> dict[Any, Any]:
    return {**laws, "every": every}


@pytest.fixture(scope="module")
def spring() -> mbs.Prepared:
    return mbs.prepare(mbs.loads(SPRING))


@pytest.fixture(scope="module")
def ball() -> mbs.Prepared:
    return mbs.prepare(mbs.loads(BALL))


def sampled(m: float = 2.0, k: float = 3.0, c: float = 0.4) -> np.ndarray:
    """Return the states (x, u) at each sample of 2 s, by the exponential of the matrix of state and held force."""
    whole = expm(EVERY * np.array([[0, 1, 0], [-k / m, -c / m, 1 / m], [0, 0, 0]]))
    states = [np.array([1.0, 0.5])]
    for _ in range(100):
        states.append(whole[:2] @ [*states[-1], -P * states[-1][0] - D * states[-1][1]])
    return np.array(states)


@pytest.mark.parametrize("backend", ["c", "python"])
@pytest.mark.parametrize(
    ("method", "step", "allowed"),
    [("dormand_prince", None, 1e-11), ("radau_5", None, 1e-10), ("LSODA", None, 1e-9), ("rk4", "1 ms", 1e-12),
     ("rk4", "3 ms", 1e-10), ("adams_bashforth_moulton", "1 ms", 1e-11)],
)  # fmt: skip
def test_a_sampled_pd_is_that_of_the_discrete_system(method: str, step: Any, allowed: float, backend: Any) -> None:
    """Steps end at each sample, whatever their length: 3 ms is no part of 20."""
    inputs = held(F=pd)
    run = mbs.simulate(mbs.loads(WITHOUT_WORK), inputs=inputs, method=method, step=step, backend=backend)
    exact = sampled()
    np.testing.assert_allclose(run["x"][::2], exact[:, 0], atol=allowed)
    np.testing.assert_allclose(run["u_x"][::2], exact[:, 1], atol=10 * allowed)
    forces = -exact[:-1] @ [P, D]
    np.testing.assert_allclose(run["F"][:-1].reshape(-1, 2), np.column_stack([forces] * 2), atol=100 * allowed)
    np.testing.assert_allclose(run["power"], run["F"] * run["u_x"], atol=1e-12)
    assert len(run) == 201


def test_it_is_stepped_to_the_bit(spring: mbs.Prepared) -> None:
    run, sim, times = spring.run(inputs=held(F=pd, wind=0.3)), spring.stepper(EVERY), list[float]()
    for k in range(100):
        assert [run["x"][2 * k], run["u_x"][2 * k]] == [*sim.q, *sim.u]
        sim.step([pd(sim.t, sim.q, sim.u), 0.3])
        times.append(sim.t)
        assert sim["F"] == run["F"][2 * k] == run["F"][2 * k + 1]
    again = spring.run(inputs={("F", "wind"): lambda t, q, u: (pd(t, q, u), 0.3), "every": "20 ms"})
    assert np.array_equal(again.q, run.q)
    function = mbs.function(spring.system, [f"-{P}*x - {D}*u_x"])  # which takes what a law takes
    assert np.allclose(spring.run(inputs=held(F=function, wind=0.3)).q, run.q, rtol=1e-13)
    assert np.array_equal(pickle.loads(pickle.dumps(run))["F"], run["F"])


def test_it_is_asked_between_samples_and_at_times_of_ones_own(spring: mbs.Prepared) -> None:
    run, times = spring.run(inputs=held(F=pd)), np.array([0.005, 0.02, 0.033])
    own, between = spring.run(inputs=held(F=pd), samples=times.tolist()), run(times)
    assert np.array_equal(between["F"], run["F"][[0, 2, 2]])
    for name in ("x", "u_x", "F", "done"):
        np.testing.assert_allclose(own[name], between[name], rtol=1e-10)
    assert own["x"][1] == run["x"][2]


def test_a_law_is_called_once_a_sample(spring: mbs.Prepared) -> None:
    times = list[float]()

    def law(t: float, q: np.ndarray, u: np.ndarray) -> float:
        times.append(t)
        q[:] = u[:] = np.nan  # they are its own
        return 1.0

    prepared = mbs.prepare(spring.system, inputs=held(0.3, F=law))
    assert not times
    run = prepared.run(t_end=1)
    assert times == [0.0, 0.3, 0.6, 3 * 0.3]
    assert run.t_final == 1.0
    np.testing.assert_allclose(run["x"], spring.run(inputs={"F": 1.0}, t_end=1)["x"], atol=1e-11)
    prepared.run(t_end=1, parameters={"m": 3})
    assert times[4:] == times[:4]


def test_more_samples_lead_to_feedback_without_any(spring: mbs.Prepared) -> None:
    """Holding delays by half a sample: the error is of first order, and extrapolated of second."""
    whole = spring.run(inputs={"F": f"-{P}*x - {D}*u_x"})["x"]
    once, twice, four = (spring.run(inputs=held(every, F=pd))["x"] for every in (0.02, 0.01, 0.005))
    errors = [np.abs(x - whole).max() for x in (once, twice, four)]
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.05)
    better = [np.abs(2 * fine - rough - whole).max() for rough, fine in ((once, twice), (twice, four))]
    assert better[0] < errors[1] / 10
    assert better[0] / better[1] == pytest.approx(4, rel=0.1)


def test_theorems_and_work_go_on_over_samples(spring: mbs.Prepared) -> None:
    """The work of the force is the change of energy and what the damper takes: k and c are those of the run."""
    run = spring.run(inputs=held(F=pd), parameters={"c": 0})
    np.testing.assert_allclose(run["done"], run.energy - run.energy[0], atol=1e-9)
    assert max(miss.relative for miss in run.verified().values()) < 1e-9


def test_a_stop_is_met_between_samples(spring: mbs.Prepared) -> None:
    run = spring.run(inputs=held(F=lambda t, q, u: 40.0))
    same = spring.run(inputs={"F": 40.0})
    assert run.stop is not None
    assert run.stop["t"] == run.t[-1] == pytest.approx(same.t_final, rel=1e-12)
    assert run["x"][-1] == pytest.approx(3, rel=1e-12)


def test_friction_holds_until_a_sample_and_is_stepped_to_the_bit(ball: mbs.Prepared) -> None:
    def law(t: float, q: np.ndarray, u: np.ndarray) -> float:
        return 3.0 if t < 0.499 else 8.0 if t < 0.799 else -2.0

    run, sim, events = ball.run(inputs=held(0.1, F=law)), ball.stepper(0.1), list[Any]()
    for k in range(15):
        sim.step({"F": law(sim.t, sim.q, sim.u)})
        events += sim.events
        assert [run["x"][2 * k + 2], run["u_x"][2 * k + 2]] == [sim["x"], sim["u_x"]]
    assert [(e["t"], e["kind"]) for e in events] == [(e["t"], e["kind"]) for e in run.events]
    assert [e["kind"] for e in run.events] == ["slide+", "stick"]
    slides = 0.8 + (8 - 4) * 0.3 / (4 + 2)  # 4 N of 0.4 * 10 N
    assert [e["t"] for e in run.events] == pytest.approx([0.5, slides], rel=1e-12)
    assert run["friction"][9:11].tolist() == pytest.approx([-3, -4])
    assert run.friction_work["c"].total == pytest.approx(-4 * (0.5 * 4 * 0.3**2 + 0.5 * 1.2 * (slides - 0.8)), rel=1e-9)
    assert abs(run.energy_residual) < 1e-9


def test_a_ball_bounces_between_samples(ball: mbs.Prepared) -> None:
    """From 1 m it falls at 10 m/s^2; from 0.3 s on 4 N hold it: each impact is the root of a quadratic."""
    run = ball.run(inputs=held(0.3, lift=lambda t, q, u: 0.0 if t < 0.29 else 4.0), initial={"y": 1, "x": 0})
    height, speed = 1 - 5 * 0.3**2, -10 * 0.3
    left = (speed + np.sqrt(speed**2 + 12 * height)) / 6
    after = 0.5 * (6 * left - speed)
    times = 0.3 + left + np.cumsum([0.0, *(2 * after * 0.5**k / 6 for k in range(2))])
    struck = [e["t"] for e in run.events if e["kind"] == "impact"][:3]
    assert struck == pytest.approx(times, rel=1e-10)


def test_wrong_words_are_told(spring: mbs.Prepared) -> None:
    for inputs, message in (
        ({"F": pd}, '"every" says how often'),
        ({"F": pd, "every": 0}, "every is a time in s"),
        ({"F": pd, "every": 1e-12}, "calls of functions are too many"),
        ({"F": int, "every": 1}, "nothing tells what"),
        ({"F": pd, "every": "1 kg"}, "expected a quantity in s"),
        ({"G": pd, "every": 1}, "there is no input 'G'"),
        ({"F": lambda t: 0.0, "every": 1}, "called as"),
        ({3: pd, "every": 1}, "has a function for 3"),
        ({("F", "wind"): pd, "wind": 3, "every": 1}, "gives wind twice"),
        ({("F", "wind"): pd, "every": 1}, "returned the shape"),
        ({"F": lambda t, q, u: np.nan if t else 0.0, "every": 1}, "returned nan for F at t = 1 s"),
        ({"F": lambda t, q, u: "a", "every": 1}, "real numbers"),
        ({"F": 3, "every": 1}, "there is no input 'every'"),
    ):
        with pytest.raises(mbs.InputError, match=message):
            spring.run(inputs=inputs)
    with pytest.raises(mbs.InputError, match="a Stepper holds its inputs itself"):
        mbs.prepare(spring.system, inputs=held(F=pd)).stepper(1)
    with pytest.raises(mbs.InputError, match="a sweep takes no functions"):
        mbs.sweep(spring.system, vary={"m": [1, 2]}, inputs=held(F=pd))
    joints = {"lift": mbs.Prismatic("ground", "cabin", axis="y", motion=mbs.variable("s"))}
    moved = mbs.System("lift", gravity=[0, 0, 0], bodies={"cabin": mbs.Body(mass=1)}, joints=joints, inputs={"s": "t"})
    with pytest.raises(mbs.InputError, match="s drives a motion"):
        mbs.simulate(moved, inputs=held(s=pd))
