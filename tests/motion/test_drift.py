"""Drift of a crank-rocker under gravity: constraints hold by projection to rounding, by Baumgarte's terms to 1e-6."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.motion.runs.run import FailedRunError
from multibody_sym.program.backend import Backend

FOUR_BAR = Path(__file__).parents[2] / "examples" / "four_bar.yaml"
LONGEST = 0.5


def drifted(kept: str, t_end: float, backend: Backend = "c") -> mbs.Trajectory:
    """Return the motion without motor, from 10 rad/s of the crank."""
    system = replace(mbs.load(FOUR_BAR), forces={})
    return mbs.simulate(system, t_end=t_end, rtol=1e-9, constraints=kept, samples=10 * int(t_end) + 1, backend=backend)


def largest_gap(run: mbs.Trajectory) -> float:
    """Return the largest distance of the rods' ends in joint C by plane trigonometry."""
    a, b, d = (run[name] for name in ("crank_angle", "coupler_angle", "rocker_angle"))
    tip = 0.2 * np.exp(1j * a) + 0.5 * np.exp(1j * (a + b))
    return float(np.abs(tip - (0.5 + 0.4 * np.exp(1j * d))).max())


@pytest.mark.parametrize("t_end", [20, pytest.param(1000, marks=pytest.mark.long)])
def test_drift_of_a_crank_rocker(t_end: float) -> None:
    """An angle is known to half its spacing as a double: 1e-12 rad after 2,000 turns, crank and coupler one each."""
    run = drifted("projection", t_end)
    spacing = float(np.spacing(np.abs(run["crank_angle"]).max()))
    assert run.drift["position"] <= max(1e-12 * LONGEST, spacing)
    assert run.drift["velocity"] <= 1e-12 * LONGEST
    assert run.drift["energy"] < 1e-6
    assert largest_gap(run) <= 2 * max(1e-12 * LONGEST, spacing)
    run = drifted("baumgarte", t_end)
    assert run.drift["position"] <= 1e-6 * LONGEST
    assert run.drift["velocity"] <= 1e-6 * LONGEST
    assert 0.1 * run.drift["position"] < largest_gap(run) < 2 * run.drift["position"]


def test_both_loops_report_the_drift_of_the_integrated_state() -> None:
    """Nothing puts it back: what is reported is the gap that samples show, but for interpolation between steps."""
    for backend in ("c", "python"):
        run = drifted("baumgarte", 1.0, backend)
        assert 1e-13 < run.drift["position"] < 1e-8
        assert 0.2 * largest_gap(run) < run.drift["position"] < 2 * largest_gap(run)


@pytest.mark.parametrize("backend", ["c", "python"])
def test_a_run_that_leaves_its_constraints_has_failed(backend: str) -> None:
    """Nothing stabilises a rod of 1 m under long steps: the run ends where it is a millimetre too long or short."""
    system = mbs.loads("""
multibody_sym: 1
name: rod
gravity: [0, -9.81, 0]
bodies:
  slide: {mass: 1}
  bob: {mass: 1}
joints:
  X: {type: prismatic, parent: ground, child: slide, axis: x, q: x, initial: {q: 1}}
  Y: {type: prismatic, parent: slide, child: bob, axis: y, q: y}
constraints:
  rod: {type: distance, between: [ground, bob], value: 1}
simulation: {t_end: 1, method: explicit_euler, step: 0.01, constraints: {baumgarte: {alpha: 0, beta: 0}}}
""")
    with pytest.raises(FailedRunError, match=r"constraint rod is missed at t = .*thousandth") as failed:
        mbs.simulate(system, backend=backend)
    run = failed.value.trajectory
    length = np.hypot(run["x"], run["y"])
    assert abs(length[-1] - 1) > 1e-3 > 0.9 * np.abs(length[:-1] - 1).max()
