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


def test_formula_number_and_unit_stand_on_one_line() -> None:
    assert solution_text(mbs.solve(mbs.loads(MODEL))).splitlines() == [
        "wedge at t = 0",
        "accelerations",
        "  s'' = g*sin(alpha) = 5 m/s^2",
        "reactions of joints, on the child, in the axes of the joint's frame on the parent (zeros left out)",
        "  fy(slide) = g*m*cos(alpha) = 17.32050808 N",
        "conditions",
        "  sin(alpha) > 0",
        "  g > 0",
        "  up: s never has this value",
        "answers",
        "  way = 2*g*sin(alpha) = 10 m",
        "  up = unknown",
    ]


def test_speeds_that_are_no_coordinate_s_rate_have_one_prime() -> None:
    ball = mbs.System(
        "ball",
        bodies={"b": mbs.Body(mass=1, inertia={"Ixx": 1, "Iyy": 2, "Izz": 3})},
        joints={"joint": mbs.Spherical("ground", "b", initial={"u": [1, 1, 0]})},
    )
    assert "joint_wz' = -1/3 = -0.3333333333 rad/s^2" in solution_text(mbs.solve(ball))
    assert "  joint_wz' = -19.09859317 deg/s^2" in solution_text(mbs.solve(ball), chosen_units("deg")).splitlines()


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


ROWS = """
multibody_sym: 1
name: rows
gravity: [0, -10, 0]
bodies:
  ground: {points: {o: [0, 2, 0]}}
  a: {mass: 1}
  b: {mass: 2}
  c: {mass: 3}
  d: {mass: 4}
  e: {mass: 5}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: y}
  B: {type: prismatic, parent: ground, child: b, axis: y}
  C: {type: prismatic, parent: ground, child: c, axis: y}
  D: {type: prismatic, parent: ground, child: d, axis: y}
  E: {type: prismatic, parent: ground, child: e, axis: y}
constraints:
  string: {type: rope, path: [ground.o, a]}
  rod: {type: distance, between: [ground.o, b], value: 2}
  shelf: {type: point_in_plane, point: c, plane: {through: ground, normal: y}}
  brake: {type: velocity, zero: u_D}
  held: {type: expression, zero: E}
"""


def test_only_ropes_have_tensions() -> None:
    found = mbs.solve(mbs.loads(ROWS))
    told = solution_text(found).splitlines()
    headings = {line.split()[0]: head for line, head in under_headings(told) if "=" in line}
    assert headings["tension(string)"] == "tensions"
    assert headings["tension(rod)"] == headings["multiplier(shelf)"] == "forces of constraints"
    assert headings["multiplier(brake)"] == headings["multiplier(held)"] == "multipliers"
    assert "  tension(rod) = 20 N" in told
    assert "  multiplier(shelf) = 30 N" in told
    assert found.reactions["brake"]["tension"].unit == "N", "the force on D, whose speed stands alone in the row"


def under_headings(lines: list[str]) -> list[tuple[str, str]]:
    """Return each line that stands under a heading, with it."""
    found, head = [], ""
    for line in lines:
        if line.startswith("  "):
            found.append((line, head))
        else:
            head = line
    return found
