"""Squares of differences stay squares in derived equations, as a book writes them."""

from __future__ import annotations

import pytest
import sympy

import multibody_sym as mbs
from multibody_sym.algebra.simplify import with_squares
from multibody_sym.algebra.sums import expression_of, terms_of
from multibody_sym.documents.derivation import derivation_document
from multibody_sym.documents.document import write_document

BOWL = """
multibody_sym: 1
name: bowl
gravity: [0, -g, 0]
parameters: {g: 9.81, m: 1, R: {value: 0.5, positive: true}, r: {value: 0.1, positive: true}}
bodies:
  arm: {points: {end: ["0", "-(R - r)", "0"]}}
  ball: {mass: m, inertia: {Izz: 2/5*m*r^2}}
joints:
  A: {type: revolute, parent: ground, child: arm, axis: z, q: theta, initial: {q: 30 deg}}
  B: {type: revolute, parent: arm.end, child: ball, axis: z, q: psi}
constraints: {roll: {type: expression, zero: r*psi + R*theta}}
"""


def test_a_ball_in_a_bowl_has_the_book_s_energy_and_equations() -> None:
    derived = write_document(derivation_document(mbs.derive(mbs.loads(BOWL)), steps=True), "text")
    assert "    T = m*(R - r)^2*theta'^2/2 + m*r^2*(theta' + psi')^2/5\n" in derived
    assert "    M = [2*m*r^2/5 + m*(R - r)^2, 2*m*r^2/5; 2*m*r^2/5, 2*m*r^2/5]\n" in derived
    assert "R*r" not in derived


def test_a_root_is_written_alike_in_the_potential_and_in_its_gradient() -> None:
    spring = "forces: {spring: {type: spring, between: [ground.far, ball], stiffness: 10, length: 0.2}}\nconstraints"
    model = BOWL.replace("constraints", spring).replace("bodies:", "bodies:\n  ground: {points: {far: [1, 0, 0]}}")
    lines = write_document(derivation_document(mbs.derive(mbs.loads(model)), steps=True), "text").splitlines()
    with_roots = [line for line in lines if "sqrt(" in line]
    assert {"    V ", "    dV/dtheta "} <= {line.partition("=")[0] for line in with_roots}
    assert all("sqrt(1 + (R - r)^2 + 2*(r - R)*sin(theta))" in line for line in with_roots)


@pytest.mark.parametrize(
    "sums",
    [
        "x**2 - 2*x*y + y**2",
        "3*x**2 - 2*x*y + y**2",
        "k*(x**2/2 + x*y + 5*y**2)",
        "x**2 - 2*x*y + y**2 - 2*y*z + z**2 + y**2",
        "x**2 - 3*x*y + y**2",
        "-x**2 + 2*x*y - 4*y**2",
    ],
)
def test_squares_are_equal_to_what_they_stand_for(sums: str) -> None:
    expression = sympy.sympify(sums)
    found = expression_of(with_squares(terms_of(expression), frozenset()))
    assert sympy.expand(found - expression) == 0
    assert (found.count_ops() < sympy.expand(expression).count_ops()) == ("3*x*y" not in sums)
