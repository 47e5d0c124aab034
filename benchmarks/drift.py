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
    for system, length in ((crank_rocker(), 0.5), (mbs.load(EXAMPLES / "pendulum_xy.yaml"), 1.0)):
        for kept in ("projection", "baumgarte"):
            start = time.process_time()
            run = mbs.simulate(system, t_end=DURATION, rtol=1e-9, samples=10_001, constraints=kept)
            spent, drift = time.process_time() - start, run.drift
            alpha = f"  alpha {run.baumgarte['alpha']:.3g}/s" if run.baumgarte else ""
            print(
                f"{system.name:12} {kept:10}  |phi| {drift['position'] / length:.1e}  "
                f"|phidot| {drift['velocity'] / length:.1e}/s  energy {drift['energy']:.1e} J  CPU {spent:.2f} s{alpha}"
            )


if __name__ == "__main__":
    main()
