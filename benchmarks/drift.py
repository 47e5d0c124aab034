"""How well constraints hold over 1,000 s, by projection and by Baumgarte's terms: crank-rocker, pendulum in x and y.

The crank-rocker has no motor here, gravity only. Rows are measured per metre of the longest rod.

    python benchmarks/drift.py
"""

from __future__ import annotations

import time
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

import multibody_sym as mbs

EXAMPLES = Path(__file__).parent.parent / "examples"
DURATION = 1000


def crank_rocker() -> mbs.System:
    """Return the four-bar of the examples without its motor; its crank starts with 10 rad/s."""
    return replace(mbs.load(EXAMPLES / "four_bar.yaml"), forces={})


def main() -> None:
    """Print the largest |phi| and |phidot| per metre and the change of energy of the integrated state, and CPU time."""
    print(f"multibody_sym {version('multibody-sym')}, dormand_prince, rtol 1e-9, {DURATION:,} s")
    pendulum = mbs.load(EXAMPLES / "pendulum_xy.yaml")
    for system, length, coordinates in (
        (crank_rocker(), 0.5, "relative"),
        (crank_rocker(), 0.5, "absolute"),
        (pendulum, 1.0, "relative"),
    ):
        for kept in ("projection", "baumgarte"):
            print(f"{system.name:12} {coordinates} {kept:10}  {line(system, length, coordinates, kept)}")


def line(system: mbs.System, length: float, coordinates: str, kept: str) -> str:
    """Run a system and return its figures."""
    start = time.process_time()
    run = mbs.simulate(
        system, t_end=DURATION, rtol=1e-9, samples=10_001, constraints=kept, coordinates=coordinates
    )
    spent, drift = time.process_time() - start, run.drift
    alpha = f"  alpha {run.baumgarte['alpha']:.3g}/s" if run.baumgarte else ""
    return (
        f"|phi| {drift['position'] / length:.1e}  |phidot| {drift['velocity'] / length:.1e}/s  "
        f"energy {drift['energy']:.1e} J  CPU {spent:.2f} s{alpha}"
    )


if __name__ == "__main__":
    main()
