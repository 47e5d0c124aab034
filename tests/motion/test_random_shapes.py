"""Nothing passes through anything, no energy comes from nowhere, and a run does not depend on when it ends."""

from __future__ import annotations

import math

import numpy as np
import pytest
from random_shapes import Part, distance, judge, outcome, passed, placed, random_shapes, text

import multibody_sym as mbs

SOON = (110, 116, 123, 134, 137, 139, 145)
"""Seeds of runs that take little time; bodies strike, slide and rest on each other, in drums and in space."""
LATER = (109, 115, 133, 138, 148, *range(200, 300))


@pytest.mark.parametrize("seed", SOON)
def test_nothing_passes_through_anything(seed: int) -> None:
    found = judge(random_shapes(seed), backend="python")
    assert (found.wrong, found.refused) == ((), "")
    assert found.events > 0


@pytest.mark.long
@pytest.mark.parametrize("seed", LATER)
def test_nothing_passes_through_anything_in_many_runs(seed: int) -> None:
    assert list(outcome(seed, backend="python")["wrong"]) == []


def test_every_second_model_is_on_a_grid_and_every_model_can_be_read() -> None:
    for seed in range(40):
        model = random_shapes(seed)
        assert len(mbs.loads(text(model)).bodies) >= 2
        places = [x for solid in model.solids[1:] for x in solid.q[:2]]
        assert seed % 2 or all((8 * x).is_integer() for x in places)


SQUARE = Part("", np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]))
BAR = Part("", np.array([[0.0, 0.0], [2.0, 0.0]]))
DISC = Part("", np.zeros((1, 2)), 0.5)


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        (SQUARE, placed(SQUARE, (2.5, 1.0, 0.0)), 0.5),
        (SQUARE, placed(SQUARE, (1.75, 1.9, 0.0)), -0.1),
        (SQUARE, placed(SQUARE, (0.0, 1.0 + math.sqrt(2), math.pi / 4)), 0.0),
        (SQUARE, placed(BAR, (1.5, 0.5, math.pi / 2)), 0.5),
        (SQUARE, placed(BAR, (0.9, -3.0, math.pi / 2)), 0.0),
        (BAR, placed(BAR, (1.0, -0.25, math.pi / 2)), -0.25),
        (SQUARE, placed(DISC, (1.3, 1.4)), 0.0),
        (DISC, placed(DISC, (0.0, 0.75)), -0.25),
        (Part("", np.zeros((1, 2)), 3.0, hollow=True), placed(SQUARE, (1.0, 2.0, 0.0)), 3.0 - math.sqrt(13)),
        (Part("", np.zeros((1, 2)), normal=np.array([0.0, 1.0])), placed(SQUARE, (7.0, 0.5, 0.0)), -0.5),
    ],
)
def test_distances_of_the_judge(first: Part, second: Part, expected: float) -> None:
    assert distance(first, second) == pytest.approx(expected, abs=1e-12)
    assert distance(second, first) == pytest.approx(expected, abs=1e-12)


def test_the_judge_sees_what_lies_in_the_floor() -> None:
    model = random_shapes(115)
    start = np.array([x for solid in model.solids for x in solid.q])
    below = start - np.array([0.0, 9.0, 0.0] * (len(model.solids) - 1))
    told = list(passed(model, np.array([0.0, 1.0]), np.array([start, below])))
    assert told
    assert all("overlap" in x and "t = 1 s" in x for x in told)
