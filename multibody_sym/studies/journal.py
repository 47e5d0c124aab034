"""The journal of a study: rows as they come, in an SQLite database that outlives its process.

A part is one transaction: of a process that was killed what is not whole is not there, and its runs are done again.
SQLite writes ahead (WAL) and syncs where it moves that log into the database (synchronous = NORMAL): a part costs one
write and no wait for the disk; a kill loses no part that was added, a power cut at most the last ones, never the rest.
The lock is held from the beginning to the end of a study, so that no memory is shared, which network disks have not.

Numbers of a part are one column of doubles as bytes: SQL knows no nan, and a row of its own for each costs more than a
run does. Texts are rows where there are any. What is read is compared with the checksum of what was written.
"""

from __future__ import annotations

import hashlib
import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import pairwise
from typing import Any, Final

import numpy as np

from multibody_sym.errors import InputError, OutputError, Where
from multibody_sym.formats.files import file_state
from multibody_sym.records import dataclass
from multibody_sym.studies.rows import TEXTS, Rows, Span, missing

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
        """Yield the numbers below `total` of runs that are not in it."""
        return missing(self.spans, total)

    def add(self, rows: Rows) -> None:
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

    def __iter__(self) -> Iterator[Rows]:
        """Yield all rows in the order of their numbers. Raises InputError where they are not what was written."""
        for first, end in sorted(self.spans):
            with _errors(self.name):
                yield self._part(first, end)

    def _part(self, first: int, end: int) -> Rows:
        found = self.database.execute("SELECT * FROM parts WHERE first = ?", (first,)).fetchone()
        asked = "SELECT * FROM texts WHERE run >= ? AND run < ? ORDER BY run, kind"
        texts = self.database.execute(asked, (first, end)).fetchall()
        *part, checksum = found
        _, count, names, numbers = part
        if [*map(type, part)] != [int, int, str, bytes] or checksum != _checksum(tuple(part), texts):
            raise _damaged(self.name)
        columns = tuple(names.splitlines())
        if len(numbers) != 8 * count * len(columns) or any(type(x) is not str for _, *text in texts for x in text):
            raise _damaged(self.name)
        told = {kind: [""] * count for kind in TEXTS}
        for run, kind, text in texts:
            if kind not in told:
                raise _damaged(self.name)
            told[kind][run - first] = text
        return Rows(first, columns, np.frombuffer(numbers, "<f8").reshape(count, len(columns)).astype(float), told)

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


def unnamed(reason: str = "") -> Journal:
    """Return a journal that nobody else knows, for some reason, and that ends with the process. Raises OutputError."""
    with _errors("a temporary file"):
        journal = Journal(sqlite3.connect(""), "", [], reason)
        _begin(journal.database, "")
        return journal


def opened(name: str, key: str, total: int) -> Journal:
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
            _lock(database)
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


def _lock(database: sqlite3.Connection) -> None:
    database.execute("PRAGMA locking_mode = EXCLUSIVE")
    database.execute("PRAGMA synchronous = NORMAL")
    database.execute("BEGIN EXCLUSIVE")
    database.commit()


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
        raise _damaged(name)
    spans = [(first, first + count) for first, count in found]
    if any(after[0] < before[1] for before, after in pairwise([(0, 0), *spans, (total, total)])):
        raise _damaged(name)
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
        raise (_none(name) if code == sqlite3.SQLITE_NOTADB else _damaged(name)) from None


def _damaged(name: str) -> InputError:
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
