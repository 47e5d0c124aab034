"""`find` on problems with known answers: throws, loops, springs, brakes, swings; formulas where books have them."""

from __future__ import annotations

from math import sin

import pytest

import multibody_sym as mbs
from multibody_sym.answers.ask.zeros import zeros

HEAD = """
multibody_sym: 1
name: found
gravity: [0, -g, 0]
"""
SPRING = (
    HEAD
    + """
parameters: {g: {value: 9.81, positive: true}, k: {value: 300, positive: true}, m: {value: 2, positive: true}, h: 0.5,
  c: 0}
bodies: {b: {mass: m}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: y, q: y, initial: {u: "-sqrt(2*g*h)"}}}
forces: {s: {type: spring_damper, joint: j, stiffness: k, damping: c}}
simulation: {t_end: 0.6}
ask: {deepest: {min: y}, fastest: {min: u_y}, """
)


def test_an_equation_that_names_a_formula_of_time_has_no_root():
    solution = mbs.solve(mbs.loads(SPRING + "motion: {formula: y}, K: {find: k, so: motion == 0}}"))
    assert solution.answers["K"].value is None
    assert "K: it hangs on an answer that has no value" in solution.conditions


@pytest.mark.parametrize("between", ["", ", between: [9, 34]"])
def test_a_value_is_found_beside_those_for_which_nothing_oscillates(between: str) -> None:
    question = f'w: frequency(1), k: {{find: kappa, so: "w == 1"{between}}}'
    rod = f"""{HEAD}
parameters: {{g: {{value: 9.81, positive: true}}, m: {{value: 2, positive: true}}, l: {{value: 1, positive: true}},
  kappa: {{value: 30, positive: true}}}}
bodies: {{rod: {{shape: {{rod: l, mass: m}}}}}}
joints: {{h: {{type: revolute, parent: ground, child: rod, q: phi, initial: {{q: pi/2}}}}}}
forces: {{spring: {{type: torque, joint: h, value: -kappa*(phi - pi/2)}}}}
ask: {{{question}}}
"""
    found = mbs.solve(mbs.loads(rod)).answers["k"]
    assert found.value == pytest.approx(2 * (3 * 9.81 + 2) / 6, rel=1e-12)  # m l^2/3 w^2 = kappa - m g l/2
    assert found.expression is not None


@pytest.mark.parametrize(
    ("function", "bounds", "known"),
    [
        (lambda x: max(x - 2.3, 0.0), (0.0, 5.0), [(2.3, 0.0)]),
        (lambda x: max(x - 2.3, 0.0) + min(x - 1.2, 0.0), (0.0, 5.0), [(2.3, 1.2)]),
        (lambda x: max(x - 2.3, 0.0) * (x - 4.1) + 1e-13 * sin(40 * x), (0.0, 5.0), [(2.3, 0.0), (4.1, None)]),
        (lambda x: x**4 - 1e-40, (-2.0, 5.0), [(1e-10, None)]),
        (lambda x: 10 ** (3 * x) - 10**1.5, (0.0, 5.0), [(0.5, None)]),
        (lambda x: x - 2.5, (0.0, 5.0), [(2.5, None)]),
    ],
)
def test_ranges_of_zeros_are_told_from_zeros(function, bounds, known) -> None:  # type: ignore[no-untyped-def]
    found = zeros(function, 0.9, bounds)
    if len(known) == 1 and known[0][0] == 1e-10:
        assert all(zero.through is None for zero in found)
        return
    assert [zero.at for zero in found] == pytest.approx([at for at, _ in known], rel=1e-10)
    ends = [zero.through for zero in found]
    assert [None if end is None else pytest.approx(end, rel=1e-10) for end in ends] == [end for _, end in known]
