"""`dataclass`, completed when a class is first used: a command uses a third of the classes that it imports.

The standard library compiles half a dozen methods for each class while its module is imported, which took half of the
time in which a command starts. Here it finds the fields when a class is first used; of the methods, which do the same
as its own, `__init__` is compiled then, equality and hash when they are first called.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, FrozenInstanceError
from functools import wraps
from reprlib import recursive_repr
from threading import RLock
from typing import TYPE_CHECKING, Any, Final

__all__ = ["dataclass"]

_LOCK: Final = RLock()
_LOOKED_AT: Final = ("__dataclass_fields__", "__signature__")
"""What is read of a class before it has an instance: by `fields`, `replace` and subclasses; by `help`."""
_OPTIONS: Final = frozenset(["eq", "frozen", "kw_only", "repr"])
"""What classes that are completed later may ask for."""

if TYPE_CHECKING:
    from dataclasses import dataclass
else:

    def dataclass(cls: type | None = None, /, **options: Any) -> Any:
        """Return the class as `dataclasses.dataclass` makes it (same options), once it is first used."""
        return _later(cls, options) if cls is not None else lambda made: _later(made, options)


def _later(cls: Any, options: dict[str, Any]) -> Any:
    """Give a class what completes it at its first instance, called or unpickled, or where it is looked at."""
    declared = vars(cls)
    if "__init__" in declared or not declared.get("__annotations__") or not options.keys() <= _OPTIONS:
        return dataclasses.dataclass(**options)(cls)

    def complete() -> None:
        with _LOCK:
            if declared["__init__"] is begin:
                _complete(cls, **options)

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


def _complete(cls: Any, *, frozen: bool = False, eq: bool = True, repr: bool = True, kw_only: bool = False) -> None:
    """Give a class its fields, then its methods; its `__init__` last, for at no moment may another thread find none.

    The standard library compiles methods for what is frozen: only an heir, whose bases it verifies, is frozen by it.
    """
    declared, heir = vars(cls), any(map(dataclasses.is_dataclass, cls.__mro__[1:]))
    options: dict[str, Any] = {"frozen": frozen and heir, "kw_only": kw_only}
    cls.__doc__ = cls.__doc__ or cls.__name__  # else it asks for the signature, which is not known yet
    dataclasses.dataclass(init=False, repr=False, eq=False, **options)(cls)
    cls.__dataclass_params__.frozen = frozen
    fields = dataclasses.fields(cls)
    methods: dict[str, Any] = {}
    if frozen and not heir:
        methods |= _frozen(cls, frozenset(field.name for field in fields))
    if repr:
        methods["__repr__"] = _repr([field.name for field in fields if field.repr])
    if eq:
        methods["__eq__"] = _eq(cls, [field.name for field in fields if field.compare])
        hashed = [field.name for field in fields if (field.compare if field.hash is None else field.hash)]
        methods["__hash__"] = _hash(cls, hashed) if frozen else None
    for name, method in methods.items():
        if declared.get(name) is None:  # a class that says what is equal has the hash None
            setattr(cls, name, method)
    delattr(cls, "__signature__")
    delattr(cls, "__setstate__")
    cls.__init__ = _init_with_words(cls, _init(cls, fields, frozen))


def _compiled(cls: Any, name: str, arguments: str, lines: Sequence[str], known: Mapping[str, Any]) -> Any:
    """Return a method of a class from its text, in which some names are `known`."""
    body = "\n  ".join(lines)
    text = f"def make({', '.join(known)}):\n def {name}({arguments}):\n  {body}\n return {name}"
    made: dict[str, Any] = {}
    exec(text, vars(sys.modules[cls.__module__]) if cls.__module__ in sys.modules else {}, made)
    method = made["make"](**known)
    method.__qualname__ = f"{cls.__qualname__}.{name}"
    return method


class _Factory:
    """The default of a field that is made anew for each instance."""

    def __repr__(self) -> str:
        return "<factory>"


_FACTORY: Final = _Factory()


def _init(cls: Any, fields: Sequence[dataclasses.Field[Any]], frozen: bool) -> Any:
    """Return a class's `__init__`."""
    known: dict[str, Any] = {"_set": object.__setattr__, "_FACTORY": _FACTORY}
    positional, named, lines = ["self"], list[str](), list[str]()
    for field in fields:
        name = value = argument = field.name
        if field.default_factory is not MISSING:
            known[f"_make_{name}"] = field.default_factory
            argument = f"{name}=_FACTORY"
            value = f"_make_{name}() if {name} is _FACTORY else {name}" if field.init else f"_make_{name}()"
        elif field.default is not MISSING:
            known[f"_default_{name}"] = field.default
            argument = f"{name}=_default_{name}"
        if field.init:
            (named if field.kw_only else positional).append(argument)
        if field.init or field.default_factory is not MISSING:
            lines.append(f"_set(self, {name!r}, {value})" if frozen else f"self.{name} = {value}")
    lines += ["self.__post_init__()"] if hasattr(cls, "__post_init__") else []
    arguments = ", ".join([*positional, *(["*", *named] if named else [])])
    init = _compiled(cls, "__init__", arguments, lines or ["pass"], known)
    init.__annotations__ = {**{field.name: field.type for field in fields if field.init}, "return": None}
    return init


def _eq(cls: Any, names: Sequence[str]) -> Any:
    """Return `__eq__`, compiled when it is first called."""

    def __eq__(self: Any, other: object) -> Any:  # noqa: N807
        one, two = (f"({''.join(f'{of}.{name}, ' for name in names)})" for of in ("self", "other"))
        same = f"return {one} == {two} if other.__class__ is self.__class__ else NotImplemented"
        cls.__eq__ = _compiled(cls, "__eq__", "self, other", [same], {})
        return cls.__eq__(self, other)

    return __eq__


def _hash(cls: Any, names: Sequence[str]) -> Any:
    """Return `__hash__`, compiled when it is first called."""

    def __hash__(self: Any) -> int:  # noqa: N807
        values = "".join(f"self.{name}, " for name in names)
        cls.__hash__ = _compiled(cls, "__hash__", "self", [f"return hash(({values}))"], {})
        return int(cls.__hash__(self))

    return __hash__


def _repr(names: Sequence[str]) -> Any:
    @recursive_repr()
    def __repr__(self: Any) -> str:  # noqa: N807
        return f"{type(self).__qualname__}({', '.join([f'{name}={getattr(self, name)!r}' for name in names])})"

    return __repr__


def _frozen(cls: Any, names: frozenset[str]) -> dict[str, Any]:
    """Return what keeps fields, and all attributes of a class's own instances, from being set and deleted."""

    def __setattr__(self: Any, name: str, value: Any) -> None:  # noqa: N807
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:  # noqa: N807
        if type(self) is cls or name in names:
            raise FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    return {"__setattr__": __setattr__, "__delattr__": __delattr__}


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
