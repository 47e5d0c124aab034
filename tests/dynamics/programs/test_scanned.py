"""Scanned Programs against the same recursion written out, over random trees of few kinds; what is scanned."""

from __future__ import annotations

from dataclasses import replace
from random import Random
from typing import Any

import numpy as np
import pytest

from multibody_sym.dynamics.formalisms.articulated_body import block_ldl
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.programs import system as written
from multibody_sym.dynamics.programs.repeated_bodies import like_bodies
from multibody_sym.dynamics.programs.system import programs, worth_scanning
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body
from multibody_sym.model.constraints import Distance
from multibody_sym.model.forces import Force, SpringDamper
from multibody_sym.model.joints import Fixed, Planar, Prismatic, Revolute, Spherical
from multibody_sym.model.system import System
from multibody_sym.program.c_target import c_source
from multibody_sym.program.program import interpret, operation_count

JOINTS = {
    "revolute": lambda parent, child: Revolute(parent, child, axis=[0, 0.6, 0.8]),
    "spherical": Spherical,
    "prismatic": lambda parent, child: Prismatic(parent, child, axis="x"),
    "planar": Planar,
    "fixed": Fixed,
}


def tree(seed: int, count: int, *, chain: bool = False, **parts) -> System:
    """Return a tree of bodies of a few kinds with masses of their own, some joints sprung."""
    rng = Random(seed)
    kinds = rng.sample(list(JOINTS), 3)
    parameters, bodies, joints, forces = {"g": "9.81", "k": 3, "d": 0.2}, {}, {}, {}
    for i in range(count):
        kind = kinds[i % 2] if chain else rng.choice(kinds)
        before = (i - 1 if chain else rng.randrange(-1, i)) if i else -1
        parent = f"b{before}.end" if before >= 0 else "ground"
        parameters |= {f"m{i}": 1 + rng.random(), f"l{i}": 0.5 + rng.random()}
        bodies[f"b{i}"] = Body(
            mass=f"m{i}", com=[f"l{i}/2", 0.1, 0], points={"end": [f"l{i}", 0, 0.1]},
            inertia={"Ixx": f"m{i}*l{i}^2/9", "Iyy": f"m{i}*l{i}^2/8", "Izz": f"m{i}*l{i}^2/7", "Ixy": 0.01},
        )  # fmt: skip
        joints[f"j{i}"] = JOINTS[kind](parent, f"b{i}")
        if kind == "revolute" and not chain:
            forces[f"s{i}"] = SpringDamper(joint=f"j{i}", stiffness="k", damping="d")
    return System("tree", [0, "-g", 0], parameters, bodies, joints, forces, **parts)


def state(resolved: Mechanism, seed: int) -> list[Any]:
    rng = np.random.default_rng(seed)
    sizes = (len(resolved.coordinates), len(resolved.speeds), len(resolved.parameters), len(resolved.inputs))
    q, u, parameters, inputs = rng.normal(size=sizes[0]), rng.normal(size=sizes[1]), 1 + rng.random(sizes[2]), sizes[3]
    return [0.3, q, u, parameters, rng.normal(size=inputs), []]


@pytest.mark.parametrize("seed", range(6))
def test_every_program_of_a_random_tree(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = ("position(b19.end, x)", "velocity(b15.end, y)", "acceleration(b19.end, z)", "angular_velocity(b12, x)",
             "total_energy()", "momentum(y)", "reaction(j3, fx)")  # fmt: skip
    resolved = mechanism(tree(seed, 20, outputs={f"y{k}": text for k, text in enumerate(asked)}))
    monkeypatch.setattr(written, "worth_scanning", like_bodies)
    scanned = programs(resolved, block_ldl).as_mapping()
    monkeypatch.setattr(written, "worth_scanning", lambda _: None)
    unrolled = programs(resolved, block_ldl).as_mapping()
    assert scanned.keys() == unrolled.keys()
    for name, program in scanned.items():
        arguments = state(resolved, seed)[: len(program.inputs)]
        for found, wanted in zip(interpret(program, *arguments), interpret(unrolled[name], *arguments), strict=True):
            assert np.abs(found - wanted).max(initial=0.0) <= 1e-9 * (1 + np.abs(wanted).max(initial=0.0)), name


def test_a_chain_is_scanned_and_agrees_with_another_formalism() -> None:
    resolved = mechanism(tree(3, 40, chain=True))
    like = worth_scanning(resolved)
    assert like is not None
    assert len(like.kinds) <= 4
    t, q, u, parameters, inputs, modes = state(resolved, 1)
    found = interpret(programs(resolved, block_ldl).state_derivative, t, q, u, parameters, inputs, modes)[1]
    formed = composite_body(resolved, state_of(resolved, float, t, q.tolist(), u.tolist(), parameters.tolist()))
    assert np.abs(found - formed.bias_acceleration).max() <= 1e-8 * np.abs(found).max()


def test_source_does_not_grow_with_the_number_of_bodies() -> None:
    sizes = {}
    for count in (100, 200):
        made = programs(mechanism(tree(3, count, chain=True)), block_ldl).as_mapping()
        text = c_source(made)["model.c"]
        sizes[count] = len(text[text.index("static") :])
    assert abs(sizes[200] - sizes[100]) <= 100  # digits of numbers


def test_a_kernel_takes_few_more_operations_than_a_body_written_out(monkeypatch: pytest.MonkeyPatch) -> None:
    bodies = {f"b{k}": Body(mass="m", com=["l", 0, 0], points={"end": ["l", 0, 0]}) for k in range(30)}
    joints = {f"j{k}": Revolute(f"b{k - 1}.end" if k else "ground", f"b{k}", axis="z") for k in range(30)}
    system = System("pendulum", gravity=[0, -9.81, 0], parameters={"m": 1, "l": 1}, bodies=bodies, joints=joints)
    counts = []
    for chosen in (like_bodies, lambda _: None):
        monkeypatch.setattr(written, "worth_scanning", chosen)
        counts.append(operation_count(programs(mechanism(system), block_ldl).state_derivative).total)
    assert counts[0] <= 1.15 * counts[1]


def test_what_is_not_scanned() -> None:
    assert worth_scanning(mechanism(tree(3, 9, chain=True))) is None
    rod = {"rod": Distance(between=["b0.end", "b9.end"], value=1)}
    assert worth_scanning(mechanism(tree(3, 40, chain=True, constraints=rod))) is None
    push = Force(on="b9", value=[1, 0, 0])
    assert worth_scanning(mechanism(replace(tree(3, 40, chain=True), forces={"push": push}))) is None
