"""How does mass that leaves or joins a body act on it (Meshchersky)? The body moves like the rigid one of the instant.

    m a_C = F + Phi,    J omega' + omega x J omega = M_C + M_Phi

a_C is the acceleration of the body's point at which the centre of mass is, m and J are those of the instant. Where each
particle leaves or joins where the declared mass loses or gains it, Phi = m' u, with the moment (m c)' x u about the
origin, u the relative velocity; at rest in space, or at any velocity a of its own, u = a - v of each particle's place.

Where all of it passes one point P, what is lost elsewhere flows there: with d = P - c and p = m c' - m' d, the momentum
of that flow in the body (control volume; no swirl about the centre of mass),

    Phi = m' u - 2 omega x p - p',    M_Phi = d x m' u + m' d x (omega x d) - J' omega - c' x p

of which the second and the third term of the moment are the jet damping of a rocket; primes are rates in body axes.
Source: Meshchersky 1897 for Phi; the control volume is Reynolds' transport theorem on force and moment of momentum.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Final

from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.mechanics.load_records import Load, MassFlow
from multibody_sym.mechanics.mechanism import TIME, Mechanism, TreeBody
from multibody_sym.mechanics.motion import Motion, coordinate_rates
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.model.bodies import Mass
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import tangents
from multibody_sym.scalars.node import ONE, Node, as_node, slot
from multibody_sym.scalars.vectors import (
    Mat,
    S,
    Vec,
    add,
    apply,
    apply_transposed,
    cross,
    dot,
    scale,
    subtract,
    symmetric,
)

# ----------------------------------------------------------------------------------------------------------------------
# How fast a body's mass, centre of mass and inertia change, and momentum and energy by that alone.

Spatial = tuple[Vec, Vec]
"""(linear, angular) in body axes, about the body's origin."""
_ONCE: Final = 1


@dataclass(frozen=True)
class MassRates:
    """Rates in body axes: of the mass `m`, of m c (`static`), of the centre of mass c and of the inertia about it."""

    mass: S
    static: Vec
    centre: Vec
    inertia: Mat


def varies(body: TreeBody) -> bool:
    """Return whether a body's mass, centre of mass or inertia changes along a motion."""
    return bool(body.mass.moving_leaves)


def varies_with_time(body: TreeBody) -> bool:
    """Return whether they change though nothing moves."""
    return TIME in body.mass.moving_leaves


def verify_kept(mechanism: Mechanism) -> None:
    """Raise NoSolutionError where a mass changes with the time: nothing is at rest for long then."""
    for body in filter(varies_with_time, mechanism.bodies):
        raise NoSolutionError(
            f"the mass of {body.name} changes with the time, so that what rests at t = 0 may not go on resting; find "
            "equilibria with a constant mass, or one that depends on coordinates alone",
            where=Where(path=("bodies", body.name)),
            number="N110",
        )


def mass_rates(motion: Motion, index: int) -> MassRates:
    """Return the rates of a body's mass at a state."""
    mechanism = motion.mechanism
    mass = mechanism.bodies[index].mass
    named = mass.moving_leaves
    along: dict[Node, Node] = {TIME: ONE} if TIME in named else {}  # the rates of the time and of coordinates in slots
    if any(leaf.data[0] == "q" for leaf in named):
        q = [slot("q", k) for k in range(len(mechanism.coordinates))]
        u = [slot("u", k) for k in range(len(mechanism.speeds))]
        rates = map(as_node, coordinate_rates(mechanism, q, u))
        along.update((leaf, rate) for leaf, rate in zip(q, rates, strict=True) if leaf in named)
    m, sx, sy, sz, cx, cy, cz, *J = motion.state.values(_rates(mass, tuple(along.items()), _ONCE))
    return MassRates(m, (sx, sy, sz), (cx, cy, cz), symmetric(J))


@lru_cache(maxsize=1024)
def _rates(mass: Mass, along: tuple[tuple[Node, Node], ...], times: int) -> tuple[Node, ...]:
    """Return time derivatives of m, m c, c and the inertia, given the rates of the leaves that they name."""
    found = [mass.mass, *(mass.mass * x for x in mass.com), *mass.com, *mass.inertia]
    for _ in range(times):
        found = tangents(found, dict(along))
    return tuple(found)


def carried_momentum(motion: Motion, index: int) -> Spatial:
    """Return the rate at which the momentum of a body, and that about its origin, change with its mass alone.

    That is (dI/dt) V of the spatial inertia I, the velocities V held.
    """
    rates, mass, moved = mass_rates(motion, index), motion.masses[index], motion.bodies[index]
    w, v_com = moved.w_WB, add(moved.v_WB, cross(moved.w_WB, mass.com))
    force = add(scale(rates.mass, v_com), scale(mass.mass, cross(w, rates.centre)))
    turning = add(apply(rates.inertia, w), scale(mass.mass, cross(rates.centre, v_com)))
    return force, add(turning, cross(mass.com, force))


def carried_energy(motion: Motion, index: int) -> S:
    """Return the rate at which the kinetic energy of a body changes with its mass alone: V . (dI/dt) V / 2."""
    moved, (linear, angular) = motion.bodies[index], carried_momentum(motion, index)
    return (dot(moved.v_WB, linear) + dot(moved.w_WB, angular)) / 2


def carried_by_flows(motion: Motion, loads: Iterable[Load]) -> S:
    """Return the rate at which T + V change with the masses of bodies alone, of those loads that are flows of mass."""
    flows = [load.body for load in loads if isinstance(load, MassFlow)]
    return sum((carried_energy(motion, k) + carried_weight(motion, k) for k in flows), 0)


def carried_weight(motion: Motion, index: int) -> S:
    """Return the rate at which the potential energy of a body's weight changes with its mass alone."""
    rates, (R, p) = mass_rates(motion, index), motion.poses[index]
    return -dot(motion.gravity, add(scale(rates.mass, p), apply(R, rates.static)))


def flow_wrench(flow: MassFlow, motion: Motion) -> Spatial:
    """Return force and moment (body axes, about the origin) of mass that leaves or joins a body."""
    velocity = motion.state.vector(flow.velocity)
    if flow.axes != flow.body:
        world = apply(motion.rotation(flow.axes), velocity)
        velocity = apply_transposed(motion.rotation(flow.body), world)
    if flow.at is not None:
        return _wrench_through(flow.at, velocity, flow.relative, motion)
    rates = mass_rates(motion, flow.body)
    force, moment = scale(rates.mass, velocity), cross(rates.static, velocity)
    if flow.relative:
        return force, moment
    carried = carried_momentum(motion, flow.body)
    return subtract(force, carried[0]), subtract(moment, carried[1])


def _wrench_through(at: Marker, velocity: Vec, relative: bool, motion: Motion) -> Spatial:
    rates, mass, moved = mass_rates(motion, at.body), motion.masses[at.body], motion.bodies[at.body]
    w, point = moved.w_WB, motion.point(at)
    u = velocity if relative else subtract(velocity, add(moved.v_WB, cross(w, point)))
    d = subtract(point, mass.com)
    inner = subtract(rates.static, scale(rates.mass, point))
    declared = motion.mechanism.bodies[at.body].mass  # it varies with the time alone
    mass_rate_2, x, y, z, *_ = motion.state.values(_rates(declared, ((TIME, ONE),), _ONCE + 1))
    growing = subtract((x, y, z), scale(mass_rate_2, point))
    thrust = scale(rates.mass, u)
    force = subtract(subtract(thrust, scale(2, cross(w, inner))), growing)
    damping = subtract(scale(rates.mass, cross(d, cross(w, d))), apply(rates.inertia, w))
    about_com = subtract(add(cross(d, thrust), damping), cross(rates.centre, inner))
    return force, add(about_com, cross(mass.com, force))

