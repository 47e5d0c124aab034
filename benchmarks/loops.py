"""What the start of closed loops costs as their number grows, and a run that changes a number of one.

    python benchmarks/loops.py [N ...]

Windows of a four-bar in a row, as in `n_four_bar.py`, which needs the extra `peers`. CPU time of the
thread, warm, minima; the slope is that of log time over log windows from the fewest to the most.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np
from windows import windows

import multibody_sym as mbs
from multibody_sym.motion.prepare.problem import prepare_system, problem_of, settings_of

MODEL = Path(__file__).parents[1] / "examples" / "four_bar.yaml"
ROUNDS = 5


def least(work: Callable[[], object]) -> float:
    """Return the least CPU time (s) of some rounds."""
    found = []
    for _ in range(ROUNDS):
        begin = time.thread_time()
        work()
        found.append(time.thread_time() - begin)
    return min(found)


def of_starts(counts: list[int]) -> None:
    """Print what a start costs, from the declaration to the problem."""
    spent = []
    for count in counts:
        system = windows(count)

        def begin(asked: mbs.System = system) -> None:
            ready = prepare_system(asked)
            problem_of(ready, settings_of(ready))

        begin()  # compiles
        spent.append(least(begin))
        print(f"start of {count} windows: {spent[-1]:.3f} s", flush=True)
    if len(counts) > 1:
        slope = math.log(spent[-1] / spent[0]) / math.log(counts[-1] / counts[0])
        print(f"slope from {counts[0]} to {counts[-1]} windows: {slope:.2f}")


def of_changed_runs() -> None:
    """Print what runs of a four-bar cost that change a number, against those that do not."""
    prepared = mbs.prepare(mbs.load(MODEL), t_end=1e-3, samples=2)
    cranks = {"a": np.linspace(0.19, 0.21, 64).tolist()}

    def changed() -> None:
        for run in prepared.runs(cranks, {}):
            run()

    prepared.run()
    changed()
    one, all_of_them = least(prepared.run), least(changed)
    print(f"four-bar, run as declared: {1e3 * one:.3f} ms; with another crank: {1e3 * all_of_them / 64:.3f} ms")


def main() -> None:
    """Print all."""
    print(f"multibody_sym {version('multibody-sym')}, Python {sys.version.split()[0]}, NumPy {np.__version__}")
    of_starts([int(count) for count in sys.argv[1:]] or [10, 20, 40, 80, 160])
    of_changed_runs()


if __name__ == "__main__":
    main()
