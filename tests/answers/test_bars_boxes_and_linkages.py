"""Bars between walls, boxes that tip, stops at rest, flat parallelograms, guesses beside friction in a cut joint."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.scalars.rank import last_share

BAR = """\
multibody_sym: 1
name: bar
gravity: [0, -9.81, 0]
parameters: {m: 2 kg, l: {value: 1 m, positive: true}, th: 20 deg, mu: 0.5}
bodies:
  ground: {surfaces: {left: {plane: [0, 0, 0], normal: x}, right: {plane: ["l*cos(th)", 0, 0], normal: -x}}}
  bar: {mass: m, com: [l/2, 0, 0], inertia: {Izz: m*l^2/12}, points: {a: [0, 0, 0], b: [l, 0, 0]}}
joints: {j: {type: planar, parent: ground, child: bar, initial: {q: [0, 0, th]}}}
contacts:
  a: {between: [bar.a, ground.left], static: mu}
  b: {between: [bar.b, ground.right], static: mu}
"""
BOX = """\
multibody_sym: 1
name: q1
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  box: {shape: {box: [0.2, 0.6, 0.2], mass: 3 kg}}
joints: {j: {type: planar, parent: ground, child: box, q: [x, y, f], initial: {q: [0, 0.3, 0]}}}
contacts: {c: {between: [box, ground.floor], static: 0.9}}
forces: {push: {type: force, on: box, value: [15, 0, 0]}}
ask: {a: {value: f, after: 0.1 s}}
"""
STOP = """\
multibody_sym: 1
name: lim2
gravity: [0, -9.81, 0]
bodies: {b: {mass: 1 kg}}
joints:
  h: {type: prismatic, parent: ground, child: b, axis: y, q: w, initial: {q: 0.1}, limits: {lower: 0, restitution: 0.4}}
ask: {f: {max: force(h.lower), until: 1 s}, f2: {value: force(h.lower), after: 0.8 s}, low: {min: w, until: 1 s}}
"""
PARALLELOGRAM = """\
multibody_sym: 1
name: massless fourbar
gravity: [0, -9.81, 0]
parameters: {a: 0.2 m, m: 3 kg, mu: 0.3, rho: 0.01 m}
bodies:
  ground: {points: {D: [0.5, 0, 0], h: [0.25, -0.5, 0]}}
  cr: {mass: 0, points: {p: [0, a, 0]}}
  co: {mass: m, com: [0.25, 0, 0], inertia: {Izz: 0.05}, points: {p: [0.5, 0, 0], c: [0.25, 0, 0]}}
  ro: {mass: 0, points: {p: [0, a, 0]}}
joints:
  A: {type: revolute, parent: ground, child: cr, q: al, initial: {q: -20 deg, known: true}}
  B: {type: revolute, parent: cr.p, child: co, q: be, initial: {q: 20 deg}}
  D: {type: revolute, parent: ground.D, child: ro, q: de, initial: {q: -20 deg}}
  C: {type: revolute, parent: co.p, child: ro.p, cut: true}
forces:
  f1: {type: friction, joint: A, static: mu, radius: rho}
  f2: {type: friction, joint: D, static: mu, radius: rho}
"""
FOUR_BAR = """\
multibody_sym: 1
name: fb
gravity: [0, -9.81, 0]
parameters:
  {a: 0.15 m, b: 0.4 m, c: 0.3 m, d: 0.35 m, ma: 1 kg, mb: 2 kg, mc: 1.5 kg, tau: 3 N*m, rho: 0.02 m, mu: 0.25}
bodies:
  ground: {points: {D: [d, 0, 0]}}
  crank: {shape: {rod: a, mass: ma}, points: {p: [a, 0, 0]}}
  coupler: {shape: {rod: b, mass: mb}, points: {p: [b, 0, 0]}}
  rocker: {shape: {rod: c, mass: mc}, points: {p: [c, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: crank, q: al, initial: {q: 60 deg, u: 5, known: true}}
  B: {type: revolute, parent: crank.p, child: coupler, q: be, initial: {q: -40 deg}}
  D: {type: revolute, parent: ground.D, child: rocker, q: de, initial: {q: 80 deg}}
  C: {type: revolute, parent: coupler.p, child: rocker.p, cut: true, axis: z}
forces:
  drive: {type: torque, joint: A, value: tau}
  fa: {type: friction, joint: A, static: mu, radius: rho}
  fb: {type: friction, joint: B, static: mu, radius: rho}
  fc: {type: friction, joint: C, static: mu, radius: rho}
  fd: {type: friction, joint: D, static: mu, radius: rho}
"""


def test_a_bar_between_rough_walls_rests_from_the_tangent_of_its_slope_on(tmp_path, capsys) -> None:
    """Both forces then lie along the bar; a linear program on the way there was called unbounded, which has a bound."""
    path = tmp_path / "bar.yaml"
    path.write_text(BAR)
    assert main(["equilibrium", str(path), "--vary", "mu"]) == 0
    least = float(re.search(r"mu > ([0-9.]+)", capsys.readouterr().out)[1])
    assert least == pytest.approx(math.tan(math.radians(20)), abs=1e-10)


def test_a_box_that_tips_on_a_corner_has_answers_later() -> None:
    """Its row of friction restricts speeds alone; the angle is that of a run."""
    system = mbs.loads(BOX)
    (answer,) = mbs.solve(system).answers.values()
    assert answer.value == pytest.approx(mbs.simulate(system, t_end=0.1, samples=2)["f"][-1], rel=1e-8)


def test_the_largest_force_of_a_stop_is_that_of_the_rest_behind_all_bounces() -> None:
    """A fall of 0.1 m ends after sqrt(2 h/g) (1 + e)/(1 - e); between bounces the force is 0."""
    found = mbs.solve(mbs.loads(STOP)).answers
    assert found["f"].value == found["f2"].value == pytest.approx(9.81, rel=1e-9)
    assert found["f"].t == pytest.approx(math.sqrt(0.2 / 9.81) * 1.4 / 0.6, abs=1e-6)
    assert found["low"].value == pytest.approx(0.0, abs=1e-12)


def test_steps_lead_across_a_flat_parallelogram_whose_friction_has_the_coefficient_zero() -> None:
    run = mbs.simulate(mbs.loads(PARALLELOGRAM), parameters={"mu": 0}, t_end=0.6, samples=61)
    flat = run["al"][np.abs(run.t - 0.32) < 0.011]
    assert flat.min() < -math.pi / 2 < flat.max()
    assert run.energy == pytest.approx(run.energy[0], abs=1e-6)


def test_guesses_are_kept_near_where_friction_in_a_cut_joint_measures_an_angle() -> None:
    """That angle gives way first, and to where the joint is not turned over: a is 6.91 rad/s^2 by Newton and Euler."""
    found = mbs.solve(mbs.loads(FOUR_BAR))
    assert found.accelerations["al"].value == pytest.approx(6.909912, abs=1e-5)


def test_rows_of_which_none_counts_have_no_direction_that_counts_least() -> None:
    shares, least = last_share(np.zeros((2, 3)), 0)
    assert (shares.tolist(), least) == ([0.0, 0.0], 1.0)


OVERHANG = """\
multibody_sym: 1
name: box over the edge of a table
gravity: [0, -10, 0]
bodies:
  ground: {surfaces: {table: {plane: [0, 0.25, 0], normal: y, between: [[-0.5, 0.25, 0], [0.5, 0.25, 0]]}}}
  table: {shape: {box: [1, 0.5, 0.5], mass: 20 kg}}
  B: {shape: {box: [1, 0.5, 0.5], mass: 3 kg}}
joints:
  T: {type: fixed, parent: ground, child: table}
  JB: {type: planar, parent: ground, child: B, q: [x, y, p], initial: {q: [OVER, 0.5, 0]}}
contacts: {b: {between: [B, HELD], static: 0.5}}
"""


@pytest.mark.parametrize("held", ["table.top", "table", "ground.table"])
def test_a_box_over_an_edge_rests_or_tips_about_it_however_the_table_is_named(held: str) -> None:
    for over, turning in ((0.3, 0.0), (0.6, -1.0 / (1.25 / 12 + 0.1**2 + 0.25**2))):
        solved = mbs.solve(mbs.loads(OVERHANG.replace("OVER", str(over)).replace("HELD", held)))
        found = [solved.accelerations[name].value for name in ("p", "x", "y")]
        assert found == pytest.approx([turning, -0.25 * turning, 0.1 * turning], abs=1e-12)
