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

from multibody_sym.kinematics.masses.rates import Spatial, carried_momentum, mass_rates, second_rates
from multibody_sym.kinematics.motion import Motion
from multibody_sym.model.mechanism.loads import MassFlow
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.scalars.vectors import S, Vec, add, apply, apply_transposed, cross, scale, subtract


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
