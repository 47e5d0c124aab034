"""Where an equation holds in a whole range of values both ends are found; rounding is no root."""

from __future__ import annotations

from math import sqrt
from random import Random

import pytest

import multibody_sym as mbs
from multibody_sym.answers.questions.finding import zeros

LOOP = """
multibody_sym: 1
name: loop
gravity: [0, -g, 0]
parameters: {{g: 9.81 m/s^2, m: 1 kg, R: 1 m, v0: {speed} m/s}}
bodies: {{ground: {{surfaces: {{loop: {{disc: R, inside: true}}}}}}, car: {{mass: m}}}}
joints: {{free: {{type: point, parent: ground, child: car, q: [x, y], initial: {{q: [0, -R], u: [v0, 0]}}}}}}
contacts: {{c: {{between: [car, ground.loop]}}}}
outputs: {{N: "reaction(c, normal)"}}
ask: {{vmin: {{find: v0, so: "min(N) == 0"}}}}
simulation: {{t_end: 1 s}}
"""
EDGE = """
multibody_sym: 1
name: edge
gravity: [0, -9.81, 0]
parameters: {m: {value: 2 kg, positive: true}, mu: {value: 0.35, positive: true}, F: {value: 3 N, positive: true}}
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, b: {mass: m}}
joints: {j: {type: point, parent: ground, child: b, q: [x, y]}}
contacts: {c: {between: [b, ground.floor], static: mu, kinetic: mu}}
forces: {f: {type: force, on: b, value: [F, 0, 0]}}
ask: {slips: {find: F, so: "reaction(c, friction) == -mu*reaction(c, normal)", between: [1, 30]}}
"""


def test_a_car_loses_its_loop_between_two_speeds() -> None:
    """From the speed that reaches the height of the centre to the speed that passes the top, whatever is declared."""
    found = mbs.solve(mbs.loads(LOOP.format(speed=6.5)))
    assert found.answers["vmin"].value == pytest.approx(sqrt(5 * 9.81), rel=1e-9)
    (told,) = [note for note in found.conditions if "holds for every v0" in note]
    ends = [float(word.rstrip(";,")) for word in told.replace("=", " ").split() if word[:2] in ("4.", "7.")]
    assert ends == pytest.approx([sqrt(2 * 9.81), sqrt(5 * 9.81)], rel=1e-7)


@pytest.mark.parametrize("sample", [4.5, 5.0, 5.7, 6.9])
def test_rounding_in_a_range_is_no_root(sample: float) -> None:
    """A function that is +-1e-12 between 4 and 7, of terms as large as 50; a root at 2 beyond is not met."""
    draw, looked = Random(7), []

    def function(x: float) -> float:
        looked.append(x)
        return 10 * max(4 - x, 0.0) + 10 * max(x - 7, 0.0) + draw.uniform(-1e-12, 1e-12)

    (zero,) = zeros(function, sample, None, size=50.0)
    assert (zero.at, zero.through) == (pytest.approx(7.0, abs=1e-9), pytest.approx(4.0, abs=1e-9))
    assert zero.ended
    assert len(looked) < 60  # each of them may be a run; halving alone takes 90


def test_a_body_that_leaves_is_pressed_by_nothing_exactly() -> None:
    """The run that ends as the contact opens leaves 1e-11 N of it; the flight behind has none."""
    asked = LOOP.replace('vmin: {{find: v0, so: "min(N) == 0"}}', "least: {{min: N}}")
    found = mbs.solve(mbs.loads(asked.format(speed=6.5))).answers["least"]
    assert found.value == 0.0


def test_a_root_is_found_however_steep_the_function_is_elsewhere() -> None:
    (zero,) = zeros(lambda x: (x - 3.0) * (1.0 + x**8), 1.0, None)
    assert zero.at == pytest.approx(3.0, rel=1e-12)
    assert zero.through is None


def test_a_value_with_a_formula_is_the_value_of_the_formula() -> None:
    found = mbs.solve(mbs.loads(EDGE)).answers["slips"]
    assert found.as_json()["expression"] == "9.81*m*mu"
    assert found.value == pytest.approx(9.81 * 2 * 0.35, rel=1e-15)
