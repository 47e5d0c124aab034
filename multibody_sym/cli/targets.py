"""Where results of commands go."""

from __future__ import annotations

import os

from multibody_sym.errors import InputError, Where


def verify_apart(file: str, target: str | None, what: str = "the model itself") -> None:
    """Raise InputError where a result would replace the model file or `what` else, under whatever name."""
    both = target is not None and os.path.isfile(file) and os.path.isfile(target)
    if both and target is not None and os.path.samefile(file, target):
        raise InputError(f"this is {what}; give the result another name", where=Where(file=target), number="O101")
