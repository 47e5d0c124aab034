"""Templates: the layout of generated files, read as text."""

from __future__ import annotations

from pathlib import Path
from string import Template
from typing import Final

RUNTIME_SOURCES: Final = (
    *("solve.c", "calls.c", "constraints.c", "events.c", "looks.c", "explicit.c", "stages.c", "implicit.c"),
    *("singular.c", "pairing.c", "multistep.c", "runtime.c", "turns.c"),
)
RUNTIME_HEADERS: Final = ("in_order.h", "pairing.h", "runtime.h", "stages.h", "stepper.h", "turns.h", "vectors.h")
_PACKAGE = Path(__file__).resolve().parents[1]


def runtime_files() -> dict[str, str]:
    """Return the texts of the runtime that is compiled with every model, by file name."""
    return {name: template_text(f"c/{name}") for name in (*RUNTIME_SOURCES, *RUNTIME_HEADERS)}


def template_text(name: str) -> str:
    """Return the file `name` (such as `c/runtime.c`) of the installed templates, or of those of a checkout."""
    folder = _PACKAGE / "templates"
    return ((folder if folder.is_dir() else _PACKAGE.parent / "templates") / name).read_text(encoding="utf-8")


def filled(name: str, **parts: object) -> str:
    """Return the template `name` with its fields replaced by `parts`, which are printed already."""
    return Template(template_text(name)).substitute(parts)
