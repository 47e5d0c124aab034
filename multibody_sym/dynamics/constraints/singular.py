"""Regular and singular positions: in a singular one rows depend on each other that are independent beside it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from multibody_sym.dynamics.constraints.closing import Rows, closed_near, moved
from multibody_sym.dynamics.constraints.redundancy import approximate_rank, losing_rank, restricting
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import CLOSED, rank

_NEIGHBOURS: Final = 3
_NEAR: Final = 0.1
_SEED: Final = 7


def generic_rank(rows: Rows, q: Floats) -> tuple[int, int]:
    """Return how many rows are independent at q, and in positions that satisfy them: at q, or around it.

    Rows may depend on each other only where they hold; beside such a position rounding makes all of them independent.
    """
    here = _rank(rows, q)
    around = _beside(rows, q) if here < rows.acting else iter(())
    return here, max(here, *(_rank(rows, near) for near in around), 0)


def _rank(rows: Rows, q: Floats) -> int:
    found = rows.numbers(q)
    if found is not None:
        return rank(found.weighted[list(rows.active)], CLOSED)
    return approximate_rank(_dynamics(rows, q))


def verify_regular(rows: Rows, q: Floats, here: int, generic: int, called: str) -> None:
    """Raise NoSolutionError where the rank of rows at q is less than the generic one, naming those that lose theirs.

    `called`: what the state is called.
    """
    if here == generic:
        return
    beside = max((_dynamics(rows, near) for near in _beside(rows, q)), key=approximate_rank)
    names = losing_rank(_dynamics(rows, q), beside, generic)
    first = next((k for k, row in enumerate(rows.mechanism.rows) if row.name in names), rows.active[0])
    depend, hold = ("depend", "hold") if len(names) > 1 else ("depends", "holds")
    raise NoSolutionError(
        f"{called} is a singular position: {', '.join(names)} {depend} on the other constraints there, or {hold} "
        f"nothing (the rank of the constraints is {here} there and {generic} nearby), and the motion may go on along "
        "more than one way; choose one beside it",
        where=Where(path=rows.mechanism.row_path(first)),
        number="N103",
    )


def _beside(rows: Rows, q: Floats) -> Iterator[Floats]:
    """Yield positions around q that satisfy the rows."""
    rng = np.random.default_rng(_SEED)
    for _ in range(_NEIGHBOURS):
        near = closed_near(rows, moved(rows.mechanism, q, rng.uniform(-_NEAR, _NEAR, len(rows.mechanism.speeds))))
        if near is not None:
            yield near


def _dynamics(rows: Rows, q: Floats) -> TreeDynamics:
    return restricting(composite_body(rows.mechanism, rows.motion(q, np.zeros(len(rows.mechanism.speeds))).state))
