"""A wedge under a load at a wall, held by friction in three guides, which share what they hold in many ways."""

from __future__ import annotations

import math

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


LADDER = """
multibody_sym: 1
name: ladder
gravity: [0, -9.81, 0]
bodies:
  ladder: {shape: {rod: 1.2, mass: 0.2}, points: {top: [1.2, 0, 0], foot: [0, 0, 0]}}
  slider: {mass: 0.6, inertia: {Izz: 0.01}}
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: x}}}
joints:
  plane: {type: planar, parent: ground, child: ladder, q: [x, y, a], initial: {q: [1.2*cos(1.25), 0, pi - 1.25]}}
  guide: {type: prismatic, parent: ladder, child: slider, axis: x, q: s, initial: {q: 0.6}}
contacts:
  foot: {between: [ladder.foot, ground.floor], static: enough, restitution: 0}
  top: {between: [ladder.top, ground.wall], static: 0.3, restitution: 0}
forces:
  rubs: {type: friction, joint: guide, static: 1.5}
simulation: {t_end: 0.3, samples: 4}
"""


def test_a_ladder_whose_foot_never_slips_rests_while_a_slider_runs_down_its_rough_guide() -> None:
    """A smooth wall would do for its rest: it pushes, the floor does the rest. The slider has g (sin - mu cos)."""
    run = mbs.simulate(mbs.loads(LADDER))
    assert run.t[-1] == 0.3
    pace = 9.81 * (math.sin(1.25) - 1.5 * math.cos(1.25))
    assert not run.u[:, :3].any()
    np.testing.assert_allclose(run.q[:, 3], 0.6 - pace * run.t**2 / 2.0, rtol=1e-9)


def test_a_ladder_between_floor_and_wall_where_nothing_slips_rests_wherever_its_slider_is() -> None:
    """Any squeeze along the ladder presses both ends, so forces within all bounds exist: also with the slider below."""
    text = (
        LADDER.replace("static: 0.3", "static: enough")
        .replace("static: 1.5", "static: 0.06")
        .replace("q: 0.6", "q: 0.1")
    )
    run = mbs.simulate(mbs.loads(text))
    assert run.t[-1] == 0.3
    pace = 9.81 * (math.sin(1.25) - 0.06 * math.cos(1.25))
    assert not run.u[:, :3].any()
    assert run.q[-1, 3] < -0.3
    np.testing.assert_allclose(run.q[:, 3], 0.1 - pace * run.t**2 / 2.0, rtol=1e-9)


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


AT_A_WALL = """
multibody_sym: 1
name: at_a_wall
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: x}}}
  disc: {shape: {disc: 0.1, mass: 0.5}, surfaces: {rim: {disc: 0.1}}}
  pebble: {mass: 0.5}
joints:
  rests: {type: planar, parent: ground, child: disc, q: [x, y, phi], initial: {q: [0.1, 0.1, 0]}}
  flies: {type: point, parent: ground, child: pebble, q: [a, h], initial: {q: [1, 0.001], u: [1, 0]}}
contacts:
  floor: {between: [disc.rim, ground.floor], static: 0.3}
  wall: {between: [disc.rim, ground.wall], static: 0.3}
  lands: {open: true, between: [pebble, ground.floor], static: 0.3}
simulation: {t_end: 1, samples: 3}
"""


def test_a_pebble_lands_and_slides_while_a_disc_touches_a_wall_without_pressing_it() -> None:
    """It loses mu times its fall in the impact, then mu g; the disc has four rows, and the wall pushes 0."""
    run = mbs.simulate(mbs.loads(AT_A_WALL))
    fallen = math.sqrt(2 * 0.001 / 9.81)
    slides, sticks = run.events
    assert (slides["kind"], sticks["kind"]) == ("slide+", "stick")
    assert slides["t"] == pytest.approx(fallen, rel=1e-9)
    assert sticks["t"] == pytest.approx(fallen + (1 - 0.3 * 9.81 * fallen) / (0.3 * 9.81), rel=1e-9)
    assert not run.u[:, :3].any()
