"""The modules of the package, parsed and walked once for all tests that look at what they say."""

from __future__ import annotations

import ast
import gc
from functools import cache
from pathlib import Path
from types import MappingProxyType

import multibody_sym as mbs

PACKAGE = Path(mbs.__file__).parent


@cache
def trees() -> MappingProxyType[str, ast.Module]:
    """Return the modules by their paths in the package. They are no garbage until the end, and not looked at for it."""
    files = {path.relative_to(PACKAGE).as_posix(): path for path in sorted(PACKAGE.rglob("*.py"))}
    found = MappingProxyType({name: ast.parse(path.read_text(encoding="utf-8")) for name, path in files.items()})
    gc.freeze()
    return found


@cache
def nodes() -> MappingProxyType[str, tuple[ast.AST, ...]]:
    """Return all nodes of the modules by their paths in the package."""
    found = MappingProxyType({name: tuple(ast.walk(tree)) for name, tree in trees().items()})
    gc.freeze()
    return found
