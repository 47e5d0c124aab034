"""The equations of motion stabilised by rows on positions and on speeds, of index 2, with their exact derivatives.

    qdot = N (u + M^-1 H^T mu)      M udot = f + H^T lambda      0 = phi(q, t)      0 = H u + phi_t

The rows on positions have multipliers mu of their own; nonholonomic rows are rows on speeds only. mu is zero in the
motion itself, and in its approximations moves q the shortest way, in the norm of the mass matrix, back to phi = 0.

What presses in a joint that rubs is defined by accelerations and multipliers, and so are no equations of these: it is
part of f, as the state has it on the constraints. So are forces that hold at rest what stands still for good.

Source: C. W. Gear, B. Leimkuhler, G. K. Gupta, Automatic integration of Euler-Lagrange equations with constraints
(1985); E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section VII.1.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.kinematics.joint_forces import along_reactions
from multibody_sym.kinematics.motion import coordinate_rates
from multibody_sym.kinematics.state import arrays
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.program.forward import total_jacobian
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO, Node, as_node


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
