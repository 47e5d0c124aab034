"""What tells a function from every other: its code, and all that it holds and names, as a hash.

A function of the user's own is told by its bytecode and constants, default values, captured variables, attributes and
the globals that it names, an object by its class and state, and so on for all that these hold; what is installed
(Python's library, packages) by its name. Nothing of it is called, but for what tells how an object is copied
(`__reduce_ex__` or the table of `copyreg`, as for pickle).
"""

from __future__ import annotations

import sys
import types
from collections.abc import Iterator, Mapping
from copyreg import dispatch_table
from dis import get_instructions
from functools import partial
from pathlib import PurePath
from typing import Any, Final

from multibody_sym.formats.writer import dumps
from multibody_sym.model.declaration.system import System
from multibody_sym.runtime.cache import digest

_PLAIN: Final = (type(None), bool, int, float, complex, str, bytes, type(...), type(NotImplemented))
_INSTALLED: Final = frozenset({"site-packages", "dist-packages"})
_MOST: Final = 100_000
"""Things that are looked at: of what holds more nobody waits for the end."""


class UntoldError(Exception):
    """Something is held that cannot be told from another; the message says what."""


def told(function: Any) -> str:
    """Return a hash that another function, or one that holds other values, does not have. Raises UntoldError."""
    try:
        return _Telling().told(function)
    except RecursionError:
        raise UntoldError("what is nested too deeply") from None


class _Telling:
    """What was told of things so far by identity, kept alive meanwhile; of those that are not finished, their depth."""

    def __init__(self) -> None:
        self._known: dict[int, str] = {}
        self._kept: list[Any] = []
        self._open: dict[int, int] = {}

    def told(self, x: Any) -> str:
        """Return the hash of anything."""
        if type(x) in _PLAIN:
            return f"{type(x).__name__} {x!r}"
        if id(x) in self._open:
            return f"within {len(self._open) - self._open[id(x)]}"
        if id(x) not in self._known:
            if len(self._kept) >= _MOST:
                raise UntoldError(f"more than {_MOST} things")
            self._kept.append(x)
            self._open[id(x)] = len(self._open)
            found = [self.told(part) if whole else part for whole, part in _parts(x)]
            del self._open[id(x)]
            self._known[id(x)] = digest(*(sorted(found) if type(x) in (set, frozenset) else found))
        return self._known[id(x)]


_Parts = Iterator[tuple[bool, Any]]
"""What a thing consists of: other things (True), and text about them (False)."""


def _parts(x: Any) -> _Parts:
    """Yield what a thing that is not plain consists of. Raises UntoldError."""
    yield False, type(x).__name__
    parts = _EXACT.get(type(x)) or next(parts for kind, parts in _KINDS if isinstance(x, kind))
    yield from parts(x)


def _function(x: types.FunctionType) -> _Parts:
    yield False, f"{x.__module__} {x.__qualname__}"
    if _is_installed(x.__globals__.get("__name__")) and not x.__closure__ and "<locals>" not in x.__qualname__:
        return
    for held in (x.__code__, x.__defaults__, x.__kwdefaults__, x.__dict__):
        yield True, held
    for cell in x.__closure__ or ():
        yield True, cell
    if not _is_installed(x.__globals__.get("__name__")):
        yield from _named(x.__code__, x.__globals__)


def _named(code: types.CodeType, among: Mapping[str, Any]) -> _Parts:
    """Yield the globals that code and the functions in it name; of modules of the user's own what may be meant."""
    for name in sorted(set(_globals(code))):
        if name in among:
            yield False, name
            yield True, among[name]
            if isinstance(among[name], types.ModuleType) and not _is_installed(among[name].__name__):
                inside = vars(among[name])
                for attribute in sorted({name for each in _codes(code) for name in each.co_names} & set(inside)):
                    yield False, attribute
                    yield True, inside[attribute]


def _globals(code: types.CodeType) -> Iterator[str]:
    for each in _codes(code):
        yield from (x.argval for x in get_instructions(each) if x.opname in {"LOAD_GLOBAL", "LOAD_NAME"})


def _codes(code: types.CodeType) -> Iterator[types.CodeType]:
    yield code
    for inner in code.co_consts:
        if isinstance(inner, types.CodeType):
            yield from _codes(inner)


def _code(x: types.CodeType) -> _Parts:
    counts = (x.co_argcount, x.co_posonlyargcount, x.co_kwonlyargcount, x.co_flags, x.co_freevars, x.co_cellvars)
    yield False, f"{x.co_code.hex()} {x.co_names!r} {x.co_varnames!r} {counts!r}"
    yield True, x.co_consts


def _cell(x: types.CellType) -> _Parts:
    try:
        yield True, x.cell_contents
    except ValueError:
        yield False, "empty"


def _class(x: type) -> _Parts:
    yield False, f"{x.__module__} {x.__qualname__}"
    if not _is_installed(x.__module__):
        yield True, x.__bases__
        for name, value in vars(x).items():
            if isinstance(value, _METHODS) or not (name.startswith("__") or name == "_abc_impl"):
                yield False, name
                yield True, value


_METHODS: Final = (types.FunctionType, staticmethod, classmethod, property, partial)
_SLOTS: Final = (types.MemberDescriptorType, types.GetSetDescriptorType)


def _by_name(x: Any) -> _Parts:
    yield False, f"{getattr(x, '__module__', '')} {getattr(x, '__qualname__', x.__name__)}"
    owner = getattr(x, "__self__", None)
    if owner is not None and not isinstance(owner, types.ModuleType):
        yield True, owner


def _each(x: Any) -> _Parts:
    yield from ((True, item) for item in x)


def _items(x: Mapping[Any, Any]) -> _Parts:
    for key, value in x.items():
        yield True, key
        yield True, value


def _attributes(*names: str) -> Any:
    return lambda x: ((True, getattr(x, name)) for name in names)


def _state(x: Any) -> _Parts:
    """Yield how an object is copied: its class, arguments, state and items."""
    try:
        found = dispatch_table[type(x)](x) if type(x) in dispatch_table else x.__reduce_ex__(4)
    except Exception:
        name = f"{type(x).__module__}.{type(x).__qualname__}".removeprefix("builtins.")
        raise UntoldError(f"an object of type {name}") from None
    yield True, type(x)
    if isinstance(found, str):  # what is found by its name, and what it wraps, such as a function with a cache
        yield False, found
        yield True, getattr(x, "__wrapped__", None)
        return
    for part in found:
        yield True, list(part) if isinstance(part, Iterator) else part


def _is_installed(module: str | None) -> bool:
    """Whether a module is Python's, this package's, or installed beside it, and no file of the user's own."""
    if module in (None, "__main__"):
        return False
    root = str(module).partition(".")[0]
    if root in sys.stdlib_module_names or root == __name__.partition(".")[0]:
        return True
    file = getattr(sys.modules.get(str(module)), "__file__", None)
    return file is not None and not _INSTALLED.isdisjoint(PurePath(file).parts)


_KINDS: Final[tuple[tuple[Any, Any], ...]] = (
    (System, lambda x: iter([(False, dumps(x))])),
    (types.FunctionType, _function),
    (types.CodeType, _code),
    (types.CellType, _cell),
    (type, _class),
    (types.MethodType, _attributes("__func__", "__self__")),
    ((types.BuiltinFunctionType, types.ModuleType, types.MethodDescriptorType, types.WrapperDescriptorType), _by_name),
    (_SLOTS, _by_name),
    (partial, _attributes("func", "args", "keywords")),
    ((staticmethod, classmethod), _attributes("__func__")),
    (property, _attributes("fget", "fset", "fdel")),
    (types.MappingProxyType, _items),
    (object, _state),
)
_EXACT: Final[Mapping[type, Any]] = types.MappingProxyType(
    {tuple: _each, list: _each, dict: _items, set: _each, frozenset: _each}
)
