"""Infinitely many impacts: time, place and speed of their limit against the series of flights summed in 50 digits."""

from __future__ import annotations

import math
from functools import partial

import mpmath
import pytest

import multibody_sym as mbs
from multibody_sym import System, Trajectory

mpmath.mp.dps = 50
G, SPEED, LAUNCH = 9.81, 3.0, 2.0
STOP = "stop: {rests: c closes}\nsimulation: {t_end: 10}\n"
FLOOR = f"""
multibody_sym: 1
name: floor
gravity: ["{G}*sin(slope)", "-{G}*cos(slope)", 0]
parameters: {{e: 0.5, mu: 0, slope: 0, a: 0, b: 0, w: 7}}
bodies: {{plate: {{surfaces: {{top: {{plane: [0, 0, 0], normal: y}}}}}}, ball: {{mass: 1}}}}
joints:
  lift: {{type: prismatic, parent: ground, child: plate, axis: y, motion: "a*t^2/2 + b*sin(w*t)"}}
  free: {{type: point, parent: ground, child: ball, q: [x, y], initial: {{u: [{SPEED}, {LAUNCH}]}}}}
contacts: {{c: {{between: [ball, plate.top], restitution: e, static: mu, kinetic: mu}}}}
{STOP}"""
FLOORS = {
    "floor": {},
    "rough floor": {"mu": 0.2, "e": 0.7},
    "slope": {"slope": 0.4, "mu": 0.1},
    "accelerating": {"a": 2.5, "mu": 0.2, "e": 0.3},
    "shaken": {"b": 0.02, "mu": 0.1, "e": 0.6},
    "slowly losing": {"b": 0.01, "mu": 0.02, "e": 0.85},
}


def end_of_flight(above, guess):
    """Return the first root > 0 of a height that begins to grow at 0."""
    step = guess / 20
    until = next(k for k in range(2, 1000) if above(k * step) < 0) * step
    return mpmath.findroot(lambda s: above(s) / s, (until - step, until), solver="anderson")


def on_a_floor(e=0.5, mu=0, slope=0, a=0, b=0, w=7):
    """Return t, x, y, u_x, u_y once all flights are over: each ends at the first root of the height over the floor."""
    mp = mpmath
    e, mu, slope, a, b = map(mp.mpf, (e, mu, slope, a, b))
    along, down = G * mp.sin(slope), G * mp.cos(slope)
    t, x, y, u, v = mp.mpf(0), mp.mpf(0), mp.mpf(0), mp.mpf(SPEED), mp.mpf(LAUNCH)

    def height(s):
        return a * s * s / 2 + b * mp.sin(w * s)

    def rate(s):
        return a * s + b * w * mp.cos(w * s)

    def above(s, t, y, v):
        return y + v * s - down * s * s / 2 - height(t + s)

    while (speed := v - rate(t)) > mp.mpf(10) ** -14:
        flight = end_of_flight(partial(above, t=t, y=y, v=v), 2 * speed / down)
        t, x, u, v = t + flight, x + u * flight + along * flight**2 / 2, u + along * flight, v - down * flight
        y, closing = height(t), rate(t) - v
        u, v = u - mu * (1 + e) * closing, rate(t) + e * closing
    return tuple(map(float, (t, x, y, u, rate(t))))


@pytest.fixture(scope="module")
def floor() -> System:
    return mbs.loads(FLOOR)


def told(run: Trajectory, *names: str) -> tuple[float, ...]:
    assert run.stop is not None
    assert run.stop["t"] == run.t[-1] == run.events[-1]["t"]
    return (float(run.t[-1]), *(float(run[name][-1]) for name in names))


@pytest.mark.parametrize("kind", FLOORS)
def test_a_ball_rests_on_a_floor_when_and_where_the_series_of_flights_ends(floor: System, kind: str) -> None:
    run = mbs.simulate(floor, parameters=FLOORS[kind])
    assert told(run, "x", "y", "u_x", "u_y") == pytest.approx(on_a_floor(**FLOORS[kind]), rel=1e-9, abs=1e-9)


MASS, RADIUS = 4.0, 0.8
PLANET = f"""
multibody_sym: 1
name: planet
parameters: {{mu: 0.05, e: 0.6}}
bodies: {{ground: {{surfaces: {{crust: {{disc: {RADIUS}}}}}}}, ball: {{mass: 1}}}}
joints: {{free: {{type: point, parent: ground, child: ball, q: [x, y], initial: {{q: [{RADIUS}, 0], u: [0.7, 1.2]}}}}}}
forces: {{pull: {{type: gravitation, between: [ground, ball], masses: [{MASS}, 1], constant: 1}}}}
contacts: {{c: {{between: [ball, ground.crust], restitution: e, static: mu, kinetic: mu}}}}
{STOP}"""


def round_a_planet(e=0.6, mu=0.05):
    """Return t, x, y, u_x, u_y once all flights along Kepler's ellipses are over."""
    mp = mpmath
    r, gm, e, mu = mp.mpf(RADIUS), mp.mpf(MASS), mp.mpf(e), mp.mpf(mu)
    t, angle, out, across = mp.mpf(0), mp.mpf(0), mp.mpf("0.7"), mp.mpf("1.2")
    while out > mp.mpf(10) ** -14:
        axis = 1 / (2 / r - (out**2 + across**2) / gm)
        latus = (r * across) ** 2 / gm
        eccentric = mp.sqrt(1 - latus / axis)
        anomaly = mp.acos((1 - r / axis) / eccentric)
        t += mp.sqrt(axis**3 / gm) * 2 * (mp.pi - anomaly + eccentric * mp.sin(anomaly))
        angle += 2 * (mp.pi - mp.acos((latus / r - 1) / eccentric))
        out, across = e * out, across - mu * (1 + e) * out
    x, y = r * mp.cos(angle), r * mp.sin(angle)
    return tuple(map(float, (t, x, y, -across * mp.sin(angle), across * mp.cos(angle))))


def test_a_ball_rests_on_a_planet_when_and_where_the_series_of_ellipses_ends() -> None:
    run = mbs.simulate(mbs.loads(PLANET), rtol=1e-11, atol=1e-12)
    assert told(run, "x", "y", "u_x", "u_y") == pytest.approx(round_a_planet(), rel=1e-9, abs=1e-9)


BLOCK = f"""
multibody_sym: 1
name: block
gravity: ["-{G}*sin(slope)", "-{G}*cos(slope)", 0]
parameters: {{mu: 0.2, e: 0.6, slope: 0.5}}
bodies: {{block: {{mass: 2}}}}
joints:
  guide:
    type: prismatic
    parent: ground
    child: block
    axis: x
    q: s
    initial: {{q: 0.5}}
    limits: {{lower: 0, restitution: e}}
forces: {{rub: {{type: friction, joint: guide, static: mu, kinetic: mu}}}}
stop: {{rests: guide.lower stops}}
simulation: {{t_end: 10}}
"""


def test_a_block_rests_on_the_stop_of_a_rough_guide_when_the_series_of_its_ways_up_and_down_ends() -> None:
    """It goes up with the deceleration a, down with b: it takes v/a + v/sqrt(a b), and e sqrt(b/a) v is left."""
    e, mu, slope = 0.6, 0.2, 0.5
    a, b = (G * (math.sin(slope) + sign * mu * math.cos(slope)) for sign in (1, -1))
    v = math.sqrt(2 * b * 0.5)
    end = v / b + e * (v / a + v / math.sqrt(a * b)) / (1 - e * math.sqrt(b / a))
    assert told(mbs.simulate(mbs.loads(BLOCK)), "s", "u_s") == pytest.approx((end, 0, 0), rel=1e-9, abs=1e-9)


CORNER = """
multibody_sym: 1
name: corner
gravity: [-5, -5, 0]
parameters: {e: 0.5, f: 0.6, h: 0.5}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: x}}}
  ball: {mass: 1}
joints: {free: {type: point, parent: ground, child: ball, q: [x, y], initial: {q: [0.3, h]}}}
contacts:
  c: {between: [ball, ground.floor], restitution: e, open: true}
  d: {between: [ball, ground.wall], restitution: f, open: true}
simulation: {t_end: 10}
"""


@pytest.fixture(scope="module")
def corner() -> System:
    return mbs.loads(CORNER)


@pytest.mark.parametrize(("e", "f", "ahead"), [(0.5, 0.5, 3e-5), (0.5, 0.6, 1e-5), (0.7, 0.4, -2e-5)])
def test_bounces_on_a_floor_and_on_a_wall_that_end_together_end_each_when_its_own_series_does(
    corner: System, e: float, f: float, ahead: float
) -> None:
    """From rest at a height h it takes sqrt(2 h/g) (1 + e)/(1 - e)."""
    wall = math.sqrt(2 * 0.3 / 5) * (1 + f) / (1 - f)
    h = 2.5 * ((wall - ahead) * (1 - e) / (1 + e)) ** 2
    run = mbs.simulate(corner, parameters={"e": e, "f": f, "h": h}, t_end=wall + 0.1)
    rests = {x["element"]: x["t"] for x in run.events}
    assert rests == pytest.approx({"c": wall - ahead, "d": wall}, rel=1e-9)


SPUN = """
multibody_sym: 1
name: spun
gravity: ["9.81*sin(slope)", "-9.81*cos(slope)", 0]
parameters: {r: 0.1, slope: 0.04, b: 0.12, v: 0.6, w: 6}
bodies:
  ground:
    surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [-0.6, 0, 0], normal: ["cos(b)", "-sin(b)", 0]}}
  d: {mass: 1.6, inertia: {Izz: "0.8*r^2"}, surfaces: {rim: {disc: r}}}
joints: {j: {type: planar, parent: ground, child: d, q: [x, y, a], initial: {q: [-0.2, r, 0], u: [-v, 0, w]}}}
contacts:
  f: {between: [d.rim, ground.floor], static: 0.3, kinetic: 0.24}
  c: {between: [d.rim, ground.wall], static: 0.7, kinetic: 0.7, open: true}
simulation: {t_end: 1.4}
"""
"""A disc whose wall throws it off its floor, slides back against the wall, each time lower by the same part."""


@pytest.mark.parametrize("backend", ["python", "c"])
@pytest.mark.parametrize("v", [0.6, 1.2])
def test_a_disc_that_strikes_a_wall_in_shrinking_cycles_rolls_off_at_their_limit(v: float, backend: str) -> None:
    """Flights and slides of constant acceleration are alike but for size; from the limit on it rolls down the floor."""
    given = {"v": v, "w": 10 * v}
    run = mbs.simulate(mbs.loads(SPUN), parameters=given, rtol=1e-11, atol=1e-12, samples=3, backend=backend)
    t = [x["t"] for x in run.events if x["element"] == "c"]
    a, b = t[2] - t[1], t[3] - t[2]
    limit = t[3] + b * b / (a - b)
    last = [x["t"] for x in run.events if x["t"] > limit - 1e-7]
    assert last == [pytest.approx(limit, abs=2e-10)] * 2
    fall = 2 / 3 * 9.81 * math.sin(0.04)
    assert run.u[-1] == pytest.approx([fall * (1.4 - limit), 0, -10 * fall * (1.4 - limit)], abs=1e-9)
