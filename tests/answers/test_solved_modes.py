"""A start solved in a given mode: what is near a limit is not at it."""

from __future__ import annotations

import multibody_sym as mbs
from multibody_sym.answers.instant.instant import Decided, solved_in
from multibody_sym.answers.solve import solution_of
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.law_elements import Mode
from multibody_sym.mechanics.modes import in_mode

RAMP = """
multibody_sym: 1
name: ramp
gravity: [0, -g, 0]
parameters: {g: 10 m/s^2, a: 45 deg, mu: 1.0000000000000001, nu: 0.5, m: 2 kg}
bodies:
  ground: {surfaces: {ramp: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}
  block: {mass: m}
joints: {J: {type: point, parent: ground, child: block}}
contacts: {c1: {between: [block, ground.ramp], static: mu, kinetic: nu}}
"""


def test_near_the_limit_is_not_at_it() -> None:
    system = mbs.loads(RAMP)
    declared = check_numbers(system)
    mechanism = in_mode(declared, Mode({"c1": 1}, {"c1": 0}))
    decided = Decided(touching=frozenset({"c1"}), at_limit=("c1.friction",))
    assert solution_of(solved_in(system, mechanism, start(mechanism), decided=decided))[0].at_limit == {}
