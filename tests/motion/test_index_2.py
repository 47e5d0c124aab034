"""Rows as part of the equations, which makes them of index 2: orders, dependent rows, events, what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.mechanics.changes import with_settings
from multibody_sym.motion.integrator.flow import Flow
from multibody_sym.motion.integrator.loop import stepper
from multibody_sym.motion.loop.python_loop import _Run
from multibody_sym.motion.methods.table import METHODS
from multibody_sym.motion.prepare.problem import prepare_system, problem_of, settings_of
from multibody_sym.program.backend import Native

EXAMPLES = Path(__file__).parents[2] / "examples"
DRIVEN = """
multibody_sym: 1
name: driven
gravity: [0, -9.81, 0]
bodies: {slide: {}, bob: {mass: 2}}
joints:
  x: {type: prismatic, parent: ground, child: slide, axis: x, q: x, initial: {q: 0.6, u: 0, known: true}}
  y: {type: prismatic, parent: slide, child: bob, axis: y, q: y, initial: {q: -0.8}}
constraints: {rod: {type: distance, between: [bob, ground], value: 1 + 0.2*sin(3*t)}}
"""
ORDERS = {"implicit_euler": (1, 1, 128), "trapezoid": (2, 2, 64), "radau_3": (3, 2, 32), "radau_5": (5, 3, 20)}
"""Positions and speeds, multipliers, and steps. Source: Hairer, Wanner, Solving ODEs II, table VII.4.1."""


def example(name: str) -> mbs.System:
    return mbs.load(EXAMPLES / f"{name}.yaml")


def end_in_the_reference(system: mbs.System, method: str, t_end: float, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the state at t_end and the multipliers of the last stage, which lies there, by the steppers in Python."""
    step = t_end / steps
    asked = with_settings(system, {"method": method, "step": step, "t_end": t_end, "constraints": {"index_2": True}})
    ready = prepare_system(asked, code=Native(backend="python"))
    problem = problem_of(ready, settings_of(ready))
    run = _Run(problem, [])
    flow = Flow(METHODS[method], run.derivative, 0.0, t_end, problem.x0, step=step, stages=run.stages())
    taking = stepper(flow.method, flow)
    taking.restart()
    x, slope = flow.x0, flow.slope(0.0, flow.x0)
    for number in range(steps):
        done = taking.finish(trial := taking.attempt(number * step, x, slope, step, (number + 1) * step), trial.x_new)
        taking.advance(done)
        x, slope = done.x_new, done.slope_new
    return x, taking.multipliers


@pytest.mark.parametrize("method", ORDERS)
@pytest.mark.parametrize(
    ("system", "t_end"), [(example("pendulum_xy"), 0.2), (example("slider_crank"), 0.05), (mbs.loads(DRIVEN), 0.3)]
)
def test_the_orders_of_states_and_multipliers(system: mbs.System, t_end: float, method: str) -> None:
    """Against the motion by an explicit method, and the multipliers that belong to its accelerations."""
    exact = mbs.simulate(system, t_end=t_end, method="dormand_prince_8", rtol=1e-13, atol=1e-15, samples=2)
    wanted = np.concatenate([exact.q[-1], exact.u[-1]])
    forces = _Run(exact.problem, []).call("state_derivative", t_end, wanted)[2]
    state, force, steps = ORDERS[method]
    errors = []
    for count in (steps, 2 * steps):
        x, multipliers = end_in_the_reference(system, method, t_end, count)
        errors.append([np.abs(x - wanted).max(), np.abs(multipliers[len(forces) :] - forces).max()])
    measured = np.log2(np.array(errors[0]) / errors[1])
    assert measured == pytest.approx([state, force], abs=0.1)


@pytest.mark.parametrize(("method", "order"), [("implicit_midpoint", 2), ("gauss_4", 4), ("gauss_6", 6)])
def test_gauss_methods_keep_their_order_with_projection(method: str, order: int) -> None:
    """And lose it under rows that are part of the equations, which is why they are refused there."""
    system, steps = mbs.loads(DRIVEN), {2: 320, 4: 80, 6: 20}[order]
    exact = mbs.simulate(system, t_end=1, method="dormand_prince_8", rtol=1e-13, atol=1e-15, samples=2)
    runs = [mbs.simulate(system, t_end=1, method=method, step=1 / n, samples=2) for n in (steps, 2 * steps)]
    errors = [np.abs(np.concatenate([run.q[-1] - exact.q[-1], run.u[-1] - exact.u[-1]])).max() for run in runs]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)
    with pytest.raises(mbs.ModelError, match=r"Gauss methods lose order there.*projection"):
        mbs.simulate(system, method=method, step=0.1, constraints="index_2")


@pytest.mark.parametrize(
    ("name", "t_end"),
    [("three_cranks", 0.3), ("spatial_four_bar", 0.3), ("rolling_coin", 0.3), ("chaplygin_sleigh", 1)],
)
@pytest.mark.parametrize("method", ["radau_5", "trapezoid"])
def test_dependent_and_nonholonomic_rows_in_both_loops(name: str, t_end: float, method: str) -> None:
    """Rows that say twice what is so anyway, rows that vanish in the plane, quaternions, and rolling."""
    system = example(name)
    how = {"step": t_end / 200} if method == "trapezoid" else {"rtol": 1e-8}
    wanted = mbs.simulate(system, t_end=t_end, samples=11, rtol=1e-10)
    kept = {"t_end": t_end, "samples": 11, "method": method, "constraints": "index_2"}
    runs = [mbs.simulate(system, backend=backend, **kept, **how) for backend in ("c", "python")]
    for run in runs:
        np.testing.assert_allclose(run.q, wanted.q, atol=1e-3 if method == "trapezoid" else 1e-6)
        assert max(run.drift["position"], run.drift["velocity"]) < 1e-9
        assert run.statistics["index_2"]
    np.testing.assert_allclose(runs[0].q, runs[1].q, rtol=1e-12, atol=1e-12)
    taken = [run.integration.statistics for run in runs]
    counts = ("steps", "rejected", "evaluations", "jacobians", "factorisations")
    for count in counts if method == "radau_5" else counts[:1]:  # fixed steps are iterated to round-off, which differs
        assert getattr(taken[0], count) == getattr(taken[1], count)
    for measured in ("removed_position", "removed_velocity", "quaternion_deviation"):  # of steps, not of samples
        assert getattr(taken[0], measured) == pytest.approx(getattr(taken[1], measured), abs=1e-12)


def test_multipliers_of_dependent_rows_are_zero() -> None:
    """The coupler of three cranks takes two forces; those of the third pin are left over."""
    _, multipliers = end_in_the_reference(example("three_cranks"), "radau_5", 0.1, 10)
    on_positions, on_speeds = np.split(multipliers, 2)
    rank = np.count_nonzero(on_speeds)
    assert 0 < rank < len(on_speeds)
    assert np.abs(on_positions).max() < 1e-6 * np.abs(on_speeds).max()


@pytest.mark.parametrize("backend", ["c", "python"])
def test_events_begin_anew(backend: str) -> None:
    """A bob on a rod, stopped at its lowest point; a push that begins at 0.2 s is a kink."""
    text = DRIVEN.replace(" + 0.2*sin(3*t)", "") + """
forces: {push: {type: force, on: bob, value: ['where(t < 0.2, 0, 3)', 0, 0]}}
stop: {lowest: x < 0}
"""
    runs = [
        mbs.simulate(mbs.loads(text), t_end=3, method="radau_5", rtol=1e-9, constraints=constraints, backend=backend)
        for constraints in ("index_2", "projection")
    ]
    assert runs[0].t_final < 3
    times = [[event.time for event in run.integration.events] for run in runs]
    assert times[0] == pytest.approx(times[1], rel=1e-7)
    assert times[0] == pytest.approx([0.2, runs[0].t_final], rel=1e-12)
    assert runs[0].drift["position"] < 1e-9


def test_what_cannot_be_is_said() -> None:
    with pytest.raises(mbs.ModelError, match=r"auto cannot .* implicit_euler, trapezoid, radau_3, radau_5"):
        mbs.simulate(mbs.loads(DRIVEN), constraints="index_2")
    with pytest.raises(mbs.ModelError, match="there are no constraints"):
        mbs.simulate(example("pendulum"), method="radau_5", constraints="index_2")
    with pytest.raises(mbs.ModelError, match="choose projection or index_2, not both"):
        mbs.simulate(mbs.loads(DRIVEN), method="radau_5", constraints={"index_2": True, "projection": True})


def test_a_file_may_ask_for_it() -> None:
    text = DRIVEN + "simulation: {t_end: 0.1, method: radau_5, constraints: {index_2: true}}\n"
    system = mbs.loads(text)
    assert mbs.loads(mbs.dumps(system)) == system
    assert mbs.simulate(system).statistics["index_2"]


def test_ida_takes_the_rows_as_equations_too() -> None:
    """Dependent ones as well; its multistep formulas make larger errors than Radau's at the same tolerance."""
    pytest.importorskip("sksundae")
    system = example("three_cranks")
    runs = [mbs.simulate(system, t_end=0.5, method=method, samples=11) for method in ("ida", "dormand_prince")]
    np.testing.assert_allclose(runs[0].q, runs[1].q, atol=1e-7)
    assert runs[0].statistics["index_2"]
    assert max(runs[0].drift["position"], runs[0].drift["velocity"]) < 1e-8
