"""What a system conserves: constant combinations of momenta, energy and Jacobi's integral whose rates vanish.

The rates are exact expressions, evaluated in random positions, speeds and times that the constraints allow, not along a
run. Floats propose the combinations; 50 digits decide, and give their coefficients: the rate of a conserved combination
is below 1e-30 of its terms. Combinations with one value in all states, as the momentum across a plane, are left out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import islice
from typing import Any, Final, Literal

import numpy as np
from mpmath import MPContext

from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.quantities import (
    angular_momentum,
    body_momenta,
    centre_of_mass,
    generalized_momenta,
    jacobi_integral,
    momentum,
    power_of,
)
from multibody_sym.dynamics.start.start import Start, sampled_states
from multibody_sym.dynamics.start.state import examined_state
from multibody_sym.errors import MultibodyError, NoSolutionError, UndefinedValueError
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy, split
from multibody_sym.mechanics.forces import applied_forces
from multibody_sym.mechanics.load_records import Load, PointForce, PointPull, span_leaves
from multibody_sym.mechanics.mechanism import TIME, Mechanism
from multibody_sym.mechanics.motion import State, coordinate_rates, motion_of, rates_of_state, slot_state
from multibody_sym.model.fields import AXES
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.calculus import tangents
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import PI, ZERO, Node, as_node, quantity, slot, symbol
from multibody_sym.scalars.rank import least_squares
from multibody_sym.scalars.tabulated import Tabulated
from multibody_sym.scalars.vectors import S
from multibody_sym.text.printer import text as in_model_language

# ----------------------------------------------------------------------------------------------------------------------
# Quantities that a system may conserve: expressions in slots, with their exact rates along the motion.
#
#     P and L about the origin, the momenta p_k = dT/du_k of the speeds, T + V, Jacobi's integral sum p_k u_k - T + V
#
# Constant combinations of these give momenta along fixed directions and about fixed axes, cyclic coordinates, the
# energy, Jacobi's integral, and L_C about the centre of mass.


Kind = Literal["momentum", "axis", "centre", "speed", "energy", "jacobi"]


@dataclass(frozen=True)
class Candidate:
    """A quantity by its name in expressions, of a kind, with its value and rate; `place` is an axis or a speed."""

    name: str
    kind: Kind
    place: int
    value: Node
    rate: Node


def candidates(mechanism: Mechanism) -> list[Candidate]:
    """Return all candidates, in slots; rates name the accelerations as slots `udot`."""
    motion = motion_of(mechanism, slot_state(mechanism))
    parts = body_momenta(motion)
    named: list[tuple[str, Kind, int, S]] = []
    vectors: list[tuple[str, Kind, S]] = [
        ("momentum({})", "momentum", momentum(parts)),
        ("angular_momentum({})", "axis", angular_momentum(parts)),
    ]
    if as_node(sum(part.mass for part in parts)) is not ZERO:
        about_centre = angular_momentum(parts, centre_of_mass(parts))
        vectors.append(("angular_momentum(system, com, {})", "centre", about_centre))
    for pattern, kind, vector in vectors:
        named += [(pattern.format(axis), kind, k, vector[k]) for k, axis in enumerate(AXES)]
    named += [
        (in_model_language(quantity("generalized_momentum", [freedom_name(mechanism, k)])), "speed", k, p)
        for k, p in enumerate(generalized_momenta(motion))
    ]
    energy = kinetic_energy(motion) + potential_energy(motion)
    named += [("total_energy()", "energy", 0, energy), ("jacobi_integral()", "jacobi", 0, jacobi_integral(motion))]
    values = [as_node(value) for *_, value in named]
    rates = tangents(values, rates_of_state(mechanism))
    every = [
        Candidate(name, kind, place, value, as_node(rate))
        for (name, kind, place, _), value, rate in zip(named, values, rates, strict=True)
    ]
    potential = [load for load in split(mechanism.loads)[1] if _has_potential(load)]
    if potential:  # the energy less the work of these forces, which V does not hold
        of_energy = every[-2]
        power = power_of(motion, applied_forces(motion, potential, weight=False).of_body)
        works = (in_model_language(quantity("work", [load.name])) for load in potential)
        every.append(
            replace(of_energy, name=" - ".join([of_energy.name, *works]), place=1, rate=of_energy.rate - power)
        )
    return every


def _has_potential(load: Load) -> bool:
    """Return whether a force depends on the distance of its points alone, or is the same everywhere and always."""
    if isinstance(load, PointPull):
        free = {span_leaves(load.name)[0]}
        named = leaves([load.value], "slot", "quantity")
    elif isinstance(load, PointForce) and load.axes < 0:
        free = set()
        named = leaves(load.value, "slot", "quantity")
    else:
        return False
    return all(leaf in free or (leaf.op == "slot" and leaf.data[0] == "parameters") for leaf in named)


def freedom_name(mechanism: Mechanism, speed: int) -> str:
    """Return the coordinate whose rate a speed is; the speed's own name where it is the rate of none."""
    pairs = {u: q for body in mechanism.bodies for q, u in body.rate_pairs}
    return mechanism.coordinates[pairs[speed]].name if speed in pairs else mechanism.speeds[speed].name


# ----------------------------------------------------------------------------------------------------------------------
# The symmetry behind a conserved quantity, in words: the motion of the whole, or the shift of time, without effect.


_NEARLY: Final = 1e-9
Part = tuple[Candidate, float]


def symmetry(mechanism: Mechanism, parts: Sequence[Part]) -> str:
    """Return the symmetry in words that keeps a combination of candidates constant."""
    kinds = {part.kind for part, _ in parts}
    if "energy" in kinds and len(parts) == 1:
        text = "time: no energy, force or constraint that does work depends on it"
        text += ", and these forces have a potential" * bool(parts[0][0].place)
    elif "energy" in kinds:
        text = "time, as seen from what is driven steadily (Jacobi's integral): there nothing depends on it"
    elif "jacobi" in kinds:
        text = "time, as seen from what moves as prescribed: there no energy or force depends on it"
    elif "speed" in kinds:
        text = _symmetry_of_freedoms(mechanism, [part for part, _ in parts])
    elif kinds == {"centre"}:
        axes = ", ".join(AXES[part.place] for part, _ in parts)
        text = f"turning all about the centre of mass: no moment from outside about it along {axes}"
    else:
        text = _symmetry_of_space(parts)
    return f"{text}, while the states of the start last" if mechanism.one_way else text


def _symmetry_of_freedoms(mechanism: Mechanism, parts: Sequence[Candidate]) -> str:
    """Return that coordinates are cyclic, or that turning a body about an axis of its own changes nothing."""
    rates = {u for body in mechanism.bodies for _, u in body.rate_pairs}
    places = [part.place for part in parts if part.kind == "speed"]
    names = " and ".join(freedom_name(mechanism, k) for k in places)
    if all(k in rates for k in places) and len(parts) == 1:
        return f"{names} is cyclic: no energy or constraint depends on it, and no force acts along it"
    if len(parts) == 1:
        body = next(body.name for body in mechanism.bodies if places[0] in body.u)
        return f"{body} is moved along {names} in its own axes: no energy depends on that, and no force acts along it"
    return f"{names} change together: no energy or constraint depends on that, and no force acts along it"


def _symmetry_of_space(parts: Sequence[Part]) -> str:
    """Return along which direction, or about which axis or screw, moving all changes nothing."""
    vectors = {"momentum": np.zeros(3), "axis": np.zeros(3)}
    for part, c in parts:
        if part.kind in vectors:
            vectors[part.kind][part.place] += c
    along, about = vectors.values()
    if not about.any():
        return f"moving all along {_direction(along)}: no force from outside acts along it"
    axis = about / np.linalg.norm(about)
    pitch = float(along @ axis)
    if abs(pitch) > _NEARLY * float(np.linalg.norm(along)):
        return f"a screw of all about {_direction(about)}: forces from outside do no work in it"
    through = np.cross(about, along) / float(about @ about)
    place = "" if np.abs(through).max() <= _NEARLY else f" through ({', '.join(f'{x:.6g}' for x in through)})"
    return f"turning all about the axis {_direction(about)}{place}: no moment from outside about it"


def _direction(vector: Floats) -> str:
    unit = vector / np.linalg.norm(vector)
    for k, axis in enumerate(AXES):
        if abs(abs(unit[k]) - 1.0) <= _NEARLY:
            return axis
    return f"({', '.join(f'{x + 0.0:.6g}' for x in unit)})"


# ----------------------------------------------------------------------------------------------------------------------
# States of a mechanism, its accelerations, and expressions there, in 50 digits: a value that vanishes to 30 is zero.


MP: Final = MPContext()
MP.dps = 50
ZERO_BELOW: Final = MP.mpf(10) ** -30
"""The part of the terms' sizes below which a result is rounding: 20 digits are left for cancellation."""
_CLOSED: Final = MP.mpf(10) ** -40
_STEPS: Final = 6
Number = Any
Matrix = list[list[Number]]


def _table_value(function: Tabulated, order: int, a: Number) -> Number:
    x = symbol("x")
    return precise_values([function.piece(order, float(a), x)], {x: a})[0]


_OPERATIONS: Final[dict[str, Callable[..., Number]]] = {
    "neg": lambda a: -a, "add": lambda a, b: a + b, "mul": lambda a, b: a * b, "div": lambda a, b: a / b,
    "pow": MP.power, "sin": MP.sin, "cos": MP.cos, "tan": MP.tan, "asin": MP.asin,
    "acos": MP.acos, "atan": MP.atan, "atan2": MP.atan2, "sinh": MP.sinh, "cosh": MP.cosh, "tanh": MP.tanh,
    "asinh": MP.asinh, "acosh": MP.acosh, "atanh": MP.atanh,
    "exp": MP.exp, "log": MP.log, "sqrt": MP.sqrt, "abs": abs, "sign": MP.sign, "min": min, "max": max,
    "less": lambda a, b: MP.mpf(a < b), "less_equal": lambda a, b: MP.mpf(a <= b),
    "where": lambda condition, a, b: a if condition else b, "table": _table_value,
}  # fmt: skip


def precise_values(nodes: Iterable[Node], leaf: Mapping[Node, Number]) -> list[Number]:
    """Return the values of expressions in 50 digits, given their leaves. Raises `UNDEFINED` where one has none."""
    roots = list(nodes)
    values: dict[Node, Number] = {}
    for n in postorder(roots):
        if n.args:
            value = _OPERATIONS[n.op](*n.own, *(values[a] for a in n.args))
            if isinstance(value, MP.mpc) or not MP.isfinite(value):
                raise UndefinedValueError("no real value")
            values[n] = value
        elif n.op == "number":
            values[n] = MP.mpf(n.data.numerator) / n.data.denominator
        else:
            values[n] = +MP.pi if n is PI else MP.mpf(n.data) if n.op == "real" else leaf[n]
    return [values[n] for n in roots]


@dataclass(frozen=True)
class Precise:
    """A mechanism's equations as expressions for values in 50 digits; `parameters` (np) as at the start."""

    mechanism: Mechanism
    parameters: Sequence[float]

    @cached_property
    def _parameter_values(self) -> dict[Node, Number]:
        """The values of the parameters, from their expressions where they have one, so that 1/3 is a third."""
        known: dict[Node, Number] = {}
        for k, (entry, as_float) in enumerate(zip(self.mechanism.parameters, self.parameters, strict=True)):
            value = MP.mpf(as_float)
            if entry.value is not None and all(leaf in known for leaf in leaves([entry.value], "slot")):
                precise = precise_values([entry.value], known)[0]
                if abs(precise - value) <= 1e-12 * abs(value):
                    value = precise
            known[slot("parameters", k)] = value
        return known

    @cached_property
    def _equations(self) -> Any:
        return composite_body(self.mechanism, slot_state(self.mechanism))

    def at(self, state: State) -> dict[Node, Number]:
        """Return the slots at a state nearby that satisfies the constraints, with the accelerations `udot`.

        Raises UndefinedValueError where no such state is found, and `UNDEFINED` where an expression has no value.
        """
        leaf = dict(self._parameter_values)
        leaf[TIME] = MP.mpf(state.slots[TIME])
        leaf.update((slot("q", k), MP.mpf(x)) for k, x in enumerate(state.q))
        leaf.update((slot("u", k), MP.mpf(x)) for k, x in enumerate(state.u))
        self._close(leaf)
        self._add_inputs(leaf)
        leaf.update((slot("udot", k), x) for k, x in enumerate(self._accelerations(leaf)))
        return leaf

    def _add_inputs(self, leaf: dict[Node, Number]) -> None:
        inputs = precise_values(self.mechanism.inputs.values(), leaf)
        leaf.update((slot("inputs", k), x) for k, x in enumerate(inputs))

    def _close(self, leaf: dict[Node, Number]) -> None:
        """Move coordinates, then speeds, by least steps until constraints hold."""
        self._normalize(leaf)
        if not self.mechanism.rows:
            return
        rows = [row for row, declared in zip(self._equations.rows, self.mechanism.rows, strict=True) if row.kinematic]
        closing = [row for row in rows if row.holonomic]
        for _ in range(_STEPS):
            self._add_inputs(leaf)
            phi = precise_values([as_node(row.phi) for row in closing], leaf)
            if all(abs(x) < _CLOSED for x in phi):
                break
            self._move(leaf, _least(self._matrix(closing, leaf), [-x for x in phi]))
        else:
            raise UndefinedValueError("the constraints are not closed")
        psi = precise_values([as_node(row.phidot) for row in rows], leaf)
        for k, change in enumerate(_least(self._matrix(rows, leaf), [-x for x in psi])):
            leaf[slot("u", k)] += change
        self._add_inputs(leaf)
        if any(abs(x) > _CLOSED for x in precise_values([as_node(row.phidot) for row in rows], leaf)):
            raise UndefinedValueError("the constraints are not kept")

    def _move(self, leaf: dict[Node, Number], change: Sequence[Number]) -> None:
        """Move the coordinates as speeds (nu) would in a unit of time."""
        state = slot_state(self.mechanism)
        rates = coordinate_rates(self.mechanism, state.q, state.u)
        there = {**leaf, **{slot("u", k): x for k, x in enumerate(change)}}
        for k, rate in enumerate(precise_values(map(as_node, rates), there)):
            leaf[slot("q", k)] += rate
        self._normalize(leaf)

    def _normalize(self, leaf: dict[Node, Number]) -> None:
        for places in (places for body in self.mechanism.bodies for places in body.quaternions):
            length = MP.sqrt(sum(leaf[slot("q", k)] ** 2 for k in places))
            for k in places:
                leaf[slot("q", k)] /= length

    def _matrix(self, rows: Sequence[Any], leaf: Mapping[Node, Number]) -> Matrix:
        flat = precise_values([as_node(x) for row in rows for x in row.jacobian], leaf)
        n = len(self.mechanism.speeds)
        return [flat[n * k : n * k + n] for k in range(len(rows))]

    def _accelerations(self, leaf: Mapping[Node, Number]) -> list[Number]:
        """Return udot of M udot - C^T lambda = f, H udot + D lambda = gamma."""
        found, n = self._equations, len(self.mechanism.speeds)
        s = len(found.rows)
        if any(row.beside for row in found.rows):
            raise UndefinedValueError("friction has a direction that is not linear in the forces")
        coupling = [[row.coupling.get(k, 0) for k in range(s)] for row in found.rows]
        matrix = [[*found.mass_matrix[i], *(-row.forces[i] for row in found.rows)] for i in range(n)]
        matrix += [[*row.jacobian, *coupling[k]] for k, row in enumerate(found.rows)]
        right = [*found.forcing, *(row.gamma for row in found.rows)]
        flat = precise_values([as_node(x) for row in (*matrix, right) for x in row], leaf)
        size = n + s
        rows = [flat[size * k : size * k + size] for k in range(size)]
        udot = solve_precisely(rows, flat[size * size :])[:n]
        return [MP.mpf(0) if k in self.mechanism.held else x for k, x in enumerate(udot)]


def _least(matrix: Matrix, right: Sequence[Number]) -> list[Number]:
    """Return the x of least norm with A x = r, for dependent rows too that agree."""
    count = len(matrix[0]) if matrix else 0
    products = [[MP.fdot(a, b) for b in matrix] for a in matrix]
    y = solve_precisely(products, right)
    return [MP.fdot(y, [row[k] for row in matrix]) for k in range(count)]


def solve_precisely(matrix: Matrix, right: Sequence[Number]) -> list[Number]:
    """Return a solution of A x = r, zero in what dependent columns leave open.

    Raises UndefinedValueError where there is none.
    """
    rows = [[*row, r] for row, r in zip(matrix, right, strict=True)]
    for row in rows:
        size = max(map(abs, row[:-1]), default=MP.mpf(0))
        row[:] = [x / size for x in row] if size else row
    pivots: list[tuple[int, int]] = []
    left = list(range(len(rows)))
    columns = list(range(len(right)))
    while left:
        size, i, j = max(((abs(rows[i][j]), i, j) for i in left for j in columns), default=(MP.mpf(0), 0, 0))
        if size < ZERO_BELOW:
            break
        left.remove(i)
        columns.remove(j)
        pivots.append((i, j))
        for k in left:
            factor = rows[k][j] / rows[i][j]
            rows[k] = [a - factor * b for a, b in zip(rows[k], rows[i], strict=True)]
    largest = max((abs(row[-1]) for row in rows), default=MP.mpf(0))
    if any(abs(rows[k][-1]) > ZERO_BELOW * (1 + largest) for k in left):
        raise UndefinedValueError("the equations contradict each other")
    x = [MP.mpf(0)] * len(right)
    for i, j in reversed(pivots):
        x[j] = (rows[i][-1] - MP.fdot(rows[i][:-1], x)) / rows[i][j]
    return x


# ----------------------------------------------------------------------------------------------------------------------

MOST: Final = 60
"""Speeds beyond which expressions of the rates would be too long."""
MANY: Final = 6
"""Speeds beyond which their momenta are candidates one by one, not in combinations."""
_SPARE: Final = 3
_PROPOSED: Final = 1e-7
"""The part of a column that combinations of others leave, up to which 50 digits decide."""
_SAME: Final = 1e-6
"""The part of a combination that others leave, below which it depends on them."""
_SEED: Final = 11
_ORDER: Final[tuple[Kind, ...]] = ("momentum", "axis", "centre", "energy", "jacobi", "speed")
"""The plainest first."""
_COMBINED: Final[tuple[Kind, ...]] = ("momentum", "axis", "centre", "speed", "energy", "jacobi")
"""Each kind is combined with those before it."""
_TOLD: Final[tuple[Kind, ...]] = ("energy", "jacobi", "momentum", "axis", "centre", "speed")


@dataclass(frozen=True)
class Conserved:
    """A quantity that stays constant: its `name`, an expression that outputs may have, and the `symmetry` behind it.

    `coefficients` of the candidates in it, by name; `exact`: decided in 50 digits, not by floats alone.
    """

    name: str
    kind: Kind
    symmetry: str
    coefficients: Mapping[str, float]
    exact: bool = True


def find_conserved(mechanism: Mechanism, begin: Start) -> list[Conserved]:
    """Return the quantities that a mechanism conserves in its mode at the start, energy first.

    None are searched for with more than `MOST` speeds, which would take long.
    """
    if len(mechanism.speeds) > MOST:
        return []
    pool = candidates(mechanism)
    alone = len(mechanism.speeds) if len(mechanism.speeds) > MANY else 0
    states = sampled_states(mechanism, begin, len(pool) - alone + _SPARE, _SEED)[1:]
    table = _table_of(mechanism, pool, states)
    if table is None:
        return []
    kinds = [x.kind for x in pool]
    columns = sorted(range(len(pool)), key=lambda k: (not alone or kinds[k] != "speed", _COMBINED.index(kinds[k])))
    decide = _Decision(mechanism, begin, pool, states)
    trivial = list(table.dependent(table.values - table.values[0], columns, alone))  # of one value in all states
    known = [table.scaled(x) for x in trivial]
    proposed = [x for x in table.dependent(table.rates, columns, alone) if not _in_span(table.scaled(x), known)]
    confirmed = {id(x): precise for x in proposed if (precise := decide.confirmed(x)) is not None}
    found = []
    for x in _plainest(pool, table, [x for x in proposed if id(x) in confirmed], trivial):
        precise = confirmed[id(x)]
        named = {pool[k].name: c for k, c in precise.items()}
        parts = [(pool[k], c) for k, c in precise.items()]
        first = "energy" if any(p.kind == "energy" for p, _ in parts) else parts[0][0].kind
        found.append(Conserved(_expression(named), first, symmetry(mechanism, parts), named, decide.exact))
    return sorted(found, key=lambda x: _TOLD.index(x.kind))


def conserved_quantities(
    system: System,
    *,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    formalism: str | None = None,
) -> list[Conserved]:
    """Return the quantities that a system conserves from its start on; none where it has no start.

    `parameters` .. `project` change the system (`Overrides`); the formalism makes no difference. Raises InputError.
    """
    asked = Overrides(parameters, initial, inputs, coordinates, project).of(system)
    try:
        state = examined_state(asked)
    except NoSolutionError:
        return []
    return find_conserved(state.mechanism, state.start)


Combination = dict[int, float]
"""Coefficients by the numbers of candidates."""


@dataclass(frozen=True)
class _Table:
    """Values and rates (states x candidates), divided by the `sizes` (candidates) of either."""

    values: Floats
    rates: Floats
    sizes: Floats

    def dependent(self, matrix: Floats, columns: Sequence[int], alone: int) -> Iterator[Combination]:
        """Yield combinations that vanish but for rounding: of each column with earlier ones, the first `alone` none."""
        basis: list[int] = []
        for place, k in enumerate(columns):
            column = matrix[:, k]
            used = basis if place >= alone else []
            x = least_squares(matrix[:, used], column) if used else np.zeros(0)
            rest = column - matrix[:, used] @ x if used else column
            if np.abs(rest).max(initial=0.0) <= _PROPOSED:
                pairs = ((j, c) for j, c in zip(used, x, strict=True) if abs(c) > _PROPOSED)
                yield {k: 1.0, **{j: -c * self.sizes[k] / self.sizes[j] for j, c in pairs}}
            elif place >= alone:
                basis.append(k)

    def scaled(self, combination: Combination) -> Floats:
        """Return a combination as a unit vector over the scaled candidates."""
        vector = np.zeros(len(self.sizes))
        for k, c in combination.items():
            vector[k] = c * self.sizes[k]
        vector /= np.abs(vector).max()  # squares of energies may pass all floats
        found: Floats = vector / np.linalg.norm(vector)
        return found


def _table_of(mechanism: Mechanism, pool: Sequence[Candidate], states: Sequence[State]) -> _Table | None:
    """Return the table over the states at which all candidates have values; None where these are too few."""
    nodes = [x for each in pool for x in (each.value, each.rate)]
    rows = []
    for state in states:
        try:
            udot = forward_dynamics(composite_body(mechanism, state)).udot.tolist()
            rows.append(evaluate_float(nodes, {**state.slots, **{slot("udot", k): x for k, x in enumerate(udot)}}))
        except (*UNDEFINED, MultibodyError):
            continue
    if len(rows) < len(states) - _SPARE + 1 or not states:
        return None
    both = np.array(rows, dtype=float).reshape(len(rows), len(pool), 2)
    if not np.isfinite(both).all():
        return None
    sizes = np.abs(both).max(axis=(0, 2), initial=0.0)
    sizes[sizes == 0.0] = 1.0
    return _Table(both[:, :, 0] / sizes, both[:, :, 1] / sizes, sizes)


class _Decision:
    """Decides in 50 digits whether rates of combinations vanish, and with which coefficients."""

    def __init__(
        self, mechanism: Mechanism, begin: Start, pool: Sequence[Candidate], states: Sequence[State]
    ) -> None:
        self._pool = pool
        self._precise = Precise(mechanism, begin.parameters)
        self._states = iter(states)
        self._slots: list[Mapping[Node, Number]] = []

    def confirmed(self, proposed: Combination) -> Combination | None:
        """Return a combination with its coefficients in 50 digits, as far as there are; None where it changes."""
        others = list(proposed)[1:]
        rows = self._rates(list(proposed), len(others) + 2)
        if rows is None:
            return proposed
        try:
            x = solve_precisely([row[1:] for row in rows[: len(others)]], [-row[0] for row in rows[: len(others)]])
        except MultibodyError:
            return None
        for row in rows:
            terms = [row[0], *(a * b for a, b in zip(row[1:], x, strict=True))]
            if abs(sum(terms)) > ZERO_BELOW * (1 + sum(map(abs, terms))):
                return None
        return dict(zip(proposed, [1.0, *map(float, x)], strict=True))

    @property
    def exact(self) -> bool:
        """Return whether 50 digits decided, not floats."""
        return bool(self._slots)

    def _rates(self, places: Sequence[int], count: int) -> list[list[Number]] | None:
        """Return the rates of candidates at so many states; None where they have no value in 50 digits."""
        while len(self._slots) < count:
            state = next(self._states, None)
            if state is None:
                return None
            try:
                self._slots.append(self._precise.at(state))
            except (*UNDEFINED, MultibodyError):
                continue
        try:
            return [precise_values([self._pool[k].rate for k in places], leaf) for leaf in islice(self._slots, count)]
        except (*UNDEFINED, MultibodyError):
            return None


def _plainest(
    pool: Sequence[Candidate], table: _Table, proposed: Sequence[Combination], trivial: Sequence[Combination]
) -> list[Combination]:
    """Return independent combinations, the plainest first, that do not follow from others or from constants.

    Of combinations of energies only one counts.
    """

    def plainness(x: Combination) -> tuple[int, int, int]:
        first = pool[next(iter(x))]
        return len(x), _ORDER.index(first.kind), first.place

    def has_energy(x: Combination) -> bool:
        return any(pool[k].kind in ("energy", "jacobi") for k in x)

    turning = {pool[k].place for x in proposed for k in x if pool[k].kind == "axis"}
    turning -= {pool[k].place for x in trivial if len(x) == 1 for k in x if pool[k].kind == "axis"}
    known = [table.scaled(x) for x in trivial]
    found: list[Combination] = []
    for x in sorted(proposed, key=plainness):
        follows = has_energy(x) and any(map(has_energy, found))
        if follows or any(pool[k].kind == "centre" and pool[k].place in turning for k in x):
            continue
        vector = table.scaled(x)
        if _in_span(vector, known):
            continue
        known.append(vector)
        found.append(x)
    return found


def _in_span(vector: Floats, known: Sequence[Floats]) -> bool:
    if not known:
        return False
    basis = np.array(known).T
    rest = vector - basis @ least_squares(basis, vector)
    return bool(np.linalg.norm(rest) <= _SAME)


def _expression(named: Mapping[str, float]) -> str:
    """Return a combination in the language of expressions."""
    text = ""
    for name, c in named.items():
        sign = " - " if c < 0 else " + "
        size = abs(round(c, 12))
        term = name if size == 1.0 else f"{size:.12g}*{name}"
        text += f"{sign}{term}" if text else (f"-{term}" if c < 0 else term)
    return text
