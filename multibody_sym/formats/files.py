"""Files written so that an existing one is never harmed: beside the target, synced, then put in its place."""

from __future__ import annotations

import os
import secrets
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import BinaryIO, Final

from multibody_sym.errors import InputError, OutputError, Where

_NEW: Final = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)


def write_whole(path: str | os.PathLike[str], content: bytes) -> None:
    """Write `content` to `path`, all of it or nothing. Raises OutputError."""

    def write(file: BinaryIO) -> None:
        file.write(content)

    replace_with(path, write)


def write_new(path: str | os.PathLike[str], content: bytes) -> None:
    """Write `content` to a file that does not exist yet. Raises InputError where it does, OutputError."""
    name = os.fspath(path)
    try:
        with output_errors(name), open(name, "xb") as file:
            file.write(content)
            _sync(file)
    except OutputError as error:
        if not isinstance(error.__cause__, FileExistsError):
            raise
        raise InputError("this file exists already; choose another one with -o", where=Where(file=name)) from None


def replace_with(path: str | os.PathLike[str], write: Callable[[BinaryIO], None]) -> None:
    """Let `write` fill a new file that then replaces `path`; where it fails, `path` is as before.

    A device or pipe (`/dev/stdout`) is written to directly. Raises OutputError.
    """
    name = os.fspath(path)
    with output_errors(name):
        target = os.path.realpath(name)
        if _is_special(target):
            with open(target, "wb") as file:
                write(file)
            return
        temporary = f"{target}.{secrets.token_hex(4)}.tmp"
        try:
            with open_new(temporary) as file:
                write(file)
                _sync(file)
            put_in_place(temporary, target)
        except BaseException:
            with suppress(OSError):
                os.unlink(temporary)
            raise


@contextmanager
def output_errors(name: str) -> Iterator[None]:
    """Turn what the system says about writing the file `name` into an OutputError."""
    try:
        yield
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise OutputError(f"the file cannot be written: {reason}", where=Where(file=name)) from error


def open_new(path: str) -> BinaryIO:
    """Open a file that must not exist yet, with the permissions the user's umask leaves."""
    return os.fdopen(os.open(path, _NEW, 0o666), "wb")


def put_in_place(temporary: str, target: str) -> None:
    """Rename a finished file to its final name, keeping the permissions of the file it replaces."""
    with suppress(OSError):
        os.chmod(temporary, stat.S_IMODE(os.stat(target).st_mode))
    os.replace(temporary, target)
    with suppress(OSError):
        folder = os.open(os.path.dirname(target) or ".", os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def _sync(file: BinaryIO) -> None:
    file.flush()
    os.fsync(file.fileno())


def _is_special(target: str) -> bool:
    try:
        mode = os.stat(target).st_mode
    except OSError:
        return False
    return not stat.S_ISREG(mode)
