"""The version of the installed package."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from typing import Final


def _installed() -> str:
    try:
        return version("multibody-sym")
    except PackageNotFoundError:
        return "not installed"


__version__: Final = _installed()
