"""What impulses at one contact do when all that holds both ways follows them: projected columns, not M's inverse.

With A_E^T = Q R of the rows that hold both ways the columns of the contact are B = (E - Q Q^T) C^T, its speeds change
by K = B^T B, and 1/K_nn is its apparent mass. Rows of Q R that depend on others take no impulse.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from multibody_sym.dynamics.impacts.account import Chosen, NoImpulsesError
from multibody_sym.dynamics.laws.problem import Equality, Friction, LawProblem
from multibody_sym.dynamics.laws.reduction import reduced
from multibody_sym.dynamics.laws.scaled import scaled
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.pivoted_qr import pivoted_qr
from multibody_sym.numerics.rank import DRAWN, ROUNDED, idle, rank, scaled_rows
from multibody_sym.records import dataclass


@dataclass(frozen=True)
class Moved:
    """x = X f, z = Z f and v = K f for impulses f (k) at the rows `own` of a problem of m rows: normal, tangents."""

    own: list[int]
    X: Floats
    Z: Floats
    K: Floats


def moved_by(some: Chosen, own: list[int]) -> Moved:
    """Return what impulses at some rows of a chosen problem do; no other row that holds one way has any.

    Each row of friction is to be among them, as nothing that rubs follows.
    """
    equal = [k for k, law in enumerate(some.problem.laws) if isinstance(law, Equality)]
    problem = some.problem
    ordinary = not problem.coupling.any() and np.array_equal(problem.exerted[equal], problem.matrix[equal])
    return _ordinary(some, own, equal) if ordinary else _general(some, own)


def verify_moves(some: Chosen, row: int, name: str) -> None:
    """Raise NoImpulsesError where constraints and prescribed motions alone determine the speed of a unilateral row.

    Its row is then a combination of theirs. Rows that define an impulse determine no speed.
    """
    problem = some.problem
    defining = np.abs(problem.coupling).sum(axis=1) > 0.0
    kept = [k for k, law in enumerate(problem.laws) if isinstance(law, Equality) and not defining[k]]
    rows = scaled_rows(problem.matrix[[*kept, row]])[1]  # what is rounding beside the row that is struck holds nothing
    if rank(rows, ROUNDED) > rank(rows[:-1], ROUNDED):
        return
    message = (
        f"{name} closes, but constraints and prescribed motions alone determine its speed: no impulse stops it "
        "(end the run before, or let a force drive what a motion drives)"
    )
    raise NoImpulsesError(message, number="N108")


def struck_at(some: Chosen, row: int) -> Moved:
    """Return what impulses at a unilateral row of a chosen problem, and at its friction, do."""
    return moved_by(some, [row, *(k for k, law in enumerate(some.problem.laws) if isinstance(law, Friction))])


def _ordinary(some: Chosen, own: list[int], equal: list[int]) -> Moved:
    problem = some.problem
    lengths, unit = scaled_rows(problem.matrix[equal]) if equal else (np.zeros(0), problem.matrix[equal])
    pushes = problem.exerted[own].T
    Z = np.zeros((len(problem.laws), len(own)))
    Z[own, np.arange(len(own))] = 1.0
    X = pushes.copy()
    if equal:
        Q, R, order, rank = pivoted_qr(unit.T, least=1.0)
        Q, kept = Q[:, :rank], order[:rank]
        for _ in range(2):  # what is left of a column is at right angles to Q only after a second pass
            X -= Q @ (Q.T @ X)
        Z[np.array(equal)[kept]] = -np.linalg.solve(R[:rank, :rank], Q.T @ pushes) / lengths[kept, None]
    alike = np.array_equal(problem.exerted[own], problem.matrix[own])
    return Moved(own, X, Z, X.T @ X if alike else problem.matrix[own] @ X)


def _general(some: Chosen, own: list[int]) -> Moved:
    """Return the same where rows exert other forces than their own, or define a joint's impulse."""
    system = scaled(replace(some.problem, right=np.zeros(len(some.problem.right))))
    small = reduced(system)
    sizes = system.sizes[small.own]
    place = small.place[own]
    K = system.lengths[own, None] * (small.K[own] * sizes)
    return Moved(own, (small.X * sizes)[:, place], (small.Z * sizes / system.sizes[:, None])[:, place], K[:, place])


def dependent(problem: LawProblem) -> list[int]:
    """Return the rows that hold both ways and have a part in a combination of them that exerts nothing."""
    equal = [k for k, law in enumerate(problem.laws) if isinstance(law, Equality) and problem.exerted[k].any()]
    unit = scaled_rows(problem.exerted[equal])[1]
    if not equal or (count := pivoted_qr(unit.T, least=1.0).rank) == len(equal):
        return []
    shares = np.abs(idle(unit, count)).max(axis=0)
    return [k for k, share in zip(equal, shares, strict=True) if share > DRAWN]
