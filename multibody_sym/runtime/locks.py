"""Locks between processes (and threads) on files: gone with the process that holds them, and never waited for forever.

Where the system has no such locks, or the file's folder cannot be written, everybody goes on as if alone.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

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
def locked(path: Path) -> Iterator[bool]:
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
                while not _taken(descriptor, shared):
                    if time.monotonic() >= end:
                        os.close(descriptor)
                        return None
                    time.sleep(pause)
                    pause = min(2 * pause, _LONGEST_PAUSE)
                if _leads_to(path, descriptor):
                    return descriptor
            except BaseException:
                os.close(descriptor)
                raise
            os.close(descriptor)  # it was removed meanwhile, by the one before
    return None


def _taken(descriptor: int, shared: bool) -> bool:
    try:
        fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _leads_to(path: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(os.stat(path), os.fstat(descriptor))
    except FileNotFoundError:
        return False


def _let_go(descriptor: int | None, path: Path | None) -> None:
    if descriptor is None:
        return
    if path is not None:
        with contextlib.suppress(OSError):
            os.unlink(path)
    with contextlib.suppress(OSError):
        fcntl.flock(descriptor, fcntl.LOCK_UN)  # a child made by fork has the descriptor, too
    os.close(descriptor)
