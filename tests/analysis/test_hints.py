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


@pytest.mark.parametrize(
    ("was", "written", "words"),
    [
        ("{q: 0.5}", "{q: 30}", "joint hinge starts at 30, which counts as 30 rad, 4.77 turns"),
        ("gravity: [0, -g, 0]\n", "", "no gravity is declared; write gravity: [0, -9.81, 0]"),
        ("gravity: [0, -g, 0]\n", "", "parameter g is not used"),
        (PENDULUM, "multibody_sym: 1\nname: n\n", "no body is declared, and nothing moves; write bodies: {"),
        ("m: 1 kg", "m: 500", "counts as 500 kg; if grams are meant: 500 g"),
        ("com: [0, -l, 0]", "com: [0, -l/2, 0], inertia: {Izz: m*l^2/3}", "Izz of body bob would be that about an end"),
        ("{mass: m, com: [0, -l, 0]}", "{shape: {rod: l, mass: m}, points: {a: [-l/2, 0, 0]}}", "a rod begins at the"),
        ("{bob:", "{ground: {frames: {s: {rotate: [{axis: z, angle: 30}]}}}, bob:", "frame ground.s turns by 30"),
        ("0.5}}}", "0.5}}, j: {type: revolute, parent: ground, child: bob}}", "joints hinge and j both join bob to"),
        ("0.5}}}", "0.5}, limits: {lower: -90}}}", "the lower limit of joint hinge is -90, which counts as -90 rad"),
    ],
)
def test_a_hint_says_what_is_odd_and_what_to_write(was: str, written: str, words: str) -> None:
    assert any(words in hint for hint in declared_hints(loads(PENDULUM.replace(was, written))))


RAMP = """\
multibody_sym: 1
name: ramp
gravity: [0, -g, 0]
parameters: {g: 9.81 m/s^2, a: 20 deg}
bodies: {ground: {surfaces: {ramp: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}, b: {mass: 1 kg}}
joints: {j: {type: point, parent: ground, child: b, q: [x, y]}}
contacts: {c: {between: [b, ground.ramp], static: 0.3}}
"""


def test_two_contacts_between_the_same_parts_have_a_hint() -> None:
    """Whether a surface is named, or is the only one of its body; not where bodies touch with different ones."""
    second = "static: 0.3}, d: {between: [ground, b]}}"
    (hint,) = declared_hints(loads(RAMP.replace("static: 0.3}}", second)))
    assert hint.startswith("contacts c and d are both between b and ground.ramp: both press")
    assert hint.path == ("contacts", "d")
    other = RAMP.replace("static: 0.3}}", "static: 0.3}, d: {between: [b, ground.wall]}}")
    assert declared_hints(loads(other.replace("{ramp: ", "{wall: {plane: [2, 0, 0], normal: -x}, ramp: "))) == []


def test_a_ramp_that_is_turned_the_wrong_way_has_a_hint() -> None:
    """Gravity pulls off what a plane's normal points down from, unless a force presses it there or it is open."""
    assert declared_hints(loads(RAMP)) == []
    turned = RAMP.replace("[-sin(a), cos(a), 0]", "[sin(a), -cos(a), 0]")
    (hint,) = declared_hints(loads(turned))
    assert hint.path == ("contacts", "c")
    assert "gravity pulls b off ground.ramp: its normal points out of its body" in hint
    assert declared_hints(loads(turned.replace("static: 0.3", "open: true"))) == []
    assert declared_hints(loads(turned + "forces: {f: {type: force, on: b, value: [0, 20, 0]}}\n")) == []


ROW = """\
multibody_sym: 1
name: row
gravity: [0, -9.81, 0]
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, d1: {mass: 1}, d2: {mass: 1}}
joints:
  A: {type: point, parent: ground, child: d1, q: [x1, y1], initial: {u: [1, 0]}}
  B: {type: point, parent: ground, child: d2, q: [x2, y2], initial: {u: [1, 0]}}
contacts: {f#: {between: [d#, ground.floor], static: 0.5, repeat: 2}}
"""


def test_contacts_that_repeat_have_the_hints_of_each() -> None:
    """Bodies are those of the copies, and all have one hint, at the contact that is declared."""
    assert declared_hints(loads(ROW)) == []
    (hint,) = declared_hints(loads(ROW.replace("normal: y", "normal: -y")))
    assert hint.startswith("gravity pulls d1 off ground.floor")
    assert hint.path == ("contacts", "f#")


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


@pytest.mark.parametrize(
    "written",
    ["{q: 2000 deg}", "{q: 6.2}", "{q: 8*pi}"],
)
def test_whole_turns_that_state_their_unit_are_meant(written: str) -> None:
    assert declared_hints(loads(PENDULUM.replace("{q: 0.5}", written))) == []


def test_a_declared_absence_of_gravity_is_no_oversight() -> None:
    system = loads(PENDULUM.replace("[0, -g, 0]", "[0, 0, 0]").replace(", g: 9.81 m/s^2", ""))
    assert declared_hints(system) == []


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


def test_degrees_of_a_parameter_are_written_where_it_is_declared() -> None:
    text = PENDULUM.replace("9.81 m/s^2", "9.81 m/s^2, far: 90").replace("0.5}}}", "0.5}, limits: {lower: -far}}}")
    (told,) = [hint for hint in declared_hints(loads(text)) if "turns" in hint]
    assert "is -far, which counts as -90 rad" in told
    assert told.endswith("write the unit: far: 90 deg")
    fixed = text.replace("far: 90", "far: 90 deg")
    assert not [hint for hint in declared_hints(loads(fixed)) if "turns" in hint]


@pytest.mark.parametrize(
    ("written", "hinted"),
    [
        ("cos(a)", True), ("sin(-a)", True), ("tan(phi + 1 - a)", True), ("sin(2*t + a)", True),
        ("sin(a*t)", False), ("cos(a*pi/180)", False), ("exp(-a)", False), ("sin(t + b)", False), ("sin(t - c)", False),
    ],
)  # fmt: skip
def test_degrees_of_a_parameter_in_a_sine_are_written_where_it_is_declared(written: str, hinted: bool) -> None:
    parameters = "{m: 1 kg, l: 0.5 m, g: 9.81 m/s^2, a: 30, b: 30 deg, c: 6}"
    text = PENDULUM.replace("{m: 1 kg, l: 0.5 m, g: 9.81 m/s^2}", parameters)
    force = f"forces: {{f: {{type: torque, joint: hinge, value: '{written}'}}}}\n"
    found = [hint for hint in declared_hints(loads(text + force)) if "not used" not in hint]
    assert [hint.path for hint in found] == [("parameters", "a")] * hinted
    if hinted:
        assert found[0].startswith("parameter a has no unit and counts as 30 rad in ")
        assert found[0].endswith("; if degrees are meant: a: 30 deg")


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
