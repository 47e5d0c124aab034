"""Forces of couplings: how their place is written, in absolute coordinates, in examples and in exported code."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.errors import ModelError

G, M, m, R = 9.81, 4.0, 1.5, 0.3
A = m * G / (m + M / 2)
DRUM = f"""\
multibody_sym: 1
name: drum
gravity: [0, -{G}, 0]
bodies:
  ground: {{points: {{side: [{R}, 0, 0]}}}}
  drum: {{shape: {{disc: {R}, mass: {M}}}}}
  block: {{mass: {m}}}
joints:
  axle: {{type: revolute, parent: ground, child: drum, q: phi}}
  guide: {{type: prismatic, parent: ground.side, child: block, axis: -y, q: s}}
"""
STRING = f"constraints: {{string: {{type: expression, zero: s - {R}*phi, acts: in_joints}}}}\n"
NO_PLACE = STRING.replace(", acts: in_joints", "")


def test_what_is_declared_reads_and_writes() -> None:
    system = mbs.loads(DRUM + STRING)
    assert mbs.loads(mbs.dumps(system)) == system
    assert mbs.Expression("s - 0.3*phi", acts="in_joints") == mbs.loads(DRUM + STRING).constraints["string"]
    with pytest.raises(ModelError, match="no choice"):
        mbs.Coupler({"A": 1}, acts="somewhere")


OUTPUTS = 'outputs: {bearing: "2*reaction(axle, fy)", side: "reaction(axle, fz)", force: multiplier(string)}\n'


def test_absolute_coordinates_tell_the_same_forces_in_joints() -> None:
    text = DRUM + STRING + OUTPUTS
    runs = [
        mbs.simulate(mbs.loads(text + f"simulation: {{coordinates: {c}}}\n"), t_end=0.1, samples=3, backend="python")
        for c in ("relative", "absolute")
    ]
    for joint in ("axle", "guide"):
        for component, values in runs[0].reactions[joint].items():
            np.testing.assert_allclose(runs[1].reactions[joint][component], values, atol=1e-7)


EXAMPLES = sorted((Path(__file__).parents[2] / "examples").rglob("*.yaml"))


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_examples_withhold_nothing_that_is_determined(file: Path) -> None:
    """In all of them every force has a place: the sleigh's edge acts in the joint that stands for the table."""
    from multibody_sym.mechanics.resolve import mechanism

    found = {name: each.components for name, each in mechanism(mbs.load(file)).withheld.items()}
    assert found == {}


def test_exported_code_leaves_out_outputs_without_a_value(tmp_path: Path) -> None:
    mbs.export(mbs.loads(DRUM + NO_PLACE + OUTPUTS), "python", tmp_path)
    names = json.loads((tmp_path / "names.json").read_text())
    assert names["outputs"] == ["side", "force"]
    assert names["withheld_outputs"] == ["bearing"]
    assert "string" in names["withheld_reasons"][0]
