"""The journal of a study: rows as they come, each part with its checksum, in a file that outlives its process.

It begins with a line that says which study it is of; each part is its length, its checksum and its content. Of a
process that was killed the last part may be torn: it is dropped, and its runs are done again.
"""

from __future__ import annotations

import hashlib
import json
import os
import struct
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from itertools import pairwise
from typing import BinaryIO, Final, NamedTuple

from multibody_sym.errors import InputError, OutputError, Where
from multibody_sym.formats.files import leads_to, output_errors
from multibody_sym.records import dataclass
from multibody_sym.studies.rows import Rows, Span, missing

try:
    import fcntl
except ImportError:  # not POSIX
    fcntl = None  # type: ignore[assignment]

ENDING: Final = ".journal"
_FORM: Final = "multibody_sym study 1"
_HEAD: Final = struct.Struct("<Q16s")


class _Part(NamedTuple):
    """Where rows stand in the file, and which they are."""

    first: int
    end: int
    names: tuple[str, ...]
    place: int
    size: int


@dataclass(eq=False)
class Journal:
    """An open journal: its `file`, the name of that, empty where nobody else knows it, and the `parts` in it.

    `reason`: why nobody does, where people would expect it.
    """

    file: BinaryIO
    name: str
    parts: list[_Part]
    reason: str = ""

    @property
    def spans(self) -> list[Span]:
        """The numbers of the runs that are in it."""
        return [(part.first, part.end) for part in self.parts]

    @property
    def names(self) -> tuple[str, ...]:
        """The columns of all rows, in the order in which runs have them."""
        return tuple(dict.fromkeys(name for part in sorted(self.parts) for name in part.names))

    def __len__(self) -> int:
        return sum(part.end - part.first for part in self.parts)

    def left(self, total: int) -> Iterator[Span]:
        """Yield the numbers below `total` of runs that are not in it."""
        return missing(self.spans, total)

    def add(self, rows: Rows) -> None:
        """Append rows. Raises OutputError; what was there before is kept then, and nothing half written."""
        content = rows.as_bytes()
        begin = self.file.seek(0, os.SEEK_END)
        try:
            with output_errors(self.name):
                _write(self.file, _HEAD.pack(len(content), _checksum(content)) + content)
        except OutputError as error:
            with suppress(OSError):
                self.file.truncate(begin)
            raise OutputError(error.message, where=error.where) from None
        self.parts.append(_Part(rows.first, rows.first + len(rows), rows.names, begin + _HEAD.size, len(content)))

    @property
    def told(self) -> str:
        """What is kept for a call that goes on, as the end of a message; empty where nothing is."""
        if self.reason:
            return f"; no run is kept: {self.reason}"
        if not self.name or not self.parts:
            return ""
        return f"; {len(self)} runs are kept in {self.name}, and the same call goes on from there"

    def __iter__(self) -> Iterator[Rows]:
        """Yield all rows in the order of their numbers."""
        for part in sorted(self.parts):
            self.file.seek(part.place)
            yield Rows.from_bytes(self.file.read(part.size))

    def close(self) -> None:
        """Let go of the file, which stays."""
        with suppress(OSError):
            self.file.close()

    def discard(self) -> None:
        """Delete the file."""
        with suppress(OSError):
            if self.name and leads_to(self.name, self.file):
                os.unlink(self.name)
        self.close()


def unnamed(reason: str = "") -> Journal:
    """Return a journal that nobody else knows, for some reason, and that ends with the process. Raises OutputError."""
    with output_errors("a temporary file"):
        return Journal(tempfile.TemporaryFile(buffering=0), "", [], reason)


def opened(name: str, key: str) -> Journal:
    """Return the journal `name` of the study `key`, with what is in it; a new one where there is none.

    Raises InputError for the journal of another study, a damaged one, or a file that is none, and OutputError where it
    cannot be written or another process writes it.
    """
    new = not os.path.lexists(name)
    if not (new or os.path.isfile(name)):
        message = "this is no regular file, as a journal is; give the table another name"
        raise InputError(message, where=Where(file=name))
    with output_errors(name):
        file = os.fdopen(os.open(name, os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0), 0o666), "r+b", buffering=0)
    try:
        _lock(file, name)
        with output_errors(name):
            return Journal(file, name, _read(file, name, key))
    except BaseException:
        if new and leads_to(name, file) and not os.fstat(file.fileno()).st_size:
            os.unlink(name)
        file.close()
        raise


def _lock(file: BinaryIO, name: str) -> None:
    if fcntl is None:
        return
    try:
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise OutputError("another process writes this study; wait for it", where=Where(file=name)) from None
    except OSError:  # a file system without locks
        return
    if not leads_to(name, file):  # who had it has finished and deleted it
        raise OutputError("another process has just finished this study", where=Where(file=name))


def _read(file: BinaryIO, name: str, key: str) -> list[_Part]:
    """Return the parts of a journal, and cut off what is torn; begin one where there is nothing yet."""
    first = json.dumps({"form": _FORM, "key": key}).encode() + b"\n"
    begin = file.read(len(first))
    if begin != first and first.startswith(begin):  # nothing, or a beginning that is torn
        file.seek(0)
        file.truncate()
        try:
            _write(file, first)
        except OSError:  # nothing of it stays
            file.truncate(0)
            raise
        return []
    if begin != first:
        ours = begin.startswith(first[: first.index(key.encode())])
        other = "holds runs of another study: of another model, plan, reduce or version"
        what = other if ours else "is no journal of a study"
        message = f"this file {what}; finish that one, give this one another name, or delete the file"
        raise InputError(message, where=Where(file=name))
    parts = list(_parts(file, name, len(first)))
    ends = sorted((part.first, part.end) for part in parts)
    if any(after[0] < before[1] for before, after in pairwise(ends)):
        raise _damaged(name)
    file.truncate(parts[-1].place + parts[-1].size if parts else len(first))
    return parts


def _damaged(name: str) -> InputError:
    message = "this journal is damaged; delete it, so that its runs are done again, or give the table another name"
    return InputError(message, where=Where(file=name))


def _parts(file: BinaryIO, name: str, place: int) -> Iterator[_Part]:
    """Yield the parts that are whole; the last one may be torn. Raises InputError for a journal that is damaged."""
    size = os.fstat(file.fileno()).st_size
    while place + _HEAD.size <= size:
        file.seek(place)
        length, checksum = _HEAD.unpack(file.read(_HEAD.size))
        place += _HEAD.size
        if place + length > size:
            return
        content = file.read(length)
        if _checksum(content) != checksum:
            if place + length < size:
                raise _damaged(name)
            return
        try:
            rows = Rows.from_bytes(content)
        except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
            raise _damaged(name) from None
        yield _Part(rows.first, rows.first + len(rows), rows.names, place, length)
        place += length


def _write(file: BinaryIO, content: bytes) -> None:
    """Write all of the content, which a disk that gets full takes in part without a word."""
    left = memoryview(content)
    while left:
        left = left[file.write(left) :]


def _checksum(content: bytes) -> bytes:
    return hashlib.sha256(content).digest()[:16]
