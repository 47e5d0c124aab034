"""The Python API: every public name with its signature, docstring, fields and methods."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Iterator
from typing import Any

import multibody_sym as mbs
from multibody_sym.model.fields import Element
from site_pages.markdown import block, cell, code, paragraphs, table
from site_pages.model_file import anchors


def python_api() -> str:
    """Return the page."""
    values = {name: getattr(mbs, name) for name in mbs.__all__}
    kinds = {
        "Functions": [n for n, v in values.items() if callable(v) and not isinstance(v, type)],
        "Elements": [n for n, v in values.items() if isinstance(v, type) and issubclass(v, Element)],
        "Results": [n for n, v in values.items() if _is_result(v)],
        "Errors": [n for n, v in values.items() if isinstance(v, type) and issubclass(v, BaseException)],
    }
    told = {name for names in kinds.values() for name in names}
    kinds["Values"] = [name for name in values if name not in told]
    parts = ["# Python API\n\n`import multibody_sym as mbs`; all numbers are SI, angles in radians.\n"]
    for title, names in kinds.items():
        parts += [f"## {title}\n", *(_entry(name, values[name]) for name in names)]
    return "\n".join(parts)


def _is_result(value: Any) -> bool:
    return isinstance(value, type) and not issubclass(value, (Element, BaseException))


def _entry(name: str, value: Any) -> str:
    if not callable(value) or not (isinstance(value, type) or inspect.isfunction(value)):
        return f"### {name}\n\n{code(repr(value)[:80])}\n"
    text = paragraphs(inspect.getdoc(value))
    if isinstance(value, type) and issubclass(value, Element):
        where = anchors().get(value.__name__)
        keys = f"Its fields are [the keys of the model file]({where}).\n" if where else ""
        return f"### {name}\n\n{block(f'{name}{_signature(value)}', 'python')}\n{text}\n\n{keys}"
    if isinstance(value, type):
        rows = list(_members(value))
        members = table(("name", "what it is"), rows) if rows else ""
        return f"### {name}\n\n{text}\n\n{members}"
    return f"### {name}\n\n{block(f'{name}{_signature(value)}', 'python')}\n{text}\n"


def _signature(value: Any) -> str:
    signature = inspect.signature(value)
    bare = [p.replace(annotation=p.empty) for p in signature.parameters.values()]
    return str(inspect.Signature(bare))


def _members(cls: type[Any]) -> Iterator[tuple[str, str]]:
    held = {f.name for f in dataclasses.fields(cls)} if dataclasses.is_dataclass(cls) else set()
    own = {name for c in cls.__mro__ if c.__module__.startswith("multibody_sym.") for name in vars(c)}
    for name in sorted({*held, *own}):
        if name.startswith("_"):
            continue
        value = inspect.getattr_static(cls, name, None)
        said = inspect.getdoc(value) if callable(value) or isinstance(value, property) else ""
        first = (said or "").split("\n\n")[0]
        call = f"{name}{_method(cls, name)}" if inspect.isfunction(value) else name
        yield code(call), cell(paragraphs(first))


def _method(cls: type[Any], name: str) -> str:
    signature = inspect.signature(getattr(cls, name))
    bare = [p.replace(annotation=p.empty) for p in signature.parameters.values() if p.name != "self"]
    return str(inspect.Signature(bare))
