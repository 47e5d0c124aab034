"""Runs of systems that are driven by prescribed motion: what comes out, and what is not called drift."""

from __future__ import annotations

import math

import numpy as np
import pytest

from multibody_sym.analysis.check import check
from multibody_sym.documents.runs import run_summary
from multibody_sym.model.bodies import Body, GroundMotion
from multibody_sym.model.joints import Fixed, Initial, Prismatic, Revolute
from multibody_sym.model.system import System
from multibody_sym.motion.simulate import simulate


def lift(**joints: object) -> System:
    bodies = {"ground": Body(motion=GroundMotion(y="0.6*t^2 - t")), "scale": Body(), "person": Body(mass=70)}
    outputs = {"weight": "reaction(feet, fy)", "height": "position(person, y)", "pull": "reaction(ground, fy)"}
    return System(
        "lift",
        gravity=[0, -9.81, 0],
        bodies={**bodies, **({"ball": Body(mass=2, com=[0, -0.5, 0])} if joints else {})},
        joints={"floor": Fixed("ground", "scale"), "feet": Fixed("scale", "person"), **joints},
        outputs=outputs,
    )


@pytest.mark.parametrize("backend", ["c", "python"])
def test_scale_in_a_lift_reads_what_the_lift_makes_of_the_weight(backend: str) -> None:
    run = simulate(lift(), t_end=2, samples=5, backend=backend)
    np.testing.assert_allclose(run["weight"], 70 * (9.81 + 1.2), rtol=1e-14)
    np.testing.assert_allclose(run["height"], 0.6 * run.t**2 - run.t, atol=1e-14)
    assert run.t_final == 2.0
    assert run.statistics["steps"] == 0


def test_work_of_the_lift_is_not_called_drift() -> None:
    run = simulate(lift(A=Revolute("person", "ball", initial=Initial(q=1))), t_end=1, samples=11)
    assert math.isnan(run.drift["energy"])
    assert run.as_json()["drift"]["energy"] is None
    assert "prescribed motion (ground) does work" in run_summary(run)
    assert "it changed by" not in run_summary(run)


def test_theorems_and_formalisms_agree_in_a_lift() -> None:
    report = check(lift(A=Prismatic("person", "ball", axis="x")))
    assert report.agrees
    assert report.hints == ()


def test_without_freedom_and_drive_nothing_can_move() -> None:
    system = System("s", bodies={"a": Body(mass=1)}, joints={"A": Revolute("ground", "a", motion=2)})
    with pytest.raises(Exception, match="nothing can move"):
        simulate(system)
