"""Tables in files of their own, `table: {file: motor.csv}`: two columns of numbers beside the model.

A model may come from a stranger: only regular files in the folder of the model, or in one below, are opened, little is
read of them, and only plain numbers are taken from them.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Mapping
from math import inf, isfinite
from typing import Any, Final, NamedTuple

from multibody_sym.errors import InputError, ModelError, Where, at, shown
from multibody_sym.model.declaration.fields import verify_keys
from multibody_sym.model.declaration.tables import DECIMAL, MOST_ROWS
from multibody_sym.model.declaration.values import Text

LARGEST: Final = 1 << 26
_LONGEST: Final = 40
_KEY: Final = "file"
_ROW: Final = re.compile(rf"[ ]*({DECIMAL.pattern})[ ]*[ ;,\t][ ]*({DECIMAL.pattern})[ ]*", re.ASCII)
"""A row that can only be read in one way, as nearly all are."""
_LINE_END: Final = re.compile(r"\r\n|\r|\n")
_CELL: Final[Mapping[str, re.Pattern[str]]] = {
    separator: re.compile(pattern)
    for separator, pattern in {";": r"[^;]+", ",": r"[^,]+", "\t": r"[^\t]+", " ": r"\S+"}.items()
}
_OPENED: Final = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NOCTTY", 0)


def with_rows(data: Any, folder: str | None) -> tuple[Any, tuple[str, ...]]:
    """Return a model file's content with the rows of its table files in their place, and the names of these files.

    Raises InputError: with the file, line and column of what is wrong in a table, with the path in the model of a name
    that no table has, or where there is no `folder` to look in.
    """
    inputs = data.get("inputs") if isinstance(data, Mapping) else None
    if not isinstance(inputs, Mapping):
        return data, ()
    named = {name: _named(name, x) for name, x in inputs.items()}
    files = {name: _placed(name, file, folder) for name, file in named.items() if file is not None}
    filled = {name: {**inputs[name], "table": _read(name, file)} for name, file in files.items()}
    return ({**data, "inputs": {**inputs, **filled}} if filled else data), tuple(files.values())


def _named(name: str, given: Any) -> str | None:
    """Return the file that an input names, None where it names none."""
    table = given.get("table") if isinstance(given, Mapping) else None
    if not isinstance(table, Mapping):
        return None
    with at("inputs", name, "table"):
        verify_keys(table, (_KEY,))
        with at(_KEY):
            if table.get(_KEY) == "":
                raise ModelError("file is empty: write the name of a table", number="M102")
            return Text().accept(table.get(_KEY))


def _placed(name: str, file: str, folder: str | None) -> str:
    """Return the name of a table file, which is in the folder of the model or below it."""
    with at("inputs", name, "table", _KEY):
        if folder is None:
            raise ModelError(
                f"a model without a file has no folder to look for {file} in; write the rows instead", number="F104"
            )
        if os.path.isabs(file):
            raise ModelError(f"{shown(file)}: write a path relative to the model file", number="F104")
        if os.pardir in re.split(r"[/\\]", file):
            raise ModelError(f"{shown(file)}: a table is in the folder of the model, or below it", number="F104")
        return os.path.join(folder, file)


def _read(name: str, file: str) -> list[list[str]]:
    path = ("inputs", name, "table", _KEY)
    with at(*path):
        content = _content(file)
    try:
        return _rows(_text(content))
    except _TableError as wrong:
        where = Where(file=file, line=wrong.line, column=wrong.column, path=path)
        raise InputError(wrong.message, where=where, number="F104") from None


def _content(file: str) -> bytes:
    """Return the bytes of a regular file, one more than the most at most; nothing else is waited for."""
    try:
        descriptor = os.open(file, _OPENED)
        with open(descriptor, "rb") as opened:
            if not stat.S_ISREG(os.fstat(descriptor).st_mode):
                raise ModelError(f"{file} is no regular file", number="F104")
            return opened.read(LARGEST + 1)
    except FileNotFoundError:
        raise ModelError(f"there is no such file: {file}", number="F104") from None
    except IsADirectoryError:
        raise ModelError(f"{file} is no regular file", number="F104") from None
    except (OSError, ValueError) as error:
        raise ModelError(f"{file} cannot be read: {getattr(error, 'strerror', None) or error}", number="F104") from None


# --- what stands in it -----------------------------------------------------------------------------------------------


class _TableError(Exception):
    """What is wrong in a table file, and where."""

    def __init__(self, line: int, column: int, message: str) -> None:
        super().__init__(message)
        self.line, self.column, self.message = line, column, message


class _Cell(NamedTuple):
    """A cell of a row with the column of its first character."""

    column: int
    text: str


def _text(content: bytes) -> str:
    if len(content) > LARGEST:
        raise _TableError(1, 1, f"a table file has at most {LARGEST} bytes")
    try:
        return content.decode("utf-8").removeprefix("\ufeff")
    except UnicodeDecodeError as error:
        before = _LINE_END.split(content[: error.start].decode("utf-8"))
        message = f"the byte 0x{content[error.start]:02X} is not valid UTF-8"
        raise _TableError(len(before), len(before[-1]) + 1, message) from None


def _rows(text: str) -> list[list[str]]:
    """Return the rows; the first line may be a heading, `#` begins a comment. Raises _TableError."""
    rows: list[list[str]] = []
    last, before, heading = 1, -inf, True
    for number, line in enumerate(_LINE_END.split(text), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        plain = _ROW.fullmatch(line) if len(line) <= _LONGEST else None  # others are looked at cell by cell
        cells = _cells(line) if plain is None else []
        if heading and plain is None and not any(DECIMAL.fullmatch(cell.text) for cell in cells):
            heading = False
            continue
        last, heading = number, False
        row = _row(number, cells) if plain is None else [plain[1], plain[4]]
        if len(rows) == MOST_ROWS:
            raise _TableError(number, 1, f"a table has at most {MOST_ROWS:,} rows")
        argument, value = map(float, row)
        if not (before < argument < inf and -inf < value < inf):
            raise _misplaced(number, line, rows)
        before = argument
        rows.append(row)
    if len(rows) < 2:
        raise _TableError(last, 1, f"a table has at least two rows, got {len(rows)}")
    return rows


def _misplaced(number: int, line: str, before: list[list[str]]) -> _TableError:
    """Return what is wrong with a row of two numbers: one is too large, or its argument comes too early."""
    cells = _cells(line)
    for column, text in cells:
        if not isfinite(float(text)):
            return _TableError(number, column, f"{text} is too large")
    message = f"the row begins with {cells[0].text}, which does not come after {before[-1][0]}"
    return _TableError(number, cells[0].column, message)


def _cells(line: str) -> list[_Cell]:
    separator = next((x for x in (";", ",", "\t") if x in line), " ")
    return [_cell(match) for match in _CELL[separator].finditer(line) if match[0].strip()]


def _cell(match: re.Match[str]) -> _Cell:
    bare = match[0].strip()
    column = match.start() + len(match[0]) - len(match[0].lstrip()) + 1
    return _Cell(column, bare[1:-1].strip() if len(bare) > 1 and bare[0] == bare[-1] == '"' else bare)


def _row(line: int, cells: list[_Cell]) -> list[str]:
    if len(cells) != 2:
        column = cells[2].column if len(cells) > 2 else 1
        raise _TableError(line, column, f"a table has two columns, argument and value; this row has {len(cells)}")
    for column, text in cells:
        if len(text) > _LONGEST:
            raise _TableError(line, column, f"a number has at most {_LONGEST} digits")
        if not DECIMAL.fullmatch(text):
            comma = "; a number has a decimal point" if DECIMAL.fullmatch(text.replace(",", ".")) else ""
            raise _TableError(line, column, f"{shown(text)} is no number{comma}")
    return [text for _, text in cells]
