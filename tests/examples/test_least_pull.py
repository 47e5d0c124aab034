"""The least force that moves what a textbook asks for, against its formula."""

from __future__ import annotations

import math

import pytest
from twins import from_file

import multibody_sym as mbs


def test_the_least_pull_is_at_the_angle_of_friction() -> None:
    system = from_file("least_pull")
    mu, m, g = (system.parameters[name].value.shadow for name in ("mu", "m", "g"))
    found = mbs.least_for_motion(system, "F", "beta")
    assert found.value.value == pytest.approx(mu * m * g / math.sqrt(1 + mu**2), rel=1e-12)
