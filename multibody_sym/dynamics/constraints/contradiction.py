"""Contradicting constraints: the fewest rows that cannot hold together, and whether positions, speeds or accelerations
tell.

    H dq = -phi        H u = -phi_t        H udot = gamma

have no solution where a combination y of rows vanishes, y^T H = 0, and that of the right sides does not. Where rows
depend on each other at one position only, a loop is at the end of its reach, and no contradiction.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final

import numpy as np

from multibody_sym.dynamics.constraints.closing import Rows, least_missed, moved
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.rows import DistanceRow
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.dependence import contradiction
from multibody_sym.numerics.rank import CLOSED, rank
from multibody_sym.records import dataclass

_ALLOWED: Final = 1e-8
_ALLOWED_POSITION: Final = 1e-11
_BESIDE: Final = 0.01
_SEED: Final = 5


@dataclass(frozen=True)
class Contradiction:
    """Positions of rows that cannot hold together, and what of the motion does not exist on their account.

    `off`: by how much the last row is missed where all are missed least.
    """

    rows: tuple[int, ...]
    missing: str
    off: float = 0.0

    def error(self, mechanism: Mechanism, when: str) -> NoSolutionError:
        """Return the error that names the rows."""
        return NoSolutionError(self.message(mechanism, when), where=Where(path=mechanism.row_path(self.rows[-1])))

    def message(self, mechanism: Mechanism, when: str) -> str:
        """Return which rows contradict each other and what to do."""
        names = [mechanism.rows[k].name for k in self.rows]
        if len(names) == 1:
            off = ""
            if isinstance(mechanism.rows[self.rows[0]], DistanceRow) and self.missing == "positions":
                off = f": its ends are {abs(self.off):.6g} m too {'near' if self.off > 0.0 else 'far apart'}"
            return f"constraint {names[0]} asks {when} for what nothing can move{off}; correct it, or leave it out"
        listed = f"{', '.join(names[:-1])} and {names[-1]}"
        return (
            f"constraints contradict each other {when}: no {self.missing} satisfy {listed} together, though they do "
            "without any one of them; correct one, or leave it out"
        )


def contradiction_of(rows: Rows, q: Floats, u: Floats, rank: int | None = None) -> Contradiction | None:
    """Return the rows that contradict each other near a state, on the first level where some do.

    `rank`: that of the rows in positions that satisfy them, None where no such position is known.
    """
    closest = least_missed(rows.holonomic(), q)
    if closest is None:
        return None
    moving = rows.of(rows.motion(closest, u))
    jacobian = rows.jacobian(moving)
    if rank is not None and _rank(jacobian) < rank:
        return None
    levels = {
        "positions": (np.array([row.phi if row.holonomic else 0.0 for row in moving]), _ALLOWED_POSITION),
        "speeds": (jacobian @ u - np.array([row.phidot for row in moving]), _ALLOWED),
        "accelerations": (np.array([row.gamma for row in moving]), _ALLOWED),
    }
    for missing, (wanted, allowed) in levels.items():
        size = max(1.0, float(np.square(u).max(initial=0.0)), float(np.abs(wanted).max(initial=0.0)))
        found = contradiction(jacobian, wanted.astype(float), allowed * size)
        if found and (rank is not None or _lasts(rows, closest, jacobian, found)):
            return Contradiction(tuple(rows.active[k] for k in found), missing, float(wanted[found[-1]]))
    return None


@contextmanager
def contradictions_named(rows: Rows, q: Floats, u: Floats) -> Iterator[None]:
    """Raise NoSolutionError with the names of contradicting rows in place of one that they bring about."""
    try:
        yield
    except NoSolutionError:
        found = contradiction_of(rows, q, u)
        if found is None:
            raise
        raise found.error(rows.mechanism, "at the start") from None


def verify_consistent(rows: Rows, q: Floats, u: Floats, rank: int) -> None:
    """Raise NoSolutionError where no accelerations satisfy rows of a rank in a state that satisfies them."""
    found = contradiction_of(rows, q, u, rank) if rank < rows.acting else None
    if found is not None:
        raise found.error(rows.mechanism, "at the start")


def _rank(jacobian: Floats) -> int:
    return rank(jacobian, CLOSED)


def _lasts(rows: Rows, q: Floats, jacobian: Floats, circuit: Sequence[int]) -> bool:
    """Return whether rows that depend on each other at a position do beside it, or no more rows are independent there.

    Rows do neither at the end of a reach. Rows that are each in the way of others may do one of both only.
    """
    change = np.random.default_rng(_SEED).uniform(-_BESIDE, _BESIDE, len(rows.mechanism.speeds))
    near = rows.motion(moved(rows.mechanism, q, change), np.zeros(len(change)))
    beside = rows.jacobian(rows.of(near))
    return _rank(beside[list(circuit)]) < len(circuit) or _rank(beside) <= _rank(jacobian)
