"""What elements exert adds up: on each body to the rate of its momentum, and all powers to that of T."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from mechanisms import Case, random_case, random_state

from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.quantities import (
    StateQuantities,
    angular_momentum,
    body_momenta,
    exertions,
    generalized_momenta,
    jacobi_integral,
    quantities,
    resultant,
)
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy
from multibody_sym.mechanics.motion import Motion, coordinate_rates, motion_of, state_of
from multibody_sym.mechanics.points import NO_WRENCH, Wrench
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.scalars.node import quantity

_STEP = 1e-6


def drifted(case: Case, motion: Motion, udot: np.ndarray, tau: float) -> Motion:
    """Return the motion a short time later, by Taylor's formula up to udot; quaternions are left as they come out."""
    state, mechanism = motion.state, case.mechanism
    u = np.array(state.u, dtype=float)
    mid = (u + tau / 2 * udot).tolist()
    q0 = np.array(state.q, dtype=float)
    half = q0 + tau / 2 * np.array(coordinate_rates(mechanism, state.q, state.u), dtype=float)
    q = q0 + tau * np.array(coordinate_rates(mechanism, half.tolist(), mid), dtype=float)
    parameters = [x for leaf, x in state.slots.items() if leaf.data[0] == "parameters"]
    t = next(x for leaf, x in state.slots.items() if leaf.data[0] == "t")
    return motion_of(mechanism, state_of(mechanism, float, t + tau, q.tolist(), (u + tau * udot).tolist(), parameters))


@pytest.mark.parametrize("rows", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_wrenches_are_rates_of_momenta_and_powers_that_of_the_energy(seed: int, rows: bool) -> None:
    case = random_case(seed, rows=rows)
    motion = case.motion(*random_state(np.random.default_rng(seed), case))
    found = forward_dynamics(composite_body(case.mechanism, motion.state))
    acting = exertions(motion, found.udot.tolist(), row_motions(motion), found.multipliers.tolist())
    before, after = (drifted(case, motion, found.udot, tau) for tau in (-_STEP, _STEP))
    momenta = [body_momenta(m) for m in (before, after)]
    for index in range(len(motion.bodies)):
        pairs = [(m[index].momentum, angular_momentum([m[index]])) for m in momenta]
        rate = (np.array(pairs[1], dtype=float) - np.array(pairs[0], dtype=float)) / (2 * _STEP)
        on_body = [resultant(motion, _only(index, each.of_body)) for each in acting]
        size = 1.0 + np.abs(np.array(on_body, dtype=float)).sum() + np.abs(np.array(pairs[0], dtype=float)).sum()
        np.testing.assert_allclose(np.array(on_body, dtype=float).sum(axis=0), rate, atol=1e-8 * size)
    rate = (float(kinetic_energy(after)) - float(kinetic_energy(before))) / (2 * _STEP)
    powers = np.array([each.power for each in acting], dtype=float)
    assert powers.sum() == pytest.approx(rate, abs=1e-8 * (1.0 + np.abs(powers).sum() + kinetic_energy(motion)))


def _only(index: int, of_body: Sequence[Wrench]) -> list[Wrench]:
    return [wrench if k == index else NO_WRENCH for k, wrench in enumerate(of_body)]


def test_momenta_of_speeds_are_slopes_of_the_kinetic_energy() -> None:
    for seed in range(4):
        case = random_case(seed)
        t, q, u = random_state(np.random.default_rng(seed), case)
        motion = case.motion(t, q, u)
        for k, p in enumerate(generalized_momenta(motion)):
            T = []
            for sign in (-1, 1):
                moved = list(u)
                moved[k] += sign * 0.5
                T.append(float(kinetic_energy(case.motion(t, q, moved))))
            assert float(p) == pytest.approx(T[1] - T[0], rel=1e-9, abs=1e-9)
        if not case.mechanism.drives:
            total = float(kinetic_energy(motion) + potential_energy(motion))
            assert float(jacobi_integral(motion)) == pytest.approx(total, rel=1e-12)


def test_about_the_centre_of_mass_and_of_single_bodies() -> None:
    case = random_case(3, bodies=(3, 4))
    motion = case.motion(*random_state(np.random.default_rng(3), case))
    found = forward_dynamics(composite_body(case.mechanism, motion.state))

    def vector(function: str, *names: str) -> np.ndarray:
        asked = [quantity(function, (*names, axis)) for axis in "xyz"]
        return np.array(list(quantities(motion, found.udot.tolist(), [], asked).values()), dtype=float)

    names = [body.name for body in case.mechanism.bodies]
    np.testing.assert_allclose(vector("momentum", "system"), sum(vector("momentum", n) for n in names), rtol=1e-12)
    about_origin, com = vector("angular_momentum"), vector("center_of_mass")
    steiner = np.cross(com, vector("momentum"))
    about_com = vector("angular_momentum", "system", "com")
    np.testing.assert_allclose(about_com, about_origin - steiner, rtol=1e-9, atol=1e-9)
    p = vector("position", names[-1])
    about_point = about_origin - np.cross(p, vector("momentum"))
    np.testing.assert_allclose(
        vector("angular_momentum", "system", names[-1]), about_point, rtol=1e-9, atol=1e-9
    )
    own = StateQuantities(motion, found.udot.tolist(), [])
    np.testing.assert_allclose(
        vector("angular_momentum", names[0], "com"), np.array(own.momenta[0].spin, dtype=float), rtol=1e-9, atol=1e-9
    )
    energies = [quantity("kinetic_energy", (n,)) for n in names]
    assert sum(quantities(motion, [], [], energies).values()) == pytest.approx(kinetic_energy(motion))
