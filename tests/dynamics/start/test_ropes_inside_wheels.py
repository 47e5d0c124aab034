"""A rope that no straight piece can lead round its wheel at the start is told with what is too near to what."""

from __future__ import annotations

import pytest

import multibody_sym as mbs

FILE = """\
multibody_sym: 1
name: near
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {top: [0, 2, 0], beside: [0.15, 2, 0]}}
  load: {mass: 1}
  other: {mass: 2}
joints:
  L: {type: prismatic, parent: ground, child: load, axis: y, q: x, initial: {q: 1.95}}
  O: {type: prismatic, parent: ground, child: other, axis: y, q: y}
pulleys:
  P: {at: ground.top, radius: 0.1}
  Q: {at: ground.beside, radius: 0.3}
constraints:
  rope: {type: rope, path: [load, P, other], wrap: {P: "+"}}
"""


@pytest.mark.parametrize("length", ["", ", slack: true", ", length: 3, slack: true"])
def test_an_end_inside_its_wheel_is_told_with_the_distance_and_the_radius(length: str) -> None:
    text = FILE.replace('wrap: {P: "+"}', f'wrap: {{P: "+"}}{length}')
    with pytest.raises(mbs.ModelError, match=r"load is 0\.05 m from ground\.top.*wheels.*0\.1 m.*initial") as caught:
        mbs.simulate(mbs.loads(text))
    assert caught.value.where.path == ("constraints", "rope")


@pytest.mark.parametrize("wrap", ["{P: '+', Q: '+'}", "{P: '+', Q: '-'}"])
def test_a_wheel_inside_the_next_one_is_told(wrap: str) -> None:
    """Radii of 0.1 and 0.3 m at 0.15 m: neither an outer (0.2 m) nor a crossed tangent (0.4 m) leads to the other."""
    radii = "0.2 m" if "-" not in wrap else "0.4 m"
    text = FILE.replace("q: 1.95", "q: 0").replace(
        'path: [load, P, other], wrap: {P: "+"}', f"path: [load, P, Q, other], wrap: {wrap}"
    )
    with pytest.raises(mbs.ModelError, match=rf"ground\.top is 0\.15 m from ground\.beside.*{radii}"):
        mbs.simulate(mbs.loads(text))
