"""A wheel without a radius lies about its pulley, the mass that carries it hangs below, and its rope touches it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.drawing.look.settle import WHEEL
from multibody_sym.drawing.picture import Arc, Stroke

THREE = """
multibody_sym: 1
name: three_pulleys
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {p1: [0, 3, 0], p2: [1, 3, 0]}}
  a: {mass: 2}
  b: {mass: 3}
  c: {mass: 4}
joints:
  ja: {type: prismatic, parent: ground, child: a, axis: y, q: y1, initial: {q: 1}}
  jb: {type: prismatic, parent: ground, child: b, axis: y, q: y2, initial: {q: 1}}
  jc: {type: prismatic, parent: ground, child: c, axis: y, q: y3, initial: {q: 1.3}}
pulleys: {P1: {at: ground.p1}, P2: {at: ground.p2}, P3: {at: b}}
constraints: {rope: {type: rope, path: [a, P1, P3, P2, c]}}
"""


@pytest.mark.parametrize("apart", [1, 2])
def test_a_wheel_on_a_mass_is_about_its_place_and_the_rope_touches_all_wheels(apart: int) -> None:
    """Over ground's wheels the rope runs back at 1 m and bends at 2 m; on the load it bends in both."""
    marks = mbs.draw(mbs.loads(THREE.replace("p2: [1,", f"p2: [{apart},"))).picture.marks
    wheels = {m.name: m.centre for m in marks if isinstance(m, Arc) and m.radius == WHEEL}
    assert set(wheels) == {"P1", "P2", "P3"}
    middle = {m.name: m.points.mean(axis=0) for m in marks if isinstance(m, Stroke) and m.closed and m.name in "abc"}
    assert middle["b"][0] == pytest.approx(wheels["P3"][0], abs=0.1)
    lower = {name: middle[name][1] for name in "ab"}  # both places are 1 m high; b hangs on its wheel
    assert abs(wheels["P3"][1] - lower["a"]) < 1.0 < abs(lower["b"] - lower["a"])
    (rope,) = (np.asarray(m.points) for m in marks if isinstance(m, Stroke) and m.name == "rope")
    assert _distance(rope, wheels["P3"]) == pytest.approx(WHEEL, abs=0.1)
    for name in ("P1", "P2"):  # pieces that run back lie beside each other, not quite parallel
        assert _distance(rope, wheels[name]) == pytest.approx(WHEEL, abs=0.1 * WHEEL), name
    ways = [(b - a) / np.linalg.norm(b - a) for a, b in pairwise(rope) if np.linalg.norm(b - a) > 1e-6]
    assert min(float(one @ two) for one, two in pairwise(ways)) > 0.8  # it turns back nowhere but around wheels


def _distance(line: np.ndarray, point: np.ndarray) -> float:
    """Return how far a point is from a line of straight pieces."""
    found = []
    for a, b in pairwise(line):
        share = np.clip((point - a) @ (b - a) / max(float((b - a) @ (b - a)), 1e-12), 0, 1)
        found.append(float(np.linalg.norm(a + share * (b - a) - point)))
    return min(found)
