"""Friction in joints exerts impulses too: by hand, by bodies cut free, and as in runs."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs
from multibody_sym.answers.records import ImpactFound
from multibody_sym.text.printer import text

HEAD = "multibody_sym: 1\nname: struck\n"
SLIDER = """
parameters: {m: {value: 2 kg, positive: true}, v: {value: 3 m/s, positive: true}, I: {value: 4 N*s, positive: true},
  mu: {value: 0.25, positive: true}, ms: {value: 0.5, positive: true}}
bodies: {a: {mass: m}}
joints: {A: {type: prismatic, parent: ground, child: a, axis: x, q: x, initial: {u: SPEED}}}
forces: {rub: {type: friction, joint: A, static: ms, kinetic: mu}}
impact: {impulse: [PUSH, -I, 0], at: a}
"""
DOOR = """
parameters: {m: {value: 20 kg, positive: true}, b: {value: 0.9 m, positive: true}, r: {value: 0.02 m, positive: true},
  I: {value: 3 N*s, positive: true}, mu: {value: 0.4, positive: true}, w: {value: 2 rad/s, positive: true}}
bodies: {door: {mass: m, com: [b/2, 0, 0], inertia: {Izz: m*b^2/12}, points: {hit: [b, 0, 0]}}}
joints: {H: {type: revolute, parent: ground, child: door, axis: z, initial: {u: w}}}
forces: {rub: {type: friction, joint: H, kinetic: mu, radius: r}}
impact: {impulse: [0, I, 0], at: door.hit}
"""
WALL = """
parameters: {m: 2, l: 1, mu: 0.6, r: 0.1, e: 0.5, f: 0}
bodies:
  rod: {mass: m, com: [l/2, 0, 0], inertia: {Izz: m*l^2/12}, points: {tip: [l, 0, 0]}}
  ground: {surfaces: {wall: {plane: [0, -1, 0], normal: [0.6, 0.8, 0]}}}
joints: {H: {type: revolute, parent: ground, child: rod, axis: z, q: a, initial: {q: "0 - pi/2", u: -3}}}
forces: {rub: {type: friction, joint: H, kinetic: mu, radius: r}}
contacts: {c: {between: [rod.tip, ground.wall], restitution: e, kinetic: f}}
"""


def found(model: str) -> ImpactFound:
    told = mbs.solve(mbs.loads(HEAD + model)).impact
    assert told is not None
    return told


def test_a_slider_hammered_onto_its_guide_is_slowed() -> None:
    told = found(SLIDER.replace("SPEED", "v").replace("PUSH", "0"))
    assert text(told.after["u_x"].expression) == "v - I*mu/m"
    assert told.after["u_x"].value == pytest.approx(2.5, rel=1e-15)
    assert told.impulses["rub"]["friction"].value == pytest.approx(-1.0, rel=1e-15)
    assert told.joint_impulses["A"]["fy"].value == pytest.approx(4.0, rel=1e-15)
    assert told.energy_lost.value == pytest.approx(9 - 6.25, rel=1e-14)
    assert told.states["rub"] == "slides+"
    assert told.conditions == ("m*v >= I*mu",)


def test_a_hammer_that_is_strong_enough_stops_it() -> None:
    told = found(SLIDER.replace("SPEED", "v").replace("PUSH", "0").replace("4 N*s", "40 N*s"))
    assert told.after["u_x"].value == 0.0
    assert text(told.impulses["rub"]["friction"].expression) == "-m*v"
    assert told.states["rub"] == "sticks"


@pytest.mark.parametrize(("push", "speed"), [("0.4*I", 0.0), ("0.75*I", (3 - 1) / 2), ("-0.75*I", -1.0)])
def test_a_slanting_hammer_moves_a_slider_outside_the_cone(push: str, speed: float) -> None:
    told = found(SLIDER.replace("SPEED", "0").replace("PUSH", push))
    assert told.after["u_x"].value == pytest.approx(speed, abs=1e-15)


def test_a_journal_brakes_by_the_impulse_on_its_hinge() -> None:
    """J (w+ - w) = I b - mu r |R| with R = m b/2 (w+ - w) - I, which presses along +y here."""
    told = found(DOOR)
    m, b, r, push, mu = 20, 0.9, 0.02, 3, 0.4
    jump = (push * b + mu * r * push) / (m * b * b / 3 + mu * r * m * b / 2)
    assert told.jumps["u_H"].value == pytest.approx(jump, rel=1e-13)
    hinge = m * b / 2 * jump - push
    assert hinge > 0
    assert told.joint_impulses["H"]["fy"].value == pytest.approx(hinge, rel=1e-12)
    assert told.impulses["rub"]["friction"].value == pytest.approx(-mu * r * hinge, rel=1e-12)
    assert told.jumps["u_H"].expression is not None


def test_a_journal_and_a_wall_by_the_body_cut_free() -> None:
    """The tip strikes a slanting wall: compression by hand, then Poisson's part of it, both with mu r |R|."""
    m, l, mu, r, e, w = 2.0, 1.0, 0.6, 0.1, 0.5, -3.0
    n = (0.6, 0.8)
    # The tip is at (0, -l): it moves along x by l w, and p n has the moment n_x l about the hinge.
    # Hinge: R = m v_com' - p n, v_com' = (l/2 dw, 0), and mu r |R| against w < 0.
    def left(dw: float, p: float) -> float:
        size = math.hypot(m * l / 2 * dw - p * n[0], -p * n[1])
        return m * l * l / 3 * dw - p * n[0] * l - mu * r * size

    low, high = 0.0, 100.0
    for _ in range(200):  # p that stops it: dw = -w
        p = (low + high) / 2
        low, high = (p, high) if left(-w, p) > 0 else (low, p)
    told = found(WALL + "impact: {law: poisson}\n")
    compressed = p
    assert told.impulses["c"]["normal"].value == pytest.approx((1 + e) * compressed, rel=1e-12)
    after = told.after["u_a"].value
    assert after > 0  # the journal rubs the other way while it bounces
    rest = e * compressed
    size = math.hypot(m * l / 2 * after - rest * n[0], -rest * n[1])
    assert m * l * l / 3 * after == pytest.approx(rest * n[0] * l - mu * r * size, rel=1e-11)


@pytest.mark.parametrize("f", [0, 0.3])
@pytest.mark.parametrize("e", [0, 0.5, 1])
def test_solve_and_runs_have_one_answer(e: float, f: float) -> None:
    model = mbs.loads(HEAD + WALL)
    changed = {"e": e, "f": f}
    run = mbs.simulate(model, parameters=changed, t_end=1e-9)
    told = mbs.solve(mbs.loads(HEAD + WALL + "impact: closing\n"), parameters=changed).impact
    assert told is not None
    assert told.law == "poisson"
    assert told.impulses["c"]["normal"].value == pytest.approx(run.events[0]["impulse"], rel=1e-12)
    assert told.after["u_a"].value == pytest.approx(run["u_a"][-1], rel=1e-8, abs=1e-12)


def test_what_bounces_in_a_run_rubs_in_its_joints() -> None:
    """An impulse in proportion to the speed, as by the body cut free above: a smooth hinge would ask for 7/6 of it."""
    smooth = WALL.replace(", kinetic: f}", "}")
    model = mbs.loads(HEAD + smooth + "gravity: [0, -9.81, 0]\nsimulation: {samples: 20001}\n")
    run = mbs.simulate(model, initial={"a": -0.9, "u_a": -3}, t_end=0.5)
    hit = next(event for event in run.events if "impulse" in event)
    before = float(run["u_a"][int(run.t.searchsorted(hit["t"])) - 1])
    told = found(WALL + "impact: {law: poisson}\n").impulses["c"]["normal"].value
    assert hit["impulse"] / before == pytest.approx(told / -3.0, rel=1e-3)


def test_a_given_impulse_and_the_journal_that_it_presses_act_together() -> None:
    """The hinge bears R = I l/(2 l + 3 mu r) as the rod gets going: friction takes mu r R w/2."""
    told = found("""
parameters: {I: 3, m: {value: 2, positive: true}, l: {value: 1, positive: true}, r: 0.1, mu: 0.4}
bodies: {rod: {mass: m, com: [l/2, 0, 0], inertia: {Izz: m*l^2/12}, points: {tip: [l, 0, 0]}}}
joints: {J: {type: revolute, parent: ground, child: rod, axis: z}}
forces: {f: {type: friction, joint: J, static: mu, kinetic: mu, radius: r}}
impact: {impulse: [0, I, 0], at: rod.tip}
""")
    bearing = 3 / 2.12
    w = 3 / 2 * (3 - 0.04 * bearing)
    assert told.after["u_J"].value == pytest.approx(w, rel=1e-14)
    assert told.energy_lost.value == pytest.approx(0.04 * bearing * w / 2, rel=1e-13)
    assert told.energy_lost.expression is not None
    assert told.energy_given is not None
    assert told.energy_given.value == pytest.approx(3 * w / 2, rel=1e-13)
    assert told.kinetic_energy["after"].value == pytest.approx(w * w / 3, rel=1e-13)


def test_a_push_and_the_blow_that_follows_have_energies_of_their_own() -> None:
    """A push P gives P v + P^2/(2 m); then half m_red (1 - e^2) times the square of the speed is lost."""
    told = found("""
parameters: {m1: {value: 2, positive: true}, m2: {value: 3, positive: true}, v1: 4, v2: 1, e: 0.5, P: 6}
bodies: {a: {mass: m1}, b: {mass: m2}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: x, q: x1, initial: {u: v1}}
  B: {type: prismatic, parent: ground, child: b, axis: x, q: x2, initial: {u: v2}}
impact: {hit: {between: [a, b], normal: -x, restitution: e}, push: {impulse: [P, 0, 0], at: a}}
""")
    assert told.energy_given is not None
    assert text(told.energy_given.expression) == "P*(P + 2*m1*v1)/(2*m1)"
    assert told.energy_lost.value == pytest.approx(0.6 * 0.75 * 36, rel=1e-13)
    assert told.energy_lost.expression is not None
    assert told.conditions == ("P + m1*v1 > m1*v2",)
