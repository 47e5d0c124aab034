"""The solve of the C runtime, called on arrays."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence

import numpy as np

from multibody_sym.scalars.least_norm import LeastNormSolution, Span, row_spans

DOUBLES = ctypes.POINTER(ctypes.c_double)
GUARD = 12345.0


class CSpan(ctypes.Structure):
    """mbs_span."""

    _fields_ = tuple((name, ctypes.c_int) for name in ("first", "end", "low", "high"))


class CPattern(ctypes.Structure):
    """mbs_pattern."""

    _fields_ = (("rows", ctypes.c_int), ("columns", ctypes.c_int), ("spans", ctypes.POINTER(CSpan)))


class CRows(ctypes.Structure):
    """mbs_rows."""


CRows._fields_ = (
    ("rows", ctypes.c_int),
    ("columns", ctypes.c_int),
    ("begins", ctypes.POINTER(ctypes.c_int)),
    ("places", ctypes.POINTER(ctypes.c_int)),
    ("joins", ctypes.POINTER(CRows)),
)


def solve_in_c(
    library: ctypes.CDLL,
    matrix: np.ndarray,
    right: np.ndarray,
    most: float = math.inf,
    spans: Sequence[Span] | None = None,
) -> LeastNormSolution:
    """Return what mbs_factorise and mbs_substitute return; no array is written beyond its end."""
    s, n = matrix.shape
    spans = row_spans(matrix.tolist()) if spans is None else spans
    inside = [matrix[k, span.first : span.end] for k, span in enumerate(spans)]
    table = (CSpan * max(1, s))(*[CSpan(x.first, x.end, x.low, x.high) for x in spans])
    pattern = ctypes.byref(CPattern(s, n, table))
    given = [np.concatenate([np.empty(0), *inside]).astype(float), np.array(right, dtype=float)]
    factors, *found = (np.full(size + 1, GUARD) for size in (s * (n + 6) + 3, n, s, 3))
    library.mbs_factorise(pattern, _pointer(given[0]), ctypes.c_double(most), _pointer(factors))
    library.mbs_substitute(pattern, _pointer(factors), _pointer(given[1]), *map(_pointer, found))
    assert all(a[-1] == GUARD for a in (factors, *found))
    return LeastNormSolution(*(a[:-1] for a in found))


class ActingInC:
    """The solve of rows that act in C, with the room that it keeps from call to call, which holds `guard` at first.

    `filled` (rows, columns) says of A, and of C if it is another one, where elements may differ from zero.
    """

    def __init__(self, library: ctypes.CDLL, *filled: np.ndarray, guard: float = GUARD) -> None:
        (s, n), self._library, self._guard = filled[0].shape, library, guard
        self._filled, rubs = filled, len(filled) > 1
        every = np.any(filled, axis=0)
        self._joins = _sparse(every, every)[0]
        self._last = 2 * s + n
        self._spans = (CSpan * (self._last + 1))(*[CSpan(-1, -1, -1, -1)] * (self._last + 1))
        self._kept = np.zeros(3 + 8 * s + n + 2 * sum(int(x.sum()) for x in filled) + 1, dtype=np.intc)
        self._kept[-1] = -1
        room = min(s, 1024 + 4 * n)
        size = 2 + s + room * (2 * n + 16) + 2 * n
        if rubs:
            size += room * (n + 4) + (room + n) * (2 * (room + n) + 8)
        self._factors = np.full(size + 1, guard)

    def __call__(
        self,
        matrix: np.ndarray,
        right: np.ndarray,
        most: float,
        acting: np.ndarray,
        exerted: np.ndarray | None = None,
    ) -> LeastNormSolution:
        """Return what the solves return, as `solve_in_c`; no array is written beyond its end."""
        (s, n), guard = matrix.shape, self._guard
        found = [np.full(size + 1, guard) for size in (n, s, 3)]
        matrices = [np.asarray(x) for x in ([matrix] if exerted is None else [matrix, exerted])]
        pairs = zip(matrices, self._filled, strict=True)
        given = [part for x, filled in pairs for part in _sparse(x, filled, self._joins)]
        flags, wanted = np.array(acting, dtype=float), np.array(right, dtype=float)
        given += [] if exerted is not None else [None, None]
        room = _pointer(self._factors), self._spans, self._kept.ctypes.data_as(ctypes.POINTER(ctypes.c_int))
        self._library.mbs_factorise_acting(*given, _pointer(flags), ctypes.c_double(most), *room)
        self._library.mbs_substitute_acting(given[0], *room, _pointer(wanted), *map(_pointer, found))
        assert all(a[-1] == guard for a in (self._factors, *found))
        assert self._spans[self._last].high == self._kept[-1] == -1
        return LeastNormSolution(*(a[:-1] for a in found))


def solve_some_in_c(
    library: ctypes.CDLL,
    matrix: np.ndarray,
    right: np.ndarray,
    most: float,
    acting: np.ndarray,
    exerted: np.ndarray | None = None,
    guard: float = GUARD,
) -> LeastNormSolution:
    """Return what the solves of rows that act return in new room."""
    filled = [np.asarray(x) != 0.0 for x in (matrix, exerted) if x is not None]
    return ActingInC(library, *filled, guard=guard)(matrix, right, most, acting, exerted)


def _sparse(matrix: np.ndarray, filled: np.ndarray, joins: object = None) -> tuple[object, object]:
    """Return mbs_rows of a matrix and the list of its elements that may differ from zero."""
    s, n = matrix.shape
    places = [np.flatnonzero(row).tolist() for row in filled]
    begins = [0, *np.cumsum([len(each) for each in places]).tolist()]
    flat = [k for each in places for k in each]
    rows = CRows(s, n, (ctypes.c_int * len(begins))(*begins), (ctypes.c_int * max(1, len(flat)))(*flat), joins)
    elements = [float(x) for row, each in zip(matrix, places, strict=True) for x in row[each]]
    return ctypes.pointer(rows), (ctypes.c_double * max(1, len(elements)))(*elements)


def assert_same_bits(found: LeastNormSolution, wanted: LeastNormSolution) -> None:
    """Assert that all numbers are the same, zeros with their signs, nan wherever it stands."""
    for a, b in zip(vars(found).values(), vars(wanted).values(), strict=True):
        np.testing.assert_array_equal(a, b)
        np.testing.assert_array_equal(np.signbit(a[a == 0.0]), np.signbit(b[b == 0.0]))


def _pointer(array: np.ndarray) -> ctypes._Pointer[ctypes.c_double]:
    return array.ctypes.data_as(DOUBLES)
