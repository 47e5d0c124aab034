"""Rayleigh's function: half the power that linear dampers take, whose slope in the speeds is their part of Q."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import sympy
from textbook import elastic_pendulum, pendulum, positive

import multibody_sym as mbs
from multibody_sym.cli.main import main


def damped(**forces: object) -> mbs.System:
    return mbs.System(
        "damped",
        parameters=positive("m c d k"),
        bodies={"a": mbs.Body(mass="m"), "b": mbs.Body(mass="m")},
        joints={
            "A": mbs.Prismatic("ground", "a", axis="x", q="x"),
            "B": mbs.Prismatic("ground", "b", axis="x", q="y", initial={"q": 1}),
        },
        forces=forces,
    )


def test_slope_of_the_function_is_the_dampers_part_of_the_forces() -> None:
    equations = mbs.derive(
        damped(
            wall=mbs.Damper("c", joint="A"),
            between=mbs.SpringDamper("k", between=["a", "b"], damping="d"),
            air=mbs.Drag("b", linear="c"),
        )
    )
    D, (u, v) = equations.dissipation, equations.symbols.speeds
    s = {x.name: x for x in equations.symbols.parameters}
    book = s["c"] * u**2 / 2 + s["d"] * (v - u) ** 2 / 2 + s["c"] * v**2 / 2
    assert sympy.simplify(D - book) == 0
    for x, force in zip((u, v), equations.generalized_forces, strict=True):
        assert sympy.simplify(force + sympy.diff(D, x)) == 0


def test_the_function_is_told_with_the_energies() -> None:
    equations = mbs.derive(elastic_pendulum())
    step = next(step for step in equations.steps if step.title == "Rayleigh's function")
    assert [equations.notation.text(x) for e in step.equations for x in (e.left, e.right)] == ["D", "c*r'^2/2"]
    assert "-dD/du" in step.note
    hamilton = mbs.derive(elastic_pendulum(), "hamilton")
    assert "Rayleigh's function" in [step.title for step in hamilton.steps]


def test_without_dampers_or_with_others_there_is_none() -> None:
    assert mbs.derive(pendulum()).dissipation is None
    squared = mbs.derive(damped(air=mbs.Drag("b", quadratic="c"), wall=mbs.Damper("c", joint="A")))
    assert squared.dissipation is None
    growing = mbs.derive(damped(wall=mbs.Damper("c*(1 + u_x^2)", joint="A")))
    assert growing.dissipation is None
    timed = mbs.derive(damped(wall=mbs.Damper("c*(2 + sin(t))*(1 + x^2)", joint="A")))
    assert timed.dissipation is not None


def test_command_tells_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "damped.yaml"
    file.write_text(mbs.dumps(damped(wall=mbs.Damper("c", joint="A"))))
    assert main(["derive", str(file)]) == 0
    assert "D = c*x'^2/2" in capsys.readouterr().out
    assert main(["derive", str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["dissipation"] == "c*u_x^2/2"
