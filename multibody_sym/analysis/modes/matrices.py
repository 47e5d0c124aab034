"""Small motions over exact quotients: M x'' + C x' + K x = 0 in independent deviations x from a state.

In: a mechanism and a state in symbols. Out: Matrices, of which Routh's reduction takes cyclic coordinates that move.

The equations of motion are differentiated at the state, forces of constraints included:

    M dudot + C du + K dsigma = H^T dlambda,   C = -d(f + H^T lambda)/du,   K = -d(f + H^T lambda)/dsigma

with lambda as at the state, so that the second derivatives of the constraints come in through their multipliers. With
X spanning the null space of H they are X^T M X, X^T C X and X^T K X. For a system with energies M = d2T/du2,
K = d2(V - T0)/dq2 with the part T0 of T that drives give, and C is gyroscopic but for dampers.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

from multibody_sym.algebra.quotient_functions import exact, exact_solve, register_angles
from multibody_sym.algebra.quotients import Field, NoClosedFormError, Quotient
from multibody_sym.derivation.symbolic_start import SymbolicState, linear_equations
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.mechanics.mechanism import TIME, Mechanism
from multibody_sym.mechanics.motion import coordinate_rates, motion_of
from multibody_sym.mechanics.row_kinematics import RowMotion, row_motions
from multibody_sym.mechanics.state import State, state_of
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import tangents
from multibody_sym.scalars.node import ONE, Node, as_node, slot

WORK: Final = 200_000
"""How much is done for the formulas of one state, in products of terms."""

Matrix = list[list[Quotient]]


@dataclass(frozen=True)
class Matrices:
    """M, C and K (n x n) of small motions, over one field; `places` (n) of the independent deviations.

    `known` holds the values of the mechanism's slots; `balanced`: nothing is accelerated whatever the parameters.
    """

    field: Field
    places: tuple[int, ...]
    mass: Matrix
    rates: Matrix
    stiffness: Matrix
    known: dict[Node, Quotient]
    balanced: bool

    @cached_property
    def damping(self) -> Matrix:
        """The symmetric part of C."""
        return [[(a + b) / 2 for a, b in zip(x, y, strict=True)] for x, y in _with_transposed(self.rates)]

    @cached_property
    def gyroscopic(self) -> Matrix:
        """The other part of C."""
        return [[(a - b) / 2 for a, b in zip(x, y, strict=True)] for x, y in _with_transposed(self.rates)]

    @property
    def is_damped(self) -> bool:
        """Whether C has a symmetric part."""
        return not _vanishes(self.damping)

    @property
    def is_gyroscopic(self) -> bool:
        """Whether C has an antisymmetric part."""
        return not _vanishes(self.gyroscopic)

    @property
    def is_symmetric(self) -> bool:
        """Whether K is symmetric, as that of forces with a potential is."""
        return all((a - b).is_zero for x, y in _with_transposed(self.stiffness) for a, b in zip(x, y, strict=True))


def _with_transposed(matrix: Matrix) -> list[tuple[list[Quotient], list[Quotient]]]:
    return [(row, [other[k] for other in matrix]) for k, row in enumerate(matrix)]


def _vanishes(matrix: Matrix) -> bool:
    return all(x.is_zero for row in matrix for x in row)


def matrices(mechanism: Mechanism, given: SymbolicState, places: Sequence[int]) -> Matrices:
    """Return the matrices at a state in deviations at `places` of the speeds, which the constraints leave independent.

    Raises NoClosedFormError where they are too long, or constraints change along a steady motion.
    """
    try:
        return _Slopes(mechanism, given, Field(WORK)).matrices(places)
    except NoClosedFormError:
        return _Slopes(mechanism, given, Field(WORK, expands=True)).matrices(places)


class _Slopes:
    """The equations at a state, differentiated over Nodes in slots and taken over a field."""

    def __init__(self, mechanism: Mechanism, given: SymbolicState, field: Field) -> None:
        self.mechanism, self.given, self.field = mechanism, given, field
        self.size = len(mechanism.speeds)
        self.q = [slot("q", k) for k in range(len(mechanism.coordinates))]
        self.u = [slot("u", k) for k in range(self.size)]
        parameters = [slot("parameters", k) for k in range(len(mechanism.parameters))]
        self.motion = motion_of(mechanism, state_of(mechanism, Node, TIME, self.q, self.u, parameters))
        self.rows: list[RowMotion] = list(row_motions(self.motion))
        if any(row.exerts is not None or not row.kinematic for row in self.rows):
            raise NoClosedFormError("friction acts, whose force follows what presses")
        self.known: dict[Node, Quotient] = {n: field.letter(n, letter) for n, letter in given.letters.items()}

    def matrices(self, places: Sequence[int]) -> Matrices:
        self._register()
        balanced = self._forces()
        self._verify_steady()
        pushes = self._pushes()
        M = [[as_node(x) for x in row] for row in mass_matrix(self.motion)]
        C = [[-x for x in self._along(pushes, [self.u[k]], [ONE])] for k in range(self.size)]
        K = [[-x for x in self._along(pushes, self.q, self._displacement(k))] for k in range(self.size)]
        X = self._tangents(places)
        # columns of C and K are the derivatives by one deviation each
        mass = _reduced(self._exact(M), X)
        rates, stiffness = (list(map(list, zip(*_reduced(self._exact(a), X), strict=True))) for a in (C, K))
        return Matrices(self.field, tuple(places), mass, rates, stiffness, self.known, balanced)

    def _register(self) -> None:
        """Take in the state, the smallest parts of angles first."""
        state: State = self.given.state
        pairs = {leaf: as_node(x) for leaf, x in state.slots.items()}
        for leaf, node in pairs.items():
            if leaf not in self.known:
                self.known[leaf] = exact(self.field, [node], self.known)[0]
        matrix, right = linear_equations(self.motion)
        nodes = [as_node(x) for x in (*(x for row in matrix for x in row), *right)]
        register_angles(self.field, nodes, self.known)

    def _forces(self) -> bool:
        """Find the multipliers at the state; return whether all accelerations vanish identically there."""
        matrix, right = linear_equations(self.motion)
        left, wanted = self._exact(matrix), self._exact([right])[0]
        solved = exact_solve(left, wanted)
        udot, multipliers = solved[: self.size], solved[self.size :]
        if not all(x.is_zero for x in udot):
            rest = [[-row[self.size + k] for row in left[: self.size]] for k in range(len(self.rows))]
            multipliers = self._static(rest, [-x for x in wanted[: self.size]]) or multipliers
        self.known.update((slot("multipliers", k), x) for k, x in enumerate(multipliers))
        return all(x.is_zero for x in udot)

    def _static(self, forces: Matrix, right: list[Quotient]) -> list[Quotient] | None:
        """Return multipliers that balance the forces alone, which are shorter; None where they do not."""
        try:
            return exact_solve([[row[k] for row in forces] for k in range(self.size)], right) if forces else None
        except NoClosedFormError:
            return None

    def _pushes(self) -> list[Node]:
        """Return f + H^T lambda, multipliers as slots."""
        _, right = linear_equations(self.motion)
        found = [as_node(x) for x in right[: self.size]]
        for k, row in enumerate(self.rows):
            found = [f + slot("multipliers", k) * as_node(h) for f, h in zip(found, row.forces, strict=True)]
        return found

    def _displacement(self, k: int) -> list[Node]:
        """Return how the coordinates change with deviation k."""
        units = [int(j == k) for j in range(self.size)]
        return [as_node(x) for x in coordinate_rates(self.mechanism, self.q, units)]

    def _along(self, nodes: Sequence[Node], leaves: Sequence[Node], rates: Sequence[Node]) -> list[Node]:
        return tangents(nodes, dict(zip(leaves, rates, strict=True)))

    def _verify_steady(self) -> None:
        """Raise NoClosedFormError where constraints, or the axes of a deviation, change along a steady motion."""
        moves = not all(self.known[x].is_zero for x in self.u)
        turning = any(body.quaternions for body in self.mechanism.bodies)
        if moves and turning:
            raise NoClosedFormError("attitudes with a quaternion turn steadily; in three angles there are formulas")
        rates = [as_node(x) for x in coordinate_rates(self.mechanism, self.q, self.u)]
        H = [as_node(x) for row in self.rows for x in row.jacobian]
        changing = tangents(H, {**dict(zip(self.q, rates, strict=True)), TIME: ONE})
        free = [as_node(row.phidot) for row in self.rows if not row.holonomic]
        changing += [x for k in range(self.size) for x in self._along(free, self.q, self._displacement(k))]
        if not all(x.is_zero for x in exact(self.field, changing, self.known)):
            raise NoClosedFormError("constraints change along the motion")

    def _tangents(self, places: Sequence[int]) -> Matrix:
        """Return the columns of X (n x nu), by which all deviations follow the independent ones."""
        H = self._exact([[as_node(x) for x in row.jacobian] for row in self.rows])
        dependent = [k for k in range(self.size) if k not in set(places)]
        zero, one = self.field.constant(0), self.field.constant(1)
        columns = []
        for place in places:
            column = [one if k == place else zero for k in range(self.size)]
            left = [[row[k] for k in dependent] for row in H]
            solved = exact_solve(left, [-row[place] for row in H]) if dependent else []
            for k, x in zip(dependent, solved, strict=True):
                column[k] = x
            columns.append(column)
        return columns

    def _exact(self, matrix: Sequence[Sequence[object]]) -> Matrix:
        return [exact(self.field, [as_node(x) for x in row], self.known) for row in matrix]


def _reduced(matrix: Matrix, X: Matrix) -> Matrix:
    """Return X^T matrix X, with the columns of X."""
    zero = X[0][0].field.constant(0) if X else None
    found = []
    for left in X:
        pulled = [_sum(zero, (a * row[k] for a, row in zip(left, matrix, strict=True))) for k in range(len(left))]
        found.append([_sum(zero, (a * b for a, b in zip(pulled, right, strict=True))) for right in X])
    return found


def _sum(zero: Quotient | None, terms: Iterable[Quotient]) -> Quotient:
    assert zero is not None
    total = zero
    for term in terms:
        if not term.is_zero:
            total = total + term
    return total


# --- Routh's reduction: momenta of cyclic coordinates are held, and their deviations eliminated ----------------------
#
# Of a coordinate c on which nothing depends the row of M x'' + C x' + K x = 0 has no K, and says that its momentum
# stays: M_cc x_c' + M_ci x_i' + C_ci x_i = 0. With x_c' from this the other rows are, for the others alone,
#
#     M - M_ic M_cc^-1 M_ci,   C - M_ic M_cc^-1 C_ci - C_ic M_cc^-1 M_ci,   K - C_ic M_cc^-1 C_ci
#
# which are the second derivatives of Routh's function. Source: E. J. Routh, Stability of Motion (1877), on steady
# motion.


def with_momenta_held(given: Matrices) -> tuple[Matrices, tuple[int, ...]]:
    """Return the matrices without the cyclic deviations that move, and the places of these.

    On a cyclic deviation nothing depends, and no damper acts along it.
    """
    cyclic = []
    for c, place in enumerate(given.places):
        if given.known[slot("u", place)].is_zero:
            continue
        forces = (*given.stiffness[c], *(row[c] for row in given.stiffness), *given.damping[c])
        if all(x.is_zero for x in forces) and not given.mass[c][c].vanishes:
            cyclic.append(c)
    found = given
    for c in reversed(cyclic):
        M, C, K = found.mass, found.rates, found.stiffness
        others = [k for k in range(len(found.places)) if k != c]
        pivot = M[c][c]
        found = replace(
            found,
            places=tuple(found.places[k] for k in others),
            mass=[[M[i][j] - M[i][c] * M[c][j] / pivot for j in others] for i in others],
            rates=[[C[i][j] - (M[i][c] * C[c][j] + C[i][c] * M[c][j]) / pivot for j in others] for i in others],
            stiffness=[[K[i][j] - C[i][c] * C[c][j] / pivot for j in others] for i in others],
        )
    return found, tuple(given.places[c] for c in cyclic)
