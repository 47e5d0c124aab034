"""Tables of results as CSV, NPZ or Parquet, and CSV that grows during a long run."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import field, replace
from importlib import import_module
from itertools import chain
from pathlib import PurePath
from typing import Any, BinaryIO, Final

import numpy as np
import numpy.typing as npt

from multibody_sym.errors import ArgumentError, InputError, OutputError, Where, brief, short_repr
from multibody_sym.records import ByName, dataclass
from multibody_sym.text.files import (
    PARTIAL,
    FileState,
    as_named,
    file_state,
    is_special,
    leads_to,
    open_growing,
    open_through,
    output_errors,
    replace_with,
    settle,
)
from multibody_sym.text.values import SI, Units

# ----------------------------------------------------------------------------------------------------------------------
# Numbers as text: the shortest digits that read back to the same bits.


_BLOCK: Final = 1 << 16
"""Numbers that are written at once; their text takes 1.5 MB at most."""


def csv_lines(rows: npt.NDArray[np.float64]) -> Iterator[bytes]:
    """Yield rows (n, columns) as lines with commas, some at a time.

    orjson writes the digits in a tenth of the time of `repr`, and null for `nan` and `inf`, which JSON has not.
    """
    import orjson

    block = max(1, _BLOCK // max(1, rows.shape[1]))
    for first in range(0, len(rows), block):
        part = np.ascontiguousarray(rows[first : first + block])
        text = orjson.dumps(part, option=orjson.OPT_SERIALIZE_NUMPY)[2:-2].replace(b"],[", b"\n") + b"\n"
        if missing := part[~np.isfinite(part)].tolist():
            begin, *rest = text.split(b"null")
            words = (repr(x).encode() + after for x, after in zip(missing, rest, strict=True))
            text = begin + b"".join(words)
        yield text


# ----------------------------------------------------------------------------------------------------------------------

Column = npt.NDArray[np.float64]
_METADATA: Final = "__metadata__"
_TIME: Final = "t"
_ROWS: Final = 1 << 13
"""Rows of a table that are put together at once."""
_FORMULA: Final = ("=", "+", "-", "@")
"""The begins of texts that spreadsheets compute; in CSV headers an apostrophe goes before them."""


def data_package(name: str, what: str) -> Any:
    """Return a package of data frames. Raises OutputError where it is missing."""
    try:
        return import_module(name)
    except ImportError:
        raise OutputError(f"{what} needs {name}: pip install {name}") from None


@dataclass(frozen=True, eq=False)
class Table(ByName):
    """Columns of floats in order, all of one length; `units` of some of them, and `metadata` of the result.

    CSV holds names and numbers only; NPZ and Parquet hold units (Parquet with each column too) and metadata.
    """

    columns: Mapping[str, Column]
    units: Mapping[str, str] = field(default_factory=dict)
    metadata: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        columns = {name: np.asarray(values, dtype=np.float64) for name, values in self.columns.items()}
        if len({values.shape for values in columns.values()}) > 1 or any(v.ndim != 1 for v in columns.values()):
            raise ValueError("the columns of a table are one-dimensional and of one length")
        for name in columns:
            if not name or not name.isprintable() or name == _METADATA:
                raise ValueError(f"{name!r} is no name of a column")
        object.__setattr__(self, "columns", columns)

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def __repr__(self) -> str:
        return f"<Table of {len(self)} rows: {', '.join(brief(tuple(self.columns)))}>"

    def labelled(self) -> Table:
        """Return the table with units in the names of its columns, `theta [deg]`, for people to read."""
        names = {name: SI.named(name, self.units.get(name, "")) for name in self.columns}
        return replace(self, columns={names[name]: values for name, values in self.columns.items()}, units={})

    def blocks(self) -> Iterator[npt.NDArray[np.float64]]:
        """Yield the numbers, some rows (samples, columns) at a time, to save memory."""
        for first in range(0, len(self), _ROWS):
            yield np.column_stack([values[first : first + _ROWS] for values in self.columns.values()])

    def __getitem__(self, name: str) -> Column:
        """Return a column (rows,) by name, in its unit of `units`. Raises InputError for another name."""
        if not isinstance(name, str):
            raise ArgumentError(f"a table is asked by the name of a column, not by {short_repr(name)}")
        if name not in self.columns:
            message = f"no column of this table is called {name!r}"
            raise InputError(message, number="M106", word=name, known=self.columns)
        return self.columns[name]

    def keys(self) -> tuple[str, ...]:
        """Return the names of the columns."""
        return tuple(self.columns)

    def to_numpy(self) -> npt.NDArray[np.float64]:
        """Return the columns as an array (rows, columns), in the order of `keys()`."""
        return np.column_stack([*self.columns.values()]) if self.columns else np.empty((0, 0))

    def to_dataframe(self) -> Any:
        """Return a pandas DataFrame, over t if that is a column; its `attrs` have `units` and the metadata.

        Raises OutputError where pandas is missing.
        """
        frame = data_package("pandas", "a DataFrame").DataFrame(dict(self.columns))
        frame = frame.set_index(_TIME) if _TIME in self.columns else frame
        frame.attrs.update({"units": dict(self.units), **self.metadata})
        return frame

    def to_xarray(self) -> Any:
        """Return an xarray Dataset over t, or over `row` if t is no column; each variable has its unit.

        Raises OutputError where xarray is missing.
        """
        over = _TIME if _TIME in self.columns else "row"
        units = {name: {"units": unit} for name, unit in self.units.items()}
        columns = {name: (over, values, units.get(name)) for name, values in self.columns.items()}
        found = data_package("xarray", "a Dataset").Dataset(columns, attrs=dict(self.metadata))
        return found.set_coords(_TIME) if over == _TIME else found


def in_units(table: Table, units: Units) -> Table:
    """Return a table with its columns and `units` in chosen units."""
    if not units.chosen:
        return table
    columns = {name: values / units.size(table.units.get(name, "")) for name, values in table.columns.items()}
    return replace(table, columns=columns, units={name: units.of(unit) for name, unit in table.units.items()})


def write_table(table: Table, path: str | os.PathLike[str], begin: FileState | None = None) -> str:
    """Write the table in the format that the ending of `path` names: .csv, .npz or .parquet. Return the file's name.

    It is another file, beside `path`, if `path` has changed since the `begin` (`files.file_state`).
    Raises InputError for another ending, OutputError where writing fails; an existing file is then unharmed.
    """
    write = _WRITERS[table_format(path)]
    return replace_with(path, lambda file: write(table, file), begin)


def table_format(path: str | os.PathLike[str]) -> str:
    """Return the ending of `path` that names a format; raise InputError for another one."""
    ending = PurePath(path).suffix.lower()
    if ending not in _WRITERS:
        message = f"results are written to {', '.join(_WRITERS)} files, by the ending of the name, not '{ending}'"
        raise InputError(message, where=Where(file=os.fspath(path)), number="U103")
    return ending


def _write_csv(table: Table, file: BinaryIO) -> None:
    file.write(_csv_header(table.columns))
    for rows in table.blocks():
        file.writelines(csv_lines(rows))


def _csv_header(names: Mapping[str, Any] | list[str]) -> bytes:
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow([f"'{name}" if name[:1] in _FORMULA else name for name in names])
    return line.getvalue().encode("utf-8")


def _write_npz(table: Table, file: BinaryIO) -> None:
    from zipfile import ZipFile, ZipInfo

    about = json.dumps({"units": dict(table.units), "metadata": dict(table.metadata)}, sort_keys=True)
    arrays: dict[str, npt.NDArray[Any]] = {**table.columns, _METADATA: np.array(about)}
    with ZipFile(file, "w") as archive:
        for name, values in arrays.items():
            entry = ZipInfo(f"{name}.npy")  # without a time: equal tables give equal bytes
            with archive.open(entry, "w", force_zip64=True) as member:
                np.lib.format.write_array(member, values, allow_pickle=False)


def _write_parquet(table: Table, file: BinaryIO) -> None:
    arrow, parquet = _pyarrow()
    about = {"units": json.dumps(dict(table.units)), "metadata": json.dumps(dict(table.metadata), sort_keys=True)}
    fields = []
    for name in table.columns:
        unit = table.units.get(name)
        fields.append(arrow.field(name, arrow.float64(), metadata={"unit": unit} if unit else None))
    content = arrow.table(dict(table.columns), schema=arrow.schema(fields, metadata=about))
    parquet.write_table(content, file)


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        message = "Parquet files need pyarrow: pip install 'multibody_sym[parquet]', or write .csv or .npz"
        raise OutputError(message, number="O104") from None
    return pyarrow, pyarrow.parquet


_WRITERS: Final[dict[str, Callable[[Table, BinaryIO], None]]] = {
    ".csv": _write_csv, ".npz": _write_npz, ".parquet": _write_parquet,
}


# --- CSV that grows ---------------------------------------------------------------------------------------------


class GrowingCsv:
    """A CSV to which a call appends rows (samples, columns); after the call they are in the file.

    `partial` is the file's name meanwhile, `place` that at the end.
    """

    def __init__(self, file: BinaryIO, partial: str, place: str) -> None:
        self.file, self.partial, self.place = file, partial, place

    def __call__(self, rows: npt.ArrayLike) -> None:
        for lines in csv_lines(np.asarray(rows, dtype=np.float64)):
            self.write(lines)

    def write(self, content: bytes) -> None:
        """Write bytes, which are in the file then even if the process ends. Raises OutputError."""
        with output_errors(self.partial):
            self.file.write(content)
            self.file.flush()

    def discard(self) -> None:
        """Delete the partial file."""
        with suppress(OSError):
            if leads_to(self.partial, self.file):
                os.unlink(self.partial)
            self.file.close()


@contextmanager
def growing_csv(
    path: str | os.PathLike[str], names: list[str], begin: FileState | None = None, *, meanwhile: bool = False
) -> Iterator[GrowingCsv]:
    """Give a CSV that grows in `<path>.partial`, renamed to `path` at the end.

    If the block ends with an exception, the partial file stays if rows are in it, and `path` is as before. If another
    run has the partial file, or has changed `path` since the `begin` (of the block, unless given), this run's files are
    numbered: `run.2.csv.partial`, `run.2.csv`. A device or pipe is written to directly. `meanwhile`: the partial file
    is needed only until it is discarded. Raises OutputError.
    """
    name = os.fspath(path)
    target = partial = name
    through = is_special(name)
    with output_errors(name):
        if through:
            file = open_through(name)
        else:
            target, begin = os.path.realpath(name), file_state(name) if begin is None else begin
            file, partial = open_growing(target)
    table, header = GrowingCsv(file, partial, name), _csv_header(names)
    try:
        table.write(header)
        yield table
        with output_errors(name):
            if through:
                file.close()
            elif not meanwhile:
                os.fsync(file.fileno())
                if not leads_to(partial, file):  # somebody else has renamed it
                    message = "the file was taken away while it was written"
                    raise OutputError(message, where=Where(file=partial), number="O102")
                table.place = as_named(name, target, settle(partial, target, begin))
                file.close()
    except BaseException:
        if not through and os.fstat(file.fileno()).st_size <= len(header):  # no row is in it
            table.discard()
        with suppress(OSError):
            file.close()
        raise


def read_table(path: str | os.PathLike[str]) -> Table:
    """Return the table in a .csv, .npz or .parquet file, or in the `.csv.partial` of an interrupted run.

    Raises InputError for a file that cannot be read or holds something else.
    """
    from zipfile import BadZipFile

    name = os.fspath(path)
    read = _READERS[table_format(name.removesuffix(PARTIAL))]
    try:
        with open(name, "rb") as file:
            return read(file)
    except (OSError, ValueError, KeyError, EOFError, BadZipFile) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"the table cannot be read: {reason}", where=Where(file=name)) from None


def _read_csv(file: BinaryIO) -> Table:
    lines = (line for line in file if line.endswith(b"\n"))  # the last line of an interrupted run may be torn
    if (begin := next(lines, None)) is None:
        raise ValueError("it has no line")
    (header,) = csv.reader([begin.decode("utf-8")])
    names = [name[1:] if name[:1] == "'" and name[1:2] in _FORMULA else name for name in header]
    first = next(lines, None)
    if first is None:
        return Table(dict.fromkeys(names, np.empty(0)))
    rows = np.loadtxt(chain([first], lines), delimiter=",", ndmin=2, comments=None)
    return Table(dict(zip(names, rows.T, strict=True)))


def _read_npz(file: BinaryIO) -> Table:
    with np.load(file, allow_pickle=False) as archive:
        about = json.loads(archive[_METADATA].item())
        columns = {name: archive[name] for name in archive.files if name != _METADATA}
    return Table(columns, about["units"], about["metadata"])


def _read_parquet(file: BinaryIO) -> Table:
    _arrow, parquet = _pyarrow()
    content = parquet.read_table(file)
    about = {key: json.loads(content.schema.metadata[key.encode()]) for key in ("units", "metadata")}
    columns = {name: content.column(name).to_numpy() for name in content.column_names}
    return Table(columns, about["units"], about["metadata"])


_READERS: Final[dict[str, Callable[[BinaryIO], Table]]] = {
    ".csv": _read_csv, ".npz": _read_npz, ".parquet": _read_parquet,
}
