"""Rows: phidot, H and gamma against exact derivatives of phi, or of psi where there is no phi; wrenches against H."""

from __future__ import annotations

import numpy as np
import pytest
from exact import Exact
from mechanisms import Case, random_case, random_state

from multibody_sym.mechanics.points import generalized_forces, position, velocity
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.mechanics.row_records import DistanceRow, ExpressionRow, VelocityRow
from multibody_sym.model.system import system_from_tree
from multibody_sym.scalars.calculus import tangents
from multibody_sym.scalars.node import ONE, as_node

SEEDS = range(40)


@pytest.mark.parametrize("seed", SEEDS)
def test_rows_against_the_derivatives_of_phi(seed: int) -> None:
    case = random_case(seed, bodies=(1, 5), rows=True)
    state = random_state(np.random.default_rng(seed), case)
    exact = Exact(case)
    count = len(state[2])
    symbolic = row_motions(exact.motion)
    for k, row in enumerate(row_motions(case.motion(*state))):
        size = 1 + np.abs(row.jacobian).max()
        if row.holonomic:
            phi = as_node(symbolic[k].phi)
            phidot = exact.rates([phi])[0]
            assert row.phi == pytest.approx(exact.values([phi], state)[0], abs=1e-13)
            assert row.phidot == pytest.approx(exact.values([phidot], state)[0], abs=1e-12 * size)
        else:
            phidot = as_node(symbolic[k].phidot)
        along = [tangents([phidot], {speed: ONE})[0] for speed in exact.u]
        np.testing.assert_allclose(row.jacobian, exact.values(along, state), atol=1e-12 * size)
        gamma = -exact.values(exact.rates([phidot]), state, [0.0] * count)[0]
        assert row.gamma == pytest.approx(gamma, abs=1e-11 * size, rel=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_multiplier_is_the_force_that_the_wrenches_exert(seed: int) -> None:
    """H_j^T is the generalised force of the wrenches of a unit multiplier; an expression acts on coordinates."""
    case = random_case(seed, bodies=(1, 8), rows=True)
    t, q, u = random_state(np.random.default_rng(seed), case)
    motion = case.motion(t, q, u)
    for row, found in zip(case.mechanism.rows, row_motions(motion), strict=True):
        on_bodies = np.array(generalized_forces(motion, found.of_body), dtype=float)
        if isinstance(row, (ExpressionRow, VelocityRow)):
            assert not on_bodies.any()
        else:
            np.testing.assert_allclose(on_bodies, found.jacobian, atol=1e-12 * (1 + np.abs(on_bodies).max()))


def test_tension_pulls_the_ends_of_a_rod_together() -> None:
    for seed in SEEDS:
        case = random_case(seed, bodies=(2, 5), rows=True)
        t, q, u = random_state(np.random.default_rng(seed), case)
        motion, given = case.motion(t, q, u), case.motion(t, q, [0.0] * len(u))
        for row, found in zip(case.mechanism.rows, row_motions(motion), strict=True):
            if isinstance(row, DistanceRow):
                apart = np.subtract(position(motion, row.ends[1]), position(motion, row.ends[0]))
                parting = [np.subtract(velocity(m, row.ends[1]), velocity(m, row.ends[0])) for m in (motion, given)]
                closing = parting[1] - parting[0]
                power = np.array(found.jacobian, dtype=float) @ np.array(motion.state.u)
                assert power == pytest.approx(closing @ apart / np.linalg.norm(apart), abs=1e-10)


def test_length_may_depend_on_time_and_coordinates() -> None:
    """A rope that is wound up by a drum: phi = L - r phi - length, and the drum feels the tension's moment."""
    tree = {
        "multibody_sym": "1",
        "name": "winch",
        "parameters": {"r": "0.1", "L": "2"},
        "bodies": {
            "drum": {"inertia": {"Izz": "1"}, "mass": "1"},
            "load": {"mass": "3"},
            "ground": {"points": {"o": ["0.1", "0", "0"]}},
        },
        "joints": {
            "A": {"type": "revolute", "parent": "ground", "child": "drum", "q": "phi"},
            "B": {"type": "prismatic", "parent": "ground.o", "child": "load", "axis": "-y", "q": "x"},
        },
        "constraints": {"rope": {"type": "rope", "path": ["ground.o", "load"], "length": "L + r*phi + 0.5*t^2"}},
    }
    resolved = mechanism(system_from_tree(tree))
    case = Case(0, None, resolved, [0.1, 2.0, 0.0, 0.0])
    names = [c.name for c in resolved.coordinates]
    q, u = [0.3, 0.7], [2.0, -1.0]
    (row,) = row_motions(case.motion(3.0, q, u))
    assert row.phi == pytest.approx(2 + 0.1 * q[names.index("phi")] + 4.5 - q[names.index("x")])
    assert row.phidot == pytest.approx(0.1 * u[names.index("phi")] + 3.0 - u[names.index("x")])
    assert dict(zip(names, row.jacobian, strict=True)) == {"phi": pytest.approx(0.1), "x": pytest.approx(-1.0)}
    assert row.gamma == pytest.approx(-1.0)
