"""All states of random blocks, planes, ropes and guides, against brute force under the same rule for coefficients."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest
from one_way_brute_force import BruteState, brute_force
from one_way_problems import Blocks, random_blocks
from random_loops import blocks

from multibody_sym.contact_laws import search
from multibody_sym.contact_laws.problem import LawState, LawStates
from multibody_sym.contact_laws.search import find
from multibody_sym.contact_laws.solve_mode import solve_mode


def accelerations(blocks: Blocks, state: LawState) -> np.ndarray:
    M, f, *_ = blocks.mechanical()
    return state.x / np.sqrt(M) + f / M


def told_apart(blocks: Blocks, state: LawState, brute: BruteState) -> list[str]:
    """Return what a state says otherwise than brute force does."""
    M, _, _, C, _, _ = blocks.mechanical()
    udot = accelerations(blocks, state)
    if np.abs(udot - brute.udot).max() > 1e-6 * max(10.0, float(np.abs(udot).max())):
        return ["accelerations"]
    sizes = np.sqrt((C * C / M).sum(axis=1))
    for part in blocks.parts:
        for row in part.normals:
            sizes[row] = sizes[row] or sizes[part.rows[0]]
    allowed = 1e-6 * (np.abs(state.z) + max(float((np.abs(state.z) * sizes).max(initial=0.0)), 1e-3) / (sizes + 1e-300))
    between, told = brute.most - brute.least, np.isin(np.arange(len(state.z)), state.not_unique)
    # What varies by little beside forces of bodies a million times heavier is neither clearly open nor clearly not.
    wrong = np.where(told, between <= 1e-3 * allowed, between > 10.0 * allowed)
    apart = [f"row {k}: open by {between[k]}, told {told[k]}" for k in np.flatnonzero(wrong)]
    differs = ~told & (np.abs(brute.least - state.z) > 10.0 * allowed)
    return apart + [f"row {k}: {state.z[k]}, not {brute.least[k]}" for k in np.flatnonzero(differs)]


def disagreement(blocks: Blocks, found: LawStates, brute: list[BruteState]) -> str:
    """Return in what the two differ, nothing where they agree."""
    if not found.proved:
        known = [all(told_apart(blocks, state, other) for other in brute) for state in found.states]
        return "a state that is none" if any(known) and not any(state.moves for state in brute) else ""
    verdict = "none" if not brute else "one" if len(brute) == 1 and not brute[0].moves else "several"
    if found.verdict != verdict:
        return f"{found.verdict}, not {verdict}"
    if any(state.moves for state in brute):
        return "" if found.free or len(found.states) > 1 else "which forces move it is not told"
    if len(found.states) != len(brute):
        return f"{len(found.states)} states, not {len(brute)}"
    for state in found.states:
        apart = [told_apart(blocks, state, other) for other in brute]
        if all(apart):
            return str(min(apart, key=len))
    return ""


def eight_at_rest(rng: np.random.Generator) -> Blocks:
    """Return a pile of eight blocks, each on the one below, leaning a little."""
    masses = 10.0 ** rng.uniform(-1, 1, 8)
    blocks = Blocks(masses, np.column_stack([rng.normal(size=8) * 3.0 * masses, -10.0 * masses]))
    for block in range(8):
        normal = np.pi / 2 + 0.1 * rng.normal()
        static = float(rng.uniform(0.2, 0.8))
        blocks.contact(block, block - 1, np.array([np.cos(normal), np.sin(normal)]), (static, 0.8 * static))
    return blocks


def compare(seeds: range, most: int, two_state: int, sliding: bool = True) -> Counter[str]:
    verdicts = Counter[str]()
    for seed in seeds:
        blocks = random_blocks(np.random.default_rng(seed), most, two_state, sliding)
        found = find(blocks.problem())
        wrong = disagreement(blocks, found, brute_force(blocks))
        assert not wrong, f"seed {seed}: {wrong}"
        verdicts[found.verdict] += 1
    return verdicts


def tied_together(horizontal: float) -> Blocks:
    """Return two blocks of 2 and 3 kg on a rough floor, and a string between them; the second one is pulled away."""
    blocks = Blocks(np.array([2.0, 3.0]), np.array([[0.0, -20.0], [horizontal, -30.0]]))
    for block in range(2):
        blocks.contact(block, -1, np.array([0.0, 1.0]), (0.5, 0.25))
    blocks.rope({0: np.array([1.0, 0.0]), 1: np.array([-1.0, 0.0])})
    return blocks


@pytest.mark.parametrize("pull", [0.0, 6.0, 20.0])
def test_brute_force_knows_how_large_the_tension_between_blocks_that_rest_may_be(pull: float) -> None:
    """The first block holds up to 0.5 * 20 N, the second one pull + 0.5 * 30 N; at least what the second cannot hold.

    Without a pull no force is needed along the floor, so that the least solution has none there.
    """
    (state,) = brute_force(tied_together(pull))
    assert (state.least[4], state.most[4]) == pytest.approx((max(0.0, pull - 15.0), 10.0), abs=1e-6)


@pytest.mark.parametrize(("seed", "most"), [(2709, 3), (2891, 3), (30294, 5)])
def test_what_rests_without_need_of_a_force_that_may_be_is_one_state(seed: int, most: int) -> None:
    """Stuck, at either limit, and without force: one motion, and forces from one limit to the other.

    In the last one a block of 2 g is held by forces of heavy ones, a million times its weight.
    """
    assert compare(range(seed, seed + 1), most, two_state=3) == {"one": 1}


@pytest.mark.parametrize("seed", [825, 1221, 1620, 3464, 8561, 9131, 17118])
def test_small_forces_beside_large_ones_and_none_at_all_are_one_state(seed: int) -> None:
    """A rope that would push with 0.025 N beside a clamp of 4.7e7 N does not; blocks without weight press nowhere.

    And ranges of small forces hang on those of forces a million times as large (1221), or have no end (9131).
    """
    assert compare(range(seed, seed + 1), most=3, two_state=3) == {"one": 1}


def test_a_light_block_that_jams_beside_heavy_ones_sticks() -> None:
    """Rounding of 300 kg is no slip of 44 g between two directions that are nearly one."""
    assert compare(range(12927, 12928), most=3, two_state=3) == {"several": 1}


def test_modes_that_no_open_force_can_save_are_not_solved_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 1,280 modes of jammed blocks 512 leave one force open that moves them; the states are those of brute force."""
    solved = list[object]()

    def counted(*given: Any) -> Any:
        solved.append(given)
        return solve_mode(*given)

    monkeypatch.setattr(search, "solve_mode", counted)
    assert compare(range(1010, 1011), most=3, two_state=3) == {"several": 1}
    assert len(solved) < 60


@pytest.mark.parametrize("block", blocks(5, quick=2))
def test_states_of_random_systems_are_those_of_brute_force(block: int) -> None:
    verdicts = compare(range(100 * block, 100 * block + 95), most=3, two_state=3)
    verdicts += compare(range(100 * block + 95, 100 * block + 100), most=5, two_state=3)
    assert verdicts["one"] > 80
    assert verdicts["several"]


@pytest.mark.long
@pytest.mark.parametrize("block", range(19))
def test_states_of_many_random_systems_are_those_of_brute_force(block: int) -> None:
    """With up to 3 undecided contacts and 3 of two states: 19 times 1,000."""
    compare(range(1000 + 1000 * block, 2000 + 1000 * block), most=3, two_state=3)


@pytest.mark.long
def test_a_state_of_eight_contacts_at_rest_is_one_of_brute_force() -> None:
    """4^8 modes are too many to be tried: the answer says so, and what it says is right."""
    for seed in range(3):
        blocks = eight_at_rest(np.random.default_rng(seed))
        found = find(blocks.problem())
        assert (found.proved, len(found.states)) == (False, 1)
        assert found.searched == "one state found, others not searched"
        assert not disagreement(blocks, found, brute_force(blocks))


@pytest.mark.long
@pytest.mark.parametrize("block", range(10))
def test_states_of_larger_random_systems_are_those_of_brute_force(block: int) -> None:
    """With up to 5 undecided contacts and 3 of two states: 10 times 100."""
    compare(range(30000 + 100 * block, 30100 + 100 * block), most=5, two_state=3)
