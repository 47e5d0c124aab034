"""Runs from mode to mode by every kind of method, and by every way to keep constraints: the same motion."""

from __future__ import annotations

import math

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.contact.contact_problem import Scale
from multibody_sym.motion.methods.table import METHODS, SUNDIALS
from multibody_sym.motion.switching.decision import next_state

G, MU, ALPHA, V0 = 9.81, 0.25, 0.4, 5.0
THROWN = f"""
multibody_sym: 1
name: thrown
gravity: [0, -{G}, 0]
parameters: {{a: {ALPHA}, mu: {MU}}}
bodies:
  block: {{mass: 2}}
  ground: {{surfaces: {{face: {{plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}}}}
joints:
  free: {{type: point, parent: ground, child: block, q: [x, y], initial: {{u: ["{V0}*cos(a)", "{V0}*sin(a)"]}}}}
contacts: {{c: {{between: [block, ground.face], kinetic: mu}}}}
"""
LONG = pytest.mark.long
LIBRARIES = ["RK45", "Radau", "LSODA", "cvode_adams", "cvode_bdf", "ida"]


def available(method):
    if getattr(METHODS[method], "package", "") == SUNDIALS:
        pytest.importorskip("sksundae")
    return method


def up_and_down(t):
    """Return the way (m) up the incline at times t: up with g (sin + mu cos), down with g (sin - mu cos)."""
    up, down = (G * (math.sin(ALPHA) + sign * MU * math.cos(ALPHA)) for sign in (1, -1))
    turn = V0 / up
    return turn, np.where(t < turn, V0 * t - up / 2 * t**2, V0**2 / 2 / up - down / 2 * (t - turn) ** 2)


@pytest.mark.parametrize("method", LIBRARIES)
def test_a_library_goes_from_mode_to_mode(method) -> None:
    run = mbs.simulate(mbs.loads(THROWN), t_end=2.0, samples=21, method=available(method))
    turn, way = up_and_down(run.t)
    assert [(event["element"], event["kind"]) for event in run.events] == [("c", "slide-")]
    assert run.events[0]["t"] == pytest.approx(turn, abs=1e-7)
    np.testing.assert_allclose(run["x"] * math.cos(ALPHA) + run["y"] * math.sin(ALPHA), way, atol=1e-6)
    np.testing.assert_allclose(run["y"] * math.cos(ALPHA), run["x"] * math.sin(ALPHA), atol=1e-7)


CRANK = """
multibody_sym: 1
name: crank
gravity: [0, -9.81, 0]
parameters: {r: 0.1, l: 0.3, mu: 0.3}
bodies:
  crank: {mass: 1, com: [r/2, 0, 0], inertia: {Izz: r^2/12}, points: {pin: [r, 0, 0]}}
  rod: {mass: 0.5, com: [l/2, 0, 0], inertia: {Izz: l^2/24}, points: {pin: [l, 0, 0]}}
  slider: {mass: 0.8}
joints:
  A: {type: revolute, parent: ground, child: crank, axis: z, q: phi, initial: {q: 0.5, u: 10, known: true}}
  B: {type: revolute, parent: crank.pin, child: rod, axis: z, q: psi}
  D: {type: prismatic, parent: ground, child: slider, axis: x, q: s}
  C: {type: revolute, parent: rod.pin, child: slider, axis: z, cut: true}
forces:
  drive: {type: torque, joint: A, value: 2*sin(6*t)}
  rub: {type: friction, joint: D, static: mu}
"""
"""The slider turns at 0.231 s and 0.314 s, and what presses it changes its side soon after the second time."""


@pytest.fixture(scope="module")
def cranked():
    return mbs.simulate(mbs.loads(CRANK), t_end=0.35, samples=351, rtol=1e-8)


def test_what_presses_in_a_guide_within_a_loop_may_pass_from_side_to_side(cranked) -> None:
    """What the drive does and friction takes is what the energy changes by."""
    assert [event["kind"] for event in cranked.events] == ["slide+", "slide-"]
    power = 2 * np.sin(6 * cranked.t) * cranked["u_phi"]
    driven = (power[:-1:2] + 4 * power[1::2] + power[2::2]).sum() * 1e-3 / 3
    taken = cranked.friction_work["rub"].total
    assert taken < -0.1
    assert cranked.energy[-1] - cranked.energy[0] == pytest.approx(driven + taken, abs=1e-6)


@pytest.mark.parametrize(
    ("method", "constraints"), [("dormand_prince", {"baumgarte": {"alpha": 20, "beta": 20}}), ("RK45", None)]
)
def test_rows_of_modes_are_stabilised(cranked, method, constraints) -> None:
    asked = {"method": method, "constraints": constraints, "rtol": 1e-7}
    run = mbs.simulate(mbs.loads(CRANK), t_end=0.35, samples=351, **asked)
    assert not run.statistics["projection"]
    assert run.statistics["baumgarte"]["alpha"] == (20 if constraints else pytest.approx(8, rel=0.5))
    assert [event["kind"] for event in run.events] == [event["kind"] for event in cranked.events]
    for event, other in zip(run.events, cranked.events, strict=True):
        assert event["t"] == pytest.approx(other["t"], abs=1e-7)
    np.testing.assert_allclose(run["phi"], cranked["phi"], atol=1e-6)
    assert 1e-13 < run.drift["position"] < 1e-7


@pytest.mark.parametrize("method", ["radau_5", "ida"])
def test_rows_are_part_of_the_equations_beside_friction_in_joints(cranked, method) -> None:
    """What presses in the guide is no row of its own: it follows from the state."""
    asked = {"method": available(method), "constraints": {"index_2": True} if method == "radau_5" else None}
    run = mbs.simulate(mbs.loads(CRANK), t_end=0.35, samples=351, rtol=1e-8, **asked)
    assert run.statistics["index_2"]
    assert not run.statistics["projection"]
    assert [event["kind"] for event in run.events] == [event["kind"] for event in cranked.events]
    np.testing.assert_allclose(run["phi"], cranked["phi"], atol=1e-6)
    np.testing.assert_allclose(run["s"], cranked["s"], atol=1e-6)
    assert run.drift["velocity"] < 1e-6


def test_equations_of_index_2_have_rows_where_something_touches_and_hold_what_rests() -> None:
    """A block falls from 0.5 m, slides until v = mu g t' has stopped it, and does not move any more."""
    text = f"""
multibody_sym: 1
name: falling
gravity: [0, -{G}, 0]
bodies: {{block: {{mass: 2}}, ground: {{surfaces: {{face: {{plane: [0, 0, 0], normal: y}}}}}}}}
joints: {{free: {{type: point, parent: ground, child: block, q: [x, y], initial: {{q: [0, 0.5], u: [3, 0]}}}}}}
contacts: {{c: {{between: [block, ground.face], kinetic: 0.2}}}}
simulation: {{t_end: 2, samples: 201, method: radau_5, constraints: {{index_2: true}}}}
"""
    run = mbs.simulate(mbs.loads(text))
    falls = math.sqrt(1 / G)
    left = 3 - 0.2 * math.sqrt(G)  # the impact rubs too
    stops = falls + left / 0.2 / G
    assert [event["kind"] for event in run.events] == ["slide+", "stick"]
    assert [event["t"] for event in run.events] == pytest.approx([falls, stops], rel=1e-9)
    assert run["x"][-1] == pytest.approx(3 * falls + left**2 / 0.4 / G, rel=1e-8)
    assert np.ptp(run["x"][run.t > stops]) == np.ptp(run["y"][run.t > stops]) == 0.0


def test_equations_of_index_2_hold_what_rests_beside_what_moves() -> None:
    text = """
multibody_sym: 1
name: beside
gravity: [0, -9.81, 0]
parameters: {a: 0.3}
bodies: {block: {mass: 2}, bob: {mass: 1}, ground: {surfaces: {face: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}}
joints:
  free: {type: point, parent: ground, child: block, q: [x, y]}
  swings: {type: point, parent: ground, child: bob, q: [X, Y], initial: {q: [1, 0]}}
constraints: {rod: {type: distance, between: [bob, ground], value: 1}}
contacts: {c: {between: [block, ground.face], static: 0.5}}
simulation: {t_end: 1, samples: 11, method: radau_5, constraints: {index_2: true}}
"""
    run = mbs.simulate(mbs.loads(text))
    assert np.ptp(run["x"]) == np.ptp(run["y"]) == 0.0
    np.testing.assert_allclose(np.hypot(run["u_X"], run["u_Y"]) ** 2, -2 * G * run["Y"], atol=1e-7)


def test_a_crank_goes_on_where_its_slider_stops_near_the_dead_centre(cranked) -> None:
    """A slip that counts as rest is brought to rest only where that changes nothing else."""
    laws, phi, w = cranked.modes.switches.laws, math.pi + 1e-8, 60.0
    rod = math.asin(-math.sin(phi) / 3)
    turning = -math.cos(phi) / 3 * w / math.cos(rod)
    slip = -0.1 * math.sin(phi) * w - 0.3 * math.sin(rod) * turning
    place = np.array([phi, rod - phi, 0.1 * math.cos(phi) + 0.3 * math.cos(rod)])
    found = next_state(laws.at(0.0, place, np.array([w, turning - w, slip]), Scale(0.3, 60.0)), ())
    assert 0 < abs(slip) < 6e-8
    assert found.facts.u == pytest.approx([w, turning - w, 0.0], abs=1e-6)


@pytest.mark.parametrize("method", ["LSODA", "cvode_bdf"])
def test_a_ball_bounces_by_a_library_too(method) -> None:
    """It falls for t1 = sqrt(2 h / g), and is in the air for 2 e^k t1 after the k-th impact."""
    text = f"""
multibody_sym: 1
name: ball
gravity: [0, -{G}, 0]
bodies: {{b: {{mass: 1}}, ground: {{surfaces: {{f: {{plane: [0, 0, 0], normal: y}}}}}}}}
joints: {{j: {{type: point, parent: ground, child: b, q: [x, y], initial: {{q: [0, 1]}}}}}}
contacts: {{c: {{between: [b, ground.f], restitution: 0.8}}}}
"""
    run = mbs.simulate(mbs.loads(text), t_end=2.0, samples=3, method=available(method))
    falls = math.sqrt(2 / G)
    wanted = [falls, falls * (1 + 2 * 0.8), falls * (1 + 2 * 0.8 + 2 * 0.64)]
    assert [event["t"] for event in run.events] == pytest.approx(wanted, rel=1e-7)


LADDER = """
multibody_sym: 1
name: ladder
gravity: [0, -10, 0]
parameters: {l: 4, a: 45 deg}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: x}}}
  rod: {mass: 20, inertia: {Izz: 20*l^2/12}, points: {top: [-l/2, 0, 0], foot: [l/2, 0, 0]}}
joints: {j: {type: planar, parent: ground, child: rod, initial: {q: [l/2*cos(a), l/2*sin(a), -a]}}}
contacts: {foot: {between: [rod.foot, ground.floor]}, top: {between: [rod.top, ground.wall]}}
"""


@pytest.mark.parametrize(
    "method", ["LSODA", "BDF", "cvode_bdf", *(pytest.param(m, marks=LONG) for m in ("cvode_adams", "ida"))]
)
def test_what_opens_slowly_is_not_closed_by_the_first_steps_of_a_library_of_order_one(method) -> None:
    """The ladder leaves the wall at sin(a) = 2/3 sin(a0), its centre as fast as ever, with the third power of time.

    a'^2 = 3 g / l (sin(a0) - sin(a)) until then, which is integrated over z, a = a0 - z^2.
    """
    run = mbs.simulate(mbs.loads(LADDER), t_end=0.5, samples=2, method=available(method))
    a0, high = math.pi / 4, math.sin(math.pi / 4)
    points, weights = np.polynomial.legendre.leggauss(20)
    half = math.sqrt(a0 - math.asin(2 / 3 * high)) / 2
    z = half * (1 + points)
    leaves = np.sum(half * weights * 2 * z / np.sqrt(3 * 10 / 4 * (high - np.sin(a0 - z**2))))
    assert [(event["element"], event["kind"]) for event in run.events] == [("top", "open")]
    assert run.events[0]["t"] == pytest.approx(leaves, abs=1e-6)
    assert run["u_j_x"][-1] == pytest.approx(high / 3 * math.sqrt(10 * 4 * high), abs=1e-6)
