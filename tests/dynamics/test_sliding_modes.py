"""A mechanism in a mode: a block that slides on a plane, or sticks to it, is one with ordinary rows."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.law_elements import FrictionPart, LawElement, Mode
from multibody_sym.mechanics.modes import in_mode
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.row_records import NOWHERE, PositionRow
from multibody_sym.program import loading
from multibody_sym.program.backend import Native
from multibody_sym.scalars.node import ZERO, as_node

ALPHA, MU, G, MASS = 0.7, 0.3, 9.81, 1e-3


def incline():
    """Return a thin rod free in the plane, one end of which touches a slope: its normal row and its tangent."""
    system = mbs.System(
        "rod",
        gravity=[0, -G, 0],
        parameters={"mu": MU},
        bodies={"rod": mbs.Body(mass=MASS, com=[0.4, 0.1, 0], inertia={"Izz": 0.02})},
        joints={"free": mbs.Planar("ground", "rod", initial={"u": [0.3, 0.3 * math.tan(ALPHA), 0.5]})},
    )
    resolved = mechanism(system)
    normal, along = ([as_node(x) for x in v] for v in (
        (-math.sin(ALPHA), math.cos(ALPHA), 0), (math.cos(ALPHA), math.sin(ALPHA), 0)
    ))
    ends = NOWHERE, replace(NOWHERE, body=0)
    rows = PositionRow("c.normal", ends, tuple(normal)), PositionRow("c.friction", ends, tuple(along))
    part = FrictionPart("c", (rows[1],), resolved.parameters.slot("mu"), resolved.parameters.slot("mu"))
    contact = LawElement("c", "contact", ("contacts", "c"), (rows[0],), frictions=(part,), restitution=ZERO)
    return replace(resolved, one_way=(contact,), parameters=resolved.parameters.with_rows(1))


def by_hand(sense):
    """Return udot and the normal force of the rod cut free: M udot = f + (n - sense mu t) N, n . a_end = w^2 (..)."""
    c, s, w = math.cos(ALPHA), math.sin(ALPHA), 0.5
    J, m, r = 0.02, MASS, np.array([0.4, 0.1])
    n, t = np.array([-s, c]), np.array([c, s])
    force = n - sense * MU * t
    # unknown: a of the end (x, y), wdot, N; the centre accelerates by a + wdot k x r - w^2 r
    K = np.zeros((4, 4))
    K[:2, :2], K[:2, 2], K[:2, 3] = m * np.eye(2), m * np.array([-r[1], r[0]]), -force
    K[2, 2], K[2, 3] = J, -(-r[0] * force[1] + r[1] * force[0])
    K[3, :2] = n
    right = np.array([m * w * w * r[0], m * w * w * r[1] - m * G, 0.0, 0.0])
    return np.linalg.solve(K, right)


@pytest.mark.parametrize("name", sorted(set(FORMALISMS) - {"lagrange"}))
@pytest.mark.parametrize("sense", [1, -1])
def test_what_slides_exerts_friction_by_every_formalism(name, sense):
    sliding = in_mode(incline(), Mode({"c": 1}, {"c": sense}))
    begin = start(sliding)
    dynamics = FORMALISMS[name](sliding, state_of(sliding, float, 0.0, begin.q, begin.u, begin.parameters))
    found = forward_dynamics(dynamics)
    wanted = by_hand(sense)
    assert found.udot == pytest.approx(wanted[:3], rel=1e-12)
    assert found.multipliers == pytest.approx(wanted[3:], rel=1e-12)
    assert found.report[0] == 1


@pytest.mark.parametrize("backend", ["c", "python"])
def test_the_programs_of_a_mode_say_the_same(backend):
    sliding = in_mode(incline(), Mode({"c": 1}, {"c": 1}))
    begin = start(sliding)
    made = loading.load(programs(sliding, FORMALISMS["composite_body"]).as_mapping(), Native(backend=backend))
    q, u, p = (np.array(x, dtype=float) for x in (begin.q, begin.u, begin.parameters))
    _, udot, multipliers, report = made["state_derivative"](0.0, q, u, p, np.empty(0), np.empty(0))
    wanted = by_hand(1)
    assert udot == pytest.approx(wanted[:3], rel=1e-12)
    assert multipliers == pytest.approx(wanted[3:], rel=1e-12)
    assert report[0] == 1


def test_what_sticks_and_what_is_open_are_ordinary_rows_and_none():
    whole = incline()
    assert [row.name for row in in_mode(whole, Mode({"c": 1}, {"c": 0})).rows] == ["c.normal", "c.friction"]
    assert in_mode(whole, Mode({"c": 0})).rows == ()
    assert in_mode(whole, Mode({"c": 1}, {"c": 0})).row_path(1) == ("contacts", "c")
