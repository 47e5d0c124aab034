"""The quick look at a start: its pivots are those of the mass matrix, and long trees are looked at by a loop."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.closing import normalize
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.programs.system import with_constants
from multibody_sym.dynamics.start.number_checks import quick_look
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.program.backend import Native
from multibody_sym.program.c_target import c_source
from multibody_sym.program.loading import load
from multibody_sym.program.program import Program


def tree(count: int) -> mbs.System:
    """Return a tree of hinges and balls in turn, each on the one before or the one before that, with unlike numbers."""
    rng = random.Random(4)
    bodies: dict[str, Any] = {}
    joints: dict[str, Any] = {}
    for k in range(count):
        a, b, c, m = (0.5 + rng.random() for _ in range(4))
        bodies[f"b{k}"] = mbs.Body(
            mass=m, com=[a, b, -c], inertia={"Ixx": a, "Iyy": b, "Izz": (a + b) / 2}, points={"end": [b, c, a]}
        )
        parent = f"b{max(0, k - 1 - k % 3 // 2)}.end" if k else "ground"
        joints[f"j{k}"] = mbs.Spherical(parent, f"b{k}") if k % 4 == 1 else mbs.Revolute(parent, f"b{k}", axis="y")
    return mbs.System("tree", [0, 0, -9.81], {}, bodies, joints)


def look(system: mbs.System) -> tuple[Mechanism, Program]:
    """Return a system's mechanism as families look at it, and the quick look."""
    resolved = with_constants(mechanism(system))
    return resolved, quick_look(system, resolved)


@pytest.mark.parametrize("count", [3, 48])
def test_the_pivots_are_those_of_the_mass_matrix(count: int) -> None:
    """Which is LDL^T from the last speed to the first; of few bodies they are written out, of many scanned."""
    resolved, program = look(tree(count))
    rng = np.random.default_rng(1)
    q, u = (rng.uniform(-1, 1, len(x)) for x in (resolved.coordinates, resolved.speeds))
    normalize(resolved, q)
    parameters = parameter_values(resolved, {})
    motion = motion_of(resolved, state_of(resolved, float, 0.0, q.tolist(), u.tolist(), parameters))
    M = np.array(mass_matrix(motion), dtype=float)
    pivots = np.diag(np.linalg.cholesky(M[::-1, ::-1]))[::-1] ** 2

    compiled = load({"quick_look": program}, Native(backend="python")).functions["quick_look"]
    found = compiled(0.0, q, u, parameters, [], [])[1][-len(u) :]
    np.testing.assert_allclose(found, pivots - 1e-9 * np.diag(M), rtol=1e-8)


def test_a_long_tree_is_looked_at_by_a_loop() -> None:
    """Written out a body takes 12 kB of C, which compiled for seconds."""
    sizes = [len(c_source({"quick_look": look(tree(count))[1]})["model.c"]) for count in (48, 72)]
    assert sizes[1] - sizes[0] < 24 * 1000
