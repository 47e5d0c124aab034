"""Contacts that never slip while they are pressed: closed by friction alone, after many turns, beside smooth ones."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import multibody_sym as mbs

L, M, G, F = 0.3, 2.0, 9.81, 12.5
INERTIA = M * L**2 / 2 * (math.sin(math.pi / 6) ** 2 / 3 + math.cos(math.pi / 6) ** 2)
PRISM = f"""\
multibody_sym: 1
name: prism
gravity: [0, -{G}, 0]
parameters: {{l: {L}, n: 6}}
bodies:
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}
  prism: {{mass: {M}, inertia: {{Izz: {INERTIA}}}, points: {{corner: ["l*sin(pi/n)", "-l*cos(pi/n)", 0]}}}}
joints: {{free: {{type: planar, parent: ground, child: prism, q: [x, y, phi], initial: {{q: [0, "l*cos(pi/n)", 0]}}}}}}
contacts: {{c: {{between: [prism.corner, ground.floor], static: enough}}}}
forces: {{push: {{type: force, on: prism, value: [{F}, 0, 0]}}}}
outputs: {{N: "reaction(c, normal)", T: "reaction(c, friction)"}}
simulation: {{t_end: 0.75}}
"""


def corner(phi):
    """The corner from the centre of mass."""
    return L * np.sin(math.pi / 6 + phi), -L * np.cos(math.pi / 6 + phi)


def turning(phi, rate):
    """phi'' about the corner at rest, and the normal force."""
    dx, dy = corner(phi)
    bend = (M * G * dx + F * dy) / (INERTIA + M * L**2)
    return bend, M * (G - (bend * dx - rate**2 * dy))


def sliding(phi, rate):
    """phi'' and the friction that keeps the corner on the floor without a normal force: y'' = -g."""
    dx, dy = corner(phi)
    bend = (G + rate**2 * dy) / dx
    return bend, -INERTIA * bend / dy


def test_a_corner_that_nothing_presses_any_more_stays_closed_by_friction_alone():
    """Newton's and Euler's equations by hand; the limit of a large coefficient, which is a million here."""
    lifted = lambda t, x: turning(*x)[1]  # noqa: E731
    lifted.terminal = True
    kept = {"rtol": 1e-11, "atol": 1e-12}
    first = solve_ivp(lambda t, x: [x[1], turning(*x)[0]], (0.0, 0.75), [0.0, 0.0], events=lifted, **kept)
    t, (phi, rate) = first.t[-1], first.y[:, -1]
    dx, dy = corner(phi)
    start = [L / 2 - dx, -rate * -dy, phi, rate]
    free = lambda t, x: [x[1], (F + sliding(*x[2:])[1]) / M, x[3], sliding(*x[2:])[0]]  # noqa: E731
    x, speed, phi, rate = solve_ivp(free, (t, 0.75), start, **kept).y[:, -1]

    run = mbs.simulate(mbs.loads(PRISM))
    (event,) = run.events
    assert (event["element"], event["kind"]) == ("c", "slide+")
    assert event["t"] == pytest.approx(t, abs=1e-8)
    np.testing.assert_allclose(run.q[-1], [x, -corner(phi)[1], phi], atol=1e-7)
    np.testing.assert_allclose(run.u[-1], [speed, -rate * corner(phi)[0], rate], rtol=1e-5)
    assert run.outputs["T"][-1] == pytest.approx(sliding(phi, rate)[1], rel=1e-5)
    assert abs(run.outputs["N"][-1]) < 1e-5


def test_a_corner_that_would_have_to_pull_as_the_motion_begins_slides_until_it_rests():
    """Open it would go into the floor; once its slip has stopped it turns about the corner that something presses."""
    angle, load, kept = 0.2, -60.0, {"rtol": 1e-11, "atol": 1e-12}
    text = PRISM.replace(f"[{F},", f"[{load},").replace('"l*cos(pi/n)", 0]', f"{-corner(angle)[1]}, {angle}]")

    def slipping(t, x):
        return x[0] - x[2] * corner(x[1])[1]

    slipping.terminal, slipping.direction = True, 1.0

    def motion(t, x):
        bend, friction = sliding(*x[1:])
        return [(load + friction) / M, x[2], bend]

    def pivoting(t, x):
        dx, dy = corner(x[0])
        return [x[1], (M * G * dx + load * dy) / (INERTIA + M * L**2)]

    slid = solve_ivp(motion, (0.0, 0.3), [0.0, angle, 0.0], events=slipping, **kept)
    _, angle, rate = slid.y[:, -1]
    end = solve_ivp(pivoting, (slid.t[-1], 0.3), [angle, rate], **kept).y[:, -1]
    run = mbs.simulate(mbs.loads(text), t_end=0.3)
    (event,) = run.events
    assert (event["element"], event["kind"], event["t"]) == ("c", "stick", pytest.approx(slid.t[-1], rel=1e-5))
    assert (run["phi"][-1], run["u_phi"][-1]) == pytest.approx(tuple(end), rel=1e-5)
    assert abs(run.energy_residual) < 1e-8


STOOL = """\
multibody_sym: 1
name: stool
gravity: [0, 0, -9.81]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: [0, 0, 1]}}}
  stool:
    mass: 1.88
    inertia: {Ixx: 0.0376, Iyy: 0.0564, Izz: 0.0752}
    points: {a: [-0.2532, -0.184, -0.234], b: [0.0967, -0.2977, -0.234]}
contacts:
  a: {between: [stool.a, ground.floor], static: enough, open: true}
  b: {between: [stool.b, ground.floor], static: enough, open: true}
joints:
  free:
    type: free
    parent: ground
    child: stool
    initial: {q: [0, 0, 0.757, 1, 0, 0, 0], u: [1.372, -1.169, 0, 2.846, -1.243, 2.076]}
outputs: {vx: "velocity(stool.b, x)", vy: "velocity(stool.b, y)", vz: "velocity(stool.b, z)", z: "position(stool.b, z)",
  N: "reaction(b, normal)", F1: "reaction(b, friction_1)", F2: "reaction(b, friction_2)", E: "total_energy()"}
simulation: {t_end: 0.6, samples: 601}
"""


def test_a_foot_in_space_slides_where_nothing_presses_it_until_its_friction_jams():
    """It stays on the floor, friction is against its slip, and takes the energy: above 1e4 N in the last 1e-5 s."""
    run = mbs.simulate(mbs.loads(STOOL))
    assert [(event["element"], event["kind"]) for event in run.events][1:] == [("b", "slide"), ("b", "stick")]
    begins, ends = (event["t"] for event in run.events[1:])
    slides = (run.t > begins) & (run.t < ends)
    v, force = (np.array([run[k][slides] for k in names]) for names in (("vx", "vy"), ("F1", "F2")))
    size = np.linalg.norm(force, axis=0)
    np.testing.assert_allclose((v * force).sum(axis=0), -np.linalg.norm(v, axis=0) * size, rtol=1e-9)
    np.testing.assert_allclose(run["N"][slides], 1e-6 * size, rtol=1e-9)
    assert np.abs(run["z"][slides]).max() < 1e-12
    assert np.abs(run["vz"][slides]).max() < 1e-12
    assert run.friction_work["b"].total < -2.0
    assert abs(run.energy_residual) < 1e-7


SPUN = """\
multibody_sym: 1
name: spun
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  bar: {mass: 1, inertia: {Izz: 0.02}, points: {end: [0.3, 0, 0]}}
joints: {free: {type: planar, parent: ground, child: bar, q: [x, y, phi], initial: START}}
contacts: {c: {between: [bar.end, ground.floor], static: enough, restitution: 0}}
simulation: {t_end: 0.05}
"""


def test_what_has_turned_many_times_strikes_as_what_has_not():
    """An angle of 20,000 turns is rounded by 1e-11 rad; the same bar that has not turned moves alike."""
    ends = []
    for turns in (0, 20000):
        run = mbs.simulate(
            mbs.loads(SPUN.replace("START", f"{{q: [0, 0.3001, {2.0 * math.pi * turns - 1.6!r}], u: [0, -1, -300]}}"))
        )
        ends.append(([x["kind"] for x in run.events], run.q[-1] - [0.0, 0.0, 2.0 * math.pi * turns], run.u[-1]))
    assert ends[0][0] == ends[1][0]
    np.testing.assert_allclose(ends[0][1], ends[1][1], atol=1e-7)
    np.testing.assert_allclose(ends[0][2], ends[1][2], rtol=1e-7)


LEANS = """\
multibody_sym: 1
name: leans
parameters: {a: 2.2186}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: x}}}
  rod: {mass: 5, com: [0.15, 0, 0], inertia: {Izz: 0.0375}, points: {foot: [0, 0, 0], top: [0.3, 0, 0]}}
  bead: {mass: 8, inertia: {Izz: 0.01}}
joints:
  J: {type: planar, parent: ground, child: rod, q: [x, y, phi], initial: {q: [-0.3*cos(a), 0, a]}}
  guide:
    type: prismatic
    parent: rod
    child: bead
    axis: x
    q: s
    initial: {q: 0.1, u: -0.9}
    limits: {lower: 0.1, restitution: 0.5}
contacts:
  foot: {between: [rod.foot, ground.floor], static: 0, restitution: 0}
  top: {between: [rod.top, ground.wall], static: enough, restitution: 0}
"""


def test_what_would_have_to_pull_to_hold_in_an_impact_slips_as_with_a_large_coefficient():
    """By Poisson: impulses on foot and bead, and friction alone at the top, which needs no pressure in the limit."""
    a = 2.2186
    c, s = math.cos(a), math.sin(a)
    to_com, to_bead = (np.array([[1.0, 0.0, -r * s, 0.0], [0.0, 1.0, r * c, 0.0]]) for r in (0.15, 0.1))
    to_bead[:, 3] = c, s
    mass = 5 * to_com.T @ to_com + 8 * to_bead.T @ to_bead + np.diag([0.0, 0.0, 0.0475, 0.0])
    before, stop = np.array([0.0, 0.0, 0.0, -0.9]), np.array([0.0, 0.0, 0.0, 1.0])
    foot, top, along = (np.array(x) for x in ([0, 1.0, 0, 0], [1, 0, -0.3 * s, 0], [0, 1, 0.3 * c, 0]))

    def struck(exerted, still, known):
        """Return speeds and impulses such that rows `still` have no speed."""
        n = len(exerted)
        matrix = np.block([[mass, -np.transpose(exerted)], [np.array(still), np.zeros((n, n))]])
        return np.split(np.linalg.solve(matrix, [*(mass @ before + known), *[0.0] * n]), [4])

    opened, _ = struck([foot, stop], [foot, stop], 0 * stop)
    assert top @ opened < 0
    _, held = struck([foot, stop, top, along], [foot, stop, top, along], 0 * stop)
    assert held[2] < 0
    compressed, impulses = struck([foot, stop, along], [foot, stop, top], 0 * stop)
    assert impulses[2] * (along @ compressed) < 0
    after, (carried, friction) = struck([foot, along], [foot, top], 1.5 * impulses[1] * stop)
    assert carried > 0
    assert friction * (along @ after) < 0

    run = mbs.simulate(mbs.loads(LEANS), t_end=1e-3, samples=2)
    assert run.u[0] == pytest.approx(after, abs=1e-5)
    assert [x["impulse"] for x in run.events[:3]] == pytest.approx([carried, 0.0, 1.5 * impulses[1]], abs=1e-5)
