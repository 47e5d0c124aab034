"""A force that jumps with a speed has no value at rest: a run that comes to rest says so as soon as that shows."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs
from multibody_sym.motion.prepare import problem
from multibody_sym.motion.runs.run import FailedRunError

SLIDER = """
multibody_sym: 1
name: slider
bodies: {block: {mass: 2}}
joints: {D: {type: prismatic, parent: ground, child: block, axis: x, q: x, initial: {q: 0.6}}}
forces:
  spring: {type: spring_damper, joint: D, stiffness: 50}
  rub: {type: force, on: block, value: ["-F*sign(u_x)", 0, 0]}
parameters: {F: 3}
"""


@pytest.mark.parametrize("backend", ["c", "python"])
def test_a_sign_of_a_speed_at_rest_is_answered_at_once(backend) -> None:
    """Each half swing ends 2 F/k = 0.16 m nearer: after four of them the spring pulls with less than F."""
    with pytest.raises(FailedRunError, match=r"gets no further.*u_x changes its sign.*type: friction, joint: D") as met:
        mbs.simulate(mbs.loads(SLIDER), t_end=10.0, backend=backend, parameters={"F": 4})
    run = met.value.trajectory
    assert run.statistics["steps"] < 5000
    assert run.t_final == pytest.approx(4 * math.pi / 5, rel=1e-5)
    assert run.final["coordinates"]["x"] == pytest.approx(0.6 - 4 * 0.16, abs=1e-6)


def test_a_sign_of_a_speed_that_does_not_rest_is_a_force_as_others_are() -> None:
    run = mbs.simulate(mbs.loads(SLIDER), t_end=2.5, rtol=1e-10)
    assert run["x"][-1] == pytest.approx(-0.06 - 0.18 * math.cos(5 * (2.5 - 3 * math.pi / 5)), abs=1e-8)


def test_a_force_with_a_kink_in_a_speed_does_not_jump(monkeypatch: pytest.MonkeyPatch) -> None:
    """A stiff spring keeps the steps short, and beside it acts a table of the speed, which is continuous."""
    monkeypatch.setattr(problem, "_MOST_STEPS", 500)
    text = SLIDER.replace("stiffness: 50", "stiffness: 5e9").replace("-F*sign(u_x)", "-w")
    text += "inputs: {w: {table: [[-9, -1], [0, 0], [9, 2]], of: u_x}}\n"
    with pytest.raises(FailedRunError, match=r"largest number of steps.*x is stiff, it swings"):
        mbs.simulate(mbs.loads(text), t_end=10.0)
