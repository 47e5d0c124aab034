"""Ropes that run over a wheel without turning it are told by name, where the wheel could turn and nothing ties it."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.documents.solution import check_text, solution_text

ATWOOD = """\
multibody_sym: 1
name: atwood
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {axle: [0, 0, 0], west: [-0.2, 0, 0], east: [0.2, 0, 0]}}
  wheel: {shape: {disc: 0.2, mass: 4}}
  left: {mass: 1}
  right: {mass: 3}
joints:
  hub: {type: revolute, parent: ground, child: wheel, q: phi}
  L: {type: prismatic, parent: ground.west, child: left, axis: -y, q: x, initial: {q: 1}}
  R: {type: prismatic, parent: ground.east, child: right, axis: -y, q: y, initial: {q: 1}}
pulleys: {top: {at: wheel, radius: 0.19999999}}
constraints:
  string: {type: rope, path: [left, top, right]}
outputs: {force: tension(string)}
"""
HUB = "revolute, parent: ground, child: wheel, q: phi}"


def told(text: str) -> list[str]:
    """Return the hints of check on ropes that slip, having compared them with the notes of solve."""
    system = mbs.loads(text)
    hints = [hint for hint in mbs.check(system).hints if "slips over" in hint]
    assert [note for note in mbs.solve(system).notes if "slips over" in note] == hints
    return hints


@pytest.mark.parametrize(
    "change",
    [
        ("", ""),
        (", radius: 0.19999999", ""),
        (HUB, "planar, parent: ground, child: wheel}"),
        ("parent: ground, child: wheel, q: phi", "parent: ground, child: wheel, q: phi, initial: {u: 3}"),
    ],
    ids=["radius", "point", "movable", "turning"],
)
def test_a_wheel_that_its_rope_does_not_turn_is_told(change: tuple[str, str]) -> None:
    text = ATWOOD.replace(*change)
    (hint,) = told(text)
    assert hint.startswith("rope string slips over wheel without turning it")
    assert hint in check_text(mbs.check(mbs.loads(text)))
    assert hint in solution_text(mbs.solve(mbs.loads(text)))


ROUGH = ATWOOD.replace("at: wheel, radius: 0.19999999", "body: wheel, radius: 0.2, rough: MU").split("outputs:")[0]
TIE = "  tie: {type: expression, zero: x - 1 + 0.2*phi}\n"


@pytest.mark.parametrize(
    "text",
    [
        ATWOOD.replace("at: wheel", "at: ground.axle"),
        ROUGH.replace("MU", "0.5"),
        ROUGH.replace("MU", "0.05"),
        ATWOOD.replace("outputs:", TIE + "outputs:"),
        ATWOOD.replace(HUB, "fixed, parent: ground, child: wheel}"),
        ATWOOD.replace(HUB, "prismatic, parent: ground, child: wheel, axis: y}"),
        ATWOOD.replace(", radius: 0.19999999", "").replace("shape: {disc: 0.2, mass: 4}", "mass: 4, com: [0, 1, 0]"),
    ],
    ids=["on ground", "rough", "slipping", "tied", "fixed", "movable without turning", "an eye at the hinge of an arm"],
)
def test_what_is_no_wheel_or_is_tied_gives_no_hint(text: str) -> None:
    assert told(text) == []
