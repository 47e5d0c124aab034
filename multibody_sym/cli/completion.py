"""Shell completion, by the library shtab: a script for bash, zsh or tcsh that knows commands, options and words."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any, Final

from multibody_sym.errors import OutputError

SHELLS: Final = ("bash", "zsh", "tcsh")
_FILES: Final = ("FILE", "OUT", "PNG")


def completion(shell: str, parser: argparse.ArgumentParser, commands: Mapping[str, argparse.ArgumentParser]) -> str:
    """Return the script of a shell. Raises OutputError where shtab is missing."""
    try:
        import shtab
    except ImportError:
        message = "completion needs shtab: pip install 'multibody_sym[completion]'"
        raise OutputError(message, number="O104") from None
    words = _words()
    for name, command in commands.items():
        for action in command._actions:
            found: Any = action
            if action.metavar in _FILES:
                found.complete = shtab.FILE
            elif action.metavar == "DIR":
                found.complete = shtab.DIRECTORY
            elif action.choices is None and action.nargs != 0:
                known = words.get((name, action.dest)) or words.get(("", action.dest))
                action.choices = known
    return str(shtab.complete(parser, shell=shell))


def _words() -> dict[tuple[str, str], list[str]]:
    """Return the words that fit where the command or option takes any text."""
    from multibody_sym.cli.commands.new import examples
    from multibody_sym.cli.error_pages import EXPLAINED
    from multibody_sym.derivation.derive import IN_MOMENTA, METHODS
    from multibody_sym.derivation.routes import FORMALISMS
    from multibody_sym.model.settings import COORDINATES
    from multibody_sym.motion.methods.table import SUMMARIES

    return {
        ("new", "name"): list(examples()),
        ("explain", "number"): list(EXPLAINED),
        ("derive", "method"): [*METHODS, *IN_MOMENTA],
        ("", "method"): list(SUMMARIES),
        ("", "formalism"): list(FORMALISMS),
        ("", "coordinates"): list(COORDINATES),
    }
