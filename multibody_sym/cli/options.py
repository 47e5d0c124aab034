"""The words of a command line: commands, their options, and what is wrong with them."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import Any, Final, NoReturn

from multibody_sym.cli.commands import check, derive, equilibrium, export, import_, linearize, new, simulate, solve
from multibody_sym.errors import InputError, Where

COMMANDS: Final = (new, import_, check, derive, solve, equilibrium, linearize, simulate, export)
ASSIGNED: Final = {"parameters": "--set", "initial": "--initial", "inputs": "--inputs"}
"""The options that are given as NAME=VALUE, by the names of the arguments that they are."""
_AS_JSON: Final = "print one JSON object, also for an error; text goes to standard error"
_EXIT_CODES: Final = (
    "exit codes: 0 done; 2 wrong input; 3 no solution, failed run or disagreement; 4 output, compiler or memory; "
    "70 a defect of this program; 130 Ctrl-C, with what was computed kept"
)


class UsageError(InputError):
    """The words of a command line make no command."""

    code = "usage"


class Shown(SystemExit):
    """What `--help` and `--version` show, instead of ending the process."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.text = text


class _Parser(argparse.ArgumentParser):
    """A parser that raises instead of ending the process, and takes no option's name shortened."""

    def __init__(self, **named: Any) -> None:
        super().__init__(**named, allow_abbrev=False)

    def print_help(self, _file: Any = None) -> NoReturn:
        raise Shown(self.format_help())

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message} (see {self.prog} --help)")


class _Version(argparse.Action):
    """Show the version, which is looked up only then."""

    def __init__(self, **named: Any) -> None:
        super().__init__(**named, nargs=0)

    def __call__(self, *_arguments: Any) -> NoReturn:
        from multibody_sym.cli.version import __version__

        raise Shown(f"multibody-sym {__version__}")


def parsed(words: Sequence[str]) -> argparse.Namespace:
    """Return the options of a command line; `run` is the function of the command. Raises UsageError and Shown."""
    parser, commands = _parser()
    options, unknown = parser.parse_known_args(words)
    if unknown:
        known = [option for action in commands[options.command]._actions for option in action.option_strings]
        raise UsageError(f"{options.command} has no option {unknown[0]!r}{_suggestion(unknown[0], known)}")
    for name, option in ASSIGNED.items():
        if name in options:
            setattr(options, name, _assignments(option, getattr(options, name)))
    return options


def _suggestion(word: str, known: Sequence[str]) -> str:
    from difflib import get_close_matches

    near = get_close_matches(word.partition("=")[0], known, n=1)
    return f"; did you mean {near[0]}?" if near else ""


def _parser() -> tuple[argparse.ArgumentParser, Mapping[str, argparse.ArgumentParser]]:
    purpose = "Equations of motion of multibody systems, derived and run."
    parser = _Parser(prog="multibody-sym", description=purpose, epilog=_EXIT_CODES)
    parser.add_argument("--version", action=_Version, help="show the version")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", dest="command", required=True)
    made: dict[str, argparse.ArgumentParser] = {}
    for command in COMMANDS:
        name = command.__name__.rpartition(".")[2].rstrip("_")
        described = f"{command.HELP[0].upper()}{command.HELP[1:]}."
        one = made[name] = commands.add_parser(name, help=command.HELP, description=described)
        command.add_options(one)
        one.add_argument("--json", action="store_true", help=_AS_JSON)
        if command not in (new, import_):
            _add_changes(one)
        one.set_defaults(run=command.run)
    return parser, made


def _add_changes(parser: argparse.ArgumentParser) -> None:
    """Declare what changes the model that a command takes, or how it is solved."""
    values = {
        "parameters": "give a parameter another value, such as m1='500 g'",
        "initial": "let a coordinate or speed start elsewhere, such as phi='30 deg'; phi=~: where constraints put it",
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


def _assignments(option: str, texts: Sequence[str]) -> Mapping[str, str]:
    values = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise UsageError(f"{option} {text!r}: write NAME=VALUE", where=Where(path=(option,)))
        values[name.strip()] = value.strip()
    return values
