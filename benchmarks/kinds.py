"""Like parts as loops: written numbers against named ones, four-bars in a row, and a warm start from a file.

    python benchmarks/kinds.py [hinges] [windows] [links]

Chain of hinges with unlike numbers (default 300), written in the model and named: kB of C, CPU seconds of the compiler,
microseconds of a state derivative; what other numbers compile; the same of 3 hinges. Four-bars in a row (default 10,
20, 40): slopes of the sizes of C, the compiler's CPU time and the evaluation with both projections from the first to
the last; so many, and one, with unlike numbers. Chain from a file (default 1,000 links): CPU seconds of
`multibody-sym simulate` with everything cached, beyond importing numpy in the same run. Minima; ratios and slopes only
are for other machines.
"""

from __future__ import annotations

import math
import os
import platform
import random
import resource
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from windows import windows

import multibody_sym as mbs
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.motion.prepare.problem import prepare_system
from multibody_sym.motion.prepare.records import PreparedSystem
from multibody_sym.program.backend import Native
from multibody_sym.program.c_target import c_source
from multibody_sym.program.loading import load

NUMBERS = {"m": 1.3, "cx": 0.02, "cy": 0.01, "cz": -0.05, "px": 0.03, "py": 0.02, "pz": -0.1}
INERTIA = {"Ixx": 0.01, "Iyy": 0.012, "Izz": 0.008, "Ixy": 0.001, "Ixz": -0.0005, "Iyz": 0.0002}
STATES = 32


def chain(count: int, seed: int, *, named: bool) -> mbs.System:
    """Return a chain of hinges about x, y and z in turn, all with numbers of their own."""
    rng, parameters = random.Random(seed), {}
    bodies: dict[str, Any] = {}
    joints: dict[str, Any] = {}
    for k in range(count):
        own = {name: round(x * (1 + 0.1 * rng.random()), 7) for name, x in {**NUMBERS, **INERTIA}.items()}
        parameters |= {f"{name}{k}": x for name, x in own.items()}
        of = {name: f"{name}{k}" for name in own} if named else own
        bodies[f"body{k}"] = mbs.Body(
            mass=of["m"],
            com=[of["cx"], of["cy"], of["cz"]],
            inertia={name: of[name] for name in INERTIA},
            points={"end": [of["px"], of["py"], of["pz"]]},
        )
        joints[f"joint{k}"] = mbs.Revolute(f"body{k - 1}.end" if k else "ground", f"body{k}", axis="xyz"[k % 3])
    settings = {"t_end": 0.001, "samples": 2}
    return mbs.System("chain", [0, 0, -9.81], parameters if named else {}, bodies, joints, simulation=settings)


def children() -> float:
    """Return the CPU seconds of all child processes."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def source_size(ready: PreparedSystem) -> int:
    """Return the bytes of model.c."""
    made = programs(ready.mechanism, FORMALISMS[ready.formalism]).as_mapping()
    return len(c_source(made)["model.c"])


def microseconds(ready: PreparedSystem, names: tuple[str, ...]) -> float:
    """Return the least time of one evaluation of some Programs near the start."""
    rng = np.random.default_rng(0)
    q = ready.q0 + 0.01 * rng.normal(size=(STATES, len(ready.q0)))
    u = ready.u0 + 0.01 * rng.normal(size=(STATES, len(ready.u0)))
    total = 0.0
    for name in names:
        rounds = []
        for _ in range(30):
            begin = time.thread_time()
            ready.compiled.map(name, 0.0, q, u, ready.parameters, [], [])
            rounds.append(time.thread_time() - begin)
        total += min(rounds)
    return total / STATES * 1e6


def unlike_numbers(count: int) -> None:
    """Print the chain with written and with named numbers."""
    found = {}
    for named in (False, True):
        begin = children()
        ready = prepare_system(chain(count, 1, named=named))
        compiler = children() - begin
        begin = children()
        prepare_system(chain(count, 2, named=named))
        again = children() - begin
        found[named] = source_size(ready), compiler, microseconds(ready, ("state_derivative",)), again
        size, compiler, each, again = found[named]
        what = "named" if named else "written"
        print(
            f"{count} hinges, {what}: {size / 1000:.0f} kB of C, {compiler:.2f} s of compiler, {each:.2f} us; "
            f"other numbers {again:.2f} s of compiler",
            flush=True,
        )
    print(f"evaluation, written against named: {found[False][2] / found[True][2]:.3f}")


def rows_of_windows(sizes: list[int]) -> None:
    """Print four-bars in a row, with the slopes from the first to the last."""
    found = []
    for count in sizes:
        begin = children()
        ready = prepare_system(windows(count))
        compiler = children() - begin
        each = microseconds(ready, ("state_derivative", "put_back"))
        found.append((source_size(ready), compiler, each))
        size, compiler, each = found[-1]
        print(f"{count} windows: {size / 1000:.0f} kB of C, {compiler:.2f} s of compiler, {each:.2f} us", flush=True)
    ends = zip(found[0], found[-1], strict=True)
    slopes = [math.log(last / first) / math.log(sizes[-1] / sizes[0]) for first, last in ends]
    print("slopes of source, compiler, evaluation: " + ", ".join(f"{slope:.2f}" for slope in slopes))


def unlike_windows(count: int) -> None:
    """Print four-bars in a row whose numbers are all unlike beside alike ones, and what other numbers compile."""
    found = {}
    for seed in (None, 1, 2):
        begin = children()
        ready = prepare_system(windows(count, seed=seed))
        found[seed] = source_size(ready), children() - begin, microseconds(ready, ("state_derivative", "put_back"))
    size, compiler, each = found[1]
    print(
        f"{count} unlike windows: {size / 1000:.0f} kB of C, {compiler:.2f} s of compiler, evaluation against alike "
        f"ones {each / found[None][2]:.3f}; other numbers {found[2][1]:.2f} s of compiler",
        flush=True,
    )


def warm(count: int, folder: Path) -> None:
    """Print the CPU time of a run of a chain from a file, with everything cached."""
    path = folder / "chain.yaml"
    mbs.dump(chain(count, 1, named=False), path)
    commands = [sys.executable, "-c", "import numpy"], [sys.executable, "-m", "multibody_sym", "simulate", str(path)]
    least = [math.inf, math.inf]
    subprocess.run(commands[1], check=True, capture_output=True)
    for _ in range(3):
        for k, command in enumerate(commands):
            begin = children()
            subprocess.run(command, check=True, capture_output=True)
            least[k] = min(least[k], children() - begin)
    print(f"{count} links from a file, warm: {least[1] - least[0]:.2f} s of CPU beyond numpy's {least[0]:.2f} s")


def main() -> None:
    """Print all."""
    given = [int(word) for word in sys.argv[1:]]
    hinges, last, links = [*given, *(300, 40, 1000)[len(given) :]]
    compiler = subprocess.run(["cc", "--version"], check=True, capture_output=True, text=True).stdout.splitlines()[0]
    print(f"multibody_sym {version('multibody-sym')}, Python {platform.python_version()}, NumPy {np.__version__}")
    print(compiler)
    with tempfile.TemporaryDirectory() as cache:
        os.environ["XDG_CACHE_HOME"] = cache
        resolved = prepare_system(chain(2, 1, named=False)).mechanism
        load(programs(resolved, FORMALISMS["block_ldl"]).as_mapping(), Native(backend="c"))
        for count in (3, hinges):
            unlike_numbers(count)
        rows_of_windows([max(2, last // 4), max(3, last // 2), last])
        for count in (1, last):
            unlike_windows(count)
        warm(links, Path(cache))


if __name__ == "__main__":
    main()
