"""Friction in space: the exact circle, slip against velocity, its direction from rest, and journals that rub by |F|."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from one_way_problems import assert_holds, random_blocks

from multibody_sym.contact_laws import search
from multibody_sym.contact_laws import solve_mode as mode_solve
from multibody_sym.contact_laws.problem import (
    IN_SPACE,
    Equality,
    FrictionLaw,
    FrictionRow,
    LawProblem,
    LawState,
    ModeArrays,
    Unilateral,
    scaled,
)
from multibody_sym.contact_laws.search import find
from multibody_sym.contact_laws.solve_mode import ModeSolution, solve_mode

FLOOR = (Unilateral(), FrictionRow(0, 0), FrictionRow(0, 1))


def weighted(H: np.ndarray, M: np.ndarray, f: np.ndarray, laws, parts) -> LawProblem:
    """Return the problem of rows H (m, n) for a mass matrix M (n, n) under forces f (n)."""
    upper = np.linalg.cholesky(M).T
    A = np.linalg.solve(upper.T, H.T).T
    return LawProblem(A, A, np.zeros((len(H), len(H))), -H @ np.linalg.solve(M, f), tuple(laws), tuple(parts))


def particle(force: np.ndarray, static: float, kinetic: float, velocity: tuple[float, float] = (0, 0)) -> LawProblem:
    """Return a particle of 1 kg on a floor, pressed by 10 N."""
    rows = np.eye(3)[[2, 0, 1]]
    friction = FrictionLaw((1, 2), (0,), static, kinetic, velocity)
    return weighted(rows, np.eye(3), np.array([*force, -10.0]), FLOOR, (friction,))


def only(asked: LawProblem) -> LawState:
    found = find(asked)
    assert (found.verdict, found.proved) == ("one", True)
    return found.states[0]


@pytest.mark.parametrize("angle", np.linspace(0.1, 6.2, 9))
@pytest.mark.parametrize("part", [1 - 1e-9, 1 + 1e-9])
def test_a_particle_sticks_in_the_exact_circle(angle: float, part: float) -> None:
    way = np.array([np.cos(angle), np.sin(angle)])
    state = only(particle(5.0 * part * way, 0.5, 0.5))
    if part < 1:
        assert (state.mode.slips, state.mode.sides) == ((0,), (1, 1, 1))
        assert state.z == pytest.approx([10.0, *(-5.0 * part * way)], rel=1e-12)
    else:
        assert (state.mode.slips, state.mode.sides) == ((2,), (1, 0, 0))
        assert state.mode.directions[0] == pytest.approx(tuple(way), abs=1e-7)
        assert state.z == pytest.approx([10.0, *(-5.0 * way)], rel=1e-7)


def test_a_particle_that_begins_to_slip_has_the_kinetic_coefficient() -> None:
    state = only(particle(np.array([3.0, 4.5]), 0.5, 0.4))
    way = np.array([3.0, 4.5]) / np.hypot(3.0, 4.5)
    assert state.z == pytest.approx([10.0, *(-4.0 * way)], rel=1e-12)
    assert state.kinetic == {0}


TURNS = [((0.3, 0.4), 2, ()), ((-0.3, -0.4), 0, ()), ((1.0, 0.0), 2, ()), ((-0.4, 0.3), 0, (1,)), ((-1.0, 0.0), 0, ())]


@pytest.mark.parametrize(("rate", "slip", "at_limit"), TURNS)
def test_a_push_at_the_limit_moves_a_particle_where_it_grows(
    rate: tuple[float, float], slip: int, at_limit: tuple[int, ...]
) -> None:
    """The push is 3 and 4 N, all that the floor holds: by its rate it goes beyond, falls behind, or turns alone."""
    asked = particle(np.array([3.0, 4.0]), 0.5, 0.4)
    (state,) = find(asked, drift=lambda state: asked.matrix @ [*rate, 0.0]).states
    assert (state.mode.slips, state.at_limit) == ((slip,), at_limit)
    assert state.z == pytest.approx([10.0, *(-np.array([3.0, 4.0]) * (0.8 if slip else 1.0))], rel=1e-9)


def test_a_particle_that_exact_numbers_say_is_beyond_its_circle_slips() -> None:
    (state,) = find(particle(np.array([3.0, 4.0]), 0.5, 0.4), left={1: -1e-30}).states
    assert (state.mode.slips, state.at_limit) == ((2,), ())
    assert state.mode.directions[0] == pytest.approx((0.6, 0.8), rel=1e-9)


def test_friction_of_what_slides_is_against_its_velocity_not_its_acceleration() -> None:
    state = only(particle(np.array([1.0, 2.0]), 0.5, 0.4, (3.0, -4.0)))
    assert state.mode.slips == (2,)
    assert state.mode.directions == (None,)
    assert state.z == pytest.approx([10.0, -2.4, 3.2], rel=1e-12)


def body(rng: np.random.Generator, feet: int) -> LawProblem:
    """Return a rigid body on some feet, pushed about."""
    M = np.diag([1.0, 1.0, 1.0, *rng.uniform(0.1, 0.5, 3)])
    rows, laws, parts = [], [], []
    for foot in range(feet):
        r = rng.normal(size=3) * [1, 1, 0.3] - [0, 0, 0.5]
        rows += [[*way, *np.cross(r, way)] for way in np.eye(3)[[2, 0, 1]]]
        laws += [Unilateral(), FrictionRow(foot, 0), FrictionRow(foot, 1)]
        parts.append(FrictionLaw((3 * foot + 1, 3 * foot + 2), (3 * foot,), 0.4, float(rng.choice([0.3, 0.4]))))
    f = np.array([*6.0 * rng.normal(size=2), -10.0, *rng.normal(size=3)])
    return weighted(np.array(rows), M, f, laws, parts)


@pytest.mark.parametrize("feet", [1, 2, 3])
@pytest.mark.parametrize("seed", range(10))
def test_laws_of_a_body_on_feet_hold_exactly(feet: int, seed: int) -> None:
    asked = body(np.random.default_rng(seed), feet)
    found = find(asked)
    assert found.states
    for state in found.states:
        assert_holds(asked, state)


def test_directions_of_slip_take_one_solution_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Newton's method doubles the digits: half a dozen steps, however many directions there are."""
    problem = scaled(body(np.random.default_rng(9), 3))
    solved: list[int] = []
    factors = mode_solve.pivoted_qr

    def counted(*given: Any, **named: Any) -> Any:
        solved.append(1)
        return factors(*given, **named)

    monkeypatch.setattr(mode_solve, "pivoted_qr", counted)
    directions = np.zeros((3, 3))
    directions[:, 0] = 1.0
    trial = solve_mode(problem, ModeArrays(np.ones(9, dtype=int), np.full(3, IN_SPACE), directions), np.full(3, 0.3))
    assert trial.solved
    for part in problem.parts:
        assert trial.mode.direction(part) == pytest.approx(trial.a[part.rows] / np.linalg.norm(trial.a[part.rows]))
    assert len(solved) < 10


def test_a_table_on_three_legs_slides_along_the_push() -> None:
    """Pushed at the height of the floor through the middle of its legs, each leg carries a third."""
    legs = np.array([[np.cos(t), np.sin(t), 0.0] for t in (0.2, 0.2 + 2 * np.pi / 3, 0.2 - 2 * np.pi / 3)])
    rows, laws, parts = [], [], []
    for k, r in enumerate(legs):
        rows += [[*way, *np.cross(r, way)] for way in np.eye(3)[[2, 0, 1]]]
        laws += [Unilateral(), FrictionRow(k, 0), FrictionRow(k, 1)]
        parts.append(FrictionLaw((3 * k + 1, 3 * k + 2), (3 * k,), 0.5, 0.3))
    f = np.array([4.0, 4.0, -10.0, 0.0, 0.0, 0.0])
    state = only(weighted(np.array(rows), np.diag([1.0, 1, 1, 2, 2, 3]), f, laws, parts))
    assert state.mode.slips == (2, 2, 2)
    assert state.z[::3] == pytest.approx([10 / 3] * 3, rel=1e-12)
    assert state.z[1::3] == pytest.approx([-0.3 * 10 / 3 / np.sqrt(2)] * 3, rel=1e-10)


def table_on_four_legs(push: float) -> LawProblem:
    """Return a table of 2 kg pushed at its height, so that which forces its legs carry is open."""
    rows, laws, parts = [], [], []
    for k, r in enumerate(np.array([[x, y, -0.7] for x in (0.5, -0.5) for y in (0.5, -0.5)])):
        rows += [[*way, *np.cross(r, way)] for way in np.eye(3)[[2, 0, 1]]]
        laws += [Unilateral(), FrictionRow(k, 0), FrictionRow(k, 1)]
        parts.append(FrictionLaw((3 * k + 1, 3 * k + 2), (3 * k,), 0.4, 0.3))
    M = np.diag([2.0, 2, 2, 0.2, 0.2, 0.3])
    return weighted(np.array(rows), M, np.array([push, 0.0, -20.0, 0.0, 0.0, 0.0]), laws, parts)


@pytest.mark.parametrize(("push", "slip"), [(3.0, 0), (10.0, 2)])
def test_a_table_on_four_legs_has_all_its_modes_tried(push: float, slip: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Slip begun from any side of a leg comes to the same direction: that mode is tried once, not 27 or 81 times."""
    solved = list[ModeSolution]()
    monkeypatch.setattr(search, "solve_mode", lambda *asked: solved.append(solve_mode(*asked)) or solved[-1])
    state = only(table_on_four_legs(push))
    assert state.mode.slips == (slip,) * 4
    assert state.x[:3] * np.sqrt(2.0) == pytest.approx([-min(push, 6.0), 0.0, 20.0], abs=1e-9)
    assert len(solved) < 60


@pytest.mark.parametrize(("push", "slip"), [(3.0, 0), (10.0, 2)])
def test_a_table_is_found_by_the_mode_that_is_proposed(push: float, slip: int) -> None:
    """A leg that carries nothing in it has no direction in which it slips, and needs none."""
    found = find(table_on_four_legs(push), every=False)
    assert found.searched == "one state found, others not searched"
    assert found.states[0].mode.slips == (slip,) * 4


@pytest.mark.parametrize("seed", range(12))
def test_a_plane_problem_has_the_same_states_in_space(seed: int) -> None:
    """Each tangent gets a second one, across the plane, along which nothing happens."""
    blocks = random_blocks(np.random.default_rng(seed), 2, 1)
    flat = blocks.problem()
    count, size = len(flat.laws), flat.matrix.shape[1]
    more = len(flat.parts)
    deep = np.hstack([np.zeros((more, size)), np.eye(more)])
    matrix = np.vstack([np.hstack([flat.matrix, np.zeros((count, more))]), deep])
    exerted = np.vstack([np.hstack([flat.exerted, np.zeros((count, more))]), deep])
    coupling = np.zeros((count + more, count + more))
    coupling[:count, :count] = flat.coupling
    parts = tuple(
        FrictionLaw((p.rows[0], count + k), p.normals, p.static, p.kinetic, (*p.velocity, 0.0))
        for k, p in enumerate(flat.parts)
    )
    laws = (*flat.laws, *(FrictionRow(k, 1) for k in range(len(parts))))
    right = np.concatenate([flat.right, np.zeros(len(parts))])
    one, other = find(flat), find(LawProblem(matrix, exerted, coupling, right, laws, parts))
    if one.free or not one.states:
        assert other.verdict == one.verdict
        return
    assert len(one.states) == len(other.states)
    for state in one.states:
        scale = max(1.0, float(np.abs(state.x).max()))
        assert min(float(np.abs(state.x - deep_.x[:size]).max()) for deep_ in other.states) <= 1e-8 * scale


@pytest.mark.parametrize("pull", [0.0, 30.0, 300.0])
@pytest.mark.parametrize("velocity", [0.0, 2.0, -2.0])
def test_a_journal_rubs_by_the_length_of_its_reaction(pull: float, velocity: float) -> None:
    """A drum of radius R with a weight m on its string, pulled sideways by H on its journal of radius r:

    J' alpha = m g R -+ mu r |F|, F = (H, W - m R alpha), J' = J + m R^2: a quadratic for alpha.
    """
    m, R, r, mu, J, g = 2.0, 0.3, 0.05, 0.3, 0.4, 10.0
    W, inertia = 50.0 + m * g, J + m * R * R
    root = np.sqrt(inertia)
    matrix = np.array([[0.0], [m * R / root], [1.0 / root]])
    exerted = np.array([[0.0], [0.0], [1.0 / root]])
    coupling = np.diag([1.0, 1.0, 0.0])
    free = m * g * R / inertia
    right = np.array([pull, W - m * R * free, -free])
    friction = FrictionLaw((2,), (0, 1), mu * r, mu * r, (velocity,), norm=True)
    state = only(LawProblem(matrix, exerted, coupling, right, (Equality(), Equality(), FrictionRow(0)), (friction,)))
    alpha = state.x[0] / root + free
    s = np.sign(velocity) if velocity else (1.0 if m * g * R > mu * r * np.hypot(pull, W) else 0.0)
    assert state.mode.slips == (int(s),)
    if s == 0.0:
        assert state.z == pytest.approx([pull, W, -m * g * R])
        return
    force = np.hypot(pull, W - m * R * alpha)
    assert inertia * alpha == pytest.approx(m * g * R - s * mu * r * force, rel=1e-12)
    assert state.z == pytest.approx([pull, W - m * R * alpha, -s * mu * r * force], rel=1e-12, abs=1e-12)


@pytest.mark.filterwarnings("error")
def test_slip_in_space_without_a_direction_is_no_state() -> None:
    """What sticks may be flipped where its force is zero: then there is none to slip along."""
    problem = scaled(particle(np.array([3.0, 4.0]), 0.4, 0.4))
    nowhere = ModeArrays(np.array([1, 0, 0]), np.array([IN_SPACE]), np.zeros((1, 3)))
    assert not solve_mode(problem, nowhere, np.array([0.4])).solved
