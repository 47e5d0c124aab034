"""What `solve` found as text, and on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.documents.solution import solution_text
from multibody_sym.text.values import chosen_units

MODEL = """
multibody_sym: 1
name: wedge
gravity: [0, -g, 0]
parameters: {g: 10, m: 2 kg, alpha: 30 deg}
bodies:
  ground: {frames: {face: {rotate: [{axis: z, angle: alpha}]}}}
  block: {mass: m}
joints: {slide: {type: prismatic, parent: ground.face, child: block, axis: -x, q: s}}
ask: {way: {of: block, after: 2 s}, up: {s: -1}}
"""


def test_speeds_that_are_no_coordinate_s_rate_have_one_prime() -> None:
    ball = mbs.System(
        "ball",
        bodies={"b": mbs.Body(mass=1, inertia={"Ixx": 1, "Iyy": 2, "Izz": 3})},
        joints={"joint": mbs.Spherical("ground", "b", initial={"u": [1, 1, 0]})},
    )
    assert "joint_wz' = -1/3 = -0.333333 rad/s^2" in solution_text(mbs.solve(ball))
    assert "  joint_wz' = -19.0986 deg/s^2" in solution_text(mbs.solve(ball), chosen_units("deg")).splitlines()


def test_the_command_prints_text_or_one_object(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "wedge.yaml"
    file.write_text(MODEL)
    assert main(["solve", str(file)]) == 0
    assert "s'' = g*sin(alpha) = 5 m/s^2" in capsys.readouterr().out
    assert main(["solve", str(file), "--json", "--set", "g=20"]) == 0
    assert json.loads(capsys.readouterr().out)["accelerations"]["s"] == {
        "value": 10.0,
        "expression": "g*sin(alpha)",
        "unit": "m/s^2",
    }


def test_a_solution_shows_itself_in_a_line() -> None:
    assert repr(mbs.solve(mbs.loads(MODEL))) == "<Solution of wedge with accelerations s: g*sin(alpha) = 5 m/s^2>"
    driven = mbs.System(
        name="crank", bodies={"a": mbs.Body(mass=1)}, joints={"A": mbs.Revolute("ground", "a", motion="t")}
    )
    assert repr(mbs.solve(driven)) == "<Solution of crank without degrees of freedom>"
