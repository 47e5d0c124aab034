"""What a command gives: an object for programs, text for people, and the code that the process ends with."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from multibody_sym.records import dataclass


def first_lines(hints: Iterable[str]) -> list[str]:
    """Return hints for programs: without the lines of the model file that stand below them."""
    return [hint.partition("\n")[0] for hint in hints]


@dataclass(frozen=True)
class Answer:
    """`--json` prints `json` on standard output and `text` on standard error; without it `text` is the output.

    `missed`: what was asked for and not done, on standard error in either case.
    """

    json: Mapping[str, Any]
    text: str
    exit_code: int = 0
    missed: str = ""
