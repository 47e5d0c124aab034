"""Conditions that stop a run: when, where the state then is, and what the user is told."""

from __future__ import annotations

import math

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.documents.runs import run_summary
from multibody_sym.text.tables import write_table

THROWN = """
multibody_sym: 1
name: thrown
gravity: [0, 0, -g]
parameters: {g: 10, floor: 0}
bodies: {ball: {mass: 1}}
joints: {fly: {type: prismatic, parent: ground, child: ball, axis: z, q: z, initial: {q: 5, u: 2}}}
forces: {wind: {type: force, on: ball, value: [0, 0, "where(z < 2, 1, 0)"]}}
stop: {high: z > 6, fall: z < floor}
"""
# From 5 m at 2 m/s the ball is at 2 m, at -8 m/s, after 1 s; from there a = -9 m/s^2 takes it down in 2/9 s.
FALL = 11 / 9
SWING = """
multibody_sym: 1
name: swing
gravity: [0, -10, 0]
bodies: {bob: {mass: 1, com: [0, -1, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta, initial: {q: 0.5}}}
stop: {light: "reaction(hinge, fy) < limit"}
parameters: {limit: 8}
"""
LOOPS = pytest.mark.parametrize("backend", ["c", "python"])
METHODS = pytest.mark.parametrize(
    ("method", "step"), [("dormand_prince", None), ("dormand_prince_8", None), ("rk4", 0.01), ("stoermer_6", 0.01)]
)


@LOOPS
@METHODS
def test_a_run_ends_where_its_stop_holds(backend: str, method: str, step: float | None) -> None:
    run = mbs.simulate(mbs.loads(THROWN), t_end=10, method=method, step=step, samples=101, backend=backend)
    assert run.t_final == run.t[-1] == pytest.approx(FALL, abs=1e-12)
    assert run["z"][-1] == pytest.approx(0.0, abs=1e-12)
    assert run["u_z"][-1] == pytest.approx(-10.0, abs=1e-12)
    assert run.events == [{"t": run.t_final, "kind": "stop", "element": "fall"}]
    np.testing.assert_allclose(run.t[:-1], np.arange(13) / 10, atol=1e-12)
    assert run.final["t"] == run.t_final
    assert f"stopped by 'fall' at t = {run.t_final:g} s of 10 s, 14 samples" in run_summary(run)


@LOOPS
@pytest.mark.parametrize(("method", "step"), [("dormand_prince", None), ("radau_5", None), ("rk4", 1.25)])
def test_a_stop_that_is_true_for_a_part_of_a_step_ends_the_run(backend: str, method: str, step: float | None) -> None:
    """The way of a thrown ball is exact in one long step: at its ends the ball is below, between them above."""
    model = THROWN.replace("{q: 5, u: 2}", "{q: 0, u: 10}").replace("z > 6, fall: z < floor", "z > 4.5")
    model = model.replace("where(z < 2, 1, 0)", "0")
    run = mbs.simulate(mbs.loads(model), t_end=10, method=method, step=step, backend=backend)
    assert run.t_final == pytest.approx(1 - math.sqrt(0.1), abs=1e-12)
    assert [event["element"] for event in run.events] == ["high"]


@LOOPS
@pytest.mark.parametrize(("method", "step"), [("dormand_prince", None), ("radau_5", None), ("rk4", 1.25)])
def test_a_stop_that_is_true_for_a_moment_ends_the_run(backend: str, method: str, step: float | None) -> None:
    """The ball comes to 5 m after 1 s, and is above 4.99999 m for 2.8 ms of steps of a second and more."""
    model = THROWN.replace("{q: 5, u: 2}", "{q: 0, u: 10}").replace("z > 6, fall: z < floor", "z > 4.99999")
    model = model.replace("where(z < 2, 1, 0)", "0")
    run = mbs.simulate(mbs.loads(model), t_end=10, method=method, step=step, backend=backend)
    assert run.t_final == pytest.approx(1 - math.sqrt(2e-6), abs=1e-9)


def test_what_is_asked_of_the_end_is_asked_of_the_stop(tmp_path) -> None:
    run = mbs.simulate(mbs.loads(THROWN), t_end=10, samples=11, parameters={"floor": 5})
    assert run.t_final == pytest.approx(0.4, abs=1e-12)
    assert run.as_json()["events"] == run.events
    write_table(run.table(), str(tmp_path / "thrown.csv"))
    *_, last = (tmp_path / "thrown.csv").read_text().splitlines()
    assert float(last.split(",")[0]) == run.t_final


def test_a_stop_at_a_sample_makes_no_second_row() -> None:
    run = mbs.simulate(mbs.loads(THROWN), t_end=FALL, samples=12)
    assert len(run) == 12
    assert run.t[-1] == pytest.approx(FALL)


@LOOPS
def test_a_stop_that_holds_at_the_start_ends_the_run_at_once(backend: str) -> None:
    run = mbs.simulate(mbs.loads(THROWN), t_end=10, parameters={"floor": 6}, backend=backend)
    assert run.events == [{"t": 0.0, "kind": "stop", "element": "fall"}]
    assert (len(run), run.t_final, run["z"][0]) == (1, 0.0, 5.0)
    assert "the condition of stop 'fall' holds at the start" in run_summary(run)


def test_a_run_whose_stops_never_hold_ends_at_t_end() -> None:
    run = mbs.simulate(mbs.loads(THROWN), t_end=1.2, samples=11)
    assert (run.stop, run.events, run.t_final) == (None, [], 1.2)
    assert run["z"].max() > 5.19


def test_a_reaction_can_stop_a_run() -> None:
    """With c = cos(theta) the rod pulls with 10 (3 c - 2 cos(0.5)), c times that upward, as energy is conserved."""
    run = mbs.simulate(mbs.loads(SWING), t_end=10, parameters={"limit": 7}, rtol=1e-11)
    assert run.stop is None  # at least 10 cos(0.5)^2 = 7.7
    run = mbs.simulate(mbs.loads(SWING.replace("< limit", "> limit")), t_end=10, parameters={"limit": 9}, rtol=1e-11)
    c = math.cos(run.final["coordinates"]["theta"])
    assert 10 * (3 * c**2 - 2 * math.cos(0.5) * c) == pytest.approx(9, abs=1e-8)


BLOCK = """
multibody_sym: 1
name: block
parameters: {mu: 0.3}
bodies: {block: {mass: 1}}
joints: {slide: {type: prismatic, parent: ground, child: block, axis: x, q: x, initial: {u: 2}}}
forces: {friction: {type: force, on: block, value: ["-mu*9.81*sign(u_x)", 0, 0]}}
"""


@LOOPS
def test_dry_friction_in_fixed_steps_comes_to_rest_and_on(backend: str) -> None:
    """It stops after u^2 / (2 mu g); at rest its direction changes within a step, which must not hold up the run."""
    run = mbs.simulate(mbs.loads(BLOCK), t_end=2, method="rk4", step=0.01, samples=21, backend=backend)
    assert run.t_final == 2
    assert run.statistics["steps"] < 1000
    assert run["x"][-1] == pytest.approx(4 / (2 * 0.3 * 9.81), abs=0.02)  # it trembles
    assert np.abs(run["u_x"][8:]).max() < 0.3 * 9.81 * 0.011


def test_adaptive_steps_that_get_nowhere_end_the_run() -> None:
    """Dry friction by the sign of the speed has no motion at rest that an adaptive method could follow."""
    with pytest.raises(mbs.RunError, match=r"no further than t = 0\.\d+ s: a force jumps where u_x") as caught:
        mbs.simulate(mbs.loads(BLOCK), t_end=2, samples=21, backend="c")
    assert caught.value.trajectory["x"][-1] == pytest.approx(4 / (2 * 0.3 * 9.81), abs=0.1)


def test_another_stop_is_another_structure() -> None:
    from multibody_sym.mechanics.resolve import mechanism
    from multibody_sym.motion.prepare.programs import structure_key

    plain = structure_key(mechanism(mbs.loads(THROWN)), "composite_body")
    other = mbs.loads(THROWN.replace("z < floor", "z < floor - 1"))
    assert structure_key(mechanism(other), "composite_body") != plain


@LOOPS
@pytest.mark.parametrize(
    ("condition", "end"),
    [("z < 2 and u_z < -9", 1 + 1 / 9), ("z < 2 or u_z < -9", 1.0), ("u_z < 0 and (z < 2 or z > 6)", 1.0)],
)
def test_conditions_are_joined_by_and_and_or(backend: str, condition: str, end: float) -> None:
    model = THROWN.replace("{high: z > 6, fall: z < floor}", f"{{it: {condition}}}")
    run = mbs.simulate(mbs.loads(model), t_end=10, backend=backend)
    assert run.t_final == pytest.approx(end, abs=1e-12)


def test_joined_conditions_choose_a_force_in_every_route() -> None:
    force = "where(z < 2, 1, 0)"
    joined = mbs.loads(THROWN.replace(force, "where(z < 2 and z > 1 or t < 0, 1, 0)"))
    nested = mbs.loads(THROWN.replace(force, "where(z < 2, where(z > 1, 1, 0), 0)"))
    assert mbs.loads(mbs.dumps(joined)) == joined
    runs = [mbs.simulate(system, t_end=1.1, backend="python") for system in (joined, nested)]
    np.testing.assert_allclose(runs[0]["z"], runs[1]["z"], atol=1e-12)
    assert "z < 2" in str(mbs.derive(joined)) or "2 > z" in str(mbs.derive(joined))


@pytest.mark.parametrize("condition", ["z and u_z < 1", "z < 1 and 2", "not z < 1", "z < 1 and", "z < 1 or u_z + 1"])
def test_what_is_no_condition_cannot_be_joined(condition: str) -> None:
    with pytest.raises(mbs.InputError):
        mbs.loads(THROWN.replace("{high: z > 6, fall: z < floor}", f"{{it: {condition}}}"))


PRESCRIBED = """
multibody_sym: 1
name: prescribed
gravity: [0, -10, 0]
parameters: {w: 2}
bodies: {bob: {mass: 3, com: [0, -1, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, motion: w*t}}
stop: {heavy: "reaction(hinge, fy) < 26", round: t > 2.5}
"""


@LOOPS
@pytest.mark.parametrize("samples", [2, 101, 4001])
def test_a_stop_ends_a_run_in_which_every_motion_is_prescribed(backend: str, samples: int) -> None:
    """The hinge carries m g + m w^2 cos(w t) upward, from 42 N to 18 N and back."""
    run = mbs.simulate(mbs.loads(PRESCRIBED), t_end=10, samples=samples, backend=backend)
    met = math.acos(-1 / 3) / 2
    assert run.t_final == run.t[-1] == pytest.approx(met, abs=1e-12)
    assert run.events == [{"t": run.t_final, "kind": "stop", "element": "heavy"}]
    np.testing.assert_allclose(run.t[:-1], np.linspace(0, 10, samples)[: math.floor(met / 10 * (samples - 1)) + 1])
    assert f"stopped by 'heavy' at t = {run.t_final:g} s of 10 s" in run_summary(run)


def test_a_stop_of_a_prescribed_motion_may_be_short_late_or_never() -> None:
    """Below 18.003 N it is for 0.022 s about pi/2; a stop at a sample makes no second row."""
    short = mbs.loads(PRESCRIBED.replace("< 26", "< 18.003"))
    met = math.acos(-1 + 0.003 / 12) / 2
    assert mbs.simulate(short, t_end=10, samples=2, backend="python").t_final == pytest.approx(met, abs=1e-9)
    late = mbs.loads(PRESCRIBED.replace("< 26", "< 17"))
    run = mbs.simulate(late, t_end=10, samples=9, backend="python")
    assert run.t.tolist() == pytest.approx([0, 1.25, 2.5], abs=1e-12)
    assert run.stop == {"t": run.t_final, "kind": "stop", "element": "round"}
    never = mbs.simulate(late, t_end=2, samples=9, backend="python")
    assert (never.stop, never.t_final, len(never)) == (None, 2, 9)
