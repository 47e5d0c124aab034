"""Hints about what is allowed and was hardly meant: by every command, true, and none about the examples."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from multibody_sym.analysis.check import check
from multibody_sym.analysis.hints import declared_hints
from multibody_sym.cli.main import main
from multibody_sym.mechanics.model_files import load, loads

EXAMPLES = sorted(Path(__file__).parents[2].joinpath("examples").rglob("*.yaml"))
PENDULUM = """\
multibody_sym: 1
name: pendulum
gravity: [0, -g, 0]
parameters: {m: 1 kg, l: 0.5 m, g: 9.81 m/s^2}
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, q: phi, initial: {q: 0.5}}}
"""


def test_boxes_of_contacts_that_repeat_have_the_hint_about_their_edges() -> None:
    text = """
multibody_sym: 1
name: boxes
gravity: [0, 0, 0]
bodies: {a: {shape: {box: [1, 1, 1], mass: 1}}, b1: {shape: {box: [1, 1, 1], mass: 1}}}
joints: {A: {type: free, parent: ground, child: a}, B: {type: fixed, parent: ground, child: b1}}
contacts: {c#: {between: [a, b#], open: true, repeat: 1}}
"""
    found = check(loads(text.replace("child: a}", "child: a, initial: {q: [0, 3, 0, 1, 0, 0, 0]}}"))).hints
    assert any("edges of the boxes of contact c1" in hint for hint in found)


def test_no_example_has_a_hint() -> None:
    assert {path.stem: hints for path in EXAMPLES if (hints := declared_hints(load(path)))} == {}


def test_every_command_has_the_hints(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(PENDULUM.replace("{q: 0.5}", "{q: 30}"))
    for command in ("solve", "modes", "derive"):
        main([command, str(path), "--json"])
        printed = capsys.readouterr()
        assert printed.err.count("joints.hinge.initial.q: joint hinge starts at 30") == 1, command
        assert "30 deg" in json.loads(printed.out)["hints"][0]


def test_a_belt_that_a_motion_drives_needs_no_mass() -> None:
    text = """\
multibody_sym: 1
name: belt
bodies: {b: {mass: 1}, belt: {surfaces: {top: {plane: [0, 0, 0], normal: y}}}}
joints:
  jb: {type: prismatic, parent: ground, child: belt, axis: x, motion: 0.2*t}
  j: {type: point, parent: ground, child: b, q: [x, y]}
contacts: {c: {between: [b, belt.top], static: 0.5}}
gravity: [0, -9.81, 0]
"""
    free = text.replace(", motion: 0.2*t", "")
    told, of_free = (declared_hints(loads(each)) for each in (text, free))
    assert not any("has no mass" in each for each in told)
    assert any("body belt has no mass" in each for each in of_free)


def test_structures_need_no_masses() -> None:
    text = """\
multibody_sym: 1
name: two_bars
gravity: [0, 0, 0]
bodies: {ground: {points: {A: [0, 0, 0], B: [2, 0, 0]}}, top: {}}
joints: {top: {type: point, parent: ground, child: top, q: [x, y], initial: {q: [1, 1]}}}
constraints:
  a: {type: distance, between: [ground.A, top], value: sqrt(2)}
  b: {type: distance, between: [ground.B, top], value: sqrt(2)}
forces: {load: {type: force, on: top, value: [1, -2, 0]}}
"""
    assert declared_hints(loads(text)) == []
    pendulum = text[: text.index("constraints:")]
    assert any("body top has no mass" in each for each in declared_hints(loads(pendulum)))
