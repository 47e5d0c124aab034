"""Contacts that carry nothing, since what touches falls freely: by the same model without them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.contact.contact_problem import Scale
from multibody_sym.mechanics.resolve import mechanism as resolved
from multibody_sym.motion.prepare.problem import recall_laws
from multibody_sym.motion.switching.law_values import Laws

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


@pytest.mark.parametrize("speed", ["0 m/s", "1 m/s", "-2 m/s"])
def test_a_rod_that_falls_with_the_block_beneath_it_goes_as_if_there_were_no_contact(speed: str) -> None:
    system = mbs.loads(_ON_BLOCK)
    run = mbs.simulate(system, parameters={"v": speed}, samples=6)
    alone = mbs.simulate(replace(system, contacts={}), parameters={"v": speed}, samples=6)
    for name in ("x1", "y1", "x2", "y2", "p2"):
        assert np.allclose(run[name], alone[name], rtol=0.0, atol=1e-12)


def test_forces_are_measured_by_the_weight_of_what_touches_and_not_of_what_falls_elsewhere() -> None:
    mechanism = resolved(mbs.loads(_STONE))
    recalled = recall_laws(mechanism)
    laws = Laws(mechanism, recalled.compiled, recalled.metadata, np.array([10.0]))
    facts = laws.at(0.0, np.zeros(3), np.zeros(3), Scale(1.0, 1.0))
    assert facts.weights([0]) == pytest.approx(np.sqrt(1.0 / (1.0 / 3.0 + 1.0 / 2.0)) * np.sqrt(3.0 + 2.0) * 10.0)
