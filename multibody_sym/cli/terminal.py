"""What does a terminal show? A plain text in lines within its width, with bold headings and verdicts in colour.

Replies are plain texts; files and pipes get them as they are. A heading stands before deeper lines and has neither
quantity nor equation. Meanwhile a line on standard error has stage, work, part and seconds.
"""

from __future__ import annotations

import os
import re
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import field
from threading import Event, Lock, Thread
from typing import Final, TextIO

from multibody_sym.records import dataclass
from multibody_sym.stages import Watcher, watched

COLOURS: Final = ("auto", "always", "never")
_BOLD, _RED, _GREEN, _YELLOW, _PLAIN = (f"\x1b[{code}m" for code in (1, 31, 32, 33, 0))
_VERDICTS: Final = {
    _RED: r"error:|no motion:|verdict: THEY DISAGREE|unstable|rest is possible at no value|\S+: (?:failed|interrupted)",
    _GREEN: r"verdict: all agree|stable|at rest|rest is possible|oscillations are stable|\S+: done",
    _YELLOW: r"warning:|hint:|note:|indifferent|not decided|\S+: stopped",
}
"""The words at the beginning of a line that are shown in a colour; those of an earlier entry count first."""
_VERDICT: Final = {colour: re.compile(rf"\s*(?:{words})(?!\w)") for colour, words in _VERDICTS.items()}
_SAYS: Final = re.compile(r": | = |; |\d [A-Za-z]")
"""A quantity, an equation or a sentence, which no heading has."""
_OPERATORS: Final = ("=", "+", "-", "<", ">", "<=", ">=", "==", "!=")
_HANG: Final = 4
_USUAL: Final = 80
_LEAST: Final = 20
"""Columns below which a terminal is taken to be this wide."""


@dataclass(frozen=True)
class Terminal:
    """Shows texts in lines of at most `width` characters, None for any, and in colours or not."""

    width: int | None
    colours: bool

    def show(self, text: str) -> str:
        """Return a plain text as this terminal shows it."""
        lines = text.splitlines()
        shown: list[str] = []
        for line, after in zip(lines, [*lines[1:], ""], strict=True):
            parts = [line] if self.width is None else list(wrap_line(line, self.width))
            shown += self._styled(parts, is_heading(line, after)) if self.colours else parts
        return "\n".join(shown)

    def _styled(self, parts: Sequence[str], bold: bool) -> list[str]:
        if bold:
            return [f"{_BOLD}{part}{_PLAIN}" for part in parts]
        first, *others = parts
        for colour, words in _VERDICT.items():
            if found := words.match(first):
                first = f"{colour}{first[: found.end()]}{_PLAIN}{first[found.end() :]}"
                break
        return [first, *others]


def terminal_of(stream: TextIO | None, colours: str) -> Terminal:
    """Return the terminal at a stream, with colours as `--color` asks for: without one text stays as it is."""
    at_terminal = stream is not None and stream.isatty()
    known = "NO_COLOR" not in os.environ and os.environ.get("TERM") != "dumb"
    known = known and (sys.platform != "win32" or "WT_SESSION" in os.environ)
    width = max(columns_of(stream), _LEAST) if stream is not None and at_terminal else None
    return Terminal(width, colours == "always" or (colours == "auto" and at_terminal and known))


def columns_of(stream: TextIO) -> int:
    """Return the columns of a terminal: those that COLUMNS says, else its own, 80 where it has none."""
    said = os.environ.get("COLUMNS", "")
    return int(said) if said.isdecimal() else os.get_terminal_size(stream.fileno()).columns or _USUAL


def is_heading(line: str, after: str) -> bool:
    """Return whether a line is the heading of the deeper one after it."""
    deeper = line[:1].strip() != "" and after[:1] == " "
    return deeper and (line.endswith(":") or not _SAYS.search(line))


def wrap_line(line: str, width: int) -> Iterator[str]:
    """Yield a line in parts of at most `width` characters, those after the first indented.

    A part ends outside brackets where it can, before an operator, and not between a number and its unit or a name and
    its value; what has no such place, as a path, stays whole.
    """
    indent = " " * min(len(line) - len(line.lstrip()) + _HANG, width // 2)
    while len(line) > width:
        end = _break(line, width)
        if end == len(line):
            break
        yield line[:end].rstrip()
        line = indent + line[end:].lstrip()
    yield line


def _break(line: str, width: int) -> int:
    """Return where the first part of a line ends: at a space, else within a product, else at the end of the word."""
    begin, depth = len(line) - len(line.lstrip()), 0
    spaces, signs = dict[int, int](), dict[int, int]()  # places with how many brackets are open there
    for k, c in enumerate(line):
        depth += (c in "([{") - (c in ")]}")
        if k <= begin:
            continue
        if c == " " and line[k + 1 : k + 2] != " " and not _stay_together(line, k):
            spaces[k] = depth
        elif (c in "*," and line[k - 1] != c != line[k + 1 : k + 2]) or line[k - 1 : k + 1] == ")/":
            signs[k + 1] = depth
    for places in (spaces, {**spaces, **signs}):
        for least in ((begin + width) // 2, begin + 1):
            within = [(depth, -k) for k, depth in places.items() if least <= k <= width]
            if within:
                return -min(within)[1]
    return min((k for k in (*spaces, *signs) if k > width), default=len(line))


def _stay_together(line: str, k: int) -> bool:
    """Return whether the words around a space belong together: operators and operands, quantities, names and values."""
    *_, before_that, before = ("", "", *line[:k].split())
    after = line[k + 1 :].partition(" ")[0]
    quantity = before.lstrip("-(")[-1:].isdigit() and before.lstrip("-(")[:1].isdigit() and after[:1].isalpha()
    named = after == "=" and before_that not in _OPERATORS
    return before in _OPERATORS or before.endswith(":") or after.startswith("[") or quantity or named


# ----------------------------------------------------------------------------------------------------------------------
# What a command does meanwhile, on a line that is wiped at the end.


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
