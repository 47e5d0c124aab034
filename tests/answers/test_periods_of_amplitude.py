"""Periods of motions of any amplitude: the pendulum's by elliptic integrals, others by their first integrals."""

from __future__ import annotations

import math

import pytest
from mpmath import mp
from small_motion_problems import PROBLEMS

import multibody_sym as mbs
from multibody_sym.errors import InputError

TEXTS = {problem.name: problem.text for problem in PROBLEMS}
L, G = 0.5, 9.81


def period(name: str, coordinate: str, **initial: float) -> float:
    found = mbs.modes(mbs.loads(TEXTS[name]), period=coordinate, initial=initial).period
    assert found is not None
    assert found.unit == "s"
    return found.value


def swinging(amplitude: float) -> float:
    """4 sqrt(l/g) K(sin^2(a/2))."""
    return 4 * math.sqrt(L / G) * float(mp.ellipk(mp.sin(mp.mpf(amplitude) / 2) ** 2))


@pytest.mark.parametrize("amplitude", [1e-3, 0.5, 2.5])
def test_a_pendulum_swings_as_the_elliptic_integral_says(amplitude: float) -> None:
    assert period("simple_pendulum", "theta", theta=amplitude) == pytest.approx(swinging(amplitude), rel=1e-10)


def test_a_pendulum_that_begins_below_with_a_speed_swings_as_well() -> None:
    amplitude = 1.2
    speed = 2 * math.sqrt(G / L) * math.sin(amplitude / 2)
    assert period("simple_pendulum", "theta", u_theta=speed) == pytest.approx(swinging(amplitude), rel=1e-10)


def test_a_pendulum_that_goes_around_is_as_fast_as_the_elliptic_integral_says() -> None:
    """T = 4 K(1/k^2)/w with k = w/2 sqrt(l/g) > 1, w the speed below."""
    k = 1.3
    speed = 2 * k * math.sqrt(G / L)
    wanted = 4 / speed * float(mp.ellipk(1 / mp.mpf(k) ** 2))
    assert period("simple_pendulum", "theta", u_theta=speed) == pytest.approx(wanted, rel=1e-10)


def test_the_radius_of_an_ellipse_has_keplers_period() -> None:
    """T = 2 pi sqrt(m a^3/k), a of the energy -k/(2 a); k = 3, m = 2, R = 1.5."""
    speed = 1.2 * math.sqrt(3 / (2 * 1.5))
    axis = -3 / (2 * (2 * speed**2 / 2 - 3 / 1.5))
    found = period("circular_orbit_of_keplers_force", "r", u_phi=speed / 1.5)
    assert found == pytest.approx(2 * math.pi * math.sqrt(2 * axis**3 / 3), rel=1e-10)


@pytest.mark.long
def test_questions_ask_for_it_and_find_an_amplitude() -> None:
    model = TEXTS["simple_pendulum"] + (
        "ask: {T: {period_of: theta}, half: T/2, a: {find: theta, so: T == 2.2*pi*sqrt(l/g), between: [1, 1.4]}}\n"
    )
    answers = mbs.solve(mbs.loads(model), initial={"theta": 1.0}).answers
    assert answers["T"].value == pytest.approx(swinging(1.0), rel=1e-10)
    assert answers["half"].value == pytest.approx(swinging(1.0) / 2, rel=1e-10)
    assert swinging(answers["a"].value) == pytest.approx(2.2 * math.pi * math.sqrt(L / G), rel=1e-9)


@pytest.mark.parametrize(
    ("name", "coordinate", "initial"),
    [
        ("damped_oscillator", "x1", {"x1": 0.1}),
        ("double_pendulum", "q1", {"q1": 1.0, "q2": 0.3}),
        ("simple_pendulum", "theta", {}),
    ],
)
def test_what_does_not_repeat_itself_says_so(name: str, coordinate: str, initial: dict[str, float]) -> None:
    found = mbs.modes(mbs.loads(TEXTS[name]), period=coordinate, initial=initial)
    assert found.period is not None
    assert found.period.value is None
    assert any("no period is told" in note for note in found.notes)


def test_a_coordinate_that_is_not_there_is_refused() -> None:
    with pytest.raises(InputError, match="did you mean theta"):
        mbs.modes(mbs.loads(TEXTS["simple_pendulum"]), period="tetha")
    with pytest.raises(InputError):
        mbs.modes(mbs.loads(TEXTS["simple_pendulum"]), period=3)


def test_a_coordinate_that_an_impact_reverses_repeats_itself() -> None:
    """A mass on a spring, thrown back by a stop at -c, with A cos(w t) from A = 3 c on: T = 2 acos(-1/3)/w.

    And one between two stops at the speed v without any force: T = 2 l/v.
    """
    model = """
multibody_sym: 1
name: stopped
bodies: {{b: {{mass: 2}}}}
joints:
  j: {{type: prismatic, parent: ground, child: b, axis: x, q: x, limits: {limits}, initial: {{q: 0.3, u: {u}}}}}
{forces}
ask: {{T: {{period_of: x}}}}
simulation: {{t_end: 2}}
"""
    spring = "forces: {s: {type: spring, joint: j, stiffness: 60}}"
    one = mbs.loads(model.format(limits="{lower: -0.1, restitution: 1}", u=0, forces=spring))
    two = mbs.loads(model.format(limits="{lower: 0, upper: 0.8, restitution: 1}", u=2.5, forces=""))
    found = [mbs.solve(each).answers["T"].value for each in (one, two)]
    assert found == pytest.approx([2 * math.acos(-1 / 3) / math.sqrt(30), 2 * 0.8 / 2.5], rel=1e-10)
