"""States that begin, in `stop`: textbook runs, and the last sample of a run that a state ends."""

from __future__ import annotations

from pathlib import Path

import pytest

import multibody_sym as mbs

TEXTBOOK = Path(__file__).parents[2] / "examples" / "textbook"


@pytest.mark.parametrize(("name", "stop", "time"), [("growing_force", "slip", 3.0), ("drum_brake", "stands", 5.0)])
def test_textbook_runs_end_where_the_question_ends(name: str, stop: str, time: float) -> None:
    run = mbs.simulate(mbs.load(TEXTBOOK / f"{name}.yaml"), backend="python")
    assert run.stop == {"t": pytest.approx(time, rel=1e-9), "kind": "stop", "element": stop}


@pytest.mark.parametrize("omega", [50, 49.95])
def test_a_run_that_a_state_ends_has_that_moment_behind_its_last_sample(omega: float) -> None:
    """The drum loses 10 rad/s a second, told each 0.01 s: the last sample is the moment at which it stands."""
    run = mbs.simulate(mbs.load(TEXTBOOK / "drum_brake.yaml"), parameters={"omega": omega})
    assert run.t[-3:] == pytest.approx([4.98, 4.99, 5.0 if omega == 50 else 4.995], rel=1e-9)
    assert run["phi"] == pytest.approx(omega * run.t - 5 * run.t**2, rel=1e-9)
    assert abs(run["u_phi"][-1]) < 1e-9
    assert run.accelerations["u_phi"] == pytest.approx([-10] * len(run.t), rel=1e-9)
