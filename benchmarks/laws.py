"""States of 100 contact points at once: a wall of blocks, and a row of 50 blocks with 49 strings on a rough plane.

    python benchmarks/laws.py [rounds]

Per system and load: milliseconds of CPU to find its state from nothing and from the state before (the load being larger
by 1e-4), the least of so many rounds; what breaks an inequality most, relative to the largest force; and how
many contacts stick and slip. OpenBLAS has one thread, as is best where other programs run.
"""

from __future__ import annotations

import os
import sys
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from multibody_sym.contact_laws.problem import FrictionLaw, FrictionRow, Law, LawProblem, LawState, Unilateral
from multibody_sym.contact_laws.search import find

GRAVITY = 9.81


class Rows:
    """Rows over bodies in a plane with three speeds each (x, y, turn)."""

    def __init__(self, bodies: int) -> None:
        self.bodies = bodies
        self.H: list[np.ndarray] = []
        self.laws: list[Law] = []
        self.parts: list[FrictionLaw] = []

    def _row(self, law: Law, ends: list[tuple[int, np.ndarray, np.ndarray]]) -> int:
        H = np.zeros(3 * self.bodies)
        for body, arm, way in ends:
            if body >= 0:
                H[3 * body : 3 * body + 3] += [way[0], way[1], arm[0] * way[1] - arm[1] * way[0]]
        self.H.append(H)
        self.laws.append(law)
        return len(self.H) - 1

    def contact(
        self, upper: int, lower: int, arms: tuple[np.ndarray, np.ndarray], normal: np.ndarray, mu: float
    ) -> None:
        tangent = np.array([normal[1], -normal[0]])
        n = self._row(Unilateral(), [(upper, arms[0], normal), (lower, arms[1], -normal)])
        t = self._row(FrictionRow(len(self.parts)), [(upper, arms[0], tangent), (lower, arms[1], -tangent)])
        self.parts.append(FrictionLaw((t,), (n,), mu, 0.8 * mu))

    def string(self, left: int, right: int) -> None:
        along = np.array([1.0, 0.0])
        self._row(Unilateral(), [(left, np.zeros(2), along), (right, np.zeros(2), -along)])

    def problem(self, masses: np.ndarray, forces: np.ndarray) -> LawProblem:
        H = np.array(self.H)
        root = np.sqrt(masses)
        A = H / root
        right = -H @ (forces / masses)
        return LawProblem(A, A, np.zeros((len(H), len(H))), right, tuple(self.laws), tuple(self.parts))


def wall(load: float) -> LawProblem:
    """Return 50 bricks, 10 courses of 5 one upon the other, each on two points; the top is pushed sideways."""
    columns, courses = 5, 10
    rows = Rows(columns * courses)
    up, half, low = np.array([0.0, 1.0]), 0.5, 0.25
    for course in range(courses):
        for column in range(columns):
            brick = course * columns + column
            for side in (-0.4, 0.4):
                below = brick - columns if course else -1
                arms = np.array([side * 2 * half, -low]), np.array([side * 2 * half, low])
                rows.contact(brick, below, arms, up, 0.6)
    masses = np.tile([2.0, 2.0, 2.0 / 12 * (1 + 0.25)], columns * courses)
    forces = np.tile([0.0, -2.0 * GRAVITY, 0.0], columns * courses)
    forces[3 * (columns * courses - 1)] = load
    return rows.problem(masses, forces)


def train(load: float) -> LawProblem:
    """Return 50 blocks on a rough plane, each on two points, 49 strings between them; the last one is pulled."""
    rows = Rows(50)
    up = np.array([0.0, 1.0])
    for block in range(50):
        for side in (-0.1, 0.1):
            rows.contact(block, -1, (np.array([side, -0.05]), np.zeros(2)), up, 0.3)
    for block in range(49):
        rows.string(block, block + 1)
    masses = np.tile([1.0, 1.0, 0.01], 50)
    forces = np.tile([0.0, -GRAVITY, 0.0], 50)
    forces[3 * 49] = load
    return rows.problem(masses, forces)


def broken(problem: LawProblem, state: LawState) -> float:
    """Return what breaks an inequality of the state most, relative to the largest force or what a consists of."""
    z, a = state.z, state.a
    force, terms = np.abs(z).max(), (np.abs(problem.matrix) @ np.abs(state.x) + np.abs(problem.right)).max()
    worst = 0.0
    for row, law in enumerate(problem.laws):
        if isinstance(law, Unilateral):
            worst = max(worst, -z[row] / force, -a[row] / terms, abs(z[row] * a[row]) / (force * terms))
    for number, part in enumerate(problem.parts):
        mu = part.kinetic if number in state.kinetic else part.static
        row, normal = part.rows[0], z[part.normals[0]]
        worst = max(worst, (abs(z[row]) - mu * normal) / force)
        if state.mode.sides[row]:
            worst = max(worst, abs(a[row]) / terms)
    return float(worst)


def least(rounds: int, problem: LawProblem, previous: LawState | None, every: bool) -> tuple[float, LawState]:
    times = []
    for _ in range(rounds):
        begin = time.process_time()
        found = find(problem, previous, every=every)
        times.append(time.process_time() - begin)
    return 1e3 * min(times), found.states[0]


def main() -> None:
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    print(f"{'':28}{'cold ms':>9}{'warm ms':>9}{'broken':>10}  stick slip")
    loaded = {"wall of 50 bricks": (wall, (0.0, 5.0, 14.0))}
    loaded["row of 50, 49 strings"] = train, (0.0, 70.0, 101.0, 200.0)
    for name, (make, loads) in loaded.items():
        for load in loads:
            cold, state = least(rounds, make(load), None, every=True)
            warm, again = least(rounds, make(load * 1.0001), state, every=False)
            wrong = max(broken(make(load), state), broken(make(load * 1.0001), again))
            slips = sum(slip != 0 for slip in state.mode.slips)
            closed = sum(state.mode.sides[part.normals[0]] for part in make(load).parts)
            print(f"{name + f', {load:g} N':28}{cold:9.2f}{warm:9.2f}{wrong:10.1e}  {closed - slips:5d} {slips:4d}")


if __name__ == "__main__":
    main()
