"""Model files: a YAML file or text to a System, every error with file, line and column."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Final

from multibody_sym.errors import ExpressionError, InputError, MultibodyError, Where, joined
from multibody_sym.expressions.tokens import surroundings
from multibody_sym.formats.files import path_name, read_content
from multibody_sym.formats.table_files import with_rows
from multibody_sym.formats.yaml_tree import LARGEST_FILE, Place, Tree, read_bytes, read_text
from multibody_sym.model.declaration import doors
from multibody_sym.model.declaration.file_tree import path_in_file, system_from_tree
from multibody_sym.model.declaration.system import System
from multibody_sym.records import dataclass

_TEXT_NAME: Final = "<text>"


@dataclass(frozen=True)
class Places:
    """Where the parts of a model stand in its file, and which `tables` it read; no part of the System."""

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
            located(each, self.tree, self.name)
        return error

    def told(self, text: str, path: tuple[str, ...]) -> str:
        """Return a text about a part of the model behind its place in the file, and a line of the file."""
        return located(InputError(text, where=Where(path=path)), self.tree, self.name).alone

    def with_others(self, error: MultibodyError, verify: Callable[[System], object]) -> MultibodyError:
        """Return the first mistake of the file, which carries the others; `verify` raises InputError for a system's."""
        from multibody_sym.model.declaration.mistakes import with_others

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
    """Return the System that a model file's text describes; `name` stands in the errors. It has no table files."""
    name = doors.text("name", name)
    return _with_places(read_text(doors.text("text", text), name, readable=True), name)[0]


def load_with_places(
    path: str | os.PathLike[str],
    content: bytes | None = None,
    verify: Callable[[System], object] | None = None,
) -> tuple[System, Places]:
    """Return what `load` returns, and the places for errors that come up later, as in `with places.shown(): ...`.

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
) -> tuple[System, Places]:
    """Return the System and its places; table files are looked for in the `folder`, or not at all.

    Raises the mistakes of the tree with those of the system.
    """
    places, verify = Places(name, tree, has_folder=folder is not None), verify or _verify
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


def _verify(system: System) -> None:
    """Raise InputError for what is wrong in a system; what finds it is read where it is needed."""
    from multibody_sym.model.resolution.resolve import mechanism

    mechanism(system)


def _verify_beside_others(system: System, verify: Callable[[System], object]) -> None:
    """Raise InputError for what is wrong in a system, and nothing else: its file is wrong anyway."""
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
    first = joined(errors)
    every, first.others = [first, *first.others], ()
    return joined(sorted(every, key=lambda each: (each.where.line or 0, each.where.column or 0)))


def located(error: MultibodyError, tree: Tree, name: str) -> MultibodyError:
    """Return `error` with the file, line and column of the nearest thing in the file that `where.path` names."""
    if error.where.file is not None:
        return error
    path = _within(path_in_file(tree.data, error.where.path), tree)
    place = _place(error, path, tree)
    error.where = Where(name, place.line, place.column, path)
    if error.where.path and (error.excerpt is None or _is_shown(error, path, tree)):
        error.excerpt = surroundings(tree.line(place.line), place.column)
    return error


def _is_shown(error: MultibodyError, path: tuple[str, ...], tree: Tree) -> bool:
    """Return whether a line of the file has the text of an expression as it is, so that a caret can be put below it."""
    value = tree.values.get(path)
    return isinstance(error, ExpressionError) and value is not None and value.inner is not None


def _within(path: tuple[str, ...], tree: Tree) -> tuple[str, ...]:
    """Return the path, ended where the file holds a text that was read as a whole record (`k: 3` for a parameter)."""
    ends = (path[:length] for length in range(len(path)))
    return next((end for end in ends if end in tree.values and tree.values[end].is_text), path)


def _place(error: MultibodyError, wanted: tuple[str, ...], tree: Tree) -> Place:
    path = wanted
    while path not in tree.values:
        path = path[:-1]
    value = tree.values[path]
    key = tree.keys.get(path, value)
    if path != wanted or not value.is_text or tree.at(path) == "" or path[-1:] == (error.word,):
        return key
    column = error.where.column if isinstance(error, ExpressionError) else _column_of(error.word, tree.at(path))
    return value if column is None or value.inner is None else Place(value.line, value.inner + column - 1)


def _column_of(word: str | None, text: str) -> int | None:
    """Return where a word stands in a text, from 1."""
    found = re.search(rf"(?<![\w.]){re.escape(word)}(?!\w)", text) if word else None
    return found and found.start() + 1
