"""Contacts of two bodies that both move: gap and slip by hand, H and gamma against exact derivatives of these."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy
from exact import Exact
from mechanisms import Case

import multibody_sym as mbs
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.mechanics.contact_geometry import reach
from multibody_sym.mechanics.law_elements import Mode
from multibody_sym.mechanics.modes import in_mode
from multibody_sym.mechanics.motion import coordinate_rates, motion_of, state_of
from multibody_sym.mechanics.points import generalized_forces, position
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.row_kinematics import row_motions, row_terms
from multibody_sym.mechanics.row_records import Edge, Marker, PlaneSurface, Rim, TurningRow
from multibody_sym.model.bodies import Pose
from multibody_sym.scalars.calculus import tangents
from multibody_sym.scalars.node import ONE, as_node

PLANE = {
    "face": {"plane": [0.1, -0.2, 0], "normal": [0.6, 0.8, 0]},
    "rim": {"disc": 0.3, "centre": [0.1, 0.2, 0]},
    "ball": {"sphere": 0.2, "centre": [-0.1, 0.2, 0]},
    "drum": {"disc": 2.5, "centre": [0.1, 0, 0], "inside": True},
    "corner": {"point": [0.2, -0.3, 0]},
    "track": {"revolution": "0.4*s^2 - 0.3*s^3 + 0.1", "centre": [0.2, 0.1, 0], "axis": [0.6, 0.8, 0]},
}
SPACE = {
    "face": {"plane": [0.1, -0.2, 0.3], "normal": [0.6, 0.0, 0.8]},
    "rim": {"disc": 0.3, "centre": [0.1, 0.2, 0.1], "axis": [0.2, 0.9, 0.1]},
    "ball": {"sphere": 0.2, "centre": [-0.1, 0.2, 0.3]},
    "bowl": {"sphere": 2.5, "centre": [0.1, 0, 0.2], "inside": True},
    "corner": {"point": [0.2, -0.3, 0.1]},
    "bar": {"segment": [[-0.4, 0.1, 0.2], [0.8, 0.3, -0.1]]},
    "pole": {"segment": [[0.1, 0.2, -0.3], [0.3, 0.7, 0.5]], "normal": [0.6, 0.0, 0.8]},
    "vase": {"revolution": "0.4*s^2 - 0.3*s^3 + 0.1", "centre": [0.2, 0.1, 0.3], "axis": "y"},
    "cone": {"revolution": "0.7*s", "centre": [0.2, 0.1, 0.3], "axis": [0.6, 0, 0.8]},
}
FLAT_PAIRS = [
    ("corner", "face"), ("face", "corner"), ("rim", "face"), ("face", "ball"), ("rim", "rim"), ("ball", "corner"),
    ("corner", "rim"), ("rim", "drum"), ("drum", "ball"), ("corner", "drum"),
]
SPACE_PAIRS = [
    ("corner", "face"), ("face", "corner"), ("rim", "face"), ("face", "rim"), ("ball", "face"), ("ball", "ball"),
    ("corner", "ball"), ("ball", "bowl"), ("bowl", "corner"), ("bar", "pole"), ("pole", "bar"), ("bar", "bar"),
    ("ball", "bar"), ("pole", "ball"),
]
SMOOTH = [("corner", "track", True), ("track", "corner", True), ("corner", "vase", False), ("cone", "corner", False)]
PAIRS = [(*pair, True) for pair in FLAT_PAIRS] + [(*pair, False) for pair in SPACE_PAIRS]


def case(first: str, second: str, flat: bool) -> Case:
    """Return two bodies, the second carried by a third one, whose surfaces are in touch as if they stuck."""
    surfaces = PLANE if flat else SPACE
    moments = {"Izz": 0.1} if flat else {"Ixx": 0.1, "Iyy": 0.2, "Izz": 0.15}
    body = mbs.Body(mass=1, inertia=moments, surfaces=surfaces)
    joint = mbs.Planar if flat else mbs.Free
    hinge = mbs.Revolute("cart", "b", axis="z") if flat else mbs.Spherical("cart", "b")
    round_ones = {first, second} - {"corner", "face", "track", "vase", "cone", "bar", "pole"}
    system = mbs.System(
        "pair",
        bodies={"a": body, "cart": mbs.Body(mass=1, inertia=moments), "b": body},
        joints={"A": joint("ground", "a"), "C": joint("ground", "cart"), "B": hinge},
        contacts={
            "c": mbs.Contact(
                [f"a.{first}", f"b.{second}"], static=0.3, rolling_resistance=0.01 if round_ones else None
            )
        },
    )
    resolved = mechanism(system)
    stuck = in_mode(resolved, Mode({resolved.one_way[0].name: 1}))
    return Case(0, system, stuck, parameter_values(stuck, {}))


def some_state(found: Case, seed: int) -> tuple[float, list[float], list[float]]:
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1, 1, len(found.mechanism.coordinates))
    for body in found.mechanism.bodies:
        for places in body.quaternions:
            q[list(places)] /= np.linalg.norm(q[list(places)])
    u = rng.uniform(-1, 1, len(found.mechanism.speeds))
    return 0.0, [float(x) for x in q], [float(x) for x in u]


def on_surface(found: Case, state: tuple[float, list[float], list[float]]) -> tuple[float, list[float], list[float]]:
    """Return a state in which the first body is moved onto the second: what touches a smooth surface is a point."""
    t, q, u = state
    for _ in range(50):
        motion = found.motion(t, q, u)
        row = row_motions(motion)[0]
        if abs(row.phi) < 1e-14:
            break
        n = np.array(motion.rotation(0)) @ np.array(row.of_body[0][0])
        places = found.mechanism.bodies[0].q
        for k in range(2 if len(places) == 3 else 3):
            q = [x - row.phi * n[k] if i == places[k] else x for i, x in enumerate(q)]
    return t, q, u


@pytest.mark.parametrize(("first", "second", "flat"), [*PAIRS, *SMOOTH])
def test_rows_against_the_derivatives_of_gap_and_slip(first: str, second: str, flat: bool) -> None:
    found = case(first, second, flat)
    state = some_state(found, 3)
    if (first, second, flat) in SMOOTH:
        state = on_surface(found, state)
    exact = Exact(found)
    symbolic = row_motions(exact.motion)
    numbers = row_motions(found.motion(*state))
    assert len(numbers) >= (2 if flat else 3)
    for row, node in zip(numbers, symbolic, strict=True):
        phidot = as_node(node.phidot)
        if row.holonomic:
            assert row.phi == pytest.approx(exact.values([node.phi], state)[0], abs=1e-13)
            assert row.phidot == pytest.approx(exact.values(exact.rates([node.phi]), state)[0], abs=1e-12)
        along = [tangents([phidot], {speed: ONE})[0] for speed in exact.u]
        np.testing.assert_allclose(row.jacobian, exact.values(along, state), atol=1e-12)
        gamma = -exact.values(exact.rates([phidot]), state, [0.0] * len(state[2]))[0]
        assert row.gamma == pytest.approx(gamma, rel=1e-9, abs=1e-11)


@pytest.mark.parametrize(("first", "second", "flat"), [*PAIRS, *SMOOTH])
def test_h_is_the_power_of_the_wrenches_and_terms_bound_gamma(first: str, second: str, flat: bool) -> None:
    found = case(first, second, flat)
    motion = found.motion(*some_state(found, 5))
    rows = row_motions(motion)
    for row in rows:
        np.testing.assert_allclose(generalized_forces(motion, row.of_body), row.jacobian, atol=1e-12)
    assert all(abs(row.gamma) <= terms for row, terms in zip(rows, row_terms(motion), strict=True))


def gap_by_hand(found: Case, motion) -> float:
    """Return the gap from places in world axes alone."""
    skins = found.mechanism.rows[0].skins
    flat = next((k for k, skin in enumerate(skins) if isinstance(skin, PlaneSurface)), None)
    if any(isinstance(skin, Edge) for skin in skins):
        return between_lines(skins, motion)
    if flat is None:
        signed = [float(skin.radius.shadow) * (-1 if skin.inside else 1) for skin in skins]
        apart = np.linalg.norm(np.subtract(*(position(motion, skin.place) for skin in skins)))
        return (-apart if min(signed) < 0 else apart) - sum(signed)
    plane, other = skins[flat], skins[1 - flat]
    tip = tuple(p + n for p, n in zip(plane.place.pose.position, plane.normal, strict=True))
    above = Marker("", plane.place.body, Pose(tip))
    n = np.subtract(position(motion, above), position(motion, plane.place))
    height = n @ np.subtract(position(motion, other.place), position(motion, plane.place))
    if isinstance(other, Rim):
        tip = tuple(p + a for p, a in zip(other.place.pose.position, other.axis, strict=True))
        axis = np.subtract(position(motion, Marker("", other.place.body, Pose(tip))), position(motion, other.place))
        return height - float(other.radius.shadow) * np.linalg.norm(np.cross(n, axis))
    return height - float(other.radius.shadow)


def between_lines(skins, motion) -> float:
    """Return the volume of what four places span over its base, with the sign of the side that is said.

    Of a ball the distance of its centre, from the area that it spans with a bar, less its radius.
    """
    ball = next((skin for skin in skins if not isinstance(skin, Edge)), None)
    if ball is not None:
        bar = skins[1] if skins[0] is ball else skins[0]
        p, a, c = (np.array(position(motion, m), dtype=float) for m in (bar.place, bar.tip, ball.place))
        return np.linalg.norm(np.cross(a - p, c - p)) / np.linalg.norm(a - p) - float(ball.radius.shadow)
    (p, a), (q, b) = ([np.array(position(motion, m), dtype=float) for m in (skin.place, skin.tip)] for skin in skins)
    base = np.cross(a - p, b - q)
    told, sense = (skins[1], 1.0) if skins[1].facing is not None else (skins[0], -1.0)
    ahead = tuple(x + n for x, n in zip(told.place.pose.position, told.facing, strict=True))
    normal = np.subtract(position(motion, Marker("", told.place.body, Pose(ahead))), position(motion, told.place))
    return sense * np.sign(base @ normal) * np.linalg.det([a - p, b - q, p - q]) / np.linalg.norm(base)


@pytest.mark.parametrize(("first", "second", "flat"), PAIRS)
def test_the_gap_by_hand(first: str, second: str, flat: bool) -> None:
    found = case(first, second, flat)
    motion = found.motion(*some_state(found, 7))
    assert row_motions(motion)[0].phi == pytest.approx(gap_by_hand(found, motion), rel=1e-13, abs=1e-13)


@pytest.mark.parametrize(("first", "second", "flat"), PAIRS)
def test_slip_is_what_marks_on_both_bodies_move_apart(first: str, second: str, flat: bool) -> None:
    """Marks are put on both bodies where wrenches act, and followed for a short time."""
    found = case(first, second, flat)
    t, q, u = some_state(found, 11)
    step = 1e-6
    bodies = [found.mechanism.rows[0].skins[k].place.body for k in (0, 1)]
    motion = found.motion(t, q, u)
    rows = row_motions(motion)
    for row, each in zip(found.mechanism.rows, rows, strict=True):
        force, moment = each.of_body[bodies[0]]
        along = np.array(motion.rotation(bodies[0])) @ np.array(moment if isinstance(row, TurningRow) else force)
        assert np.linalg.norm(along) == pytest.approx(1.0, abs=1e-12)
        if isinstance(row, TurningRow):
            turning = [np.array(motion.rotation(b)) @ np.array(motion.bodies[b].w_WB) for b in bodies]
            assert each.phidot == pytest.approx(along @ (turning[0] - turning[1]), abs=1e-12)
            continue
        parting = [(_place(found, motion, each, bodies[0], b, step, q, u)) for b in bodies]
        assert each.phidot == pytest.approx(along @ (parting[0] - parting[1]), abs=1e-8)


def _place(found, motion, each, first, body, step, q, u):
    """Return the velocity of the mark on a body where the force on the first acts, by central differences."""
    R, p = (np.array(x, dtype=float) for x in motion.poses[first])
    force, moment = (np.array(x, dtype=float) for x in each.of_body[first])
    assert abs(force @ moment) < 1e-12
    where = p + R @ np.cross(force, moment)  # on the line of action; along the normal any place will do
    if each.phi is None:
        where = p + R @ _mark(found, motion, first)
    R_b, p_b = (np.array(x, dtype=float) for x in motion.poses[body])
    mark = Marker("", body, Pose(tuple(as_node(float(x)) for x in R_b.T @ (where - p_b))))
    ends = []
    for h in (step, -step):
        moved = found.motion(0.0, _moved(found, q, u, h), u)
        ends.append(np.array(position(moved, mark), dtype=float))
    return (ends[0] - ends[1]) / (2 * step)


def _mark(found, motion, first):
    """Return where friction acts on the first body, in its axes: its line of action meets that of the normal force."""
    normal, friction = row_motions(motion)[:2]
    lines = [tuple(np.array(x, dtype=float) for x in row.of_body[first]) for row in (normal, friction)]
    (n, mn), (t, mt) = lines
    a, b = np.cross(n, mn), np.cross(t, mt)
    return a + n * (n @ (b - a)) if abs(n @ t) < 1e-12 else a


def _moved(found, q, u, h):
    rates = [float(x) for x in coordinate_rates(found.mechanism, q, u)]
    return [x + h * v for x, v in zip(q, rates, strict=True)]


def test_a_point_beyond_the_end_of_a_face_is_out_of_reach() -> None:
    table = {"plane": [0, 0, 0], "normal": "y", "between": [[-1, 0, 0], [2, 0, 0]]}
    system = mbs.System(
        "edge",
        bodies={"ground": mbs.Body(surfaces={"table": table}), "p": mbs.Body(mass=1)},
        joints={"J": mbs.PointJoint("ground", "p")},
        contacts={"c": mbs.Contact(["p", "ground.table"])},
    )
    resolved = mechanism(system)
    here = Case(0, system, resolved, parameter_values(resolved, {}))
    row = resolved.one_way[0].normals[0]
    assert reach(row, here.motion(0.0, [1.5, 0.0], [0.0, 0.0])) == pytest.approx([2.5, 0.5])
    assert reach(row, here.motion(0.0, [-1.25, 7.0], [0.0, 0.0])) == pytest.approx([-0.25, 3.25])


def test_bars_touch_with_their_sides_balls_and_other_bars_and_with_their_ends_planes() -> None:
    """Each pair by name, and how far inside the ends the place of contact is: of the foot, and of the crossing."""
    ground = mbs.Body(
        surfaces={"floor": {"plane": [0, 0, -1]}, "rail": {"segment": [[0, -1, 0], [0, 3, 0]]}, "knob": {"sphere": 0.1}}
    )
    pairs = {"f": "ground.floor", "r": "ground.rail", "k": "ground.knob"}
    system = mbs.System(
        "bar",
        bodies={"ground": ground, "bar": mbs.Body(shape={"rod": 2, "mass": 1})},
        joints={"J": mbs.Free("ground", "bar")},
        contacts={name: mbs.Contact(["bar", on]) for name, on in pairs.items()},
    )
    resolved = mechanism(system)
    found = {element.name: element.normals[0] for element in resolved.one_way}
    assert set(found) == {"f.end1", "f.end2", "r", "k.side", "k.end1", "k.end2"}
    here = Case(0, system, resolved, parameter_values(resolved, {}))
    motion = here.motion(0.0, [-0.5, 0.3, 0.4, 1.0, 0.0, 0.0, 0.0], [0.0] * 6)
    assert reach(found["r"], motion) == pytest.approx([0.5, 1.5, 1.3, 2.7])
    assert reach(found["k.side"], motion) == pytest.approx([0.5, 1.5])
    whole = replace(motion, mechanism=replace(resolved, rows=(found["r"], found["k.side"], found["f.end1"])))
    assert [row.phi for row in row_motions(whole)] == pytest.approx([0.4, 0.4, 1.4])  # k: 0.5 m away, less 0.1 m


def test_the_edge_of_a_box_is_touched_between_its_faces() -> None:
    """A box turned by 45 degrees stands on its edge across a rail; turned back to a face the edge is at its limit."""
    ground = mbs.Body(surfaces={"rail": {"segment": [[-2, 0, 0], [2, 0, 0]]}})
    system = mbs.System(
        "box",
        bodies={"ground": ground, "box": mbs.Body(shape={"box": [0.6, 0.8, 1.0], "mass": 1})},
        joints={"J": mbs.Free("ground", "box")},
        contacts={"c": mbs.Contact(["box.back_right", "ground.rail"])},
    )
    resolved = mechanism(system)
    here, row = Case(0, system, resolved, parameter_values(resolved, {})), resolved.one_way[0].normals[0]
    for angle in (0.0, 0.7, math.pi / 2, 2.0):
        q = [0.1, 0.2, 0.9, math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0]  # about y: the edge at (0.3, -0.5)
        motion = here.motion(0.0, q, [0.0] * 6)
        corner = 0.9 - 0.3 * np.sin(angle) - 0.5 * np.cos(angle)
        whole = replace(motion, mechanism=replace(resolved, rows=(row,)))
        assert row_motions(whole)[0].phi == pytest.approx(corner)
        x = 0.1 + 0.3 * np.cos(angle) - 0.5 * np.sin(angle)
        down = 0.8 * np.array([np.cos(angle), np.sin(angle)])  # how much the faces back and right look down, in m
        assert reach(row, motion) == pytest.approx([0.2, 0.6, *down, 2 + x, 2 - x], abs=1e-12)


def test_a_bead_on_a_parabola_and_in_a_bowl() -> None:
    """On y = k x^2 the normal is (-2 k x, 1)/sqrt(1 + 4 k^2 x^2), and n . a = 2 k v_x^2 / sqrt(..)."""
    ground = mbs.Body(surfaces={"bowl": mbs.Surface(revolution="0.5*k*s^2", axis="y")})
    for dimension, joint in ((2, "xy"), (3, "xyz")):
        system = mbs.System(
            "bead",
            bodies={"ground": ground, "p": mbs.Body(1)},
            parameters={"k": 3},
            joints={"J": mbs.PointJoint("ground", "p", axes=joint)},
            contacts={"c": mbs.Contact(["p", "ground.bowl"], static=0.1)},
        )
        assert mbs.loads(mbs.dumps(system)) == system
        stuck = in_mode(mechanism(system), Mode({"c": 1}))
        found = Case(0, system, stuck, parameter_values(stuck, {}))
        (normal, *_) = row_motions(found.motion(0.0, [0.4, 0.24, 0.0][:dimension], [0.7, 0.84, 0.0][:dimension]))
        size = np.hypot(1.2, 1.0)
        assert normal.phi == pytest.approx(0.0, abs=1e-15)
        assert normal.phidot == pytest.approx(0.0, abs=1e-15)
        np.testing.assert_allclose(normal.jacobian, [-1.2 / size, 1 / size, 0.0][:dimension], atol=1e-15)
        assert normal.gamma == pytest.approx(3 * 0.49 / size, rel=1e-13)


@pytest.mark.parametrize(("first", "second", "flat"), [PAIRS[2], PAIRS[7], PAIRS[14], SMOOTH[0]])
def test_rows_over_sympy_are_those_over_floats(first: str, second: str, flat: bool) -> None:
    found = case(first, second, flat)
    t, q, u = some_state(found, 13)
    given = ([sympy.Float(x, 20) for x in part] for part in (q, u, found.parameters))
    state = state_of(found.mechanism, sympy.Expr, sympy.Integer(0), *given)
    numbers = row_motions(found.motion(t, q, u))
    for over, row in zip(row_motions(motion_of(found.mechanism, state)), numbers, strict=True):
        assert float(over.gamma) == pytest.approx(row.gamma, rel=1e-11, abs=1e-11)
        assert [float(x) for x in over.jacobian] == pytest.approx(row.jacobian, abs=1e-12)
