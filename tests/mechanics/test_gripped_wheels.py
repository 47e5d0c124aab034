"""Ropes that turn wheels: rows against finite differences, along runs, and the free bodies of textbook machines."""

from __future__ import annotations

import math

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.motion import coordinate_rates, motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.row_kinematics import row_motions

SWINGING = """\
multibody_sym: 1
name: swinging
gravity: [0, -9.81, 0]
bodies:
  arm: {mass: 1, inertia: {Izz: 1}, points: {axle: [0.7, 0.2, 0], idler: [-0.4, 0.5, 0]}}
  wheel: {shape: {disc: 0.3, mass: 2}}
  bob: {mass: 1.5, inertia: {Izz: 1}}
  load: {mass: 1, inertia: {Izz: 1}}
joints:
  A: {type: revolute, parent: ground, child: arm, q: a, initial: {q: 0.3, u: 0.4}}
  B: {type: revolute, parent: arm.axle, child: wheel, axis: [0, 0, -1], q: w, initial: {u: 1}}
  C: {type: planar, parent: ground, child: bob, q: [x, y, turn], initial: {q: [2.5, -1.5, 0], u: [0.3, 0, 0]}}
  D: {type: planar, parent: ground, child: load, q: [X, Y, turning], initial: {q: [-1.5, -1.2, 0]}}
pulleys:
  idler: {at: arm.idler, radius: 0.1}
  wheel: {body: wheel, radius: 0.3}
constraints:
  rope: {type: rope, path: [bob, wheel, idler, load]}
"""


def rows_at(system: mbs.System, q: np.ndarray, u: np.ndarray) -> tuple:
    resolved = mechanism(system)
    begin = start(resolved)
    motion = motion_of(resolved, state_of(resolved, float, 0.0, q.tolist(), u.tolist(), begin.parameters))
    return resolved, row_motions(motion)


@pytest.mark.parametrize("coordinates", ["relative", "absolute"])
def test_rows_of_a_wheel_on_a_moving_arm_are_the_derivatives_of_what_is_wound(coordinates: str) -> None:
    """phi, phidot = H u + phi_t and gamma by finite differences along u, at states beside the start."""
    system = mbs.loads(SWINGING + f"simulation: {{coordinates: {coordinates}}}\n")
    resolved = mechanism(system)
    begin = start(resolved)
    rng = np.random.default_rng(4)
    for _ in range(5):
        q = np.array(begin.q) + rng.uniform(-0.2, 0.2, len(begin.q))
        u = rng.uniform(-1, 1, len(begin.u))
        rate = np.array(coordinate_rates(resolved, q.tolist(), u.tolist()), dtype=float)
        here = rows_at(system, q, u)[1]
        h = 1e-5
        ahead, behind = (rows_at(system, q + s * rate, u)[1] for s in (h, -h))
        for k, row in enumerate(here):
            assert row.phidot == pytest.approx((ahead[k].phi - behind[k].phi) / (2 * h), abs=1e-8)
            assert row.phidot == pytest.approx(float(np.dot(row.jacobian, u)), abs=1e-12)
            assert row.gamma == pytest.approx(-(ahead[k].phidot - behind[k].phidot) / (2 * h), abs=1e-8)


def test_wheel_may_turn_more_than_once_and_nothing_jumps() -> None:
    system = mbs.loads(SWINGING)
    begin = start(mechanism(system))
    u = np.zeros(len(begin.u))
    place = [c.name for c in mechanism(system).coordinates].index("w")
    found = []
    for turn in np.linspace(0.0, 4 * math.pi, 9):
        q = np.array(begin.q)
        q[place] += turn
        found.append([row.phi for row in rows_at(system, q, u)[1]])
    steps = np.diff(np.array(found), axis=0)
    assert np.abs(steps) == pytest.approx(0.3 * math.pi / 2), "R pi/2 up on one side, off on the other"
    assert np.abs(steps.sum(axis=1)).max() < 1e-12


def test_energy_stays_along_a_run_in_which_the_bob_swings_and_the_wheel_turns() -> None:
    run = mbs.simulate(mbs.loads(SWINGING), t_end=0.4, rtol=1e-10)
    assert abs(run.drift["energy"]) < 1e-8
    assert abs(float(run["w"][-1] - run["w"][0])) > 0.3


CRANE = """\
multibody_sym: 1
name: crane
gravity: [0, 0, -9.81]
bodies:
  tower:
    {mass: 10, inertia: {Ixx: 1, Iyy: 1, Izz: 2}, frames: {tip: {position: [2, 0, 3], rotate: [{axis: z, angle: 0.4}]},
     foot: {position: [2, 0, 0], rotate: [{axis: z, angle: 0.4}]}}}
  wheel: {mass: 2, inertia: {Ixx: 0.1, Iyy: 0.1, Izz: 0.1}}
  load: {mass: 3}
  cart: {mass: 3}
joints:
  A: {type: revolute, parent: ground, child: tower, axis: z, q: yaw, initial: {u: 0.5}}
  B: {type: revolute, parent: tower.tip, child: wheel, axis: y, q: w}
  C: {type: prismatic, parent: tower.foot, child: load, axis: [0.3, 0, 1], q: z, initial: {q: 1}}
  D: {type: prismatic, parent: tower.tip, child: cart, axis: x, q: x, initial: {q: -1.5}}
pulleys: {P: {body: wheel, radius: 0.3, axis: y}}
constraints: {rope: {type: rope, path: [load, P, cart]}}
"""


@pytest.mark.parametrize(
    "pulley",
    ["body: wheel, radius: 0.3, axis: y", "at: tower.tip, radius: 0.3, axis: [-sin(0.4), cos(0.4), 0]"],
)
def test_a_rope_in_a_plane_that_turns_in_space(pulley: str) -> None:
    """A tangent keeps to the plane across the wheel's axis, which a crane that swings carries along."""
    system = mbs.loads(CRANE.replace("body: wheel, radius: 0.3, axis: y", pulley))
    resolved = mechanism(system)
    begin = start(resolved)
    rng = np.random.default_rng(1)
    for _ in range(3):
        q = np.array(begin.q) + rng.uniform(-0.2, 0.2, len(begin.q))
        u = rng.uniform(-1, 1, len(begin.u))
        rate, h = np.array(coordinate_rates(resolved, q.tolist(), u.tolist()), dtype=float), 1e-5
        here = rows_at(system, q, u)[1]
        ahead, behind = (rows_at(system, q + k * rate, u)[1] for k in (h, -h))
        for k, row in enumerate(here):
            assert row.phidot == pytest.approx((ahead[k].phi - behind[k].phi) / (2 * h), abs=1e-8)
            assert row.gamma == pytest.approx(-(ahead[k].phidot - behind[k].phidot) / (2 * h), abs=1e-8)
