"""The rank-revealing solve of A x = r by Householder QR: the reference that `solve.c` repeats.

The text of this file stands in exported Python, and imports NumPy and the standard library only.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from operator import mul
from typing import Final

import numpy as np

from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import CLEAR, TIE, exact, scaled_rows
from multibody_sym.records import dataclass

_FEW: Final = 6
"""Rows up to which lists are quicker than arrays."""


Lists = list[list[float]]
Sparse = list[dict[int, float]]
"""Rows, of each what may differ from zero by its column."""
Found = tuple[list[float], list[float], list[float]]
PLAIN: Final = 2.0
"""Acts, and multipliers are of least norm as they are."""
SHORTEST: Final = 1e-6
"""Part of the longest row's length that scales shorter rows: what rounding has left of a row takes no force."""
_NEARLY_ZERO: Final = 1e-150


@dataclass(frozen=True)
class Solution:
    """What `solve` returns: x (n), multipliers (s), and the report (rank, conditioning, residual)."""

    solution: Floats
    multipliers: Floats
    report: Floats


@dataclass(frozen=True)
class _Factors:
    """Householder vectors and triangular factor of the rows in `order`, the kept ones first, divided by `lengths` (s).

    Row j of `rows` (s x n) holds R[k, j] in entry k < min(j, rank) and, where it was kept, the vector v of reflection j
    from entry j on. Reflection k is E - factors[k] v v^T.
    """

    rows: list[list[float]]
    order: list[int]
    diagonal: list[float]
    factors: list[float]
    lengths: list[float]
    """Those of the rows as they are declared."""

    @property
    def rank(self) -> int:
        return len(self.diagonal)


def solve(
    matrix: Floats,
    right: Floats,
    most: float = math.inf,
    acting: Sequence[float] = (),
    exerted: Sequence[Sequence[float]] = (),
) -> Solution:
    """Return the minimum-norm x with A x = r and the multipliers lambda with x = A^T lambda.

    The rows of A, scaled to unit length, are the columns of A^T = Q R P^T. They are taken as they come where at least
    1e-6 of each is left by those before it. Else the longest remaining column becomes the pivot at each step (ties: the
    row declared first) until none exceeds 100 eps max(n, s) |R_11|. Then x = Q R^-T r and R lambda = R^-T r, over the
    kept rows. Dependent rows take no part: their multipliers are zero, and x is the least
    squares solution as well whenever they agree with the kept ones. No more than `most` rows are kept: rows that depend
    on each other only in positions that satisfy them are independent beside such a position, by rounding. Rows that
    `acting` has a zero for are left out, and have no multipliers. With `exerted` C (s, n) x is C^T lambda: where A C^T
    is regular, or of the rank of A and C, lambda follows from that, else x and lambda are of least norm together,
    lambda times lengths of C, or as it is where `acting` has a 2 (`PLAIN`) for all rows. What is left of rows is then
    measured by their own lengths.

    Arguments: matrix A (s, n), right r (s,). Returns x (n,), lambda (s,) and the report (3,): the rank; the smallest
    part of a kept row that those before it leave, or the shortest of them relative to the longest if that is less (0 if
    there is none), which vanishes with a row, and where one becomes dependent, and hardly jumps where two change places
    in the order; the largest |A x - r| of a dependent row relative to the largest |r|,
    both in rows of unit length (a zero row is as long as the longest). Everything is nan if A or r is not finite.
    Source: Businger, Golub, Linear least squares solutions by Householder transformations, Numer. Math. 7 (1965).
    """
    if len(acting):
        pair = (np.asarray(x).tolist() for x in (matrix, exerted))
        rows, forces = ([{k: x for k, x in enumerate(row) if x != 0.0} for row in each] for each in pair)
        found = solve_some(rows, right.tolist(), matrix.shape[1], most, acting, forces)
    else:
        found = solve_lists(matrix.tolist(), right.tolist(), matrix.shape[1], most)
    return Solution(*(np.array(values, dtype=float) for values in found))


def solve_lists(matrix: Lists, right: list[float], columns: int, most: float) -> Found:
    """Return what `solve` does, solution, multipliers and report, for lists: s rows of `columns` numbers, and s."""
    return _solved(_factors_of(matrix, columns, most), right, columns)


def solve_some(
    matrix: Sparse, right: list[float], columns: int, most: float, acting: Sequence[float], exerted: Sparse
) -> Found:
    """Return what `solve` does for the rows that act, given by what may differ from zero.

    They fall apart into islands: rows of two of them have no column in common. Where these have more rank than there
    should be in all, by rounding, all rows are taken as one, the clearest of them first.
    """
    places = [j for j, acts in enumerate(acting) if acts]
    rows = {j: matrix[j] for j in places}
    forces = {j: exerted[j] for j in places} if exerted else rows
    plain = PLAIN in acting
    islands = _islands(rows, forces)
    limit = most if len(islands) == 1 else math.inf
    parts = [_island(rows, forces, right, *each, limit, plain=plain) for each in islands]
    if len(parts) > 1 and sum(report[0] for *_, report in parts) > most:
        islands = [(places, list(dict.fromkeys(k for j in places for k in (*rows[j], *forces[j]))))]
        parts = [_island(rows, forces, right, *islands[0], most, plain=plain)]
    solution, multipliers = [0.0] * columns, [0.0] * len(right)
    for (own, names), (x, carried, _) in zip(islands, parts, strict=True):
        for j, value in zip(own, carried, strict=True):
            multipliers[j] = value
        for k, value in zip(names, x, strict=True):
            solution[k] = value
    report = _reported(islands, [report for *_, report in parts], rows, right)
    if math.isnan(report[0]):
        return [math.nan] * columns, [math.nan] * len(right), report
    return solution, multipliers, report


def _islands(
    rows: Mapping[int, Mapping[int, float]], forces: Mapping[int, Mapping[int, float]]
) -> list[tuple[list[int], list[int]]]:
    """Return the rows of each island and its columns in the order in which rows first have them."""
    next_to: dict[int, int] = {}

    def end(k: int) -> int:
        while next_to[k] != k:
            k = next_to[k]
        return k

    own = {j: list(dict.fromkeys((*row, *forces[j]))) for j, row in rows.items()}
    for names in own.values():
        for k in names:
            next_to.setdefault(k, k)
            next_to[end(k)] = end(names[0])
    found: dict[int, tuple[list[int], dict[int, None]]] = {}
    for j, names in own.items():
        island = found.setdefault(end(names[0]) if names else -1 - j, ([], {}))
        island[0].append(j)
        island[1].update(dict.fromkeys(names))
    return [(places, list(names)) for places, names in found.values()]


def _island(
    rows: Mapping[int, Mapping[int, float]],
    forces: Mapping[int, Mapping[int, float]],
    right: list[float],
    places: list[int],
    names: list[int],
    most: float,
    *,
    plain: bool,
) -> Found:
    """Return x in the columns of an island, and the multipliers of its rows."""
    own, exerted = ([[row[j].get(k, 0.0) for k in names] for j in places] for row in (rows, forces))
    wanted = [right[j] for j in places]
    if exerted == own and (not plain or forces is rows):
        return solve_lists(own, wanted, len(names), most)
    return _rubbing(own, exerted, wanted, len(names), most, plain=plain)


def _reported(
    islands: Sequence[tuple[list[int], list[int]]],
    reports: Sequence[list[float]],
    rows: Mapping[int, Mapping[int, float]],
    right: list[float],
) -> list[float]:
    """Return the report of all islands."""
    rank = sum(report[0] for report in reports)
    if math.isnan(rank):
        return [math.nan] * 3
    least = min((report[1] for report in reports if report[0]), default=0.0)
    if len(reports) == 1:
        return [rank, least, reports[0][2]]
    largest = [
        max((abs(right[j]) / math.sqrt(_dot(rows[j].values(), rows[j].values())) for j in own if right[j]), default=0.0)
        for own, _ in islands
    ]
    left = max((report[2] * size for report, size in zip(reports, largest, strict=True)), default=0.0)
    return [float(rank), least, left / max(largest) if left else 0.0]


def _factors_of(matrix: Lists, columns: int, most: float) -> _Factors | None:
    """Return the factors of s rows, None where a number is not finite."""
    count = len(matrix)
    factors = _few_in_order(matrix) if 0 < count <= min(_FEW, columns, most) else None
    return factors or _factored(np.array(matrix, dtype=float).reshape(count, columns), most)


def _solved(factors: _Factors | None, right: list[float], columns: int) -> Found:
    if factors is None or not all(map(math.isfinite, right)):
        return [math.nan] * columns, [math.nan] * len(right), [math.nan] * 3
    scaled = [right[j] / factors.lengths[j] for j in factors.order]
    halfway = _forward(factors, scaled)
    multipliers = [0.0] * len(right)
    for j, value in zip(factors.order, _backward(factors, halfway), strict=False):
        multipliers[j] = value / factors.lengths[j]
    return _rotated(factors, halfway, columns), multipliers, _report(factors, scaled, halfway)


def _rubbing(
    matrix: Lists, exerted: Lists, right: list[float], columns: int, most: float, *, plain: bool
) -> Found:
    """Return x = C^T lambda, lambda, A x = r: of least norm together, lambda times lengths, if A C^T is singular."""
    count = len(right)
    lengths = [1.0 if plain else math.sqrt(_dot(row, row)) for row in exerted]
    shortest = max(SHORTEST * max(lengths), _NEARLY_ZERO)
    lengths = [length if length > shortest else shortest for length in lengths]
    unit = [[x / length for x in row] for row, length in zip(exerted, lengths, strict=True)]
    square = [[_dot(a, c) for c in unit] for a in matrix]
    factors = _factors_of(square, count, most)
    carried, _, report = _solved(factors, right, count)
    if factors is not None and _has_rank(factors.rank, matrix, unit, most):
        pairs = zip(factors.diagonal, factors.order, strict=False)  # what is left of rows is measured by the rows of A
        left = (abs(x) * factors.lengths[j] / math.sqrt(_dot(matrix[j], matrix[j])) for x, j in pairs)
        report = [report[0], min(left, default=0.0), report[2]]
    elif report[0] < count:
        upper = [[*row, *[0.0] * count] for row in matrix]
        lower = [[*(float(i == k) for k in range(columns)), *(-c[i] for c in unit)] for i in range(columns)]
        both, _, report = solve_lists(upper + lower, right + [0.0] * columns, columns + count, most + columns)
        carried, report = both[columns:], [report[0] - columns, *report[1:]]
    x = [0.0] * columns
    for z, row in zip(carried, unit, strict=True):
        x = [a + z * b for a, b in zip(x, row, strict=True)]
    return x, [z / length for z, length in zip(carried, lengths, strict=True)], report


def _has_rank(rank: int, matrix: Lists, unit: Lists, most: float) -> bool:
    """Return whether A C^T is regular, or A and C have its rank: then x is unique, and lambda of least norm follows."""
    count, columns = np.shape(matrix)
    if rank == count or count > columns:
        return rank == count
    exerted = np.array(unit)
    forces = _longest_first(*scaled_rows(exerted), exact(exerted), most + 1)
    by_rounding = forces.rank > most and abs(forces.diagonal[-1]) <= CLEAR
    return len(independent_rows(np.array(matrix), most)) == rank == forces.rank - by_rounding


def independent_rows(matrix: Floats, most: float = math.inf) -> list[int]:
    """Return which rows of a finite matrix (s, n) are independent, the longest taken first, in increasing order."""
    factors = _longest_first(*scaled_rows(matrix), exact(matrix), most)
    return sorted(factors.order[: factors.rank])


def _few_in_order(matrix: list[list[float]]) -> _Factors | None:
    """Return what `_in_order` does, None also where a row is small beside others; three times as quickly."""
    largest = [max(map(abs, row)) for row in matrix]
    if not min(largest) > CLEAR * max(largest):
        return None
    units = [[x / size for x in row] for row, size in zip(matrix, largest, strict=True)]
    lengths = [math.sqrt(_dot(row, row)) for row in units]
    left = [[x / length for x in row] for row, length in zip(units, lengths, strict=True)]
    found = _Factors([], list(range(len(left))), [], [], [a * b for a, b in zip(largest, lengths, strict=True)])
    heads: list[list[float]] = [[] for _ in left]
    for k, row in enumerate(left):
        length, first = math.sqrt(_dot(row, row)), row[0]
        if not length > CLEAR:
            return None
        found.diagonal.append(-length if first > 0.0 else length)
        found.factors.append(1.0 / (length * (length + abs(first))))
        vector = [first - found.diagonal[k], *row[1:]]
        found.rows.append([*heads[k], *vector])
        for j in range(k + 1, len(left)):
            by = found.factors[k] * _dot(vector, left[j])
            head, *left[j] = [a - by * b for a, b in zip(left[j], vector, strict=True)]
            heads[j].append(head)
    return found


@np.errstate(all="ignore")
def _factored(matrix: Floats, most: float) -> _Factors | None:
    """Return the factors of any rows, None where a number is not finite."""
    lengths, rows = scaled_rows(matrix)
    if not np.isfinite(lengths).all():
        return None
    factors = _in_order(lengths, rows) if len(rows) <= min(rows.shape[1], most) else None
    return factors or _longest_first(lengths, rows, exact(matrix), most)


def _in_order(lengths: Floats, rows: Floats) -> _Factors | None:
    """Return the factors of the rows as they come, None where one of them might depend on those before it."""
    turned, factors = np.linalg.qr(rows.T, mode="raw")
    diagonal = turned.diagonal().tolist()
    if not all(abs(length) > CLEAR for length in diagonal):
        return None
    np.fill_diagonal(turned, 1.0)
    return _Factors(turned.tolist(), list(range(len(rows))), diagonal, factors.tolist(), lengths.tolist())


def _longest_first(lengths: Floats, rows: Floats, tolerance: float, most: float) -> _Factors:
    rows, order = rows.copy(), list(range(len(rows)))
    diagonal, factors = list[float](), list[float]()
    for k in range(min(rows.shape)):
        rest = rows[k:, k:]
        left = np.sqrt((rest * rest).sum(axis=1)).tolist()
        longest = max(left)
        if longest <= tolerance * (abs(diagonal[0]) if k else longest) or k >= most:
            break
        chosen = next(i for i, length in enumerate(left) if length >= (1.0 - TIE) * longest)
        order.insert(k, order.pop(k + chosen))
        if chosen:
            rows[k : k + chosen + 1] = np.roll(rows[k : k + chosen + 1], 1, axis=0)
        length, first = left[chosen], float(rest[0, 0])
        diagonal.append(-length if first > 0.0 else length)
        factors.append(1.0 / (length * (length + abs(first))))
        rest[0, 0] = first - diagonal[k]
        rest[1:] -= np.multiply.outer(rest[1:] @ rest[0], factors[k] * rest[0])
    return _Factors(rows.tolist(), order, diagonal, factors, lengths.tolist())


def _dot(first: Iterable[float], second: Iterable[float]) -> float:
    """Return the product of as many numbers as the shorter one has."""
    return sum(map(mul, first, second), 0.0)


def _forward(factors: _Factors, right: list[float]) -> list[float]:
    """Solve R^T y = r over the kept rows."""
    y = list[float]()
    for row, value, diagonal in zip(factors.rows, right, factors.diagonal, strict=False):
        y.append((value - _dot(y, row)) / diagonal)
    return y


def _backward(factors: _Factors, y: list[float]) -> list[float]:
    """Solve R lambda = y."""
    rest, multipliers = y, list[float]()
    for k in reversed(range(factors.rank)):
        value = rest[k] / factors.diagonal[k]
        rest = [a - b * value for a, b in zip(rest[:k], factors.rows[k], strict=False)]
        multipliers.append(value)
    return multipliers[::-1]


def _rotated(factors: _Factors, y: list[float], size: int) -> list[float]:
    """Return Q (y, 0)."""
    x = [0.0] * (size - factors.rank)
    for k in reversed(range(factors.rank)):
        x, vector = [y[k], *x], factors.rows[k][k:]
        by = factors.factors[k] * _dot(vector, x)
        x = [a - by * b for a, b in zip(x, vector, strict=True)]
    return x


def _report(factors: _Factors, right: list[float], y: list[float]) -> list[float]:
    """Return the report, for right-hand sides in the order of the factors."""
    rank = factors.rank
    kept = [factors.lengths[j] for j in factors.order[:rank]]
    least = min(*map(abs, factors.diagonal), min(kept) / max(kept)) if rank else 0.0
    largest = max(map(abs, right), default=0.0)
    beside = zip(right[rank:], factors.rows[rank:], strict=True)
    residual = max((abs(value - _dot(y, row)) for value, row in beside), default=0.0)
    return [float(rank), least, residual / largest if largest else 0.0]
