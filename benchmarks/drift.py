"""How well constraints hold over 1,000 s: the pendulum in x and y, by projection and by Baumgarte's terms.

    python benchmarks/drift.py
"""

from __future__ import annotations

import time
from importlib.metadata import version
from pathlib import Path

from multibody_sym.formats.reader import load
from multibody_sym.simulation.simulate import simulate

MODEL = Path(__file__).parent.parent / "examples" / "pendulum_xy.yaml"


def main() -> None:
    """Print the largest |phi| and |phidot| of the integrated state, and the CPU time."""
    print(f"multibody_sym {version('multibody-sym')}, {MODEL.stem}, dormand_prince, rtol 1e-9, 1,000 s")
    system = load(MODEL)
    for kept in ("projection", "baumgarte"):
        start = time.process_time()
        run = simulate(system, t_end=1000, rtol=1e-9, samples=10_001, constraints=kept)
        spent, drift = time.process_time() - start, run.drift
        print(f"{kept:10}  |phi| {drift['position']:.1e} m  |phidot| {drift['velocity']:.1e} m/s  CPU {spent:.2f} s")


if __name__ == "__main__":
    main()
