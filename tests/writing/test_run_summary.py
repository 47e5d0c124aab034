"""What the summary of a run says of energy and of redundant rows."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.writing.check import check_text
from multibody_sym.writing.run_summary import run_summary

SWING = """
multibody_sym: 1
name: swing
gravity: [0, -9.81, 0]
bodies: {{rod: {{mass: 1, com: [0, -1, 0]}}}}
joints: {{A: {{type: revolute, parent: ground, child: rod, axis: z, q: theta, initial: {{q: 1}}}}}}
forces: {{{force}}}
"""


@pytest.mark.parametrize(
    ("force", "told"),
    [
        ("", " J"),
        ("turning: {type: spring, joint: A, stiffness: 3}", " J"),
        ("turning: {type: spring, joint: A, stiffness: 3, damping: 0.5}", " J, the work of turning included"),
        ("turning: {type: spring, joint: A, stiffness: 3 + t}", " J, the work of turning included"),
        ("motor: {type: torque, joint: A, value: 5}", " J, the work of motor included"),
    ],
)
def test_work_of_forces_is_told_beside_the_change_of_energy(force: str, told: str) -> None:
    run = mbs.simulate(mbs.loads(SWING.format(force=force)), t_end=0.5, samples=3, backend="python")
    line = next(line for line in run_summary(run).splitlines() if line.startswith("total energy"))
    number, unit, rest = line.partition("changed by at most ")[2].partition(" J")
    assert unit + rest == told
    assert float(number) > (0.01 if "work" in told else -1.0)


PLANAR = """
multibody_sym: 1
name: planar
bodies:
  ground: {points: {far: [4, 0, 0]}}
  crank: {mass: 1, com: [0.5, 0, 0], points: {end: [1, 0, 0]}}
  rod: {mass: 1, com: [2, 0, 0], points: {end: [4, 0, 0]}}
  rocker: {mass: 1, com: [1, 0, 0], points: {end: [2, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: crank, axis: z, q: a, initial: {q: 80 deg, known: true}}
  B: {type: revolute, parent: crank.end, child: rod, axis: z, q: b, initial: {q: -60 deg}}
  D: {type: revolute, parent: ground.far, child: rocker, axis: z, q: d, initial: {q: 80 deg}}
  C: {type: revolute, parent: rod.end, child: rocker.end, axis: z, cut: true}
"""


def test_the_redundancy_of_a_planar_model_is_two_short_lines() -> None:
    lines = check_text(mbs.check(mbs.loads(PLANAR))).splitlines()
    assert lines[1:3] == [
        "redundant constraints: z rx ry of C (3 rows, against which nothing could move anyway; the motion is unique)",
        "forces that are not unique: fz mx my of A, B, D, C; all others are",
    ]
    assert not any("elasticity" in line for line in lines)
