"""The constrained solve, once over all scalars: accelerations, multipliers, and least corrections.

    M udot = f + H^T lambda,   H udot = gamma

With M = G^T G, x = G udot and A = H G^-1 this is x = G^-T f + A^T lambda, A x = gamma, which a rank-revealing solve of
least norm answers whatever the rank of A. `Solver` is that solve over the scalar at hand: numbers in floats, statements
of a Program over Nodes. The textbooks' W = A A^T in W lambda = gamma - A x_f is never formed: it squares the condition
of A.

With friction, rows exert C^T lambda instead, and may define forces: H udot + D lambda = gamma. Then x and lambda are
found together, which does not square the condition either:

    [A   D   ] [x     ]   [gamma - A G^-T f]
    [E  -C_w^T] [lambda] = [0              ]       C_w = C G^-1
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import reduce
from typing import Final, Protocol

import numpy as np

from multibody_sym.dynamics.formalisms.articulated_body import tree_factors
from multibody_sym.dynamics.formalisms.composite_body import mass_diagonal, mass_matrix
from multibody_sym.dynamics.formalisms.equations import (
    FrictionTerms,
    MassFactors,
    TreeDynamics,
    completed_matrix,
    massless_speeds,
    vanishing_pivots,
)
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.mechanics.motion import Motion, why_locked
from multibody_sym.mechanics.row_kinematics import along_reactions, constraint_jacobian, row_motions
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.functions import is_exactly, maximum, sqrt
from multibody_sym.scalars.least_norm import SHORTEST, LeastNormSolution, solve
from multibody_sym.scalars.rank import PIVOT, vanishes
from multibody_sym.scalars.vectors import S

_NEARLY_ZERO: Final = 1e-150
"""The scale of forces that vanish at the values of parameters, as friction without a coefficient."""
PASSES: Final = 7
"""Each doubles the digits of the directions of forces (Newton's method); friction turns them by little."""

Matrix = Sequence[Sequence[S]]


class LeastNorm(Protocol):
    """The x (n) of least norm with A x = r, lambda (s) with x = A^T lambda, and the report (3) of `least_norm`."""

    @property
    def solution(self) -> Iterable[S]: ...
    @property
    def multipliers(self) -> Iterable[S]: ...
    @property
    def report(self) -> Iterable[S]: ...


class Solver(Protocol):
    """Solves A x = r for A (s x n), r (s) and n, which A does not tell without rows.

    `beside` of the rows are no constraints: they are independent of all others.
    """

    def __call__(self, matrix: Matrix, right: Sequence[S], size: int, /, beside: int = 0) -> LeastNorm: ...


@dataclass(frozen=True)
class Sharing:
    """Multipliers that are not unique: `forces` (s), and the least combination of `ways` (s) beside them.

    A way is the parts of some rows, by number; it takes the place of one row.
    """

    forces: Sequence[S]
    ways: Sequence[Sequence[tuple[int, S]]]

    def of(self, rows: Matrix) -> list[list[S]]:
        """Return the forces of each way, from those of each row."""
        size = range(len(rows[0]) if rows else 0)
        return [[sum(x * rows[j][i] for j, x in way) for i in size] for way in self.ways]

    def carried(self, taken: Sequence[S]) -> list[S]:
        """Return the multipliers (s) with `taken` (s) of each way."""
        found = list(self.forces)
        for way, y in zip(self.ways, taken, strict=True):
            for j, x in way:
                found[j] = found[j] + x * y
        return found


@dataclass(frozen=True)
class Constrained:
    """udot (n), multipliers (s) and the report (3) of the solve; C (s x n) where reactions gave it a direction."""

    udot: list[S]
    multipliers: list[S]
    report: Iterable[S]
    along: Matrix | None = None


def solve_constrained(
    factors: MassFactors,
    forcing: Sequence[S],
    rows: Matrix,
    wanted: Sequence[S],
    solve: Solver,
    *,
    minimum_norm: bool = False,
    friction: FrictionTerms | None = None,
    sharing: Sharing | None = None,
) -> Constrained:
    """Return the accelerations and multipliers for f (n), H (s x n) and gamma (s), and `friction` where rows rub.

    Accelerations without rows may be huge beside x (a light body that heavy ones hold), and their rounding is missing
    in A x = gamma: a second solve with the residual brings it back. Multipliers of dependent rows are zero, those of
    `minimum_norm` (`least_multipliers`), or those of a `sharing`.
    """
    free = factors.weighted(forcing)
    if friction is not None and sharing is not None:  # the forces carried at first are loads beside others
        exerts = [factors.weighted(row) for row in friction.exerts]
        loaded = [x + sum(z * c[i] for z, c in zip(sharing.forces, exerts, strict=True)) for i, x in enumerate(free)]
        ways = FrictionTerms(sharing.of(friction.exerts), friction.coupling)
        found = _with_friction(factors, loaded, rows, wanted, ways, solve, lengths=[1] * len(rows))
        return Constrained(found.udot, sharing.carried(found.multipliers), found.report)
    if friction is not None:
        exerts = _along_reactions(factors, free, rows, wanted, friction, solve) if friction.beside else friction.exerts
        found = _with_friction(factors, free, rows, wanted, FrictionTerms(exerts, friction.coupling), solve)
        return replace(found, along=exerts) if friction.beside else found
    matrix = [factors.weighted(row) for row in rows]
    first = solve(matrix, _residual(wanted, matrix, free), len(free))
    near = factors.unweighted(sums(free, first.solution))
    second = solve(matrix, _residual(wanted, rows, near), len(free))
    udot = sums(near, factors.unweighted(list(second.solution)))
    if sharing is not None:
        left = _residual(sums(first.solution, second.solution), _transpose(matrix), sharing.forces)
        multipliers = sharing.carried(list(solve(_transpose(sharing.of(matrix)), left, len(rows)).solution))
    elif minimum_norm and rows:
        multipliers = least_multipliers(matrix, sums(first.solution, second.solution), solve)
    else:
        multipliers = sums(first.multipliers, second.multipliers)
    return Constrained(udot, multipliers, first.report)


def _along_reactions(
    factors: MassFactors, free: list[S], rows: Matrix, wanted: Sequence[S], friction: FrictionTerms, solve: Solver
) -> list[list[S]]:
    """Return C (s x n) where reactions press with their lengths |F|: as d . F with the direction d of F itself.

    This is Newton's method, as |F| and d . F touch there; it begins at the reactions without this friction.
    """
    exerts = [[0 * x for x in row] if k in friction.beside else row for k, row in enumerate(friction.exerts)]
    previous: list[S] = []
    for _ in range(PASSES):
        trial = FrictionTerms(exerts, friction.coupling)
        found = _with_friction(factors, free, rows, wanted, trial, solve, once=True).multipliers
        exerts = along_reactions(friction.exerts, friction.beside, found)
        if previous and all(is_exactly(x, y) for x, y in zip(found, previous, strict=True)):
            break
        previous = found
    return exerts


def _with_friction(
    factors: MassFactors,
    free: Sequence[S],
    rows: Matrix,
    wanted: Sequence[S],
    friction: FrictionTerms,
    solve: Solver,
    *,
    once: bool = False,
    lengths: Sequence[S] | None = None,
) -> Constrained:
    """Return the accelerations and multipliers where rows exert other forces than their own, by two solves as well.

    With `once` the multipliers follow from A C^T alone, which is good for their directions, without accelerations.
    The unknowns are multipliers times the lengths of their forces; rows that define them are scaled likewise.
    """
    matrix = [factors.weighted(row) for row in rows]
    exerts = [factors.weighted(row) for row in friction.exerts]
    lengths = _lengths(exerts) if lengths is None else lengths
    unit = [[x / length for x in row] for row, length in zip(exerts, lengths, strict=True)]
    coupling = [[d / length for d, length in zip(row, lengths, strict=True)] for row in friction.coupling]
    size, count = len(free), len(rows)
    sizes = [length if _may_act(d) else 1 for d, length in zip(friction.coupling, lengths, strict=True)]
    if once:
        square = [
            [s * (sum(x * y for x, y in zip(a, c, strict=True)) + e) for c, e in zip(unit, d, strict=True)]
            for s, a, d in zip(sizes, matrix, coupling, strict=True)
        ]
        left = [x * s for x, s in zip(_residual(wanted, matrix, free), sizes, strict=True)]
        found = solve(square, left, count)
        return Constrained([], [y / length for y, length in zip(found.solution, lengths, strict=True)], found.report)
    upper = [[x * s for x in (*a, *d)] for s, a, d in zip(sizes, matrix, coupling, strict=True)]
    lower = [[*(1 if i == k else 0 for k in range(size)), *(-c[i] for c in unit)] for i in range(size)]

    def solve_both(missing: Sequence[S], unbalanced: Sequence[S]) -> tuple[list[S], list[S], Iterable[S]]:
        scaled = [x * s for x, s in zip(missing, sizes, strict=True)]
        found = solve([*upper, *lower], [*scaled, *unbalanced], size + count, beside=size)
        both = list(found.solution)
        return both[:size], both[size:], found.report

    x, z, report = solve_both(_residual(wanted, matrix, free), [0] * size)
    near = factors.unweighted(sums(free, x))
    missing = _residual(_residual(wanted, rows, near), coupling, z)
    pushed = [sum(c[i] * y for c, y in zip(unit, z, strict=True)) - x[i] for i in range(size)]
    more, other, _ = solve_both(missing, pushed)
    udot = sums(near, factors.unweighted(more))
    multipliers = [y / length for y, length in zip(sums(z, other), lengths, strict=True)]
    rank, *rest = report
    return Constrained(udot, multipliers, [rank - size, *rest])


def _transpose(matrix: Matrix) -> list[list[S]]:
    return [list(column) for column in zip(*matrix, strict=True)]


def _may_act(row: Sequence[S]) -> bool:
    """Return whether an element is not zero; an expression may be."""
    return not all(is_exactly(x, 0) for x in row)


def _lengths(rows: Matrix) -> list[S]:
    """Return the lengths of the rows' forces, none much below the longest; 1 where a row exerts nothing."""
    zero = [not _may_act(row) for row in rows]
    found = [1 if nothing else sqrt(sum(x * x for x in row)) for nothing, row in zip(zero, rows, strict=True)]
    exerting = [length for nothing, length in zip(zero, found, strict=True) if not nothing]
    if not exerting:
        return found
    shortest = maximum(SHORTEST * reduce(maximum, exerting), _NEARLY_ZERO)
    return [1 if nothing else maximum(length, shortest) for nothing, length in zip(zero, found, strict=True)]


def correction(factors: MassFactors, rows: Matrix, least: Callable[[Matrix], Sequence[S]]) -> list[S]:
    """Return the change of the speeds that is smallest in the norm of the mass matrix.

    `least` returns from A (s x n) the x (n) of least norm with the wanted A x = H change.
    """
    return factors.unweighted(least([factors.weighted(row) for row in rows]))


def least_multipliers(matrix: Matrix, x: Sequence[S], solve: Solver) -> list[S]:
    """Return the lambda (s) of least norm with A^T lambda = x, each counted times its row's length.

    Rows that are alike carry equal parts.
    """
    lengths = [sqrt(sum(a * a for a in row)) for row in matrix]
    shortest = SHORTEST * reduce(maximum, lengths)
    bounded = [maximum(length, shortest) for length in lengths]
    transposed = [[row[i] / length for row, length in zip(matrix, bounded, strict=True)] for i in range(len(x))]
    found = solve(transposed, x, len(matrix)).solution
    return [value / length for value, length in zip(found, bounded, strict=True)]


def _residual(wanted: Sequence[S], matrix: Matrix, x: Sequence[S]) -> list[S]:
    """Return wanted - matrix x."""
    products = (sum(a * b for a, b in zip(row, x, strict=True)) for row in matrix)
    return [value - product for value, product in zip(wanted, products, strict=True)]


def sums(a: Iterable[S], b: Iterable[S]) -> list[S]:
    return [x + y for x, y in zip(a, b, strict=True)]


# ----------------------------------------------------------------------------------------------------------------------
# Forward dynamics in floats: accelerations and multipliers, the reference for every program.
#
# Rows are equalities here; one-way elements have become such rows in a mode.


_SETTLED: Final = 1e-6
"""Friction along the resulting reactions may differ by this part of its largest force."""


@dataclass(frozen=True)
class Accelerations:
    """The result of forward dynamics: udot (nu), multipliers (ns), and the solve's report (3).

    `settled`: friction of joints goes along the resulting reactions. It does not where no reactions satisfy its law, as
    where it jams.
    """

    udot: Floats
    multipliers: Floats
    report: Floats
    settled: bool = True


def forward_dynamics(dynamics: TreeDynamics, *, minimum_norm: bool = False) -> Accelerations:
    """Return udot and the multipliers at a state over floats.

    M udot = Q - c + H^T lambda, H udot = gamma. Multipliers of dependent rows are zero, or those of `minimum_norm`.
    """
    if not dynamics.rows:
        return Accelerations(np.array(dynamics.bias_acceleration, dtype=float), np.zeros(0), np.zeros(3))
    friction = dynamics.friction
    found = solve_constrained(
        dynamics.factors,
        dynamics.forcing,
        constraint_jacobian(dynamics.rows).tolist(),
        dynamics.constraint_forcing,
        in_floats,
        minimum_norm=minimum_norm,
        friction=friction,
    )
    udot, multipliers, report = (np.array(list(x), dtype=float) for x in (found.udot, found.multipliers, found.report))
    settled = True
    if friction is not None and found.along is not None:
        along = along_reactions(friction.exerts, friction.beside, found.multipliers)
        before, after = (np.array(exerts, dtype=float) * multipliers[:, None] for exerts in (found.along, along))
        settled = bool(np.abs(after - before).max() <= _SETTLED * np.abs(before).max())
    return Accelerations(udot, multipliers, report, settled)


# --- is there inertia in every direction? ---------------------------------------------------------------------------


def verify_inertia(motion: Motion) -> None:
    """Raise NoSolutionError naming the first speed that neither inertia nor rows resist."""
    massless = massless_speeds(motion.mechanism)
    if not massless:  # pivots in time linear in the number of bodies
        with suppress(ZeroDivisionError):
            pivots = tree_factors(motion).pivots
            pairs = zip(pivots, mass_diagonal(motion), strict=True)
            if not any(vanishes(p, d, PIVOT * len(pivots)) for p, d in pairs):
                return
    rows = row_motions(motion) if massless else []
    matrix = np.array(completed_matrix(motion, mass_matrix(motion), rows), dtype=float)
    index = next(vanishing_pivots(matrix, PIVOT * len(matrix)), None)
    if index is not None:
        speed = motion.mechanism.speeds[index]
        place, body = next((k, body.name) for k, body in enumerate(motion.mechanism.bodies) if index in body.u)
        if mass_diagonal(motion)[index] > 0:
            why = why_locked(motion, place) if speed.unit == "rad/s" else None
            if why:
                raise NoSolutionError(
                    f"no inertia resists the speed {speed.name} in this position: {why}",
                    where=Where(path=("joints", speed.joint)),
                    number="N102",
                )
            why = f"freedoms beyond joint {speed.joint!r} move what it moves in the same way, at least in this position"
        else:
            why = f"body {body} and what joint {speed.joint!r} moves with it have neither mass nor inertia that way"
        lacking = "a mass" if speed.unit == "m/s" else "an inertia"
        raise NoSolutionError(
            f"no inertia resists the speed {speed.name}: {why}; give body {body} {lacking}, hold the direction by "
            "a constraint, or start from another position",
            where=Where(path=("joints", speed.joint)),
            number="N102",
        )


def in_floats(
    matrix: Sequence[Sequence[float]], right: Sequence[float], size: int, /, beside: int = 0
) -> LeastNormSolution:
    """Return the solve of equalities in floats: A (s x n), r (s), n."""
    A, r = np.array(matrix, dtype=float).reshape(len(right), size), np.array(right, dtype=float)
    return solve(A, r)
