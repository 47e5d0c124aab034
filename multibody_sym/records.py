"""`dataclass`, completed when a class is first used: a command uses a third of the classes that it imports.

The standard library compiles half a dozen methods for each class while its module is imported, which took half of the
time in which a command starts. The same methods are made here, by the standard library but for `__init__`, which is
written as it writes it; only the moment differs.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable
from functools import wraps
from threading import RLock
from typing import TYPE_CHECKING, Any, Final

__all__ = ["dataclass"]

_LOCK: Final = RLock()
_LOOKED_AT: Final = ("__dataclass_fields__", "__signature__")
"""What is read of a class before it has an instance: by `fields`, `replace` and subclasses; by `help`."""

if TYPE_CHECKING:
    from dataclasses import dataclass
else:

    def dataclass(cls: type | None = None, /, **options: Any) -> Any:
        """Return the class as `dataclasses.dataclass` makes it (same options), once it is first used."""
        return _later(cls, options) if cls is not None else lambda made: _later(made, options)


def _later(cls: Any, options: dict[str, Any]) -> Any:
    """Give a class what completes it at its first instance, called or unpickled, or where it is looked at."""
    declared = vars(cls)
    if "__init__" in declared or not declared.get("__annotations__") or options.get("slots"):
        return dataclasses.dataclass(**options)(cls)

    def complete() -> None:
        with _LOCK:
            if declared["__init__"] is begin:
                dataclasses.dataclass(**options, init=False)(cls)
                delattr(cls, "__signature__")
                delattr(cls, "__setstate__")
                cls.__init__ = _told(cls, _init(cls))

    def begin(self: Any, *values: Any, **named: Any) -> None:
        complete()
        cls.__init__(self, *values, **named)

    def restore(self: Any, state: dict[str, Any]) -> None:
        complete()
        self.__dict__.update(state)

    cls.__init__, cls.__setstate__ = begin, restore
    for name in _LOOKED_AT:
        setattr(cls, name, _Opened(name, complete))
    return cls


def _init(cls: Any) -> Any:
    """Return a class's `__init__`, as the standard library writes it.

    The library could make it only for a class that inherits this one, as at no moment may another thread find none: the
    methods of a frozen class were compiled a second time for that.
    """
    every = dataclasses.fields(cls)
    places = [f for f in every if f.init and not f.kw_only]
    names = [f for f in every if f.init and f.kw_only]
    used: dict[str, Any] = {"_set": object.__setattr__, "_factory": _FACTORY}
    arguments = ["self", *[_argument(f, used) for f in places], *["*"][: len(names)]]
    arguments += [_argument(f, used) for f in names]
    lines = [f"_set(self, {f.name!r}, {value})" for f in every if (value := _value(f, used))]
    lines += ["self.__post_init__()"] if hasattr(cls, "__post_init__") else []
    head = f"def _made({', '.join(used)}):\n def __init__({', '.join(arguments)}):\n  "
    found: dict[str, Any] = {}
    exec("\n  ".join([head, *(lines or ["pass"])]) + "\n return __init__", vars(sys.modules[cls.__module__]), found)
    made = found["_made"](**used)
    made.__qualname__, made.__module__ = f"{cls.__qualname__}.__init__", cls.__module__
    made.__annotations__ = {f.name: f.type for f in (*places, *names)} | {"return": None}
    return made


def _argument(f: dataclasses.Field[Any], used: dict[str, Any]) -> str:
    """Return an argument of `__init__`, whose default is added to what it uses."""
    if f.default is not dataclasses.MISSING:
        used[f"_default_{f.name}"] = f.default
        return f"{f.name}=_default_{f.name}"
    return f.name if f.default_factory is dataclasses.MISSING else f"{f.name}=_factory"


def _value(f: dataclasses.Field[Any], used: dict[str, Any]) -> str:
    """Return what `__init__` sets a field to; nothing where that is left to the class."""
    if f.default_factory is dataclasses.MISSING:
        return f.name if f.init else ""
    used[f"_make_{f.name}"] = f.default_factory
    made = f"_make_{f.name}()"
    return f"{made} if {f.name} is _factory else {f.name}" if f.init else made


class _Factory:
    """The default of an argument that is made anew for each instance."""

    def __repr__(self) -> str:
        return "<factory>"


_FACTORY: Final = _Factory()


def _told(cls: Any, made: Any) -> Any:
    """Return `__init__` for a class that has words of its own, `verify_call`, for arguments that do not fit."""
    verify = getattr(cls, "verify_call", None)
    if verify is None:
        return made

    @wraps(made)
    def init(self: Any, *values: Any, **named: Any) -> None:
        try:
            made(self, *values, **named)
        except TypeError:
            verify(values, named)
            raise

    return init


class _Opened:
    """An attribute of a class that is completed when it is read."""

    def __init__(self, name: str, complete: Callable[[], None]) -> None:
        self._name, self._complete = name, complete

    def __get__(self, _instance: object, owner: type) -> Any:
        self._complete()
        return getattr(owner, self._name)
