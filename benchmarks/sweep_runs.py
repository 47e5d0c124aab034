"""What a run of a study costs beside its loop, and against scipy's integrators on sympy's functions.

    python benchmarks/sweep_runs.py [samples of the comparison with scipy]

The double pendulum of two point masses, its upper mass varied. CPU time of the thread; `loop` is what passes inside the
C function of the same run. Where others use the machine a run costs more beside its loop, so minima are told:
of single runs, and of parts of a sweep.

- run: `prepared.run` of 10 s with two samples.
- sweep: rows of `sweep(reduce=...)` on one core, checkpoints written; the same computed now as a part of 1,000 runs.
- scipy: 1 s from rest, at the loosest tolerances at which the largest error against runs at 1e-13 is no more than ours.
"""

from __future__ import annotations

import hashlib
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

import multibody_sym as mbs
from multibody_sym.motion.simulate import Prepared
from multibody_sym.motion.sweep.rows import open_journal
from multibody_sym.motion.sweep.study import Task

MODEL = Path(__file__).parents[1] / "examples" / "double_pendulum.yaml"
MASSES = (1.0, 2.0)
ROUNDS = 300
SHORT: dict[str, Any] = {"t_end": 1, "samples": 2, "method": "dormand_prince_8", "rtol": 1e-9}
"""The runs of 1 s: by the method of order 8, as scipy's DOP853."""


class Loop:
    """A library whose integration loop is timed, of one run or of many: `spent` is the CPU time (s) inside it."""

    def __init__(self, library: Any) -> None:
        self.library, self.spent = library, 0.0

    def __getattr__(self, name: str) -> Any:
        return getattr(self.library, name)

    def mbs_integrate(self, *given: Any) -> Any:
        return self._timed(self.library.mbs_integrate, given)

    def mbs_integrate_each(self, *given: Any) -> Any:
        return self._timed(self.library.mbs_integrate_each, given)

    def _timed(self, function: Callable[..., Any], given: Any) -> Any:
        begin = time.thread_time()
        done = function(*given)
        self.spent += time.thread_time() - begin
        return done


def watched(prepared: Prepared, **values: Any) -> Loop:
    """Let the loop of a prepared system's runs be timed."""
    function = prepared.run(**values).ready.compiled["state_derivative"]
    found = Loop(function.library)
    object.__setattr__(function, "library", found)
    return found


def least(work: Callable[[], Any], loop: Loop, rounds: int = ROUNDS) -> tuple[float, float]:
    """Return the CPU time (s) of the round that took least beside its loop, and that of its loop."""
    found = []
    for _ in range(rounds):
        loop.spent, begin = 0.0, time.thread_time()
        work()
        found.append((time.thread_time() - begin, loop.spent))
    return min(found, key=lambda pair: pair[0] - pair[1])


def of_a_run(system: mbs.System) -> None:
    """Print what a run costs beside its loop."""
    for label, values in (("as declared", {}), ("m1 = 1.5", {"parameters": {"m1": 1.5}})):
        prepared = mbs.prepare(system, t_end=10, samples=2)
        loop = watched(prepared, **values)
        whole, inside = least(lambda p=prepared, v=values: p.run(**v), loop)
        print(f"run, {label}: {1e3 * whole:.4f} ms, loop {1e3 * inside:.4f}, beside it {1e3 * (whole - inside):.4f} ms")


def of_a_sweep(system: mbs.System) -> None:
    """Print what rows cost with all that is done for them, written to a journal."""
    asked = mbs.prepare(system, t_end=10, samples=2)
    plan = mbs.sweep(asked.system, {"m1": (*MASSES, 1000)}, sample=None, t_end=1e-3, reduce=ends).plan
    task = Task(asked, plan, ends)
    loop = watched(task.prepared, parameters={"m1": 1.5})
    with tempfile.TemporaryDirectory() as folder:
        for size in (1, 32, 320):
            journal = open_journal(f"{folder}/{size}", task.key, ROUNDS * 320)
            work = lambda n=size, kept=journal: kept.add(replace(task.rows(0, n), first=len(kept)))  # noqa: E731
            whole, inside = least(work, loop, max(10, ROUNDS // size))
            told = f"{whole / inside:.3f} loops, {1e6 * (whole - inside) / size:.1f} us a run beside it"
            print(f"sweep, parts of {size}: {told}")
            journal.close()


def ends(run: mbs.Trajectory) -> dict[str, float]:
    """Return what is kept of a run."""
    return {"theta1": run["theta1"][-1], "theta2": run["theta2"][-1]}


# --- against scipy ---------------------------------------------------------------------------------------------------


def functions(system: mbs.System) -> Callable[..., Any]:
    """Return (t, x, m1, m2, l1, l2, g) -> x', made by sympy's LagrangesMethod and lambdify, as its manual does."""
    import sympy
    from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

    m1, m2, l1, l2, g = sympy.symbols("m1 m2 l1 l2 g")
    a, b = dynamicsymbols("a b")
    t = dynamicsymbols._t
    x1, y1 = l1 * sympy.sin(a), -l1 * sympy.cos(a)
    x2, y2 = x1 + l2 * sympy.sin(a + b), y1 - l2 * sympy.cos(a + b)
    kinetic = sum(m / 2 * (x.diff(t) ** 2 + y.diff(t) ** 2) for m, x, y in ((m1, x1, y1), (m2, x2, y2)))
    method = LagrangesMethod(kinetic - g * (m1 * y1 + m2 * y2), [a, b])
    method.form_lagranges_equations()
    state = [a, b, a.diff(t), b.diff(t)]
    names = dict(zip(state, sympy.symbols("x0:4"), strict=True))
    right = sympy.Matrix.vstack(sympy.Matrix(state[2:]), method.mass_matrix.LUsolve(method.forcing))
    right = right.subs(dict(reversed(list(names.items())))).subs(names)
    found = sympy.lambdify([*names.values(), m1, m2, l1, l2, g], list(right), cse=True)
    return lambda _t, x, *values: found(*x, *values)


def against_scipy(system: mbs.System, count: int) -> None:
    """Print the CPU time of runs of 1 s against scipy's, at equal error."""
    from scipy.integrate import solve_ivp

    masses = np.linspace(*MASSES, 10_000)
    probe = masses[:: len(masses) // count]
    right, x0 = functions(system), [np.pi / 2, 0.0, 0.0, 0.0]
    exact = ends_of(system, probe, rtol=1e-13)
    begin = time.process_time()
    ours = mbs.sweep(system, {"m1": masses.tolist()}, **SHORT, reduce=ends, workers=1)
    own = (time.process_time() - begin) / len(masses)
    both = np.column_stack([ours["theta1"], ours["theta2"]])[:: len(masses) // count]
    error = np.abs(both - exact).max()
    print(f"ours: {1e3 * own:.4f} ms a run of 1 s, error {error:.1e}")
    for method in ("DOP853", "LSODA"):
        for rtol in 10.0 ** -np.arange(4, 14, 0.5):
            begin = time.process_time()
            found = [
                solve_ivp(right, (0, 1), x0, method, args=(m, 1.0, 1.0, 1.0, 9.81), rtol=rtol, atol=rtol / 10).y[:2, -1]
                for m in probe
            ]
            spent = (time.process_time() - begin) / len(probe)
            missed = np.abs(np.array(found) - exact).max()
            if missed <= error or rtol < 2e-13:
                break
        print(f"{method} at {rtol:.0e}: {1e3 * spent:.3f} ms, error {missed:.1e}: {spent / own:.0f} times ours")


def ends_of(system: mbs.System, masses: Any, rtol: float) -> Any:
    """Return the angles at the end of 1 s."""
    found = mbs.sweep(system, {"m1": masses.tolist()}, t_end=1, samples=2, rtol=rtol, reduce=ends)
    return np.column_stack([found["theta1"], found["theta2"]])


def same_bits(system: mbs.System) -> None:
    """Print the wall time and the bits of 10,000 runs of 1 s by one and two threads, processes and Dask's workers."""
    values = {**SHORT, "reduce": ends}
    vary = {"m1": (*MASSES, 10_000)}
    found = {}
    for workers in (1, 2):
        begin = time.perf_counter()
        found[f"{workers} threads"] = mbs.sweep(system, vary, workers=workers, **values), time.perf_counter() - begin
    with ProcessPoolExecutor(2) as pool:
        begin = time.perf_counter()
        found["2 processes"] = mbs.sweep(system, vary, executor=pool, **values), time.perf_counter() - begin
    try:
        import distributed
    except ImportError:
        distributed = None
    if distributed is not None:
        cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
        with cluster, distributed.Client(cluster) as client:
            begin = time.perf_counter()
            done = mbs.sweep(system, vary, executor=client.get_executor(), **values)
            found["2 workers of Dask"] = done, time.perf_counter() - begin
    for name, (study, seconds) in found.items():
        bits = hashlib.sha256(study["theta1"].tobytes() + study["theta2"].tobytes()).hexdigest()[:12]
        print(f"10,000 runs of 1 s, {name}: {seconds:.2f} s, bits {bits}")


def main() -> None:
    """Print all."""
    print(f"multibody_sym {version('multibody-sym')}, Python {sys.version.split()[0]}, NumPy {np.__version__}")
    system = mbs.load(MODEL)
    of_a_run(system)
    of_a_sweep(system)
    against_scipy(system, int(sys.argv[1]) if len(sys.argv) > 1 else 20)
    same_bits(system)


if __name__ == "__main__":
    main()
