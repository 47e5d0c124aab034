"""A hanging chain of 100, 300 and 1,000 hinges whose end is struck: the jumps and the impulses in all joints, in C.

    python benchmarks/impacts.py [hinges ...]

Per number of hinges: CPU seconds of resolving and deriving, and of the compiler, with empty caches; microseconds of one
impact (minimum over rounds) with all impulses in joints; and by how much momentum is missed, relative to the sum of its
terms. Last the slope of log time against log hinges.
"""

from __future__ import annotations

import math
import os
import sys
import tempfile
import time
from typing import Any

import numpy as np

import multibody_sym as mbs


def chain(count: int) -> mbs.System:
    """Return a chain of rods on hinges about z, straight along x, that falls onto a point under its end."""
    rod = mbs.Body(shape=mbs.Shape("rod", "l", "m"), points={"end": ["l", 0, 0]})
    bodies = {f"rod{k}": rod for k in range(1, count + 1)}
    joints = {
        f"h{k}": mbs.Revolute(f"rod{k - 1}.end" if k > 1 else "ground", f"rod{k}", axis="z", initial={"u": -1 / k})
        for k in range(1, count + 1)
    }
    ground = mbs.Body(points={"edge": [f"{count}*l", 0, 0]})
    return mbs.System(
        "struck chain",
        parameters={"m": 1.0, "l": 0.1, "e": 0.5},
        bodies={**bodies, "ground": ground},
        joints=joints,
        impact=mbs.Impact(between=[f"rod{count}.end", "ground.edge"], normal="y", restitution="e"),
    )


def measured(count: int) -> float:
    """Print one row and return the microseconds of an impact."""
    begin = time.process_time()
    system = chain(count)
    function = mbs.compile(mbs.impact(system))
    prepared = time.process_time() - begin
    arguments, program = function.arguments, function.arguments.compiled["impact"]
    u = np.array([-1 / k for k in range(1, count + 1)])
    given = arguments.complete(0.0, np.zeros(count), u, None, None)
    for _ in range(20):
        program(*given)
    best = math.inf
    for _ in range(30):
        start = time.perf_counter()
        for _ in range(10):
            program(*given)
        best = min(best, (time.perf_counter() - start) / 10)
    told = function(0.0, np.zeros(count), u)
    print(f"{count:6d} {prepared:8.2f} s {1e6 * best:10.1f} us   momentum missed {missed(told, u):.1e}")
    return 1e6 * best


def missed(told: Any, u: np.ndarray) -> float:
    """Return how far the jump of the vertical momentum is from the impulses of the hinge on ground and at the end."""
    omega = np.cumsum(told.u - u)
    ends = 0.1 * np.concatenate([[0.0], np.cumsum(omega)])
    momenta = (ends[:-1] + ends[1:]) / 2
    impulses = told.joints["h1"]["fy"] + next(iter(told.impulses.values()))
    return float(abs(momenta.sum() - impulses) / (np.abs(momenta).sum() + abs(impulses)))


def main(counts: list[int]) -> None:
    """Print all rows and the slope."""
    os.environ["XDG_CACHE_HOME"] = tempfile.mkdtemp()
    times = [measured(count) for count in counts]
    if len(times) > 1:
        print(f"slope {math.log(times[-1] / times[0]) / math.log(counts[-1] / counts[0]):.2f}")


if __name__ == "__main__":
    main([int(x) for x in sys.argv[1:]] or [100, 300, 1000])
