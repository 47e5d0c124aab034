"""Contacts that start inside each other, and coefficients that parameters make wrong, are told by name."""

from __future__ import annotations

from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.start.contact_starts import contact_gaps, verify_contact_values, verify_outside
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.resolution.resolve import mechanism

FILE = """\
multibody_sym: 1
name: table
gravity: [0, -10, 0]
parameters: {mu: 0.3, nu: 0.2, e: 0, f: 0.01, r: 0.25}
bodies:
  ground: {surfaces: {table: {plane: [0, 0, 0], normal: y, between: [[-1, 0, 0], [1, 0, 0]]}}}
  box: {shape: {box: [0.4, 0.2, 1], mass: 1}}
  wheel: {mass: 1, inertia: {Izz: 1}, surfaces: {rim: {disc: r}}}
joints:
  B: {type: planar, parent: ground, child: box}
  W: {type: planar, parent: ground, child: wheel}
contacts:
  c1: {between: [box, ground.table], static: mu, kinetic: nu, restitution: e}
  c2: {between: [wheel, ground.table], static: enough, rolling_resistance: f}
"""
OUT = {"B_x": 0.0, "B_y": 0.1, "B_theta": 0.0, "W_x": 0.5, "W_y": 0.25, "W_theta": 0.0}


def motion(q: dict[str, float], **parameters: Any) -> Motion:
    resolved = mechanism(mbs.loads(FILE))
    values = parameter_values(resolved, parameters)
    places = [{**OUT, **q}[c.name] for c in resolved.coordinates]
    return motion_of(resolved, state_of(resolved, float, 0.0, places, [0.0] * len(resolved.speeds), values))


def test_gaps_of_all_parts() -> None:
    gaps = {element.name: gap for element, _, gap in contact_gaps(motion({"B_theta": 0.0}))}
    assert gaps == pytest.approx({"c1.corner1": 0, "c1.corner2": 0, "c1.corner3": 0.2, "c1.corner4": 0.2, "c2": 0})


def test_what_touches_is_not_inside() -> None:
    verify_outside(motion({}), 1e-9)
    verify_outside(motion({"B_y": 0.1 - 1e-12}), 1e-9)


def test_a_millimetre_inside_is_told() -> None:
    with pytest.raises(mbs.ModelError, match=r"contacts.c1: box starts 0.001 m inside ground.table \(c1.corner1\)"):
        verify_outside(motion({"B_y": 0.099}), 1e-9)
    with pytest.raises(mbs.ModelError, match=r"contacts.c2: wheel.rim starts 0.001 m inside ground.table; move it out"):
        verify_outside(motion({"W_y": 0.249}), 1e-9)


def test_below_the_level_of_a_table_beside_it_is_not_inside() -> None:
    verify_outside(motion({"B_x": 1.3, "B_y": -5.0, "W_x": -2.0, "W_y": 0.0}), 1e-9)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"nu": -0.1}, r"contacts.c1.kinetic: -0.1 is negative"),
        ({"mu": -0.1}, r"contacts.c1.static: -0.1 is negative"),
        ({"mu": 0.1}, r"contacts.c1.static: static 0.1 is below kinetic 0.2"),
        ({"e": 1.5}, r"contacts.c1.restitution: 1.5 is above 1"),
        ({"f": -0.01}, r"contacts.c2.rolling_resistance: -0.01 is negative"),
        ({"r": 0.0}, r"contacts.c2: a radius there is 0 m"),
    ],
)
def test_values_that_parameters_make_wrong(parameters: dict[str, float], message: str) -> None:
    verify_contact_values(motion({}))
    with pytest.raises(mbs.ModelError, match=message):
        verify_contact_values(motion({}, **parameters))
