"""Literal numbers of many bodies as constants: against the numbers in floats; what does not become data."""

from __future__ import annotations

from dataclasses import replace
from random import Random

import numpy as np
import pytest
from windows import windows

from multibody_sym.dynamics.formalisms.articulated_body import block_ldl
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.system import (
    MANY_BODIES,
    programs,
    state_derivative,
    with_constants,
    worth_scanning,
)
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy
from multibody_sym.mechanics.motion import motion_of, slot_state, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body
from multibody_sym.model.constraints import Distance, Rope
from multibody_sym.model.forces import Force, SpringDamper, Torque
from multibody_sym.model.joints import Prismatic, Revolute, Spherical
from multibody_sym.model.steps import Translate
from multibody_sym.model.system import System
from multibody_sym.program.c_target import c_source
from multibody_sym.program.loops import with_loops
from multibody_sym.program.program import interpret

INERTIA = {"Ixx": 0.010, "Iyy": 0.012, "Izz": 0.009, "Ixy": 0.001}


def tree(numbers: int, count: int = 72, *, shape: int = 0, **parts) -> System:
    """Return a tree of one `shape` whose bodies' numbers are all unlike, other ones for other `numbers`."""
    joints, rng, forces, bodies = {}, Random(numbers), {}, {}
    parents = Random(shape)
    for i in range(count):
        of = lambda x: round(x * (1 + 0.3 * rng.random()), 6)  # noqa: E731
        turn = {"axis": "z", "angle": f"{of(20)} deg"}
        end = {"end": {"position": [of(0.1), 0, of(0.2)], "rotate": [turn]}}
        inertia = {key: of(x) for key, x in INERTIA.items()}
        bodies[f"b{i}"] = Body(mass=of(1.2), com=[of(0.05), 0, of(-0.1)], inertia=inertia, frames=end)
        parent = f"b{parents.randrange(max(0, i - 4), i)}.end" if i else "ground"
        joints[f"j{i}"] = (
            Revolute(parent, f"b{i}", axis=[0, of(0.6), of(0.8)]),
            Spherical(parent, f"b{i}"),
            Prismatic(parent, f"b{i}", axis="x"),
        )[i % 3]
        if i % 3 == 0:
            forces[f"s{i}"] = SpringDamper(joint=f"j{i}", stiffness=of(3), damping=of(0.2), length=of(0.3))
            forces[f"d{i}"] = Torque(joint=f"j{i}", value=f"{of(0.5)}*sin(j{i}) - {of(0.4)}*u_j{i}^3")
    return System("tree", [0, of(-9), 0], None, bodies, joints, forces, **parts)


def state(resolved, seed: int):
    rng = np.random.default_rng(seed)
    q, u = rng.normal(size=len(resolved.coordinates)), rng.normal(size=len(resolved.speeds))
    for body in resolved.bodies:
        for places in map(list, body.quaternions):
            q[places] /= np.linalg.norm(q[places])
    return q, u


@pytest.mark.parametrize("seed", range(2))
def test_the_same_motion_as_with_the_numbers_themselves(seed: int) -> None:
    literal = mechanism(tree(seed, shape=seed))
    resolved = with_constants(literal)
    assert worth_scanning(resolved) is not None
    made = programs(resolved, block_ldl)
    q, u = state(resolved, seed)
    constants = parameter_values(resolved, {})
    found = interpret(made.state_derivative, 0.3, q, u, constants, [], [])[1]
    floats = state_of(literal, float, 0.3, q.tolist(), u.tolist(), [])
    wanted = composite_body(literal, floats).bias_acceleration
    assert np.abs(found - wanted).max() <= 1e-9 * np.abs(wanted).max()
    motion = motion_of(literal, floats)
    energies = interpret(made.energy, 0.3, q, u, constants, [], [])
    assert np.allclose(energies, [kinetic_energy(motion), potential_energy(motion)], rtol=1e-12)


def test_other_numbers_have_the_same_source() -> None:
    texts = [c_source(programs(with_constants(mechanism(tree(k))), block_ldl).as_mapping()) for k in (1, 2)]
    assert texts[0] == texts[1]
    assert len(texts[0]["model.c"]) <= 200_000


LOOPS = 24
"""Four-bars in a row that have more bodies than stay in the text."""


def text_of(resolved) -> str:
    """Return the C of what moves a mechanism of loops."""
    derived = state_derivative(resolved, composite_body(resolved, slot_state(resolved)))
    return c_source({"state_derivative": with_loops(derived)})["model.c"]


def test_closed_loops_move_as_with_the_numbers_themselves() -> None:
    literal = mechanism(windows(LOOPS, seed=3))
    resolved = with_constants(literal)
    q, u = state(resolved, 3)
    constants = parameter_values(resolved, {})
    derived = state_derivative(resolved, block_ldl(resolved, slot_state(resolved)))
    found = interpret(derived, 0.0, q, u, constants, [], [])[1:3]
    floats = state_of(literal, float, 0.0, q.tolist(), u.tolist(), parameter_values(literal, {}))
    wanted = forward_dynamics(composite_body(literal, floats))
    for pair in zip(found, (wanted.udot, wanted.multipliers), strict=True):
        assert np.abs(pair[0] - pair[1]).max() <= 1e-9 * np.abs(pair[1]).max()


def test_loops_with_other_numbers_have_the_same_source() -> None:
    """But for the places at which they are read, unlike numbers take no more text than alike ones."""
    alike, *texts = (text_of(with_constants(mechanism(windows(LOOPS, seed=seed)))) for seed in (None, 1, 2))
    assert texts[0] == texts[1]
    assert len(texts[0]) <= 1.1 * len(alike)


def test_constraints_are_data_with_the_bodies_that_they_join() -> None:
    rod = Distance(between=["b0.end", "b9.end"], value=1.25)
    tied = with_constants(mechanism(replace(tree(1), constraints={"rod": rod})))
    (row,) = tied.rows
    assert tied.parameters[row.value.data[1]].value.shadow == 1.25
    assert row.ends[1] == tied.markers["b9.end"]
    assert row.ends[1].pose.position[0].op == "slot"


def test_a_point_that_carries_a_joint_has_one_set_of_numbers() -> None:
    """What follows from where a crank ends is computed once, for the coupler that it carries and for the loop."""
    resolved = with_constants(mechanism(windows(LOOPS, seed=1)))
    for cut in resolved.cuts:
        for marker in cut.frames:
            carried = [b.frame_on_parent for b in resolved.bodies if b.parent == marker.body]
            assert marker.pose in carried or not carried
            assert marker.pose.position[0].op == "slot"
    assert resolved.rows[0].frames == resolved.cuts[0].frames


def test_zeros_and_ones_stay_in_the_text() -> None:
    resolved = with_constants(mechanism(tree(1)))
    assert resolved.bodies[3].mass.com[1].shadow == 0.0
    assert all(body.mass.inertia[5].shadow == 0.0 for body in resolved.bodies)
    slides = [body.steps[0] for body in resolved.bodies if isinstance(body.steps[0], Translate)]
    assert slides
    assert all([x.shadow for x in step.axis] == [1.0, 0.0, 0.0] for step in slides)


def test_what_keeps_its_numbers() -> None:
    few = mechanism(tree(1, MANY_BODIES - 1))
    assert with_constants(few) is few
    push = mechanism(replace(tree(1), forces={"push": Force(on="b9", value=[1, 0, 0])}))
    assert with_constants(push) is push
    roped = mechanism(replace(tree(1), constraints={"rope": Rope(path=["b0.end", "b9.end"], length=3.5)}))
    assert with_constants(roped) is roped
    bodies = {f"b{k}": Body(mass="m", com=["l", 0, 0], points={"end": ["l", 0, 0]}) for k in range(MANY_BODIES)}
    joints = {f"j{k}": Revolute(f"b{k - 1}.end" if k else "ground", f"b{k}", axis="z") for k in range(MANY_BODIES)}
    named = mechanism(System("named", [0, "-g", 0], {"m": 1, "l": 1, "g": 9.81}, bodies, joints))
    assert with_constants(named) is named


def test_bodies_of_many_kinds_keep_their_numbers() -> None:
    """One body has no product of inertia, the next no centre beside its axis, and so on: each is its own kind."""
    system = tree(1, 80)
    bodies = {
        name: replace(body, inertia={key: x for j, (key, x) in enumerate(INERTIA.items()) if j < 3 or k % 2},
                      com=[*(0.1 * (k >> j & 1) for j in (1, 2, 3))])
        for k, (name, body) in enumerate(system.bodies.items())
    }  # fmt: skip
    many = mechanism(replace(system, bodies=bodies, forces={}))
    assert with_constants(many) is many
