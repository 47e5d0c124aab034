"""Runs of 100 s against motions in closed form and a conserved energy, as tight as order 8 makes them."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exact_motions import FREE_BODY, HEAVY_TOP, free_rotation, nutation

import multibody_sym as mbs

needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="takes a minute without a C compiler")
TIGHT: dict[str, Any] = {"t_end": 100, "method": "dormand_prince_8", "rtol": 1e-14, "atol": 1e-14}


@needs_compiler
def test_a_free_body_turns_as_elliptic_functions_say() -> None:
    run = mbs.simulate(mbs.loads(FREE_BODY), **TIGHT)
    found = np.array([run[f"ball_w{axis}"] for axis in "xyz"])
    assert np.abs(found - free_rotation(1, 2, 3, 1, 0.7, run.t)).max() < 1e-9


@needs_compiler
def test_a_heavy_top_nutates_as_elliptic_functions_say() -> None:
    run = mbs.simulate(mbs.loads(HEAVY_TOP), **TIGHT)
    A, weight, spin = 3e-4 + 0.3 * 0.04**2, 0.3 * 9.81 * 0.04, 2e-4 * 100
    assert np.abs(run["z"] - nutation(A, weight, spin, np.pi / 3, run.t)).max() < 1e-9
    assert np.ptp(run["z"]) > 0.4


@needs_compiler
def test_a_double_pendulum_keeps_its_energy() -> None:
    run = mbs.simulate(mbs.load(Path(__file__).parents[2] / "examples" / "double_pendulum.yaml"), **TIGHT)
    assert run.drift["energy"] < 3e-12 * run.kinetic_energy.max()
