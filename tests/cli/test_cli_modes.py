"""`modes` as users run it: its object, its text, LaTeX that names the frequencies, exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command import EXAMPLES, PENDULUM

from multibody_sym.cli.main import main

COUPLED = """\
multibody_sym: 1
name: coupled
parameters: {k: {value: 3, positive: true}, kc: {value: 1, positive: true}, m: {value: 1 kg, positive: true}}
bodies: {a: {mass: m}, b: {mass: m}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: x, q: x1}
  B: {type: prismatic, parent: ground, child: b, axis: x, q: x2}
forces:
  s1: {type: spring_damper, joint: A, stiffness: k}
  s2: {type: spring_damper, joint: B, stiffness: k}
  s3: {type: spring_damper, between: [a, b], stiffness: kc}
"""


@pytest.fixture
def coupled(tmp_path: Path) -> str:
    path = tmp_path / "coupled.yaml"
    path.write_text(COUPLED)
    return str(path)


def test_modes_prints_formulas(coupled: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", coupled]) == 0
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    assert lines[0] == "coupled: small motions about an equilibrium"
    assert "M x'' + K x = 0 in x = (x1, x2)" in lines
    assert "omega2 = sqrt((k + 2*kc)/m) = 2.23607 rad/s" in lines
    assert "T1 = 2*pi*sqrt(m/k) = 3.6276 s" in lines
    assert "shape: x1 1, x2 -1" in lines
    assert "stable" in lines


def test_modes_answers_with_an_object(coupled: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", coupled, "--json", "--set", "kc=4"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [x["expression"] for x in found["frequencies"]] == ["sqrt(k/m)", "sqrt((k + 2*kc)/m)"]
    assert found["frequencies"][1]["value"] == pytest.approx(11**0.5)
    assert found["K"][0][1]["expression"] == "-kc"
    assert found["stable"] is True


def test_modes_prints_a_latex_document(coupled: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", coupled, "--format", "latex"]) == 0
    printed = capsys.readouterr().out
    assert r"\omega_{1} &= \sqrt{\frac{k}{m}}, \quad T_{1} = 2 \pi \sqrt{\frac{m}{k}}" in printed
    assert printed.rstrip().endswith(r"\end{document}")


def test_modes_says_that_it_found_the_place(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", PENDULUM]) == 0
    assert "(found beside the declared start)" in capsys.readouterr().out


def test_modes_of_steady_motions_hold_momenta(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", str(EXAMPLES / "spherical_pendulum.yaml")]) == 0
    printed = capsys.readouterr().out
    assert "the momenta of phi are held" in printed
    assert "omega = sqrt(g*(3*cos(theta)^2 + 1)/(l*cos(theta)))" in printed


def test_what_nothing_brings_back_is_indifferent(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "slide.yaml"
    path.write_text(COUPLED.partition("forces:")[0])
    assert main(["modes", str(path)]) == 0
    printed = capsys.readouterr().out
    assert "moves off uniformly (omega = 0)" in printed
    assert "\n  indifferent: nothing brings it back\n" in printed


def test_a_place_where_speeds_change_ends_with_3(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", PENDULUM, "--at", "theta=1"]) == 3
    assert "no equilibrium and no steady motion" in capsys.readouterr().err
