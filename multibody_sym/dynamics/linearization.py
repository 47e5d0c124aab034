"""Linearisation about a state: x' = A x + B w in independent coordinates and speeds, by exact derivatives.

A motion that satisfies the constraints moves on a surface of the state space. With z = (q, u), z' = F(z, w), and
X(z) spanning the surface's tangents, parametrised by independent components of z, these obey

    xi' = P dF/dz X xi + P dF/dw w           P picks the independent components

Steady motions (a bicycle that rolls on) are linearised like equilibria: what they run through does not enter.
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

from multibody_sym.dynamics.formalisms import FORMALISMS, cheapest
from multibody_sym.dynamics.programs import inputs_program, state_derivative
from multibody_sym.dynamics.start import start, verify_regular_start
from multibody_sym.kinematics.motion import motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import arrays, slot_state
from multibody_sym.model.mechanism import Mechanism
from multibody_sym.model.resolve import mechanism
from multibody_sym.model.system import System
from multibody_sym.program.derivatives import jacobian
from multibody_sym.program.program import Program
from multibody_sym.program.trace import Trace
from multibody_sym.runtime.loading import load
from multibody_sym.scalars.node import ONE

Floats = npt.NDArray[np.float64]
Function = Callable[..., tuple[Floats, ...]]

_RANK: Final = 1e-9
_WANTED: Final = 1e-3
"""The weight of a component that is wanted as a state: it is made dependent only where no other will do."""


@dataclass(frozen=True, eq=False)
class Linearization:
    """x' = A x + B w for small changes x of `states` (m) and w of `inputs` (k): `A` (m x m), `B` (m x k).

    `accelerations` (by speed) at the state itself: zero in an equilibrium or a steady motion; `shifts`: by how much
    given start values changed to satisfy the constraints.
    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    A: Floats
    B: Floats
    accelerations: dict[str, float]
    shifts: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def eigenvalues(self) -> npt.NDArray[np.complex128]:
        """The eigenvalues of A, the least damped first."""
        values = np.linalg.eigvals(self.A).astype(complex)
        return values[np.lexsort((values.imag, -values.real))]

    def as_json(self) -> dict[str, Any]:
        """Return the object that `linearize --json` prints."""
        return {
            "states": list(self.states),
            "inputs": list(self.inputs),
            "A": self.A.tolist(),
            "B": self.B.tolist(),
            "eigenvalues": [[float(x.real), float(x.imag)] for x in self.eigenvalues],
            "accelerations": self.accelerations,
            "shifts": dict(self.shifts),
        }


def linearize(system: System, *, formalism: str | None = None) -> Linearization:
    """Return the linearisation of a system about its start, in coordinates of its joints.

    Raises InputError, and NoSolutionError where there is no start, or it is a singular position.
    """
    declared = mechanism(system)
    resolved = declared.relative or declared
    begin = start(resolved, project=system.simulation.project)
    verify_regular_start(resolved, begin)
    return replace(Flow(resolved, begin.parameters, formalism).linearized(begin.q, begin.u), shifts=begin.shifts)


@dataclass(frozen=True)
class Tangents:
    """The states that constraints allow beside one: dz = X xi, with xi those components of dz that stand at `places`.

    `places` (m) of the independent components of z = (q, u), `X` (nq + nu, m).
    """

    places: list[int]
    X: Floats


@dataclass(frozen=True)
class Flow:
    """z' = F(z) of a mechanism at t = 0, z = (q, u), for given parameters, with its exact derivatives."""

    mechanism: Mechanism
    parameters: Sequence[float]
    formalism: str | None = None

    def linearized(self, q: npt.ArrayLike, u: npt.ArrayLike) -> Linearization:
        """Return the linearisation about a state that satisfies the constraints."""
        known, tangents = self.known(q, u), self.tangents(q, u)
        by_state, by_input = self.derivatives(known)
        names = [*(c.name for c in self.mechanism.coordinates), *(s.name for s in self.mechanism.speeds)]
        udot = self._rates(*known)[1].tolist()
        return Linearization(
            tuple(names[k] for k in tangents.places),
            tuple(self.mechanism.inputs),
            (by_state @ tangents.X)[tangents.places],
            by_input[tangents.places],
            dict(zip(names[len(self.mechanism.coordinates) :], udot, strict=True)),
        )

    def known(self, q: npt.ArrayLike, u: npt.ArrayLike) -> tuple[npt.ArrayLike, ...]:
        """Return what system programs are called with at a state."""
        given = (0.0, q, u, self.parameters)
        return (*given, self._driven(*given)[0], [])

    def accelerations(self, q: npt.ArrayLike, u: npt.ArrayLike) -> Floats:
        """Return udot (nu)."""
        return self._rates(*self.known(q, u))[1]

    def derivatives(self, known: Sequence[npt.ArrayLike]) -> tuple[Floats, Floats]:
        """Return dF/dz (nz x nz), through the inputs too, and dF/dw (nz x nw)."""
        by = {name: self._by(self._derivative, ("qdot", "udot"), name, known) for name in ("q", "u", "inputs")}
        inputs = [self._by(self._inputs, ("inputs",), name, known[:4]) for name in ("q", "u")]
        columns = [by[name] + by["inputs"] @ inner for name, inner in zip(("q", "u"), inputs, strict=True)]
        return np.hstack(columns), by["inputs"]

    def tangents(self, q: npt.ArrayLike, u: npt.ArrayLike) -> Tangents:
        """Return the states that the constraints allow beside a state, parametrised by components as given first.

        Among them are, as far as may be, coordinates that are marked known, with their speeds, and those of whose
        speeds are there.
        """
        known = self.known(q, u)
        by_q, by_u = (self._by(self._restricted, ("positions", "speeds"), name, known) for name in ("q", "u"))
        count = len(by_q) - len(self.mechanism.rows)
        matrix, size = np.hstack([by_q, by_u]), len(self.mechanism.coordinates)
        wanted = {k for k, c in enumerate(self.mechanism.coordinates) if c.known}
        speeds = _pivots(by_u[count:], {u for k, u in self._pairs.items() if k in wanted})
        wanted |= {k for k, u in self._pairs.items() if u not in speeds}
        dependent = [*_pivots(by_q[:count], wanted), *(size + k for k in speeds)]
        places = [k for k in range(matrix.shape[1]) if k not in set(dependent)]
        X = np.zeros((matrix.shape[1], len(places)))
        X[places] = np.eye(len(places))
        if dependent:
            X[dependent] = np.linalg.lstsq(matrix[:, dependent], -matrix[:, places], rcond=_RANK)[0]
        return Tangents(places, X)

    @cached_property
    def _pairs(self) -> dict[int, int]:
        """The speeds that are rates of coordinates, by these."""
        bodies = [body for body in self.mechanism.bodies if not body.ball]
        return {q: u for body in bodies for q, u in zip(body.q, body.u, strict=True)}

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
    def _restricted(self) -> Program:
        """The Program of what stays zero: phi of holonomic rows and |quaternion|^2 - 1; phidot of all rows."""
        trace = Trace("restricted", arrays(self.mechanism))
        rows = row_motions(motion_of(self.mechanism, slot_state(self.mechanism)))
        lengths = [
            sum((trace["q"][k] ** 2 for k in body.quaternion), -ONE) for body in self.mechanism.bodies if body.ball
        ]
        positions = [*(row.phi for row in rows if row.holonomic), *lengths]
        speeds = [row.phidot for row in rows]
        return trace.finish(
            {"positions": ((len(positions),), positions), "speeds": ((len(speeds),), speeds)}
        )


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
