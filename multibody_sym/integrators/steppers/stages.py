"""The linear equations of simplified Newton iteration for the stages of a collocation method, factorised.

Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section IV.8.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from multibody_sym.numerics.arrays import Floats

if TYPE_CHECKING:
    from multibody_sym.integrators.methods.collocation import Scheme


class StageMatrices:
    """The factors of gamma E - h J and of [alpha E - h J, -beta E; beta E, alpha E - h J] for the kept rows."""

    def __init__(self, scheme: Scheme, differential: Floats, jacobian: Floats, h: float) -> None:
        """Factorise; `differential` (n,) is the diagonal of E. Raises ZeroDivisionError where a matrix is singular."""
        self.scheme = scheme
        E, J = np.diag(differential), h * jacobian
        if scheme.gamma > 0.0 or scheme.error is not None:
            self.single = _factors(scheme.filter * E - J)
        if scheme.beta > 0.0:
            diagonal, off = scheme.alpha * E - J, scheme.beta * E
            self.pairs = _factors(np.block([[diagonal, -off], [off, diagonal]]))

    def solved(self, rest: Floats) -> Floats:
        """Return the transformed changes (s, n) for the transformed residuals."""
        parts = []
        if self.scheme.gamma > 0.0:
            parts.append(_substituted(self.single, rest[0]))
        if self.scheme.beta > 0.0:
            parts.append(_substituted(self.pairs, rest[-2:].ravel()))
        return np.concatenate(parts).reshape(rest.shape)

    def filtered(self, right: Floats) -> Floats:
        """Return (filter E - h J)^-1 right (n,)."""
        return _substituted(self.single, right)


_Factors = tuple[Floats, list[int]]


def _factors(matrix: Floats) -> _Factors:
    """Return L U of the matrix with rows exchanged, and which row took each place; raises ZeroDivisionError."""
    a, rows = matrix.copy(), []
    for k in range(len(a)):
        pivot = k + int(np.argmax(np.abs(a[k:, k])))
        rows.append(pivot)
        if pivot != k:
            a[[k, pivot]] = a[[pivot, k]]
        if not abs(a[k, k]) > 0.0:
            raise ZeroDivisionError
        a[k + 1 :, k] = a[k + 1 :, k] / a[k, k]
        a[k + 1 :, k + 1 :] -= a[k + 1 :, k, None] * a[k, k + 1 :]
    return a, rows


def _substituted(factors: _Factors, right: Floats) -> Floats:
    a, rows = factors
    b = right.copy()
    for k, pivot in enumerate(rows):
        b[k], b[pivot] = b[pivot], b[k]
    for k in range(len(b)):
        b[k + 1 :] -= a[k + 1 :, k] * b[k]
    for k in range(len(b) - 1, -1, -1):
        b[k] = b[k] / a[k, k]
        b[:k] -= a[:k, k] * b[k]
    return b
