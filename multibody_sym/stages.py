"""Who follows a calculation: what its stages take, what they do and how far they are, and the log of it.

Nothing is measured or written unless somebody asks. The log is that of `logging.getLogger("multibody_sym")`, at DEBUG.
"""

from __future__ import annotations

import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from contextvars import ContextVar
from dataclasses import field
from typing import Final, TypeVar

from multibody_sym.records import dataclass

_T = TypeVar("_T")


class Watcher(ABC):
    """Follows the stages of a calculation in one thread."""

    @abstractmethod
    def stage(self, name: str) -> AbstractContextManager[None]:
        """Follow a stage, inside the one before."""

    @abstractmethod
    def doing(self, words: str) -> None:
        """Take note of what the present stage does."""

    @abstractmethod
    def reached(self, part: float) -> None:
        """Take note of the part of the present stage that is done, from 0 to 1."""


@dataclass
class Times(Watcher):
    """Seconds by stage, without those of the stages inside it, and how often each was entered."""

    seconds: dict[str, float] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    _inside: float = 0.0

    def __str__(self) -> str:
        """A line such as `took 2.3 s: derive 0.4, compile 1.6, decide 0.2 (12 times), integrate 0.1`."""
        parts = [f"{name} {x:.2g}{self._often(name)}" for name, x in self.seconds.items()]
        return f"took {sum(self.seconds.values()):.2g} s: {', '.join(parts)}"

    def _often(self, name: str) -> str:
        return f" ({self.counts[name]} times)" if self.counts[name] > 1 else ""

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add what is done here to a stage."""
        begin, before, self._inside = time.perf_counter(), self._inside, 0.0
        try:
            yield
        finally:
            whole = time.perf_counter() - begin
            self.seconds[name] = self.seconds.get(name, 0.0) + whole - self._inside
            self.counts[name] = self.counts.get(name, 0) + 1
            self._inside = before + whole

    def doing(self, words: str) -> None:
        """Leave aside what a stage does: it takes the same time."""

    def reached(self, part: float) -> None:
        """Leave aside how far a stage is."""


LOGGER: Final = "multibody_sym"
"""The name of the logger under which the package writes."""


def is_logged() -> bool:
    """Return whether somebody reads the log, who has imported `logging` then."""
    logging = sys.modules.get("logging")
    return logging is not None and logging.getLogger(LOGGER).isEnabledFor(logging.DEBUG)


def log(message: str, *values: object) -> None:
    """Write a line to the log and to those who follow, with the values in place of %s and the like."""
    logging = sys.modules.get("logging")
    if logging is not None:
        logging.getLogger(LOGGER).debug(message, *values)
    if _WATCHERS.get():
        doing(message % values)


# ----------------------------------------------------------------------------------------------------------------------

_WATCHERS: Final[ContextVar[tuple[Watcher, ...]]] = ContextVar("watchers", default=())


@contextmanager
def stage(name: str) -> Iterator[None]:
    """Name a stage."""
    watchers = _WATCHERS.get()
    if not watchers:
        yield
        return
    with ExitStack() as stack:
        for watcher in watchers:
            stack.enter_context(watcher.stage(name))
        yield


def doing(words: str) -> None:
    """Say what the present stage does."""
    for watcher in _WATCHERS.get():
        watcher.doing(words)


def reached(part: float) -> None:
    """Say which part of the present stage is done, from 0 to 1."""
    for watcher in _WATCHERS.get():
        watcher.reached(part)


def counted(items: Sequence[_T], words: str) -> Iterator[_T]:
    """Yield items, and say which of how many `words` is at work."""
    for k, item in enumerate(items, 1):
        doing(f"{words} {k} of {len(items)}")
        yield item


@contextmanager
def watched(watcher: Watcher, name: str) -> Iterator[None]:
    """Let somebody follow all stages; what belongs to none is of the stage `name`."""
    token = _WATCHERS.set((*_WATCHERS.get(), watcher))
    try:
        with watcher.stage(name):
            yield
    finally:
        _WATCHERS.reset(token)


@contextmanager
def time_stages(name: str) -> Iterator[Times]:
    """Measure all stages; what belongs to none counts as `name`."""
    times = Times()
    with watched(times, name):
        yield times
