"""The public interface as lines of text, and what of it differs from that of the last release.

`python tests/public_record.py` prints the differences that CHANGES.md does not name yet;
`python tests/public_record.py --release` writes `docs/public_api.txt` anew, which is done with each release.
"""

from __future__ import annotations

import argparse
import inspect
import re
import sys
import tomllib
import typing
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, Final

import multibody_sym as mbs
from multibody_sym.model.fields import Element
from multibody_sym.scalars.node import Node

ROOT: Final = Path(__file__).parents[1]
RECORD: Final = ROOT / "docs" / "public_api.txt"
CHANGES: Final = ROOT / "CHANGES.md"
Interface = Mapping[str, str]
"""What there is by name, such as `simulate(t_end)`, `Trajectory.plot`, `multibody-sym check --json`, and how it is."""

_HEAD: Final = "# Recorded at release {version}: public functions, classes, commands and types in model files.\n"
_WORD: Final = re.compile(r"[-\w]+")
_KNOWN: Final = frozenset({"multibody-sym", "type"})
_EVERY: Final = "every command"


# --- what there is -------------------------------------------------------------------------------------------------


def interface() -> Interface:
    """Return the public interface as the code has it."""
    found: dict[str, str] = {}
    for name in mbs.__all__:
        found.update(_entries(name, getattr(mbs, name)))
    for cls in _returned():
        found.setdefault(cls.__name__, "class, returned")
        found.update(_members(cls))
    found.update(_commands())
    found.update(_types())
    return found


def _entries(name: str, value: Any) -> Iterator[tuple[str, str]]:
    """Yield what users write of a name: calls of functions, elements and errors; of results what can be asked."""
    if not isinstance(value, type):
        is_function = callable(value) and not isinstance(value, Node)
        yield from _signature(name, value, "function") if is_function else [(name, "value")]
    elif issubclass(value, Element):
        yield from _signature(name, value, "class")
    else:
        yield name, "class"
        yield from _members(value)


def _signature(name: str, function: Any, kind: str) -> Iterator[tuple[str, str]]:
    """Yield a callable with what it takes by position, in that order, then each parameter with its default."""
    parameters = inspect.signature(function).parameters.values()
    ordered = [p.name for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    yield name, f"{kind} ({', '.join(ordered)})"
    for p in parameters:
        yield f"{name}({p.name})", "required" if p.default is p.empty else f"= {p.default!r}"


def _members(cls: type[Any]) -> Iterator[tuple[str, str]]:
    """Yield public fields, properties and methods; of an error those that its class adds."""
    ours = [c for c in cls.__mro__ if c.__module__.startswith("multibody_sym.")]
    held = {f.name for f in fields(cls)} if is_dataclass(cls) else set()
    for name in sorted({*held, *(name for c in ours for name in vars(c))}):
        value = inspect.getattr_static(cls, name, None)
        if issubclass(cls, BaseException) and name not in vars(cls):
            continue
        if name == "__call__" or (inspect.isfunction(value) and not name.startswith("_")):
            yield f"{cls.__name__}.{name}", f"method {_plain(inspect.signature(getattr(cls, name)))}"
        elif not name.startswith("_"):
            yield f"{cls.__name__}.{name}", "field" if name in held else "property"


def _plain(signature: inspect.Signature) -> str:
    """Return a signature without self and types."""
    bare = [p.replace(annotation=p.empty) for p in signature.parameters.values() if p.name != "self"]
    return str(inspect.Signature(bare))


def _returned() -> list[type[Any]]:
    """Return the classes of what public functions return that have no public name and are called or read by users."""
    from multibody_sym.motion.prepare.functions import RightSide

    return [RightSide]


def _commands() -> Iterator[tuple[str, str]]:
    from multibody_sym.cli.options import _parser

    for command, parser in _parser()[1].items():
        yield f"multibody-sym {command}", "command"
        for action in parser._actions:
            if not isinstance(action, argparse._HelpAction):
                name = ", ".join(action.option_strings) or str(action.metavar or action.dest)
                yield f"multibody-sym {command} {name}", _value(action)


def _value(action: argparse.Action) -> str:
    if action.nargs == 0:
        return "without a value"
    words = f"one of {', '.join(map(str, action.choices))}" if action.choices else str(action.metavar or "value")
    return words if action.default in (None, []) else f"{words}, {action.default!r} if left out"


def _types() -> Iterator[tuple[str, str]]:
    """Yield the words that `type:` takes in model files; fields of elements are those of their classes."""
    from multibody_sym.model.constraints import CONSTRAINTS
    from multibody_sym.model.forces import FORCES
    from multibody_sym.model.joints import JOINTS

    for part, one_of in (("joints", JOINTS), ("forces", FORCES), ("constraints", CONSTRAINTS)):
        for word, cls in one_of.table.items():
            yield f"{part} type {word}", cls.__name__
        for word, other in one_of.aliases.items():
            yield f"{part} type {word}", f"the same as {other}"


# --- the record, and what differs from it ----------------------------------------------------------------------------


def recorded() -> Interface:
    """Return the interface of the last release."""
    lines = RECORD.read_text(encoding="utf-8").splitlines()
    return dict(typing.cast("tuple[str, str]", line.split("  ", 1)) for line in lines if not line.startswith("#"))


def release() -> str:
    """Return the version that the record is of."""
    found = re.match(_HEAD.partition("{")[0] + r"(\S+):", RECORD.read_text(encoding="utf-8"))
    assert found
    return found[1]


def differences(before: Interface, now: Interface) -> dict[str, str]:
    """Return what differs by name, in words."""
    found = {name: f"new: {now[name]}" for name in now if name not in before}
    found |= {name: f"gone: {before[name]}" for name in before if name not in now}
    found |= {name: f"was {before[name]}, is {now[name]}" for name in now if before.get(name, now[name]) != now[name]}
    return dict(sorted(found.items()))


def unnamed(different: Interface, notes: str) -> dict[str, str]:
    """Return the differences whose words stand together in no item of `notes`."""
    texts = re.split(r"^- ", notes, flags=re.MULTILINE)
    items = [{*_WORD.findall(text), *([_EVERY] if _EVERY in " ".join(text.split()) else [])} for text in texts]
    return {name: how for name, how in different.items() if not any(_names(item, name) for item in items)}


def _names(item: set[str], name: str) -> bool:
    words = [word for word in _WORD.findall(name) if word not in _KNOWN]
    if name.startswith("multibody-sym ") and _EVERY in item:
        words = words[1:]
    return all(word in item for word in words)


def unreleased() -> str:
    """Return what CHANGES.md says of the time since the last release."""
    return section("Unreleased")


def section(title: str) -> str:
    """Return what CHANGES.md says under a title; the empty text where it has none."""
    whole = CHANGES.read_text(encoding="utf-8")
    found = re.search(rf"^## {re.escape(title)}\b.*?$(.*?)(?=^## |\Z)", whole, re.MULTILINE | re.DOTALL)
    return found[1] if found else ""


def message(missing: Interface) -> str:
    """Return what is to be done about differences that are not named."""
    listed = "\n".join(f"  {name}  {how}" for name, how in missing.items())
    return (
        f"these public names differ from those of {release()} ({RECORD.relative_to(ROOT)}), and no item under "
        f"'Unreleased' in CHANGES.md names them (all words of a name in one item that begins with '- ', the command's "
        f"may be '{_EVERY}'):\n{listed}\n`python tests/public_record.py` prints this list; with --release, at a "
        "release only, it writes the record anew."
    )


def main() -> None:
    """Print what is not named, or write the record for a release."""
    if sys.argv[1:] == ["--release"]:
        version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
        lines = [f"{name}  {how}\n" for name, how in sorted(interface().items())]
        RECORD.write_text(_HEAD.format(version=version) + "".join(lines), encoding="utf-8")
        return
    missing = unnamed(differences(recorded(), interface()), unreleased())
    print(message(missing) if missing else "CHANGES.md names every difference from the last release")


if __name__ == "__main__":
    main()
