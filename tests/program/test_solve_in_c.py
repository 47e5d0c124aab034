"""The solve in C has the bits of that in Python, and what defines the solution, on all kinds of matrices."""

import ctypes
import math
import os

import numpy as np
import pytest
from c_solve import ActingInC, assert_same_bits, solve_in_c, solve_some_in_c
from hand_models import OSCILLATOR
from hypothesis import example, given, settings
from hypothesis import strategies as st

from multibody_sym.program.statements import Rows, column_order
from multibody_sym.scalars.least_norm import LeastNormSolution, row_spans, solve
from multibody_sym.scalars.node import ZERO, as_node


@pytest.fixture(scope="module")
def in_c():
    library = ctypes.CDLL(str(OSCILLATOR.load().path))

    def call(matrix, right, most=math.inf, spans=None):
        found = solve_in_c(library, np.asarray(matrix), right, most, spans)
        return found.solution, found.multipliers, found.report

    return call


def rows_of(draw, s, n, rank, spread):
    """Return a matrix of the given rank whose rows have lengths over many orders of magnitude."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    matrix = rng.standard_normal((s, rank)) @ rng.standard_normal((rank, n)) if rank else np.zeros((s, n))
    return matrix * 10.0 ** rng.uniform(-spread, spread, size=(s, 1)), rng


@st.composite
def problems(draw):
    s, n = draw(st.integers(1, 9)), draw(st.integers(1, 9))
    rank = draw(st.integers(0, min(s, n)))
    matrix, rng = rows_of(draw, s, n, rank, draw(st.sampled_from([0.0, 1.0, 6.0])))
    made = rng.standard_normal(n) if draw(st.booleans()) else None
    return matrix, rng.standard_normal(s) if made is None else matrix @ made, rank, made


def rounding(made):
    """Return how far r = A z may be from consistent in rows of unit length: |r| may be far less than what it sums."""
    return len(made) * np.finfo(float).eps * float(np.linalg.norm(made))


def nearly_across():
    """Return equal rows and a z that is across them but for a part in 1e9: all that is left of A z is rounding's."""
    row = np.array([1.0, -0.7, 0.3, 0.9])
    made = np.array([0.2, 1.1, -0.4, 0.8])
    made += (1e-9 - float(row @ made)) / float(row @ row) * row
    matrix = np.outer([1.0, 0.137, -3.3, 7.1, 0.9], row)
    return matrix, matrix @ made, 1, made


@settings(max_examples=400, deadline=None)
@given(problem=problems())
@example(problem=nearly_across())
def test_c_and_python_have_the_same_bits(problem, in_c):
    matrix, right, rank, made = problem
    found = in_c(matrix, right)
    assert_same_bits(LeastNormSolution(*found), solve(matrix, right))
    assert found[2][0] == rank
    if made is not None:
        lengths, blurred = np.linalg.norm(matrix, axis=1), 1e-13 * len(right) / max(found[2][1], 1e-12) ** 2
        largest = np.abs(right / np.where(lengths, lengths, 1.0)).max()
        assert found[2][2] * largest <= blurred * largest + rounding(made) / max(found[2][1], 1e-12) ** 2


@pytest.mark.parametrize("rank", [40, 25])
@pytest.mark.parametrize("filled", [0.1, 1.0])
def test_many_rows_have_the_same_bits(rank, filled, in_c):
    rng = np.random.default_rng(rank)
    matrix = np.where(rng.random((40, 50)) < filled, rng.standard_normal((40, 50)), -0.0)
    matrix[rank:] = matrix[: 40 - rank] - matrix[1 : 41 - rank]
    right = rng.standard_normal(40)
    found = LeastNormSolution(*in_c(matrix, right))
    assert_same_bits(found, solve(matrix, right))
    assert found.report[0] == rank


@settings(max_examples=200, deadline=None)
@given(problem=problems())
@example(problem=nearly_across())
def test_the_solution_has_least_norm_and_comes_from_the_multipliers(problem, in_c):
    matrix, right, _, made = problem
    x, multipliers, report = in_c(matrix, right)
    stiff = 1.0 / max(report[1], 1e-12) ** 2
    blurred = 1e-12 * stiff
    np.testing.assert_allclose(matrix.T @ multipliers, x, rtol=0, atol=blurred * max(np.abs(x).max(), 1e-300))
    assert np.count_nonzero(multipliers) <= report[0]
    if made is not None:
        lengths = np.linalg.norm(matrix, axis=1)
        scaled = matrix / np.where(lengths, lengths, 1.0)[:, None]
        least = np.linalg.pinv(scaled, rcond=1e-10) @ (right / np.where(lengths, lengths, 1.0))
        allowed = blurred * np.abs(least).max() + rounding(made) * stiff
        np.testing.assert_allclose(x, least, rtol=0, atol=max(allowed, 1e-300))


def test_of_equal_rows_the_first_declared_is_kept(in_c):
    matrix = np.array([[0.6, 0.8, 0.0], [6.0, 8.0, 0.0], [0.0, 0.0, 2.0], [3e-6, 4e-6, 0.0]])
    x, multipliers, report = in_c(matrix, matrix @ [1.0, 1.0, 1.0])
    assert report[0] == 2
    np.testing.assert_allclose(multipliers, [1.4, 0.0, 0.5, 0.0], atol=1e-15)
    np.testing.assert_allclose(x, [0.84, 1.12, 1.0], rtol=1e-15)


def test_contradicting_rows_show_in_the_residual(in_c):
    x, _, report = in_c(np.array([[1.0, 0.0], [2.0, 0.0]]), [1.0, 4.0])
    assert (x[0], report[0], report[2]) == (1.0, 1.0, 0.5)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_not_finite_gives_nan_everywhere(in_c, bad):
    for matrix, right in (([[1.0, bad]], [1.0]), ([[1.0, 1.0]], [bad])):
        assert all(np.isnan(part).all() for part in in_c(np.array(matrix), right))


def test_zero_rows_have_rank_zero(in_c):
    x, multipliers, report = in_c(np.zeros((2, 3)), [0.0, 0.0])
    assert not x.any()
    assert not multipliers.any()
    np.testing.assert_array_equal(report, 0.0)


@pytest.mark.parametrize("scale", [1e-200, 1e200])
def test_extreme_lengths_do_not_overflow(in_c, scale):
    x, _, report = in_c(scale * np.array([[1.0, 1.0], [1e-12, -1e-12]]), [2 * scale, 0.0])
    np.testing.assert_allclose(x, 1.0)
    assert report[0] == 2


def test_no_more_rows_are_kept_than_asked_for(in_c):
    matrix, right = np.array([[1.0, 0.0, 0.0], [1.0, 1e-7, 0.0], [0.0, 0.0, 2.0]]), [1.0, 1.5, 3.0]
    x, multipliers, report = in_c(matrix, right, 2)
    reference = solve(matrix, np.array(right), 2)
    np.testing.assert_allclose(x, [1.0, 0.0, 1.5], atol=1e-15)
    np.testing.assert_allclose(x, reference.solution, atol=1e-15)
    assert report[0] == reference.report[0] == 2
    assert multipliers[1] == 0.0


def test_a_row_of_rounding_has_no_direction(in_c):
    x, multipliers, report = in_c(np.array([[1.0, 2.0, 0.0], [3e-17, -1e-17, 2e-17]]), [5.0, 1e-17])
    np.testing.assert_allclose(x, [1.0, 2.0, 0.0], rtol=1e-14)
    assert report[0] == 1
    assert multipliers[1] == 0.0


@settings(max_examples=300, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.sampled_from([0.2, 0.4, 0.8]), st.booleans())
def test_what_is_zero_by_structure_may_be_left_out(in_c, seed, size, filled, twice):
    """Rows with few elements, in columns that are put in order: as if all zeros were there, dependent rows or not."""
    rng = np.random.default_rng(seed)
    rows = int(rng.integers(1, size + 1))
    matrix = np.where(rng.random((rows, size)) < filled, rng.standard_normal((rows, size)), 0.0)
    if twice:
        matrix[-1] = -3.0 * matrix[0]
    right = matrix @ rng.standard_normal(size)
    nodes = [[as_node(float(x)) for x in row] for row in matrix]
    order = column_order(Rows.of(nodes).columns, size)
    spans = row_spans([[row[k] is not ZERO for k in order] for row in nodes])
    x, multipliers, report = in_c(matrix[:, order], right, spans=spans)
    wanted = solve(matrix, right)
    assert report[0] == wanted.report[0]
    blurred = 1e-13 / max(report[1], 1e-12) ** 2
    np.testing.assert_allclose(x, wanted.solution[order], rtol=0, atol=blurred)
    np.testing.assert_allclose(multipliers, wanted.multipliers, rtol=0, atol=blurred * (1 + abs(multipliers).max()))
    assert report[1] == pytest.approx(wanted.report[1], rel=1e-8)
    assert_same_bits(LeastNormSolution(x, multipliers, report), solve(matrix[:, order], right))


@pytest.mark.parametrize("rubs", [False, True])
def test_what_is_kept_of_rows_that_act_changes_no_bit(rubs):
    """Numbers change from call to call, some to zero, at times the rows that act too, and the greatest rank."""
    library, rng = ctypes.CDLL(str(OSCILLATOR.load().path)), np.random.default_rng(rubs)
    for _ in range(8):
        s, n = int(rng.integers(2, 17)), int(rng.integers(2, 17))
        filled = [rng.random((s, n)) < rng.choice([0.15, 0.3, 0.6])] * (1 + rubs)
        kept, acting = ActingInC(library, *filled), np.ones(s)
        for _ in range(12):
            matrix = np.where(filled[0] & (rng.random((s, n)) < 0.9), rng.standard_normal((s, n)), 0.0)
            exerted = np.where(filled[0], matrix + 0.3 * rng.standard_normal((s, n)), 0.0) if rubs else None
            if rng.random() < 0.4:
                acting = np.array(rng.random(s) < 0.7, dtype=float)
            rank = int(np.linalg.matrix_rank(matrix[acting != 0.0])) if acting.any() else 0
            given = matrix, rng.standard_normal(s), rank - int(rng.random() < 0.2 and rank > 1), acting, exerted
            assert_same_bits(kept(*given), ActingInC(library, *filled)(*given))


@pytest.mark.parametrize("seed", range(160))
def test_rows_that_act_and_what_they_exert(seed):
    """To the bit as in Python, and that against what defines the solution: A x = r, x = C^T lambda, of least norm."""
    library = ctypes.CDLL(str(OSCILLATOR.load().path))
    rng = np.random.default_rng(seed)
    s, n = int(rng.integers(1, 7)), int(rng.integers(2, 7))
    matrix = rng.standard_normal((s, n)) * 10.0 ** rng.uniform(-2, 2, (s, 1))
    if seed >= 60:  # rows of few bodies, of which spans are found as they are gathered
        s, n = int(rng.integers(2, 17)), int(rng.integers(2, 17))
        filled = rng.random((s, n)) < rng.choice([0.15, 0.3, 0.6])
        matrix = np.where(filled, rng.standard_normal((s, n)), 0.0)
    if seed % 3 == 0 and s > 2:
        matrix[1] = 2.0 * matrix[0]
    acting = np.array(rng.random(s) < 0.7, dtype=float)
    rubbing = None if seed % 2 else matrix + 0.3 * rng.standard_normal((s, n)) * (rng.random((s, 1)) < 0.5)
    right = matrix @ rng.standard_normal(n)
    places = np.flatnonzero(acting)
    independent = int(np.linalg.matrix_rank(matrix[places])) if len(places) else 0
    forces = () if rubbing is None else rubbing.tolist()
    wanted = solve(matrix, right, independent, acting.tolist(), forces)
    found = solve_some_in_c(library, matrix, right, independent, acting, rubbing)
    assert_same_bits(found, wanted)
    size = max(1.0, float(np.abs(wanted.solution).max()), float(np.abs(wanted.multipliers).max()))
    C = matrix if rubbing is None else rubbing
    assert not wanted.multipliers[acting == 0.0].any()
    assert C.T @ wanted.multipliers == pytest.approx(wanted.solution, abs=1e-9 * size)
    if independent == len(places) and wanted.report[1] > 1e-3:
        assert matrix[places] @ wanted.solution == pytest.approx(right[places], abs=1e-8 * size * np.abs(matrix).max())


@pytest.mark.parametrize("seed", range(20))
def test_rows_that_depend_on_each_other_and_exert_what_does_so_too(seed):
    """x is unique, multipliers are of least norm: against the system of both, which NumPy's least squares answers."""
    library = ctypes.CDLL(str(OSCILLATOR.load().path))
    rng = np.random.default_rng(seed)
    rank, n = int(rng.integers(1, 4)), int(rng.integers(6, 9))
    mixed = rng.standard_normal((rank + int(rng.integers(1, 3)), rank))
    basis = rng.standard_normal((rank, n))
    A, C = mixed @ basis, mixed @ (basis + 0.2 * rng.standard_normal((rank, n)))
    C /= np.linalg.norm(C, axis=1)[:, None]
    right = A @ rng.standard_normal(n)
    count = len(A)
    together = np.block([[A, np.zeros((count, count))], [np.eye(n), -C.T]])
    both = np.linalg.lstsq(together, np.concatenate([right, np.zeros(n)]), rcond=1e-10)[0]
    found = solve_some_in_c(library, A, right, rank, np.ones(count), C)
    assert_same_bits(found, solve(A, right, rank, [1.0] * count, C.tolist()))
    assert found.report[0] == rank
    assert found.solution == pytest.approx(both[:n], abs=1e-8)
    assert found.multipliers == pytest.approx(both[n:], abs=1e-8)
    assert found.report[2] < 1e-12


@pytest.mark.parametrize("seed", range(20))
def test_rows_that_depend_on_each_other_and_exert_what_does_not(seed):
    """Feet that slide different ways: x is not unique, and of least norm with the multipliers, beside how many rows are
    kept at most."""
    library = ctypes.CDLL(str(OSCILLATOR.load().path))
    rng = np.random.default_rng(seed)
    rank, n = int(rng.integers(1, 4)), int(rng.integers(6, 9))
    count = rank + int(rng.integers(1, 3))
    A = rng.standard_normal((count, rank)) @ rng.standard_normal((rank, n))
    C = A + 0.3 * rng.standard_normal((count, n))
    C /= np.linalg.norm(C, axis=1)[:, None]
    right = A @ rng.standard_normal(n)
    together = np.block([[A, np.zeros((count, count))], [np.eye(n), -C.T]])
    both = np.linalg.lstsq(together, np.concatenate([right, np.zeros(n)]), rcond=1e-10)[0]
    found = solve_some_in_c(library, A, right, rank, np.ones(count), C)
    assert_same_bits(found, solve(A, right, rank, [1.0] * count, C.tolist()))
    assert found.report[0] == rank
    assert found.solution == pytest.approx(both[:n], abs=1e-8)
    assert found.multipliers == pytest.approx(both[n:], abs=1e-8)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_rows_that_are_not_finite_have_no_order(bad):
    """They ended the process, where the room for it held large numbers: here one of its own."""
    library = ctypes.CDLL(str(OSCILLATOR.load().path))
    matrix, exerted = np.array([[1.0, 2.0, bad], [0.0, 1.0, 1.0]]), np.array([[1.0, 2.0, 1.0], [0.5, 1.0, 1.0]])
    if not (child := os.fork()):
        try:
            found = solve_some_in_c(library, matrix, np.ones(2), 2, np.ones(2), exerted, guard=1e9)
            os._exit(int(not all(np.isnan(part).all() for part in found.__dict__.values())))
        finally:
            os._exit(2)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


@pytest.mark.parametrize("rubs", [False, True])
def test_more_rows_than_there_is_room_for_have_no_solution(rubs):
    """In two columns 1032 may act: of as many x is that of least norm, of one more it is nan."""
    library = ctypes.CDLL(str(OSCILLATOR.load().path))
    rng = np.random.default_rng(3)
    matrix, acting = rng.standard_normal((1040, 2)), np.ones(1040)
    x = np.array([0.7, -0.2])
    for count in (1032, 1033):
        acting[:] = np.arange(1040) < count
        found = solve_some_in_c(library, matrix, matrix @ x, 2, acting, 1.0 * matrix if rubs else None)
        assert found.solution == pytest.approx(x if count == 1032 else [np.nan] * 2, abs=1e-12, nan_ok=True)
