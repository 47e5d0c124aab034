"""A rod of no length pulls in no direction: it is refused, with its place, whatever gives the length."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.errors import ModelError
from multibody_sym.mechanics.model_files import locate_error
from multibody_sym.model.system import system_from_tree
from multibody_sym.text.yaml_tree import read_text

FILE = """\
multibody_sym: 1
name: ridge
gravity: [0, -9.81, 0]
parameters: {a: 0.4 m, r: 0.2 m}
bodies:
  cube: {shape: {box: [a, a, a], mass: 5}, points: {toe: [a/2, -a/2, 0]}}
  ground: {points: {ridge: [a/2, 0, 0]}}
joints: {free: {type: planar, parent: ground, child: cube, q: [x, y, phi], initial: {q: [0, a/2, 0], u: [1, 0, 0]}}}
constraints: {trip: {type: distance, between: [cube.toe, ground.ridge], value: 0}}
"""


@pytest.mark.parametrize("value", ["0", "0 mm", "2 - 2"])
def test_a_literal_zero_is_told_with_its_line(value: str) -> None:
    tree = read_text(FILE.replace("value: 0", f"value: {value}"), "ridge.yaml")
    with pytest.raises(ModelError, match=r"a rod of no length has no direction .* joined by a joint") as caught:
        system_from_tree(tree.data)
    assert locate_error(caught.value, tree, "ridge.yaml").where.line == 9
    assert caught.value.number == "M109"


@pytest.mark.parametrize("begins", ["", "impact: {begins: trip}\n"])
def test_a_zero_that_parameters_give_is_told(begins: str) -> None:
    """What begins in an impact is no row of the state before: it was met only where its direction was divided by."""
    system = mbs.loads(FILE.replace("value: 0", "value: a - 2*r") + begins)
    with pytest.raises(ModelError, match="a rod of no length") as caught:
        mbs.solve(system)
    assert caught.value.where.path == ("constraints", "trip", "value")
