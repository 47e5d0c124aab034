"""Stretches of a run in fine samples: each part between kinks has as many as its own steps ask for."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.motion.loop.integrate import Integration, integrate
from multibody_sym.motion.loop.problem import Problem
from multibody_sym.motion.results import integrals
from multibody_sym.motion.switching.mode_run import ModeRun

PUSHED = """\
multibody_sym: 1
name: pushed to and fro
gravity: [0, -9.81, 0]
bodies:
  block: {mass: 1}
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
joints: {J: {type: point, parent: ground, child: block, q: [x, y], initial: {u: [50, 0]}}}
forces: {F: {type: force, on: block, value: ["sign(sin(50*t))", 0, 0]}}
contacts: {c: {between: [block, ground.floor], static: 0.3, kinetic: 0.3}}
"""


def test_parts_between_kinks_have_steps_of_their_own() -> None:
    run = mbs.simulate(mbs.loads(PUSHED), t_end=2.0)
    assert isinstance(run.modes, ModeRun)
    (stretch,) = run.modes.along
    parts = list(stretch.smooth_parts())
    assert len(parts) == 32
    assert max(part.steps for part in parts) < stretch.steps / 4
    worked = run.modes.account.loads + sum(work.total for work in run.modes.account.friction.values())
    assert 0.5 * run["u_x"][-1] ** 2 - 1250 == pytest.approx(worked, rel=1e-9)


def test_an_account_of_many_kinks_takes_a_few_times_the_steps_of_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a force with 1,909 kinks, some of them later than a second, beside which 1e-12 of a short part is rounding."""
    steps = 0

    def counted(problem: Problem) -> Integration:
        nonlocal steps
        run = integrate(problem)
        steps += run.statistics.steps
        return run

    monkeypatch.setattr(integrals, "integrate", counted)
    run = mbs.simulate(mbs.loads(PUSHED.replace("50*t", "3000*t")), t_end=2.0)
    assert isinstance(run.modes, ModeRun)
    assert abs(run.energy_residual) < 1e-9 * 1250
    assert steps < 5 * run.statistics["steps"]
