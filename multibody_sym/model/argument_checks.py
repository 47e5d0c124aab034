"""Checks of the arguments of public functions.

In: names and values of arguments. Out: the values, of one kind each; else an ArgumentError that says what fits.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import wraps
from operator import index
from typing import Any, Final, ParamSpec, TypeVar

from multibody_sym.errors import ArgumentError, nearest, short_repr

_P = ParamSpec("_P")
_R = TypeVar("_R")


def door(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Return a public function or method that raises ArgumentError where Python would raise TypeError for its call."""

    @wraps(function)
    def called(*values: _P.args, **named: _P.kwargs) -> _R:
        try:
            return function(*values, **named)
        except TypeError as error:
            if not isinstance(error, ArgumentError):
                _verify_call(function, values, named)
            raise

    return called


def _verify_call(function: Callable[..., Any], values: Sequence[Any], named: Mapping[str, Any]) -> None:
    """Raise ArgumentError where the arguments do not bind to a function; a TypeError from inside it passes."""
    from inspect import Parameter, signature

    known = signature(function)
    try:
        known.bind(*values, **named)
    except TypeError:
        every = [x for x in known.parameters.values() if x.kind not in (x.VAR_POSITIONAL, x.VAR_KEYWORD)]
        method = bool(every) and every[0].name == "self"
        every, values = (every[1:], values[1:]) if method else (every, values)
        places = [x.name for x in every if x.kind is not x.KEYWORD_ONLY]
        kinds = {x.kind for x in known.parameters.values()}
        if Parameter.VAR_POSITIONAL in kinds:
            values = values[: len(places)]
        if Parameter.VAR_KEYWORD in kinds:
            named = {name: value for name, value in named.items() if name in known.parameters}
        verify_arguments(
            function.__qualname__ if method else function.__name__,
            "argument",
            {x.name: x.name if x.name in places else f"{x.name}=" for x in every if x.default is Parameter.empty},
            places,
            [x.name for x in every],
            values,
            named,
        )


OTHERWISE: Final = "*"
"""The key in `meant` for every word that resembles no known one."""


def verify_arguments(
    called: str,
    what: str,
    needed: Mapping[str, str],
    places: Sequence[str],
    every: Sequence[str],
    values: Sequence[Any],
    named: Mapping[str, Any],
    meant: Mapping[str, str] | None = None,
) -> None:
    """Raise ArgumentError where `called` cannot take the positional `values` and the `named` ones.

    `every`: the names that it takes, `places` those by place; `needed`: names without a default, with their words in
    messages; `meant`: for unknown names the right one, or advice, instead of the nearest.
    """
    placed = places[: len(values)]
    by_name = [name for name in every if name not in placed]
    for name in named:
        if name in placed:
            raise ArgumentError(f"{called} is given {name} twice: by its place and by its name")
        if name not in by_name:
            advice, members = as_meant(name, by_name, meant)
            raise ArgumentError(f"{called} has no {what} {name!r}{advice}", **members)
    if len(values) > len(places):
        taken = f"{len(places)} by their places ({', '.join(places)})" if places else "none by its place"
        others = f"; give others by name: {', '.join(f'{name}=..' for name in by_name)}" if by_name else ""
        got = f"{len(values)}, {short_repr(values[len(places)])} the first too many"
        raise ArgumentError(f"{called} takes {taken}, and got {got}{others}")
    missing = [words for name, words in needed.items() if name in by_name and name not in named]
    if missing:
        raise ArgumentError(f"{called} is missing {'; '.join(missing)}")


def as_meant(word: str, known: Collection[str], meant: Mapping[str, str] | None) -> tuple[str, dict[str, Any]]:
    """Return the end of the message about an unknown word, and the members of its error that name the right one."""
    advice = (meant or {}).get(word) or (None if nearest(word, known) else (meant or {}).get(OTHERWISE))
    if advice is None or advice in known:
        return "", {"word": word, "known": known, "meant": advice}
    return f"; {advice}", {"word": word}


# Each of these returns the argument `name`, or raises ArgumentError.


def text(name: str, value: Any) -> str:
    if not isinstance(value, str):
        raise ArgumentError(f"{name} is to be text, got {short_repr(value)}")
    return value


def flag(name: str, value: Any) -> bool:
    if not isinstance(value, bool) and type(value).__name__ not in ("bool_", "bool"):
        raise ArgumentError(f"{name} is to be True or False, got {short_repr(value)}")
    return bool(value)


def whole_number(name: str, value: Any, most: int | None = None) -> int:
    """Return a number from 1 on, of any kind of integers."""
    try:
        found = 0 if isinstance(value, bool) else index(value)
    except TypeError:
        found = 0
    if found < 1 or (most is not None and found > most):
        range_ = "of at least 1" if most is None else f"from 1 to {most}"
        raise ArgumentError(f"{name} is a number {range_}, not {short_repr(value)}")
    return found


_NAMED: Final = {
    "parameters": "{'m': 2}, a parameter of the model",
    "initial": "{'phi': 0.1}, a coordinate or speed of the model",
    "inputs": "{'force': '2*sin(t)'}, an input of the model",
}
"""Examples of arguments that are maps of names."""


def values_by_name(name: str, value: Any) -> Mapping[str, Any]:
    """Return a map of names, the empty one for None."""
    if value is None:
        return {}
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        such = f", such as {_NAMED[name]}" if name in _NAMED else ""
        raise ArgumentError(f"{name} is to be a map from names to values{such}; got {short_repr(value)}")
    return value


def state_by_name(name: str, value: Any) -> Mapping[str, Any]:
    """Return a map of coordinates and speeds: as given, or out of a run's `final`."""
    given = values_by_name(name, value)
    parts = [given[key] for key in ("coordinates", "speeds") if isinstance(given.get(key), Mapping)]
    if not parts or not {"t", "coordinates", "speeds"}.issuperset(given):
        return given
    return {called: x for part in parts for called, x in values_by_name(name, part).items()}


def names(name: str, value: Any) -> tuple[str, ...]:
    listed = (value,) if isinstance(value, str) else value
    if not isinstance(listed, (list, tuple, set, frozenset)) or not all(isinstance(each, str) for each in listed):
        raise ArgumentError(f"{name} is to be a name or a list of names, got {short_repr(value)}")
    return tuple(listed)


def callback(name: str, value: Any) -> Callable[..., Any] | None:
    if value is not None and not callable(value):
        raise ArgumentError(f"{name} is to be a function, got {short_repr(value)}")
    return value  # type: ignore[no-any-return]
