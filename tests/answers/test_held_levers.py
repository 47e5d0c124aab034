"""Coordinates that so many rows as coordinates join are held."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.redundancy import held_coordinates
from multibody_sym.dynamics.start.state import examined_state

TRUSS = """
multibody_sym: 1
name: truss
bodies:
  ground: {points: {far: [1, 0, 0]}}
  p: {mass: 1, inertia: {Izz: 1}, points: {end: [0.6, 0, 0]}}
  q: {mass: 1, inertia: {Izz: 1}, points: {end: [0.8, 0, 0]}}
  r: {mass: 1, inertia: {Izz: 1}}
joints:
  A: {type: revolute, parent: ground, child: p, axis: z, q: one, initial: {q: 0.9}}
  B: {type: revolute, parent: ground.far, child: q, axis: z, q: two, initial: {q: 2.5}}
  C: {type: revolute, parent: ground, child: r, axis: z, q: free, initial: {u: 1}}
JOINED
"""
PIN = "  D: {type: revolute, parent: p.end, child: q.end, axis: z}"
ROD = "constraints: {rod: {type: distance, between: [p.end, q.end], value: LENGTH}, OTHER}"
OTHER = "other: {type: distance, between: [p.end, ground.far], value: 0.75}"


@pytest.mark.parametrize(
    ("joined", "held"),
    [
        (PIN, {0, 1}),
        (ROD.replace("LENGTH", "0.3").replace("OTHER", OTHER), {0, 1}),
        (ROD.replace("LENGTH", "0.3 + t/9").replace("OTHER", OTHER), {0}),
        (ROD.replace("LENGTH", "0.3").replace(", OTHER", ""), set()),
    ],
)
def test_what_so_many_rows_as_coordinates_join_is_held(joined: str, held: set[int]) -> None:
    mechanism, begin = examined_state(mbs.loads(TRUSS.replace("JOINED", joined))).in_joints
    assert held_coordinates(mechanism, begin.q, begin.parameters) == held
