"""What gets past an edge of a box in space leaves its face there: closed forms, and the same motion in a plane."""

from __future__ import annotations

import pytest

import multibody_sym as mbs

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
