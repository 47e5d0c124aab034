"""Tables of studies as CSV, NPZ and Parquet: written row by row from a journal, and read again."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from tempfile import TemporaryFile
from typing import Any, BinaryIO, Final
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile, ZipInfo

import numpy as np
from numpy.typing import NDArray

from multibody_sym.errors import OutputError
from multibody_sym.formats.digits import csv_lines
from multibody_sym.formats.files import replace_with
from multibody_sym.formats.tables import table_format
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.studies.journal import Journal
from multibody_sym.studies.plan import Plan
from multibody_sym.studies.rows import TEXTS, Rows

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

    def parts(self) -> Iterator[tuple[Floats, Rows]]:
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
    text.write(",".join(map(_quoted, (*content.numbers, *TEXTS))) + "\n")
    for numbers, rows in content.parts():
        written = b"".join(csv_lines(numbers[:, 1:])).decode().splitlines()
        texts = (rows.texts[name] for name in TEXTS)
        for run, row, *words in zip(numbers[:, 0].astype(int).tolist(), written, *texts, strict=True):
            text.write(",".join((str(run), row, *map(_quoted, words))) + "\n")
        file.write(text.getvalue().encode())
        text.seek(0)
        text.truncate()


def _quoted(text: str) -> str:
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


def gathered(content: Content) -> dict[str, Column]:
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
