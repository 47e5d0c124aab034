"""Contacts that carry nothing, since what touches falls freely: by the same model without them."""

from __future__ import annotations

from dataclasses import replace
from math import radians

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.contact.contact_problem import Scale
from multibody_sym.mechanics.resolve import mechanism as resolved
from multibody_sym.motion.prepare.programs import recall_laws
from multibody_sym.motion.switching.law_values import Laws

_ROD = """
multibody_sym: 1
name: rod_beside_wall
gravity: [0, -g, 0]
parameters: {g: 10 m/s^2, l: 3 m, theta: 60 deg}
bodies:
  ground: {surfaces: {wall: {plane: [0, 0, 0], normal: -x}}}
  rod: {shape: {rod: l, mass: 12 kg}, points: {top: [l, 0, 0]}}
joints:
  rod: {type: planar, parent: ground, child: rod, q: [x, y, phi], initial: {q: [-l*cos(theta), 0, theta]}}
contacts: {top: {between: [rod.top, ground.wall]}}
simulation: {t_end: 0.5 s}
"""
_ON_BLOCK = """
multibody_sym: 1
name: rod_on_falling_block
gravity: [0, -g, 0]
parameters: {g: 10 m/s^2, mu: 0.3, L: 1 m, v: 0 m/s}
bodies:
  block: {mass: 2, surfaces: {top: {plane: [0, 0, 0], normal: y}}}
  rod: {shape: {rod: L, mass: 1}, points: {foot: [0, 0, 0]}}
joints:
  block: {type: point, parent: ground, child: block, q: [x1, y1]}
  rod: {type: planar, parent: ground, child: rod, q: [x2, y2, p2], initial: {q: [0, 0, 60 deg], u: [v, 0, 0]}}
contacts: {foot: {between: [rod.foot, block.top], static: mu}}
simulation: {t_end: 0.4 s}
"""
_STONE = """
multibody_sym: 1
name: stone_elsewhere
gravity: [0, -g, 0]
parameters: {g: 10 m/s^2}
bodies: {stone: {mass: 1e6}, block: {mass: 2, surfaces: {top: {plane: [0, 0, 0], normal: y}}}, ball: {mass: 3}}
joints:
  stone: {type: prismatic, parent: ground, child: stone, axis: y, q: y0}
  block: {type: prismatic, parent: ground, child: block, axis: y, q: y1}
  ball: {type: prismatic, parent: ground, child: ball, axis: y, q: y2}
contacts: {touch: {between: [ball, block.top]}}
"""


@pytest.mark.parametrize("angle", [1, 17, 35, 60, 61, 77, 90, 103, 120, 146, 179])
def test_a_rod_that_falls_along_a_smooth_wall_is_not_held_up_by_rounding(angle: int) -> None:
    run = mbs.simulate(mbs.loads(_ROD), parameters={"theta": f"{angle} deg"}, samples=6)
    assert np.allclose(run["y"], -5.0 * run.t**2, rtol=0.0, atol=1e-12)
    assert np.allclose(run["x"], run["x"][0], rtol=0.0, atol=1e-12)
    assert np.allclose(run["phi"], radians(angle), rtol=0.0, atol=1e-12)
    assert not run.events


@pytest.mark.parametrize("speed", ["0 m/s", "1 m/s", "-2 m/s"])
def test_a_rod_that_falls_with_the_block_beneath_it_goes_as_if_there_were_no_contact(speed: str) -> None:
    system = mbs.loads(_ON_BLOCK)
    run = mbs.simulate(system, parameters={"v": speed}, samples=6)
    alone = mbs.simulate(replace(system, contacts={}), parameters={"v": speed}, samples=6)
    for name in ("x1", "y1", "x2", "y2", "p2"):
        assert np.allclose(run[name], alone[name], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(("start", "time"), [({"y": 0.01}, 0.002**0.5), ({"u_y": 0.1}, 0.02)])
def test_a_ladder_lifted_off_the_floor_falls_back_on_it_along_its_wall(start: dict[str, float], time: float) -> None:
    run = mbs.simulate(mbs.load("examples/textbook/ladder.yaml"), initial=start, samples=6)
    first = next(event for event in run.events if event["element"] == "foot")
    assert first["t"] == pytest.approx(time, abs=1e-9)


def test_forces_are_measured_by_the_weight_of_what_touches_and_not_of_what_falls_elsewhere() -> None:
    mechanism = resolved(mbs.loads(_STONE))
    recalled = recall_laws(mechanism)
    laws = Laws(mechanism, recalled.compiled, recalled.metadata, np.array([10.0]))
    facts = laws.at(0.0, np.zeros(3), np.zeros(3), Scale(1.0, 1.0))
    assert facts.weights([0]) == pytest.approx(np.sqrt(1.0 / (1.0 / 3.0 + 1.0 / 2.0)) * np.sqrt(3.0 + 2.0) * 10.0)
