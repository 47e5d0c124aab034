"""Tables: what is written reads back to the same bits, in every format, and also after a kill."""

import csv
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from multibody_sym.errors import InputError, OutputError
from multibody_sym.text import tables
from multibody_sym.text.tables import Table, growing_csv, read_table, table_format, write_table

STRANGE = [0.1, -0.0, 1 / 3, 5e-324, 1.7976931348623157e308, np.nan, np.inf, -np.inf, 1e22, 123456789.123456789]
TABLE = Table(
    {"t": np.arange(10) / 10, "phi": np.array(STRANGE), 'pin, "x"': np.ones(10)},
    {"t": "s", "phi": "rad"},
    {"model": "pendulum", "steps": 12, "drift": 1e-13},
)


def same_bits(a: Table, b: Table) -> bool:
    return list(a.columns) == list(b.columns) and all(
        np.array_equal(a.columns[n].view(np.uint64), b.columns[n].view(np.uint64)) for n in a.columns
    )


@pytest.mark.parametrize("ending", [".csv", ".npz", ".parquet", ".CSV"])
def test_tables_read_back(tmp_path, ending):
    if ending == ".parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / f"run{ending}"
    write_table(TABLE, path)
    back = read_table(path)
    assert same_bits(back, TABLE)
    if ending.lower() != ".csv":
        assert (back.units, back.metadata) == (TABLE.units, TABLE.metadata)
    assert os.listdir(tmp_path) == [path.name]


@given(values=st.lists(st.floats(width=64), min_size=1, max_size=30))
def test_csv_keeps_every_bit(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("csv") / "x.csv"
    table = Table({"x": np.where(np.isnan(values), np.nan, values)})
    write_table(table, path)
    assert same_bits(read_table(path), table)


def test_csv_is_what_others_read(tmp_path):
    write_table(TABLE, tmp_path / "run.csv")
    with open(tmp_path / "run.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["t"]) for row in rows] == list(TABLE.columns["t"])
    assert list(rows[0]) == ["t", "phi", 'pin, "x"']


def test_npz_is_what_numpy_reads_without_pickle(tmp_path):
    write_table(TABLE, tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz", allow_pickle=False) as archive:
        assert np.array_equal(archive["phi"], TABLE.columns["phi"], equal_nan=True)


@pytest.mark.parametrize("ending", [".csv", ".npz"])
def test_equal_tables_give_equal_bytes(tmp_path, ending):
    for name in ("a", "b"):
        write_table(TABLE, tmp_path / (name + ending))
    assert (tmp_path / f"a{ending}").read_bytes() == (tmp_path / f"b{ending}").read_bytes()


def test_an_empty_table(tmp_path):
    write_table(Table({"t": np.empty(0), "x": np.empty(0)}), tmp_path / "empty.csv")
    assert list(read_table(tmp_path / "empty.csv").columns) == ["t", "x"]


NO_TABLES = [{"a": [1.0], "b": [1.0, 2.0]}, {"a": [[1.0]]}, {"": [1.0]}, {"a\n": [1.0]}, {"__metadata__": [1.0]}]


@pytest.mark.parametrize("columns", NO_TABLES)
def test_columns_that_are_no_table(columns):
    with pytest.raises(ValueError, match="column"):
        Table(columns)


@pytest.mark.parametrize("name", ["run.xls", "run", "run.csv.gz", ""])
def test_other_endings_are_refused(name):
    with pytest.raises(InputError, match=r"\.csv, \.npz, \.parquet"):
        table_format(name)


def test_a_failed_write_keeps_the_old_result(tmp_path, monkeypatch):
    write_table(TABLE, tmp_path / "run.npz")
    before = (tmp_path / "run.npz").read_bytes()

    def fails(file, values, allow_pickle):
        file.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np.lib.format, "write_array", fails)
    with pytest.raises(OutputError, match="No space left"):
        write_table(TABLE, tmp_path / "run.npz")
    assert (tmp_path / "run.npz").read_bytes() == before
    assert os.listdir(tmp_path) == ["run.npz"]


def test_without_pyarrow_parquet_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(OutputError, match=r"multibody_sym\[parquet\]"):
        write_table(TABLE, tmp_path / "run.parquet")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("content", [b"", b"t,x\n1\n", b"t\nword\n", b"\xff\xfe", b"PK\x03\x04broken"])
@pytest.mark.parametrize("ending", [".csv", ".npz"])
def test_files_that_hold_no_table(tmp_path, content, ending):
    path = tmp_path / f"x{ending}"
    path.write_bytes(content)
    with pytest.raises(InputError, match="the table cannot be read"):
        read_table(path)


def test_pickled_arrays_are_not_loaded(tmp_path):
    np.savez(tmp_path / "x.npz", __metadata__=np.array({"a": 1}, dtype=object))
    with pytest.raises(InputError):
        read_table(tmp_path / "x.npz")


# --- CSV that grows ---


def test_growing_csv(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("an older result")
    with growing_csv(path, ["t", "x"]) as append:
        append(np.array([[0.0, 1.0], [0.1, 2.0]]))
        assert len(read_table(f"{path}.partial")) == 2
        assert path.read_text() == "an older result"
        append(np.array([[0.2, 3.0]]))
        assert len(read_table(f"{path}.partial")) == 3
    assert list(read_table(path).columns["x"]) == [1, 2, 3]
    assert os.listdir(tmp_path) == ["run.csv"]


def interrupted_after(append):
    append(np.array([[0.0]]))
    raise KeyboardInterrupt


def test_a_run_that_fails_keeps_its_part_and_the_older_result(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("an older result")
    with pytest.raises(KeyboardInterrupt), growing_csv(path, ["t"]) as append:
        interrupted_after(append)
    assert path.read_text() == "an older result"
    assert len(read_table(f"{path}.partial")) == 1
    with growing_csv(path, ["t"]) as append:
        append(np.array([[1.0], [2.0]]))
    assert len(read_table(path)) == 2
    assert sorted(os.listdir(tmp_path)) == ["run.csv", "run.csv.partial.old"]


def test_growing_csv_says_when_the_disk_is_full(tmp_path, monkeypatch):
    (tmp_path / "run.csv").write_text("older")

    def fails(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fails)
    with pytest.raises(OutputError, match="No space left"), growing_csv(tmp_path / "run.csv", ["t"]) as append:
        append(np.array([[0.0]]))
    assert (tmp_path / "run.csv").read_text() == "older"
    with pytest.raises(OutputError, match="No such file"), growing_csv(tmp_path / "no" / "run.csv", ["t"]):
        pass


WRITER = """
import sys
import numpy as np
from multibody_sym.text.tables import growing_csv
with growing_csv(sys.argv[1], ["t", "x"]) as append:
    for k in range(10**9):
        append(np.array([[k, 0.1 * k]] * 7))
        print(k, flush=True)
"""


def test_after_kill_9_everything_appended_is_readable(tmp_path):
    package = Path(tables.__file__).parents[2]
    path = tmp_path / "run.csv"
    environment = {**os.environ, "PYTHONPATH": str(package)}
    process = subprocess.Popen([sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, env=environment)
    lines = [process.stdout.readline() for _ in range(20)]
    process.send_signal(signal.SIGKILL)
    process.wait()
    lines += process.stdout.readlines()
    process.stdout.close()
    appended = len([line for line in lines if line.endswith(b"\n")])
    table = read_table(f"{path}.partial")
    assert len(table) >= 7 * appended >= 140
    assert np.array_equal(table.columns["x"], 0.1 * table.columns["t"])
    assert not path.exists()


def test_a_torn_last_line_is_left_out(tmp_path):
    (tmp_path / "run.csv.partial").write_text("t,x\n0.0,1.0\n0.1,2.5\n0.2,3.")
    assert list(read_table(tmp_path / "run.csv.partial").columns["x"]) == [1.0, 2.5]


def test_names_are_no_formulas_for_spreadsheets(tmp_path):
    names = ["=1+1", "+x", "-x", "@x", "x=1"]
    table = Table({name: np.zeros(1) for name in names})
    write_table(table, tmp_path / "run.csv")
    header = next(csv.reader((tmp_path / "run.csv").read_text().splitlines()))
    assert header == ["'=1+1", "'+x", "'-x", "'@x", "x=1"]
    assert list(read_table(tmp_path / "run.csv").columns) == names


@pytest.mark.parametrize("room", [0, 2])
def test_a_full_disk_leaves_no_partial_file_without_rows(tmp_path: Path, room: int) -> None:
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
    try:
        with pytest.raises(OutputError, match="File too large"), growing_csv(tmp_path / "run.csv", ["t", "x"]):
            pass
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert os.listdir(tmp_path) == []
