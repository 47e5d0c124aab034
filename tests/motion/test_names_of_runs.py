"""Runs and studies as maps from names to columns, and as frames of other libraries."""

from __future__ import annotations

import numpy as np
import pytest

import multibody_sym as mbs

MODEL = """
multibody_sym: 1
name: pendulum
gravity: [0, -9.81, 0]
parameters: {m: {value: 1 kg, positive: true}}
bodies: {bob: {mass: m, com: [0, -0.5 m, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, q: theta, initial: {q: 30 deg}}}
forces: {drive: {type: torque, joint: hinge, value: F}}
inputs: {F: sin(t)}
outputs: {pull: "fy(hinge)"}
simulation: {t_end: 0.2 s, samples: 5}
"""


@pytest.fixture(scope="module")
def run() -> mbs.Trajectory:
    return mbs.simulate(mbs.loads(MODEL))


def test_names_lead_to_columns(run: mbs.Trajectory) -> None:
    assert run.keys() == ("theta", "u_theta", "pull", "F")
    assert list(run) == list(run.keys())
    assert "theta" in run
    assert "t" not in run
    assert all(run[name].shape == (5,) for name in run)


def test_frames_hold_the_table(run: mbs.Trajectory) -> None:
    pandas = pytest.importorskip("pandas")
    frame = run.to_dataframe("deg")
    assert isinstance(frame, pandas.DataFrame)
    assert list(frame.columns) == ["theta", "u_theta", "pull"]
    np.testing.assert_array_equal(frame.index, run.t)
    np.testing.assert_allclose(frame["theta"], np.degrees(run["theta"]), rtol=1e-15)
    assert frame.attrs["units"]["theta"] == "deg"
    assert frame.attrs["system"] == "pendulum"


def test_datasets_hold_units(run: mbs.Trajectory) -> None:
    pytest.importorskip("xarray")
    data = run.to_xarray()
    np.testing.assert_array_equal(data["pull"].values, run["pull"])
    assert data["theta"].attrs["units"] == "rad"
    assert data["t"].attrs["units"] == "s"


def test_all_results_have_one_face(run: mbs.Trajectory) -> None:
    study, table = mbs.sweep(mbs.loads(MODEL), {"m": [1, 2]}, samples=3), run.table()
    for result in (run, run([0.1, 0.2]), study, table):
        names = result.keys()
        assert list(result) == list(names)
        assert all(name in result and len(result[name]) == len(result) for name in names)
        assert "no such name" not in result
        for wrong in ("no such name", 3, None):
            with pytest.raises(mbs.InputError):
                result[wrong]
        assert result.to_numpy().shape[0] == len(result)
    assert table.keys() == ("t", "theta", "u_theta", "pull")
    assert [repr(run(t)) for t in ([0.1, 0.2], 0.1)] == [
        "<Motion of pendulum: t = 0.1 to 0.2 s>", "<Motion of pendulum: t = 0.1 s>"
    ]  # fmt: skip
    np.testing.assert_array_equal(run.to_numpy("deg")[:, 1], np.degrees(run["theta"]))
    np.testing.assert_array_equal(study.to_numpy()[:, 1], study["m"])
    pytest.importorskip("pandas")
    assert run.to_dataframe().equals(table.to_dataframe())
    pytest.importorskip("xarray")
    assert run.to_xarray().equals(table.to_xarray())


def test_studies_are_maps_too() -> None:
    study = mbs.sweep(mbs.loads(MODEL), {"m": [1, 2]}, samples=3)
    assert "m" in study
    assert list(study) == list(study.keys())
    assert study["m"].tolist() == [1.0, 2.0]
