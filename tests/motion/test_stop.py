"""Conditions that stop a run: when, where the state then is, and what the user is told."""

from __future__ import annotations

import numpy as np
import pytest

import multibody_sym as mbs
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
LOOPS = pytest.mark.parametrize("backend", ["c", "python"])


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
    from multibody_sym.motion.prepare.problem import structure_key

    plain = structure_key(mechanism(mbs.loads(THROWN)), "composite_body")
    other = mbs.loads(THROWN.replace("z < floor", "z < floor - 1"))
    assert structure_key(mechanism(other), "composite_body") != plain


def test_joined_conditions_choose_a_force_in_every_route() -> None:
    force = "where(z < 2, 1, 0)"
    joined = mbs.loads(THROWN.replace(force, "where(z < 2 and z > 1 or t < 0, 1, 0)"))
    nested = mbs.loads(THROWN.replace(force, "where(z < 2, where(z > 1, 1, 0), 0)"))
    assert mbs.loads(mbs.dumps(joined)) == joined
    runs = [mbs.simulate(system, t_end=1.1, backend="python") for system in (joined, nested)]
    np.testing.assert_allclose(runs[0]["z"], runs[1]["z"], atol=1e-12)
    assert "z < 2" in str(mbs.derive(joined)) or "2 > z" in str(mbs.derive(joined))
