"""The legend of a figure with more lengths than it has room for: where the centres of mass of its bodies are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from geometry import faults, shown, texts

import multibody_sym as mbs
from multibody_sym.pictures.draw import draw, legend_lines
from multibody_sym.pictures.page.picture import Arrow, words
from multibody_sym.pictures.scene.scene import scene_of

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_the_squeezer_has_its_centres_of_mass_in_a_legend_and_the_other_lengths_in_the_figure() -> None:
    scene = scene_of(mbs.load(EXAMPLES / "andrews_squeezer.yaml"))
    picture = draw(scene, scene.at())
    assert faults(picture) == []
    told = " ".join(shown(text) for text in texts(picture) if text.role == "legend")
    assert told == (
        "centres of mass, in the axes of their bodies: K1 (ra, 0), K2 (−da, 0), K3 (sb, −sa), K4 (0, ea − e), "
        "K5 (ta, tb), K6 (zf − fa, 0), K7 (ua, ub)"
    )
    lengths = {each.name for each in scene.dimensions}
    written = {text.name for text in texts(picture)}
    assert lengths - written == {name for name in lengths if name.endswith(".com")}
    bottom = min(text.at[1] for text in texts(picture) if text.role != "legend")
    assert all(text.at[1] < bottom for text in texts(picture) if text.role == "legend")


def test_letters_of_an_angle_that_is_zero_stand_at_their_own_hinge() -> None:
    """The crank of the squeezer is 7 mm long: its letters stood at its other end, where the next angle is counted."""
    scene = scene_of(mbs.load(EXAMPLES / "andrews_squeezer.yaml"))
    picture = draw(scene, scene.at())
    middles = {
        text.name: np.array([text.box.left + text.box.right, text.box.bottom + text.box.top]) / 2
        for text in texts(picture)
        if text.role == "angle"
    }
    bows = {m.name: np.asarray(m.points) for m in picture.marks if isinstance(m, Arrow) and m.role == "angle"}
    pins = {mark.name: mark.centre for mark in picture.simple if mark.role == "joint" and hasattr(mark, "centre")}
    for angle, own in (("beta", "O"), ("theta", "O1")):
        radii = np.linalg.norm(bows[angle] - pins[own], axis=1)
        assert np.ptp(radii) < 1e-6
        assert radii[0] < 25.0
        assert np.linalg.norm(bows[angle] - middles[angle], axis=1).min() < 25.0


def test_a_few_lengths_stay_in_the_figure_and_long_legends_end() -> None:
    scene = scene_of(mbs.load(EXAMPLES / "oscillations/coupled_pendulums.yaml"))
    assert not [text for text in texts(draw(scene, scene.at())) if text.role == "legend"]
    lines = ["".join(run for run, _ in note.runs) for note in legend_lines("x", "all: ", [words("a" * 20)] * 60)]
    assert len(lines) == 6
    assert lines[0].startswith("all: aaa")
    assert lines[1].startswith("aaa")
    assert lines[-1].endswith("..")
