"""Functions of robots and their derivatives against Pinocchio, as both are called from Python.

    python benchmarks/functions.py [ROBOT ..]

For each robot, in microseconds of CPU a state: one call of accelerations; a batch of 10,000 states against a loop
around `pin.aba`; derivatives of inverse dynamics by q and u (two Functions, summed) against `computeRNEADerivatives`;
those of accelerations against `computeABADerivatives`, which also returns the inverse of M. Interleaved, minimum of
rounds. Needs the extra `peers`.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable
from importlib.metadata import version

import numpy as np
import pinocchio as pin
from robots import ROBOTS, Robot, path_of

import multibody_sym as mbs

MANY, ROUNDS = 10_000, 7


def best(*calls: Callable[[], object], repeat: int) -> list[float]:
    """Return the least CPU time of each call, in microseconds, interleaved."""
    found = [float("inf")] * len(calls)
    for _ in range(ROUNDS):
        for k, call in enumerate(calls):
            begun = time.process_time()
            for _ in range(repeat):
                call()
            found[k] = min(found[k], (time.process_time() - begun) / repeat * 1e6)
    return found


def measured(robot: Robot) -> list[str]:
    """Return the row of a robot: ours and theirs of each pair."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", mbs.UrdfNotice)
        system = mbs.load_urdf(path_of(robot), floating=robot.floating, damping=False, mimic=False)
    model = pin.buildModelFromUrdf(path_of(robot), *([pin.JointModelFreeFlyer()] if robot.floating else []))
    data, rng = model.createData(), np.random.default_rng(0)
    q = np.array([pin.randomConfiguration(model, -np.ones(model.nq), np.ones(model.nq)) for _ in range(MANY)])
    u, udot = rng.standard_normal((2, MANY, model.nv))
    tau = np.zeros(model.nv)
    accelerations, forces = (mbs.function(system, what) for what in ("state_derivative", "inverse_dynamics"))
    one = 0.0, q[0].copy(), u[0].copy()
    rates = [accelerations.derivative(by) for by in ("q", "u")]
    slopes = [forces.derivative(by) for by in ("q", "u")]
    for f in (accelerations, *rates):
        f(*one)
    for f in slopes:
        f(*one, udot[0])
    call = best(lambda: accelerations(*one), lambda: pin.aba(model, data, *one[1:], tau), repeat=2000)
    batch = best(
        lambda: accelerations(0.0, q, u),
        lambda: [pin.aba(model, data, a, b, tau) for a, b in zip(q, u, strict=True)],
        repeat=1,
    )
    of_forces = best(
        lambda: [f(*one, udot[0]) for f in slopes],
        lambda: pin.computeRNEADerivatives(model, data, *one[1:], udot[0]),
        repeat=1000,
    )
    of_rates = best(
        lambda: [f(*one) for f in rates],
        lambda: pin.computeABADerivatives(model, data, *one[1:], tau),
        repeat=1000,
    )
    pairs = [call, [x / MANY for x in batch], of_forces, of_rates]
    return [robot.name, *(f"{ours:.2f} ({theirs:.2f})" for ours, theirs in pairs)]


def main(names: list[str]) -> None:
    """Print a row a robot."""
    versions = f"multibody_sym {mbs.__version__}, pinocchio {version('pin')}, Python {sys.version.split()[0]}"
    print(f"{versions}; microseconds, Pinocchio's in brackets")
    print("| robot | one call | one of 10,000 | d inverse dynamics | d accelerations |\n|---|---|---|---|---|")
    for robot in ROBOTS:
        if not names or robot.name.split()[0].rstrip(',') in names:
            print("|", " | ".join(measured(robot)), "|")


if __name__ == "__main__":
    main(sys.argv[1:])
