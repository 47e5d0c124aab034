"""The equations of motion stabilised by rows on positions and on speeds, of index 2, with their exact derivatives.

    qdot = N (u + M^-1 H^T mu)      M udot = f + H^T lambda      0 = phi(q, t)      0 = H u + phi_t

The rows on positions have multipliers mu of their own; nonholonomic rows are rows on speeds only. mu is zero in the
motion itself, and in its approximations moves q the shortest way, in the norm of the mass matrix, back to phi = 0.

Source: C. W. Gear, B. Leimkuhler, G. K. Gupta, Automatic integration of Euler-Lagrange equations with constraints
(1985); E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section VII.1.
"""

from __future__ import annotations

from collections.abc import Sequence

from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.kinematics.motion import coordinate_rates
from multibody_sym.kinematics.state import arrays
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.program.forward import total_jacobian
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.node import ZERO, Node


def index_2_programs(mechanism: Mechanism, dynamics: TreeDynamics, inputs: Program) -> dict[str, Program]:
    """Return by name the Programs that Newton's iteration for the stabilised equations of a mechanism with rows needs.

    `index_2`: (t, q, u, .., multipliers) -> qdot (nq,), udot (nu,), phi (ns,), residual (ns,): H u + phi_t or psi. The
    multipliers (2 ns,) are (mu, lambda). `index_2_by_state`: the derivative of all four by (q, u), through the inputs
    as well, which `inputs` gives from (t, q, u, parameters). `index_2_by_multipliers`: that of qdot and udot.
    """
    defining = next((row for row in mechanism.rows if not row.restricts), None)
    if defining is not None:
        raise NoSolutionError(
            "what presses in a joint that rubs is no part of equations of index 2; choose constraints: "
            "{projection: true} or baumgarte, and another method than ida",
            where=Where(path=mechanism.row_path(mechanism.rows.index(defining))),
        )
    equations = _equations(mechanism, dynamics)
    outputs = [output.name for output in equations.outputs]
    by_state = total_jacobian(equations, outputs, ("q", "u"), inputs, name="index_2_by_state")
    by_multipliers = _by_multipliers(mechanism, dynamics)
    return {program.name: program for program in (equations, by_state, by_multipliers)}


def _equations(mechanism: Mechanism, dynamics: TreeDynamics) -> Program:
    rows, count = dynamics.rows, len(dynamics.rows)
    trace = Trace("index_2", (*arrays(mechanism), Array("multipliers", (2 * count,))))
    mu, multipliers = trace["multipliers"][:count], trace["multipliers"][count:]
    columns = [row.jacobian for row in rows]
    pushing = _combined([row.forces for row in rows], multipliers)
    pushed = [f + x for f, x in zip(dynamics.forcing, pushing, strict=True)]
    udot = dynamics.factors.solve(pushed)
    holonomic = [column if row.holonomic else [ZERO] * len(column) for column, row in zip(columns, rows, strict=True)]
    shift = dynamics.factors.solve(_combined(holonomic, mu))
    qdot = coordinate_rates(mechanism, trace["q"], [u + x for u, x in zip(trace["u"], shift, strict=True)])
    phi = [row.phi if row.holonomic else ZERO for row in rows]
    return trace.finish(
        {
            "qdot": ((len(qdot),), qdot),
            "udot": ((len(udot),), udot),
            "phi": ((count,), phi),
            "residual": ((count,), [row.phidot for row in rows]),
        }
    )


def _combined(columns: Sequence[Sequence[Node]], weights: Sequence[Node]) -> list[Node]:
    """Return sum_j columns_j weights_j (nu)."""
    return [sum((x * w for x, w in zip(row, weights, strict=True)), ZERO) for row in zip(*columns, strict=True)]


def _by_multipliers(mechanism: Mechanism, dynamics: TreeDynamics) -> Program:
    """Return d(qdot, udot) / d(mu, lambda) (nq + nu, 2 ns): N M^-1 H^T of holonomic rows, and M^-1 H^T.

    What slides pushes with other forces than H^T lambda.
    """
    trace = Trace("index_2_by_multipliers", arrays(mechanism))
    shifting = [dynamics.factors.solve(row.jacobian) for row in dynamics.rows]
    pushing = [
        column if row.exerts is None else dynamics.factors.solve(row.exerts)
        for row, column in zip(dynamics.rows, shifting, strict=True)
    ]
    nq, nu = len(mechanism.coordinates), len(mechanism.speeds)
    positions = [
        coordinate_rates(mechanism, trace["q"], column) if row.holonomic else [ZERO] * nq
        for row, column in zip(dynamics.rows, shifting, strict=True)
    ]
    columns = [*([*x, *[ZERO] * nu] for x in positions), *([*[ZERO] * nq, *x] for x in pushing)]
    values = [column[k] for k in range(nq + nu) for column in columns]
    return trace.finish({"jacobian": ((nq + nu, len(columns)), values)})
