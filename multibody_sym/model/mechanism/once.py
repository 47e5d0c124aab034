"""What depends on a mechanism alone, found once as long as it lives."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from functools import wraps
from typing import TypeVar

from multibody_sym.model.mechanism.mechanism import Mechanism

Found = TypeVar("Found")


def once(find: Callable[[Mechanism], Found]) -> Callable[[Mechanism], Found]:
    """Return a function that keeps what it finds for each mechanism, by identity; nothing may change what it found."""
    known: dict[int, Found] = {}

    @wraps(find)
    def found(mechanism: Mechanism) -> Found:
        key = id(mechanism)
        if key not in known:
            known[key] = find(mechanism)
            weakref.finalize(mechanism, known.pop, key, None)
        return known[key]

    return found
