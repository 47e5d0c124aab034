"""Deviations of a motion, z = (sigma, delta u), to first order: how they move, and which of them constraints allow.

Deviations sigma of coordinates are these themselves; of an attitude the rotation vector theta in the body's axes,
R = R0(t) exp(theta~), so that

    sigma' = delta u,   theta' = delta omega - omega0 x theta,   delta udot = dudot/dq N sigma + dudot/du delta u

with dq = N(q) sigma, as qdot = N(q) u: a body that spins about a fixed axis has a constant A, which it has not in the
components of its quaternion. A motion that satisfies the constraints moves on a surface; with z' = F z + G w, and X
spanning the surface's tangents, parametrised by independent components xi of z, these obey

    xi' = P F X xi + P G w           P picks the independent components

Source: the elimination is that of P. J. Peterson, G. Gede, M. Hubbard, Symbolic Linearization of Equations of Motion
of Constrained Multibody Systems (2015), done in numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.dynamics.programs.system import inputs_program, state_derivative
from multibody_sym.dynamics.routes import FORMALISMS, cheapest
from multibody_sym.kinematics.energy import potential_energy
from multibody_sym.kinematics.motion import coordinate_rates, motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import arrays, slot_state
from multibody_sym.kinematics.steps import carried_deviations, deviation_suffixes
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.numerics.rank import SLOPES, leading_columns, least_squares
from multibody_sym.program.forward import jacobian
from multibody_sym.program.program import Program
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.runtime.loading import load
from multibody_sym.scalars.node import as_node

Function = Callable[..., tuple[Floats, ...]]

_WANTED: Final = 1e-3
"""The weight of a component that is wanted as a state: it is made dependent only where no other will do."""


@dataclass(frozen=True)
class Slopes:
    """xi' = A xi + B w beside a state: names of the components xi (m), `A` (m x m), `B` (m x nw), udot by speed."""

    states: tuple[str, ...]
    A: Floats
    B: Floats
    accelerations: dict[str, float]


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

    def linearized(self, q: npt.ArrayLike, u: npt.ArrayLike) -> Slopes:
        """Return how deviations move at t = 0 at a state that satisfies the constraints, be A constant or not."""
        known, tangents = self.known(q, u), self.tangents(q, u)
        by_state, by_input = self.derivatives(known)
        names = [*deviation_names(self.mechanism), *(s.name for s in self.mechanism.speeds)]
        udot = self._rates(*known)[1].tolist()
        return Slopes(
            tuple(names[k] for k in tangents.places),
            (by_state @ tangents.X)[tangents.places],
            by_input[tangents.places] + 0.0,
            dict(zip((s.name for s in self.mechanism.speeds), udot, strict=True)),
        )

    def known(
        self, q: npt.ArrayLike, u: npt.ArrayLike, t: float = 0.0, parameters: npt.ArrayLike | None = None
    ) -> tuple[npt.ArrayLike, ...]:
        """Return what system programs are called with at a state; time stands still in inputs."""
        values = self.parameters if parameters is None else parameters
        (inputs, *_) = self._driven(0.0, q, u, values)
        return (t, q, u, values, inputs, [])

    def known_at(self, q: npt.ArrayLike, u: npt.ArrayLike, t: float) -> tuple[npt.ArrayLike, ...]:
        """Return the same at another time, which inputs follow."""
        (inputs, *_) = self._driven(t, q, u, self.parameters)
        return (t, q, u, self.parameters, inputs, [])

    def accelerations(self, q: npt.ArrayLike, u: npt.ArrayLike) -> Floats:
        """Return udot (nu)."""
        return self._rates(*self.known(q, u))[1]

    def multipliers(self, q: npt.ArrayLike) -> Floats:
        """Return the multipliers (nr) of the rows at rest."""
        return self._rates(*self.known(q, np.zeros(len(self.mechanism.speeds))))[2]

    def jacobian(self, q: npt.ArrayLike) -> Floats:
        """Return the Jacobian (nr x nu) of the rows."""
        known = self.known(q, np.zeros(len(self.mechanism.speeds)))
        return self._by(self._restricted, ("speeds",), "u", known)

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
        """Return what the motion itself makes of deviations, as of theta' = - omega x theta."""
        found = np.zeros((len(self.mechanism.speeds),) * 2)
        for body in self.mechanism.bodies:
            for free in body.free_steps:
                found[np.ix_(free.u, free.u)] = carried_deviations(free.step, [float(np.asarray(u)[k]) for k in free.u])
        return found

    def tangents(self, q: npt.ArrayLike, u: npt.ArrayLike) -> Tangents:
        """Return the states that the constraints allow beside a state, parametrised by components as given first.

        Among them are, as far as may be, deviations of coordinates that are marked known, with their speeds, and those
        of whose speeds are there.
        """
        known, size = self.known(q, u), len(self.mechanism.speeds)
        positions, speeds = self.restrictions(known)
        dependent = _pivots(speeds[:, size:], self._wanted)
        independent = set(range(size)) - set(dependent)
        dependent = [*_pivots(positions[:, :size], self._wanted | independent), *(size + k for k in dependent)]
        places = [k for k in range(2 * size) if k not in set(dependent)]
        return Tangents(places, self.span(known, places))

    def span(self, known: Sequence[npt.ArrayLike], places: Sequence[int]) -> Floats:
        """Return X (2 nu x m) for given independent components."""
        matrix = np.vstack(self.restrictions(known))
        if not np.isfinite(matrix).all():
            raise FloatingPointError("the constraints' slopes are not finite")
        dependent = [k for k in range(matrix.shape[1]) if k not in set(places)]
        X = np.zeros((matrix.shape[1], len(places)))
        X[places] = np.eye(len(places))
        if dependent:
            X[dependent] = least_squares(matrix[:, dependent], -matrix[:, places], SLOPES)
        return X

    def restrictions(self, known: Sequence[npt.ArrayLike]) -> tuple[Floats, Floats]:
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
        found[dependent] -= least_squares(H, self._residuals(*known)[1], SLOPES)
        return found

    def poses(self, q: npt.ArrayLike) -> tuple[Floats, float]:
        """Return R_WB and p_WB of all bodies (12 each, R by rows) and the potential energy at rest."""
        found = self._placed(*self.known(q, np.zeros(len(self.mechanism.speeds))))
        return found[0], float(found[1])

    def pose_slopes(self, q: npt.ArrayLike) -> Floats:
        """Return how poses follow deviations (12 per body x nu)."""
        known = self.known(q, np.zeros(len(self.mechanism.speeds)))
        return self._by(self._place, ("poses",), "q", known) @ self.displacements(q)

    def row_without_slopes(self, known: Sequence[npt.ArrayLike]) -> int | None:
        """Return the first row whose acceleration, or what it restricts, has no finite derivative; None: all have."""
        count = len(self.mechanism.rows)
        for name in ("q", "u"):
            try:
                found = self._by(self._asked, ("rows",), name, known).reshape(count, -1) if count else np.zeros((0, 1))
            except UNDEFINED:
                return 0
            bad = np.flatnonzero(~np.isfinite(found).all(axis=1))
            if len(bad):
                return int(bad[0])
        return None

    @cached_property
    def _wanted(self) -> set[int]:
        """The deviations of coordinates that are marked known."""
        coordinates = self.mechanism.coordinates
        return {
            u
            for body in self.mechanism.bodies
            for free in body.free_steps
            for u in free.u
            if any(coordinates[q].known for q in free.q)
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

    @cached_property
    def _asked(self) -> Program:
        """The Program of what each row asks for: phi, phidot, its Jacobian and gamma (nr x (nu + 3))."""
        trace = Trace("asked", arrays(self.mechanism))
        rows = row_motions(motion_of(self.mechanism, slot_state(self.mechanism)))
        each = [(row.phi if row.holonomic else 0, row.phidot, row.gamma, *row.jacobian) for row in rows]
        values = [as_node(x) for parts in each for x in parts]
        return trace.finish({"rows": ((len(values),), values)})


def deviation_names(mechanism: Mechanism) -> list[str]:
    """Return the names of the deviations sigma (nu): of coordinates theirs, of an attitude `J.rx`, `J.ry`, `J.rz`."""
    names = [""] * len(mechanism.speeds)
    for body in mechanism.bodies:
        for q, u in body.rate_pairs:
            names[u] = mechanism.coordinates[q].name
        for free in body.free_steps:
            for suffix, u in zip(deviation_suffixes(free.step), free.u, strict=True):
                names[u] = names[u] if suffix is None else body.joint_name + suffix
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
    return leading_columns(matrix / np.where(lengths > 0.0, lengths, 1.0), SLOPES)
