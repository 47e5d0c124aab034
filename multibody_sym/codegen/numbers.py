"""Numbers of generated C as data beside it, so that Programs that differ in them alone are the same text.

Where they are written into the text a compiler loads them from memory as well: as data they cost next to no time,
unless it packs several into one, as it does for a processor that it knows (`native`).
"""

from __future__ import annotations

import json
from typing import Final

NUMBERS_FILE: Final = "numbers.json"
"""The file beside model.c that holds the numbers in their order."""
_IN_TEXT: Final = (0.0, 1.0, -1.0)


class Numbers:
    """The numbers that a text names as elements of an array, each by the next place where it is met.

    Zero, one and minus one stay in the text. Equal numbers do not share a place: other ones need not be equal.
    """

    def __init__(self, prefix: str) -> None:
        self._prefix = prefix
        self._values: list[float] = []

    def named(self, value: float) -> str:
        """Return the text of a number."""
        if value in _IN_TEXT:
            return repr(value)
        self._values.append(value)
        return f"{self._prefix}__numbers[{len(self._values) - 1}]"

    @property
    def definitions(self) -> str:
        """The array, and by what name the loader of the library finds it, which alone writes it."""
        prefix, size = self._prefix, len(self._values)
        lines = (
            f"static double {prefix}__numbers[{max(1, size)}];",
            f"double *const {prefix}_numbers = {prefix}__numbers;",
            f"const int {prefix}_number_count = {size};",
        )
        return "\n".join(lines) + "\n\n"

    @property
    def file(self) -> str:
        """What `NUMBERS_FILE` holds."""
        return json.dumps(self._values)
