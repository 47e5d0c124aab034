"""The words of a command line: commands, their options, what is wrong with them, and the reply to them."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from keyword import iskeyword
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final, NoReturn, cast, get_args

from multibody_sym.cli.terminal import COLOURS
from multibody_sym.errors import InputError, OutputError, Where, at, nearest
from multibody_sym.model.run_options import ASSIGNED, MODEL_OPTIONS, RUN_OPTIONS, ModelOptions, RunOptions
from multibody_sym.records import dataclass

if TYPE_CHECKING:
    from multibody_sym.text.values import Units

# ----------------------------------------------------------------------------------------------------------------------
# Command lines that run no command.


class UsageError(InputError):
    """The command line is wrong."""

    code = "usage"
    number = "U101"


class ShownText(SystemExit):
    """The text of `--help`, `--version` or `--print-completion`."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.text = text


# ----------------------------------------------------------------------------------------------------------------------
# The options that change the model a command takes, or how it is solved: the same for every command.


def add_run_options(parser: argparse.ArgumentParser) -> None:
    """Declare how a run is done."""
    group = parser.add_argument_group("how the run is done")
    for name in RUN_OPTIONS:
        if name not in MODEL_OPTIONS:
            _add_option(group, name)


def _add_option(group: Any, name: str) -> None:
    """Declare the option of an argument, as its type says."""
    option, kind = RUN_OPTIONS[name], RunOptions.__annotations__[name].__origin__
    word = f"--{name.replace('_', '-')}"
    choices = [choice for part in get_args(kind) for choice in get_args(part) if isinstance(choice, str)]
    if option.flag:
        words = dict.fromkeys((option.flag, word))
        group.add_argument(*words, dest=name, action="append", default=[], metavar=option.value, help=option.help)
    elif kind is bool:
        group.add_argument(word, action="store_true", help=option.help)
    elif kind == bool | None:
        group.add_argument(word, action=argparse.BooleanOptionalAction, help=option.help)
    elif choices:
        group.add_argument(word, choices=choices, help=option.help)
    else:
        group.add_argument(word, metavar=option.value or name.upper(), help=option.help)


def model_options(options: argparse.Namespace) -> ModelOptions:
    """Return the arguments that every function takes beside a system."""
    return cast(ModelOptions, {name: getattr(options, name) for name in MODEL_OPTIONS})


def run_options(options: argparse.Namespace) -> RunOptions:
    """Return the arguments that `simulate` takes beside a system, for a command that has them as options."""
    given = {name: getattr(options, name) for name in RUN_OPTIONS}
    return cast(RunOptions, {**given, "samples": _times_in_file(given["samples"])})


_TABLES: Final = (".csv", ".npz", ".parquet")


def _times_in_file(samples: str | None) -> Any:
    """Return the times in column t of the table that is named for `samples`, or what is given if that is no file."""
    if samples is None or not samples.endswith(_TABLES):
        return samples
    from multibody_sym.text.tables import read_table

    table = read_table(samples)
    if "t" not in table.columns:
        message = f"the table has no column t of times; it has {', '.join(table.columns) or 'none'}"
        raise InputError(message, where=Where(file=samples))
    return table.columns["t"].tolist()


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


# ----------------------------------------------------------------------------------------------------------------------
# What `--help` shows: the program on one screen, a command in short lines; the documentation tells the rest.


WIDTH: Final = 80
_NAMES: Final = 25
_EXIT_CODES: Final = """\
exit codes: 0 done; 2 input; 3 no solution; 4 output; 70 a defect; 130 Ctrl-C
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
        if action.choices and action.metavar is None:
            return "|".join(map(str, action.choices))
        return f"[{action.metavar}]" if action.nargs == "?" else str(action.metavar)


def _short(told: str, width: int) -> str:
    """Return a help text cut to a line, at a comma or colon."""
    while len(told) > width:
        end = max(told.rfind(", "), told.rfind(": "))
        told = told[:end] if end > 0 else f"{told[: width - 2]}.."
    return told


# ----------------------------------------------------------------------------------------------------------------------

COMMANDS: Final = (
    *("new", "import", "check", "draw", "derive", "solve", "equilibrium", "linearize", "modes", "simulate", "animate"),
    *("live", "sweep", "export", "report", "schema", "explain"),
)
"""The commands, in the order in which they are told."""
_WITHOUT_MODEL: Final = ("new", "import", "schema", "explain")
_AS_JSON: Final = "print one JSON object, also for an error"
_IN_COLOURS: Final = "bold and colours: auto (default), always or never"
_PURPOSE: Final = "Equations of motion of multibody systems, derived and run."


class _Once(argparse.Action):
    """Keep the value of an option; another value for the same option, under whatever name, is refused."""

    given: tuple[str, Any] | None = None

    def __call__(self, parser: Any, namespace: argparse.Namespace, values: Any, option: str | None = None) -> None:
        if option is not None and self.given is not None and self.given[1] != values:
            before, value = self.given
            parser.error(f"{before} {value} and {option} {values} are two values for one thing: leave one of them out")
        self.given = None if option is None else (option, values)
        setattr(namespace, self.dest, values)


class _Parser(argparse.ArgumentParser):
    """A parser that raises instead of ending the process, and takes no option's name shortened."""

    def __init__(self, **named: Any) -> None:
        super().__init__(**named, allow_abbrev=False, formatter_class=Brief)
        for action in (None, "store"):
            self.register("action", action, _Once)

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """Refuse an unknown choice or command, and name the nearest one."""
        if action.choices is not None and value not in action.choices:
            known = list(map(str, action.choices))
            near = _suggestion(str(value), known)
            if isinstance(action, argparse._SubParsersAction):
                self.error(f"there is no command {value!r}{near or '; known: ' + ', '.join(known)}")
            raise argparse.ArgumentError(action, f"invalid choice: {value!r} (choose from {', '.join(known)}){near}")

    def print_help(self, _file: Any = None) -> NoReturn:
        raise ShownText(self.format_help())

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message} (see {self.prog} --help)")


class _Version(argparse.Action):
    """Show the version, which is looked up only then."""

    def __init__(self, **named: Any) -> None:
        super().__init__(**named, nargs=0)

    def __call__(self, *_arguments: Any) -> NoReturn:
        from multibody_sym.cli.version import __version__

        raise ShownText(f"multibody-sym {__version__}")


class _Completion(argparse.Action):
    """Show the script with which a shell completes words of the command line."""

    def __call__(self, _parser_: Any, _namespace: Any, shell: Any, _option: str | None = None) -> NoReturn:
        raise ShownText(completion(shell, *_parser()))


def parse_words(words: Sequence[str]) -> argparse.Namespace:
    """Return the options of a command line; `run` is the function of the command. Raises UsageError and ShownText."""
    parser, commands = _parser([word for word in words[:1] if word in COMMANDS] or COMMANDS)
    _verify_options(words, parser, commands)
    options, unknown = parser.parse_known_args(words)
    if unknown:
        _refuse(unknown[0], options.command, commands[options.command])
    for name, option in ASSIGNED.items():
        if name in options:
            setattr(options, name, assignments(option, getattr(options, name)))
    if isinstance(getattr(options, "at", None), list):  # a state, not a time
        options.at = _place(options.at)
    return options


def _verify_options(
    words: Sequence[str], parser: argparse.ArgumentParser, commands: Mapping[str, argparse.ArgumentParser]
) -> None:
    """Raise UsageError for options that a command, or the program, does not have, before others are missed."""
    place = next((k for k, word in enumerate(words) if not word.startswith("-")), len(words))
    command = words[place] if place < len(words) else ""
    for word in words[:place]:
        if word.partition("=")[0] not in _options(parser):
            later = any(word.partition("=")[0] in _options(each) for each in commands.values())
            hint = "; options stand behind a command" if later else _suggestion(word, _options(parser))
            if command or not later:
                raise UsageError(f"there is no option {word!r}{hint}")
    for word in words[place + 1 :] if command in commands else ():
        if word == "--":
            return
        if word.startswith("--") and word.partition("=")[0] not in _options(commands[command]):
            _refuse(word, command, commands[command])


def _options(parser: argparse.ArgumentParser) -> list[str]:
    return [option for action in parser._actions for option in action.option_strings]


def _refuse(word: str, command: str, parser: argparse.ArgumentParser) -> NoReturn:
    if not word.startswith("-"):
        raise UsageError(f"{command} takes no further argument {word!r} (see multibody-sym {command} --help)")
    raise UsageError(f"{command} has no option {word!r}{_suggestion(word, _options(parser))}")


def _place(words: Sequence[str]) -> str | Mapping[str, str]:
    """Return the state to linearise at: one word, or values by name."""
    from multibody_sym.analysis.state_asked_about import REST

    odd = next((word for word in words if "=" not in word), None)
    if list(words) == [REST]:
        return REST
    if odd is not None:
        raise UsageError(f"--at {odd!r}: write {REST} or NAME=VALUE", where=Where(path=("--at",)))
    return assignments("--at", words)


def _suggestion(word: str, known: Sequence[str]) -> str:
    near = nearest(word.partition("=")[0], known)
    return f"; did you mean {near}?" if near else ""


def command_module(name: str) -> ModuleType:
    """Import and return the module of a command."""
    return import_module(f"multibody_sym.cli.commands.{f'{name}_' if iskeyword(name) else name}")


class _Program(_Parser):
    """The parser of the program, whose help has a line for each command."""

    def format_help(self) -> str:
        commands = {name: command_module(name).HELP for name in COMMANDS}
        width = max(map(len, commands))
        lines = [f"  {name:{width}}  {_short(told, WIDTH - width - 4)}" for name, told in commands.items()]
        head = "usage: multibody-sym COMMAND [FILE] [options]   (COMMAND --help lists options)"
        return "\n".join((head, "", _PURPOSE, "", *lines, "", _EXIT_CODES, ""))


def _parser(names: Sequence[str] = COMMANDS) -> tuple[argparse.ArgumentParser, Mapping[str, argparse.ArgumentParser]]:
    parser = _Program(prog="multibody-sym", description=_PURPOSE)
    parser.add_argument("--version", action=_Version, help="show the version")
    script = "show the script with which a shell completes words (needs shtab)"
    parser.add_argument("--print-completion", action=_Completion, choices=("bash", "zsh", "tcsh"), help=script)
    commands = parser.add_subparsers(
        title="commands", metavar="COMMAND", dest="command", required=True, parser_class=_Parser
    )
    made: dict[str, argparse.ArgumentParser] = {}
    for name in names:
        command = command_module(name)
        described = f"{command.HELP[0].upper()}{command.HELP[1:]}."
        aliases: Sequence[str] = getattr(command, "ALIASES", ())
        one = made[name] = commands.add_parser(name, help=command.HELP, description=described, aliases=aliases)
        if name not in _WITHOUT_MODEL:
            one.add_argument("file", metavar="FILE", help="a model file (YAML)")
        command.add_options(one)
        one.add_argument("--json", action="store_true", help=_AS_JSON)
        one.add_argument("--color", choices=COLOURS, default=COLOURS[0], metavar="WHEN", help=_IN_COLOURS)
        if name not in _WITHOUT_MODEL:
            group = one.add_argument_group("what changes the model, or how it is solved")
            for option in MODEL_OPTIONS:
                _add_option(group, option)
        one.set_defaults(run=command.run, command=name)
        # the arguments of the command, and the options that it needs
        words = [one.prog]
        for action in one._actions:
            if not action.option_strings:
                words.append(f"[{action.metavar}]" if action.nargs == "?" else str(action.metavar))
            elif action.required:
                words.append(f"{action.option_strings[0]} {action.metavar or '|'.join(map(str, action.choices or ()))}")
        one.usage = " ".join([*words, "[options]"])
        made.update(dict.fromkeys(aliases, one))
    return parser, made


# ----------------------------------------------------------------------------------------------------------------------
# Shell completion, by the library shtab: a script for bash, zsh or tcsh that knows commands, options and words.


_FILES: Final = ("FILE", "OUT", "PNG")
_PACKAGE: Final = Path(__file__).parents[1]


def examples() -> dict[str, Path]:
    """Return the file of each shipped example by name."""
    inside = _PACKAGE / "examples"  # of the installed package, else of the checkout
    folder = inside if inside.is_dir() else _PACKAGE.parent / "examples"
    return {path.stem: path for path in sorted(folder.rglob("*.yaml"))}


def completion(shell: str, parser: argparse.ArgumentParser, commands: Mapping[str, argparse.ArgumentParser]) -> str:
    """Return the script of a shell. Raises OutputError where shtab is missing."""
    try:
        import shtab
    except ImportError:
        message = "completion needs shtab: pip install 'multibody_sym[completion]'"
        raise OutputError(message, number="O104") from None
    # the words that fit where the command or option takes any text
    from multibody_sym.cli.error_pages import EXPLAINED
    from multibody_sym.derivation.derive import IN_MOMENTA, METHODS
    from multibody_sym.derivation.routes import FORMALISMS
    from multibody_sym.model.settings import COORDINATES
    from multibody_sym.motion.methods.table import SUMMARIES

    words = {
        ("new", "name"): list(examples()),
        ("explain", "number"): list(EXPLAINED),
        ("derive", "method"): [*METHODS, *IN_MOMENTA],
        ("", "method"): list(SUMMARIES),
        ("", "formalism"): list(FORMALISMS),
        ("", "coordinates"): list(COORDINATES),
    }
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


# ----------------------------------------------------------------------------------------------------------------------
# Replies of commands, where results go, units and digits of quantities.


INTERRUPTED: Final = 130
"""The exit code after Ctrl-C."""


def first_lines(hints: Iterable[str]) -> list[str]:
    """Return the first lines of hints, without the lines of the model file."""
    return [hint.partition("\n")[0] for hint in hints]


@dataclass(frozen=True)
class Reply:
    """`--json` prints `json` on standard output and `text` on standard error; without it `text` is the output.

    `missed`: work that was asked for and not done, on standard error in either case. `source`: the text is code, which
    no terminal wraps.
    """

    json: Mapping[str, Any]
    text: str
    exit_code: int = 0
    missed: str = ""
    source: bool = False


# ----------------------------------------------------------------------------------------------------------------------
# Where results of commands go.


def verify_apart(file: str, target: str | None, what: str = "the model itself") -> None:
    """Raise InputError where a result would replace the model file or `what` else, under whatever name."""
    both = target is not None and os.path.isfile(file) and os.path.isfile(target)
    if both and target is not None and os.path.samefile(file, target):
        raise InputError(f"this is {what}; give the result another name", where=Where(file=target), number="O101")


# ----------------------------------------------------------------------------------------------------------------------
# The options of commands that print quantities: units and digits in which people read them.


_DESCRIBED: Final = "units to read, such as mm,deg,kN; --json stays SI"
_MOST_DIGITS: Final = 17


def add_units(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--units", metavar="UNITS", help=_DESCRIBED)


def add_digits(parser: argparse.ArgumentParser, digits: int | None = None) -> None:
    """Declare how many digits are printed, where nothing is said so many; None: as texts have them."""
    from multibody_sym.text.values import DIGITS

    digits = digits or DIGITS
    parser.add_argument("--digits", metavar="N", default=digits, help=f"digits of numbers; default: {digits}")


def asked_units(options: argparse.Namespace) -> Units:
    """Return the units and digits that the options ask for. Raises InputError for what is neither."""
    from multibody_sym.text.values import chosen_units

    with at("--units"):
        units = chosen_units(options.units)
    told = str(getattr(options, "digits", units.digits))
    if not told.isdecimal() or not 1 <= int(told) <= _MOST_DIGITS:
        raise InputError(f"expected a number from 1 to {_MOST_DIGITS}, got {told!r}", where=Where(path=("--digits",)))
    return replace(units, digits=int(told))
