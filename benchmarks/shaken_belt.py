"""A block on a shaken rough belt for 50 periods: located switches against smoothed friction, at the best error of each.

    python benchmarks/shaken_belt.py [seconds]

One coefficient of friction. The belt's largest acceleration is 3 times what friction gives (the block slides one way
and the other and never sticks) and 1.5 times (it sticks twice in each period). The exact motion is piecewise a parabola
or the belt's own, with switching times to rounding. Per tool: the largest error of the block's position at a thousand
times over the belt's amplitude, and CPU seconds; of each the most accurate of several settings that take at most so
many seconds (default 60), and its CPU time over that of this package at no larger an error. Ours is a run of a prepared
model that was run before, so that decisions at switches are verified, not searched for; its first run, and what
`mbs.simulate` takes with all that precedes it, are told too. Of the others only the steps count.

- scipy: LSODA on friction mu m g tanh(v / e), in speeds against the ground (v is then a difference that loses digits;
  smaller e than shown take many minutes), and in the speed relative to the belt, with the belt's inertia force.
- MuJoCo: a slide joint with `frictionloss` in the belt's frame, the inertia force at the middle of each step, and the
  stiffest friction it allows: impedance 0.9999 and what sticks slows down within one or two steps. Euler: its RK4 is
  of order 1 here too and takes four times the time; a contact that carries the weight adds its own errors.
- Exudyn: a belt of 1e8 kg on a spring and `CoordinateSpringDamperExt`: by DOPRI5 with a frictionProportionalZone
  (stiff: its time grows as the zone shrinks), and by its generalised alpha with bristles that are critically damped,
  which it recommends. Newton's tolerance is 1e-12: its own leaves the friction of so heavy a belt unbalanced.

What is not installed (the extra `peers`) is left out with a line.
"""

from __future__ import annotations

import importlib.util
import math
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import multibody_sym as mbs

MU, G, W, PERIODS = 0.3, 9.81, 4 * math.pi, 50
END = PERIODS * 2 * math.pi / W
TIMES = np.arange(1001) * END / 1000
HEAVY = 1e8
Result = tuple[float, float, str]
"""Error, CPU seconds, setting."""


@dataclass(frozen=True)
class Belt:
    """A belt whose largest acceleration is so many times what friction gives."""

    excess: float

    @property
    def amplitude(self) -> float:
        """Return it in m."""
        return self.excess * MU * G / W**2

    def place(self, times: np.ndarray) -> np.ndarray:
        """Return where the belt is, in m."""
        return np.asarray(self.amplitude * np.sin(W * times))

    @property
    def model(self) -> str:
        """Return our model file."""
        return f"""
multibody_sym: 1
name: shaken_belt
gravity: [0, -{G}, 0]
parameters: {{A: {self.amplitude!r}, w: {W!r}}}
bodies:
  block: {{mass: 1}}
  belt: {{mass: 1, surfaces: {{top: {{plane: [0, 0, 0], normal: y}}}}}}
joints:
  slide: {{type: point, parent: ground, child: block, q: [x, y], initial: {{u: [A*w, 0]}}}}
  shake: {{type: prismatic, parent: ground, child: belt, axis: x, motion: A*sin(w*t)}}
contacts:
  c: {{between: [block, belt.top], static: {MU}, kinetic: {MU}}}
"""


def exact(belt: Belt, times: np.ndarray) -> np.ndarray:
    """Return the block's positions at times."""
    a = belt.amplitude
    t, x, v, slip = 0.0, 0.0, a * W, 0.0
    pieces = []
    while t < END:
        if slip:
            t0, x0, v0 = t, x, v

            def gap(s: float, v0: float = v0, t0: float = t0, slip: float = slip) -> float:
                return slip * (v0 - slip * MU * G * (s - t0) - a * W * math.cos(W * s))

            places = t0 + np.linspace(1e-6, 1.0, 4001) * 2 * math.pi / W
            k = next(i for i, s in enumerate(places) if gap(s) < 0.0)
            end = brentq(gap, places[k - 1], places[k], xtol=1e-16, rtol=1e-15)
            half = slip * MU * G / 2
            pieces.append((t0, end, lambda s, x=x0, v=v0, t=t0, c=half: x + v * (s - t) - c * (s - t) ** 2))
            t, x, v = end, pieces[-1][2](end), a * W * math.cos(W * end)
            pull = -a * W * W * math.sin(W * end)
            slip = -math.copysign(1.0, pull) if abs(pull) > MU * G else 0.0
        else:
            phase, limit = W * t, math.asin(MU * G / (a * W * W))
            half = math.floor(phase / math.pi)
            end = (half * math.pi + limit) / W
            end = end if end > t else ((half + 1) * math.pi + limit) / W
            pieces.append((t, end, lambda s, x=x, t=t: x + a * (math.sin(W * s) - math.sin(W * t))))
            x, v, t = pieces[-1][2](end), a * W * math.cos(W * end), end
            slip = math.copysign(1.0, math.sin(W * end + 1e-9))
    found = [next(f(s) for a, b, f in pieces if a <= s <= b) for s in times]
    return np.array(found)


def measured(run: Callable[[], np.ndarray], belt: Belt, setting: str) -> Result:
    """Return the error and the CPU time of a run that returns positions at TIMES; infinite where it gives up."""
    begin = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        x = run()
    spent = time.process_time() - begin
    whole = len(x) == len(TIMES)
    return float(np.abs(x - exact(belt, TIMES)).max() / belt.amplitude) if whole else math.inf, spent, setting


# --- each tool's runs -------------------------------------------------------------------------------------------------


def ours(belt: Belt) -> Iterator[Result]:
    """Yield runs of this package by tolerance."""
    for rtol in (1e-3, 1e-5, 1e-7, 1e-9, 1e-11):

        fresh = [mbs.prepare(mbs.loads(belt.model), t_end=END, rtol=rtol, samples=1001) for _ in range(4)]

        def run(prepared: mbs.Prepared = fresh[0]) -> np.ndarray:
            return np.array(prepared.run()["x"])

        def whole(rtol: float = rtol) -> np.ndarray:
            return np.array(mbs.simulate(mbs.loads(belt.model), t_end=END, rtol=rtol, samples=1001)["x"])

        run()
        first = min(measured(lambda one=one: run(one), belt, "")[1] for one in fresh[1:])
        least = min(measured(whole, belt, "")[1] for _ in range(3))
        told = f"rtol {rtol:g} (first run {first:.3f} s, with its model read and built {least:.3f} s)"
        yield min(measured(run, belt, told) for _ in range(5))


def scipys(belt: Belt, relative: bool) -> Iterator[Result]:
    """Yield runs of LSODA on smoothed friction, in coordinates of the belt or of the ground."""
    fastest = belt.amplitude * W
    for exponent in range(2, 12 if relative else 9):
        e = fastest * 10.0**-exponent

        def slope(t: float, y: np.ndarray, e: float = e) -> list[float]:
            if relative:
                return [y[1], fastest * W * math.sin(W * t) - MU * G * math.tanh(y[1] / e)]
            return [y[1], -MU * G * math.tanh((y[1] - fastest * math.cos(W * t)) / e)]

        def run(slope: Any = slope) -> np.ndarray:
            how = {"method": "LSODA", "rtol": 1e-10, "atol": 1e-13, "max_step": 0.05 / W, "t_eval": TIMES}
            found = solve_ivp(slope, (0.0, END), [0.0, 0.0 if relative else fastest], **how)
            x = np.array(found.y[0]) if len(found.y) else np.empty(0)
            return x + belt.place(TIMES) if relative and len(x) == len(TIMES) else x

        yield measured(run, belt, f"LSODA, e = {e:.1g} m/s")


MJCF = """
<mujoco>
  <option gravity="0 0 0" timestep="{step!r}" tolerance="0"><flag contact="disable" refsafe="disable"/></option>
  <worldbody>
    <body>
      <joint name="slide" type="slide" axis="1 0 0" frictionloss="{limit!r}" solreffriction="-1 {damping!r}"
             solimpfriction=".9999 .9999 .001 .5 2"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
    </body>
  </worldbody>
  <actuator><motor joint="slide"/></actuator>
</mujoco>
"""


def mujocos(belt: Belt) -> Iterator[Result]:
    """Yield runs of MuJoCo by step; forces are given in blocks of 25 ms or more."""
    import mujoco
    from mujoco import rollout

    for count in (25, 250, 2500, 25000):
        step = END / 1000 / count
        for part in (1.0, 0.5):
            model = mujoco.MjModel.from_xml_string(MJCF.format(step=step, limit=MU * G, damping=-part / step))

            def run(model: Any = model, count: int = count, step: float = step) -> np.ndarray:
                data = mujoco.MjData(model)
                whole = mujoco.mjtState.mjSTATE_FULLPHYSICS
                state = np.empty(mujoco.mj_stateSize(model, whole))
                mujoco.mj_getState(model, data, state, whole)
                force = belt.excess * MU * G * np.sin(W * (np.arange(1000 * count) + 0.5) * step)
                places, block = [np.zeros(1)], count * max(1, 1000 // count)
                for k in range(0, len(force), block):
                    states, _ = rollout.rollout(model, data, state[None], force[None, k : k + block, None])
                    places.append(states[0, count - 1 :: count, 1])
                    state = states[0, -1]
                return np.concatenate(places) + belt.place(TIMES)

            yield measured(run, belt, f"Euler, step {step:.0e} s, slows down in {1 / part:g} steps")


def exudyns(belt: Belt) -> Iterator[Result]:
    """Yield runs of Exudyn by zone, and by step and stiffness of bristles; errors at the times that it stores."""
    import exudyn as exu
    from exudyn import itemInterface

    def run(solver: str, steps: int, friction: dict[str, float]) -> tuple[float, float]:
        system = exu.SystemContainer().AddSystem()
        fastest = belt.amplitude * W
        still = system.AddNode(itemInterface.NodePointGround())
        ground = system.AddMarker(itemInterface.MarkerNodeCoordinate(nodeNumber=still, coordinate=0))
        nodes, markers = [], []
        for mass in (1.0, HEAVY):
            node = itemInterface.Node1D(referenceCoordinates=[0], initialCoordinates=[0], initialVelocities=[fastest])
            nodes.append(system.AddNode(node))
            system.AddObject(itemInterface.ObjectMass1D(mass=mass, nodeNumber=nodes[-1]))
            markers.append(system.AddMarker(itemInterface.MarkerNodeCoordinate(nodeNumber=nodes[-1], coordinate=0)))
        spring = {"markerNumbers": [ground, markers[1]], "stiffness": HEAVY * W * W}
        system.AddObject(itemInterface.ObjectConnectorCoordinateSpringDamper(**spring))
        memory = system.AddNode(itemInterface.NodeGenericData(numberOfDataCoordinates=3, initialCoordinates=[0, 0, 0]))
        rub = {"markerNumbers": markers[::-1], "dynamicFrictionForce": MU * G, "nodeNumber": memory, **friction}
        system.AddObject(itemInterface.ObjectConnectorCoordinateSpringDamperExt(**rub))
        watched = {"outputVariableType": exu.OutputVariableType.Coordinates, "storeInternal": True}
        sensor = system.AddSensor(itemInterface.SensorNode(nodeNumber=nodes[0], writeToFile=False, **watched))
        system.Assemble()
        settings = exu.SimulationSettings()
        motion = settings.timeIntegration
        motion.endTime, motion.numberOfSteps, motion.minimumStepSize = END, steps, 1e-10
        motion.relativeTolerance = motion.absoluteTolerance = 1e-10
        motion.newton.relativeTolerance = motion.newton.absoluteTolerance = 1e-12
        settings.solution.file.write, settings.solution.sensors.writePeriod = False, END / 1000
        begin = time.process_time()
        system.SolveDynamic(settings, solverType=getattr(exu.DynamicSolverType, solver))
        spent = time.process_time() - begin
        found = system.GetSensorStoredData(sensor)
        error = np.abs(found[:, 1] - exact(belt, np.minimum(found[:, 0], END))).max() / belt.amplitude
        return float(error), spent

    for zone in (1e-4, 1e-5, 1e-6):
        yield *run("DOPRI5", 2500, {"frictionProportionalZone": zone}), f"DOPRI5, zone {zone:g} m/s"
    for step in (1e-4, 1e-5, 3e-6):
        for stiffness in (1e5, 1e6, 1e7, 1e8):
            bristles = {"stickingStiffness": stiffness, "stickingDamping": 2 * math.sqrt(stiffness)}
            told = f"generalised alpha, step {step:.0e} s, bristles {stiffness:.0e} N/m"
            yield *run("GeneralizedAlpha", round(END / step), bristles), told


# --- comparison -------------------------------------------------------------------------------------------------------


def best(results: Iterator[Result], limit: float) -> Result:
    """Return the most accurate run among those that take no longer than a limit, and print all."""
    kept = (math.inf, math.inf, "none")
    for result in results:
        print(f"    {result[2]:58} error {result[0]:.2e}  {result[1]:8.3f} s", flush=True)
        if result[1] > limit:
            break
        kept = min(kept, result, key=lambda one: one[0])
    return kept


def compare(name: str, runs: Iterator[Result], own: list[Result], limit: float) -> None:
    """Print a tool's runs, and how much more CPU than ours the best of them takes."""
    print(name)
    error, spent, setting = best(runs, limit)
    fitting = [one[1] for one in own if one[0] <= error]
    told = f"{spent / min(fitting):.2g} times our CPU time" if fitting else "more accurate than ours"
    print(f"    best: {setting}, error {error:.2e}, {spent:.3f} s: {told}")


def main(limit: float) -> None:
    """Print all runs for each belt."""
    for belt in (Belt(3.0), Belt(1.5)):
        print(f"--- the belt's largest acceleration is {belt.excess:g} mu g")
        print("multibody_sym")
        own = list(ours(belt))
        for error, spent, setting in own:
            print(f"    {setting:58} error {error:.2e}  {spent:8.3f} s")
        compare(f"scipy {version('scipy')}, speeds against the ground", scipys(belt, False), own, limit)
        compare(f"scipy {version('scipy')}, speed relative to the belt", scipys(belt, True), own, limit)
        for name, runs in (("mujoco", mujocos), ("exudyn", exudyns)):
            if importlib.util.find_spec(name) is None:
                print(f"{name} is not installed: pip install multibody-sym[peers]")
            else:
                compare(f"{name} {version(name)}", runs(belt), own, limit)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)
