"""Curves as they are declared: forms, units, names, what is refused with which words, what is written back."""

from __future__ import annotations

import copy
import math
import pickle

import pytest

import multibody_sym as mbs

WIRE = """
multibody_sym: 1
name: wire
parameters: {{p: 2 m, m: 1 kg}}
bodies: {{bead: {{mass: m}}}}
joints:
  wire:
    type: curve
    parent: ground
    child: bead
    curve: {curve}
    initial: {{q: {q}}}
"""


def wire(curve: str, q: str = "1") -> mbs.System:
    return mbs.loads(WIRE.format(curve=curve, q=q))


@pytest.mark.parametrize(
    ("curve", "unit", "names"),
    [
        ("{y: x^2/(2*p)}", "m", ["x", "y"]),
        ("{x: y^2/p}", "m", ["x", "y"]),
        ("{z: sin(x/p)*p, y: x}", "m", ["x", "y", "z"]),
        ("{x: p*cos(s), y: p*sin(s), parameter: s}", "rad", ["x", "y"]),
        ("{x: s, y: s^2/p, parameter: s}", "m", ["x", "y"]),
        ("{x: p*cos(s/p), y: p*sin(s/p), parameter: s, unit: m}", "m", ["x", "y"]),
    ],
)
def test_forms_and_units(curve: str, unit: str, names: list[str]) -> None:
    system = wire(curve)
    resolved = mbs.mechanism(system)
    assert resolved.coordinates[0].unit == unit
    moved = [axis for axis, way in zip("xyz", resolved.bodies[0].steps[0].rates.s, strict=True) if way.shadow != 0]
    assert moved == names
    assert mbs.loads(mbs.dumps(system)) == system
    assert pickle.loads(pickle.dumps(system)) == system == copy.deepcopy(system)


def test_a_coordinate_may_have_the_name_of_the_parameter() -> None:
    s, (p,) = mbs.variable("s"), mbs.parameters("p", [2])
    circle = mbs.Curve(x=p * mbs.sin(s), y=-p * mbs.cos(s), parameter="s")
    system = mbs.System(
        "wire",
        gravity=[0, -9.81, 0],
        bodies={"bead": mbs.Body(mass=1)},
        joints={"wire": mbs.CurveJoint(parent="ground", child="bead", curve=circle, q="s")},
        outputs={"height": -p * mbs.cos(s)},
    )
    assert mbs.loads(mbs.dumps(system)) == system
    pendulum = mbs.solve(system, initial={"s": 0.5}).accelerations["s"].value
    assert pendulum == pytest.approx(-9.81 / 2 * math.sin(0.5), rel=1e-14)
