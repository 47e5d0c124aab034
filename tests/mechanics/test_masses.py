"""What leaves or joins a body of variable mass exerts on it, against particles that carry momentum away one by one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from multibody_sym.mechanics.forces import applied_forces, carried_energy, carried_momentum, carried_weight
from multibody_sym.mechanics.motion import Motion, motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body, VariableMass
from multibody_sym.model.joints import Free
from multibody_sym.model.system import System

RNG = np.random.default_rng(4)
V, W = RNG.normal(size=3), RNG.normal(size=3)
TIME = 0.7
PLACES = RNG.normal(size=(6, 3))
FIRST, RATE = RNG.uniform(1, 2, 6), RNG.uniform(-1, 1, 6)
"""Particles on the body, whose masses are FIRST + RATE t."""


def moving(body: Body, w: Any = W) -> Motion:
    """Return the motion of a free body with its axes along ground's at the time, at V and w (body axes)."""
    system = System("free", gravity=[1, -9, 2], bodies={"b": body}, joints={"j": Free("ground", "b")})
    resolved = mechanism(system)
    state = state_of(resolved, float, TIME, [0.3, 0.2, -0.4, 1, 0, 0, 0], [*V, *w], [])
    return motion_of(resolved, state)


def body_of_particles(**mass: Any) -> Body:
    """Return the body whose mass, centre and inertia are those of the particles, as expressions of t."""
    m = " + ".join(f"({a} + ({b})*t)" for a, b in zip(FIRST, RATE, strict=True))
    statics = [
        " + ".join(f"({a} + ({b})*t)*({x})" for a, b, x in zip(FIRST, RATE, PLACES[:, k], strict=True))
        for k in range(3)
    ]
    com = [f"({s})/({m})" for s in statics]
    inertia = {}
    for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
        moments = [r @ r * (i == j) - r[i] * r[j] for r in PLACES]
        origin = " + ".join(f"({a} + ({b})*t)*({x})" for a, b, x in zip(FIRST, RATE, moments, strict=True))
        c = "+".join(f"({x})^2" for x in com) if i == j else "0"
        inertia[f"I{'xyz'[i]}{'xyz'[j]}"] = f"{origin} - ({m})*({c} - ({com[i]})*({com[j]}))"
    return Body(mass=VariableMass(m, **mass), com=com, inertia=inertia)


def wrench(motion: Motion) -> tuple[Any, Any]:
    force, moment = applied_forces(motion, weight=False).of_body[0]
    return np.array(force), np.array(moment)


def test_every_particle_that_leaves_takes_its_own_velocity() -> None:
    u = RNG.normal(size=3)
    relative = wrench(moving(body_of_particles(relative_velocity=list(u))))
    expected = sum(b * u for b in RATE), sum(np.cross(r, b * u) for b, r in zip(RATE, PLACES, strict=True))
    np.testing.assert_allclose(relative, expected, rtol=0, atol=1e-12)


def test_what_is_at_rest_in_space_is_caught_by_each_place_of_the_body() -> None:
    a = RNG.normal(size=3)
    found = wrench(moving(body_of_particles(absolute_velocity=list(a))))
    each = [b * (a - V - np.cross(W, r)) for b, r in zip(RATE, PLACES, strict=True)]
    expected = sum(each), sum(np.cross(r, f) for f, r in zip(each, PLACES, strict=True))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_momentum_and_energy_that_the_mass_alone_takes() -> None:
    motion = moving(body_of_particles(relative_velocity=[0, 0, 0]))
    speeds = [V + np.cross(W, r) for r in PLACES]
    each = [b * v for b, v in zip(RATE, speeds, strict=True)]
    expected = sum(each), sum(np.cross(r, f) for f, r in zip(each, PLACES, strict=True))
    np.testing.assert_allclose(carried_momentum(motion, 0), expected, rtol=0, atol=1e-12)
    energy = sum(b * v @ v / 2 for b, v in zip(RATE, speeds, strict=True))
    assert carried_energy(motion, 0) == pytest.approx(energy, rel=1e-12)
    g, origin = np.array([1, -9, 2]), np.array([0.3, 0.2, -0.4])
    lifted = -sum(b * g @ (origin + r) for b, r in zip(RATE, PLACES, strict=True))
    assert carried_weight(motion, 0) == pytest.approx(lifted, rel=1e-12)


# --- all that leaves passes one point, and flows there through a pipe in the body ------------------------------------


class Pipe:
    """Gas in a straight pipe of the body that flows to its open end x = 0, and a shell about the pipe's line.

    Density lambda = A(t) (2 + x^2), closed at x = L; continuity gives the flow. The shell has its own mass and inertia.
    """

    direction = np.array([1.0, 2.0, -2.0]) / 3
    start = np.array([0.4, -0.1, 0.3])
    length, shell = 1.3, 2.5
    inertia = np.diag([0.7, 0.9, 1.1])
    shell_at = 0.5

    def amount(self, t: float) -> tuple[float, float, float]:
        """Return A and its two rates."""
        return 1.5 - 0.4 * t + 0.1 * t * t, -0.4 + 0.2 * t, 0.2

    def at(self, x: Any, t: float) -> tuple[Any, Any, Any]:
        """Return the density, the relative velocity (along the pipe) and the relative acceleration of the gas."""
        A, A1, A2 = self.amount(t)
        shape, L = 2 + x**2, self.length
        ahead = (2 * L + L**3 / 3) - (2 * x + x**3 / 3)  # f(x) = A' times the shape beyond x, f(L) = 0
        v = A1 / A * ahead / shape
        v_t = (A2 / A - (A1 / A) ** 2) * ahead / shape
        v_x = A1 / A * (-1 - ahead * 2 * x / shape**2)
        return A * shape, v, v_t + v * v_x

    def body(self, u: str) -> Body:
        A, L, e, p = "(1.5 - 0.4*t + 0.1*t^2)", self.length, self.direction, self.start
        first, second = 2 * L + L**3 / 3, L**2 + L**4 / 4
        third = 2 * L**3 / 3 + L**5 / 5
        m = f"({A}*{first} + {self.shell})"
        along = f"(({A}*{second} + {self.shell * self.shell_at})/{m})"
        across = f"({A}*{third} + {self.shell * self.shell_at**2} - {m}*{along}^2)"
        com = [f"{p[k]} + ({e[k]})*{along}" for k in range(3)]
        inertia = {
            f"I{'xyz'[i]}{'xyz'[j]}": f"{self.inertia[i, j]} + ({float(i == j) - e[i] * e[j]})*{across}"
            for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
        }
        flow = VariableMass(m, relative_velocity=[f"({u})*({x})" for x in e], at="mouth")
        return Body(mass=flow, com=com, inertia=inertia, points={"mouth": list(p)})


def test_flow_inside_and_jet_damping_are_those_of_gas_in_a_pipe() -> None:
    pipe, a, alpha = Pipe(), RNG.normal(size=3), RNG.normal(size=3)
    _, v_out, _ = pipe.at(0.0, TIME)
    motion = moving(pipe.body(repr(float(v_out))))
    x, weights = np.polynomial.legendre.leggauss(30)
    x, weights = (x + 1) * pipe.length / 2, weights * pipe.length / 2
    density, v, growing = pipe.at(x, TIME)
    force, moment = np.zeros(3), np.zeros(3)
    for dm, xi, vi, ai in zip(density * weights, x, v, growing, strict=True):
        r = pipe.start + xi * pipe.direction
        carried = a + np.cross(alpha, r) + np.cross(W, np.cross(W, r))
        pull = dm * (carried + 2 * np.cross(W, vi * pipe.direction) + ai * pipe.direction)
        force, moment = force + pull, moment + np.cross(r, pull)
    r = pipe.start + pipe.shell_at * pipe.direction
    pull = pipe.shell * (a + np.cross(alpha, r) + np.cross(W, np.cross(W, r)))
    force, moment = force + pull, moment + np.cross(r, pull)
    moment += pipe.inertia @ alpha + np.cross(W, pipe.inertia @ W)
    mass = motion.masses[0]
    c, J = np.array(mass.com), np.array(mass.inertia)
    solid = mass.mass * (a + np.cross(alpha, c) + np.cross(W, np.cross(W, c)))
    about = np.cross(c, solid) + J @ alpha + np.cross(W, J @ W)
    found = wrench(motion)
    np.testing.assert_allclose(found[0], solid - force, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found[1], about - moment, rtol=0, atol=1e-12)
