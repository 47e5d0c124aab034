"""The same search for speeds after things touch without bouncing: M (u+ - u-) = C^T p, speeds v+ in place of a."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.contact_laws.problem import Equality, FrictionLaw, FrictionRow, LawProblem, LawState, Unilateral
from multibody_sym.contact_laws.search import find
from multibody_sym.errors import NoSolutionError


def closing(H: np.ndarray, masses: np.ndarray, before: np.ndarray, laws, parts) -> LawProblem:
    """Return the problem of rows H (m, n) that close at speeds before (n)."""
    A = H / np.sqrt(masses)
    return LawProblem(A, A, np.zeros((len(H), len(H))), -H @ before, tuple(laws), tuple(parts))


def only(problem: LawProblem) -> LawState:
    found = find(problem)
    assert (found.verdict, found.proved) == ("one", True)
    return found.states[0]


@pytest.mark.parametrize(("along", "after"), [(0.5, 0.0), (-0.5, 0.0), (3.0, 3.0 - 0.4 * 2), (-3.0, -3.0 + 0.4 * 2)])
def test_a_block_that_falls_on_a_belt_stops_or_is_braked(along: float, after: float) -> None:
    H, m = np.array([[0.0, 1.0], [1.0, 0.0]]), np.array([5.0, 5.0])
    friction = FrictionLaw((1,), (0,), 0.4, 0.4)
    state = only(closing(H, m, np.array([along, -2.0]), (Unilateral(), FrictionRow(0)), (friction,)))
    assert state.a == pytest.approx([0.0, after], abs=1e-14)
    assert state.z == pytest.approx([10.0, 5.0 * (after - along)])
    assert state.mode.slips == (int(np.sign(after)),)


def test_a_rope_that_goes_taut_makes_both_speeds_one() -> None:
    """Momentum along it is kept: (m1 v1 + m2 v2) / (m1 + m2)."""
    state = only(closing(np.array([[-1.0, 1.0]]), np.array([2.0, 3.0]), np.array([4.0, 1.0]), (Unilateral(),), ()))
    u = state.x / np.sqrt([2.0, 3.0]) + [4.0, 1.0]
    assert u == pytest.approx([11 / 5, 11 / 5])
    assert state.z == pytest.approx([18 / 5])


def test_what_opens_again_in_a_row_of_blocks_has_no_impulse() -> None:
    """The first of three blocks strikes the second with e = 0; the third, which flies ahead, is not touched."""
    H = np.array([[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]])
    state = only(closing(H, np.ones(3), np.array([2.0, 0.0, 1.5]), (Unilateral(), Unilateral()), ()))
    assert state.z == pytest.approx([1.0, 0.0])
    assert state.mode.sides == (1, 0)


def test_equalities_alone_and_nothing_at_all() -> None:
    state = only(closing(np.array([[1.0, 1.0]]), np.ones(2), np.array([1.0, 0.0]), (Equality(),), ()))
    assert state.z == pytest.approx([-0.5])
    empty = only(LawProblem(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 0)), np.zeros(0), ()))
    assert (empty.x.tolist(), empty.z.tolist(), empty.mode.sides) == ([0.0, 0.0, 0.0], [], ())


def test_rows_that_are_not_finite_are_an_error() -> None:
    with pytest.raises(NoSolutionError, match="row 1"):
        find(closing(np.array([[1.0, 1.0], [np.nan, 0.0]]), np.ones(2), np.ones(2), (Equality(), Unilateral()), ()))
