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


def test_a_crate_that_slides_rests_once_it_rocks_unseen_from_corner_to_corner() -> None:
    """Corners that rest rebound as others strike. Friction takes mu times all momentum that the floor gives, m g t too.

    It slides with 1.4 m/s and turns slowly, so that its corners slip in directions up to 4 degrees apart.
    """
    began, sinks = (-1.4446, 0.094632), 0.0011259
    turned = "0.998644, -3.6995e-9, -7.0977e-8, -0.052052"
    start = f"q: [0, 0, 0.243921, {turned}], u: [{began[0]}, {began[1]}, {-sinks}, -4.065e-8, 0.0054583, -0.28599]"
    text = CRATE.replace("q: [0, 0, 1.15, 1, 0, 0, 0]", start)
    text = text.replace("0.4, 0.2, 0.3", "0.41254773, 0.5486069, 0.487842845")
    text = text.replace("static: 0.3, kinetic: 0.3, restitution: 0.5", "static: 0.1, kinetic: 0.1, restitution: 0.3")
    run = mbs.simulate(mbs.loads(text), t_end=0.002)
    assert run.u[-1][2:5] == pytest.approx([0, 0, 0], abs=1e-12)
    assert run.q[-1][2:6] == pytest.approx([0.2439214225, run.q[-1][3], 0, 0], abs=1e-12)
    assert math.dist(run.u[-1][:2], began) == pytest.approx(0.1 * (9.81 * 0.002 + sinks), rel=5e-3)
    assert (run.energy[1:] - run.energy[:-1]).max() < 1e-13
