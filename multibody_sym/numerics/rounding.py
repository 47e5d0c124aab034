"""What rounding may make of a matrix, and eigenvalues without what rounding alone makes of them.

A part of an eigenvalue is rounding where it is smaller than the change that the matrix's own rounding E can bring: to
first order |y|^T |E| |x| / |y^H x| with the left and right eigenvectors y, x, which no choice of units changes, and no
more than the square root of the rounding where two eigenvalues meet. Errors are first-order bounds: they exceed that
square root where several eigenvalues meet.
Source: G. H. Golub, C. F. Van Loan, Matrix Computations (4th ed. 2013), section 7.2.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.numerics.arrays import EPSILON, Floats

_LARGEST: Final = 1e150
_SAFETY: Final = 8.0


def without_rounding(matrix: Floats, rounding: Floats) -> Floats:
    """Return a matrix with zeros where nothing but rounding stands, none of them negative."""
    return np.where(np.abs(matrix) <= rounding, 0.0, matrix) + 0.0


def least_rounding(matrix: Floats, rounding: Floats) -> Floats:
    """Return `rounding` (m x m), but no less than the last places of the matrix as a whole, in balanced units.

    Elements that cancel to zero at the few states at which rounding was looked at are rounding nevertheless.
    """
    if not matrix.size:
        return rounding
    balanced, scale = _balanced(without_rounding(matrix, rounding))
    size = float(np.linalg.norm(balanced, 2))
    found: Floats = np.maximum(rounding, _SAFETY * EPSILON * size * scale[:, None] / scale[None, :])
    return found


def eigenvalues(matrix: Floats, rounding: Floats) -> tuple[npt.NDArray[np.complex128], Floats]:
    """Return the eigenvalues of a matrix (m x m) known up to `rounding` (m x m, not negative), and their errors.

    Real and imaginary parts that are rounding are zero. Raises FloatingPointError for a matrix past all bounds.
    """
    if not matrix.size:
        return np.zeros(0, dtype=complex), np.zeros(0)
    from scipy.linalg import eig  # scipy takes longer to import than most answers take

    balanced, scale = _balanced(without_rounding(matrix, rounding))
    noise = rounding * scale[None, :] / scale[:, None]
    size = float(np.linalg.norm(balanced, 2))
    values, left, right = eig(balanced, left=True, right=True)
    moved = _first_order(left, right, noise + _SAFETY * EPSILON * size)
    uncertain = np.minimum(moved, np.sqrt(np.linalg.norm(noise + _SAFETY * EPSILON * size, 2) * size))
    real = np.where(np.abs(values.real) <= uncertain, 0.0, values.real)
    imaginary = np.where(np.abs(values.imag) <= uncertain, 0.0, values.imag)
    return real + 1j * imaginary + 0.0, np.minimum(moved, size)


def _balanced(matrix: Floats) -> tuple[Floats, Floats]:
    """Return D^-1 A D of nearly equal rows and columns, and the diagonal of D. Raises FloatingPointError."""
    if not float(np.abs(matrix).max()) < _LARGEST:
        raise FloatingPointError("the matrix holds what is too large to compute with")
    from scipy.linalg import matrix_balance  # as above

    balanced, (scale, _) = matrix_balance(matrix, separate=True, permute=False)
    return balanced, scale


def _first_order(left: Floats, right: Floats, noise: Floats) -> Floats:
    """Return by how much noise moves each eigenvalue to first order, infinity where it has no bound."""
    overlap = np.abs(np.sum(left.conj() * right, axis=0))
    moved = np.einsum("ik,ij,jk->k", np.abs(left), noise, np.abs(right))
    found: Floats = np.divide(moved, overlap, out=np.full_like(moved, np.inf), where=overlap > 0.0)
    return found
