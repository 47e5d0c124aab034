"""Implicit methods by name on declared systems, against an explicit one: rows, quaternions, inputs, both backends."""

from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs

EXAMPLES = Path(__file__).parents[2] / "examples"
IMPLICIT = {"radau_5": {"rtol": 1e-8}, "gauss_4": {"step": 0.002}}


@pytest.mark.parametrize("example", ["pendulum_xy", "spinning_top", "cart_pole"])
def test_the_motion_is_that_of_the_explicit_method(example):
    system = mbs.load(EXAMPLES / f"{example}.yaml")
    wanted = mbs.simulate(system, t_end=0.5, samples=51, rtol=1e-11)
    for method, how in IMPLICIT.items():
        run = mbs.simulate(system, t_end=0.5, samples=51, method=method, **how)
        np.testing.assert_allclose(run.q, wanted.q, atol=5e-5 if example == "spinning_top" else 1e-8)
        assert run.drift["position"] <= 1e-12
        assert run.statistics["jacobians"] > 0


def test_it_runs_in_python_too():
    system = mbs.load(EXAMPLES / "pendulum_xy.yaml")
    runs = [mbs.simulate(system, t_end=0.1, samples=3, method="radau_5", backend=name) for name in ("c", "python")]
    np.testing.assert_allclose(runs[0].q, runs[1].q, atol=1e-12)
    assert runs[0].statistics["steps"] == runs[1].statistics["steps"]


@pytest.mark.parametrize("method", ["implicit_euler", "radau_5", "BDF"])
def test_a_model_that_nothing_moves_but_what_is_prescribed_runs_too(method):
    run = mbs.simulate(mbs.load(EXAMPLES / "lift.yaml"), method=method, samples=9)
    lift = 12.0 * 2.0 * np.pi / 8.0**2 * np.sin(2.0 * np.pi * run.t / 8.0)  # y'' of h*(t/T - sin(2*pi*t/T)/(2*pi))
    np.testing.assert_allclose(run["reading"], 70.0 * (9.81 + lift), rtol=1e-12)


def test_an_iteration_without_a_solution_is_said_in_words():
    text = """
multibody_sym: 1
name: small
bodies: {cart: {mass: 1 kg}}
joints: {slide: {type: prismatic, parent: ground, child: cart, axis: x, q: x, initial: {q: 1 m, u: 1 m/s}}}
forces: {push: {type: force, on: cart, value: [3*x^2, 0, 0]}}
"""
    with pytest.raises(mbs.RunError, match=r"Newton's iteration .* on account of (u_)?x: take shorter steps"):
        mbs.simulate(mbs.loads(text), t_end=8, method="gauss_4", step=4)


@pytest.mark.parametrize(
    ("method", "constraints", "error"),
    [
        ("implicit_euler", "index_2", 1e-2),
        ("trapezoid", "index_2", 1e-4),
        ("implicit_midpoint", "projection", 1e-4),
        ("radau_3", "index_2", 1e-6),
        ("gauss_4", "projection", 1e-8),
        ("radau_5", "index_2", 1e-8),
        ("gauss_6", "projection", 1e-8),
    ],
)
def test_stiff_forces_in_a_loop_and_steps_a_hundred_times_theirs(method, constraints, error):
    """Iterated to the rounding of what is stiff, which stands far over that of the motion."""
    system = mbs.load(EXAMPLES / "elastic_rod.yaml")
    wanted = mbs.simulate(system, t_end=0.1, samples=11, method="dormand_prince", constraints="projection")
    run = mbs.simulate(system, t_end=0.1, samples=11, method=method, step=0.002, constraints=constraints)
    assert np.abs(run["phi"] - wanted["phi"]).max() < error
