"""What is unique: `check`, `solve`, runs and figures have one judgement, by what multipliers exert beyond rounding."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.analysis.check import check

EXAMPLES = Path(__file__).parents[2] / "examples"
ROLLING_WITH_ARM = """
multibody_sym: 1
name: rolling_with_arm
gravity: [0, -g, 0]
parameters:
  g: {value: 9.81 m/s^2, positive: true}
  m: {value: 2 kg, positive: true}
  r: {value: 0.2 m, positive: true}
  R: {value: 0.5 m, positive: true}
  theta0: {value: 20 deg, positive: true}
bodies:
  ground: {surfaces: {drum: {disc: R, axis: z}}}
  arm: {points: {end: [0, R + r, 0]}}
  disc: {shape: {disc: r, mass: m}, surfaces: {rim: {disc: r, axis: z}}}
joints:
  centre: {type: revolute, parent: ground, child: arm, axis: -z, q: theta, initial: {q: theta0, known: true}}
  spin: {type: revolute, parent: arm.end, child: disc, axis: -z, q: psi}
constraints:
  rolls: {type: rolling, body: disc.rim, on: ground.drum}
ask: {friction: "multiplier(rolls.t1)", arm: "reaction(spin, fx)"}
"""


def open_components(solution: mbs.Solution) -> set[tuple[str, str]]:
    """Return the elements and components of forces without a value, rows of constraints by their own names."""
    named = {(name, part) for name, parts in solution.reactions.items() for part, x in parts.items() if not x.unique}
    return {(name, "" if part in ("tension", "multiplier") else part) for name, part in named}


@pytest.mark.parametrize("name", ["", "guides/rolling_ellipse.yaml", "two_wheeled_cart.yaml", "four_bar.yaml"])
def test_check_solve_and_runs_name_the_same_forces(name: str) -> None:
    system = mbs.load(EXAMPLES / name) if name else mbs.loads(ROLLING_WITH_ARM)
    checked = check(system).ambiguous
    told = {(element, part) for element, parts in checked.items() for part in parts or ("",)}
    assert told == open_components(mbs.solve(system))
    assert dict(mbs.simulate(system, t_end=0.01, samples=2).redundancy.ambiguous) == dict(checked)


def test_friction_of_a_disc_on_a_disc_with_an_arm_is_unique() -> None:
    """By the disc's own equation of moments about its centre: F r = I (theta'' + psi''); the arm has no mass."""
    g, m, r, R, theta0 = 9.81, 2.0, 0.2, 0.5, np.radians(20)
    found = mbs.solve(mbs.loads(ROLLING_WITH_ARM))
    turning = sum(value.value or 0.0 for value in found.accelerations.values())
    friction = found.reactions["rolls.t1"]["tension"]
    assert abs(friction.value or 0.0) == pytest.approx(m * r**2 / 2 * turning / r, rel=1e-12)
    assert abs(friction.value or 0.0) == pytest.approx(m * g * np.sin(theta0) / 3, rel=1e-12)
    assert turning == pytest.approx(2 * g * np.sin(theta0) / (3 * (R + r)) * (1 + R / r), rel=1e-12)
    assert found.answers["friction"].value == friction.value
    assert (found.answers["arm"].value, found.answers["arm"].unique) == (0.0, True)
