"""Bode's plots, samples and StateSpace objects of five systems against python-control."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs

control: Any = pytest.importorskip("control", reason="the peer python-control (extra: peers) is not installed")

EXAMPLES = Path(__file__).parents[2] / "examples"
CHAIN = """
multibody_sym: 1
name: chain
bodies: {a: {mass: 1}, b: {mass: 2}, c: {mass: 0.5}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: x, q: x}
  B: {type: prismatic, parent: a, child: b, axis: x, q: y}
  C: {type: prismatic, parent: b, child: c, axis: x, q: z}
forces:
  sa: {type: spring_damper, joint: A, stiffness: 100, damping: 0.4}
  sb: {type: spring_damper, joint: B, stiffness: 50, damping: 0.2}
  sc: {type: spring_damper, joint: C, stiffness: 20, damping: 0.1}
  push: {type: force, on: a, value: [F, 0, 0]}
  pull: {type: force, on: c, value: [P, 0, 0]}
inputs: {F: 0, P: 0}
outputs: {end: "position(c, x)", felt: "100*x", shaken: "acceleration(b, x)"}
"""
SYSTEMS: dict[str, tuple[Any, dict[str, Any]]] = {
    "chain": (CHAIN, {}),
    "cart": ("cart_pole", {"at": {"theta": "-90 deg"}, "inputs": {"push": 0}}),
    "pole": ("cart_pole", {"at": {"theta": "90 deg"}, "inputs": {"push": 0}}),
    "furuta": ("furuta", {"at": {"theta": 0.0}, "inputs": {"tau": 0}}),
    "upright": ("furuta", {"at": {"theta": "180 deg"}, "inputs": {"tau": 0}}),
}


@pytest.mark.parametrize("name", SYSTEMS)
def test_responses_are_those_of_python_control(name: str) -> None:
    model, options = SYSTEMS[name]
    system = mbs.loads(model) if "\n" in model else mbs.load(EXAMPLES / f"{model}.yaml")
    here = mbs.linearize(system, **options)
    for mine in (here, here.discrete(0.01)):
        theirs = mine.to_control()
        assert theirs.input_labels == list(mine.inputs)
        assert theirs.state_labels == list(mine.states)
        found = mbs.bode(mine)
        points = 1j * found.omega if mine.dt is None else np.exp(1j * found.omega * mine.dt)
        response = np.moveaxis(theirs(points, squeeze=False), -1, 0)
        np.testing.assert_allclose(found.response, response, rtol=0, atol=1e-12 * np.abs(response).max())
    sampled = control.sample_system(here.to_control(), 0.01)
    np.testing.assert_allclose(here.discrete(0.01).A, sampled.A, atol=1e-13)
    np.testing.assert_allclose(here.discrete(0.01).B, sampled.B, atol=1e-13)


def test_amplitude_and_lag_are_those_of_the_transfer_function() -> None:
    """Of all three coordinates of the chain under F = 2 sin(3 t), of which z lags by more than a quarter turn."""
    asked = ", ".join(f"A{x}: {{amplitude: {x}, of: F}}, p{x}: {{phase: {x}, of: F}}" for x in "xyz")
    found = mbs.solve(mbs.loads(CHAIN.replace("F: 0,", "F: 2*sin(3*t),") + f"ask: {{{asked}}}\n")).answers
    model = CHAIN[: CHAIN.index("outputs")]
    peer = control.evalfr(mbs.linearize(mbs.loads(model)).to_control(), 3j)[:3, 0]
    ours = [found[f"A{x}"].value / 2 * np.exp(-1j * found[f"p{x}"].value) for x in "xyz"]
    assert np.abs(ours - peer).max() <= 1e-12 * np.abs(peer).max()
