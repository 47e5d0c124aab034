"""`dataclass`, completed when a class is first used: a command uses a third of the classes that it imports.

The standard library compiles half a dozen methods for each class while its module is imported, which took half of the
time in which a command starts. The same methods are made here, by the standard library; only the moment differs.
`ByName` is the face of records of columns.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from functools import wraps
from threading import RLock
from typing import TYPE_CHECKING, Any, Final

__all__ = ["ByName", "dataclass"]

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
                cls.__init__ = _init_with_words(cls, _init(cls, options))

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


def _init(cls: Any, options: dict[str, Any]) -> Any:
    """Return a class's `__init__`, made for a class that inherits it: at no moment may another thread find none.

    The heir stands among `__subclasses__` until it is collected, and says that it is none of this package's classes.
    """
    heir = dataclasses.dataclass(eq=False, repr=False, match_args=False, frozen=options.get("frozen", False))
    body = {"__doc__": cls.__name__, "__module__": dataclasses.__name__}
    made = vars(heir(type(cls.__name__, (cls,), body)))["__init__"]
    made.__qualname__ = f"{cls.__qualname__}.__init__"
    return made


def _init_with_words(cls: Any, made: Any) -> Any:
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


class ByName:
    """Columns by name: iteration and `in` follow from the `keys` of a subclass."""

    def keys(self) -> tuple[str, ...]:
        """Return the names of the columns."""
        raise NotImplementedError

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name in self.keys()
