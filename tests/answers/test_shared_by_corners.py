"""Forces of least norm are told only where contacts and friction can exert them."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs
from multibody_sym.documents.solution import solution_text

BOX = """
multibody_sym: 1
name: box
gravity: [0, 0, -10]
parameters: {m: 10 kg, mu: 0.5, F: 20 N, y: 0.4 m}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  box: {shape: {box: [1, 1, 0.5], mass: m}, points: {side: [0.5, y, 0]}}
joints: {f: {type: free, parent: ground, child: box, initial: {q: [0, 0, 0.25, 1, 0, 0, 0]}}}
contacts: {c: {between: [box, ground.floor], static: mu}}
simulation: {multipliers: minimum_norm}
forces: {pull: {type: force, on: box, at: side, value: [F, 0, 0]}}
"""
CORNERS = [f"c.corner{k}" for k in range(1, 5)]


@pytest.mark.parametrize(
    ("force", "y", "within"), [(20.0, 0.4, True), (35.0, 0.4, False), (30.0, 0.0, True), (42.0, 0.0, False)]
)
def test_each_corner_is_told_within_its_cone_or_without_a_number(force: float, y: float, within: bool) -> None:
    """By hand: N = m g/4 -+ F h/(4 b), friction F/4 and the couple F y shared along both sides, F y/4 each way."""
    found = mbs.solve(mbs.loads(BOX), parameters={"F": force, "y": y})
    assert {found.states[corner] for corner in CORNERS} == {"stick"}
    share, couple = force / 4, force * y / 4
    beyond = any(
        math.hypot(share + s * couple, couple) > 0.5 * (25 + x * force * 0.25 / 2) for s in (1, -1) for x in (1, -1)
    )
    assert beyond is not within
    for corner in CORNERS:
        told = [found.reactions[corner][name].value for name in ("normal", "friction_1", "friction_2")]
        assert not any(found.reactions[corner][name].unique for name in ("normal", "friction_1", "friction_2"))
        if within:
            normal, *friction = (x for x in told if x is not None)
            assert math.hypot(*friction) <= 0.5 * normal
        else:
            assert told == [None, None, None]
    assert found.reactions["c"]["normal"].value == pytest.approx(100.0, rel=1e-12)
    said = [note for note in found.notes if "least norm" in note]
    assert said == ([] if within else [said[0]])
    if not within:
        assert "would need more friction than there is" in said[0]
        assert "normal(c.corner1) = not unique" in solution_text(found)


def test_a_corner_that_would_pull_is_told_without_a_number() -> None:
    """Three ropes beside each other on a beam share its weight linearly: an outer one would push; those may slacken."""
    model = """
multibody_sym: 1
name: beam
gravity: [0, -10, 0]
parameters: {m: 6 kg, x: 0.8 m}
bodies:
  ground: {points: {a: [-1 m, 1 m, 0], b: [0, 1 m, 0], c: [1 m, 1 m, 0]}}
  beam: {mass: 0, inertia: {Izz: 0.5}, points: {a: [-1, 0, 0], b: [0, 0, 0], c: [1, 0, 0], load: [x, 0, 0]}}
joints: {j: {type: planar, parent: ground, child: beam, q: [px, py, phi]}}
forces: {weight: {type: force, on: beam, at: load, value: [0, -10*m, 0]}}
constraints:
  a: {type: rope, path: [ground.a, beam.a], slack: true}
  b: {type: rope, path: [ground.b, beam.b], slack: true}
  c: {type: rope, path: [ground.c, beam.c], slack: true}
simulation: {multipliers: minimum_norm}
"""
    model = model.replace("{mass: 0,", "{mass: 1e-3 kg,")
    for place, shown in ((0.5, True), (0.8, False)):
        found = mbs.solve(mbs.loads(model), parameters={"x": place})
        told = [found.reactions[rope]["tension"].value for rope in "abc"]
        assert all(x is not None and x >= 0 for x in told) if shown else told == [None, None, None]
