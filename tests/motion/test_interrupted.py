"""Studies that are killed, interrupted, that meet a full disk or lose a worker: the same call goes on."""

from __future__ import annotations

import os
import random
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.errors import ArgumentError, InputError, OutputError
from multibody_sym.motion.sweep import rows as tables
from multibody_sym.motion.sweep import study as studies
from multibody_sym.motion.sweep.rows import ENDING, Journal, StudyRow, StudyRows, open_journal

MOST = 2**30
ROOT = Path(__file__).parents[2]
PENDULUM = """
multibody_sym: 1
name: pendulum
gravity: [0, -9.81, 0]
parameters: {l: {value: 0.5, positive: true}}
bodies: {bob: {mass: 1, com: [0, -l, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta, initial: {q: 0.5}}}
simulation: {t_end: 1, samples: 3, rtol: 1e-6}
"""
@pytest.fixture(scope="module")
def system() -> mbs.System:
    return mbs.loads(PENDULUM)


def journal_of(path: Path) -> Journal:
    """Return what is in a journal, whatever study it is of."""
    with closing(sqlite3.connect(path)) as database:
        begun = database.execute("SELECT name FROM sqlite_master WHERE name = 'study'").fetchall()
        ((key,),) = database.execute("SELECT key FROM study").fetchall() if begun else (("",),)
    return open_journal(str(path), key, MOST)


# --- the journal -----------------------------------------------------------------------------------------------------


def rows(first: int, count: int) -> StudyRows:
    numbers = range(first, first + count)
    return StudyRows.of(first, [StudyRow({"x": float(k)}, "e" * (k % 2), "f" * (k % 3)) for k in numbers])


def test_a_journal_whose_log_is_cut_anywhere_keeps_what_was_whole(tmp_path: Path) -> None:
    """What a power cut leaves: of parts that are in the log alone those before the cut."""
    file, log, whole = tmp_path / "j", tmp_path / "j-wal", tmp_path / "whole"
    journal, ends = open_journal(str(file), "key", MOST), []
    for first, count in ((0, 3), (8, 1), (3, 2)):
        ends.append((log.stat().st_size, list(journal.spans)))
        journal.add(rows(first, count))
    ends.append((log.stat().st_size, list(journal.spans)))
    shutil.copytree(tmp_path, whole)
    journal.discard()
    for size in {*range(ends[0][0], ends[-1][0] + 1, 701), *(end for end, _ in ends)}:
        shutil.copy(whole / "j", file)
        log.write_bytes((whole / "j-wal").read_bytes()[:size])
        again = open_journal(str(file), "key", MOST)
        kept = [spans for end, spans in ends if end <= size][-1]
        assert again.spans == sorted(kept)
        found = [(part.first, part.numbers.tolist(), part.texts) for part in again]
        assert found == [(f, rows(f, e - f).numbers.tolist(), rows(f, e - f).texts) for f, e in again.spans]
        again.add(rows(20, 1))
        again.close()
        assert not log.exists()
        again = open_journal(str(file), "key", MOST)
        assert again.spans[-1] == (20, 21)
        again.close()


def test_rows_come_back_with_the_same_bits(tmp_path: Path) -> None:
    values = np.array([[0.0, -0.0, np.nan, np.inf, 5e-324, -1 / 3]])
    journal = open_journal(str(tmp_path / "j"), "key", MOST)
    journal.add(StudyRows(7, tuple("abcdef"), values, {"events": ["a\nb\0 \u00b0"], "failure": [""]}))
    (found,) = journal
    assert found.numbers.tobytes() == values.tobytes()
    assert (found.first, found.names, found.texts["events"]) == (7, tuple("abcdef"), ["a\nb\0 \u00b0"])
    journal.close()


def test_what_is_left_is_what_is_in_no_span() -> None:
    assert list(Journal(sqlite3.connect(""), "", []).left(3)) == [(0, 3)]
    assert list(Journal(sqlite3.connect(""), "", [(4, 6), (0, 2)]).left(9)) == [(2, 4), (6, 9)]
    assert list(Journal(sqlite3.connect(""), "", [(0, 2), (2, 9)]).left(9)) == []


# --- kill -9 ---------------------------------------------------------------------------------------------------------


def started(system: mbs.System, out: Path, log: Path) -> int:
    """Return the number of a process, a copy of this one, that does a study and logs each of its runs."""
    child = os.fork()
    if child:
        return child
    code = 1
    try:
        file = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)

        def logged(run: Any) -> dict[str, float]:
            os.write(file, b"%d\n" % round(run.parameters[0] - 1))
            return {"x": run["theta"][-1]}

        studies._SECONDS = 0.02  # more parts than in life
        mbs.sweep(system, {"l": (1, 300, 300)}, reduce=logged, key="logged", output=out, workers=2)
        code = 0
    finally:
        os._exit(code)


def kills(system: mbs.System, folder: Path, count: int, seed: int) -> None:
    """Kill studies at random times; none loses a row or has one twice, and none that was kept is computed again."""
    chance, done, study = random.Random(seed), 0, 0
    whole = mbs.sweep(system, {"l": (1, 300, 300)}, reduce=lambda run: {"x": run["theta"][-1]})
    while done < count:
        out, log = folder / f"{study}.csv", folder / f"{study}.log"
        study += 1  # one that is over before it is killed gives place to another
        journal, kept = Path(f"{out}{ENDING}"), Counter[int]()
        log.touch()
        while not out.exists():
            before, child = log.stat().st_size, started(system, out, log)
            time.sleep(chance.expovariate(20))
            os.kill(child, signal.SIGKILL)
            ended = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
            assert ended in (0, -signal.SIGKILL)
            done += ended != 0
            computed = Counter(map(int, log.read_bytes()[before:].split(b"\n")[:-1]))
            assert not computed.keys() & kept.keys()
            assert set(computed.values()) <= {1}
            if journal.exists():
                found = journal_of(journal)
                kept = Counter(k for first, end in found.spans for k in range(first, end))
                found.close()
                assert set(kept.values()) <= {1}
        found = tables.read(str(out))[0]
        assert found["run"].tolist() == list(range(300))
        assert found["x"].tobytes() == whole["x"].tobytes()


def test_a_study_that_is_killed_goes_on(tmp_path: Path, system: mbs.System) -> None:
    kills(system, tmp_path, 10, seed=1)


@pytest.mark.long
def test_studies_that_are_killed_go_on_a_hundred_times(tmp_path: Path, system: mbs.System) -> None:
    kills(system, tmp_path, 100, seed=2)


# --- Ctrl-C, full disks, others ------------------------------------------------------------------------------------


def test_ctrl_c_keeps_the_results(tmp_path: Path) -> None:
    model, out = tmp_path / "m.yaml", tmp_path / "o.csv"
    model.write_text(PENDULUM)
    words = ["sweep", str(model), "--vary", "l=1:300:100000", "--samples", "1001", "-o", str(out)]
    start = [sys.executable, "-m", "multibody_sym", *words]
    process = subprocess.Popen(start, stderr=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(ROOT)}, text=True)
    journal, log = Path(f"{out}{ENDING}"), Path(f"{out}{ENDING}-wal")
    while process.poll() is None and not (log.exists() and log.stat().st_size > 60_000):
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate()
    assert process.returncode == 130
    assert "Traceback" not in told
    assert "runs are kept" in told
    assert len(journal_of(journal)) > 0
    assert not out.exists()


def test_a_full_disk_is_told_and_what_was_kept_is_used(
    tmp_path: Path, system: mbs.System, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, vary = tmp_path / "o.csv", {"l": (0.5, 1.0, 1200)}
    add = Journal.add

    def full(journal: Journal, found: StudyRows) -> None:
        if len(journal) > 5:
            journal.database.execute("PRAGMA max_page_count = 1")  # no page more than there are
        add(journal, found)

    with monkeypatch.context() as patched:
        patched.setattr(Journal, "add", full)
        with pytest.raises(OutputError, match=r"disk is full.*\d+ runs are kept.*same call goes on"):
            mbs.sweep(system, vary, output=out, workers=1)
    journal = journal_of(Path(f"{out}{ENDING}"))
    kept = len(journal)
    journal.close()
    assert kept > 5
    study = mbs.sweep(system, vary, output=out, workers=1)
    assert study.computed == 1200 - kept
    assert study["theta end"].tobytes() == mbs.sweep(system, vary)["theta end"].tobytes()


def test_a_file_that_may_not_grow_is_told_and_the_study_goes_on(tmp_path: Path, system: mbs.System) -> None:
    resource = pytest.importorskip("resource")
    out, told, vary = tmp_path / "o.csv", tmp_path / "told", {"l": (0.5, 1.0, 2000)}
    child = os.fork()
    if not child:
        try:
            resource.setrlimit(resource.RLIMIT_FSIZE, (65536, resource.RLIM_INFINITY))
            studies._SECONDS = 0.002  # more parts than in life
            mbs.sweep(system, vary, output=out, workers=1)
        except OutputError as error:
            told.write_text(str(error))
        finally:
            os._exit(0)
    os.waitpid(child, 0)
    journal = journal_of(Path(f"{out}{ENDING}"))
    kept = len(journal)
    journal.close()
    assert re.search(rf"disk I/O error.*{kept} runs are kept.*same call goes on", told.read_text(), re.DOTALL)
    assert 0 < kept < 2000
    assert not out.exists()
    study = mbs.sweep(system, vary, output=out, workers=1)
    assert study.computed == 2000 - kept
    assert study["theta end"].tobytes() == mbs.sweep(system, vary)["theta end"].tobytes()


def test_a_table_that_cannot_be_written_costs_no_run(
    tmp_path: Path, system: mbs.System, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, vary = tmp_path / "o.npz", {"l": (0.5, 1.0, 4)}
    with monkeypatch.context() as patched:
        patched.setattr("multibody_sym.text.files.os.fsync", lambda _: (_ for _ in ()).throw(OSError(28, "full")))
        with pytest.raises(OutputError):
            mbs.sweep(system, vary, output=out)
    assert mbs.sweep(system, vary, output=out).computed == 0


def test_the_journal_of_another_study_is_left_alone(tmp_path: Path, system: mbs.System) -> None:
    out = tmp_path / "o.csv"
    journal = Path(f"{out}{ENDING}")

    def failing(run: Any) -> dict[str, float]:
        if run.parameters[0] > 0.8:
            raise KeyboardInterrupt
        return {"x": 1.0}

    with pytest.raises(KeyboardInterrupt):
        mbs.sweep(system, {"l": (0.5, 1.0, 40)}, reduce=failing, key="ones", output=out, workers=1)
    before = journal.read_bytes()
    for vary, more in (({"l": (0.5, 1.0, 41)}, {}), ({"l": (0.5, 1.0, 40)}, {"t_end": 2})):
        with pytest.raises(InputError, match="another study"):
            mbs.sweep(system, vary, reduce=failing, key="ones", output=out, **more)
    assert journal.read_bytes() == before
    journal.write_bytes(b"something else")
    with pytest.raises(InputError, match="is no journal"):
        mbs.sweep(system, {"l": [1]}, output=out)
    assert journal.read_bytes() == b"something else"


def test_two_processes_do_not_write_one_study(tmp_path: Path, system: mbs.System) -> None:
    out = tmp_path / "o.csv"

    def again(run: Any) -> dict[str, float]:
        with pytest.raises(OutputError, match="another process"):
            mbs.sweep(system, {"l": [1]}, output=out)
        return {"x": 1.0}

    assert mbs.sweep(system, {"l": [1]}, reduce=again, key="again", output=out)["x"] == 1.0
    for wrong in (tmp_path, tmp_path / "none" / "o.csv"):
        with pytest.raises((OutputError, InputError)):
            mbs.sweep(system, {"l": [1]}, output=wrong)


def test_a_command_that_cannot_write_ends_with_four(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "m.yaml"
    model.write_text(PENDULUM)
    assert main(["sweep", str(model), "--vary", "l=1,2", "-o", str(tmp_path / "none" / "o.csv")]) == 4
    assert main(["sweep", str(model), "--vary", "l=-1,-2"]) == 3
    assert main(["sweep", str(model), "--vary", "L=1"]) == 2
    assert main(["sweep", str(model)]) == 2
    assert "defect" not in capsys.readouterr().err


# --- executors -------------------------------------------------------------------------------------------------------


def test_processes_find_the_same_bits(system: mbs.System) -> None:
    with ProcessPoolExecutor(2) as pool:
        found = mbs.sweep(system, {"l": (0.5, 1.0, 30)}, executor=pool)
    assert found["theta end"].tobytes() == mbs.sweep(system, {"l": (0.5, 1.0, 30)})["theta end"].tobytes()


def test_what_processes_cannot_be_sent_is_told(system: mbs.System) -> None:
    with (
        ProcessPoolExecutor(1) as pool,
        pytest.raises(ArgumentError, match=r"^reduce cannot be sent to workers.*define it at the top of a module"),
    ):
        mbs.sweep(system, {"l": [0.5]}, executor=pool, reduce=lambda _: {"x": 1})


def test_an_executor_that_is_shut_is_told(system: mbs.System) -> None:
    with ThreadPoolExecutor(1) as pool:
        pass
    with pytest.raises(OutputError, match="the executor takes no work: RuntimeError"):
        mbs.sweep(system, {"l": [0.5]}, executor=pool)


class _Dying(Executor):
    """An executor whose workers are gone after a few answers."""

    def __init__(self) -> None:
        self.answers = 3

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.answers -= 1
        if self.answers < 0:
            future.set_exception(RuntimeError("the workers are gone"))
        else:
            future.set_result(fn(*args, **kwargs))
        return future


def test_an_executor_that_breaks_is_told_and_loses_nothing(tmp_path: Path, system: mbs.System) -> None:
    out, vary = tmp_path / "o.csv", {"l": (0.5, 1.0, 200)}
    with pytest.raises(OutputError, match=r"the workers are gone.*kept"):
        mbs.sweep(system, vary, executor=_Dying(), output=out)
    study = mbs.sweep(system, vary, output=out)
    assert 0 < study.computed < 200


@pytest.mark.long
def test_a_dask_worker_that_is_killed_costs_no_row(tmp_path: Path, system: mbs.System) -> None:
    distributed = pytest.importorskip("distributed")
    vary, out = {"l": (0.5, 1.0, 400)}, tmp_path / "o.csv"
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        workers = list(client.run(os.getpid).values())
        killed: list[int] = []

        def kill(done: int, total: int) -> None:
            if done > total / 10 and not killed:
                killed.append(workers[0])
                os.kill(workers[0], signal.SIGKILL)

        found = mbs.sweep(system, vary, executor=client.get_executor(), on_progress=kill, output=out)
    assert killed
    assert found["run"].tolist() == list(range(400))
    assert found["theta end"].tobytes() == mbs.sweep(system, vary, workers=1)["theta end"].tobytes()
