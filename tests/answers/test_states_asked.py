"""States that begin, in `stop` and `ask`: when something sticks, slides or opens; paths through changes of state."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from test_solved_modes import HEAD

import multibody_sym as mbs

TEXTBOOK = Path(__file__).parents[2] / "examples" / "textbook"
THROWN = """
parameters: {g: 10 m/s^2, a: 30 deg, mu: 0.9, m: 2 kg, v: 5 m/s}
bodies: {ground: {surfaces: {ramp: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}, block: {mass: m}}
joints: {J: {type: point, parent: ground, child: block, initial: {u: [v*cos(a), v*sin(a)]}}}
contacts: {c1: {between: [block, ground.ramp], static: mu}}
simulation: {t_end: 3 s}
"""
JOINT = "type: planar, parent: ground, child: block, initial: {q: [-0.05*sin(a), 0.05*cos(a), a]}"
UP = 10 * (0.5 + 0.9 * math.sqrt(3) / 2)
"""The deceleration of the block that is thrown up."""


def thrown(rest: str) -> mbs.System:
    return mbs.loads(HEAD + THROWN + rest)


def test_a_run_ends_where_a_state_begins() -> None:
    run = mbs.simulate(thrown("stop: {rests: c1 sticks}"), backend="python")
    assert run.stop == {"t": pytest.approx(5 / UP, rel=1e-9), "kind": "stop", "element": "rests"}
    assert run.final["coordinates"]["J_x"] == pytest.approx(25 / (2 * UP) * math.sqrt(3) / 2, rel=1e-9)


@pytest.mark.parametrize(("name", "stop", "time"), [("growing_force", "slip", 3.0), ("drum_brake", "stands", 5.0)])
def test_textbook_runs_end_where_the_question_ends(name: str, stop: str, time: float) -> None:
    run = mbs.simulate(mbs.load(TEXTBOOK / f"{name}.yaml"), backend="python")
    assert run.stop == {"t": pytest.approx(time, rel=1e-9), "kind": "stop", "element": stop}


def test_states_are_asked_for() -> None:
    asked = "ask: {turn: c1 sticks, speed: {of: block, at: c1 sticks}, way: {of: block, after: 2 s}, off: c1 opens}"
    solution = mbs.solve(thrown(asked))
    answers = {name: value.value for name, value in solution.answers.items()}
    assert answers["turn"] == pytest.approx(5 / UP, rel=1e-9)
    assert answers["speed"] == 0.0
    assert answers["way"] == pytest.approx(25 / (2 * UP), rel=1e-9)
    assert answers["off"] is None
    assert "off: c1 opens at no time before t_end of the simulation" in solution.conditions


def test_a_formula_of_a_path_holds_as_long_as_the_state_does() -> None:
    solution = mbs.solve(thrown("ask: {before: {of: block, after: 0.2 s}, beyond: {of: block, after: 1 s}}"))
    before, beyond = (solution.answers[name] for name in ("before", "beyond"))
    assert before.value == pytest.approx(5 * 0.2 - UP * 0.02, rel=1e-12)
    assert before.expression is not None
    assert beyond.value == pytest.approx(25 / (2 * UP), rel=1e-9)
    assert beyond.expression is None


SLING = """
parameters: {g: 9.81 m/s^2, m: 1.5 kg, l: 0.9 m}
bodies: {p: {mass: m}}
joints: {f: {type: point, parent: ground, child: p, q: [x, y], initial: {q: [0, -l], u: [5 m/s, 0]}}}
constraints: {s: {type: rope, path: [ground, p], length: l, slack: true}}
simulation: {t_end: 1.2 s}
"""


def test_what_holds_at_the_start_begins_when_it_comes_back() -> None:
    """A stone on a string, thrown with 5 m/s, flies free from cos = (v^2/(g l) - 2)/3 above its nail to the circle."""
    g, l = 9.81, 0.9
    rise = (25 / (g * l) - 2) / 3
    v2 = g * l * rise  # m v^2/l = m g cos there; the parabola is at the circle again after 4 v sin/g
    flight = 4 * math.sqrt(v2) * math.sqrt(1 - rise**2) / g
    asked = "ask: {off: s slackens, back: s tautens, at: {value: t, when: s tautens}, flight: back - off}"
    answers = mbs.solve(mbs.loads(HEAD + SLING + asked)).answers
    assert answers["flight"].value == pytest.approx(flight, rel=1e-8)
    assert answers["back"].value == pytest.approx(answers["at"].value, rel=1e-9)
    assert answers["back"].value == pytest.approx(answers["off"].value + flight, rel=1e-8)


def test_what_holds_from_the_start_and_never_begins_is_told() -> None:
    asked = "ask: {back: s tautens, at: {of: p, at: s tautens}, x: {max: x, until: s tautens}, end: {max: x}}"
    model = SLING.replace("t_end: 1.2", "t_end: 0.2") + asked
    solution = mbs.solve(mbs.loads(HEAD + model))
    assert [solution.answers[name].value for name in ("back", "at")] == pytest.approx([0.0, 5.0], rel=1e-12)
    assert solution.answers["x"].value == solution.answers["end"].value
    said = "s tautens from the start on, and does not begin to later, before t_end of the simulation"
    assert [f"{name}: {said}" for name in ("back", "at")] == [x for x in solution.conditions if said in x]


def test_a_body_at_rest_closes_at_the_start() -> None:
    """It has no freedom left, so that no energy tells its speed by its place."""
    model = """
parameters: {g: 9.81 m/s^2}
bodies: {b: {mass: 1}, ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}}
joints: {J: {type: prismatic, parent: ground, child: b, axis: y, q: y}}
contacts: {c: {between: [b, ground.floor]}}
ask: {T: c closes, v: {of: b, at: c closes}}
"""
    answers = mbs.solve(mbs.loads(HEAD + model)).answers
    assert [answers[x].value for x in "Tv"] == [0.0, 0.0]


@pytest.mark.parametrize("section", ["stop: {a: string slackens}", "ask: {a: string slackens}"])
def test_what_has_no_state_is_told(section: str) -> None:
    with pytest.raises(mbs.ModelError, match="'string' is no contact, rope that may slacken, stop or friction"):
        mbs.solve(thrown(section))


def test_a_contact_of_several_parts_names_them() -> None:
    """A box touches with corners, each with its state: it was said to be no contact."""
    model = THROWN.replace("block: {mass: m}", "block: {shape: {box: [0.2, 0.1, 0.1], mass: m}}")
    model = model.replace("type: point, parent: ground, child: block, initial: {u: [v*cos(a), v*sin(a)]}", JOINT)
    with pytest.raises(mbs.ModelError, match=r"'c1' has no state of its own, .* say c1.corner1 opens, or"):
        mbs.solve(mbs.loads(HEAD + model + "ask: {a: c1 opens}"))


@pytest.mark.parametrize("verb", ["rolls", "grips", "tautens", "stops", "frees", "closed", "slip"])
@pytest.mark.parametrize("section", ["stop", "ask"])
def test_states_that_an_element_never_has_are_refused(section: str, verb: str) -> None:
    """A contact sticks or slides, a drum grips or slips."""
    said = f"'c1 {verb}': it has no such state; say c1 sticks or c1 slides or c1 opens"
    with pytest.raises(mbs.ModelError, match=said):
        mbs.solve(thrown(f"{section}: {{a: c1 {verb}}}"))


@pytest.mark.parametrize("section", ["stop: {a: t>1 and c1 sticks}", "ask: {a: {of: block, at: t > 1 or c1 sticks}}"])
def test_states_that_are_joined_with_conditions_are_told_to_stand_alone(section: str) -> None:
    with pytest.raises(mbs.ModelError, match=r"states are not joined with conditions .* such as c1 sticks"):
        mbs.solve(thrown(section))


def test_states_are_written_back() -> None:
    system = thrown("stop: {rests: c1 sticks}\nask: {turn: c1 sticks, speed: {of: block, at: c1 slides}}")
    again = mbs.loads(mbs.dumps(system))
    assert (again.stop, again.ask) == (system.stop, system.ask)


@pytest.mark.parametrize("asked", ["{x: c1 sticks}", "{find: x, when: c1 sticks}"])
def test_a_state_in_no_known_question_is_told_the_forms_that_are_known(asked: str) -> None:
    with pytest.raises(mbs.ModelError, match=r"no known question; ask with .*\{of: body, at.*c sticks \(a state\)"):
        thrown(f"ask: {{turn: {asked}}}")


@pytest.mark.parametrize("omega", [50, 49.95])
def test_a_run_that_a_state_ends_has_that_moment_behind_its_last_sample(omega: float) -> None:
    """The drum loses 10 rad/s a second, told each 0.01 s: the last sample is the moment at which it stands."""
    run = mbs.simulate(mbs.load(TEXTBOOK / "drum_brake.yaml"), parameters={"omega": omega})
    assert run.t[-3:] == pytest.approx([4.98, 4.99, 5.0 if omega == 50 else 4.995], rel=1e-9)
    assert run["phi"] == pytest.approx(omega * run.t - 5 * run.t**2, rel=1e-9)
    assert abs(run["u_phi"][-1]) < 1e-9
    assert run.accelerations["u_phi"] == pytest.approx([-10] * len(run.t), rel=1e-9)


def test_states_are_typed_as_runs_print_them() -> None:
    """Each event of a run, typed as it is printed, ends a run, and is asked for, at its time."""
    run = mbs.simulate(thrown(""))
    assert {event["kind"] for event in run.changes} == {"stick"}
    down = thrown("stop: {s: c1 stick}\nask: {s: c1 stick, down: {value: u_J_x, when: c1 stick}}")
    assert mbs.simulate(down).t_final == pytest.approx(5 / UP, rel=1e-9)
    answers = mbs.solve(down).answers
    assert [answers[name].value for name in ("s", "down")] == pytest.approx([5 / UP, 0.0], rel=1e-9, abs=1e-9)
    assert mbs.dumps(down).count("c1 stick") == 3
    back = mbs.loads(HEAD + THROWN.replace("mu: 0.9", "mu: 0.3") + "ask: {back: c1 slide-}")
    turns = 5 / (10 * (0.5 + 0.3 * math.sqrt(3) / 2))
    assert mbs.solve(back).answers["back"].value == pytest.approx(turns, rel=1e-9)
    pushed = mbs.loads(
        HEAD + "parameters: {g: 10 m/s^2, rate: 12 N/s}\n"
        "bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, block: {mass: 3 kg}}\n"
        "joints: {J: {type: point, parent: ground, child: block}}\n"
        "contacts: {c1: {between: [block, ground.floor], static: 0.4}}\n"
        "forces: {push: {type: force, on: block, value: [rate*t, 0, 0]}}\nask: {s: c1 slips, either_way: c1 slide}"
    )
    for answer in mbs.solve(pushed).answers.values():
        assert answer.value == pytest.approx(0.4 * 3 * 10 / 12, rel=1e-9)
