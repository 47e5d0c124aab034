"""What is no more than rounding of its terms is told as 0 by `solve`, with its formula; what is small is not."""

from __future__ import annotations

from pathlib import Path

import pytest

import multibody_sym as mbs
from multibody_sym.scalars.node import symbol
from multibody_sym.scalars.sign_changes import Bounded, bound_rounding
from multibody_sym.text.parser import parse

HUNG = """
multibody_sym: 1
name: hung
gravity: [0, -{g}, 0]
parameters: {{g: 9.81, m: 0.1, k: 100, l0: 0.3, s0: {s0}}}
bodies: {{load: {{mass: {m}}}, rod: {{mass: 3, com: [0, -0.7, 0], inertia: {{Izz: 0.1}}}}}}
joints:
  slide: {{type: prismatic, parent: ground, child: load, axis: -y, q: s, initial: {{q: {start}}}}}
  hinge: {{type: revolute, parent: ground, child: rod, axis: z, q: theta, initial: {{q: 180 deg}}}}
forces: {{spring: {{type: spring, between: [ground, load], stiffness: {k}, length: {l0}}}}}
ask: {{side: "position(rod, x)", way: {{of: load, after: 3 s}}, less: s - 0.30981}}
"""
NAMED = {"g": "g", "m": "m", "k": "k", "l0": "l0", "s0": "0.30981", "start": "s0"}
LITERAL = {"g": "9.81", "m": "0.1", "k": "100", "l0": "0.3", "s0": "0", "start": "0.30981"}


@pytest.mark.parametrize("values", [NAMED, LITERAL], ids=["named", "literal"])
def test_a_position_of_rest_has_no_acceleration_and_no_way(values: dict[str, str]) -> None:
    found = mbs.solve(mbs.loads(HUNG.format(**values)))
    shown = {name: value.value for name, value in (*found.accelerations.items(), *found.answers.items())}
    assert shown == {"s": 0.0, "theta": 0.0, "side": 0.0, "way": 0.0, "less": 0.0}
    assert found.accelerations["s"].as_json()["expression"] == ("0" if values is LITERAL else "g + k*(l0 - s0)/m")
    assert found.reactions["hinge"]["fy"].value == pytest.approx(29.43, rel=1e-15)


def test_a_small_acceleration_stays_what_it_is() -> None:
    """A displacement of 1e-12 m out of rest is ten thousand times its rounding: s'' = -k/m 1e-12."""
    found = mbs.solve(mbs.loads(HUNG.format(**{**NAMED, "s0": "0.309810000001"})))
    assert found.accelerations["s"].value == pytest.approx(-1e-9, rel=1e-3)
    assert found.answers["less"].value == pytest.approx(1e-12, rel=1e-3)


def test_accelerations_that_are_rounding_beside_large_ones_are_zero() -> None:
    """Andrews' squeezer starts with five accelerations that are 0 in its published values."""
    found = mbs.solve(mbs.load(Path(__file__).parents[2] / "examples" / "andrews_squeezer.yaml")).accelerations
    assert [found[name].value for name in ("gamma", "delta", "phi", "epsilon", "omega")] == [0.0] * 5
    assert found["beta"].value == pytest.approx(14222.4439199541138, rel=1e-9)


def test_bounds_of_rounding_hold_and_are_not_loose() -> None:
    x, y = symbol("x"), symbol("y")
    leaves = {x: Bounded(1 / 3, 5.6e-17), y: Bounded(1e8, 0.0)}
    written = ("x*y + 1 - x*y", "(-x)^2", "sqrt(x)", "log(x - 1)")
    total, square, root, none = bound_rounding(map(parse, written), leaves)
    assert abs(total.value - 1) <= total.bound < 1e-7
    assert 3e-17 < square.bound < 1e-16
    assert 5e-17 < root.bound < 3e-16
    assert none.bound == float("inf")


def test_a_quotient_of_many_digits_is_printed_as_a_decimal() -> None:
    model = """
multibody_sym: 1
name: literal
gravity: [0, -9.81, 0]
bodies: {a: {mass: 1.37}, b: {mass: 2.913, com: [0.317, 0, 0], inertia: {Izz: 0.0371}}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: x, q: x}
  B: {type: revolute, parent: a, child: b, axis: z, q: theta, initial: {u: 1.3}}
"""
    found = mbs.solve(mbs.loads(model)).accelerations
    assert str(found["theta"]) == f"{found['theta'].value:.10g} rad/s^2"
    by_hand = -9.81 * 2.913 * 0.317 / (0.0371 + 2.913 * 0.317**2)
    assert found["theta"].value == pytest.approx(by_hand, rel=1e-12)
