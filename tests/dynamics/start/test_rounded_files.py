"""Rows that the digits of a file leave open by a little, where nothing that can move would close them."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs
from multibody_sym.errors import NoSolutionError

TILTED = """\
multibody_sym: 1
name: tilted
bodies:
  ground: {frames: {hole: {position: [1, 0, 0]}}}
  slider: {mass: 1, inertia: {Ixx: 1, Iyy: 1, Izz: 1}, frames: {pin: {rotate: [{axis: y, angle: TILT}]}}}
joints:
  guide: {type: prismatic, parent: ground, child: slider, axis: x, q: x}
  hinge: {type: revolute, parent: ground.hole, child: slider.pin, cut: true}
"""
BRACED = """\
multibody_sym: 1
name: braced
bodies:
  ground: {points: {high: [0, 1, 0], low: [0, -1, 0]}}
  slider: {mass: 1}
joints:
  guide: {type: prismatic, parent: ground, child: slider, axis: x, q: x, initial: {q: 0.7}}
constraints:
  up: {type: distance, between: [ground.high, slider], value: 1.25}
  down: {type: distance, between: [ground.low, slider], value: LONG}
"""


@pytest.mark.parametrize("tilt", [0.0, 2e-13, 5e-12])
def test_a_constant_row_closes_as_far_as_written_digits_tell(tilt: float) -> None:
    run = mbs.simulate(mbs.loads(TILTED.replace("TILT", repr(tilt))), t_end=0.1, samples=2)
    assert run.q[:, 0] == pytest.approx([1.0, 1.0], abs=1e-12)


def test_rods_that_say_the_same_to_twelve_digits_close_together() -> None:
    """Both leave x = sqrt(1.25^2 - 1); by Newton's method in x alone the lengths stay apart by their difference."""
    run = mbs.simulate(mbs.loads(BRACED.replace("LONG", "1.250000000002")), t_end=0.1, samples=2)
    assert run.q[:, 0] == pytest.approx(math.sqrt(1.25**2 - 1.0), abs=1e-11)


@pytest.mark.parametrize(("text", "off"), [(TILTED, ("TILT", "1e-9")), (BRACED, ("LONG", "1.250000001"))])
def test_what_is_missed_by_more_is_named(text: str, off: tuple[str, str]) -> None:
    with pytest.raises(NoSolutionError, match=r"hinge\.ry|up.* down"):
        mbs.simulate(mbs.loads(text.replace(*off)), t_end=0.1)
