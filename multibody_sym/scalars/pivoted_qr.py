"""QR with column pivoting: which columns are independent, and the factors to solve with."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.least_norm import solve
from multibody_sym.scalars.rank import exact, least_squares, scaled_rows


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


# ----------------------------------------------------------------------------------------------------------------------
# QR with column pivoting: which columns are independent, and the factors to solve with.


_WORK: Final = 34
"""Columns of working space for each of the matrix's: those of LAPACK's blocks, and two."""


class PivotedQr(NamedTuple):
    """A[:, order] = Q R of A (n x s): Q (n x k), R (k x s), and the rank, so many columns of the order are kept."""

    Q: Floats
    R: Floats
    order: NDArray[np.intp]
    rank: int


@cache
def _upper(shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return where a matrix is not below its diagonal: numpy's `triu` takes longer than the factors of a small one."""
    found: NDArray[np.bool_] = np.tri(*shape, k=-1) == 0.0
    return found


def pivoted_qr(matrix: Floats, least: float = 0.0) -> PivotedQr:
    """Return the factors of a matrix whose numbers are exact but for arithmetic.

    A column counts where what those before it leave of it is more than rounding of the longest, or of `least`.
    """
    if not matrix.size:
        count = min(matrix.shape)
        nothing = np.zeros((matrix.shape[0], count)), np.zeros((count, matrix.shape[1]))
        return PivotedQr(*nothing, np.arange(matrix.shape[1]), 0)
    factors, order, tau, _, _ = lapack().dgeqp3(matrix, lwork=_WORK * (matrix.shape[1] + 1))
    count = len(tau)
    Q, _, _ = lapack().dorgqr(factors[:, :count], tau, lwork=_WORK * count)
    R = np.where(_upper(factors[:count].shape), factors[:count], 0.0)
    diagonal = np.abs(R.diagonal())
    largest = max(least, float(diagonal.max(initial=0.0)))
    return PivotedQr(Q, R, order - 1, int((diagonal > exact(matrix) * largest).sum()))


# ----------------------------------------------------------------------------------------------------------------------
# Rows that depend on each other: which combinations of a matrix's rows vanish, each in as few rows as can be found.
#
# A combination y with y^T A = 0 of which no row can be missed is a circuit of the rows. Where A x = b is asked for and
# y^T b is not zero, the rows of the circuit contradict each other, and any of them left out the others do not.


NEGLIGIBLE: Final = 1e-8
"""Part of the largest share in a combination below which a row has none."""


@dataclass(frozen=True)
class Dependence:
    """The rank of rows, those `left_over`, and for each of them a circuit (s,) of rows of length one."""

    rank: int
    left_over: tuple[int, ...]
    circuits: tuple[Floats, ...]


def dependence(matrix: Floats) -> Dependence:
    """Return how the rows of a matrix (s x n) depend on each other, judged as `solve` does."""
    _, rows = scaled_rows(matrix)
    # numbers that no row is likely to be perpendicular to: drawn, as any pattern meets masses that fit it
    generic = np.random.default_rng(20).normal(size=matrix.shape[1])
    kept = solve(matrix, matrix @ generic).multipliers != 0.0
    left_over: list[int] = np.flatnonzero(~kept).tolist()
    # the combinations that make each row left over vanish with those kept, its own share 1
    combinations = np.zeros((len(left_over), len(rows)))
    combinations[:, kept] = -least_squares(rows[kept].T, rows[~kept].T).T
    combinations[:, ~kept] = np.eye(len(combinations))
    circuits = _sparser([_clean(combination) for combination in combinations], left_over)
    return Dependence(int(kept.sum()), tuple(left_over), tuple(circuits))


def support(combination: Floats) -> tuple[int, ...]:
    """Return the rows that have a share in a combination."""
    return tuple(np.flatnonzero(combination).tolist())


def contradiction(matrix: Floats, wanted: Floats, allowed: float) -> tuple[int, ...]:
    """Return the fewest rows found of which A x = b asks what cannot be: circuits with |y^T b| > `allowed` |y|_1.

    Arguments: matrix A (s, n), wanted b (s,), both divided by the lengths of the rows. No rows where nothing
    contradicts.
    """
    lengths, _ = scaled_rows(matrix)
    found = [
        support(circuit)
        for circuit in dependence(matrix).circuits
        if abs(float(circuit @ (wanted / lengths))) > allowed * float(np.abs(circuit).sum())
    ]
    return min(found, key=len, default=())


def _clean(combination: Floats) -> Floats:
    """Return a combination of largest share 1 without what is rounding."""
    unit: Floats = combination / np.abs(combination).max()
    return np.where(np.abs(unit) > NEGLIGIBLE, unit, 0.0)


def _sparser(circuits: Sequence[Floats], own: Sequence[int]) -> list[Floats]:
    """Return circuits in fewer rows: what each shares with another is eliminated as long as its own row remains."""
    found = list(circuits)
    larger = [i for i, circuit in enumerate(found) if len(support(circuit)) > 2]
    while any(_made_sparser(found, i, j, own[i]) for i in larger for j in range(len(found)) if j != i):
        pass
    return found


def _made_sparser(circuits: list[Floats], i: int, j: int, row: int) -> bool:
    """Put circuit i less some of circuit j in its place if that has fewer rows, `row` among them."""
    one, other = circuits[i], circuits[j]
    for k in np.flatnonzero((one != 0.0) & (other != 0.0)):
        trial = _clean(one - one[k] / other[k] * other)
        if trial[row] != 0.0 and np.count_nonzero(trial) < np.count_nonzero(one):
            circuits[i] = trial
            return True
    return False
