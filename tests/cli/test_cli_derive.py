"""`derive` and `solve`: the answers of a pendulum as a book prints them, in every format."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest
from command import EXAMPLES, PENDULUM, answer, here

from multibody_sym.cli.main import main

EQUATION = "m*l^2*theta'' + m*g*l*sin(theta) = 0"


def test_derive_prints_energies_and_equations() -> None:
    done = here("derive", PENDULUM)
    assert done.returncode == 0
    for line in ("T = m*l^2*theta'^2/2", "V = -m*g*l*cos(theta)", EQUATION):
        assert line in done.stdout
    assert "Momenta" not in done.stdout


def test_derive_prints_the_steps() -> None:
    assert "dT/dtheta' = m*l^2*theta'" in here("derive", PENDULUM, "--steps").stdout


def test_derive_prints_latex(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["derive", PENDULUM, "--format", "latex"]) == 0
    assert r"\dot{\theta}" in capsys.readouterr().out


@pytest.mark.parametrize("words", [["--json"], ["--format", "json"]])
def test_derive_prints_json(capsys: pytest.CaptureFixture[str], words: list[str]) -> None:
    assert main(["derive", PENDULUM, *words]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["coordinates"] == ["theta"]
    assert printed["equations"][0]["text"] == EQUATION


@pytest.mark.parametrize("words", [["--method", "lagrang"], ["--formalism", "lagrang"]])
def test_derive_refuses_what_gives_no_closed_form(capsys: pytest.CaptureFixture[str], words: list[str]) -> None:
    assert main(["derive", PENDULUM, *words, "--json"]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert "lagrange" in error["message"]
    assert error["where"]["file"] is None


@pytest.mark.parametrize("method", ["lagrange", "multipliers", "composite_body"])
def test_derive_takes_every_method(capsys: pytest.CaptureFixture[str], method: str) -> None:
    assert main(["derive", str(EXAMPLES / "double_pendulum.yaml"), "--method", method, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["method"] == method


def test_solve_gives_numbers_and_formulas() -> None:
    done = here("solve", PENDULUM, "--json", "--set", "l=2", "--set", "g=10")
    printed = answer(done)
    assert done.returncode == 0
    assert printed["coordinates"] == {"theta": pytest.approx(math.pi / 3)}
    acceleration = printed["accelerations"]["theta"]
    assert acceleration["value"] == pytest.approx(-10 / 2 * math.sqrt(3) / 2)
    assert "g" in acceleration["expression"]
    assert printed["reactions"]["hinge"]["fy"]["value"] == pytest.approx(10 / 4)
    assert {"states", "conditions", "answers"} < set(printed)


@pytest.mark.parametrize("form", ["text", "latex", "json"])
def test_products_past_all_floats_are_named_by_their_factor_when_they_are_written(
    form: str, tmp_path: Path, capsys: Any
) -> None:
    """The equations hold (1e300)^2, which sympy knows and no float does."""
    file = tmp_path / "far.yaml"
    file.write_text("""
multibody_sym: 1
name: far
bodies: {turning: {mass: 1, inertia: {Izz: 2}}, far: {mass: 3}}
joints:
  A: {type: revolute, parent: ground, child: turning, axis: z, q: a}
  B: {type: prismatic, parent: turning, child: far, axis: x, motion: 1e300}
""")
    assert main(["derive", str(file), "--format", form]) == 2
    told = capsys.readouterr().err
    assert f"{file}:7:" in told
    assert "1e+300 is too large to compute with" in told
