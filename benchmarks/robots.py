"""Forward dynamics of real robots: operations of the generated code, and time per evaluation against Pinocchio.

    python benchmarks/robots.py [--counts]

Accelerations from coordinates, speeds and a torque in every joint (none on a floating base), values folded; no damping,
mimicking joints free, as Pinocchio has them. Operations are additions, subtractions, multiplications and divisions;
theirs are the same of Pinocchio's algorithm traced through CasADi with common subexpressions eliminated, counted once
(the wheel has no bindings for it); loads of constants, sines and cosines are not counted on either side.
Times: ours is `--native` code called for many random states in turn by a loop in C; theirs `pin.aba` called from Python
for random states in turn, less the cost of the call, measured as `pin.aba` of a model without joints (the same
arguments to convert, no mechanics). CPU time of the thread, minimum of interleaved rounds. Needs the extra `peers`.
"""

from __future__ import annotations

import sys
import time
import warnings
from dataclasses import dataclass, replace
from importlib.metadata import files, version
from typing import Any

import numpy as np
import pinocchio as pin

from multibody_sym.derivation.routes import FORMALISMS, cheapest
from multibody_sym.dynamics.programs.system import state_derivative
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import slot_state
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.forces import Torque
from multibody_sym.model.urdf import UrdfNotice, load_urdf
from multibody_sym.program.backend import Native
from multibody_sym.program.loading import load
from multibody_sym.program.program import Program, operation_count
from multibody_sym.program.trace import Trace

STATES = 1000
ROUNDS = 200


@dataclass(frozen=True)
class Robot:
    """A robot of example-robot-data, and the additions, subtractions, multiplications and divisions of Pinocchio's."""

    name: str
    file: str
    floating: bool
    their_operations: int


ROBOTS = (
    Robot("UR5", "ur_description/urdf/ur5_robot.urdf", False, 1279),
    Robot("Panda with fingers", "panda_description/urdf/panda.urdf", False, 2973),
    Robot("ANYmal, floating", "anymal_b_simple_description/robots/anymal.urdf", True, 5765),
    Robot("Talos, floating", "talos_data/robots/talos_full_v2.urdf", True, 18431),
)


def path_of(robot: Robot) -> str:
    """Return the robot's file in the installed package."""
    return str(next(file.locate() for file in files("example-robot-data") or [] if str(file).endswith(robot.file)))


def our_mechanism(robot: Robot) -> Mechanism:
    """Return the robot with a torque as input in every joint with one freedom."""
    system = load_urdf(path_of(robot), floating=robot.floating, damping=False, mimic=False)
    joints = [name for name, joint in system.joints.items() if len(joint.coordinate_units) == 1]
    torques = {f"torque {name}": Torque(f"tau{k}", joint=name) for k, name in enumerate(joints)}
    inputs = {f"tau{k}": 0 for k in range(len(joints))}
    return mechanism(replace(system, forces=torques, inputs=inputs))


def forward_dynamics(resolved: Mechanism) -> Program:
    """Return the Program of the accelerations alone, by the formalism that is the default."""
    derivative = state_derivative(resolved, FORMALISMS[cheapest(resolved)](resolved, slot_state(resolved)))
    accelerations = derivative.output("udot")
    return Trace("forward_dynamics", derivative.inputs).finish({"udot": (accelerations.shape, accelerations.values)})


def counts(robot: Robot, resolved: Mechanism, program: Program) -> str:
    """Return one row: speeds, formalism, operations, theirs, the ratio."""
    count = operation_count(program)
    parts = count.additions + count.subtractions, count.multiplications, count.divisions, count.functions
    split = " ".join(f"{part:6}" for part in parts)
    part = count.total / robot.their_operations
    head = f"{robot.name:20} {len(resolved.speeds):6} {cheapest(resolved):15}"
    return f"{head} {count.total:10} {split} {robot.their_operations:8} {part:6.1%}"


def random_coordinates(resolved: Mechanism, rng: np.random.Generator) -> np.ndarray:
    """Return coordinates (STATES, nq), the quaternions of unit length."""
    q = rng.uniform(-1, 1, (STATES, len(resolved.coordinates)))
    for body in resolved.bodies:
        for places in map(list, body.quaternions):
            q[:, places] /= np.linalg.norm(q[:, places], axis=1, keepdims=True)
    return q


def times(robot: Robot, resolved: Mechanism, program: Program) -> str:
    """Return one row: microseconds per evaluation, ours, theirs less the call, the call, and how many times less."""
    rng = np.random.default_rng(0)
    compiled = load({"forward_dynamics": program}, Native(True, "c"))
    inputs = rng.normal(size=(STATES, len(resolved.inputs)))
    ours = (0.0, random_coordinates(resolved, rng), rng.normal(size=(STATES, len(resolved.speeds))), [], inputs, [])
    model = pin.buildModelFromUrdf(path_of(robot), *([pin.JointModelFreeFlyer()] if robot.floating else []))
    theirs, empty = their_states(model, rng), their_states(pin.Model(), rng)
    bare = pin.Model()
    rounds = []
    for _ in range(ROUNDS):
        start = time.thread_time()
        compiled.map("forward_dynamics", *ours)
        middle = time.thread_time()
        rounds.append((middle - start, their_seconds(model, theirs), their_seconds(bare, empty)))
    own, full, call = (min(seconds) / STATES * 1e6 for seconds in zip(*rounds, strict=True))
    return f"{robot.name:20} {own:8.3f} {full - call:10.3f} {call:8.3f} {(full - call) / own:8.1f}"


def their_states(model: Any, rng: np.random.Generator) -> list[tuple[np.ndarray, ...]]:
    """Return random coordinates, speeds and torques of one of Pinocchio's models."""
    states = []
    for _ in range(STATES):
        q = pin.integrate(model, pin.neutral(model), rng.uniform(-1, 1, model.nv))
        states.append((q, rng.normal(size=model.nv), rng.normal(size=model.nv)))
    return states


def their_seconds(model: Any, states: list[tuple[np.ndarray, ...]]) -> float:
    """Return the CPU time of one call for each state."""
    data, aba = model.createData(), pin.aba
    start = time.thread_time()
    for q, v, tau in states:
        aba(model, data, q, v, tau)
    return time.thread_time() - start


def main() -> None:
    """Print both tables."""
    warnings.simplefilter("ignore", UrdfNotice)
    print(f"multibody_sym {version('multibody-sym')}, Pinocchio {pin.__version__}")
    print("robot                speeds formalism       operations    +/-     *      / sin,cos   theirs  ratio")
    derived = []
    for robot in ROBOTS:
        resolved = our_mechanism(robot)
        program = forward_dynamics(resolved)
        derived.append((robot, resolved, program))
        print(counts(robot, resolved, program), flush=True)
    if "--counts" in sys.argv:
        return
    print(f"\nus per evaluation    ours native   pin.aba     call  times less ({STATES} states, {ROUNDS} rounds)")
    for robot, resolved, program in derived:
        print(times(robot, resolved, program), flush=True)


if __name__ == "__main__":
    main()
