"""Boxes that are dropped flat in space, with friction at all corners: how they bounce, and that no run goes on without
an impact that could not be solved."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.impacts.problem import ImpactProblem
from multibody_sym.errors import NoSolutionError
from multibody_sym.simulation.failures import FailedRunError

CRATE = """\
multibody_sym: 1
name: crate
gravity: [0, 0, -9.81]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  crate: {shape: {box: [0.4, 0.2, 0.3], mass: 2 kg}}
joints: {J: {type: free, parent: ground, child: crate, initial: {q: [0, 0, 1.15, 1, 0, 0, 0]}}}
contacts: {c: {between: [crate, ground.floor], static: 0.3, kinetic: 0.3, restitution: 0.5}}
"""


@pytest.fixture(scope="module")
def crate() -> mbs.Mechanism:
    return mbs.loads(CRATE)


def test_bounces_end_when_the_closed_form_says_and_the_box_rests_to_the_last_bit(crate: mbs.Mechanism) -> None:
    end = math.sqrt(2 * 1.0 / 9.81) * (1 + 0.5) / (1 - 0.5)
    run = mbs.simulate(crate, t_end=2.0)
    rests = [event["t"] for event in run.events if event["kind"] == "stick"]
    assert len(rests) == 4
    assert rests == pytest.approx([end] * 4, rel=1e-8)
    resting = run.t > end + 1e-6
    assert not run.u[resting].any()
    assert not (run.q[resting] - run.q[-1]).any()
    assert run.q[-1] == pytest.approx([0, 0, 0.15, 1, 0, 0, 0], abs=1e-8)


def test_a_run_whose_impact_cannot_be_solved_stops_and_says_so(
    crate: mbs.Mechanism, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nothing(problem: ImpactProblem) -> None:
        raise NoSolutionError("no impulses fulfil the laws of the impact at c.corner1", number="N108")

    monkeypatch.setattr("multibody_sym.dynamics.impacts.strike.strike", nothing)
    why = r"the impact cannot be solved: no impulses fulfil the laws of the impact at c\.corner1"
    with pytest.raises(FailedRunError, match=f"{why} at t = {math.sqrt(2 / 9.81):.6g} s"):
        mbs.simulate(crate, t_end=2.0)
    with pytest.raises(NoSolutionError, match=f"{why} at the start"):
        mbs.simulate(crate, t_end=2.0, initial={"J_z": 0.15, "u_J_z": -1.0})
