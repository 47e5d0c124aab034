"""Every example has a figure in which no letters lie over anything, nothing is cut off, and all that is declared is."""

from __future__ import annotations

from pathlib import Path

import pytest
from geometry import faults, shown, texts

import multibody_sym as mbs
from multibody_sym.pictures.draw import draw
from multibody_sym.pictures.page.picture import Picture, letters
from multibody_sym.pictures.scene.items import Axes
from multibody_sym.pictures.scene.scene import Scene, scene_of

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").rglob("*.yaml"))
TENTH = EXAMPLES[::6]
WIDEST, HIGHEST = 430.0, 430.0
INSTANTS = (13, 37)
"""Hundredths of a second after the start at which figures are looked at too; every example moves for that long."""


def missing(scene: Scene, picture: Picture) -> list[str]:
    """Return what is declared and not drawn: bodies, joints that are no freedom alone, named lengths and angles."""
    drawn = {name for _, name in picture.boxes()}
    legend = "".join(shown(text) for text in texts(picture) if text.role == "legend")
    told = {each.name for each in scene.dimensions if each.name.endswith(".com") and each.component}
    told = {name for name in told if f"{shown_name(name)} (" in legend}
    written = {text.name for text in texts(picture)} | told
    unseen = ("free", "hanger")  # the freedoms of a particle: its carriers have no mass
    signs = [item for item in scene.items if item.role == "joint" and getattr(item.form, "kind", "") not in unseen]
    asked = scene.asked
    turns = {each.name for each in scene.angles}  # a coordinate that an angle shows
    joints = {i.name for i in signs if not isinstance(i.form, Axes) or asked.intersection(i.form.names) - turns}
    floors = {i.name for i in scene.items if i.role == "guide" and i.on_ground}
    joints -= floors if floors & drawn else set()  # sliders on one line share a floor
    lengths = {each.name for each in scene.dimensions}
    return [*sorted(joints - drawn), *sorted(lengths - written)]


def shown_name(name: str) -> str:
    return "".join(run for run, _ in letters(name.removesuffix(".com")))


def wrong(scene: Scene, picture: Picture) -> list[str]:
    told = [f"a page of {picture.width:.0f} x {picture.height:.0f} pt"]
    large = told if picture.width > WIDEST or picture.height > HIGHEST else []
    return [*faults(picture), *missing(scene, picture), *large]


@pytest.mark.parametrize("path", TENTH, ids=lambda path: path.stem)
def test_the_start_of_an_example(path: Path) -> None:
    scene = scene_of(mbs.load(path))
    assert wrong(scene, draw(scene, scene.at())) == []


@pytest.mark.long
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_at_three_instants(path: Path) -> None:
    system = mbs.load(path)
    scene = scene_of(system)
    found = {0.0: wrong(scene, draw(scene, scene.at()))}
    run = mbs.simulate(system, t_end=0.4, samples=41)
    for k in (min(instant, len(run.t) - 1) for instant in INSTANTS):
        placed = scene.at(run.q[k], run.u[k], float(run.t[k]))
        found[float(run.t[k])] = wrong(scene, draw(scene, placed))
    assert {t: what for t, what in found.items() if what} == {}
