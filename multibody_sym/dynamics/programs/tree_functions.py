"""Programs of a tree besides its motion: the mass matrix, inverse and hybrid dynamics, Hamilton's equations.

Inputs are t, q, u, parameters, inputs, modes as of every system Program; where accelerations are given, udot follows.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.dynamics.formalisms.articulated_body import block_ldl, hybrid_dynamics, tree_factors
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix, needed_wrenches
from multibody_sym.dynamics.formalisms.constrained import PASSES
from multibody_sym.dynamics.formalisms.equations import massless_speeds, verify_massive
from multibody_sym.dynamics.programs.quantities import generalized_momenta
from multibody_sym.dynamics.programs.system import constrained_motion, inputs_program
from multibody_sym.errors import InputError, ModelError, NoSolutionError, at
from multibody_sym.mechanics.alignment import economical_motion
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces, varies
from multibody_sym.mechanics.mechanism import INDEPENDENT, Mechanism, verify_without_states
from multibody_sym.mechanics.motion import (
    Motion,
    State,
    arrays,
    coordinate_rates,
    joint_rates,
    motion_of,
    slot_state,
    state_of,
    turning_momenta,
)
from multibody_sym.mechanics.points import carried_wrenches, joint_projection
from multibody_sym.mechanics.row_kinematics import acting_rows, along_reactions, row_motions
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import gradient
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, real, slot
from multibody_sym.scalars.rank import ROUNDED, null_space, rank
from multibody_sym.scalars.vectors import S

OF_MOMENTA: Final = "canonical equations are those of coordinates and momenta alone; choose the method multipliers"
"""Why canonical equations take no declared states."""
MOMENTA: Final = "momenta"
"""The array of Programs of momenta that stands where others have u."""


def mass_matrix_program(mechanism: Mechanism) -> Program:
    """Return -> mass_matrix (nu, nu) of the tree, whatever its rows."""
    trace = Trace("mass_matrix", arrays(mechanism))
    matrix = mass_matrix(economical_motion(mechanism, slot_state(mechanism)))
    return trace.finish({"mass_matrix": ((len(matrix), len(matrix)), [x for row in matrix for x in row])})


def inverse_dynamics_program(mechanism: Mechanism) -> Program:
    """Return (.., udot) -> forces (nu): M udot + c - Q, the forces that the accelerations need on top of the loads.

    Raises ModelError where rows restrict the tree, whose forces are not determined.
    """
    _verify_tree(mechanism, "say which joints are driven (function(.., drives=[..])), ")
    trace = Trace("inverse_dynamics", (*arrays(mechanism), Array("udot", (len(mechanism.speeds),))))
    forces = _needed_forces(economical_motion(mechanism, slot_state(mechanism)), trace["udot"])
    return trace.finish({"forces": ((len(forces),), forces)})


def _needed_forces(motion: Motion, udot: Sequence[S]) -> list[S]:
    """Return M udot + c - Q (nu)."""
    loads = applied_forces(motion, weight=False)
    carried = carried_wrenches(motion, needed_wrenches(motion, udot, loads.of_body))
    return [x - drive for x, drive in zip(joint_projection(motion, carried), loads.of_speed, strict=True)]


def driven_dynamics_program(mechanism: Mechanism, drives: Collection[str]) -> Program:
    """Return (.., udot) -> forces (nu): those of the joints named `drives`, zero elsewhere, of least norm.

    With the rows' forces C^T lambda, of which some define others by D lambda = gamma - H udot,

        M udot + c - Q = S^T S mu + C^T lambda,   C mu + D^T eta = 0,   D lambda = d

    are the conditions of the least S mu, the forces of the drives that S picks. They are unique however many rows
    depend on each other. Accelerations are taken as given: they should satisfy H udot = gamma.
    """
    count, driven = len(mechanism.speeds), driven_speeds(mechanism, drives)
    trace = Trace("inverse_dynamics", (*arrays(mechanism), Array("udot", (count,))))
    motion, udot = motion_of(mechanism, slot_state(mechanism)), trace["udot"]
    every = row_motions(motion)
    rows = [every[k] for k in acting_rows(every)]
    defining = [row for row in rows if not row.kinematic]
    coupling = [[as_node(row.coupling.get(k, ZERO)) for k in acting_rows(every)] for row in defining]
    wanted = [row.gamma - sum((h * a for h, a in zip(row.jacobian, udot, strict=True)), ZERO) for row in defining]
    needed = [as_node(x) for x in _needed_forces(motion, udot)]
    exerts = [list(map(as_node, row.forces)) for row in rows]
    beside = {k: tuple(map(acting_rows(every).index, row.beside)) for k, row in enumerate(rows) if row.beside}
    most = mechanism.parameters.slot(INDEPENDENT) + (count + len(defining)) if rows else real(count)

    def solve(forces: Sequence[Sequence[Node]]) -> list[Node]:
        matrix = [
            [*(ONE if i == k and k in driven else ZERO for i in range(count)), *(f[k] for f in forces)]
            + [ZERO] * len(defining)
            for k in range(count)
        ]
        columns = zip(*coupling, strict=True) if defining else ([] for _ in rows)
        matrix += [[*f, *[ZERO] * len(rows), *d] for f, d in zip(forces, columns, strict=True)]
        matrix += [[*[ZERO] * count, *d, *[ZERO] * len(defining)] for d in coupling]
        right = [*needed, *[ZERO] * len(rows), *wanted]
        return list(trace.solve(matrix, right, len(right), most).solution)

    found = solve([[ZERO] * count if k in beside else row for k, row in enumerate(exerts)] if beside else exerts)
    for _ in range(PASSES if beside else 0):
        found = solve(along_reactions(exerts, beside, found[count : count + len(rows)]))
    return trace.finish({"forces": ((count,), [found[k] if k in driven else ZERO for k in range(count)])})


def driven_speeds(mechanism: Mechanism, drives: Collection[str]) -> list[int]:
    """Return the speeds of the joints named `drives`. Raises InputError for a joint without speeds."""
    speeds = {body.joint_name: body.u for body in mechanism.bodies if body.u}
    for name in drives:
        if name not in speeds:
            message = f"no joint {name!r} has a speed that a drive could move"
            raise InputError(message, number="M106", word=name, known=speeds)
    return [k for name in drives for k in speeds[name]]


def verify_drives(mechanism: Mechanism, state: State, drives: Collection[str]) -> bool:
    """Return whether more joints are driven than the freedoms of a state over floats need.

    Raises NoSolutionError where a speed is left that no drive moves.
    """
    driven, count = driven_speeds(mechanism, drives), len(mechanism.speeds)
    rows = [row.jacobian for row in row_motions(motion_of(mechanism, state)) if row.kinematic]
    restricted = rank(np.array(rows, dtype=float).reshape(len(rows), count), ROUNDED)
    both = np.array([*rows, *np.eye(count)[driven]], dtype=float).reshape(len(rows) + len(driven), count)
    left = null_space(both, ROUNDED)
    if left.size:
        sizes = np.abs(left).max(axis=1)
        free = mechanism.speeds[int(np.argmax(sizes > ROUNDED * sizes.max()))]  # others, such as mimics, follow it
        raise NoSolutionError(
            f"{count - restricted} degrees of freedom need as many drives, and with {', '.join(drives) or 'none'} the "
            f"speed {free.name} is free at the start: name joint {free.joint!r} among drives, too",
            number="N102",
        )
    return len(driven) > count - restricted


def hybrid_dynamics_program(mechanism: Mechanism, given: Collection[str]) -> Program:
    """Return (.., udot) -> udot (nu), forces (nu); `given` names the joints whose udot is read.

    Raises ModelError where rows restrict the tree, NoSolutionError where a free joint moves nothing that has mass.
    """
    _verify_tree(mechanism)
    bodies = [k for k, body in enumerate(mechanism.bodies) if body.joint_name in given]
    held = {k for index in bodies for k in mechanism.bodies[index].u}
    massless = [mechanism.speeds[k] for k in massless_speeds(mechanism) if k not in held]
    if massless:
        raise NoSolutionError(
            f"joint {massless[0].joint!r} moves nothing that has mass; give its acceleration, or the body a mass",
            number="N102",
        )
    trace = Trace("hybrid_dynamics", (*arrays(mechanism), Array("udot", (len(mechanism.speeds),))))
    udot, forces = hybrid_dynamics(motion_of(mechanism, slot_state(mechanism)), bodies, trace["udot"])
    return trace.finish({"udot": ((len(udot),), udot), "forces": ((len(forces),), forces)})


def _verify_tree(mechanism: Mechanism, advice: str = "") -> None:
    if mechanism.rows:
        section, name = mechanism.row_path(0)
        what = f"joint {name!r} closes a loop," if section == "joints" else f"{name!r} restricts the joints,"
        with at(section, name):
            raise ModelError(
                f"{what} and its force shares in the work: given accelerations determine the forces of joints only "
                f"where nothing else holds them; {advice}leave it out (load_urdf(..., mimic=False) leaves out the "
                "couplers of joints that mimic others), or put its force in as a force",
                number="M110",
            )


# ----------------------------------------------------------------------------------------------------------------------
# Programs of Hamilton's equations: p from u, u from p, the rates of q and p, and H; linear in the number of bodies.
#
#     p = dT/du (bodies' momenta, inward)      u = M^-1 (p - b) (articulated bodies)      q' = N u
#     p' = N^T dT/dq - (terms of quasi-velocities) + Q + H^T lambda, dT/dq by one reverse pass at constant u
#     H = p . u - T + V
#
# M is never formed. Q holds all loads and the weight; the multipliers are those of the accelerations at this state.


def canonical_programs(mechanism: Mechanism) -> dict[str, Program]:
    """Return the Programs `inputs`, `momenta` (of u), `speeds`, `canonical` and `hamiltonian` (of p) of a mechanism.

    Those of p have the array `momenta` where others have `u`. Raises ModelError where masses vary or something rubs,
    NoSolutionError where a freedom moves nothing with mass.
    """
    equations = _Canonical.of(mechanism)
    return {"inputs": inputs_program(mechanism), **{name: make(equations) for name, make in _PROGRAMS.items()}}


def canonical_program(mechanism: Mechanism, name: str) -> Program:
    """Return one of `canonical_programs`. Raises as that does."""
    return _PROGRAMS[name](_Canonical.of(mechanism))


def with_inputs_of_momenta(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism whose inputs are declared by momenta in place of speeds."""
    if not any(leaf.data[0] == "u" for leaf in leaves(mechanism.inputs.values(), "slot")):
        return mechanism
    values = _Canonical.of(mechanism)._at_momenta(list(mechanism.inputs.values()))
    return replace(mechanism, inputs=dict(zip(mechanism.inputs, values, strict=True)))


def verify_canonical(mechanism: Mechanism) -> None:
    """Raise ModelError where momenta do not determine the motion: states, masses that vary, and rows with friction."""
    verify_without_states(mechanism, OF_MOMENTA)
    for body in mechanism.bodies:
        if varies(body):
            raise ModelError(f"the mass of {body.name!r} varies, so that its momentum changes with it", number="M120")
    rows = row_motions(motion_of(mechanism, slot_state(mechanism))) if mechanism.rows else []
    for row, moved in zip(mechanism.rows, rows, strict=True):
        if moved.exerts is not None or not moved.kinematic:
            raise ModelError(
                f"{row.name!r} rubs or slides: its forces follow from reactions and are no part of canonical equations",
                number="M120",
            )
    verify_massive(mechanism, "Hamilton's equations")


@dataclass(frozen=True)
class _Canonical:
    """The motion over Nodes in slots, p(q, u), and u(q, p) with p as the slots `momenta`."""

    mechanism: Mechanism
    motion: Motion
    of_speeds: list[Node]
    speeds: list[Node]

    @classmethod
    def of(cls, mechanism: Mechanism) -> _Canonical:
        verify_canonical(mechanism)
        motion = economical_motion(mechanism, slot_state(mechanism))
        momenta = [as_node(p) for p in generalized_momenta(motion)]
        at_rest = {slot("u", k): ZERO for k in range(len(momenta))}
        bias = evaluate(momenta, lambda leaf: at_rest.get(leaf, leaf))
        free = [slot(MOMENTA, k) - b for k, b in enumerate(bias)]
        return cls(mechanism, motion, momenta, [as_node(u) for u in tree_factors(motion).solve(free)])

    def momenta_program(self) -> Program:
        """Return (.., u, ..) -> p (nu)."""
        return Trace("momenta", arrays(self.mechanism)).finish({"p": ((len(self.of_speeds),), self.of_speeds)})

    def speeds_program(self) -> Program:
        """Return (.., momenta, ..) -> u (nu)."""
        return Trace("speeds", self._arrays()).finish({"u": ((len(self.speeds),), self.speeds)})

    def function_program(self) -> Program:
        """Return (.., momenta, ..) -> H."""
        p = [slot(MOMENTA, k) for k in range(len(self.speeds))]
        along = sum((a * b for a, b in zip(p, self.speeds, strict=True)), ZERO)
        energies = [as_node(kinetic_energy(self.motion)), as_node(potential_energy(self.motion))]
        kinetic, potential = self._at_momenta(energies)
        return Trace("hamiltonian", self._arrays()).finish({"H": ((), [along - kinetic + potential])})

    def rates_program(self) -> Program:
        """Return (.., momenta, ..) -> qdot (nq), pdot (nu), multipliers (ns)."""
        trace = Trace("canonical", self._arrays())
        rates = self._at_momenta(self._forces())
        multipliers: Sequence[Node] = ()
        if self.mechanism.rows:
            dynamics = block_ldl(self.mechanism, self._state())
            _, multipliers, _ = constrained_motion(trace, self.mechanism, dynamics)
            for row, multiplier in zip(dynamics.rows, multipliers, strict=True):
                rates = [rate + as_node(h) * multiplier for rate, h in zip(rates, row.jacobian, strict=True)]
        qdot = [as_node(x) for x in coordinate_rates(self.mechanism, self.motion.state.q, self.speeds)]
        outputs = {"qdot": ((len(qdot),), qdot), "pdot": ((len(rates),), rates)}
        return trace.finish({**outputs, "multipliers": ((len(multipliers),), multipliers)})

    def _forces(self) -> list[Node]:
        """Return p' without rows, in slots of q and u."""
        q, u = self.motion.state.q, self.motion.state.u
        slopes = gradient(as_node(kinetic_energy(self.motion)), q)
        found = [as_node(x) for x in applied_generalized_forces(self.motion, applied_forces(self.motion))]
        for body in self.mechanism.bodies:
            for k in body.u:
                column = joint_rates(body, q, [int(j == k) for j in range(len(u))])
                found[k] = found[k] + sum(n * slopes[i] for n, i in zip(column, body.q, strict=True))
            for free in body.free_steps:
                turned = turning_momenta(free.step, [u[k] for k in free.u], [self.of_speeds[k] for k in free.u])
                for k, x in zip(free.u, turned, strict=True):
                    found[k] = found[k] - x
        return found

    def _at_momenta(self, nodes: Sequence[Node]) -> list[Node]:
        """Return Nodes in q and u as ones in q and p."""
        known: Mapping[Node, Node] = {slot("u", k): u for k, u in enumerate(self.speeds)}
        return [as_node(x) for x in evaluate(nodes, lambda leaf: known.get(leaf, leaf))]

    def _state(self) -> State:
        state = slot_state(self.mechanism)
        counted = (("parameters", len(self.mechanism.parameters)), ("inputs", len(self.mechanism.inputs)))
        parameters, inputs = ([slot(array, k) for k in range(n)] for array, n in counted)
        return state_of(self.mechanism, Node, slot("t", 0), state.q, self.speeds, parameters, inputs)

    def _arrays(self) -> tuple[Array, ...]:
        renamed = {"u": Array(MOMENTA, (len(self.speeds),))}
        return tuple(renamed.get(array.name, array) for array in arrays(self.mechanism))


_PROGRAMS: Final[Mapping[str, Callable[[_Canonical], Program]]] = {
    "momenta": _Canonical.momenta_program,
    "speeds": _Canonical.speeds_program,
    "canonical": _Canonical.rates_program,
    "hamiltonian": _Canonical.function_program,
}
