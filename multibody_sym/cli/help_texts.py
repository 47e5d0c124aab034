"""What `--help` shows: the program on one screen, a command in short lines; the documentation tells the rest."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Final

WIDTH: Final = 80
_NAMES: Final = 25
_EXIT_CODES: Final = """\
exit codes: 0 done; 2 wrong input; 3 no solution, failed run or disagreement;
4 output, compiler or memory; 70 a defect of this program; 130 Ctrl-C
--version shows the version, --print-completion SHELL a script that completes"""


class Brief(argparse.HelpFormatter):
    """Options with their value once, and with one long name: others stand in the documentation."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=_NAMES, width=WIDTH)

    def _format_action_invocation(self, action: argparse.Action) -> str:
        if not action.option_strings:
            return super()._format_action_invocation(action)
        names = action.option_strings[:1]
        if isinstance(action, argparse.BooleanOptionalAction) or not names[0].startswith("--"):
            names = action.option_strings[:2]
        return ", ".join(names) + (f" {self._value(action)}" if action.nargs != 0 else "")

    def _value(self, action: argparse.Action) -> str:
        if action.choices:
            return "|".join(map(str, action.choices))
        return f"[{action.metavar}]" if action.nargs == "?" else str(action.metavar)


def usage(parser: argparse.ArgumentParser) -> str:
    """Return how a command is called: its arguments, the options that it needs, and that there are others."""
    words = [parser.prog]
    for action in parser._actions:
        if not action.option_strings:
            words.append(f"[{action.metavar}]" if action.nargs == "?" else str(action.metavar))
        elif action.required:
            words.append(f"{action.option_strings[0]} {action.metavar or '|'.join(map(str, action.choices or ()))}")
    return " ".join([*words, "[options]"])


def whole_help(purpose: str, commands: Mapping[str, str]) -> str:
    """Return the help of the program: a line for each command."""
    width = max(map(len, commands))
    lines = [f"  {name:{width}}  {_short(told, WIDTH - width - 4)}" for name, told in commands.items()]
    head = "usage: multibody-sym COMMAND [FILE] [options]   (COMMAND --help tells options)"
    return "\n".join((head, "", purpose, "", *lines, "", _EXIT_CODES, ""))


def _short(told: str, width: int) -> str:
    """Return what a command does, as much of it as fits in a line: parts behind a comma or colon are left out."""
    while len(told) > width:
        end = max(told.rfind(", "), told.rfind(": "))
        told = told[:end] if end > 0 else f"{told[: width - 2]}.."
    return told
