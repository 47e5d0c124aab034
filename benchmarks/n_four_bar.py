"""CPU time of ten seconds of N four-bar windows at equal energy error, against Exudyn and MuJoCo in the same run.

    python benchmarks/n_four_bar.py [N ...]

Cranks hang from (i, 0), i = 0..N, N couplers join their tips; each rod is 1 m long and weighs 1 kg. All cranks are
upright at first, the couplers move at +x 1 m/s, g is 9.81. Whenever all rods lie in line the rows of a window depend on
each other: the windows might fold either way there. Error: the largest change of the energy in an untimed run, at 1,001
times (ours, MuJoCo's) or all steps (Exudyn's). For each run of theirs ours has the largest of the tolerances 10^(-k/2)
whose error is no larger.

Exudyn: rigid bodies in the plane with revolute joints, generalised alpha of index 3 with its default spectral radius
0.9 and modified Newton iterations, the linear solver that is faster (dense for few windows, sparse for many). Its
explicit methods take no loops, and its index 2 (Newmark) diverges at a flat position. MuJoCo: hinges and `connect`
equalities, RK4, contacts off; of its solvers Newton's is the fastest at a given error, with the stiffest constraints
that it allows (solref 2 steps, solimp 0.9999), and the Jacobian that is faster.
CPU time of the thread, minimum of runs in turn. Needs the extra `peers`.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import Any

import exudyn as exu
import mujoco
import numpy as np
from exudyn import itemInterface
from windows import GRAVITY, windows

from multibody_sym.motion.loop.integrate import integrate
from multibody_sym.motion.loop.problem import Problem
from multibody_sym.motion.methods.table import METHODS
from multibody_sym.motion.prepare.problem import prepare_system, problem_of, settings_of

END = 10.0
METHOD = "dormand_prince_8"
TOLERANCES = [10 ** (-k / 2) for k in range(4, 19)]
ROUNDS = {2: 5, 40: 2}
STEPS = {2: ((1e-2, 1e-3, 2.5e-4), (4e-3, 1e-3, 2.5e-4)), 40: ((1e-2, 1e-3), (4e-3, 1e-3))}
"""Of Exudyn and of MuJoCo, whose errors at 1e-2 s are of the size of a rod's weight."""
FEW = 8
"""Windows up to which dense linear algebra is the faster one for the others."""


@dataclass(frozen=True)
class Run:
    """A way to integrate: its largest energy error in J, and what to call for a run without measurements."""

    name: str
    error: float
    again: Callable[[], object]


# --- ours ---------------------------------------------------------------------------------------------------------


def our_problem(count: int) -> Problem:
    """Return the compiled problem."""
    ready = prepare_system(windows(count, END))
    return replace(problem_of(ready, settings_of(ready)), method=METHODS[METHOD])


def ours(problem: Problem, tolerance: float) -> Run:
    """Return the run at a tolerance; one that fails has an infinite error."""
    problem = replace(problem, rtol=tolerance, atol=tolerance)
    motion = integrate(problem)
    found = problem.compiled.map("energy", motion.t, motion.q, motion.u, problem.parameters, [], problem.modes)
    error = np.inf if motion.failure else np.ptp(sum(found))
    return Run(f"tolerance {tolerance:.1e}", error, lambda: integrate(replace(problem, samples=2)))


def as_good(runs: list[Run], error: float) -> Run:
    """Return the run with the largest tolerance whose error is no larger."""
    found = next((run for run in runs if run.error <= error), None)
    if found is None:
        raise SystemExit(f"no tolerance reaches the error {error:.1e} J")
    return found


# --- Exudyn -------------------------------------------------------------------------------------------------------


def exudyn_run(count: int, step: float) -> Run:
    """Return Exudyn's run at a step."""
    states: list[np.ndarray] = []

    def record(system: Any, _t: float) -> bool:
        data = system.systemData
        states.append(np.array([data.GetODE2Coordinates(), data.GetODE2Coordinates_t()]))
        return True

    watched, reference = their_windows(count)
    watched.SetPreStepUserFunction(record)
    watched.SolveDynamic(their_settings(count, step))
    record(watched, END)
    moved, rates = (part.reshape(len(states), -1, 3) for part in np.array(states).transpose(1, 0, 2))
    heights = moved[..., 1] + reference.reshape(-1, 3)[:, 1]
    kinetic = 0.5 * (rates[..., 0] ** 2 + rates[..., 1] ** 2) + rates[..., 2] ** 2 / 24
    energy = (kinetic + GRAVITY * heights).sum(axis=1)
    fresh, settings = [their_windows(count)[0] for _ in range(ROUNDS[count])], their_settings(count, step)
    return Run(f"Exudyn, step {step:.1e} s", change(energy), lambda: fresh.pop().SolveDynamic(settings))


def their_windows(count: int) -> tuple[Any, np.ndarray]:
    """Return Exudyn's system, assembled, and the reference coordinates (x, y, angle) of its rods."""
    system = exu.SystemContainer().AddSystem()
    ground = system.AddObject(itemInterface.ObjectGround())

    def rod(place: list[float], velocity: list[float]) -> list[Any]:
        node = system.AddNode(itemInterface.NodeRigidBody2D(referenceCoordinates=place, initialVelocities=velocity))
        body = system.AddObject(itemInterface.ObjectRigidBody2D(mass=1, inertia=1 / 12, nodeNumber=node))
        mass = system.AddMarker(itemInterface.MarkerBodyMass(bodyNumber=body))
        system.AddLoad(itemInterface.LoadMassProportional(markerNumber=mass, loadVector=[0, -GRAVITY, 0]))
        return [marker(body, [end, 0, 0]) for end in (-0.5, 0.5)]

    def marker(body: Any, place: list[float]) -> Any:
        return system.AddMarker(itemInterface.MarkerBodyPosition(bodyNumber=body, localPosition=place))

    cranks = [rod([i, 0.5, np.pi / 2], [0.5, 0, -1]) for i in range(count + 1)]
    couplers = [rod([i + 0.5, 1, 0], [1, 0, 0]) for i in range(count)]
    pins = [(marker(ground, [i, 0, 0]), crank[0]) for i, crank in enumerate(cranks)]
    for i, coupler in enumerate(couplers):
        pins += [(cranks[i][1], coupler[0]), (coupler[1], cranks[i + 1][1])]
    for pin in pins:
        system.AddObject(itemInterface.ObjectJointRevolute2D(markerNumbers=list(pin)))
    system.Assemble()
    return system, np.array(system.systemData.GetODE2Coordinates(exu.ConfigurationType.Reference))


def their_settings(count: int, step: float) -> Any:
    """Return Exudyn's settings; nothing is written."""
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(END / step)
    settings.timeIntegration.endTime = END
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 2 * END
    if count > FEW:
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    return settings


# --- MuJoCo -------------------------------------------------------------------------------------------------------


def mjcf(count: int, step: float) -> str:
    """Return MuJoCo's model; its angles are those from the start."""
    twelfth, hinge = repr(1 / 12), '<joint type="hinge" axis="0 -1 0"/>'
    crank = f'{hinge}<inertial pos="0 0 .5" mass="1" diaginertia="{twelfth} {twelfth} 1e-6"/>'
    inertial = f'<inertial pos=".5 0 0" mass="1" diaginertia="1e-6 {twelfth} {twelfth}"/>'
    couplers = [f'<body name="b{i}" pos="0 0 1">{hinge}{inertial}</body>' for i in range(count)]
    stiff = f'anchor="1 0 0" solref="{2 * step!r} 1" solimp=".9999 .9999 .001 .5 2"'
    bodies = [f'<body name="a{i}" pos="{i} 0 0">{crank}{carried}</body>' for i, carried in enumerate([*couplers, ""])]
    pins = [f'<connect body1="b{i}" body2="a{i + 1}" {stiff}/>' for i in range(count)]
    jacobian = "dense" if count <= FEW else "sparse"
    option = f'gravity="0 0 {-GRAVITY}" integrator="RK4" timestep="{step!r}" jacobian="{jacobian}"'
    return (
        f'<mujoco><option {option}><flag contact="disable"/></option><worldbody>{"".join(bodies)}</worldbody>'
        f"<equality>{''.join(pins)}</equality></mujoco>"
    )


def mujoco_run(count: int, step: float) -> Run:
    """Return MuJoCo's run at a step."""
    model = mujoco.MjModel.from_xml_string(mjcf(count, step))
    data = mujoco.MjData(model)

    def begin() -> None:
        mujoco.mj_resetData(model, data)
        data.qvel[0::2], data.qvel[1::2] = -1, 1

    def again() -> None:
        begin()
        mujoco.mj_step(model, data, nstep=round(END / step))

    begin()
    states = [np.array([data.qpos, data.qvel])]
    every = max(1, round(END / step / 1000))
    for _ in range(round(END / step / every)):
        mujoco.mj_step(model, data, nstep=every)
        states.append(np.array([data.qpos, data.qvel]))
    q, u = np.array(states).transpose(1, 0, 2)
    return Run(f"MuJoCo, step {step:.1e} s", change(energy_of_angles(q, u)), again)


def energy_of_angles(q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return T + V at samples of the cranks' and the couplers' joint angles from the start, in turn (m, 2 N + 1)."""
    crank, rate = q[:, 0::2], u[:, 0::2]
    energy = (rate**2 / 6 + GRAVITY * 0.5 * np.cos(crank)).sum(axis=1)
    crank, rate = crank[:, :-1], rate[:, :-1]
    angle, spin = crank + q[:, 1::2], rate + u[:, 1::2]
    vx = -np.cos(crank) * rate - 0.5 * np.sin(angle) * spin
    vy = -np.sin(crank) * rate + 0.5 * np.cos(angle) * spin
    height = np.cos(crank) + 0.5 * np.sin(angle)
    return energy + (0.5 * (vx**2 + vy**2) + spin**2 / 24 + GRAVITY * height).sum(axis=1)


# --- comparison ---------------------------------------------------------------------------------------------------


def change(energy: np.ndarray) -> float:
    """Return the largest change against the start."""
    return float(np.abs(energy - energy[0]).max())


def seconds(run: Run) -> float:
    """Return the CPU time of one run."""
    start = time.thread_time()
    run.again()
    return time.thread_time() - start


def compare(count: int) -> None:
    """Print each run of theirs beside ours that is at least as good."""
    start = time.process_time()
    problem = our_problem(count)
    print(f"N = {count}: declared, assembled, derived and printed in {time.process_time() - start:.1f} s of CPU")
    runs = [ours(problem, tolerance) for tolerance in TOLERANCES]
    for steps, engine in zip(STEPS[count], (exudyn_run, mujoco_run), strict=True):
        for theirs in (engine(count, step) for step in steps):
            own = as_good(runs, theirs.error)
            pairs = [(seconds(own), seconds(theirs)) for _ in range(ROUNDS[count])]
            best, their_best = (min(times) for times in zip(*pairs, strict=True))
            print(
                f"  {theirs.name}: {theirs.error:.1e} J in {their_best:.3f} s; ours, {own.name}: {own.error:.1e} J in "
                f"{best * 1e3:.2f} ms, ratio {their_best / best:.0f}",
                flush=True,
            )


def main() -> None:
    """Print the comparison for 2 and 40 windows, or for those asked for."""
    warnings.simplefilter("ignore")
    theirs = f"Exudyn {version('exudyn')}, MuJoCo {mujoco.__version__}"
    print(f"multibody_sym {version('multibody-sym')} ({METHOD}), {theirs}")
    for count in map(int, sys.argv[1:] or ("2", "40")):
        compare(count)


if __name__ == "__main__":
    main()
