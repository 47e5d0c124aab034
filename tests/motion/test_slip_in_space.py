"""What slips from rest in space under a load that grows and turns goes on, explicit methods and implicit ones alike."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import multibody_sym as mbs


def puck() -> mbs.System:
    """A particle on a rough table, static as kinetic, pushed by a force that turns as it grows."""
    return mbs.System(
        "puck",
        gravity=[0, 0, -10],
        bodies={"ground": mbs.Body(surfaces={"table": {"plane": [0, 0, 0], "normal": "z"}}), "puck": mbs.Body(mass=1)},
        joints={"free": mbs.PointJoint("ground", "puck", axes="xyz", q=["x", "y", "z"])},
        contacts={"c": mbs.Contact(["puck", "ground.table"], kinetic=0.2)},
        forces={"push": mbs.Force("puck", ["t", "0.5*t + 0.3*t^2", 0])},
    )


def test_a_turning_load_moves_what_it_has_just_overcome() -> None:
    explicit = mbs.simulate(puck(), t_end=4)
    implicit = mbs.simulate(puck(), t_end=4, method="radau_5", rtol=1e-11, atol=1e-13)
    assert explicit.statistics["steps"] < 20_000
    slips = explicit.changes[0]["t"]
    assert slips**2 + (0.5 * slips + 0.3 * slips**2) ** 2 == pytest.approx((0.2 * 10) ** 2, rel=1e-9)
    for name in "xy":
        assert explicit[name][-1] == pytest.approx(implicit[name][-1], rel=1e-7)


def slid(force: list[object], **coefficients: float) -> mbs.Trajectory:
    """Return the run of a particle of 2 kg on a rough table that a force pushes, with g = 10 m/s^2."""
    system = mbs.System(
        "slid",
        gravity=[0, 0, -10],
        bodies={"ground": mbs.Body(surfaces={"table": {"plane": [0, 0, 0], "normal": "z"}}), "p": mbs.Body(mass=2)},
        joints={"free": mbs.PointJoint("ground", "p", axes="xyz", q=["x", "y", "z"])},
        contacts={"c": mbs.Contact(["p", "ground.table"], **coefficients)},
        forces={"push": mbs.Force("p", force)},
    )
    return mbs.simulate(system, t_end=2)


def test_the_work_of_friction_that_slips_from_rest_in_space_is_a_number() -> None:
    """From t = 1, when 10 t is 0.5 * 20: v = 2.5 (t - 1)^2, so that friction of 10 N takes 25/3 J by t = 2."""
    run = slid(["10*t", 0, 0], static=0.5)
    assert [(event["kind"], event["t"]) for event in run.events] == [("slide", pytest.approx(1.0, rel=1e-9))]
    assert run["u_x"][-1] == pytest.approx(2.5, rel=1e-7)
    assert run.friction_work["c"].total == pytest.approx(-25 / 3, rel=1e-7)


def test_friction_that_drops_to_its_kinetic_value_takes_what_the_load_gives_beyond_the_motion() -> None:
    """The work of the load less the kinetic energy, from the samples of the run, is what friction took."""
    run = slid([6, "8*t", 0], static=0.5, kinetic=0.3)
    assert [(event["kind"], event["t"]) for event in run.events] == [("slide", pytest.approx(1.0, rel=1e-9))]
    power = 6 * run["u_x"] + 8 * run.t * run["u_y"]
    given = float(((power[1:] + power[:-1]) / 2 * (run.t[1:] - run.t[:-1])).sum())
    kept = run["u_x"][-1] ** 2 + run["u_y"][-1] ** 2
    assert run.friction_work["c"].total == pytest.approx(kept - given, rel=1e-5)


def test_slip_that_slows_down_under_a_turning_load_comes_to_rest_and_starts_again() -> None:
    system = mbs.System(
        "puck",
        gravity=[0, 0, -10],
        bodies={"ground": mbs.Body(surfaces={"table": {"plane": [0, 0, 0], "normal": "z"}}), "puck": mbs.Body(mass=2)},
        joints={"free": mbs.PointJoint("ground", "puck", axes="xyz", q=["x", "y", "z"])},
        contacts={"c": mbs.Contact(["puck", "ground.table"], static=0.5, kinetic=0.4)},
        forces={"push": mbs.Force("puck", ["10*sin(6*t)", "10*cos(5*t)", 0])},
    )
    run = mbs.simulate(system, t_end=1.75)
    kinds = [change["kind"] for change in run.changes]
    assert kinds[-2:] == ["stick", "slide"]
    rest, starts = (change["t"] for change in run.changes[-2:])
    assert rest < starts
    pushed = lambda t: (10 * math.sin(6 * t)) ** 2 + (10 * math.cos(5 * t)) ** 2  # noqa: E731
    assert pushed(starts) == pytest.approx((0.5 * 2 * 10) ** 2, rel=1e-8)
    assert run.statistics["steps"] < 50_000


def pushed(force: list[object], t_end: float, **settings: float) -> mbs.Trajectory:
    """Return the run of the puck, whose friction holds 2 N, under another force."""
    return mbs.simulate(replace(puck(), forces={"push": mbs.Force("puck", force)}), t_end=t_end, **settings)


def test_slip_under_a_load_that_grows_straight_on_is_that_of_the_closed_form() -> None:
    """5 t N, from 0.4 s on more than 2 N: v = 2.5 (t - 0.4)^2."""
    run = pushed(["3*t", "4*t", 0], 2.0)
    assert run.changes[0]["t"] == pytest.approx(0.4, rel=1e-11)
    way, speed = 5 * 1.6**3 / 6, 2.5 * 1.6**2
    assert (run["x"][-1], run["y"][-1]) == pytest.approx((0.6 * way, 0.8 * way), rel=1e-10)
    assert (run["u_x"][-1], run["u_y"][-1]) == pytest.approx((0.6 * speed, 0.8 * speed), rel=1e-10)
    assert run.statistics["steps"] < 1000


@pytest.mark.parametrize("c", [1e-4, 1e-2])
def test_slip_that_never_gets_fast_stops_when_it_does(c: float) -> None:
    """v = c (s^2/2 - s^3/3), s = t - 1: no more than c/6, and zero at s = 1.5."""
    run = pushed([f"2 + {c}*(t - 1)*(2 - t)", 0, 0], 3.0)
    assert [change["kind"] for change in run.changes] == ["slide", "stick"]
    assert run.changes[1]["t"] == pytest.approx(2.5, rel=1e-10)
    assert run["x"][-1] == pytest.approx(c * (1.5**3 / 6 - 1.5**4 / 12), rel=1e-10)


def test_friction_is_against_the_velocity_soon_after_slip_has_started_under_a_turning_load() -> None:
    """Beside scipy's Radau method, from 1e-5 s after the start on, when the direction is still that of the load."""
    run = pushed(["t", "0.5*t + 0.3*t^2", 0], 3.0, rtol=1e-10, atol=1e-12)
    begun, soon = run.changes[0]["t"], 1e-5

    def force(t: float) -> np.ndarray:
        return np.array([t, 0.5 * t + 0.3 * t * t])

    def rates(t: float, state: np.ndarray) -> np.ndarray:
        return np.concatenate([state[2:], force(t) - 2.0 * state[2:] / np.hypot(*state[2:])])

    along = force(begun) / 2.0
    grows = float(along @ [1.0, 0.5 + 0.6 * begun])
    start = np.concatenate([along * grows * soon**3 / 6, along * grows * soon**2 / 2])
    exact = solve_ivp(rates, (begun + soon, 3.0), start, method="Radau", rtol=1e-9, atol=1e-14).y[:, -1]
    assert (run["x"][-1], run["y"][-1]) == pytest.approx(tuple(exact[:2]), abs=1e-9)
    assert (run["u_x"][-1], run["u_y"][-1]) == pytest.approx(tuple(exact[2:]), abs=1e-9)


BALL = """
multibody_sym: 1
name: ball
gravity: [0, 0, -10]
bodies:
  ground: {surfaces: {table: {plane: [0, 0, 0], normal: z}}}
  ball: {shape: {sphere: 0.1, mass: 1}, surfaces: {skin: {sphere: 0.1}}}
joints: {free: {type: free, parent: ground, child: ball, initial: {q: [0, 0, 0.1, 1, 0, 0, 0], u: [5, 0, 0, 0, 0, 0]}}}
contacts: {c: {between: [ball.skin, ground.table], static: 0.2}}
"""


@pytest.mark.parametrize(("rtol", "backend"), [(1e-4, "c"), (1e-7, "c"), (1e-4, "python")])
def test_slip_in_space_stops_when_it_does_however_coarse_the_run_is(rtol: float, backend: str) -> None:
    """A ball rolls from t = 2 v/(7 mu g) on: one step past that would turn its friction round, and it never stuck.

    Friction takes (1/7) m v^2.
    """
    run = mbs.simulate(mbs.loads(BALL), t_end=0.8, rtol=rtol, backend=backend)
    assert [(change["kind"], change["t"]) for change in run.changes] == [("stick", pytest.approx(5 / 7, rel=1e-12))]
    assert run.friction_work["c"].total == pytest.approx(-25 / 7, rel=1e-9)
    assert run.statistics["steps"] < 300


@pytest.mark.parametrize("samples", [2, 201])
def test_a_particle_on_a_rough_table_stops_when_it_does(samples: int) -> None:
    """At v/(mu g) = 1.25, which is a sample or none."""
    system = puck()
    table = mbs.System(
        "thrown",
        gravity=[0, 0, -10],
        bodies=system.bodies,
        joints={"free": mbs.PointJoint("ground", "puck", axes="xyz", q=["x", "y", "z"], initial={"u": [3, 4, 0]})},
        contacts={"c": mbs.Contact(["puck", "ground.table"], static=0.4)},
    )
    run = mbs.simulate(table, t_end=2, samples=samples)
    assert [(change["kind"], change["t"]) for change in run.changes] == [("stick", pytest.approx(1.25, rel=1e-12))]
    assert (run["x"][-1], run["y"][-1]) == pytest.approx((3 * 1.25 / 2, 4 * 1.25 / 2), rel=1e-12)


@pytest.mark.parametrize(("short", "backend"), [(1e-14, "c"), (1e-12, "c"), (1e-9, "c"), (1e-12, "python")])
def test_a_run_that_ends_as_slip_in_space_stops_has_its_last_sample_there(short: float, backend: str) -> None:
    """The ball rolls with 5/7 of its speed from t = 5/7 on, and no later: the run is too short for more."""
    end = 5 / 7 * (1 - short)
    run = mbs.simulate(mbs.loads(BALL), t_end=end, samples=3, rtol=1e-8, backend=backend)
    assert [change["kind"] for change in run.changes] == ["stick"]
    assert run.t.tolist() == [0.0, end / 2, end]
    assert (run["u_free_x"][1], run["u_free_x"][-1]) == pytest.approx((5 - end, 25 / 7), rel=1e-7)


@pytest.mark.parametrize("spin", [0, 30])
def test_when_a_ball_rolls_in_space_can_be_asked(spin: float) -> None:
    """Slip at first (v, r w) shrinks by 7/2 mu g."""
    text = BALL.replace("u: [5, 0, 0, 0, 0, 0]", f"u: [5, 0, 0, {spin}, 0, 0]") + "ask: {T: c sticks}\n"
    solved = mbs.solve(mbs.loads(text))
    assert solved.answers["T"].value == pytest.approx(math.hypot(5, 0.1 * spin) / 7, rel=1e-9)
