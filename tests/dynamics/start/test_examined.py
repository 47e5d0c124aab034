"""Numbers that no arithmetic can do with: the expression is named, with its place, its values and its line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from multibody_sym.cli.main import main
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.errors import ModelError
from multibody_sym.mechanics import motion
from multibody_sym.mechanics.model_files import loads

MODEL = """multibody_sym: 1
name: m
gravity: [0, GRAVITY, 0]
parameters: {k: 0, big: 1e200}
bodies:
  ground: {points: {hook: [0, HOOK, 0]}}
  bob:
    mass: MASS
    com: [0, COM, 0]
    inertia:
      Izz: INERTIA
    points: {p: [0, -1, 0]}
joints:
  hinge:
    {type: revolute, parent: ground, child: bob, axis: z, q: phi, initial: {q: ANGLE}}
forces:
  spring: {type: spring_damper, between: [ground.hook, bob.p], stiffness: STIFFNESS, length: 1}
  push:
    type: torque
    joint: hinge
    value: TORQUE
outputs: {o: OUTPUT}
"""
USUAL = {
    "GRAVITY": "-9.81", "HOOK": "1", "MASS": "1", "COM": "-1", "INERTIA": "0.1", "ANGLE": "0.5", "STIFFNESS": "10",
    "TORQUE": "0", "OUTPUT": "phi",
}
COMMANDS = ("check", "solve", "linearize", "equilibrium", "simulate", "export", "derive")


def outcome(capsys: Any, folder: Path, command: str, **numbers: str) -> tuple[int, dict[str, Any], str]:
    """Return exit code, error and the text of the line that it names."""
    content = MODEL
    for name, usual in USUAL.items():
        content = content.replace(name, numbers.get(name, usual))
    file = folder / "m.yaml"
    file.write_text(content)
    more = {
        "simulate": ["--backend", "python", "--t-end", "0.1", "--samples", "2"],
        "export": ["--to", "python", "-o", str(folder / "out")],
    }
    code = main([command, str(file), "--json", *more.get(command, [])])
    printed = json.loads(capsys.readouterr().out)
    error = printed.get("error", {"message": "", "where": {"path": "", "line": None}})
    line = error["where"]["line"]
    return code, error, "" if line is None else content.splitlines()[line - 1]


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    ("name", "value", "path", "told"),
    [
        ("COM", "-1/k", "bodies.bob.com.1", "-1/k has no finite value, for 1/k has none with k = 0"),
        ("INERTIA", "log(k)", "bodies.bob.inertia.Izz", "log(k) has no finite value with k = 0"),
        ("STIFFNESS", "sqrt(k - 1)", "forces.spring.stiffness", "with k = 0"),
        ("HOOK", "2*big*big", "bodies.ground.points.hook.1", "has none with big = 1e+200"),
        ("ANGLE", "exp(big)", "joints.hinge.initial.q", "exp(big) has no finite value with big = 1e+200"),
        ("OUTPUT", "1/k", "outputs.o", "1/k has no finite value with k = 0"),
    ],
)
def test_what_has_no_value_is_named_by_every_command(
    capsys: Any, tmp_path: Path, command: str, name: str, value: str, path: str, told: str
) -> None:
    code, error, line = outcome(capsys, tmp_path, command, **{name: value})
    assert (code, error["code"], error["where"]["path"]) == (2, "model", path)
    assert told in error["message"]
    assert value in line


@pytest.mark.parametrize("command", ["check", "solve", "linearize", "equilibrium", "simulate"])
@pytest.mark.parametrize(
    ("name", "value", "path"),
    [("GRAVITY", "1e300", "gravity.1"), ("HOOK", "1e300", "bodies.ground.points.hook.1"), ("COM", "1e300", "com")],
)
def test_what_is_too_large_to_compute_with_is_named(
    capsys: Any, tmp_path: Path, command: str, name: str, value: str, path: str
) -> None:
    code, error, line = outcome(capsys, tmp_path, command, **{name: value})
    assert code in (0, 2, 3), "what is computed all the same may be told"
    if code == 2:
        assert path in error["where"]["path"]
        assert "1e+300 is too large to compute with" in error["message"]
        assert value in line


def test_a_force_without_value_at_the_start_is_named(capsys: Any, tmp_path: Path) -> None:
    code, error, line = outcome(capsys, tmp_path, "solve", TORQUE="1/(phi - 0.5)")
    assert (code, error["where"]["path"].split(".")[:2]) == (2, ["forces", "push"])
    assert "no finite value" in error["message"]
    assert "1/(phi - 0.5)" in line or "push" in line


@pytest.mark.parametrize("failure", [KeyError("planted"), ZeroDivisionError("planted"), ValueError("planted")])
@pytest.mark.parametrize("command", COMMANDS)
def test_a_defect_stays_a_defect(
    capsys: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str, failure: Exception
) -> None:
    """Nothing that is declared explains it, so that nothing declared is blamed."""

    def broken(*_arguments: object) -> None:
        raise failure

    monkeypatch.setattr(motion, "body_motion", broken)
    code, error, _ = outcome(capsys, tmp_path, command)
    assert (code, error["code"]) == (70, "internal")
    assert "planted" in error["message"]


@pytest.mark.parametrize("radius", ["-0.1", "k - 1"])
def test_a_negative_radius_is_refused(capsys: Any, tmp_path: Path, radius: str) -> None:
    file = tmp_path / "m.yaml"
    file.write_text(
        "multibody_sym: 1\nname: m\nparameters: {k: 0}\nbodies: {ground: {points: {o: [0, 3, 0]}}, a: {mass: 1},"
        " b: {mass: 2}}\njoints:\n  A: {type: prismatic, parent: ground, child: a, axis: y, initial: {q: 0.5}}\n"
        "  B: {type: prismatic, parent: ground, child: b, axis: y, q: y2, initial: {q: 0.4}}\n"
        f"pulleys: {{P: {{at: ground.o, radius: {radius}}}}}\nconstraints: {{r: {{type: rope, path: [a, P, b]}}}}\n"
    )
    assert main(["solve", str(file), "--json"]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert error["where"]["path"] == "constraints.r"
    assert "no radius is negative" in error["message"]


LEDGE = """\
multibody_sym: 1
name: ledge
gravity: [0, -9.81, 0]
parameters: {a: 30 deg, l: 2 m}
bodies:
  ground:
    points: {top: [l*cos(a), l*sin(a), 0]}
    surfaces: {ramp: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0], between: [[0, 0, 0], top]}}
  b: {mass: 1}
joints: {J: {type: point, parent: ground, child: b, q: [x, y], initial: {q: [l, 1]}}}
contacts: {c: {between: [b, ground.ramp], open: true}}
"""


def test_the_ends_of_a_plane_lie_on_it() -> None:
    """To 1e-9 of its length."""
    check_numbers(loads(LEDGE))
    check_numbers(loads(LEDGE.replace("[[0, 0, 0],", "[[0, 1e-9, 0],")))
    off = LEDGE.replace("[[0, 0, 0],", "[[0, 0.1, 0],").replace("top: [l*cos(a),", "top: [l*cos(a) + 1e-6,")
    with pytest.raises(ModelError) as found:
        check_numbers(loads(off))
    first, *others = found.value, *found.value.others
    assert first.where.path == ("bodies", "ground", "surfaces", "ramp", "between", "0")
    assert first.message == (
        "this end lies 0.0866 m above the plane: move it along the normal, to [0.0433013, 0.025, 0], or correct plane "
        "or normal"
    )
    assert [each.where.path[-1] for each in others] == ["1"]
    assert "lies 5e-07 m below the plane" in others[0].message
