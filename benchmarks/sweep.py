"""The sweep against block L^T D L on chains of joints with three freedoms, a step of Stoermer's method of order 6.

    python benchmarks/sweep.py [bodies ...]

One step is one evaluation of the accelerations, kinematics included, and the update of coordinates and speeds. Joints
are ball joints by three angles, all numbers symbols (13 a body, as in chains.py). The routes:

- plain: the sweep as first published, V inverted, all 36 elements; what is zero or one by structure is not computed.
- dense: the same in 6 x 6 loops, which multiply by those zeros and ones too.
- sweep: V factorised, one triangle of each inertia.
- block: block L^T D L.

Operations are those of the Program; times those of C (cc -O2), for many states in turn by a loop in C, CPU time of the
thread, minimum of interleaved rounds. `x/block` is the ratio to block L^T D L. Linear in the number of bodies: the last
column is the slope of log(operations) against log(bodies) since the row before.

The source (Shimanovskii, 2017) has L^T D L 1.6 to 2 times faster than a sweep that ignores symmetry. That is the
ratio of `plain`: the gain of symmetry alone. Loops that multiply by the zeros of C and A too (`dense`) are slower yet.
Beside a sweep that forms one triangle what is left are the substitutions with V for the six rows of its gains, and the
rows and columns that block L^T D L knows to vanish.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from importlib.metadata import version
from math import comb
from typing import Any

import numpy as np
from chains import INERTIA
from plain_sweep import Link, Matrix, links, plain_sweep, swept

from multibody_sym.dynamics.formalisms.articulated_body import TreeFactors, block_ldl, swept_joints
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.mechanics.alignment import economical_motion
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import arrays, slot_state
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body
from multibody_sym.model.joints import Spherical
from multibody_sym.model.system import System
from multibody_sym.program.backend import Native
from multibody_sym.program.loading import load
from multibody_sym.program.program import Program, operation_count
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.node import Node, as_node, slot

ROUNDS = 7
STATES = 100
POSITION = (1, 0, 1 / 12, 1 / 12, 19 / 240, 3 / 40)
SPEED = (1 / 2, 1 / 3, 7 / 24, 97 / 360, 367 / 1440)
"""Factors of the backward differences D0, D1, ... of the accelerations in the update of q and of qdot."""


def chain(count: int) -> Mechanism:
    """Return a chain of bodies with ball joints."""
    parameters: dict[str, float] = {}
    bodies, joints = {}, {}
    for k in range(count):
        values = dict(zip(("m", "cx", "cy", "cz", *INERTIA, "px", "py", "pz"), NUMBERS, strict=True))
        parameters.update({f"{key}{k}": value for key, value in values.items()})
        bodies[f"body{k}"] = Body(
            mass=f"m{k}",
            com=[f"cx{k}", f"cy{k}", f"cz{k}"],
            inertia={key: f"{key}{k}" for key in INERTIA},
            points={"end": [f"px{k}", f"py{k}", f"pz{k}"]},
        )
        joints[f"joint{k}"] = Spherical(f"body{k - 1}.end" if k else "ground", f"body{k}", angles="zyx")
    return mechanism(System("chain", gravity=[0, 0, -9.81], parameters=parameters, bodies=bodies, joints=joints))


NUMBERS = (1.2, 0.4, 0.1, -0.1, 0.1, 0.2, 0.25, 0.01, 0.02, -0.01, 0.9, 0.1, 0.05)


# --- the routes ----------------------------------------------------------------------------------------------------


def factorised(resolved: Mechanism) -> Sequence[Any]:
    """Return the accelerations of the sweep."""
    state = slot_state(resolved)
    motion = economical_motion(resolved, state)
    return TreeFactors(motion, swept_joints(motion)).solve(composite_body(resolved, state).forcing)


def block(resolved: Mechanism) -> Sequence[Any]:
    """Return the accelerations of block L^T D L."""
    return block_ldl(resolved, slot_state(resolved)).bias_acceleration


def plain(resolved: Mechanism) -> Sequence[Any]:
    """Return the accelerations of the plain sweep."""
    return plain_sweep(economical_motion(resolved, slot_state(resolved)))[0]


def dense(resolved: Mechanism) -> Sequence[Any]:
    """Return the same, every zero and one of A, C and M a value of its own."""
    tree = [opaque(link, k) for k, link in enumerate(links(economical_motion(resolved, slot_state(resolved))))]
    return [rate for part in swept(tree)[0] for (rate,) in part]


OPAQUE = 128


def opaque(link: Link, number: int) -> Link:
    """Return a link whose constants are inputs."""
    taken = iter(range(OPAQUE * number, OPAQUE * (number + 1)))

    def hidden(matrix: Matrix) -> Matrix:
        return [[slot("opaque", next(taken)) if as_node(x).shadow is not None else x for x in row] for row in matrix]

    return replace(
        link, inertia=hidden(link.inertia), carrier=hidden(link.carrier), freedoms=hidden(link.freedoms),
        drives=hidden(link.drives),
    )


ROUTES = {"plain": plain, "dense": dense, "sweep": factorised, "block": block}


# --- a step --------------------------------------------------------------------------------------------------------


def step(resolved: Mechanism, accelerations: Sequence[Any]) -> Program:
    """Return the Program of a step: next q and u from q, u, the step h, the q before and five earlier accelerations."""
    count = len(resolved.speeds)
    memory = Array("before", (count,)), Array("earlier", (5 * count,)), Array("h", ())
    opaque_inputs = Array("opaque", (OPAQUE * len(resolved.bodies),))
    trace = Trace("step", (*arrays(resolved), *memory, opaque_inputs))
    (h,) = trace["h"]
    q, u = [], []
    for k, now in enumerate(accelerations):
        history = [now, *trace["earlier"][5 * k : 5 * k + 5]]
        here, before = trace["q"][k], trace["before"][k]
        new = 2 * here - before + h * h * weighted(POSITION, history)
        q.append(new)
        u.append((new - here) / h + h * weighted(SPEED, history))
    return trace.finish({"q": ((count,), q), "u": ((count,), u), "now": ((count,), accelerations)})


def weighted(factors: Sequence[float], history: Sequence[Node]) -> Node:
    """Return the sum of factors[k] Dk, the backward differences gathered by acceleration."""
    total = as_node(0)
    for j, value in enumerate(history):
        factor = sum((-1) ** j * comb(k, j) * x for k, x in enumerate(factors) if k >= j)
        total = total + factor * value if factor else total
    return total


def timed(programs: Sequence[Program]) -> list[float]:
    """Return the seconds of one step of each Program."""
    rng = np.random.default_rng(0)
    calls = []
    for program in programs:
        given = [rng.uniform(-0.5, 0.5, (STATES, *array.shape)) for array in program.inputs]
        given[3] = np.tile(NUMBERS, given[3].shape[1] // len(NUMBERS))
        given[-1] = np.zeros_like(given[-1])
        calls.append((load({"step": program}, Native(backend="c")), given))
    best = [math.inf] * len(calls)
    for _ in range(ROUNDS):
        for k, (compiled, given) in enumerate(calls):
            start = time.thread_time()
            compiled.map("step", *given)
            best[k] = min(best[k], (time.thread_time() - start) / STATES)
    return best


def rows(counts: Sequence[int]) -> Iterator[str]:
    """Yield the rows of the table."""
    last: tuple[int, int] | None = None
    for count in counts:
        resolved = chain(count)
        programs = [step(resolved, route(resolved)) for route in ROUTES.values()]
        operations = [operation_count(program).total for program in programs]
        seconds = timed(programs)
        ratios = [n / operations[-1] for n in operations[:-1]], [s / seconds[-1] for s in seconds[:-1]]
        slope = math.log(operations[-1] / last[1]) / math.log(count / last[0]) if last else math.nan
        yield (
            f"{count:6} {operations[-1]:10} " + " ".join(f"{x:7.2f}" for x in ratios[0])
            + f"  {1e6 * seconds[-1]:9.2f} " + " ".join(f"{x:7.2f}" for x in ratios[1]) + f"  {slope:6.3f}"
        )
        last = count, operations[-1]


def main() -> None:
    """Print the table."""
    print(f"multibody_sym {version('multibody-sym')}, Python {sys.version.split()[0]}, NumPy {np.__version__}")
    named = " ".join(f"{name:>7}" for name in list(ROUTES)[:-1])
    print("                       operations, x/block                 time, x/block")
    print(f"bodies      block {named}   block us {named}   slope")
    for row in rows([int(word) for word in sys.argv[1:]] or [10, 30, 100]):
        print(row, flush=True)


if __name__ == "__main__":
    main()
