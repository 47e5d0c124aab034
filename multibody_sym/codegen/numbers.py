"""Numbers of generated C: in its text, or as data beside it, so that Programs that differ in them alone are one text.

Where they are written into the text a compiler loads them from memory as well: as data they cost next to no time,
unless it packs several into one, as it does for a processor that it knows (`native`).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Final

from multibody_sym.codegen.layout import wrapped
from multibody_sym.scalars.rows import Tabulated

NUMBERS_FILE: Final = "numbers.json"
"""The file beside model.c that holds the numbers in their order."""
_IN_TEXT: Final = (0.0, 1.0, -1.0)


class Written:
    """Numbers in the text where they are met; tables are arrays of constants, each once, and so are other arrays."""

    def __init__(self, prefix: str) -> None:
        self._prefix = prefix
        self._tables: dict[bytes, str] = {}
        self._arrays: list[str] = []

    def named(self, value: float) -> str:
        """Return the text of a number."""
        return repr(value)

    def array(self, values: Sequence[float]) -> str:
        """Return the address of numbers."""
        name = f"{self._prefix}__array_{len(self._arrays) + 1}"
        self._arrays.append(wrapped(f"static const double {name}[] = {{", map(repr, values), "};"))
        return name

    def table(self, function: Tabulated) -> str:
        """Return the address of a table's columns, one after the other."""
        if function.digest not in self._tables:
            name = f"{self._prefix}__table_{len(self._tables) + 1}"
            values = (repr(x) for column in function.columns for x in column)
            self._arrays.append(wrapped(f"static const double {name}[] = {{ /* {function.name} */\n    ", values, "};"))
            self._tables[function.digest] = name
        return self._tables[function.digest]

    @property
    def definitions(self) -> str:
        """The arrays of tables."""
        return "".join(f"{text}\n\n" for text in self._arrays)


class Numbers:
    """The numbers that a text names as elements of an array, each by the next place where it is met.

    Zero, one and minus one stay in the text. Equal numbers do not share a place: other ones need not be equal.
    """

    def __init__(self, prefix: str) -> None:
        self._prefix = prefix
        self._values: list[float] = []
        self._tables: dict[bytes, int] = {}

    def named(self, value: float) -> str:
        """Return the text of a number."""
        if value in _IN_TEXT:
            return repr(value)
        self._values.append(value)
        return f"{self._prefix}__numbers[{len(self._values) - 1}]"

    def array(self, values: Sequence[float]) -> str:
        """Return the address of numbers, zero and one among them."""
        self._values += values
        return f"{self._prefix}__numbers + {len(self._values) - len(values)}"

    def table(self, function: Tabulated) -> str:
        """Return the address of a table's columns, one after the other, which share a place with equal ones."""
        if function.digest not in self._tables:
            self._tables[function.digest] = len(self._values)
            for column in function.columns:
                self._values += column
        return f"{self._prefix}__numbers + {self._tables[function.digest]}"

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
