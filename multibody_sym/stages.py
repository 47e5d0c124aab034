"""What the stages of a run take, and the log of what it does: nothing is measured or written unless somebody asks.

The log is that of `logging.getLogger("multibody_sym")`, at DEBUG.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import field
from typing import Final

from multibody_sym.records import dataclass


@dataclass
class Times:
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


LOGGER: Final = "multibody_sym"
"""The name of the logger under which the package writes."""


def is_logged() -> bool:
    """Return whether somebody reads the log, who has imported `logging` then."""
    logging = sys.modules.get("logging")
    return logging is not None and logging.getLogger(LOGGER).isEnabledFor(logging.DEBUG)


def log(message: str, *values: object) -> None:
    """Write a line to the log, with the values in place of %s and the like."""
    logging = sys.modules.get("logging")
    if logging is not None:
        logging.getLogger(LOGGER).debug(message, *values)


# ----------------------------------------------------------------------------------------------------------------------

_TIMES: Final[ContextVar[Times | None]] = ContextVar("times", default=None)


@contextmanager
def stage(name: str) -> Iterator[None]:
    """Name a stage."""
    times = _TIMES.get()
    if times is None:
        yield
        return
    with times.stage(name):
        yield


@contextmanager
def time_stages(name: str) -> Iterator[Times]:
    """Measure all stages; what belongs to none counts as `name`."""
    times = Times()
    token = _TIMES.set(times)
    try:
        with times.stage(name):
            yield times
    finally:
        _TIMES.reset(token)
