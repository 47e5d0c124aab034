"""Linearisation about a motion: x' = A x + B w in independent deviations and speeds, by exact derivatives.

Deviations sigma of coordinates are these themselves; of an attitude the rotation vector theta in the body's axes,
R = R0(t) exp(theta~), so that

    sigma' = delta u,   theta' = delta omega - omega0 x theta,   delta udot = dudot/dq N sigma + dudot/du delta u

with dq = N(q) sigma, as qdot = N(q) u: a body that spins about a fixed axis has a constant A, which it has not in the
components of its quaternion. A motion that satisfies the constraints moves on a surface; with z = (sigma, delta u),
z' = F z + G w, and X spanning the surface's tangents, parametrised by independent components of z, these obey

    xi' = P F X xi + P G w           P picks the independent components

Steady motions (a bicycle that rolls on) are linearised like equilibria: A is constant (`steadiness`).
Source: the elimination is that of P. J. Peterson, G. Gede, M. Hubbard, Symbolic Linearization of Equations of Motion
of Constrained Multibody Systems (2015), done in numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from scipy.linalg import qr

from multibody_sym.analysis.periodic import Multipliers, multipliers_of
from multibody_sym.analysis.steadiness import NO_EIGENVALUES, constancy_of
from multibody_sym.dynamics.programs.system import inputs_program, state_derivative
from multibody_sym.dynamics.routes import FORMALISMS, cheapest, verify_formalism
from multibody_sym.dynamics.start.examined import examined, on_numbers
from multibody_sym.dynamics.start.start import Start, start, verify_regular_start
from multibody_sym.errors import ModelError, NoSolutionError
from multibody_sym.kinematics.energy import potential_energy
from multibody_sym.kinematics.motion import coordinate_rates, motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import arrays, slot_state
from multibody_sym.model.mechanism import TIME, Mechanism
from multibody_sym.model.system import System
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.numbers import number
from multibody_sym.numerics.rounding import eigenvalues, without_rounding
from multibody_sym.program.derivatives import jacobian
from multibody_sym.program.program import Program
from multibody_sym.program.trace import Trace
from multibody_sym.runtime.loading import load
from multibody_sym.scalars.node import as_node, leaves

Function = Callable[..., tuple[Floats, ...]]

_RANK: Final = 1e-9
_WANTED: Final = 1e-3
"""The weight of a component that is wanted as a state: it is made dependent only where no other will do."""


@dataclass(frozen=True, eq=False)
class Linearization:
    """x' = A x + B w for small changes x of `states` (m) and w of `inputs` (k): `A` (m x m), `B` (m x k).

    States are coordinates and speeds by name; of a joint with a quaternion J the deviations `J.rx`, `J.ry`, `J.rz`
    (rad), the rotation vector in the child's axes. `accelerations` (by speed) at the state itself: zero in an
    equilibrium or a steady motion; `steady`: whether A is constant; where it is not, the system is let go from rest,
    and A is that of the start. `left_out`: states that are not among `states`, as nothing depends on them and their
    own rates are not constant. `shifts`: by how much given start values changed to satisfy the constraints. `rounding`
    (m x m): what rounding may make of A.
    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    A: Floats
    B: Floats
    accelerations: dict[str, float]
    shifts: Mapping[str, float] = field(default_factory=dict)
    steady: bool = True
    left_out: tuple[str, ...] = ()
    held_inputs: tuple[str, ...] = ()
    rounding: Floats | None = None

    @cached_property
    def eigenvalues(self) -> npt.NDArray[np.complex128]:
        """The eigenvalues of A, the least damped first, without what is rounding.

        Raises NoSolutionError where A is not constant: its eigenvalues say nothing about the motion then.
        """
        if not self.steady:
            raise NoSolutionError(f"{NO_EIGENVALUES}; `A` is that of the start")
        values = eigenvalues(self.A, np.zeros_like(self.A) if self.rounding is None else self.rounding)
        return values[np.lexsort((values.imag, -values.real))]

    def as_json(self) -> dict[str, Any]:
        """Return the object that `linearize --json` prints; eigenvalues are empty where A is not constant."""
        found = [[float(x.real), float(x.imag)] for x in self.eigenvalues] if self.steady else []
        return {
            "states": list(self.states),
            "inputs": list(self.inputs),
            "A": self.A.tolist(),
            "B": self.B.tolist(),
            "eigenvalues": found,
            "steady": self.steady,
            "left_out": list(self.left_out),
            "held_inputs": list(self.held_inputs),
            "accelerations": self.accelerations,
            "shifts": dict(self.shifts),
        }


@on_numbers
def linearize(system: System, *, formalism: str | None = None) -> Linearization:
    """Return the linearisation of a system about its start, in coordinates of its joints.

    Inputs that change with time are held at their values at t = 0.
    Raises InputError, and NoSolutionError where there is no start, it is a singular position, or it moves such that A
    is not constant, by name.
    """
    flow, begin = _started(system, formalism)
    q, u = np.array(begin.q, dtype=float), np.array(begin.u, dtype=float)
    return replace(_settled(flow, q, u), shifts=begin.shifts, held_inputs=_changing(flow.mechanism))


@on_numbers
def period_multipliers(system: System, period: float, *, formalism: str | None = None) -> Multipliers:
    """Return the multipliers over one period (s) of small deviations from the motion that begins at the start.

    For motions that repeat themselves, in which A is not constant. Inputs that change with time are held.
    Raises InputError, and NoSolutionError where there is no start, or the motion does not repeat itself.
    """
    period = number("period", period)
    if not (np.isfinite(period) and period > 0.0):
        raise ModelError(f"a period is a positive time, got {period:g}")
    flow, begin = _started(system, formalism)
    return multipliers_of(flow, np.array(begin.q, dtype=float), np.array(begin.u, dtype=float), period)


def _started(system: System, formalism: str | None) -> tuple[Flow, Start]:
    """Return the flow in coordinates of joints and its start, which is regular."""
    verify_formalism(formalism)
    declared = examined(system)
    resolved = declared.relative or declared
    begin = start(resolved, project=system.simulation.project)
    verify_regular_start(resolved, begin)
    return Flow(resolved, begin.parameters, formalism), begin


def _settled(flow: Flow, q: Floats, u: Floats) -> Linearization:
    """Return the linearisation without states that move and matter to nothing, verified to be constant."""
    found = flow.linearized(q, u)
    constancy = constancy_of(flow, q, u)
    if not constancy.constant and constancy.reason:
        raise NoSolutionError(constancy.reason)
    keep = [k for k in range(len(found.states)) if k not in constancy.left_out]
    return replace(
        found,
        states=tuple(found.states[k] for k in keep),
        A=without_rounding(found.A, constancy.rounding)[np.ix_(keep, keep)],
        B=found.B[keep],
        steady=constancy.constant,
        left_out=tuple(found.states[k] for k in sorted(constancy.left_out)),
        rounding=constancy.rounding[np.ix_(keep, keep)],
    )


def _changing(resolved: Mechanism) -> tuple[str, ...]:
    return tuple(name for name, node in resolved.inputs.items() if TIME in leaves([node], "slot"))


@dataclass(frozen=True)
class Tangents:
    """The states that constraints allow beside one: dz = X xi, with xi those components of dz that stand at `places`.

    `places` (m) of the independent components of dz = (sigma, du), `X` (2 nu, m).
    """

    places: list[int]
    X: Floats


@dataclass(frozen=True)
class Flow:
    """How states of a mechanism near a motion move, for given parameters: z = (sigma, du), by exact derivatives."""

    mechanism: Mechanism
    parameters: Sequence[float]
    formalism: str | None = None

    def linearized(self, q: npt.ArrayLike, u: npt.ArrayLike) -> Linearization:
        """Return the linearisation at t = 0 at a state that satisfies the constraints, be A constant or not."""
        known, tangents = self.known(q, u), self.tangents(q, u)
        by_state, by_input = self.derivatives(known)
        names = [*deviation_names(self.mechanism), *(s.name for s in self.mechanism.speeds)]
        udot = self._rates(*known)[1].tolist()
        return Linearization(
            tuple(names[k] for k in tangents.places),
            tuple(self.mechanism.inputs),
            (by_state @ tangents.X)[tangents.places],
            by_input[tangents.places] + 0.0,
            dict(zip((s.name for s in self.mechanism.speeds), udot, strict=True)),
        )

    def known(
        self, q: npt.ArrayLike, u: npt.ArrayLike, t: float = 0.0, parameters: npt.ArrayLike | None = None
    ) -> tuple[npt.ArrayLike, ...]:
        """Return what system programs are called with at a state; time stands still in inputs."""
        values = self.parameters if parameters is None else parameters
        return (t, q, u, values, self._driven(0.0, q, u, values)[0], [])

    def accelerations(self, q: npt.ArrayLike, u: npt.ArrayLike) -> Floats:
        """Return udot (nu)."""
        return self._rates(*self.known(q, u))[1]

    def rates(self, known: Sequence[npt.ArrayLike]) -> tuple[Floats, Floats]:
        """Return qdot (nq) and udot (nu)."""
        qdot, udot, *_ = self._rates(*known)
        return qdot, udot

    def derivatives(self, known: Sequence[npt.ArrayLike]) -> tuple[Floats, Floats]:
        """Return dz'/dz (2 nu x 2 nu), through the inputs too, and dz'/dw (2 nu x nw)."""
        N, size = self.displacements(known[1]), len(self.mechanism.speeds)
        by = {name: self._by(self._derivative, ("udot",), name, known) for name in ("q", "u", "inputs")}
        held = (0.0, *known[1:4])
        for name in ("q", "u"):
            by[name] = by[name] + by["inputs"] @ self._by(self._inputs, ("inputs",), name, held)
        found = np.zeros((2 * size, 2 * size))
        found[:size, :size], found[:size, size:] = self._turning(known[2]), np.eye(size)
        found[size:, :size], found[size:, size:] = by["q"] @ N, by["u"]
        return found, np.vstack([np.zeros((size, by["inputs"].shape[1])), by["inputs"]])

    def displacements(self, q: npt.ArrayLike) -> Floats:
        """Return N (nq x nu) in dq = N sigma."""
        units = np.eye(len(self.mechanism.speeds)).tolist()
        values = np.asarray(q, dtype=float).tolist()
        columns = [coordinate_rates(self.mechanism, values, unit) for unit in units]
        return np.array(columns, dtype=float).reshape(len(units), len(self.mechanism.coordinates)).T

    def _turning(self, u: npt.ArrayLike) -> Floats:
        """Return what the motion itself makes of deviations: theta' = - omega x theta."""
        found = np.zeros((len(self.mechanism.speeds),) * 2)
        for body in self.mechanism.bodies:
            if body.ball:
                x, y, z = (float(np.asarray(u)[k]) for k in body.u[-3:])
                found[np.ix_(body.u[-3:], body.u[-3:])] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        return found

    def tangents(self, q: npt.ArrayLike, u: npt.ArrayLike) -> Tangents:
        """Return the states that the constraints allow beside a state, parametrised by components as given first.

        Among them are, as far as may be, deviations of coordinates that are marked known, with their speeds, and those
        of whose speeds are there.
        """
        known, size = self.known(q, u), len(self.mechanism.speeds)
        positions, speeds = self._restrictions(known)
        dependent = _pivots(speeds[:, size:], self._wanted)
        independent = set(range(size)) - set(dependent)
        dependent = [*_pivots(positions[:, :size], self._wanted | independent), *(size + k for k in dependent)]
        places = [k for k in range(2 * size) if k not in set(dependent)]
        return Tangents(places, self.span(known, places))

    def span(self, known: Sequence[npt.ArrayLike], places: Sequence[int]) -> Floats:
        """Return X (2 nu x m) for given independent components."""
        matrix = np.vstack(self._restrictions(known))
        if not np.isfinite(matrix).all():
            raise FloatingPointError("the constraints' slopes are not finite")
        dependent = [k for k in range(matrix.shape[1]) if k not in set(places)]
        X = np.zeros((matrix.shape[1], len(places)))
        X[places] = np.eye(len(places))
        if dependent:
            X[dependent] = np.linalg.lstsq(matrix[:, dependent], -matrix[:, places], rcond=_RANK)[0]
        return X

    def _restrictions(self, known: Sequence[npt.ArrayLike]) -> tuple[Floats, Floats]:
        """Return what positions of z and what all of z must not do: derivatives of phi, and of phidot (x 2 nu)."""
        N = self.displacements(known[1])
        phi = self._by(self._restricted, ("positions",), "q", known) @ N
        by_q, by_u = (self._by(self._restricted, ("speeds",), name, known) for name in ("q", "u"))
        return np.hstack([phi, np.zeros_like(phi)]), np.hstack([by_q @ N, by_u])

    def completed(self, q: Floats, u: Floats, t: float, places: Sequence[int]) -> Floats:
        """Return u with those speeds that `places` leaves out such that the rows hold."""
        size = len(self.mechanism.speeds)
        dependent = [k for k in range(size) if size + k not in set(places)]
        if not dependent:
            return u
        known = self.known(q, u, t)
        H, found = self._by(self._restricted, ("speeds",), "u", known)[:, dependent], u.copy()
        found[dependent] -= np.linalg.lstsq(H, self._residuals(*known)[1], rcond=_RANK)[0]
        return found

    def poses(self, q: npt.ArrayLike) -> tuple[Floats, float]:
        """Return R_WB and p_WB of all bodies (12 each, R by rows) and the potential energy at rest."""
        found = self._placed(*self.known(q, np.zeros(len(self.mechanism.speeds))))
        return found[0], float(found[1])

    def pose_slopes(self, q: npt.ArrayLike) -> Floats:
        """Return how poses follow deviations (12 per body x nu)."""
        known = self.known(q, np.zeros(len(self.mechanism.speeds)))
        return self._by(self._place, ("poses",), "q", known) @ self.displacements(q)

    @cached_property
    def _wanted(self) -> set[int]:
        """The deviations of coordinates that are marked known."""
        coordinates = self.mechanism.coordinates
        return {
            u
            for body in self.mechanism.bodies
            for q, u in [*zip(body.step_q, body.step_u, strict=True), *zip(body.quaternion, body.u[-3:], strict=False)]
            if coordinates[q].known
        }

    def _by(self, program: Program, outputs: Sequence[str], name: str, known: Sequence[npt.ArrayLike]) -> Floats:
        """Return the derivatives of outputs, one below the other, with respect to an input."""
        parts = []
        for output in outputs:
            key = program.name, output, name
            if key not in self._jacobians:
                self._jacobians[key] = _callable(jacobian(program, output, name))
            found = self._jacobians[key](*known)[0]
            parts.append(found.reshape(len(program.output(output).values), program.input(name).size))
        return np.vstack(parts)

    @cached_property
    def _jacobians(self) -> dict[tuple[str, str, str], Function]:
        """The derivatives that were needed so far, by program, output and input."""
        return {}

    @cached_property
    def _derivative(self) -> Program:
        formalism = FORMALISMS[self.formalism or cheapest(self.mechanism)]
        return state_derivative(self.mechanism, formalism(self.mechanism, slot_state(self.mechanism)))

    @cached_property
    def _rates(self) -> Function:
        return _callable(self._derivative)

    @cached_property
    def _inputs(self) -> Program:
        return inputs_program(self.mechanism)

    @cached_property
    def _driven(self) -> Function:
        return _callable(self._inputs)

    @cached_property
    def _placed(self) -> Function:
        return _callable(self._place)

    @cached_property
    def _place(self) -> Program:
        """The Program of all bodies' poses and the potential energy."""
        trace, motion = Trace("place", arrays(self.mechanism)), motion_of(self.mechanism, slot_state(self.mechanism))
        poses = [as_node(x) for R, p in motion.poses for x in (*R[0], *R[1], *R[2], *p)]
        return trace.finish(
            {"poses": ((len(poses),), poses), "energy": ((), [as_node(potential_energy(motion))])}
        )

    @cached_property
    def _residuals(self) -> Function:
        return _callable(self._restricted)

    @cached_property
    def _restricted(self) -> Program:
        """The Program of what stays zero: phi of holonomic rows, phidot of all rows."""
        trace = Trace("restricted", arrays(self.mechanism))
        rows = row_motions(motion_of(self.mechanism, slot_state(self.mechanism)))
        positions = [row.phi for row in rows if row.holonomic]
        speeds = [row.phidot for row in rows]
        return trace.finish(
            {"positions": ((len(positions),), positions), "speeds": ((len(speeds),), speeds)}
        )


def deviation_names(mechanism: Mechanism) -> list[str]:
    """Return the names of the deviations sigma (nu): of coordinates theirs, of an attitude `J.rx`, `J.ry`, `J.rz`."""
    names = [""] * len(mechanism.speeds)
    for body in mechanism.bodies:
        for q, u in zip(body.step_q, body.step_u, strict=True):
            names[u] = mechanism.coordinates[q].name
        if body.ball:
            for axis, u in zip("xyz", body.u[-3:], strict=True):
                names[u] = f"{body.joint_name}.r{axis}"
    return names


def _callable(program: Program) -> Function:
    """Return a Program as generated Python: searches call it thousands of times, yet too few for a compiler."""
    return load({program.name: program}, backend="python")[program.name]


def _pivots(matrix: Floats, wanted: Set[int]) -> list[int]:
    """Return as many columns as the matrix has rank, which determine the others best, but `wanted` ones last."""
    if not matrix.size:
        return []
    matrix = matrix * np.where([k in wanted for k in range(matrix.shape[1])], _WANTED, 1.0)
    lengths = np.linalg.norm(matrix, axis=1, keepdims=True)
    triangle, order = qr(matrix / np.where(lengths > 0.0, lengths, 1.0), mode="r", pivoting=True)
    sizes = np.abs(np.diag(triangle))
    return [int(k) for k in order[: int((sizes > _RANK * sizes.max(initial=0.0)).sum())]]
