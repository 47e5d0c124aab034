"""The options that change the model a command takes, or how it is solved: the same for every command."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import Final

from multibody_sym.cli.usage import UsageError
from multibody_sym.errors import Where

ASSIGNED: Final = {"parameters": "--set", "initial": "--initial", "inputs": "--inputs"}
"""The options that are given as NAME=VALUE, by the names of the arguments that they are."""


def add_changes(parser: argparse.ArgumentParser) -> None:
    """Declare what changes the model that a command takes, or how it is solved."""
    values = {
        "parameters": "give a parameter another value, such as m1='500 g'",
        "initial": "let a coordinate or speed start elsewhere, such as phi='30 deg'; phi='~': where constraints put it",
        "inputs": "give an input another value, such as tau='2*sin(t)'",
    }
    which = "relative (of the joints) or absolute (of each body, restricted by joints); default: the file's"
    project = "let all start values change, known ones too, as little as constraints need"
    route = "the route to the equations of motion; default: the cheapest"
    for name, help in values.items():
        called = (ASSIGNED[name], f"--{name}") if ASSIGNED[name] != f"--{name}" else (f"--{name}",)
        parser.add_argument(*called, dest=name, action="append", default=[], metavar="NAME=VALUE", help=help)
    parser.add_argument("--coordinates", metavar="WHICH", help=which)
    parser.add_argument("--project", action=argparse.BooleanOptionalAction, help=project)
    parser.add_argument("--formalism", metavar="NAME", help=route)


def assignments(option: str, texts: Sequence[str]) -> Mapping[str, str]:
    """Return the values by name that an option was given as NAME=VALUE. Raises UsageError, for two values too."""
    values: dict[str, str] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise UsageError(f"{option} {text!r}: write NAME=VALUE", where=Where(path=(option,)))
        name, value = name.strip(), value.strip()
        if values.setdefault(name, value) != value:
            told = f"{name} is given two values, {values[name]!r} and {value!r}: leave one of them out"
            raise UsageError(told, where=Where(path=(option,)))
    return values
