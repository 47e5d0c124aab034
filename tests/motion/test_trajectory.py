"""What a run knows of itself: names, tables, JSON, figures."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.text.tables import read_table, write_table

EXAMPLES = Path(__file__).parents[2] / "examples"
TOP = (
    "{multibody_sym: 1, name: top, bodies: {b: {mass: 1, inertia: {Ixx: 1, Iyy: 2, Izz: 3}}},"
    " joints: {ball: {type: spherical, parent: ground, child: b, initial: {u: [1, 2, 3]}}}, simulation: {t_end: 1}}"
)
CLASH = (
    "{multibody_sym: 1, name: clash, parameters: {w: 2}, bodies: {b: {mass: 1}}, inputs: {F: w*t},"
    " joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x}},"
    " forces: {f: {type: torque, joint: j, value: F}},"
    " outputs: {x: 7*x, t: 2*t, $name_: u_x}, simulation: {t_end: 3, samples: 4}}"
)


@pytest.fixture(scope="module")
def clash() -> mbs.Trajectory:
    return mbs.simulate(mbs.loads(CLASH))


def test_names_find_coordinates_first_then_speeds_outputs_inputs(clash: mbs.Trajectory) -> None:
    assert np.allclose(clash["x"], clash.t**3 / 3)
    assert np.allclose(clash["u_x"], clash.t**2)
    assert np.allclose(clash.outputs["x"], 7 * clash["x"])
    assert np.allclose(clash["t"], 2 * clash.t)
    assert np.allclose(clash["F"], 2 * clash.t)
    with pytest.raises(mbs.InputError, match="did you mean u_x"):
        clash["u_xx"]


def test_table_has_a_column_for_each(clash: mbs.Trajectory, tmp_path: Path) -> None:
    table = clash.table()
    assert list(table.columns) == ["t", "x", "u_x", "output x", "output t", "$name_"]
    assert table.units == {"t": "s", "x": "m", "u_x": "m/s", "$name_": "m/s"}
    write_table(table, tmp_path / "clash.npz")
    assert np.array_equal(read_table(tmp_path / "clash.npz").columns["output x"], clash.outputs["x"])


def test_json_is_json(clash: mbs.Trajectory) -> None:
    assert json.loads(json.dumps(clash.as_json(), allow_nan=False))["outputs"]["x"][-1] == pytest.approx(63.0)


def test_no_number_is_none_in_json() -> None:
    system = mbs.loads(CLASH.replace("7*x", "log(t - 1.5)"))
    values = mbs.simulate(system).as_json()["outputs"]["x"]
    assert values[:2] == [None, None]
    assert values[3] == pytest.approx(np.log(1.5))


def test_quaternions_stay_units_and_momentum_stays() -> None:
    run = mbs.simulate(mbs.loads(TOP))
    names = [f"ball_q{x}" for x in "wxyz"]
    assert np.allclose(sum(run[name] ** 2 for name in names), 1.0, rtol=0, atol=1e-14)
    assert 0.0 < run.drift["quaternion"] < 1e-6
    squared = sum((inertia * run[f"ball_w{x}"]) ** 2 for inertia, x in zip((1, 2, 3), "xyz", strict=True))
    assert np.allclose(squared, squared[0], rtol=1e-8)


def test_it_shows_itself_in_a_line(clash: mbs.Trajectory) -> None:
    assert repr(clash) == "<Trajectory of clash: 4 samples to t = 3 s>"


def test_figures_take_every_name_as_it_stands(clash: mbs.Trajectory, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    figure = clash.plot(tmp_path / "clash.svg")
    labels = [text.get_text() for axis in figure.axes for text in axis.get_legend().get_texts()]
    x = "$\\mathit{x}$"
    assert sorted(labels) == sorted([x, "$\\dot{\\mathit{x}}$", "\\$name_", "output x", "output t"])
    assert (tmp_path / "clash.svg").read_text().lstrip().startswith("<?xml")
    (line,) = (line for axis in figure.axes for line in axis.get_lines() if line.get_label() == x)
    assert np.array_equal(line.get_ydata(), clash["x"])
    with pytest.raises(mbs.OutputError, match="'xyz'"):
        clash.plot(tmp_path / "clash.xyz")


UNITS = (
    "{multibody_sym: 1, name: units, parameters: {K: 3 N/m, k: 3, m: 2 kg},"
    " bodies: {b: {mass: m}, c: {mass: m, com: [1, 0, 0]}}, joints:"
    " {j: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {u: 1}},"
    " h: {type: revolute, parent: ground, child: c, q: a, initial: {u: 2}}},"
    " outputs: {pull: K*x, lever: k*x, push: -K*x, way: 2*x}, simulation: {t_end: 1, samples: 3}}"
)


def test_axes_and_tables_tell_units_where_they_are_known() -> None:
    pytest.importorskip("matplotlib")
    run = mbs.simulate(mbs.loads(UNITS), backend="python")
    figures = run.plot(), run.plot(units="mm,deg,ms")
    plain, chosen = ([axis.get_ylabel() for axis in figure.axes] for figure in figures)
    assert plain == [
        "pull, push [N]", "lever", "way [m]", "$\\mathit{x}$ [m]", "$\\mathit{a}$ [deg]",
        "$\\dot{\\mathit{x}}$ [m/s]", "$\\dot{\\mathit{a}}$ [rad/s]",
    ]  # fmt: skip
    others = {"m]": "mm]", "m/s]": "mm/ms]", "rad/s]": "deg/ms]"}
    assert chosen == [f"{name}[{others.get(unit, unit)}" if bracket else name
                      for name, bracket, unit in (label.partition("[") for label in plain)]  # fmt: skip
    assert [figure.axes[-1].get_xlabel() for figure in figures] == ["t [s]", "t [ms]"]
    t, x = figures[1].axes[3].get_lines()[0].get_data()
    assert np.allclose([t, x], [1e3 * run.t, 1e3 * run["x"]])
    table = run.table(units=["mm", "kN"])
    assert table.units == {
        "t": "s", "x": "mm", "a": "rad", "u_x": "mm/s", "u_a": "rad/s", "pull": "kN", "push": "kN", "way": "mm",
    }
    assert np.allclose(table.columns["pull"], run["pull"] / 1e3)
    assert np.array_equal(table.columns["lever"], run["lever"])
    with pytest.raises(mbs.InputError, match="'furlong' is not a unit; known: m, "):
        run.plot(units="furlong")
