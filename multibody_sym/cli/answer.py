"""What a command gives: an object for programs, text for people, and the code that the process ends with."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from multibody_sym.records import dataclass


@dataclass(frozen=True)
class Answer:
    """`--json` prints `json` on standard output and `text` on standard error; without it `text` is the output.

    `missed`: what was asked for and not done, on standard error in either case.
    """

    json: Mapping[str, Any]
    text: str
    exit_code: int = 0
    missed: str = ""
