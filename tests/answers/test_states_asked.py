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


def test_states_are_written_back() -> None:
    system = thrown("stop: {rests: c1 sticks}\nask: {turn: c1 sticks, speed: {of: block, at: c1 slides}}")
    again = mbs.loads(mbs.dumps(system))
    assert (again.stop, again.ask) == (system.stop, system.ask)


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
