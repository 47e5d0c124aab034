"""`--units`: what people read is in the units that they choose, what programs read stays SI and says so."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import EXAMPLES

from multibody_sym.cli.main import main
from multibody_sym.text.tables import read_table

MODEL = """
multibody_sym: 1
name: swing
gravity: [0, -g, 0]
parameters: {m: 2 kg, l: 0.5 m, g: 10 m/s^2, k: 3, M0: 4 N*m}
bodies: {rod: {mass: m, com: [0, -l, 0]}, car: {mass: m}}
joints:
  A: {type: revolute, parent: ground, child: rod, q: a, initial: {q: 90 deg, u: -1}}
  B: {type: prismatic, parent: ground, child: car, axis: x, q: x, initial: {q: 0.25 m, u: 2}}
inputs: {M: M0*cos(a)}
forces: {motor: {type: torque, joint: A, value: M}, spring: {type: spring_damper, joint: B, stiffness: 8}}
outputs: {height: "position(rod, y)", load: "reaction(B, fy)", energy: total_energy(), pull: k*x}
ask: {moment: M, weight: m*g, unknown: k*x, far: {of: car, after: 0 s}}
"""


@pytest.fixture
def model(tmp_path: Path) -> str:
    file = tmp_path / "swing.yaml"
    file.write_text(MODEL)
    return str(file)


def printed(capsys: pytest.CaptureFixture[str], *words: str) -> list[str]:
    assert main(list(words)) == 0
    return capsys.readouterr().out.splitlines()


def test_solve_tells_units_and_takes_others(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    lines = printed(capsys, "solve", model)
    assert "  x'' = -2/m = -1 m/s^2" in lines
    assert any(line.startswith("  weight = ") and line.endswith(" = 20 N") for line in lines)
    assert any(line.startswith("  moment = ") and line.endswith(" N*m") for line in lines)
    other = printed(capsys, "solve", model, "--units", "mm,deg,kN")
    assert "  x'' = -2/m = -1000 mm/s^2" in other
    assert any(line.startswith("  a'' = ") and line.endswith(f" = {math.degrees(-20):.6g} deg/s^2") for line in other)
    assert any(line.startswith("  weight = ") and line.endswith(" = 0.02 kN") for line in other)
    assert [line for line in lines if "unknown" in line] == [line for line in other if "unknown" in line]


def test_json_stays_in_si_units_and_names_them(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    def asked_both(*words: str) -> list[Any]:
        return [json.loads(printed(capsys, *words, "--json", *more)[0]) for more in ((), ("--units", "mm,deg"))]

    plain, asked = asked_both("solve", model)
    assert plain == asked
    assert plain["units"] == {"a": "rad", "x": "m", "u_a": "rad/s", "u_x": "m/s"}
    assert {name: x["unit"] for name, x in plain["answers"].items()} == {
        "moment": "N*m", "weight": "N", "unknown": "", "far": "m",
    }
    plain, asked = asked_both("simulate", model, "--t-end", "0.1", "--samples", "3", "--backend", "python")
    assert plain["coordinates"] == asked["coordinates"]
    assert plain["units"] == asked["units"] == {
        "t": "s", "coordinates": {"a": "rad", "x": "m"}, "speeds": {"u_a": "rad/s", "u_x": "m/s"},
        "outputs": {"height": "m", "load": "N", "energy": "J", "pull": ""},
    }


def test_equilibrium_and_linearize_tell_units(
    model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    still = tmp_path / "still.yaml"
    rest = MODEL.replace("q: 90 deg, u: -1", "q: 0").replace("q: 0.25 m, u: 2", "q: 0")
    still.write_text(rest.replace("M0*cos(a)", "0*M0"))
    assert "stable: a = 0 deg, x = 0 mm" in printed(capsys, "equilibrium", str(still), "--units", "deg,mm")
    assert "stable: a = 0 rad, x = 0 m" in printed(capsys, "equilibrium", str(still))
    lines = printed(capsys, "linearize", str(still))
    assert lines[0] == "linearised in a [rad], x [m], u_a [rad/s], u_x [m/s]"
    assert "eigenvalues in 1/s" in lines
    other = printed(capsys, "linearize", str(still), "--units", "deg,mm,ms")
    assert other[0] == "linearised in a [deg], x [mm], u_a [deg/ms], u_x [mm/ms]"
    assert "  +- 0.002 i   (0.3183 Hz, damping ratio 0)" in other[other.index("eigenvalues in 1/ms") :]


def test_a_and_b_are_in_the_units_that_stand_above_them(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """From a cart's speed in mm/s to the acceleration of a pole in deg/s^2, by hand from the SI matrices."""
    cart = str(EXAMPLES / "cart_pole.yaml")
    given = [matrices(printed(capsys, "linearize", cart, *words)) for words in ((), ("--units", "mm,deg"))]
    (names, A, B), (other_names, other_A, other_B) = given
    sizes = np.array([1e3 if "[m" in name else 180 / math.pi for name in names])
    assert [name.replace("mm", "m").replace("deg", "rad") for name in other_names] == names
    assert other_A == pytest.approx(A * sizes[:, None] / sizes, rel=1e-4)
    assert other_B == pytest.approx(B * sizes[:, None], rel=1e-4)
    assert np.abs(A).max() > 1.0


def matrices(lines: list[str]) -> tuple[list[str], np.ndarray, np.ndarray]:
    names = lines[0].removeprefix("linearised in ").split(", ")
    a, b, c = lines.index("A"), *(next(k for k, x in enumerate(lines) if x.startswith(word)) for word in ("B (", "C ("))
    A, B = (np.array([line.split() for line in lines[i + 1 : j]], dtype=float) for i, j in ((a, b), (b, c)))
    return names, A, B


def test_a_run_tells_its_end_in_chosen_units(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = ("simulate", model, "--t-end", "0.5", "--samples", "3", "--backend", "python", "--digits", "10")
    plain, other = printed(capsys, *words), printed(capsys, *words, "--units", "mm,deg,ms,kJ")
    assert other[0] == "swing: done at t = 500 ms of 500 ms, 3 samples"
    assert numbers(other, "x") == (pytest.approx(1e3 * numbers(plain, "x")[0]), "mm")
    assert numbers(other, "u_a") == (pytest.approx(math.degrees(numbers(plain, "u_a")[0]) / 1e3), "deg/ms")
    assert any(line.startswith("total energy 0.0045 kJ at the start; it changed by at most ") for line in other)


def numbers(lines: list[str], name: str) -> tuple[float, str]:
    ((value, unit),) = [line.split()[1:] for line in lines if line.startswith(f"  {name} ")]
    return float(value), unit


@pytest.mark.parametrize("ending", [".csv", ".npz"])
def test_csv_names_the_units_that_were_chosen_and_other_tables_stay_si(model: str, tmp_path: Path, ending: str) -> None:
    words = ("simulate", model, "--t-end", "0.5", "--samples", "3", "--backend", "python", "--digits", "10")
    plain, other = tmp_path / f"plain{ending}", tmp_path / f"other{ending}"
    assert main([*words, "-o", str(plain)]) == 0
    assert main([*words, "-o", str(other), "--units", "mm,deg"]) == 0
    si, told = read_table(plain), read_table(other)
    assert list(si.columns) == ["t", "a", "x", "u_a", "u_x", "height", "load", "energy", "pull"]
    if ending == ".npz":
        assert told.units == si.units
        assert si.units["height"] == "m"
        assert "pull" not in si.units
        assert np.array_equal(told.columns["x"], si.columns["x"])
        return
    with other.open(newline="") as file:
        header = next(csv.reader(file))
    assert header == [
        "t [s]", "a [deg]", "x [mm]", "u_a [deg/s]", "u_x [mm/s]", "height [mm]", "load [N]", "energy [J]", "pull",
    ]
    assert told.columns["x [mm]"] == pytest.approx(1e3 * si.columns["x"])
    assert told.columns["u_a [deg/s]"] == pytest.approx(np.degrees(si.columns["u_a"]))
    assert np.array_equal(told.columns["pull"], si.columns["pull"])


@pytest.mark.parametrize("name", ["check", "solve", "equilibrium", "linearize", "simulate"])
def test_a_wrong_unit_is_an_error_that_lists_units(
    name: str, model: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([name, model, "--units", "mm,furlong", "--json"]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert error["message"].startswith("'furlong' is not a unit; known: m, g, s, N, ")
    assert error["where"]["path"] == "--units"
