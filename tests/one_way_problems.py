"""Random systems of blocks, planes, ropes and guides as numbers."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from multibody_sym.contact_laws.problem import Equality, FrictionLaw, FrictionRow, Law, LawProblem, LawState, Unilateral

GRAVITY = 10.0


@dataclass
class Blocks:
    """Points of given masses in a vertical plane, and rows between them, while they are put together."""

    masses: np.ndarray
    forces: np.ndarray
    rows: list[np.ndarray] = field(default_factory=list)
    laws: list[Law] = field(default_factory=list)
    parts: list[FrictionLaw] = field(default_factory=list)
    right: list[float] = field(default_factory=list)
    defining: dict[int, np.ndarray] = field(default_factory=dict)

    @property
    def speeds(self) -> int:
        return 2 * len(self.masses)

    def row(self, law: Law, pushed: dict[int, np.ndarray], right: float = 0.0) -> int:
        """Add a row that pushes blocks (by number; -1 is the ground) along vectors."""
        H = np.zeros(self.speeds)
        for block, way in pushed.items():
            if block >= 0:
                H[2 * block : 2 * block + 2] += way
        self.rows.append(H)
        self.laws.append(law)
        self.right.append(right)
        return len(self.rows) - 1

    def contact(
        self,
        block: int,
        under: int,
        normal: np.ndarray,
        mu: tuple[float, float],
        speed: float = 0.0,
        right: float = 0.0,
    ) -> None:
        """Let a block lie on another one or on the ground, with friction unless both coefficients are zero."""
        n = self.row(Unilateral(), {block: normal, under: -normal}, right)
        if any(mu):
            tangent = np.array([normal[1], -normal[0]])
            t = self.row(FrictionRow(len(self.parts)), {block: tangent, under: -tangent}, right / 2)
            self.parts.append(FrictionLaw((t,), (n,), *mu, (speed,)))

    def guide(self, block: int, normal: np.ndarray, mu: tuple[float, float], speed: float, *, written: bool) -> None:
        """Lead a block along a line; its reaction is a constraint's multiplier, or `written` down by Newton's law."""
        n = self.row(Equality(), {block: normal})
        tangent = np.array([normal[1], -normal[0]])
        if written:
            self.defining[self.row(Equality(), {})] = normal
            n = len(self.rows) - 1
            self.defining[n] = np.array([block, *normal])
        t = self.row(FrictionRow(len(self.parts)), {block: tangent})
        self.parts.append(FrictionLaw((t,), (n,), *mu, (speed,)))

    def rope(self, ends: dict[int, np.ndarray], *, slack: bool = True) -> None:
        """Let a rope pull blocks along vectors."""
        self.row(Unilateral() if slack else Equality(), ends)

    def mechanical(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return M (n), f (n), H, C, D and gamma."""
        count = len(self.rows)
        H, D, gamma = np.array(self.rows).reshape(count, self.speeds), np.zeros((count, count)), np.array(self.right)
        f = self.forces.ravel()
        for k, (block, *normal) in self.defining.items():
            # The reaction N of the guide is what Newton's law asks beside all other forces on the block across it.
            way = np.zeros(self.speeds)
            way[2 * int(block) : 2 * int(block) + 2] = normal
            D[k] = H @ way
            D[k, k - 1], D[k, k] = 0.0, 1.0
            gamma[k] = -f @ way
        return np.repeat(self.masses, 2), f, H, H.copy(), D, gamma

    def problem(self) -> LawProblem:
        M, f, H, C, D, gamma = self.mechanical()
        root = np.sqrt(M)
        return LawProblem(H / root, C / root, D, gamma - H @ (f / M), tuple(self.laws), tuple(self.parts))


def unit(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), np.sin(angle)])


def random_blocks(rng: np.random.Generator, most: int = 3, two_state: int = 3, sliding: bool = True) -> Blocks:
    """Return 2 to 7 blocks with at most so many undecided contacts, and so many of two states (ropes, sliding, smooth).

    One in three consists of few like numbers, so that rows depend on each other and inequalities are close.
    """
    plain = rng.random() < 1 / 3
    count = int(rng.integers(2, 8))
    masses = rng.choice([1.0, 2.0], count) if plain else 10.0 ** rng.uniform(-3, 3, count)
    forces = np.column_stack([np.zeros(count), -GRAVITY * masses])
    pulled = rng.random(count) < 0.5
    forces[pulled] += (rng.normal(size=(count, 2)) * (GRAVITY * masses)[:, None])[pulled]
    blocks = Blocks(masses, forces)
    undecided = int(rng.integers(1, most + 1))
    twos = int(rng.integers(0, two_state + 1))
    for number in range(undecided):
        block = number % count
        if rng.random() < 0.15:
            blocks.guide(block, unit(_angle(rng, plain)), _coefficients(rng, plain), 0.0, written=rng.random() < 0.5)
        else:
            under = int(rng.integers(0, block)) if block and rng.random() < 0.4 else -1
            right = float(rng.normal()) if rng.random() < 0.1 and not plain else 0.0
            blocks.contact(block, under, unit(_angle(rng, plain)), _coefficients(rng, plain), right=right)
    for _ in range(twos):
        _two_state(rng, blocks, plain, sliding)
    return blocks


def _two_state(rng: np.random.Generator, blocks: Blocks, plain: bool, sliding: bool) -> None:
    count = len(blocks.masses)
    block, other = (int(k) for k in rng.choice(count, 2, replace=False))
    kind = rng.choice(["rope", "rope", "smooth", "sliding", "guide"] if sliding else ["rope", "smooth"])
    speed = float(rng.choice([-1.0, 1.0]))
    if kind == "rope":
        along = _angle(rng, plain) + np.pi / 2
        beyond = along + np.pi if plain else rng.uniform(0, 6)
        blocks.rope({block: unit(along), other: unit(beyond)}, slack=rng.random() < 0.8)
    elif kind == "smooth":
        blocks.contact(block, other, unit(_angle(rng, plain)), (0.0, 0.0))
    elif kind == "sliding":
        blocks.contact(block, -1, unit(_angle(rng, plain)), _coefficients(rng, plain), speed)
    else:
        blocks.guide(block, unit(_angle(rng, plain)), _coefficients(rng, plain), speed, written=rng.random() < 0.5)


def _angle(rng: np.random.Generator, plain: bool) -> float:
    return float(rng.choice([np.pi / 2, np.pi / 2, np.pi / 3, np.pi]) if plain else np.pi / 2 + 0.6 * rng.normal())


def _coefficients(rng: np.random.Generator, plain: bool) -> tuple[float, float]:
    static = float(rng.choice([0.2, 0.5, 1.0]) if plain else 10.0 ** rng.uniform(-1.5, 0.3))
    return static, static * float(rng.choice([1.0, 0.5]) if plain else rng.choice([1.0, rng.uniform(0.3, 1)]))


def assert_holds(asked: LawProblem, state: LawState) -> None:
    """Assert friction at rest in the circle, and against a_t where it slips in space; none comes from a pyramid."""
    largest = float(np.abs(state.z).max())
    rounding = 1e-14 * max(float(np.abs(asked.right).max()), float(np.abs(state.x).max()))
    assert asked.exerted.T @ state.z == pytest.approx(state.x, abs=1e-9 * largest)
    for number, part in enumerate(asked.parts):
        z, a, N = state.z[list(part.rows)], state.a[list(part.rows)], state.z[part.normals[0]]
        mu = part.kinetic if number in state.kinetic else part.static
        assert -1e-10 * largest <= N
        assert np.linalg.norm(z) <= mu * N + 1e-10 * largest
        if state.mode.slips[number]:
            size = float(np.linalg.norm(a))
            assert np.linalg.norm(z) == pytest.approx(mu * N, abs=1e-10 * largest)
            assert abs(z[0] * a[1] - z[1] * a[0]) <= (1e-10 * size + rounding) * largest
            assert z @ a <= 0.0
