"""From dynamics over Nodes to the Programs that a simulation runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

from multibody_sym.dynamics.formalisms.articulated_body import block_ldl
from multibody_sym.dynamics.formalisms.constrained import Matrix, Sharing, constrained, correction
from multibody_sym.dynamics.formalisms.equations import Formalism, FrictionTerms, TreeDynamics
from multibody_sym.dynamics.programs.quantities import Sources, answered, events
from multibody_sym.dynamics.programs.repeated_bodies import scanned_normalize, scanned_sources, worth_scanning
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy
from multibody_sym.mechanics.joint_friction import along_reactions
from multibody_sym.mechanics.mechanism import ALPHA, BETA, INDEPENDENT, Mechanism
from multibody_sym.mechanics.modes import shared_forces
from multibody_sym.mechanics.motion import Motion, coordinate_rates, motion_of
from multibody_sym.mechanics.row_kinematics import RowMotion, acting_rows
from multibody_sym.mechanics.state import arrays, slot_state
from multibody_sym.program.derivatives import total_jacobian
from multibody_sym.program.loops import all_rolled
from multibody_sym.program.program import Program
from multibody_sym.program.programs import Form, Programs
from multibody_sym.program.statements import Array, Solve
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import absolute, maximum, where
from multibody_sym.scalars.node import ZERO, Node, as_node, less, real
from multibody_sym.scalars.vectors import unit_quaternion

# ----------------------------------------------------------------------------------------------------------------------
# The equations of motion stabilised by rows on positions and on speeds, of index 2, with their exact derivatives.
#
#     qdot = N (u + M^-1 H^T mu)      M udot = f + H^T lambda      0 = phi(q, t)      0 = H u + phi_t
#
# The rows on positions have multipliers mu of their own; nonholonomic rows are rows on speeds only. mu is zero in the
# motion itself, and in its approximations moves q the shortest way, in the norm of the mass matrix, back to phi = 0.
#
# What presses in a joint that rubs is defined by accelerations and multipliers, and so are no equations of these: it
# is part of f, as the state has it on the constraints. So are forces that hold at rest what stands still for good.
#
# Source: C. W. Gear, B. Leimkuhler, G. K. Gupta, Automatic integration of Euler-Lagrange equations with constraints
# (1985); E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section VII.1.


def index_2_programs(
    mechanism: Mechanism, dynamics: TreeDynamics, inputs: Program, derivative: Program
) -> dict[str, Program]:
    """Return by name the Programs that Newton's iteration for the stabilised equations of a mechanism with rows needs.

    `index_2`: (t, q, u, .., multipliers) -> qdot (nq,), udot (nu,), phi (ns,), residual (ns,): H u + phi_t or psi. The
    multipliers (2 ns,) are (mu, lambda). `index_2_by_state`: the derivative of all four by (q, u), through the inputs
    as well, which `inputs` gives from (t, q, u, parameters). `index_2_by_multipliers`: that of qdot and udot.
    """
    rows = _Rows(mechanism, dynamics, derivative)
    equations = _equations(mechanism, dynamics, rows)
    outputs = [output.name for output in equations.outputs]
    by_state = total_jacobian(equations, outputs, ("q", "u"), inputs, name="index_2_by_state")
    by_multipliers = _by_multipliers(mechanism, dynamics, rows)
    return {program.name: program for program in (equations, by_state, by_multipliers)}


@dataclass(frozen=True, eq=False)
class _Rows:
    """The rows of a mechanism by what they are in equations of index 2, with its state `derivative`.

    Some are none of these equations, as what they exert follows from the state: those that define a force, and those
    that hold speeds at zero, unless they bear on others too.
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
        return [
            k
            for k, row in enumerate(self.dynamics.rows)
            if not row.kinematic or (self.held and _places(row.jacobian) <= self.held)
        ]

    @cached_property
    def shifting(self) -> list[list[Node]]:
        """H of the rows that are equations on positions, zero for others."""
        return [
            list(row.jacobian) if row.holonomic and k not in self.given else [ZERO] * len(row.jacobian)
            for k, row in enumerate(self.dynamics.rows)
        ]

    @cached_property
    def pushing(self) -> list[list[Node]]:
        """What unit multipliers exert of the rows that are equations, zero for others: what slides not H^T lambda."""
        rows = enumerate(self.dynamics.rows)
        return [[ZERO] * len(row.jacobian) if k in self.given else list(row.forces) for k, row in rows]

    def pushed(self, trace: Trace) -> list[Node]:
        """Return f (nu) with what the rows exert that are no equations."""
        if not self.given:
            return list(self.dynamics.forcing)
        _, _, multipliers, _ = trace.call(self.derivative, [trace[a.name] for a in self.derivative.inputs])
        forces, friction = [row.forces for row in self.dynamics.rows], self.dynamics.friction
        if friction is not None:
            forces = along_reactions(forces, friction.beside, multipliers)
        known = _combined([forces[k] for k in self.given], [multipliers[k] for k in self.given])
        return [f + x for f, x in zip(self.dynamics.forcing, known, strict=True)]

    def unheld(self, values: Sequence[Node]) -> list[Node]:
        """Return values of the speeds, zero where they are held."""
        return [ZERO if k in self.held else x for k, x in enumerate(values)]


def _places(jacobian: Sequence[Node]) -> frozenset[int]:
    return frozenset(k for k, x in enumerate(jacobian) if as_node(x) is not ZERO)


def _equations(mechanism: Mechanism, dynamics: TreeDynamics, rows: _Rows) -> Program:
    count = len(dynamics.rows)
    trace = Trace("index_2", (*arrays(mechanism), Array("multipliers", (2 * count,))))
    mu, multipliers = trace["multipliers"][:count], trace["multipliers"][count:]
    pushing = _combined(rows.pushing, multipliers)
    udot = rows.unheld(dynamics.factors.solve([f + x for f, x in zip(rows.pushed(trace), pushing, strict=True)]))
    shift = dynamics.factors.solve(_combined(rows.shifting, mu))
    shifted = rows.unheld([u + x for u, x in zip(trace["u"], shift, strict=True)])
    qdot = coordinate_rates(mechanism, trace["q"], shifted)
    left_out = [k in rows.given for k in range(count)]
    phi = [row.phi if row.holonomic and not out else ZERO for row, out in zip(dynamics.rows, left_out, strict=True)]
    residual = [ZERO if out else row.phidot for row, out in zip(dynamics.rows, left_out, strict=True)]
    return trace.finish(
        {
            "qdot": ((len(qdot),), qdot),
            "udot": ((len(udot),), udot),
            "phi": ((count,), phi),
            "residual": ((count,), residual),
        }
    )


def _combined(columns: Sequence[Sequence[Node]], weights: Sequence[Node]) -> list[Node]:
    """Return sum_j columns_j weights_j (nu)."""
    return [sum((x * w for x, w in zip(row, weights, strict=True)), ZERO) for row in zip(*columns, strict=True)]


def _by_multipliers(mechanism: Mechanism, dynamics: TreeDynamics, rows: _Rows) -> Program:
    """Return d(qdot, udot) / d(mu, lambda) (nq + nu, 2 ns): N M^-1 H^T of holonomic rows, and M^-1 H^T.

    What slides pushes with other forces than H^T lambda.
    """
    trace = Trace("index_2_by_multipliers", arrays(mechanism))
    shifting = [rows.unheld(dynamics.factors.solve(row)) for row in rows.shifting]
    pushing = [rows.unheld(dynamics.factors.solve(row)) for row in rows.pushing]
    nq, nu = len(mechanism.coordinates), len(mechanism.speeds)
    positions = [coordinate_rates(mechanism, trace["q"], column) for column in shifting]
    columns = [*([*x, *[ZERO] * nu] for x in positions), *([*[ZERO] * nq, *x] for x in pushing)]
    values = [column[k] for k in range(nq + nu) for column in columns]
    return trace.finish({"jacobian": ((nq + nu, len(columns)), values)})


# ----------------------------------------------------------------------------------------------------------------------

_ROUNDING: Final = 1e-11
"""The part of the coefficients of held speeds that rounding may leave of others: of places thousands of metres away."""
_BY_DERIVATIVE: Final = ("explicit", "multistep")
"""Forms that take the derivative alone."""


def programs(mechanism: Mechanism, formalism: Formalism, form: Form = "explicit") -> Programs:
    """Return all Programs of a mechanism by one formalism, with those that a method needs for its `form`.

    Those of `block_ldl` are scanned where that shortens them, but for their Jacobian, which has a scan for each column.
    Long ones of closed loops are rolled up where much in them is alike.
    """
    like = worth_scanning(mechanism) if formalism is block_ldl and form in _BY_DERIVATIVE else None
    if like is not None:
        return _programs(mechanism, scanned_sources(mechanism, like), scanned_normalize(mechanism, like))
    dynamics = formalism(mechanism, slot_state(mechanism))

    def motion(trace: Trace) -> Motion:
        return motion_of(mechanism, slot_state(mechanism))

    sources = Sources(state_derivative(mechanism, dynamics), energy_program(mechanism), motion)
    if not mechanism.rows:
        return _programs(mechanism, sources, _normalize(mechanism), None, form)
    made = _programs(mechanism, sources, _normalize(mechanism), dynamics, form)
    return replace(made, **all_rolled(made.as_mapping()))


def _programs(
    mechanism: Mechanism,
    sources: Sources,
    normalize: Program | None,
    constrained: TreeDynamics | None = None,
    form: Form = "explicit",
) -> Programs:
    derivative, inputs = sources.state_derivative, inputs_program(mechanism)
    missed = _missed(mechanism, constrained) if constrained else None
    return Programs(
        inputs=inputs,
        state_derivative=derivative,
        project_position=_project_position(mechanism, constrained) if constrained else None,
        project_velocity=_project_velocity(mechanism, constrained) if constrained else None,
        missed=missed,
        put_back=_put_back(mechanism, constrained, missed) if constrained and missed else None,
        normalize=normalize,
        energy=sources.energy,
        outputs=outputs_program(mechanism, sources),
        events=events(mechanism, sources),
        jacobian=total_jacobian(derivative, ("qdot", "udot"), ("q", "u"), inputs) if form == "implicit" else None,
        **(index_2_programs(mechanism, constrained, inputs, derivative) if constrained and form == "index_2" else {}),
    )


def state_derivative(mechanism: Mechanism, dynamics: TreeDynamics) -> Program:
    """Return (t, q, u, ...) -> qdot, udot, multipliers, report.

    Without rows udot = M^-1 f, written out. Multipliers of dependent rows are zero, or of minimum norm.
    """
    trace = Trace("state_derivative", arrays(mechanism))
    rows = len(dynamics.rows)
    if rows == 0:
        udot = dynamics.bias_acceleration
        multipliers: Sequence[Node] = ()
        report: Sequence[Node] = (ZERO,) * 3
    else:
        udot, multipliers, report = constrained_motion(trace, mechanism, dynamics)
    rates = dynamics.rates
    if mechanism.held:
        rates, udot = coordinate_rates(mechanism, trace["q"], _unheld(mechanism, trace["u"])), _unheld(mechanism, udot)
    return trace.finish(
        {
            "qdot": ((len(rates),), rates),
            "udot": ((len(udot),), udot),
            "multipliers": ((rows,), multipliers),
            "report": ((3,), report),
        }
    )


def constrained_motion(
    trace: Trace, mechanism: Mechanism, dynamics: TreeDynamics
) -> tuple[list[Node], list[Node], Sequence[Node]]:
    """Return udot, multipliers and the solve's report; of what is stabilised, where Baumgarte's coefficients say so."""
    acting = acting_rows(dynamics.rows)
    rows = [dynamics.rows[k] for k in acting]
    found = constrained(
        dynamics.factors,
        dynamics.forcing,
        _nodes([row.jacobian for row in rows]),
        stabilised(rows, mechanism),
        _solver(trace, mechanism),
        minimum_norm=mechanism.minimum_norm,
        friction=friction_of(dynamics, acting),
        sharing=_sharing(mechanism, acting),
    )
    return found.udot, _placed(found.multipliers, acting, len(dynamics.rows)), list(found.report)


def _sharing(mechanism: Mechanism, acting: Sequence[int]) -> Sharing | None:
    """Return what those rows that act carry where a mode says so."""
    found, places = shared_forces(mechanism), {k: place for place, k in enumerate(acting)}
    if found is None:
        return None
    forces, ways = found
    own = [[(places[j], x) for j, x in ways[k] if j in places] for k in acting]
    return Sharing([forces[k] for k in acting], own)


def _unheld(mechanism: Mechanism, values: Sequence[Node]) -> list[Node]:
    """Return values of the speeds, zero where they are held: rounding does not move what stands still."""
    return [ZERO if k in mechanism.held else value for k, value in enumerate(values)]


def friction_of(dynamics: TreeDynamics, acting: Sequence[int]) -> FrictionTerms | None:
    """Return what those rows that act exert and define, None where it is H^T lambda."""
    whole = dynamics.friction
    if whole is None:
        return None
    coupling = [[as_node(whole.coupling[j][k]) for k in acting] for j in acting]
    beside = {acting.index(k): tuple(map(acting.index, others)) for k, others in whole.beside.items()}
    return FrictionTerms(_nodes([whole.exerts[k] for k in acting]), coupling, beside)


def _solver(trace: Trace, mechanism: Mechanism) -> Callable[..., Solve]:
    """Return the solve of least norm as a statement, which keeps no more rows than are independent anywhere."""
    most = mechanism.parameters.slot(INDEPENDENT)

    def solve(matrix: Matrix, right: Sequence[Node], size: int, /, beside: int = 0) -> Solve:
        return trace.solve(matrix, right, size, most + beside if beside else most)

    return solve


def _restricting(rows: Sequence[RowMotion]) -> list[RowMotion]:
    """Return the acting rows that restrict motion."""
    return [rows[k] for k in acting_rows(rows) if rows[k].kinematic]


def _placed(values: Sequence[Node], places: Sequence[int], size: int) -> list[Node]:
    """Return `size` numbers: the values at their places, zero elsewhere."""
    found: list[Node] = [ZERO] * size
    for place, value in zip(places, values, strict=True):
        found[place] = value
    return found


def stabilised(rows: Sequence[RowMotion], mechanism: Mechanism) -> list[Node]:
    """Return gamma - 2 alpha phidot - beta^2 phi, of nonholonomic rows gamma - alpha psi (Baumgarte 1972)."""
    alpha, beta = map(mechanism.parameters.slot, (ALPHA, BETA))
    return [
        row.gamma - 2 * alpha * row.phidot - beta**2 * row.phi if row.holonomic else row.gamma - alpha * row.phidot
        for row in rows
    ]


def _correction(
    trace: Trace, mechanism: Mechanism, dynamics: TreeDynamics, rows: Sequence[RowMotion], wanted: Sequence[Node]
) -> list[Node]:
    """Return the least change of the speeds with H change = wanted; of those that are not held, if some are.

    Rows that define forces restrict nothing: without them so many fewer are independent.
    """
    jacobian, solve = _nodes([row.jacobian for row in rows]), _solver(trace, mechanism)
    defining = sum(not row.restricts for row in mechanism.rows)
    if mechanism.held:
        free = [_felt(_unheld(mechanism, row), row) for row in jacobian]
        left = [k for k, row in enumerate(free) if set(row) != {ZERO}]
        found = solve([free[k] for k in left], [wanted[k] for k in left], len(dynamics.speeds), -defining)
        return _unheld(mechanism, list(found.solution))

    def least(matrix: Matrix) -> Sequence[Node]:
        return solve(matrix, wanted, len(dynamics.speeds), -defining).solution

    return correction(dynamics.factors, jacobian, least)


def _felt(free: Sequence[Node], row: Sequence[Node]) -> list[Node]:
    """Return the coefficients of the speeds that move, zero where they are rounding beside those that are held.

    A contact's row on what its joint holds would else be put right by a turn of many radians.
    """
    held = [absolute(whole) for moving, whole in zip(free, row, strict=True) if moving is ZERO and whole is not ZERO]
    if not held:
        return list(free)
    return [felt(x, sum(held[1:], held[0])) for x in free]


def felt(x: Node, held: Node) -> Node:
    """Return a coefficient of a speed, zero where it is rounding beside what is `held`, all coefficients' sizes."""
    return x if x is ZERO else as_node(where(less(absolute(x), held * real(_ROUNDING)), ZERO, x))


def _project_position(mechanism: Mechanism, dynamics: TreeDynamics) -> Program:
    trace = Trace("project_position", arrays(mechanism))
    rows = [row for row in _restricting(dynamics.rows) if row.holonomic]
    change = _correction(trace, mechanism, dynamics, rows, [-row.phi for row in rows])
    phi = [row.phi if row.holonomic else ZERO for row in dynamics.rows]
    correction = coordinate_rates(mechanism, trace["q"], change)
    return trace.finish({"phi": ((len(phi),), phi), "correction": ((len(correction),), correction)})


def _project_velocity(mechanism: Mechanism, dynamics: TreeDynamics) -> Program:
    trace = Trace("project_velocity", arrays(mechanism))
    rows = _restricting(dynamics.rows)
    correction = _correction(trace, mechanism, dynamics, rows, [-row.phidot for row in rows])
    phidot = [row.phidot for row in dynamics.rows]
    return trace.finish({"residual": ((len(phidot),), phidot), "correction": ((len(correction),), correction)})


def _missed(mechanism: Mechanism, dynamics: TreeDynamics) -> Program:
    trace, rows = Trace("missed", arrays(mechanism)), dynamics.rows
    phi = [row.phi if row.holonomic else ZERO for row in rows]
    levels = {"phi": phi, "residual": [row.phidot for row in rows]}
    return trace.finish({name: ((len(rows),), values) for name, values in levels.items()})


def _put_back(mechanism: Mechanism, dynamics: TreeDynamics, missed: Program) -> Program:
    """Return both corrections: that of u for phidot where that of q leads, with H where it starts, which is as good.

    Factors kept between steps leave too much to be taken away in one correction (docs/guide/methods.md has figures).
    """
    trace = Trace("put_back", arrays(mechanism))
    rows = _restricting(dynamics.rows)
    holonomic = [row for row in rows if row.holonomic]
    change = _correction(trace, mechanism, dynamics, holonomic, [-row.phi for row in holonomic])
    of_q = coordinate_rates(mechanism, trace["q"], change)
    given = {array.name: trace[array.name] for array in missed.inputs}
    given["q"] = tuple(as_node(x) + dx for x, dx in zip(given["q"], of_q, strict=True))
    residual = dict(zip(map(id, dynamics.rows), trace.call(missed, list(given.values()))[1], strict=True))
    of_u = _correction(trace, mechanism, dynamics, rows, [-residual[id(row)] for row in rows])
    return trace.finish({"of_q": ((len(of_q),), of_q), "of_u": ((len(of_u),), of_u)})


def _normalize(mechanism: Mechanism) -> Program | None:
    trace = Trace("normalize", arrays(mechanism))
    q = list(trace["q"])
    deviation: Node = ZERO
    for body in mechanism.bodies:
        for free in body.free_steps:
            if not free.step.unit_quaternion or set(free.u) <= set(mechanism.held):
                continue
            places = free.q
            unit, off = unit_quaternion([q[k] for k in places])
            deviation = maximum(deviation, off)
            q[places[0] : places[-1] + 1] = unit
    if deviation is ZERO:
        return None
    return trace.finish({"q": ((len(q),), q), "deviation": ((), [deviation])})


def inputs_program(mechanism: Mechanism) -> Program:
    """Return (t, q, u, parameters) -> inputs (nw,), from their declared expressions."""
    trace = Trace("inputs", arrays(mechanism)[:4])
    values = list(mechanism.inputs.values())
    return trace.finish({"inputs": ((len(values),), values)})


def energy_program(mechanism: Mechanism) -> Program:
    """Return (t, q, u, ..) -> kinetic, potential."""
    motion = motion_of(mechanism, slot_state(mechanism))
    trace = Trace("energy", arrays(mechanism))
    kinetic, potential = as_node(kinetic_energy(motion)), as_node(potential_energy(motion))
    return trace.finish({"kinetic": ((), [kinetic]), "potential": ((), [potential])})


def outputs_program(mechanism: Mechanism, sources: Sources) -> Program:
    """Return (t, q, u, ..) -> values of the declared outputs."""
    trace = Trace("outputs", arrays(mechanism))
    values = answered(trace, sources, list(mechanism.outputs.values()))
    return trace.finish({"values": ((len(values),), values)})


def _nodes(matrix: Sequence[Sequence[Node]]) -> list[list[Node]]:
    return [[as_node(x) for x in row] for row in matrix]
