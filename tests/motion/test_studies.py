"""Studies: plans, rows that are those of single runs, tables in all formats, failures as rows."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.errors import ArgumentError, InputError, OutputError
from multibody_sym.motion.loop import native_loop
from multibody_sym.motion.sweep import rows
from multibody_sym.motion.sweep import study as studies
from multibody_sym.motion.sweep.plan import axes_of, plan_of
from multibody_sym.motion.sweep.rows import StudyRows, unnamed_journal
from multibody_sym.pictures.plots import PlottedCurve, typeset

PENDULUM = """
multibody_sym: 1
name: pendulum
gravity: [0, -g, 0]
parameters: {m: {value: 1 kg, positive: true}, l: {value: 0.5 m, positive: true}, g: 9.81}
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta, initial: {q: 0.5}}}
outputs: {height: -l*cos(theta)}
stop: {low: theta < -0.3}
simulation: {t_end: 1, samples: 21, rtol: 1e-6}
"""


@pytest.fixture(scope="module")
def system() -> mbs.System:
    return mbs.loads(PENDULUM)


def test_each_row_is_what_simulate_finds_for_its_values(system: mbs.System) -> None:
    study = mbs.sweep(system, {"l": [0.3, 0.7], "theta": "10:50:3 deg"})
    assert len(study) == 6
    assert study.varied == ("l", "theta")
    assert study["l"].tolist() == [0.3] * 3 + [0.7] * 3
    assert study["theta"].tolist() == pytest.approx(np.radians([10, 30, 50, 10, 30, 50]).tolist(), rel=1e-15)
    for k in range(6):
        run = mbs.simulate(system, parameters={"l": study["l"][k]}, initial={"theta": study["theta"][k]})
        assert study["t"][k] == run.t_final
        for name, values in {"theta": run["theta"], "u_theta": run["u_theta"], "height": run["height"]}.items():
            assert study[f"{name} end"][k] == values[-1]
            assert (study[f"{name} min"][k], study[f"{name} max"][k]) == (values.min(), values.max())
        stop = run.stop
        told = "" if stop is None else f"stop low at {stop['t']!r}"
        assert study["events"][k] == told
    assert any(study["events"] != "")


def test_floats_make_no_expressions_and_are_the_numbers_that_their_digits_are_read_as(
    system: mbs.System, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = [0.1, 1 / 3, -0.0, 5e-324, 1.7976931348623157e308, -2.5e-7]
    (read,) = axes_of(system, {"theta": [Fraction(repr(x)) for x in given]})
    monkeypatch.setattr("multibody_sym.motion.sweep.plan.scalar", None)
    (axis,) = axes_of(system, {"theta": np.array(given)})
    assert np.array(axis.values).tobytes() == np.array(read.values).tobytes()


def test_the_structures_of_a_family_are_made_once(system: mbs.System, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Any] = []
    own = native_loop.method_struct

    def method_struct(method: Any) -> Any:
        made.append(method)
        return own(method)

    monkeypatch.setattr("multibody_sym.motion.loop.native_loop.method_struct", method_struct)
    asked = mbs.loads(PENDULUM.partition("stop:")[0] + "simulation: {t_end: 0.01, samples: 2}")
    runs = [make(None) for make in mbs.prepare(asked).runs({"l": np.linspace(0.5, 1, 100).tolist()}, {})]
    assert len({run["theta"][-1] for run in runs}) == 100
    assert len(made) == 1


def test_a_function_of_a_run_makes_the_columns(system: mbs.System) -> None:
    def half_height(run: Any) -> dict[str, float]:
        return {"half": run["height"][-1] / 2, "m": float(len(run))}

    study = mbs.sweep(system, {"m": [1, 2]}, reduce=half_height)
    assert study.results == ("half", "found m")
    assert study["half"][0] == mbs.simulate(system)["height"][-1] / 2


def test_a_run_that_fails_is_a_row_with_its_reason(system: mbs.System) -> None:
    study = mbs.sweep(system, {"l": [0.5, -1.0, 0.7]})
    assert list(study.failures) == [1]
    assert "it is declared positive" in study.failures[1]
    assert np.isnan(study["theta end"][1])
    assert np.isfinite(study["theta end"][[0, 2]]).all()


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        (lambda _: 1 / 0, "ZeroDivisionError: division by zero"),
        (lambda _: {"x": "one"}, "it is to return numbers; x is 'one'"),
        (lambda _: {"x": 10**400}, "x is larger than any float"),
        (lambda _: [1], "it is to return a map from names to numbers, got [1]"),
        (lambda _: {1: 1}, "it is to name its numbers by text, not 1"),
        (lambda _: {}["a\nb\udc80"], "KeyError: 'a\\nb\\udc80'"),
    ],
)
def test_a_run_of_which_reduce_makes_nothing_is_a_row_with_its_reason(
    tmp_path: Path, system: mbs.System, wrong: Any, reason: str
) -> None:
    def reduce(run: Any) -> Any:
        return {"x": run.parameters[1]} if run.parameters[1] < 0.7 else wrong(run)

    study = mbs.sweep(system, {"l": [0.5, 0.9, 0.6]}, reduce=reduce, key="x", output=tmp_path / "o.csv")
    assert study.failures == {1: f"reduce failed: {reason}"}
    assert study["x"][[0, 2]].tolist() == [0.5, 0.6]
    assert np.isnan(study["x"][1])


def test_a_reduce_that_fails_for_all_of_the_first_runs_ends_the_study(tmp_path: Path, system: mbs.System) -> None:
    out, vary, calls = tmp_path / "o.csv", {"l": [-1.0, *np.linspace(0.5, 0.9, 2999)]}, []

    def wrong(run: Any) -> Any:
        calls.append(run)
        return run["no such column"]

    with pytest.raises(InputError, match=r"^reduce failed for l = 0\.5: InputError: .*no such column"):
        mbs.sweep(system, vary, reduce=wrong, key="wrong", output=out, workers=1)
    assert len(calls) < 2000
    assert list(tmp_path.iterdir()) == []
    found = mbs.sweep(system, {"l": [0.5] * 19 + [0.9] * 2}, reduce=lambda run: {"x": 1 / int(run.parameters[1] > 0.7)})
    assert list(found.failures) == list(range(19))
    assert found["x"][19:].tolist() == [1.0, 1.0]


def test_a_study_without_numbers_that_failed_nowhere_is_not_said_to_have(system: mbs.System) -> None:
    pytest.importorskip("matplotlib")
    with pytest.raises(InputError, match="no run gave a number"):
        mbs.sweep(system, {"l": [0.5, 0.9]}, reduce=lambda _: {}).plot()


def test_a_setting_that_a_varied_parameter_makes_wrong_is_a_row_with_its_reason() -> None:
    text = PENDULUM.replace("g: 9.81}", "g: 9.81, T: 1}").replace("t_end: 1", "t_end: 2*T")
    study = mbs.sweep(mbs.loads(text), {"T": [0.1, -1, 0.2]})
    assert study["t"][[0, 2]].tolist() == [0.2, 0.4]
    assert study["failure"].tolist() == ["", "simulation.t_end: expected a positive number, got -2", ""]


def test_results_hang_on_values_alone(system: mbs.System) -> None:
    vary = {"l": (0.2, 0.9, 40)}
    one, four = mbs.sweep(system, vary, workers=1), mbs.sweep(system, vary, workers=4)
    alone = mbs.sweep(system, {"l": [one["l"][17]]})
    for name in one.columns:
        if name != "run":
            assert one[name].tobytes() == four[name].tobytes()
            assert one[name][17] == alone[name][0]


@pytest.mark.parametrize("sobol", [False, True])
def test_samples_are_told_by_seed_and_number_alone(system: mbs.System, sobol: bool) -> None:
    vary = {"l": (0.2, 0.9), "m": [1, 2, 3], "theta": (0.1, 0.5, 3)}
    axes = axes_of(system, vary)
    plan, other = plan_of(axes, 600, 7, sobol), plan_of(axes, 600, 8, sobol)
    found = plan.values(0, 600)
    assert plan.values(251, 270).tobytes() == found[251:521].tobytes() != other.values(251, 270).tobytes()
    assert plan_of(axes, 300, 7, sobol).values(0, 300).tobytes() == found[:300].tobytes()
    assert 0.2 <= found[:, 0].min() < 0.21
    assert 0.89 < found[:, 0].max() <= 0.9
    assert set(found[:, 1]) == {1, 2, 3}
    assert set(found[:, 2]) == {0.1, 0.3, 0.5}
    # a mean of n samples misses by 1/sqrt(12 n) of the range at random, by about 1/n evenly
    assert abs(found[:, 0].mean() - 0.55) < 0.7 * (2 / 600 if sobol else 4 / np.sqrt(12 * 600))
    study = mbs.sweep(system, vary, sample=3, seed=7, sobol=sobol)
    assert np.column_stack([study[name] for name in vary]).tobytes() == found[:3].tobytes()


@pytest.mark.parametrize("ending", ["csv", "npz", "parquet"])
def test_tables_hold_the_study(tmp_path: Path, system: mbs.System, ending: str) -> None:
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    file = tmp_path / f"o.{ending}"
    kept, told = mbs.sweep(system, {"l": [0.5, -1, 0.7]}), mbs.sweep(system, {"l": [0.5, -1, 0.7]}, output=file)
    assert [x.name for x in tmp_path.iterdir()] == [file.name]
    assert list(told.columns) == list(kept.columns)
    for name in kept.columns:
        assert told[name].tolist() == kept[name].tolist() or np.array_equal(told[name], kept[name], equal_nan=True)
    assert told.failures == kept.failures


@pytest.mark.parametrize("ending", ["csv", "npz", "parquet"])
def test_tables_have_the_same_bytes_whatever_parts_rows_came_in(
    tmp_path: Path, system: mbs.System, ending: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    monkeypatch.setattr(rows, "_GROUP", 1)
    monkeypatch.setattr(rows, "_LEAST_GROUP", 7)
    files = [tmp_path / f"{most}.{ending}" for most in (2, 5, 2000)]
    for file, most in zip(files, (2, 5, 2000), strict=True):
        monkeypatch.setattr(studies, "_MOST_ROWS", most)
        mbs.sweep(system, {"l": (0.2, 0.9, 18)}, output=file, workers=1)
    first, *others = (file.read_bytes() for file in files)
    assert others == [first] * 2
    if ending == "parquet":
        parquet = pytest.importorskip("pyarrow.parquet").ParquetFile(files[0])
        assert [parquet.metadata.row_group(k).num_rows for k in range(parquet.num_row_groups)] == [7, 7, 4]
        assert parquet.read()["run"].to_pylist() == list(range(18))


def test_a_long_text_does_not_make_an_npz_long(tmp_path: Path, system: mbs.System) -> None:
    columns = {"events": ["", "x" * 2000], "failure": ["", ""]}
    content = rows.Content(plan_of(axes_of(system, {"l": (0.2, 0.9, 1000)})), unnamed_journal(), {})
    for first in range(0, 1000, 2):
        content.journal.add(StudyRows(first, (), np.empty((2, 0)), columns))
    path = rows.write(content, str(tmp_path / "o.npz"))
    assert Path(path).stat().st_size < 100_000  # of 8 MB
    with np.load(path) as archive:
        assert archive["events"].tolist() == ["", "x" * 2000] * 500


def test_frames_and_datasets_hold_the_study(system: mbs.System) -> None:
    pytest.importorskip("pandas")
    xarray = pytest.importorskip("xarray")
    study = mbs.sweep(system, {"l": [0.5, 0.6, 0.7], "m": [1, 2]})
    frame, data = study.to_dataframe(), study.to_xarray()
    assert frame["theta end"][3] == study["theta end"][3]
    assert float(data["theta end"].sel(l=0.6, m=2)) == study["theta end"][3]
    drawn = mbs.sweep(system, {"l": (0.5, 0.7)}, sample=3).to_xarray()
    assert isinstance(drawn, xarray.Dataset)
    assert drawn["l"].dims == ("run",)
    assert data["theta end"].attrs["units"] == "rad"
    assert data["l"].attrs["units"] == "m"
    twice = mbs.sweep(system, {"l": [0.6, 0.5, 0.6]}).to_xarray()
    assert twice["l"].dims == ("run",)
    assert twice["theta end"].values.tolist() == [float(data["theta end"].sel(l=l, m=1)) for l in (0.6, 0.5, 0.6)]
    assert mbs.sweep(system, rows=[{"l": 0.5}, {"l": 0.7}]).to_xarray()["l"].dims == ("run",)


@pytest.mark.parametrize("name", ["pandas", "xarray"])
def test_what_is_not_installed_is_told(system: mbs.System, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, name, None)
    study = mbs.sweep(system, {"l": [0.5]})
    with pytest.raises(OutputError, match=f"pip install {name}"):
        study.to_dataframe() if name == "pandas" else study.to_xarray()


@pytest.mark.parametrize(
    ("vary", "more", "message"),
    [
        ({"mm": [1]}, {}, "did you mean m"),
        ({"thet": [1]}, {}, "did you mean theta"),
        ({}, {}, "nothing is varied"),
        ({"l": []}, {}, "no values"),
        ({"l": "1:2"}, {}, "how many values"),
        ({"l": "1:2:-3"}, {}, "no count"),
        ({"l": "1:2:3:4"}, {}, "two ends and a count"),
        ({"l": "1,,2"}, {}, "no range and no list"),
        ({"l": "1 m,2"}, {}, "a unit with the last value"),
        ({"l": "1,2 s"}, {}, "a quantity in m"),
        ({"theta": "1,2 kg"}, {}, "quantity in rad"),
        ({"l": "m,2"}, {}, "no number"),
        ({"l": [float("nan")]}, {}, "not finite"),
        ({"l": np.ones((2, 2))}, {}, r"expected a number or an expression, got array"),
        ({"l": "1:2:1000000000"}, {}, "no count of values, at least 1 and at most 100000000"),
        ({"l": (1, 2, 10**5000)}, {}, "no count of values"),
        ({"l": [1, 2]}, {"sample": 3, "seed": 10**22}, "at least 0 and at most 9223372036854775807"),
        ({"l": [1, 2]}, {"workers": 10**5000}, "number of workers"),
        ({"l": [1, 2]}, {"workers": True}, "number of workers"),
        ({"l": [1, 2]}, {"sample": 10**12}, "at least 1 and at most 1073741824"),
        ({"l": [1, 2]}, {"sample": 0}, "at least 1"),
        ({"l": [1, 2]}, {"sample": -4}, "at least 1"),
        ({"l": [1, 2]}, {"seed": 4}, "seed is for samples"),
        ({"l": [1, 2]}, {"sobol": True}, "sobol is for samples"),
        ({"l": [1, 2]}, {"workers": 0}, "number of workers"),
        ({"l": [1, 2]}, {"t_end": -1}, "t_end"),
        ({"l": [1, 2]}, {"formalism": "lagrang"}, "formalism"),
        ({"l": [1, 2]}, {"output": "a.txt"}, ".csv"),
    ],
)
def test_what_is_wrong_is_told(system: mbs.System, vary: Any, more: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        mbs.sweep(system, vary, **more)


def test_arguments_of_other_kinds_are_told(system: mbs.System) -> None:
    for vary, more in (([1], {}), ({"l": 3}, {}), ({"l": [1]}, {"reduce": 3}), ({"l": [1]}, {"executor": 3})):
        with pytest.raises(ArgumentError):
            mbs.sweep(system, vary, **more)
    with pytest.raises(InputError, match=r"reduce failed for l = 1: KeyError: 'x'"):
        mbs.sweep(system, {"l": [1]}, reduce=lambda run: {}["x"])


def test_names_and_texts_of_a_table_are_no_remarks(tmp_path: Path, system: mbs.System) -> None:
    def reduce(run: Any) -> dict[str, float]:
        if run.parameters[1] > 0.7:
            raise ValueError('nothing, "#1"')
        return {"#h": 1.0, 'a,"b"': 2.0}

    study = mbs.sweep(system, {"l": [0.5, 0.9]}, reduce=reduce, key="x", output=tmp_path / "o.csv")
    assert study.results == ("#h", 'a,"b"')
    frame = pytest.importorskip("pandas").read_csv(tmp_path / "o.csv", comment="#")
    assert list(frame) == ["run", "l", "#h", 'a,"b"', "events", "failure"]
    assert frame["failure"][1] == study.failures[1] == 'reduce failed: ValueError: nothing, "#1"'


def test_what_is_wrong_with_an_option_is_told_of_no_place_in_the_model(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "m.yaml"
    model.write_text(PENDULUM)
    assert main(["sweep", str(model), "--vary", "l="]) == 2
    told = capsys.readouterr().err
    assert "--vary 'l=': write NAME=VALUES" in told
    assert "m.yaml" not in told


def test_a_figure_that_is_a_folder_is_told_before_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    model, folder = tmp_path / "m.yaml", tmp_path / "f.png"
    model.write_text(PENDULUM)
    folder.mkdir()
    monkeypatch.setattr("multibody_sym.cli.commands.sweep._swept", None)
    assert main(["sweep", str(model), "--vary", "l=.5,.6", "--plot", str(folder)]) == 4
    assert "it is a folder" in capsys.readouterr().err


def test_figures_are_families_and_maps(tmp_path: Path, system: mbs.System) -> None:
    pytest.importorskip("matplotlib")
    family = mbs.sweep(system, {"l": [0.9, 0.2, 0.5]}).plot(tmp_path / "a.png", show=["height max"])
    assert family.axes[0].lines[0].get_xdata().tolist() == [0.2, 0.5, 0.9]
    study = mbs.sweep(system, {"l": [0.2, 0.5, 0.9], "theta": [0.3, 0.4]})
    drawn = study.plot(show=["height max"])
    assert np.array_equal(drawn.axes[0].collections[0].get_array().ravel(), study["height max"])
    points = mbs.sweep(system, {"l": (0.2, 0.9), "theta": (0.3, 0.4)}, sample=5).plot(show=["height max"])
    assert points.axes[0].collections[0].get_offsets().shape == (5, 2)
    with pytest.raises(InputError, match="did you mean height max"):
        study.plot(show=["height mx"])


def test_a_figure_of_a_sweep_has_a_panel_for_each_unit_its_legend_beside_it_and_every_curve(system: mbs.System) -> None:
    pytest.importorskip("matplotlib")
    study = mbs.sweep(system, {"l": [0.2, 0.5, 0.9]})
    drawn = study.plot(units="deg,cm")
    units = [axis.get_ylabel().partition("[")[2].rstrip("]") for axis in drawn.axes]
    assert len(set(units)) == len(units)
    assert "deg" in units
    assert drawn.axes[-1].get_xlabel() == "l [cm]"
    changing = {name for name in study.results if np.ptp(study[name]) > 0}
    names = {typeset(PlottedCurve(name, study["l"], study["l"])): name for name in changing}
    shown = {names[line.get_label().partition(",")[0]]: line for axis in drawn.axes for line in axis.lines}
    assert set(shown) == changing
    angle = next(name for name in changing if name.startswith("theta "))
    assert shown[angle].get_ydata() == pytest.approx(np.degrees(study[angle]))
    drawn.canvas.draw()
    for axis in drawn.axes:
        assert axis.get_legend().get_window_extent().x0 >= axis.get_window_extent().x1


def test_rows_are_runs_of_their_own_values(system: mbs.System, tmp_path: Path) -> None:
    given = [{"l": "30 cm", "theta": 0.4}, {"theta": "10 deg", "l": 0.7}, {"l": 0.3, "theta": 0.4}]
    study = mbs.sweep(system, rows=given)
    assert study.varied == ("l", "theta")
    assert study["l"].tolist() == [0.3, 0.7, 0.3]
    assert study["theta"] == pytest.approx([0.4, np.radians(10), 0.4])
    for k in range(3):
        run = mbs.simulate(system, parameters={"l": study["l"][k]}, initial={"theta": study["theta"][k]})
        assert study["height end"][k] == run["height"][-1]
    assert study.to_numpy()[:, 1].tolist() == study["l"].tolist()
    kept = mbs.sweep(system, rows=given, output=tmp_path / "out.csv")
    assert kept["height end"].tolist() == study["height end"].tolist()
    with ThreadPoolExecutor(2) as pool:  # the way of Dask's executor: the task goes there pickled
        assert mbs.sweep(system, rows=given, executor=pool)["height end"].tolist() == study["height end"].tolist()
    study.plot(tmp_path / "rows.png", show="height end")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"rows": []}, "rows is to be a list of maps"),
        ({"rows": {"l": [1]}}, "rows is to be a list of maps"),
        ({"rows": [{}]}, "nothing is varied: each row names"),
        ({"rows": [{"l": 1}, {"m": 1}]}, r"rows\.1: all rows name the same values"),
        ({"rows": [{"l": 1}, {"l": "x"}]}, r"rows\.1\.l: "),
        ({"rows": [{"l": 1}, {"l": "2 kg"}]}, r"rows\.1\.l\.?.*: '2 kg' does not fit"),
        ({"rows": [{"l": 1}, {"l": float("nan")}]}, r"rows\.1\.l: nan is not finite"),
        ({"rows": [{"ll": 1}]}, "rows: no parameter, coordinate or speed is called 'll'; did you mean l"),
        ({"rows": [{1: 1}]}, "rows: no parameter, coordinate or speed is called 1"),
        ({"rows": [{"l": 1}], "vary": {"l": [1]}}, "rows say all values of each run: leave vary out"),
        ({"rows": [{"l": 1}], "sample": 2}, "leave sample out"),
        ({}, "nothing is varied"),
    ],
)
def test_wrong_rows(system: mbs.System, given: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        mbs.sweep(system, **given)


def test_rows_of_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model, table = tmp_path / "pendulum.yaml", tmp_path / "rows.csv"
    model.write_text(PENDULUM)
    table.write_text("l,theta\n0.3,0.4\n0.7,0.1\n")
    out = tmp_path / "out.npz"
    assert main(["sweep", str(model), "--rows", str(table), "-o", str(out)]) == 0
    found = rows.read(str(out))[0]
    assert found["l"].tolist() == [0.3, 0.7]
    assert found["theta"].tolist() == [0.4, 0.1]
    table.write_text("l,no\n0.3,0.4\n")
    assert main(["sweep", str(model), "--rows", str(table)]) == 2
    assert "no parameter, coordinate or speed is called 'no'" in capsys.readouterr().err
    assert main(["sweep", str(model), "--rows", str(table), "--vary", "l=1,2"]) == 2
    assert main(["sweep", str(model), "--rows", str(table), "-o", str(table)]) == 2
    assert main(["sweep", str(model)]) == 2
