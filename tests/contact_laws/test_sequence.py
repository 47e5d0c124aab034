"""Impacts one after the other: Newton's cradle, ties, what is held, and collapse in place of a hang."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from impact_problems import Impact

from multibody_sym.contact_laws.impact_sequence import strike
from multibody_sym.contact_laws.problem import Equality
from multibody_sym.errors import NoSolutionError


def in_a_row(masses: list[float], u: list[float], e: list[float]) -> Impact:
    impact = Impact(np.diag(masses), np.array(u))
    for k, value in enumerate(e):
        row = np.zeros(len(masses))
        row[k], row[k + 1] = -1.0, 1.0
        impact.contact(row, value)
    return impact


@pytest.mark.parametrize("law", ["newton", "poisson", "stronge"])
def test_newtons_cradle(law: str) -> None:
    balls = in_a_row([1.0] * 5, [1.0, 0, 0, 0, 0], [1.0] * 4)
    struck = strike(balls.problem(law, "one_by_one"))
    assert balls.after(struck) == pytest.approx([0.0, 0.0, 0.0, 0.0, 1.0], abs=1e-14)
    assert (struck.impacts, [phase.rows for phase in struck.phases if phase.stage != "compression"]) == (
        4,
        [(0,), (1,), (2,), (3,)],
    )


def test_two_that_come_with_the_same_speed_send_two_away() -> None:
    balls = in_a_row([1.0] * 5, [1.0, 1.0, 0, 0, 0], [1.0] * 4)
    assert balls.after(strike(balls.problem("newton", "one_by_one"))) == pytest.approx([0, 0, 0, 1.0, 1.0], abs=1e-14)


@pytest.mark.parametrize(("apart", "together"), [(0.0, True), (1e-11, True), (1e-6, False)])
def test_closing_speeds_that_are_the_same_are_struck_together(apart: float, together: bool) -> None:
    """Two balls strike a third one from both sides."""
    balls = in_a_row([1.0] * 3, [1.0 + apart, 0.0, -1.0], [0.5, 0.5])
    struck = strike(balls.problem("newton", "one_by_one"))
    assert struck.phases[0].rows == ((0, 1) if together else (0,))
    assert (struck.impacts == 1) == together
    if together:
        assert balls.after(struck) == pytest.approx([-0.5, 0.0, 0.5], abs=1e-10)


def test_the_fastest_closing_is_the_first() -> None:
    """Ball 2 meets ball 1 at 3 and ball 3 at 1: first 1 and 2 exchange their speeds, then 2 follows ball 3 no more."""
    balls = in_a_row([1.0] * 3, [2.0, -1.0, -2.0], [1.0, 1.0])
    struck = strike(balls.problem("newton", "one_by_one"))
    order = [phase.rows for phase in struck.phases if phase.stage == "restitution"]
    assert order[0] == (0,)
    assert balls.after(struck) == pytest.approx([-2.0, -1.0, 2.0], abs=1e-14)


def test_what_does_not_bounce_is_held_while_others_are_struck() -> None:
    """Two balls that touch with e = 0 are struck as one of their mass; they part if they are struck apart."""
    balls = in_a_row([1.0, 1.0, 2.0], [3.0, 0.0, 0.0], [1.0, 0.0])
    struck = strike(balls.problem("newton", "one_by_one"))
    assert balls.after(struck) == pytest.approx([-3.0 * 2 / 4, 3.0 * 2 / 4, 3.0 * 2 / 4], abs=1e-14)
    assert struck.impacts == 1


def test_clusters_that_do_not_touch_each_other_are_struck_each_for_itself() -> None:
    pairs = Impact(np.eye(4), np.array([1.0, 0.0, 1.0, 0.0]))
    pairs.contact([-1.0, 1.0, 0, 0], 1.0)
    pairs.contact([0, 0, -1.0, 1.0], 0.0)
    struck = strike(pairs.problem("newton", "one_by_one"))
    assert pairs.after(struck) == pytest.approx([0.0, 1.0, 0.5, 0.5], abs=1e-14)
    assert struck.impacts == 2


def test_impacts_without_end_collapse_and_say_so() -> None:
    """Ten balls against a wall with e = 0.6: infinitely many impacts; no ball goes through another then."""
    count = 10
    balls = in_a_row([1.0] * count, [1.0] * count, [0.6] * (count - 1))
    wall = np.zeros(count)
    wall[-1] = -1.0
    balls.contact(wall, 0.6)
    struck = strike(balls.problem("newton", "one_by_one"))
    assert struck.collapsed
    assert struck.impacts == 100 + 20 * count + 1
    assert any("collapse" in note for note in struck.notes)
    assert (struck.after >= -1e-9).all()
    assert not struck.restitution.any()
    assert struck.energy_lost == pytest.approx(balls.energy(balls.u) - balls.energy(balls.after(struck)), rel=1e-12)


def test_a_ball_in_a_closing_wedge_is_struck_again_and_again_but_not_for_ever() -> None:
    """Three walls around a ball with e = 1 and different ways: a finite number of impacts, each by its own wall."""
    impact = Impact(np.eye(2), np.array([-1.0, -0.2]))
    for angle in (0.0, 0.2):
        impact.contact([np.cos(angle), np.sin(angle)], 1.0)
    impact.contact([-np.cos(0.1), np.sin(0.1)], 1.0)
    struck = strike(impact.problem("newton", "one_by_one"))
    assert struck.impacts < 160
    assert struck.energy_lost == pytest.approx(0.0, abs=1e-13)
    assert (struck.after >= -1e-9).all()


def test_a_drive_whose_speed_jumps_takes_an_impulse() -> None:
    """A cart of 2 kg gets the speed 3 m/s: 6 N s; r = v+ - v- of a drive is the jump that is wanted."""
    cart = Impact(np.array([[2.0]]), np.array([0.0]))
    cart.both_ways([1.0])
    problem = cart.problem()
    problem.rows.right[0] = 3.0
    struck = strike(problem)
    assert isinstance(problem.rows.laws[0], Equality)
    assert struck.impulses == pytest.approx([6.0])
    assert struck.after == pytest.approx([0.0], abs=1e-15)


def test_speeds_wanted_of_one_body_that_contradict_each_other_are_refused() -> None:
    cart = Impact(np.array([[2.0]]), np.array([0.0]))
    for _ in range(2):
        cart.both_ways([1.0])
    problem = replace(cart.problem(), names=("left", "right"))
    problem.rows.right[:] = 3.0, 4.0
    with pytest.raises(NoSolutionError, match="contradict each other"):
        strike(problem)
    problem.rows.right[:] = 3.0, 3.0
    assert strike(problem).x == pytest.approx([3.0 * np.sqrt(2.0)])


@pytest.mark.parametrize(
    ("across", "why"),
    [
        ([], "no impulses fulfil the laws of the impact at left, right: all 16 modes "),
        ([0.0], "no impulses were found .* left, right; tried were all .*, and it is not proved that there are none "),
    ],
)
def test_a_strut_that_jams_but_is_to_bounce_is_refused_with_what_was_searched(across: list[float], why: str) -> None:
    """By Newton v_n = e times that before, but friction against that slip is larger than what pushes: x < mu y.

    In space directions of slip are iterated, from a few starts.
    """
    strut = Impact(np.array([[1.5]]), np.array([-2.0]))
    for x in (0.3, 0.35):
        strut.contact([x], 0.5, [[0.9], *([k] for k in across)], 0.8)
    names = ("left", *["friction"] * (1 + len(across)), "right", *["friction"] * (1 + len(across)))
    with pytest.raises(NoSolutionError, match=why):
        strike(replace(strut.problem("newton"), names=names))


def test_a_racket_that_is_moved_suddenly_strikes_the_ball_that_lies_on_it() -> None:
    """The drive's jump comes first: then the ball closes at 3 m/s, and leaves the racket at 0.5 times that."""
    both = Impact(np.diag([2.0, 1.0]), np.zeros(2))
    both.both_ways([1.0, 0.0])
    both.contact([-1.0, 1.0], 0.5)
    problem = both.problem("poisson")
    problem.rows.right[0] = 3.0
    struck = strike(problem)
    assert struck.x / np.sqrt([2.0, 1.0]) == pytest.approx([3.0, 4.5])
    assert [phase.stage for phase in struck.phases] == ["joined", "compression", "restitution"]
    assert struck.impulses == pytest.approx([6.0 + 4.5, 4.5])


def test_impacts_in_turn_that_shrink_end_in_their_limit_without_any_slip() -> None:
    """A disc falls on one that lies on a rough floor: they strike by turns until all stands, p = K^-1 (-v).

    Slip shrinks with the speeds of closing: where these no longer count, it would be left, and nothing could hold it.
    """
    m, r = (1.0, 1.5), (0.3, 0.25)
    n = np.array([0.889, -np.sqrt(1.0 - 0.889**2)])
    discs = Impact(np.diag([m[0], m[0], m[0] * r[0] ** 2 / 2, m[1], m[1], m[1] * r[1] ** 2 / 2]), np.zeros(6))
    discs.contact([0, 1, 0, 0, 0, 0], 0.3, [[1, 0, r[0], 0, 0, 0]], 2.0)
    discs.contact([*n, 0, *-n, 0], 0.3, [[n[1], -n[0], r[0], -n[1], n[0], r[1]]], 2.0)
    discs.u[:] = np.linalg.lstsq(discs.H, np.array([0.0, 0.0, -3.459, 0.602]), rcond=None)[0]
    struck = strike(discs.problem("poisson", "one_by_one"))
    assert struck.impacts > 10
    assert struck.after == pytest.approx(np.zeros(4), abs=1e-13)
    K = discs.H @ np.linalg.solve(discs.M, discs.H.T)
    assert struck.impulses == pytest.approx(np.linalg.solve(K, -discs.H @ discs.u), rel=1e-12)


def test_what_strikes_together_but_moves_nothing_of_each_other_strikes_as_if_alone() -> None:
    """Two rods on a floor, whose ends touch each other as well: slip of each stops on the way and turns back."""

    def rods(count: int) -> Impact:
        """Return rods that fall and slip, with an end on the floor; neighbours touch along the floor."""
        impact = Impact(np.eye(3 * count), np.tile([0.4, -1.0, 0.0], count))
        for k in range(count):
            normal, tangent = np.zeros((2, 3 * count))
            normal[3 * k + 1 : 3 * k + 3], tangent[3 * k], tangent[3 * k + 2] = (1.0, -0.92), 1.0, 0.56
            impact.contact(normal, 0.5, [tangent], 0.11)
        for k in range(count - 1):
            between = np.zeros(3 * count)
            between[3 * k], between[3 * k + 3] = -1.0, 1.0
            impact.contact(between, 0.5)
        return impact

    alone, both = rods(1), rods(2)
    found = strike(alone.problem("poisson", "one_by_one"))
    struck = strike(both.problem("poisson", "one_by_one"))
    assert found.course(0) == (1, -1)
    assert both.after(struck) == pytest.approx(np.tile(alone.after(found), 2), abs=1e-14)
