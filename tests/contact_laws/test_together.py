"""Several contacts at once: against all modes of a dense solve, dependent contacts, different coefficients."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from impact_problems import Impact, random_impact

from multibody_sym.contact_laws import impact_sequence
from multibody_sym.contact_laws.impact_sequence import strike, sweep_to_modes
from multibody_sym.contact_laws.problem import IN_SPACE, Equality, LawProblem, LawStates, Unilateral
from multibody_sym.contact_laws.search import find
from multibody_sym.errors import InputError, NoSolutionError


def solutions(impact: Impact, v: np.ndarray, least: np.ndarray, closed: list[int]) -> Iterator[np.ndarray]:
    """Yield the impulses (m) of all modes in which the laws hold, with v (m) before, over a dense W.

    A normal impulse is at least `least` (m), and that and more where v_n = 0; |p_t| <= mu p_n against v_t.
    """
    W = impact.H @ np.linalg.solve(impact.M, impact.H.T)
    equal = [k for k, law in enumerate(impact.laws) if isinstance(law, Equality)]
    part_of = {part.normals[0]: part for part in impact.parts}
    for modes in product(("open", "stick", 1, -1), repeat=len(closed)):
        if any(mode in (1, -1) and k not in part_of for mode, k in zip(modes, closed, strict=True)):
            continue
        E, r = np.zeros((len(v), len(v))), np.zeros(len(v))
        for k in equal:
            E[k], r[k] = W[k], -v[k]
        for k in set(range(len(v))) - set(equal):
            E[k, k] = 1.0  # no impulse, unless a mode says otherwise
        for mode, k in zip(modes, closed, strict=True):
            if mode == "open":
                r[k] = least[k]
            else:
                E[k], r[k] = W[k], -v[k]
            if (part := part_of.get(k)) is None:
                continue
            row = part.rows[0]
            if mode == "stick" or (mode == "open" and least[k]):
                E[row], r[row] = W[row], -v[row]
            elif mode in (1, -1):
                E[row, k] = mode * part.static
        for p, w in _solved(E, r, W, v, modes, [part_of[k].rows[0] if k in part_of else -1 for k in closed], closed,
                            [part_of[k].static if k in part_of else 0.0 for k in closed], least):  # fmt: skip
            if _holds(impact, p, w, least, closed):
                yield p


def _solved(E, r, W, v, modes, rows, closed, mus, least):  # type: ignore[no-untyped-def]
    """Yield the solution of a mode; what is open with an impulse of its own sticks or slides as well."""
    still = [i for i, mode in enumerate(modes) if mode == "open" and rows[i] >= 0 and least[closed[i]] > 0.0]
    for ways in product((0, 1, -1), repeat=len(still)):
        F = E.copy()
        s = r.copy()
        for i, way in zip(still, ways, strict=True):
            if way:
                F[rows[i]] = 0.0
                F[rows[i], rows[i]], F[rows[i], closed[i]], s[rows[i]] = 1.0, way * mus[i], 0.0
        if abs(np.linalg.det(F)) > 1e-12:
            p = np.linalg.solve(F, s)
            yield p, v + W @ p


def _holds(impact: Impact, p: np.ndarray, w: np.ndarray, least: np.ndarray, closed: list[int]) -> bool:
    small = 1e-9 * (np.abs(p).max() + np.abs(w).max())
    if any(p[k] < least[k] - small or w[k] < -small for k in closed):
        return False
    for part in impact.parts:
        k, row = part.normals[0], part.rows[0]
        if k not in closed:
            continue
        limit = part.static * p[k]
        if abs(p[row]) > limit + small or (abs(w[row]) > small and p[row] * w[row] > small):
            return False
        if abs(w[row]) > small and abs(abs(p[row]) - limit) > small:
            return False
    return True


def struck_alone(impact: Impact, law: str) -> tuple[np.ndarray, list[int]] | None:
    """Return the impulses of an impact that is a single one of at least two contacts, and who takes part."""
    v = impact.H @ impact.u
    closed = [k for k, law_ in enumerate(impact.laws) if isinstance(law_, Unilateral) and v[k] < 0.0]
    try:
        struck = strike(impact.problem(law))
    except NoSolutionError:
        return None
    plain = struck.impacts == 1 and len(closed) > 1 and not struck.notes and not struck.not_unique
    return (struck.impulses, closed) if plain else None


@pytest.mark.parametrize("law", ["newton", "poisson"])
def test_impulses_at_once_are_those_of_brute_force(law: str) -> None:
    """Three contacts with friction and a constraint: all modes, twice for Poisson, one solution of which is told."""
    tried = 0
    for seed in range(24):
        impact = random_impact(np.random.default_rng(seed), 3, both_ways=seed % 2)
        if (found := struck_alone(impact, law)) is None:
            continue
        impulses, closed = found
        v, tried = impact.H @ impact.u, tried + 1
        W, e = impact.H @ np.linalg.solve(impact.M, impact.H.T), np.array(impact.e)
        none = np.zeros(len(v))
        first = v.copy()
        if law == "newton":
            first[closed] *= 1.0 + e[closed]
        ends = list(solutions(impact, first, none, closed))
        if law == "poisson":
            halves, ends = ends, []
            for p in halves:
                least = none.copy()
                least[closed] = e[closed] * np.where(p[closed] > 1e-12 * p.max(), p[closed], 0.0)
                ends += [p + q for q in solutions(impact, v + W @ p, least, closed)]
        size = np.abs(impulses).max()
        assert min(np.abs(p - impulses).max() for p in ends) < 1e-9 * size, seed
    assert tried > 5


def test_sweeps_come_to_the_mode_that_the_search_finds() -> None:
    """In space, from nothing: the mode that they lead to gives the same speeds."""
    found = 0
    for seed in range(8):
        impact = random_impact(np.random.default_rng(seed), 2, tangents=2, equal=True)
        problem = impact.problem("poisson").rows
        state = find(problem, every=False).states[0]
        *_, mode = sweep_to_modes(problem)
        (trial,) = find(problem, mode, every=False, most=0).states
        assert trial.x == pytest.approx(state.x, abs=1e-9 * float(np.abs(state.x).max()))
        found += any(slip == IN_SPACE for slip in mode.slips)
    assert found


def test_boxes_that_land_flat_tell_the_sum_of_dependent_impulses() -> None:
    """A table with four legs: each impulse may be another, the speeds are those of its mass: p = (1 + e) m v."""
    m, v, e = 2.0, 3.0, 0.5
    table = Impact(np.diag([m, 1.0, 1.0]), np.array([-v, 0.0, 0.0]))
    for x, y in product((-1.0, 1.0), repeat=2):
        table.contact([1.0, x, y], e)
    for law in ("newton", "poisson"):
        struck = strike(table.problem(law))
        assert struck.impulses.sum() == pytest.approx((1 + e) * m * v, rel=1e-13)
        assert table.after(struck) == pytest.approx([e * v, 0.0, 0.0], abs=1e-13)
        assert struck.not_unique == (0, 1, 2, 3)
        assert struck.impulses == pytest.approx([struck.impulses.sum() / 4] * 4, rel=1e-12)  # none before another
    three = Impact(table.M, table.u)
    for place in ((1.0, 0.0), (-1.0, 1.0), (-1.0, -1.0)):
        three.contact([1.0, *place], e)
    assert strike(three.problem()).not_unique == ()


def test_restitution_that_depends_on_impulses_which_are_not_unique_says_so() -> None:
    """Four legs with different e: the table turns by how compression is shared, which is evenly."""
    table = Impact(np.diag([2.0, 1.0, 1.0]), np.array([-3.0, 0.0, 0.0]))
    for e, (x, y) in zip((0.2, 0.4, 0.6, 0.8), product((-1.0, 1.0), repeat=2), strict=True):
        table.contact([1.0, x, y], e)
    struck = strike(table.problem("poisson"))
    assert struck.compression == pytest.approx([1.5] * 4)
    assert any("not unique" in note for note in struck.notes)
    for k in range(4):
        table.e[k] = 0.5
    assert strike(table.problem("poisson")).notes == ()


def test_stronge_several_at_once_is_refused_with_what_to_say() -> None:
    impact = random_impact(np.random.default_rng(1), 1)
    both = Impact(np.eye(2), np.array([-1.0, -1.0]))
    both.contact([1.0, 0.0], 0.5)
    both.contact([0.0, 1.0], 0.5)
    assert strike(both.problem("stronge", "one_by_one")).after == pytest.approx([0.5, 0.5])
    assert strike(impact.problem("stronge")).impacts == 1
    joined = Impact(np.array([[2.0, 0.5], [0.5, 1.0]]), both.u, both.rows, both.laws, both.parts, both.e)
    with pytest.raises(InputError, match="one_by_one"):
        strike(joined.problem("stronge"))


def test_all_take_the_smallest_coefficient_where_different_ones_make_energy() -> None:
    """Random impacts in which Poisson's different coefficients with friction make 0.3 J, 9 J and 26 J."""
    for seed in (590, 1087, 1468):
        impact = random_impact(np.random.default_rng(seed), 3)
        struck = strike(impact.problem("poisson"))
        assert any("the smallest one" in note for note in struck.notes)
        assert len(set(struck.restitution[list(struck.closed)])) == 1
        assert impact.gain(struck) <= 1e-12


def test_newton_with_friction_tells_the_energy_that_it_makes() -> None:
    """K = [[1, 0.9], [0.9, 1]], mu = 1, v = (-1, -1), e = 1: both stop at p = 1/1.9, then it sticks until v_n = 1.

    T = v K^-1 v / 2 grows from 1/1.9 to 1/0.38; by impulses and by works it does not grow.
    """
    impact = Impact(np.linalg.inv(np.array([[1.0, 0.9], [0.9, 1.0]])), np.array([-1.0, -1.0]))
    impact.contact([1.0, 0.0], 1.0, [[0.0, 1.0]], 1.0)
    struck = {law: strike(impact.problem(law)) for law in ("newton", "poisson", "stronge")}
    assert struck["newton"].impulses[0] == pytest.approx(1 / 1.9 + 1 / 0.19, rel=1e-12)
    assert struck["newton"].gained == pytest.approx(1 / 0.38 - 1 / 1.9, rel=1e-12)
    for law in ("poisson", "stronge"):
        assert struck[law].gained == 0.0
        assert impact.gain(struck[law]) < 0.0


def test_a_wedge_that_lets_nothing_move_ends_at_rest() -> None:
    """Three walls around a body."""
    wedge = Impact(np.eye(2), np.array([-1.0, -0.3]))
    for angle, e in ((0.0, 0.3), (2.2, 0.5), (4.2, 0.7)):
        wedge.contact([np.cos(angle), np.sin(angle)], e)
    struck = strike(wedge.problem())
    assert struck.after == pytest.approx([0.0, 0.0, 0.0], abs=1e-8)
    assert wedge.gain(struck) == pytest.approx(-1.0, abs=1e-12)


def nearly_dependent(seed: int) -> Impact:
    """Return contacts of which one has nearly a constraint's row, another one nearly that of the first."""
    rng = np.random.default_rng(seed)
    both_ways, equal, tangents = int(rng.integers(0, 3)), bool(rng.integers(2)), int(rng.choice([1, 1, 2]))
    contacts = int(rng.integers(1, 4))
    impact = random_impact(rng, contacts, both_ways=both_ways, equal=equal, tangents=tangents)
    normals = [k for k, law in enumerate(impact.laws) if isinstance(law, Unilateral)]
    if contacts > 1:
        impact.rows[normals[1]] = impact.rows[normals[0]] + 1e-6 * impact.rows[normals[1]]
    if both_ways:
        impact.rows[normals[0]] = impact.rows[0] + 1e-4 * impact.rows[normals[0]]
        held = impact.H[:both_ways]
        impact.u = impact.u - np.linalg.pinv(held) @ (held @ impact.u)
    if (impact.H[normals] @ impact.u > 0.0).all():
        impact.u = -impact.u
    return impact


def test_contacts_that_nearly_depend_are_struck_with_all_their_digits() -> None:
    for seed in range(8):
        impact = nearly_dependent(seed)
        struck = strike(impact.problem("poisson"))
        assert impact.missed(struck) < 1e-10
        assert impact.gain(struck) <= 1e-12


@pytest.mark.parametrize("most", [0, 5])
def test_no_more_modes_are_tried_than_may_be(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two contacts of one direction that are held both ways, each at a speed of its own: no mode fits."""
    impact = Impact(np.eye(2), np.array([-1.0, 0.0]))
    for e in (0.0, 0.0):
        impact.contact([1.0, 0.0], e)
    posed = impact.problem()
    rows = replace(posed.rows, right=np.array([1.0, 2.0]), laws=(Equality(), Equality()))
    tried = list[int]()

    def counted(problem: LawProblem, *given: Any, most: int, **more: Any) -> LawStates:
        tried.append(most)
        return find(problem, *given, most=most, **more)

    monkeypatch.setattr(impact_sequence, "find", counted)
    with pytest.raises(NoSolutionError):
        strike(replace(posed, rows=rows, most=most))
    assert set(tried) == {0, most}
