"""The cache of compiled artifacts: files named by what they were made from and what they contain, and keys to them.

A file is `<hash of its origin>-<hash of its content><suffix>`: it is never changed in place, a damaged one does not
match its name, and a rebuilt one never has the name of one that is already loaded. A key is a small file
`<hash of the key>.json`: a checksum in the first line, then the file's name and the caller's metadata. Everything is
written to a temporary file and renamed, so that a reader sees all of it or nothing.
"""

from __future__ import annotations

import atexit
import functools
import hashlib
import json
import os
import shutil
import stat
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

_DIGITS: Final = 24
_MOST_FILES: Final = 400  # a full cache loses its oldest quarter, when something is stored


@dataclass(frozen=True)
class Artifact:
    """A verified file of the cache and what was stored with its key."""

    path: Path
    metadata: Mapping[str, Any]


def digest(*parts: str | bytes) -> str:
    """Return a hash of `parts` that changes when text moves from one part to the next."""
    total = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        total.update(b"%d:" % len(data))
        total.update(data)
    return total.hexdigest()[:_DIGITS]


@functools.cache
def toolkit() -> str:
    """Return a hash of the toolkit's files by name, size and time of change: what others made may be outdated.

    The templates that generated code is printed with are among them.
    """
    package = Path(__file__).parent.parent
    places = [package, package / "templates", package.parent / "templates"]
    files = sorted({file for place in places for kind in ("*.py", "*.[ch]", "*.in") for file in place.rglob(kind)})
    status = ((file, file.stat()) for file in files)
    return digest(*(f"{file.relative_to(package.parent)} {s.st_size} {s.st_mtime_ns}" for file, s in status))


def folder() -> Path:
    """Return the cache folder, created if need be; a private temporary one where the user's own cannot be used."""
    wanted = _wanted_folder()
    return wanted if wanted is not None and _is_ours(wanted) else _temporary_folder()


def _wanted_folder() -> Path | None:
    configured = os.environ.get("XDG_CACHE_HOME", "")
    try:
        root = Path(configured) if os.path.isabs(configured) else Path.home() / ".cache"
    except RuntimeError:  # no home folder is known
        return None
    return root / "multibody_sym" if root.is_absolute() else None


def _is_ours(path: Path) -> bool:
    """Make `path` a folder that only its owner, this user, can use; tell whether that is so and it can be written."""
    try:
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = path.lstat()
        if not stat.S_ISDIR(status.st_mode):
            return False
        if hasattr(os, "geteuid"):
            if status.st_uid != os.geteuid() or status.st_mode & 0o022:
                return False
            if status.st_mode & 0o077:
                path.chmod(0o700)
        return os.access(path, os.R_OK | os.W_OK | os.X_OK)
    except OSError:
        return False


@functools.cache
def _temporary_folder() -> Path:
    path = tempfile.mkdtemp(prefix="multibody_sym-")
    atexit.register(shutil.rmtree, path, ignore_errors=True)
    return Path(path)


def find(key: str) -> Artifact | None:
    """Return what was stored under `key`; None if there is nothing, or if it or its file is damaged."""
    try:
        checksum, _, body = (folder() / _key_name(key)).read_bytes().partition(b"\n")
        if checksum.decode("ascii") != digest(key, body):
            return None
        entry = json.loads(body)
        path = folder() / entry["file"]
        return Artifact(path, entry["metadata"]) if path.name == _file_name(path, path.read_bytes()) else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def store(key: str, path: Path, metadata: Mapping[str, Any]) -> None:
    """Let `key` lead to the cached file `path` and to `metadata` (JSON values); what cannot be written is left out."""
    body = json.dumps({"file": path.name, "metadata": metadata}, sort_keys=True).encode()
    with_checksum = digest(key, body).encode("ascii") + b"\n" + body
    try:
        _write(folder() / _key_name(key), with_checksum)
        _make_room()
    except OSError:
        return


def keep(content: bytes, origin: str, suffix: str) -> Path:
    """Store `content` as a file whose name tells its `origin` and content; for this process only if the cache is full.

    Raises OSError if it cannot be written anywhere.
    """
    name = _file_name(Path(f"{digest(origin)}-{suffix}"), content)
    try:
        _write(folder() / name, content)
        return folder() / name
    except OSError:
        _write(_temporary_folder() / name, content)
        return _temporary_folder() / name


def _file_name(path: Path, content: bytes) -> str:
    return f"{path.name.partition('-')[0]}-{digest(content)}{path.suffix}"


def _key_name(key: str) -> str:
    return f"{digest(key)}.json"


def _write(path: Path, content: bytes) -> None:
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix="new-")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def _make_room() -> None:
    files = [entry for entry in os.scandir(folder()) if entry.is_file(follow_symlinks=False)]
    if len(files) > _MOST_FILES:
        files.sort(key=lambda entry: entry.stat(follow_symlinks=False).st_mtime)
        for entry in files[: _MOST_FILES // 4]:
            os.unlink(entry.path)
