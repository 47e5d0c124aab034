"""Impacts without friction by Newton's coefficient, several at once, against formulas of books."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from multibody_sym.contact_laws.impact_problem import ImpactProblem, ImpactResult
from multibody_sym.contact_laws.impact_sequence import strike
from multibody_sym.contact_laws.problem import Equality, Law, LawProblem, Unilateral


def rows(H: np.ndarray, masses: Sequence[float], u: Sequence[float], laws: Sequence[Law]) -> LawProblem:
    A = H / np.sqrt(np.array(masses))
    return LawProblem(A, A, np.zeros((len(H), len(H))), -H @ np.array(u), tuple(laws))


def in_a_row(masses: Sequence[float], u: Sequence[float], e: float) -> ImpactProblem:
    """Return balls in a row that touch, from left to right."""
    count = len(masses) - 1
    H = np.eye(count, count + 1, 1) - np.eye(count, count + 1)
    return ImpactProblem(rows(H, masses, u, [Unilateral()] * count), np.full(count, e))


def after(struck: ImpactResult, masses: Sequence[float], u: Sequence[float]) -> np.ndarray:
    return np.array(u) + struck.x / np.sqrt(np.array(masses))


@pytest.mark.parametrize("e", [0.0, 0.3, 1.0])
def test_two_balls_collide(e: float) -> None:
    """p = (1 + e) m1 m2 (v1 - v2) / (m1 + m2), and half (1 - e^2) m1 m2 (v1 - v2)^2 / (m1 + m2) is lost."""
    m1, m2, v1, v2 = 2.0, 3.0, 4.0, -1.0
    struck = strike(in_a_row((m1, m2), (v1, v2), e))
    reduced = m1 * m2 / (m1 + m2)
    assert struck.impulses == pytest.approx([(1 + e) * reduced * (v1 - v2)], rel=1e-14)
    assert struck.compression == pytest.approx([reduced * (v1 - v2)], rel=1e-14)
    assert struck.after == pytest.approx([e * (v1 - v2)], abs=1e-14)
    assert struck.energy_lost == pytest.approx((1 - e * e) * reduced * (v1 - v2) ** 2 / 2, abs=1e-13)
    assert (struck.closed, struck.impacts, struck.gained) == ((0,), 1, 0.0)


def test_five_balls_at_once_fly_on_together() -> None:
    struck = strike(in_a_row([1.0] * 5, [1.0, 0, 0, 0, 0], 1.0))
    assert after(struck, [1.0] * 5, [1.0, 0, 0, 0, 0]) == pytest.approx([-0.6, 0.4, 0.4, 0.4, 0.4], abs=1e-14)
    assert struck.energy_lost == pytest.approx(0.0, abs=1e-14)


def test_what_separates_takes_no_part_until_it_closes() -> None:
    """The middle one of three balls is struck, and strikes the third, which was slower ahead of it than it is then."""
    masses, u = [1.0, 1.0, 1.0], [3.0, 0.0, 1.0]
    struck = strike(in_a_row(masses, u, 1.0))
    assert after(struck, masses, u) == pytest.approx([0.0, 1.0, 3.0], abs=1e-14)
    assert (struck.impacts, struck.closed) == (2, (0, 1))


def test_nothing_strikes_where_all_separate() -> None:
    struck = strike(in_a_row([1.0, 1.0], [0.0, 1.0], 1.0))
    assert (struck.phases, struck.impacts) == ((), 0)
    assert not struck.x.any()


def test_a_rod_is_caught_at_its_end_by_a_hook() -> None:
    """A rod of length 2 that falls flat turns about its caught end with omega = 3 v / 4 (half-length 1), e = 0."""
    m, v = 2.0, 5.0
    held = rows(np.array([[1.0, -1.0]]), [m, m / 3], [-v, 0.0], [Equality()])
    struck = strike(ImpactProblem(held, np.zeros(1)))
    assert struck.x / np.sqrt([m, m / 3]) + [-v, 0.0] == pytest.approx([-3 * v / 4, -3 * v / 4], rel=1e-14)
    assert struck.energy_lost == pytest.approx(m * v * v / 2 - (m + m / 3) * (3 * v / 4) ** 2 / 2, rel=1e-14)
    assert [phase.stage for phase in struck.phases] == ["joined"]
