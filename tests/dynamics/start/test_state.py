"""The mode at the start: what touches, acts, sticks and slides there, against bodies cut free by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.start.state import StartState, examined_state
from multibody_sym.errors import ModelError, NoSolutionError
from multibody_sym.mechanics.state import state_of

G = 9.81
INCLINE = f"""\
multibody_sym: 1
name: incline
gravity: [0, -{G}, 0]
parameters: {{mu: 0.3, a: 30 deg}}
bodies:
  b: {{mass: 2, points: {{p: [0, 0, 0]}}}}
  ground: {{surfaces: {{face: {{plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}}}}
joints: {{J: {{type: point, parent: ground, child: b, initial: {{q: [1, tan(a)], u: [0, 0]}}}}}}
contacts: {{c: {{between: [b.p, ground.face], static: mu}}}}
"""
ROPE = f"""\
multibody_sym: 1
name: lift
gravity: [0, -{G}, 0]
bodies: {{a: {{mass: 2}}, b: {{mass: 3}}}}
joints:
  A: {{type: prismatic, parent: ground, child: a, axis: y, q: ya, initial: {{q: 0}}}}
  B: {{type: prismatic, parent: ground, child: b, axis: y, q: yb, initial: {{q: -1}}}}
forces: {{pull: {{type: force, on: a, value: [0, 60, 0]}}}}
constraints: {{rope: {{type: rope, path: [a, b], slack: true}}}}
"""
DRAWER = """\
multibody_sym: 1
name: drawer
parameters: {mu: 0.5, l: 0.4, e: 0.3}
bodies: {b: {mass: 2, inertia: {Izz: 0.1}, points: {p: [0.1, e, 0]}}}
joints: {J: {type: prismatic, parent: ground, child: b, axis: x, q: x}}
forces:
  push: {type: force, on: b, value: [20, 0, 0], at: p}
  rub: {type: friction, joint: J, static: mu, length: l}
"""
ROD = f"""\
multibody_sym: 1
name: rod
gravity: [0, -{G}, 0]
bodies:
  rod: {{mass: 1, com: [1, 0, 0], inertia: {{Izz: 1/3}}, points: {{end: [0, 0, 0]}}}}
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}
joints: {{J: {{type: planar, parent: ground, child: rod, initial: {{q: [0, 0, THETA], u: [-8, 0, OMEGA]}}}}}}
contacts: {{c: {{between: [rod.end, ground.floor], static: 2}}}}
"""


def at_start(text: str, **changes: str) -> StartState:
    for old, new in changes.items():
        text = text.replace(old, new)
    return examined_state(mbs.loads(text))


def accelerations(found: StartState) -> tuple[np.ndarray, dict[str, float]]:
    """Return udot and the multipliers by name in the mode at the start."""
    begin, resolved = found.start, found.mechanism
    state = state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)
    solved = forward_dynamics(composite_body(resolved, state))
    return solved.udot, dict(zip((row.name for row in resolved.rows), solved.multipliers, strict=True))


# --- contacts ------------------------------------------------------------------------------------------------------


def test_a_block_on_an_incline_sticks_or_slides_by_its_coefficient() -> None:
    found = at_start(INCLINE, **{"mu: 0.3": "mu: 0.6"})
    assert found.words == {"c": "stick"}
    udot, forces = accelerations(found)
    assert udot == pytest.approx([0, 0], abs=1e-14)
    assert forces == pytest.approx({"c.normal": 2 * G * math.cos(math.pi / 6), "c.friction": G}, rel=1e-14)
    found = at_start(INCLINE)
    assert found.words == {"c": "slide-"}
    down = G * (0.5 - 0.3 * math.cos(math.pi / 6))
    along = np.array([math.cos(math.pi / 6), 0.5])
    assert accelerations(found)[0] == pytest.approx(-down * along, rel=1e-13)


@pytest.mark.parametrize(("u", "word"), [("[1, tan(a)]", "slide+"), ("[-1, -tan(a)]", "slide-"), ("[-1, 0]", "open")])
def test_what_moves_slides_that_way_or_leaves(u: str, word: str) -> None:
    found = at_start(INCLINE, **{"u: [0, 0]": f"u: {u}"})
    assert (found.words, dict(found.closing)) == ({"c": word}, {})


def test_what_strikes_as_the_run_begins_is_told() -> None:
    assert at_start(INCLINE, **{"u: [0, 0]": "u: [0, -1]"}).closing == pytest.approx({"c": math.cos(math.pi / 6)})


def test_a_contact_that_is_nearly_closed_is_closed_unless_it_is_open() -> None:
    near = {"tan(a)]": "0.5775]"}
    found = at_start(INCLINE, **near)
    assert found.words == {"c": "slide-"}
    assert found.start.q == pytest.approx([1, math.tan(math.pi / 6)], abs=1e-15)
    assert at_start(INCLINE, **near, **{"static: mu": "static: mu, open: true"}).words == {"c": "open"}
    assert at_start(INCLINE, **{"tan(a)]": "0.6]"}).words == {"c": "open"}


def test_a_contact_that_starts_inside_is_an_error() -> None:
    with pytest.raises(ModelError, match=r"starts 0\.0239\d* m inside ground\.face") as caught:
        at_start(INCLINE, **{"tan(a)]": "0.5497]"})
    assert caught.value.where.path == ("contacts", "c")


def test_speeds_that_are_not_given_follow_what_touches() -> None:
    """A ramp that moves with a given speed lifts the block on it, whose own speed is not given."""
    text = INCLINE.replace("  ground: {surf", "  ramp: {mass: 1, surf").replace("ground.face", "ramp.face")
    ramp = "  R: {type: prismatic, parent: ground, child: ramp, axis: x, initial: {u: 2}}"
    text = text.replace(", u: [0, 0]}}}", f"}}}}\n{ramp}")
    text = text.replace("joints: {J: {", "joints:\n  J: {", 1)
    found = at_start(text)
    assert found.words["c"] in ("stick", "slide+", "slide-")
    u = dict(zip((s.name for s in found.mechanism.speeds), found.start.u, strict=True))
    assert u["u_R"] == 2
    assert -math.sin(math.pi / 6) * (u["u_J_x"] - 2) + math.cos(math.pi / 6) * u["u_J_y"] == pytest.approx(0, abs=1e-14)


# --- ropes, stops, joints ------------------------------------------------------------------------------------------


def test_a_rope_is_taut_where_it_pulls_and_slack_where_it_would_push() -> None:
    found = at_start(ROPE)
    assert found.words == {"rope": "taut"}
    udot, forces = accelerations(found)
    assert udot == pytest.approx([60 / 5 - G] * 2, rel=1e-13)
    assert forces["rope"] == pytest.approx(3 * 60 / 5, rel=1e-13)
    assert at_start(ROPE, **{"0, 60, 0": "0, -60, 0"}).words == {"rope": "slack"}
    assert at_start(ROPE, **{"slack: true": "slack: true, length: 2"}).words == {"rope": "slack"}
    with pytest.raises(ModelError, match=r"rope begins 0\.5 m longer than the rope is"):
        at_start(ROPE, **{"slack: true": "slack: true, length: 0.5"})


def test_all_that_begins_beyond_what_it_allows_is_told_at_once() -> None:
    """A box with its two lower corners in a floor, whose contact is told once, two ropes and a stop."""
    text = """
multibody_sym: 1
name: beyond
gravity: [0, -10, 0]
bodies:
  ground: {points: {o: [0, 0, 0]}, surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  m: {shape: {box: [1, 1, 1], mass: 1}}
  n: {mass: 1}
joints:
  J: {type: planar, parent: ground, child: m, initial: {q: [3, 0.4, 0]}}
  K: {type: prismatic, parent: ground, child: n, axis: x, limits: {upper: 1}, initial: {q: 4}}
contacts: {c: {between: [m, ground.floor], static: 0.3}}
constraints:
  r: {type: rope, path: [ground.o, m], length: 2, slack: true}
  s: {type: rope, path: [ground.o, n], length: 1, slack: true}
"""
    with pytest.raises(ModelError) as raised:
        at_start(text)
    told = [raised.value, *raised.value.others]
    paths = [("contacts", "c"), ("constraints", "r"), ("constraints", "s"), ("joints", "K")]
    assert [each.where.path[:2] for each in told] == paths


def test_a_stop_holds_what_is_pushed_against_it() -> None:
    text = ROPE.replace("constraints", "parameters: {h: 0}\n#").replace("q: 0}", "q: 0}, limits: {upper: h}")
    found = at_start(text)
    assert found.words == {"A.upper": "upper"}
    udot, forces = accelerations(found)
    assert udot == pytest.approx([0, -G], abs=1e-14)
    assert forces["A.upper"] == pytest.approx(60 - 2 * G, rel=1e-14)
    assert at_start(text, **{"0, 60, 0": "0, 10, 0"}).words == {"A.upper": "free"}
    with pytest.raises(ModelError, match=r"A\.upper begins 0\.1 beyond its stop"):
        at_start(text, **{"h: 0": "h: -0.1"})


def test_a_drawer_jams_where_its_pads_press_harder_than_it_is_pushed() -> None:
    """Pushed at a distance e aside, pads l apart take +-F e / l each: it moves only if 2 mu e / l < 1."""
    limit = 0.4 / (2 * 0.3)
    for factor, word in ((1 - 1e-9, "slide+"), (1 + 1e-9, "stick")):
        found = at_start(DRAWER, **{"mu: 0.5": f"mu: {limit * factor!r}"})
        assert found.words == {"rub": word}
    found = at_start(DRAWER)
    udot, forces = accelerations(found)
    assert udot == pytest.approx([(20 - 2 * 0.5 * 20 * 0.3 / 0.4) / 2], rel=1e-13)
    assert sorted(forces.values()) == pytest.approx([-15, 15], rel=1e-13)


def test_absolute_coordinates_have_the_same_mode() -> None:
    found = at_start(DRAWER + "simulation: {coordinates: absolute}\n")
    assert found.words == {"rub": "slide+"}
    assert accelerations(found)[0][0] == pytest.approx((20 - 2 * 0.5 * 20 * 0.3 / 0.4) / 2, rel=1e-12)


PUSHED = f"""\
multibody_sym: 1
name: pushed
gravity: [0, -{G}, 0]
bodies: {{b: {{mass: 2}}, ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}}}
joints: {{J: {{type: point, parent: ground, child: b}}}}
forces: {{push: {{type: force, on: b, value: [RATE*t + 0.3*2*{G}, 0, 0]}}}}
contacts: {{c: {{between: [b, ground.floor], static: 0.3}}}}
"""


@pytest.mark.parametrize(("rate", "word"), [("1", "slide+"), ("-1", "stick"), ("0", "stick")])
def test_what_is_at_its_limit_goes_where_its_rates_lead(rate: str, word: str) -> None:
    found = at_start(PUSHED, RATE=rate)
    assert found.words == {"c": word}
    assert bool(found.found.states[0].at_limit) == (rate == "0")


def test_a_guide_that_nothing_presses_holds_nothing() -> None:
    found = at_start(DRAWER.replace(", length: l", ""))
    assert accelerations(found)[0] == pytest.approx([10], rel=1e-14)


# --- none and several ----------------------------------------------------------------------------------------------


def test_painleve_s_rod_has_no_state_or_several() -> None:
    """LAWS: theta = 1.3, omega = 0 leaves no state, theta = 0.9, omega = -4 several; the floor is rough, mu = 2."""
    found = at_start(ROD, THETA="1.3", OMEGA="0")
    assert (found.modes, found.found.verdict) == ((), "none")
    with pytest.raises(NoSolutionError, match=r"contact and friction .* declare a restitution") as caught:
        _ = found.mode
    assert caught.value.where.path == ("contacts", "c")
    found = at_start(ROD, THETA="0.9", OMEGA="-4")
    assert found.found.verdict == "several"
    assert {mode.sides["c"] for mode in found.modes} == {0, 1}


# --- what follows --------------------------------------------------------------------------------------------------


def test_every_command_is_of_the_mode_at_the_start() -> None:
    system = mbs.loads(INCLINE)
    report = mbs.check(system)
    assert (report.agrees, report.states, report.degrees_of_freedom) == (True, {"c": "slide-"}, 1)
    assert "mu*cos(a) - sin(a)" in str(mbs.derive(system))
    assert pytest.approx(np.array([[0, 1], [0, 0]]), abs=1e-15) == mbs.linearize(system).A
    run = mbs.simulate(system, t_end=0.5)
    down = G * (0.5 - 0.3 * math.cos(math.pi / 6))
    assert run["J_x"][-1] == pytest.approx(1 - down * math.cos(math.pi / 6) / 8, rel=1e-9)


def test_a_joint_s_reaction_holds_its_friction_and_stop_in_any_coordinates() -> None:
    stopped = DRAWER.replace("q: x}", "q: x, limits: {upper: 0}}").replace("20, 0, 0", "20, -8, 0")
    for text, drive in ((DRAWER, -2 * 0.5 * 20 * 0.3 / 0.4), (stopped, -20)):
        for coordinates in ("relative", "absolute"):
            asked = f"{text}outputs: {{fx: 'reaction(J, fx)'}}\nsimulation: {{coordinates: {coordinates}}}\n"
            run = mbs.simulate(mbs.loads(asked), t_end=1e-6, samples=2)
            assert run["fx"][0] == pytest.approx(drive, rel=1e-12)


def test_a_box_in_space_finds_its_state_soon() -> None:
    """Four corners rub in space at rest: all modes are tried; of eight it is said that others were not searched."""
    text = f"""\
multibody_sym: 1
name: box
gravity: [0, 0, -{G}]
bodies:
  b: {{shape: {{box: [0.4, 0.2, 0.3], mass: 2}}}}
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: z}}}}}}
joints: {{J: {{type: free, parent: ground, child: b, initial: {{q: [0, 0, 0.15, 1, 0, 0, 0]}}}}}}
forces: {{push: {{type: force, on: b, value: [3, 4, 0]}}}}
contacts: {{c: {{between: [b, ground.floor], static: 0.2}}}}
"""
    found = at_start(text)
    assert (found.found.verdict, found.found.searched) == ("one", "all 625 modes")
    assert accelerations(found)[0][:3] == pytest.approx(np.array([3, 4, 0]) * (1 / 2 - 0.2 * G / 5), abs=1e-9)
    with pytest.raises(NoSolutionError, match="begins to slip in space, and the direction of its friction"):
        mbs.linearize(mbs.loads(text))
    assert at_start(text.replace("static: 0.2", "static: 0.3")).words["c.corner1"] == "stick"
    two = text.replace("bodies:", "bodies:\n  b2: {shape: {box: [0.2, 0.2, 0.2], mass: 2}}")
    joint = "K: {type: free, parent: ground, child: b2, initial: {q: [5, 0, 0.1, 1, 0, 0, 0]}}"
    two = two.replace("joints: {J", f"joints: {{{joint}, J")
    two = two.replace("{c: {", "{d: {between: [b2, ground.floor], static: 0.2}, c: {")
    assert "others not searched" in at_start(two).found.searched
