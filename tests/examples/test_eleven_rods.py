"""The chain of eleven rods that a particle strikes, against all bodies cut free with all impulses unknown.

Source: J. Wittenburg, Dynamics of Multibody Systems, example 6.2.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs

FILE = Path(__file__).parents[2] / "examples/impacts/eleven_rods.yaml"
ANGLES = [(6 - i) * np.pi / 10 for i in range(1, 12)]
RADIUS = 1 / (2 * np.tan(np.pi / 20))


SYSTEM = mbs.load(FILE)


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


@pytest.fixture(scope="module")
def struck():
    return mbs.solve(SYSTEM).impact


@pytest.fixture(scope="module")
def places():
    """Centres of the rods and their hinges."""
    along = np.array([[np.cos(a), np.sin(a)] for a in ANGLES])
    centres = RADIUS * np.column_stack([-along[:, 1], along[:, 0]])
    return centres, centres[:-1] + along[:-1] / 2


@pytest.fixture(scope="module")
def free_bodies(places):
    """Velocities (12, 3: vx, vy, omega) of rods and particle, hinge impulses (10, 2) on the lower rods, and p."""
    centres, hinges = places
    size = 3 * 12 + 2 * 10 + 1
    A, r = np.zeros((size, size)), np.zeros(size)
    n = centres[3] / RADIUS
    inertia = [1.0, 1.0, 1 / 12]
    for body in range(12):
        for k in range(3):
            A[3 * body + k, 3 * body + k] = inertia[k] if body < 11 else 1.0
    r[33:35] = -n
    for h, hinge in enumerate(hinges):
        for body, sign in ((h, 1.0), (h + 1, -1.0)):
            arm = hinge - centres[body]
            for k in range(2):
                column, unit = 36 + 2 * h + k, np.eye(2)[k]
                A[3 * body + k, column] -= sign
                A[3 * body + 2, column] -= sign * cross(arm, unit)
                A[column, 3 * body + k] += sign
                A[column, 3 * body + 2] += sign * (-arm[1], arm[0])[k]
    A[9:11, 56], A[33:35, 56] = n, -n  # p n acts on the particle, -p n on the fourth rod
    A[56, 33:35], A[56, 9:11], r[56] = n, -n, 1.0
    solution = np.linalg.solve(A, r)
    return solution[:36].reshape(12, 3), solution[36:56].reshape(10, 2), solution[56]


def test_impulse_and_velocities_are_those_of_the_free_bodies(struck, free_bodies):
    velocities, _, p = free_bodies
    assert struck.impulses["impact"]["normal"].value == pytest.approx(p, rel=1e-12)
    after = {name: value.value for name, value in struck.after.items()}
    assert (after["u_x"], after["u_y"]) == pytest.approx(tuple(velocities[11, :2]), abs=1e-12)
    turning = np.cumsum([after[f"u_phi{k}"] for k in range(1, 12)])
    np.testing.assert_allclose(turning, velocities[:11, 2], atol=1e-12)


def test_hinges_transmit_the_impulses_of_the_free_bodies(struck, free_bodies):
    """Told on the child, the rod with the higher number, in the axes of the lower one."""
    for h, on_lower in enumerate(free_bodies[1]):
        told = [struck.joint_impulses[f"hinge{h + 1}"][name].value for name in ("fx", "fy")]
        c, s = np.cos(ANGLES[h]), np.sin(ANGLES[h])
        np.testing.assert_allclose(np.array([[c, -s], [s, c]]) @ told, -on_lower, atol=1e-12)


def test_the_impact_keeps_momenta_and_energy(free_bodies, struck, places):
    velocities, centres = free_bodies[0], np.vstack([places[0], places[0][3]])
    n = places[0][3] / RADIUS
    np.testing.assert_allclose(velocities[:, :2].sum(axis=0), -n, atol=1e-12)
    moment = sum(cross(c, v[:2]) for c, v in zip(centres, velocities, strict=True)) + velocities[:11, 2].sum() / 12
    assert moment == pytest.approx(0.0, abs=1e-12)
    energy = (velocities[:, :2] ** 2).sum() / 2 + (velocities[:11, 2] ** 2).sum() / 24
    assert energy == pytest.approx(0.5, rel=1e-12)
    assert struck.energy_lost.value == pytest.approx(0.0, abs=1e-12)
    assert struck.opening["impact"].value == pytest.approx(1.0, rel=1e-12)


def test_centres_of_neighbours_are_on_a_line_through_their_hinge(struck, places):
    centres = [np.array(struck.instantaneous_centres[f"rod{k}"]["centre"]) for k in range(1, 12)]
    for first, second, hinge in zip(centres, centres[1:], places[1], strict=False):
        a, b = first - hinge, second - hinge
        assert abs(cross(a, b)) <= 1e-12 * np.hypot(*a) * np.hypot(*b)


def test_the_chain_meets_itself_and_keeps_its_momenta_and_energy(struck):
    """The run begins after the impact of the particle and goes on through that of the chain's end."""
    run = mbs.simulate(SYSTEM, samples=301)
    assert [run[name][0] for name in struck.after] == pytest.approx([x.value for x in struck.after.values()], abs=1e-12)
    began, met = run.events
    assert (began["t"], began["kind"]) == (0.0, "impact")
    assert (met["element"], met["kind"]) == ("meet", "impact")
    assert met["t"] == pytest.approx(11.254, abs=1e-3)
    assert met["impulse"] > 0.1
    assert np.ptp(run.energy) < 1e-10
    phi = np.cumsum([run[f"phi{k}"] for k in range(1, 12)], axis=0)
    turning = np.cumsum([run[f"u_phi{k}"] for k in range(1, 12)], axis=0)
    along = np.stack([np.cos(phi), np.sin(phi)], axis=1)
    across = np.stack([-np.sin(phi), np.cos(phi)], axis=1) * turning[:, None]
    starts = np.array([run["x1"], run["y1"]]) + np.vstack([np.zeros((1, *along[0].shape)), np.cumsum(along, axis=0)])
    rates = np.array([run["u_x1"], run["u_y1"]]) + np.vstack(
        [np.zeros((1, *along[0].shape)), np.cumsum(across, axis=0)]
    )
    centres, speeds = starts[:11] + along / 2, rates[:11] + across / 2
    particle, speed = np.array([run["x"], run["y"]]), np.array([run["u_x"], run["u_y"]])
    momentum = speeds.sum(axis=0) + speed
    moment = sum(cross(c, v) for c, v in zip(centres, speeds, strict=True)) + turning.sum(axis=0) / 12
    moment = moment + cross(particle, speed)
    assert np.ptp(momentum, axis=1).max() < 1e-10
    assert np.ptp(moment) < 1e-10
