"""Infinitely many impacts: time, place and speed of their limit against the series of flights summed in 50 digits."""

from __future__ import annotations

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
