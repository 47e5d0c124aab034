"""Boxes on four corners in space: their forces are not unique, and they rest to the last bit, slip, tip and stop."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import nnls

import multibody_sym as mbs

CRATE = """\
multibody_sym: 1
name: crate
gravity: [gx, gy, gz]
parameters:
  gx: 0 m/s^2
  gy: 0 m/s^2
  gz: -9.81 m/s^2
  pz: 0 m
  mu: 0.5
  nu: 0.5
  F: 0 N
  G: 0 N
  k: 0 N/s
  l: 0 N/s
  M: 0 N*m
  n: 0 N*m/s
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  crate: {shape: {box: [0.6, 0.4, 0.3], mass: 12 kg}, points: {hook: [0, 0, pz]}}
joints: {J: {type: free, parent: ground, child: crate, initial: {q: [0, 0, 0.15, 1, 0, 0, 0]}}}
forces:
  push: {type: force, on: crate, at: hook, value: [F + k*t, G + l*t, 0]}
  turn: {type: torque, on: crate, value: [0, 0, M + n*t]}
contacts: {c: {between: [crate, ground.floor], static: mu, kinetic: nu}}
"""


def run(t_end: float, speeds: dict[str, float] | None = None, **values: float) -> mbs.Trajectory:
    return mbs.simulate(mbs.loads(CRATE), t_end=t_end, parameters=values, initial=speeds)


def test_a_push_beside_the_middle_makes_the_crate_slip_where_the_range_of_rest_ends() -> None:
    """The second route: all loads at which forces within all cones balance the crate, by cutting planes."""
    model = mbs.loads(CRATE.replace("hook: [0, 0, pz]", "hook: [0.1, 0.1, 0.1]"))
    _, most = mbs.range_of_rest(model, "F", parameters={"G": 5.0}).ends[-1]
    pushed = mbs.simulate(model, t_end=5.7, parameters={"G": 5.0, "k": 10.0})
    assert pushed.events[0]["t"] == pytest.approx(most.value / 10, rel=1e-7)


SPINNING = """
multibody_sym: 1
name: spinning_box
gravity: [0, 0, -9.81]
bodies:
  ground:
    surfaces: {floor: {plane: [0, 0, 0], normal: [-sin(0.5), 0, cos(0.5)]}}
    frames: {slope: {rotate: [{axis: y, angle: -0.5}]}}
  box: {shape: {box: [0.365, 0.413, 0.724], mass: 7.73}}
contacts: {c: {between: [box, ground.floor], static: 1.5, restitution: 1}}
joints:
  j: {type: free, parent: ground.slope, child: box, initial: {q: [0, 0, 0.362, 1, 0, 0, 0], u: [0, 0, 0, 0, 0, 1.127]}}
forces: {push: {type: force, on: box, value: [88.2676*sin(2.669*t), 0, 0]}}
"""


def test_a_box_that_slips_on_four_corners_tips_when_two_of_them_can_carry_all() -> None:
    """The shares of its corners have no room left there; the run ended with friction that jams.

    Two forces N with friction 1.5 N against slip then balance the load along the normal and both moments about the
    centre: three equations, which other forces of the four corners do not solve.
    """
    system = mbs.loads(SPINNING)
    run = mbs.simulate(system, t_end=0.00722, samples=2)
    tipped = next(x for x in run.events if x["kind"] == "open")
    assert tipped["t"] == pytest.approx(0.007197, abs=1e-5)
    assert abs(run.energy_residual) < 1e-9
    last = mbs.simulate(system, t_end=tipped["t"] - 3e-7, samples=2).final
    (x, y), spin = (last["speeds"][f"u_j_{k}"] for k in "xy"), last["speeds"]["j_wz"]
    turned = 2.0 * math.atan2(last["coordinates"]["j_qz"], last["coordinates"]["j_qw"])
    columns = []
    for a, b in ((-0.1825, -0.2065), (-0.1825, 0.2065), (0.1825, -0.2065), (0.1825, 0.2065)):
        cos, sin = math.cos(turned), math.sin(turned)
        at = np.array([a * cos - b * sin, a * sin + b * cos, -0.362])
        slip = np.array([x - spin * at[1], y + spin * at[0], 0.0])
        force = np.array([0.0, 0.0, 1.0]) - 1.5 * slip / np.linalg.norm(slip)
        columns.append([1.0, *np.cross(at, force)[:2]])
    load = 7.73 * 9.81 * math.cos(0.5) + 88.2676 * math.sin(2.669 * tipped["t"]) * math.sin(0.5)
    forces, missed = nnls(np.array(columns).T, np.array([load, 0.0, 0.0]))
    assert missed < 1e-9 * load
    assert sorted(forces > 1e-3 * load) == [False, False, True, True]


ROCKING = """\
multibody_sym: 1
name: rocking
gravity: [0, 0, -9.81]
bodies:
  ground:
    surfaces: {floor: {plane: [0, 0, 0], normal: [-sin(0.5), 0, cos(0.5)]}}
    frames: {slope: {rotate: [{axis: y, angle: -0.5}]}}
  box: {shape: {box: [0.32, 0.405, 0.77], mass: 1.25}}
contacts: {c: {between: [box, ground.floor], static: 0.7, kinetic: 0.42, restitution: 0}}
joints:
  j:
    type: free
    parent: ground.slope
    child: box
    initial: {q: [0.0, 0, 0.385, 1, 0, 0, 0], u: [1.392, -0.927, 0, 0, 0, 1.959]}
outputs: {E: total_energy()}
"""


@pytest.mark.parametrize("t_end", [0.6, 1.0])
def test_a_box_that_ceases_to_rock_slides_on(t_end: float) -> None:
    """Friction of its corners, held together by pulls, held them up: it stopped at once, or lost energy on paper alone.

    What is left of the rocking turns at 1e-6 rad/s then; along the slope the box decelerates by friction alone, which
    as it slides is no more than 0.42 times its weight along the normal.
    """
    run = mbs.simulate(mbs.loads(ROCKING), t_end=t_end, samples=round(1000 * t_end) + 1)
    end = max(event["t"] for event in run.events)
    assert run.events[-1]["kind"] == "slide"
    assert abs(run.energy_residual) < 1e-6
    near = (run.t > end - 0.002) & (run.t < end + 0.002)
    pushes = 9.81 * (math.sin(0.5) + 0.42 * math.cos(0.5))
    assert np.abs(np.diff(run.u[near][:, :2], axis=0)).max() < 0.0011 * pushes
    assert np.abs(np.diff(run.outputs["E"][near])).max() < 0.0011 * 0.42 * 1.25 * 9.81 * 1.0
