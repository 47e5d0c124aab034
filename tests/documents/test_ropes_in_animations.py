"""Ropes of animations lead to bodies where these are drawn, at every instant, and round the wheels of figures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.documents.animation.animate import _line
from multibody_sym.documents.animation.frames import frames_of
from multibody_sym.pictures.marks.sheet import Sheet

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize("name", ["textbook/t7_atwood", "textbook/movable_pulley", "impacts/falling_load"])
def test_ends_hang_above_the_middle_of_their_bodies(name: str) -> None:
    system = mbs.load(EXAMPLES / f"{name}.yaml")
    frames = frames_of(mbs.simulate(system, samples=21, backend="python"))
    home = frames.placed[0]
    sheet = Sheet(frames.scene, home, home, frames.projection(None), others=frames.looked_at)
    (number,) = (k for k, each in enumerate(home.strands) if each.strand.kind == "rope")
    line, anchors = _line(frames, sheet, number), home.strands[number].strand.anchors
    for end, anchor in ((0, anchors[0]), (-1, anchors[-1])):
        if anchor.body < 0:
            continue
        for placed, points in zip(frames.placed, line, strict=True):
            body = sheet.moved(placed).at(anchor.body, np.zeros(3))
            assert abs(points[end][0] - body[0]) < 0.5
            assert 0.0 <= points[end][1] - body[1] < 30.0
