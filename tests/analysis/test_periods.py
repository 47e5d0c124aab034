"""The period over which small deviations grow: given as the time of a run is, and no longer than can be followed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.analysis.linearize import period_multipliers

PENDULUM = mbs.loads("""
multibody_sym: 1
name: pendulum
parameters: {l: 0.5 m, g: 9.81 m/s^2}
gravity: [0, -g, 0]
bodies: {bob: {mass: 1, com: [0, -l, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, q: theta}}
""")
WHOLE = 2 * math.pi * math.sqrt(0.5 / 9.81)


@pytest.mark.parametrize("given", ["2*pi*sqrt(l/g)", f"{WHOLE} s", f"{WHOLE * 1000} ms", WHOLE, np.float64(WHOLE)])
def test_a_period_is_given_as_the_time_of_a_run_is(given: Any) -> None:
    """After a whole oscillation about rest every small deviation is as it was."""
    found = period_multipliers(PENDULUM, given)
    assert found.period == pytest.approx(WHOLE, rel=1e-12)
    assert found.multipliers == pytest.approx([1, 1], abs=1e-4)


def test_a_period_follows_changed_parameters() -> None:
    found = period_multipliers(PENDULUM, "2*pi*sqrt(l/g)", parameters={"l": "2 m"})
    assert found.period == pytest.approx(2 * WHOLE, rel=1e-12)


@pytest.mark.parametrize(
    "given", [True, None, "", "1 kg", "l", "theta", "t", "nan", math.nan, math.inf, 0, -1, "-1 s", [1]]
)
def test_what_is_no_period_is_refused_at_its_name(given: Any) -> None:
    with pytest.raises(mbs.InputError) as caught:
        period_multipliers(PENDULUM, given)
    assert caught.value.where.path[:1] == ("period",)


@pytest.mark.parametrize("period", [1e7, 1e300])
def test_a_period_that_takes_too_many_steps_is_told_with_the_time_reached(period: float) -> None:
    told = r"takes too many steps: \d+ led to t = [\d.]+ s, .* give the shortest time after which the motion repeats"
    with pytest.raises(mbs.NoSolutionError, match=told):
        period_multipliers(PENDULUM, period)
