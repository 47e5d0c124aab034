"""Runs of what holds one way only, from switch to switch: times and states against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import multibody_sym as mbs
from multibody_sym.motion.prepare import problem
from multibody_sym.motion.runs.run import FailedRunError

G = 9.81
HEAD = "multibody_sym: 1\nname: case\ngravity: [0, -9.81, 0]\n"
EXACT = {"rtol": 1e-12, "atol": 1e-13}


def simulated(text, **options):
    return mbs.simulate(mbs.loads(HEAD + text), **options)


def told(run):
    return [(event["element"], event["kind"]) for event in run.events]


def times(run, *kinds):
    return [event["t"] for event in run.events if not kinds or event["kind"] in kinds]


def thrown(mu, alpha=0.4, more=""):
    return f"""
parameters: {{a: {alpha}, mu: {mu}}}
bodies:
  block: {{mass: 2}}
  ground: {{surfaces: {{face: {{plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}}}}
joints:
  free: {{type: point, parent: ground, child: block, q: [x, y], initial: {{u: ["5*cos(a)", "5*sin(a)"]}}}}
contacts:
  c1: {{between: [block, ground.face], static: mu, kinetic: mu}}
{more}"""


@pytest.mark.parametrize("backend", ["c", "python"])
def test_a_run_may_end_a_few_roundings_after_a_switch(backend):
    """A block sliding at 5 m/s stands after 5/(mu g): no step is so short as what is left of these runs."""
    model = """
        multibody_sym: 1
        name: slide
        gravity: [0, -9.81, 0]
        bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, b: {mass: 3}}
        joints: {j: {type: point, parent: ground, child: b, q: [x, y], initial: {u: [5, 0]}}}
        contacts: {c: {between: [b, ground.floor], static: 0.19, kinetic: 0.19}}
        """
    slide = mbs.prepare(mbs.loads(model), rtol=1e-11, atol=1e-12, samples=2, backend=backend)
    for roundings in range(0, 40, 4 if backend == "c" else 12):
        t_end = 5 / (0.19 * 9.81) * (1 + (roundings - 20) * 2.2e-16)
        run = slide.run(t_end=t_end)
        assert run["x"][-1] == pytest.approx(25 / (2 * 0.19 * 9.81), rel=1e-9)


def test_both_backends_take_the_same_way():
    first, other = (simulated(thrown(0.25), t_end=1.0, samples=11, backend=name) for name in ("c", "python"))
    assert times(first) == pytest.approx(times(other), rel=1e-14)
    np.testing.assert_allclose(first.q, other.q, rtol=1e-12)
    assert first.statistics["steps"] == other.statistics["steps"]


BELT = """
parameters: {m: 1.5, k: 40, v: 0.3, mus: 0.5, muk: 0.3}
bodies:
  block: {mass: m}
  belt: {mass: 1, surfaces: {top: {plane: [0, 0, 0], normal: y}}}
joints:
  free: {type: point, parent: ground, child: block, q: [x, y], initial: {u: [v, 0]}}
  run: {type: prismatic, parent: ground, child: belt, axis: x}
constraints:
  drive: {type: motion, joint: run, value: v*t}
forces:
  spring: {type: force, on: block, value: [-k*x, 0, 0]}
contacts:
  c1: {between: [block, belt.top], static: mus, kinetic: muk}
"""


def test_a_mass_on_a_belt_sticks_and_slips_for_fifty_periods():
    m, k, v, static, kinetic = 1.5, 40, 0.3, 0.5, 0.3
    w, A = math.sqrt(k / m), (static - kinetic) * m * G / k
    slip, stick = 2 / w * (math.pi - math.atan(A * w / v)), 2 * A / v
    first = static * m * G / k / v
    run = simulated(BELT, t_end=50 * (slip + stick) + first, rtol=1e-11, atol=1e-12)
    begins = first + np.arange(50) * (slip + stick)
    assert times(run, "slide-")[:50] == pytest.approx(begins, rel=1e-9)
    assert times(run, "stick") == pytest.approx(begins + slip, rel=1e-9)


def test_a_rope_goes_slack_and_taut_again():
    """A bob on a string: slack where v^2 = g y, then a parabola until it is at the length again; the rope takes v_n."""
    text = """
bodies:
  bob: {mass: 1.5}
joints:
  free: {type: point, parent: ground, child: bob, q: [x, y], initial: {q: [0, -1], u: [5.5, 0]}}
constraints:
  string: {type: rope, path: [ground, bob], length: 1, slack: true}
"""
    run = simulated(text, t_end=1.3, **EXACT)
    assert told(run) == [("string", "slack"), ("string", "taut")]
    y = (5.5**2 - 2 * G) / (3 * G)
    x, speed = math.sqrt(1 - y * y), math.sqrt(G * y)
    vx, vy = -speed * y, speed * x
    slack, taut = times(run)
    # |(x, y) + v s - g s^2/2|^2 = 1 has the root 0 three times: g^2/4 s + g.v = 0 is left over
    assert taut - slack == pytest.approx(4 * vy / G, rel=1e-9)
    s = 4 * vy / G
    place, before = np.array([x + vx * s, y + vy * s - G / 2 * s * s]), np.array([vx, vy - G * s])
    tangent = np.array([-place[1], place[0]])
    after = simulated(text, t_end=taut + 1e-6, samples=2, **EXACT).u[-1]
    np.testing.assert_allclose(after, tangent * (tangent @ before), atol=2e-5)
    assert run.energy[-1] == pytest.approx(0.75 * (tangent @ before) ** 2 + 1.5 * G * place[1], rel=1e-9)
    assert (run.tensions["string"][(run.t > slack) & (run.t < taut)] == 0.0).all()


BOX = """
bodies:
  box: {shape: {box: [0.4, 0.2, 0.3], mass: 2}}
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
contacts:
  c1: {between: [box, ground.floor], static: 0.5, kinetic: 0.5}
"""


def pushed_over(force, **options):
    """Return the run of a flat box, which never slips, that is pushed at its middle, 0.05 m above the floor."""
    more = f"""
joints:
  free: {{type: planar, parent: ground, child: box, q: [x, y, th], initial: {{q: [0, 0.05, 0]}}}}
forces:
  F: {{type: force, on: box, value: ["{force}", 0, 0]}}
"""
    box = BOX.replace("static: 0.5, kinetic: 0.5", "static: enough").replace("0.4, 0.2", "0.4, 0.1")
    return simulated(box + more, backend="python", samples=3, **options)


def test_where_a_load_that_ends_leaves_a_tipping_box_its_corner_slides_until_it_opens():
    """What never slips would have to pull at its corner. Newton's and Euler's equations, by hand, at mu -> infinity."""
    inertia, load = 2 * (0.4**2 + 0.1**2) / 12, 200.0

    def corner(angle):
        return 0.2 * np.cos(angle) + 0.05 * np.sin(angle), 0.2 * np.sin(angle) - 0.05 * np.cos(angle)

    def turning(t, x):
        dx, dy = corner(x[0])
        return [x[1], (2 * G * dx + load * dy) / (inertia + 2 * (dx**2 + dy**2))]

    def sliding(t, x):  # the corner has y'' = 0 without a normal force
        dx, dy = corner(x[0])
        bend = (G + x[1] ** 2 * dy) / dx
        return [x[1], bend, -inertia * bend / dy / 2]

    def opens(t, x):
        return G + x[1] ** 2 * corner(x[0])[1]

    opens.terminal = True
    angle, rate = solve_ivp(turning, (0.0, 0.1), [0.0, 0.0], **EXACT).y[:, -1]
    dx, dy = corner(angle)
    slid = solve_ivp(sliding, (0.1, 0.2), [angle, rate, rate * dy], events=opens, **EXACT)
    run = pushed_over("200*(t < 0.1)", t_end=0.2)
    assert told(run) == [("c1.corner2", "slide-"), ("c1.corner2", "open")]
    assert [event["t"] for event in run.events] == pytest.approx([0.1, slid.t[-1]], abs=1e-7)
    dx, dy = corner(slid.y[0, -1])
    flight = slid.y[2, -1], -slid.y[1, -1] * dx - G * (0.2 - slid.t[-1]), slid.y[1, -1]
    assert run.u[-1] == pytest.approx(flight, rel=1e-6)
    assert abs(run.energy_residual) < 1e-9  # the load's work ends where it jumps


def test_a_sign_of_a_speed_at_rest_is_answered_by_what_to_declare(monkeypatch):
    text = """
bodies:
  block: {mass: 2}
joints:
  D: {type: prismatic, parent: ground, child: block, axis: x, q: x, initial: {q: 0.3}}
forces:
  spring: {type: spring_damper, joint: D, stiffness: 50}
  rub: {type: force, on: block, value: ["-20*sign(u_x)", 0, 0]}
"""
    monkeypatch.setattr(problem, "_MOST_STEPS", 10_000_000)
    with pytest.raises(FailedRunError, match=r"where u_x changes its sign.*type: friction, joint: D, static"):
        simulated(text, t_end=10.0)


def test_a_sign_of_a_speed_at_rest_on_a_contact_is_answered_by_the_coefficients_of_a_contact(monkeypatch):
    text = """
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, b: {mass: 1}}
joints: {j: {type: point, parent: ground, child: b, q: [x, y]}}
contacts: {c: {between: [b, ground.floor]}}
forces: {f: {type: force, on: b, value: ["3 - 5*sign(u_x)", 0, 0]}}
"""
    monkeypatch.setattr(problem, "_MOST_STEPS", 10_000_000)
    with pytest.raises(FailedRunError, match=r"where u_x changes its sign.*as such, a contact with static and kinetic"):
        simulated(text, t_end=3.0)
