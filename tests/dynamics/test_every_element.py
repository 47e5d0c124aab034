"""Every kind of joint, force and constraint that the model knows, and prescribed motion, through every route."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest
from mechanisms import Case, random_case, random_state

from multibody_sym.analysis.check import beyond_rounding, compare_formalisms
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.balance import balance_terms, rates_of, theorems
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.model.bodies import GroundMotion
from multibody_sym.model.constraints import CONSTRAINTS, OnCurve
from multibody_sym.model.forces import FORCES, Distributed, Friction
from multibody_sym.model.joints import JOINTS
from multibody_sym.model.parameters import Table

APART = (Friction, OnCurve, Distributed)
DECLARED = [cls for table in (JOINTS, FORCES, CONSTRAINTS) for cls in table.table.values() if cls not in APART]
MOST_SPEEDS = 4
"""Up to which the routes that derive closed forms take part here."""


@cache
def case_of(seed: int, rows: bool) -> Case:
    return random_case(seed, bodies=(2, 3) if rows else (1, 3), rows=rows)


def verify_first(wanted: Callable[[Any], bool], *, rows: bool = False) -> None:
    """Verify the first random case that declares something wanted."""
    verify(next(seed for seed in range(300) if any(map(wanted, parts(case_of(seed, rows))))), rows)


def parts(case: Case) -> Iterator[Any]:
    """Yield everything that a case's system declares."""
    system = case.system
    for table in (system.joints, system.forces, system.constraints, system.inputs):
        yield from table.values()
    yield from (body.motion for body in system.bodies.values())


@cache
def verify(seed: int, rows: bool) -> None:
    """Assert that all routes agree at a random state, and that the theorems hold there; of each case once."""
    case = case_of(seed, rows)
    state = case.state(*random_state(np.random.default_rng(case.seed), case))
    derived = ("lagrange", "multipliers") if len(case.mechanism.speeds) > MOST_SPEEDS else ()
    left_out = {*derived, *(["lagrange"] if case.mechanism.rows else [])}
    routes = {name: route for name, route in FORMALISMS.items() if name not in left_out}
    assert not beyond_rounding(case.mechanism, compare_formalisms(case.mechanism, [state], routes))
    found = forward_dynamics(composite_body(case.mechanism, state))
    assert max(theorems([balance_terms(case.mechanism, rates_of(case.mechanism), state, found)]).values()) < 1e-11


@pytest.mark.parametrize("cls", [*DECLARED, GroundMotion, Table], ids=lambda cls: cls.__name__)
def test_every_kind(cls: type) -> None:
    verify_first(lambda x: type(x) is cls, rows=cls in CONSTRAINTS.table.values())


@pytest.mark.parametrize("cls", [cls for cls in JOINTS.table.values() if cls.kind != "fixed"], ids=lambda cls: cls.kind)
def test_every_joint_with_prescribed_motion(cls: type) -> None:
    def is_driven(x: Any) -> bool:
        return type(x) is cls and any(motion is not None for motion in x.motion or ())

    verify_first(is_driven)
