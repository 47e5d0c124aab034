"""What leaves or joins a body of variable mass exerts on it (Meshchersky), so that it moves like the rigid body it is.

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

from collections.abc import Iterable, Mapping
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
# How fast a body's mass, centre of mass and inertia change, and what that makes of momentum and energy by itself.


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
    m, sx, sy, sz, cx, cy, cz, *J = motion.state.values(_rates(mass, _along(mechanism, mass), _ONCE))
    return MassRates(m, (sx, sy, sz), (cx, cy, cz), symmetric(J))


def second_rates(motion: Motion, index: int) -> tuple[S, Vec]:
    """Return the second time derivatives of m and of m c (body axes) of a mass that varies with the time alone."""
    mass = motion.mechanism.bodies[index].mass
    m, x, y, z, *_ = motion.state.values(_rates(mass, ((TIME, ONE),), _ONCE + 1))
    return m, (x, y, z)


def _along(mechanism: Mechanism, mass: Mass) -> tuple[tuple[Node, Node], ...]:
    """Return the rates of the time and of the coordinates that a mass names, in slots."""
    named = mass.moving_leaves
    found: dict[Node, Node] = {TIME: ONE} if TIME in named else {}
    if any(leaf.data[0] == "q" for leaf in named):
        q, u = ([slot(x, k) for k in range(len(of))] for x, of in _sizes(mechanism).items())
        rates = map(as_node, coordinate_rates(mechanism, q, u))
        found.update((leaf, rate) for leaf, rate in zip(q, rates, strict=True) if leaf in named)
    return tuple(found.items())


def _sizes(mechanism: Mechanism) -> Mapping[str, tuple[object, ...]]:
    return {"q": mechanism.coordinates, "u": mechanism.speeds}


def _elements(mass: Mass) -> tuple[Node, ...]:
    """Return m, m c, c and the inertia."""
    return mass.mass, *(mass.mass * x for x in mass.com), *mass.com, *mass.inertia


@lru_cache(maxsize=1024)
def _rates(mass: Mass, along: tuple[tuple[Node, Node], ...], times: int) -> tuple[Node, ...]:
    found = list(_elements(mass))
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


# ----------------------------------------------------------------------------------------------------------------------

def flow_wrench(flow: MassFlow, motion: Motion) -> Spatial:
    """Return force and moment about the body's origin (body axes) that what leaves or joins exerts."""
    x, y, z = motion.state.values(flow.velocity)
    velocity = (x, y, z)
    if flow.axes != flow.body:
        world = apply(motion.rotation(flow.axes), velocity)
        velocity = apply_transposed(motion.rotation(flow.body), world)
    if flow.at is not None:
        return _through(flow.at, velocity, flow.relative, motion)
    rates = mass_rates(motion, flow.body)
    force, moment = scale(rates.mass, velocity), cross(rates.static, velocity)
    if flow.relative:
        return force, moment
    carried = carried_momentum(motion, flow.body)
    return subtract(force, carried[0]), subtract(moment, carried[1])


def _through(at: Marker, velocity: Vec, relative: bool, motion: Motion) -> Spatial:
    """Return the wrench of what passes a point of the body, with that of the flow inside."""
    rates, mass, moved = mass_rates(motion, at.body), motion.masses[at.body], motion.bodies[at.body]
    w, point = moved.w_WB, motion.point(at)
    u = velocity if relative else subtract(velocity, add(moved.v_WB, cross(w, point)))
    d = subtract(point, mass.com)
    inner = subtract(rates.static, scale(rates.mass, point))
    mass_rate_2, static_2 = second_rates(motion, at.body)
    growing = subtract(static_2, scale(mass_rate_2, point))
    thrust = scale(rates.mass, u)
    force = subtract(subtract(thrust, _twice(cross(w, inner))), growing)
    damping = subtract(scale(rates.mass, cross(d, cross(w, d))), apply(rates.inertia, w))
    about_com = subtract(add(cross(d, thrust), damping), cross(rates.centre, inner))
    return force, add(about_com, cross(mass.com, force))


def _twice(a: Vec) -> Vec:
    two: S = 2
    return scale(two, a)
