"""Every error the toolkit raises on purpose, with the place it belongs to and the exit code it ends a command with.

And what makes their messages: wrong values shown in a line, places named on the way out, known words suggested.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, ClassVar, Final

from multibody_sym.records import dataclass


@dataclass(frozen=True)
class Where:
    """Where something stands: in a file (line and column from 1), in the model (`joints`, `A`, `axis`), or both."""

    file: str | None = None
    line: int | None = None
    column: int | None = None
    path: tuple[str, ...] = ()

    def __str__(self) -> str:
        column = None if self.line is None else self.column  # without a line the excerpt shows it
        place = ":".join(str(part) for part in (self.file, self.line, column) if part is not None)
        return ": ".join(part for part in (place, ".".join(self.path)) if part)

    def as_json(self) -> dict[str, Any]:
        """Return the `where` object of the `--json` error."""
        return {"file": self.file, "line": self.line, "column": self.column, "path": ".".join(self.path)}


_SHOWN: Final = 60


def brief(names: Sequence[str], most: int = 6) -> tuple[str, ...]:
    """Return names for a line of text: all of them, or some and how many others there are."""
    return tuple(names) if len(names) <= most else (*names[: most - 1], f".. {len(names) - most + 1} more")


def short_repr(value: object) -> str:
    """Return what a wrong value is, in a line that is never long."""
    try:
        text = repr(value)
    except Exception:  # a user's own class
        text = f"<{type(value).__name__}>"
    text = " ".join(text.split())
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."


class MultibodyError(Exception):
    """What was wrong, where, and what to do; `code` names the kind, `exit_code` ends the command.

    `number` is that of its page among those of errors (`multibody-sym explain M101`): of its class, unless it is given.
    `word`: the word of the model or argument that is wrong; `meant`: the one of the `known` that may stand for it,
    with which the message ends, or with all that are `known`. `others` are further mistakes of the same model file.
    """

    code: ClassVar[str] = "error"
    exit_code: ClassVar[int] = 2
    number: str = "I100"

    def __init__(
        self,
        message: str,
        *,
        where: Where | None = None,
        excerpt: str | None = None,
        number: str | None = None,
        word: str | None = None,
        known: Iterable[str] = (),
        meant: str | None = None,
    ) -> None:
        words = list(map(str, known))
        word = None if word is None else str(word)
        self.word = word
        self.known = tuple(words)
        self.meant = meant or (nearest(word, words) if word is not None and words else None)
        if words:
            message += f"; did you mean {self.meant}?" if self.meant else f"; known: {', '.join(words)}"
        super().__init__(message)
        self.message = message
        if number is not None:
            self.number = number
        self.where = where if isinstance(where, Where) else Where()
        self.excerpt = excerpt
        self.others: tuple[MultibodyError, ...] = ()

    def __str__(self) -> str:
        return "\n".join(each.alone for each in (self, *self.others))

    @property
    def alone(self) -> str:
        """The text without the others."""
        text = ": ".join(part for part in (str(self.where), self.message) if part)
        return f"{text}\n{self.excerpt}" if self.excerpt else text

    def located(self, **place: Any) -> MultibodyError:
        """Fill those fields of `where` that are still open; return self for `raise error.located(...)`."""
        missing = {name: value for name, value in place.items() if not getattr(self.where, name)}
        self.where = replace(self.where, **missing)
        return self

    def under(self, step: str) -> MultibodyError:
        """Put `step` in front of the path in the model, of the others too; return self for `raise error.under(...)`."""
        for each in (self, *self.others):
            each.where = replace(each.where, path=(step, *each.where.path))
        return self

    def as_json(self) -> dict[str, Any]:
        """Return the object that `--json` prints: `error`, the first, and `errors`, all of them."""
        errors = [
            {"code": each.code, "number": each.number, "message": each.message, "where": each.where.as_json()}
            for each in (self, *self.others)
        ]
        return {"error": errors[0], "errors": errors}


class InputError(MultibodyError):
    """The model, an option or an argument is wrong (exit 2)."""

    code = "input"
    number = "I100"


class ExpressionError(InputError):
    """An expression cannot be read, or has no real value; `where.column` counts from 1 within its text."""

    code = "expression"
    number = "E101"


class ArgumentError(InputError, TypeError):
    """A value is of a kind that is not taken there: text for a number, a list for a name."""

    number = "A100"


class UndefinedValueError(ExpressionError, ArithmeticError):
    """A function has no finite real value at the given numbers."""

    number = "E105"


class ModelError(InputError):
    """A declared model contradicts itself; `where.path` names the element and field."""

    code = "model"
    number = "M100"


class NoSolutionError(MultibodyError):
    """The problem as declared has no (unique) solution (exit 3)."""

    code = "no_solution"
    exit_code = 3
    number = "N100"


class RunError(MultibodyError):
    """A simulation or a check failed on the way (exit 3)."""

    code = "run"
    exit_code = 3
    number = "R100"


class OutputError(MultibodyError):
    """A result could not be written, or a compiler failed where one is required (exit 4)."""

    code = "output"
    exit_code = 4
    number = "O100"


class MissingPackageError(OutputError):
    """A method, or a target of functions, needs a package that is not installed."""

    code = "package"
    number = "O104"


class at:  # noqa: N801  # read as a word: with at("bodies", name); a class, since large models enter it for each value
    """Name the place in the model to which errors raised inside belong."""

    __slots__ = ("_steps",)

    def __init__(self, *steps: object) -> None:
        self._steps = steps

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: object, traceback: object) -> None:
        if isinstance(error, InputError):
            for step in reversed(self._steps):
                error.under(str(step))


class gathered:  # noqa: N801  # read as a word, like `at`
    """Collect the InputErrors of several readings, `with wrong: ...` each; `told` raises the first with the others."""

    __slots__ = ("_found",)

    def __init__(self) -> None:
        self._found: list[InputError] = []

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: object, traceback: object) -> bool:
        if isinstance(error, InputError):
            self._found.append(error)
        return isinstance(error, InputError)

    def told(self) -> None:
        """Raise what was collected, if anything was."""
        if self._found:
            raise join_errors(self._found)


def join_errors(errors: Sequence[MultibodyError]) -> MultibodyError:
    """Return the first of errors, which carries the others and those that they carry."""
    first, *others = (each for error in errors for each in (error, *error.others))
    for each in others:
        each.others = ()
    first.others = tuple(others)
    return first


def nearest(word: str, known: Iterable[str], cutoff: float = 0.6) -> str | None:
    """Return the one of the known words that somebody who wrote `word` most likely meant."""
    from difflib import get_close_matches

    folded: dict[str, str] = {}
    for each in known:
        folded.setdefault(each.lower(), each)
    near = get_close_matches(word[:_SHOWN].lower(), folded, n=1, cutoff=cutoff)
    return folded[near[0]] if near else None
