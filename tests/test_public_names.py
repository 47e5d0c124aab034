"""The table of public names: what type checkers see is what users get, and each is there."""

from __future__ import annotations

import ast
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import multibody_sym as mbs


def declared() -> dict[str, str]:
    """Return the module of each name that the type checkers' branch imports."""
    tree = ast.parse(Path(mbs.__file__).read_text())
    branch = next(node for node in tree.body if isinstance(node, ast.If))
    imports = [node for node in branch.body if isinstance(node, ast.ImportFrom)]
    assert all(name.asname == name.name for node in imports for name in node.names)
    return {name.name: str(node.module) for node in imports for name in node.names}


def test_type_checkers_see_what_users_get() -> None:
    assert {name: f"multibody_sym.{module}" for name, module in mbs._MODULES.items()} == declared()


@pytest.mark.parametrize("name", mbs.__all__)
def test_every_name_is_there(name: str) -> None:
    assert getattr(mbs, name) is not None
    assert name in dir(mbs)


def test_other_names_are_not() -> None:
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = mbs.simulat


EVERYTHING = """
import importlib, pkgutil
import multibody_sym as mbs

for part in pkgutil.walk_packages(mbs.__path__, "multibody_sym."):
    if not part.name.endswith("__main__"):
        importlib.import_module(part.name)
for name, module in mbs._MODULES.items():
    public, inside = getattr(mbs, name), getattr(importlib.import_module(f"multibody_sym.{module}"), name)
    assert getattr(public, "__wrapped__", public) is inside, name
"""


def test_names_stay_what_they_are_when_every_part_is_imported_first() -> None:
    """A part called `solve` would take the place of the function as soon as anything imports it."""
    subprocess.run([sys.executable, "-c", EVERYTHING], check=True)


def test_no_part_of_the_root_has_a_public_name() -> None:
    parts = {part.name for part in pkgutil.iter_modules(mbs.__path__)}
    assert parts.isdisjoint(mbs.__all__)
