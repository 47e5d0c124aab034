"""Which System does a model file describe, and which file a System? Every error has file, line and column.

In: a YAML file or text, with tables in files beside it. Out: a System, and the places of its parts; or text.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import inf, isfinite
from typing import Any, Final

from multibody_sym.errors import (
    ExpressionError,
    InputError,
    ModelError,
    MultibodyError,
    Where,
    at,
    join_errors,
    short_repr,
)
from multibody_sym.model import argument_checks
from multibody_sym.model.fields import Text, verify_keys
from multibody_sym.model.parameters import DECIMAL, MOST_ROWS
from multibody_sym.model.system import System, path_in_file, system_from_tree, tree_from_system, verify_system
from multibody_sym.records import dataclass
from multibody_sym.text.files import path_name, read_content, write_whole
from multibody_sym.text.tokens import surroundings
from multibody_sym.text.yaml_tree import LARGEST_FILE, Place, Tree, read_bytes, read_text

# ----------------------------------------------------------------------------------------------------------------------
# Tables in files of their own, `table: {file: motor.csv}`: two columns of numbers beside the model.
#
# A model may come from a stranger: only regular files in the folder of the model, or in one below, are opened, little
# is read of them, and only plain numbers are taken from them.


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

    Raises InputError with the file, line and column of a mistake in a table, or with the path in the model of a name
    that no table has, or where there is no `folder`.
    """
    inputs = data.get("inputs") if isinstance(data, Mapping) else None
    if not isinstance(inputs, Mapping):
        return data, ()
    named = {name: _table_file(name, x) for name, x in inputs.items()}
    files = {name: _path_in_folder(name, file, folder) for name, file in named.items() if file is not None}
    filled = {name: {**inputs[name], "table": _read_table(name, file)} for name, file in files.items()}
    return ({**data, "inputs": {**inputs, **filled}} if filled else data), tuple(files.values())


def _table_file(name: str, given: Any) -> str | None:
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


def _path_in_folder(name: str, file: str, folder: str | None) -> str:
    """Return the name of a table file, which is in the folder of the model or below it."""
    with at("inputs", name, "table", _KEY):
        if folder is None:
            raise ModelError(
                f"a model without a file has no folder to look for {file} in; write the rows instead", number="F104"
            )
        if os.path.isabs(file):
            raise ModelError(f"{short_repr(file)}: write a path relative to the model file", number="F104")
        if os.pardir in re.split(r"[/\\]", file):
            raise ModelError(f"{short_repr(file)}: a table is in the folder of the model, or below it", number="F104")
        return os.path.join(folder, file)


def _read_table(name: str, file: str) -> list[list[str]]:
    path = ("inputs", name, "table", _KEY)
    with at(*path):
        content = _regular_file_content(file)
    try:
        if len(content) > LARGEST:
            raise _table_error(1, 1, f"a table file has at most {LARGEST} bytes")
        try:
            text = content.decode("utf-8").removeprefix("\ufeff")
        except UnicodeDecodeError as error:
            before = _LINE_END.split(content[: error.start].decode("utf-8"))
            message = f"the byte 0x{content[error.start]:02X} is not valid UTF-8"
            raise _table_error(len(before), len(before[-1]) + 1, message) from None
        return _rows(text)
    except InputError as wrong:
        raise wrong.located(file=file, path=path) from None


def _regular_file_content(file: str) -> bytes:
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


def _table_error(line: int, column: int, message: str) -> InputError:
    return InputError(message, where=Where(line=line, column=column), number="F104")


def _rows(text: str) -> list[list[str]]:
    """Return the rows; the first line may be a heading, `#` begins a comment."""
    rows: list[list[str]] = []
    last, before, heading = 1, -inf, True
    for number, line in enumerate(_LINE_END.split(text), 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        plain = _ROW.fullmatch(line) if len(line) <= _LONGEST else None  # others are looked at cell by cell
        cells = _cells(line) if plain is None else []
        if heading and plain is None and not any(DECIMAL.fullmatch(cell) for _, cell in cells):
            heading = False
            continue
        last, heading = number, False
        row = _row(number, cells) if plain is None else [plain[1], plain[4]]
        if len(rows) == MOST_ROWS:
            raise _table_error(number, 1, f"a table has at most {MOST_ROWS:,} rows")
        argument, value = map(float, row)
        if not (before < argument < inf and -inf < value < inf):
            cells = _cells(line)
            for column, cell in cells:
                if not isfinite(float(cell)):
                    raise _table_error(number, column, f"{cell} is too large")
            column, cell = cells[0]
            raise _table_error(number, column, f"the row begins with {cell}, which does not come after {rows[-1][0]}")
        before = argument
        rows.append(row)
    if len(rows) < 2:
        raise _table_error(last, 1, f"a table has at least two rows, got {len(rows)}")
    return rows


def _cells(line: str) -> list[tuple[int, str]]:
    """Return the cells of a row, each behind the column of its first character."""
    separator = next((x for x in (";", ",", "\t") if x in line), " ")
    cells = []
    for match in _CELL[separator].finditer(line):
        if bare := match[0].strip():
            column = match.start() + len(match[0]) - len(match[0].lstrip()) + 1
            quoted = len(bare) > 1 and bare[0] == bare[-1] == '"'
            cells.append((column, bare[1:-1].strip() if quoted else bare))
    return cells


def _row(line: int, cells: list[tuple[int, str]]) -> list[str]:
    if len(cells) != 2:
        column = cells[2][0] if len(cells) > 2 else 1
        raise _table_error(line, column, f"a table has two columns, argument and value; this row has {len(cells)}")
    for column, text in cells:
        if len(text) > _LONGEST:
            raise _table_error(line, column, f"a number has at most {_LONGEST} digits")
        if not DECIMAL.fullmatch(text):
            comma = "; a number has a decimal point" if DECIMAL.fullmatch(text.replace(",", ".")) else ""
            raise _table_error(line, column, f"{short_repr(text)} is no number{comma}")
    return [text for _, text in cells]


# ----------------------------------------------------------------------------------------------------------------------
# Model files, with the places of their mistakes.

_TEXT_NAME: Final = "<text>"


@dataclass(frozen=True)
class ModelPlaces:
    """The places of a model's parts in its file, and the `tables` that it read; no part of the System."""

    name: str
    tree: Tree
    tables: tuple[str, ...] = ()
    has_folder: bool = True

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Give errors about the model that are raised inside their file, line and column."""
        try:
            yield
        except MultibodyError as error:
            raise self.all_located(error) from None

    def all_located(self, error: MultibodyError) -> MultibodyError:
        """Return the error with its place and a line of the file, and those of the others that it carries."""
        for each in (error, *error.others):
            locate_error(each, self.tree, self.name)
        return error

    def told(self, text: str, path: tuple[str, ...]) -> str:
        """Return a text about a part of the model behind its place in the file, and a line of the file."""
        return locate_error(InputError(text, where=Where(path=path)), self.tree, self.name).alone

    def with_others(self, error: MultibodyError, verify: Callable[[System], object]) -> MultibodyError:
        """Return the first mistake of the file, which carries the others; `verify` raises InputError for a system's."""
        from multibody_sym.model.mistakes import with_others

        folder = os.path.dirname(self.name) if self.has_folder else None
        return self.all_located(
            with_others(error, self.tree.data, lambda data: verify(system_from_tree(with_rows(data, folder)[0])))
        )


def load(path: str | os.PathLike[str]) -> System:
    """Return the System that the model file at `path` describes.

    Raises InputError (with file, line and column) for a file that cannot be read or that is wrong.
    """
    return load_with_places(path)[0]


def loads(text: str, name: str = _TEXT_NAME) -> System:
    """Return the System that a model file's text describes; `name` stands in the errors. It has no table files.

    Raises InputError for a text that is no model, with the place of each mistake.
    """
    name = argument_checks.text("name", name)
    return _with_places(read_text(argument_checks.text("text", text), name, readable=True), name)[0]


def load_with_places(
    path: str | os.PathLike[str],
    content: bytes | None = None,
    verify: Callable[[System], object] | None = None,
) -> tuple[System, ModelPlaces]:
    """Return the System, and the places for errors that come up later, as in `with places.shown(): ...`.

    `content` is that of the file, if it is read already. `verify` finds the mistakes beside the first one (it raises
    InputError); by default `mechanism` does.
    """
    name = path_name(path, "a model file")
    content = read_content(name, LARGEST_FILE) if content is None else content
    if content.lstrip().startswith((b"<?xml", b"<robot")):
        message = "this is XML; multibody-sym import turns URDF into a model file, load_urdf(...) reads it in Python"
        raise InputError(message, where=Where(file=name, line=1, column=1), number="F101")
    return _with_places(read_bytes(content, name, readable=True), name, os.path.dirname(name), verify)


def _with_places(
    tree: Tree, name: str, folder: str | None = None, verify: Callable[[System], object] | None = None
) -> tuple[System, ModelPlaces]:
    """Return the System and its places; table files are looked for in the `folder`, or not at all.

    Raises the mistakes of the tree with those of the system.
    """
    places, verify = ModelPlaces(name, tree, has_folder=folder is not None), verify or _verify_mechanism
    try:
        data, tables = with_rows(tree.data, folder)
        system = system_from_tree(data)
        if tree.mistakes:
            _verify_beside_others(system, verify)
    except MultibodyError as error:
        raise _in_order([*tree.mistakes, places.with_others(error, verify)]) from None
    if tree.mistakes:
        raise _in_order(tree.mistakes)
    return system, replace(places, tables=tables)


def _verify_mechanism(system: System) -> None:
    """Raise InputError for the mistakes of a system."""
    from multibody_sym.mechanics.resolve import mechanism

    mechanism(system)


def _verify_beside_others(system: System, verify: Callable[[System], object]) -> None:
    """Raise InputError for the mistakes of a system, and nothing else: its file is wrong anyway."""
    try:
        verify(system)
    except InputError:
        raise
    except Exception:  # a wrong file may fail anywhere: its mistakes are raised without that
        return


def _in_order(errors: Sequence[MultibodyError]) -> MultibodyError:
    """Return the first of errors, by their places in the file, which carries the others."""
    if len(errors) == 1:
        return errors[0]
    first = join_errors(errors)
    every, first.others = [first, *first.others], ()
    return join_errors(sorted(every, key=lambda each: (each.where.line or 0, each.where.column or 0)))


def locate_error(error: MultibodyError, tree: Tree, name: str) -> MultibodyError:
    """Return `error` with the file, line and column of the nearest thing in the file that `where.path` names."""
    if error.where.file is not None:
        return error
    path = path_in_file(tree.data, error.where.path)
    # a text may have been read as a whole record (`k: 3` for a parameter): the path ends there
    ends = (path[:length] for length in range(len(path)))
    path = next((end for end in ends if end in tree.values and tree.values[end].is_text), path)
    place = _find_place(error, path, tree)
    error.where = Where(name, place.line, place.column, path)
    value = tree.values.get(path)  # a caret is put below the text of an expression that the line has as it is
    as_it_is = isinstance(error, ExpressionError) and value is not None and value.inner is not None
    if error.where.path and (error.excerpt is None or as_it_is):
        error.excerpt = surroundings(tree.line(place.line), place.column)
    return error


def _find_place(error: MultibodyError, wanted: tuple[str, ...], tree: Tree) -> Place:
    """Return where in the file a mistake is: at the column of a wrong word in a text, else at a value or its key."""
    path = wanted
    while path not in tree.values:
        path = path[:-1]
    value = tree.values[path]
    key = tree.keys.get(path, value)
    if path != wanted or not value.is_text or tree.at(path) == "" or path[-1:] == (error.word,):
        return key
    column = error.where.column
    if not isinstance(error, ExpressionError):
        found = re.search(rf"(?<![\w.]){re.escape(error.word)}(?!\w)", tree.at(path)) if error.word else None
        column = None if found is None else found.start() + 1
    return value if column is None or value.inner is None else Place(value.line, value.inner + column - 1)


# ----------------------------------------------------------------------------------------------------------------------
# A System back to YAML text, of which the reader makes an equal System.

_WIDTH: Final = 120
_PLAIN: Final = re.compile(r"[A-Za-z0-9_.+/(-](?:[A-Za-z0-9_.+*/^()<>=' -]*[A-Za-z0-9_.+*/^()<>='-])?")
_NOT_PLAIN: Final = re.compile(r"^(?:-|---|\.\.\.)(?: |$)")


def dump(system: System, file: str | os.PathLike[str]) -> None:
    """Write the System as a model file.

    Raises InputError for what is no System or path, OutputError where writing fails; an existing file is then unharmed.
    """
    write_whole(file, dumps(system).encode("utf-8"))


def dumps(system: System) -> str:
    """Return the text of a model file that describes the System. Raises InputError for what is no System."""
    verify_system(system)
    return yaml_text(tree_from_system(system))


def yaml_text(tree: Mapping[str, Any]) -> str:
    """Return a tree of maps, lists and text as YAML: one line for each element that fits, else indented."""
    return "".join(line + "\n" for key, value in tree.items() for line in _entry(key, value, 0, blocks=1))


def _entry(key: str, value: Any, indent: int, blocks: int) -> list[str]:
    """Return `key: value`, in one line where it fits; `blocks` levels are indented even where one line would do."""
    head = " " * indent + _scalar(key) + ":"
    line = f"{head} {_flow(value)}"
    if not isinstance(value, (Mapping, list, tuple)) or not value:
        return [line]
    deep = isinstance(value, Mapping) and any(isinstance(x, (Mapping, list, tuple)) for x in value.values())
    if len(line) <= _WIDTH and (blocks <= 0 or not deep):
        return [line]
    if isinstance(value, Mapping):
        return [head, *(x for k, v in value.items() for x in _entry(k, v, indent + 2, blocks - 1))]
    return [head, *(f"{' ' * (indent + 2)}- {_flow(item)}" for item in value)]


def _flow(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_scalar(k)}: {_flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return _scalar(value)


def _scalar(value: Any) -> str:
    """Return text plain where YAML leaves it alone inside and outside of {...} and [...], else quoted."""
    text = str(value)
    if _PLAIN.fullmatch(text) and not _NOT_PLAIN.match(text) and text.count("(") <= text.count(")"):
        return text
    return '"' + "".join(map(_escape, text)) + '"'


def _escape(character: str) -> str:
    if character in '"\\':
        return "\\" + character
    if character.isprintable():
        return character
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
