"""Rows of a study: what was found of runs with consecutive numbers."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
import os
import re
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import chain, pairwise
from tempfile import TemporaryFile
from typing import Any, BinaryIO, Final, NamedTuple
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile, ZipInfo

import numpy as np
from numpy.typing import NDArray

from multibody_sym.errors import InputError, OutputError, Where
from multibody_sym.motion.sweep.plan import Plan
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.text.files import file_state, replace_with
from multibody_sym.text.tables import csv_lines, table_format

EVENTS, FAILURE = "events", "failure"
TEXTS = (EVENTS, FAILURE)
"""The columns of text: what happened on the way, and why there is no result."""


class StudyRow(NamedTuple):
    """What was found of one run: numbers by name, its events, and the reason why it failed, if it did."""

    numbers: Mapping[str, float]
    events: str = ""
    failure: str = ""


@dataclass(frozen=True, eq=False)
class StudyRows:
    """Runs from number `first` on: `numbers` (count, names), nan where a run has none, and texts."""

    first: int
    names: tuple[str, ...]
    numbers: Floats
    texts: Mapping[str, Sequence[str]]

    @classmethod
    def of(cls, first: int, rows: Sequence[StudyRow]) -> StudyRows:
        """Return rows one after the other; a name has a column where one of them has it."""
        found = [row.numbers for row in rows]
        names = tuple(dict.fromkeys(chain.from_iterable(found)))
        columns = [[numbers.get(name, math.nan) for numbers in found] for name in names]
        numbers = np.array(columns, dtype=float).T
        texts = {EVENTS: [row.events for row in rows], FAILURE: [row.failure for row in rows]}
        return cls(first, names, numbers.reshape(len(rows), len(names)), texts)

    def __len__(self) -> int:
        return len(self.numbers)

    def column(self, name: str) -> Floats:
        """Return a column (count,), nan where no row has it."""
        if name not in self.names:
            return np.full(len(self), np.nan)
        found: Floats = self.numbers[:, self.names.index(name)]
        return found


Span = tuple[int, int]
"""The first number of some runs, and that after the last."""


# ----------------------------------------------------------------------------------------------------------------------
# The journal of a study: rows as they come, in an SQLite database that outlives its process.
#
# A part is one transaction: of a process that was killed what is not whole is not there, and its runs are done again.
# SQLite writes ahead (WAL) and syncs where it moves that log into the database (synchronous = NORMAL): a part costs
# one write and no wait for the disk; a kill loses no part that was added, a power cut at most the last ones, never the
# rest. The lock is held from the beginning to the end of a study, so that no memory is shared, which network disks
# have not.
#
# Numbers of a part are one column of doubles as bytes: SQL knows no nan, and a row of its own for each costs more than
# a run does. Texts are rows where there are any. What is read is compared with the checksum of what was written.


ENDING: Final = ".journal"
_TABLES: Final = (
    "CREATE TABLE study (key TEXT)",
    "CREATE TABLE parts (first INTEGER PRIMARY KEY, count INTEGER, names TEXT, numbers BLOB, checksum TEXT)",
    "CREATE TABLE texts (run INTEGER, kind TEXT, text TEXT, PRIMARY KEY (run, kind)) WITHOUT ROWID",
)
_BESIDE: Final = ("", "-wal", "-journal")
"""The endings of the files of a database: its own, its log, and what it has while it begins."""
_BEFORE: Final = b'{"form": "multibody_sym study'
"""How journals begin that were no databases."""
_AGAIN: Final = "delete it, so that its runs are done again, or give the table another name"
_UNWRITABLE: Final = (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR, sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN)


@dataclass(eq=False)
class Journal:
    """An open journal: its `database`, the name of that, empty where nobody else knows it, and the runs in it.

    `spans`: the numbers of these runs. `reason`: why nobody knows it, where people would expect it.
    """

    database: sqlite3.Connection
    name: str
    spans: list[Span]
    reason: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """The columns of all rows, in the order in which runs have them."""
        with _errors(self.name):
            found = self.database.execute("SELECT names FROM parts ORDER BY first").fetchall()
        return tuple(dict.fromkeys(name for (names,) in found for name in names.splitlines()))

    def __len__(self) -> int:
        return sum(end - first for first, end in self.spans)

    def left(self, total: int) -> Iterator[Span]:
        """Yield the numbers below `total` of runs that are not in it; its spans do not overlap."""
        begin = 0
        for first, end in sorted(self.spans):
            if first > begin:
                yield begin, first
            begin = end
        if begin < total:
            yield begin, total

    def add(self, rows: StudyRows) -> None:
        """Append rows. Raises OutputError; what was there before is kept then, and nothing half written."""
        part = rows.first, len(rows), "\n".join(rows.names), rows.numbers.astype("<f8").tobytes()
        by_kind = rows.texts.items()
        texts = sorted((rows.first + k, kind, x) for kind, column in by_kind for k, x in enumerate(column) if x)
        with _errors(self.name), self.database:
            self.database.execute("INSERT INTO parts VALUES (?, ?, ?, ?, ?)", (*part, _checksum(part, texts)))
            self.database.executemany("INSERT INTO texts VALUES (?, ?, ?)", texts)
        self.spans.append((rows.first, rows.first + len(rows)))

    @property
    def told(self) -> str:
        """What is kept for a call that goes on, as the end of a message; empty where nothing is."""
        if self.reason:
            return f"; no run is kept: {self.reason}"
        if not self.name or not self.spans:
            return ""
        return f"; {len(self)} runs are kept in {self.name}, and the same call goes on from there"

    def __iter__(self) -> Iterator[StudyRows]:
        """Yield all rows in the order of their numbers. Raises InputError where they are not what was written."""
        for first, end in sorted(self.spans):
            with _errors(self.name):
                yield self._part(first, end)

    def _part(self, first: int, end: int) -> StudyRows:
        found = self.database.execute("SELECT * FROM parts WHERE first = ?", (first,)).fetchone()
        asked = "SELECT * FROM texts WHERE run >= ? AND run < ? ORDER BY run, kind"
        texts = self.database.execute(asked, (first, end)).fetchall()
        *part, checksum = found
        _, count, names, numbers = part
        if [*map(type, part)] != [int, int, str, bytes] or checksum != _checksum(tuple(part), texts):
            raise _damage_error(self.name)
        columns = tuple(names.splitlines())
        if len(numbers) != 8 * count * len(columns) or any(type(x) is not str for _, *text in texts for x in text):
            raise _damage_error(self.name)
        told = {kind: [""] * count for kind in TEXTS}
        for run, kind, text in texts:
            if kind not in told:
                raise _damage_error(self.name)
            told[kind][run - first] = text
        return StudyRows(first, columns, np.frombuffer(numbers, "<f8").reshape(count, len(columns)).astype(float), told)

    def close(self) -> None:
        """Let go of the file, which stays where there are rows in it."""
        if self.name and not self.spans:
            self.discard()
        self.database.close()

    def discard(self) -> None:
        """Delete the files, whose lock is held until that is done."""
        for ending in _BESIDE if self.name else ():
            with suppress(OSError):
                os.unlink(self.name + ending)
        self.database.close()


def unnamed_journal(reason: str = "") -> Journal:
    """Return a journal that nobody else knows, for some reason, and that ends with the process. Raises OutputError."""
    with _errors("a temporary file"):
        journal = Journal(sqlite3.connect(""), "", [], reason)
        _begin(journal.database, "")
        return journal


def open_journal(name: str, key: str, total: int) -> Journal:
    """Return the journal `name` of the study `key` of `total` runs, with what is in it; a new one where there is none.

    Raises InputError for the journal of another study, a damaged one, or a file that is none, and OutputError where it
    cannot be written or another process writes it.
    """
    if os.path.lexists(name) and not os.path.isfile(name):
        message = "this is no regular file, as a journal is; give the table another name"
        raise InputError(message, where=Where(file=name))
    before = file_state(name)[:2]
    with _errors(name):
        database = sqlite3.connect(name, timeout=0)
        try:
            database.execute("PRAGMA locking_mode = EXCLUSIVE")
            database.execute("PRAGMA synchronous = NORMAL")
            database.execute("BEGIN EXCLUSIVE")
            database.commit()
            now = file_state(name)[:2]
            if not now or before not in ((), now):  # who had it has finished and deleted it
                raise OutputError("another process has just finished this study", where=Where(file=name))
            return _read(database, name, key, total)
        except BaseException:
            database.close()
            raise


def _read(database: sqlite3.Connection, name: str, key: str, total: int) -> Journal:
    """Return the journal in a database that is locked; begin one where there is nothing in it."""
    tables = {sql for (sql,) in database.execute("SELECT sql FROM sqlite_master WHERE sql IS NOT NULL")}
    if tables:
        journal = Journal(database, name, _spans(database, name, tables, key, total))
        for _ in journal:  # what is in it is what was written
            pass
        return journal
    journal = Journal(database, name, [])
    try:
        _begin(database, key)
    except BaseException:
        journal.discard()
        raise
    return journal


def _begin(database: sqlite3.Connection, key: str) -> None:
    """Make the tables of a new journal."""
    database.execute("PRAGMA journal_mode = WAL")
    with database:
        for table in _TABLES:
            database.execute(table)
        database.execute("INSERT INTO study VALUES (?)", (key,))


def _spans(database: sqlite3.Connection, name: str, tables: set[str], key: str, total: int) -> list[Span]:
    """Return the numbers of the runs in a journal. Raises InputError for that of another study, or a damaged one."""
    if tables != set(_TABLES):
        raise _none(name)
    if database.execute("SELECT key FROM study").fetchall() != [(key,)]:
        other = "this file holds runs of another study: of another model, plan, key or version"
        raise InputError(
            f"{other}; finish that one, give this one another name, or delete the file", where=Where(file=name)
        )
    found = database.execute("SELECT first, count FROM parts ORDER BY first").fetchall()
    if any(type(count) is not int or count < 1 for _, count in found):
        raise _damage_error(name)
    spans = [(first, first + count) for first, count in found]
    if any(after[0] < before[1] for before, after in pairwise([(0, 0), *spans, (total, total)])):
        raise _damage_error(name)
    return spans


@contextmanager
def _errors(name: str) -> Iterator[None]:
    """Turn what SQLite says about the file `name` into InputError and OutputError."""
    try:
        yield
    except sqlite3.IntegrityError:  # rows that are there already: no fault of the file
        raise
    except (sqlite3.DatabaseError, UnicodeDecodeError) as error:  # the latter where it quotes what is damaged
        code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF
        if code == sqlite3.SQLITE_BUSY:
            message = "another process writes this study; wait for it"
            raise OutputError(message, where=Where(file=name)) from None
        if code in _UNWRITABLE:
            message = f"the file cannot be written: {error}"
            raise OutputError(message, where=Where(file=name), number="O102") from error
        raise (_none(name) if code == sqlite3.SQLITE_NOTADB else _damage_error(name)) from None


def _damage_error(name: str) -> InputError:
    return InputError(f"this journal is damaged; {_AGAIN}", where=Where(file=name))


def _none(name: str) -> InputError:
    """Return the error for a file that is no database, or another one."""
    with open(name, "rb") as file:
        before = file.read(len(_BEFORE)) == _BEFORE
    what = "this journal is of an earlier version" if before else "this file is no journal of a study, or a damaged one"
    return InputError(f"{what}; {_AGAIN}", where=Where(file=name))


def _checksum(part: tuple[Any, ...], texts: list[Any]) -> str:
    """Return the checksum of a part, of which the numbers come last."""
    *head, numbers = part
    return hashlib.sha256(repr((head, texts)).encode() + numbers).hexdigest()


# ----------------------------------------------------------------------------------------------------------------------
# Tables of studies as CSV, NPZ and Parquet: written row by row from a journal, and read again.


RUN: Final = "run"
_ABOUT: Final = "__metadata__"
_REMARK: Final = "# "
_QUOTED: Final = re.compile(r'[",\r\n#]')
_GROUP: Final = 1 << 21
_LEAST_GROUP: Final = 1 << 10
"""Values, and the least number of rows, that a row group of Parquet has, whatever parts rows came in."""
Column = NDArray[Any]


def results(plan: Plan, columns: Iterable[str]) -> tuple[str, ...]:
    """Return the columns of numbers that runs gave."""
    return tuple(name for name in columns if name not in (RUN, *plan.names, *TEXTS))


@dataclass(frozen=True, eq=False)
class Content:
    """What a table is made of: the rows of a journal, with the values that the plan says; `about` tells what it is of.

    Columns of numbers are the number of the run, what is varied, what was found; of text events and failures.
    """

    plan: Plan
    journal: Journal
    about: Mapping[str, Any]

    @property
    def numbers(self) -> tuple[str, ...]:
        """The columns of numbers."""
        return (RUN, *self.plan.names, *map(self._called, self.journal.names))

    def _called(self, name: str) -> str:
        """Return what a column is called: `found m` where m is varied."""
        return f"found {name}" if name in (RUN, *self.plan.names, *TEXTS) else name

    def parts(self) -> Iterator[tuple[Floats, StudyRows]]:
        """Yield all rows in their order: numbers (count, columns), and the rows themselves for their texts."""
        names = self.journal.names
        for rows in self.journal:
            run = np.arange(rows.first, rows.first + len(rows), dtype=float)
            found = [rows.column(name) for name in names]
            yield np.column_stack([run, self.plan.values(rows.first, len(rows)), *found]), rows


def write(content: Content, path: str) -> str:
    """Write a table in the format that the ending of `path` names; return the file's name.

    Raises InputError for another ending, OutputError where writing fails; an existing file is then unharmed.
    """
    writer = _WRITERS[table_format(path)]
    return replace_with(path, lambda file: writer(content, file))


def _write_csv(content: Content, file: BinaryIO) -> None:
    text = io.StringIO()
    for key, value in content.about.items():
        text.write(f"{_REMARK}{key}: {json.dumps(value)}\n")
    text.write(",".join(map(_quote, (*content.numbers, *TEXTS))) + "\n")
    for numbers, rows in content.parts():
        written = b"".join(csv_lines(numbers[:, 1:])).decode().splitlines()
        texts = (rows.texts[name] for name in TEXTS)
        for run, row, *words in zip(numbers[:, 0].astype(int).tolist(), written, *texts, strict=True):
            text.write(",".join((str(run), row, *map(_quote, words))) + "\n")
        file.write(text.getvalue().encode())
        text.seek(0)
        text.truncate()


def _quote(text: str) -> str:
    """Return a text of a CSV, between quotation marks where it would be taken apart, or for a remark."""
    return '"' + text.replace('"', '""') + '"' if _QUOTED.search(text) else text


def _write_npz(content: Content, file: BinaryIO) -> None:
    """Write each column as an array; columns are gathered in a file, so that memory does not grow with the rows.

    Texts are as wide as the longest, mostly with nothing behind them, and are deflated.
    """
    total, names = len(content.journal), content.numbers
    widths = dict.fromkeys(TEXTS, 1)
    with TemporaryFile() as gathered, ZipFile(file, "w") as archive:
        for numbers, rows in content.parts():
            for k, column in enumerate(numbers.T):
                gathered.seek(8 * (k * total + rows.first))
                gathered.write(np.ascontiguousarray(column).tobytes())
            for name in TEXTS:
                widths[name] = max(widths[name], *map(len, rows.texts[name]))
        gathered.flush()
        for k, name in enumerate(names):
            gathered.seek(8 * k * total)
            _put(archive, name, "<f8", total, iter(lambda: gathered.read(1 << 20), b""), 8 * total)
        for name in TEXTS:
            kind = f"<U{widths[name]}"
            pieces = (np.array(rows.texts[name], dtype=kind).tobytes() for rows in content.journal)
            _put(archive, name, kind, total, pieces, 4 * widths[name] * total)
        about = np.array(json.dumps(dict(content.about)))
        _put(archive, _ABOUT, about.dtype.str, None, iter([about.tobytes()]), about.nbytes)


def _put(archive: ZipFile, name: str, kind: str, total: int | None, pieces: Iterator[bytes], size: int) -> None:
    """Write an array of a kind as a member of an archive, from pieces of it."""
    about = ZipInfo(f"{name}.npy")
    about.compress_type = ZIP_DEFLATED if name in TEXTS else ZIP_STORED
    with archive.open(about, "w", force_zip64=True) as member:
        shape = () if total is None else (total,)
        head = {"descr": kind, "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(member, head)
        for piece in pieces:
            member.write(piece[:size])
            size -= min(size, len(piece))


def _write_parquet(content: Content, file: BinaryIO) -> None:
    arrow, parquet = _pyarrow()
    fields = [arrow.field(name, arrow.float64()) for name in content.numbers]
    fields += [arrow.field(name, arrow.string()) for name in TEXTS]
    schema = arrow.schema(fields, metadata={key: json.dumps(value) for key, value in content.about.items()})
    size = max(_LEAST_GROUP, _GROUP // len(fields))
    with parquet.ParquetWriter(file, schema) as writer:
        waiting = schema.empty_table()
        for numbers, rows in content.parts():
            columns = [*map(np.ascontiguousarray, numbers.T), *(rows.texts[name] for name in TEXTS)]
            part = arrow.table(dict(zip(schema.names, columns, strict=True)), schema=schema)
            waiting = arrow.concat_tables([waiting, part])
            while len(waiting) >= size:
                writer.write_table(waiting.slice(0, size).combine_chunks(), row_group_size=size)
                waiting = waiting.slice(size)
        if len(waiting):
            writer.write_table(waiting.combine_chunks(), row_group_size=size)


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        message = "Parquet files need pyarrow: pip install 'multibody_sym[parquet]', or write .csv or .npz"
        raise OutputError(message) from None
    return pyarrow, pyarrow.parquet


_WRITERS: Final[dict[str, Callable[[Content, BinaryIO], None]]] = {
    ".csv": _write_csv, ".npz": _write_npz, ".parquet": _write_parquet,
}


def verify_format(path: str) -> None:
    """Raise InputError for an unknown ending, and OutputError for one that takes what is not installed."""
    if table_format(path) == ".parquet":
        _pyarrow()


# --- reading ----------------------------------------------------------------------------------------------------


def read(path: str) -> tuple[dict[str, Column], dict[str, Any]]:
    """Return the columns of a study's table by name, of floats and of text, and what it says it is of."""
    with open(path, "rb") as file:
        return _READERS[table_format(path)](file)


def gather_columns(content: Content) -> dict[str, Column]:
    """Return the columns of a table that is in no file, by name."""
    parts = list(content.parts())
    numbers = np.concatenate([part for part, _ in parts]) if parts else np.empty((0, len(content.numbers)))
    texts = {name: [text for _, rows in parts for text in rows.texts[name]] for name in TEXTS}
    columns: dict[str, Column] = dict(zip(content.numbers, numbers.T.copy(), strict=True))
    return {**columns, **{name: _texts(found) for name, found in texts.items()}}


def _texts(found: Sequence[str]) -> Column:
    return np.array(found, dtype=str) if found else np.empty(0, dtype="<U1")


def _read_csv(file: BinaryIO) -> tuple[dict[str, Column], dict[str, Any]]:
    text = io.TextIOWrapper(file, encoding="utf-8", newline="")
    about, line = {}, text.readline()
    while line.startswith(_REMARK):
        key, _, value = line.removeprefix(_REMARK).partition(": ")
        with suppress(ValueError):
            about[key] = json.loads(value)
        line = text.readline()
    (names,) = csv.reader([line])
    columns = list(zip(*csv.reader(text), strict=True)) or [()] * len(names)
    return {
        name: _texts(column) if name in TEXTS else np.array(column, dtype=float)
        for name, column in zip(names, columns, strict=True)
    }, about


def _read_npz(file: BinaryIO) -> tuple[dict[str, Column], dict[str, Any]]:
    with np.load(file, allow_pickle=False) as archive:
        about = json.loads(archive[_ABOUT].item())
        return {name: archive[name] for name in archive.files if name != _ABOUT}, about


def _read_parquet(file: BinaryIO) -> tuple[dict[str, Column], dict[str, Any]]:
    _arrow, parquet = _pyarrow()
    content = parquet.read_table(file)
    columns = {name: content.column(name).to_numpy() for name in content.column_names}
    found = {name: _texts(column.tolist()) if name in TEXTS else column for name, column in columns.items()}
    return found, {key.decode(): json.loads(value) for key, value in (content.schema.metadata or {}).items()}


_READERS: Final[dict[str, Callable[[BinaryIO], tuple[dict[str, Column], dict[str, Any]]]]] = {
    ".csv": _read_csv, ".npz": _read_npz, ".parquet": _read_parquet,
}
