"""Friction along three rows, as of a ball in its socket or a ring that slides and turns: the exact sphere, slip."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import root

from multibody_sym.contact_laws.problem import Equality, FrictionLaw, FrictionRow, LawMode, LawProblem, Unilateral
from multibody_sym.contact_laws.search import find

LAWS = (Unilateral(), FrictionRow(0, 0), FrictionRow(0, 1), FrictionRow(0, 2))


def pressed(M: np.ndarray, f: np.ndarray, static: float, kinetic: float) -> LawProblem:
    """Return four freedoms with a mass matrix M under forces f: the first is stopped, the others rub with it."""
    A = np.linalg.inv(np.linalg.cholesky(M).T)
    right = -np.linalg.solve(M, f)
    friction = FrictionLaw((1, 2, 3), (0,), static, kinetic, (0.0, 0.0, 0.0))
    return LawProblem(A, A, np.zeros((4, 4)), right, LAWS, (friction,))


def by_hand(M: np.ndarray, f: np.ndarray, mu: float) -> np.ndarray:
    """Return z of slip from rest: a = (0, a_t), z_t = -mu z_n a_t/|a_t|, by a solver that knows nothing of modes."""

    def missing(x: np.ndarray) -> np.ndarray:
        a, n = x[:3], x[3]
        z = np.array([n, *(-mu * n * a / np.linalg.norm(a))])
        return M @ np.array([0.0, *a]) - f - z

    free = np.linalg.solve(M[1:, 1:], f[1:])
    found = root(missing, np.array([*free, 1.0]), tol=1e-14)
    assert float(np.abs(found.fun).max()) < 1e-12
    a, n = found.x[:3], found.x[3]
    return np.array([n, *(-mu * n * a / np.linalg.norm(a))])


def direction(rng: np.random.Generator) -> np.ndarray:
    way = rng.normal(size=3)
    return way / np.linalg.norm(way)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("part", [1 - 1e-9, 1 + 1e-9])
def test_three_tangents_stick_in_the_exact_sphere(seed: int, part: float) -> None:
    way = direction(np.random.default_rng(seed))
    found = find(pressed(np.eye(4), np.array([-10.0, *(5.0 * part * way)]), 0.5, 0.5))
    assert (found.verdict, found.proved) == ("one", True)
    (state,) = found.states
    if part < 1:
        assert (state.mode.slips, state.mode.sides) == ((0,), (1, 1, 1, 1))
        assert state.z == pytest.approx([10.0, *(-5.0 * part * way)], rel=1e-12)
    else:
        assert (state.mode.slips, state.mode.sides) == ((2,), (1, 0, 0, 0))
        assert state.mode.directions[0] == pytest.approx(tuple(way), abs=1e-7)
        assert state.z == pytest.approx([10.0, *(-5.0 * way)], rel=1e-7)


@pytest.mark.parametrize("seed", range(20))
def test_slip_from_rest_goes_where_it_leads_though_inertia_turns_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    B = rng.normal(size=(4, 4))
    M = B @ B.T + 0.5 * np.eye(4)
    f = np.array([-10.0, *(20.0 * direction(rng))])
    problem = pressed(M, f, 0.3, 0.3)
    found = find(problem)
    assert (found.verdict, found.proved) == ("one", True)
    (state,) = found.states
    if state.mode.sides[0] and state.mode.slips == (2,):
        assert state.z == pytest.approx(by_hand(M, f, 0.3), rel=1e-9, abs=1e-9)
    elif state.mode.sides[0]:
        assert float(np.linalg.norm(state.z[1:])) <= 0.3 * state.z[0]
    again = find(problem, state, every=False)
    assert again.states[0].z == pytest.approx(state.z, rel=1e-9, abs=1e-9)


def test_what_slides_rubs_against_its_velocity() -> None:
    problem = pressed(np.eye(4), np.array([-10.0, 1.0, 2.0, 3.0]), 0.5, 0.4)
    moving = FrictionLaw((1, 2, 3), (0,), 0.5, 0.4, (2.0, -3.0, 6.0))
    found = find(
        LawProblem(*(getattr(problem, x) for x in ("matrix", "exerted", "coupling", "right")), LAWS, (moving,))
    )
    (state,) = found.states
    assert state.mode == LawMode((1, 0, 0, 0), (2,), (None,))
    assert state.z == pytest.approx([10.0, -8 / 7, 12 / 7, -24 / 7], rel=1e-12)


@pytest.mark.parametrize("push", [0.9, 1.1])
def test_a_force_of_three_components_presses_with_its_length(push: float) -> None:
    """A ball of 1 kg and 1 kg m^2 that holds (1, 2, 2) N has mu r |F| = 0.6 N m."""
    H = np.eye(6)
    way = np.array([2.0, 1.0, -2.0]) / 3.0
    f = np.array([1.0, 2.0, 2.0, *(0.6 * push * way)])
    laws = (Equality(), Equality(), Equality(), *(FrictionRow(0, k) for k in range(3)))
    friction = FrictionLaw((3, 4, 5), (0, 1, 2), 0.2, 0.2, (0.0, 0.0, 0.0), norm=True)
    found = find(LawProblem(H, H, np.zeros((6, 6)), -f, laws, (friction,)))
    (state,) = found.states
    assert state.mode.slips == ((0,) if push < 1 else (2,))
    assert state.z == pytest.approx([-1, -2, -2, *(-0.6 * min(push, 1.0) * way)], rel=1e-10)
