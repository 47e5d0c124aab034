"""QR with column pivoting: which columns are independent, and the factors to solve with."""

from __future__ import annotations

from functools import cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import exact

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
    from scipy.linalg.lapack import dgeqp3, dorgqr  # scipy takes longer to import than a run that needs none of it

    factors, order, tau, _, _ = dgeqp3(matrix, lwork=_WORK * (matrix.shape[1] + 1))
    count = len(tau)
    Q, _, _ = dorgqr(factors[:, :count], tau, lwork=_WORK * count)
    R = np.where(_upper(factors[:count].shape), factors[:count], 0.0)
    diagonal = np.abs(R.diagonal())
    largest = max(least, float(diagonal.max(initial=0.0)))
    return PivotedQr(Q, R, order - 1, int((diagonal > exact(matrix) * largest).sum()))
