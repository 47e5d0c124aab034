"""QR with column pivoting: which columns are independent, and the factors to solve with."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import exact


class PivotedQr(NamedTuple):
    """A[:, order] = Q R of A (n x s): Q (n x k), R (k x s), and the rank, so many columns of the order are kept."""

    Q: Floats
    R: Floats
    order: NDArray[np.intp]
    rank: int


def pivoted_qr(matrix: Floats, least: float = 0.0) -> PivotedQr:
    """Return the factors of a matrix whose numbers are exact but for arithmetic.

    A column counts where what those before it leave of it is more than rounding of the longest, or of `least`.
    """
    from scipy.linalg import qr  # scipy takes longer to import than a run that needs none of it

    Q, R, order = qr(matrix, mode="economic", pivoting=True, check_finite=False)
    diagonal = np.abs(R.diagonal())
    largest = max(least, float(diagonal.max(initial=0.0)))
    return PivotedQr(Q, R, order, int((diagonal > exact(matrix) * largest).sum()))
