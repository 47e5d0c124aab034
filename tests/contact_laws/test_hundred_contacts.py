"""A wall of bricks, and a row of blocks with strings: 100 contact points in one state, by its inequalities."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from laws import Rows, broken, train, wall

from multibody_sym.contact_laws import search
from multibody_sym.contact_laws.problem import LawProblem
from multibody_sym.contact_laws.search import find
from multibody_sym.contact_laws.solve_mode import ModeSolution, solve_mode

CASES = [(wall, 5.0, 0), (wall, 14.0, 2), (train, 70.0, 0), (train, 101.0, 0), (train, 200.0, 100)]


@pytest.mark.parametrize(("make", "load", "slipping"), CASES)
def test_a_state_of_a_hundred_contacts(make: Callable[[float], LawProblem], load: float, slipping: int) -> None:
    found = find(make(load))
    assert (len(found.states), found.proved) == (1, False)
    (state,) = found.states
    assert broken(make(load), state) < 1e-10
    assert sum(slip != 0 for slip in state.mode.slips) == slipping
    near = find(make(load * 1.0001), state, every=False).states[0]
    assert broken(make(load * 1.0001), near) < 1e-10
    assert near.mode.slips == state.mode.slips


@pytest.mark.parametrize(("make", "load", "slipping"), CASES)
def test_from_the_state_before_each_pair_of_coefficients_takes_one_solve(
    make: Callable[[float], LawProblem], load: float, slipping: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where something slips there are two: with the static coefficient first, then with the kinetic one."""
    (state,) = find(make(load)).states
    solved = list[ModeSolution]()
    monkeypatch.setattr(search, "solve_mode", lambda *asked: solved.append(solve_mode(*asked)) or solved[-1])
    assert find(make(load * 1.0001), state, every=False).verdict == "one"
    assert len(solved) == (2 if slipping else 1)


def test_a_row_of_blocks_moves_when_all_of_them_slip() -> None:
    """50 blocks of 1 kg hold 50 * 0.3 * 9.81 N = 147.15 N; then they have the kinetic coefficient 0.24."""
    asked = train(147.15 * (1 + 1e-9))
    (state,) = find(asked).states
    udot = state.x[::3] + np.append(np.zeros(49), 147.15 * (1 + 1e-9))
    assert udot == pytest.approx(np.full(50, 147.15 / 50 - 0.24 * 9.81), rel=1e-6)
    assert not find(train(147.15 * (1 - 1e-9))).states[0].mode.slips[99]


def test_tensions_between_blocks_that_all_rest_are_not_told() -> None:
    (state,) = find(train(20.0)).states
    strings = range(200, 249)
    assert set(strings) <= set(state.not_unique)
    assert all(state.mode.sides[k] for k in strings), "taut before slack"


@pytest.mark.parametrize(("load", "slipping"), [(5.0, 0), (20.0, 2)])
def test_two_boxes_flush_on_each_other_have_all_their_modes_tried(load: float, slipping: int) -> None:
    """Two corners on the floor, four pairs of which two say what the others do: 4^6 modes, most leave forces open."""
    rows, up = Rows(2), np.array([0.0, 1.0])
    for side in (-0.2, 0.2):
        rows.contact(0, -1, (np.array([side, -0.1]), np.zeros(2)), up, 0.4)
    for side in (-0.2, 0.2, -0.2, 0.2):
        rows.contact(1, 0, (np.array([side, -0.1]), np.array([side, 0.1])), up, 0.4)
    forces = np.tile([0.0, -20.0, 0.0], 2)
    forces[0] = load
    found = find(rows.problem(np.tile([2.0, 2.0, 0.03], 2), forces))
    assert (found.verdict, found.proved) == ("one", True)
    slips = found.states[0].mode.slips
    assert (slips[0], slips[1]) == ((1, 1) if slipping else (0, 0))
    assert set(slips[2:]) == {0}
