"""Inertias moved to the bodies that feel them: the same equations with fewer numbers."""

from __future__ import annotations

import numpy as np
import pytest
from mechanisms import random_case, random_state

from multibody_sym.dynamics.formalisms.inertia import about_origin, split_at_joint
from multibody_sym.mechanics.alignment import align_bodies
from multibody_sym.mechanics.motion import motion_of


@pytest.mark.parametrize("described", [align_bodies, lambda declared: declared], ids=["aligned", "declared"])
@pytest.mark.parametrize("seed", range(40))
def test_the_parent_and_the_kept_part_move_as_the_body_does(seed: int, described) -> None:
    """Twice the kinetic energy of body and parent, at random velocities of the parent and of the joint."""
    rng = np.random.default_rng(seed)
    case = random_case(seed, bodies=(1, 4))
    state = case.state(*random_state(rng, case))
    motion = motion_of(described(case.mechanism), state)
    for body, moved, mass in zip(motion.mechanism.bodies, motion.bodies, motion.masses, strict=True):
        inertia = about_origin(mass)
        kept, handed = split_at_joint(body, moved, inertia)
        v, w, rates = rng.normal(size=3), rng.normal(size=3), rng.normal(size=len(body.u))
        R, p = np.array(moved.R_PB, dtype=float), np.array(moved.p_PB, dtype=float)
        linear, angular = (np.array(x, dtype=float).reshape(-1, 3) for x in (moved.linear, moved.angular))
        given_linear, given_angular = (np.array(x, dtype=float) for x in (moved.given_linear, moved.given_angular))
        w_body = R.T @ w + given_angular + rates @ angular
        v_body = R.T @ (v + np.cross(w, p)) + given_linear + rates @ linear
        size = twice_energy(inertia, v_body, w_body)
        assert twice_energy(kept, v_body, w_body) + twice_energy(handed, v, w) == pytest.approx(size, rel=1e-9)


def twice_energy(inertia, v: np.ndarray, w: np.ndarray) -> float:
    force, moment = inertia.wrench(tuple(v), tuple(w))
    return float(v @ np.array(force, dtype=float) + w @ np.array(moment, dtype=float))
