"""Where two modes fit an instant: rates decide, and what they leave open is told as being at the limit."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.contact_laws.problem import FrictionLaw, FrictionRow, LawProblem, LawState, LawStates, Unilateral
from multibody_sym.contact_laws.search import find

G = 10.0


def blocks(forces: np.ndarray, static: float, kinetic: float) -> LawProblem:
    """Return blocks of 1 kg side by side on a floor, under forces (b, 2)."""
    count = len(forces)
    rows, laws, parts = [], [], []
    for k in range(count):
        for way in ((0.0, 1.0), (1.0, 0.0)):
            row = np.zeros(2 * count)
            row[2 * k : 2 * k + 2] = way
            rows.append(row)
        laws += [Unilateral(), FrictionRow(k)]
        parts.append(FrictionLaw((2 * k + 1,), (2 * k,), static, kinetic))
    A = np.array(rows)
    return LawProblem(A, A, np.zeros((2 * count, 2 * count)), -A @ forces.ravel(), tuple(laws), tuple(parts))


def rated(problem: LawProblem, rates: np.ndarray) -> LawStates:
    """Return the states under forces that change at a rate (2 b): a of each row does as its body's force."""
    return find(problem, drift=lambda state: problem.matrix @ rates)


def test_without_rates_a_block_at_the_limit_sticks_and_is_said_to_be_there() -> None:
    (state,) = find(blocks(np.array([[5.0, -G]]), 0.5, 0.4)).states
    assert (state.mode.slips, state.at_limit) == ((0,), (1,))


GROWING = [([1.0, 0.0], 1), ([-1.0, 0.0], 0), ([0.0, -1.0], 0), ([0.0, 1.0], 1), ([0.4, -1.0], 0), ([0.6, -1.0], 1)]


@pytest.mark.parametrize(("rate", "slip"), GROWING)
def test_a_push_that_grows_over_the_limit_moves_the_block(rate: list[float], slip: int) -> None:
    """It slips where the push grows faster than mu times the weight does, and has the kinetic coefficient then."""
    (state,) = rated(blocks(np.array([[5.0, -G]]), 0.5, 0.4), np.array(rate)).states
    assert (state.mode.slips, state.at_limit) == ((slip,), ())
    assert state.z == pytest.approx([G, -4.0 if slip else -5.0])


def test_a_push_the_other_way_slips_the_other_way() -> None:
    (state,) = rated(blocks(np.array([[-5.0, -G]]), 0.5, 0.5), np.array([-1.0, 0.0])).states
    assert state.mode.slips == (-1,)


def test_a_push_that_stays_at_the_limit_is_tied_again() -> None:
    """As a block on a ramp with mu = tan(alpha): it sticks."""
    (state,) = rated(blocks(np.array([[5.0, -G]]), 0.5, 0.4), np.zeros(2)).states
    assert (state.mode.slips, state.at_limit) == ((0,), (1,))


@pytest.mark.parametrize(("rate", "side"), [(1.0, 0), (-1.0, 1)])
def test_a_contact_without_force_opens_or_closes_with_the_rates(rate: float, side: int) -> None:
    (state,) = rated(blocks(np.array([[0.0, 0.0]]), 0.5, 0.4), np.array([0.0, rate])).states
    assert (state.mode.sides[0], state.at_limit) == (side, ())


@pytest.mark.parametrize(("push", "slip"), [(0.4, 0), (0.6, 1), (-0.6, -1)])
def test_a_contact_that_begins_to_press_sticks_or_slips_by_its_rates(push: float, slip: int) -> None:
    (state,) = rated(blocks(np.array([[0.0, 0.0]]), 0.5, 0.5), np.array([push, -1.0])).states
    assert (state.mode.sides[0], state.mode.slips) == (1, (slip,))


def test_a_string_shares_what_grows_between_two_blocks_at_their_limits() -> None:
    """Two blocks at the limit; the first one is pulled more, the second one less: a string holds them where it can."""
    plain = blocks(np.array([[5.0, -G], [5.0, -G]]), 0.5, 0.5)
    string = np.array([[0.0, 0.0, 0.0, 0.0], [-1.0, 0.0, 1.0, 0.0]])[1:]
    A = np.vstack([plain.matrix, string])
    laws = (*plain.laws, Unilateral())
    tied = LawProblem(A, A, np.zeros((5, 5)), np.append(plain.right, 0.0), laws, plain.parts)
    cases = [([1.0, -2.0], (0, 0), 1), ([2.0, -1.0], (1, 1), 1), ([2.0, 1.0], (1, 1), 1), ([-1.0, 1.0], (0, 1), 0)]
    for (first, second), slips, taut in cases:
        rates = np.array([first, 0.0, second, 0.0])
        (state,) = find(tied, drift=lambda state, rates=rates: A @ rates).states
        assert (state.mode.slips, state.mode.sides[4]) == (slips, taut)


def test_rates_are_asked_of_the_state_that_is_tied() -> None:
    asked = list[LawState]()

    def drift(state: LawState) -> np.ndarray:
        asked.append(state)
        return np.zeros(2)

    find(blocks(np.array([[5.0, -G]]), 0.5, 0.4), drift=drift)
    find(blocks(np.array([[3.0, -G]]), 0.5, 0.4), drift=drift)
    assert [state.z.tolist() for state in asked] == [[10.0, -5.0]]


@pytest.mark.parametrize(("left", "slip"), [(-1e-30, 1), (1e-30, 0)])
def test_what_exact_numbers_say_is_left_of_friction_decides_at_the_limit(left: float, slip: int) -> None:
    """Beyond its static limit, by however little, the block slips under the kinetic one."""
    (state,) = find(blocks(np.array([[5.0, -G]]), 0.5, 0.4), left={1: left}).states
    assert (state.mode.slips, state.at_limit) == ((slip,), ())
    assert state.z == pytest.approx([G, -4.0 if slip else -5.0])


@pytest.mark.parametrize(("left", "side"), [(-1e-30, 0), (1e-30, 1)])
def test_what_exact_numbers_say_presses_decides_whether_a_contact_without_force_is_closed(
    left: float, side: int
) -> None:
    (state,) = find(blocks(np.array([[0.0, 0.0]]), 0.5, 0.4), left={0: left}).states
    assert (state.mode.sides[0], state.at_limit) == (side, ())


def test_exact_numbers_come_before_rates_and_rates_decide_where_they_are_zero() -> None:
    """The push shrinks: the block that is beyond its limit slips now, the one that is at its limit does not."""
    asked = blocks(np.array([[5.0, -G], [5.0, -G]]), 0.5, 0.4)
    (state,) = find(asked, drift=lambda state: asked.matrix @ [-1.0, 0.0, -1.0, 0.0], left={1: -1e-30}).states
    assert (state.mode.slips, state.at_limit) == ((1, 0), ())


SHARED = [((-1.0, 2.0), (0, 0), 1), ((-2.0, 1.0), (1, 1), 1), ((1.0, -2.0), (0, 1), 0)]


@pytest.mark.parametrize(("left", "slips", "taut"), SHARED)
def test_a_string_shares_what_is_left_between_two_blocks_at_their_limits(
    left: tuple[float, float], slips: tuple[int, int], taut: int
) -> None:
    """The block behind is held by what is left at the one before it, where that is enough."""
    plain = blocks(np.array([[5.0, -G], [5.0, -G]]), 0.5, 0.5)
    A = np.vstack([plain.matrix, [-1.0, 0.0, 1.0, 0.0]])
    tied = LawProblem(A, A, np.zeros((5, 5)), np.append(plain.right, 0.0), (*plain.laws, Unilateral()), plain.parts)
    (state,) = find(tied, left={1: 1e-20 * left[0], 3: 1e-20 * left[1]}).states
    assert (state.mode.slips, state.mode.sides[4]) == (slips, taut)
