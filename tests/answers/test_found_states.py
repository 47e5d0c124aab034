"""`solve` finds the state of what holds one way only, from files that say nothing of directions; none, and several."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from test_solved_modes import HEAD, PULLED, RAMP, RIDGE

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.documents.solution import solution_text

ROD = """
parameters: {g: 9.81, mu: 2, theta: 1.3, w: 0, v: -8, m: 1 kg, l: 1 m}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  rod: {mass: m, inertia: {Izz: m*l^2/3}, com: [l, 0, 0], points: {end: [0, 0, 0]}}
joints: {J: {type: planar, parent: ground, child: rod, q: [x, y, phi], initial: {q: [0, 0, theta], u: [v, 0, w]}}}
contacts: {c: {between: [rod.end, ground.floor], static: mu}}
"""


def solve(model: str, **parameters: float) -> mbs.Solution:
    return mbs.solve(mbs.loads(HEAD + model), parameters)


def test_nobody_gives_directions() -> None:
    pulled, ridge = solve(PULLED), solve(RIDGE)
    assert pulled.states == {"c1": "slide-", "c2": "slide-"}
    assert ridge.states == {"c1": "slide-", "c2": "slide-"}
    assert pulled.accelerations["K_x"].value == pytest.approx(-3.5906618162532906, rel=1e-12)
    assert ridge.reactions["string"]["tension"].value == pytest.approx(6.114993217231683, rel=1e-12)
    right = solve(PULLED, F1=5, F2=30)
    assert right.states == {"c1": "slide+", "c2": "slide+"}
    assert solve(PULLED, F1=6).states == {"c1": "stick", "c2": "stick"}


def test_a_state_is_that_of_two_coefficients() -> None:
    """Between them a block that rests stays, and one that moves goes on."""
    assert solve(RAMP, a=0.6).states == {"c1": "stick"}
    moving = RAMP.replace("child: block}", "child: block, initial: {u: [-cos(a), -sin(a)]}}")
    assert solve(moving, a=0.6).states == {"c1": "slide-"}
    assert solve(RAMP, a=0.7).states == {"c1": "slide-"}


def test_painleve_s_rod_that_has_no_state(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "rod.yaml"
    file.write_text(HEAD + ROD)
    assert main(["solve", str(file), "--json"]) == 3
    error = json.loads(capsys.readouterr().out)["error"]
    assert error["code"] == "no_solution"
    assert "contact and friction together: all 2 modes" in error["message"]


def test_painleve_s_rod_that_has_several() -> None:
    solution = solve(ROD, theta=0.9, w=-4)
    assert solution.verdict == "several"
    assert [solution.states, *(other.states for other in solution.others)] == [{"c": "open"}, {"c": "slide-"}]
    (other,) = solution.others
    sine, cosine = math.sin(0.9), math.cos(0.9)
    normal = (9.81 - 16 * sine) / (1 - 3 * cosine * (2 * sine - cosine))
    turns = 3 * normal * (2 * sine - cosine)
    assert other.accelerations["x"] == pytest.approx(2 * normal + sine * turns + 16 * cosine, rel=1e-12)
    assert other.accelerations["phi"] == pytest.approx(turns, rel=1e-12)
    assert other.accelerations["y"] == 0.0
    assert 0.0 < other.errors["y"] < 1e-12
    told = solution_text(solution)
    assert "the laws leave several motions: this is one of them, and nothing says which one happens" in told
    moved = ", ".join(f"{name} {x:.6g}" for name, x in other.accelerations.items())
    assert f"  another: c slide-: accelerations {moved}\n" in told + "\n"
    assert ", y 0, " in told


def test_the_paradox_is_a_condition() -> None:
    """N is positive over an apparent mass that is, and the paradox begins where that vanishes, for mu = 4/3."""
    solution = solve(ROD, theta=0.15, w=2)
    assert solution.conditions[1] == "3*cos(theta)^2 + 1 > 3*mu*cos(theta)*sin(theta)"
    assert solution.limits[solution.conditions[0]] == "c opens"


TOUCHING = """
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, lid: {plane: [0, 0, 0], normal: -y}}}
  w: {mass: 2}
joints: {j: {type: point, parent: ground, child: w, q: [x, y]}}
contacts:
"""


def lines(contacts: str) -> str:
    return solution_text(mbs.solve(mbs.loads(f"multibody_sym: 1\nname: m\ngravity: [0, -10, 0]\n{TOUCHING}{contacts}")))


def test_a_coefficient_of_zero_is_a_smooth_contact() -> None:
    assert "\n  c is closed\n" in lines("  c: {between: [w, ground.floor], static: 0}\n")
    assert "\n  c sticks: friction 0 N of at most 4 N\n" in lines("  c: {between: [w, ground.floor], static: 0.2}\n")


def test_friction_under_a_normal_force_that_is_not_unique_has_no_limit_that_is_told() -> None:
    both = "".join(f"  {x}: {{between: [w, ground.{x}], static: 0.2}}\n" for x in ("floor", "lid"))
    told = lines(both)
    assert "\n  floor sticks: friction that is not unique\n" in told
    assert "\n  lid sticks: friction that is not unique\n" in told


def test_friction_that_is_always_enough_is_not_said_to_be_needless_where_it_is_not_unique() -> None:
    """A ladder at 20 deg would slide without friction at either end."""
    model = """
multibody_sym: 1
name: ladder
gravity: [0, -9.81, 0]
parameters: {th: 20 deg}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: -x}}}
  l: {shape: {rod: 2, mass: 4}, points: {a: [0, 0, 0], b: [2, 0, 0]}}
joints: {j: {type: planar, parent: ground, child: l, initial: {q: [-2*cos(th), 0, th]}}}
contacts:
  foot: {between: [l.a, ground.floor], static: enough}
  head: {between: [l.b, ground.wall], static: enough}
"""
    told = solution_text(mbs.solve(mbs.loads(model)))
    assert "\n  foot sticks: friction that is not unique\n" in told
    assert "\n  head sticks: friction that is not unique\n" in told
    assert "no friction is needed" not in told


def test_what_slides_in_a_joint_is_told_by_its_body_and_the_joint() -> None:
    model = """
multibody_sym: 1
name: slope
gravity: [2, -9.81, 0]
bodies: {block: {mass: 2}}
joints: {slide: {type: prismatic, parent: ground, child: block, axis: x, q: s}}
forces: {rub: {type: friction, joint: slide, static: 0.1, kinetic: 0.1}}
"""
    assert mbs.solve(mbs.loads(model)).found == (
        "rub slides forward: block starts to move along the axis of slide",
    )
