"""A System back to YAML text: what the reader reads back is equal."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from typing import Any, Final

from multibody_sym.formats.files import write_whole
from multibody_sym.model.declaration.file_tree import tree_from_system
from multibody_sym.model.declaration.system import System, verify_system

_WIDTH: Final = 120
_PLAIN: Final = re.compile(r"[A-Za-z0-9_.+/(-](?:[A-Za-z0-9_.+*/^()<>=' -]*[A-Za-z0-9_.+*/^()<>='-])?")
_NOT_PLAIN: Final = re.compile(r"^(?:-|---|\.\.\.)(?: |$)")


def dump(system: System, file: str | os.PathLike[str]) -> None:
    """Write the System as a model file. Raises OutputError where that fails; an existing file is then unharmed."""
    write_whole(file, dumps(system).encode("utf-8"))


def dumps(system: System) -> str:
    """Return the text of a model file that describes the System."""
    verify_system(system)
    return yaml_text(tree_from_system(system))


def yaml_text(tree: Mapping[str, Any]) -> str:
    """Return a tree of maps, lists and text as YAML: one line for each element that fits, else indented."""
    return "".join(line + "\n" for key, value in tree.items() for line in _entry(key, value, 0, blocks=1))


def _entry(key: str, value: Any, indent: int, blocks: int) -> list[str]:
    """Return the lines of `key: value`; `blocks` levels are indented even where one line would do."""
    head = " " * indent + _scalar(key) + ":"
    line = f"{head} {_flow(value)}"
    if not isinstance(value, (Mapping, list, tuple)) or not value:
        return [line]
    if len(line) <= _WIDTH and (blocks <= 0 or not _holds_collections(value)):
        return [line]
    if isinstance(value, Mapping):
        return [head, *(x for k, v in value.items() for x in _entry(k, v, indent + 2, blocks - 1))]
    return [head, *(f"{' ' * (indent + 2)}- {_flow(item)}" for item in value)]


def _holds_collections(value: Any) -> bool:
    items = value.values() if isinstance(value, Mapping) else value
    return isinstance(value, Mapping) and any(isinstance(x, (Mapping, list, tuple)) for x in items)


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
    return '"' + "".join(_escaped(c) for c in text) + '"'


def _escaped(character: str) -> str:
    if character in '"\\':
        return "\\" + character
    if character.isprintable():
        return character
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
