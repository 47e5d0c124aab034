"""Stops, ropes that may slacken and friction in joints as one-way elements of a mechanism."""

from __future__ import annotations

import pytest

from multibody_sym import loads
from multibody_sym.errors import ModelError
from multibody_sym.mechanics.resolve import mechanism

MODEL = """\
multibody_sym: 1
name: s
parameters: {l: 2, mu: 0.3}
bodies:
  a: {mass: 1, inertia: {Izz: 1}}
  b: {mass: 1, inertia: {Izz: 1}}
  ground: {points: {o: [0, 3, 0]}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: x, q: x, limits: {lower: -1, upper: l, restitution: 0.5}}
  B: {type: revolute, parent: ground, child: b, limits: {upper: 90 deg, acts: false}}
forces:
  rub: {type: friction, joint: A, static: mu, length: 0.4}
  journal: {type: friction, joint: B, kinetic: 0.1, radius: 0.02}
constraints:
  rope: {type: rope, path: [a, ground.o], slack: true}
  rod: {type: distance, between: [b, ground.o], value: 3}
"""


def test_what_holds_one_way_only_is_no_row_before_a_mode_says_so() -> None:
    found = mechanism(loads(MODEL))
    assert [row.name for row in found.rows] == ["rod"]
    assert [(x.name, x.kind, x.group, x.unilateral) for x in found.one_way] == [
        ("rope", "rope", "rope", True),
        ("A.lower", "stop", "A", True),
        ("A.upper", "stop", "A", True),
        ("rub", "friction", "rub", False),
        ("journal", "friction", "journal", False),
    ]
    assert [x.words for x in found.one_way[:3]] == [("taut", "slack"), ("lower", "free"), ("upper", "free")]
    assert {x.restitution.shadow for x in found.one_way[1:3]} == {0.5}
    rub, journal = (x.frictions[0] for x in found.one_way[3:])
    assert (rub.static, rub.normals, rub.norm) == (rub.kinetic, (0, 1), False)  # two pads, each with its own size
    assert (journal.kinetic.shadow, journal.normals, journal.norm) == (0.1 * 0.02, (0, 1), True)


@pytest.mark.parametrize(
    ("old", "new", "message", "path"),
    [
        ("static: mu, length: 0.4", "static: mu, radius: 1", "a slider has none; give the length", "forces.rub.radius"),
        (", radius: 0.02", "", "a hinge rubs on a journal: give its radius", "forces.journal.radius"),
        ("joint: A, static", "joint: C, static", "no joint is called 'C'", "forces.rub.joint"),
        ("type: revolute", "type: planar", "limits are for joints with one freedom", "joints.B.limits"),
        (
            "axis: x, q: x, limits: {lower: -1, upper: l, restitution: 0.5}",
            "axis: x, motion: t",
            "'A' is another, or prescribed",
            "forces.rub.joint",
        ),
    ],
)
def test_what_cannot_rub_is_told_with_its_place(old: str, new: str, message: str, path: str) -> None:
    with pytest.raises(ModelError, match=message) as caught:
        mechanism(loads(MODEL.replace(old, new)))
    assert ".".join(caught.value.where.path) == path
