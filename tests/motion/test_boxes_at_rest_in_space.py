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
WEIGHT = 12 * 9.81


def run(t_end: float, speeds: dict[str, float] | None = None, **values: float) -> mbs.Trajectory:
    return mbs.simulate(mbs.loads(CRATE), t_end=t_end, parameters=values, initial=speeds)


def moved(run: mbs.Trajectory) -> float:
    return float(np.abs(run.q - run.q[0]).max())


@pytest.mark.parametrize(
    "values",
    [
        {"F": 10.0},
        {"F": 58.0},
        {"F": 34.0, "G": -47.0},
        {"F": 20.0, "M": 6.0},
        {"M": 21.0},
        {"F": 45.0, "pz": 0.15, "mu": 0.9},
    ],
)
def test_a_crate_that_is_pushed_less_than_friction_holds_does_not_move_at_all(values: dict[str, float]) -> None:
    resting = run(1000.0, **values)
    assert moved(resting) == 0.0
    assert not resting.events


@pytest.mark.parametrize("way", [0.0, 2.5])
def test_a_crate_on_a_ramp_rests_below_the_friction_angle_and_slides_above_it(way: float) -> None:
    for over in (-1e-3, 1e-3):
        angle = math.atan(0.5) + over
        down = 9.81 * math.sin(angle)
        gravity = {"gx": down * math.cos(way), "gy": down * math.sin(way), "gz": -9.81 * math.cos(angle)}
        if over < 0.0:
            assert moved(run(1000.0, **gravity)) == 0.0
            continue
        slid = run(1.0, **gravity)
        faster = down - 0.5 * 9.81 * math.cos(angle)
        assert np.hypot(*slid.q[-1, :2]) == pytest.approx(faster / 2, rel=1e-6)


@pytest.mark.parametrize(
    ("values", "slips"),
    [
        ({"k": 10.0}, 0.5 * WEIGHT / 10),
        ({"k": 6.0, "l": 8.0}, 0.5 * WEIGHT / 10),
        ({"k": 10.0, "G": 20.0}, math.sqrt((0.5 * WEIGHT) ** 2 - 400) / 10),
        ({"k": 10.0, "pz": 0.1}, 0.5 * WEIGHT / 10),
        ({"n": 3.0}, 0.5 * WEIGHT * math.hypot(0.3, 0.2) / 3),
    ],
)
def test_a_push_that_grows_makes_all_corners_slip_when_the_crate_does(values: dict[str, float], slips: float) -> None:
    pushed = run(slips + 0.02, **values)
    assert [event["kind"] for event in pushed.events] == ["slide"] * 4
    assert pushed.events[0]["t"] == pytest.approx(slips, rel=1e-9)
    until = pushed.t <= slips * (1 - 1e-9)
    assert float(np.abs(pushed.q[until] - pushed.q[0]).max()) == 0.0


def test_a_crate_pushed_high_up_tips_about_its_edge_where_it_is_too_rough_to_slip() -> None:
    """10 t at 0.3 m against the weight at half the length, 0.3 m."""
    tipped = run(12.0, k=10.0, pz=0.15, mu=1.5, nu=1.5)
    assert {(event["kind"], event["element"]) for event in tipped.events[:2]} == {
        ("open", "c.corner1"),
        ("open", "c.corner4"),
    }
    assert tipped.events[0]["t"] == pytest.approx(WEIGHT / 10, rel=1e-9)


def test_a_push_beside_the_middle_makes_the_crate_slip_where_the_range_of_rest_ends() -> None:
    """The second route: all loads at which forces within all cones balance the crate, by cutting planes."""
    model = mbs.loads(CRATE.replace("hook: [0, 0, pz]", "hook: [0.1, 0.1, 0.1]"))
    _, most = mbs.range_of_rest(model, "F", parameters={"G": 5.0}).ends[-1]
    pushed = mbs.simulate(model, t_end=5.7, parameters={"G": 5.0, "k": 10.0})
    assert pushed.events[0]["t"] == pytest.approx(most.value / 10, rel=1e-7)


def test_a_crate_thrown_along_the_floor_stops_where_it_should_and_stays() -> None:
    thrown = run(2.0, {"u_J_x": 2.0, "u_J_y": 1.0})
    speed = math.hypot(2, 1)
    assert [event["kind"] for event in thrown.events] == ["stick"] * 4
    stops = speed / (0.5 * 9.81)
    assert thrown.events[0]["t"] == pytest.approx(stops, rel=1e-9)
    after = thrown.t > stops
    assert thrown.q[-1, :2] == pytest.approx([2 * stops / 2, stops / 2], rel=1e-8)
    assert float(np.abs(thrown.q[after] - thrown.q[-1]).max()) == 0.0
    work = sum(part.total for part in thrown.friction_work.values())
    assert work == pytest.approx(-0.5 * 12 * speed**2, rel=1e-7)


def test_a_crate_spun_about_the_vertical_stops_after_it_has_turned_as_far_as_friction_lets_it() -> None:
    """All corners are as far from the axis: J w' = -mu m g r."""
    spun = run(1.0, {"J_wz": 3.0})
    inertia = (0.6**2 + 0.4**2) / 12
    slower = 0.5 * 9.81 * math.hypot(0.3, 0.2) / inertia
    assert spun.events[0]["t"] == pytest.approx(3 / slower, rel=1e-8)
    assert 2 * math.atan2(spun.q[-1, 6], spun.q[-1, 3]) == pytest.approx(9 / (2 * slower), rel=1e-7)
    after = spun.t > 3 / slower
    assert float(np.abs(spun.q[after] - spun.q[-1]).max()) == 0.0


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
