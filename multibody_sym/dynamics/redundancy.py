"""Dependent rows: the rank of the constraints at a state, the rows left over, and the forces that are not unique.

In: rows at a state over floats. Out: a Redundancy, combinations of multipliers without effect, ranks at a position and
around it, contradictions by name.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.dynamics.closing import ConstraintRows, closed_near, displaced, least_missed
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.equations import TreeDynamics, coupled_groups
from multibody_sym.dynamics.left_over import Redundancy
from multibody_sym.dynamics.programs.reactions import reactions
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.mechanics.law_elements import row_forces
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion, motion_of, slot_state, state_of
from multibody_sym.mechanics.row_kinematics import constraint_jacobian, row_motions
from multibody_sym.mechanics.row_records import DistanceRow
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import as_node
from multibody_sym.scalars.pivoted_qr import NEGLIGIBLE, contradiction, dependence, support
from multibody_sym.scalars.rank import CLOSED, last_share, null_space, rank, scaled_rows
from multibody_sym.text.parser import force_name
from multibody_sym.text.printer import COMPONENTS

_SHARE: Final = 0.1


def redundancy(motion: Motion, dynamics: TreeDynamics) -> Redundancy:
    """Return the rank of the rows at a state over floats, by the solver's own measure (H G^-1 with M = G^T G).

    Rows in an idle combination of multipliers, and joints that it loads, have forces that are not unique.
    """
    restrict = restricting_rows(dynamics)
    if not restrict.rows:
        return Redundancy(0, (), ())
    found = dependence(_by_mass(restrict, constraint_jacobian(restrict.rows)))
    idle, names = idle_combinations(dynamics), dynamics.row_names
    shared = {k for combination in idle for k in support(combination)}
    loaded = _ambiguous(motion, dynamics, idle)
    of_joints = {k for cut in motion.mechanism.cuts for k in cut.rows}
    joints = [body.joint_name for body in motion.mechanism.bodies if body.joint_name in loaded]
    doubles = motion.mechanism.doubles
    return Redundancy(
        found.rank - sum(doubles.values()),
        tuple(restrict.row_names[k] for k in found.left_over),
        (*(names[k] for k in sorted(shared)), *joints),
        tuple(tuple(restrict.row_names[k] for k in support(circuit)) for circuit in found.circuits),
        {**{names[k]: () for k in sorted(shared - of_joints)}, **loaded},
        doubles,
        tuple(dict.fromkeys(_force_names(motion.mechanism, {names[k] for k in shared - of_joints}, loaded))),
    )


def _force_names(
    mechanism: Mechanism, rows: Collection[str], loaded: Mapping[str, Sequence[str]]
) -> Iterator[str]:
    """Yield the names of the forces of rows and of joints' components."""
    one_way = {row: pair for element in mechanism.one_way for row, *pair in row_forces(element)}
    for row in (row for row in mechanism.rows if row.name in rows):
        if row.name in one_way:
            yield force_name(*one_way[row.name])
        elif row.rope_run is not None:
            yield from (force_name(row.rope_run.told[0], component) for component in row.rope_run.components)
        else:
            yield force_name(row.name, "tension" if row.multiplier == "rod" else "multiplier")
    yield from (force_name(joint, component) for joint, components in loaded.items() for component in components)


def idle_combinations(dynamics: TreeDynamics) -> list[Floats]:
    """Return combinations y (s) of multipliers, of length one, that exert nothing and define no other: C^T y = D y = 0.

    Multipliers and forces that depend on them are unique where no such combination changes them. C is H for rows
    without friction, D their coupling; rows that define a force are as long as the effect of its unit.
    """
    if not dynamics.rows:
        return []
    friction = dynamics.friction
    exerted = _by_mass(dynamics, [row.forces for row in dynamics.rows])
    if friction is not None:
        lengths = scaled_rows(exerted)[0]
        exerted = np.hstack([exerted, np.array(friction.coupling, dtype=float).T * lengths])
    lengths = scaled_rows(exerted)[0]
    combinations: list[Floats] = []
    for circuit in dependence(exerted).circuits:
        combination = circuit / lengths
        combinations.append(combination / np.linalg.norm(combination))
    return combinations


def restricting_rows(dynamics: TreeDynamics) -> TreeDynamics:
    """Return the dynamics with those rows alone that restrict motion; others define forces."""
    if all(row.kinematic for row in dynamics.rows):
        return dynamics
    kept = [(row, name) for row, name in zip(dynamics.rows, dynamics.row_names, strict=True) if row.kinematic]
    return replace(dynamics, rows=[row for row, _ in kept], row_names=tuple(name for _, name in kept))


@dataclass(frozen=True)
class NearDependence:
    """The rows that come nearest to dependence, or to vanishing, as rows of unit length.

    `independence` is 1 for rows across each other, 0 for dependent ones.
    """

    names: tuple[str, ...]
    independence: float


def nearly_dependent(dynamics: TreeDynamics, independent: int) -> NearDependence:
    """Return the rows nearest to dependence, where `independent` of all rows are independent in general.

    Rows that define their force take no part, but count among the independent ones.
    """
    own = [k for k, row in enumerate(dynamics.rows) if row.kinematic]
    matrix = scaled_rows(_by_mass(dynamics, constraint_jacobian(dynamics.rows)))[1][own]
    count = min(max(independent - (len(dynamics.rows) - len(own)), 1), *matrix.shape)
    shares, independence = last_share(matrix, count)
    names = [dynamics.row_names[k] for k in own]
    named = tuple(name for name, share in zip(names, shares, strict=True) if share > _SHARE)
    return NearDependence(named, independence)


def approximate_rank(dynamics: TreeDynamics) -> int:
    """Return the rank of the rows at a state that satisfies them only nearly."""
    if not dynamics.rows:
        return 0
    return rank(_by_mass(dynamics, constraint_jacobian(dynamics.rows)), CLOSED)


def _by_mass(dynamics: TreeDynamics, rows: Iterable[Sequence[float]]) -> Floats:
    """Return H G^-1 (s x n), for rows H or what they exert."""
    return np.array([dynamics.factors.weighted(list(map(float, row))) for row in rows], dtype=float)


def _ambiguous(motion: Motion, dynamics: TreeDynamics, idle: list[Floats]) -> dict[str, tuple[str, ...]]:
    """Return the components of each joint's reaction that idle combinations of multipliers change."""
    if not idle:
        return {}
    at_rest = [0.0] * len(dynamics.speeds)
    without = reactions(motion, at_rest, dynamics.rows, [0.0] * len(dynamics.rows))
    with_each = [reactions(motion, at_rest, dynamics.rows, combination.tolist()) for combination in idle]

    def changes(name: str, c: str) -> bool:
        own = without[name][c]
        return any(abs(each[name][c] - own) > NEGLIGIBLE * max(1.0, abs(own)) for each in with_each)

    changed = {name: tuple(c for c in COMPONENTS if changes(name, c)) for name in without}
    return {name: components for name, components in changed.items() if components}


# ----------------------------------------------------------------------------------------------------------------------
# Contradicting constraints: the fewest rows that no positions, no speeds or no accelerations satisfy together.
#
#     H dq = -phi        H u = -phi_t        H udot = gamma
#
# have no solution where a combination y of rows vanishes, y^T H = 0, and that of the right sides does not. Rows that
# depend on each other at one position only are those of a loop at the end of its reach, and no contradiction.


_ALLOWED: Final = 1e-8
_ALLOWED_POSITION: Final = 1e-11
_BESIDE: Final = 0.01
_SEED: Final = 5


@dataclass(frozen=True)
class RowContradiction:
    """Places of rows that cannot hold together, and what is `missing`: positions, speeds or accelerations.

    `off`: the residual of the last row where all are missed least.
    """

    rows: tuple[int, ...]
    missing: str
    off: float = 0.0

    def error(self, mechanism: Mechanism, when: str) -> NoSolutionError:
        return NoSolutionError(self.message(mechanism, when), where=Where(path=mechanism.row_path(self.rows[-1])))

    def message(self, mechanism: Mechanism, when: str) -> str:
        """Return which rows contradict each other and what to do."""
        names = [mechanism.rows[k].name for k in self.rows]
        if len(names) == 1:
            off = ""
            if isinstance(mechanism.rows[self.rows[0]], DistanceRow) and self.missing == "positions":
                off = f": its ends are {abs(self.off):.6g} m too {'near' if self.off > 0.0 else 'far apart'}"
            return f"constraint {names[0]} asks {when} for what nothing can move{off}; correct it, or leave it out"
        listed = f"{', '.join(names[:-1])} and {names[-1]}"
        return (
            f"constraints contradict each other {when}: no {self.missing} satisfy {listed} together, though they do "
            "without any one of them; correct one, or leave it out"
        )


def contradiction_of(
    rows: ConstraintRows, q: Floats, u: Floats, known_rank: int | None = None
) -> RowContradiction | None:
    """Return the rows that contradict each other near a state, on the first level where some do.

    `known_rank`: that of the rows in positions that satisfy them, None where no such position is known.
    """
    closest = least_missed(rows.holonomic(), q)
    if closest is None:
        return None
    moving = rows.of(rows.motion(closest, u))
    jacobian = rows.jacobian(moving)
    if known_rank is not None and rank(jacobian, CLOSED) < known_rank:
        return None
    levels = {
        "positions": (np.array([row.gap for row in moving]), _ALLOWED_POSITION),
        "speeds": (jacobian @ u - np.array([row.phidot for row in moving]), _ALLOWED),
        "accelerations": (np.array([row.gamma for row in moving]), _ALLOWED),
    }
    for missing, (wanted, allowed) in levels.items():
        size = max(1.0, float(np.square(u).max(initial=0.0)), float(np.abs(wanted).max(initial=0.0)))
        found = contradiction(jacobian, wanted.astype(float), allowed * size)
        if found and (known_rank is not None or _lasts(rows, closest, jacobian, found)):
            return RowContradiction(tuple(rows.active[k] for k in found), missing, float(wanted[found[-1]]))
    return None


def _lasts(rows: ConstraintRows, q: Floats, jacobian: Floats, circuit: Sequence[int]) -> bool:
    """Return whether rows that depend on each other at a position do so nearby, or the rank is no greater there.

    Neither is true at the end of a reach. Of rows that block each other only one may be true.
    """
    change = np.random.default_rng(_SEED).uniform(-_BESIDE, _BESIDE, len(rows.mechanism.speeds))
    near = rows.motion(displaced(rows.mechanism, q, change), np.zeros(len(change)))
    beside = rows.jacobian(rows.of(near))
    return rank(beside[list(circuit)], CLOSED) < len(circuit) or rank(beside, CLOSED) <= rank(jacobian, CLOSED)


# ----------------------------------------------------------------------------------------------------------------------
# Regular and singular positions: in a singular one rows depend on each other that are independent nearby.


_NEIGHBOURS: Final = 3
_NEAR: Final = 0.1
_SINGULAR_SEED: Final = 7


def generic_rank(rows: ConstraintRows, q: Floats) -> tuple[int, int]:
    """Return how many rows are independent at q, and the most at q and at positions around it that satisfy them.

    Rows may depend on each other only where they hold; beside such a position rounding makes all independent.
    """
    here = _singular_rank(rows, q)
    around = _beside(rows, q) if here < rows.acting else iter(())
    return here, max(here, *(_singular_rank(rows, near) for near in around), 0)


def _singular_rank(rows: ConstraintRows, q: Floats) -> int:
    found = rows.numbers(q)
    if found is not None:
        return rank(found.weighted[list(rows.active)], CLOSED)
    return approximate_rank(_dynamics(rows, q))


def verify_regular(rows: ConstraintRows, q: Floats, here: int, generic: int, called: str) -> None:
    """Raise NoSolutionError where the rank of rows at q is less than the generic one, by the names of dependent rows.

    These depend on each other, or vanish, at q and do not beside it. `called`: the name of the state.
    """
    if here == generic:
        return
    singular = _dynamics(rows, q)
    beside = max((_dynamics(rows, near) for near in _beside(rows, q)), key=approximate_rank)
    unit = scaled_rows(_by_mass(beside, constraint_jacobian(beside.rows)))[1]
    losing = set[int]()
    for circuit in dependence(_by_mass(singular, constraint_jacobian(singular.rows))).circuits:
        members = list(support(circuit))
        if rank(unit[members], CLOSED) == len(members):
            losing.update(members)
    names = tuple(singular.row_names[k] for k in sorted(losing)) or nearly_dependent(singular, generic).names
    first = next((k for k, row in enumerate(rows.mechanism.rows) if row.name in names), rows.active[0])
    depend, hold = ("depend", "hold") if len(names) > 1 else ("depends", "holds")
    raise NoSolutionError(
        f"{called} is a singular position: {', '.join(names)} {depend} on the other constraints there, or {hold} "
        f"nothing (the rank of the constraints is {here} there and {generic} nearby), and the motion may go on along "
        "more than one way; choose one beside it",
        where=Where(path=rows.mechanism.row_path(first)),
        number="N103",
    )


def _beside(rows: ConstraintRows, q: Floats) -> Iterator[Floats]:
    """Yield positions around q that satisfy the rows."""
    rng = np.random.default_rng(_SINGULAR_SEED)
    for _ in range(_NEIGHBOURS):
        near = closed_near(rows, displaced(rows.mechanism, q, rng.uniform(-_NEAR, _NEAR, len(rows.mechanism.speeds))))
        if near is not None:
            yield near


def _dynamics(rows: ConstraintRows, q: Floats) -> TreeDynamics:
    return restricting_rows(composite_body(rows.mechanism, rows.motion(q, np.zeros(len(rows.mechanism.speeds))).state))


# ----------------------------------------------------------------------------------------------------------------------
# Coordinates that constraints immobilise: a lever pressed on a drum does not turn while it touches.


_TIMED: Final = ("t", "inputs", "u")


_ASIDE: Final = (0.0137, -0.0211, 0.0323)
"""How far others are displaced where rows are looked at that may not depend on them."""


def _held_whatever_else(
    mechanism: Mechanism, q: Sequence[float], parameters: Sequence[float], rows: Sequence[int], jacobian: Floats
) -> set[int]:
    """Return coordinates that cannot move at a position, and satisfy the rows there wherever all others are.

    So a plank on two wheels keeps its height and its angle, though its rows name the place along it too.
    """
    loose = null_space(jacobian[list(rows)], CLOSED)
    still = {k for k in range(len(q)) if np.all(np.abs(loose[k]) <= CLOSED)}
    for aside in _ASIDE:
        moved = [x if k in still else x + aside * (1 + k) for k, x in enumerate(q)]
        state = state_of(mechanism, float, 0.0, moved, [0.0] * len(mechanism.speeds), parameters)
        found = row_motions(motion_of(mechanism, state))
        if any(not abs(float(found[k].phi)) <= CLOSED for k in rows):
            return set()
    return still


def held_coordinates(mechanism: Mechanism, q: Sequence[float], parameters: Sequence[float]) -> frozenset[int]:
    """Return the places of coordinates that rows hold at a position while these act; none with quaternions.

    Coordinates have no other position nearby if as many independent rows name them alone, and not the time.
    """
    if len(q) != len(mechanism.speeds) or any(body.quaternions for body in mechanism.bodies):
        return frozenset()
    named: dict[int, set[int]] = {}  # the coordinates in each row on positions, without rows that name the time
    for k, row in enumerate(row_motions(motion_of(mechanism, slot_state(mechanism)))):
        if row.holonomic and row.kinematic:
            slots = [leaf.data for leaf in leaves([as_node(row.phi)], "slot")]
            if not any(array in _TIMED for array, _ in slots):
                named[k] = {index for array, index in slots if array == "q"}
    if not named:
        return frozenset()
    state = state_of(mechanism, float, 0.0, q, [0.0] * len(mechanism.speeds), parameters)
    jacobian = constraint_jacobian(row_motions(motion_of(mechanism, state)))
    held: set[int] = set()
    while True:
        left = {row: places - held for row, places in named.items() if places - held}
        for group in (*left.values(), *coupled_groups(left.values())):
            rows = [row for row, places in left.items() if places <= group]
            if len(rows) >= len(group) and rank(jacobian[np.ix_(rows, sorted(group))], CLOSED) == len(group):
                held |= group
                break
        else:
            return frozenset(held | _held_whatever_else(mechanism, q, parameters, [*named], jacobian))
