"""The four-bar's constrained accelerations: generated C against Pinocchio's constraint dynamics, time per evaluation.

    python benchmarks/four_bar.py

Ours: accelerations and multipliers of `examples/four_bar.yaml` without its motor, values folded, `--native`, for the
states of a motion in turn by a loop in C. Theirs: the same bodies, and the pin between coupler and rocker as a
CONTACT_3D constraint (point on point: the least that holds a planar loop), regularised by mu = 1e-10 in 10 proximal
iterations, as its three rows depend on each other in the plane and the default settings give nan;
`pin.constraintDynamics` called from Python for the same states. From both the cost of the call is taken: ours is that
for one state, theirs that of a model without joints and constraints, for each state. CPU time of
the thread, minimum of interleaved rounds. Needs the extra `peers`.
"""

from __future__ import annotations

import time
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

import multibody_sym as mbs
from multibody_sym.derivation.routes import FORMALISMS, cheapest
from multibody_sym.dynamics.programs.system import state_derivative
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.mechanics.motion import slot_state
from multibody_sym.program.backend import Native
from multibody_sym.program.loading import Compiled, load
from multibody_sym.program.program import Program, operation_count
from multibody_sym.program.trace import fold_input

MODEL = Path(__file__).parent.parent / "examples" / "four_bar.yaml"
STATES = 2000
ROUNDS = 100
LENGTHS = {"crank": 0.2, "coupler": 0.5, "rocker": 0.4}
DENSITY, FRAME = 2.0, 0.5


def our_program(system: mbs.System) -> Program:
    """Return the Program of accelerations and multipliers, the values of all parameters folded."""
    resolved = mbs.mechanism(system)
    derivative = state_derivative(resolved, FORMALISMS[cheapest(resolved)](resolved, slot_state(resolved)))
    wanted = replace(derivative, outputs=(derivative.output("udot"), derivative.output("multipliers")))
    return fold_input(wanted, "parameters", parameter_values(resolved, {}))


def their_model() -> tuple[Any, Any]:
    """Return Pinocchio's model and its constraints."""
    model = pin.Model()
    model.gravity.linear = np.array([0.0, -9.81, 0.0])
    joints: dict[str, int] = {}
    for name, parent, place in (("crank", None, 0.0), ("coupler", "crank", LENGTHS["crank"]), ("rocker", None, FRAME)):
        placement = pin.SE3(np.eye(3), np.array([place, 0.0, 0.0]))
        joints[name] = model.addJoint(joints.get(parent, 0), pin.JointModelRZ(), placement, name)
        length = LENGTHS[name]
        inertia = DENSITY * length**3 / 12 * np.diag([0.0, 1.0, 1.0])
        rod = pin.Inertia(DENSITY * length, np.array([length / 2, 0.0, 0.0]), inertia)
        model.appendBodyToJoint(joints[name], rod, pin.SE3.Identity())
    ends = [pin.SE3(np.eye(3), np.array([LENGTHS[name], 0.0, 0.0])) for name in ("coupler", "rocker")]
    constraints = pin.StdVec_RigidConstraintModel()
    constraints.append(
        pin.RigidConstraintModel(
            pin.ContactType.CONTACT_3D, model, joints["coupler"], ends[0], joints["rocker"], ends[1], pin.LOCAL
        )
    )
    return model, constraints


def their_seconds(model: Any, constraints: Any, states: list[tuple[np.ndarray, ...]]) -> tuple[float, np.ndarray]:
    """Return the CPU time of one call for each state, and the last accelerations."""
    data, dynamics = model.createData(), pin.constraintDynamics
    datas = pin.StdVec_RigidConstraintData()
    for constraint in constraints:
        datas.append(constraint.createData())
    pin.initConstraintDynamics(model, data, constraints, datas)
    settings = pin.ProximalSettings(1e-12, 1e-10, 10)
    start = time.thread_time()
    for q, v, tau in states:
        dynamics(model, data, q, v, tau, constraints, datas, settings)
    return time.thread_time() - start, data.ddq.copy()


def our_seconds(compiled: Compiled, q: np.ndarray, u: np.ndarray, parameters: np.ndarray) -> tuple[float, np.ndarray]:
    """Return the CPU time of a loop in C over states, and the last accelerations."""
    start = time.thread_time()
    udot, _ = compiled.map("state_derivative", 0.0, q, u, parameters, [], [])
    return time.thread_time() - start, udot[-1]


def main() -> None:
    """Print both times and their ratio."""
    system = replace(mbs.load(MODEL), forces={})
    program = our_program(system)
    motion = mbs.simulate(system, t_end=10, samples=STATES)
    coordinates, speeds = np.ascontiguousarray(motion.q), np.ascontiguousarray(motion.u)
    compiled = load({"state_derivative": program}, Native(True, "c"))
    folded_values = np.zeros(program.input("parameters").size)
    model, constraints = their_model()
    theirs = [(q, u, np.zeros(3)) for q, u in zip(coordinates, speeds, strict=True)]
    empty = [(np.zeros(0),) * 3] * STATES
    rounds = []
    for _ in range(ROUNDS):
        own, udot = our_seconds(compiled, coordinates, speeds, folded_values)
        one, _ = our_seconds(compiled, coordinates[:1], speeds[:1], folded_values)
        full, their_udot = their_seconds(model, constraints, theirs)
        rounds.append((own, one, full, their_seconds(pin.Model(), pin.StdVec_RigidConstraintModel(), empty)[0]))
    np.testing.assert_allclose(udot, their_udot, rtol=1e-9)
    own, one, full, call = (min(seconds) / STATES * 1e6 for seconds in zip(*rounds, strict=True))
    own -= one
    count = operation_count(program)
    print(f"multibody_sym {version('multibody-sym')}, Pinocchio {pin.__version__}")
    print(f"{count.total} operations, {count.functions} functions, {count.solves} solves with one matrix of 2 x 3")
    print(f"us per evaluation: ours native {own:.3f}, constraintDynamics {full - call:.2f}, its call {call:.2f}")
    print(f"ratio {(full - call) / own:.1f}")


if __name__ == "__main__":
    main()
