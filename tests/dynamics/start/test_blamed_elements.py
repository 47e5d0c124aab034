"""Where the laws leave no state at the start, the message names a smallest set of elements that cannot hold."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.errors import NoSolutionError

PARALLEL = """
multibody_sym: 1
name: two ropes
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {top: [0, 2, 0], p0: [0, 0, 0], p1: [0.6, 0, 0], p2: [1.2, 0, 0], p3: [1.8, 0, 0]}}
  b0: {mass: 0.5}
  b1: {mass: 0.5}
  b2: {mass: 0.5}
  b3: {mass: 2}
joints:
  j0: {type: prismatic, parent: ground.p0, child: b0, axis: -y, q: q0}
  j1: {type: prismatic, parent: ground.p1, child: b1, axis: x, q: q1}
  j2: {type: prismatic, parent: ground.p2, child: b2, axis: -y, q: q2, initial: {u: -1.032}}
  j3: {type: prismatic, parent: ground.p3, child: b3, axis: -y, q: q3}
pulleys: {P: {at: ground.top}}
constraints:
  fine: {type: rope, path: [b0, P, b1], slack: true}
  across: {type: rope, path: [b2, b3], slack: true}
"""


def test_the_rope_that_nothing_can_hold_is_named() -> None:
    """The rope between two vertical slides lies across both: no tension keeps its length as one of them moves."""
    with pytest.raises(NoSolutionError) as raised:
        mbs.solve(mbs.loads(PARALLEL))
    assert raised.value.where.path == ("constraints", "across")
    assert mbs.solve(mbs.loads(PARALLEL.replace("  across: {type: rope, path: [b2, b3], slack: true}\n", ""))).states
