"""Rows in numbers by Programs against the same rows walked through in floats, and starts of loops that take them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from windows import windows

import multibody_sym as mbs
from multibody_sym.dynamics import closing
from multibody_sym.dynamics.closing import ConstraintRows
from multibody_sym.dynamics.formalisms.articulated_body import tree_factors
from multibody_sym.dynamics.programs.system import CompiledRows, closing_programs, inputs_program
from multibody_sym.dynamics.start import parameters
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.motion.prepare.problem import prepare_system
from multibody_sym.program.backend import Native
from multibody_sym.program.loading import load

EXAMPLES = Path(__file__).parents[3] / "examples"
LOOPS = ("four_bar", "spatial_four_bar", "slider_crank", "andrews_squeezer", "rolling_coin")


def by_both(system: mbs.System) -> tuple[ConstraintRows, ConstraintRows]:
    """Return all rows at the start's parameters: walked through, and by Programs in Python."""
    resolved = mechanism(system)
    derived = {"inputs": inputs_program(resolved)} | closing_programs(resolved)
    programs = load(derived, Native(backend="python")).functions
    walked = ConstraintRows(resolved, start(resolved).parameters, range(len(resolved.rows)))
    return walked, ConstraintRows(resolved, walked.parameters, walked.active, compiled=CompiledRows(resolved, programs))


@pytest.mark.parametrize("name", LOOPS)
def test_rows_by_programs_are_those_walked_through(name: str) -> None:
    walked, compiled = by_both(mbs.load(EXAMPLES / f"{name}.yaml"))
    rng, here = np.random.default_rng(2), list(walked.active)
    begin = start(walked.mechanism)
    for _ in range(3):
        q = np.array(begin.q) + rng.uniform(-0.1, 0.1, len(begin.q))
        u = rng.normal(size=len(begin.u))
        assert compiled.moving(q, u).phidot == pytest.approx(walked.moving(q, u).phidot, abs=1e-12)
        assert compiled.moving(q, u).jacobian == pytest.approx(walked.moving(q, u).jacobian, abs=1e-12)
        assert compiled.moving(q, u).terms == pytest.approx(walked.moving(q, u).terms, rel=0.5, abs=1e-12)
        found, gamma = compiled.numbers(q, u), [row.gamma for row in walked.of(walked.motion(q, u))]
        assert found is not None
        assert found.gamma[here] == pytest.approx(np.array(gamma, dtype=float), abs=1e-11)
        weights = tree_factors(walked.motion(q, u))
        H = walked.moving(q, u).jacobian
        expected = H @ np.array([weights.solve(row) for row in H.tolist()]).T  # H M^-1 H^T, whatever the axes are
        assert found.weighted[here] @ found.weighted[here].T == pytest.approx(expected, rel=1e-9, abs=1e-9)
        x = rng.normal(size=len(u))
        assert compiled.compiled is not None
        back = compiled.compiled.change(0.0, q, u, compiled.parameters, x)
        assert found.weighted[here] @ x == pytest.approx(found.jacobian[here] @ back, abs=1e-9)
        if walked.holonomic().active:
            missed = [rows.holonomic().missed(q) for rows in (walked, compiled)]
            assert missed[1] == tuple(pytest.approx(x, abs=1e-12) for x in missed[0] or ())


@pytest.mark.parametrize("name", LOOPS)
def test_starts_by_programs_are_those_walked_through(name: str) -> None:
    _, compiled = by_both(mbs.load(EXAMPLES / f"{name}.yaml"))
    walked, found = start(compiled.mechanism), start(compiled.mechanism, compiled=compiled.compiled)
    assert found.q == pytest.approx(walked.q, abs=1e-12)
    assert found.u == pytest.approx(walked.u, abs=1e-11)
    assert (found.held, found.assembled, found.rank) == (walked.held, walked.assembled, walked.rank)
    assert found.parameters == pytest.approx(walked.parameters, abs=1e-12)


def test_a_start_of_many_loops_walks_through_no_kinematics(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each walk takes as long as hundreds of runs' evaluations: 46 of them were 2.2 of 2.7 s for forty windows."""
    ready = prepare_system(windows(6), code=Native(backend="python"))  # from the cache in what follows

    def walked(*_: object) -> None:
        raise AssertionError("walked through")

    monkeypatch.setattr(closing, "motion_of", walked)
    monkeypatch.setattr(parameters, "position", walked)
    found = prepare_system(windows(6), code=Native(backend="python"))
    assert found.q0 == pytest.approx([np.pi / 2, -np.pi / 2] * 6 + [np.pi / 2], abs=1e-12)
    assert found.u0 == pytest.approx([-1.0, 1.0] * 6 + [-1.0], abs=1e-12)
    assert (found.q0.tolist(), found.u0.tolist()) == (ready.q0.tolist(), ready.u0.tolist())
    assert found.start.rank == 12
