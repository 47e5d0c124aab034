"""Contacts that start inside each other, and coefficients that parameters make wrong, are told by name."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.start.initial_geometry import contact_gaps, verify_outside
from multibody_sym.dynamics.start.parameters import parameter_values, value_at, verify_contact_values
from multibody_sym.mechanics.motion import Motion, motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism

FILE = """\
multibody_sym: 1
name: table
gravity: [0, -10, 0]
parameters: {mu: 0.3, nu: 0.2, e: 0, f: 0.01, r: 0.25}
bodies:
  ground: {surfaces: {table: {plane: [0, 0, 0], normal: y, between: [[-1, 0, 0], [1, 0, 0]]}}}
  box: {shape: {box: [0.4, 0.2, 1], mass: 1}}
  wheel: {mass: 1, inertia: {Izz: 1}, surfaces: {rim: {disc: r}}}
joints:
  B: {type: planar, parent: ground, child: box}
  W: {type: planar, parent: ground, child: wheel}
contacts:
  c1: {between: [box, ground.table], static: mu, kinetic: nu, restitution: e}
  c2: {between: [wheel, ground.table], static: enough, rolling_resistance: f}
"""
OUT = {"B_x": 0.0, "B_y": 0.1, "B_theta": 0.0, "W_x": 0.5, "W_y": 0.25, "W_theta": 0.0}


def motion(q: dict[str, float], **parameters: Any) -> Motion:
    resolved = mechanism(mbs.loads(FILE))
    values = parameter_values(resolved, parameters)
    places = [{**OUT, **q}[c.name] for c in resolved.coordinates]
    return motion_of(resolved, state_of(resolved, float, 0.0, places, [0.0] * len(resolved.speeds), values))


def test_gaps_of_all_parts() -> None:
    gaps = {element.name: gap for element, _, gap in contact_gaps(motion({}), 1e-9)}
    corners = {"c1.corner1": 0, "c1.corner2": 0, "c1.corner3": 0.2, "c1.corner4": 0.2}
    edges = {"c2.end1": math.hypot(1.5, 0.25) - 0.25, "c2.end2": math.hypot(0.5, 0.25) - 0.25}
    assert gaps == pytest.approx({**corners, "c2.face": 0, **edges})


def test_what_touches_is_not_inside() -> None:
    verify_outside(motion({}), 1e-9)
    verify_outside(motion({"B_y": 0.1 - 1e-12}), 1e-9)


def test_a_millimetre_inside_is_told() -> None:
    with pytest.raises(mbs.ModelError, match=r"contacts.c1: box starts 0.001 m inside ground.table \(c1.corner1\)"):
        verify_outside(motion({"B_y": 0.099}), 1e-9)
    with pytest.raises(mbs.ModelError, match=r"c2: wheel.rim starts 0.001 m inside ground.table \(c2.face\); move"):
        verify_outside(motion({"W_y": 0.249}), 1e-9)


def test_below_the_level_of_a_table_beside_it_is_not_inside() -> None:
    verify_outside(motion({"B_x": 1.3, "B_y": -5.0, "W_x": -2.0, "W_y": 0.0}), 1e-9)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"nu": -0.1}, r"contacts.c1.kinetic: -0.1 is negative"),
        ({"mu": -0.1}, r"contacts.c1.static: -0.1 is negative"),
        ({"mu": 0.1}, r"contacts.c1.static: static 0.1 is below kinetic 0.2"),
        ({"e": 1.5}, r"contacts.c1.restitution: 1.5 is above 1"),
        ({"f": -0.01}, r"contacts.c2.rolling_resistance: -0.01 is negative"),
        ({"r": 0.0}, r"contacts.c2: a radius there is 0 m"),
    ],
)
def test_values_that_parameters_make_wrong(parameters: dict[str, float], message: str) -> None:
    right, at = motion({}), motion({}, **parameters)
    verify_contact_values(right.mechanism.one_way, partial(value_at, right))
    with pytest.raises(mbs.ModelError, match=message):
        verify_contact_values(at.mechanism.one_way, partial(value_at, at))


# --- what ends at faces and corners --------------------------------------------------------------------------------


def two_boxes(q: list[float], sizes: tuple[float, float, float, float]) -> Motion:
    """Return two boxes of sizes (a, b) and (c, d), free in the plane."""
    a, b, c, d = sizes
    system = mbs.System(
        "boxes",
        bodies={
            "A": mbs.Body(shape=mbs.Shape("box", [a, b, 1], 1)),
            "B": mbs.Body(shape=mbs.Shape("box", [c, d, 1], 1)),
        },
        joints={"JA": mbs.Planar("ground", "A"), "JB": mbs.Planar("ground", "B")},
        contacts={"c": mbs.Contact(["A", "B"])},
    )
    resolved = mechanism(system)
    values = parameter_values(resolved, {})
    return motion_of(resolved, state_of(resolved, float, 0.0, q, [0.0] * 6, values))


def closed(found: Motion) -> set[str]:
    return {element.name for element, _, gap in contact_gaps(found, 1e-9) if abs(gap) < 1e-9}


def test_equal_boxes_on_each_other_touch_top_to_bottom() -> None:
    sizes = (0.4, 0.2, 0.4, 0.2)
    touching = {"c.corner1.top", "c.corner2.top", "c.bottom.corner3", "c.bottom.corner4"}
    assert closed(two_boxes([0.0, 0.2, 0.0, 0.0, 0.0, 0.0], sizes)) == touching
    for far in (0.1, 0.3):  # pushed along: what is beyond the end no longer touches
        pushed = closed(two_boxes([far, 0.2, 0.0, 0.0, 0.0, 0.0], sizes))
        assert pushed == {"c.corner1.top", "c.bottom.corner3"}
    assert closed(two_boxes([-0.4, 0.0, 0.0, 0.0, 0.0, 0.0], sizes)) == {
        "c.corner2.left", "c.corner3.left", "c.right.corner1", "c.right.corner4"
    }


def corners(x: float, y: float, angle: float, a: float, b: float) -> np.ndarray:
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return np.array([[-a, -b], [a, -b], [a, b], [-a, b]]) / 2 @ turn.T + [x, y]


def distance(p: np.ndarray, q: np.ndarray) -> tuple[float, bool]:
    """Return how far two polygons are apart, and whether a corner faces a side there; 0 where they overlap."""
    best, facing = np.inf, False
    for one, other in ((p, q), (q, p)):
        for corner in one:
            for k in range(4):
                u, v = other[k], other[(k + 1) % 4]
                along = np.clip((corner - u) @ (v - u) / ((v - u) @ (v - u)), 0, 1)
                far = float(np.linalg.norm(corner - u - along * (v - u)))
                if far < best:
                    best, facing = far, bool(0 < along < 1)
    for one in (p, q):
        for k in range(4):
            n = np.array([one[(k + 1) % 4][1] - one[k][1], one[k][0] - one[(k + 1) % 4][0]])
            if min((q if one is p else p) @ n) >= max(one @ n):
                return best, facing
    return 0.0, False


def test_boxes_that_are_apart_are_nowhere_inside_each_other() -> None:
    """The least gap is the distance of the polygons by brute force, wherever a corner faces a side."""
    rng = np.random.default_rng(1)
    facing = 0
    for _ in range(200):
        a, b, c, d = (float(x) for x in rng.uniform(0.1, 1, 4))
        q = [float(x) for x in rng.uniform(-1, 1, 6) * [1, 1, 3, 1, 1, 3]]
        apart, faces = distance(corners(*q[:3], a, b), corners(*q[3:], c, d))
        if apart == 0.0:
            continue
        gaps = [gap for _, _, gap in contact_gaps(two_boxes(q, (a, b, c, d)), 1e-9)]
        assert min(gaps, default=1.0) > 0
        if faces:
            facing += 1
            assert min(gaps) == pytest.approx(apart, rel=1e-9)
    assert facing > 60


def bar_and_disc(x: float, y: float, r: float, segment: Any = None) -> dict[str, float]:
    """Return the gaps of a bar along x from 0 to 2 and a disc, or a point if r is 0."""
    bar = mbs.Body(mass=1, inertia={"Izz": 1}, surfaces={"bar": segment or {"segment": [[0, 0, 0], [2, 0, 0]]}})
    disc = mbs.Body(mass=1, inertia={"Izz": 1}, surfaces={"rim": {"disc": r} if r else {"point": [0, 0, 0]}})
    system = mbs.System(
        "bar",
        bodies={"bar": bar, "disc": disc},
        joints={"A": mbs.Planar("ground", "bar"), "B": mbs.Planar("ground", "disc")},
        contacts={"c": mbs.Contact(["bar", "disc.rim"])},
    )
    resolved = mechanism(system)
    state = state_of(resolved, float, 0.0, [0.0, 0.0, 0.0, x, y, 0.0], [0.0] * 6, parameter_values(resolved, {}))
    return {element.name: gap for element, _, gap in contact_gaps(motion_of(resolved, state), 1e-9)}


def test_a_disc_touches_the_side_of_a_bar_on_which_it_is_and_its_ends() -> None:
    assert bar_and_disc(0.5, 0.3, 0.3)["c.left"] == pytest.approx(0.0)
    assert "c.right" not in bar_and_disc(0.5, 0.3, 0.3)
    assert bar_and_disc(0.5, -0.4, 0.3)["c.right"] == pytest.approx(0.1)
    assert bar_and_disc(-0.4, 0.3, 0.3) == pytest.approx({"c.end1": 0.2, "c.end2": math.hypot(2.4, 0.3) - 0.3})


def test_a_point_on_a_bar_is_held_both_ways_unless_a_side_is_declared() -> None:
    assert bar_and_disc(0.5, 0.0, 0.0) == pytest.approx({"c.left": 0.0, "c.right": 0.0})
    below = {"segment": [[0, 0, 0], [2, 0, 0]], "normal": "-y"}
    assert bar_and_disc(0.5, 0.0, 0.0, below) == pytest.approx({"c": 0.0})
    assert bar_and_disc(0.5, -0.2, 0.0, below) == pytest.approx({"c": 0.2})


@pytest.mark.parametrize("slope", [0.0, 10.0, 40.0])
def test_gap_of_a_rim_that_lies_nearly_flat(slope: float) -> None:
    """It is the height of its centre less r sin(tilt) to the last digit, also where the tilt is next to rounding."""
    half = math.radians(slope) / 2
    normal = [math.sin(2 * half), 0.0, math.cos(2 * half)]
    system = mbs.System(
        "disc",
        bodies={
            "ground": mbs.Body(surfaces={"face": {"plane": [0, 0, 0], "normal": normal}}),
            "disc": mbs.Body(shape={"disc": 0.5, "mass": 1}),
        },
        joints={"J": mbs.Free("ground", "disc")},
        contacts={"c": mbs.Contact(["disc", "ground.face"])},
    )
    resolved = mechanism(system)
    for tilt in (0.0, *(10.0**-k for k in range(2, 18))):
        q = [*normal, math.cos(half + tilt / 2), 0.0, math.sin(half + tilt / 2), 0.0]
        state = state_of(resolved, float, 0.0, q, [0.0] * 6, parameter_values(resolved, {}))
        ((_, _, gap),) = contact_gaps(motion_of(resolved, state), 1e-9)
        assert gap == pytest.approx(1 - 0.5 * math.sin(tilt), abs=1e-15), tilt


def test_faces_of_a_box_have_names() -> None:
    system = mbs.System(
        "faces",
        bodies={"box": mbs.Body(shape=mbs.Shape("box", [0.4, 0.2, 1], 1)), "p": mbs.Body(mass=1)},
        joints={"A": mbs.Planar("ground", "box"), "P": mbs.PointJoint("ground", "p")},
        contacts={"c": mbs.Contact(["p", "box.top"]), "d": mbs.Contact(["p", "box"])},
    )
    resolved = mechanism(system)
    state = state_of(resolved, float, 0.0, [0.0, 0.0, 0.0, 0.1, 0.5], [0.0] * 5, parameter_values(resolved, {}))
    gaps = {element.name: gap for element, _, gap in contact_gaps(motion_of(resolved, state), 1e-9)}
    assert gaps == pytest.approx({"c": 0.4, "d.top": 0.4})


def test_equal_boxes_on_each_other_in_space_touch_top_to_bottom() -> None:
    box = mbs.Body(shape=mbs.Shape("box", [0.4, 0.2, 0.6], 1))
    system = mbs.System(
        "boxes",
        bodies={"A": box, "B": box},
        joints={"JA": mbs.Free("ground", "A"), "JB": mbs.Free("ground", "B")},
        contacts={"c": mbs.Contact(["A", "B"])},
    )
    resolved = mechanism(system)
    values = parameter_values(resolved, {})
    for far, corners in ((0.0, {"1", "2", "5", "6"}), (0.1, {"1", "5"})):
        q = [far, 0.2, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
        found = closed(motion_of(resolved, state_of(resolved, float, 0.0, q, [0.0] * 12, values)))
        assert {name for name in found if name.endswith("top")} == {f"c.corner{k}.top" for k in corners}
        assert {name.split(".")[1 if "corner" not in name.split(".")[1] else 2] for name in found} == {"top", "bottom"}
