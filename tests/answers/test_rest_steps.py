"""Steps to the ends of a range of rest: the printed equations hold at the end that another route found."""

from __future__ import annotations

import math
from functools import lru_cache
from pathlib import Path

import pytest
import sympy

import multibody_sym as mbs
from multibody_sym.answers.records import Formula, Worked
from multibody_sym.answers.worked.rest import worked_rest
from multibody_sym.cli.main import main

SLED = """
multibody_sym: 1
name: sled
gravity: [0, -g, 0]
parameters:
  m: {value: 6 kg, positive: true}
  a: {value: 40 deg, positive: true}
  f: {value: 0.3, positive: true}
  P: {value: 40 N, positive: true}
  g: {value: 9.81 m/s^2, positive: true}
bodies:
  ground: {frames: {slope: {rotate: [{axis: z, angle: -a}]}}}
  block: {mass: m}
joints: {plane: {type: prismatic, parent: ground.slope, child: block, axis: x, q: x}}
forces:
  pull: {type: force, on: block, value: [-P*cos(a), P*sin(a), 0]}
  rub: {type: friction, joint: plane, static: f, kinetic: f}
"""


@lru_cache(maxsize=1)
def steps() -> Worked:
    return worked_rest(mbs.loads(SLED), "P")


def formulas() -> list[Formula]:
    return [line for step in steps().steps for line in step.lines if isinstance(line, Formula)]


def test_ends_are_derived_from_balance_and_limits() -> None:
    ends = [line for line in formulas() if line.value is not None]
    m, a, f, g = 6.0, math.radians(40), 0.3, 9.81
    known = [m * g * (math.sin(a) - s * f * math.cos(a)) for s in (1, -1)]
    assert [line.value.number for line in ends if line.value] == pytest.approx(known, rel=1e-12)


def test_the_printed_equations_have_the_end_as_their_solution() -> None:
    """Forces and the parameter are solved for together by sympy."""
    tagged = [line for line in formulas() if line.tag is not None]
    balance, limits = tagged[:2], tagged[2:]
    ends = [line for line in formulas() if line.value is not None]
    assert len(limits) == len(ends) == 2
    named = {steps().notation.text(s): s for line in tagged for side in line.sides for s in side.free_symbols}
    for limit, end in zip(limits, ends, strict=True):
        equations = [line.sides[0] - line.sides[1] for line in (*balance, limit)]
        (found,) = sympy.solve(equations, [named["P"], named["F"], named["N"]], dict=True)
        assert sympy.simplify(found[named["P"]] - end.sides[-1]) == 0


def test_the_command_prints_the_steps_before_the_range(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "sled.yaml"
    file.write_text(SLED)
    assert main(["equilibrium", str(file), "--vary", "P", "--steps"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "    (3) rub: F = f*N" in lines
    assert lines[-1].startswith("rest is possible for P from")


@pytest.mark.parametrize("more", [[], ["--vary", "f", "--least", "P"]])
def test_steps_without_a_range_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str], more: list[str]) -> None:
    """They were left out without a word."""
    file = tmp_path / "sled.yaml"
    file.write_text(SLED)
    assert main(["equilibrium", str(file), *more, "--steps"]) == 2
    assert "name its parameter alone, such as --vary mu" in capsys.readouterr().err
