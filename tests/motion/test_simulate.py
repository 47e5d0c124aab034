"""Simulated motions against closed forms, conserved quantities, other backends, other formalisms and other starts."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.special import ellipj

import multibody_sym as mbs
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.motion.loop import python_loop
from multibody_sym.motion.prepare import problem
from multibody_sym.motion.runs.run import FailedRunError

EXAMPLES = Path(__file__).parents[2] / "examples"
PENDULUM_XY = """
multibody_sym: 1
name: pendulum_xy
gravity: [0, -g, 0]
parameters: {g: 9.81, l: 1 m, k: 1}
bodies: {bob: {mass: 1 kg, inertia: {Izz: 1}}}
joints: {plane: {type: planar, parent: ground, child: bob, q: [x, y, turn], initial: {q: [l, 0, 0]}}}
constraints: {rod: {type: distance, between: [ground, bob], value: l}}
outputs: {pull: tension(rod)}
simulation: {t_end: 2 s}
"""


def pendulum(**changes):
    return mbs.simulate(mbs.load(EXAMPLES / "pendulum.yaml"), **changes)


def pendulum_xy() -> mbs.System:
    return mbs.loads(PENDULUM_XY)


def exact_angle(t, start, rate):
    """Return the angle of a pendulum let go at `start`: sin(theta/2) = k cd(w t, k^2), k = sin(start/2)."""
    k = np.sin(start / 2)
    _, cn, dn, _ = ellipj(rate * t, k**2)
    return 2 * np.arcsin(k * cn / dn)


def test_pendulum_moves_as_elliptic_functions_say() -> None:
    run = pendulum(rtol=1e-12, atol=1e-13)
    assert np.abs(run["theta"] - exact_angle(run.t, np.pi / 3, np.sqrt(9.81))).max() < 1e-9
    assert run.t[0] == 0.0
    assert run.t[-1] == 10.0
    assert len(run) == 1001


def test_default_tolerances_keep_eight_digits() -> None:
    run = pendulum()
    assert np.abs(run["theta"] - exact_angle(run.t, np.pi / 3, np.sqrt(9.81))).max() < 1e-7
    assert run.drift["energy"] < 1e-7


def test_energy_is_kept_and_is_what_the_output_says() -> None:
    run = mbs.simulate(mbs.load(EXAMPLES / "double_pendulum.yaml"), rtol=1e-11)
    assert run.drift["energy"] < 1e-7
    assert np.allclose(run.energy, run["energy"], rtol=0, atol=1e-12)
    assert np.abs(run.kinetic_energy).max() > 1.0


def test_both_backends_give_the_same_motion() -> None:
    runs = [pendulum(backend=backend, t_end=2) for backend in ("c", "python")]
    assert [run.statistics["backend"] for run in runs] == ["c", "python"]
    assert np.abs(runs[0].q - runs[1].q).max() < 1e-13
    assert runs[0].statistics["steps"] == runs[1].statistics["steps"]


@pytest.mark.parametrize(
    ("example", "formalism"),
    [
        *(("double_pendulum", name) for name in FORMALISMS if name != "composite_body"),
        *(("pendulum_xy", name) for name in FORMALISMS if name not in ("composite_body", "lagrange")),
    ],
)
def test_every_formalism_gives_the_same_motion(example: str, formalism: str) -> None:
    system = pendulum_xy() if example == "pendulum_xy" else mbs.load(EXAMPLES / f"{example}.yaml")
    usual = mbs.simulate(system, t_end=1, rtol=1e-11)
    other = mbs.simulate(system, t_end=1, rtol=1e-11, formalism=formalism)
    assert other.statistics["formalism"] == formalism != usual.statistics["formalism"]
    assert np.abs(other.q - usual.q).max() < 1e-8


def test_parameters_take_text_with_units() -> None:
    assert pendulum(parameters={"l": "50 cm"}, t_end=1)["height"][0] == pytest.approx(-0.25)


def test_projection_holds_constraints_to_round_off() -> None:
    run = mbs.simulate(pendulum_xy())
    assert run.drift["position"] < 1e-13
    assert run.drift["velocity"] < 1e-13
    assert run.statistics["projection"] is True
    assert run.baumgarte is None
    assert np.abs(np.hypot(run["x"], run["y"]) - 1).max() < 1e-13
    angle = exact_angle(run.t, np.pi / 2, np.sqrt(9.81))
    assert np.abs(run["x"] - np.sin(angle)).max() < 1e-7


def test_baumgarte_chooses_coefficients_from_a_pilot_without_it() -> None:
    free = mbs.simulate(pendulum_xy(), constraints={"projection": False})
    kept = mbs.simulate(pendulum_xy(), constraints="baumgarte")
    assert kept.baumgarte == {name: pytest.approx(0.01 / free.statistics["mean_step"]) for name in ("alpha", "beta")}
    assert kept.drift["position"] < free.drift["position"]


@pytest.mark.parametrize("backend", ["c", "python"])
def test_a_load_drawn_through_its_pulley_ends_the_run(backend) -> None:
    """Block on an incline, s = -2 + 2 t^2 until it meets the pulley at t = 1, where the rope's length has a kink."""
    system = mbs.load(EXAMPLES / "textbook" / "incline_pulley.yaml")
    with pytest.raises(FailedRunError, match=r"constraint string cannot be satisfied at t = 1 s") as caught:
        mbs.simulate(system, t_end=10, backend=backend)
    run = caught.value.trajectory
    assert np.allclose(run["s"], -2 + 2 * run.t**2, rtol=0, atol=1e-9)
    assert run.t[-1] == pytest.approx(1.0, abs=0.011)


def test_too_many_steps_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(problem, "_MOST_STEPS", 20)
    with pytest.raises(FailedRunError, match="largest number of steps"):
        pendulum()
    with pytest.raises(mbs.ModelError, match="too many"):
        pendulum(step=0.1)


STIFF = """
multibody_sym: 1
name: stiff
bodies: {b: {mass: 4}}
joints: {J: {type: prismatic, parent: ground, child: b, axis: y, q: y, initial: {q: 0.1}}}
forces: {spring: {type: spring_damper, joint: J, stiffness: %s, damping: %s}}
"""


@pytest.mark.parametrize("backend", ["c", "python"])
@pytest.mark.parametrize(
    ("stiffness", "damping", "told"),
    [
        ("36e20", 0, r"y is stiff, it swings with omega = 3e\+10 rad/s .* 4.77e\+09 times in the run.* and the unit"),
        ("4e12", "4e12", r"y is stiff, it dies down within 1e-12 s there, and dormand_prince .*method: radau_5"),
    ],
)
def test_stiffness_is_told_where_it_keeps_steps_short(
    monkeypatch: pytest.MonkeyPatch, backend: Any, stiffness: str, damping: Any, told: str
) -> None:
    """By hand: omega = sqrt(k/m), omega t/(2 pi) swings in 1 s; much damped the fast rate is c/m."""
    monkeypatch.setattr(problem, "_MOST_STEPS", 3000)
    with pytest.raises(FailedRunError, match=told):
        mbs.simulate(mbs.loads(STIFF % (stiffness, damping)), t_end=1, backend=backend)


WINDING = """
multibody_sym: 1
name: winding
bodies: {b: {mass: 1, inertia: {Ixx: 1, Iyy: 1, Izz: 1}}}
joints: {J: {type: spherical, parent: ground, child: b, initial: {u: [0, 0, 30]}}}
forces: {drive: {type: torque, on: b, frame: b, value: [0, 0, 30*J_wz]}}
"""


@pytest.mark.parametrize("backend", ["c", "python"])
def test_a_run_that_would_take_too_many_steps_ends_soon(monkeypatch: pytest.MonkeyPatch, backend: Any) -> None:
    """By hand: omega = 30 e^(30 t), half the steps are taken in the last ln(2)/30 s, 1 s takes e^30 of them."""
    monkeypatch.setattr(python_loop, "LEAST_PACE", 1 << 12)
    with pytest.raises(FailedRunError, match=r"ever more steps, .* to t = 1 s.*J_wz is .* rad/s there") as caught:
        mbs.simulate(mbs.loads(WINDING), t_end=1, backend=backend)
    run = caught.value.trajectory
    assert run.statistics["steps"] == {"c": 1 << 17, "python": 1 << 12}[backend]
    assert run.final["speeds"]["J_wz"] == pytest.approx(30 * math.exp(30 * run.t_final), rel=1e-4)


def test_steps_that_a_run_can_take_are_taken() -> None:
    """The same as before, but for an end before it is too fast: over 131,072 steps, of 200 million that it may take."""
    run = mbs.simulate(mbs.loads(WINDING), t_end=0.337)
    assert 1 << 17 < run.statistics["steps"] < 1 << 20


def test_no_stiffness_is_told_of_a_slow_pendulum(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(problem, "_MOST_STEPS", 20)
    with pytest.raises(FailedRunError, match=r"s: ask for less accuracy or a shorter time$"):
        pendulum()


def test_reactions_follow_the_run() -> None:
    run = pendulum(t_end=3)
    theta, speed = run["theta"], run["u_theta"]
    along = 9.81 * np.cos(theta) + speed**2  # of a bob of 1 kg on 1 m
    assert np.allclose(run.reactions["hinge"]["fy"], along * np.cos(theta), rtol=0, atol=1e-9)
    assert np.allclose(run.reactions["hinge"]["fx"], -along * np.sin(theta), rtol=0, atol=1e-9)
    assert np.allclose(run.reactions["hinge"]["fy"], run["pull"], rtol=0, atol=1e-12)
    assert np.allclose(run.reactions["hinge"]["mz"], 0.0, rtol=0, atol=1e-12)


def test_accelerations_are_the_rates_of_speeds() -> None:
    run = pendulum(t_end=1)
    assert np.allclose(run.accelerations["u_theta"], -9.81 * np.sin(run["theta"]), rtol=0, atol=1e-12)


def test_progress_brings_every_sample_once() -> None:
    seen: list[tuple[np.ndarray, float]] = []
    run = pendulum(on_progress=lambda new, part: seen.append((new["theta"], part)))
    assert np.array_equal(np.concatenate([values for values, _ in seen]), run["theta"])
    assert seen[-1][1] == 1.0


def test_an_interrupted_run_keeps_its_samples() -> None:
    def stop(_new: object, part: float) -> None:
        if part > 0.01:
            raise KeyboardInterrupt

    run = pendulum(t_end=2000, samples=200001, on_progress=stop)
    assert run.interrupted
    assert 1 < len(run) < 200001
    assert run.as_json()["interrupted"] is True
    assert run.final["t"] < 2000


def test_a_rope_that_would_push_is_an_event() -> None:
    joint = {"type": "prismatic", "parent": "ground", "axis": "x"}
    system = mbs.System(
        "pushed",
        bodies={"left": {"mass": 1}, "right": {"mass": 2}},
        joints={"a": {**joint, "child": "left"}, "b": {**joint, "child": "right", "initial": {"q": 0.5}}},
        forces={"p": {"type": "force", "on": "left", "value": ["1 - 2*t", 0, 0]}},
        constraints={"string": {"type": "rope", "path": ["left", "right"]}},
    )
    (event,) = mbs.simulate(system, t_end=0.4, samples=41).events
    assert event == {"t": 0.0, "kind": "rope would push", "element": "string"}
    pulled = replace(system, forces={"p": {"type": "force", "on": "left", "value": ["2*t - 1", 0, 0]}})
    (later,) = mbs.simulate(pulled, t_end=1, samples=101).events
    assert later["t"] == pytest.approx(0.51)
    assert not mbs.simulate(pulled, t_end=0.4).events
