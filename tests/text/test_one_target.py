"""Several writers of one file, and files that are no files: nothing is torn, who loses is told, pipes stay pipes."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from multibody_sym.errors import OutputError
from multibody_sym.text.files import file_state, write_whole
from multibody_sym.text.tables import Table, growing_csv, read_table, write_table

ROOT = Path(__file__).parents[2]


def table_of(value: float, rows: int = 3) -> Table:
    return Table({"t": np.arange(float(rows)), "x": np.full(rows, value)})


# --- one target ----------------------------------------------------------------------------------------------------


def test_two_growing_tables_of_one_name_do_not_meet(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    with growing_csv(path, ["x"]) as first:
        first([[1.0]])
        with growing_csv(path, ["x"]) as second:
            second([[2.0]])
            first([[1.0]])
            second([[2.0]])
            assert sorted(os.listdir(tmp_path)) == ["run.2.csv.partial", "run.csv.partial"]
            assert list(read_table(tmp_path / "run.2.csv.partial").columns["x"]) == [2, 2]
        first([[1.0]])
    assert (second.place, first.place) == (str(path), str(tmp_path / "run.2.csv"))
    assert list(read_table(path).columns["x"]) == [2, 2]
    assert list(read_table(tmp_path / "run.2.csv").columns["x"]) == [1, 1, 1]
    assert sorted(os.listdir(tmp_path)) == ["run.2.csv", "run.csv"]


@pytest.mark.parametrize("ending", [".csv", ".npz"])
def test_a_target_that_changed_meanwhile_is_kept(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"run{ending}"
    for before in (None, table_of(0.0)):
        if before is not None:
            write_table(before, path)
        begin = file_state(path)
        write_table(table_of(1.0), path)
        (tmp_path / f"run.2{ending}").write_text("the user's own")
        assert write_table(table_of(2.0), path, begin) == str(tmp_path / f"run.3{ending}")
        assert set(read_table(path).columns["x"]) == {1.0}
        assert set(read_table(tmp_path / f"run.3{ending}").columns["x"]) == {2.0}
        assert (tmp_path / f"run.2{ending}").read_text() == "the user's own"
        (tmp_path / f"run.3{ending}").unlink()


def test_names_beside_a_target_are_as_the_user_named_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    begin = file_state("run.csv")
    assert write_table(table_of(1.0), "run.csv") == "run.csv"
    assert write_table(table_of(2.0), "run.csv", begin) == "run.2.csv"


def test_a_partial_file_that_was_taken_away_is_told(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"run\.csv\.partial: .*taken away"), growing_csv(tmp_path / "run.csv", ["x"]):
        os.replace(tmp_path / "run.csv.partial", tmp_path / "elsewhere")


WRITER = """
import sys
import numpy as np
from multibody_sym.text.files import file_state
from multibody_sym.text.tables import Table, growing_csv, write_table
path, number, ending = sys.argv[1], float(sys.argv[2]), sys.argv[3]
begin = file_state(path)
print("ready", flush=True)
sys.stdin.readline()
if ending == ".csv":
    with growing_csv(path, ["t", "x"], begin) as append:
        for k in range(50):
            append(np.array([[10.0 * k + i, number] for i in range(10)]))
    place = append.place
else:
    place = write_table(Table({"t": np.arange(500.0), "x": np.full(500, number)}), path, begin)
print(place)
"""


@pytest.mark.parametrize(("writers", "rounds"), [(3, 1), pytest.param(16, 10, marks=pytest.mark.long)])
@pytest.mark.parametrize("ending", [".csv", ".npz"])
def test_of_many_writers_one_has_the_target_and_the_others_are_told(
    tmp_path: Path, ending: str, writers: int, rounds: int
) -> None:
    for turn in range(rounds):
        folder = tmp_path / str(turn)
        folder.mkdir()
        path = folder / f"run{ending}"
        places = written_at_once(path, writers, ending)
        assert len(set(places)) == writers
        assert sorted(os.listdir(folder)) == sorted(os.path.basename(place) for place in places)
        assert str(path) in places
        for number, place in enumerate(places):
            table = read_table(place)
            assert table.columns["t"].tolist() == list(range(500))
            assert set(table.columns["x"]) == {float(number)}


def written_at_once(path: Path, writers: int, ending: str) -> list[str]:
    """Return where each of several processes says that its table is."""
    started = [
        subprocess.Popen(
            [sys.executable, "-c", WRITER, str(path), str(number), ending],
            env={**os.environ, "PYTHONPATH": str(ROOT)}, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )
        for number in range(writers)
    ]
    for process in started:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
    for process in started:
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
    return [process.communicate(timeout=120)[0].strip() for process in started]


# --- no files ------------------------------------------------------------------------------------------------------


class Reader(threading.Thread):
    """Reads a pipe by its name to its end."""

    def __init__(self, path: Path) -> None:
        super().__init__(daemon=True)
        self.path, self.content = path, b""
        self.start()

    def run(self) -> None:
        self.content = self.path.read_bytes()


def test_a_pipe_is_written_through_and_stays(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    os.mkfifo(path)
    for write in (lambda: write_table(table_of(1.0), path), lambda: grown(path)):
        reader = Reader(path)
        assert write() == str(path)
        reader.join(10)
        assert reader.content == b"t,x\n0.0,1.0\n1.0,1.0\n2.0,1.0\n"
        assert stat.S_ISFIFO(path.stat().st_mode)
        assert os.listdir(tmp_path) == ["run.csv"]


def grown(path: Path, before: Callable[[], None] = lambda: None) -> str:
    with growing_csv(path, ["t", "x"]) as append:
        before()
        append(next(table_of(1.0).blocks()))
    return append.place


def test_a_device_stays_one(tmp_path: Path) -> None:
    (tmp_path / "run.csv").symlink_to("/dev/null")
    assert grown(tmp_path / "run.csv") == str(tmp_path / "run.csv")
    write_table(table_of(1.0), tmp_path / "run.csv")
    assert os.readlink(tmp_path / "run.csv") == "/dev/null"
    assert Path("/dev/null").is_char_device()
    assert os.listdir(tmp_path) == ["run.csv"]


@pytest.mark.skipif(not Path("/dev/stdout").exists(), reason="no /dev/stdout here")
def test_standard_output_that_is_a_pipe_is_written_to() -> None:
    code = "from multibody_sym.text.files import write_whole; write_whole('/dev/stdout', b'content')"
    run = [sys.executable, "-c", code]
    done = subprocess.run(run, env={**os.environ, "PYTHONPATH": str(ROOT)}, stdout=subprocess.PIPE, check=True)
    assert done.stdout == b"content"


def test_a_pipe_that_nobody_reads_any_more_is_told(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    os.mkfifo(path)
    reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    with pytest.raises(OutputError, match="Broken pipe"):
        grown(path, before=lambda: os.close(reader))


def test_errors_of_a_run_that_writes_to_a_pipe_are_its_own() -> None:
    def fail() -> None:
        raise ValueError("the run's")

    with pytest.raises(ValueError, match="the run's"):
        grown(Path("/dev/null"), before=fail)


def test_a_folder_is_no_target(tmp_path: Path) -> None:
    with pytest.raises(OutputError):
        write_whole(tmp_path, b"x")
    assert os.listdir(tmp_path) == []
