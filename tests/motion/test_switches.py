"""Runs of what holds one way only, from switch to switch: times and states against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import multibody_sym as mbs
from multibody_sym.errors import NoSolutionError
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


def test_a_block_thrown_up_an_incline_comes_back():
    run = simulated(thrown(0.25), t_end=3.0, **EXACT)
    up = G * (math.sin(0.4) + 0.25 * math.cos(0.4))
    down = G * (math.sin(0.4) - 0.25 * math.cos(0.4))
    assert told(run) == [("c1", "slide-")]
    assert times(run) == pytest.approx([5 / up], rel=1e-12)
    along = run["x"] * math.cos(0.4) + run["y"] * math.sin(0.4)
    turn = 5 / up
    wanted = np.where(run.t < turn, 5 * run.t - up / 2 * run.t**2, 12.5 / up - down / 2 * (run.t - turn) ** 2)
    np.testing.assert_allclose(along, wanted, atol=1e-10)
    np.testing.assert_allclose(run.t, np.arange(1001) * 0.003, rtol=1e-15)


@pytest.mark.parametrize("t_end", [1e3, 1e6])
def test_a_block_that_stops_on_an_incline_stays_to_the_last_bit(t_end):
    run = simulated(thrown(0.6), t_end=t_end, samples=101)
    stop = 5 / (G * (math.sin(0.4) + 0.6 * math.cos(0.4)))
    assert told(run) == [("c1", "stick")]
    assert times(run) == pytest.approx([stop], rel=1e-9)
    after = run.t > stop
    assert np.ptp(run["x"][after]) == np.ptp(run["y"][after]) == 0.0
    assert (run["u_x"][after] == 0.0).all()
    assert run["x"][-1] == pytest.approx(2.5 * stop * math.cos(0.4), rel=1e-8)


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
    for roundings in range(0, 40, 4 if backend == "c" else 12):
        t_end = 5 / (0.19 * 9.81) * (1 + (roundings - 20) * 2.2e-16)
        run = mbs.simulate(mbs.loads(model), t_end=t_end, rtol=1e-11, atol=1e-12, samples=2, backend=backend)
        assert run["x"][-1] == pytest.approx(25 / (2 * 0.19 * 9.81), rel=1e-9)


def test_both_backends_take_the_same_way():
    first, other = (simulated(thrown(0.25), t_end=1.0, samples=11, backend=name) for name in ("c", "python"))
    assert times(first) == pytest.approx(times(other), rel=1e-14)
    np.testing.assert_allclose(first.q, other.q, rtol=1e-12)
    assert first.statistics["steps"] == other.statistics["steps"]


def test_block_on_block_under_a_growing_force():
    """The lower one slides when the force is mu2 (m + M) g, the upper one slips when it is (mu1 + mu2) (m + M) g."""
    text = """
parameters: {m: 1.5, M: 4, mu1: 0.4, mu2: 0.15}
bodies:
  block: {mass: m}
  plank: {mass: M, surfaces: {top: {plane: [0, 0, 0], normal: y}}}
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
joints:
  a: {type: point, parent: ground, child: block, q: [x, y]}
  b: {type: point, parent: ground, child: plank, q: [X, Y]}
forces:
  F: {type: force, on: plank, value: [7*t, 0, 0]}
contacts:
  c1: {between: [block, plank.top], static: mu1, kinetic: mu1}
  c2: {between: [plank, ground.floor], static: mu2, kinetic: mu2}
"""
    run = simulated(text, t_end=6.0, **EXACT)
    slides, slips = 0.15 * 5.5 * G / 7, 0.55 * 5.5 * G / 7
    assert told(run) == [("c2", "slide+"), ("c1", "slide-")]
    assert times(run) == pytest.approx([slides, slips], rel=1e-9)
    late = run.t[-1] - slips
    speed = 7 * (slips - slides) ** 2 / 2 / 5.5
    assert run["u_x"][-1] == pytest.approx(speed + 0.4 * G * late, rel=1e-9)
    assert (run["x"][run.t < slides] == 0.0).all()


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


def test_a_ball_slides_into_rolling():
    text = """
parameters: {r: 0.1, mu: 0.2}
bodies:
  ball: {mass: 1.5, inertia: {Izz: 2/5*1.5*r^2}, surfaces: {skin: {disc: r, axis: z}}}
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
joints:
  free: {type: planar, parent: ground, child: ball, q: [x, y, th], initial: {q: [0, r, 0], u: [3, 0, 0]}}
contacts:
  c1: {between: [ball.skin, ground.floor], static: mu, kinetic: mu}
"""
    run = simulated(text, t_end=2.0, **EXACT)
    assert told(run) == [("c1", "stick")]
    assert times(run) == pytest.approx([2 * 3 / (7 * 0.2 * G)], rel=1e-12)
    assert run["u_x"][-1] == pytest.approx(3 * 5 / 7, rel=1e-12)
    assert run["u_th"][-1] == pytest.approx(-3 * 5 / 7 / 0.1, rel=1e-12)
    assert (run["y"] == 0.1).all()


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


ROD = """
parameters: {{mu: 2}}
bodies:
  rod: {{mass: 1, inertia: {{Izz: 1/3}}, points: {{end: [-1, 0, 0]}}}}
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}
joints:
  free:
    type: planar
    parent: ground
    child: rod
    q: [x, y, th]
    initial: {{q: [0, "sin({0})", {0}], u: ["-({1})*sin({0}) + {2}", "({1})*cos({0})", {1}]}}
contacts:
  c1: {{between: [rod.end, ground.floor], static: mu, kinetic: mu}}
"""


def test_painleves_rod_slips_the_other_way_where_it_can_neither_slide_on_nor_stick():
    run = simulated(ROD.format(0.15, 2, -8), t_end=0.331, **EXACT)
    assert told(run) == [("c1", "slide+")]
    assert times(run) == pytest.approx([0.330004627001], rel=1e-11)


def test_painleves_rod_without_a_state_is_told():
    with pytest.raises(NoSolutionError, match="fulfils the laws of contact and friction together"):
        simulated(ROD.format(1.3, 0, -8), t_end=0.1)


def test_of_several_states_the_run_takes_one_and_says_so():
    run = simulated(ROD.format(0.9, -4, -8), t_end=0.01)
    assert run.events[0]["kind"] == "several states"
    assert run.events[0]["t"] == 0.0


BOX = """
bodies:
  box: {shape: {box: [0.4, 0.2, 0.3], mass: 2}}
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
contacts:
  c1: {between: [box, ground.floor], static: 0.5, kinetic: 0.5}
"""


def test_a_box_on_two_corners_slips_where_both_together_cannot_hold_it():
    """How friction is shared between the corners is open while it stands: its sum alone says when it slips."""
    more = """
joints:
  free: {type: planar, parent: ground, child: box, q: [x, y, th], initial: {q: [0, 0.1, 0]}}
forces:
  F: {type: force, on: box, value: [12*sin(3*t), 0, 0]}
"""
    run = simulated(BOX + more, t_end=1.5, **EXACT)
    slips = math.asin(0.5 * 2 * G / 12) / 3
    assert times(run, "slide+") == pytest.approx([slips, slips], rel=1e-11)
    # it moves until 4 (cos 3 t0 - cos 3 t)/2 = mu g (t - t0), and slips back when the force is large enough that way
    t = times(run, "stick")[0]
    assert 2 * (math.cos(3 * slips) - math.cos(3 * t)) == pytest.approx(0.5 * G * (t - slips), rel=1e-9)
    assert times(run, "slide-") == pytest.approx([slips + math.pi / 3] * 2, rel=1e-11)
    standing = (run.t > t) & (run.t < slips + math.pi / 3)
    assert np.ptp(run["x"][standing]) == 0.0
    assert (run["x"][run.t < slips] == 0.0).all()


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


def test_a_box_that_is_rough_enough_tips_where_its_weight_does_not_hold_it():
    """Corners that never slip may press against each other as hard as they like, which holds nothing down."""
    limit = 2 * G * 0.2 / 0.05
    rests, tips = (pushed_over(f"{part * limit}", t_end=1e-3) for part in (0.999, 1.001))
    assert (told(rests), rests["th"][-1]) == ([], 0.0)
    assert (told(tips), tips["th"][-1] < 0.0) == ([], True)


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


def test_a_box_that_falls_on_a_corner_comes_to_rest_on_its_side():
    more = """
joints:
  free: {type: planar, parent: ground, child: box, q: [x, y, th], initial: {q: [0, 0.5, 0.3], u: [1, 0, 0]}}
"""
    run = simulated(BOX + more, t_end=0.6, rtol=1e-11, atol=1e-12)
    low = 0.5 - 0.2 * math.sin(0.3) - 0.1 * math.cos(0.3)
    first = run.events[0]
    assert (first["t"], first["kind"], first["element"]) == (
        pytest.approx(math.sqrt(2 * low / G)),
        "impact",
        "c1.corner1",
    )
    assert told(run)[-2:] == [("c1.corner1", "stick"), ("c1.corner2", "stick")]
    assert (run["y"][-1], run["th"][-1]) == pytest.approx((0.1, 0.0), abs=1e-14)
    taken = sum(work.total for work in run.friction_work.values()) - sum(run.impact_losses.values())
    assert run.energy[-1] - run.energy[0] == pytest.approx(taken, rel=1e-9)


def test_a_slider_with_dry_friction_stops_after_eleven_half_swings():
    """Each half swing takes 2 mu g / w^2 of the amplitude, until the spring is too weak: to the last bit."""
    text = """
bodies:
  block: {mass: 2}
joints:
  D: {type: prismatic, parent: ground, child: block, axis: x, q: x, initial: {q: 1}}
forces:
  spring: {type: spring_damper, joint: D, stiffness: 50}
  rub: {type: friction, joint: D, static: 0.12, kinetic: 0.12}
"""
    run = simulated(text, t_end=10.0, **EXACT)
    assert times(run) == pytest.approx(np.arange(1, 12) * math.pi / 5, rel=1e-9)
    assert [word for _, word in told(run)] == ["slide+", "slide-"] * 5 + ["stick"]
    way = sum(2 * (1 - (2 * k + 1) * 0.12 * G / 25) for k in range(11))
    assert run["x"][-1] == pytest.approx(22 * 0.12 * G / 25 - 1, rel=1e-9)
    assert np.ptp(run["x"][run.t > 7.0]) == 0.0
    assert run.friction_work["rub"].total == pytest.approx(-0.12 * 2 * G * way, rel=1e-9)


def test_a_stop_holds_until_the_moment_turns():
    text = """
bodies:
  flap: {mass: 2, inertia: {Izz: 0.5}}
joints:
  D: {type: revolute, parent: ground, child: flap, axis: z, q: phi, limits: {lower: 0, upper: 1}}
forces:
  M: {type: torque, joint: D, value: -sin(t)}
"""
    run = simulated(text, t_end=6.0, **EXACT)
    assert (run["phi"][run.t < math.pi] == 0.0).all()
    assert times(run)[0] == pytest.approx(math.pi, rel=1e-11)
    assert told(run) == [("D.lower", "free"), ("D.upper", "upper")]
    # 0.5 phi'' = -sin t from rest at pi: phi = 2 (s - sin s), s = t - pi
    s = times(run)[1] - math.pi
    assert 2 * (s - math.sin(s)) == pytest.approx(1.0, rel=1e-9)
    assert run.impact_losses["D.upper"] == pytest.approx(0.25 * (2 * (1 - math.cos(s))) ** 2, rel=1e-9)


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


PUCK = """
bodies:
  puck: {{mass: 2}}
  ground: {{surfaces: {{face: {{plane: [0, 0, 0], normal: [-sin(0.3), 0, cos(0.3)]}}}}}}
joints:
  free: {{type: point, axes: xyz, parent: ground, child: puck, q: [x, y, z]{0}}}
contacts:
  c1: {{between: [puck, ground.face], static: 0.4, kinetic: {1}}}
{2}"""


def in_space(text, **options):
    return mbs.simulate(mbs.loads(HEAD.replace("0, -9.81, 0", "0, 0, -9.81") + text), **options)


def test_a_puck_curves_down_an_incline_and_stops():
    """d(mu cos a |v| + sin a v_down)/dt = -g (mu^2 cos^2 a - sin^2 a) whatever the way."""
    start = ', initial: {u: ["0.5*cos(0.3)", 2, "0.5*sin(0.3)"]}'
    run = in_space(PUCK.format(start, 0.4, ""), t_end=2.0, **EXACT)
    mu, s = 0.4 * math.cos(0.3), math.sin(0.3)
    assert told(run) == [("c1", "stick")]
    assert times(run)[0] == pytest.approx((mu * math.hypot(2, 0.5) - 0.5 * s) / G / (mu**2 - s**2), rel=1e-8)
    assert np.ptp(run.q[run.t > 1.2], axis=0).tolist() == [0.0, 0.0, 0.0]


def test_a_puck_slips_where_weight_and_push_together_leave_the_circle():
    push = "forces: {F: {type: force, on: puck, value: [0, 3*t, 0]}}"
    run = in_space(PUCK.format("", 0.3, push), t_end=1.7, **EXACT)
    slips = 2 * G * math.sqrt((0.4 * math.cos(0.3)) ** 2 - math.sin(0.3) ** 2) / 3
    assert told(run) == [("c1", "slide")]
    assert times(run)[0] == pytest.approx(slips, rel=1e-9)
    assert run["u_x"][-1] < 0.0 < run["u_y"][-1]


THROWN = """\
multibody_sym: 1
name: thrown
gravity: [0, -10, 0]
parameters: {h: 4.99999, F: 5}
bodies: {b: {mass: 1}}
joints: {J: {type: prismatic, parent: ground, child: b, axis: y, q: y, initial: {u: 10}}}
forces: {f: {type: force, on: b, value: [0, "where(y > h, -F, 0)", 0]}}
"""


@pytest.mark.parametrize("method", ["dormand_prince", "dormand_prince_8", "radau_5", "RK45"])
@pytest.mark.parametrize("depth", [1e-3, 1e-5, 5e-7])
def test_a_kink_that_is_hardly_passed_is_left_again(depth: float, method: str) -> None:
    """At v = sqrt(2 g d) the height rounds to the same number for v^-1 1e-15 s: with shorter steps it never came back.

    It is above h for 2 v/(g + F), and falls from there with v.
    """
    v = math.sqrt(20 * depth)
    left = 2 - ((10 - v) / 10 + 2 * v / 15)
    run = mbs.simulate(mbs.loads(THROWN), t_end=2, parameters={"h": 5 - depth}, method=method, samples=2)
    allowed = 1e-6 if method == "RK45" else 1e-9
    assert run["y"][-1] == pytest.approx(5 - depth - v * left - 5 * left**2, abs=allowed)


LED_ON_A_SLIDER = """
bodies: {b: {mass: 1}, c: {mass: 1}}
joints:
  J: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {u: 30}}
  K: {type: prismatic, parent: b, child: c, axis: x, q: s}
forces:
  rub: {type: friction, joint: J, static: 0.5}
  hold: {type: friction, joint: K, static: 0.2}
  down: {type: force, on: c, value: [0, 4.81, 0]}
  up: {type: force, on: b, value: [0, "14.81 + where(t < 0.5, 0, LOAD)", 0]}
"""


@pytest.mark.parametrize("load", [20, -20])
def test_a_load_from_either_side_brakes_a_slider_that_nothing_pressed(load):
    """10 N brake the slider, of which 1 N is given by the block: it slips forward on it, and at no time back."""
    run = simulated(LED_ON_A_SLIDER.replace("LOAD", str(load)), t_end=1.0)
    assert run.u[-1] == pytest.approx([30 - 9 * 0.5, 8 * 0.5], rel=1e-9)
    assert told(run) == [("rub", "slide+"), ("hold", "slide+")]
