"""The rank of a matrix: one rule, and every tolerance with its reason.

Rows count at unit length, so that units have no say, and a row that is rounding beside the longest is none. What is
left of a row by those before it, or a singular value of unit rows, counts where it exceeds a tolerance: which one
depends on how exact the matrix is, and is the caller's only choice.

The text of this file stands in exported Python, and imports NumPy and the standard library only.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from multibody_sym.scalars.arrays import EPSILON, Floats, row_sums
from multibody_sym.scalars.elimination import Elimination, blocks, eliminate

ROUNDING: Final = 2e-14
"""Rows whose numbers are below this part of the longest row's largest one count as zero: a hundred roundings of it."""
TIE: Final = 1e-8
"""Remaining lengths that differ by less than this fraction count as equal; the row declared first is taken: rounding
must not choose among rows that are alike."""
CLEAR: Final = 1e-6
"""Where that part of every row in turn is left by those before it, all are independent beyond doubt: the squares that
lengths are taken from still have four digits beyond rounding."""
CLOSED: Final = 1e-6
"""For rows at positions that Newton's method has closed to rounding: where rows touch (the end of a reach, a stretched
rod) the position is only as exact as the root of that, 1e-8, and H with it, a hundred times below this."""
DRAWN: Final = 1e-8
"""For matrices at drawn positions and parameters, where nothing is small by chance: what vanishes identically is some
thousand roundings, what does not is a few parts in a hundred; this lies in the middle."""
SLOPES: Final = 1e-9
"""For exact derivatives of rows by position and speed at a closed state: sums of more terms than H has."""
FLAT: Final = 1e-8
"""For slopes of forces at rest, found where Newton's method ended: a direction in which they change by less is one in
which nothing is resisted."""
ALIKE: Final = 1e-6
"""For rates of poses by coordinates: directions that move bodies by less than positions are told apart by."""
TYPED: Final = 1e-6
"""For directions that people wrote as decimals: six digits are enough to mean the same."""
GROWING: Final = 1e-4
"""Parts between rounding and this multiply forces by ten thousand and more: no state to compare two routes at."""
ROUNDED: Final = 1e-12
"""Singular values of unit rows below this are rounding of a combination that vanishes."""
SWITCHED: Final = 1e-9
"""For rows where a mode of contacts and ropes ends: as exact as the time at which it does, found to 1e-12 of itself."""
FEW: Final = 24
"""Rows and columns of so many are judged as a whole; of more, blocks that share nothing, and by elimination where it
leaves no doubt, which takes time as the number of elements does."""
BEYOND_DOUBT: Final = 100.0
"""Times the tolerance: a least singular value above that is judged by an estimate of it."""
UNMOVED: Final = 1e-13
"""Part of what a row exerts up to which its H_j is what opposite wrenches round to."""
PIVOT: Final = 10.0 * EPSILON
"""Times the size of M, the part of its own diagonal element below which a pivot of M is what subtractions left."""


def exact(matrix: Floats) -> float:
    """Return the tolerance for numbers that are exact but for arithmetic: 100 eps times the larger dimension."""
    return 100.0 * EPSILON * float(max(matrix.shape))


def scaled_rows(matrix: Floats) -> tuple[Floats, Floats]:
    """Return the lengths of the rows and the rows divided by them, without overflow on the way.

    A row that is zero but for rounding (of numbers like those of the longest row) counts as zero: what is left of it
    has no direction. Its length counts as that of the longest row, or one.
    """
    largest = np.abs(matrix).max(axis=1, initial=0.0)
    longest = float(largest.max(initial=0.0))
    empty = largest <= ROUNDING * longest
    largest[empty] = longest or 1.0
    rows = np.where(empty[:, None], 0.0, matrix / largest[:, None])
    lengths = np.sqrt(row_sums(rows * rows))
    lengths[empty] = 1.0
    return largest * lengths, rows / lengths[:, None]


def worth(matrix: Floats) -> Floats:
    """Return the singular values of the rows at unit length, largest first: what each further direction is worth."""
    return np.asarray(np.linalg.svd(scaled_rows(matrix)[1], compute_uv=False), dtype=float)


def rank(matrix: Floats, tolerance: float) -> int:
    """Return how many rows of a matrix (s x n) are independent."""
    if not matrix.size:
        return 0
    if min(matrix.shape) <= FEW:
        return int((worth(matrix) > tolerance).sum())
    rows = scaled_rows(matrix)[1]
    return sum(_rank_of_block(rows[np.ix_(*block)], tolerance) for block in blocks(rows))


def _rank_of_block(rows: Floats, tolerance: float) -> int:
    wide = rows if len(rows) <= rows.shape[1] else rows.T
    found = eliminate(wide, CLEAR)
    if found is not None and _least_worth_of(found) > BEYOND_DOUBT * tolerance:
        return len(wide)
    return int((np.linalg.svd(rows, compute_uv=False) > tolerance).sum())


def _least_worth_of(found: Elimination) -> float:
    """Return the least singular value of eliminated rows, estimated by inverse iteration."""
    x = np.random.default_rng(len(found.rows)).normal(size=len(found.rows))
    size = 0.0
    for _ in range(4):
        x = found.grown(x / np.linalg.norm(x))
        size = float(np.linalg.norm(x))
    return float(1.0 / np.sqrt(size)) if size > 0.0 else 0.0


def clear_least_norm(matrix: Floats, right: Floats) -> Floats | None:
    """Return the x of least norm with A x = r over rows that do not vanish, where those are many and independent.

    None where they are few, or may depend on each other: what they are is for `solve` to say.
    """
    if min(matrix.shape) <= FEW:
        return None
    lengths, rows = scaled_rows(matrix)
    found = eliminate(rows, CLEAR)
    return None if found is None else found.least_norm(right / lengths)


def without_rounding(jacobian: Floats, exerted: Floats) -> Floats:
    """Return H (s x n) without the rows that move nothing but by rounding of the forces (s) that they exert."""
    vanishing = np.abs(jacobian).max(axis=1, initial=0.0) <= UNMOVED * exerted
    return np.where(vanishing[:, None], 0.0, jacobian)


def null_space(matrix: Floats, tolerance: float) -> Floats:
    """Return an orthonormal basis (n x k) of the x with A x = 0, A as it stands: its columns' units are the caller's.

    Directions count whose singular value is no more than the tolerance times the largest.
    """
    if not matrix.size:
        return np.eye(matrix.shape[1])
    _, sizes, v = np.linalg.svd(matrix)
    return np.asarray(v[int((sizes > tolerance * sizes.max(initial=0.0)).sum()) :].T, dtype=float)


def row_space(matrix: Floats, tolerance: float) -> Floats:
    """Return an orthonormal basis (k x n), in rows, of what the rows of A (s x n) span, A as it stands."""
    if not matrix.size:
        return np.zeros((0, matrix.shape[1]))
    _, sizes, v = np.linalg.svd(matrix, full_matrices=False)
    return np.asarray(v[sizes > tolerance * sizes.max(initial=0.0)], dtype=float)


def determined(matrix: Floats, tolerance: float) -> dict[int, Floats]:
    """Return by place the unknowns that rows (m, n), taken as of length one, could fix, and what of each row it takes.

    Values of less than `tolerance` of the largest count as zero, and so does what rows leave of an unknown.
    """
    lengths = np.linalg.norm(matrix, axis=1)
    left, sizes, right = np.linalg.svd(matrix / np.where(lengths > 0.0, lengths, 1.0)[:, None], full_matrices=False)
    count = int((sizes > tolerance * sizes.max(initial=0.0)).sum())
    kept = right[:count]
    missed = np.linalg.norm(np.eye(matrix.shape[1]) - kept.T @ kept, axis=0)
    places = np.flatnonzero(missed <= tolerance)
    found = left[:, :count] @ (kept[:, places] / sizes[:count, None])
    return dict(zip(places.tolist(), found.T, strict=True))


def least_combination(matrix: Floats, tolerance: float) -> Floats | None:
    """Return the y (s) of length one with the least y^T A, A as it stands; None where the rows are independent."""
    sizes, vectors = np.linalg.svd(matrix.T)[1:]
    if len(sizes) == len(vectors) and sizes[-1] > tolerance * sizes[0]:
        return None
    return np.asarray(vectors[-1], dtype=float)


def idle(matrix: Floats, count: int) -> Floats:
    """Return (k x s), in rows, the combinations y^T A = 0 of unit rows that a rank of `count` leaves."""
    return np.asarray(np.linalg.svd(matrix)[0][:, count:].T, dtype=float)


def last_share(matrix: Floats, count: int) -> tuple[Floats, float]:
    """Return (s) the share of each row in the direction that counts least among `count` that do, and how much it does.

    A singular value: 1 for rows of unit length across each other, 0 for dependent ones. None counts where rows vanish.
    """
    if not count:
        return np.zeros(len(matrix)), 1.0
    shares, sizes, _ = np.linalg.svd(matrix)
    return np.asarray(np.abs(shares[:, count - 1]), dtype=float), float(sizes[count - 1])


def least_directions(matrix: npt.NDArray[Any], count: int) -> npt.NDArray[Any]:
    """Return, in rows, the `count` vectors of length one for which |A v| is least, A as it stands, real or complex."""
    return np.asarray(np.linalg.svd(matrix)[2][-count:].conj())


def least_squares(matrix: Floats, right: Floats, tolerance: float | None = None) -> Floats:
    """Return the x of least norm that misses A x = r least, A as it stands.

    Directions whose singular value is no more than the tolerance (by default rounding) times the largest take no part.
    """
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=tolerance)[0], dtype=float)


def principal_axes(points: Floats) -> tuple[Floats, int]:
    """Return the axes along which points (n, 3) about their middle spread, the longest first, and how many there are.

    What spreads less than TYPED of the longest axis is flat to the eye.
    """
    _, sizes, axes = np.linalg.svd(points)
    return np.asarray(axes, dtype=float), int(np.sum(sizes > TYPED * max(sizes[0], np.finfo(float).tiny)))


def first_columns(matrix: Floats, tolerance: float) -> tuple[npt.NDArray[np.bool_], Floats]:
    """Return which columns of length one (m x n, m >= n) the earlier ones do not give, and the factors (k x n) of all.

    Column j is the sum of these k columns by the factors in its column.
    """
    factor = np.linalg.qr(matrix)[1]
    first = np.abs(np.diag(factor)) > tolerance
    return first, np.linalg.lstsq(factor[:, first], factor, rcond=None)[0]


def leading_columns(matrix: Floats, tolerance: float) -> list[int]:
    """Return as many columns as the matrix (s x n) has rank: the longest first of what those before it leave.

    The matrix stands as it is, and the tolerance is a part of its longest column.
    """
    rest, chosen, first = matrix.copy(), list[int](), 0.0
    for _ in range(min(matrix.shape)):
        lengths = np.linalg.norm(rest, axis=0)
        largest = float(lengths.max(initial=0.0))
        first = first or largest
        if largest <= tolerance * first:
            break
        chosen.append(int(np.argmax(lengths >= (1.0 - TIE) * largest)))
        unit = rest[:, chosen[-1]] / lengths[chosen[-1]]
        rest -= np.outer(unit, unit @ rest)
        rest[:, chosen] = 0.0
    return chosen


def damped_solution(matrix: Floats, right: Floats, damping: float) -> Floats:
    """Return A^T (A A^T + mu E)^-1 r over unit rows, without directions that are worth no more than `DRAWN`."""
    lengths = np.linalg.norm(matrix, axis=1)
    lengths[lengths == 0.0] = 1.0
    rows = matrix / lengths[:, None]
    if min(matrix.shape) > FEW and (found := _damped_many(rows, right / lengths, damping)) is not None:
        return found
    u, sizes, v = np.linalg.svd(rows, full_matrices=False)
    gains = np.where(sizes > DRAWN, sizes / (sizes * sizes + damping + (sizes == 0.0)), 0.0)
    return np.asarray(v.T @ (gains * (u.T @ (right / lengths))), dtype=float)


def _damped_many(rows: Floats, right: Floats, damping: float) -> Floats | None:
    """Return `damped_solution` as the shortest (x, y) with A x + sqrt(mu) y = r; None where rows may be dependent."""
    beside = np.sqrt(damping) * np.diag((rows != 0.0).any(axis=1).astype(float))
    found = eliminate(np.hstack([rows, beside]), np.sqrt(CLEAR))
    return None if found is None else found.least_norm(right)[: rows.shape[1]]


def vanishes(pivot: float, diagonal: float, tolerance: float) -> bool:
    """Return whether a pivot of M = L^T D L is nothing beside its own diagonal element; a nan is."""
    return not pivot > tolerance * diagonal
