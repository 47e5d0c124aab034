"""Chains of 10 to 1,000 like bodies: from the declaration to compiled code, and its time, against Pinocchio's.

    python benchmarks/chains.py [bodies ...]

Two spatial chains whose links share 13 symbolic parameters (mass, centre of mass, inertia, place of the next joint):
hinges about x, y and z in turn, and ball joints. Per number of bodies: CPU seconds of declaring and resolving, of
deriving and printing, and of the compiler, with empty caches; bytes of model.c; operations; microseconds of one state
derivative (minimum over rounds, many states in turn, called by a loop in C, -O2 for any machine); the same by `pin.aba`
up to 300 speeds (its data hold nv^3 numbers); and the agreement ratio of the compiled accelerations with d'Alembert's
principle (`analysis.independent_checks`: rounding is below 10). Last the slope of log time against log bodies from the
first row to the last.
"""

from __future__ import annotations

import math
import os
import resource
import sys
import tempfile
import time
from importlib.metadata import version
from itertools import pairwise
from typing import Any

import numpy as np

from multibody_sym.analysis.check import dalembert, ratio
from multibody_sym.dynamics.formalisms.articulated_body import block_ldl
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body
from multibody_sym.model.joints import Joint, Revolute, Spherical
from multibody_sym.model.system import System
from multibody_sym.program.backend import Native
from multibody_sym.program.c_target import c_source
from multibody_sym.program.loading import Compiled, load
from multibody_sym.program.program import operation_count

VALUES = {"m": 1.3, "cx": 0.02, "cy": 0.01, "cz": -0.05, "px": 0.03, "py": 0.0, "pz": -0.1}
INERTIA = {"Ixx": 0.01, "Iyy": 0.012, "Izz": 0.008, "Ixy": 0.001, "Ixz": -0.0005, "Iyz": 0.0002}
LARGEST_THEIRS = 300
GRAVITY = 9.81


def chain(count: int, kind: str) -> System:
    """Return a chain of hinges (axes x, y, z in turn) or ball joints."""
    body = Body(
        mass="m", com=["cx", "cy", "cz"], inertia={key: key for key in INERTIA}, points={"end": ["px", "py", "pz"]}
    )
    joints: dict[str, Joint] = {}
    for k in range(count):
        ends = f"body{k - 1}.end" if k else "ground", f"body{k}"
        joints[f"joint{k}"] = Revolute(*ends, axis="xyz"[k % 3]) if kind == "revolute" else Spherical(*ends)
    bodies = {f"body{k}": body for k in range(count)}
    return System("chain", gravity=[0, 0, -GRAVITY], parameters={**VALUES, **INERTIA}, bodies=bodies, joints=joints)


def cpu() -> tuple[float, float]:
    """Return the CPU seconds of this process and of its children."""
    usage = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    own, children = (each.ru_utime + each.ru_stime for each in usage)
    return own, children


def states(resolved: Mechanism, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return random coordinates, quaternions of unit length, and small speeds."""
    rng = np.random.default_rng(0)
    q = rng.uniform(-1, 1, (count, len(resolved.coordinates)))
    for body in resolved.bodies:
        for places in map(list, body.quaternions):
            q[:, places] /= np.linalg.norm(q[:, places], axis=1, keepdims=True)
    return q, 0.1 * rng.normal(size=(count, len(resolved.speeds)))


def our_microseconds(compiled: Compiled, q: np.ndarray, u: np.ndarray) -> float:
    """Return the least time of one evaluation."""
    parameters = [*VALUES.values(), *INERTIA.values()]
    rounds = []
    for _ in range(30):
        start = time.thread_time()
        compiled.map("state_derivative", 0.0, q, u, parameters, [], [])
        rounds.append(time.thread_time() - start)
    return min(rounds) / len(q) * 1e6


def their_microseconds(count: int, kind: str) -> float:
    """Return the least time of one `pin.aba` for the same chain; nan without Pinocchio, or where it is large."""
    try:
        import pinocchio as pin
    except ImportError:
        return math.nan
    if count * (1 if kind == "revolute" else 3) > LARGEST_THEIRS:
        return math.nan
    model = their_model(pin, count, kind)
    data, rng = model.createData(), np.random.default_rng(0)
    v, tau = rng.normal(size=model.nv), np.zeros(model.nv)
    q = pin.integrate(model, pin.neutral(model), rng.uniform(-1, 1, model.nv))
    rounds = []
    for _ in range(200):
        start = time.thread_time()
        pin.aba(model, data, q, v, tau)
        rounds.append(time.thread_time() - start)
    return min(rounds) * 1e6


def their_model(pin: Any, count: int, kind: str) -> Any:
    """Return the chain as Pinocchio's model."""
    hinges = [pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ]
    xx, yy, zz, xy, xz, yz = INERTIA.values()
    com = np.array([VALUES["cx"], VALUES["cy"], VALUES["cz"]])
    inertia = pin.Inertia(VALUES["m"], com, np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    step = np.array([VALUES["px"], VALUES["py"], VALUES["pz"]])
    model, last = pin.Model(), 0
    for k in range(count):
        joint = hinges[k % 3]() if kind == "revolute" else pin.JointModelSpherical()
        last = model.addJoint(last, joint, pin.SE3(np.eye(3), step if k else np.zeros(3)), f"joint{k}")
        model.appendBodyToJoint(last, inertia, pin.SE3.Identity())
    return model


def agreement_ratio(resolved: Mechanism, compiled: Compiled, q: np.ndarray, u: np.ndarray) -> float:
    """Return the scaled residual of the compiled accelerations."""
    parameters = [*VALUES.values(), *INERTIA.values()]
    _, udot, *_ = compiled["state_derivative"](0.0, q, u, parameters, [], [])
    state = state_of(resolved, float, 0.0, q.tolist(), u.tolist(), parameters)
    return ratio(dalembert(motion_of(resolved, state)), udot, [])


def measure(count: int, kind: str) -> float:
    """Print one row and return the microseconds of an evaluation."""
    times = [cpu()]
    resolved = mechanism(chain(count, kind))
    times.append(cpu())
    made = programs(resolved, block_ldl).as_mapping()
    size = len(c_source(made)["model.c"])
    times.append(cpu())
    compiled = load(made, Native(backend="c"))
    times.append(cpu())
    declared, derived, built = (sum(b) - sum(a) for a, b in pairwise(times))
    q, u = states(resolved, 64)
    own = our_microseconds(compiled, q, u)
    print(
        f"{kind:10} {count:6} {declared:9.2f} {derived:8.2f} {built:8.2f} {declared + derived + built:7.2f} {size:8}"
        f" {operation_count(made['state_derivative']).total:10} {own:9.2f} {their_microseconds(count, kind):9.2f}"
        f" {agreement_ratio(resolved, compiled, q[0], u[0]):9.2g}",
        flush=True,
    )
    return own


def main() -> None:
    """Print the table."""
    print(f"multibody_sym {version('multibody-sym')}, Python {sys.version.split()[0]}")
    print("joints     bodies  declare s derive s   cc s  total s    bytes operations     us    pin us  agreement")
    sizes = [int(word) for word in sys.argv[1:]] or [10, 30, 100, 300, 1000]
    with tempfile.TemporaryDirectory() as cache:
        os.environ["XDG_CACHE_HOME"] = cache
        for kind in ("revolute", "spherical"):
            microseconds = [measure(count, kind) for count in sizes]
            if len(sizes) > 1:
                slope = math.log(microseconds[-1] / microseconds[0]) / math.log(sizes[-1] / sizes[0])
                print(f"{kind}: slope {slope:.3f}")


if __name__ == "__main__":
    main()
