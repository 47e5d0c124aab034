"""The folder of an export: its files replace those of an earlier one, never what somebody else wrote or changed.

`names.json` tells under `written` what the files were when they were written, itself included.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from multibody_sym.errors import InputError, OutputError, Where
from multibody_sym.formats.files import is_special, write_whole

_TABLE: Final = "names.json"
_WRITTEN: Final = "written"
_DIGITS: Final = 24


def write_export(directory: Path, texts: Mapping[str, str], table: Mapping[str, Any]) -> list[Path]:
    """Write `texts` by file name and `table` as `names.json` into a folder made if need be; return the files.

    Raises InputError, and writes nothing, where one of them is there already and is not what an export wrote;
    OutputError.
    """
    if "\0" in str(directory):
        raise InputError("no folder has such a name", where=Where(file=repr(str(directory))), number="O101")
    contents = {name: text.encode("utf-8") for name, text in texts.items()}
    earlier = _written_before(directory)
    written = {**earlier, **{name: _digest(content) for name, content in contents.items()}}
    written.pop(_TABLE, None)
    contents[_TABLE] = _signed(table, written)
    for name, content in contents.items():
        _verify_replaceable(directory / name, content, earlier.get(name))
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as problem:
        message = f"the folder cannot be made: {getattr(problem, 'strerror', None) or problem}"
        raise OutputError(message, where=Where(file=str(directory)), number="O101") from None
    for name, content in contents.items():
        write_whole(directory / name, content)
    return [directory / name for name in contents]


def _signed(table: Mapping[str, Any], written: Mapping[str, str]) -> bytes:
    """Return the table as a file that tells what was written, and what it is itself."""
    own = _digest(_printed({**table, _WRITTEN: written}))
    return _printed({**table, _WRITTEN: {**written, _TABLE: own}})


def _printed(table: Mapping[str, Any]) -> bytes:
    return (json.dumps(table, indent=2) + "\n").encode("utf-8")


def _written_before(directory: Path) -> dict[str, str]:
    """Return the digests of what earlier exports wrote into the folder, that of the table being that of the file."""
    place = directory / _TABLE
    if is_special(str(place)):
        return {}
    try:
        content = place.read_bytes()
        table = json.loads(content)
        written = {str(name): str(digest) for name, digest in table.pop(_WRITTEN).items()}
        del written[_TABLE]
        if content == _signed(table, written):
            written[_TABLE] = _digest(content)
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}
    return written


def _verify_replaceable(path: Path, content: bytes, digest: str | None) -> None:
    try:
        there = None if is_special(str(path)) else path.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        return
    except OSError:
        there = None
    if there is None or (there != content and _digest(there) != digest):
        message = "this file is not as an export wrote it here; move it away, or choose another folder"
        raise InputError(message, where=Where(file=str(path)), number="O101")


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:_DIGITS]
