"""What stands on feet on a plane in space and is pulled anywhere: up to which force it rests, against polygons by hand.

The second route has the feet's forces in balance within polygons inside the circles of friction, by one linear program.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest
from one_way_problems import assert_holds
from scipy.optimize import linprog

import multibody_sym as mbs
from multibody_sym.contact_laws.search import find
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.dynamics.start.state import state_at
from multibody_sym.mechanics.changes import Overrides

DIRECTIONS = 180
INSIDE = math.cos(math.pi / DIRECTIONS)
"""How far the sides of a polygon inside a circle are from its middle, as part of the radius."""


@dataclass
class Stool:
    """Feet (n, 3) on the plane z = 0, mass 3 kg at `com`, gravity of any direction, a pull `way` * F at `hook`."""

    feet: np.ndarray
    com: np.ndarray
    hook: np.ndarray
    way: np.ndarray
    gravity: np.ndarray
    mu: float

    @property
    def model(self) -> str:
        feet = ", ".join(f"p{k}: {foot.tolist()}" for k, foot in enumerate(self.feet, 1))
        x, y, z = (f'"{part!r}*F"' for part in self.way.tolist())
        return f"""\
multibody_sym: 1
name: stool
gravity: {self.gravity.tolist()}
parameters: {{mu: {self.mu!r}, F: {{value: 1 N, positive: true}}}}
bodies:
  ground: {{surfaces: {{plane: {{plane: [0, 0, 0], normal: z}}}}}}
  stool:
    mass: 3
    com: {self.com.tolist()}
    inertia: {{Ixx: 1, Iyy: 1, Izz: 1}}
    points: {{{feet}, hook: {self.hook.tolist()}}}
joints: {{J: {{type: free, parent: ground, child: stool}}}}
forces: {{pull: {{type: force, on: stool, at: hook, value: [{x}, {y}, {z}]}}}}
contacts: {{c: {{between: ["stool.p#", ground.plane], static: mu, repeat: {len(self.feet)}}}}}
"""

    def balance(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the rows and right side of the balance of (x, y, z) of all feet's forces and F."""
        feet, weight = len(self.feet), 3 * self.gravity
        balance = np.zeros((6, 3 * feet + 1))
        for k, foot in enumerate(self.feet):
            for axis, unit in enumerate(np.eye(3)):
                balance[:, 3 * k + axis] = [*unit, *np.cross(foot, unit)]
        balance[:, -1] = [*self.way, *np.cross(self.hook, self.way)]
        return balance, -np.array([*weight, *np.cross(self.com, weight)])

    def most(self) -> float | None:
        """Return the largest F at which forces within the polygons balance; None where none do."""
        feet, (balance, loads) = len(self.feet), self.balance()
        limits = np.zeros((feet, DIRECTIONS, 3 * feet + 1))
        angles = 2 * math.pi * np.arange(DIRECTIONS) / DIRECTIONS
        for k in range(feet):
            limits[k, :, 3 * k : 3 * k + 3] = np.column_stack(
                [np.cos(angles), np.sin(angles), np.full(DIRECTIONS, -self.mu * INSIDE)]
            )
        bounds = [(None, None), (None, None), (0, None)] * feet + [(0, None)]
        rows = limits.reshape(-1, 3 * feet + 1)
        cost = np.append(np.zeros(3 * feet), -1.0)
        found = linprog(cost, A_ub=rows, b_ub=np.zeros(len(rows)), A_eq=balance, b_eq=loads, bounds=bounds)
        return float(found.x[-1]) if found.status == 0 else None

    def limit(self) -> float:
        """Return the largest F within circles: tangents where the forces pass one, until none does by 1e-10."""
        feet, (balance, loads) = len(self.feet), self.balance()
        rows: list[np.ndarray] = []

        def cut(foot: int, x: float, y: float) -> None:
            rows.append(np.zeros(3 * feet + 1))
            rows[-1][3 * foot : 3 * foot + 3] = [x / math.hypot(x, y), y / math.hypot(x, y), -self.mu]

        for foot in range(feet):
            for turn in range(16):
                cut(foot, math.cos(turn * math.pi / 8), math.sin(turn * math.pi / 8))
        bounds = [(None, None), (None, None), (0, None)] * feet + [(0, None)]
        cost = np.append(np.zeros(3 * feet), -1.0)
        sharp = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
        for _ in range(60):
            found = linprog(cost, rows, np.zeros(len(rows)), balance, loads, bounds, options=sharp)
            forces = found.x[:-1].reshape(-1, 3)
            over = (np.hypot(forces[:, 0], forces[:, 1]) - self.mu * forces[:, 2]) / np.abs(forces).max()
            if over.max() < 1e-10:
                return float(found.x[-1])
            for foot in np.flatnonzero(over > 1e-11):
                cut(int(foot), *forces[foot, :2])
        raise AssertionError("tangents did not settle")


def random_stool(seed: int) -> Stool:
    rng = random.Random(seed)
    four = [(0.3 * x, 0.2 * y, 0.0) for x in (-1, 1) for y in (-1, 1)]
    three = [(rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4), 0.0) for _ in range(3)]
    feet = np.array(rng.choice([four, four, three]))
    beside = [rng.uniform(-0.05, 0.05), rng.uniform(-0.05, 0.05), rng.uniform(0.0, 0.3)]
    com = feet.mean(axis=0) + np.array(beside)
    hook = np.array([rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4), rng.choice([0.0, 0.2])])
    to, down, slope = rng.uniform(0, 6.28), rng.uniform(0, 6.28), rng.choice([0.0, rng.uniform(0.0, 0.3)])
    way = np.array([math.cos(to), math.sin(to), rng.choice([0.0, rng.uniform(-0.5, 0.5)])])
    tilted = [math.sin(slope) * math.cos(down), math.sin(slope) * math.sin(down), -math.cos(slope)]
    return Stool(feet, com, hook, way, 9.81 * np.array(tilted), rng.uniform(0.1, 0.9))


def compared(seed: int) -> bool:
    """Compare one stool; return whether it rests at some force."""
    stool = random_stool(seed)
    most, found = stool.most(), mbs.range_of_rest(mbs.loads(stool.model), "F").rest
    if most is None:
        assert found == [], seed
        return False
    ((_, high),) = found
    assert high is not None
    # The circles are outside of the polygons, and by so little more that forces are larger.
    assert most * (1 - 1e-9) <= high <= most + 5e-3 * max(most, 1.0), seed
    return True


def test_up_to_which_force_feet_rest() -> None:
    assert [compared(seed) for seed in (0, 1, 5)] == [True, False, True]


@pytest.mark.long
@pytest.mark.parametrize("start", range(0, 40, 10))
def test_up_to_which_force_many_stools_rest(start: int) -> None:
    assert sum(compared(seed) for seed in range(start, start + 10)) >= 4


def table(com: tuple[float, float], hook: tuple[float, float]) -> Stool:
    """Return one on four legs that is pulled along x at a height of 0.7 m."""
    legs = np.array([(0.6 * x, 0.6 * y, 0.0) for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))])
    pull, gravity = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, -9.81])
    return Stool(legs, np.array([*com, 0.0]), np.array([*hook, 0.7]), pull, gravity, 0.3)


def rests_up_to_the_circles(one: Stool, beyond: Sequence[float] = ()) -> None:
    """Compare with the second route; so much beyond it has a state, as whatever is at rest has, which slips."""
    system = mbs.loads(one.model)
    ((low, high),) = mbs.range_of_rest(system, "F").rest
    assert (low, high) == (0.0, pytest.approx(one.limit(), rel=1e-9))
    for part in beyond:
        declared = check_numbers(Overrides({"F": high * (1 + part)}).of(system))
        state = state_at(declared, search=lambda posed: find(posed.problem, every=False))
        (found,) = state.found.states
        assert_holds(state.posed.problem, found)
        assert float(np.abs(found.a).max()) > 0.1 * part


def test_a_table_rests_up_to_the_largest_force_that_legs_can_take_together() -> None:
    """Newton's method went to forces with another leg lifted, which that leg's friction would still have helped."""
    rests_up_to_the_circles(table((5 / 167.72, 2.5 / 167.72), (0.1, 0.05)), (1e-6, 1e-3, 1e-2))


@pytest.mark.long
@pytest.mark.parametrize("start", range(0, 40, 10))
def test_tables_rest_up_to_the_largest_force_that_legs_can_take_together(start: int) -> None:
    for seed in range(start, start + 10):
        rng = random.Random(seed)
        com = (rng.uniform(-0.05, 0.05), rng.uniform(-0.05, 0.05))
        rests_up_to_the_circles(table(com, (rng.uniform(-0.15, 0.15), rng.uniform(-0.15, 0.15))), (1e-6, 1e-3, 1e-2))


def test_what_the_simplex_method_leaves_without_an_answer_is_found() -> None:
    """Of this box on a slope, all but slipping, some linear program ended so."""
    feet = np.array([(0.3 * x, 0.2 * y, 0.0) for x in (-1, 1) for y in (-1, 1)])
    com = np.array([-0.04674149347179454, -0.001743832544914413, 0.004449733807366107])
    hook = np.array([-0.02993559352564068, -0.006962860682077021, 0.0])
    way = np.array([0.9767508882193262, 0.2143774763419827, 0.0])
    gravity = np.array([2.6585265222685477, 0.7639356918626639, -9.411946609978884])
    stool = Stool(feet, com, hook, way, gravity, 0.29999734134912026)
    ((low, high),) = mbs.range_of_rest(mbs.loads(stool.model), "F").rest
    assert low == 0.0
    assert high == pytest.approx(stool.most(), abs=2e-3)
