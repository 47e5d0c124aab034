"""What a call may change of a system, and how it is solved and run: one record for functions and the command line.

In: nothing. Out: the names, types, defaults and `--help` texts of these options, for whoever declares or takes them.
Imports next to nothing: `--help` reads it alone.
"""

from collections.abc import Callable, Mapping
from functools import wraps
from types import NoneType
from typing import Annotated, Any, Final, NamedTuple, ParamSpec, TypedDict, TypeVar, get_args

from multibody_sym.program.backend import Backend

_P = ParamSpec("_P")
_R = TypeVar("_R")


class Option(NamedTuple):
    """An option of the command line: its help, the word for its value (else its name), its name if that is another."""

    help: str
    value: str = ""
    flag: str = ""
    default: Any = None


class RunSettings(TypedDict, total=False):
    """How a run is done: the keys of `simulation:` in a model file, in whose place they stand."""

    t_end: Annotated[Any, Option("until when, such as 10 or '2*pi*sqrt(l/g)'")]
    method: Annotated[str | None, Option("auto (default), radau_5 (stiff), 'all' lists")]
    step: Annotated[Any, Option("a fixed step in s")]
    rtol: Annotated[Any, Option("relative tolerance of an adaptive method")]
    atol: Annotated[Any, Option("absolute tolerance of an adaptive method")]
    samples: Annotated[Any, Option("number of rows, or times: 0,0.1,0.5 or a file")]
    constraints: Annotated[Any, Option("projection (default), baumgarte or index_2", "HOW")]


class ModelOverrides(TypedDict, total=False):
    """What changes the model: see `Overrides`, which does it."""

    parameters: Annotated[
        Mapping[str, Any] | None, Option("another value of a parameter: m1='500 g'", "NAME=VALUE", "--set")
    ]
    initial: Annotated[
        Mapping[str, Any] | None, Option("another start: phi='30 deg'; phi='~' is found", "NAME=VALUE", "--initial")
    ]
    inputs: Annotated[
        Mapping[str, Any] | None, Option("another value of an input: tau='2*sin(t)'", "NAME=VALUE", "--inputs")
    ]
    coordinates: Annotated[str | None, Option("relative (of joints) or absolute (of bodies)", "WHICH")]
    project: Annotated[bool | None, Option("let start values change as constraints need")]


class ModelOptions(ModelOverrides, total=False):
    """What every function takes beside a system, and every command beside a model file."""

    formalism: Annotated[str | None, Option("the route to the equations; default: the cheapest", "NAME")]


class RunOptions(RunSettings, ModelOptions, total=False):
    """What `simulate` takes, and whatever else makes runs."""

    native: Annotated[bool, Option("code for this processor only", default=False)]
    backend: Annotated[Backend | None, Option("default: C, or Python without a compiler")]


def options_of(record: type) -> dict[str, Option]:
    """Return the options of a record by name, in their order."""
    return {name: hint.__metadata__[0] for name, hint in record.__annotations__.items()}


RUN_SETTINGS: Final = options_of(RunSettings)
MODEL_OVERRIDES: Final = options_of(ModelOverrides)
MODEL_OPTIONS: Final = options_of(ModelOptions)
RUN_OPTIONS: Final = options_of(RunOptions)
ASSIGNED: Final = {name: option.flag for name, option in MODEL_OVERRIDES.items() if option.flag}
"""The options that are given as NAME=VALUE on the command line, by name."""


def spelled_out(record: type) -> Callable[[Callable[_P, _R]], Callable[_P, _R]]:
    """Return what gives a function with `**options` a signature in which the options of a record stand one by one.

    Other names are refused with a TypeError, as of every function.
    """
    from inspect import Parameter, formatannotation, signature

    def typed(name: str) -> str:
        kind = record.__annotations__[name].__origin__
        parts = get_args(kind) if NoneType in get_args(kind) else (kind,)
        text = " | ".join("None" if part is NoneType else formatannotation(part) for part in parts)
        return text.replace("typing.", "").replace("collections.abc.", "")

    def decorate(function: Callable[_P, _R]) -> Callable[_P, _R]:
        plain = signature(function)
        own = [x for x in plain.parameters.values() if x.kind is not Parameter.VAR_KEYWORD]
        options = [
            Parameter(name, Parameter.KEYWORD_ONLY, default=option.default, annotation=typed(name))
            for name, option in options_of(record).items()
        ]
        told = [x for x in own if x.name == "on_progress"]
        shown = plain.replace(parameters=[*(x for x in own if x not in told), *options, *told])

        @wraps(function)
        def called(*values: _P.args, **named: _P.kwargs) -> _R:
            shown.bind(*values, **named)
            return function(*values, **named)

        called.__signature__ = shown  # type: ignore[attr-defined]
        return called

    return decorate
