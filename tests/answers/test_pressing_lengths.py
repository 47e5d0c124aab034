"""Closed forms of journals: friction from the length of a force, one component or two, against the body cut free."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs
from multibody_sym.algebra.book_form import book_form
from multibody_sym.answers.instant.instant import solved_in
from multibody_sym.dynamics.start.state import examined_state
from multibody_sym.text.printer import text

WHEEL = """\
multibody_sym: 1
name: wheel
gravity: [0, -g, 0]
parameters:
  m: {value: 2, positive: true}
  g: {value: 9.81, positive: true}
  J: {value: 0.1, positive: true}
  mu: {value: 0.2, positive: true}
  r: {value: 0.02, positive: true}
  F: {value: 5, positive: true}
  R: {value: 0.2, positive: true}
bodies: {w: {mass: m, com: COM, inertia: {Izz: J}, points: {p: [0, R, 0]}}}
joints: {A: {type: revolute, parent: ground, child: w, q: phi, initial: {u: 1}}}
forces:
  rub: {type: friction, joint: A, static: mu, radius: r}
  push: {type: force, on: w, at: p, value: [FX, FY, 0]}
"""


@pytest.mark.parametrize(
    ("fx", "fy", "expression"),
    [
        ("0", "0", "-g*m*mu*r/J"),
        ("0", "F", "mu*r*(F - g*m)/J"),
        ("F", "0", "-(F*R + mu*r*sqrt(F^2 + g^2*m^2))/J"),
    ],
)
def test_a_wheel_rubs_on_its_journal(fx: str, fy: str, expression: str) -> None:
    system = mbs.loads(WHEEL.replace("FX", fx).replace("FY", fy).replace("COM", "[0, 0, 0]"))
    solved = solved_in(system, *examined_state(system).in_joints)
    assert solved.forms is not None
    (closed,) = solved.forms.udot
    assert text(book_form(closed)) == expression
    assert float(closed.sample) == pytest.approx(solved.numbers.udot[0], rel=1e-14)


def test_where_friction_changes_the_force_it_comes_from_the_quadratic_is_solved() -> None:
    """m a_C = A + m g, J alpha = -c x A .. - mu r |A|, a_C = alpha k x c - w^2 c: |A| by bisection of what is left."""
    text_of = WHEEL.replace("FX", "0").replace("FY", "0").replace("COM", "[0.3, 0.1, 0]").replace("u: 1", "u: 3")
    system = mbs.loads(text_of)
    solved = solved_in(system, *examined_state(system).in_joints)
    c, w, m, g, J, arm = (0.3, 0.1), 3.0, 2.0, 9.81, 0.1, 0.2 * 0.02

    def left(alpha: float) -> float:
        a = -alpha * c[1] - w * w * c[0], alpha * c[0] - w * w * c[1]
        force = m * a[0], m * (a[1] + g)
        return J * alpha - (-c[0] * force[1] + c[1] * force[0]) + arm * math.hypot(*force)

    low, high = -100.0, 100.0
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if left(middle) < 0 else (low, middle)
    assert solved.numbers.udot == pytest.approx([low], rel=1e-13)
    assert solved.forms is not None
    assert float(solved.forms.udot[0].sample) == pytest.approx(low, rel=1e-13)


@pytest.mark.parametrize("speed", ["0", "1"])
def test_what_a_journal_exerts_is_told_by_the_length_of_its_force(speed: str) -> None:
    """At rest it holds the push at 2 mm by at most mu r sqrt(F^2 + (m g)^2), else it exerts that."""
    text_of = WHEEL.replace("FX", "F").replace("FY", "0").replace("COM", "[0, 0, 0]").replace("u: 1", f"u: {speed}")
    found = mbs.solve(mbs.loads(text_of.replace("R: {value: 0.2", "R: {value: 0.002")))
    most = 0.2 * 0.02 * math.hypot(5, 2 * 9.81)
    assert found.reactions["rub"]["friction"].value == pytest.approx(0.01 if speed == "0" else -most, rel=1e-14)
    if speed == "0":
        assert f"friction 0.01 N*m of at most {most:.6g} N*m" in found.found[0]
        assert found.conditions == ("mu*r*sqrt(F^2 + g^2*m^2) >= F*R",)
