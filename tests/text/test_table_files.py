"""Tables in files beside the model: read by their names, never more than that, every mistake with line and column."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main

MODEL = """\
multibody_sym: 1
name: motor
bodies: {rotor: {mass: 1, inertia: {Izz: 0.1}}}
joints: {A: {type: revolute, parent: ground, child: rotor, q: phi, initial: {u: 3}}}
forces: {drive: {type: torque, joint: A, value: tau}}
inputs:
  tau:
    of: u_phi
    interpolation: cubic
    table: {file: data/motor.csv}
simulation: {t_end: 0.2, samples: 3}
"""
ROWS = [[0, 2], [5, 1.5], [10, 0.25]]


def written(folder: Path, content: str | bytes, model: str = MODEL) -> Path:
    """Write a model and its table; return the model's file."""
    (folder / "data").mkdir(exist_ok=True)
    table = content if isinstance(content, bytes) else content.encode("utf-8")
    (folder / "data" / "motor.csv").write_bytes(table)
    (folder / "motor.yaml").write_text(model, encoding="utf-8")
    return folder / "motor.yaml"


@pytest.mark.parametrize(
    "content",
    [
        "0,2\n5,1.5\n10,0.25\n",
        "speed in rad/s, torque in N*m\r\n0, 2\r\n5, 1.5\r\n10, 0.25",
        "\ufeffspeed;torque\n+0;2.\n5.0;15e-1\n1e1;.25\n",
        "# measured\n\n0\t2\n  # again\n5\t1.5\n10\t0.25\n",
        '"speed","torque"\n"0","2"\n"5","1.5"\n"10","0.25"\n',
        "0 2\n5    1.5\n 10 0.25 \n",
    ],
)
def test_a_table_file_is_the_rows_it_holds(content: str, tmp_path: Path) -> None:
    rows = MODEL.replace("{file: data/motor.csv}", str(ROWS))
    found = mbs.load(written(tmp_path, content))
    assert found == mbs.loads(rows)
    assert mbs.loads(mbs.dumps(found)) == found


def test_a_run_follows_the_file(tmp_path: Path) -> None:
    """J w' = tau(w) on a straight line: w = w1 + (w0 - w1) exp(-t k/J), wherever the process stands."""
    model = MODEL.replace("interpolation: cubic", "interpolation: linear")
    file = written(tmp_path, "0,1\n10,0\n", model)
    run = mbs.simulate(mbs.load(file), backend="python")
    assert run["u_phi"] == pytest.approx(10 - 7 * np.exp(-run.t), rel=1e-8)


@pytest.mark.parametrize(
    ("content", "line", "column", "message"),
    [
        ("0,2\n5,x\n", 2, 3, "'x' is no number"),
        ("0,2\n5;1,5\n", 2, 3, "decimal point"),
        ("0,2\n5\n", 2, 1, "two columns"),
        ("0,2,3\n5,6,7\n", 1, 5, "two columns"),
        ("0,2\n5,1.5\n5,1\n", 3, 1, "does not come after 5"),
        ("a,b\nc,d\n", 2, 1, "'c' is no number"),
        ("0,2\n", 1, 1, "at least two rows"),
        ("", 1, 1, "at least two rows"),
        ("0,2\n1,1e999\n", 2, 3, "1e999"),
        ("0,nan\n1,2\n", 1, 3, "'nan' is no number"),
        ("0,2\n1," + "9" * 100 + "\n", 2, 3, "digits"),
        ("0,2\n1,__import__('os')\n", 2, 3, "is no number"),
        ("".join(f"{k},1\n" for k in range(60_000)) + "7,1\n", 60_001, 1, "7, which does not come after 59999"),
        ("0,2\n1,3,\n2,nan\n", 3, 3, "'nan' is no number"),
        (b"0,2\n5,\xff\n", 2, 3, "UTF-8"),
        (b"0,2\n5,\x00\n", 2, 3, "is no number"),
    ],
)
def test_a_mistake_is_told_with_its_place(
    content: str | bytes, line: int, column: int, message: str, tmp_path: Path
) -> None:
    with pytest.raises(mbs.InputError, match=message) as error:
        mbs.load(written(tmp_path, content))
    where = error.value.where
    assert (where.file, where.line, where.column) == (str(tmp_path / "data" / "motor.csv"), line, column)
    assert where.path == ("inputs", "tau", "table", "file")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("data/moter.csv", "no such file.*data/moter.csv"),
        ("/etc/passwd", "relative"),
        ("../motor.csv", "folder of the model"),
        ("data/../../motor.csv", "folder of the model"),
        ("data", "no regular file"),
        ("fifo", "no regular file"),
        ("link", "no regular file"),
        ("''", "empty"),
        ("large.csv", "at most"),
        ("data/motor.csv, columns: 2", "unknown key 'columns'"),
        ("[a, b]", "expected a name"),
    ],
)
def test_what_is_no_table_is_never_opened(name: str, message: str, tmp_path: Path) -> None:
    """Nothing hangs on a pipe or a device, nothing outside of the model's folder is named, nothing large is read."""
    file = written(tmp_path, "0,1\n1,2\n", MODEL.replace("data/motor.csv", name))
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "link").symlink_to("/dev/zero")
    (tmp_path / "large.csv").touch()
    os.truncate(tmp_path / "large.csv", 1 << 27)
    with pytest.raises(mbs.InputError, match=message) as error:
        mbs.load(file)
    if name != "large.csv":
        assert error.value.where.file == str(file)
        assert (error.value.where.line or 0) >= 10


def test_a_model_without_a_file_has_no_folder() -> None:
    with pytest.raises(mbs.ModelError, match="has no folder"):
        mbs.loads(MODEL)
    with pytest.raises(mbs.ModelError, match="rows"):
        mbs.Table({"file": "motor.csv"})


def test_the_command_reads_it_and_no_result_takes_its_place(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, table = written(tmp_path, "0,1\n10,0\n"), tmp_path / "data" / "motor.csv"
    assert main(["simulate", str(file), "--backend", "python", "-o", str(tmp_path / "out.csv")]) == 0
    assert main(["simulate", str(file), "--backend", "python", "-o", str(table)]) == 2
    assert "table of the model" in capsys.readouterr().err
    assert table.read_text() == "0,1\n10,0\n"


def test_a_table_of_100_000_rows_is_read_interpolated_and_run(tmp_path: Path) -> None:
    """tau = 0.1 cos(4 t) on a rotor of 0.1 kg m^2: w = 3 + sin(4 t)/4, read in the time of few other things."""
    t = np.linspace(0, 1, 100_000)
    content = "".join(f"{x!r},{y!r}\n" for x, y in zip(t.tolist(), (0.1 * np.cos(4 * t)).tolist(), strict=True))
    file = written(tmp_path, content, MODEL.replace("    of: u_phi\n", ""))
    begun = time.process_time()
    system = mbs.load(file)
    assert time.process_time() - begun < 5
    rows = system.inputs["tau"].table
    assert (len(rows), rows.x[7], rows.y[-1]) == (100_000, t[7], 0.1 * np.cos(4.0))
    run = mbs.simulate(system)
    assert run["u_phi"] == pytest.approx(3 + np.sin(4 * run.t) / 4, abs=1e-8)
