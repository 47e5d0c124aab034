"""Looks at functions of one variable until they are certain to keep their signs."""

from __future__ import annotations

import math

import pytest

from multibody_sym.scalars.sign_changes import PROBE, Look, first_seen

MARGIN = 1e-13
ROUNDING = 2e-14


class Counted:
    """A function that starts at rest, a margin away from zero, but for rounding; it counts how often it is asked."""

    def __init__(self, dip: float = 0.0) -> None:
        self.dip, self.asked = dip, 0

    def __call__(self, theta: float) -> float:
        self.asked += 1
        rounded = ROUNDING * math.sin(1e9 * theta)
        return MARGIN + theta * theta - self.dip * math.exp(-(((theta - 0.7) / 0.1) ** 2)) + rounded

    def first_seen(self, unseen: float) -> float | None:
        start, after, before, end = (self(theta) for theta in (0.0, PROBE, 1.0 - PROBE, 1.0))
        rise, fall = (after - start) / PROBE, (end - before) / PROBE
        return first_seen(self, Look(0.0, start, rise, rise), Look(1.0, end, fall, fall), unseen)


def test_what_starts_at_rest_but_for_rounding_takes_few_looks() -> None:
    """Rates near the start are rounding: halving its pieces tells nothing more."""
    function = Counted()
    assert function.first_seen(32.0 * MARGIN) is None
    assert function.asked < 120


@pytest.mark.parametrize("dip", [0.6, 1.0])
def test_a_dip_behind_a_start_at_rest_is_seen(dip: float) -> None:
    function = Counted(dip)
    found = function.first_seen(32.0 * MARGIN)
    assert found is not None
    assert function(found) < 0.0
