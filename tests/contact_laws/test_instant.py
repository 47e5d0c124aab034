"""Single bodies whose states are known in closed form: a block on an incline, Painleve's rod, blocks that jam."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.contact_laws.problem import (
    Equality,
    FrictionLaw,
    FrictionRow,
    LawMode,
    LawProblem,
    LawState,
    Unilateral,
)
from multibody_sym.contact_laws.search import find

G = 9.81


def problem(H, M, f, laws, parts, gamma=0.0) -> LawProblem:
    """Return the problem of rows H (m, n) of bodies with a diagonal mass matrix M (n) under forces f (n)."""
    H, M, f = np.array(H, dtype=float), np.array(M, dtype=float), np.array(f, dtype=float)
    A = H / np.sqrt(M)
    right = np.broadcast_to(gamma, len(H)) - H @ (f / M)
    return LawProblem(A, A, np.zeros((len(H), len(H))), right, tuple(laws), tuple(parts))


def incline(angle: float, static: float, kinetic: float, velocity: float = 0.0) -> LawProblem:
    """Return a block of 2 kg on an incline: its normal, and uphill."""
    rows = [[-np.sin(angle), np.cos(angle)], [np.cos(angle), np.sin(angle)]]
    friction = FrictionLaw((1,), (0,), static, kinetic, (velocity,))
    return problem(rows, [2.0, 2.0], [0.0, -2.0 * G], (Unilateral(), FrictionRow(0)), (friction,))


def rod(angle: float, rate: float, velocity: float, mu: float = 2.0) -> LawProblem:
    """Return Painleve's rod of 1 kg and half-length 1 m, its lower end on the floor."""
    c, s = np.cos(angle), np.sin(angle)
    rows, gamma = [[0.0, 1.0, -c], [1.0, 0.0, s]], [-s * rate**2, -c * rate**2]
    friction = FrictionLaw((1,), (0,), mu, mu, (velocity,))
    return problem(rows, [1.0, 1.0, 1 / 3], [0.0, -G, 0.0], (Unilateral(), FrictionRow(0)), (friction,), gamma)


def only(asked: LawProblem) -> LawState:
    found = find(asked)
    assert (found.verdict, found.proved) == ("one", True)
    return found.states[0]


def test_a_block_below_the_friction_angle_sticks() -> None:
    state = only(incline(np.pi / 6, 0.7, 0.5))
    assert (state.mode.slips, state.mode.sides, state.kinetic) == ((0,), (1, 1), frozenset())
    assert state.z == pytest.approx([2 * G * np.sqrt(3) / 2, 2 * G / 2])


@pytest.mark.parametrize(("velocity", "slip"), [(0.0, -1), (-1.0, -1), (1.0, 1)])
def test_a_block_above_it_slides_with_the_kinetic_coefficient(velocity: float, slip: int) -> None:
    state = only(incline(np.pi / 6, 0.5, 0.3, velocity))
    normal = 2 * G * np.sqrt(3) / 2
    assert (state.mode.slips, state.mode.sides, state.kinetic) == (
        (slip,),
        (1, 0),
        {0} if not velocity else frozenset(),
    )
    assert state.z == pytest.approx([normal, -slip * 0.3 * normal])
    assert state.a[1] == pytest.approx(-G / 2 - slip * 0.3 * normal / 2)


def test_between_both_coefficients_a_block_sticks_and_is_one_state() -> None:
    """Both stick and slide fulfil the inequalities where mu_k N < F < mu_s N; the static one is asked first."""
    state = only(incline(np.pi / 6, 0.6, 0.3))
    assert state.mode.slips == (0,)


@pytest.mark.parametrize(
    ("at", "verdict", "count"), [((1.3, 0, -8), "none", 0), ((0.9, -4, -8), "several", 2), ((0.15, 2, -8), "one", 1)]
)
def test_reports_of_a_sliding_rod(at: tuple[float, float, float], verdict: str, count: int) -> None:
    found = find(rod(*at))
    assert (found.verdict, len(found.states), found.searched, found.proved) == (verdict, count, "all 2 modes", True)


def test_the_paradox_begins_at_four_thirds() -> None:
    """At the angle where (1 + 3 c^2) - 3 mu s c, the inverse of the apparent mass, is least: tan 2 angle = -mu ..."""
    for mu, verdicts in ((1.3333, {"one"}), (1.3334, {"one", "none"})):
        # The worst angle has tan(angle) = 2: 1 + 3/5 - 3 mu 2/5 = 0 at mu = 4/3.
        assert {find(rod(angle, 0.0, -1.0, mu)).verdict for angle in (np.arctan(2.0), 1.5)} == verdicts


def test_a_block_pulled_off_its_plane_leaves_it() -> None:
    asked = problem(
        [[0.0, 1.0], [1.0, 0.0]],
        [1.0, 1.0],
        [0.0, 3.0],
        (Unilateral(), FrictionRow(0)),
        (FrictionLaw((1,), (0,), 0.5, 0.5),),
    )
    assert only(asked).mode == LawMode((0, 0), (0,), (None,))


def test_a_ball_in_a_corner_that_two_rods_hold_apart_has_no_state() -> None:
    """A row that pushes a block into a plane faster than the plane gives way: contradiction."""
    asked = problem([[0.0, 1.0], [0.0, -1.0]], [1.0, 1.0], [0.0, 0.0], (Unilateral(), Unilateral()), (), [1.0, 1.0])
    found = find(asked)
    assert (found.verdict, found.states) == ("none", ())


def test_a_block_jammed_between_two_walls_may_stay_or_fall() -> None:
    """Nothing says how hard the walls press: 'several', with the rows of both walls."""
    rows = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]
    laws = (Unilateral(), Unilateral(), FrictionRow(0), FrictionRow(1))
    parts = (FrictionLaw((2,), (0,), 0.5, 0.5), FrictionLaw((3,), (1,), 0.5, 0.5))
    found = find(problem(rows, [1.0, 1.0], [0.0, -G], laws, parts))
    assert found.verdict == "several"
    assert {0, 1} <= set(found.free) | set(found.states[0].not_unique)
    falls = {round(float(state.x[1]), 9) for state in found.states}
    assert G in {round(x, 9) for x in falls}
    assert 0.0 in falls


@pytest.mark.parametrize("wall", [1.0, -1.0])
def test_a_falling_block_between_its_guide_and_a_wall_may_be_squeezed(wall: float) -> None:
    """Nothing says how hard: forces N on one side of the guide slow it by more, wherever the wall is."""
    laws = (Equality(), FrictionRow(0), Unilateral(), FrictionRow(1))
    parts = (FrictionLaw((1,), (0,), 0.2, 0.1, (-1.0,)), FrictionLaw((3,), (2,), 0.5, 0.5, (-1.0,)))
    found = find(problem([[1.0, 0.0], [0.0, 1.0], [wall, 0.0], [0.0, 1.0]], [1.0, 1.0], [0.0, -G], laws, parts))
    assert found.verdict == "several"
    assert {0, 2} <= set(found.free)


def test_a_string_between_resting_blocks_has_no_value() -> None:
    """Two blocks on a rough floor, a string between them: at rest, taut, and its tension is anybody's guess."""
    rows = [[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1], [0, 0, 1, 0], [1, 0, -1, 0]]
    laws = (Unilateral(), FrictionRow(0), Unilateral(), FrictionRow(1), Unilateral())
    parts = (FrictionLaw((1,), (0,), 0.5, 0.4), FrictionLaw((3,), (2,), 0.5, 0.4))
    state = only(problem(rows, [1.0] * 4, [0.0, -G, 0.0, -G], laws, parts))
    assert state.mode.sides == (1, 1, 1, 1, 1)
    assert state.not_unique == (1, 3, 4)
    assert state.z[[0, 2]] == pytest.approx([G, G])


def test_a_guide_rubs_by_the_size_of_its_reaction() -> None:
    """A block led along x and pressed against the guide, up or down, by a force below or above its weight."""
    for push in (-20.0, 3.0, 30.0):
        rows, laws = [[0.0, 1.0], [1.0, 0.0]], (Equality(), FrictionRow(0))
        asked = problem(rows, [1.0, 1.0], [5.0, push - G], laws, (FrictionLaw((1,), (0,), 0.4, 0.3),))
        state, reaction = only(asked), G - push
        slides = 0.4 * abs(reaction) < 5.0
        assert state.mode.slips == (int(slides),)
        assert state.z == pytest.approx([reaction, -0.3 * abs(reaction) if slides else -5.0])
        assert state.mode.sides[0] == np.sign(reaction)


@pytest.mark.parametrize("load", [2.0, -2.0])
@pytest.mark.parametrize("every", [True, False])
def test_friction_resists_from_a_mode_in_which_nothing_pressed(load: float, every: bool) -> None:
    """A slider in a guide that carried nothing so far: whichever side presses next, friction takes energy out."""
    laws, friction = (Equality(), FrictionRow(0)), FrictionLaw((1,), (0,), 0.5, 0.5, (1.0,))
    asked = problem([[0.0, 1.0], [1.0, 0.0]], [1.0, 1.0], [0.0, load], laws, (friction,))
    found = find(asked, LawMode((0, 0), (1,), (None,)), every=every)
    assert [state.z.tolist() for state in found.states] == [[-load, -1.0]]


@pytest.mark.parametrize("velocity", [0.0, 1.0])
def test_what_sticks_before_is_found_from_the_previous_state(velocity: float) -> None:
    asked = incline(np.pi / 6, 0.7, 0.5, velocity)
    state = only(asked)
    again = find(asked, state, every=False)
    assert again.states[0].mode == state.mode
    assert again.states[0].z == pytest.approx(state.z, rel=1e-14)
    assert (again.verdict, again.searched) == ("one", "one state found, others not searched")
