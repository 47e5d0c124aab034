"""Masses and inertias that bodies can have, those that are welded to each other taken as one.

A distribution of mass exists where neither the mass nor E = tr(J)/2 - J is negative, E the integral of r r^T dm about
the centre of mass: then no principal moment of J is negative, and none more than the sum of the others. What is taken
out of a body, a hole, is a body of negative mass that is welded to it.

Declared inertias are often incomplete, for in the plane one moment is enough. A body that declares some of its moments
leaves the others open, and judged is what it does about axes normal to theirs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from multibody_sym.dynamics.start.undefined import value_or_none
from multibody_sym.errors import ModelError, at
from multibody_sym.kinematics.masses.rates import varies
from multibody_sym.kinematics.motion import body_mass, body_motion, moving_parent
from multibody_sym.kinematics.state import State, state_of
from multibody_sym.model.mechanism.mass import GROUND
from multibody_sym.model.mechanism.mechanism import Mechanism, TreeBody
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import TYPED, null_space
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO, slot
from multibody_sym.scalars.vectors import ZERO_VECTOR

_ROUNDING: Final = 1e-6
"""Relative: inertias are written with few digits, and the moments of a thin plate add up exactly."""
_CANCELLED: Final = 1e-9
"""Of the masses added and taken away: nothing is left."""


@dataclass(frozen=True)
class _Part:
    """A body among those welded to each other, in the axes of the first: its mass, centre of mass and inertia about it.

    `open` (3, k): directions about which it declares no moment, though it does about others.
    """

    name: str
    mass: float
    com: Floats
    inertia: Floats
    open: Floats


def verify_masses(mechanism: Mechanism, parameters: Sequence[float]) -> None:
    """Raise ModelError at the first body, with what is welded to it, that has a mass or inertia which no body has.

    The path ends with the field that is wrong, where it is one body's.
    """
    for parts in _welded(mechanism, parameters):
        if parts[0].name != GROUND and not _is_particle(parts):
            worst = min(parts, key=lambda part: part.mass)
            with at("bodies", worst.name if worst.mass < 0.0 else parts[0].name):
                _verify(parts)


def verify_apart(mechanism: Mechanism, parameters: Sequence[float]) -> None:
    """Raise ModelError at the first body that can be only with what it is welded to, as a hole: alone it is no body."""
    for parts in _welded(mechanism, parameters):
        for part in parts if parts[0].name != GROUND else ():
            try:
                _verify([part])
            except ModelError:
                with at("bodies", part.name):
                    raise ModelError(
                        f"{part.name} counts only together with {parts[0].name}, to which it is welded, and absolute "
                        "coordinates move every body by itself: choose coordinates: relative",
                        number="M119",
                    ) from None


def holes(mechanism: Mechanism, parameters: Sequence[float]) -> Iterator[tuple[str, str]]:
    """Yield the bodies of negative mass, each with the first of those that it is welded to."""
    for parts in _welded(mechanism, parameters):
        yield from ((part.name, parts[0].name) for part in parts[1:] if part.mass < 0.0)


def _welded(mechanism: Mechanism, parameters: Sequence[float]) -> list[list[_Part]]:
    """Return the bodies that move, those welded to each other together."""
    still = _coordinates(mechanism, parameters), [0.0] * len(mechanism.speeds)
    state = state_of(mechanism, float, 0.0, *still, parameters, [0.0] * len(mechanism.inputs))
    groups: dict[int, list[_Part]] = {}
    first: list[int] = []
    poses: list[tuple[Floats, Floats]] = []
    for index, body in enumerate(mechanism.bodies):
        if body.steps:
            first.append(index)
            poses.append((np.eye(3), np.zeros(3)))
        else:
            onto = first[body.parent] if body.parent >= 0 else -1
            first.append(onto)
            poses.append(_pose(body, state, poses[body.parent] if onto >= 0 else (np.eye(3), np.zeros(3))))
        if first[index] >= 0:
            groups.setdefault(first[index], []).append(_part(body, state, poses[index]))
    return list(groups.values())


def _coordinates(mechanism: Mechanism, parameters: Sequence[float]) -> list[float]:
    """Return the declared coordinates (nq) where masses name them; what has no value there is zero, as all is else."""
    if not any(varies(body) for body in mechanism.bodies):
        return [0.0] * len(mechanism.coordinates)
    known = {slot("parameters", k): x for k, x in enumerate(parameters)}
    return [value_or_none(c.initial, known) or 0.0 for c in mechanism.coordinates]


def _pose(body: TreeBody, state: State, parent: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Return rotation and position of a welded body, given those of its parent."""
    moved = body_motion(body, moving_parent(ZERO_VECTOR, ZERO_VECTOR, ZERO_VECTOR), state)
    rotation, position = (np.array(x, dtype=float) for x in (moved.R_PB, moved.p_PB))
    return parent[0] @ rotation, parent[1] + parent[0] @ position


def _part(body: TreeBody, state: State, pose: tuple[Floats, Floats]) -> _Part:
    rotation, position = pose
    mass = body_mass(body, state)
    inertia = np.array(mass.inertia, dtype=float)
    declared = any(x is not ZERO for x in body.mass.inertia)
    missing = [k for k in range(3) if declared and body.mass.inertia[k] is ZERO]
    return _Part(
        body.name,
        float(mass.mass),
        position + rotation @ np.array(mass.com, dtype=float),
        rotation @ inertia @ rotation.T,
        rotation[:, missing],
    )


def _is_particle(parts: Sequence[_Part]) -> bool:
    """Return whether it is one body, of a mass that can be and without inertia: there is nothing to judge."""
    return len(parts) == 1 and 0.0 <= parts[0].mass < np.inf and not parts[0].inertia.any()


def _verify(parts: Sequence[_Part]) -> None:
    masses = np.array([part.mass for part in parts])
    mass, added = float(masses.sum()), float(np.abs(masses).sum())
    together = f" together with {', '.join(part.name for part in parts[1:])}" if len(parts) > 1 else ""
    whose = f"{parts[0].name}{together}"
    if mass < -_CANCELLED * added:
        advice = "correct it" if together else "a hole is welded (type: fixed) to the body that it is taken out of"
        told = ModelError(f"the mass of {whose} is {mass:g} kg; no mass is negative: {advice}", number="M109")
        raise told.under("mass")
    if not added > 0.0:
        mass = 1.0  # the centre is that of nothing
    elif mass <= _CANCELLED * added:
        _verify_balance(parts, whose)
        mass, masses = 1.0, np.full(len(parts), 1.0 / len(parts))  # any centre is as good as another
    _verify_inertia(parts, whose, (masses / mass) @ np.array([part.com for part in parts]))


def _verify_balance(parts: Sequence[_Part], whose: str) -> None:
    """Raise ModelError where masses cancel each other, but not their static moments."""
    masses, centres = np.array([part.mass for part in parts]), np.array([part.com for part in parts])
    sizes = np.abs(masses)
    amid = sizes @ centres / sizes.sum()  # about a point near, as masses cancel but for rounding
    moment = float(np.linalg.norm(masses @ (centres - amid)))
    if moment > _ROUNDING * float(sizes @ np.linalg.norm(centres, axis=1)):
        raise ModelError(
            f"the mass of {whose} is 0, but not its static moment: {moment:.6g} kg m; no body has "
            "this: correct a mass, or let the centres of mass meet",
            number="M118",
        )


def _verify_inertia(parts: Sequence[_Part], whose: str, centre: Floats) -> None:
    """Raise ModelError where inertias about a common centre of mass are no body's."""
    total, added = np.zeros((3, 3)), 0.0
    for part in parts:
        way = part.com - centre
        shift = part.mass * (way @ way * np.eye(3) - np.outer(way, way))
        total += part.inertia + shift
        added += float(np.abs(part.inertia).max() + np.abs(shift).max())
    judged = _normal(np.hstack([part.open for part in parts]))
    moments = np.linalg.eigvalsh(judged.T @ total @ judged)
    named = ", ".join(f"{x:g}" for x in moments)
    principal = "principal moments of inertia" if len(moments) == 3 else "moments of inertia"
    if moments.min(initial=0.0) < -_ROUNDING * added:
        negative = ModelError(
            f"the {principal} of {whose} are {named} kg m^2 about the centre of mass; none is negative", number="M109"
        )
        raise negative if parts[1:] else negative.under("inertia")
    if len(moments) == 3 and moments[2] - moments[1] - moments[0] > _ROUNDING * added:
        excessive = ModelError(
            f"the {principal} of {whose} are {named} kg m^2 about the centre of mass; of no body is one more than the "
            "sum of the others: correct them, or leave out those that do not matter in the plane",
            number="M118",
        )
        raise excessive if parts[1:] else excessive.under("inertia")


def _normal(directions: Floats) -> Floats:
    """Return an orthonormal basis (3, k) of what is normal to directions (3, n)."""
    return null_space(directions.T, TYPED) if directions.size else np.eye(3)
