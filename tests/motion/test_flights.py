"""How long a gap stays open under a constant acceleration: s + v t - a t^2/2 has its first zero then."""

from __future__ import annotations

import math

import pytest

from multibody_sym.motion.switching.decision import Fall


@pytest.mark.parametrize("start", [0.0, 1e-300, 1e-9, 0.3])
@pytest.mark.parametrize("rate", [0.0, -1e-200, -0.4, 0.7])
@pytest.mark.parametrize("falling", [9.81, 1e-250])
def test_it_is_the_zero_of_the_gap(start: float, rate: float, falling: float) -> None:
    fall = Fall(start, rate, falling)
    left = fall.left
    assert left >= 0.0
    assert start + rate * left - 0.5 * falling * left * left == pytest.approx(0.0, abs=1e-12 * (1.0 + abs(rate * left)))


def test_what_does_not_fall_stays_off() -> None:
    assert Fall(0.1, 0.5, -1.0).left == math.inf
    assert Fall(0.1, 0.0, 0.0).left == math.inf
