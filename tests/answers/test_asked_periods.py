"""Periods by quadrature alone, a value found by numbers where a frequency has no formula, and what is no coordinate."""

from __future__ import annotations

import math

import pytest
from mpmath import mp
from small_motion_problems import PROBLEMS

import multibody_sym as mbs
from multibody_sym.analysis.modes import modes as amplitude
from multibody_sym.errors import InputError

TEXTS = {problem.name: problem.text for problem in PROBLEMS}


@pytest.mark.parametrize("start", [1.0, 2.5])
def test_a_swing_with_its_energy_has_its_period_by_quadrature(start: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """4 sqrt(l/g) K(sin^2(a/2)), in the double's last digits; runs that are corrected are not made."""
    monkeypatch.setattr(amplitude.Swing, "_swung", lambda *_: pytest.fail("a run was asked"))
    found = mbs.modes(mbs.loads(TEXTS["simple_pendulum"]), period="theta", initial={"theta": start})
    wanted = 4 * math.sqrt(0.5 / 9.81) * float(mp.ellipk(mp.sin(mp.mpf(start) / 2) ** 2))
    assert found.period is not None
    assert found.period.value == pytest.approx(wanted, rel=1e-13)
    assert any("by quadrature" in note for note in found.notes)


@pytest.mark.long
def test_where_there_is_no_formula_a_value_is_found_by_numbers() -> None:
    chain = "four_equal_masses_five_springs"
    model = TEXTS[chain].replace("  b: {mass: m}\n", "  b: {mass: 3*m}\n")
    model += "ask: {T: period(1), heavy: {find: m, so: T == 10, between: [1, 10]}}\n"
    found = mbs.solve(mbs.loads(model)).answers
    assert found["heavy"].value == pytest.approx(2 * (10 / found["T"].value) ** 2, rel=1e-8)


def test_a_period_of_no_coordinate_is_refused() -> None:
    with pytest.raises(InputError):
        mbs.modes(mbs.loads(TEXTS["simple_pendulum"]), period=3)


PENDULUM = """
multibody_sym: 1
name: pendulum
parameters: {m: 1 kg, l: 0.5 m, g: 9.81 m/s^2}
gravity: [0, -g, 0]
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {pin: {type: revolute, parent: ground, child: bob, q: theta, initial: {q: START}}}
ask: {T: {period_of: theta}, J: {action: theta}}
"""


def test_a_swing_nearly_from_upright_has_its_period_and_action() -> None:
    """T by its limit 4 sqrt(l/g) ln(4/cos(a/2)), J by the integral of p over the angle; runs lose the turns."""
    found = mbs.solve(mbs.loads(PENDULUM.replace("START", "179.999999 deg"))).answers
    with mp.workdps(40):
        turn = mp.pi * mp.mpf("179.999999") / 180
        wanted = 4 * mp.sqrt(mp.mpf("0.5") / mp.mpf("9.81")) * mp.log(4 / mp.cos(turn / 2))

        def momentum(angle):
            rise = mp.sin((turn - angle) / 2) * mp.sin((turn + angle) / 2)
            return mp.mpf("0.25") * mp.sqrt(4 * mp.mpf("9.81") / mp.mpf("0.5") * rise)

        action = 4 * mp.quad(momentum, [0, turn]) / (2 * mp.pi)
    assert found["T"].value == pytest.approx(float(wanted), rel=1e-14)
    assert found["J"].value == pytest.approx(float(action), rel=1e-12)
    assert found["J.frequency"].value == pytest.approx(2 * math.pi / float(wanted), rel=1e-14)


ORBIT = """
multibody_sym: 1
name: orbit
gravity: [0, 0, 0]
parameters:
  k: {value: 3 N*m^2, positive: true}
  m: {value: 2 kg, positive: true}
  R: {value: 1.5 m, positive: true}
bodies: {planet: {mass: m}}
joints:
  orbit: {type: custom, parent: ground, child: planet, free: [{rotate: z}, {translate: x}], q: [phi, r],
          initial: {q: [0, R], u: [SPEED*sqrt(k/(m*R))/R, 0]}}
forces: {sun: {type: potential, joint: orbit, value: -k/r}}
simulation: {t_end: 20 s}
ask: {J_r: {action: r}, J_phi: {action: phi}}
"""


def test_a_circular_orbit_has_no_radial_action() -> None:
    """J_r = k sqrt(m/(-2 E)) - J_phi vanishes; the radial frequency is that of an orbit beside it, as Kepler has it."""
    circle = mbs.solve(mbs.loads(ORBIT.replace("SPEED", "1"))).answers
    assert circle["J_r"].value == 0.0
    beside = mbs.solve(mbs.loads(ORBIT.replace("SPEED", "1.001"))).answers
    energy = 2 * (1.001**2 * 3 / (2 * 1.5)) / 2 - 3 / 1.5
    assert beside["J_r"].value == pytest.approx(3 * math.sqrt(2 / (-2 * energy)) - beside["J_phi"].value, abs=1e-9)
    for name in ("J_r.frequency", "J_phi.frequency"):
        assert circle[name].value == pytest.approx(math.sqrt(3 / (2 * 1.5**3)), rel=1e-12)
        assert circle[name].value == pytest.approx(beside[name].value, rel=5e-3)


def test_at_upright_rest_there_is_no_action() -> None:
    found = mbs.solve(mbs.loads(PENDULUM.replace("START", "0").replace("[0, -g, 0]", "[0, g, 0]")))
    assert found.answers["J"].value is None
    assert any("unstable" in condition for condition in found.conditions)
