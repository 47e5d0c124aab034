"""The textbook's problems, from files that say nothing of directions: right to 1e-12, printed as books print them."""

from __future__ import annotations

import pytest
from twins import from_file

import multibody_sym as mbs


@pytest.mark.parametrize("name", ["t1_two_blocks", "t3_three_loads", "t7_atwood", "t8_blocks_in_a_row"])
def test_the_motion_that_is_simulated_is_the_one_that_was_solved(name: str) -> None:
    run = mbs.simulate(from_file(name), t_end=0.5, samples=3, backend="python")
    for coordinate, found in mbs.solve(from_file(name)).accelerations.items():
        assert found.value is not None
        assert run[coordinate][-1] - run[coordinate][0] == pytest.approx(found.value * 0.5**2 / 2, rel=1e-9)
