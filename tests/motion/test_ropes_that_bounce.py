"""Ropes that go taut and rebound: times, speeds and energies against closed forms, up to a load that hangs."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs

G, MASS, LENGTH = 9.81, 2.0, 1.5
FALL = math.sqrt(2 * LENGTH / G)
"""The time after which a load that is dropped at the rope's upper end has fallen its length."""


def load(e, rope="{path: [ground.hook, load], length: L, slack: true, restitution: e}", extra=""):
    """A load that falls straight down from where its rope is fixed."""
    return mbs.loads(f"""
multibody_sym: 1
name: load
gravity: [0, -{G}, 0]
parameters: {{e: {e}, L: {LENGTH}, h: 1e-3}}
bodies: {{ground: {{points: {{hook: [0, 0, 0]}}}}, load: {{mass: {MASS}}}}}
joints: {{fall: {{type: prismatic, parent: ground, child: load, axis: -y, q: s, initial: {{q: h}}}}}}
constraints: {{cord: {{type: rope, {rope[1:]}}}
{extra}""")


@pytest.fixture(scope="module")
def fallen():
    """Runs of loads by their restitution, up to a tenth past rest."""
    model = load(0.5)
    ends = {e: 1.1 * FALL * (1 + e) / (1 - e) for e in (0.1, 0.5, 0.9)}
    return {e: mbs.simulate(model, parameters={"e": e, "h": 1e-3}, t_end=end) for e, end in ends.items()}


@pytest.mark.parametrize("e", [0.1, 0.5, 0.9])
def test_a_load_bounces_on_its_rope_until_it_hangs(fallen, e):
    """It strikes with v = sqrt(2 g h) e^n, and hangs after 2 v e/(g (1 - e)) more; all its height is lost.

    Where it goes taut is the difference of two lengths, whose rounding counts in the last bounces.
    """
    run, height = fallen[e], LENGTH - 1e-3
    v = math.sqrt(2 * G * height)
    impacts = [event for event in run.events if event["kind"] == "impact"]
    assert {event["element"] for event in run.events} == {"cord"}
    assert [event["impulse"] for event in impacts[:3]] == pytest.approx(
        [MASS * (1 + e) * v * e**n for n in range(3)], rel=1e-9
    )
    assert [event["lost"] for event in impacts[:3]] == pytest.approx(
        [MASS * (1 - e * e) * (v * e**n) ** 2 / 2 for n in range(3)], rel=1e-9
    )
    last = run.events[-1]
    assert last["kind"] == "taut"
    assert last["t"] == pytest.approx(v / G * (1 + e) / (1 - e), rel=1e-9)
    assert (run["s"][run.t > last["t"]] == run["s"][-1]).all()
    assert run["s"][-1] == pytest.approx(LENGTH, rel=1e-12)
    assert sum(event.get("lost", 0.0) for event in run.events) == pytest.approx(MASS * G * height, rel=1e-11)


def test_a_rope_without_restitution_is_taut_at_once(fallen):
    run = mbs.simulate(load(0.5), parameters={"e": 0, "h": 1e-3}, t_end=1.2 * FALL)
    assert [event["kind"] for event in run.events] == ["taut"]


def test_a_rope_keeps_its_restitution_in_a_file_and_in_python():
    model = load(0.5)
    assert mbs.loads(mbs.dumps(model)) == model
    assert "restitution: e" in mbs.dumps(model)
    rope = mbs.Rope(("ground.hook", "load"), length="L", slack=True, restitution="e")
    assert model.constraints["cord"] == rope


@pytest.mark.parametrize(
    ("rope", "words"),
    [
        ("{path: [ground.hook, load], restitution: 0.5}", "slack: true"),
        ("{path: [ground.hook, load], slack: true, restitution: 1.5}", "between 0 and 1 \\(0: they stay together"),
        ("{path: [ground.hook, load], slack: true, restitution: -0.5}", "between 0 and 1 \\(0: they stay together"),
    ],
)
def test_a_restitution_that_no_rope_has_is_refused(rope, words):
    with pytest.raises(mbs.ModelError, match=words) as caught:
        mbs.solve(load(0.5, rope))
    assert caught.value.where.path == ("constraints", "cord", "restitution")


def test_a_restitution_that_a_parameter_makes_too_large_is_refused():
    with pytest.raises(mbs.ModelError, match="above 1") as caught:
        mbs.simulate(load(0.5), parameters={"e": 1.2}, t_end=0.1)
    assert caught.value.where.path == ("constraints", "cord", "restitution")


def test_an_impact_knows_the_restitution_of_the_rope():
    """`impact: closing` with the load at the rope's end: p = (1 + e) m v, as declared by the rope itself."""
    model = mbs.loads(
        mbs.dumps(load(0.25)).replace("q: h}", "q: L, u: 3}").replace("q: [h]", "q: [L], u: [3]") + "impact: closing\n"
    )
    impact = mbs.solve(model).impact
    assert impact.impulses["cord"]["normal"].value == pytest.approx(1.25 * MASS * 3, rel=1e-14)


def test_two_loads_on_a_rope_over_a_pulley_rebound_together():
    """Unequal loads, one held up by hand: the rope goes taut, v = relative; each rebound is e times the speed before.

    The rope's row is s1 + s2 <= L; its effective mass 1/(1/m1 + 1/m2), and both fall freely between: the row's
    acceleration is 2 g, so that it rests after 2 v e/(2 g (1 - e)) more.
    """
    e, m1, m2, slack = 0.4, 3.0, 1.0, 0.2
    run = mbs.simulate(
        mbs.loads(f"""
multibody_sym: 1
name: atwood
gravity: [0, -{G}, 0]
bodies:
  ground: {{points: {{left: [-0.1, 0, 0], right: [0.1, 0, 0]}}}}
  a: {{mass: {m1}}}
  b: {{mass: {m2}}}
joints:
  A: {{type: prismatic, parent: ground.left, child: a, axis: -y, q: s1, initial: {{q: 1}}}}
  B: {{type: prismatic, parent: ground.right, child: b, axis: -y, q: s2, initial: {{q: 1}}}}
constraints:
  cord: {{type: rope, path: [a, ground.left, ground.right, b], length: {2.2 + slack}, slack: true, restitution: {e}}}
"""),
        t_end=0.4,
    )
    v = 2 * G * math.sqrt(slack / G)
    impacts = [event for event in run.events if event["kind"] == "impact"]
    assert impacts[0]["impulse"] == pytest.approx((1 + e) * v * m1 * m2 / (m1 + m2), rel=1e-9)
    last = run.events[-1]
    assert (last["element"], last["kind"]) == ("cord", "taut")
    assert last["t"] == pytest.approx(math.sqrt(slack / G) * (1 + e) / (1 - e), rel=1e-9)


def test_a_rope_whose_ends_are_at_one_place_has_no_direction():
    with pytest.raises(mbs.ModelError, match=r"ground\.hook and load are at one place") as caught:
        mbs.simulate(load(0.5), parameters={"h": 0}, t_end=0.1)
    assert caught.value.where.path == ("constraints", "cord")


@pytest.mark.parametrize("backend", ["c", "python"])
def test_a_load_that_strikes_at_the_very_end_of_a_run_ends_it(backend):
    """With g = 10 m/s^2 it falls 0.8 m in 0.4 s to 4 m/s; with e = 1/2 it is back at 0.8 s and 1 s, but for 1e-15."""
    model = mbs.loads(_EVEN + "outputs: {twice: 2*s}\n")
    struck = mbs.simulate(model, t_end=1, samples=3, backend=backend)
    assert struck.outputs["twice"].tolist() == (2 * struck["s"]).tolist()
    assert struck["s"][-1] == pytest.approx(1.0, rel=1e-12)
    assert [event["t"] for event in struck.events] == pytest.approx([0.4, 0.8, 1.0][: len(struck.events)], rel=1e-12)


@pytest.mark.parametrize("end", [0.4, 1.0, 1.6])
def test_the_largest_speed_of_a_load_is_that_at_which_it_strikes(end):
    text = _EVEN + f"ask: {{fastest: {{max: u_s}}}}\nsimulation: {{t_end: {end}}}\n"
    answer = mbs.solve(mbs.loads(text)).answers["fastest"]
    assert answer.value == pytest.approx(4.0, rel=1e-12)


_EVEN = """
multibody_sym: 1
name: even
gravity: [0, -10, 0]
bodies: {ground: {points: {hook: [0, 0, 0]}}, load: {mass: 2}}
joints: {fall: {type: prismatic, parent: ground, child: load, axis: -y, q: s, initial: {q: 0.2}}}
constraints: {cord: {type: rope, path: [ground.hook, load], length: 1, slack: true, restitution: 0.5}}
"""


TWO_ROPES = """
multibody_sym: 1
name: two_ropes
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {ledge: {plane: [0, 0, 0], normal: y}}}
  anchor: {mass: 3}
  load: {mass: 2}
joints:
  a: {type: point, parent: ground, child: anchor, q: [ax, ay]}
  b: {type: point, parent: ground, child: load, q: [x, y], initial: {q: [0, -0.75]}}
contacts: {c: {between: [anchor, ground.ledge], static: 0.5, restitution: 0}}
constraints:
  dead: {type: rope, path: [anchor, load], length: 1, slack: true, restitution: 0}
  lively: {type: rope, path: [anchor, load], length: 1, slack: true, restitution: 1}
"""


def test_a_load_on_two_ropes_comes_to_rest_where_their_anchor_rests_on_a_ledge() -> None:
    """By Poisson, sharing the impulse of compression, they bounce as one of 0.5 does: fall t, in all t + 2 t e/(1 - e).

    The ledge takes part of every impact, though nothing strikes it.
    """
    run = mbs.simulate(mbs.loads(TWO_ROPES), t_end=1, samples=101)
    rests = [event["t"] for event in run.events if event["kind"] == "taut"]
    assert rests == pytest.approx([3 * math.sqrt(2 * 0.25 / 9.81)] * 2, rel=1e-8)
    assert (run["y"][-1], run["ay"][-1]) == (-1.0, 0.0)


IN_A_CORNER = """
multibody_sym: 1
name: in_a_corner
gravity: [0, -9.81, 0]
bodies:
  ground:
    surfaces:
      low: {plane: [0, 0, 0], normal: [-0.342581, 0.939488, 0]}
      steep: {plane: [0, 0, 0], normal: [0.939488, 0.342581, 0]}
  anchor: {mass: 0.162}
  load: {mass: 10}
joints:
  a: {type: point, parent: ground, child: anchor, q: [ax, ay]}
  b: {type: point, parent: ground, child: load, q: [x, y], initial: {q: [0.8, 0.3]}}
forces:
  pull: {type: force, on: anchor, value: [-2.553, -0.778, 0]}
  weight: {type: force, on: load, value: [0, -7.431, 0]}
contacts:
  c: {between: [anchor, ground.low], static: 1.5, restitution: 0}
  d: {between: [anchor, ground.steep], static: 0.3, restitution: 0.5}
constraints:
"""
TWO = """\
  dead: {type: rope, path: [anchor, load], slack: true, restitution: 0}
  lively: {type: rope, path: [anchor, load], slack: true, restitution: 1}
"""
ONE = "  one: {type: rope, path: [anchor, load], slack: true, restitution: 0.5}\n"


def test_ropes_come_to_rest_where_their_anchor_is_held_by_more_friction_than_it_needs() -> None:
    """Impulses that friction shares as it likes do not pull at the steep face, which nothing leaves.

    As one rope of 0.5 they leave the load swinging; without that rest they strike on.
    """
    two, one = (mbs.simulate(mbs.loads(IN_A_CORNER + ropes), t_end=0.6, samples=301) for ropes in (TWO, ONE))
    for name in ("x", "y", "u_x", "u_y"):
        assert two[name][-1] == pytest.approx(one[name][-1], abs=1e-9), name
    assert len(two.events) < 70
