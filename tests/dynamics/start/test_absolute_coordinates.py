"""Absolute coordinates against those of the joints: one motion, one set of reactions, whatever it is written in.

Accelerations found in one kind of coordinates are turned into the other by the bodies' kinematics, and put with the
multipliers into d'Alembert's principle there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy
from mechanisms import Case, random_case, random_state
from random_loops import blocks, closed

import multibody_sym as mbs
from multibody_sym.analysis.check import LARGEST_WITH_ROWS, dalembert, ratio
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.reactions import reactions
from multibody_sym.dynamics.programs.system import state_derivative
from multibody_sym.dynamics.redundancy import redundancy
from multibody_sym.dynamics.start.start import absolute_state, start
from multibody_sym.mechanics.changes import with_settings
from multibody_sym.mechanics.mechanism import TIME, Mechanism
from multibody_sym.mechanics.motion import (
    Motion,
    State,
    accelerations,
    body_acceleration,
    motion_of,
    slot_state,
    state_of,
)
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.model.fields import Names
from multibody_sym.program.program import interpret
from multibody_sym.scalars.node import symbol

EXAMPLES = Path(__file__).parents[3] / "examples"
FAR_APART = 1000.0
"""The largest ratio for masses from 1e-6 to 1e6, in absolute coordinates: the weights of heavy bodies count."""


def freed(case: Case, state: State) -> tuple[Mechanism, Motion, list[float]]:
    """Return a case in absolute coordinates at a state of its joints, with its parameters."""
    found = mbs.mechanism(with_settings(case.system, {"coordinates": "absolute"}))
    known = dict(zip((p.name for p in case.mechanism.parameters), case.parameters, strict=True))
    known["most independent rows"] = float(len(found.rows))
    parameters = [known.get(p.name, 0.0) for p in found.parameters]
    q, u = absolute_state(found, motion_of(case.mechanism, state), parameters)
    at = state_of(found, float, state.slots[TIME], q.tolist(), u.tolist(), parameters)
    return found, motion_of(found, at), parameters


def same_accelerations(wanted: Motion, known: Motion, udot: np.ndarray) -> np.ndarray:
    """Return the accelerations udot of one motion at which its bodies accelerate as those of the other at its udot."""
    names = [body.name for body in known.mechanism.bodies]
    reached = dict(zip(names, accelerations(known, udot.tolist()), strict=True))
    found = np.zeros(len(wanted.state.u))
    carried: list[tuple] = []
    for body, moved in zip(wanted.mechanism.bodies, wanted.bodies, strict=True):
        double_of = body.name.partition(" at ")[0].removeprefix("double of ").partition(".")[0]
        name = body.name if body.name in reached else double_of
        parent = carried[body.parent] if body.parent >= 0 else ((0, 0, 0), (0, 0, 0))
        w_parent = wanted.bodies[body.parent].w_WB if body.parent >= 0 else (0, 0, 0)
        bias = np.concatenate(body_acceleration(moved, w_parent, parent, [0.0] * len(body.u)))
        carried.append(reached[name])
        if body.u:
            directions = np.hstack([moved.linear, moved.angular]).T
            found[list(body.u)] = np.linalg.lstsq(directions, np.concatenate(reached[name]) - bias, rcond=None)[0]
    return found


def disagreement(case: Case, state: State) -> tuple[float, float]:
    """Return the scaled residual of the motion found in absolute coordinates, and the largest difference of reactions.

    The latter relative to the largest reaction, zero where reactions are not unique.
    """
    relative = motion_of(case.mechanism, state)
    mechanism, absolute, _ = freed(case, state)
    dynamics = composite_body(mechanism, absolute.state)
    found = forward_dynamics(dynamics)
    by_row = dict(zip(dynamics.row_names, found.multipliers, strict=True))
    multipliers = np.array([by_row[row.name] for row in case.mechanism.rows])
    udot = same_accelerations(relative, absolute, found.udot)
    residual = ratio(dalembert(relative), udot, multipliers)
    if redundancy(absolute, dynamics).not_unique:
        return residual, 0.0
    own = forward_dynamics(composite_body(case.mechanism, state))
    first = reactions(relative, own.udot.tolist(), row_motions(relative), own.multipliers.tolist())
    second = reactions(absolute, found.udot.tolist(), row_motions(absolute), found.multipliers.tolist())
    assert set(first) == set(mechanism.joint_names)
    return residual, difference(first, second)


def difference(first: Mapping[str, Mapping[str, float]], second: Mapping[str, Mapping[str, float]]) -> float:
    largest = max((abs(x) for of_joint in first.values() for x in of_joint.values()), default=0.0)
    pairs = [(x, second[name][key]) for name, of_joint in first.items() for key, x in of_joint.items()]
    return max((abs(a - b) for a, b in pairs), default=0.0) / (largest or 1.0)


def with_masses_apart(case: Case) -> Case:
    """Return a case whose masses, with their inertias, are up to a thousand times larger or smaller: 1e-6 to 1e6."""
    rng = np.random.default_rng(case.seed)
    bodies = {}
    for name, body in case.system.bodies.items():
        k = float(10 ** rng.uniform(-3, 3))
        inertia = None if body.inertia is None else tuple(k * x for x in body.inertia)
        bodies[name] = replace(body, mass=None if body.mass is None else k * body.mass, inertia=inertia)
    system = replace(case.system, bodies=Names(bodies))
    return replace(case, system=system, mechanism=mbs.mechanism(system))


def residual_in_absolute_coordinates(case: Case, state: State) -> float:
    """Return the scaled residual, there, of accelerations found in those of joints with the multipliers found there."""
    relative = motion_of(case.mechanism, state)
    mechanism, absolute, _ = freed(case, state)
    own = forward_dynamics(composite_body(case.mechanism, state))
    found = forward_dynamics(composite_body(mechanism, absolute.state))
    udot = same_accelerations(absolute, relative, own.udot)
    return max(ratio(dalembert(absolute), x, found.multipliers) for x in (udot, found.udot))


def by_program(case: Case, state: State) -> float:
    """Return the scaled residual, in absolute coordinates, of what their Program finds."""
    mechanism, absolute, parameters = freed(case, state)
    program = state_derivative(mechanism, composite_body(mechanism, slot_state(mechanism)))
    at, (t, inputs) = absolute.state, _time_and_inputs(absolute.state)
    _, udot, multipliers, _ = interpret(program, t, at.q, at.u, parameters, inputs, [])
    return ratio(dalembert(absolute), udot, multipliers)


def _time_and_inputs(state: State) -> tuple[float, list[float]]:
    inputs = {leaf.data[1]: x for leaf, x in state.slots.items() if leaf.data[0] == "inputs"}
    return state.slots[TIME], [inputs[k] for k in range(len(inputs))]


def random_tree(seed: int, *, rows: bool = False) -> tuple[Case, State]:
    case = random_case(seed, bodies=(1, 5), rows=rows)
    return case, case.state(*random_state(np.random.default_rng(seed), case))


@pytest.mark.parametrize("block", blocks(60, quick=1))
def test_random_loops_accelerate_alike_and_pull_alike(block: int) -> None:
    for seed in range(5 * block, 5 * block + 5):
        residual, of_reactions = disagreement(*closed(seed))
        assert residual <= LARGEST_WITH_ROWS, f"seed {seed}: {residual}"
        assert of_reactions <= 1e-6, f"seed {seed}: {of_reactions}"


@pytest.mark.parametrize("block", blocks(60, quick=1))
def test_masses_may_be_far_apart(block: int) -> None:
    for seed in range(5 * block, 5 * block + 5):
        case, state = closed(seed)
        residual = residual_in_absolute_coordinates(with_masses_apart(case), state)
        assert residual <= FAR_APART, f"seed {seed}: {residual}"


@pytest.mark.parametrize("seed", range(2))
def test_programs_agree_where_the_mass_matrix_is_singular_too(seed: int) -> None:
    assert by_program(*closed(seed)) <= LARGEST_WITH_ROWS
    assert by_program(*random_tree(seed, rows=True)) <= LARGEST_WITH_ROWS


@pytest.mark.parametrize("rows", [False, True])
@pytest.mark.parametrize("block", blocks(40, quick=1))
def test_random_trees_accelerate_alike_and_pull_alike(block: int, rows: bool) -> None:
    for seed in range(5 * block, 5 * block + 5):
        residual, of_reactions = disagreement(*random_tree(seed, rows=rows))
        assert residual <= LARGEST_WITH_ROWS, f"seed {seed}: {residual}"
        assert of_reactions <= 1e-6, f"seed {seed}: {of_reactions}"


@pytest.mark.parametrize("seed", range(10))
def test_joints_measure_the_speeds_that_the_state_was_given_in(seed: int) -> None:
    case, state = random_tree(seed)
    mechanism, absolute, _ = freed(case, state)
    three_angles = {c.joint for c in case.mechanism.coordinates if c.unit == "rad" and c.name.endswith("_3")}
    for speed, wanted in zip(case.mechanism.speeds, state.u, strict=True):
        found = mechanism.symbols.get(symbol(speed.name))
        if found is not None and speed.joint not in three_angles:
            assert absolute.state.values([found])[0] == pytest.approx(wanted, abs=1e-12), speed.name
    for row, moving in zip(mechanism.rows, row_motions(absolute), strict=True):
        joint = row.name.partition(".")[0]
        if joint in case.system.joints:
            assert abs(moving.phi) < 1e-12, row.name
            assert abs(moving.phidot) < 1e-11, row.name


def test_a_pendulum_reads_as_in_the_textbook() -> None:
    model = mbs.load(str(EXAMPLES / "pendulum.yaml"))
    equations = mbs.derive(with_settings(model, {"coordinates": "absolute"}))
    x, y, angle = equations.symbols.coordinates
    m, length, g = (next(s for s in equations.symbols.parameters if s.name == name) for name in ("m", "l", "g"))
    assert equations.mass_matrix == sympy.diag(m, m, 0)
    assert list(equations.constraints) == [x - length * sympy.sin(angle), y + length * sympy.cos(angle)]
    assert list(equations.forcing) == [0, -m * g, 0]


def test_whole_turns_are_counted_in_the_plane() -> None:
    """A wound up torsion spring has the energy of all its turns."""
    system = mbs.System(
        "wound",
        bodies={"disc": mbs.Body(mass=1, inertia={"Izz": 0.5}), "arm": mbs.Body(mass=1, inertia={"Izz": 0.5})},
        joints={
            "axle": mbs.Revolute("ground", "arm", q="a", initial={"q": -9}),
            "spring": mbs.Revolute("arm", "disc", q="b", axis="-z", initial={"q": 25, "u": -3}),
        },
        forces={"coil": mbs.SpringDamper(stiffness=2, joint="spring", damping=0.1)},
        simulation={"coordinates": "absolute"},
    )
    begin = start(mbs.mechanism(system))
    assert dict(zip((c.name for c in mbs.mechanism(system).coordinates), begin.q, strict=True)) == pytest.approx(
        {"disc_x": 0, "disc_y": 0, "disc_angle": -34, "arm_x": 0, "arm_y": 0, "arm_angle": -9}
    )
    run = mbs.simulate(system, t_end=1, samples=5, backend="python")
    assert run.energy[0] == pytest.approx(25**2 + 0.25 * 3**2)
    other = mbs.simulate(system, coordinates="relative", t_end=1, samples=5, backend="python")
    for name in ("a", "b", "u_a", "u_b"):
        assert run[name] == pytest.approx(other[name], abs=1e-7)
    assert run.reactions["spring"]["mz"] == pytest.approx(other.reactions["spring"]["mz"], abs=1e-6)


def test_a_name_that_is_taken_is_lengthened() -> None:
    joints = {"hinge": mbs.Revolute("ground", "rod 1", q="rod_1_angle")}
    system = mbs.System("named", bodies={"rod 1": mbs.Body(mass=1, inertia={"Izz": 1})}, joints=joints)
    found = mbs.mechanism(with_settings(system, {"coordinates": "absolute"}))
    assert [c.name for c in found.coordinates] == ["rod_1_free_x", "rod_1_free_y", "rod_1_free_angle"]
    assert found.joint_names == ("hinge",)
