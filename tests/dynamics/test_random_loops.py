"""Random trees closed by one more joint of any kind: routes agree, and joints planted twice are named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mechanisms import Case
from random_loops import blocks, closed

import multibody_sym as mbs
from multibody_sym.analysis.check import LARGEST_WITH_ROWS, compare_formalisms, dalembert, ratio
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.formalisms.equations import massless_speeds
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.dynamics.redundancy import redundancy
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.mechanics.mechanism import ALPHA, BETA, INDEPENDENT, TIME
from multibody_sym.mechanics.motion import State, motion_of
from multibody_sym.model.fields import Names
from multibody_sym.model.forces import Torque
from multibody_sym.model.joints import PointJoint
from multibody_sym.program.backend import Backend, Native
from multibody_sym.program.loading import load
from multibody_sym.scalars.node import slot

LARGEST = {False: LARGEST_WITH_ROWS, True: 10 * LARGEST_WITH_ROWS}
NUMERIC = {name: route for name, route in FORMALISMS.items() if name not in ("lagrange", "multipliers")}


@pytest.mark.parametrize("extreme", [False, True])
@pytest.mark.parametrize("block", blocks(10, quick=1))
def test_routes_agree_on_random_loops(block: int, extreme: bool) -> None:
    """Masses are 1e-3 to 1e3, extreme ones 1e-6 to 1e6, with links of none; 30 loops of either kind, 300 if long."""
    for seed in range(30 * block, 30 * block + 30):
        case, state = closed(seed, extreme=extreme)
        found = compare_formalisms(case.mechanism, [state], NUMERIC)
        assert max(found.values()) <= LARGEST[extreme], f"seed {seed}: {found}"


def test_measure_sees_a_part_in_a_billion_of_gamma() -> None:
    """Sums of absolute contributions hide no error of 1e-9 in a gamma that shows beside |gamma| itself."""
    seen = 0
    for seed in range(120):
        extreme = bool(seed % 2)
        case, state = closed(seed, extreme=extreme)
        right = dalembert(motion_of(case.mechanism, state))
        exact = forward_dynamics(NUMERIC["composite_body"](case.mechanism, state))
        for k in np.flatnonzero(np.abs(right.constraint_forcing) > 0.01 * right.absolute_constraint_forcing):
            gamma = right.constraint_forcing.copy()
            gamma[k] *= 1 + 1e-9
            wrong = replace(right, constraint_forcing=gamma)
            by_value = replace(wrong, absolute_constraint_forcing=np.abs(gamma))
            if ratio(by_value, exact.udot, exact.multipliers) > 10 * LARGEST[extreme]:
                assert ratio(wrong, exact.udot, exact.multipliers) > LARGEST[extreme], f"seed {seed}, row {k}"
                seen += 1
    assert seen > 20


def lightened(case: Case, state: State) -> tuple[Case, State] | None:
    """Return the case with its outermost bodies as particles or without mass, None where no row holds them then."""
    carriers = {body.parent for body in case.mechanism.bodies}
    outer = [body.name for k, body in enumerate(case.mechanism.bodies) if k not in carriers and body.name != "ground"]
    mass = {"mass": None} if case.seed % 3 == 0 else {}
    bodies = {**case.system.bodies, **{n: replace(case.system.bodies[n], inertia=None, **mass) for n in outer}}
    particles = [joint.child for joint in case.system.joints.values() if isinstance(joint, PointJoint)]
    idle = [n for n, f in case.system.forces.items() if isinstance(f, Torque) and f.on in {*outer} & {*particles}]
    forces = {n: f for n, f in case.system.forces.items() if n not in idle}  # a couple on a particle is an error
    system = replace(case.system, bodies=Names(bodies), forces=Names(forces))
    light = Case(case.seed, system, mbs.mechanism(system), parameter_values(mbs.mechanism(system), {}))
    t, count = state.slots[TIME], len(light.mechanism.speeds)
    found = dalembert(motion_of(light.mechanism, light.state(t, list(state.q), list(state.u))))
    lengths = np.linalg.norm(found.constraint_jacobian, axis=1, keepdims=True)
    _, sizes, v = np.linalg.svd(found.constraint_jacobian / np.where(lengths == 0.0, 1.0, lengths))
    free = v[int((sizes > 1e-8).sum()) :].T
    left = np.linalg.eigvalsh(free.T @ found.mass_matrix @ free) if free.size else np.zeros(1)
    if len(massless_speeds(light.mechanism)) in (0, count) or left[0] < 1e-6 * found.mass_matrix.max():
        return None
    return light, light.state(t, list(state.q), list(state.u))


@pytest.mark.parametrize("block", blocks(12, quick=1))
def test_routes_agree_where_only_rows_hold_what_has_no_inertia(block: int) -> None:
    routes = {name: NUMERIC[name] for name in ("newton_euler", "dalembert_lagrange", "composite_body")}
    cases = [lightened(*closed(seed)) for seed in range(30 * block, 30 * block + 30)]
    singular = [found for found in cases if found is not None]
    assert singular
    for case, state in singular:
        found = compare_formalisms(case.mechanism, [state], routes)
        assert max(found.values()) <= LARGEST_WITH_ROWS, f"seed {case.seed}: {found}"


@pytest.mark.parametrize("backend", ["c", "python"])
def test_programs_agree_where_only_rows_hold_what_has_no_inertia(backend: Backend) -> None:
    case, state = next(found for seed in range(30) if (found := lightened(*closed(seed))) is not None)
    expected = forward_dynamics(composite_body(case.mechanism, state))
    program = programs(case.mechanism, composite_body).state_derivative
    values = [slot("inputs", k) for k in range(len(case.mechanism.inputs))]
    inputs = np.array([float(state.slots[x]) for x in values])
    t, q, u = float(state.slots[TIME]), np.array(state.q), np.array(state.u)
    compiled = load({"state_derivative": program}, Native(backend=backend))
    chosen = {INDEPENDENT: len(case.mechanism.rows), ALPHA: 0.0, BETA: 0.0}
    parameters = np.array(case.mechanism.parameters.changed(case.parameters, chosen))
    _, udot, multipliers, _ = compiled["state_derivative"](t, q, u, parameters, inputs, np.empty(0))
    np.testing.assert_allclose(udot, expected.udot, rtol=1e-9, atol=1e-9 * np.abs(expected.udot).max())
    size = np.abs(expected.multipliers).max()
    np.testing.assert_allclose(multipliers, expected.multipliers, rtol=1e-9, atol=1e-9 * size)


@pytest.mark.parametrize("block", blocks(3, quick=1))
def test_a_joint_that_stands_twice_is_named(block: int) -> None:
    for seed in range(20 * block, 20 * block + 20):
        (once, state), (twice, there) = closed(seed), closed(seed, times=2)
        one, two = (
            redundancy(motion_of(case.mechanism, at), composite_body(case.mechanism, at))
            for case, at in ((once, state), (twice, there))
        )
        rows = len(once.mechanism.rows)
        assert two.rank == one.rank, f"seed {seed}"
        assert len(two.redundant) == 2 * rows - one.rank, f"seed {seed}"
        assert {row.name for row in twice.mechanism.rows} <= set(two.not_unique), f"seed {seed}"
