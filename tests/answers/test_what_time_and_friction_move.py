"""Small motions and periods of what time drives or friction holds; periods by quadrature and as formulas."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from mpmath import mp
from small_motion_problems import PROBLEMS

import multibody_sym as mbs
from multibody_sym.analysis.modes import amplitude
from multibody_sym.documents.solution import solution_text
from multibody_sym.errors import NoSolutionError
from multibody_sym.text.parser import parse

TEXTS = {problem.name: problem.text for problem in PROBLEMS}
DRIVEN = """
multibody_sym: 1
name: driven
parameters: {m: {value: 2 kg, positive: true}, k: {value: 8 N/m, positive: true}, c: 0.4, F: 3 N, w: 1.3 rad/s}
bodies: {b: {mass: m}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {q: 1}}}
forces: {s: {type: spring_damper, joint: j, stiffness: k, damping: c}, f: {type: torque, joint: j, value: F*cos(w*t)}}
"""
ROUGH = """
multibody_sym: 1
name: rough
gravity: [0, -g, 0]
parameters: {g: 9.81 m/s^2, m: 2 kg, mu: 0.3, k: 8 N/m}
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, b: {mass: m}}
joints: {j: {type: point, parent: ground, child: b, q: [x, y], initial: {u: [2, 0]}}}
forces: {s: {type: spring_damper, between: [ground, b], stiffness: k}}
contacts: {c: {between: [b, ground.floor], static: mu, kinetic: mu}}
"""
QUARTIC = """
multibody_sym: 1
name: quartic
parameters: {a: 3, m: 2 kg}
bodies: {p: {mass: m}}
joints: {J: {type: prismatic, parent: ground, child: p, axis: x, q: x, initial: {q: 1}}}
forces: {v: {type: potential, joint: J, value: a*x^4}}
simulation: {t_end: 5}
"""


def test_modes_say_that_a_drive_stands_still_and_how_long_its_period_is() -> None:
    found = mbs.modes(mbs.loads(DRIVEN), period="x")
    assert found.period is not None
    assert found.period.value is None
    assert any(note.startswith("forces.f depends on t, and small motions are those") for note in found.notes)
    period = 2 * math.pi / 1.3
    assert any(f"the drive's period is left, {period:.10g} s" in note for note in found.notes)


def test_a_table_of_time_stands_still_too() -> None:
    told = "inputs: {push: {table: [[0, 0], [1, 5], [2, 0]]}}\n"
    model = DRIVEN.replace("F*cos(w*t)", "push") + told
    assert any(note.startswith("inputs.push depends on t") for note in mbs.modes(mbs.loads(model)).notes)


def test_what_turns_evenly_stands_still_in_its_own_frame() -> None:
    """Nothing about a bead on a hoop that turns evenly about the vertical depends on when it is looked at."""
    model = mbs.loads(
        "multibody_sym: 1\nname: hoop\ngravity: [0, 0, -g]\nparameters: {g: 9.81, m: 0.1, R: 0.3, w: 8}\n"
        "bodies: {hoop: {}, bead: {mass: m, com: [0, 0, -R]}}\njoints:\n"
        "  axle: {type: revolute, parent: ground, child: hoop, axis: z, motion: w*t}\n"
        "  slide: {type: revolute, parent: hoop, child: bead, axis: x, q: theta}\n"
    )
    assert not any("depends on t" in note for note in mbs.modes(model).notes)
    axle = replace(model.joints["axle"], motion=parse("sin(3*t)/10"))
    shaken = replace(model, joints={**model.joints, "axle": axle})
    with pytest.raises(NoSolutionError, match="--period T"):
        mbs.modes(shaken)


def test_modes_name_the_friction_that_they_hold() -> None:
    sliding = mbs.modes(mbs.loads(ROUGH))
    assert any(note.startswith("c: friction is taken as it pushes while this slides") for note in sliding.notes)


@pytest.mark.parametrize("start", [1.0, 2.5])
def test_a_swing_with_its_energy_has_its_period_by_quadrature(start: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """4 sqrt(l/g) K(sin^2(a/2)), in the double's last digits; runs that are corrected are not made."""
    monkeypatch.setattr(amplitude.Swing, "_swung", lambda *_: pytest.fail("a run was asked"))
    found = mbs.modes(mbs.loads(TEXTS["simple_pendulum"]), period="theta", initial={"theta": start})
    wanted = 4 * math.sqrt(0.5 / 9.81) * float(mp.ellipk(mp.sin(mp.mpf(start) / 2) ** 2))
    assert found.period is not None
    assert found.period.value == pytest.approx(wanted, rel=1e-13)
    assert any("by quadrature" in note for note in found.notes)


def test_a_turn_around_has_its_time_by_quadrature() -> None:
    k = 1.3
    speed = 2 * k * math.sqrt(9.81 / 0.5)
    found = mbs.modes(mbs.loads(TEXTS["simple_pendulum"]), period="theta", initial={"u_theta": speed})
    wanted = 4 / speed * float(mp.ellipk(1 / mp.mpf(k) ** 2))
    assert found.period is not None
    assert found.period.value == pytest.approx(wanted, rel=1e-13)


def test_a_period_of_a_quartic_well_is_its_beta_function() -> None:
    """T = 4 sqrt(m/(2 a))/A times the integral of 1/sqrt(1 - s^4), Gauss's lemniscate constant."""
    solution = mbs.solve(mbs.loads(QUARTIC + "ask: {T: {period_of: x}}\n"))
    wanted = 4 * math.sqrt(2 / 6) * math.gamma(0.25) ** 2 / (4 * math.sqrt(2 * math.pi))
    assert solution.answers["T"].value == pytest.approx(wanted, rel=1e-12)
    assert any(each.startswith("T: its number is known by quadrature") for each in solution.conditions)


def test_a_linear_oscillator_has_a_formula_for_its_period() -> None:
    model = DRIVEN.replace("F: 3 N", "F: 0 N").replace("F*cos(w*t)", "F").replace("damping: c", "damping: 0")
    answer = mbs.solve(mbs.loads(model + "ask: {T: {period_of: x}}\n")).answers["T"]
    assert str(answer).startswith("2*pi*sqrt(m/k) = 3.1")


def test_dampers_have_no_quadrature() -> None:
    model = DRIVEN.replace("F*cos(w*t)", "F")
    found = mbs.modes(mbs.loads(model), period="x")
    assert found.period is not None
    assert found.period.value is None


def test_what_begins_to_slide_at_once_has_no_formula_of_its_rest() -> None:
    """A bead at rest on a rough rod that turns: its normal force 2 m W r' is zero at the start alone."""
    rod = """
multibody_sym: 1
name: rod
parameters: {W: {value: 3 rad/s, positive: true}, L: {value: 1 m, positive: true}, mu: {value: 0.3, positive: true}}
bodies: {rod: {mass: 1, inertia: {Izz: 1}}, bead: {mass: 0.2 kg}}
joints:
  s: {type: revolute, parent: ground, child: rod, motion: W*t}
  b: {type: prismatic, parent: rod, child: bead, axis: x, q: r, initial: {q: 0.1}}
forces: {rub: {type: friction, joint: b, static: mu}}
ask: {f: {formula: r}, out: {when: {r: L}}}
simulation: {t_end: 3 s}
"""
    solution = mbs.solve(mbs.loads(rod))
    assert solution.answers["f"].expression is None
    assert "  rub sticks: nothing presses, and there is no friction" in solution_text(solution).splitlines()
    rates = [3 * (-0.3 + sign * math.sqrt(1.09)) for sign in (1, -1)]
    first, second = (0.1 * rates[1 - k] / (rates[1 - k] - rates[k]) for k in (0, 1))
    t = solution.answers["out"].value
    assert first * math.exp(rates[0] * t) + second * math.exp(rates[1] * t) == pytest.approx(1, rel=1e-8)
