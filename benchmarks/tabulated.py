"""What inputs by tables cost: reading, preparing, another start beside the run alone, and kinks of straight lines.

    python benchmarks/tabulated.py
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import multibody_sym as mbs

_FEW, _MANY, _TRIES = 400, 100_000, 7
_MODEL = """\
multibody_sym: 1
name: pulled
bodies: {block: {mass: 2}}
joints: {J: {type: prismatic, parent: ground, child: block, axis: x, q: x}}
forces: {F: {type: force, on: block, value: [pull, 0, 0]}}
inputs: {pull: {table: {file: pull.csv}}}
"""


def main() -> None:
    """Print the figures in CPU time, as minima."""
    print(f"Python {sys.version.split()[0]}")
    for rows in (_FEW, _MANY):
        system = _road(rows)
        took, prepared = _cpu(lambda system=system: mbs.prepare(system, t_end=3, samples=7, step=5e-5), 1)
        prepared.run(initial={"wheel": 0.3})
        alone, _ = _cpu(prepared.run, _TRIES)
        another, _ = _cpu(lambda prepared=prepared: prepared.run(initial={"wheel": 0.1}), _TRIES)
        print(f"motion by a spline of {rows} rows: prepare {took:.2f} s, another start {another / alone:.2f} runs")
    with tempfile.TemporaryDirectory() as folder:
        t = np.linspace(0, 10, _MANY)
        y = np.cumsum(np.random.default_rng(1).normal(size=_MANY)) / np.sqrt(_MANY)
        np.savetxt(Path(folder) / "pull.csv", np.c_[t, y], "%.15g", ",")
        file = Path(folder) / "pulled.yaml"
        file.write_text(_MODEL, encoding="utf-8")
        took, system = _cpu(lambda: mbs.load(file), 1)
        prepared = mbs.prepare(system, t_end=10, samples=2)
        alone, run = _cpu(prepared.run, 2)
        missed = abs(run["u_x"][-1] - np.trapezoid(y, t) / 2)
        print(f"force on straight lines through {_MANY} rows: read {took:.2f} s, run {alone:.2f} s, error {missed:.1e}")


def _road(rows: int) -> mbs.System:
    """Return a wheel on a spring above a road that is a table of its height over time."""
    way, t = mbs.variable("way"), np.linspace(0, 3, rows)
    return mbs.System(
        "quarter_car",
        bodies={"patch": mbs.Body(mass=1), "wheel": mbs.Body(mass=1)},
        joints={
            "R": mbs.Prismatic("ground", "patch", axis="z", motion=way),
            "W": mbs.Prismatic("ground", "wheel", axis="z", q="wheel"),
        },
        forces={"tyre": mbs.Force(on="wheel", value=[0, 0, 100 * (way - mbs.variable("wheel"))])},
        inputs={"way": mbs.Table(table=np.c_[t, 0.05 * np.sin(3 * t) ** 2], interpolation="cubic")},
    )


def _cpu(work: Callable[[], Any], tries: int) -> tuple[float, Any]:
    """Return the least CPU time of several tries, and the last result."""
    least = float("inf")
    for _ in range(tries):
        begun = time.process_time()
        found = work()
        least = min(least, time.process_time() - begun)
    return least, found


if __name__ == "__main__":
    main()
