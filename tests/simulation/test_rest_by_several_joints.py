"""A wedge under a load at a wall, held by friction in three guides, which share what they hold in many ways."""

from __future__ import annotations

import pytest

import multibody_sym as mbs

WEDGE = """
multibody_sym: 1
name: wedge
gravity: [0, -9.81, 0]
parameters: {M: 100 kg, mu: 0.2, alpha: 10 deg, P: {value: 600 N, positive: true}}
bodies:
  wedge: {mass: 1 kg, frames: {face: {rotate: [{axis: z, angle: alpha}]}}}
  load: {mass: M, frames: {up: {rotate: [{axis: z, angle: -alpha}]}}}
joints:
  floor: {type: prismatic, parent: ground, child: wedge, axis: x, q: x}
  face: {type: prismatic, parent: wedge.face, child: load, axis: x, q: s}
  wall: {type: prismatic, parent: ground, child: load.up, axis: y, q: y, cut: true}
forces:
  push: {type: force, on: wedge, value: [-P, 0, 0]}
  f1: {type: friction, joint: floor, static: mu}
  f2: {type: friction, joint: face, static: mu}
  f3: {type: friction, joint: wall, static: mu}
simulation: {t_end: 0.05 s, samples: 5}
"""


@pytest.fixture(scope="module")
def ends() -> tuple[float, float]:
    """The least and the largest push at which it rests, by linear programs that know no runs."""
    ((low, high),) = mbs.range_of_rest(mbs.loads(WEDGE), "P").rest
    assert low is not None
    assert high is not None
    return low, high


@pytest.mark.parametrize("part", [0.02, 0.3, 0.5, 0.8, 0.98])
def test_it_rests_to_the_last_bit_between_the_ends(part: float, ends: tuple[float, float]) -> None:
    push = ends[0] + part * (ends[1] - ends[0])
    run = mbs.simulate(mbs.loads(WEDGE), parameters={"P": push})
    assert not run["x"].any()
    assert not run["s"].any()


def test_it_moves_beyond_the_upper_end(ends: tuple[float, float]) -> None:
    run = mbs.simulate(mbs.loads(WEDGE), parameters={"P": 1.01 * ends[1]})
    assert run["x"][-1] < 0.0
