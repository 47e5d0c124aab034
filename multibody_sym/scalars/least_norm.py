"""The rank-revealing solve of A x = r by Householder QR, with the same operations in the same order as `solve.c`.

So both give the same bits. The text of this file stands in exported Python, and imports NumPy and the standard library
only.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from operator import mul
from typing import Final, NamedTuple

import numpy as np

from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats, row_sums
from multibody_sym.scalars.rank import CLEAR, TIE, exact, scaled_rows

Lists = list[list[float]]
Sparse = list[dict[int, float]]
"""Rows, of each what may differ from zero by its column."""
Found = tuple[list[float], list[float], list[float]]
PLAIN: Final = 2.0
"""Acts, and multipliers are of least norm as they are."""
SHORTEST: Final = 1e-6
"""Part of the longest row's length that scales shorter rows: what rounding has left of a row takes no force."""
_FEW: Final = 24
"""Rows up to which lists are quicker than arrays."""
_NEARLY_ZERO: Final = 1e-150
_LARGEST: Final = 1e200
_LEAST: Final = 1e-200
"""Squares of lengths beyond these may have lost digits: such rows are scaled first."""
_ALIKE: Final = 1e-12
"""Of the longest row: lengths below that may be rounding."""


class Span(NamedTuple):
    """One row: its elements from `first` up to `end` may differ from zero, when eliminated those from `low` to `high`.

    The reflection that eliminates row k mixes the columns from k up to its `high`, and so those of every later row that
    reaches into them.
    """

    first: int
    end: int
    low: int
    high: int


@dataclass(frozen=True)
class LeastNormSolution:
    """What `solve` returns: x (n), multipliers (s), and the report (rank, conditioning, residual)."""

    solution: Floats
    multipliers: Floats
    report: Floats


@dataclass
class _Factors:
    """Factors of rows in `order`, the kept ones first: R, and the vector v of each reflection E - f v v^T."""

    order: list[int]
    scale: list[float]
    """What each row was divided by, in the order of the declaration."""
    heads: Lists = field(default_factory=list)
    """R[i, k] of each row k, from i = `lows[k]` on; of rows that are not kept over all that are."""
    lows: list[int] = field(default_factory=list)
    inverse: list[float] = field(default_factory=list)
    """1 / R[k, k]."""
    factors: list[float] = field(default_factory=list)
    vectors: Lists = field(default_factory=list)
    """v from element k on."""
    conditioning: float = 0.0

    @property
    def rank(self) -> int:
        return len(self.inverse)

    def reflect(self, first: float, length: float) -> float:
        """Add a reflection of what is left of a row onto its axis, of this length and first element; return v[k]."""
        whole = length + abs(first)
        self.factors.append(1.0 / (length * whole))
        self.inverse.append(-math.copysign(self.factors[-1] * whole, first))
        return first + math.copysign(length, first)

    def measured(self, squares: list[float], left: list[float]) -> bool:
        """Find the conditioning of rows as they come from their squares and what is left of these.

        Return whether these squares have kept their digits.
        """
        longest, shortest, least = max(squares), min(squares), math.inf
        if not (longest < _LARGEST and shortest > _LEAST and shortest > _ALIKE * _ALIKE * longest):
            return False
        for square, rest in zip(squares, left, strict=True):
            least = rest / square if rest < least * square else least
        self.conditioning = math.sqrt(least if least * longest < shortest else shortest / longest)
        return True


def solve(
    matrix: Floats,
    right: Floats,
    most: float = math.inf,
    acting: Sequence[float] = (),
    exerted: Sequence[Sequence[float]] = (),
) -> LeastNormSolution:
    """Return the minimum-norm x with A x = r and the multipliers lambda with x = A^T lambda.

    The rows of A are the columns of A^T = Q R P^T. They are taken as they come where at least 1e-6 of each is left by
    those before it. Else they are scaled to unit length, and the longest remaining column becomes the pivot at each
    step (ties: the row declared first) until none exceeds 100 eps max(n, s) |R_11|. Then x = Q R^-T r and
    R lambda = R^-T r, over the kept rows. Dependent rows take no part: their multipliers are zero, and x is the least
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
        whole = matrix.tolist()
        found = solve_lists(whole, right.tolist(), matrix.shape[1], most, row_spans(whole))
    return LeastNormSolution(*(np.array(values, dtype=float) for values in found))


def solve_lists(
    matrix: Lists, right: list[float], columns: int, most: float, spans: Sequence[Sequence[int]] = ()
) -> Found:
    """Return what `solve` does, solution, multipliers and report, for lists: s rows of `columns` numbers, and s.

    `spans` (see `Span`) say where rows may differ from zero.
    """
    return _solve_factored(_factorise(matrix, columns, most, spans), right, columns)


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
    report = _join_reports(islands, [report for *_, report in parts], rows, right)
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
        return solve_lists(own, wanted, len(names), most, row_spans(own))
    return _solve_with_friction(own, exerted, wanted, len(names), most, plain=plain)


def _join_reports(
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
    if not any(report[2] for report in reports):
        return [float(rank), least, 0.0]
    lengths = dict[int, float]()
    for places, names in islands:
        for j in places:
            row = [rows[j].get(k, 0.0) for k in names]
            lengths[j] = math.sqrt(_dot(row, row))
    longest = max(lengths.values()) or 1.0
    largest = [max(abs(right[j]) / (lengths[j] or longest) for j in places) for places, _ in islands]
    left = max((report[2] * size for report, size in zip(reports, largest, strict=True)), default=0.0)
    return [float(rank), least, left / max(largest) if left else 0.0]


def row_spans(matrix: Sequence[Sequence[object]]) -> list[Span]:
    """Return the span of each row of a matrix (s x n) of numbers, or of whether they may differ from zero."""
    spans: list[Span] = []
    for j, row in enumerate(matrix):
        used = [k for k, element in enumerate(row) if element]
        first, end = (used[0], used[-1] + 1) if used else (0, 0)
        low = next((k for k, before in enumerate(spans) if before.high > first), j)
        reached = [before.high for before in spans[low:]]
        spans.append(Span(first, end, min(low, first), min(max(end, j + 1, *reached), len(row))))
    return spans


def independent_rows(matrix: Floats, most: float = math.inf) -> list[int]:
    """Return which rows of a finite matrix (s, n) are independent, the longest taken first, in increasing order."""
    factors = _longest_first(matrix, most)
    return sorted(factors.order[: factors.rank])


def _factorise(matrix: Lists, columns: int, most: float, spans: Sequence[Sequence[int]]) -> _Factors | None:
    """Return the factors of s rows, None where a number is not finite."""
    count, found = len(matrix), None
    independent = bool(spans) and count <= min(columns, most)
    if independent and count <= _FEW:
        found = _few_in_order(matrix, spans)
    if found is None:
        array = np.array(matrix, dtype=float).reshape(count, columns)
        if not np.isfinite(array).all():
            return None
        for row, (first, end, *_) in zip(array, spans, strict=False):
            row[:first] = row[end:] = 0.0  # -0.0 before
        found = _many_in_order(array, spans) if independent and count > _FEW else None
    return found or _longest_first(array, most)


def _few_in_order(matrix: Lists, spans: Sequence[Sequence[int]]) -> _Factors | None:
    """Return the factors of the rows as they come, None where one of them might depend on those before it."""
    found = _Factors(list(range(len(matrix))), [1.0] * len(matrix))
    factors, vectors = found.factors, found.vectors
    squares, left = list[float](), list[float]()
    for k, (row, (first, end, low, high)) in enumerate(zip(matrix, spans, strict=True)):
        inside, head = row[first:end], list[float]()
        rest = [*[0.0] * (first - low), *inside, *[0.0] * (high - end)]
        for i in range(low, k):
            _subtract(factors[i] * _dot(vectors[i], rest), vectors[i], rest)
            head.append(rest.pop(0))
        squares.append(_dot(inside, inside))
        left.append(_dot(rest, rest))
        if not left[k] > CLEAR * CLEAR * squares[k]:
            return None
        rest[0] = found.reflect(rest[0], math.sqrt(left[k]))
        vectors.append(rest)
        found.heads.append(head)
        found.lows.append(low)
    return found if found.measured(squares, left) else None


@np.errstate(all="ignore")
def _many_in_order(matrix: Floats, spans: Sequence[Sequence[int]]) -> _Factors | None:
    """Return what `_few_in_order` does, of many rows more quickly: each reflection turns all later rows at once."""
    found = _Factors(list(range(len(matrix))), [1.0] * len(matrix))
    rows, squares, left = matrix.copy(), row_sums(matrix * matrix).tolist(), list[float]()
    found.lows = [low for _, _, low, _ in spans]
    lows = np.array(found.lows)
    for k, (_, _, _, high) in enumerate(spans):
        v = rows[k, k:high]
        left.append(float(row_sums(v[None] * v)[0]))
        if not left[k] > CLEAR * CLEAR * squares[k]:
            return None
        v[0] = found.reflect(float(v[0]), math.sqrt(left[k]))
        later = k + 1 + np.flatnonzero(lows[k + 1 :] <= k)
        rest = rows[later, k:high]
        rows[later, k:high] = rest - np.multiply.outer(found.factors[k] * row_sums(rest * v), v)
    found.heads = [rows[k, low:k].tolist() for k, low in enumerate(found.lows)]
    found.vectors = [rows[k, k:high].tolist() for k, (_, _, _, high) in enumerate(spans)]
    return found if found.measured(squares, left) else None


@np.errstate(all="ignore")
def _longest_first(matrix: Floats, most: float) -> _Factors:
    """Return the factors of the rows of a finite matrix, the longest of what those before it leave first."""
    lengths, rows = scaled_rows(matrix)
    found = _Factors(list(range(len(rows))), lengths.tolist())
    tolerance, first, least = exact(matrix), 0.0, math.inf
    for k in range(min(*rows.shape, math.ceil(min(most, len(rows))))):
        rest = rows[k:, k:]
        left = np.sqrt(row_sums(rest * rest))
        chosen = int(np.argmax(left >= (1.0 - TIE) * left.max()))
        length = float(left[chosen])
        first = first or length
        if not length > tolerance * first:
            break
        found.order.insert(k, found.order.pop(k + chosen))
        if chosen:
            rows[k : k + chosen + 1] = np.roll(rows[k : k + chosen + 1], 1, axis=0)
        least = min(least, length)
        rest[0, 0] = found.reflect(float(rest[0, 0]), length)
        v = rest[0, : np.flatnonzero(rest[0])[-1] + 1]
        by = found.factors[k] * row_sums(rest[1:, : len(v)] * v)
        rest[1:, : len(v)] -= np.multiply.outer(by, v)
    found.lows = [0] * len(rows)
    found.heads = [row[: min(k, found.rank)] for k, row in enumerate(rows.tolist())]
    found.vectors = [rows[k, k:].tolist() for k in range(found.rank)]
    if found.rank:
        kept = [found.scale[j] for j in found.order[: found.rank]]
        found.conditioning = min(least, min(kept) / max(kept))
    return found


def _solve_factored(factors: _Factors | None, right: list[float], columns: int) -> Found:
    """Return x = Q R^-T r, multipliers R^-1 R^-T r and the report."""
    if factors is None or not all(map(math.isfinite, right)):
        return [math.nan] * columns, [math.nan] * len(right), [math.nan] * 3
    scaled = [right[j] / factors.scale[j] for j in factors.order]
    y, missed, multipliers = list[float](), 0.0, [0.0] * len(right)
    for low, head, value, inverse in zip(factors.lows, factors.heads, scaled, factors.inverse, strict=False):
        y.append((value - _dot(head, y[low:])) * inverse)
    rank = len(y)
    for head, value in zip(factors.heads[rank:], scaled[rank:], strict=True):
        missed = max(missed, abs(value - _dot(head, y)))
    rest, x = y.copy(), [0.0] * (columns - rank)
    for k in reversed(range(rank)):
        value, low, j = rest[k] * factors.inverse[k], factors.lows[k], factors.order[k]
        multipliers[j] = value / factors.scale[j]
        rest[low:k] = [a - value * b for a, b in zip(rest[low:k], factors.heads[k], strict=True)]
        x.insert(0, y[k])
        _subtract(factors.factors[k] * _dot(factors.vectors[k], x), factors.vectors[k], x)
    residual = missed / max(map(abs, scaled)) if missed > 0.0 else 0.0
    return x, multipliers, [float(rank), factors.conditioning, residual]


def _solve_with_friction(
    matrix: Lists, exerted: Sequence[Sequence[float]], right: list[float], columns: int, most: float, *, plain: bool
) -> Found:
    """Return x = C^T lambda, lambda, A x = r: of least norm together, lambda times lengths, if A C^T is singular."""
    lengths = [1.0 if plain else math.sqrt(_dot(row, row)) for row in exerted]
    shortest = max(SHORTEST * max(lengths), _NEARLY_ZERO)
    lengths = [length if length > shortest else shortest for length in lengths]
    unit = [[x / length for x in row] for row, length in zip(exerted, lengths, strict=True)]
    found = _alone(matrix, unit, right, columns, most) if len(right) <= columns else None
    carried, report = found or _together(matrix, unit, right, columns, most)
    x = [0.0] * columns
    for z, row in zip(carried, unit, strict=True):
        x = [a + z * b for a, b in zip(x, row, strict=True)]
    return x, [z / length for z, length in zip(carried, lengths, strict=True)], report


def _alone(
    matrix: Lists, unit: Lists, right: list[float], columns: int, most: float
) -> tuple[list[float], list[float]] | None:
    """Return lambda from A C^T lambda = r and the report; None where A C^T has another rank than A and C.

    Else x is unique, and lambda of least norm follows.
    """
    count = len(right)
    square = [[*[_dot(a, c) for c in unit], *[0.0] * (columns - count)] for a in matrix]
    factors = _factorise(square, columns, most, row_spans(square))
    if factors is not None:
        if factors.rank < count and not _same_rank(factors.rank, matrix, unit, most):
            return None
        factors.conditioning = _least_left(factors, matrix)
    carried, _, report = _solve_factored(factors, right, columns)
    return carried[:count], report


def _together(
    matrix: Lists, unit: Lists, right: list[float], columns: int, most: float
) -> tuple[list[float], list[float]]:
    """Return lambda from [A 0; E -C^T] (x, lambda) = (r, 0), of least norm with x, and the report."""
    count = len(right)
    upper = [[*row, *[0.0] * count] for row in matrix]
    lower = [[*(float(i == k) for k in range(columns)), *(-c[i] for c in unit)] for i in range(columns)]
    factors = _factorise(upper + lower, columns + count, most + columns, ())
    both, _, report = _solve_factored(factors, right + [0.0] * columns, columns + count)
    return both[columns:], [report[0] - columns, *report[1:]]


def _same_rank(rank: int, matrix: Lists, unit: Lists, most: float) -> bool:
    """Return whether A and C have this rank, but for rounding beyond `most`."""
    for more, rows in enumerate((matrix, unit)):
        found = _longest_first(np.array(rows), most + more)
        by_rounding = found.rank > most and abs(found.inverse[int(most)]) * CLEAR >= 1.0
        if (most if by_rounding else found.rank) != rank:
            return False
    return True


def _least_left(factors: _Factors, matrix: Lists) -> float:
    """Return the smallest part of a kept row of A that A C^T leaves, beside its other rows."""
    least = math.inf if factors.rank else 0.0
    for j, inverse in zip(factors.order, factors.inverse, strict=False):
        length = math.sqrt(_dot(matrix[j], matrix[j]))
        least = min(least, factors.scale[j] / abs(inverse) / length) if length else least
    return least


def _dot(first: Sequence[float], second: Sequence[float]) -> float:
    """Return the product of as many numbers as the shorter one has, added from left to right."""
    total = 0.0
    for product in map(mul, first, second):
        total += product
    return total


def _subtract(amount: float, vector: list[float], row: list[float]) -> None:
    """Take `amount` times a vector from the row that begins where it does, and is as long or longer."""
    row[: len(vector)] = [a - amount * b for a, b in zip(row, vector, strict=False)]
