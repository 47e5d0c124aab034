"""Ropes end in their loads and are tangent to their wheels, rods end at their points: in figures, films and pages."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from strand_geometry import page_data, page_faults, strand_faults

import multibody_sym as mbs
from multibody_sym.documents.animation.frames import frames_of
from multibody_sym.pictures.marks.sheet import Sheet, points_drawn
from multibody_sym.pictures.page.picture import Projection
from multibody_sym.pictures.scene.scene import scene_of

ROOT = Path(__file__).parents[2] / "examples"
NAMES = sorted(str(path.relative_to(ROOT).with_suffix("")) for path in ROOT.rglob("*.yaml"))
WORDS = ("type: rope", "type: distance", "type: spring", "type: damper")
HELD = [name for name in NAMES if any(w in (ROOT / f"{name}.yaml").read_text(encoding="utf-8") for w in WORDS)]
MOVING = {"swinging_atwood", "textbook/yo_yo", "textbook/movable_pulley"}
"""A bob that goes once around its wheel, a drum that hangs and turns, a wheel that moves."""
ROWS = 20


@pytest.mark.parametrize("name", HELD)
def test_strands_of_a_figure(name: str) -> None:
    system = mbs.load(ROOT / f"{name}.yaml")
    scene = scene_of(system)
    home = scene.at()
    seen = Projection(scene.view.right, scene.view.up, 1.0, scene.plane).scaled(points_drawn(scene, home))
    assert list(strand_faults(system, Sheet(scene, home, home, seen))) == []


@pytest.mark.parametrize("name", [n if n in MOVING else pytest.param(n, marks=pytest.mark.long) for n in HELD])
def test_strands_of_a_film_and_a_page(name: str) -> None:
    system = mbs.load(ROOT / f"{name}.yaml")
    run = mbs.simulate(system, samples=41)
    frames = frames_of(run)
    home, seen = frames.placed[0], frames.projection()
    for placed in frames.placed[:: len(frames.placed) // ROWS]:
        sheet = Sheet(frames.scene, placed, home, seen, others=frames.looked_at)
        assert list(strand_faults(system, sheet)) == [], placed.time
    if frames.scene.plane:
        sheet = Sheet(frames.scene, home, home, frames.window(seen).projection, others=frames.looked_at)
        rows = np.unique(np.linspace(0, len(frames.times) - 1, ROWS).astype(int))
        assert list(page_faults(system, sheet, page_data(mbs.animate(run).html), [int(k) for k in rows])) == []
