"""Routh's reduction of small motions: momenta of cyclic coordinates are held, and their deviations eliminated.

Of a coordinate c on which nothing depends the row of M x'' + C x' + K x = 0 has no K, and says that its momentum stays:
M_cc x_c' + M_ci x_i' + C_ci x_i = 0. With x_c' from this the other rows are, for the others alone,

    M - M_ic M_cc^-1 M_ci,   C - M_ic M_cc^-1 C_ci - C_ic M_cc^-1 M_ci,   K - C_ic M_cc^-1 C_ci

which are the second derivatives of Routh's function. Source: E. J. Routh, Stability of Motion (1877), on steady motion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from multibody_sym.algebra.quotients import Quotient
from multibody_sym.answers.small_motions.matrices import Matrices, Matrix
from multibody_sym.scalars.node import slot


def with_momenta_held(given: Matrices) -> tuple[Matrices, tuple[int, ...]]:
    """Return the matrices without the cyclic deviations that move, and the places of these."""
    moving = [k for k, place in enumerate(given.places) if not given.known[slot("u", place)].is_zero]
    held = [k for k in moving if _is_cyclic(given, k)]
    found = given
    for k in reversed(held):
        found = _without(found, k)
    return found, tuple(given.places[k] for k in held)


def _is_cyclic(given: Matrices, k: int) -> bool:
    """Return whether nothing depends on a deviation, and no damper acts along it."""
    row, column = given.stiffness[k], [x[k] for x in given.stiffness]
    damped = given.damping[k]
    return all(x.is_zero for x in (*row, *column, *damped)) and not given.mass[k][k].vanishes


def _without(given: Matrices, c: int) -> Matrices:
    M, C, K = given.mass, given.rates, given.stiffness
    others = [k for k in range(len(given.places)) if k != c]

    def changed(entry: Callable[[int, int], Quotient]) -> Matrix:
        return [[entry(i, j) for j in others] for i in others]

    pivot = M[c][c]
    return replace(
        given,
        places=tuple(given.places[k] for k in others),
        mass=changed(lambda i, j: M[i][j] - M[i][c] * M[c][j] / pivot),
        rates=changed(lambda i, j: C[i][j] - (M[i][c] * C[c][j] + C[i][c] * M[c][j]) / pivot),
        stiffness=changed(lambda i, j: K[i][j] - C[i][c] * C[c][j] / pivot),
    )
