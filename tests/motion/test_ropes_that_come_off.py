"""A rope keeps the side of its wheel that it has at the start, past the centre's line, until it lies around none of it.

The second route is the motion of two weights on one rope by Lagrange's equations in scipy, with the length laid out by
hand: tangent, arc over the top of the wheel, vertical piece.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import multibody_sym as mbs
from multibody_sym.motion.runs.run import FailedRunError

RADIUS, LIGHT, HEAVY = 0.1, 0.5, 2.0
MODEL = f"""\
multibody_sym: 1
name: thrown_over
gravity: [0, -9.81, 0]
bodies:
  light: {{mass: {LIGHT}}}
  heavy: {{mass: {HEAVY}}}
  ground: {{points: {{post: [0, 0, 0], beside: [{RADIUS}, 0, 0]}}}}
joints:
  flies: {{type: point, parent: ground, child: light, q: [x, y], initial: {{q: [-0.8, 0.4], u: [2, 4]}}}}
  hangs: {{type: prismatic, parent: ground.beside, child: heavy, axis: -y, q: s, initial: {{q: 1}}}}
pulleys: {{wheel: {{at: ground.post, radius: {RADIUS}}}}}
constraints: {{rope: {{type: rope, path: [light, wheel, heavy]}}}}
"""


def reach(x: float, y: float) -> tuple[float, np.ndarray]:
    """Return how much rope lies between the light weight and the wheel's right side, and the gradient of that."""
    far = math.hypot(x, y)
    tangent = math.sqrt(far**2 - RADIUS**2)
    touches = math.atan2(y, x) - math.acos(RADIUS / far)  # the rope turns to the right, over the top
    if touches < -math.pi / 2:
        touches += 2 * math.pi
    place = RADIUS * np.array([math.cos(touches), math.sin(touches)])
    return tangent + RADIUS * touches, (np.array([x, y]) - place) / tangent


def by_hand(t: float, state: np.ndarray, wheel: float = 0.0) -> np.ndarray:
    """Return the rates of x, y and their rates: s = const - reach(x, y), gradient by differences for its own rate.

    A wheel that turns with the rope is as hard to move as a mass `wheel` (kg) beside the heavy one, without weight.
    """
    (x, y, *v), step = state, 1e-6
    _, n = reach(x, y)
    (_, ahead), (_, back) = (reach(x + k * step * v[0], y + k * step * v[1]) for k in (1, -1))
    turning = float((ahead - back) / (2 * step) @ v)
    # light a = weight - T n, (heavy + wheel) (-n a - turning) = heavy g - T
    mass = LIGHT * np.eye(2) + (HEAVY + wheel) * np.outer(n, n)
    force = np.array([0.0, -9.81 * LIGHT]) - (HEAVY * 9.81 + (HEAVY + wheel) * turning) * n
    return np.concatenate([v, np.linalg.solve(mass, force)])


def off(t: float, state: np.ndarray, wheel: float = 0.0) -> float:
    return state[0] - RADIUS  # then the rope is one vertical line


@pytest.fixture(scope="module")
def route():
    system = mbs.loads(MODEL)
    begin = mbs.simulate(system, t_end=1e-3)
    off.terminal = True
    start = [-0.8, 0.4, *begin.u[0][:2]]
    return solve_ivp(by_hand, (0, 2), start, rtol=1e-11, atol=1e-11, events=off, dense_output=True)


def test_the_rope_stays_on_its_side_and_comes_off_where_it_is_straight(route) -> None:
    with pytest.raises(FailedRunError, match="rope comes off wheel at t = ") as failed:
        mbs.simulate(mbs.loads(MODEL), t_end=2, samples=401, rtol=1e-10, atol=1e-10)
    run = failed.value.trajectory
    assert run.t[-1] == pytest.approx(route.t_events[0][0], abs=1e-7)
    crossed = run.q[:, 0] * (RADIUS - 0) < 0  # left of the wheel's centre
    assert crossed.any()
    assert not crossed.all()
    assert run.q[:, :2] == pytest.approx(route.sol(run.t)[:2].T, abs=1e-7)


def test_fixed_steps_keep_the_side_too(route) -> None:
    end = float(route.t_events[0][0])
    run = mbs.simulate(mbs.loads(MODEL), t_end=0.95 * end, samples=3, method="rk4", step=end / 2000)
    line = run.q[-1, 0] / run.q[-1, 1], RADIUS / -float(run.q[-1, 2])
    assert line[0] > line[1], "beyond the line of the heavy weight and the centre"
    assert run.q[-1, :2] == pytest.approx(route.sol(0.95 * end)[:2], abs=1e-6)


def test_a_wheel_that_reaches_the_point_from_which_its_rope_leads_is_named() -> None:
    """A point is no obstacle: the piece between them has no direction there."""
    model = """
multibody_sym: 1
name: drawn up
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {up: [0, 3, 0], side: [1, 3, 0]}}
  lifted: {mass: 1}
  load: {mass: 4}
joints:
  guide: {type: prismatic, parent: ground, child: lifted, axis: y, q: y, initial: {q: 2}}
  fall: {type: prismatic, parent: ground, child: load, axis: y, q: z, initial: {q: -1}}
pulleys: {wheel: {at: lifted}, corner: {at: ground.side}}
constraints: {rope: {type: rope, path: [ground.up, wheel, corner, load]}}
simulation: {t_end: 2, samples: 5}
"""
    with pytest.raises(mbs.MultibodyError, match=r"ground\.up and lifted meet there, and rope between them"):
        mbs.simulate(mbs.loads(model))


TURNING = 0.4
"""The mass (kg) of a disc that turns with the rope: half of it moves as fast as the rope."""


def test_a_rope_comes_off_a_wheel_that_turns_with_it() -> None:
    model = MODEL.replace("  ground:", f"  disc: {{shape: {{disc: {RADIUS}, mass: {TURNING}}}}}\n  ground:")
    model = model.replace("  flies:", "  turns: {type: revolute, parent: ground.post, child: disc, axis: z}\n  flies:")
    model = model.replace("at: ground.post", "body: disc")
    system = mbs.loads(model)
    begin = mbs.simulate(system, t_end=1e-3)
    off.terminal = True
    names = [coordinate.name for coordinate in begin.ready.mechanism.coordinates]
    x, y = names.index("x"), names.index("y")
    start = [-0.8, 0.4, begin.u[0][x], begin.u[0][y]]
    route = solve_ivp(
        by_hand, (0, 2), start, rtol=1e-11, atol=1e-11, events=off, dense_output=True, args=(TURNING / 2,)
    )
    with pytest.raises(FailedRunError, match="rope comes off wheel at t = ") as failed:
        mbs.simulate(system, t_end=2, samples=401, rtol=1e-10, atol=1e-10)
    run = failed.value.trajectory
    assert run.t[-1] == pytest.approx(route.t_events[0][0], abs=1e-7)
    assert run.q[:, [x, y]] == pytest.approx(route.sol(run.t)[:2].T, abs=1e-7)
