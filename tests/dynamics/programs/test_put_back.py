"""Both levels of rows put back by one factorisation, against the two corrections that find it each for itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.derivation.routes import FORMALISMS, cheapest
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.program.c_target import c_source
from multibody_sym.program.program import interpret
from multibody_sym.program.programs import Programs

EXAMPLES = Path(__file__).parents[3] / "examples"


def derived(name: str) -> tuple[Programs, list[np.ndarray]]:
    """Return the Programs of an example, and their inputs at its start."""
    resolved = mechanism(mbs.load(EXAMPLES / f"{name}.yaml"))
    begin = start(resolved)
    found = programs(resolved, FORMALISMS[cheapest(resolved)])
    q, u, p = (np.array(x, dtype=float) for x in (begin.q, begin.u, begin.parameters))
    inputs = interpret(found.inputs, 0.0, q, u, p)[0]
    return found, [np.array(0.0), q, u, p, inputs, np.empty(0)]


@pytest.mark.parametrize("name", ["four_bar", "spatial_four_bar", "rolling_coin"])
def test_both_corrections_are_those_of_each_level(name: str) -> None:
    """That of the speeds is for the corrected coordinates, with H from before: what is left is of second order."""
    found, (t, q, u, *rest) = derived(name)
    assert found.put_back is not None
    assert found.missed is not None
    assert found.project_position is not None
    assert found.project_velocity is not None
    rng = np.random.default_rng(4)
    off, spin = q + 1e-6 * rng.normal(size=len(q)), u + rng.normal(size=len(u))
    of_q, of_u = interpret(found.put_back, t, off, spin, *rest)
    phi, correction = interpret(found.project_position, t, off, spin, *rest)
    np.testing.assert_allclose(of_q, correction, atol=1e-14)
    closed = off + of_q
    residual, change = interpret(found.project_velocity, t, closed, spin, *rest)
    np.testing.assert_allclose(of_u, change, atol=1e-3 * np.abs(change).max())
    seen = interpret(found.missed, t, closed, spin, *rest)
    np.testing.assert_allclose(seen[1], residual, atol=1e-14)
    left = interpret(found.missed, t, closed, spin + of_u, *rest)
    assert np.abs(left[0]).max() <= 1e-3 * np.abs(phi).max()
    assert np.abs(left[1]).max() <= 1e-2 * np.abs(residual).max()


def test_a_loop_is_factorised_once_for_both() -> None:
    found, _ = derived("four_bar")
    assert set(found.of_runs()) - set(found.exported()) == {"missed", "put_back"}
    assert set(found.exported()) - set(found.of_runs()) == {"project_position", "project_velocity"}
    assert found.put_back is not None
    text = c_source({"put_back": found.put_back})["model.c"]
    assert (text.count(" mbs_factorise"), text.count(" mbs_substitute")) == (1, 2)


def test_a_row_that_held_speeds_alone_change_is_put_right_by_no_others() -> None:
    """A cylinder rolls far: s = g sin(alpha) t^2/3 = R phi, though its contact's row has rounding for s and phi."""
    example = Path(__file__).parents[3] / "examples" / "textbook" / "cylinder_down_an_incline.yaml"
    run = mbs.simulate(mbs.load(example), t_end=10, rtol=1e-11, atol=1e-12)
    fallen = 10 * np.sin(np.pi / 6) * run.t**2 / 3
    assert np.abs(np.abs(run["s"]) - fallen).max() < 1e-9 * fallen[-1]
    assert np.abs(run["s"] + 0.1 * run["phi"]).max() < 1e-11 * fallen[-1]
