"""Linearised beside the start: at a position of rest, or where some coordinates and speeds have other values."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main

EXAMPLES = Path(__file__).parents[2] / "examples"
PENDULUM = """\
multibody_sym: 1
name: pendulum
gravity: [0, -g, 0]
parameters: {m: 2 kg, l: 0.5 m, g: 9.81, up: 180 deg}
bodies: {bob: {mass: m, com: [0, -l, 0], inertia: {Izz: 0.1}}}
joints: {hinge: {type: revolute, parent: ground, child: bob, q: theta, initial: {q: 30 deg, u: 1, known: true}}}
"""
STIFFNESS = 2 * 9.81 * 0.5 / (0.1 + 2 * 0.5**2)
"""g m l / (I + m l^2), by hand."""


def pendulum() -> mbs.System:
    return mbs.loads(PENDULUM)


@pytest.mark.parametrize(
    ("place", "squared", "angle"),
    [
        ("equilibrium", -STIFFNESS, 0),
        ({"theta": "up", "u_theta": 0}, STIFFNESS, math.pi),
        ({"theta": "-1 rev", "u_theta": 0}, -STIFFNESS, -2 * math.pi),
    ],
)
def test_a_pendulum_by_hand(place: Any, squared: float, angle: float) -> None:
    """theta'' = -(g m l / J) sin(theta): eigenvalues have this square at rest, whatever the start is."""
    found = mbs.linearize(pendulum(), at=place)
    assert found.eigenvalues**2 == pytest.approx([squared, squared])
    assert found.at == {"theta": pytest.approx(angle, abs=1e-12), "u_theta": 0.0}
    assert found.as_json()["at"] == dict(found.at)


def test_values_that_are_not_named_stay_those_of_the_start() -> None:
    joint = mbs.Prismatic("ground", "b", axis="x", q="x", initial={"q": 1, "u": 3})
    system = mbs.System("cart", bodies={"b": mbs.Body(mass=2)}, joints={"j": joint})
    assert mbs.linearize(system, at={"x": 0.2}).at == {"x": 0.2, "u_x": 3.0}
    assert mbs.linearize(system, at={"u_x": "-1 km/h"}).at == {"x": 1.0, "u_x": pytest.approx(-1 / 3.6)}
    assert mbs.linearize(system).at == {"x": 1.0, "u_x": 3.0}


def test_a_loop_is_closed_around_the_values_that_are_named() -> None:
    """A slider-crank whose rod is named though the crank is known at the start: the loop by hand, and as a start."""
    system = mbs.loads((EXAMPLES / "slider_crank.yaml").read_text())
    psi = -0.2
    found = mbs.linearize(system, at={"psi": psi, "u_phi": 0})
    phi = found.at["phi"]
    assert found.at["psi"] == psi
    assert 0.1 * math.sin(phi) + 0.3 * math.sin(phi + psi) == pytest.approx(0, abs=1e-13)
    assert found.at["s"] == pytest.approx(0.1 * math.cos(phi) + 0.3 * math.cos(phi + psi))
    same = mbs.linearize(system, initial={"phi": phi, "u_phi": 0})
    assert same.states == found.states
    assert np.abs(same.A - found.A).max() <= 1e-9 * np.abs(found.A).max()


def test_a_loop_brought_to_rest_keeps_no_speeds_from_rounding() -> None:
    """At rest nothing depends on speeds to first order where nothing brakes: the rates of A by them are zero."""
    bar = mbs.load(EXAMPLES / "four_bar.yaml")
    found = mbs.linearize(bar, parameters={"torque": 0}, at={"rocker_angle": "100 deg", "u_crank_angle": 0})
    assert found.A[1, 1] == 0.0
    assert max(abs(found.at[name]) for name in found.at if name.startswith("u_")) < 1e-25


def test_a_rope_keeps_the_length_that_the_start_gives_it() -> None:
    """Two blocks on a rope that nobody measured: where one is put a metre lower the other is a metre higher."""
    system = mbs.System(
        "atwood",
        gravity=[0, -9.81, 0],
        bodies={"ground": mbs.Body(points={"top": [0, 3, 0]}), "a": mbs.Body(mass=1), "b": mbs.Body(mass=2)},
        joints={
            "A": mbs.Prismatic("ground", "a", axis="-y", q="ya", initial={"q": 0.5}),
            "B": mbs.Prismatic("ground", "b", axis="-y", q="yb", initial={"q": 1}),
        },
        pulleys={"P": mbs.Pulley("ground.top")},
        constraints={"rope": mbs.Rope(["a", "P", "b"])},
    )
    assert mbs.linearize(system, at={"yb": 2}).at == pytest.approx({"ya": -0.5, "yb": 2, "u_ya": 0, "u_yb": 0})


def test_the_rest_is_the_one_that_equilibrium_tells_first() -> None:
    system = mbs.loads((EXAMPLES / "slider_crank.yaml").read_text())
    given = {"inputs": {"tau": 0}} if "tau" in system.inputs else {}
    first = mbs.equilibrium(system, **given)
    found = mbs.linearize(system, at="equilibrium", **given)
    assert {name: found.at[name] for name in first.positions[0]} == pytest.approx(first.positions[0], abs=1e-7)
    assert max(map(abs, found.accelerations.values())) < 1e-8
    assert (found.eigenvalues.real > 1e-6).any() == (first.stable[0] is False)


def test_multipliers_of_a_period_begin_there_too() -> None:
    """At rest deviations are multiplied by exp(+-i w T); a quarter of the period gives +-i."""
    quarter = math.pi / 2 / math.sqrt(STIFFNESS)
    found = mbs.period_multipliers(pendulum(), quarter, at="equilibrium")
    assert sorted(found.multipliers, key=lambda x: x.imag) == pytest.approx([-1j, 1j], abs=1e-6)


@pytest.mark.parametrize(
    ("place", "message", "path"),
    [
        ("rest", "equilibrium", ("at",)),
        (3, "equilibrium", ("at",)),
        ({"thet": 1}, "did you mean theta?", ("at", "thet")),
        ({"theta": "1 kg"}, "quantity in rad", ("at", "theta")),
        ({"theta": "theta"}, "names parameters only", ("at", "theta")),
        ({"theta": "1/(l-l)"}, "no finite value|zero", ("at", "theta")),
        ({"theta": None}, "needs a value", ("at", "theta")),
    ],
)
def test_what_is_no_place_is_refused(place: Any, message: str, path: tuple[str, ...]) -> None:
    with pytest.raises(mbs.InputError, match=message) as error:
        mbs.linearize(pendulum(), at=place)
    assert error.value.where.path == path


def test_a_part_of_a_quaternion_and_an_open_loop_are_refused() -> None:
    bodies = {"b": {"mass": 1, "inertia": {"Ixx": 1, "Iyy": 1, "Izz": 1}}}
    ball = mbs.System("ball", bodies=bodies, joints={"F": mbs.Spherical("ground", "b")})
    with pytest.raises(mbs.ModelError, match="all four"):
        mbs.linearize(ball, at={"F_qx": 0.1})
    with pytest.raises(mbs.NoSolutionError):
        mbs.linearize(mbs.loads((EXAMPLES / "slider_crank.yaml").read_text()), at={"psi": "-90 deg"})


def test_the_command_takes_a_word_or_values(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "pendulum.yaml"
    file.write_text(PENDULUM, encoding="utf-8")

    def told(*words: str) -> tuple[int, Any]:
        code = main(["linearize", str(file), "--json", *words])
        answer = json.loads(capsys.readouterr().out)
        unused = [hint.rpartition(": ")[2] for hint in answer.pop("hints", [])]
        assert unused in ([], ["parameter up is not used"])  # the file alone does not use it
        return code, answer

    assert told("--at", "theta=up", "--at", "u_theta=0") == (
        0, mbs.linearize(pendulum(), at={"theta": math.pi, "u_theta": 0}).as_json()
    )
    assert told("--at", "equilibrium") == (0, mbs.linearize(pendulum(), at="equilibrium").as_json())
    for words in (("equilibrium", "theta=1"), ("rest",)):
        code, answer = told(*(word for place in words for word in ("--at", place)))
        assert (code, answer["error"]["where"]["path"]) == (2, "--at")
    code, answer = told("--at", "thet=1")
    assert (code, answer["error"]["where"]["path"]) == (2, "--at")
    assert main(["linearize", str(file), "--at", "equilibrium"]) == 0
    assert "about theta = 0" in capsys.readouterr().out


RAMP = """\
multibody_sym: 1
name: ramp
bodies: {b: {mass: 1}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {q: -1}}}
forces: {f: {type: force, on: b, value: [sqrt(0-x), 0, 0]}}
"""


@pytest.mark.parametrize(
    ("model", "place", "message"),
    [
        (PENDULUM, "u_theta=1", "the state is no equilibrium and no steady motion: A depends on what moves: theta"),
        (RAMP, "x=0", "A has no finite value in this state: f has no derivative there; choose one beside it"),
        ("slider_crank", "phi=90 deg,psi=0", "no state with these values satisfies joints.C; name fewer, or give"),
        ("slider_crank", "phi=0,psi=0,u_phi=0,u_psi=1", "no state with these values satisfies joints.C; name fewer"),
    ],
)
def test_what_is_wrong_at_a_place_is_told_of_it_and_not_of_the_start(
    model: str, place: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "model.yaml"
    file.write_text(model if ":" in model else (EXAMPLES / f"{model}.yaml").read_text(), encoding="utf-8")
    places = place.split(",")
    assert main(["linearize", str(file), *(word for x in places for word in ("--at", x))]) == 3
    told = capsys.readouterr().err
    told = told[told.index("error: ") :]  # behind hints
    assert told.startswith(f"error: --at: {message}")
    assert "start" not in told
    with pytest.raises(mbs.NoSolutionError) as error:
        mbs.linearize(mbs.load(file), at=dict(x.split("=") for x in places))
    assert error.value.where.path == ("at",)
    assert error.value.message.startswith(message)


def test_a_singular_position_at_a_place_is_told_of_it() -> None:
    """A parallelogram that is laid flat."""
    lengths = {"a": 1, "b": 2, "c": 1}
    bodies = {
        name: mbs.Body(mass=1, inertia={"Izz": 1}, points={"end": [x, 0, 0]}) for name, x in lengths.items()
    }
    joints = {
        "A": mbs.Revolute("ground", "a", q="a", initial={"q": 1, "known": True}),
        "B": mbs.Revolute("a.end", "b", q="b", initial={"q": -1}),
        "C": mbs.Revolute("ground.right", "c", q="c", initial={"q": 1}),
        "D": mbs.Revolute("b.end", "c.end"),
    }
    ground = mbs.Body(points={"right": [2, 0, 0]})
    flat = mbs.System("flat", bodies={"ground": ground, **bodies}, joints=joints)
    with pytest.raises(mbs.NoSolutionError, match=r"^at: the state is a singular position: .*choose one beside it"):
        mbs.linearize(flat, at={"a": 0, "b": 0, "c": 0})


def test_a_word_that_is_no_place_is_told_as_it_is_typed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "pendulum.yaml"
    file.write_text(PENDULUM, encoding="utf-8")
    assert main(["linearize", str(file), "--at", "foo"]) == 2
    assert "--at 'foo': write equilibrium or NAME=VALUE" in capsys.readouterr().err


def test_a_place_to_which_loops_close_without_inertia_is_told_as_such() -> None:
    arms = {name: mbs.Body(mass=1, points={"end": [1, 0, 0]}) for name in ("left", "right")}
    beam = mbs.Body(mass=1, com=[1, 0, 0], points={"left": [0, 0, 0], "right": [2, 0, 0]})
    hinges = {
        "a": mbs.Revolute("ground", "left", initial={"q": "60 deg"}),
        "c": mbs.Revolute("left.end", "beam.left"),
        "b": mbs.Revolute("ground.foot", "right"),
        "d": mbs.Revolute("right.end", "beam.right"),
    }
    bodies = {**arms, "beam": beam, "ground": mbs.Body(points={"foot": [2, 0, 0]})}
    flat = mbs.System("parallelogram of points of mass", gravity=[0, -9.81, 0], bodies=bodies, joints=hinges)
    assert mbs.linearize(flat, at={"a": 1.0, "u_a": 0.0}).states
    with pytest.raises(mbs.NoSolutionError, match="no inertia resists the speed u_a"):
        mbs.linearize(flat, at={"a": 0.0, "b": 0.0})
