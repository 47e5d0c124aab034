"""The example of an environment, by the checks of Gymnasium."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="the peer gymnasium (extra: peers) is not installed")


@pytest.mark.filterwarnings("ignore:.*WARN")
def test_it_is_an_environment() -> None:
    from gymnasium.utils.env_checker import check_env

    path = Path(__file__).parents[2] / "examples" / "control" / "environment.py"
    spec = importlib.util.spec_from_file_location("environment", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    environment = module.CartPole()
    check_env(environment, skip_render_check=True)
    first, _ = environment.reset(seed=3)
    again, _ = environment.reset(seed=3)
    assert np.array_equal(first, again)
    states = [environment.step(np.array([0.0]))[2] for _ in range(500)]
    assert states[-1]  # a pole that nobody keeps upright falls
