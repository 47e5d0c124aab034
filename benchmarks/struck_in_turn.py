"""Fifty unequal balls on a line between walls for 10 s: located impacts, and contact forces at their best error.

    python benchmarks/struck_in_turn.py [seconds]

Every impact bounces with e = 1, then 0.95. The exact motion goes from impact to impact in fractions of 60 digits. Per
tool: the largest error of a ball's place at the end (m) and CPU seconds; of each the most accurate of several settings
that take at most so many seconds (default 60), and its CPU time over ours. Ours includes all decisions at impacts, once
with building the model and once without, each the mean of ten runs, which take too little time for one; code is
compiled before. Of the others only the steps count: their balls press
into each other over a time that takes several steps to resolve, and later impacts magnify what that moves them some
hundred times.

- MuJoCo: contacts with `solref` as stiffness and damping of an acceleration, so that e does not depend on masses.
- Exudyn: `ObjectContactSphereSphere` with a linear spring and, for e < 1, the damping that gives e; explicit RK44.

What is not installed (the extra `peers`) is left out with a line.
"""

from __future__ import annotations

import importlib.util
import math
import sys
import time
from collections.abc import Callable, Iterator
from fractions import Fraction
from importlib.metadata import version
from itertools import pairwise, product
from typing import Any

import numpy as np

import multibody_sym as mbs

COUNT, SIZE, END = 50, 0.5, 10.0
RNG = np.random.default_rng(1)
MASSES: list[float] = (10 ** RNG.uniform(-0.5, 0.5, COUNT)).tolist()
SPEEDS: list[float] = RNG.normal(size=COUNT).tolist()
STARTS = [k + 0.5 for k in range(COUNT)]
Result = tuple[float, float, str]
"""Error (m), CPU seconds, setting."""


def model(e: float) -> str:
    """Return our model file."""
    lines = ["multibody_sym: 1", "name: struck_in_turn", "gravity: [0, 0, 0]", "bodies:"]
    walls = f"left: {{plane: [0, 0, 0], normal: x}}, right: {{plane: [{COUNT}, 0, 0], normal: -x}}"
    lines.append(f"  ground: {{surfaces: {{{walls}}}}}")
    skin = f"surfaces: {{skin: {{sphere: {SIZE / 2}}}}}"
    lines += [f"  b{k}: {{mass: {m!r}, {skin}}}" for k, m in enumerate(MASSES)]
    lines.append("joints:")
    for k, (x, u) in enumerate(zip(STARTS, SPEEDS, strict=True)):
        start = f"initial: {{q: {x!r}, u: {u!r}}}"
        lines.append(f"  j{k}: {{type: prismatic, parent: ground, child: b{k}, axis: x, q: x{k}, {start}}}")
    pairs = [("b0.skin", "ground.left"), (f"b{COUNT - 1}.skin", "ground.right")]
    pairs += [(f"b{k + 1}.skin", f"b{k}.skin") for k in range(COUNT - 1)]
    lines.append("contacts:")
    lines += [f"  c{k}: {{between: [{a}, {b}], restitution: {e}}}" for k, (a, b) in enumerate(pairs)]
    return "\n".join(lines) + "\n"


def exact(e: float) -> np.ndarray:
    """Return the places (COUNT,) at the end, from impact to impact."""
    x, v, m = ([Fraction(y) for y in values] for values in (STARTS, SPEEDS, MASSES))
    left, ratio, half = Fraction(END), Fraction(e), Fraction(SIZE) / 2
    while True:
        gaps = [x[0] - half, *(b - a - 2 * half for a, b in pairwise(x)), COUNT - x[-1] - half]
        rates = [v[0], *(b - a for a, b in pairwise(v)), -v[-1]]
        wait, k = min((g / -r, k) for k, (g, r) in enumerate(zip(gaps, rates, strict=True)) if r < 0)
        x = [a + b * min(wait, left) for a, b in zip(x, v, strict=True)]
        if wait >= left:
            return np.array([float(a) for a in x])
        left -= wait
        if k in (0, COUNT):
            v[k - (k == COUNT)] *= -ratio
        else:
            p = (1 + ratio) * (v[k - 1] - v[k]) / (1 / m[k - 1] + 1 / m[k])
            v[k - 1], v[k] = v[k - 1] - p / m[k - 1], v[k] + p / m[k]
        x, v = ([Fraction(round(y * 10**60), 10**60) for y in values] for values in (x, v))


def damping(e: float) -> float:
    """Return the part of critical damping with which half a swing ends with e of its speed."""
    loss = -math.log(e)
    return loss / math.hypot(loss, math.pi)


def measured(run: Callable[[], np.ndarray], wanted: np.ndarray, setting: str, times: int = 1) -> Result:
    """Return the error and the mean CPU time of a run that returns the places at the end."""
    begin = time.process_time()
    for _ in range(times):
        places = run()
    return float(np.abs(places - wanted).max()), (time.process_time() - begin) / times, setting


def ours(e: float, wanted: np.ndarray) -> Iterator[Result]:
    """Yield the run of this package."""

    def places(trajectory: mbs.Trajectory) -> np.ndarray:
        return np.array([trajectory[f"x{k}"][-1] for k in range(COUNT)])

    def run() -> np.ndarray:
        return places(mbs.simulate(mbs.loads(model(e)), t_end=END, samples=2))

    prepared = mbs.prepare(mbs.loads(model(e)), t_end=END, samples=2)
    run()
    yield measured(run, wanted, "located impacts, with building the model", 10)
    places(prepared.run())
    yield measured(lambda: places(prepared.run()), wanted, "located impacts, of a prepared run", 10)


def mujocos(e: float, wanted: np.ndarray) -> Iterator[Result]:
    """Yield runs of MuJoCo by step and by how many of them a contact lasts."""
    import mujoco

    for step, lasts in product((1e-3, 1e-4, 1e-5, 1e-6), (10, 30, 100)):
        rate = math.pi / (lasts * step)
        solref = f"{-(rate**2)!r} {-2 * damping(e) * rate!r}"
        contact = f'solref="{solref}" solimp=".9999 .9999 .001 .5 2" condim="1"'
        balls = "".join(
            f'<body pos="{x} 0 0"><joint type="slide" axis="1 0 0"/>'
            f'<geom type="sphere" size="{SIZE / 2}" mass="{m!r}" {contact}/></body>'
            for x, m in zip(STARTS, MASSES, strict=True)
        )
        xml = f"""<mujoco><option gravity="0 0 0" timestep="{step!r}" tolerance="0"><flag refsafe="disable"/></option>
          <worldbody><geom type="plane" size="9 9 1" euler="0 90 0" {contact}/>
          <geom type="plane" size="9 9 1" pos="{COUNT} 0 0" euler="0 -90 0" {contact}/>{balls}</worldbody></mujoco>"""
        world = mujoco.MjModel.from_xml_string(xml)

        def run(world: Any = world, step: float = step) -> np.ndarray:
            data = mujoco.MjData(world)
            data.qvel[:] = SPEEDS
            for _ in range(round(END / step)):
                mujoco.mj_step(world, data)
            return np.array(data.qpos) + STARTS

        yield measured(run, wanted, f"Euler, step {step:.0e} s, contacts last {lasts} steps")


def exudyns(e: float, wanted: np.ndarray) -> Iterator[Result]:
    """Yield runs of Exudyn by step and by how many of them the contact of the lightest balls lasts."""
    import exudyn as exu
    from exudyn import itemInterface

    for step, lasts in product((1e-3, 1e-4, 1e-5), (8, 20)):
        stiffness = (math.pi / (lasts * step)) ** 2 * min(MASSES) / 2
        system = exu.SystemContainer().AddSystem()
        nodes, markers = [], []
        for x, u, m in zip(STARTS, SPEEDS, MASSES, strict=True):
            node = itemInterface.NodePoint(referenceCoordinates=[x, 0, 0], initialVelocities=[u, 0, 0])
            nodes.append(system.AddNode(node))
            system.AddObject(itemInterface.ObjectMassPoint(mass=m, nodeNumber=nodes[-1]))
            markers.append(system.AddMarker(itemInterface.MarkerNodePosition(nodeNumber=nodes[-1])))
        for x in (-SIZE / 2, COUNT + SIZE / 2):
            wall = system.AddObject(itemInterface.ObjectGround(referencePosition=[x, 0, 0]))
            markers.append(system.AddMarker(itemInterface.MarkerBodyPosition(bodyNumber=wall)))
        order = [markers[-2], *markers[:-2], markers[-1]]
        inverse = [0.0, *(1 / m for m in MASSES), 0.0]
        for k, pair in enumerate(pairwise(order)):
            rate = 2 * damping(e) * math.sqrt(stiffness / (inverse[k] + inverse[k + 1]))
            memory = system.AddNode(
                itemInterface.NodeGenericData(numberOfDataCoordinates=4, initialCoordinates=[0, 0, 0, 0])
            )
            system.AddObject(
                itemInterface.ObjectContactSphereSphere(
                    markerNumbers=list(pair),
                    nodeNumber=memory,
                    spheresRadii=[SIZE / 2] * 2,
                    contactStiffness=stiffness,
                    contactDamping=rate,
                    contactStiffnessExponent=1,
                    impactModel=0,
                )
            )
        system.Assemble()
        settings = exu.SimulationSettings()
        settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = END, round(END / step)
        settings.solution.file.write = False

        def run(system: Any = system, settings: Any = settings, nodes: list[int] = nodes) -> np.ndarray:
            try:
                system.SolveDynamic(settings, solverType=exu.DynamicSolverType.RK44)
            except exu.SolverError:
                return np.full(COUNT, math.inf)
            position = exu.OutputVariableType.Position
            return np.array([system.GetNodeOutput(node, position)[0] for node in nodes])

        yield measured(run, wanted, f"RK44, step {step:.0e} s, contacts last {lasts} steps")


def told(result: Result) -> None:
    """Print a run."""
    print(f"    {result[2]:44} error {result[0]:.2e} m  {result[1]:8.3f} s", flush=True)


def best(results: Iterator[Result], limit: float) -> Result:
    """Return the most accurate run up to the first one that takes longer than a limit, and print all."""
    kept = (math.inf, math.inf, "none")
    for result in results:
        told(result)
        kept = min(kept, result, key=lambda one: one[0])
        if result[1] > limit / 3:
            break
    return kept


def main(limit: float) -> None:
    """Print all runs for each coefficient."""
    for e in (1.0, 0.95):
        wanted = exact(e)
        print(f"--- e = {e:g}\nmultibody_sym")
        own, prepared = ours(e, wanted)
        for each in (own, prepared):
            told(each)
        for name, runs in (("mujoco", mujocos), ("exudyn", exudyns)):
            if importlib.util.find_spec(name) is None:
                print(f"{name} is not installed: pip install multibody-sym[peers]")
                continue
            print(f"{name} {version(name)}")
            error, spent, setting = best(runs(e, wanted), limit)
            ratios = f"{spent / own[1]:.3g} times our CPU time, {spent / prepared[1]:.3g} times that of a prepared run"
            print(f"    best: {setting}, error {error:.2e} m: {ratios}")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)
