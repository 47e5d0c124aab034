"""Rods end where the points are drawn that they join, also at particles that are welded to ground."""

from __future__ import annotations

import numpy as np

import multibody_sym as mbs
from multibody_sym.pictures.page.picture import Arc

WELDED = """
multibody_sym: 1
name: welded
bodies: {A: {mass: 1}, B: {mass: 1}, C: {mass: 1}}
joints:
  jA: {type: fixed, parent: ground, child: A}
  jC: {type: prismatic, parent: ground, child: C, axis: x, q: xC, initial: {q: 2}}
  jB: {type: point, parent: ground, child: B, q: [x, y], initial: {q: [1, 0]}}
constraints:
  r1: {type: distance, between: [A, B], value: 1}
  r2: {type: distance, between: [B, C], value: 1}
"""


def test_two_rods_in_one_line_meet_at_their_particle() -> None:
    marks = mbs.draw(mbs.loads(WELDED)).picture.marks
    pins = [mark.points.mean(axis=0) for mark in marks if mark.role == "rod" and isinstance(mark, Arc)]
    (joint,) = (mark.points.mean(axis=0) for mark in marks if mark.name == "B" and isinstance(mark, Arc))
    ends = [sum(float(np.linalg.norm(pin - joint)) < 0.1 for pin in pins), len(pins)]
    assert ends == [2, 4]  # one end of each rod is on the particle between them
    assert max(abs(float(pin[1] - joint[1])) for pin in pins) < 0.1
