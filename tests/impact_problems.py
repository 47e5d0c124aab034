"""Random impacts in numbers, and what they have to fulfil by definitions of their own: momentum, speeds, energy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from multibody_sym.contact_laws.impact_problem import ImpactProblem, ImpactResult
from multibody_sym.contact_laws.problem import Equality, FrictionLaw, FrictionRow, Law, LawProblem, Unilateral

STONES = """
multibody_sym: 1
name: rod on two stones
parameters: {m: 1, l: 1, e: 0.5, mu: 0.1}
bodies:
  rod: {mass: m, inertia: {Izz: m*l^2/12}, points: {tip: [l/2, 0, 0], heel: [-l/2, 0, 0]}}
  ground: {points: {a: [0.5, 0, 0], b: [-0.5, 0, 0]}}
joints: {P: {type: planar, parent: ground, child: rod, q: [x, y, a], initial: {u: [2, -3, 0]}}}
impact:
  a: {between: [rod.tip, ground.a], normal: y, kinetic: mu, restitution: e}
  b: {between: [rod.heel, ground.b], normal: y, kinetic: mu, restitution: e}
  sequence: simultaneous
"""
"""Two ends of a rod strike stones at once."""


@dataclass
class Impact:
    """Rows over speeds u (n) of a mass matrix M (n, n), which are added one by one."""

    M: np.ndarray
    u: np.ndarray
    rows: list[np.ndarray] = field(default_factory=list)
    laws: list[Law] = field(default_factory=list)
    parts: list[FrictionLaw] = field(default_factory=list)
    e: list[float] = field(default_factory=list)
    given_back: list[float] = field(default_factory=list)

    def both_ways(self, row: Sequence[float]) -> None:
        self._add(row, Equality())

    def contact(
        self, normal: Sequence[float], e: float, tangents: Sequence[Sequence[float]] = (), mu: float = 0.0, *,
        kinetic: float | None = None, given_back: float = 0.0,
    ) -> None:  # fmt: skip
        place = self._add(normal, Unilateral(), e)
        if tangents:
            rows = tuple(self._add(t, FrictionRow(len(self.parts), k)) for k, t in enumerate(tangents))
            self.parts.append(FrictionLaw(rows, (place,), mu, mu if kinetic is None else kinetic))
            self.given_back.append(given_back)

    def _add(self, row: Sequence[float], law: Law, e: float = 0.0) -> int:
        self.rows.append(np.asarray(row, dtype=float))
        self.laws.append(law)
        self.e.append(e)
        return len(self.rows) - 1

    @property
    def H(self) -> np.ndarray:
        return np.array(self.rows).reshape(len(self.rows), len(self.u))

    @property
    def G(self) -> np.ndarray:
        return np.linalg.cholesky(self.M).T

    def problem(self, law: str = "newton", sequence: str = "simultaneous") -> ImpactProblem:
        A, count = np.linalg.solve(self.G.T, self.H.T).T, len(self.rows)
        posed = LawProblem(A, A, np.zeros((count, count)), -self.H @ self.u, tuple(self.laws), tuple(self.parts))
        return ImpactProblem(posed, np.array(self.e), tuple(self.given_back), law, sequence)  # type: ignore[arg-type]

    def after(self, struck: ImpactResult) -> np.ndarray:
        return self.u + np.linalg.solve(self.G, struck.x)

    def energy(self, u: np.ndarray) -> float:
        return float(u @ self.M @ u) / 2.0

    def missed(self, struck: ImpactResult) -> float:
        """Return what M (u+ - u-) = H^T p misses, the speeds that are told, and the energy, to parts of the largest."""
        u = self.after(struck)
        momentum = self.M @ (u - self.u) - self.H.T @ struck.impulses
        size = np.abs(self.M) @ np.abs(u - self.u) + np.abs(self.H.T) @ np.abs(struck.impulses)
        speeds = struck.after - self.H @ u
        sizes = np.abs(self.H) @ (np.abs(u) + np.abs(self.u)).max(keepdims=True).repeat(len(u))
        energy = self.energy(self.u) - self.energy(u) - struck.energy_lost
        total = self.energy(self.u) + self.energy(u) + float(np.abs(struck.lost).sum())
        return max(
            float(np.abs(momentum).max() / (size.max() + 1e-300)),
            float((np.abs(speeds) / (sizes + 1e-300)).max(initial=0.0)),
            abs(energy) / total,
        )

    def gain(self, struck: ImpactResult) -> float:
        """Return what is made of energy, to a part of what there was."""
        return (self.energy(self.after(struck)) - self.energy(self.u)) / self.energy(self.u)


def random_impact(
    rng: np.random.Generator, contacts: int, *, tangents: int = 1, equal: bool = False, both_ways: int = 0
) -> Impact:
    """Return contacts in random directions of random systems of two to eight speeds; at least one closes."""
    size = int(rng.integers(both_ways + 1 + tangents, both_ways + 9))
    root = rng.normal(size=(size, size))
    impact = Impact(root @ root.T + 0.05 * np.eye(size), np.zeros(size))
    for _ in range(both_ways):
        impact.both_ways(rng.normal(size=size))
    e = float(rng.choice([0.0, 1.0, rng.uniform()]))
    for _ in range(contacts):
        mu = float(rng.choice([0.0, rng.uniform(0.0, 2.0)]))
        rows = [rng.normal(size=size) for _ in range(tangents)]
        impact.contact(rng.normal(size=size), e if equal else float(rng.uniform()), rows, mu)
    u = rng.normal(size=size) * (10.0 ** rng.uniform(-1.0, 1.0, size))
    if both_ways:
        held = impact.H[:both_ways]
        u -= np.linalg.pinv(held) @ (held @ u)
    normals = [k for k, law in enumerate(impact.laws) if isinstance(law, Unilateral)]
    impact.u = -u if all(impact.H[normals] @ u > 0.0) else u
    return impact
