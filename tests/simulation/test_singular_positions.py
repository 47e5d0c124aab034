"""Runs through positions in which rows become dependent: the motion goes on as by hand, or the run stops by name."""

from __future__ import annotations

import numpy as np
import pytest
from singular_mechanisms import MECHANISMS, Mechanism

import multibody_sym as mbs

NAMES = list(MECHANISMS)


@pytest.fixture(autouse=True, scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory):
    patch = pytest.MonkeyPatch()
    patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
    yield
    patch.undo()


def error(run: mbs.Trajectory, mechanism: Mechanism, phi: np.ndarray) -> float:
    """Return how far a run is from the motion by hand, in the crank's angle and in what must follow it."""
    assert np.isfinite(run.q).all()
    assert np.isfinite(run.u).all()
    branch = max(np.abs(run[name] - follow(run["phi"])).max() for name, follow in mechanism.others.items())
    assert branch < 1e-6
    return float(np.abs(run["phi"] - phi[: len(run)]).max())


def crossings(mechanism: Mechanism, t: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Return when a motion by hand passes singular positions, between samples linearly."""
    side = mechanism.crossing(phi)
    k = np.flatnonzero(side[1:] * side[:-1] < 0)
    return t[k] + (t[k + 1] - t[k]) * side[k] / (side[k] - side[k + 1])


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("rtol", [1e-4, 1e-7, 1e-11])
def test_free_motion_in_weight_goes_on_along_its_branch(name: str, rtol: float) -> None:
    mechanism = MECHANISMS[name]
    run = mbs.simulate(mechanism.system(g=9.81), t_end=3, rtol=rtol, atol=rtol, samples=3001)
    phi = mechanism.by_hand(run.t, g=9.81)
    assert error(run, mechanism, phi) < 3e3 * rtol
    times = [event["t"] for event in run.events if event["kind"] == "singular position"]
    assert times == pytest.approx(crossings(mechanism, run.t, phi), abs=1e-5 + 1e3 * rtol)
