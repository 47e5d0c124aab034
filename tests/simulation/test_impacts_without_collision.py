"""Painleve's rod slides where no force holds it: what its friction does then is an impact, though nothing closes."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import multibody_sym as mbs
from multibody_sym.dynamics.laws.assemble import Scale
from multibody_sym.scalars.node import ZERO
from multibody_sym.simulation.failures import FailedRunError
from multibody_sym.simulation.one_way.decision import decided
from multibody_sym.simulation.one_way.facts import Facts

ROD = """
multibody_sym: 1
name: rod
gravity: [0, -9.81, 0]
parameters: {mu: 2, e: 0.4}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  rod: {mass: 1, inertia: {Izz: 1/3, Ixx: 1/3, Iyy: 1/3}, points: {tip: [-1, 0, 0]}}
joints:
  free: {type: planar, parent: ground, child: rod, q: [x, y, th], initial: {q: [0, 2, 1.3], u: [-8, 0, 0]}}
contacts:
  c: {between: [rod.tip, ground.floor], static: mu, kinetic: mu, restitution: e, open: true}
simulation: {t_end: 1e-3, samples: 2}
"""


@pytest.fixture(scope="module")
def sliding() -> Facts:
    """The rod with its tip on the floor, where K_nn - mu K_nt, the inverse of its apparent mass, is negative."""
    run = mbs.simulate(mbs.loads(ROD))
    assert run.modes is not None
    q, u = np.array([0.0, math.sin(1.3), 1.3]), np.array([-8.0, 0.0, 0.0])
    return run.modes.laws.at(0.0, q, u, Scale(1.0, 8.0))


def test_its_impulses_stop_the_slip_and_give_back_what_has_been_compressed(sliding: Facts) -> None:
    """Routh: (p_n, p_t) compress until v_n = v_t = 0; then it sticks while e p_n more is given back."""
    c, s, e = math.cos(1.3), math.sin(1.3), 0.4
    K = np.array([[1 + 3 * c * c, -3 * s * c], [-3 * s * c, 1 + 3 * s * s]])
    assert K[0, 0] + 2 * K[0, 1] < 0.0
    compressed = np.linalg.solve(K, [0.0, 8.0])
    p = compressed + e * compressed[0] * np.array([1.0, -K[0, 1] / K[1, 1]])
    assert abs(p[1]) < 2 * p[0]
    found = decided(sliding, ["c"])
    assert found.mode is not None
    assert found.mode.sides == {"c": 0}
    np.testing.assert_allclose(found.facts.u, [-8 + p[1], p[0], 3 * (s * p[1] - c * p[0])], rtol=0, atol=1e-7)
    assert found.blow is not None
    assert found.blow.impulses["c"] == pytest.approx(p[0], rel=1e-7)
    energy = [0.5 * (u[0] ** 2 + u[1] ** 2 + u[2] ** 2 / 3) for u in (sliding.u, found.facts.u)]
    assert found.blow.lost["c"] == pytest.approx(energy[0] - energy[1], rel=1e-7)


def test_without_a_restitution_there_is_no_state_and_it_is_proved(sliding: Facts) -> None:
    laws = sliding.laws
    dead = replace(laws.mechanism, one_way=tuple(replace(x, restitution=ZERO) for x in laws.mechanism.one_way))
    found = decided(replace(sliding, laws=replace(laws, mechanism=dead)), ["c"])
    assert (found.mode, found.blow) == (None, None)
    assert found.found is not None
    assert found.found.proved


CRATE = """
multibody_sym: 1
name: crate
gravity: [0, 0, -9.81]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  crate: {shape: {box: [0.455, 0.453, 0.66], mass: 1.03}}
contacts:
  c: {between: [crate, ground.floor], static: 1.5, restitution: 1}
joints:
  free:
    type: free
    parent: ground
    child: crate
    initial: {q: [0, 0, 0.33, 1, 0, 0, 0], u: [-0.748, 0.114, 0, 0, 0, -2.203]}
simulation: {t_end: 0.1}
"""


def test_a_sliding_corner_that_friction_jams_is_named_and_no_constraint_is_blamed() -> None:
    """Its apparent mass grows without bound: (n + r x n) . M^-1 (n - mu v/|v|) is zero there, by hand."""
    why = r"friction jams at t = 0\.00081.* c\.corner4\.normal .*Painleve"
    with pytest.raises(FailedRunError, match=why) as failed:
        mbs.simulate(mbs.loads(CRATE))
    end = failed.value.trajectory.integration
    w, *axis = end.q_final[3:]
    turned = Rotation.from_quat([*axis, w]).as_matrix()
    sizes, m = np.array([0.455, 0.453, 0.66]), 1.03
    corners = turned @ (np.array(list(product((-0.5, 0.5), repeat=3))) * sizes).T
    inertia = turned @ np.diag(m / 12.0 * (sizes @ sizes - sizes**2)) @ turned.T
    r = corners[:, np.argmin(corners[2])]
    v = end.u_final[:3] + np.cross(turned @ end.u_final[3:], r)
    n = np.array([0.0, 0.0, 1.0])
    force = n - 1.5 * np.array([v[0], v[1], 0.0]) / math.hypot(v[0], v[1])
    smooth, rough = (f[2] / m + np.cross(r, n) @ np.linalg.solve(inertia, np.cross(r, f)) for f in (n, force))
    assert abs(rough) < 1e-5 * smooth
