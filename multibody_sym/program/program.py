"""Program: a straight-line calculation with named inputs and outputs, as data that verifies itself when it is made."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import TypeVar

from multibody_sym.program.measures import digest
from multibody_sym.program.statements import (
    Array,
    Output,
    ProgramError,
    Statement,
    UndefinedError,
)
from multibody_sym.program.text import program_text
from multibody_sym.program.verify import verify
from multibody_sym.records import dataclass


@dataclass(frozen=True, repr=False)
class Program:
    """A function of arrays: `statements` compute what `outputs` name from `inputs`; every value is defined once.

    Raises ProgramError (UndefinedError, DefinedTwiceError, ShapeError) where the parts do not fit together.
    """

    name: str
    inputs: tuple[Array, ...]
    statements: tuple[Statement, ...]
    outputs: tuple[Output, ...]

    def __post_init__(self) -> None:
        try:
            verify(self)
        except ProgramError as error:
            raise error.located(path=(f"program {self.name}",)) from None

    def __repr__(self) -> str:
        return f"<Program {self.name}: {len(self.statements)} statements>"

    def __str__(self) -> str:
        return program_text(self)

    @cached_property
    def digest(self) -> bytes:
        """The hash of structure, shapes and constants (see `multibody_sym.program.measures`)."""
        return digest(self)

    def output(self, name: str) -> Output:
        """Return the output called `name`; raises UndefinedError if there is none."""
        return _named(name, self.outputs, "output")

    def input(self, name: str) -> Array:
        """Return the input called `name`; raises UndefinedError if there is none."""
        return _named(name, self.inputs, "input")


_Part = TypeVar("_Part", Array, Output)


def _named(name: str, things: Iterable[_Part], kind: str) -> _Part:
    for thing in things:
        if thing.name == name:
            return thing
    raise UndefinedError(f"no {kind} is called {name!r}; there are {', '.join(t.name for t in things) or 'none'}")


# --- the verifier: one function a statement type -----------------------------------------------------------------


