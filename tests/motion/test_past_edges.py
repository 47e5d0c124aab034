"""What slides past the end of a face falls off it, and a box is handed from its corner to the edge of the table."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs

TABLE = """\
multibody_sym: 1
name: table
gravity: [0, -10, 0]
bodies:
  ground: {{surfaces: {{table: {{plane: [0, 0, 0], normal: y, between: [[-2, 0, 0], [0, 0, 0]]}}}}}}
  {body}
joints: {{J: {{{joint}}}}}
contacts: {{c: {{between: [b, ground.table], static: {mu}}}}}
simulation: {{t_end: 0.7, samples: 8, rtol: 1e-10, atol: 1e-12}}
"""


def changes(body: str, joint: str, mu: float) -> list[tuple[float, str, str]]:
    run = mbs.simulate(mbs.loads(TABLE.format(body=body, joint=joint, mu=mu)), backend="python")
    return [(event["t"], event["kind"], event["element"]) for event in run.events]


def test_a_particle_slides_off_a_table() -> None:
    """0.5 = 2 t - t^2/2."""
    joint = "type: point, parent: ground, child: b, initial: {q: [-0.5, 0], u: [2, 0]}"
    ((t, kind, element),) = changes("b: {mass: 1}", joint, 0.1)
    assert (kind, element) == ("open", "c")
    assert t == pytest.approx(2 - math.sqrt(3), abs=1e-9)


def test_a_box_slides_over_the_edge_and_tips() -> None:
    """Its corner gets to the edge after 0.3 m; it tips when its normal force, mu h ahead of the centre, is there."""
    joint = "type: planar, parent: ground, child: b, initial: {q: [-0.5, 0.1, 0], u: [1, 0, 0]}"
    found = changes("b: {shape: {box: [0.4, 0.2, 1], mass: 1}}", joint, 0.05)
    times = {(kind, element): t for t, kind, element in found}
    assert times["open", "c.corner2"] == pytest.approx(2 - 2 * math.sqrt(1 - 0.3), abs=1e-9)
    assert times["slide+", "c.bottom.end2"] == times["open", "c.corner2"]
    assert times["open", "c.corner1"] == pytest.approx(2 - 2 * math.sqrt(1 - 0.495), abs=1e-8)


@pytest.mark.parametrize("ends", ["b, ground.table", "ground.table, b"])
def test_a_rod_bounces_on_a_table_that_ends(ends: str) -> None:
    """It falls 0.2 m in 0.2 s and rises as high again; each of its ends may meet each end of the table."""
    joint = "type: planar, parent: ground, child: b, initial: {q: [-1.5, 0.2, 0]}"
    text = TABLE.format(body="b: {shape: {rod: 0.5, mass: 1}}", joint=joint, mu=0)
    text = text.replace("b, ground.table", ends).replace("static: 0", "restitution: 1")
    run = mbs.simulate(mbs.loads(text), t_end=0.4, backend="python")
    assert [event["t"] for event in run.events] == pytest.approx([0.2, 0.2], abs=1e-9)
    assert run.q[-1] == pytest.approx([-1.5, 0.2, 0.0], abs=1e-8)
