"""Functions of robots and their derivatives against Pinocchio, as both are called from Python, and in C alone.

    python benchmarks/functions.py [--native] [ROBOT ..]

First for each robot, in microseconds of CPU a state: one call of accelerations; a batch of 10,000 states against a loop
around `pin.aba`; derivatives of inverse dynamics by q and u together against `computeRNEADerivatives`; those of
accelerations by q, u and all torques against `computeABADerivatives`. Then the same accelerations with all derivatives
without Python: ours by a loop in C over 10,000 different states in turn, theirs for the same number of states less the
cost of the call, which is that of a model without joints, and ours beside accelerations alone. The operations are those
of accelerations alone; of the slopes of forces by q and u; of columns solved with M. A floating base has no torques of
its own, and Pinocchio returns columns of M^-1 for it, too. With --native ours are compiled for the machine at hand.
Interleaved, minimum of rounds. Needs the extra `peers`.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from typing import Any

import numpy as np
import pinocchio as pin
from robots import ROBOTS, Robot, path_of

import multibody_sym as mbs

MANY, ROUNDS = 10_000, 7
SOLO = Robot("Solo12, floating", "solo_description/robots/solo12.urdf", True, 0)


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


class Measured:
    """A robot here and there, with states for both."""

    def __init__(self, robot: Robot, native: bool) -> None:
        self.name, path = robot.name, path_of(robot)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", mbs.UrdfNotice)
            system = mbs.load_urdf(path, floating=robot.floating, damping=False, mimic=False, torques=True)
        self.model = pin.buildModelFromUrdf(path, *([pin.JointModelFreeFlyer()] if robot.floating else []))
        self.data, rng = self.model.createData(), np.random.default_rng(0)
        bounds = np.ones(self.model.nq)
        self.q = np.array([pin.randomConfiguration(self.model, -bounds, bounds) for _ in range(MANY)])
        self.u, self.udot = rng.standard_normal((2, MANY, self.model.nv))
        self.accelerations = mbs.function(system, "state_derivative", native=native)
        self.forces = mbs.function(system, "inverse_dynamics", native=native)
        self.rates = self.accelerations.with_derivatives("q", "u", "inputs", of="udot")
        self.slopes = self.forces.with_derivatives("q", "u", "udot")

    def from_python(self) -> list[str]:
        """Return the row of calls from Python: ours and theirs of each pair."""
        model, data, q, u = self.model, self.data, self.q, self.u
        one, udot, tau = (0.0, q[0].copy(), u[0].copy()), self.udot[0].copy(), np.zeros(model.nv)
        call = best(lambda: self.accelerations(*one), lambda: pin.aba(model, data, *one[1:], tau), repeat=2000)
        batch = best(
            lambda: self.accelerations(0.0, q, u),
            lambda: [pin.aba(model, data, a, b, tau) for a, b in zip(q, u, strict=True)],
            repeat=1,
        )
        of_forces = best(
            lambda: self.slopes(*one, udot),
            lambda: pin.computeRNEADerivatives(model, data, *one[1:], udot),
            repeat=1000,
        )
        of_rates = best(
            lambda: self.rates(*one), lambda: pin.computeABADerivatives(model, data, *one[1:], tau), repeat=1000
        )
        pairs = [call, [x / MANY for x in batch], of_forces, of_rates]
        return [self.name, *(f"{ours:.2f} ({theirs:.2f})" for ours, theirs in pairs)]

    def in_c(self) -> list[str]:
        """Return the row of C alone: ours, theirs, the ratio, accelerations alone, the ratio, operations by part."""
        given = 0.0, self.q, self.u
        alone, together = (partial(f, *given, out=f(*given)) for f in (self.accelerations, self.rates))
        bare, tau = pin.Model(), np.zeros(self.model.nv)
        none = bare.createData(), np.zeros(0)
        times = best(
            alone,
            together,
            lambda: [pin.computeABADerivatives(self.model, self.data, a, b, tau) for a, b in self._states()],
            lambda: [pin.computeABADerivatives(bare, none[0], none[1], none[1], none[1]) for _ in self._states()],
            repeat=1,
        )
        one, every, theirs, call = (x / MANY for x in times)
        by_state = self.forces.with_derivatives("q", "u")
        counted = (self.accelerations, self.forces, by_state, self.rates)
        first, forces, with_slopes, total = (f.operations.total for f in counted)
        parts = first, with_slopes - forces, total - first - (with_slopes - forces)
        ratios = f"{(theirs - call) / every:.1f}", f"{one:.3f}", f"{every / one:.1f}"
        return [self.name, f"{every:.3f}", f"{theirs - call:.2f}", *ratios, " + ".join(map(str, parts))]

    def _states(self) -> zip[tuple[Any, Any]]:
        return zip(self.q, self.u, strict=True)


def main(words: list[str]) -> None:
    """Print both tables, a row a robot."""
    native, names = "--native" in words, [word for word in words if word != "--native"]
    versions = f"multibody_sym {mbs.__version__}, pinocchio {version('pin')}, Python {sys.version.split()[0]}"
    print(f"{versions}; microseconds, Pinocchio's in brackets")
    robots = [robot for robot in (*ROBOTS, SOLO) if not names or robot.name.split()[0].rstrip(",") in names]
    measured = [Measured(robot, native) for robot in robots]
    print("| robot | one call | one of 10,000 | d inverse dynamics | d accelerations |\n|---|---|---|---|---|")
    for each in measured:
        print("|", " | ".join(each.from_python()), "|", flush=True)
    print("\n| robot | in C | Pinocchio | times less | accelerations alone | ratio | operations |")
    print("|---|---|---|---|---|---|---|")
    for each in measured:
        print("|", " | ".join(each.in_c()), "|", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
