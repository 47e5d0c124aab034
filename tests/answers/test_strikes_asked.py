"""What strikes, and what an impact or other forces make true at once, in `stop` and `ask`: a ball that bounces."""

from __future__ import annotations

import math
from typing import Any

import pytest

import multibody_sym as mbs

G, H, E = 9.81, 1.0, 0.8
HEAD = "multibody_sym: 1\nname: problem\n"
BALL = f"""
gravity: [0, -{G}, 0]
bodies: {{ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}, b: {{mass: 2}}}}
joints: {{s: {{type: prismatic, parent: ground, child: b, axis: y, q: y, initial: {{q: {H}}}}}}}
contacts: {{c: {{between: [b, ground.floor], restitution: {E}, open: true}}}}
simulation: {{t_end: 2 s}}
"""
HIT, SPEED = math.sqrt(2 * H / G), math.sqrt(2 * G * H)
BACKENDS = pytest.mark.parametrize("backend", ["c", "python"])


def ball(rest: str) -> mbs.System:
    return mbs.loads(HEAD + BALL + rest)


def test_what_strikes_is_asked_with_the_speed_before() -> None:
    """Galileo: t = sqrt(2 h/g), v = sqrt(2 g h); the coordinate is at the floor then, and does not pass it."""
    asked = "ask: {T: c strikes, v: {of: b, at: c strikes}, x: {value: u_y, when: c strikes}, w: {of: b, at: {y: 0}}}"
    answers = mbs.solve(ball(asked)).answers
    assert answers["T"].value == pytest.approx(HIT, rel=1e-10)
    assert [answers[x].value for x in "vxw"] == pytest.approx([SPEED, -SPEED, SPEED], rel=1e-10)


def test_what_bounces_and_never_closes_is_told_to_strike() -> None:
    solution = mbs.solve(ball("ask: {T: c closes}"))
    assert solution.answers["T"].value is None
    assert "c strikes at t = 0.451524 s and bounces: ask c strikes" in "\n".join(solution.conditions)


FALLING = """
gravity: [0, -9.81, 0]
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, b: {mass: 1}}
joints: {s: {type: prismatic, parent: ground, child: b, axis: y, q: y, initial: {u: -2}}}
"""
AT_THE_START = {
    "c": FALLING + "contacts: {c: {between: [b, ground.floor], restitution: E}}\n",
    "s.lower": FALLING.replace("{u: -2}", "{u: -2}, limits: {lower: 0, restitution: E}"),
}


@pytest.mark.parametrize("name", AT_THE_START)
def test_what_strikes_at_the_start_is_asked_when_it_strikes_again(name: str) -> None:
    """It rises with e v = 1 m/s, comes back after 2 e v/g with that speed, and is (e v)^2/(2 g) high meanwhile."""
    asked = f"ask: {{T: {name} strikes, v: {{value: u_y, when: {name} strikes}}, w: {{of: b, at: {name} strikes}}, "
    asked += f"top: {{max: y, until: {name} strikes}}}}"
    answers = mbs.solve(mbs.loads(HEAD + AT_THE_START[name].replace("E", "0.5") + asked)).answers
    assert answers["T"].value == pytest.approx(2 * 1.0 / G, rel=1e-10)
    assert [answers[x].value for x in "vw"] == pytest.approx([-1.0, 1.0], rel=1e-10)
    assert answers["top"].value == pytest.approx(1.0 / (2 * G), rel=1e-9)


@pytest.mark.parametrize("name", AT_THE_START)
def test_what_strikes_at_the_start_alone_is_told(name: str) -> None:
    asked = f"ask: {{T: {name} strikes, v: {{value: u_y, when: {name} strikes}}, w: {{of: b, at: {name} strikes}}}}"
    solution = mbs.solve(mbs.loads(HEAD + AT_THE_START[name].replace("E", "0") + asked))
    assert [solution.answers[x].value for x in "Tvw"] == [None, None, None]
    said = f"{name} strikes at the start, and not again before t_end of the simulation"
    assert [f"{x}: {said}" for x in "Tvw"] == [x for x in solution.conditions if said in x]


def test_a_table_that_throws_a_block_at_the_start_strikes_it_again() -> None:
    """The table A sin(w t) leaves with A w = 0.85 m/s, the block with (1 + e) A w on its parabola."""
    model = f"""
gravity: [0, -{G}, 0]
bodies: {{table: {{mass: 0, surfaces: {{top: {{plane: [0, 0, 0], normal: y}}}}}}, b: {{mass: 1}}}}
joints:
  T: {{type: prismatic, parent: ground, child: table, axis: y, motion: 0.05*sin(17*t)}}
  J: {{type: prismatic, parent: ground, child: b, axis: y, q: y}}
contacts: {{c: {{between: [b, table.top], restitution: 0.4}}}}
ask: {{T: c strikes}}
"""

    def gap(t: float) -> float:
        return 1.4 * 0.85 * t - G * t * t / 2 - 0.05 * math.sin(17 * t)

    low, high = 0.2, 0.3
    assert gap(low) > 0.0 > gap(high)
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if gap(middle) > 0.0 else (low, middle)
    assert mbs.solve(mbs.loads(HEAD + model)).answers["T"].value == pytest.approx(low, rel=1e-9)


def test_what_an_impact_makes_true_is_found() -> None:
    """The ball rises with e v from the impact on; at y = 0.2 it was before, on its way down."""
    asked = "ask: {up: u_y > 0, v: {value: u_y, when: u_y > 1}, turns: {y: 0.2}, top: {max: y, after: 0.5 s}}"
    answers = mbs.solve(ball(asked)).answers
    assert answers["up"].value == pytest.approx(HIT, rel=1e-10)
    assert answers["v"].value == pytest.approx(E * SPEED, rel=1e-9)
    assert answers["turns"].value == pytest.approx(math.sqrt(2 * (H - 0.2) / G), rel=1e-9)
    assert answers["top"].value == pytest.approx(E**2 * H, rel=1e-9)


@BACKENDS
@pytest.mark.parametrize(("condition", "speed"), [("u_y > 0", E * SPEED), ("c strikes", -SPEED), ("y < 0", -SPEED)])
def test_a_run_stops_at_an_impact(backend: Any, condition: str, speed: float) -> None:
    run = mbs.simulate(ball(f"stop: {{end: {condition}}}"), backend=backend, samples=7)
    assert run.stop is not None
    assert run.stop["element"] == "end"
    assert run.t[-1] == run.t_final == pytest.approx(HIT, rel=1e-9)
    assert run["u_y"][-1] == run.final["speeds"]["u_y"] == pytest.approx(speed, rel=1e-8)
    assert len(run["u_y"]) == len(run.t) == 3
    assert run.energy_residual == pytest.approx(0.0, abs=1e-10)


@BACKENDS
def test_a_comparison_that_no_impact_makes_true_goes_on(backend: Any) -> None:
    """Impacts let it rise with e v at most, and no rounding of them moves a ball that flies level beside it."""
    model = (HEAD + BALL).replace("{mass: 2}", "{mass: 2}, c: {mass: 1}")
    model = model.replace("{q: 1.0}}}", "{q: 1.0}}, l: {type: point, parent: ground, child: c, q: [X, Y]}}")
    model += f"forces: {{weight: {{type: force, on: c, value: [0, {G}, 0]}}}}\n"
    run = mbs.simulate(mbs.loads(model + "stop: {a: u_y > 3.6, b: y > 1.1, c: u_Y > 0, d: u_Y < 0}"), backend=backend)
    assert run.stop is None
    assert len(run.events) == 3


@BACKENDS
def test_a_force_that_jumps_as_friction_turns_stops_a_run(backend: Any) -> None:
    """A block that slides up a slope of 45 degrees against friction turns after v/(g (sin + mu cos)): the force is
    mu m g cos the other way at once, and passes zero nowhere on the way."""
    model = f"""
gravity: [0, -{G}, 0]
bodies: {{ground: {{frames: {{f: {{rotate: [{{axis: z, angle: 45 deg}}]}}}}}}, b: {{mass: 2}}}}
joints: {{J: {{type: prismatic, parent: ground.f, child: b, axis: x, q: x, initial: {{u: 3}}}}}}
forces: {{rub: {{type: friction, joint: J, static: 0.2}}}}
outputs: {{F: "reaction(J, fx)"}}
stop: {{turned: F > 0.5}}
simulation: {{t_end: 2 s}}
"""
    run = mbs.simulate(mbs.loads(HEAD + model), backend=backend)
    assert run.stop is not None
    assert run.t_final == pytest.approx(3 / (G * (1 + 0.2) / math.sqrt(2)), rel=1e-9)
    assert run["F"][-1] == pytest.approx(0.2 * 2 * G / math.sqrt(2), rel=1e-9)
