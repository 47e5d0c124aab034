"""The cache of compiled artifacts: files named by what they were made from and what they contain, and keys to them.

A file is `<hash of its origin>-<hash of its content><suffix>`: it is never changed in place, a damaged one does not
match its name, and a rebuilt one never has the name of one that is already loaded. A key is a small file
`<hash of the key>.json`: a checksum in the first line, then the file's name and the caller's metadata. Everything is
written to a temporary file and renamed, so that a reader sees all of it or nothing.

What a process is about to use stays: the finder keeps the folder (`keep_files`) until it is loaded
or read, and marks it as used. What several processes need at the same time one of them makes, `alone`.
"""

from __future__ import annotations

import atexit
import contextlib
import fcntl
import functools
import hashlib
import json
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator, Mapping
from itertools import count
from pathlib import Path
from typing import Any, Final

from multibody_sym.records import dataclass

# ----------------------------------------------------------------------------------------------------------------------
# Locks between processes (and threads) on files: gone with the process that holds them, and never waited for forever.
#
# Where the system has no such locks, or the file's folder cannot be written, everybody goes on as if alone.


try:
    import fcntl
except ImportError:  # not POSIX
    fcntl = None  # type: ignore[assignment]

_OPEN: Final = os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0)
_FIRST_PAUSE: Final = 0.002
_LONGEST_PAUSE: Final = 0.1


@contextlib.contextmanager
def lock(path: Path, *, seconds: float = 1.0, shared: bool = False, remove: bool = False) -> Iterator[None]:
    """Hold the lock on `path` in a block, alone or `shared` with others; after `seconds` of waiting, go on without.

    `remove`: the file, which is made if need be, goes with the lock.
    """
    descriptor = _waited_for(path, seconds, shared)
    try:
        yield
    finally:
        _let_go(descriptor, path if remove else None)


@contextlib.contextmanager
def lock_at_once(path: Path) -> Iterator[bool]:
    """Tell a block whether it holds the lock on `path` alone: it does unless somebody else has it now."""
    descriptor = _waited_for(path, 0.0, shared=False)
    try:
        yield descriptor is not None or fcntl is None
    finally:
        _let_go(descriptor, None)


def _waited_for(path: Path, seconds: float, shared: bool) -> int | None:
    """Return a descriptor that holds the lock; None where there are no locks or the time is over."""
    if fcntl is None:
        return None
    end, pause = time.monotonic() + seconds, _FIRST_PAUSE
    with contextlib.suppress(OSError):
        while True:
            descriptor = os.open(path, _OPEN, 0o600)
            try:
                while not _take_lock(descriptor, shared):
                    if time.monotonic() >= end:
                        os.close(descriptor)
                        return None
                    time.sleep(pause)
                    pause = min(2 * pause, _LONGEST_PAUSE)
                with contextlib.suppress(FileNotFoundError):
                    if os.path.samestat(os.stat(path), os.fstat(descriptor)):
                        return descriptor
            except BaseException:
                os.close(descriptor)
                raise
            os.close(descriptor)  # it was removed meanwhile, by the one before
    return None


def _take_lock(descriptor: int, shared: bool) -> bool:
    try:
        fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _let_go(descriptor: int | None, path: Path | None) -> None:
    if descriptor is None:
        return
    if path is not None:
        with contextlib.suppress(OSError):
            os.unlink(path)
    with contextlib.suppress(OSError):
        fcntl.flock(descriptor, fcntl.LOCK_UN)  # a child made by fork has the descriptor, too
    os.close(descriptor)


# ----------------------------------------------------------------------------------------------------------------------

_DIGITS: Final = 24
_MOST_FILES: Final = 400  # a full cache loses what was not used for longest, down to three quarters of that
_IN_USE: Final = 60.0  # seconds for which what was stored or found stays, however full the cache is
_PATIENCE: Final = 300.0  # seconds: longer than nearly every compilation; who waits in vain makes it itself
_LOCK: Final = ".lock"
_HELD: Final = f"held{_LOCK}"
_STORES: Final = count()
_SOURCES: Final = (".py", ".c", ".h", ".in")


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
    package = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    around = os.path.dirname(package)
    places = (package, os.path.join(around, "templates"))
    files = sorted(file for place in places for file in _sources(place, os.path.relpath(place, around)))
    return digest(*(" ".join(map(str, file)) for file in files))


def _sources(folder: str, place: str) -> Iterator[tuple[str, int, int]]:
    """Yield the name under `place`, size and time of change of each file of source in a folder."""
    with contextlib.suppress(FileNotFoundError), os.scandir(folder) as entries:
        for entry in entries:
            if entry.is_dir(follow_symlinks=False):
                if entry.name != "__pycache__":
                    yield from _sources(entry.path, f"{place}/{entry.name}")
            elif entry.name.endswith(_SOURCES):
                status = entry.stat()
                yield f"{place}/{entry.name}", status.st_size, status.st_mtime_ns


def folder() -> Path:
    """Return the cache folder, created if need be; a private temporary one where the user's own cannot be used."""
    configured = os.environ.get("XDG_CACHE_HOME", "")
    try:
        root = Path(configured) if os.path.isabs(configured) else Path.home() / ".cache"
    except RuntimeError:  # no home folder is known
        return _temporary_folder()
    wanted = root / "multibody_sym"
    return wanted if root.is_absolute() and _is_ours(wanted) else _temporary_folder()


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
    """Return what was stored under `key`, marked as used; None if there is nothing, or if it or its file is damaged.

    The file stays as long as the caller, or this process for it, keeps the folder (`keep_files`).
    """
    found = _read(key)
    return None if found is None else found[0]


def stored_content(key: str) -> bytes | None:
    """Return the content of the file stored under `key`, or None as `find` does."""
    found = _read(key)
    return None if found is None else found[1]


def _read(key: str) -> tuple[Artifact, bytes] | None:
    place = folder() / _key_name(key)
    try:
        with keep_files():
            checksum, _, body = place.read_bytes().partition(b"\n")
            if checksum.decode("ascii") != digest(key, body):
                return None
            entry = json.loads(body)
            path = folder() / entry["file"]
            data = path.read_bytes()
            if path.name != _file_name(path, data):
                return None
            for used in (place, path):
                os.utime(used)
            return Artifact(path, entry["metadata"]), data
    except (OSError, ValueError, KeyError, TypeError):
        return None


@contextlib.contextmanager
def keep_files() -> Iterator[None]:
    """Keep every process from making room in the cache as long as the block lasts."""
    with lock(folder() / _HELD, shared=True):
        yield


@contextlib.contextmanager
def alone(key: str) -> Iterator[None]:
    """Let no other process or thread be in such a block of the same `key`: what it makes the others then find.

    A process that ends, however it does, is no longer in it. Nobody waits longer than a few minutes.
    """
    with lock(folder() / f"{digest(key)}{_LOCK}", seconds=_PATIENCE, remove=True):
        yield


@contextlib.contextmanager
def alone_at_once(key: str) -> Iterator[bool]:
    """Tell a block whether no other process or thread is in such a block, or in `alone`, of the same `key`."""
    path = folder() / f"{digest(key)}{_LOCK}"
    descriptor = _waited_for(path, 0.0, shared=False)
    try:
        yield descriptor is not None or fcntl is None
    finally:
        _let_go(descriptor, path)


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
    """Delete what was not used for longest, if the cache is full and nobody is about to load something from it.

    A process looks at its first store and then once in a sixteenth of the limit: reading the folder takes longer than
    storing, and files in use may keep it full.
    """
    if next(_STORES) % (1 + _MOST_FILES // 16):
        return
    place = folder()
    if len(os.listdir(place)) > _MOST_FILES and len(_files(place)) > _MOST_FILES:
        with lock_at_once(place / _HELD) as free:
            if not free:
                return
            files, now = _files(place), time.time()
            for used, path in files[: max(0, len(files) - _MOST_FILES * 3 // 4)]:
                if now - used >= _IN_USE:
                    with contextlib.suppress(FileNotFoundError):
                        os.unlink(path)
            for left in place.glob(f"*{_LOCK}"):  # of locks that nobody has: a process was killed with them
                if left.name != _HELD:
                    with lock_at_once(left) as alone_with_it, contextlib.suppress(FileNotFoundError):
                        if alone_with_it:
                            left.unlink()


def _files(place: Path) -> list[tuple[float, str]]:
    """Return the files of the cache but for those that locks are on, each with the time of its last use."""
    found = []
    with os.scandir(place) as entries:
        for entry in entries:
            with contextlib.suppress(FileNotFoundError):  # another process makes room, too
                if entry.is_file(follow_symlinks=False) and not entry.name.endswith(_LOCK):
                    found.append((entry.stat(follow_symlinks=False).st_mtime, entry.path))
    return sorted(found)
