"""Every example has a scene with all that it declares; ropes are as long as they are, poses those of kinematics."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.mechanics.changes import with_settings
from multibody_sym.model.constraints import Rope
from multibody_sym.pictures.draw import scene_marks
from multibody_sym.pictures.marks.sheet import points_drawn
from multibody_sym.pictures.marks.symbols import SYMBOLS
from multibody_sym.pictures.page.picture import Projection, Wish
from multibody_sym.pictures.scene.items import Symbol
from multibody_sym.pictures.scene.scene import Scene, scene_of

ROOT = Path(__file__).parents[2] / "examples"
EXAMPLES = sorted(str(path.relative_to(ROOT).with_suffix("")) for path in ROOT.rglob("*.yaml"))
SOME = {
    *("andrews_squeezer", "bicycle", "slider_crank", "spatial_four_bar", "governor", "guides/brachistochrone"),
    *("textbook/heavy_pulley", "textbook/two_drums", "textbook/t6_double_incline", "textbook/movable_pulley"),
    *("oscillations/governor", "oscillations/triatomic_molecule", "variable_mass/folded_chain", "kepler"),
}
ALL = [name if name in SOME else pytest.param(name, marks=pytest.mark.long) for name in EXAMPLES]


@cache
def drawn(name: str) -> tuple[mbs.System, Scene]:
    system = mbs.load(ROOT / f"{name}.yaml")
    return system, scene_of(system)


@pytest.mark.parametrize("name", ALL)
def test_all_that_is_declared_is_in_the_scene(name: str) -> None:
    system, scene = drawn(name)
    paths = {thing.path[:2] for thing in (*scene.items, *scene.strands, *scene.arrows)}
    for group in ("bodies", "joints", "constraints", "pulleys", "contacts", "forces"):
        for element in getattr(system, group):
            if (group, element) != ("bodies", "ground"):
                assert (group, element) in paths


@pytest.mark.parametrize("name", ALL)
def test_marks_of_an_example_are_finite_and_name_its_bodies(name: str) -> None:
    _, scene = drawn(name)
    placed = scene.at()
    assert np.all(np.isfinite(placed.poses))
    seen = Projection(scene.view.right, scene.view.up, 1.0, scene.plane).scaled(points_drawn(scene, placed))
    marks = scene_marks(scene, placed, seen)
    for mark in marks:
        places = [getattr(mark, key) for key in ("points", "centre", "at", "a", "b", "about") if hasattr(mark, key)]
        assert all(np.all(np.isfinite(place)) for place in places), mark
    bodies = {item.name for item in scene.items if item.role == "body"}
    assert bodies <= {mark.name for mark in marks if isinstance(mark, Wish) and mark.role == "body"}


@pytest.mark.parametrize("name", [name for name in EXAMPLES if "type: rope" in (ROOT / f"{name}.yaml").read_text()])
def test_a_rope_is_drawn_as_long_as_it_is(name: str) -> None:
    system, scene = drawn(name)
    known = dict(zip((entry.name for entry in scene.mechanism.parameters), scene.begin.parameters, strict=True))
    for placed in scene.at().strands:
        rope = system.constraints.get(placed.strand.name)
        if not isinstance(rope, Rope) or rope.wind or f"length of {placed.strand.name}" not in known:
            continue
        assert placed.length == pytest.approx(known[f"length of {placed.strand.name}"])


def test_a_rope_keeps_its_length_while_one_load_falls_as_the_other_rises() -> None:
    _, scene = drawn("textbook/heavy_pulley")
    names = [coordinate.name for coordinate in scene.mechanism.coordinates]
    for way in (-0.4, 0.1, 0.5):
        values = {"phi": way / 0.1, "y1": way, "y2": -way}
        (rope,) = scene.at([values[name] for name in names]).strands
        assert rope.length == pytest.approx(2 * 2.0 + np.pi * 0.1)


@pytest.mark.parametrize(
    ("name", "point", "coordinates"),
    [
        pytest.param("four_bar", "rocker.end", "relative", marks=pytest.mark.long),
        ("furuta", "rod.com", "relative"),
        ("double_pendulum", "lower.com", "absolute"),
    ],
)
def test_poses_are_those_of_outputs_at_three_instants(name: str, point: str, coordinates: str) -> None:
    system = mbs.load(ROOT / f"{name}.yaml")
    outputs = {f"p_{axis}": f"position({point}, {axis})" for axis in "xyz"}
    system = with_settings(replace(system, outputs=outputs), {"coordinates": coordinates})
    run = mbs.simulate(system, t_end=0.2, samples=3)
    scene = scene_of(system)
    body, _, place = point.partition(".")
    number = scene.bodies.index(body)
    own = {"end": (0.4, 0.0, 0.0), "com": (0.0, 0.0, -0.15) if name == "furuta" else (0.0, -1.0, 0.0)}[place]
    for k in range(3):
        found = scene.at(run.q[k], run.u[k], run.t[k]).world(number, np.array([own]))[0]
        assert found == pytest.approx([run[f"p_{axis}"][k] for axis in "xyz"], abs=1e-12)


def test_names_of_symbols_have_looks() -> None:
    items = [item for name in sorted(SOME & set(EXAMPLES)) for item in drawn(name)[1].items]
    kinds = {item.form.kind for item in items if isinstance(item.form, Symbol)}
    assert kinds <= set(SYMBOLS)
