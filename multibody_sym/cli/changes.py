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
        "parameters": "another value of a parameter: m1='500 g'",
        "initial": "another start: phi='30 deg'; phi='~' is found",
        "inputs": "another value of an input: tau='2*sin(t)'",
    }
    which = "relative (of joints) or absolute (of bodies)"
    project = "let start values change as constraints need"
    route = "the route to the equations; default: the cheapest"
    group = parser.add_argument_group("what changes the model, or how it is solved")
    for name, help in values.items():
        called = (ASSIGNED[name], f"--{name}") if ASSIGNED[name] != f"--{name}" else (f"--{name}",)
        group.add_argument(*called, dest=name, action="append", default=[], metavar="NAME=VALUE", help=help)
    group.add_argument("--coordinates", metavar="WHICH", help=which)
    group.add_argument("--project", action=argparse.BooleanOptionalAction, help=project)
    group.add_argument("--formalism", metavar="NAME", help=route)


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
