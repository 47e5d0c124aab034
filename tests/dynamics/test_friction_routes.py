"""Friction in every joint that may rub, of random systems in random modes, through every route and the theorems."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mechanisms import Case, random_case, random_state

from multibody_sym.analysis.check import beyond_rounding, compare_formalisms
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.balance import balance_terms, rates_of, theorems
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.mechanics.law_elements import Mode
from multibody_sym.mechanics.mechanism import INDEPENDENT, Mechanism
from multibody_sym.mechanics.modes import in_mode
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.fields import Names
from multibody_sym.model.forces import Friction
from multibody_sym.program.program import interpret

RUBBING = {"prismatic": {}, "revolute": {"radius": 0.05}, "cylindrical": {"radius": 0.05}, "screw": {"radius": 0.05}}
MOST_SPEEDS = 4


def rubbing(case: Case) -> Mechanism | None:
    """Return a case's mechanism with friction in all joints that may rub, None where none may."""
    rng, forces = np.random.default_rng(case.seed), {}
    for name, joint in case.system.joints.items():
        if joint.kind in RUBBING and joint.motion is None:
            fields = dict(RUBBING[joint.kind])
            if joint.kind == "prismatic" and rng.random() < 0.5:
                fields["length"] = 0.7
            forces[f"friction in {name}"] = Friction(name, float(rng.uniform(0, 0.2)), **fields)
    if not forces:
        return None
    return mechanism(replace(case.system, forces=Names({**case.system.forces, **forces})))


def random_mode(resolved: Mechanism, seed: int) -> Mode:
    """Return a mode in which each friction slides one way or the other, or sticks, pressed by either side."""
    rng = np.random.default_rng(seed)
    sides = {row.name: int(rng.choice([-1, 1])) for x in resolved.one_way for row in x.normals}
    sides |= {x.name: int(rng.choice([-1, 1])) for x in resolved.one_way}
    parts = [part for x in resolved.one_way for part in x.frictions]
    return Mode(sides, {part.name: 2 if len(part.rows) == 2 else int(rng.choice([-1, 1])) for part in parts})


def verify(seed: int, *, rows: bool) -> bool:
    case = random_case(seed, bodies=(2, 4), rows=rows)
    declared = rubbing(case)
    if declared is None:
        return False
    resolved = in_mode(declared, random_mode(declared, seed))
    t, q, u = random_state(np.random.default_rng(seed), case)
    if len(q) != len(resolved.coordinates):  # a joint that rubs keeps its coordinates where it is cut
        return False
    known = dict(zip((entry.name for entry in case.mechanism.parameters), case.parameters, strict=True))
    parameters = [known.get(entry.name, 0.0) for entry in resolved.parameters]
    parameters = resolved.parameters.changed(parameters, {INDEPENDENT: float(len(resolved.rows))})
    state = state_of(resolved, float, t, q, u, parameters)
    derived = ("lagrange", "multipliers") if len(u) > MOST_SPEEDS else ("lagrange",)
    routes = {name: route for name, route in FORMALISMS.items() if name not in derived}
    assert not beyond_rounding(resolved, compare_formalisms(resolved, [state], routes))
    found = forward_dynamics(composite_body(resolved, state))
    assert max(theorems([balance_terms(resolved, rates_of(resolved), state, found)]).values()) < 1e-10
    program = programs(resolved, FORMALISMS["composite_body"]).state_derivative
    inputs = [state.slots[x] for x in state.slots if x.data[0] == "inputs"]
    again = interpret(program, t, q, u, parameters, np.array(inputs), np.zeros(0))[1]
    assert again == pytest.approx(found.udot, rel=1e-7, abs=1e-9 * max(map(abs, found.udot)))
    return True


@pytest.mark.parametrize("rows", [False, True])
def test_random_systems_rub_alike_on_every_route(rows: bool) -> None:
    assert sum(verify(seed, rows=rows) for seed in range(14)) >= 6


@pytest.mark.long
@pytest.mark.parametrize("rows", [False, True])
def test_more_random_systems_rub_alike(rows: bool) -> None:
    assert sum(verify(seed, rows=rows) for seed in range(14, 150)) >= 60
