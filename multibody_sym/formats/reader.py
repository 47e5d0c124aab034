"""Model files: a YAML file or text to a System, every error with file, line and column."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from multibody_sym.errors import ExpressionError, InputError, Where
from multibody_sym.formats.yaml_tree import LARGEST_FILE, Place, Tree, read_bytes, read_text
from multibody_sym.model.declaration import system_from_tree
from multibody_sym.model.system import System

_TEXT_NAME: Final = "<text>"


def load(path: str | os.PathLike[str]) -> System:
    """Return the System that the model file at `path` describes.

    Raises InputError (with file, line and column) for a file that cannot be read or that is wrong.
    """
    name = os.fspath(path)
    return _system(read_bytes(_content(name), name), name)


def loads(text: str, name: str = _TEXT_NAME) -> System:
    """Return the System that a model file's text describes; `name` stands in the errors."""
    return _system(read_text(text, name), name)


def _content(name: str) -> bytes:
    try:
        if os.path.isdir(name):
            raise InputError("this is a directory, not a model file", where=Where(file=name))
        with open(name, "rb") as file:
            return file.read(LARGEST_FILE + 1)
    except FileNotFoundError:
        raise InputError(f"there is no such file{_neighbour(name)}", where=Where(file=name)) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"the file cannot be read: {reason}", where=Where(file=name)) from None


def _neighbour(name: str) -> str:
    from difflib import get_close_matches

    path = Path(name)
    try:
        names = [entry.name for entry in path.parent.iterdir() if entry.suffix in (".yaml", ".yml")]
    except OSError:
        return ""
    near = get_close_matches(path.name, names, n=1, cutoff=0.7)
    return f"; did you mean {path.parent / near[0]}?" if near else ""


def _system(tree: Tree, name: str) -> System:
    try:
        return system_from_tree(tree.data)
    except InputError as error:
        raise located(error, tree, name) from None


def located(error: InputError, tree: Tree, name: str) -> InputError:
    """Return `error` with the file, line and column of the nearest thing in the file that `where.path` names."""
    place = _place(error, tree)
    error.where = Where(name, place.line, place.column, error.where.path)
    return error


def _place(error: InputError, tree: Tree) -> Place:
    wanted = tuple(map(str, error.where.path))
    path = wanted
    while path not in tree.values:
        path = path[:-1]
    value = tree.values[path]
    key = tree.keys.get(path, value)
    if path != wanted or not value.is_text or error.message.startswith("unknown key"):
        return key
    column = error.where.column if isinstance(error, ExpressionError) else None
    return value if column is None or value.inner is None else Place(value.line, value.inner + column - 1)
