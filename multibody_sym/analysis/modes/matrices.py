"""Small motions over exact quotients: M x'' + C x' + K x = 0 in independent deviations x from a state.

In: a mechanism and a state in symbols. Out: Matrices, of which Routh's reduction takes cyclic coordinates that move.

The equations of motion are differentiated at the state, forces of constraints included:

    M dudot + C du + K dsigma = H^T dlambda,   C = -d(f + H^T lambda)/du,   K = -d(f + H^T lambda)/dsigma

with lambda as at the state, so that the second derivatives of the constraints come in through their multipliers. With
X spanning the null space of H they are X^T M X, X^T C X and X^T K X. For a system with energies M = d2T/du2,
K = d2(V - T0)/dq2 with the part T0 of T that drives give, and C is gyroscopic but for dampers.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from typing import Any, Final, Literal

import numpy as np

from multibody_sym.algebra.quotient_functions import exact, exact_solve, register_angles
from multibody_sym.algebra.quotients import Field, NoClosedFormError, Quotient
from multibody_sym.algebra.roots import roots, shortest_node
from multibody_sym.analysis.deviations import DeviationFlow, displaced
from multibody_sym.analysis.equilibrium_search import keeps_mode, search_from
from multibody_sym.analysis.linearize import At, Linearization, flow_at, verified_linearization
from multibody_sym.analysis.rest.ends import fits
from multibody_sym.analysis.state_asked_about import REST, errors_at
from multibody_sym.derivation.symbolic_start import SymbolicState, declared_state, linear_equations
from multibody_sym.dynamics.closing import ConstraintRows, closed_near
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.start.start import Start, start_beside
from multibody_sym.errors import ExpressionError, NoSolutionError, Where
from multibody_sym.mechanics.mechanism import TIME, Mechanism, verify_without_states
from multibody_sym.mechanics.motion import State, coordinate_rates, motion_of, state_of
from multibody_sym.mechanics.row_kinematics import RowMotion, row_motions
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.calculus import tangents
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ONE, PI, ZERO, Node, as_node, slot, symbol
from multibody_sym.scalars.rank import ROUNDED, least_squares

WORK: Final = 200_000
"""How much is done for the formulas of one state, in products of terms."""

Matrix = list[list[Quotient]]


@dataclass(frozen=True)
class Matrices:
    """M, C and K (n x n) of small motions, over one field; `places` (n) of the independent deviations.

    `tangents` (n x nu): how all deviations follow each of them. `known` holds the values of the mechanism's slots;
    `balanced`: nothing is accelerated whatever the parameters.
    """

    field: Field
    places: tuple[int, ...]
    mass: Matrix
    rates: Matrix
    stiffness: Matrix
    tangents: Matrix
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
        return Matrices(self.field, tuple(places), mass, rates, stiffness, X, self.known, balanced)

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
        if self.rows and not all(x.is_zero for x in udot):  # those that balance the forces alone are shorter
            rest = [[-row[self.size + k] for k in range(len(self.rows))] for row in left[: self.size]]
            with suppress(NoClosedFormError):
                multipliers = exact_solve(rest, [-x for x in wanted[: self.size]])
        self.known.update((slot("multipliers", k), x) for k, x in enumerate(multipliers))
        return all(x.is_zero for x in udot)

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
    found = []
    for left in X:
        zero = left[0].field.constant(0)
        pulled = [sum((a * row[k] for a, row in zip(left, matrix, strict=True)), zero) for k in range(len(left))]
        found.append([sum((a * b for a, b in zip(pulled, right, strict=True)), zero) for right in X])
    return found


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
            tangents=[found.tangents[k] for k in others],
        )
    return found, tuple(given.places[c] for c in cyclic)


# ----------------------------------------------------------------------------------------------------------------------
# The state of small motions: the declared one where its speeds stay, else one found beside it; then its formulas.
#
# In: a System. Out: a SteadyState, and the same in symbols. Beside a start in which a cyclic coordinate moves, a steady
# motion with its momenta is sought: there the motion from the start, which swings about it, would come to rest but for
# these (Routh's effective potential).


_MISSED: Final = 1e-8
"""The distance of a start from a state without accelerations, beside 1 (m, rad), that is rounding of its numbers."""
_LEFT: Final = 1e-10
_CONVERGED: Final = 1e-14
_STEPS: Final = 60
_LARGEST_STEP: Final = 0.2
_GUESSES: Final = 24
_SECONDS: Final = 3.0
"""CPU time after which no other guess for a stable equilibrium is begun."""
_SINGULAR: Final = 1e-12


@dataclass(frozen=True, eq=False)
class SteadyState:
    """A state in which speeds keep their values: an equilibrium, or a steady motion if something moves in it.

    `found`: it is not the declared one but was found beside it; `stopped`: it is at rest although the start moves.
    """

    flow: DeviationFlow
    begin: Start
    linear: Linearization
    found: bool
    stopped: bool = False

    @property
    def kind(self) -> Literal["equilibrium", "steady motion"]:
        """The kind of the state; one that only drives move is an equilibrium (of a moving frame)."""
        return "steady motion" if any(self.begin.u) else "equilibrium"


def place_of(system: System, formalism: str | None, at: At = None) -> SteadyState:
    """Return the declared state if speeds keep their values there, else the equilibrium or steady motion beside it.

    An equilibrium that is found is a stable one if a few guesses find any. Raises InputError, and NoSolutionError where
    there is none, or with `at` where that state is none.
    """
    flow, begin = flow_at(system, formalism, at)
    verify_without_states(flow.mechanism, "it has no normal modes; linearize tells its eigenvalues")
    if is_balanced(flow, begin):
        with suppress(*((NoSolutionError,) if at is None and any(begin.u) else ())):  # it may pass a rest on its way
            return _linearized_at(flow, begin, at)
    if at is not None:
        why = "the state is no equilibrium and no steady motion: speeds change in it"
        raise NoSolutionError(f"{why}; name others, or write {REST}", where=Where(path=("at",)), number="N111")
    if any(begin.u):
        with suppress(NoSolutionError, np.linalg.LinAlgError, *UNDEFINED):
            steady = _Steady(flow, begin).found()
            if steady is not None:
                return _linearized_at(flow, steady, None, found=True)
    moves = any(begin.u)
    first = flow_at(system, formalism, REST)
    found = _linearized_at(*first, None, found=True, stopped=moves)
    if max(found.linear.eigenvalues.real, default=0.0) > 0.0:  # a few guesses may find a stable one
        search = search_from(flow.mechanism, begin, formalism)
        reached = search.reached_in_time(time.process_time() + _SECONDS, _GUESSES)
        stable = [q for q in reached if search.stable(q) and keeps_mode(search, q)]
        if stable:
            nearest = min(stable, key=lambda q: float(np.linalg.norm(q - np.array(begin.q))))
            rest = {speed.name: 0.0 for speed in flow.mechanism.speeds}
            names = dict(zip((c.name for c in flow.mechanism.coordinates), nearest.tolist(), strict=True)) | rest
            return _linearized_at(*flow_at(system, formalism, names), None, found=True, stopped=moves)
    return found


def _linearized_at(
    flow: DeviationFlow, begin: Start, at: Any, *, found: bool = False, stopped: bool = False
) -> SteadyState:
    with errors_at(at):
        linear = verified_linearization(flow, np.array(begin.q, dtype=float), np.array(begin.u, dtype=float))
    return SteadyState(flow, begin, linear, found, stopped)


def is_balanced(flow: DeviationFlow, begin: Start) -> bool:
    """Return whether no speed changes, but for the rounding of the numbers of a state."""
    q, u = np.array(begin.q, dtype=float), np.array(begin.u, dtype=float)
    udot = flow.accelerations(q, u)
    if not udot.any():
        return True
    slopes = flow.derivatives(flow.known(q, u))[0][len(u) :] @ flow.tangents(q, u).X
    step = least_squares(slopes, -udot, ROUNDED)
    left = np.abs(slopes @ step + udot).max()
    size = max(1.0, float(np.abs(q).max(initial=0.0)))
    steepest = max(1.0, float(np.abs(slopes).max(initial=0.0)))
    return bool(np.abs(step).max(initial=0.0) <= _MISSED * size and left <= _LEFT * steepest)


class _Steady:
    """Looks for the steady motion beside a start: coordinates that move at the start keep their momenta.

    Newton's method in the other independent coordinates x, with u_c(x) of the moving ones from their momenta:
    udot(x, u_c(x)) = 0, where du_c/dx is the slope of udot_c by the speed of x, as u_c' = (du_c/dx) x'.
    """

    def __init__(self, flow: DeviationFlow, begin: Start) -> None:
        self.flow, self.begin = flow, begin
        self.q, self.u = np.array(begin.q, dtype=float), np.array(begin.u, dtype=float)
        self.size = len(self.u)
        self.places = flow.tangents(self.q, self.u).places
        speeds = [k - self.size for k in self.places if k >= self.size]
        self.moving = [k for k in speeds if self.u[k]]
        self.others = [k for k in speeds if not self.u[k] and k in self.places]
        self.momenta = self._masses(self.q) @ self.u[self.moving]

    def found(self) -> Start | None:
        """Return the state, None where there is none near."""
        rows = ConstraintRows(self.flow.mechanism, self.flow.parameters, range(len(self.flow.mechanism.rows)))
        q, u = self.q, self.u
        for _ in range(_STEPS):
            step, moved = self._step(q, u)
            near = closed_near(rows, displaced(self.flow.mechanism, q, moved))
            if near is None:
                return None
            q, u = near, self._with_momenta(near)
            if float(np.abs(step).max(initial=0.0)) <= _CONVERGED:
                break
        names = [*(c.name for c in self.flow.mechanism.coordinates), *(s.name for s in self.flow.mechanism.speeds)]
        values = dict(zip(names, [*q.tolist(), *u.tolist()], strict=True))
        steady = start_beside(self.flow.mechanism, self.begin, values)
        return steady if is_balanced(self.flow, steady) and any(steady.u) else None

    def _step(self, q: Floats, u: Floats) -> tuple[Floats, Floats]:
        """Return a step of the other independent coordinates, and how all deviations move with it."""
        known = self.flow.known(q, u)
        X = self.flow.span(known, self.places)
        slopes = self.flow.derivatives(known)[0][self.size :] @ X
        by = [self.places.index(k) for k in self.others]
        by_rate = [self.places.index(self.size + k) for k in self.others]
        by_moving = [self.places.index(self.size + k) for k in self.moving]
        turning = slopes[np.ix_(self.moving, by_rate)]
        matrix = slopes[:, by] + slopes[:, by_moving] @ turning
        step = least_squares(matrix[self.others], -self.flow.accelerations(q, u)[self.others], ROUNDED)
        step = step * min(1.0, _LARGEST_STEP / max(float(np.abs(step).max(initial=0.0)), 1e-300))
        return np.asarray(step, dtype=float), np.asarray(X[:, by] @ step, dtype=float)[: self.size]

    def _masses(self, q: Floats) -> Floats:
        """Return the inertia of the moving coordinates, what moves with them included."""
        flow = self.flow
        known = flow.known(q, np.zeros(self.size))
        X = flow.span(known, self.places)[self.size :, [self.places.index(self.size + k) for k in self.moving]]
        state = state_of(flow.mechanism, float, 0.0, q.tolist(), [0.0] * self.size, list(flow.parameters))
        M = np.array(mass_matrix(motion_of(flow.mechanism, state)), dtype=float)
        return np.asarray(X.T @ M @ X)

    def _with_momenta(self, q: Floats) -> Floats:
        """Return the speeds with which the moving coordinates have their momenta."""
        masses = self._masses(q)
        if abs(np.linalg.det(masses)) <= _SINGULAR * np.abs(masses).max() ** len(masses):
            raise np.linalg.LinAlgError("no inertia is left")
        u = np.zeros(self.size)
        u[self.moving] = np.linalg.solve(masses, self.momenta)
        return self.flow.completed(q, u, 0.0, self.places)


# --- the state as formulas: as declared, or, where it was found beside the start, by solving its balances ------------

_WORK: Final = 30_000
_EXACTLY: Final = 1e-9
_TURNS: Final = 12
_MOST_TRIED: Final = 6


def formulas_of(mechanism: Mechanism, begin: Start, *, found: bool, places: Sequence[int]) -> SymbolicState:
    """Return the state in the names of the model; a coordinate without a formula keeps its name.

    `places` of the independent deviations. A coordinate of a state that was `found`, or that closes a declared one as
    where curves touch, is tried as a round number or part of a turn; of a found state then as a root of its balances.
    """
    if not found:
        given = declared_state(mechanism, begin)
        pairs = list(zip(mechanism.coordinates, begin.q, strict=True))
        rounded = {c.name: _quarter_turns(x) for c, x in pairs if symbol(c.name) in given.letters}
        kept = {name: node for name, node in rounded.items() if node is not None}
        if not kept:
            return given
        exactly = tuple(round(2.0 * x / math.pi) * math.pi / 2 if c.name in kept else x for c, x in pairs)
        return declared_state(_with_initial(mechanism, kept), replace(begin, q=exactly))
    tried = _Balance(_at_rest(mechanism, begin), begin, tuple(places))
    given = tried.state()
    for _ in range(_MOST_TRIED):
        formula = next(tried.formulas(given), None)
        if formula is None:
            break
        tried = replace(tried, mechanism=_with_initial(tried.mechanism, formula))
        given = tried.state()
    return tried.with_speeds(tried.with_distances(given))


def _at_rest(mechanism: Mechanism, begin: Start) -> Mechanism:
    """Return the mechanism with vanishing speeds declared as zero, and coordinates near round numbers as these."""
    speeds = tuple(
        replace(speed, initial=ZERO) if x == 0.0 else speed
        for speed, x in zip(mechanism.speeds, begin.u, strict=True)
    )
    formulas = {c.name: _quarter_turns(x) for c, x in zip(mechanism.coordinates, begin.q, strict=True)}
    for places in (places for body in mechanism.bodies for places in body.quaternions):
        if max(abs(abs(begin.q[k]) - round(abs(begin.q[k]))) for k in places) <= _EXACTLY:
            formulas |= {mechanism.coordinates[k].name: as_node(round(begin.q[k])) for k in places}
    kept = {name: node for name, node in formulas.items() if node is not None}
    return _with_initial(replace(mechanism, speeds=speeds), kept)


def _quarter_turns(x: float) -> Node | None:
    """Return zero, or a quarter of turns, where a number is nothing else."""
    quarters = round(2.0 * x / math.pi)
    if abs(quarters) > _TURNS or abs(x - quarters * math.pi / 2) > _EXACTLY:
        return None
    return as_node(quarters) * PI / 2


def _with_initial(mechanism: Mechanism, formulas: Mapping[str, Node]) -> Mechanism:
    coordinates = tuple(
        replace(c, initial=formulas[c.name]) if c.name in formulas else c for c in mechanism.coordinates
    )
    return replace(mechanism, coordinates=coordinates)


@dataclass(frozen=True)
class _Balance:
    """The balances at a state that was found, from which formulas for its coordinates follow."""

    mechanism: Mechanism
    begin: Start
    places: tuple[int, ...]

    def state(self) -> SymbolicState:
        """Return the state in symbols, coordinates near round numbers taken as these."""
        pairs = ((x, _quarter_turns(x)) for x in self.begin.q)
        q = tuple(x if node is None else round(2.0 * x / math.pi) * math.pi / 2 for x, node in pairs)
        assembled = self.begin.assembled if self.mechanism.rows else ()
        return declared_state(self.mechanism, replace(self.begin, q=q, assembled=assembled))

    def formulas(self, given: SymbolicState) -> Iterator[dict[str, Node]]:
        """Yield formulas for coordinates without one, in parameters, each with those that go with it."""
        unknown = self._unknown(given)
        sample = _sample(given)
        left = self._balances(given) if unknown else []
        yield from self._linear(given, unknown, sample) if left else ()
        for equation in left:
            named = [x for x in unknown if x in equation.symbols]
            if len(named) == 1:
                yield from self._of_one(equation, named[0], sample)

    def _of_one(self, equation: Quotient, unknown: Node, sample: Mapping[Node, float]) -> Iterator[dict[str, Node]]:
        known = {node: x for node, x in sample.items() if node is not unknown}
        try:
            for root in roots(equation, unknown):
                if fits(root, unknown, sample[unknown], known):
                    yield {str(unknown): self._in_slots(root)}
        except (NoClosedFormError, ExpressionError):
            return

    def with_distances(self, given: SymbolicState) -> SymbolicState:
        """Return the state with one of two coordinates of one kind by the other where a balance tells them apart.

        As two bodies that move off together: x2 = x1 + s.
        """
        names, sample = self._unknown(given), _sample(given)
        for equation in self._balances(given) if len(names) > 1 else ():
            named = [x for x in names if x in equation.symbols]
            if len(named) != 2:
                continue
            known = {node: x for node, x in sample.items() if node is not named[1]}
            with suppress(NoClosedFormError, ExpressionError):
                root = next((r for r in roots(equation, named[1]) if fits(r, named[1], sample[named[1]], known)), None)
                if root is not None:
                    return self._put(given, named[1], root)
        return given

    def _unknown(self, given: SymbolicState) -> list[Node]:
        """Return the coordinates without a formula; none where a speed has none."""
        if any(symbol(speed.name) in given.letters for speed in self.mechanism.speeds):
            return []
        return [symbol(c.name) for c in self.mechanism.coordinates if symbol(c.name) in given.letters]

    def _balances(self, given: SymbolicState) -> list[Quotient]:
        """Return what vanishes at a state; nothing where it has no closed form."""
        with suppress(NoClosedFormError, ExpressionError):
            return self._left(given)
        return []

    def _put(self, given: SymbolicState, letter: Node, formula: Node) -> SymbolicState:
        """Return the state with a formula for a coordinate or a speed."""
        mechanism, old = self.mechanism, given.state
        q = [formula if symbol(c.name) is letter else x for c, x in zip(mechanism.coordinates, old.q, strict=True)]
        u = [formula if symbol(s.name) is letter else x for s, x in zip(mechanism.speeds, old.u, strict=True)]
        parameters = [old.slots[slot("parameters", j)] for j in range(len(mechanism.parameters))]
        state = state_of(mechanism, Node, ZERO, q, u, parameters)
        return SymbolicState(state, {node: x for node, x in given.letters.items() if node is not letter})

    def with_speeds(self, given: SymbolicState) -> SymbolicState:
        """Return the state with formulas for speeds without one, each from a balance in which it is."""
        for letter in (symbol(speed.name) for speed in self.mechanism.speeds):
            if letter not in given.letters:
                continue
            sample = {node: float(x.sample) for node, x in given.letters.items() if node is not letter}
            value = float(given.letters[letter].sample)
            try:
                equations = [x for x in self._left(given) if letter in x.symbols]
                found = [root for x in equations for root in roots(x, letter) if fits(root, letter, value, sample)]
            except (NoClosedFormError, ExpressionError):
                continue
            if found:
                given = self._put(given, letter, found[0])
        return given

    def _linear(
        self, given: SymbolicState, unknown: Sequence[Node], sample: Mapping[Node, float]
    ) -> Iterator[dict[str, Node]]:
        """Yield all unknown coordinates where balance is linear in them, by one step from where they are zero."""
        try:
            field = Field(_WORK)
            equations = self._left(given, field)
            parts = [_linear_parts(equation, unknown) for equation in equations]
            solved = exact_solve([row for row, _ in parts], [-rest for _, rest in parts])
            formulas = {str(x): root for x, root in zip(unknown, map(shortest_node, solved), strict=True)}
            known = {node: x for node, x in sample.items() if node not in unknown}
            if all(fits(formulas[str(x)], x, sample[x], known) for x in unknown):
                yield {name: self._in_slots(node) for name, node in formulas.items()}
        except (NoClosedFormError, ExpressionError):
            return

    def _in_slots(self, node: Node) -> Node:
        names = self.mechanism.symbols
        return as_node(evaluate([node], lambda leaf: names.get(leaf, leaf))[0])

    def _left(self, given: SymbolicState, field: Field | None = None) -> list[Quotient]:
        """Return the forces along independent deviations, those of constraints eliminated, which vanish."""
        field = field or Field(_WORK)
        known = {node: field.letter(node, letter) for node, letter in given.letters.items()}
        matrix, right = linear_equations(motion_of(self.mechanism, given.state))
        nodes = [[as_node(x) for x in row] for row in (*matrix, right)]
        register_angles(field, [x for row in nodes for x in row], known)
        *rows, wanted = [exact(field, row, known) for row in nodes]
        size = len(self.mechanism.speeds)
        H = [row[:size] for row in rows[size:]]
        dependent = [k for k in range(size) if k not in self.places]
        found = []
        for place in self.places:
            left = [[row[k] for k in dependent] for row in H]
            moved = exact_solve(left, [-row[place] for row in H]) if dependent else []
            total = wanted[place]
            for k, x in zip(dependent, moved, strict=True):
                total = total + x * wanted[k]
            found.append(total)
        return [x for x in found if not x.is_zero]


def _sample(given: SymbolicState) -> dict[Node, float]:
    return {node: float(letter.sample) for node, letter in given.letters.items()}


def _linear_parts(equation: Quotient, unknown: Sequence[Node]) -> tuple[list[Quotient], Quotient]:
    """Return (a, b) of a . x + b in the unknown letters x. Raises NoClosedFormError for what is not linear."""
    field = equation.field
    rest, rows = field.whole(field.in_ring(equation.above)), []
    for x in unknown:
        k = field.position(x)
        rest, *slopes = [rest] if k is None else field.coefficients(rest.above, k)
        if len(slopes) > 1:
            raise NoClosedFormError("balance is not linear")
        rows += slopes or [field.constant(0)]
    if any(x in y.symbols for y in (*rows, rest, field.whole(field.in_ring(equation.below))) for x in unknown):
        raise NoClosedFormError("balance is not linear")
    return rows, rest
