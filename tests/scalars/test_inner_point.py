"""The point that is most inside cones, by closed forms, and in how many steps of Newton's method it is found."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.scalars import linear_inequalities as module
from multibody_sym.scalars.linear_inequalities import Cone, inner_point


@pytest.fixture
def steps(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Give what each of Newton's steps gained."""
    gains: list[float] = []
    step = module._InnerPointSearch._step

    def counted(search: module._InnerPointSearch, y: np.ndarray, sharp: float) -> tuple[np.ndarray, float]:
        found = step(search, y, sharp)
        gains.append(found[1])
        return found

    monkeypatch.setattr(module._InnerPointSearch, "_step", counted)
    return gains


@pytest.mark.parametrize("mu", [0.01, 0.5, 3.0])
def test_force_in_a_circular_cone_below_a_bound(mu: float) -> None:
    """F and N with |F| <= mu N and N <= 2: log(mu^2 N^2) + log(2 - N) is greatest for N = 4/3, F = 0."""
    cones = [Cone((0, 1), (2,), (mu,)), Cone((), (3,), (1.0,))]
    ways = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    found = inner_point(np.array([0.3, -0.2, 0.5, 1.5]), ways, cones)
    assert found.z == pytest.approx([0.0, 0.0, 4 / 3, 2 / 3], abs=1e-8)
    # -log(mu^2 N^2 - F^2) has the second derivatives 2/(mu N)^2 by F and 2/N^2 by N
    assert np.diag(found.hessian) == pytest.approx([*[2 / (mu * 4 / 3) ** 2] * 2, 2 / (4 / 3) ** 2, 1 / (2 / 3) ** 2])
    assert found.room == pytest.approx(min(mu * 4 / 3, 2 / 3))


@pytest.mark.parametrize("room", [1e-3, 0.0, -1e-3])
def test_shares_of_corners_that_hardly_hold_are_found_in_few_steps(room: float, steps: list[float]) -> None:
    """Four corners carry 1 in all and resist a push of (1 - room)/2 by mu = 1/2, each a quarter by symmetry."""
    corners = range(4)
    cones = [Cone((3 * k, 3 * k + 1), (3 * k + 2,), (0.5,)) for k in corners]
    cones += [Cone((), (3 * k + 2,), (1.0,)) for k in corners]
    push = (1.0 - room) / 2
    total = np.array([[0, -push / 4, 0.25][j] for k in corners for j in range(3)])
    balanced = np.hstack([np.eye(3)] * 4)
    places = [(0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2)]
    about = np.zeros((3, 12))
    for k, (x, y) in enumerate(places):
        about[:, 3 * k : 3 * k + 3] = [[0, 0, y], [0, 0, -x], [-y, x, 0]]
    ways = np.linalg.svd(np.vstack([balanced, about]))[2][6:].T
    start = total + ways @ np.linspace(-0.05, 0.1, ways.shape[1])
    found = inner_point(start, ways, cones)
    assert found.room == pytest.approx(room / 8, abs=1e-12)
    assert found.z == pytest.approx(total, abs=1e-4 if room > 0.0 else 1e-5)
    assert len(steps) < 200
