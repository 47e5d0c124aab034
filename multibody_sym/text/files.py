"""Files written so that an existing one is never harmed: beside the target, synced, then put in its place.

Several runs may name one target. Each has a file of its own until it ends. The first to end has the target; later ones
find it changed since their beginning, and keep their files beside it. Devices and pipes are written through.
"""

from __future__ import annotations

import errno
import itertools
import os
import stat
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO, Final

from multibody_sym.errors import ArgumentError, InputError, OutputError, Where, short_repr

try:
    import fcntl
except ImportError:  # not POSIX
    fcntl = None  # type: ignore[assignment]

PARTIAL: Final = ".partial"
_ENDINGS: Final = (".yaml", ".yml")
_ALIKE: Final = 0.7
_AT_ONCE: Final = getattr(os, "O_NONBLOCK", 0)
FileState = tuple[int, ...]
_GROWING: Final = os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
_NEW: Final = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)


def path_name(path: Any, what: str = "a file") -> str:
    """Return a path as text; raises ArgumentError for a value that names no file."""
    if not isinstance(path, (str, os.PathLike)):
        raise ArgumentError(f"expected the path of {what}, got {short_repr(path)}")
    name = os.fspath(path)
    if not isinstance(name, str):
        raise ArgumentError(f"expected the path of {what} as text, got {short_repr(path)}")
    return name


def write_whole(path: str | os.PathLike[str], content: bytes) -> None:
    """Write `content` to `path`, all of it or nothing. Raises OutputError."""

    def write(file: BinaryIO) -> None:
        file.write(content)

    replace_with(path, write)


def write_new(path: str | os.PathLike[str], content: bytes) -> None:
    """Write `content` to a file that does not exist yet: all of it, or there is none. A device or pipe may exist.

    Raises InputError where it does, and for `-`, which means standard output elsewhere; OutputError.
    """
    name = path_name(path)
    if name == "-":
        message = "this names no file: write /dev/stdout for standard output, ./- for a file called so"
        raise InputError(message, where=Where(file=name), number="O101")
    if is_special(name):
        write_whole(name, content)
        return
    try:
        with output_errors(name):
            file = open_new(name)
    except OutputError as error:
        if not isinstance(error.__cause__, FileExistsError):
            raise
        raise InputError(
            "this file exists already; choose another one with -o", where=Where(file=name), number="O101"
        ) from None
    try:
        with output_errors(name), file:
            file.write(content)
            _sync(file)
    except BaseException:
        with suppress(OSError):
            os.unlink(name)
        raise


def replace_with(
    path: str | os.PathLike[str], write: Callable[[BinaryIO], None], begin: FileState | None = None
) -> str:
    """Let `write` fill a new file that then replaces `path`; if it fails, `path` is as before. Return its name.

    If `path` has changed since the `begin`, the new file stays beside it, under the returned name. A device or pipe
    (`/dev/stdout`) is written to directly. Raises OutputError.
    """
    name = path_name(path)
    with output_errors(name):
        if is_special(name):
            with open_through(name) as file:
                write(file)
            return name
        target = os.path.realpath(name)
        temporary = f"{target}.{os.urandom(4).hex()}.tmp"
        try:
            with open_new(temporary) as file:
                write(file)
                _sync(file)
            return as_named(name, target, settle(temporary, target, begin))
        except BaseException:
            with suppress(OSError):
                os.unlink(temporary)
            raise


class PipeNotice(UserWarning):
    """Somebody waits at a pipe."""


def open_through(name: str) -> BinaryIO:
    """Open a device or pipe to write to; wait, with a note, until somebody reads a pipe."""
    try:
        descriptor = open_at_once(name, os.O_WRONLY)
    except OSError as error:
        if error.errno != errno.ENXIO:
            raise
        warnings.warn(f"nobody reads the pipe {name} yet, which is waited for", PipeNotice, stacklevel=2)
        descriptor = os.open(name, os.O_WRONLY)
    wait_from_now(descriptor)
    return os.fdopen(descriptor, "wb")


def open_at_once(name: str, flags: int) -> int:
    """Open a file without waiting for the other end of a pipe, neither now nor in reading. Raises OSError."""
    return os.open(name, flags | _AT_ONCE)


def wait_from_now(descriptor: int) -> None:
    """Let reading and writing wait again after `open_at_once`."""
    if _AT_ONCE:
        os.set_blocking(descriptor, True)


def file_state(path: str | os.PathLike[str]) -> FileState:
    """Return numbers that change when somebody writes the file `path`; () where there is none."""
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return ()
    return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns


def settle(temporary: str, target: str, begin: FileState | None) -> str:
    """Rename a finished file to `target`, or beside it if that has changed since the `begin`; return the name."""
    with _folder_locked(os.path.dirname(target) or "."):
        if begin is None or file_state(target) == begin:
            # with the permissions of the replaced file
            with suppress(OSError):
                os.chmod(temporary, stat.S_IMODE(os.stat(target).st_mode))
            os.replace(temporary, target)
            with suppress(OSError):
                folder = os.open(os.path.dirname(target) or ".", os.O_RDONLY)
                try:
                    os.fsync(folder)
                finally:
                    os.close(folder)
            return target
        for number in itertools.count(2):  # the first numbered name that is free
            name = _with_number(target, number)
            with suppress(FileExistsError):
                open_new(name).close()
                os.replace(temporary, name)
                return name
    raise AssertionError


def open_growing(target: str) -> tuple[BinaryIO, str]:
    """Open a new file beside `target` for this run alone; return it and its name, which ends in `.partial`.

    A file that a killed run left under that name is kept as `<name>.old`.
    """
    for number in itertools.count(1):
        name = _with_number(target, number) + PARTIAL
        descriptor = _claim(name)
        if descriptor is not None:
            return os.fdopen(descriptor, "wb"), name
    raise AssertionError


def leads_to(name: str, file: BinaryIO) -> bool:
    """Return whether an open file still has this name."""
    try:
        return os.path.samestat(os.stat(name), os.fstat(file.fileno()))
    except FileNotFoundError:
        return False


def _claim(name: str) -> int | None:
    """Return a descriptor of an empty, locked file of this name; None if another run writes it."""
    while True:
        descriptor = os.open(name, _GROWING, 0o666)
        try:
            if not _lock(descriptor):
                os.close(descriptor)
                return None
            status = os.fstat(descriptor)
            if file_state(name)[:2] == (status.st_dev, status.st_ino):
                if status.st_size == 0:
                    return descriptor
                os.replace(name, name + ".old")
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)


def _lock(descriptor: int) -> bool:
    """Lock an open file; return False if another run has locked it. Systems without locks count as unlocked."""
    if fcntl is not None:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:
            return True
    return True


@contextmanager
def _folder_locked(folder: str) -> Iterator[None]:
    """Keep other runs from settling in the folder; go on where it cannot be locked."""
    descriptor = None
    with suppress(OSError):
        if fcntl is not None:
            descriptor = os.open(folder, os.O_RDONLY | getattr(os, "O_CLOEXEC", 0))
            fcntl.flock(descriptor, fcntl.LOCK_EX)
    try:
        yield
    finally:
        if descriptor is not None:
            os.close(descriptor)


def _with_number(target: str, number: int) -> str:
    """Return the name with a number before its ending: `run.2.csv`; without for number 1."""
    stem, ending = os.path.splitext(target)
    return target if number == 1 else f"{stem}.{number}{ending}"


def as_named(name: str, target: str, place: str) -> str:
    """Return the place of a file as the user names it: `name`, or beside it."""
    return name if place == target else os.path.join(os.path.dirname(name), os.path.basename(place))


@contextmanager
def output_errors(name: str) -> Iterator[None]:
    """Turn errors of the system in writing the file `name` into OutputError."""
    try:
        yield
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise OutputError(f"the file cannot be written: {reason}", where=Where(file=name), number="O102") from error


def open_new(path: str) -> BinaryIO:
    """Open a file that must not exist yet, with the permissions the user's umask leaves."""
    return os.fdopen(os.open(path, _NEW, 0o666), "wb")


def _sync(file: BinaryIO) -> None:
    file.flush()
    os.fsync(file.fileno())


def is_special(name: str) -> bool:
    """Return whether a name leads to a device or a pipe, which is written through and never replaced."""
    try:
        mode = os.stat(name).st_mode  # not of what the link is resolved to: that of a pipe has no path
    except (OSError, ValueError):
        return False
    return not stat.S_ISREG(mode) and not stat.S_ISDIR(mode)


def read_content(name: str, largest: int) -> bytes:
    """Return the bytes of a file, one more than `largest` at most. Raises InputError."""
    try:
        if os.path.isdir(name):
            raise InputError("this is a directory, not a model file", where=Where(file=name), number="F101")
        with open(name, "rb", opener=open_at_once) as file:
            begin = file.read(largest + 1)
            if begin == b"" and stat.S_ISFIFO(os.fstat(file.fileno()).st_mode):
                raise OSError(errno.EPIPE, "nobody writes to this pipe")
            wait_from_now(file.fileno())
            begin = begin or b""  # None where somebody is going to write
            return begin + file.read(largest + 1 - len(begin))
    except FileNotFoundError:
        raise InputError(f"there is no such file{_advice(name)}", where=Where(file=name), number="F101") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"the file cannot be read: {reason}", where=Where(file=name), number="F101") from None


def _advice(name: str) -> str:
    """Return the advice for a missing file: one in the same folder with a similar name, endings aside."""
    from difflib import get_close_matches

    path = Path(name)
    try:
        beside = {entry.name: entry.stem.lower() for entry in path.parent.iterdir() if entry.suffix in _ENDINGS}
    except OSError:
        return "" if path.parent.is_dir() else f"; there is no folder {path.parent} either"
    stem = path.stem if path.suffix in _ENDINGS else path.name
    near = get_close_matches(stem.lower(), sorted(beside.values()), n=1, cutoff=_ALIKE)
    similar = sorted(file for file, other in beside.items() if [other] == near)
    return f"; did you mean {path.parent / similar[0]}?" if similar else ""
