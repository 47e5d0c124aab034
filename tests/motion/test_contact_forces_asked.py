"""Forces of contacts as outputs and answers: normal, friction, those of a box's corners together, of what rolls."""

from __future__ import annotations

from math import cos, radians, sin

import numpy as np
import pytest

import multibody_sym as mbs

G, MU, A, M = 9.81, 0.3, radians(30), 2.0
THROWN = """
multibody_sym: 1
name: thrown_up
gravity: [0, -g, 0]
parameters: {g: 9.81, m: 2 kg, mu: 0.3, v0: 5 m/s, alpha: 30 deg}
bodies:
  ground:
    frames: {incline: {rotate: [{axis: z, angle: alpha}]}}
    surfaces: {face: {plane: [0, 0, 0], normal: [-sin(alpha), cos(alpha), 0]}}
  block: {mass: m}
joints: {block: {type: point, parent: ground.incline, child: block, q: [s, n], initial: {u: [v0, 0]}}}
contacts: {c: {between: [block, ground.face], kinetic: mu}}
outputs: {N: "reaction(c, normal)", F: "reaction(c, friction)"}
ask: {N: "reaction(c, normal)", F: "reaction(c, friction)", most: {max: "reaction(c, friction)"}}
simulation: {t_end: 1.5 s}
"""


@pytest.mark.parametrize("backend", ["c", "python"])
def test_normal_force_and_friction_along_a_run(backend: str) -> None:
    run = mbs.simulate(mbs.loads(THROWN), samples=31, backend=backend)
    rises = run.t < 5 / (G * (sin(A) + MU * cos(A)))
    normal = M * G * cos(A)
    assert run.outputs["N"] == pytest.approx(np.full(31, normal), rel=1e-9)
    assert run.outputs["F"] == pytest.approx(np.where(rises, -MU * normal, MU * normal), rel=1e-9)
    assert run.output_units == {"N": "N", "F": "N"}


def test_they_are_asked_of_solve_with_their_formulas() -> None:
    answers = mbs.solve(mbs.loads(THROWN)).answers
    assert str(answers["N"]).startswith("g*m*cos(alpha) = ")
    assert str(answers["F"]).startswith("-g*m*mu*cos(alpha) = ")
    assert answers["most"].value == pytest.approx(MU * M * G * cos(A), rel=1e-9)


def test_corners_of_a_box_are_told_together_and_what_is_open_exerts_nothing() -> None:
    model = """
multibody_sym: 1
name: box
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  box: {shape: {box: [1, 0.5, 1], mass: 3}}
joints: {j: {type: planar, parent: ground, child: box, q: [x, y, phi], initial: {q: [0, 0.45, 0]}}}
contacts: {c: {between: [box, ground.floor], static: 0.5, kinetic: 0.4, open: true}}
outputs: {N: "reaction(c, normal)"}
simulation: {t_end: 0.5 s}
"""
    run = mbs.simulate(mbs.loads(model), samples=6)
    lands = (2 * 0.2 / 9.81) ** 0.5
    assert run.outputs["N"] == pytest.approx(np.where(run.t < lands, 0.0, 3 * 9.81), rel=1e-9)


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ("reaction(c, fx)", "'c' is a contact, which has normal, friction"),
        ("reaction(block, normal)", "'block' is a joint, which has fx, fy"),
        ("reaction(d, normal)", "'d' is no joint, contact, stop or friction"),
    ],
)
def test_components_are_those_of_the_element(asked: str, message: str) -> None:
    with pytest.raises(mbs.InputError, match=message):
        mbs.solve(mbs.loads(THROWN.replace('{N: "reaction(c, normal)", F', f'{{N: "{asked}", F')))
