"""Lengths stand outside of bodies, angles have two sides, coordinates stand beside their own body."""

from __future__ import annotations

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.pictures.draw import draw
from multibody_sym.pictures.page.picture import Arc, Arrow, Hatch, Picture, Stroke, TextMark
from multibody_sym.pictures.scene.scene import scene_of


def drawn(text: str) -> Picture:
    scene = scene_of(mbs.loads("multibody_sym: 1\nname: drawn\ngravity: [0, -9.81, 0]\n" + text))
    return draw(scene, scene.at())


def words(mark: TextMark) -> str:
    return "".join(run for run, _ in mark.runs)


def texts(shown: Picture, *, legend: bool = False) -> dict[str, TextMark]:
    return {words(m): m for m in shown.marks if isinstance(m, TextMark) and (m.role == "legend") == legend}


def lines(shown: Picture, role: str, name: str = "") -> list[np.ndarray]:
    """Return the arrows, strokes and arcs of a role as points."""
    kinds = (Arrow, Stroke, Arc, Hatch)
    own = (m for m in shown.marks if m.role == role and name in ("", m.name))
    return [np.asarray(m.points) for m in own if isinstance(m, kinds)]


def box(shown: Picture, name: str) -> np.ndarray:
    every = np.vstack(lines(shown, "body", name))
    return np.array([every.min(axis=0), every.max(axis=0)])


BOX = """
parameters: {m: 2 kg, h: 1 m, b: 0.6 m, y: 0.8 m, F: 5 N, beta: 70 deg, l: 2 m}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  box: {shape: {box: [b, h, 0.4 m], mass: m}, points: {hook: [b/2, y - h/2, 0]}}
joints: {free: {type: planar, parent: ground, child: box, initial: {q: [0, h/2, 0]}}}
contacts: {c: {between: [box, ground.floor]}}
forces: {pull: {type: force, on: box.hook, value: [F, 0, 0]}}
"""


def test_lengths_of_a_box_stand_outside_of_it_and_a_height_is_measured_from_below() -> None:
    shown = drawn(BOX)
    found, (low, high) = texts(shown), box(shown, "box")
    assert {"h", "b", "y"} <= {*found}
    assert "y − h/2" not in found
    for letter in "hby":
        _, left, bottom, right, top = found[letter].box
        assert right < low[0] or left > high[0] or top < low[1] or bottom > high[1], letter
    (height,) = [np.vstack([x for x in lines(shown, "dimension", "box.hook") if np.ptp(x[:, 0]) < 1e-9])]
    assert np.ptp(height[:, 1]) == pytest.approx(0.8 * (high[1] - low[1]), rel=1e-6)


def test_a_length_that_is_a_sum_is_measured_from_the_next_point() -> None:
    shown = drawn("""
parameters: {a: 2 m, c: 1 m, d: 0.4 m, l: 3 m}
bodies:
  beam: {mass: 1, inertia: {Izz: 1}, points: {B: [a, 0, 0], C: [a + c, 0, 0]}}
  rod: {mass: 1, inertia: {Izz: 1}, com: [0, -d, 0], points: {top: [0, l/2 - d, 0], end: [0, -l/2 - d, 0]}}
joints:
  A: {type: revolute, parent: ground, child: beam}
  O: {type: revolute, parent: beam.C, child: rod}
""")
    assert {"a", "c", "d", "l"} <= {*texts(shown)}
    assert not {"a + c", "l/2 − d"} & {*texts(shown)}


def test_places_and_angles_of_the_start_are_drawn_and_not_in_the_legend() -> None:
    shown = drawn("""
parameters: {h: 2 m, beta: 60 deg, l: 3 m, p: 1 m, x0: 1.5 m, R: 1 m, n: 4 kg*m^4/s^2, E: 1.4e9 Pa}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  ball: {mass: 1}
  rod: {shape: {rod: l, mass: 1}}
  bead: {mass: 1}
joints:
  free: {type: point, parent: ground, child: ball, q: [x, y], initial: {q: [4, h]}}
  J: {type: planar, parent: ground, child: rod, q: [u, v, phi], initial: {q: [2, 0, pi - beta]}}
  wire: {type: curve, parent: ground, child: bead, curve: {y: "x^2/(2*p)"}, initial: {q: x0}}
contacts: {c: {between: [ball, ground.floor]}}
""")
    assert {"h", "β", "x0", "x", "y"} <= {*texts(shown)}
    assert [*texts(shown, legend=True)] == ["R = 1 m, n = 4 kg\u2009m⁴/s², E = 1.4·10⁹ Pa"]
    (arc,) = [x for x in lines(shown, "angle") if len(x) > 2]
    rows = np.column_stack((2.0 * arc, np.ones(len(arc))))  # the circle through its points
    foot = np.linalg.lstsq(rows, (arc**2).sum(axis=1), rcond=None)[0][:2]
    first, last = (np.degrees(np.arctan2(y, -x)) for x, y in (arc[0] - foot, arc[-1] - foot))
    assert sorted([first, last]) == pytest.approx([0.0, 60.0], abs=3.0)  # less the head of the arrow


def test_an_angle_that_is_zero_has_a_dashed_side_too() -> None:
    shown = drawn("""
parameters: {l: 1 m}
bodies: {rod: {mass: 1, inertia: {Izz: 1}, com: [0, -l/2, 0], points: {end: [0, -l, 0]}}}
joints: {A: {type: revolute, parent: ground, child: rod, q: phi}}
""")
    dashed = [m for m in shown.marks if isinstance(m, Stroke) and m.role == "angle" and m.pen and m.pen.dash]
    (arc,) = [m for m in shown.marks if isinstance(m, Arrow) and m.role == "angle"]
    (side,) = (np.asarray(m.points) for m in dashed)
    rod = np.vstack(lines(shown, "body", "rod"))
    pin = np.array([rod[:, 0].mean(), rod[:, 1].max()])
    away = abs(float(np.cross(np.append(side[1] - side[0], 0), np.append(arc.points[-1] - side[0], 0))[2]))
    assert away / np.hypot(*(side[1] - side[0])) < 1.0  # the arc ends on it
    assert side[0][1] < pin[1]
    assert texts(shown)["φ"].at[0] > rod[:, 0].max()


def test_coordinates_stand_beside_their_own_body_and_not_between_ropes() -> None:
    shown = drawn("""
parameters: {m: 1 kg, M: 2 kg, alpha: 30 deg, X: 1}
bodies:
  wedge: {mass: M, surfaces: {face: {plane: [0, 0, 0], normal: [-sin(alpha), cos(alpha), 0]}}}
  block: {mass: m}
joints:
  table: {type: prismatic, parent: ground, child: wedge, axis: x, q: x}
  slope: {type: prismatic, parent: wedge, child: block, axis: [cos(alpha), sin(alpha), 0], q: s}
""")
    front, (arrow,) = box(shown, "wedge")[1], [x for x in lines(shown, "coordinate", "x") if len(x) == 2]
    assert arrow[:, 0].min() > front[0]
    ropes = drawn("""
bodies: {ground: {points: {top: [0, 2, 0]}}, a: {mass: 1}, b: {mass: 2}}
pulleys: {P: {at: ground.top, radius: 0.1}}
constraints: {rope: {type: rope, path: [a, P, b]}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: y, q: y1}
  B: {type: prismatic, parent: ground, child: b, axis: y, q: y2}
""")
    first, second = (np.vstack(lines(ropes, "coordinate", name))[:, 0] for name in ("y1", "y2"))
    assert first.max() < box(ropes, "a")[0][0]
    assert second.min() > box(ropes, "b")[1][0]


def test_a_number_that_would_be_the_answer_is_not_given() -> None:
    text = """
parameters: {l: 1 m, a: 0.5, W: sqrt(9.81/(l*cos(a))), k: 3 N/m}
bodies: {bob: {mass: 1}}
joints: {A: {type: prismatic, parent: ground, child: bob, axis: x, q: s}}
ask: {omega: {find: W, so: W*k == 3, between: [0, 9]}}
"""
    assert "W" not in " ".join(texts(drawn(text), legend=True))


def test_a_spring_and_a_damper_have_their_letters_on_their_own_sides() -> None:
    shown = drawn("""
parameters: {k: 30 N/m, c: 2 N*s/m}
bodies: {block: {mass: 1}}
joints: {A: {type: prismatic, parent: ground, child: block, axis: x, q: x}}
forces: {both: {type: spring_damper, joint: A, stiffness: k, damping: c}}
""")
    middle = np.mean([x.mean(axis=0) for x in lines(shown, "spring_damper")], axis=0)
    found = texts(shown)
    assert found["k"].at[1] > middle[1] > found["c"].at[1]


def test_polar_coordinates_and_thin_bars_have_their_lengths() -> None:
    shown = drawn("""
parameters: {R: 2 m, l: 1 m, h: 3 m, b: 0.2 m}
bodies:
  planet: {mass: 1}
  ball: {shape: {sphere: b, mass: 1}}
  bar: {mass: 1, inertia: {Izz: 1}, surfaces: {below: {segment: [["-l/2", 0, 0], [l/2, 0, 0]], normal: -y}}}
joints:
  orbit: {type: custom, parent: ground, child: planet, free: [{rotate: z}, {translate: x}], q: [phi, r],
          initial: {q: [0.6, R]}}
  free: {type: planar, parent: ground, child: bar, initial: {q: [0, -1, 0]}}
  fall: {type: prismatic, parent: ground, child: ball, axis: y, q: y, initial: {q: h + b}}
""")
    assert {"R", "r", "φ", "l", "h"} <= {*texts(shown)}
    height = np.vstack([x for x in lines(shown, "dimension", "fall.h") if np.ptp(x[:, 0]) < 1e-9])
    assert height[:, 1].max() == pytest.approx(box(shown, "ball")[0][1], abs=0.6)
    ends = np.vstack([x for x in lines(shown, "dimension", "r") if len(x) == 2 and abs(np.ptp(x[:, 0])) > 20.0])
    way = ends[np.argmax(ends[:, 0])] - ends[np.argmin(ends[:, 0])]
    assert np.arctan2(way[1], way[0]) == pytest.approx(0.6, abs=1e-6)
