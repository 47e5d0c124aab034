"""Functions of robots in CasADi and JAX against ours: how near they are, their operations, and batches of JAX.

    python benchmarks/other_tools.py

For UR5 and Panda with fingers, the largest differences over 20 states relative to the largest element: accelerations in
CasADi, and their derivatives by q, u and the torques by CasADi; the same in JAX by `jacfwd`, for UR5. Instructions of
CasADi's functions beside our operations. Then CPU time of accelerations of 10,000 states: `jax.vmap`, compiled as it is
and without fusion, over our batch; interleaved, minimum of rounds. Needs the extra `peers`.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from typing import Any

import casadi
import jax
import numpy as np
from robots import ROBOTS, Robot, path_of

import multibody_sym as mbs

MANY, NEAR, ROUNDS = 10_000, 20, 9
ALONE = {"xla_disable_hlo_passes": "cpu-fusion,fusion,cpu-instruction-fusion"}


def worst(found: Any, wanted: np.ndarray) -> float:
    """Return the largest difference relative to the largest element."""
    off = np.abs(np.array(found, dtype=float).reshape(wanted.shape) - wanted).max()
    return float(off / np.abs(wanted).max())


def measured(robot: Robot) -> None:
    """Print what there is of a robot."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", mbs.UrdfNotice)
        system = mbs.load_urdf(path_of(robot), damping=False, mimic=False, torques=True)
    f = mbs.function(system, "state_derivative")
    slopes, rng = f.with_derivatives("q", "u", "inputs", of="udot"), np.random.default_rng(0)
    size = f.shapes["udot"][0]
    q, (u, torques) = rng.uniform(-2, 2, (MANY, size)), rng.standard_normal((2, MANY, size))
    known = slopes(0.0, q[:NEAR], u[:NEAR], inputs=torques[:NEAR])
    in_casadi(robot.name, f, slopes, (q, u, torques), known)
    g = f.to_jax(inputs="free")
    if robot is ROBOTS[0]:
        jacobian = jax.jit(jax.vmap(jax.jacfwd(lambda *x: g(0.0, *x).udot, (0, 1, 2))))
        theirs = jacobian(q[:NEAR], u[:NEAR], torques[:NEAR])
        print(robot.name, "JAX, derivatives:", *(f"{worst(a, b):.0e}" for a, b in zip(theirs, known[1:], strict=True)))
    mapped = jax.vmap(f.to_jax(), (None, 0, 0))
    plain, alone = jax.jit(mapped), jax.jit(mapped, compiler_options=ALONE)
    calls = (
        lambda: f(0.0, q, u),
        lambda: jax.block_until_ready(plain(0.0, q, u)),
        lambda: jax.block_until_ready(alone(0.0, q, u)),
    )
    ours, *theirs = best(calls)
    print(robot.name, f"vmap over our batch ({ours:.2f} ms):", *(f"{each / ours:.1f}" for each in theirs), flush=True)


def in_casadi(name: str, f: Any, slopes: Any, given: tuple[np.ndarray, ...], known: Any) -> None:
    """Print how near CasADi's accelerations and derivatives are, and how long its functions are."""
    function = f.to_casadi(inputs="free")
    symbols = [casadi.SX.sym(word, given[0].shape[1]) for word in ("q", "u", "w")]
    udot = function(0.0, *symbols)[1]
    every = casadi.Function("every", symbols, [udot, *(casadi.jacobian(udot, x) for x in symbols)])
    found = [every(*(x[k] for x in given)) for k in range(NEAR)]
    parts = [np.array([each[k].full() for each in found]) for k in range(4)]
    print(name, "CasADi:", *(f"{worst(a, b):.0e}" for a, b in zip(parts, known, strict=True)))
    lengths = function.n_instructions(), f.operations.total, every.n_instructions(), slopes.operations.total
    print(name, "instructions of CasADi's, our operations; with derivatives:", *lengths)


def best(calls: tuple[Callable[[], object], ...]) -> list[float]:
    """Return the least CPU time of each call in ms, interleaved."""
    found = [float("inf")] * len(calls)
    for _ in range(ROUNDS):
        for k, call in enumerate(calls):
            begun = time.process_time()
            call()
            found[k] = min(found[k], (time.process_time() - begun) * 1e3)
    return found


if __name__ == "__main__":
    jax.config.update("jax_enable_x64", True)
    for each in ROBOTS[:2]:
        measured(each)
