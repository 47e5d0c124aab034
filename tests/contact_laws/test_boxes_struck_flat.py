"""Boxes that strike a floor with all corners at once in space, with friction: more impulses than speeds."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.contact_laws import search
from multibody_sym.contact_laws.impact_problem import ImpactProblem, ImpactResult
from multibody_sym.contact_laws.impact_sequence import strike
from multibody_sym.contact_laws.problem import FrictionLaw, FrictionRow, Law, LawProblem, Unilateral
from multibody_sym.scalars.arrays import Floats

SIZES = tuple[float, float, float]


def corner_rows(point: Floats) -> Floats:
    """Return (3, 6) the velocity upward, along x and along y of a point by that of the mass centre and the turn."""
    x, y, z = point
    return np.array([[0, 0, 1, y, -x, 0], [1, 0, 0, 0, z, -y], [0, 1, 0, -z, 0, x]], dtype=float)


def posed(rows: Floats, mass: Floats, u: Floats, mu: float, e: float) -> ImpactProblem:
    """Return the impact of corners, each a normal and its tangents in rows (k, d, n), for speeds u (n)."""
    corners, each, size = rows.shape
    whole = rows.reshape(corners * each, size)
    A = whole @ np.linalg.inv(np.linalg.cholesky(mass).T)
    laws = [law for k in range(corners) for law in (Unilateral(), *(FrictionRow(k, j) for j in range(each - 1)))]
    parts = [
        FrictionLaw(tuple(range(k * each + 1, (k + 1) * each)), (k * each,), mu, mu, (0.0,) * (each - 1))
        for k in range(corners)
    ]
    bounces = np.zeros(len(whole))
    bounces[::each] = e
    typed: tuple[Law, ...] = tuple(laws)
    problem = LawProblem(A, A.copy(), np.zeros((len(A), len(A))), -whole @ u, typed, tuple(parts))
    return ImpactProblem(problem, bounces, law="poisson", sequence="one_by_one")


def after(problem: ImpactProblem, mass: Floats, u: Floats) -> tuple[ImpactResult, Floats]:
    found = strike(problem)
    return found, u + np.linalg.solve(np.linalg.cholesky(mass).T, found.x)


def box(sizes: SIZES, m: float) -> tuple[Floats, Floats]:
    """Return the mass matrix (6, 6) of a box and the rows (4, 3, 6) of its lower corners."""
    a, b, c = sizes
    mass = np.diag([m, m, m, *(m / 12 * np.array([b * b + c * c, a * a + c * c, a * a + b * b]))])
    return mass, np.array([corner_rows(np.array([i * a, j * b, -c]) / 2) for i in (1, -1) for j in (1, -1)])


def in_space(sizes: SIZES, m: float, u: list[float], mu: float, e: float) -> tuple[ImpactResult, Floats]:
    mass, rows = box(sizes, m)
    speeds = np.array(u)
    return after(posed(rows, mass, speeds, mu, e), mass, speeds)


def in_the_plane(sizes: SIZES, m: float, vx: float, vz: float, mu: float, e: float) -> tuple[ImpactResult, Floats]:
    """Return the impact of the same box in the plane of x and z: two corners, speeds x, z and the turn about y."""
    mass, rows = box(sizes, m)
    here = [0, 2, 4]
    plane = rows[[0, 2]][:, :2][:, :, here]
    speeds = np.array([vx, vz, 0.0])
    own = mass[np.ix_(here, here)]
    return after(posed(plane, own, speeds, mu, e), own, speeds)


def judged(found: ImpactResult, v: Floats, sizes: SIZES, m: float, u: list[float], mu: float) -> None:
    """Assert the jump by the impulses, the cones in each phase, no corner into the floor, and no energy made."""
    mass, rows = box(sizes, m)
    for phase in found.phases:
        part = phase.impulses.reshape(4, 3)
        assert (np.hypot(*part[:, 1:].T) <= mu * part[:, 0] + 1e-9).all()
    jump = np.einsum("kdn,kd->n", rows, found.impulses.reshape(4, 3))
    assert jump == pytest.approx(mass @ (v - np.array(u)), abs=1e-9)
    assert (np.einsum("kn,n->k", rows[:, 0], v) >= -1e-9).all()
    assert v @ mass @ v <= np.array(u) @ mass @ np.array(u)


@pytest.mark.parametrize(("mu", "e"), [(0.3, 0.5), (0.8, 1.0), (0.1, 0.0)])
def test_a_box_dropped_flat_bounces_straight_up_and_nothing_rubs(mu: float, e: float) -> None:
    found, u = in_space((0.4, 0.2, 0.3), 2.0, [0, 0, -4.0, 0, 0, 0], mu, e)
    assert u == pytest.approx([0, 0, 4.0 * e, 0, 0, 0], abs=1e-12)
    z = found.impulses.reshape(4, 3).sum(axis=0)
    assert z == pytest.approx([2.0 * 4.0 * (1 + e), 0, 0], abs=1e-11)


@pytest.mark.parametrize(
    ("sizes", "m", "mu", "e", "vx", "vz"),
    [
        ((0.2515974146458225, 0.3267489447403258, 0.16702084862358238), 2.314, 0.8, 0.3, -1.68, -1.68),
        ((0.18032600448, 0.5849627, 0.358034292), 1.02, 0.3, 0.9, -1.805, -3.995),
        ((0.5276134871435351, 0.5306417480888342, 0.5382685), 2.6235, 0.5, 0.3, -0.310043, -0.53193),
        ((0.24020437899301997, 0.34259548, 0.5903685999), 4.82745, 0.1, 0.9, 0.261976, -2.9355),
        ((0.4, 0.2, 0.3), 2.0, 0.3, 0.5, 3.0, -4.4),
        ((0.4, 0.2, 0.3), 2.0, 0.3, 0.5, 0.2, -4.4),
    ],
)
def test_a_box_that_strikes_along_x_moves_as_in_the_plane(
    sizes: SIZES, m: float, mu: float, e: float, vx: float, vz: float
) -> None:
    found, u = in_space(sizes, m, [vx, 0, vz, 0, 0, 0], mu, e)
    flat, v = in_the_plane(sizes, m, vx, vz, mu, e)
    assert u[[0, 2, 4]] == pytest.approx(v, abs=1e-8)
    assert u[[1, 3, 5]] == pytest.approx([0, 0, 0], abs=1e-8)
    assert found.impulses.reshape(4, 3)[:, :2].sum(axis=0) == pytest.approx(flat.impulses.reshape(2, 2).sum(axis=0))
    assert found.energy_lost == pytest.approx(flat.energy_lost)


@pytest.mark.parametrize(
    ("sizes", "m", "mu", "e", "u"),
    [
        ((0.37479, 0.113779, 0.4767565), 2.92, 0.8, 0.3, [3.18661, 0.752949, -4.0479, 0, 0, 0]),
        ((0.51778, 0.24, 0.2076), 3.3769, 0.8, 1.0, [6.76, 0.3441, -4.836, 0, 0, 0]),
        ((0.20172762, 0.23115667, 0.475182346), 1.7618394, 0.3, 0.5, [-0.9073, -0.44178, -4.9133, 0, 0, -0.87386]),
    ],
)
def test_a_box_that_strikes_askew_or_turning_keeps_to_the_cones_and_makes_no_energy(
    sizes: SIZES, m: float, mu: float, e: float, u: list[float]
) -> None:
    found, v = in_space(sizes, m, u, mu, e)
    judged(found, v, sizes, m, u, mu)
    assert found.not_unique


@pytest.mark.parametrize(
    ("sizes", "m", "mu", "e", "u"),
    [
        ((0.10556, 0.45946, 0.26556), 4.73, 0.3, 0.0, [0.256725, 0.659525, -3.95956, 0, 0, 1.3556]),
        ((0.49297, 0.37559, 0.22194), 2.34, 0.8, 0.3, [-0.0717, -0.17725, -4.06095, 0, 0, -1.8179]),
    ],
)
def test_a_box_that_turns_as_it_lands_is_struck_without_trying_all_modes(
    sizes: SIZES, m: float, mu: float, e: float, u: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*of: object) -> None:
        raise AssertionError("all modes are tried")

    monkeypatch.setattr(search, "candidate_modes", none)
    judged(*in_space(sizes, m, u, mu, e), sizes, m, u, mu)


def test_boxes_that_tip_from_an_edge_onto_a_face_move_as_their_impulses_say() -> None:
    """They slide and turn as they do so: other shares of the impulses would rub in other directions."""
    rng = np.random.default_rng(0)
    for _ in range(12):
        sizes = (float(rng.uniform(0.1, 0.5)), float(rng.uniform(0.1, 0.5)), float(rng.uniform(0.1, 0.5)))
        m, mu, tips = float(rng.uniform(0.5, 4.0)), float(rng.uniform(0.1, 0.8)), float(rng.uniform(1.0, 8.0))
        slides, spins = rng.uniform(-1.0, 1.0, 2).tolist(), float(rng.uniform(-0.3, 0.3))
        u = [*slides, -tips * sizes[0] / 2.0, 0.0, tips, spins]
        judged(*in_space(sizes, m, u, mu, 0.0), sizes, m, u, mu)


def test_a_table_on_three_legs_has_one_share_of_each() -> None:
    """Dropped with its mass centre off the middle: the normal impulses are those of levers, by Poisson twice."""
    mass = np.diag([3.0, 3.0, 3.0, 0.2, 0.3, 0.4])
    feet = np.array([[0.5, 0.0, -0.4], [-0.3, 0.4, -0.4], [-0.3, -0.2, -0.4]])
    rows = np.array([corner_rows(foot) for foot in feet])
    u = np.array([0, 0, -2.0, 0, 0, 0])
    found, v = after(posed(rows, mass, u, 0.4, 0.5), mass, u)
    shares = np.linalg.solve(np.vstack([np.ones(3), feet[:, 0], feet[:, 1]]), [3.0 * 2.0 * 1.5, 0.0, 0.0])
    assert found.impulses.reshape(3, 3)[:, 0] == pytest.approx(shares)
    assert v == pytest.approx([0, 0, 1.0, 0, 0, 0], abs=1e-12)
