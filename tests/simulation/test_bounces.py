"""What bounces in runs: times, speeds and energies against closed forms, up to rest."""

from __future__ import annotations

import math

import numpy as np
import pytest

import multibody_sym as mbs

G = 9.81


def ball(e, height=1.0, *, slope=0.0, across=0.0):
    """A point above a smooth plane that leans by an angle, from rest or with a speed along x."""
    return mbs.loads(f"""
multibody_sym: 1
name: ball
gravity: [0, -{G}, 0]
parameters: {{e: {e}, h: {height}, a: {slope}, v: {across}}}
bodies:
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: ["-sin(a)", "cos(a)", 0]}}}}}}
  ball: {{mass: 2}}
joints: {{free: {{type: point, parent: ground, child: ball, q: [x, y], initial: {{q: [0, h], u: [v, 0]}}}}}}
contacts: {{c: {{between: [ball, ground.floor], restitution: e}}}}
""")


def rest(e, height=1.0, g=G):
    """The time at which what falls from a height rests: sqrt(2 h/g) (1 + e)/(1 - e)."""
    return math.sqrt(2 * height / g) * (1 + e) / (1 - e)


@pytest.mark.parametrize("e", [0.1, 0.5, 0.9, 0.99])
def test_a_ball_comes_to_rest_in_time(e):
    run = mbs.simulate(ball(0.5), parameters={"e": e}, t_end=1.1 * rest(e))
    last = run.events[-1]
    assert (last["kind"], last["element"]) == ("closed", "c")
    assert last["t"] == pytest.approx(rest(e), rel=1e-11)
    assert (run["y"][run.t > last["t"]] == run["y"][-1]).all()
    assert sum(event.get("lost", 0.0) for event in run.events) == pytest.approx(2 * G, rel=1e-11)
    speeds = [event["impulse"] / (2 * (1 + e)) for event in run.events[:4]]
    assert speeds == pytest.approx([math.sqrt(2 * G) * e**k for k in range(4)], rel=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("e", [0.995, 0.999])
def test_a_ball_that_hardly_loses_speed_comes_to_rest_in_time(e):
    run = mbs.simulate(ball(0.5), parameters={"e": e}, t_end=1.01 * rest(e))
    assert run.events[-1]["t"] == pytest.approx(rest(e), rel=1e-8)


def test_an_elastic_ball_bounces_a_thousand_times():
    """Each flight takes 2 sqrt(2 h/g) and nothing is lost."""
    flight = 2 * math.sqrt(2 / G)
    run = mbs.simulate(ball(1.0), t_end=1000 * flight)
    times = [event["t"] for event in run.events]
    assert len(times) == 1000
    np.testing.assert_allclose(times, flight * (np.arange(1000) + 0.5), rtol=1e-10)
    assert np.ptp(run.energy) < 1e-10 * run.energy[0]


def test_a_ball_on_a_slope_bounces_as_on_a_floor_with_less_gravity():
    """Across the plane it falls by g cos(a); along it nothing acts but g sin(a), whatever strikes."""
    slope, e = 0.3, 0.6
    run = mbs.simulate(ball(e, slope=slope), t_end=4.0)
    normal = math.cos(slope)
    last = run.events[-1]
    assert last["kind"] == "closed"
    assert last["t"] == pytest.approx(rest(e, normal, G * normal), rel=1e-9)
    along = run["x"] * normal + run["y"] * math.sin(slope)
    np.testing.assert_allclose(along, math.sin(slope) - G * math.sin(slope) * run.t**2 / 2, atol=1e-9)


def test_both_backends_bounce_alike():
    first, other = (mbs.simulate(ball(0.7), t_end=3.0, samples=31, backend=name) for name in ("c", "python"))
    times = [[event["t"] for event in run.events] for run in (first, other)]
    assert times[0] == pytest.approx(times[1], rel=1e-12)
    np.testing.assert_allclose(first.q, other.q, atol=1e-12)


def test_a_ball_bounces_to_rest_on_a_plate_that_stands():
    """Both would fall alike without the floor: what counts is the acceleration while the plate stands."""
    run = mbs.simulate(
        mbs.loads(f"""
multibody_sym: 1
name: pair
gravity: [0, -{G}, 0]
bodies:
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}
  plate: {{mass: 5, surfaces: {{top: {{plane: [0, 0, 0], normal: y}}}}}}
  ball: {{mass: 1}}
joints:
  lift: {{type: prismatic, parent: ground, child: plate, axis: y, q: y1, initial: {{q: 0}}}}
  fall: {{type: prismatic, parent: ground, child: ball, axis: y, q: y2, initial: {{q: 1}}}}
contacts:
  stand: {{between: [plate, ground.floor]}}
  strike: {{between: [ball, plate.top], restitution: 0.5}}
"""),
        t_end=2.0,
    )
    assert abs(run["y1"]).max() < 1e-12
    last = run.events[-1]
    assert (last["element"], last["kind"]) == ("strike", "closed")
    assert last["t"] == pytest.approx(rest(0.5), rel=1e-9)
