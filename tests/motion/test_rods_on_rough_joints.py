"""A rod falls about a rough ball joint onto a rough floor: joint and floor hold the same motion, and it rests."""

from __future__ import annotations

import math

import multibody_sym as mbs

ROD = """
multibody_sym: 1
name: rod
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, -0.8, 0], normal: y}}}
  rod: {mass: 1, com: [0.4375, 0, 0], inertia: {Ixx: 0.001, Iyy: 0.0638, Izz: 0.0638}, points: {end: [0.875, 0, 0]}}
joints:
  ball: {type: spherical, parent: ground, child: rod}
contacts:
  floor: {between: [rod.end, ground.floor], static: 0.1, restitution: 0, open: true}
forces:
  rubs: {type: friction, joint: ball, static: 0.3, kinetic: 0.2, radius: 0.02}
simulation: {t_end: 0.6, samples: 61}
"""


def test_it_lies_on_the_floor_to_the_last_bit() -> None:
    """The floor alone may hold it; the account is the fall's m g h, taken by the impact and by the joint."""
    run = mbs.simulate(mbs.loads(ROD))
    assert run.t[-1] == 0.6
    resting = run.t > 0.39
    assert not run.u[resting].any()
    w, z = run.q[-1][[0, 3]]
    assert math.isclose(2.0 * math.atan2(-z, w), math.asin(0.8 / 0.875), rel_tol=1e-9)
    assert math.isclose(run.energy[-1] - run.energy[0], -9.81 * 0.4, rel_tol=1e-9)
    assert [x["element"] for x in run.events if x["kind"] == "stick"] == ["floor", "rubs"]


def test_a_rod_that_leans_on_a_wall_that_is_always_rough_enough_rests() -> None:
    """Its forces are not unique: with friction's limit at the floor none is kept, with no friction at the wall all are.

    The floor then carries both weights, and the wall pushes by M/h, which friction at the floor, 0.33 N, balances.
    """
    model = """
multibody_sym: 1
name: leaning
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: x}}}
  rod: {shape: {rod: 0.438, mass: 0.158}, points: {top: [0.438, 0, 0], foot: [0, 0, 0]}}
  ring: {mass: 1.11, inertia: {Izz: 0.01}}
joints:
  place: {type: planar, parent: ground, child: rod, q: [x, y, a], initial: {q: [0.438*cos(0.992), 0, pi - 0.992]}}
  slide: {type: prismatic, parent: rod, child: ring, axis: x, q: s, initial: {q: 0.219}}
contacts:
  floor: {between: [rod.foot, ground.floor], static: 0.7, restitution: 0}
  wall: {between: [rod.top, ground.wall], static: enough, restitution: 0.5}
forces:
  rub: {type: friction, joint: slide, static: enough}
  push: {type: force, on: rod, value: [2*sin(t), 0, 0]}
simulation: {t_end: 0.2, samples: 5}
"""
    run = mbs.simulate(mbs.loads(model))
    assert list(run.events) == []
    assert not run.u.any()
