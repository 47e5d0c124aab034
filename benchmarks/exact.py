"""How close runs of 100 s come to motions in closed form, and to the energy that they should keep.

    python benchmarks/exact.py
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np

from multibody_sym.mechanics.model_files import load, loads
from multibody_sym.model.system import System
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.motion.simulate import simulate

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))
from exact_motions import FREE_BODY, HEAVY_TOP, free_rotation, nutation  # noqa: E402


def free_body_error(run: Trajectory) -> float:
    """Return the largest error of the angular velocity in rad/s; it is about 1 rad/s."""
    found = np.array([run[f"ball_w{axis}"] for axis in "xyz"])
    return float(np.abs(found - free_rotation(1, 2, 3, 1, 0.7, run.t)).max())


def heavy_top_error(run: Trajectory) -> float:
    """Return the largest error of the cosine of the tilt of a top that spins at 100 rad/s."""
    exact = nutation(3e-4 + 0.3 * 0.04**2, 0.3 * 9.81 * 0.04, 2e-4 * 100, np.pi / 3, run.t)
    return float(np.abs(run["z"] - exact).max())


def energy_error(run: Trajectory) -> float:
    """Return the largest change of the energy, relative to the largest kinetic energy."""
    return run.drift["energy"] / float(run.kinetic_energy.max())


def show(name: str, system: System, error: Callable[[Trajectory], float]) -> None:
    """Print the errors at three tolerances."""
    for tolerance in (1e-10, 1e-12, 1e-14):
        start = time.process_time()
        run = simulate(system, t_end=100, method="dormand_prince_8", rtol=tolerance, atol=tolerance)
        spent, steps = time.process_time() - start, run.statistics["steps"]
        print(f"{name:28}  tolerance {tolerance:.0e}  error {error(run):.1e}  {steps:6} steps  CPU {spent:.2f} s")


def main() -> None:
    """Print the errors of a free body, a heavy top, and the energy of a double pendulum."""
    print(f"multibody_sym {version('multibody-sym')}, dormand_prince_8, 100 s")
    show("free body, angular velocity", loads(FREE_BODY), free_body_error)
    show("heavy top, cosine of tilt", loads(HEAVY_TOP), heavy_top_error)
    show("double pendulum, energy", load(ROOT / "examples" / "double_pendulum.yaml"), energy_error)


if __name__ == "__main__":
    main()
