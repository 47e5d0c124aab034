"""What random impacts take of the energy: never less than nothing, and what the formula without friction says."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

import numpy as np
import pytest
from impact_problems import Impact, random_impact

from multibody_sym.contact_laws.impact_sequence import strike
from multibody_sym.contact_laws.problem import Unilateral

GAIN = 1e-12
MISSED = 1e-11


def judged(impact: Impact, law: str, sequence: str) -> bool:
    """Strike, verify momentum, speeds, energy and gaps; return whether a single impact did it."""
    struck = strike(impact.problem(law, sequence))
    assert impact.gain(struck) <= GAIN
    assert struck.gained == 0.0
    assert impact.missed(struck) < MISSED
    unilateral = [k for k, law_ in enumerate(impact.laws) if isinstance(law_, Unilateral)]
    assert (struck.after[unilateral] >= -1e-8 * np.abs(impact.H @ impact.u).max()).all()
    assert (struck.impulses[unilateral] >= -1e-12 * np.abs(struck.impulses).max()).all()
    return struck.impacts == 1


def drawn(seed: int, most: int, **kind: object) -> Impact:
    rng = np.random.default_rng(seed)
    both_ways = int(rng.integers(0, 3))
    return random_impact(rng, int(rng.integers(1, most + 1)), both_ways=both_ways, **kind)  # type: ignore[arg-type]


def one_contact(seeds: Iterable[int], tangents: int) -> None:
    for seed in seeds:
        assert judged(drawn(seed, 1, tangents=tangents), ("poisson", "stronge")[seed % 2], "simultaneous")


def at_once(seeds: Iterable[int], *, equal: bool, tangents: int = 1) -> None:
    single = Counter(
        judged(drawn(seed, 3, equal=equal, tangents=tangents), "poisson", "simultaneous") for seed in seeds
    )
    assert single[True] > single[False]


def one_by_one(seeds: Iterable[int]) -> None:
    for seed in seeds:
        judged(drawn(seed, 3), ("poisson", "stronge")[seed % 2], "one_by_one")


def smooth(seed: int, e: float | None) -> Impact:
    impact = drawn(seed, 4)
    impact.parts = []
    for k, law in enumerate(impact.laws):
        if isinstance(law, Unilateral) and e is not None:
            impact.e[k] = e
    keep = [k for k, law in enumerate(impact.laws) if type(law).__name__ != "Friction"]
    impact.rows, impact.laws = [impact.rows[k] for k in keep], [impact.laws[k] for k in keep]
    impact.e, impact.given_back = [impact.e[k] for k in keep], []
    return impact


def without_friction(seeds: Iterable[int]) -> int:
    """Newton at once loses sum p (1 - e) (-v-) / 2, and nothing at e = 1, whatever the sequence.

    Return how many were single impacts.
    """
    single = 0
    for seed in seeds:
        impact = smooth(seed, None)
        struck = strike(impact.problem())
        before = impact.energy(impact.u)
        formula = struck.impulses @ ((1.0 - np.array(impact.e)) * -(impact.H @ impact.u)) / 2.0
        lost = before - impact.energy(impact.after(struck))
        if struck.impacts == 1:
            assert lost == pytest.approx(formula, abs=1e-12 * before)
            single += 1
        assert struck.energy_lost == pytest.approx(lost, abs=1e-12 * before)
        for law, sequence in (("newton", "simultaneous"), ("poisson", "one_by_one")):
            elastic = smooth(seed, 1.0)
            struck = strike(elastic.problem(law, sequence))
            if not struck.collapsed:
                assert elastic.energy(elastic.after(struck)) == pytest.approx(before, rel=1e-12)
    return single


def test_energy_of_some_impacts() -> None:
    one_contact(range(200), tangents=1)
    one_contact(range(25), tangents=2)
    at_once(range(25), equal=True)
    at_once(range(10), equal=False)
    at_once(range(4), equal=True, tangents=2)
    one_by_one(range(20))
    assert without_friction(range(40)) > 20


def test_what_separates_by_next_to_nothing_in_a_wedge_takes_no_part() -> None:
    """It contradicts what is to bounce: random systems whose contacts let nothing move at the end."""
    for seed in (95, 163, 190):
        impact = smooth(seed, None)
        assert impact.missed(strike(impact.problem())) < MISSED


def test_contacts_that_jam_are_not_given_up_for_the_rounding_of_their_impulses() -> None:
    """A tangent is nearly along the normal: impulses are a thousand times those that cause them, and nothing moves."""
    for seed in (5456, 16868):
        judged(random_impact(np.random.default_rng(seed), 3), "poisson", "simultaneous")


@pytest.mark.long
@pytest.mark.parametrize("block", range(10))
def test_one_contact_never_makes_energy(block: int) -> None:
    one_contact(range(1000 * block, 1000 * block + 800), tangents=1)
    one_contact(range(1000 * block, 1000 * block + 200), tangents=2)


@pytest.mark.long
@pytest.mark.parametrize("block", range(10))
def test_several_contacts_never_make_energy(block: int) -> None:
    at_once(range(1000 * block, 1000 * block + 300), equal=True)
    at_once(range(1000 * block, 1000 * block + 200), equal=False)
    at_once(range(1000 * block, 1000 * block + 40), equal=True, tangents=2)
    one_by_one(range(1000 * block, 1000 * block + 200))
    assert without_friction(range(1000 * block, 1000 * block + 260)) > 100
