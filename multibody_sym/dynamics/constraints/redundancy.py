"""Dependent rows: the rank of the constraints at a state, which rows it leaves over, and what they make ambiguous."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.dynamics.constraints.left_over import Redundancy
from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.dynamics.programs.reactions import reactions
from multibody_sym.expressions.components import COMPONENTS
from multibody_sym.expressions.quantities import force_name
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.rows import constraint_jacobian
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import row_forces
from multibody_sym.model.mechanism.rows import RopeRow
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.dependence import NEGLIGIBLE, dependence, support
from multibody_sym.numerics.rank import CLOSED, last_share, scaled_rows
from multibody_sym.numerics.rank import rank as rank_of
from multibody_sym.records import dataclass

_SHARE: Final = 0.1


def redundancy(motion: Motion, dynamics: TreeDynamics) -> Redundancy:
    """Return the rank of the rows at a state over floats, judged as the solver judges it (H G^-1 with M = G^T G).

    Rows that have a share in an idle combination of multipliers, and joints that it loads, have forces that are not
    unique.
    """
    restrict = restricting(dynamics)
    if not restrict.rows:
        return Redundancy(0, (), ())
    found = dependence(_weighted(restrict, constraint_jacobian(restrict.rows)))
    idle, names = idle_combinations(dynamics), dynamics.row_names
    shared = {k for combination in idle for k in support(combination)}
    loaded = _ambiguous(motion, dynamics, idle)
    of_joints = {k for cut in motion.mechanism.cuts for k in cut.rows}
    joints = [body.joint_name for body in motion.mechanism.bodies if body.joint_name in loaded]
    doubles = doubles_of(motion.mechanism)
    return Redundancy(
        found.rank - sum(doubles.values()),
        tuple(restrict.row_names[k] for k in found.left_over),
        (*(names[k] for k in sorted(shared)), *joints),
        tuple(tuple(restrict.row_names[k] for k in support(circuit)) for circuit in found.circuits),
        {**{names[k]: () for k in sorted(shared - of_joints)}, **loaded},
        doubles,
        tuple(dict.fromkeys(_named(motion.mechanism, {names[k] for k in shared - of_joints}, loaded))),
    )


def _named(
    mechanism: Mechanism, rows: Collection[str], loaded: Mapping[str, Sequence[str]]
) -> Iterator[str]:
    """Yield the names of the forces of rows and of joints' components."""
    one_way = {row: pair for element in mechanism.one_way for row, *pair in row_forces(element)}
    for row in (row for row in mechanism.rows if row.name in rows):
        if row.name in one_way:
            yield force_name(*one_way[row.name])
        elif isinstance(row, RopeRow):
            yield from (force_name(row.told[0], component) for component in row.components)
        else:
            yield force_name(row.name, "tension" if row.multiplier == "rod" else "multiplier")
    yield from (force_name(joint, component) for joint, components in loaded.items() for component in components)


def idle_combinations(dynamics: TreeDynamics) -> list[Floats]:
    """Return combinations y (s) of multipliers, of length one, that exert nothing and define no other: C^T y = D y = 0.

    Multipliers and what hangs on them are unique where no such combination changes them. C is H for rows without
    friction, D their coupling; rows that define a force are as long as what its unit exerts.
    """
    if not dynamics.rows:
        return []
    friction = dynamics.friction
    exerted = _weighted(dynamics, [row.forces for row in dynamics.rows])
    if friction is not None:
        lengths = scaled_rows(exerted)[0]
        exerted = np.hstack([exerted, np.array(friction.coupling, dtype=float).T * lengths])
    lengths = scaled_rows(exerted)[0]
    return [_unit(circuit / lengths) for circuit in dependence(exerted).circuits]


def restricting(dynamics: TreeDynamics) -> TreeDynamics:
    """Return the dynamics with those rows alone that restrict motion; others define forces."""
    if all(row.kinematic for row in dynamics.rows):
        return dynamics
    kept = [(row, name) for row, name in zip(dynamics.rows, dynamics.row_names, strict=True) if row.kinematic]
    return replace(dynamics, rows=[row for row, _ in kept], row_names=tuple(name for _, name in kept))


def doubles_of(mechanism: Mechanism) -> dict[str, int]:
    """Return the joints whose coordinates massless doubles keep, with their speeds, and as many rows that hold them."""
    return {body.joint_name: len(body.u) for body in mechanism.bodies if body.is_double}


@dataclass(frozen=True)
class Dependence:
    """The rows that come nearest to dependence, or to vanishing, as rows of unit length.

    `independence` is 1 for rows across each other, 0 for dependent ones.
    """

    names: tuple[str, ...]
    independence: float


def nearly_dependent(dynamics: TreeDynamics, independent: int) -> Dependence:
    """Return which rows come nearest to dependence where so many of all are independent anywhere.

    Rows that define their force take no part; they count among the independent ones.
    """
    own = [k for k, row in enumerate(dynamics.rows) if row.kinematic]
    matrix = scaled_rows(_weighted(dynamics, constraint_jacobian(dynamics.rows)))[1][own]
    count = min(max(independent - (len(dynamics.rows) - len(own)), 1), *matrix.shape)
    shares, independence = last_share(matrix, count)
    names = [dynamics.row_names[k] for k in own]
    named = tuple(name for name, share in zip(names, shares, strict=True) if share > _SHARE)
    return Dependence(named, independence)


def losing_rank(here: TreeDynamics, beside: TreeDynamics, rank: int) -> tuple[str, ...]:
    """Return the rows that depend on each other, or vanish, here and do not beside, where the rank is the greater."""
    found = dependence(_weighted(here, constraint_jacobian(here.rows)))
    unit = scaled_rows(_weighted(beside, constraint_jacobian(beside.rows)))[1]
    losing = {k for circuit in found.circuits if _independent(unit[list(support(circuit))]) for k in support(circuit)}
    return tuple(here.row_names[k] for k in sorted(losing)) or nearly_dependent(here, rank).names


def _independent(rows: Floats) -> bool:
    return rank_of(rows, CLOSED) == len(rows)


def approximate_rank(dynamics: TreeDynamics) -> int:
    """Return the rank of the rows at a state that satisfies them only nearly."""
    if not dynamics.rows:
        return 0
    matrix = _weighted(dynamics, constraint_jacobian(dynamics.rows))
    return rank_of(matrix, CLOSED)


def _weighted(dynamics: TreeDynamics, rows: Iterable[Sequence[float]]) -> Floats:
    """Return H G^-1 (s x n), for rows H or what they exert."""
    return np.array([dynamics.factors.weighted(list(map(float, row))) for row in rows], dtype=float)


def _unit(combination: Floats) -> Floats:
    unit: Floats = combination / np.linalg.norm(combination)
    return unit


def _ambiguous(motion: Motion, dynamics: TreeDynamics, idle: list[Floats]) -> dict[str, tuple[str, ...]]:
    """Return the components of each joint's reaction that combinations of multipliers which exert nothing change."""
    if not idle:
        return {}
    at_rest = [0.0] * len(dynamics.speeds)
    without = reactions(motion, at_rest, dynamics.rows, [0.0] * len(dynamics.rows))
    with_each = [reactions(motion, at_rest, dynamics.rows, combination.tolist()) for combination in idle]
    changed = {
        name: tuple(c for c in COMPONENTS if any(_differs(found[name][c], known[c]) for found in with_each))
        for name, known in without.items()
    }
    return {name: components for name, components in changed.items() if components}


def _differs(value: float, other: float) -> bool:
    return abs(value - other) > NEGLIGIBLE * max(1.0, abs(other))
