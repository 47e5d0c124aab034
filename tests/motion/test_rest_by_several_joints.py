"""A wedge under a load at a wall, held by friction in three guides, which share what they hold in many ways."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

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


FACES = {(0.452342, 0.891845): 0.3, (0.891845, -0.452342): 0.0, (0.207226, 0.978293): 1.5, (0.978293, -0.207226): 0.3}
"""Normals of faces that meet in one corner, and their coefficients of friction."""
CORNER = """
multibody_sym: 1
name: corner
gravity: [0, -9.81, 0]
bodies:
  block: {mass: 0.1}
  sledge: {mass: 2}
  ground: {surfaces: {FACES}}
joints:
  plane: {type: point, parent: ground, child: block, q: [x, y]}
  track: {type: prismatic, parent: ground, child: sledge, axis: x, q: s, initial: {u: 1}}
contacts: {CONTACTS}
forces:
  pull: {type: force, on: block, value: [-0.166, -0.736, 0]}
  rubs: {type: friction, joint: track, static: 0.2}
simulation: {t_end: 0.3, samples: 4}
"""


def test_a_block_in_a_corner_of_more_faces_than_hold_it_rests_while_a_sledge_slows_down_elsewhere() -> None:
    """A linear program finds forces within all bounds for the block's rest; the sledge has -mu g."""
    faces = ", ".join(f"f{k}: {{plane: [0, 0, 0], normal: [{x}, {y}, 0]}}" for k, (x, y) in enumerate(FACES))
    contacts = (f"c{k}: {{between: [block, ground.f{k}], static: {mu}}}" for k, mu in enumerate(FACES.values()))
    edges = np.array([(x - way * mu * y, y + way * mu * x) for (x, y), mu in FACES.items() for way in (1, -1)])
    forces = linprog(np.zeros(len(edges)), A_eq=edges.T, b_eq=[0.166, 0.736 + 0.1 * 9.81], bounds=(0, None))
    assert forces.status == 0
    text = CORNER.replace("{FACES}", f"{{{faces}}}").replace("{CONTACTS}", f"{{{', '.join(contacts)}}}")
    run = mbs.simulate(mbs.loads(text))
    assert run.t[-1] == 0.3
    assert not run.u[:, :2].any()
    np.testing.assert_allclose(run.q[:, 2], run.t - 0.2 * 9.81 * run.t**2 / 2.0, rtol=1e-9, atol=1e-15)
