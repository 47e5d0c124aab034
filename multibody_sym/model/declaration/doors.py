"""What public functions take: each argument is looked at where it comes in, and what is of another kind is told."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

from multibody_sym.errors import ArgumentError, shown


def text(name: str, value: Any) -> str:
    """Return an argument that is text; raises ArgumentError."""
    if not isinstance(value, str):
        raise ArgumentError(f"{name} is to be text, got {shown(value)}")
    return value


def flag(name: str, value: Any) -> bool:
    """Return an argument that is True or False; raises ArgumentError."""
    if not isinstance(value, bool) and type(value).__name__ not in ("bool_", "bool"):
        raise ArgumentError(f"{name} is to be True or False, got {shown(value)}")
    return bool(value)


_NAMED: Final = {
    "parameters": "{'m': 2}, a parameter of the model",
    "initial": "{'phi': 0.1}, a coordinate or speed of the model",
    "inputs": "{'force': '2*sin(t)'}, an input of the model",
}
"""What fits an argument that is a map of names."""


def values_by_name(name: str, value: Any) -> Mapping[str, Any]:
    """Return an argument that is a map of names, the empty one for None; raises ArgumentError."""
    if value is None:
        return {}
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        such = f", such as {_NAMED[name]}" if name in _NAMED else ""
        raise ArgumentError(f"{name} is to be a map from names to values{such}; got {shown(value)}")
    return value


def state_by_name(name: str, value: Any) -> Mapping[str, Any]:
    """Return an argument that is a map of coordinates and speeds, or a run's `final` without its time.

    Raises ArgumentError.
    """
    given = values_by_name(name, value)
    parts = [given[key] for key in ("coordinates", "speeds") if isinstance(given.get(key), Mapping)]
    if not parts or not {"t", "coordinates", "speeds"}.issuperset(given):
        return given
    return {called: x for part in parts for called, x in values_by_name(name, part).items()}


def names(name: str, value: Any) -> tuple[str, ...]:
    """Return an argument that is a name or several; raises ArgumentError."""
    listed = (value,) if isinstance(value, str) else value
    if not isinstance(listed, (list, tuple, set, frozenset)) or not all(isinstance(each, str) for each in listed):
        raise ArgumentError(f"{name} is to be a name or a list of names, got {shown(value)}")
    return tuple(listed)


def callback(name: str, value: Any) -> Callable[..., Any] | None:
    """Return an argument that is a function or None; raises ArgumentError."""
    if value is not None and not callable(value):
        raise ArgumentError(f"{name} is to be a function, got {shown(value)}")
    return value  # type: ignore[no-any-return]


def choice(name: str, value: Any, known: Iterable[str]) -> str:
    """Return an argument that is one of a few words; raises ArgumentError."""
    words = list(known)
    if not isinstance(value, str) or value not in words:
        raise ArgumentError(f"there is no {name} {shown(value)}; known: {', '.join(words)}")
    return value
