"""A UR5 stepped by 1 ms from Python, alone and a thousand at once, beside what its C takes.

    python benchmarks/stepper.py

In microseconds of CPU: a step of rk4 with a torque law of numpy, the law alone, and their difference; a step of each of
1,000 arms, and the call in C within it. Interleaved, minimum of rounds. Needs the extra `peers`, for the URDF.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable

import numpy as np
from robots import ROBOTS, path_of

import multibody_sym as mbs

MANY, ROUNDS, STEPS = 1000, 15, 200


def least(*calls: Callable[[], object]) -> list[float]:
    """Return the least CPU time of each call, in microseconds, interleaved."""
    found = [float("inf")] * len(calls)
    for _ in range(ROUNDS):
        for k, call in enumerate(calls):
            begun = time.process_time()
            call()
            found[k] = min(found[k], (time.process_time() - begun) * 1e6)
    return found


def main() -> None:
    """Print both rows."""
    robot = next(each for each in ROBOTS if each.name == "UR5")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", mbs.UrdfNotice)
        system = mbs.load_urdf(path_of(robot), torques=True, damping=False)
    prepared = mbs.prepare(system, method="rk4", step="1 ms", t_end=1)
    sim, many = prepared.stepper("1 ms"), prepared.stepper("1 ms", count=MANY)

    def torques() -> np.ndarray:
        return -10.0 * sim.q - 2.0 * sim.u

    def steps() -> None:
        for _ in range(STEPS):
            sim.step(torques())

    def laws() -> None:
        for _ in range(STEPS):
            torques()

    pushes = np.random.default_rng(0).standard_normal((MANY, len(many.inputs)))
    calls = many.step(pushes)._calls
    both, law = (x / STEPS for x in least(steps, laws))
    whole, in_c = (x / MANY for x in least(lambda: many.step(pushes), calls.run))
    print(f"multibody_sym {mbs.__version__}, numpy {np.__version__}, Python {sys.version.split()[0]}")
    print(f"one UR5: {both:.1f} with its law, {law:.1f} the law alone, {both - law:.1f} the step")
    print(f"each of {MANY}: {whole:.2f}, C within it {in_c:.2f}, ratio {whole / in_c:.2f}")


if __name__ == "__main__":
    main()
