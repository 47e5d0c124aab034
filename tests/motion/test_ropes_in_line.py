"""Taut ropes in one line: rows depend on each other at the start, and no longer once something hangs down."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import multibody_sym as mbs

M_BALL, M_BLOCK, PULL, G = 1.5, 0.8, 6.0, 9.81

HEAD = """
multibody_sym: 1
name: ropes in line
gravity: [0, -9.81, 0]
"""
DRAWN = f"""{HEAD}
bodies:
  ground: {{points: {{o: [0, 0, 0], s: [-2, 0, 0]}}}}
  ball: {{mass: {M_BALL}}}
  block: {{mass: {M_BLOCK}}}
joints:
  j1: {{type: point, parent: ground, child: ball, q: [x, y], initial: {{q: [-1, 0]}}}}
  j2: {{type: prismatic, parent: ground.s, child: block, axis: x, q: s, limits: {{lower: 0, restitution: 0}}}}
forces: {{pull: {{type: force, on: block, value: [{-PULL}, 0, 0]}}}}
constraints:
  rope1: {{type: rope, path: [block, ball], slack: true}}
  rope2: {{type: rope, path: [ball, ground.o], slack: true}}
"""
WIRE = f"""{HEAD}
bodies:
  ground: {{points: {{o: [0, 0, 0], s: [-2, 0, 0]}}}}
  ball: {{mass: {M_BALL}}}
joints: {{j1: {{type: point, parent: ground, child: ball, q: [x, y], initial: {{q: [-1, 0]}}}}}}
constraints:
  rope1: {{type: rope, path: [ground.s, ball], slack: true}}
  rope2: {{type: rope, path: [ball, ground.o], slack: true}}
"""
NESTED = f"""{HEAD}
bodies:
  ground: {{points: {{o: [0, 0, 0], s: [0.5, 0, 0]}}, surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}
  bob: {{mass: {M_BALL}}}
  block: {{mass: {M_BLOCK}}}
joints:
  j1: {{type: point, parent: ground, child: bob, q: [x, y], initial: {{q: [1, 0]}}}}
  j2: {{type: prismatic, parent: ground, child: block, axis: y, q: h, initial: {{q: 0.1}}}}
contacts: {{c: {{between: [block, ground.floor], static: 0, restitution: 0}}}}
constraints:
  outer: {{type: rope, path: [ground.o, bob], slack: true}}
  inner: {{type: rope, path: [ground.s, bob], slack: true}}
"""


def test_a_block_is_drawn_off_its_stop() -> None:
    """A crank with ropes of 1 m: the ball at an angle a below the line has drawn the block to -2 cos a.

    Energy gives a'^2 of a, and with its derivative a'' = d(a'^2 / 2)/da.
    """
    run = mbs.simulate(mbs.loads(DRAWN), t_end=0.4, samples=41, rtol=1e-11, atol=1e-12)

    def rates(_t: float, y: np.ndarray) -> list[float]:
        a, speed = y
        mass = M_BALL + 4.0 * M_BLOCK * np.sin(a) ** 2
        drives = M_BALL * G * np.cos(a) - 2.0 * PULL * np.sin(a)
        return [speed, (drives - 4.0 * M_BLOCK * np.sin(a) * np.cos(a) * speed**2) / mass]

    a, speed = solve_ivp(rates, (0.0, 0.4), [0.0, 0.0], method="DOP853", t_eval=run.t, rtol=1e-13, atol=1e-14).y
    energy = M_BALL * G * np.sin(a) - 2.0 * PULL * (1.0 - np.cos(a))
    np.testing.assert_allclose((M_BALL + 4.0 * M_BLOCK * np.sin(a) ** 2) * speed**2 / 2.0, energy, atol=1e-12)
    for name, wanted in (("x", -np.cos(a)), ("y", -np.sin(a)), ("s", 2.0 - 2.0 * np.cos(a))):
        np.testing.assert_allclose(run[name], wanted, atol=1e-9, err_msg=name)
    assert a[-1] > 0.5


def test_a_wire_holds_what_hangs_on_it() -> None:
    """It sags by what rounding of its lengths allows: l^2 / 2 = 1e-14 m."""
    run = mbs.simulate(mbs.loads(WIRE), t_end=0.2, samples=21)
    assert np.abs(run["x"] + 1.0).max() < 1e-13
    assert np.abs(run["y"]).max() == pytest.approx(0.0, abs=3e-7)


def test_the_longer_of_two_ropes_is_slack_once_the_bob_swings_on_the_shorter() -> None:
    """It is taut at the start alone: what falls elsewhere, while it hangs, does not draw the bob back to it."""
    run = mbs.simulate(mbs.loads(NESTED), t_end=0.4, samples=41)
    height, speed = run["y"], np.hypot(run["u_x"], run["u_y"])
    np.testing.assert_allclose(np.hypot(run["x"] - 0.5, height), 0.5, atol=1e-12)
    np.testing.assert_allclose(speed**2, -2.0 * G * height, atol=1e-8)
    assert (run.events[-1]["element"], run.events[-1]["kind"]) == ("outer", "slack")
    assert run["h"][-1] == 0.0
    assert height[-1] < -0.45
