"""Which code a calculation becomes: C, for any processor or for this one, or generated Python.

In: what a user asks for. Out: a record that all take who compile, load or recall. A module of its own, for the command
line reads it before it knows whether anything is compiled.
"""

from __future__ import annotations

from typing import Final, Literal, get_args

from multibody_sym.errors import InputError, short_repr
from multibody_sym.records import dataclass

Backend = Literal["c", "python"]


@dataclass(frozen=True)
class Native:
    """The code to be made.

    `native`: C for this processor only, whose last digits may differ, with the numbers in its text, where the compiler
    packs them. `backend`: None takes C, and Python where there is no compiler; "c" and "python" take no other.
    """

    native: bool = False
    backend: Backend | None = None

    def verify(self) -> None:
        """Raise InputError for a backend that is none."""
        if self.backend is not None and not (isinstance(self.backend, str) and self.backend in get_args(Backend)):
            raise InputError(f"there is no backend {short_repr(self.backend)}; known: {', '.join(get_args(Backend))}")


PORTABLE: Final = Native()
"""What is made where nothing else is asked for."""
