"""Figures speak in the letters of the problem: all that is asked is in the figure or its legend, over nothing else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from geometry import faults, shown, texts

import multibody_sym as mbs
from multibody_sym.pictures.draw import FigureContent, contains, draw
from multibody_sym.pictures.marks.labels import is_alone
from multibody_sym.pictures.page.picture import (
    COORDINATE,
    FORCE,
    REACTION,
    VELOCITY,
    Arc,
    Arrow,
    Picture,
    Run,
    Stroke,
    formula,
    letters,
)
from multibody_sym.pictures.scene.scene import Scene, scene_of

ROOT = Path(__file__).parents[2] / "examples"
EXAMPLES = sorted(ROOT.rglob("*.yaml"))
LEGIBLE = 6.0
"""The least size (pt) of letters in a figure that is printed 80 mm wide."""
COLUMN = 80.0 * 72.0 / 25.4


def lacking(scene: Scene, picture: Picture) -> list[str]:
    """Return the names in a model's questions whose letters are neither in the figure nor in its legend."""
    runs = [text.runs for text in texts(picture)]

    def written(*ways: tuple[Run, ...]) -> bool:
        return any(contains(each, way) for each in runs for way in ways)

    coordinates = [c.name for c in scene.mechanism.coordinates if c.name in scene.asked]
    givens = [each.letter for each in scene.givens if each.name in scene.asked]
    items = [i for i in scene.items if i.role in ("joint", "pulley", "contact")]
    named = [i for i in (*items, *scene.strands) if i.name in scene.asked]
    return [
        *(name for name in (*coordinates, *givens) if not written(letters(name))),
        *(i.name for i in named if not (is_alone(scene, i) or written(letters(i.name), ((i.name, "small"),)))),
    ]


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_shows_what_is_asked_and_no_letters_over_others_or_over_lines(path: Path) -> None:
    scene = scene_of(mbs.load(path))
    picture = draw(scene, scene.at())
    assert lacking(scene, picture) == []
    assert faults(picture) == []
    assert 10.0 * min(1.0, COLUMN / picture.width) >= LEGIBLE - 0.05


def test_a_body_has_the_letter_of_its_mass_and_springs_and_contacts_those_of_their_laws() -> None:
    text = """
multibody_sym: 1
name: lettered
parameters: {M: 2 kg, k: 3 N/m, c: 1 N*s/m, mu_s: 0.4, mu_k: 0.3, F: 2 N, w: 3 rad/s, beta: 30 deg, x0: 20 cm, J: 1}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  block: {mass: M}
  load: {mass: 2 kg}
  wheel: {mass: 1 kg, inertia: {Izz: 1}, label: W}
joints:
  guide: {type: prismatic, parent: ground, child: block, axis: x, q: x, initial: {q: x0}}
  slide: {type: prismatic, parent: block, child: load, axis: x, q: s}
  A: {type: revolute, parent: ground, child: wheel, q: phi}
contacts: {touch: {between: [load, ground.floor], static: mu_s, kinetic: mu_k, restitution: 0.5}}
forces:
  damped: {type: spring_damper, joint: guide, stiffness: k, damping: c}
  drive: {type: torque, joint: guide, value: F*sin(w*t)}
  pull: {type: force, on: load, value: [F*cos(beta), F*sin(beta), 0]}
ask: {T: fx(slide)*J}
"""
    scene = scene_of(mbs.loads(text))
    picture = draw(scene, scene.at())
    written = {shown(each) for each in texts(picture)}
    assert {"M", "W", "A", "k", "c", "μs, μk, e = 0.5", "F\u2009sin(w\u2009t)", "F", "β"} <= written
    assert {"x", "x0"} <= written
    assert not {"block", "load", "wheel", "guide", "damped", "drive", "pull", "touch", "floor", "slide"} & written
    assert [shown(each) for each in texts(picture) if each.role == "legend"] == ["J = 1"]
    every = " ".join(shown(each) for each in texts(draw(scene, scene.at(), shown=FigureContent(names="all"))))
    assert {"block", "load", "guide", "damped"} <= set(every.split())
    none = draw(scene, scene.at(), shown=FigureContent(names="none"))
    assert {shown(each) for each in texts(none)} <= {"F", "F\u2009sin(w\u2009t)"}


@pytest.mark.parametrize("names", [True, "some", np.array(["all"]), None])
def test_other_words_for_names_are_refused(names: object) -> None:
    with pytest.raises(mbs.ArgumentError, match="names: expected letters, all, none, got"):
        mbs.draw(mbs.load(ROOT / "pendulum.yaml"), names=names)  # type: ignore[arg-type]


def test_named_lengths_can_be_left_out_apart_from_letters() -> None:
    scene = scene_of(mbs.load(ROOT / "four_bar.yaml"))
    picture = draw(scene, scene.at(), shown=FigureContent(dimensions=False))
    assert not [mark for mark in picture.marks if mark.role == "dimension"]
    assert {"A", "B", "C", "D"} <= {shown(each) for each in texts(picture)}
    assert not any(each.endswith(" m") for each in map(shown, texts(picture)))  # nor their numbers in the legend


def test_an_expression_is_set_with_numbers_letters_and_functions_in_this_order() -> None:
    assert "".join(run for run, _ in formula("2*F*sin(w*t)")) == "2\u2009F\u2009sin(w\u2009t)"
    assert "".join(run for run, _ in formula("t*v*sin(t*w)")) == "v\u2009t\u2009sin(w\u2009t)"
    assert formula("mu_s, e") == (("μ", "italic"), ("s", "subscript"), (", ", "roman"), ("e", "italic"))
    assert formula("rod end") == (("rod end", "roman"),)


def legend_of(text: str) -> tuple[Picture, set[str], str]:
    scene = scene_of(mbs.loads("multibody_sym: 1\nname: drawn\n" + text))
    picture = draw(scene, scene.at())
    entries = " ".join(shown(each) for each in texts(picture) if each.role == "legend")
    return picture, {shown(each) for each in texts(picture) if each.role != "legend"}, entries


def test_words_and_what_follows_from_others_stand_nowhere_unless_they_are_asked_about() -> None:
    _, written, legend = legend_of("""
parameters: {l: 1 m, start: 10 deg, bend: 20 deg, b: 30 deg, W: 3 rad/s, spin: 2*W, T: 2*W, n: W/2}
bodies: {arm: {mass: 1, com: [0, -l, 0], points: {end: [0, -l, 0]}}, link: {mass: 1, com: [0, -l, 0]},
         last: {mass: 1, com: [l, 0, 0]}, driven: {mass: 1, com: [l, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: arm, q: theta, initial: {q: start}}
  link_1: {type: revolute, parent: arm.end, child: link, initial: {q: bend}}
  link_2: {type: revolute, parent: arm.end, child: last, initial: {q: b}}
  B: {type: revolute, parent: ground, child: driven, motion: W*t}
ask: {n: n}
""")
    assert {"θ", "b", "W"} <= written
    assert not any(word in each for each in written for word in ("start", "bend", "link1", "link_1", "="))
    assert legend == "n = 1.5"


def test_a_speed_of_an_expression_at_an_angle_has_the_letter_of_the_angle() -> None:
    _, written, legend = legend_of("""
parameters: {E: 2, a: 40 deg}
bodies: {star: {mass: 1}}
joints: {j: {type: point, parent: ground, child: star, q: [x, y], initial: {u: [sqrt(2*E)*cos(a), sqrt(2*E)*sin(a)]}}}
""")
    assert {"v0", "a"} <= written
    assert legend == "E = 2"


def test_angles_at_the_start_are_arcs_of_tops_of_particles_and_of_arms_without_a_size() -> None:
    inertia = "{Ixx: 1, Iyy: 1, Izz: 1}"
    top = "{type: spherical, angles: zxz, parent: ground, child: top, q: [psi, nod, phi], initial: {q: [0, theta, 0]}}"
    for text, angle, turned in (
        (
            f"bodies: {{top: {{mass: 1, com: [0, 0, 1], inertia: {inertia}}}}}\njoints: {{tip: {top}}}",
            "θ",
            None,
        ),
        (
            "bodies: {bob: {mass: 1}}\njoints: {j: {type: point, parent: ground, child: bob, q: [x, y],"
            " initial: {q: [2*sin(theta), -2*cos(theta)]}}}\nconstraints: {s: {type: rope, path: [ground, bob]}}",
            "θ",
            None,
        ),
        (
            "bodies: {arm: {}, bob: {mass: 1}}\njoints: {h: {type: revolute, parent: ground, child: arm, q: phi,"
            " initial: {q: theta}}, r: {type: prismatic, parent: arm, child: bob, axis: -y, q: r, initial: {q: 2}}}",
            "φ = θ",
            0.7,
        ),
    ):
        picture, written, legend = legend_of(f"gravity: [0, -9.81, 0]\nparameters: {{theta: 0.7 rad}}\n{text}")
        assert angle in written
        assert not legend
        arcs = [mark for mark in picture.marks if isinstance(mark, Arrow) and mark.role == "angle"]
        assert arcs
        if turned is not None:  # the arc spans the angle that the model gives
            points = np.asarray(arcs[0].points)
            chord = float(np.linalg.norm(points[-1] - points[0]))
            steps = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
            assert chord / steps == pytest.approx(np.sin(turned / 2) / (turned / 2), rel=1e-3)


def test_a_slider_has_the_speed_of_its_start_by_its_letter_or_v_0() -> None:
    text = """
parameters: {{v: 2 m/s}}
bodies: {{block: {{mass: 1}}}}
joints: {{guide: {{type: prismatic, parent: ground, child: block, axis: x, q: x, initial: {{u: {speed}}}}}}}
"""
    picture, written, legend = legend_of(text.format(speed="-v"))
    (arrow,) = [mark for mark in picture.marks if isinstance(mark, Arrow) and mark.role == "velocity"]
    assert "v" in written
    assert not legend
    assert arrow.points[1][0] < arrow.points[0][0]
    picture, _, _ = legend_of(text.format(speed="2"))
    (arrow,) = [mark for mark in picture.marks if isinstance(mark, Arrow) and mark.role == "velocity"]
    assert arrow.points[1][0] > arrow.points[0][0]
    assert "v0" in {shown(each) for each in texts(picture)}
    picture, _, _ = legend_of(text.format(speed="0"))
    assert not [mark for mark in picture.marks if mark.role == "velocity"]


def test_a_driven_trolley_without_a_size_is_drawn() -> None:
    _, written, _ = legend_of("""
gravity: [0, -9.81, 0]
parameters: {a: 0.6 m/s^2, M: 2 kg}
bodies: {trolley: {mass: M}}
joints: {rail: {type: prismatic, parent: ground, child: trolley, axis: x, motion: a*t^2/2}}
""")
    assert "M" in written


@pytest.mark.parametrize(
    ("normal", "value", "pushes"),
    [("[0, 1, 0]", "[F, 0, 0]", False), ("[-sin(a), cos(a), 0]", "[-F, 0, 0]", True)],
    ids=["pulled", "pushed"],
)
def test_a_force_on_a_block_is_outside_of_it(normal: str, value: str, *, pushes: bool) -> None:
    """A pulled block is left at its edge; a wedge is pushed at its upright side, not at its slope."""
    picture, _, _ = legend_of(f"""
gravity: [0, -9.81, 0]
parameters: {{F: 5 N, a: 30 deg}}
bodies: {{block: {{mass: 2, surfaces: {{top: {{plane: [0, 0.2, 0], normal: {normal}}}}}}}, load: {{mass: 1}}}}
joints:
  table: {{type: prismatic, parent: ground, child: block, axis: x, q: x}}
  load: {{type: point, parent: block, child: load, q: [bx, by], initial: {{q: [0, 0.2]}}}}
contacts: {{c: {{between: [load, block.top], static: 0.9}}}}
forces: {{push: {{type: force, on: block, value: {value}}}}}
""")
    (arrow,) = [mark for mark in picture.marks if isinstance(mark, Arrow) and mark.role == "force"]
    bodies = [m for m in picture.marks if isinstance(m, Stroke) and m.closed and m.role == "body" and m.name == "block"]
    right = max(float(np.asarray(mark.points)[:, 0].max()) for mark in bodies)
    near = 1 if pushes else 0
    assert arrow.points[near][0] == pytest.approx(right, abs=0.1)
    assert arrow.points[1 - near][0] > right + 20.0


# ----------------------------------------------------------------------------------------------------------------------
# Forces, velocities and coordinates: told apart in colour, by eyes without red or green cones, and in grey.


PROTAN = [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
DEUTAN = [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
"""Linear sRGB as seen by protan and deutan eyes: Machado, Oliveira, Fernandes 2009, severity 1."""
APART = 25.0


def linear(colour: str) -> np.ndarray:
    values = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def lab(rgb: np.ndarray) -> np.ndarray:
    """Return CIE L*a*b* (D65) of linear sRGB."""
    to_xyz = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
    ratio = np.array(to_xyz) @ np.clip(rgb, 0.0, 1.0) / [0.95047, 1.0, 1.08883]
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def ciede2000(one: np.ndarray, two: np.ndarray) -> float:
    """Return the colour difference of two L*a*b* (Sharma, Wu, Dalal 2005)."""
    lightness, a, b = np.array([one, two]).T
    g = 0.5 * (1 - np.sqrt((c7 := np.hypot(a, b).mean() ** 7) / (c7 + 25.0**7)))
    a = (1 + g) * a
    chroma, hue = np.hypot(a, b), np.degrees(np.arctan2(b, a)) % 360
    bright, grey = lightness.mean(), chroma.prod() == 0
    turn = 0.0 if grey else (hue[1] - hue[0] + 180) % 360 - 180
    middle = hue.sum() if grey else (hue[0] + turn / 2) % 360
    weights = ((-0.17, 1, -30), (0.24, 2, 0), (0.32, 3, 6), (-0.20, 4, -63))
    t = 1 + sum(w * np.cos(np.radians(n * middle + shift)) for w, n, shift in weights)
    c = chroma.mean()
    spans = (
        (lightness[1] - lightness[0]) / (1 + 0.015 * (bright - 50) ** 2 / np.sqrt(20 + (bright - 50) ** 2)),
        (chroma[1] - chroma[0]) / (1 + 0.045 * c),
        2 * np.sqrt(chroma.prod()) * np.sin(np.radians(turn / 2)) / (1 + 0.015 * c * t),
    )
    angle = 30 * np.exp(-(((middle - 275) / 25) ** 2))
    twist = -np.sin(np.radians(2 * angle)) * 2 * np.sqrt(c**7 / (c**7 + 25.0**7))
    return float(np.sqrt(sum(span**2 for span in spans) + twist * spans[1] * spans[2]))


def test_the_difference_of_colours_is_that_of_published_pairs() -> None:
    """Rows 1, 7, 17 and 25 of the table of Sharma, Wu and Dalal."""
    for one, two, apart in (
        ((50, 2.6772, -79.7751), (50, 0, -82.7485), 2.0425),
        ((50, 0, 0), (50, -1, 2), 2.3669),
        ((50, 2.5, 0), (73, 25, -18), 27.1492),
        ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644),
    ):
        assert ciede2000(np.array(one), np.array(two)) == pytest.approx(apart, abs=1e-4)


@pytest.mark.parametrize("eyes", [np.eye(3), PROTAN, DEUTAN], ids=["normal", "protan", "deutan"])
def test_forces_velocities_and_coordinates_differ_for_all_eyes(eyes: list[list[float]]) -> None:
    pens = (FORCE, VELOCITY, COORDINATE, REACTION)
    colours = [lab(np.array(eyes) @ linear(pen.colour)) for pen in pens]
    for k, one in enumerate(colours):
        assert all(ciede2000(one, other) >= APART for other in colours[:k])


@pytest.mark.parametrize("pen", [FORCE, VELOCITY, COORDINATE, REACTION])
def test_letters_have_contrast_on_paper(pen: object) -> None:
    luminance = linear(pen.colour) @ [0.2126, 0.7152, 0.0722]  # type: ignore[attr-defined]
    assert 1.05 / (luminance + 0.05) >= 4.5


def test_forces_velocities_and_coordinates_are_told_apart_in_grey() -> None:
    """A force is thick with a filled head, a velocity has an open one, a coordinate is thin and begins at a dot."""
    scene = scene_of(mbs.load(ROOT / "questions/over_a_wall.yaml"))
    thrown = draw(scene, scene.at())
    (velocity,) = [mark for mark in thrown.marks if isinstance(mark, Arrow) and mark.role == "velocity"]
    scene = scene_of(mbs.load(ROOT / "questions/driven_oscillator.yaml"))
    driven = draw(scene, scene.at())
    (force,) = [mark for mark in driven.marks if isinstance(mark, Arrow) and mark.role == "force"]
    (coordinate,) = [mark for mark in driven.marks if isinstance(mark, Arrow) and mark.role == "coordinate"]
    (datum,) = [mark for mark in driven.marks if isinstance(mark, Arc) and mark.role == "coordinate"]
    assert np.allclose(datum.centre, coordinate.points[0])
    assert (velocity.open, force.open, coordinate.open) == (True, False, False)
    assert force.pen.width > 2 * coordinate.pen.width
    assert not force.pen.dash


def test_an_angle_at_the_start_is_drawn_by_its_letter_and_later_by_its_coordinate() -> None:
    scene = scene_of(mbs.load(ROOT / "oscillations/governor.yaml"))
    start, later = (draw(scene, scene.at(t=t)) for t in (0.0, 0.1))
    assert "θ = α" in {shown(each) for each in texts(start)}
    assert {"θ"} <= {shown(each) for each in texts(later)}
    ladder = scene_of(mbs.load(ROOT / "textbook/ladder.yaml"))
    (angle,) = [each for each in texts(draw(ladder, ladder.at())) if each.role == "angle"]
    assert shown(angle) == "θ"
