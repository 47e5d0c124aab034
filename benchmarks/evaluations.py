"""One evaluation of a mode, derivative and switching values: a ladder, a robot on four feet, 12 discs in a box.

    python benchmarks/evaluations.py [--rounds N] [WORD ..]

Each row is a mode in which a run of the model begins, with the elements that are closed and the rows that act. An
evaluation is a call of `inputs`, `state_derivative` and `events` of the compiled library from a loop in C, at many
states about the start in turn. Printed are microseconds of CPU, and the ratio to a fixed piece of C (the L D L^T
factors of a 12 x 12 matrix) that the same library runs in turn with it: other programs on the machine slow down both.
The least time, and the median of the ratios, of interleaved rounds. Needs example-robot-data (extra `peers`).
"""

from __future__ import annotations

import argparse
import ctypes
import dataclasses
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from robots import ROBOTS, path_of

import multibody_sym as mbs
from multibody_sym.motion.loop.native_loop import NativeProblem
from multibody_sym.motion.switching.legs import ModeLeg
from multibody_sym.program.loading import find_compiler
from multibody_sym.program.target_layout import runtime_files

SECONDS = 0.01
EXAMPLES = Path(__file__).parent.parent / "examples"
SOURCE = """
#include "runtime.h"

void evaluate(const mbs_system *s, double t, long long calls, int states, const double *x, double *inputs, double *out)
{
    double *qdot = out, *udot = qdot + s->nq, *forces = udot + s->nu, *report = forces + s->ns, *values = report + 3;
    double *const found[4] = {qdot, udot, forces, report};
    int n = s->nq + s->nu;
    for (long long k = 0; k < calls; ++k) {
        const double *at = x + (k % states) * n;
        const double *in[7] = {&t, at, at + s->nq, s->parameters, inputs, s->modes, forces};
        if (s->inputs)
            s->inputs->call(in, &inputs);
        s->state_derivative->call(in, found);
        if (s->events)
            s->events->call(in, &values);
    }
}

double fixed_piece(long long calls)
{
    enum { N = 12 };
    double a[N][N], sum = 0.0;
    for (long long k = 0; k < calls; ++k) {
        for (int i = 0; i < N; ++i)
            for (int j = 0; j < N; ++j)
                a[i][j] = 1.0 / (1.0 + i + j) + (i == j) + 1e-9 * (double)(k & 7);
        for (int i = 0; i < N; ++i)
            for (int j = i + 1; j < N; ++j) {
                double factor = a[j][i] / a[i][i];
                for (int l = j; l < N; ++l)
                    a[l][j] -= factor * a[l][i];
            }
        sum += a[N - 1][N - 1];
    }
    return sum;
}
"""


# ----------------------------------------------------------------------------------------------------------------------
# Models, each with the state in which the mode of a row begins.


def ladder(mu: float) -> mbs.System:
    """Return the ladder of the textbook with a coefficient of friction at its foot."""
    system = mbs.load(EXAMPLES / "textbook" / "ladder.yaml")
    return dataclasses.replace(system, parameters={**system.parameters, "mu": mu})


_BENT = {"HAA": (0.0, 0.0), "HFE": (0.4, -0.4), "KFE": (-0.8, 0.8)}
"""Angles (rad) of hinges of front and hind legs."""
STANDING = {"base_z": 0.52}
STANDING |= {f"{leg}_{hinge}": _BENT[hinge][leg[1] == "H"] for leg in ("LF", "RF", "LH", "RH") for hinge in _BENT}
"""Where the robot begins: m and rad."""


def robot() -> mbs.System:
    """Return ANYmal, its hinges held by springs and dampers, above a floor on which its feet land and slide first."""
    path = next(path_of(one) for one in ROBOTS if one.name.startswith("ANYmal"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", mbs.UrdfNotice)
        system = mbs.load_urdf(path, floating=True, damping=False)
    drives = {
        f"drive_{name}": mbs.Torque(joint=name, value=150 * (x - mbs.variable(name)) - 8 * mbs.variable(f"u_{name}"))
        for name, x in STANDING.items()
        if name in system.joints
    }
    ground = mbs.Body(surfaces={"floor": mbs.Surface(plane=[0, 0, 0], normal="z")})
    feet = [name for name in system.bodies if name.endswith("FOOT")]
    contacts = {f"c{foot}": mbs.Contact([foot, "ground.floor"], static=0.7, kinetic=0.6) for foot in feet}
    bodies = {**system.bodies, "ground": ground}
    return dataclasses.replace(system, forces=drives, bodies=bodies, contacts=contacts)


def discs(places: Sequence[Sequence[float]], spins: Sequence[float], gravity: Sequence[float]) -> mbs.System:
    """Return discs in a box, each at a place (x, y) with a spin (rad/s): three walls, and all pairs of discs."""
    walls = {
        "floor": mbs.Surface(plane=[0, 0, 0], normal="y"),
        "left": mbs.Surface(plane=[-2, 0, 0], normal="x"),
        "right": mbs.Surface(plane=[2, 0, 0], normal="-x"),
    }
    bodies, joints, contacts = {"ground": mbs.Body(surfaces=walls)}, {}, {}
    law = {"static": 0.3, "kinetic": 0.3, "restitution": 0.5}
    for i, ((x, y), spin) in enumerate(zip(places, spins, strict=True)):
        bodies[f"b{i}"] = mbs.Body(mass=1, inertia={"Izz": 0.016}, surfaces={"rim": mbs.Surface(disc=0.2)})
        initial = {"q": [x, y, 0], "u": [0, 0, spin]}
        joints[f"j{i}"] = mbs.Planar("ground", f"b{i}", q=[f"x{i}", f"y{i}", f"t{i}"], initial=initial)
        contacts |= {f"c{i}_{wall}": mbs.Contact([f"b{i}.rim", f"ground.{wall}"], **law) for wall in walls}
        contacts |= {f"c{i}_{k}": mbs.Contact([f"b{i}.rim", f"b{k}.rim"], **law) for k in range(i)}
    return mbs.System("discs", gravity=gravity, bodies=bodies, joints=joints, contacts=contacts)


FLIGHT = [(-1.5 + i % 5 * 0.7, 0.5 + i // 5 * 0.5) for i in range(12)]
TOWER = [(0.0, 0.2 + 0.4 * i) for i in range(12)]
GRID = [(-1.8 + 0.4 * (i % 4), 0.2 + 0.4 * (i // 4)) for i in range(12)]
STILL, SPINS = [0.0] * 12, [(-1) ** i * (1 + 0.1 * i) for i in range(12)]
GRID_SPINS = [1 + 0.1 * i for i in range(12)]
DOWN, ASIDE = (0, -9.81, 0), (-4, -9.81, 0)


# ----------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Case:
    """A mode of a run: its model, until when it runs, how many elements are closed and rows act in the mode."""

    name: str
    system: Callable[[], mbs.System]
    until: float
    closed: int
    rows: int
    initial: dict[str, float] = field(default_factory=dict)


CASES = (
    Case("ladder, at rest", lambda: ladder(0.4), 1e-6, 2, 3),
    Case("ladder, foot sliding", lambda: ladder(0.2), 1e-6, 2, 2),
    Case("ANYmal, sliding on 4 feet", robot, 0.1, 4, 4, STANDING),
    Case("ANYmal, stuck on 4 feet", robot, 0.1, 4, 12, STANDING),
    Case("12 discs, in flight", lambda: discs(FLIGHT, STILL, DOWN), 1e-6, 0, 0),
    Case("12 discs, 12 sliding", lambda: discs(TOWER, SPINS, DOWN), 1e-6, 12, 12),
    Case("12 discs, 12 stuck", lambda: discs(TOWER, STILL, DOWN), 1e-6, 12, 24),
    Case("12 discs, 24 sliding", lambda: discs(GRID, GRID_SPINS, ASIDE), 1e-6, 24, 24),
    Case("12 discs, 24 stuck", lambda: discs(GRID, STILL, ASIDE), 1e-6, 24, 36),
)


def leg_of(case: Case) -> ModeLeg:
    """Return the first leg of a run in the mode of a case."""
    try:
        run = mbs.simulate(case.system(), t_end=case.until, samples=2, initial=case.initial, backend="c")
    except mbs.RunError as error:
        run = error.trajectory
    assert run.modes is not None
    wanted = case.closed, case.rows
    return next(leg for leg in run.modes.legs if (len(leg.program.active), len(leg.program.entered.rows)) == wanted)


def library() -> ctypes.CDLL:
    """Return the loops of `SOURCE`, compiled as the runtime is."""
    compiler = find_compiler()
    with tempfile.TemporaryDirectory() as place:
        for name, text in {**runtime_files(), "calls.c": SOURCE}.items():
            Path(place, name).write_text(text)
        command = [*compiler.command, *compiler.flags, "-shared", "calls.c", "-o", "calls.so"]
        subprocess.run(command, cwd=place, check=True)
        found = ctypes.CDLL(f"{place}/calls.so")
    found.fixed_piece.restype = ctypes.c_double
    found.evaluate.restype = None
    return found


class Evaluations:
    """Evaluations of a leg's mode at `states` states about its start, in a loop in C."""

    def __init__(self, loops: ctypes.CDLL, leg: ModeLeg, states: int = 16) -> None:
        self.native = NativeProblem(leg.problem)
        self._loops, self._time, self._states = loops, leg.problem.start, states
        x, rng = leg.problem.x0, np.random.default_rng(0)
        self._x = x * (1 + 1e-12 * rng.standard_normal((states, len(x))))
        self._inputs = np.zeros(leg.problem.inputs + 1)
        sizes = len(x), leg.problem.rows, 3, len(leg.problem.terminal)
        self._out = np.zeros(sum(sizes) + 1)

    def __call__(self, calls: int) -> None:
        arrays = (ctypes.c_void_p(x.ctypes.data) for x in (self._x, self._inputs, self._out))
        count = ctypes.c_longlong(calls), self._states
        self._loops.evaluate(self.native.structure.system, ctypes.c_double(self._time), *count, *arrays)


def seconds(call: Callable[[int], object], calls: int) -> float:
    """Return the CPU time of one of so many calls."""
    begun = time.process_time()
    call(calls)
    return (time.process_time() - begun) / calls


def calls_for(call: Callable[[int], object], duration: float) -> int:
    """Return how many calls take about so long (s)."""
    return max(1, int(duration / seconds(call, max(1, int(1e-3 / seconds(call, 100))))))


def main() -> None:
    """Print a row for each mode."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", help="words that names of rows contain; all rows if left out")
    parser.add_argument("--rounds", type=int, default=41)
    given = parser.parse_args()
    loops = library()

    def piece(calls: int) -> None:
        loops.fixed_piece(ctypes.c_longlong(calls))

    compiler = find_compiler().version().splitlines()[0]
    print(f"multibody_sym {mbs.__version__}, {compiler}, Python {sys.version.split()[0]}")
    print("| mode | rows | us | us over the fixed piece | fixed piece, us |\n|---|--:|--:|--:|--:|")
    for case in CASES:
        if given.cases and not any(word in case.name for word in given.cases):
            continue
        evaluations = Evaluations(loops, leg_of(case))
        calls = [calls_for(evaluations, SECONDS), calls_for(piece, SECONDS)]
        pairs = list(zip((evaluations, piece), calls, strict=True))
        rounds = [[seconds(*each) for each in pairs] for _ in range(given.rounds)]
        ours, theirs = (min(times) * 1e6 for times in zip(*rounds, strict=True))
        ratio = statistics.median(a / b for a, b in rounds)
        print(f"| {case.name} | {case.rows} | {ours:.2f} | {ratio:.2f} | {theirs:.3f} |", flush=True)


if __name__ == "__main__":
    main()
