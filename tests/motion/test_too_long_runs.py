"""A run whose time is past what steps of the motion can cross is told as that; a jump in any run as a jump."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import multibody_sym as mbs
from multibody_sym.motion.runs.run import FailedRunError

FOUR_BAR = Path(__file__).parents[2] / "examples" / "four_bar.yaml"


def mass(force: object) -> mbs.System:
    """Return a mass of 1 kg on a straight track, 1 m from 0, which it leaves at 1 m/s, with a force on it."""
    track = mbs.Prismatic("ground", "b", axis="x", q="x", initial={"q": 1, "u": 1})
    return mbs.System(
        "m", bodies={"b": mbs.Body(mass=1)}, joints={"j": track}, forces={"f": mbs.Torque(force, joint="j")}
    )


@pytest.mark.parametrize("t_end", [1e16, 1e20, 1e300])
@pytest.mark.parametrize("method", ["dormand_prince", "radau_5"])
def test_a_run_too_long_for_the_steps_of_its_motion_is_told_as_that(t_end: float, method: str) -> None:
    """Steps of an oscillation at 100 rad/s are some milliseconds; 1e16 of them are those of 1e13 s and more."""
    with pytest.raises(FailedRunError, match="the run is too long for the steps that the motion needs") as caught:
        mbs.simulate(mass("-1e4*x"), t_end=t_end, method=method, samples=3, backend="python")
    assert "singularity" not in str(caught.value)
    assert "ask for a shorter time" in str(caught.value)


def test_a_run_whose_first_step_leads_past_all_numbers_is_told_as_too_long() -> None:
    with pytest.raises(FailedRunError, match="the run is too long for the steps that the motion needs"):
        mbs.simulate(mbs.load(FOUR_BAR), t_end=1e300, samples=3, backend="python")


@pytest.mark.parametrize("t_end", [2.0, 2e3, 2e6])
def test_a_singularity_is_told_as_one_whatever_the_time_of_the_run(t_end: float) -> None:
    """x'' = 2 x^3 with x = x' = 1 is x = 1/(1 - t)."""
    with pytest.raises(FailedRunError, match=r"at t = (1|0\.99\d*|1\.0+\d*) s") as caught:
        mbs.simulate(mass("2*x^3"), t_end=t_end, samples=3, backend="python")
    assert "too long" not in str(caught.value)


@pytest.mark.parametrize("method", ["dormand_prince", "radau_5"])
@pytest.mark.parametrize(("given", "time"), [("sqrt(-t)", r"\S*e-17"), ("log(1 - 4*t)", r"0\.25")])
def test_an_input_without_a_value_is_told_as_that_also_at_the_start(given: str, time: str, method: str) -> None:
    system = replace(mass("P"), inputs={"P": given})
    told = rf"no finite number at t = {time} s: the input P has no finite value there"
    with pytest.raises(FailedRunError, match=told) as caught:
        mbs.simulate(system, t_end=1.0, method=method, samples=3, backend="python")
    assert "too long" not in str(caught.value)
