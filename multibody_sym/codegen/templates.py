"""Templates: the layout of generated files, read as text."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from string import Template
from typing import Final

_ALWAYS: Final = ("calls.c", "constraints.c", "explicit.c", "runtime.c")
_PARTS: Final = {
    "rows": (("solve.c", "singular.c"), "no_rows.c"),
    "events": (("events.c", "looks.c", "turns.c"), "no_events.c"),
    "implicit": (("stages.c", "implicit.c"), "no_implicit.c"),
    "multistep": (("pairing.c", "multistep.c"), "no_multistep.c"),
}
"""What only some models enter: its sources, and the one in their place for the others, which compile sooner."""
RUNTIME_PARTS: Final = frozenset(_PARTS)
RUNTIME_SOURCES: Final = (*_ALWAYS, *(name for sources, _ in _PARTS.values() for name in sources))
STAND_INS: Final = tuple(stand_in for _, stand_in in _PARTS.values())
RUNTIME_HEADERS: Final = ("in_order.h", "pairing.h", "runtime.h", "stages.h", "stepper.h", "turns.h", "vectors.h")
_PACKAGE = Path(__file__).resolve().parents[1]


def runtime_files(parts: Collection[str] = RUNTIME_PARTS) -> dict[str, str]:
    """Return the texts of the runtime that is compiled with models that enter these parts of it, by file name."""
    return {name: template_text(f"c/{name}") for name in (*runtime_sources(parts), *RUNTIME_HEADERS)}


def stand_in_files() -> dict[str, str]:
    """Return the texts of what is compiled in the place of parts of the runtime, by file name."""
    return {name: template_text(f"c/{name}") for name in STAND_INS}


def runtime_sources(parts: Collection[str]) -> tuple[str, ...]:
    """Return the names of the sources for models that enter these parts."""
    chosen = (sources if part in parts else (stand_in,) for part, (sources, stand_in) in _PARTS.items())
    return (*_ALWAYS, *(name for sources in chosen for name in sources))


def template_text(name: str) -> str:
    """Return the file `name` (such as `c/runtime.c`) of the installed templates, or of those of a checkout."""
    folder = _PACKAGE / "templates"
    return ((folder if folder.is_dir() else _PACKAGE.parent / "templates") / name).read_text(encoding="utf-8")


def filled(name: str, **parts: object) -> str:
    """Return the template `name` with its fields replaced by `parts`, which are printed already."""
    return Template(template_text(name)).substitute(parts)
