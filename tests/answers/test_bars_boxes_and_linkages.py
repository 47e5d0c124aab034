"""Boxes that tip, flat parallelograms, and rows of which none counts."""

from __future__ import annotations

import math

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.scalars.rank import last_share

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


def test_a_box_that_tips_on_a_corner_has_answers_later() -> None:
    """Its row of friction restricts speeds alone; the angle is that of a run."""
    system = mbs.loads(BOX)
    (answer,) = mbs.solve(system).answers.values()
    assert answer.value == pytest.approx(mbs.simulate(system, t_end=0.1, samples=2)["f"][-1], rel=1e-8)


def test_steps_lead_across_a_flat_parallelogram_whose_friction_has_the_coefficient_zero() -> None:
    run = mbs.simulate(mbs.loads(PARALLELOGRAM), parameters={"mu": 0}, t_end=0.6, samples=61)
    flat = run["al"][np.abs(run.t - 0.32) < 0.011]
    assert flat.min() < -math.pi / 2 < flat.max()
    assert run.energy == pytest.approx(run.energy[0], abs=1e-6)


def test_rows_of_which_none_counts_have_no_direction_that_counts_least() -> None:
    shares, least = last_share(np.zeros((2, 3)), 0)
    assert (shares.tolist(), least) == ([0.0, 0.0], 1.0)
