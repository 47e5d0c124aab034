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
