"""Units in every expression of a model: coordinates, speeds and time have theirs where parameters were given units."""

from __future__ import annotations

import pytest

import multibody_sym as mbs

MODEL = """
multibody_sym: 1
name: units
parameters: {{m: 1 kg, l: 2 m, k: 3 N/m, c: 5 N*s/m, w: 2 rad/s, T: 2 s, J: 2 kg*m^2{parameters}}}
bodies: {{b: {{mass: m, points: {{p: [l, 0, 0]}}}}, d: {{mass: m, inertia: {{Izz: J}}}}}}
joints:
  A: {{type: prismatic, parent: ground, child: b, axis: x, q: s}}
  B: {{type: revolute, parent: ground, child: d, axis: z, q: theta}}
{rest}
"""
FORCE = "forces: {f: {type: force, on: b, value: [%s, 0, 0]}}"


def test_all_wrong_units_of_an_expression_are_told_at_once() -> None:
    """What is made of a wrong part, here the product with k and the whole sum, is not told."""
    text = """
multibody_sym: 1
name: block
parameters: {k: 100 N/m, T: 2 s, v: 3 m/s}
bodies: {m: {mass: 1}}
joints: {J: {type: prismatic, axis: x, parent: ground, child: m, q: x}}
forces: {f: {type: force, on: m, value: ["k*(x - T) + sin(v)", 0, 0]}}
"""
    with pytest.raises(mbs.InputError) as raised:
        mbs.solve(mbs.loads(text))
    told = [raised.value, *raised.value.others]
    assert {each.where.path for each in told} == {("forces", "f", "value", "0")}
    assert {each.message for each in told} == {
        "a sum of m and s: x is in m, T is in s", "sin() wants a pure number or an angle, and v is in m/s"
    }  # fmt: skip


def test_motion_has_no_units_in_a_model_without_units() -> None:
    text = MODEL.format(rest=FORCE % "s + theta + u_s*t", parameters="")
    for unit in (" kg*m^2", " kg", " N/m", " N*s/m", " m", " rad/s", " s"):
        text = text.replace(f"2{unit}", "2").replace(f"1{unit}", "1").replace(f"3{unit}", "3").replace(f"5{unit}", "5")
    mbs.mechanism(mbs.loads(text))
