"""Islands: rows that share nothing with the others have states of their own, and none at all proves none of all."""

from __future__ import annotations

import numpy as np
import pytest
from one_way_problems import random_blocks
from scipy.linalg import block_diag

from multibody_sym.contact_laws import search
from multibody_sym.contact_laws.problem import FrictionLaw, FrictionRow, LawProblem, Unilateral
from multibody_sym.contact_laws.search import find, islands


def side_by_side(problems: list[LawProblem], order: np.ndarray) -> LawProblem:
    """Return the problem of several that share nothing, its rows in an order: row k is row order[k] of them all."""
    place = {int(row): k for k, row in enumerate(order)}
    laws, parts, first = [], [], 0
    for problem in problems:
        for law in problem.laws:
            laws.append(FrictionRow(len(parts) + law.part, law.component) if isinstance(law, FrictionRow) else law)
        moved = [[tuple(place[first + k] for k in of) for of in (x.rows, x.normals)] for x in problem.parts]
        own = [(*rows, x.static, x.kinetic, x.velocity) for rows, x in zip(moved, problem.parts, strict=True)]
        parts += [FrictionLaw(*each) for each in own]
        first += len(problem.laws)
    A, C = (block_diag(*of)[order] for of in ([p.matrix for p in problems], [p.exerted for p in problems]))
    D = block_diag(*(p.coupling for p in problems))[np.ix_(order, order)]
    r = np.concatenate([p.right for p in problems])
    return LawProblem(A, C, D, r[order], tuple(laws[k] for k in order), tuple(parts))


def jammed_rod() -> LawProblem:
    """Return Painleve's rod: its tip slides at 8 m/s, mu = 2, K_nn - mu K_nt < 0; all that may act can not."""
    c, s = np.cos(1.3), np.sin(1.3)
    H = np.array([[0.0, 1.0, -c], [1.0, 0.0, s]])
    A = H * [1.0, 1.0, np.sqrt(3.0)]
    laws, part = (Unilateral(), FrictionRow(0)), FrictionLaw((1,), (0,), 2.0, 2.0, (-8.0,))
    return LawProblem(A, A, np.zeros((2, 2)), np.array([9.81, 0.0]), laws, (part,))


def foot(rng: np.random.Generator) -> LawProblem:
    """Return a body in space that stands on four rough points, under a random load."""
    points = np.array([[x, y, -0.5] for x in (-1.0, 1.0) for y in (-1.0, 1.0)])
    H = np.array([[*way, *np.cross(point, way)] for point in points for way in np.eye(3)[[2, 0, 1]]])
    load = np.array([*rng.normal(size=2), -9.81, *rng.normal(size=3)])
    parts = tuple(FrictionLaw((3 * k + 1, 3 * k + 2), (3 * k,), 0.3, 0.3, (0.0, 0.0)) for k in range(4))
    laws = tuple(law for k in range(4) for law in (Unilateral(), FrictionRow(k), FrictionRow(k, 1)))
    return LawProblem(H, H, np.zeros((12, 12)), -H @ load, laws, parts)


def test_a_body_that_has_a_state_does_not_hide_that_another_one_has_none() -> None:
    rng = np.random.default_rng(3)
    assert find(foot(rng), most=4).states
    both = side_by_side([foot(rng), jammed_rod()], rng.permutation(14))
    found = find(both, most=4)
    assert (found.states, found.proved, found.searched) == ((), True, "all 2 modes")


@pytest.mark.parametrize("seed", range(20))
def test_the_islands_of_problems_side_by_side_are_theirs(seed: int) -> None:
    """However their rows are mixed; a body that stands on four points is one island."""
    rng = np.random.default_rng(seed)
    problems = [random_blocks(rng, sliding=False).problem(), jammed_rod(), foot(rng)]
    count = sum(len(p.laws) for p in problems)
    order = rng.permutation(count)
    found = islands(side_by_side(problems, order))
    assert sorted(row for island in found for row in island.rows) == list(range(count))
    found = [island.problem for island in found]
    for island in found:
        assert any(set(island.right) <= set(p.right) and island.matrix.shape[0] <= len(p.laws) for p in problems)
    (rod,) = (x for x in found if any(part.velocity == (-8.0,) for part in x.parts))
    assert sorted(rod.right.tolist()) == [0.0, 9.81]
    (standing,) = (x for x in found if len(x.parts) == 4 and len(x.laws) == 12)
    rows = (np.column_stack([x.matrix, x.right]) for x in (standing, problems[2]))
    values = [np.linalg.svd(x, compute_uv=False)[:6] for x in rows]
    np.testing.assert_allclose(*values, rtol=1e-12)
    assert all(standing.laws[part.normals[0]] == Unilateral() for part in standing.parts)


@pytest.mark.parametrize("seed", range(20))
def test_states_of_islands_are_all_that_the_whole_has(seed: int) -> None:
    """Each of one with each of the other: what they do, which forces are free, and what a later search begins from."""
    rng = np.random.default_rng(seed)
    one, other = (random_blocks(rng, sliding=bool(k)).problem() for k in range(2))
    order = rng.permutation(len(one.laws) + len(other.laws))
    both = side_by_side([one, other], order)
    alone = [find(one), find(other)]
    found = find(both)
    assert len(found.states) == len(alone[0].states) * len(alone[1].states)
    assert found.proved == all(each.proved for each in alone)
    pairs = [np.concatenate([a.x, b.x]) for a in alone[0].states for b in alone[1].states]
    for state in found.states:
        x = state.x
        assert min(float(np.abs(x - pair).max()) for pair in pairs) < 1e-9 * max(1.0, float(np.abs(x).max()))
        np.testing.assert_allclose(both.exerted.T @ state.z, x, atol=1e-9 * max(1.0, float(np.abs(x).max())))
        again = find(both, state, every=False).states[0]
        np.testing.assert_allclose(again.x, x, atol=1e-9 * max(1.0, float(np.abs(x).max())))
    assert {int(order[k]) for k in found.free} == {*alone[0].free, *(len(one.laws) + k for k in alone[1].free)}


def test_more_states_than_are_kept_are_not_called_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks that have several states, twice: each of one with each of the other."""
    blocks = (random_blocks(np.random.default_rng(seed), sliding=True).problem() for seed in range(200))
    one = next(problem for problem in blocks if len(find(problem).states) > 1)
    both = side_by_side([one, one], np.arange(2 * len(one.laws)))
    assert find(both).proved
    monkeypatch.setattr(search, "_MOST_TOGETHER", 2)
    found = find(both)
    assert (len(found.states), found.verdict, found.proved) == (2, "several", False)
