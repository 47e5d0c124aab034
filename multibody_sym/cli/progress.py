"""What does a command do meanwhile? A line on standard error, where that is a terminal: stage, work, part, seconds."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import field
from threading import Event, Lock, Thread
from typing import Final, TextIO

from multibody_sym.cli.terminal import columns_of
from multibody_sym.records import dataclass
from multibody_sym.stages import Watcher, watched

_PATIENCE: Final = 1.0
"""Seconds before the line appears."""
_EVERY: Final = 0.2
_BAR: Final = 30
_NAMED: Final = 1.0
"""Seconds from which on a stage that is over is named."""


@dataclass
class _Level:
    """A stage under way: its name, when it began, what it does and which part of it is done."""

    name: str
    begin: float
    words: str = ""
    part: float | None = None


@dataclass(eq=False)
class ProgressLine(Watcher):
    """Writes what is under way to a stream; `wipe` makes room for other lines."""

    stream: TextIO
    begin: float = field(default_factory=time.monotonic)
    _levels: list[_Level] = field(default_factory=list)
    _past: dict[str, float] = field(default_factory=dict)
    _drawn: int = 0
    _lock: Lock = field(default_factory=Lock)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        level = _Level(name, time.monotonic())
        self._levels.append(level)
        try:
            yield
        finally:
            self._levels.pop()
            self._past[name] = self._past.get(name, 0.0) + time.monotonic() - level.begin

    def doing(self, words: str) -> None:
        self._levels[-1].words = words

    def reached(self, part: float) -> None:
        self._levels[-1].part = part

    def line(self, now: float) -> str:
        """Return what is under way at a time: the innermost stage, and the longer ones that are over."""
        level = self._levels[-1]
        words, seconds = level.words or level.name, now - level.begin
        words = words if words.startswith(level.name) or not level.words else f"{level.name}: {words}"
        if level.part is not None and 0.0 < level.part < 1.0:
            full = round(level.part * _BAR)
            bar = f"[{'#' * full}{'.' * (_BAR - full)}] {100.0 * level.part:3.0f} %"
            return f"{level.name} {bar}, {seconds * (1.0 - level.part) / level.part:.0f} s left"
        under_way = {each.name for each in self._levels}
        past = [f"{name} {x:.0f} s" for name, x in self._past.items() if x >= _NAMED and name not in under_way]
        return f"{words}, {seconds:.0f} s{'; done: ' * bool(past)}{', '.join(past)}"

    def draw(self) -> None:
        """Write the line anew, once a command takes long."""
        with self._lock:
            now = time.monotonic()
            if now - self.begin > _PATIENCE and self._levels:
                line = self.line(now)[: columns_of(self.stream) - 1]
                self.stream.write("\r" + line.ljust(self._drawn))
                self.stream.flush()
                self._drawn = len(line)

    def wipe(self) -> None:
        """Remove the line."""
        with self._lock:
            if self._drawn:
                self.stream.write("\r" + " " * self._drawn + "\r")
                self.stream.flush()
                self._drawn = 0


@contextmanager
def progress_on(stream: TextIO, command: str) -> Iterator[ProgressLine]:
    """Show the stages of a command on a terminal; the line is wiped at the end."""
    progress, ended = ProgressLine(stream), Event()

    def draw() -> None:
        while not ended.wait(_EVERY):
            progress.draw()

    thread = Thread(target=draw, daemon=True)
    thread.start()
    try:
        with watched(progress, command):
            yield progress
    finally:
        ended.set()
        thread.join()
        progress.wipe()
