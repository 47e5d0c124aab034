"""A journal that is damaged is refused by name, whatever is wrong with it; no study believes it, none waits for it."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.errors import InputError, OutputError
from multibody_sym.motion.sweep import rows as journals
from multibody_sym.motion.sweep.rows import _TABLES, ENDING, _checksum

SYSTEM = """
multibody_sym: 1
name: falling
bodies: {b: {mass: 1}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {u: 1}}}
simulation: {t_end: 1, samples: 2}
"""
NUMBERS, TEXT = bytes(8), (4, "events", "told")


def part(*values: Any, texts: tuple[Any, ...] = ()) -> tuple[tuple[Any, ...], ...]:
    """Return what another one writes as a part, with a checksum that is right."""
    return (*values, _checksum(values, [*texts])), *texts


PARTS = {
    "a count that is text": part(4, "one", "x", NUMBERS),
    "a count that is no whole number": part(4, 1.5, "x", NUMBERS),
    "no runs": part(4, 0, "x", b""),
    "more runs than there are numbers": part(4, 2, "x", NUMBERS),
    "many runs": part(4, 2**62, "x", NUMBERS),
    "names that are bytes": part(4, 1, b"x", NUMBERS),
    "no names": part(4, 1, None, NUMBERS),
    "numbers that are text": ((4, 1, "x", "12345678", ""),),
    "too few numbers": part(4, 1, "x\ny", NUMBERS),
    "a number before the first": part(-3, 1, "x", NUMBERS),
    "a number behind the last": part(6, 1, "x", NUMBERS),
    "a text of another kind": part(4, 1, "x", NUMBERS, texts=((4, "remark", "told"),)),
    "a text that is a number": part(4, 1, "x", NUMBERS, texts=((4, "events", b"told"),)),
    "a text that was not written": (*part(4, 1, "x", NUMBERS), TEXT),
    "another checksum": ((4, 1, "x", NUMBERS, "0"),),
    "no checksum": ((4, 1, "x", NUMBERS, None),),
}
STATEMENTS = {
    "a text that is no text": "INSERT INTO texts VALUES (0, 'events', CAST(x'ff' AS TEXT))",
    "a number that changed": "UPDATE parts SET numbers = x'0000000000000000' || substr(numbers, 9)",
    "a name that changed": "UPDATE parts SET names = upper(names)",
    "a table that is gone": "DROP TABLE texts",
    "a table with another column": "ALTER TABLE parts ADD COLUMN more",
    "a trigger": "CREATE TRIGGER t AFTER INSERT ON parts BEGIN DELETE FROM parts; END",
}


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], mbs.Study]:
    """A study of six runs whose journal is there already, as an interrupted call leaves it."""
    system, out = mbs.loads(SYSTEM), tmp_path / "o.csv"
    monkeypatch.setattr("multibody_sym.motion.sweep.study._MOST_ROWS", 1)  # of six runs at most four are done by then

    def again(stop: bool = False) -> mbs.Study:
        def counted(done: int, total: int) -> None:
            if stop and done > 1:
                raise KeyboardInterrupt

        return mbs.sweep(system, {"x": (1, 2, 6)}, output=out, workers=1, on_progress=counted)

    with pytest.raises(KeyboardInterrupt, match=r"\d runs are kept in"):
        again(stop=True)
    return again


@pytest.fixture
def database(tmp_path: Path, study: Callable[[], mbs.Study]) -> Iterator[sqlite3.Connection]:
    """The journal of the study, as another program sees it."""
    with closing(sqlite3.connect(tmp_path / f"o.csv{ENDING}")) as found:
        yield found


@pytest.mark.parametrize("found", PARTS.values(), ids=PARTS)
def test_a_part_that_is_no_rows_is_refused(
    found: Any, study: Callable[[], mbs.Study], database: sqlite3.Connection
) -> None:
    whole, *texts = found
    with database:
        database.execute("INSERT INTO parts VALUES (?, ?, ?, ?, ?)", whole)
        database.executemany("INSERT INTO texts VALUES (?, ?, ?)", texts)
    database.close()
    with pytest.raises(InputError, match=f"{ENDING}.*damaged.*delete it"):
        study()


def test_runs_that_are_there_twice_are_refused(study: Callable[[], mbs.Study], database: sqlite3.Connection) -> None:
    with database:
        for (whole,) in (part(4, 2, "x", 2 * NUMBERS), part(5, 1, "x", NUMBERS)):
            database.execute("INSERT INTO parts VALUES (?, ?, ?, ?, ?)", whole)
    database.close()
    with pytest.raises(InputError, match="damaged"):
        study()


def test_a_part_that_is_rows_is_believed(study: Callable[[], mbs.Study], database: sqlite3.Connection) -> None:
    """That the parts above are refused for what is wrong with each, not for all that they have in common."""
    ((kept,),) = database.execute("SELECT sum(count) FROM parts").fetchall()
    whole, *texts = part(4, 1, "x", NUMBERS, texts=(TEXT,))
    with database:
        database.execute("INSERT INTO parts VALUES (?, ?, ?, ?, ?)", whole)
        database.executemany("INSERT INTO texts VALUES (?, ?, ?)", texts)
    database.close()
    found = study()
    assert (found.computed, found["events"][4]) == (5 - kept, "told")


@pytest.mark.parametrize("statement", STATEMENTS.values(), ids=STATEMENTS)
def test_a_database_that_another_one_changed_is_refused(
    statement: str, study: Callable[[], mbs.Study], database: sqlite3.Connection
) -> None:
    with database:
        database.execute(statement)
    database.close()
    with pytest.raises(InputError, match=f"{ENDING}.*damaged.*delete it"):
        study()


def test_a_journal_that_is_cut_or_overwritten_anywhere_is_refused_or_right(
    study: Callable[[], mbs.Study], tmp_path: Path
) -> None:
    journal, out, refused = tmp_path / f"o.csv{ENDING}", tmp_path / "o.csv", []
    content, right = journal.read_bytes(), study()["x end"].tolist()
    for place in range(0, len(content), 1021):
        for changed in (content[:place], content[:place] + b"\xa5" * 40 + content[place + 40 :]):
            out.unlink(missing_ok=True)
            journal.write_bytes(changed)
            try:
                found = study()["x end"].tolist()
            except InputError as error:
                refused.append(str(error))
            else:
                assert found == right
    assert len(refused) > 10
    assert not [told for told in refused if not ("damaged" in told and "; delete it" in told)]


def test_a_journal_of_an_earlier_version_is_refused_and_stays(study: Callable[[], mbs.Study], tmp_path: Path) -> None:
    journal, before = tmp_path / f"o.csv{ENDING}", b'{"form": "multibody_sym study 1", "key": "0"}\n' + bytes(99)
    journal.write_bytes(before)
    with pytest.raises(InputError, match=f"{ENDING}: this journal is of an earlier version; delete it"):
        study()
    assert journal.read_bytes() == before


def test_the_database_of_another_program_is_refused_and_stays(study: Callable[[], mbs.Study], tmp_path: Path) -> None:
    journal = tmp_path / f"o.csv{ENDING}"
    journal.unlink()
    with closing(sqlite3.connect(journal)) as other, other:
        other.execute("CREATE TABLE addresses (name TEXT)")
    before = journal.read_bytes()
    with pytest.raises(InputError, match="no journal of a study"):
        study()
    assert journal.read_bytes() == before


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes")
def test_a_pipe_is_refused_without_waiting(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / f"p.csv{ENDING}")
    with pytest.raises(InputError, match="no regular file"):
        mbs.sweep(mbs.loads(SYSTEM), {"x": [1, 2]}, output=tmp_path / "p.csv")


@pytest.mark.parametrize("statement", [_TABLES[0], "INSERT INTO parts VALUES (?, ?, ?, ?, ?)"])
def test_a_full_disk_leaves_no_empty_journal(statement: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Full(sqlite3.Connection):
        def execute(self, sql: str, *values: Any) -> Any:
            if sql == statement:
                super().execute("PRAGMA max_page_count = 1")
                super().execute("CREATE TABLE more (a)")
            return super().execute(sql, *values)

    connect = sqlite3.connect
    monkeypatch.setattr(journals.sqlite3, "connect", lambda *a, **more: connect(*a, **more, factory=Full))
    with pytest.raises(OutputError, match="disk is full"):
        mbs.sweep(mbs.loads(SYSTEM), {"x": [1, 2]}, output=tmp_path / "o.csv")
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_study_without_a_file_says_that_nothing_is_kept() -> None:
    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match="no run is kept") as raised:
        mbs.sweep(mbs.loads(SYSTEM), {"x": (1, 2, 3)}, workers=1, on_progress=stop)
    assert type(raised.value) is KeyboardInterrupt


# --- what `reduce` computes has a name -------------------------------------------------------------------------------


def stopped(done: int, total: int) -> None:
    if done > 1:
        raise KeyboardInterrupt


def test_a_table_has_no_rows_of_two_keys(tmp_path: Path) -> None:
    out, system, vary = tmp_path / "o.csv", mbs.loads(SYSTEM), {"x": (1, 2, 6)}
    with pytest.raises(KeyboardInterrupt, match=r"\d runs are kept.*the same call goes on"):
        mbs.sweep(system, vary, reduce=lambda _: {"a": 1.0}, key="one", output=out, workers=1, on_progress=stopped)
    for key in ("two", None):
        with pytest.raises(InputError, match=r"another study.* key"):
            mbs.sweep(system, vary, reduce=None if key is None else lambda _: {"a": 2.0}, key=key, output=out)
    found = mbs.sweep(system, vary, reduce=lambda _: {"a": 3.0}, key="one", output=out)
    kept = 6 - found.computed
    assert kept > 1
    assert found["a"].tolist() == [1.0] * kept + [3.0] * found.computed


def test_without_a_key_no_row_is_kept_and_that_is_said_once(tmp_path: Path) -> None:
    out, system, vary = tmp_path / "o.csv", mbs.loads(SYSTEM), {"x": (1, 2, 6)}
    with (
        pytest.warns(UserWarning, match="no run is kept.*give key=") as told,
        pytest.raises(KeyboardInterrupt, match="no run is kept: give key="),
    ):
        mbs.sweep(system, vary, reduce=lambda _: {"a": 1.0}, output=out, workers=1, on_progress=stopped)
    assert [(len(told), Path(each.filename).name) for each in told] == [(1, Path(__file__).name)]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("given", [{"key": "a"}, {"key": "", "reduce": len}, {"key": 3, "reduce": len}])
def test_a_key_that_names_nothing_is_refused(given: Any) -> None:
    with pytest.raises(InputError, match=r"^key"):
        mbs.sweep(mbs.loads(SYSTEM), {"x": [1, 2]}, **given)
