"""From the words of a command line to its output and exit code; nothing that a user does wrong ends in a traceback."""

from __future__ import annotations

import argparse
import math
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any, Final, TextIO, cast

from multibody_sym.cli.options import INTERRUPTED, Reply, ShownText, first_lines, parse_words
from multibody_sym.cli.terminal import COLOURS, progress_on, terminal_of
from multibody_sym.errors import MultibodyError, OutputError

_THREADS: Final = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
DEBUG: Final = "MULTIBODY_SYM_DEBUG"
INTERNAL: Final = 70
NO_MEMORY: Final = 4
_FAILED: Final = 3
_MOST: Final = 20
"""The most mistakes of a model that are printed."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    0 done; 2 the input is wrong; 3 no solution, a failed run or a disagreement; 4 output, compiler, memory;
    70 a defect of the toolkit; 130 Ctrl-C.
    """
    if arguments is None and not any(name in os.environ for name in _THREADS):
        # in a process of its own linear algebra takes one thread, unless the user chose: solves are small, and threads
        # wait for busy cores; libraries read it when numpy is imported, which is later
        os.environ.update(dict.fromkeys(_THREADS, "1"))
    words = list(sys.argv[1:] if arguments is None else arguments)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    colours = _colours(words)
    answer, text = _run_guarded(words)
    try:
        # the object on standard output and the text on standard error, or the text alone where it belongs
        if text is not None:
            _say(answer.text, colours)
            _write(sys.stdout, text)
        elif "error" in answer.json:
            _say(answer.text, colours)
        else:
            out = answer.text if answer.source else terminal_of(sys.stdout, colours).show(answer.text)
            _write(sys.stdout, out)
        if answer.missed:
            _say(answer.missed, colours)
    except BrokenPipeError:  # whoever read the output has seen enough
        _silence(sys.stdout)
    except OSError as problem:
        _silence(sys.stdout)
        _say(f"error: the output cannot be written: {problem.strerror}", colours)
        return OutputError.exit_code
    except KeyboardInterrupt:
        _silence(sys.stdout)
        return INTERRUPTED
    return answer.exit_code


def _run_guarded(words: Sequence[str]) -> tuple[Reply, str | None]:
    """Return the answer of a command, with its object as text where that was asked for; whatever happens, an answer."""
    as_json = "--json" in words
    try:
        answer = _run(words)
        return answer, _json_text(answer.json) if as_json else None
    except ShownText as shown:
        answer = Reply({"text": shown.text}, shown.text)
    except MultibodyError as error:
        every = (error, *error.others)
        more = [f"and {len(every) - _MOST} more"] if len(every) > _MOST else []
        text = "\n".join([*(_error_text(each.alone, each.number) for each in every[:_MOST]), *more])
        answer = Reply(error.as_json(), text, error.exit_code)
    except KeyboardInterrupt as interrupt:
        told = "; ".join(("interrupted", *filter(None, map(str, interrupt.args))))
        answer = _failure("interrupted", "X103", told, INTERRUPTED)
    except MemoryError:
        answer = _failure("memory", "X102", "there is not enough memory for this", NO_MEMORY)
    except Exception as error:
        if os.environ.get(DEBUG):
            raise
        what = f"{type(error).__name__}: {error}".splitlines()[0]
        advice = f"this is a defect of multibody-sym, please report it; {DEBUG}=1 shows where it happened"
        answer = _failure("internal", "X100", f"{what} ({advice})", INTERNAL)
    return answer, _json_text(answer.json) if as_json else None


def _run(words: Sequence[str]) -> Reply:
    """Return the answer of a command; hints about its model are printed, and stand in its object, if there are any."""
    options = parse_words(words)
    options.hints = tuple
    try:
        answer, hints = _watched(options)
    except MultibodyError as error:
        if error.exit_code == _FAILED:  # what is wrong input has no hints yet
            for hint in options.hints():
                _say(f"hint: {hint}", options.color)
        raise
    for hint in hints:
        _say(f"hint: {hint}", options.color)
    return replace(answer, json={**answer.json, "hints": first_lines(hints)}) if hints else answer


def _watched(options: argparse.Namespace) -> tuple[Reply, list[str]]:
    """Return the answer of a command and its hints; its stages are shown on a terminal while they last."""
    with ExitStack() as stack:
        wipe: Callable[[], object] = tuple
        if sys.stderr is not None and sys.stderr.isatty():
            wipe = stack.enter_context(progress_on(sys.stderr, options.command)).wipe
        stack.enter_context(warnings.catch_warnings())
        warnings.simplefilter("always")
        warnings.showwarning = cast(Any, partial(_show_notice, wipe, options.color))
        answer: Reply = options.run(options)
        hints = list(options.hints())
    return answer, hints


def _colours(words: Sequence[str]) -> str:
    """Return what `--color` asks for, also where the other words of the command line are wrong."""
    after = (word.partition("=")[2] or nearby for word, nearby in pairwise([*words, ""]) if word.startswith("--color"))
    asked = next(after, "")
    return asked if asked in COLOURS else COLOURS[0]


def _failure(code: str, number: str, message: str, exit_code: int) -> Reply:
    where = {"file": None, "line": None, "column": None, "path": ""}
    error = {"code": code, "number": number, "message": message, "where": where}
    text = message if code == "interrupted" else _error_text(message, number)
    return Reply({"error": error, "errors": [error]}, text, exit_code)


def _error_text(message: str, number: str) -> str:
    """Return an error as people read it: the number, which `explain` takes, ends the first line."""
    first, *rest = message.splitlines() or [""]
    return "\n".join((f"error: {first} [{number}]", *rest))


def _show_notice(
    wipe: Callable[[], object], colours: str, message: Warning | str, category: type[Warning], *_: Any, **_named: Any
) -> None:
    """Print the toolkit's own notices as lines; a command's user can do nothing about other libraries' warnings."""
    if category.__module__.startswith("multibody_sym."):
        wipe()
        _say(f"note: {message}", colours)


def _write(stream: TextIO | None, text: str) -> None:
    if stream is not None:
        stream.write(text.rstrip("\n") + "\n")
        stream.flush()


def _say(text: str, colours: str) -> None:
    """Print a text on standard error, if anybody listens."""
    try:
        _write(sys.stderr, terminal_of(sys.stderr, colours).show(text))
    except OSError:
        _silence(sys.stderr)


def _silence(stream: TextIO | None) -> None:
    """Let what is left in a stream's buffer go nowhere when the interpreter closes it."""
    if stream is not None:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _json_text(value: Any) -> str:
    import json

    try:
        return json.dumps(value, allow_nan=False)
    except ValueError:
        return json.dumps(_finite(value), allow_nan=False)


def _finite(value: Any) -> Any:
    """Return the value with None where it is not a finite number."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(x) for key, x in value.items()}
    return [_finite(x) for x in value] if isinstance(value, (list, tuple)) else value
