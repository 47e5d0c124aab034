"""When a step passed singular positions, of independences whose zeros are known; and how often it is looked at."""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from multibody_sym.motion.integrator.singular import singular_times
from multibody_sym.program.runtime_constants import FEW_LOOKS, LOOKS


def looked(independence: Callable[[float], float], t: float = 2.0, h: float = 0.1) -> tuple[tuple[float, ...], int]:
    """Return what is found in a step, and how often it was looked at."""
    looks = []

    def at(time: float, _x: np.ndarray) -> float:
        looks.append(time)
        return independence(time)

    step: Any = SimpleNamespace(t=t, h=h, t_new=t + h, value=lambda theta: np.array([theta]))
    seen = [independence(t + c * h) for c in (0.0, 0.2, 0.3, 0.8, 8 / 9, 1.0)]
    return singular_times(step, at, (min(seen), max(seen))), len(looks)


@pytest.mark.parametrize("seed", range(40))
def test_a_zero_is_found_where_it_is(seed: int) -> None:
    """It goes down and up as steeply, and bends, as beside a position in which rows become dependent."""
    of = Random(seed).uniform
    zero, slope, bend = 2.0 + 0.1 * of(0.05, 0.95), of(0.4, 1.0), of(-2.0, 2.0)
    found, _ = looked(lambda t: abs(t - zero) * slope * (1.0 + bend * (t - zero)))
    assert found == pytest.approx((zero,), abs=1e-6)


def test_two_zeros_are_both_found() -> None:
    found, _ = looked(lambda t: abs(np.sin(np.pi * (t - 2.02) / 0.06)))
    assert found == pytest.approx((2.02, 2.08), abs=1e-6)


@pytest.mark.parametrize("ratio", [0.3, 0.6, 1.0, 1.7, 3.3])
def test_a_step_without_one_is_looked_at_a_few_times(ratio: float) -> None:
    """Two thirds of the steps near singular positions pass none: each was looked at 27 times, half of a run's work."""
    found, looks = looked(lambda t: 0.1 + 0.1 * (ratio - 1.0) * (t - 2.0) / 0.1)
    assert (found, looks) == ((), FEW_LOOKS + 1)


def test_what_dips_and_does_not_reach_zero_is_none() -> None:
    found, looks = looked(lambda t: 0.02 + abs(t - 2.04))
    assert found == ()
    assert looks <= LOOKS + 1 + 10


@pytest.mark.parametrize("h", [2.0, 3.0, 4.0, 5.0])
def test_steps_over_many_positions_tell_all(h: float) -> None:
    """A crank that is turned evenly is computed by steps of several turns, and few looks could all be alike."""
    found, _ = looked(lambda t: abs(np.sin(3.0 * t + 1.0)), h=h)
    first, last = (np.ceil((3.0 * t + 1.0) / np.pi) for t in (2.0, 2.0 + h))
    expected = (np.arange(first, last) * np.pi - 1.0) / 3.0
    assert found == pytest.approx(tuple(expected), abs=1e-2)
