"""Rows planted into random loops: redundant and contradicting ones are named, each time exactly those.

Two hundred and forty loops get such rows, and sixty in a plane are closed by hinges in space. Right means: the rank is
that of the loop without them (by singular values of H with rows of unit length, a route of its own) and of all planted
rows but one; and the rows named together are exactly the planted circuit. It is the only one in which planted rows
stand without rows of the loop, as all of them but one are independent of the loop where it is drawn.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from mechanisms import Case
from random_loops import closed

import multibody_sym as mbs
from multibody_sym.dynamics.closing import ConstraintRows
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.redundancy import contradiction_of, redundancy
from multibody_sym.mechanics.mechanism import TIME, Source
from multibody_sym.mechanics.motion import State, motion_of
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.model.fields import Names

Random = np.random.Generator
Plants = Mapping[str, Any]


@dataclass(frozen=True)
class Loop:
    """A closed case at its state; draws by `rng`."""

    case: Case
    state: State
    rng: Random

    def with_rows(self, plants: Plants) -> Case:
        system = self.case.system
        planted = replace(system, constraints=Names({**system.constraints, **plants}))
        made = mbs.mechanism(planted)
        known = dict(zip(self.case.mechanism.parameters.places, self.case.parameters, strict=True))
        values = [0.0 if entry.source is Source.CHOSEN else known[entry.name] for entry in made.parameters]
        return Case(self.case.seed, planted, made, values)

    def at(self, case: Case) -> State:
        return case.state(self.time, list(self.state.q), list(self.state.u))

    @property
    def time(self) -> float:
        return float(self.state.slots[TIME])

    def speeds(self) -> list[tuple[str, float, float]]:
        """Return two speeds with a factor and their values."""
        names = [speed.name for speed in self.case.mechanism.speeds]
        chosen = self.rng.permutation(len(names))[:2]
        return [(names[k], float(self.rng.uniform(0.5, 2)), float(self.state.u[k])) for k in chosen]

    def coordinates(self, count: int) -> list[tuple[str, str]]:
        """Return coordinates whose rate is a speed, each with how it goes on at its speed."""
        mechanism = self.case.mechanism
        plain = [pair for body in mechanism.bodies for pair in body.rate_pairs]
        chosen = [plain[k] for k in self.rng.permutation(len(plain))[:count]]
        return [
            (mechanism.coordinates[i].name, f"{self.state.q[i]!r} + ({self.state.u[k]!r})*(t - {self.time!r})")
            for i, k in chosen
        ]


def two_distances(loop: Loop, factor: float) -> Plants:
    """Two rods between the same points; the second is `factor` times as long."""
    names = [body.name for body in loop.case.mechanism.bodies if body.name != "ground"]
    first, second = (f"{name}.a" for name in loop.rng.permutation(["ground", *names])[:2])
    probe = loop.with_rows({"P1": mbs.Distance([first, second], 1)})
    motion = motion_of(probe.mechanism, loop.at(probe))
    length = 1.0 - float(row_motions(motion)[0].phi)
    if length < 0.05:
        raise ValueError("a rod has no direction there")
    return {"P1": mbs.Distance([first, second], length), "P2": mbs.Distance([second, first], factor * length)}


def three_speeds(loop: Loop, more: float) -> Plants:
    """Two speeds and their sum, which asks for `more` than they do."""
    (a, p, u), (b, r, v) = loop.speeds()
    terms = f"{p!r}*{a}", f"{r!r}*{b}"
    given = {"P1": f"{terms[0]} - ({p * u!r})", "P2": f"{terms[1]} - ({r * v!r})"}
    both = f"{terms[0]} + {terms[1]} - ({p * u + r * v + more!r})"
    return {name: mbs.VelocityConstraint(zero) for name, zero in {**given, "P3": both}.items()}


def two_motions(loop: Loop, more: str) -> Plants:
    """A coordinate that moves as prescribed twice, the second time with `more` added."""
    ((name, value),) = loop.coordinates(1)
    return {"P1": mbs.Expression(f"{name} - ({value})"), "P2": mbs.Expression(f"2*{name} - 2*({value} + {more})")}


def three_couplings(loop: Loop, more: str) -> Plants:
    """The sum and the difference of two coordinates, and one of the two."""
    (a, x), (b, y) = loop.coordinates(2)
    zeros = [f"{a} + {b} - ({x}) - ({y})", f"{a} - {b} - ({x}) + ({y})", f"3*{a} - 3*({x} + {more})"]
    return {f"P{k}": mbs.Expression(zero) for k, zero in enumerate(zeros, 1)}


def later(loop: Loop, rate: float, acceleration: float) -> str:
    return f"({rate!r})*(t - {loop.time!r}) + ({acceleration!r})*(t - {loop.time!r})^2"


REDUNDANT = [
    lambda loop: two_distances(loop, 1.0),
    lambda loop: three_speeds(loop, 0.0),
    lambda loop: two_motions(loop, "0"),
    lambda loop: three_couplings(loop, "0"),
]
CONTRADICTING = [
    ("positions", lambda loop: two_distances(loop, 1.1)),
    ("speeds", lambda loop: three_speeds(loop, 0.3)),
    ("speeds", lambda loop: two_motions(loop, later(loop, 0.2, 0))),
    ("accelerations", lambda loop: two_motions(loop, later(loop, 0, 0.5))),
    ("positions", lambda loop: three_couplings(loop, "0.1")),
    ("accelerations", lambda loop: three_couplings(loop, later(loop, 0, -0.4))),
]


def rank_of(loop: Loop, plants: Plants) -> int:
    """Return the rank of H with rows of unit length; rows of less than 1e-12 vanish."""
    case = loop.with_rows(plants)
    rows = row_motions(motion_of(case.mechanism, loop.at(case)))
    jacobian = np.array([row.jacobian for row in rows], dtype=float)
    lengths = np.linalg.norm(jacobian, axis=1)
    kept = jacobian[lengths > 1e-12] / lengths[lengths > 1e-12, None]
    values = np.linalg.svd(kept, compute_uv=False)
    assert not ((values > 1e-10) & (values < 1e-6)).any()
    return int((values > 1e-8).sum())


def planted(seed: int, plant: Any) -> tuple[Loop, Plants]:
    """Return a loop and what is planted, all but one of it independent of the loop's rows and of each other."""
    for draw in range(1000):
        rng = np.random.default_rng([seed, draw, 4])
        loop = Loop(*closed(1000 * draw + seed), rng)
        try:
            plants = plant(loop)
        except (ValueError, ZeroDivisionError):  # too few coordinates, or both ends of a rod nearly at one place
            continue
        rest = dict(list(plants.items())[:-1])
        try:
            if rank_of(loop, rest) == rank_of(loop, {}) + len(rest):
                return loop, plants
        except AssertionError:
            continue
    raise AssertionError(f"seed {seed}: no loop leaves freedom for what is planted")


def blocks(count: int, *, quick: int) -> list[Any]:
    return [k if k < quick else pytest.param(k, marks=pytest.mark.long) for k in range(count)]


@pytest.mark.parametrize("block", blocks(20, quick=1))
def test_redundant_rows_are_named(block: int) -> None:
    for seed in range(6 * block, 6 * block + 6):
        loop, plants = planted(seed, REDUNDANT[seed % len(REDUNDANT)])
        case = loop.with_rows(plants)
        state = loop.at(case)
        found = redundancy(motion_of(case.mechanism, state), composite_body(case.mechanism, state))
        rank = rank_of(loop, {}) + len(plants) - 1
        assert (found.rank, len(found.redundant)) == (rank, len(case.mechanism.rows) - rank), f"seed {seed}"
        with_plants = [set(names) for names in found.dependencies if set(names) & set(plants)]
        assert with_plants == [set(plants)], f"seed {seed}"
        assert set(plants) <= set(found.not_unique), f"seed {seed}"


@pytest.mark.parametrize("block", blocks(20, quick=1))
def test_contradicting_rows_are_named(block: int) -> None:
    for seed in range(6 * block, 6 * block + 6):
        missing, plant = CONTRADICTING[seed % len(CONTRADICTING)]
        loop, plants = planted(seed, plant)
        case = loop.with_rows(plants)
        rows = ConstraintRows(case.mechanism, case.parameters, range(len(case.mechanism.rows)), loop.time)
        found = contradiction_of(rows, np.array(loop.state.q), np.array(loop.state.u))
        assert found is not None, f"seed {seed}"
        assert {case.mechanism.rows[k].name for k in found.rows} == set(plants), f"seed {seed}"
        assert found.missing == missing, f"seed {seed}"


@pytest.mark.parametrize("block", blocks(6, quick=1))
def test_hinges_in_space_that_close_a_loop_in_a_plane(block: int) -> None:
    """Of a hinge's five rows three hold what stays in the plane anyway; a second hinge repeats the other two."""
    for seed in range(10 * block, 10 * block + 10):
        case, state = closed(seed, times=2, flat=True)
        found = redundancy(motion_of(case.mechanism, state), composite_body(case.mechanism, state))
        alone = {names[0] for names in found.dependencies if len(names) == 1}
        across = {f"L{k}.{row}" for k in range(2) for row in ("z", "rx", "ry")}
        assert alone >= across, f"seed {seed}"
        rank = rank_of(Loop(case, state, np.random.default_rng(0)), {})
        assert (found.rank, len(found.dependencies)) == (rank, 10 - rank), f"seed {seed}"
        pairs = [set(names) for names in found.dependencies if len(names) > 1]
        if rank == 2:  # else both directions say the same to the only freedom of the loop
            assert pairs == [{"L0.x", "L1.x"}, {"L0.y", "L1.y"}], f"seed {seed}"
        assert all(len(pair) == 2 for pair in pairs), f"seed {seed}"
