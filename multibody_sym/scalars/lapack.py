"""Routines of LAPACK and BLAS from scipy, without `scipy.linalg` around them, which takes 0.12 s to import."""

from __future__ import annotations

import os
import sys
from functools import cache
from importlib import import_module
from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from typing import Any


@cache
def lapack() -> Any:
    """Return what `scipy.linalg.lapack` has its routines from."""
    return _extension("_flapack", "lapack")


@cache
def blas() -> Any:
    """Return what `scipy.linalg.blas` has its routines from."""
    return _extension("_fblas", "blas")


def _extension(name: str, public: str) -> Any:
    """Return an extension module of `scipy.linalg`, or the `public` one where there is none of this name."""
    whole = f"scipy.linalg.{name}"
    if whole not in sys.modules:
        place = os.path.join(os.path.dirname(str(import_module("scipy").__file__)), "linalg")
        spec = PathFinder.find_spec(whole, [place])
        if spec is None or spec.loader is None:
            return import_module(f"scipy.linalg.{public}")
        sys.modules[whole] = module_from_spec(spec)
        spec.loader.exec_module(sys.modules[whole])
    return sys.modules[whole]
