"""The keys of model files element by element, from the declarations."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Iterator, Sequence
from typing import Any

from multibody_sym.model.fields import Element, fields_of, key_of, unit_of
from multibody_sym.model.schema import REPEAT_SAYS, TYPED, VERSION_SAYS, default_of, kind_of, words_of
from multibody_sym.model.system import REPEAT_KEY, VERSION_KEY, Repeat, System
from site_pages.markdown import anchor, cell, code, paragraphs, table


def sections() -> Iterator[tuple[str, type[Element]]]:
    """Yield title and class of every element of a model file, in the order in which the file leads to them."""
    words = {
        cls: (part, words_of(one_of, name)) for part, one_of in TYPED.items() for name, cls in one_of.table.items()
    }
    pending: list[type[Element]] = [System, Repeat]
    seen: set[type[Element]] = set()
    while pending:
        cls = pending.pop(0)
        if cls in seen:
            continue
        seen.add(cls)
        part, names = words.get(cls, ("", []))
        yield (f"{part}: {', '.join(names)}" if names else cls.__name__), cls
        pending[:0] = [one for field in fields_of(cls).values() for one in kind_of(field).elements]


def section(title: str, cls: type[Element]) -> str:
    """Return the part of the page about one element: its docstring and a table of its keys."""
    rows = [_row(f) for f in dataclasses.fields(cls)]
    if cls is System:
        rows = [
            [code(VERSION_KEY), cell(VERSION_SAYS), "`1`", "required", code("1")],
            *rows,
            [code(REPEAT_KEY), cell(REPEAT_SAYS), "map: [Repeat](#repeat), or a list of them", "", ""],
        ]
    if title.partition(":")[1]:
        word = title.partition(": ")[2].partition(",")[0]
        rows.insert(0, ["`type`", "which kind it is", cell(title.partition(": ")[2]), "required", code(word)])
    text = paragraphs(inspect.getdoc(cls))
    heads = ("key", "meaning", "takes", "if left out", "example")
    return f"## {title}\n\n{text}\n\n{table(heads, rows)}"


def _row(f: dataclasses.Field[Any]) -> list[str]:
    field, default = f.metadata["field"], default_of(f)
    left_out = "required" if f.default is dataclasses.MISSING else code(_text(default)) if default else ""
    such = f.metadata["such"]
    takes = _linked(cell(kind_of(field).words), kind_of(field).elements)
    unit = unit_of(field)
    takes += f", in {code(unit)}" if unit else ", without a unit" if unit == "" else ""
    return [code(key_of(f.name)), cell(f.metadata["says"]), takes, left_out, code(such)]


def _linked(words: str, elements: Sequence[type[Element]]) -> str:
    """Return words in which elements lead to their sections; a `type` leads to the first of its kinds."""
    places = {cls.__name__: anchor(title) for title, cls in sections()}
    if words.endswith("with a `type`"):
        first = places[elements[0].__name__] if elements else places["Revolute"]
        return words.replace("a `type`", f"[a `type`](#{first})")
    for name in (cls.__name__ for cls in elements):
        words = re.sub(rf"(?<=\s){name}\b", f"[{name}](#{places[name]})", words)
    return words


def _text(tree: Any) -> str:
    if isinstance(tree, list):
        return f"[{', '.join(map(_text, tree))}]"
    return str(tree)


def anchors() -> dict[str, str]:
    """Return the link to the section of each class, by its name."""
    return {cls.__name__: f"../keys.md#{anchor(title)}" for title, cls in sections()}

