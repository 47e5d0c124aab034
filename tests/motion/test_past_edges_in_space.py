"""What gets past an edge of a box in space leaves its face there: closed forms, and the same motion in a plane."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs
from multibody_sym.analysis.check import check
from multibody_sym.documents.runs import run_summary

G = 9.81
HEAD = """\
multibody_sym: 1
name: off a box
gravity: [{gravity}]
bodies:
  box: {{shape: {{box: [1, 1, 1], mass: 5}}}}
  b: {{{body}}}
joints: {{W: {{type: fixed, parent: ground, child: box}}, B: {{{joint}}}}}
contacts: {{c: {{between: [{ends}], {contact}}}{more}}}
simulation: {{t_end: {t_end}, samples: 9, rtol: 1e-10, atol: 1e-12}}
"""
FREE = "type: free, parent: ground, child: b, angles: yzx, q: [x, y, z, b1, a, c1]"
PLANAR = "type: planar, parent: ground, child: b, q: [x, z, b1]"


def run_of(body: str, joint: str, contact: str, t_end: float, **others: str) -> mbs.Trajectory:
    known = {"gravity": f"0, 0, -{G}", "ends": "b, box", "more": "", **others}
    model = HEAD.format(body=body, joint=joint, contact=contact, t_end=t_end, **known)
    return mbs.simulate(mbs.loads(model))


def changes(run: mbs.Trajectory) -> list[tuple[float, str, str]]:
    return [(event["t"], event["kind"], event["element"]) for event in run.events]


@pytest.mark.parametrize("ends", ["b, box", "box, b"])
def test_a_particle_slides_off_a_box(ends: str) -> None:
    """It gets to the edge after 0.1 m at 0.5 m/s, and falls from there."""
    joint = "type: point, parent: ground, child: b, axes: xyz, initial: {q: [0.4, 0, 0.5], u: [0.5, 0.1, 0]}"
    run = run_of("mass: 1", joint, "static: 0", 0.5, ends=ends)
    ((t, kind, _),) = changes(run)
    assert (kind, t) == ("open", pytest.approx(0.2, abs=1e-9))
    assert run.q[-1] == pytest.approx([0.65, 0.05, 0.5 - G * 0.3**2 / 2], abs=1e-9)


def test_a_particle_slides_off_over_a_corner() -> None:
    """What gets past both edges at once leaves the face once."""
    joint = "type: point, parent: ground, child: b, axes: xyz, initial: {q: [0.4, 0.4, 0.5], u: [0.5, 0.5, 0]}"
    run = run_of("mass: 1", joint, "static: 0", 0.5)
    assert [(kind, t) for t, kind, _ in changes(run)] == [("open", pytest.approx(0.2, abs=1e-9))]
    assert run.q[-1] == pytest.approx([0.65, 0.65, 0.5 - G * 0.3**2 / 2], abs=1e-9)


@pytest.mark.parametrize(
    ("x", "z", "u", "contact", "t_end"),
    [
        (0.4, 0.8, 0.5, "static: 0", 0.8),
        (0.4, 0.8, 0.5, "static: 0.3", 0.8),
        (0.6, 1.2, 0.0, "restitution: 0.5, open: true", 0.5),
        (0.75, 0.8, 0.0, "static: 0.3", 0.4),
        (0.81, 0.8, 0.0, "open: true", 0.3),
    ],
)
def test_a_ball_beside_the_edge_moves_as_a_disc_in_a_plane(
    x: float, z: float, u: float, contact: str, t_end: float
) -> None:
    """Off the face over the edge, down onto the edge, and past the box."""
    found = [
        run_of(
            "mass: 1, inertia: {Ixx: 0.036, Iyy: 0.036, Izz: 0.036}, surfaces: {rim: {sphere: 0.3}}",
            f"{FREE}, initial: {{q: [{x}, 0.1, {z}, 0, 0, 0], u: [{u}, 0, 0, 0, 0, 0]}}",
            contact,
            t_end,
        ),
        run_of(
            "mass: 1, inertia: {Izz: 0.036}, surfaces: {rim: {disc: 0.3}}",
            f"{PLANAR}, initial: {{q: [{x}, {z}, 0], u: [{u}, 0, 0]}}",
            contact,
            t_end,
            gravity=f"0, -{G}, 0",
        ),
    ]
    space, plane = found
    assert [t for t, _, _ in changes(space)] == pytest.approx([t for t, _, _ in changes(plane)], abs=1e-8)
    assert space.q[:, [0, 2]] == pytest.approx(plane.q[:, :2], abs=1e-7)
    assert space["b1"] == pytest.approx(-plane["b1"], abs=1e-7)
    assert space["y"] == pytest.approx([0.1] * len(space), abs=1e-9)


def test_a_ball_strikes_an_edge_along_the_line_from_there_to_its_centre() -> None:
    """Dropped 0.1 m beside the face it touches the edge at the depth sqrt(r^2 - 0.1^2) above it."""
    joint = f"{FREE}, initial: {{q: [0.6, 0, 1.2, 0, 0, 0]}}"
    run = run_of("shape: {sphere: 0.3, mass: 1}", joint, "restitution: 0.5, open: true", 0.5)
    above = math.sqrt(0.3**2 - 0.1**2)
    ((t, kind, element),) = changes(run)
    assert (kind, element) == ("impact", "c.right_front")
    assert t == pytest.approx(math.sqrt(2 * (0.7 - above) / G), abs=1e-9)
    assert run.events[0]["impulse"] == pytest.approx(1.5 * G * t * above / 0.3, rel=1e-8)


CUBE = "shape: {box: [0.2, 0.2, 0.2], mass: 1}"


def test_a_cube_slides_off_a_cube_over_edges_that_are_named() -> None:
    """Two corners at a time leave the face; it tips over the edge as in a plane."""
    edges = ", ".join(
        f"e{k}: {{between: [b.{side}_back, box.right_front], open: true}}" for k, side in enumerate(("top", "bottom"))
    )
    space = run_of(
        CUBE,
        f"{FREE}, initial: {{q: [0.3, 0, 0.6, 0, 0, 0], u: [1, 0, 0, 0, 0, 0]}}",
        "static: 0",
        0.5,
        more=f", {edges}",
    )
    plane = run_of(
        CUBE, f"{PLANAR}, initial: {{q: [0.3, 0.6, 0], u: [1, 0, 0]}}", "static: 0", 0.5, gravity=f"0, -{G}, 0"
    )
    left = [t for t, kind, _ in changes(space) if kind == "open"]
    assert left[:4] == pytest.approx([0.1, 0.1, 0.2, 0.2], abs=1e-8)
    assert space.q[:, [0, 2]] == pytest.approx(plane.q[:, :2], abs=1e-6)
    assert space["b1"] == pytest.approx(-plane["b1"], abs=1e-5)
    assert not [x for x in space.events if x["kind"] == "edges cross"]


def test_a_cube_whose_edges_are_not_named_says_so() -> None:
    joint = f"{FREE}, initial: {{q: [0.3, 0, 0.6, 0, 0, 0], u: [1, 0, 0, 0, 0, 0]}}"
    run = run_of(CUBE, joint, "static: 0", 0.2)
    assert [t for t, kind, _ in changes(run) if kind == "open"] == pytest.approx([0.1, 0.1], abs=1e-8)
    assert "an edge of one box of contact c leads through the other" in run_summary(run)


def test_what_has_come_in_through_an_edge_ends_the_run() -> None:
    joint = f"{FREE}, initial: {{q: [0.3, 0, 0.6, 0, 0, 0], u: [1, 0, 0, 0, 0, 0]}}"
    with pytest.raises(mbs.RunError, match=r"has come into the box through an edge.*declare a contact of both edges"):
        run_of(CUBE, joint, "static: 0", 1)


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        ("rod: 0.5", "the side of b does not touch the edges of box in contact c"),
        ("disc: 0.3", "rims of b touch the faces of box in contact c, nothing of it the edges and corners"),
        ("cylinder: [0.2, 0.3]", "rims of b touch the faces of box in contact c"),
    ],
)
def test_check_hints_at_edges_that_nothing_touches(shape: str, said: str) -> None:
    joint = f"{FREE}, initial: {{q: [0, 0, 2, 0.1, 0.2, 0.3]}}"
    known = {"gravity": f"0, 0, -{G}", "ends": "b, box", "more": "", "t_end": 1, "contact": "open: true"}
    system = mbs.loads(HEAD.format(body=f"shape: {{{shape}, mass: 1}}", joint=joint, **known))
    assert any(said in hint for hint in check(system).hints)
