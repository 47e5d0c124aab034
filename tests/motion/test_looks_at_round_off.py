"""Switching functions without a margin that are zero but for round-off cost few looks."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.motion.integrator.flow import Events, Flow
from multibody_sym.motion.integrator.loop import steps
from multibody_sym.motion.methods.table import METHODS
from multibody_sym.scalars.arrays import Floats


def _two_equal_pendulums(t: float, x: Floats) -> Floats:
    """The second one's torque is rounded otherwise."""
    return np.array([x[2], x[3], -3.0 * np.sin(x[0]), -3.0 * np.sin(x[1]) - 2e-16 * np.cos(40.0 * t)])


@pytest.mark.parametrize(("method", "most"), [("dormand_prince", 30), ("RK45", 500), ("BDF", 100)])
def test_the_difference_of_two_equal_motions_takes_few_looks(method: str, most: int) -> None:
    asked = 0

    def difference(t: float, x: Floats) -> Floats:
        nonlocal asked
        asked += 1
        return np.array([x[0] - x[1]])

    start, events = np.array([1.0, 1.0, 0.1, 0.1]), Events(difference, (False,))
    taken = sum(1 for _ in steps(Flow(METHODS[method], _two_equal_pendulums, 0.0, 5.0, start, events=events)))
    assert asked < most * taken


@pytest.mark.parametrize("method", ["dormand_prince", "RK45"])
@pytest.mark.parametrize("depth", [1e-9, 1e-12])
def test_a_shallow_crossing_there_and_back_within_a_step_is_seen(method: str, depth: float) -> None:
    """x = (t^2/2, t): the function is positive where t is nearer to 1/2 s than the root of the depth."""
    events = Events(lambda t, x: np.array([depth - (x[1] - 0.5) ** 2]), (True,))
    flow = Flow(METHODS[method], lambda t, x: np.array([x[1], 1.0]), 0.0, 2.0, np.zeros(2), events=events)
    *_, last = steps(flow)
    assert last.event == 0
    assert last.t_new == pytest.approx(0.5 - np.sqrt(depth), abs=1e-9)


def test_what_never_falls_below_its_rounding_takes_few_looks() -> None:
    """The length of a vector that turns, less one: points that have met part only below their margin."""
    asked = 0

    def met(t: float, x: Floats) -> Floats:
        nonlocal asked
        asked += 1
        return np.array([np.hypot(np.cos(x[0]), np.sin(x[0])) - 1.0 + 1e-15 * np.cos(1e7 * t)])

    events = Events(met, (True,), margins=(-8e-14,))
    flow = Flow(METHODS["dormand_prince"], lambda t, x: np.array([x[1], 0.0]), 0.0, 5.0, np.ones(2), events=events)
    taken = sum(1 for _ in steps(flow))
    assert asked < 30 * taken
