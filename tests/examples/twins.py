"""The shipped examples: each model file, and the module that declares the same system in Python."""

from __future__ import annotations

import importlib.util
from functools import cache
from pathlib import Path

import multibody_sym as mbs

EXAMPLES = Path(__file__).parents[2] / "examples"
FILES = {path.stem: path for path in sorted(EXAMPLES.rglob("*.yaml"))}
TWINNED = (EXAMPLES, EXAMPLES / "impacts")
TWINS = [name for name, path in FILES.items() if path.parent in TWINNED or path.with_suffix(".py").exists()]
"""Those that stand in Python too: all but problems of the textbook with friction."""


@cache
def from_file(name: str) -> mbs.System:
    """Return the system of a model file."""
    return mbs.load(FILES[name])


def from_python(name: str) -> mbs.System:
    """Return the system of the Python module that stands beside the file."""
    spec = importlib.util.spec_from_file_location(f"example_{name}", FILES[name].with_suffix(".py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    system: mbs.System = module.system
    return system
