"""`linearize` and `equilibrium` as users run them: their objects, their text, their exit codes."""

from __future__ import annotations

import cmath
import json
from pathlib import Path

import pytest
from command import EXAMPLES, PENDULUM

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.documents.analysis import equilibrium_text

STONE = (
    "{multibody_sym: 1, name: m, gravity: [0, -9.81, 0], bodies: {b: {mass: 1}},"
    " joints: {j: {type: prismatic, axis: y, parent: ground, child: b}}}"
)


def test_linearize_answers_with_the_documented_object(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["linearize", str(EXAMPLES / "cart_pole.yaml"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found) >= {"A", "B", "states", "inputs", "eigenvalues"}
    assert [len(found["A"]), len(found["A"][0]), len(found["B"]), len(found["B"][0])] == [4, 4, 4, 1]
    assert all(len(pair) == 2 for pair in found["eigenvalues"])


def test_linearize_prints_frequencies(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(Path(PENDULUM).read_text().replace("60 deg", "0 deg"))
    assert main(["linearize", str(tmp_path / "m.yaml")]) == 0
    printed = capsys.readouterr().out
    assert "3.13209 i   (0.4985 Hz" in printed
    assert "note:" not in printed


def test_linearize_says_that_a_state_is_no_equilibrium(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["linearize", PENDULUM]) == 0
    assert "no equilibrium and no steady motion" in capsys.readouterr().out


def test_equilibrium_answers_with_the_documented_object(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["equilibrium", PENDULUM, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert sorted(zip((round(abs(p["theta"]), 6) for p in found["positions"]), found["stable"], strict=True)) == [
        (0.0, True),
        (3.141593, False),
    ]


def test_equilibrium_says_which_positions_are_stable(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["equilibrium", PENDULUM]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert {line.split(":")[0] for line in lines} == {"stable", "unstable"}
    assert "stable: theta = 0 rad" in lines


@pytest.mark.parametrize("command", ["linearize", "equilibrium"])
def test_a_missing_file_ends_with_2(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "nowhere.yaml", "--json"]) == 2
    assert json.loads(capsys.readouterr().out)["error"]["message"]


def test_no_equilibrium_ends_with_3(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(STONE)
    assert main(["equilibrium", str(tmp_path / "m.yaml"), "--json"]) == 3
    assert "no position of equilibrium" in json.loads(capsys.readouterr().out)["error"]["message"]


def test_linearize_prints_rounding_as_zero(capsys: pytest.CaptureFixture[str]) -> None:
    """A level gyroscope nods without damping: a pure pair beside zeros, and nothing is -0 or 1e-14."""
    assert main(["linearize", str(EXAMPLES / "gyroscope.yaml")]) == 0
    printed = capsys.readouterr().out
    assert "\n  +- 60.3001 i   (9.597 Hz, damping ratio 0)\n" in printed
    assert "e-1" not in printed
    assert " -0 " not in printed
    assert main(["linearize", str(EXAMPLES / "gyroscope.yaml"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert sorted(found["eigenvalues"])[0][0] == sorted(found["eigenvalues"])[-1][0] == 0.0
    assert "-0.0" not in json.dumps(found["A"])


def test_linearize_refuses_a_motion_that_changes_what_it_depends_on(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    moving = Path(PENDULUM).read_text().replace("q: 60 deg, u: 0", "q: 0 deg, u: 3")
    (tmp_path / "m.yaml").write_text(moving)
    assert main(["linearize", str(tmp_path / "m.yaml")]) == 3
    assert "A depends on what moves: theta (3 rad/s)" in capsys.readouterr().err


def test_equilibrium_says_what_it_leaves_out_and_what_is_not_proved(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["equilibrium", str(EXAMPLES / "spherical_pendulum.yaml")]) == 0
    printed = capsys.readouterr().out
    assert "start speeds are left out (u_phi); steady motion: `linearize`" in printed
    assert "not proved that there are no others" in printed
    assert main(["equilibrium", str(EXAMPLES / "spherical_pendulum.yaml"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["complete"], found["cut_short"], found["speeds_left_out"]) == (False, False, ["u_phi"])


def test_linearize_gives_the_multipliers_of_a_period(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """At rest x' = A x: exp(A T), whose pair has the size 1, and is -1 after half an oscillation."""
    (tmp_path / "m.yaml").write_text(Path(PENDULUM).read_text().replace("60 deg", "0 deg"))
    assert main(["linearize", str(tmp_path / "m.yaml"), "--period", "0.5", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    expected = cmath.exp(0.5j * 9.81**0.5)
    assert sorted(complex(*x).imag for x in found["multipliers"]) == pytest.approx([-expected.imag, expected.imag])
    assert main(["linearize", str(tmp_path / "m.yaml"), "--period", "0.5"]) == 0
    assert "over one period of 0.5 s\nmultipliers\n" in capsys.readouterr().out
    assert main(["linearize", PENDULUM, "--period", "0.5"]) == 3
    assert "does not repeat itself after 0.5 s" in capsys.readouterr().err
    assert main(["linearize", PENDULUM, "--period", "-1"]) == 2


def test_text_and_object_tell_the_same_positions_of_rest(capsys: pytest.CaptureFixture[str]) -> None:
    """0, where the position beside it rests no better; and what is small and no rounding stays in both."""
    assert main(["equilibrium", PENDULUM, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["positions"][0] == {"theta": 0.0}
    track = {"j": mbs.Prismatic("ground", "b", axis="x", q="x")}
    spring = {"s": mbs.SpringDamper(joint="j", stiffness=100), "f": mbs.Torque("4e-8", joint="j")}
    found = mbs.equilibrium(mbs.System("m", bodies={"b": mbs.Body(mass=1)}, joints=track, forces=spring))
    assert found.positions[0]["x"] == pytest.approx(4e-10, rel=1e-6)
    assert "x = 4e-10 m" in equilibrium_text(found)
