"""`check` as users run it: its object, its text, and its exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command import PENDULUM, answer, here

from multibody_sym.cli.main import main

POINT_ON_A_BALL = (
    "{multibody_sym: 1, name: m, bodies: {b: {mass: 1, com: [1, 0, 0]}},"
    " joints: {h: {type: spherical, parent: ground, child: b}}}"
)


def test_check_answers_with_the_documented_object() -> None:
    done = here("check", PENDULUM, "--json")
    printed = answer(done)
    assert done.returncode == 0
    assert printed["degrees_of_freedom"] == 1
    assert set(printed) > {"rank", "redundant", "not_unique", "agreement", "theorems", "hints"}
    assert "composite_body" in printed["agreement"]
    assert "degrees of freedom: 1" in done.stderr


def test_no_start_ends_with_3(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(POINT_ON_A_BALL)
    assert main(["check", str(tmp_path / "m.yaml"), "--json"]) == 3
    assert "inertia" in json.loads(capsys.readouterr().out)["failure"]


def test_routes_that_disagree_end_with_3(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    from multibody_sym.analysis import check

    monkeypatch.setattr(check, "beyond_rounding", lambda *_arguments: ["sweep"])
    assert main(["check", PENDULUM]) == 3
    assert "THEY DISAGREE: sweep\n" in capsys.readouterr().out


def test_unknown_formalism(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", PENDULUM, "--formalism", "lagrang", "--json"]) == 2
    assert "did you mean" in json.loads(capsys.readouterr().out)["error"]["message"]


@pytest.mark.parametrize("rest", ["", ", bodies: {b: {mass: 1}}, joints: {j: {type: fixed, parent: ground, child: b}}"])
def test_what_cannot_move_has_no_freedom(capsys: pytest.CaptureFixture[str], tmp_path: Path, rest: str) -> None:
    (tmp_path / "m.yaml").write_text(f"{{multibody_sym: 1, name: m{rest}}}")
    assert main(["check", str(tmp_path / "m.yaml"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["degrees_of_freedom"] == 0
