"""A wheel without a radius lies about its pulley, the mass that carries it hangs below, and its rope touches it."""

from __future__ import annotations

from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.pictures.marks.sheet import WHEEL
from multibody_sym.pictures.page.picture import Arc, Stroke

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


EXAMPLES = Path(__file__).parents[2] / "examples"
PULLEYS = sorted(path for path in EXAMPLES.rglob("*.yaml") if "\npulleys:" in path.read_text())


@pytest.mark.parametrize("path", [None, *PULLEYS], ids=lambda path: path.stem if path else "three_pulleys")
def test_no_load_covers_a_wheel_and_no_rope_crosses_itself_or_another(path: Path | None) -> None:
    system = mbs.loads(THREE) if path is None else mbs.load(path)
    marks = mbs.draw(system).picture.marks
    names = {*system.pulleys, *(pulley.body for pulley in system.pulleys.values())}  # a heavy wheel is its body's disc
    wheels = [m for m in marks if isinstance(m, Arc) and m.name in names and m.radius > 4.0]
    assert wheels
    for mass in (m for m in marks if isinstance(m, Stroke) and m.role == "body" and m.closed and len(m.points) == 4):
        for wheel in wheels:
            outline = np.vstack([mass.points, mass.points[:1]])
            assert _distance(outline, wheel.centre) > wheel.radius - 0.1, (mass.name, wheel.name)
    ropes = [np.asarray(m.points) for m in marks if isinstance(m, Stroke) and m.role == "rope"]
    pieces = [pair for rope in ropes for pair in pairwise(rope)]
    assert not [(one, two) for one, two in combinations(pieces, 2) if _crosses(*one, *two)]


def _crosses(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> bool:
    """Return whether two straight pieces cross inside both."""

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    least = -1e-6
    return side(a, b, c) * side(a, b, d) < least and side(c, d, a) * side(c, d, b) < least


def _distance(line: np.ndarray, point: np.ndarray) -> float:
    """Return how far a point is from a line of straight pieces."""
    found = []
    for a, b in pairwise(line):
        share = np.clip((point - a) @ (b - a) / max(float((b - a) @ (b - a)), 1e-12), 0, 1)
        found.append(float(np.linalg.norm(a + share * (b - a) - point)))
    return min(found)
