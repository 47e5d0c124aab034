"""The `impact:` section: what is read, written back, and refused with its place."""

from __future__ import annotations

import pytest

import multibody_sym as mbs

HEAD = """multibody_sym: 1
name: struck
parameters: {e: 2}
bodies:
  a: {mass: 1, points: {p: [1, 0, 0]}}
  b: {mass: 2}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: x, initial: {u: 1}}
  B: {type: prismatic, parent: ground, child: b, axis: x}
"""


@pytest.mark.parametrize(
    "section",
    [
        "{between: [a, b], normal: -x, restitution: 1}",
        "{between: [a, b], normal: -x, restitution: 1, law: poisson, sequence: simultaneous}",
        "{first: {between: [a, b], normal: -x, static: 0.1}, push: {impulse: [1, 0, 0], at: b}, law: newton}",
        "{impulse: {couple: [0, 0, 1], on: b}}",
        "closing",
        "{}",
    ],
)
def test_what_is_read_is_written_back(section: str) -> None:
    system = mbs.loads(f"{HEAD}impact: {section}\n")
    assert mbs.loads(mbs.dumps(system)) == system
    assert system.impact is not None
