"""How each kind of step moves a body, over floats, Nodes and sympy: pose, velocity, rates, and what it leaves alone.

What a kind is, and what the model asks of it, is said in `model/declaration/steps.py`; a new kind registers here how
it moves. Steps of one coordinate whose rate is their speed have the rest in common.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import singledispatch
from typing import Any, Final

import numpy as np

from multibody_sym.kinematics.joints import JointMotion, Way, followed, rotated, screwed, translated, turned_along
from multibody_sym.kinematics.state import State
from multibody_sym.model.declaration.curves.follow import Follow, Rates
from multibody_sym.model.declaration.steps import Ball, OneCoordinate, Rotate, Screw, Step, Translate
from multibody_sym.model.declaration.values import Point
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scalars.node import ONE, ZERO, Node
from multibody_sym.scalars.rotations import quaternion_product, quaternion_rates, quaternion_rotation, turned, turned_by
from multibody_sym.scalars.vectors import UNIT_MATRIX, S, Vec, combination, cross

_UP: Final[Vec] = (0, 0, 1)
_UNITS: Final[tuple[Point, ...]] = ((ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE))


# --- motion --------------------------------------------------------------------------------------------------------


@singledispatch
def stepped(step: Step, before: JointMotion, q: Sequence[S], u: Sequence[S], state: State) -> JointMotion:
    """Return the motion of M when a step has followed those `before`, at its coordinates q and speeds u."""
    raise TypeError(f"nothing says how {type(step).__name__} moves a body")


@stepped.register
def _(step: Translate, before: JointMotion, q: Sequence[S], u: Sequence[S], state: State) -> JointMotion:
    return translated(before, _axis(step.axis, state), q[0], u[0])


@stepped.register
def _(step: Rotate, before: JointMotion, q: Sequence[S], u: Sequence[S], state: State) -> JointMotion:
    axis = _axis(step.axis, state)
    return rotated(before, turned(axis, q[0]), (axis,), u)


@stepped.register
def _(step: Screw, before: JointMotion, q: Sequence[S], u: Sequence[S], state: State) -> JointMotion:
    return screwed(before, _axis(step.axis, state), state.values([step.lead])[0], q[0], u[0])


@stepped.register
def _(step: Ball, before: JointMotion, q: Sequence[S], u: Sequence[S], state: State) -> JointMotion:
    return rotated(before, quaternion_rotation(q), UNIT_MATRIX, u)


@stepped.register
def _(step: Follow, before: JointMotion, q: Sequence[S], u: Sequence[S], state: State) -> JointMotion:
    """Derivatives are taken of the expressions, so that all scalars have the same exact ones."""
    at = {step.leaf: q[0]}
    axes = [_axis(axis, state) for axis in step.axes]
    place = combination(axes, state.values(step.place, at))
    moved = followed(before, place, _way(step.rates, axes, state, at), u[0])
    if not step.turns_along:
        return moved
    cosine, sine = state.values(step.tangent, at)
    return turned_along(moved, turned_by(axes[2], cosine, sine), axes[2], _way(step.turning, (_UP,), state, at), u[0])


def _way(rates: Rates, axes: Sequence[Vec], state: State, at: Mapping[Node, S]) -> Way:
    """Return derivatives with their components along axes."""
    return Way(*(combination(axes, state.values(nodes, at)) for nodes in rates))


def _axis(declared: Point, state: State) -> Vec:
    x, y, z = state.values(declared)
    return x, y, z


@singledispatch
def step_rates(step: Step, q: Sequence[S], u: Sequence[S]) -> Sequence[S]:
    """Return the rates of a step's coordinates, qdot = N(q) u."""
    raise TypeError(f"nothing says how the coordinates of {type(step).__name__} follow its speeds")


@step_rates.register
def _(step: OneCoordinate, q: Sequence[S], u: Sequence[S]) -> Sequence[S]:
    return u


@step_rates.register
def _(step: Ball, q: Sequence[S], u: Sequence[S]) -> Sequence[S]:
    return quaternion_rates(q, u)


# --- what it leaves alone ------------------------------------------------------------------------------------------


@singledispatch
def invariant_directions(step: Step) -> tuple[Point, ...]:
    """Return the directions along which both frames may be moved together, and the step moves the body just so."""
    raise TypeError(f"nothing says which directions {type(step).__name__} leaves alone")


@invariant_directions.register
def _(step: Translate) -> tuple[Point, ...]:
    return _UNITS


@invariant_directions.register(Rotate)
@invariant_directions.register(Screw)
def _(step: Rotate | Screw) -> tuple[Point, ...]:
    return (step.axis,)


@invariant_directions.register
def _(step: Follow) -> tuple[Point, ...]:
    return (step.axis,) if step.turns_along else _UNITS


@invariant_directions.register
def _(step: Ball) -> tuple[Point, ...]:
    return ()


# --- deviations ----------------------------------------------------------------------------------------------------


@singledispatch
def displaced(step: Step, q: Floats, sigma: Floats) -> Floats:
    """Return a step's coordinates displaced by deviations, one for each speed: small ones move as its speeds do."""
    raise TypeError(f"nothing says how {type(step).__name__} is displaced")


@displaced.register
def _(step: OneCoordinate, q: Floats, sigma: Floats) -> Floats:
    return q + sigma


@displaced.register
def _(step: Ball, q: Floats, sigma: Floats) -> Floats:
    """Turn on by the rotation vector sigma."""
    angle = float(np.linalg.norm(sigma))
    part = 0.5 * np.sinc(angle / (2.0 * np.pi))
    found = np.array(quaternion_product(q.tolist(), [np.cos(angle / 2.0), *(part * sigma)]), dtype=float)
    unit: Floats = found / np.linalg.norm(found)
    return unit


@singledispatch
def deviation_suffixes(step: Step) -> tuple[str | None, ...]:
    """Return what follows the joint's name in those of deviations; None where one is that of a coordinate."""
    raise TypeError(f"nothing says what the deviations of {type(step).__name__} are called")


@deviation_suffixes.register
def _(step: OneCoordinate) -> tuple[str | None, ...]:
    return (None,)


@deviation_suffixes.register
def _(step: Ball) -> tuple[str | None, ...]:
    return (".rx", ".ry", ".rz")


@singledispatch
def carried_deviations(step: Step, u: Sequence[float]) -> Floats:
    """Return the matrix D of sigma' = D sigma + ..., what the motion itself makes of deviations."""
    raise TypeError(f"nothing says what motion makes of the deviations of {type(step).__name__}")


@carried_deviations.register
def _(step: OneCoordinate, u: Sequence[float]) -> Floats:
    return np.zeros((1, 1))


@carried_deviations.register
def _(step: Ball, u: Sequence[float]) -> Floats:
    """theta' = - omega x theta."""
    x, y, z = u
    return np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])


# --- Lagrange's equations ------------------------------------------------------------------------------------------


@singledispatch
def turning_momenta(step: Step, u: Sequence[Any], momenta: Sequence[Any]) -> Sequence[Any]:
    """Return what N^T (d/dt dT/dqdot - dT/dq) holds besides d/dt dT/du - N^T dT/dq: nothing where u = qdot."""
    raise TypeError(f"nothing says how Lagrange's equations hold in the speeds of {type(step).__name__}")


@turning_momenta.register
def _(step: OneCoordinate, u: Sequence[Any], momenta: Sequence[Any]) -> Sequence[Any]:
    return (0,)


@turning_momenta.register
def _(step: Ball, u: Sequence[Any], momenta: Sequence[Any]) -> Sequence[Any]:
    """Return omega x p.

    Of an angular velocity omega = 2 E(q) qdot, N = E^T / 2: with p = dT/domega, dT/dqdot = 2 E^T p, and the projection
    leaves N^T (d/dt (2 E^T) - (d(2 E qdot)/dq)^T) p = omega x p; the multiplier of |q| = 1 drops out because N^T q = 0.
    """
    x, y, z = u
    a, b, c = momenta
    return cross((x, y, z), (a, b, c))
