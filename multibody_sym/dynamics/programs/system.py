"""From dynamics over Nodes to the Programs that a simulation runs: derivatives, projections, energy, outputs, events.

In: a Mechanism, a formalism and the form that a method needs. Out: Programs (`program.programs`).
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, fields, replace
from functools import cached_property, reduce
from typing import TYPE_CHECKING, Final

import numpy as np

from multibody_sym.dynamics.formalisms.articulated_body import block_ldl, tree_factors
from multibody_sym.dynamics.formalisms.composite_body import mass_diagonal
from multibody_sym.dynamics.formalisms.constrained import Matrix, Sharing, correction, solve_constrained
from multibody_sym.dynamics.formalisms.equations import Formalism, FrictionTerms, TreeDynamics, massless_speeds
from multibody_sym.dynamics.programs.quantities import Sources, choose, column, events, with_quantities
from multibody_sym.mechanics.alignment import economical_motion
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy
from multibody_sym.mechanics.mechanism import ALPHA, BETA, INDEPENDENT, Mechanism
from multibody_sym.mechanics.modes import shared_forces
from multibody_sym.mechanics.motion import Motion, arrays, coordinate_rates, motion_of, qdot_of, slot_state
from multibody_sym.mechanics.points import NO_WRENCH, direction, position
from multibody_sym.mechanics.row_kinematics import RowMotion, acting_rows, along_reactions, power_terms, row_motions
from multibody_sym.mechanics.row_records import AngleRow
from multibody_sym.program.program import Program
from multibody_sym.program.programs import Form, Programs
from multibody_sym.program.statements import Array, Solve
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.functions import absolute, maximum, sqrt, where
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, less, real
from multibody_sym.scalars.rank import PIVOT, without_rounding
from multibody_sym.scalars.vectors import S, dot, unit_quaternion

if TYPE_CHECKING:
    from multibody_sym.dynamics.programs.repeated_bodies import LikeBodies

# ----------------------------------------------------------------------------------------------------------------------
# Programs that close loops at the start: rows and their sizes in numbers, at any state.
#
# Over floats, Python walks through the kinematics of all bodies at each state; these are the same rows over Nodes. H
# and H G^-1, with M = G^T G, consist of the elements that are not zero everywhere.


CLOSING: Final = "closing"
PLACES: Final = "closing_places"
CHANGE: Final = "closing_change"
_LONG: Final = 400
"""Operations from which on loops are sooner compiled: these Programs run so seldom that only compiling counts."""

Elements = list[tuple[int, int, Node]]
"""Row, column and value of the elements of a matrix that are not zero everywhere."""


def closing_programs(mechanism: Mechanism) -> dict[str, Program]:
    """Return by name the Programs that close the rows of a mechanism; none where it has none to close.

    All take (t, q, u, parameters, inputs, modes). `closing`: of each row (ns) phi, phidot, gamma, the largest component
    of its wrenches, `exerted`, the terms of its `power`, and `aligned`, negative where a joint is turned over; `length`
    of the model; `shares` (nu): the pivots of M as parts of its diagonal; elements of H, `jacobian`, and of H G^-1,
    `weighted`. `closing_places`: rows and columns of those elements, and 1 for each row that does not vanish, else 0.
    `closing_change`: G^-1 x (nu) for one more input x (nu).
    """
    if not closes_by_programs(mechanism):
        return {}
    motion = economical_motion(mechanism, slot_state(mechanism))
    rows = row_motions(motion)
    acting = [
        k
        for k, row in enumerate(rows)
        if row.kinematic and {*map(as_node, row.jacobian), as_node(row.gamma), as_node(row.phidot)} != {ZERO}
    ]
    jacobian = [(k, j, as_node(x)) for k in acting for j, x in enumerate(rows[k].jacobian) if as_node(x) is not ZERO]
    factors = tree_factors(motion)
    lines = [(k, factors.weighted([as_node(x) for x in rows[k].jacobian])) for k in acting]
    weighted = [(k, j, as_node(x)) for k, line in lines for j, x in enumerate(line) if as_node(x) is not ZERO]
    shares = [as_node(p) / d for p, d in zip(factors.pivots, mass_diagonal(motion), strict=True)]
    matrices = {"jacobian": jacobian, "weighted": weighted}
    markers = [position(motion, marker) for marker in motion.mechanism.markers.values()]
    squares = dict.fromkeys(as_node(dot(p, p)) for p in (*markers, *(p for _, p in motion.poses)))
    closing = Trace(CLOSING, arrays(mechanism)).finish(
        {
            **_row_values(motion, rows),
            "length": ((), [as_node(sqrt(reduce(maximum, squares, ZERO)))]),
            "shares": column(shares),
            **{name: column(x for _, _, x in elements) for name, elements in matrices.items()},
        }
    )
    pairs = {name: [as_node(x) for k, j, _ in elements for x in (k, j)] for name, elements in matrices.items()}
    of_elements = {name: ((len(x) // 2, 2), x) for name, x in pairs.items()}
    acts = column(ONE if k in acting else ZERO for k in range(len(rows)))
    places = Trace(PLACES, arrays(mechanism)).finish({**of_elements, "acting": acts})
    count = len(mechanism.speeds)
    trace = Trace(CHANGE, (*arrays(mechanism), Array("x", (count,))))
    change = trace.finish({"change": column(correction(factors, [], lambda _weighted: list(trace["x"])))})
    from multibody_sym.program.loops import with_loops  # which trees do without

    return {program.name: with_loops(program, _LONG) for program in (closing, places, change)}


def closes_by_programs(mechanism: Mechanism) -> bool:
    """Return whether Programs close the rows of a mechanism: it has no one-way elements and no massless freedoms."""
    special = mechanism.one_way or mechanism.mode is not None or mechanism.relative is not None
    return bool(mechanism.rows) and not special and not massless_speeds(mechanism)


def _row_values(motion: Motion, rows: Sequence[RowMotion]) -> dict[str, tuple[tuple[int], list[Node]]]:
    """Return the outputs of `closing` that have a value for each row."""
    exerted, aligned = [], []
    for row, declared in zip(rows, motion.mechanism.rows, strict=True):
        wrenches = (wrench for wrench in row.of_body if wrench is not NO_WRENCH)
        parts = (as_node(absolute(as_node(x))) for wrench in wrenches for part in wrench for x in part)
        exerted.append(reduce(maximum, (x for x in dict.fromkeys(parts) if x is not ZERO), ZERO))
        cosine: S = ONE
        if isinstance(declared, AngleRow) and declared.shared is not None:
            cosine = dot(*(direction(motion, frame, declared.shared) for frame in declared.frames))
        aligned.append(cosine)
    return {
        "phi": column(row.gap if row.kinematic else ZERO for row in rows),
        "phidot": column(row.phidot for row in rows),
        "gamma": column(row.gamma for row in rows),
        "exerted": column(exerted),
        "power": column(power_terms(motion, rows)),
        "aligned": column(aligned),
    }


# ----------------------------------------------------------------------------------------------------------------------
# Rows of a mechanism in numbers at a state, by callable Programs (`closing_programs`).


Functions = Mapping[str, Callable[..., tuple[Floats, ...]]]
"""Programs by name, ready to be called with their inputs; `inputs` among them."""
_NO_MODES: Final = np.empty(0)
_REMEMBERED: Final = 4


@dataclass(frozen=True)
class ClosingRows:
    """The values of `closing` at a state, by the names of its outputs; H (ns x nu) and H G^-1 of all rows."""

    phi: Floats
    phidot: Floats
    gamma: Floats
    power: Floats
    aligned: Floats
    length: float
    shares: Floats
    jacobian: Floats
    weighted: Floats

    @cached_property
    def finite(self) -> bool:
        return all(bool(np.isfinite(getattr(self, each.name)).all()) for each in fields(self))

    @property
    def has_inertia(self) -> bool:
        """Whether all pivots of the mass matrix are positive beside its diagonal."""
        return bool((self.shares > PIVOT * len(self.shares)).all())


@dataclass(frozen=True, eq=False)
class CompiledRows:
    """The rows of a `mechanism` by callable Programs."""

    mechanism: Mechanism
    functions: Functions
    _latest: tuple[tuple[bytes, ClosingRows], ...] = field(default=(), init=False)

    def at(self, t: float, q: Floats, u: Floats, parameters: Sequence[float]) -> ClosingRows:
        """Return the rows at a state; numbers without a value are not finite."""
        key = np.concatenate([(t,), q, u, parameters]).tobytes()
        for known, rows in self._latest:  # several functions ask for the same state, one after the other
            if known == key:
                return rows
        with np.errstate(all="ignore"):
            values = self.functions[CLOSING](*self._arguments(t, q, u, parameters))
        phi, phidot, gamma, exerted, power, aligned, length, shares, jacobian, weighted = values
        H = without_rounding(self._dense(jacobian, self._places[0]), exerted)
        moves = H.any(axis=1, keepdims=True)
        by_mass = np.where(moves, self._dense(weighted, self._places[1]), 0.0)
        rows = ClosingRows(phi, phidot, gamma, power, aligned, float(length), shares, H, by_mass)
        object.__setattr__(self, "_latest", ((key, rows), *self._latest[: _REMEMBERED - 1]))
        return rows

    def change(self, t: float, q: Floats, u: Floats, parameters: Sequence[float], x: Floats) -> Floats:
        (change,) = self.functions[CHANGE](*self._arguments(t, q, u, parameters), x)
        return change

    @cached_property
    def acting(self) -> Floats:
        """1 for each row (ns) that does not vanish everywhere, 0 for the others."""
        return self._constants[2]

    def _arguments(self, t: float, q: Floats, u: Floats, parameters: Sequence[float]) -> tuple[float | Floats, ...]:
        known = t, q, u, np.asarray(parameters, dtype=float)
        inputs = self.functions["inputs"](*known)[0] if self.mechanism.inputs else np.empty(0)
        return (*known, inputs, _NO_MODES)

    @cached_property
    def _constants(self) -> tuple[Floats, ...]:
        sizes = len(self.mechanism.coordinates), len(self.mechanism.speeds), len(self.mechanism.parameters)
        return self.functions[PLACES](0.0, *map(np.zeros, sizes), np.zeros(len(self.mechanism.inputs)), _NO_MODES)

    @cached_property
    def _places(self) -> list[tuple[Floats, Floats]]:
        found = [places.astype(int) for places in self._constants[:2]]
        return [(places[:, 0], places[:, 1]) for places in found]

    def _dense(self, values: Floats, places: tuple[Floats, Floats]) -> Floats:
        matrix = np.zeros((len(self.mechanism.rows), len(self.mechanism.speeds)))
        matrix[places] = values
        return matrix


# ----------------------------------------------------------------------------------------------------------------------
# The equations of motion stabilised by rows on positions and on speeds, of index 2, with their exact derivatives.
#
#     qdot = N (u + M^-1 H^T mu)      M udot = f + H^T lambda      0 = phi(q, t)      0 = H u + phi_t
#
# The rows on positions have multipliers mu of their own; nonholonomic rows are rows on speeds only. mu is zero in the
# motion itself, and in its approximations moves q the shortest way, in the norm of the mass matrix, back to phi = 0.
#
# Forces that press in a joint with friction are defined by accelerations and multipliers: they are no equations here,
# but part of f, as on the constraints. So are forces that hold immobile speeds at rest.
#
# Source: C. W. Gear, B. Leimkuhler, G. K. Gupta, Automatic integration of Euler-Lagrange equations with constraints
# (1985); E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section VII.1.


@dataclass(frozen=True, eq=False)
class _Index2:
    """The rows of a mechanism by their part in equations of index 2, with its state `derivative`.

    Rows that define a force are no equations, nor are rows that hold speeds at zero and bear on no others: their forces
    follow from the state.
    """

    mechanism: Mechanism
    dynamics: TreeDynamics
    derivative: Program

    @cached_property
    def held(self) -> frozenset[int]:
        """The speeds that stay zero to the last bit: none if a row bears on them and on others."""
        held = frozenset(self.mechanism.held)
        reached = [_places(row.jacobian) for row in self.dynamics.rows if row.kinematic]
        return held if all(places <= held or not places & held for places in reached) else frozenset()

    @cached_property
    def given(self) -> list[int]:
        """The rows that are no equations."""
        rows = enumerate(self.dynamics.rows)
        return [k for k, row in rows if not row.kinematic or (self.held and _places(row.jacobian) <= self.held)]

    @cached_property
    def shifting(self) -> list[list[Node]]:
        """H of the rows that are equations on positions, zero for others."""
        return [
            list(row.jacobian) if row.holonomic and k not in self.given else [ZERO] * len(row.jacobian)
            for k, row in enumerate(self.dynamics.rows)
        ]

    @cached_property
    def pushing(self) -> list[list[Node]]:
        """Forces of unit multipliers of the rows that are equations, zero for others; with friction not H^T lambda."""
        rows = enumerate(self.dynamics.rows)
        return [[ZERO] * len(row.jacobian) if k in self.given else list(row.forces) for k, row in rows]

    def pushed(self, trace: Trace) -> list[Node]:
        """Return f (nu) with the forces of the rows that are no equations."""
        if not self.given:
            return list(self.dynamics.forcing)
        _, _, multipliers, _ = trace.call(self.derivative, [trace[a.name] for a in self.derivative.inputs])
        forces, friction = [row.forces for row in self.dynamics.rows], self.dynamics.friction
        if friction is not None:
            forces = along_reactions(forces, friction.beside, multipliers)
        known = _combination([forces[k] for k in self.given], [multipliers[k] for k in self.given])
        return [f + x for f, x in zip(self.dynamics.forcing, known, strict=True)]

    def unheld(self, values: Sequence[Node]) -> list[Node]:
        return [ZERO if k in self.held else x for k, x in enumerate(values)]

    def programs(self, inputs: Program) -> dict[str, Program]:
        """Return by name the Programs that Newton's iteration for the stabilised equations needs.

        `index_2`: (t, q, u, .., multipliers) -> qdot (nq,), udot (nu,), phi (ns,), residual (ns,): H u + phi_t or psi.
        The multipliers (2 ns,) are (mu, lambda). `index_2_by_state`: the derivative of all four by (q, u), through the
        inputs as well, which `inputs` gives from (t, q, u, parameters). `index_2_by_multipliers`: that of qdot, udot.
        """
        from multibody_sym.program.derivatives import total_jacobian  # which few methods need

        equations = self.equations()
        outputs = [output.name for output in equations.outputs]
        by_state = total_jacobian(equations, outputs, ("q", "u"), inputs, name="index_2_by_state")
        return {program.name: program for program in (equations, by_state, self.by_multipliers())}

    def equations(self) -> Program:
        mechanism, dynamics, count = self.mechanism, self.dynamics, len(self.dynamics.rows)
        trace = Trace("index_2", (*arrays(mechanism), Array("multipliers", (2 * count,))))
        mu, multipliers = trace["multipliers"][:count], trace["multipliers"][count:]
        pushing = _combination(self.pushing, multipliers)
        udot = self.unheld(dynamics.factors.solve([f + x for f, x in zip(self.pushed(trace), pushing, strict=True)]))
        shift = dynamics.factors.solve(_combination(self.shifting, mu))
        shifted = self.unheld([u + x for u, x in zip(trace["u"], shift, strict=True)])
        rows = [(row, k in self.given) for k, row in enumerate(dynamics.rows)]
        return trace.finish(
            {
                "qdot": column(qdot_of(slot_state(mechanism), mechanism, shifted)),
                "udot": column(udot),
                "phi": column(ZERO if out else row.gap for row, out in rows),
                "residual": column(ZERO if out else row.phidot for row, out in rows),
            }
        )

    def by_multipliers(self) -> Program:
        """Return d(qdot, udot) / d(mu, lambda) (nq + nu, 2 ns): N M^-1 H^T of holonomic rows, and M^-1 H^T.

        Sliding parts push with other forces than H^T lambda.
        """
        mechanism, solve = self.mechanism, self.dynamics.factors.solve
        trace = Trace("index_2_by_multipliers", arrays(mechanism))
        shifting, pushing = ([self.unheld(solve(row)) for row in rows] for rows in (self.shifting, self.pushing))
        nq, nu = len(mechanism.coordinates), len(mechanism.speeds)
        positions = [coordinate_rates(mechanism, trace["q"], column) for column in shifting]
        columns = [*([*x, *[ZERO] * nu] for x in positions), *([*[ZERO] * nq, *x] for x in pushing)]
        values = [column[k] for k in range(nq + nu) for column in columns]
        return trace.finish({"jacobian": ((nq + nu, len(columns)), values)})


def _places(jacobian: Sequence[Node]) -> frozenset[int]:
    return frozenset(k for k, x in enumerate(jacobian) if as_node(x) is not ZERO)


def _combination(columns: Sequence[Sequence[Node]], weights: Sequence[Node]) -> list[Node]:
    """Return sum_j columns_j weights_j (nu)."""
    return [sum((x * w for x, w in zip(row, weights, strict=True)), ZERO) for row in zip(*columns, strict=True)]


# ----------------------------------------------------------------------------------------------------------------------

_ROUNDING: Final = 1e-11
"""Coefficients below this part of those of held speeds are rounding: of places thousands of metres away."""
_BY_DERIVATIVE: Final = ("explicit", "multistep")
"""Forms that take the derivative alone."""


MANY_BODIES: Final = 48
"""From how many bodies on numbers are data (benchmarks/kinds.py): fewer compile in seconds, and are faster written out.

Robots have fewer.
"""
_BODIES_OF_A_KIND: Final = 4
"""Mean number of bodies of a kind from which on a scan is chosen (benchmarks/chains.py)."""


def with_constants(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with literal numbers as constants where its bodies are many and of few kinds."""
    if len(mechanism.bodies) < MANY_BODIES:
        return mechanism
    from multibody_sym.dynamics.programs.repeated_bodies import numbers_as_constants

    return numbers_as_constants(mechanism)


def worth_scanning(mechanism: Mechanism) -> LikeBodies | None:
    """Return the kinds of bodies of a mechanism that is scanned, None for one whose Programs are written out."""
    if len(mechanism.bodies) < _BODIES_OF_A_KIND or mechanism.rows or massless_speeds(mechanism):
        return None
    from multibody_sym.dynamics.programs.repeated_bodies import like_bodies

    like = like_bodies(mechanism)
    return like if like is not None and len(mechanism.bodies) >= _BODIES_OF_A_KIND * len(like.kinds) else None


def programs(mechanism: Mechanism, formalism: Formalism, form: Form = "explicit") -> Programs:
    """Return all Programs of a mechanism by one formalism, with those that a method needs for its `form`.

    Those of `block_ldl` are scanned where that shortens them, except with a Jacobian, whose columns each take a scan.
    Long ones of closed loops are rolled up where much in them is alike.
    """
    like = worth_scanning(mechanism) if formalism is block_ldl and form in _BY_DERIVATIVE else None
    if like is not None:
        from multibody_sym.dynamics.programs.repeated_bodies import scanned_normalize, scanned_sources

        return _programs(mechanism, scanned_sources(mechanism, like), scanned_normalize(mechanism, like))
    dynamics = formalism(mechanism, slot_state(mechanism))
    sources = sources_of(mechanism, state_derivative(mechanism, dynamics))
    held = [ONE if k in mechanism.held else ZERO for k in range(len(mechanism.speeds))]
    normalize = normalize_program(mechanism, held)
    if not mechanism.rows:
        return _programs(mechanism, sources, normalize, None, form)
    from multibody_sym.program.loops import all_rolled

    every = _programs(mechanism, sources, normalize, dynamics, form)
    return replace(every, **all_rolled(every.as_mapping()))


def sources_of(mechanism: Mechanism, derivative: Program) -> Sources:
    """Return the sources of quantities whose motion is written out."""
    return Sources(derivative, energy_program(mechanism), lambda _: motion_of(mechanism, slot_state(mechanism)))


def _programs(
    mechanism: Mechanism,
    sources: Sources,
    normalize: Program | None,
    constrained: TreeDynamics | None = None,
    form: Form = "explicit",
) -> Programs:
    derivative, inputs = sources.state_derivative, inputs_program(mechanism)
    of_rows: dict[str, Program | None] = {"project_position": None, "project_velocity": None}
    if constrained:
        of_rows |= _row_programs(mechanism, constrained)
    if constrained and form == "index_2":
        of_rows |= _Index2(mechanism, constrained, derivative).programs(inputs)
    ends, jacobian = events(mechanism, sources), None
    if ends is not None:
        from multibody_sym.program.loops import with_loops  # which trees do without

        ends = with_loops(ends)
    if form == "implicit":
        from multibody_sym.program.derivatives import total_jacobian  # which few methods need

        jacobian = total_jacobian(derivative, ("qdot", "udot"), ("q", "u"), inputs)
    return Programs(
        inputs=inputs,
        state_derivative=derivative,
        normalize=normalize,
        energy=sources.energy,
        outputs=outputs_program(mechanism, sources),
        events=ends,
        jacobian=jacobian,
        **of_rows,
    )


def state_derivative(mechanism: Mechanism, dynamics: TreeDynamics) -> Program:
    """Return (t, q, u, ...) -> qdot, udot, multipliers, report.

    Without rows udot = M^-1 f, written out. Multipliers of dependent rows are zero, or of minimum norm.
    """
    trace = Trace("state_derivative", arrays(mechanism))
    udot: Sequence[Node]
    if dynamics.rows:
        udot, multipliers, report = constrained_motion(trace, mechanism, dynamics)
    else:
        udot, multipliers, report = dynamics.bias_acceleration, [], (ZERO,) * 3
    rates = dynamics.rates
    if mechanism.held:
        rates = qdot_of(slot_state(mechanism), mechanism, _zero_where_held(mechanism, trace["u"]))
        udot = _zero_where_held(mechanism, udot)
    outputs = {"qdot": rates, "udot": udot, "multipliers": multipliers, "report": report}
    return trace.finish({name: column(values) for name, values in outputs.items()})


def constrained_motion(
    trace: Trace, mechanism: Mechanism, dynamics: TreeDynamics
) -> tuple[list[Node], list[Node], Sequence[Node]]:
    """Return udot, multipliers and the solve's report, stabilised by Baumgarte's coefficients.

    gamma becomes gamma - 2 alpha phidot - beta^2 phi, of nonholonomic rows gamma - alpha psi (Baumgarte 1972).
    """
    acting = acting_rows(dynamics.rows)
    rows = [dynamics.rows[k] for k in acting]
    alpha, beta = map(mechanism.parameters.slot, (ALPHA, BETA))
    gamma = [
        row.gamma - 2 * alpha * row.phidot - beta**2 * row.phi if row.holonomic else row.gamma - alpha * row.phidot
        for row in rows
    ]
    sharing, shared = None, shared_forces(mechanism)
    if shared is not None:
        (forces, ways), places = shared, {k: place for place, k in enumerate(acting)}
        own = [[(places[j], x) for j, x in ways[k] if j in places] for k in acting]
        sharing = Sharing([forces[k] for k in acting], own)
    found = solve_constrained(
        dynamics.factors,
        dynamics.forcing,
        _nodes([row.jacobian for row in rows]),
        gamma,
        _solver(trace, mechanism),
        minimum_norm=mechanism.minimum_norm,
        friction=friction_of(dynamics, acting),
        sharing=sharing,
    )
    multipliers: list[Node] = [ZERO] * len(dynamics.rows)
    for k, x in zip(acting, found.multipliers, strict=True):
        multipliers[k] = x
    return found.udot, multipliers, list(found.report)


def _zero_where_held(mechanism: Mechanism, values: Sequence[Node]) -> list[Node]:
    """Return values of the speeds, zero where they are held: rounding does not move immobile bodies."""
    return [ZERO if k in mechanism.held else value for k, value in enumerate(values)]


def friction_of(dynamics: TreeDynamics, acting: Sequence[int]) -> FrictionTerms | None:
    """Return the forces that acting rows exert and define, None where these are H^T lambda."""
    whole = dynamics.friction
    if whole is None:
        return None
    coupling = [[as_node(whole.coupling[j][k]) for k in acting] for j in acting]
    beside = {acting.index(k): tuple(map(acting.index, others)) for k, others in whole.beside.items()}
    return FrictionTerms(_nodes([whole.exerts[k] for k in acting]), coupling, beside)


def _solver(trace: Trace, mechanism: Mechanism) -> Callable[..., Solve]:
    """Return the solve of least norm as a statement, which keeps no more rows than are independent in general."""
    most = mechanism.parameters.slot(INDEPENDENT)

    def solve(matrix: Matrix, right: Sequence[Node], size: int, /, beside: int = 0) -> Solve:
        return trace.solve(matrix, right, size, most + beside if beside else most)

    return solve


def _correction(
    trace: Trace, mechanism: Mechanism, dynamics: TreeDynamics, rows: Sequence[RowMotion], wanted: Sequence[Node]
) -> list[Node]:
    """Return the least change of the speeds with H change = wanted; of those that are not held, if some are.

    Rows that define forces restrict nothing, and are not counted among the independent ones.
    """
    jacobian, solve = _nodes([row.jacobian for row in rows]), _solver(trace, mechanism)
    defining = sum(not row.restricts for row in mechanism.rows)
    if mechanism.held:
        free = []
        for row in jacobian:  # a contact's row on held speeds would else be put right by a turn of many radians
            moving = _zero_where_held(mechanism, row)
            held = [absolute(x) for x, own in zip(row, moving, strict=True) if own is ZERO and x is not ZERO]
            free.append([felt(x, sum(held[1:], held[0])) for x in moving] if held else moving)
        left = [k for k, row in enumerate(free) if set(row) != {ZERO}]
        found = solve([free[k] for k in left], [wanted[k] for k in left], len(dynamics.speeds), -defining)
        return _zero_where_held(mechanism, list(found.solution))

    def least(matrix: Matrix) -> Sequence[Node]:
        return solve(matrix, wanted, len(dynamics.speeds), -defining).solution

    return correction(dynamics.factors, jacobian, least)


def felt(x: Node, held: Node) -> Node:
    """Return a coefficient of a speed, zero where it is rounding beside the sum of the sizes of those `held`."""
    return x if x is ZERO else as_node(where(less(absolute(x), held * real(_ROUNDING)), ZERO, x))


def _row_programs(mechanism: Mechanism, dynamics: TreeDynamics) -> dict[str, Program]:
    """Return the Programs that measure and correct how rows are missed, in positions and in speeds.

    `put_back` has both corrections: that of u for phidot where that of q leads, with H of the start, which is as good.
    With factors kept between steps one correction is not enough (docs/guide/methods.md has figures).
    """
    every = dynamics.rows
    phi, phidot = column(row.gap for row in every), column(row.phidot for row in every)
    rows = [every[k] for k in acting_rows(every) if every[k].kinematic]
    holonomic = [row for row in rows if row.holonomic]

    trace = Trace("project_position", arrays(mechanism))
    change = _correction(trace, mechanism, dynamics, holonomic, [-row.phi for row in holonomic])
    of_q = coordinate_rates(mechanism, trace["q"], change)
    position = trace.finish({"phi": phi, "correction": column(of_q)})

    trace = Trace("project_velocity", arrays(mechanism))
    of_u = _correction(trace, mechanism, dynamics, rows, [-row.phidot for row in rows])
    velocity = trace.finish({"residual": phidot, "correction": column(of_u)})

    missed = Trace("missed", arrays(mechanism)).finish({"phi": phi, "residual": phidot})

    trace = Trace("put_back", arrays(mechanism))
    change = _correction(trace, mechanism, dynamics, holonomic, [-row.phi for row in holonomic])
    of_q = coordinate_rates(mechanism, trace["q"], change)
    residual = dict(zip(map(id, every), residual_ahead(trace, missed, of_q), strict=True))
    of_u = _correction(trace, mechanism, dynamics, rows, [-residual[id(row)] for row in rows])
    put_back = trace.finish({"of_q": column(of_q), "of_u": column(of_u)})
    return {"project_position": position, "project_velocity": velocity, "missed": missed, "put_back": put_back}


def residual_ahead(trace: Trace, missed: Program, of_q: Sequence[Node]) -> tuple[Node, ...]:
    """Return by how much rows are missed in speeds where coordinates have moved on."""
    given = {array.name: trace[array.name] for array in missed.inputs}
    given["q"] = tuple(as_node(x) + dx for x, dx in zip(given["q"], of_q, strict=True))
    return trace.call(missed, list(given.values()))[1]


def normalize_program(mechanism: Mechanism, held: Sequence[Node]) -> Program | None:
    """Return -> q with unit quaternions, deviation; None without any. `held` (nu): 1 where a speed is held.

    Quaternions of immobile bodies stay unchanged.
    """
    trace = Trace("normalize", arrays(mechanism))
    q, deviation = list(trace["q"]), ZERO
    for free in (free for body in mechanism.bodies for free in body.free_steps if free.step.unit_quaternion):
        stands = reduce(operator.mul, (held[k] for k in free.u))
        if stands is not ONE:
            unit, off = unit_quaternion([q[k] for k in free.q])
            deviation = as_node(maximum(deviation, choose(stands, ZERO, off)))
            q[free.q[0] : free.q[-1] + 1] = [choose(stands, q[k], x) for k, x in zip(free.q, unit, strict=True)]
    return None if deviation is ZERO else trace.finish({"q": column(q), "deviation": ((), [deviation])})


def inputs_program(mechanism: Mechanism, given: Sequence[Array] = ()) -> Program:
    """Return (t, q, u, parameters) -> inputs (nw,), from their declared expressions; of the first `given` arrays."""
    return Trace("inputs", (given or arrays(mechanism))[:4]).finish({"inputs": column(mechanism.inputs.values())})


def energy_program(mechanism: Mechanism) -> Program:
    """Return (t, q, u, ..) -> kinetic, potential."""
    motion = motion_of(mechanism, slot_state(mechanism))
    energies = {"kinetic": ((), [kinetic_energy(motion)]), "potential": ((), [potential_energy(motion)])}
    return Trace("energy", arrays(mechanism)).finish(energies)


def outputs_program(mechanism: Mechanism, sources: Sources) -> Program:
    """Return (t, q, u, ..) -> values of the declared outputs."""
    trace = Trace("outputs", arrays(mechanism))
    return trace.finish({"values": column(with_quantities(trace, sources, list(mechanism.outputs.values())))})


def _nodes(matrix: Sequence[Sequence[Node]]) -> list[list[Node]]:
    return [[as_node(x) for x in row] for row in matrix]
