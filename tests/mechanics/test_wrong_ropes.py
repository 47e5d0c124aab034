"""Ropes and pulleys that cannot be: told with the place in the file and what to write instead."""

from __future__ import annotations

import pytest

from multibody_sym.errors import ModelError
from multibody_sym.mechanics.model_files import locate_error
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.system import system_from_tree
from multibody_sym.text.yaml_tree import read_text

FILE = """\
multibody_sym: 1
name: wrong
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {top: [0, 2, 0]}}
  wheel: {shape: {disc: 0.1, mass: 1}}
  load: {mass: 1}
  other: {mass: 2}
joints:
  hub: {type: revolute, parent: ground.top, child: wheel, q: phi}
  L: {type: prismatic, parent: ground, child: load, axis: y, q: x}
  O: {type: prismatic, parent: ground, child: other, axis: y, q: y}
pulleys:
  P: {at: ground.top}
  W: {body: wheel, radius: 0.1}
constraints:
  rope: {type: rope, path: [load, P, other]}
"""
PULLEY, ROPE = "W: {body: wheel, radius: 0.1}", "path: [load, P, other]}"


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        (PULLEY, "W: {body: wheel}", 15, "a wheel that turns with its rope needs its radius"),
        (PULLEY, "W: {radius: 0.1}", 15, "say where it is: at: a point .*, or body: the wheel"),
        (PULLEY, "W: {body: wheel, at: ground.top, radius: 0.1}", 15, "give one of them"),
        (PULLEY, "W: {body: ground.top, radius: 0.1}", 15, "ground turns with no rope"),
        (PULLEY, "W: {body: load, radius: 0.1}", 15, "joint L does not turn load by an angle about the axis"),
        (PULLEY, "W: {body: wheel, radius: 0.1, axis: x}", 15, "joint hub does not turn wheel by an angle"),
        (PULLEY, "W: {body: weel, radius: 0.1}", 15, "did you mean"),
        (ROPE, "path: [load, P]}", 17, "the rope ends on pulley P and is fastened to nothing there"),
        (ROPE, "path: [W, P, other]}", 17, "or, if it winds on it, write wind: W"),
        (ROPE, "path: [load, P, other, P, load]}", 17, "the rope runs over pulley P twice"),
        (ROPE, "path: [load, W], wind: P}", 17, "P stands at a point and turns nothing"),
        (ROPE, "path: [load, W], wind: drum}", 17, "no pulley is called 'drum'"),
        (ROPE, "path: [load, W, other], wind: W}", 17, "W stands between the ends of the path"),
        (ROPE, "path: [load, W], wind: W}", 17, 'not told.*wrap: "\\+" hangs down on the right'),
        (ROPE, "path: [W, load], wind: W}", 17, 'wrap: "-" hangs down on the right'),
        (ROPE, 'path: [load, P, other], wrap: {W: "+"}}', 17, "the rope does not run over a pulley 'W'"),
        (ROPE, "path: [load, W], wind: W, wrap: left}", 17, "'left' is no choice here"),
        (ROPE, 'path: [load, W], wind: W, wrap: "+", length: 2}', 17, "leave length out"),
        (ROPE, "path: [load, W, other], length: 2}", 17, "leave length out"),
        (ROPE, 'path: [load, P, other], turns: -1}', 17, "expected a whole number, at least 0"),
    ],
)
def test_a_rope_that_cannot_be_is_told_with_its_line(old: str, new: str, line: int, message: str) -> None:
    tree = read_text(FILE.replace(old, new), "wrong.yaml")
    with pytest.raises(ModelError, match=message) as caught:
        mechanism(system_from_tree(tree.data))
    where = locate_error(caught.value, tree, "wrong.yaml").where
    assert where.line == line
    assert where.column
