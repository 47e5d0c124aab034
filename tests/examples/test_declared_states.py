"""The examples with `states:`, each against its formula by hand."""

from __future__ import annotations

from math import radians, sqrt

import numpy as np
import pytest
from twins import from_file

import multibody_sym as mbs


def test_oil_is_a_spring_and_the_valve_an_integrator() -> None:
    m, A, V, E, c, kv = 100, 5e-4, 1e-4, 1.4e9, 2000, 0.002
    found = mbs.linearize(from_file("hydraulic_cylinder"), at="equilibrium")
    wanted = np.roots([1, c / m, E * A**2 / (V * m), E * A * kv / (V * m)])
    assert np.allclose(np.sort_complex(found.eigenvalues), np.sort_complex(wanted), rtol=1e-9)


def test_a_lag_makes_the_swing_smaller() -> None:
    run = mbs.simulate(from_file("low_pass_filter"), samples=20001)
    last = run["x"][run.t > 18]
    m, k, c, F0, w, T = 2, 50, 8, 10, 6, 0.25
    swing = F0 / sqrt(((k - m * w**2) ** 2 + (c * w) ** 2) * (1 + (w * T) ** 2))
    assert (last.max() - last.min()) / 2 == pytest.approx(swing, rel=1e-5)


def test_anti_windup_keeps_an_arm_from_shooting_over() -> None:
    system, ref = from_file("pid_with_antiwindup"), radians(60)
    run, winding = mbs.simulate(system), mbs.simulate(system, parameters={"kb": 0})
    for each in (run, winding):
        assert each["phi"][-1] == pytest.approx(ref, abs=1e-5)
        assert np.abs(each["torque"]).max() == pytest.approx(4.6)
    assert run["phi"].max() < ref + 1e-9
    assert np.degrees(winding["phi"].max() - ref) == pytest.approx(5.8, abs=0.05)


def test_a_motor_reaches_the_current_of_its_load() -> None:
    run = mbs.simulate(from_file("motor_current"))
    current = 2 * 9.81 * 0.05 / 0.4
    assert run["i"][-1] == pytest.approx(current, rel=1e-6)
    assert run["u_phi"][-1] == pytest.approx((24 - 1.2 * current) / 0.4, rel=1e-6)
