"""Ropes, rods and springs on the side on which they start: no sign() and abs() where one side is meant."""

from __future__ import annotations

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.documents.derivation import derivation_document
from multibody_sym.documents.document import write_document
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.motion import motion_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.mechanics.state import state_of

ATWOOD = """\
multibody_sym: 1
name: atwood
gravity: [0, -g, 0]
parameters:
  g: {value: 9.81, positive: true}
  m1: {value: 1, positive: true}
  m2: {value: 2, positive: true}
  R: {value: 0.1, positive: true}
  h: {value: 3, positive: true}
  k: {value: 50, positive: true}
bodies:
  ground: {points: {top: [0, h, 0], left: [-R, 0, 0], right: [R, 0, 0]}}
  one: {mass: m1}
  two: {mass: m2}
joints:
  L: {type: prismatic, parent: ground.left, child: one, axis: y, q: y1, initial: {q: 0.5}}
  N: {type: prismatic, parent: ground.right, child: two, axis: y, q: y2, initial: {q: -0.5}}
pulleys: {P: {at: ground.top, radius: R}}
constraints: {string: {type: rope, path: [one, P, two]}}
"""
SPRING = "forces: {spring: {type: spring_damper, between: [ground.left, one], stiffness: k, length: 0.2}}\n"


def told(text: str) -> str:
    return write_document(derivation_document(mbs.derive(mbs.loads(text))), "text")


def test_the_plainest_machine_with_a_symbolic_radius_is_as_short_as_without() -> None:
    lines = told(ATWOOD).splitlines()
    assert max(map(len, lines)) <= 100
    assert "    m1*y1'' + m1*g = lambda_string" in lines
    assert "    m2*y2'' + m2*g = lambda_string" in lines
    assert "    phi_string = length_of_string - pi*R - 2*h + y1 + y2" in lines
    place = lines.index("Sides at the start, on which these equations hold")
    assert lines[place + 1 : place + 3] == [
        "    string, one to ground.top: h - y1 > 0", "    string, ground.top to two: h - y2 > 0"
    ]


def test_a_wheel_that_turns_with_its_rope_is_as_plain() -> None:
    heavy = ATWOOD.replace("P: {at: ground.top, radius: R}", "P: {body: wheel, radius: R}").replace(
        "  one: {mass: m1}", "  wheel: {shape: {disc: R, mass: 2*m1}}\n  one: {mass: m1}"
    )
    hub = "joints:\n  H: {type: revolute, parent: ground.top, child: wheel, q: phi}\n"
    lines = told(heavy.replace("joints:\n", hub)).splitlines()
    assert "    m1*R^2*phi'' = R*lambda_string_1 - R*lambda_string_2" in lines
    assert "    d/dt phi_string.1 = R*phi' + y1'" in lines
    assert not [line for line in lines if "angle_of" in line], "directions that stay need no angle of the start"


@pytest.mark.parametrize(("q", "force"), [(0.5, "k*y1"), (-0.5, "k*y1")])
def test_a_spring_along_a_guide_has_one_sign_on_its_side(q: float, force: str) -> None:
    lines = told(ATWOOD.replace("initial: {q: 0.5}", f"initial: {{q: {q}}}") + SPRING)
    assert "abs" not in lines
    assert "sign" not in lines
    assert force in lines
    assert f"spring, ground.left to one: {'' if q > 0 else '-'}y1 > 0" in lines


def test_what_is_not_led_along_its_tangent_stays_as_it_was() -> None:
    """The guide beside the tangent by numbers alone, or at an angle: the rope turns as the load goes."""
    beside = told(ATWOOD.replace("left: [-R, 0, 0]", "left: [-0.1, 0, 0]"))
    assert "string, one to ground.top" not in beside
    assert "string, ground.top to two: h - y2 > 0" in beside


def test_equations_are_those_of_the_programs_on_that_side() -> None:
    """H and gamma of the derivation, which knows the side, against the kinematics, which knows none."""
    system = mbs.loads(ATWOOD.replace("axis: y, q: y1", "axis: [-0.6, -0.8, 0], q: y1") + SPRING)
    resolved = mechanism(system)
    begin = start(resolved)
    terms = mbs.derive(system).lambdify("terms")
    rng = np.random.default_rng(0)
    for _ in range(5):
        q = [0.4 + rng.uniform(0, 1), rng.uniform(-1, 1)]
        u = rng.uniform(-1, 1, 2).tolist()
        _M, _f, H, gamma = terms(q, u)
        rows = row_motions(motion_of(resolved, state_of(resolved, float, 0.0, q, u, begin.parameters)))
        np.testing.assert_allclose(H, [row.jacobian for row in rows], atol=1e-13)
        np.testing.assert_allclose(gamma, [row.gamma for row in rows], atol=1e-12)


def test_ropes_that_may_slacken_or_slip_are_on_their_sides_too() -> None:
    """In the mode of the start: taut, over a rough drum on which the rope slips forward."""
    assert "    m1*y1'' + m1*g = lambda_string" in told(ATWOOD.replace("[one, P, two]", "[one, P, two], slack: true"))
    slips = told(ATWOOD.replace("radius: R}", "radius: R, rough: 0.1}")).splitlines()
    assert "    phi_string = length_of_string - pi*R - 2*h + y1 + y2" in slips
    assert not [line for line in slips if "sign" in line or "abs" in line]
