"""Deviations of a motion to first order, and whether A in x' = A x + B w is constant along it.

In: a mechanism, its parameters and a state. Out: A and B beside the state, the tangents of the constraints, and the
verdict on A: constant in equilibria and steady motions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.derivation.routes import FORMALISMS, cheapest
from multibody_sym.dynamics.closing import ConstraintRows, closed_near
from multibody_sym.dynamics.programs.quantities import Sources, with_quantities
from multibody_sym.dynamics.programs.system import energy_program, inputs_program, outputs_program, state_derivative
from multibody_sym.mechanics.energy import potential_energy
from multibody_sym.mechanics.forces import varies_with_time
from multibody_sym.mechanics.load_records import Load
from multibody_sym.mechanics.mechanism import Mechanism, Source
from multibody_sym.mechanics.motion import (
    arrays,
    carried_deviations,
    coordinate_rates,
    deviation_suffixes,
    motion_of,
    slot_state,
)
from multibody_sym.mechanics.motion import displaced as step_displaced
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.program.backend import Native
from multibody_sym.program.derivatives import jacobian
from multibody_sym.program.loading import load
from multibody_sym.program.program import Program
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, UNDEFINED, Floats
from multibody_sym.scalars.elimination import eigenvalues, least_rounding, without_rounding
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import as_node, slot
from multibody_sym.scalars.rank import SLOPES, leading_columns, least_squares
from multibody_sym.scalars.sign_changes import switching_functions

# --- deviations z = (sigma, delta u, delta s): how they move, and which of them constraints allow --------------------
#
# Deviations sigma of coordinates are these themselves; of an attitude the rotation vector theta in the body's axes, R
# = R0(t) exp(theta~), so that
#
#     sigma' = delta u,   theta' = delta omega - omega0 x theta,   delta udot = dudot/dq N sigma + dudot/du delta u
#
# and declared states s, which are the last of q, add their rates and dudot/ds delta s. With dq = N(q) sigma + delta s,
# as qdot = N(q) u + s': a body that spins about a fixed axis has a constant A, which it has not in
# the components of its quaternion. A motion that satisfies the constraints moves on a surface; with z' = F z + G w,
# and X spanning the surface's tangents, parametrised by independent components xi of z, these obey
#
#     xi' = P F X xi + P G w           P picks the independent components
#
# Source: the elimination is that of P. J. Peterson, G. Gede, M. Hubbard, Symbolic Linearization of Equations of Motion
# of Constrained Multibody Systems (2015), done in numbers.

Function = Callable[..., tuple[Floats, ...]]
_WANTED: Final = 1e-3
"""The weight of a component that is wanted as a state: it is made dependent only where no other will do."""


@dataclass(frozen=True)
class Slopes:
    """xi' = A xi + B w beside a state: names of the components xi (m), `A` (m x m), `B` (m x nw).

    `accelerations` has udot by speed, and the rates of declared states by their names.
    """

    states: tuple[str, ...]
    A: Floats
    B: Floats
    accelerations: dict[str, float]


@dataclass(frozen=True)
class Tangents:
    """States that constraints allow beside one, dz = (sigma, du, ds) = X xi: `X` (nz, m), `places` (m) of xi in dz."""

    places: list[int]
    X: Floats


@dataclass(frozen=True)
class DeviationFlow:
    """How states of a mechanism near a motion move, for given parameters, by exact derivatives.

    z = (sigma, du, ds) has nz = 2 nu + ns components, for ns declared states.
    """

    mechanism: Mechanism
    parameters: Sequence[float]
    formalism: str | None = None

    def without(self, load: Load) -> DeviationFlow:
        """Return the flow of the mechanism without the loads of one name."""
        loads = tuple(x for x in self.mechanism.loads if x.name != load.name)
        return replace(self, mechanism=replace(self.mechanism, loads=loads))

    def linearized(self, q: npt.ArrayLike, u: npt.ArrayLike) -> Slopes:
        """Return A and B at t = 0 at a state that satisfies the constraints, be A constant or not."""
        known, tangents = self.known(q, u), self.tangents(q, u)
        by_state, by_input = self.derivatives(known)
        names = (*(s.name for s in self.mechanism.speeds), *self._state_names)
        return Slopes(
            self.state_names(tangents),
            (by_state @ tangents.X)[tangents.places],
            by_input[tangents.places] + 0.0,
            dict(zip(names, self.unbalanced(q, u).tolist(), strict=True)),
        )

    def state_names(self, tangents: Tangents) -> tuple[str, ...]:
        """Return the names of the independent components (m)."""
        names = [*deviation_names(self.mechanism), *(s.name for s in self.mechanism.speeds), *self._state_names]
        return tuple(names[k] for k in tangents.places)

    def known(
        self, q: npt.ArrayLike, u: npt.ArrayLike, t: float = 0.0, parameters: npt.ArrayLike | None = None
    ) -> tuple[npt.ArrayLike, ...]:
        """Return the arguments of system programs at a state; time stands still in inputs."""
        values = self.parameters if parameters is None else parameters
        (inputs, *_) = self._outputs(self._inputs, 0.0, q, u, values)
        return (t, q, u, values, inputs, [])

    def known_at(self, q: npt.ArrayLike, u: npt.ArrayLike, t: float) -> tuple[npt.ArrayLike, ...]:
        """Return the same at another time, which inputs follow."""
        (inputs, *_) = self._outputs(self._inputs, t, q, u, self.parameters)
        return (t, q, u, self.parameters, inputs, [])

    def accelerations(self, q: npt.ArrayLike, u: npt.ArrayLike) -> Floats:
        """Return udot (nu)."""
        return self.rates(self.known(q, u))[1]

    def unbalanced(self, q: npt.ArrayLike, u: npt.ArrayLike) -> Floats:
        """Return udot and the rates of declared states (nu + ns), which are zero in an equilibrium."""
        qdot, udot = self.rates(self.known(q, u))
        return np.concatenate([udot, qdot[len(qdot) - len(self._state_names) :]])

    def multipliers(
        self, q: npt.ArrayLike, u: npt.ArrayLike | None = None, inputs: npt.ArrayLike | None = None
    ) -> Floats:
        """Return the multipliers (nr) of the rows, at rest where no speeds are given, under declared inputs."""
        *known, declared, modes = self.known(q, np.zeros(len(self.mechanism.speeds)) if u is None else u)
        return self._outputs(self._derivative, *known, declared if inputs is None else inputs, modes)[2]

    def jacobian(self, q: npt.ArrayLike) -> Floats:
        """Return the Jacobian (nr x nu) of the rows."""
        known = self.known(q, np.zeros(len(self.mechanism.speeds)))
        return self._by(self._restricted, ("speeds",), "u", known)

    def rates(self, known: Sequence[npt.ArrayLike]) -> tuple[Floats, Floats]:
        """Return qdot (nq) and udot (nu)."""
        qdot, udot, *_ = self._outputs(self._derivative, *known)
        return qdot, udot

    def positions(self, known: Sequence[npt.ArrayLike]) -> Floats:
        """Return phi of the holonomic rows."""
        return self._outputs(self._restricted, *known)[0]

    def derivatives(self, known: Sequence[npt.ArrayLike]) -> tuple[Floats, Floats]:
        """Return dz'/dz (nz x nz), through the inputs too, and dz'/dw (nz x nw)."""
        N, size, states = self.displacements(known[1]), len(self.mechanism.speeds), len(self._state_names)
        by = {name: self._unbalanced_by(name, known) for name in ("q", "u", "inputs")}
        held = (0.0, *known[1:4])
        for name in ("q", "u"):
            by[name] = by[name] + by["inputs"] @ self._by(self._inputs, ("inputs",), name, held)
        found = np.zeros((2 * size + states,) * 2)
        found[:size, :size], found[:size, size : 2 * size] = self._turning(known[2]), np.eye(size)
        found[size:] = self._by_deviations(by["q"], N, by["u"])
        return found, np.vstack([np.zeros((size, by["inputs"].shape[1])), by["inputs"]])

    def outputs(self, known: Sequence[npt.ArrayLike]) -> Floats:
        """Return the declared outputs (ny)."""
        return self._outputs(self._declared, *known)[0]

    def output_slopes(self, known: Sequence[npt.ArrayLike]) -> tuple[Floats, Floats]:
        """Return the derivatives of the declared outputs (ny) by z (ny x nz), through inputs, and by w (ny x nw)."""
        return self._slopes(self._declared, known)

    def bends(self, known: Sequence[npt.ArrayLike]) -> tuple[Floats, Floats, Floats]:
        """Return functions whose zeros are kinks of forces, inputs or outputs (nb), and their derivatives alike."""
        return self._outputs(self._bending, *known)[0], *self._slopes(self._bending, known)

    def _slopes(self, program: Program, known: Sequence[npt.ArrayLike]) -> tuple[Floats, Floats]:
        by = {name: self._by(program, ("values",), name, known) for name in ("q", "u", "inputs")}
        for name in ("q", "u"):
            by[name] = by[name] + by["inputs"] @ self._by(self._inputs, ("inputs",), name, (0.0, *known[1:4]))
        return self._by_deviations(by["q"], self.displacements(known[1]), by["u"]), by["inputs"]

    def _unbalanced_by(self, name: str, known: Sequence[npt.ArrayLike]) -> Floats:
        """Return the derivatives of udot and of the rates of states (nu + ns) by an input."""
        found, states = self._by(self._derivative, ("udot",), name, known), len(self._state_names)
        return np.vstack([found, self._by(self._derivative, ("qdot",), name, known)[-states:]]) if states else found

    def _by_deviations(self, by_q: Floats, N: Floats, by_u: Floats) -> Floats:
        """Return derivatives by z (nz) from those by q and u."""
        return np.hstack([by_q @ N, by_u, by_q[:, by_q.shape[1] - len(self._state_names) :]])

    @cached_property
    def _state_names(self) -> tuple[str, ...]:
        return tuple(c.name for c in self.mechanism.coordinates if c.rate is not None)

    def displacements(self, q: npt.ArrayLike) -> Floats:
        """Return N (nq x nu) in dq = N sigma."""
        units = np.eye(len(self.mechanism.speeds)).tolist()
        values = np.asarray(q, dtype=float).tolist()
        columns = [coordinate_rates(self.mechanism, values, unit) for unit in units]
        return np.array(columns, dtype=float).reshape(len(units), len(self.mechanism.coordinates)).T

    def _turning(self, u: npt.ArrayLike) -> Floats:
        """Return the matrix by which the motion itself carries deviations, as in theta' = - omega x theta."""
        found = np.zeros((len(self.mechanism.speeds),) * 2)
        for body in self.mechanism.bodies:
            for free in body.free_steps:
                found[np.ix_(free.u, free.u)] = carried_deviations(free.step, [float(np.asarray(u)[k]) for k in free.u])
        return found

    def tangents(self, q: npt.ArrayLike, u: npt.ArrayLike) -> Tangents:
        """Return the states that the constraints allow beside a state.

        Independent are, as far as possible, deviations of coordinates marked known, with their speeds, and those of
        independent speeds.
        """
        known, size = self.known(q, u), len(self.mechanism.speeds)
        positions, speeds = self.restrictions(known)
        dependent = _pivots(speeds[:, size : 2 * size], self._wanted)
        independent = set(range(size)) - set(dependent)
        dependent = [*_pivots(positions[:, :size], self._wanted | independent), *(size + k for k in dependent)]
        places = [k for k in range(speeds.shape[1]) if k not in set(dependent)]
        return Tangents(places, self.span(known, places))

    def span(self, known: Sequence[npt.ArrayLike], places: Sequence[int]) -> Floats:
        """Return X (nz x m) for given independent components."""
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
        """Return the derivatives of phi and of phidot by z (x nz), which allowed deviations make zero."""
        N = self.displacements(known[1])
        phi = self._by(self._restricted, ("positions",), "q", known)
        by_q, by_u = (self._by(self._restricted, ("speeds",), name, known) for name in ("q", "u"))
        at_positions = self._by_deviations(phi, N, np.zeros((len(phi), N.shape[1])))
        return at_positions, self._by_deviations(by_q, N, by_u)

    def dependent_speeds(self, q: Floats, u: Floats, given: Set[int]) -> list[int]:
        """Return places (in u) of speeds that follow from the others by the rows, `given` ones if no others can."""
        size = len(self.mechanism.speeds)
        return _pivots(self.restrictions(self.known(q, u))[1][:, size : 2 * size], given)

    def completed(self, q: Floats, u: Floats, t: float, places: Sequence[int]) -> Floats:
        """Return u with the dependent speeds, not in `places`, such that the rows hold."""
        size = len(self.mechanism.speeds)
        dependent = [k for k in range(size) if size + k not in set(places)]
        if not dependent:
            return u
        known = self.known(q, u, t)
        H, found = self._by(self._restricted, ("speeds",), "u", known)[:, dependent], u.copy()
        found[dependent] -= least_squares(H, self._outputs(self._restricted, *known)[1], SLOPES)
        return found

    def poses(self, q: npt.ArrayLike) -> tuple[Floats, float]:
        """Return R_WB and p_WB of all bodies (12 each, R by rows) and the potential energy at rest."""
        found = self._outputs(self._place, *self.known(q, np.zeros(len(self.mechanism.speeds))))
        return found[0], float(found[1])

    def pose_slopes(self, q: npt.ArrayLike) -> Floats:
        """Return the derivatives of poses by deviations (12 per body x nu)."""
        known = self.known(q, np.zeros(len(self.mechanism.speeds)))
        return self._by(self._place, ("poses",), "q", known) @ self.displacements(q)

    def row_without_slopes(self, known: Sequence[npt.ArrayLike]) -> int | None:
        """Return the first row of which phi, phidot, H or gamma has no finite derivative; None: all have."""
        count = len(self.mechanism.rows)
        for name in ("q", "u") if count else ():
            try:
                slopes = self._by(self._row_values, ("rows",), name, known).reshape(count, -1)
            except UNDEFINED:
                return 0
            bad = np.flatnonzero(~np.isfinite(slopes).all(axis=1))
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
            if key not in self._functions:
                self._functions[key] = _callable(jacobian(program, output, name))
            found = self._functions[key](*known)[0]
            parts.append(found.reshape(len(program.output(output).values), program.input(name).size))
        return np.vstack(parts)

    def _outputs(self, program: Program, *known: npt.ArrayLike) -> tuple[Floats, ...]:
        if (program.name,) not in self._functions:
            self._functions[program.name,] = _callable(program)
        return self._functions[program.name,](*known)

    @cached_property
    def _functions(self) -> dict[tuple[str, ...], Function]:
        """The programs and derivatives that were needed so far, by program, output and input."""
        return {}

    @cached_property
    def _derivative(self) -> Program:
        formalism = FORMALISMS[self.formalism or cheapest(self.mechanism)]
        return state_derivative(self.mechanism, formalism(self.mechanism, slot_state(self.mechanism)))

    @cached_property
    def _declared(self) -> Program:
        """The Program of the declared outputs."""
        return outputs_program(self.mechanism, self._sources)

    @cached_property
    def _bending(self) -> Program:
        """The Program of functions whose zeros are kinks."""
        mechanism, trace = self.mechanism, Trace("bends", arrays(self.mechanism))
        bends = dict.fromkeys([*mechanism.kinks, *switching_functions(mechanism.outputs.values())])
        values = with_quantities(trace, self._sources, list(bends))
        return trace.finish({"values": ((len(values),), values)})

    @cached_property
    def _sources(self) -> Sources:
        mechanism = self.mechanism
        motion = motion_of(mechanism, slot_state(mechanism))
        return Sources(self._derivative, energy_program(mechanism), lambda _: motion)

    @cached_property
    def _inputs(self) -> Program:
        return inputs_program(self.mechanism)

    @cached_property
    def _place(self) -> Program:
        """The Program of all bodies' poses and the potential energy."""
        trace, motion = Trace("place", arrays(self.mechanism)), motion_of(self.mechanism, slot_state(self.mechanism))
        poses = [as_node(x) for R, p in motion.poses for x in (*R[0], *R[1], *R[2], *p)]
        return trace.finish(
            {"poses": ((len(poses),), poses), "energy": ((), [as_node(potential_energy(motion))])}
        )

    @cached_property
    def _restricted(self) -> Program:
        """The Program of the values that stay zero: phi of holonomic rows, phidot of all rows."""
        trace = Trace("restricted", arrays(self.mechanism))
        rows = row_motions(motion_of(self.mechanism, slot_state(self.mechanism)))
        positions = [row.phi for row in rows if row.holonomic]
        speeds = [row.phidot for row in rows]
        return trace.finish(
            {"positions": ((len(positions),), positions), "speeds": ((len(speeds),), speeds)}
        )

    @cached_property
    def _row_values(self) -> Program:
        """The Program of each row's phi, phidot, gamma and Jacobian (nr x (nu + 3))."""
        trace = Trace("asked", arrays(self.mechanism))
        rows = row_motions(motion_of(self.mechanism, slot_state(self.mechanism)))
        each = [(row.gap, row.phidot, row.gamma, *row.jacobian) for row in rows]
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
    return load({program.name: program}, Native(backend="python"))[program.name]


def _pivots(matrix: Floats, wanted: Set[int]) -> list[int]:
    """Return columns, as many as the rank, that determine the others best; `wanted` ones are taken last."""
    if not matrix.size:
        return []
    matrix = matrix * np.where([k in wanted for k in range(matrix.shape[1])], _WANTED, 1.0)
    lengths = np.linalg.norm(matrix, axis=1, keepdims=True)
    return leading_columns(matrix / np.where(lengths > 0.0, lengths, 1.0), SLOPES)


# --- whether A is constant -------------------------------------------------------------------------------------------
#
# A system moves steadily where all that A depends on keeps its value, although coordinates on which nothing depends may
# move (a bicycle that rolls on, a top that spins about the vertical). Two looks decide it. The state is moved on
# uniformly, far along everything that moves: A must not change at all, but for rounding. And it is moved as A itself
# says, over the time of each eigenvalue: accelerations must not change A either, but for the little by which the
# numbers of a start miss a steady motion.

NO_EIGENVALUES: Final = "the state is no equilibrium and no steady motion, and A changes as soon as it is let go"
_ADVICE: Final = (
    "linearise about an equilibrium (`--at equilibrium`; `equilibrium` finds all), or about a motion in which only "
    "coordinates change on which nothing depends; `--period T` gives multipliers of a motion that repeats itself"
)
_PARTS: Final = (0.37, 1.13, 2.9)
"""How far the state is moved on, in times in which the fastest coordinate moves by one unit, or one eigenvalue acts."""
_REST: Final = 1e-6
"""A speed this small beside all eigenvalues moves nothing while these act."""
_SLOW: Final = 1e-3
"""Eigenvalues this small beside what moves are not waited for."""
_STEADY: Final = 1e-9
_MISSED: Final = 1e-5
"""The part of A by which it may change where numbers of the start miss a steady motion."""
_CLOSURE: Final = 1e3
"""How much more than rounding of the state loops leave that are closed again."""
_GROWTH: Final = 3.0
_SAMPLES: Final = 3
_SAFETY: Final = 16.0
_SEED: Final = 5


@dataclass(frozen=True, eq=False)
class Constancy:
    """Whether A is constant, without the states `left_out`; if not, and the system moves, the `reason`, by name.

    `rounding` (m x m): by how much rounding may change A.
    """

    constant: bool
    left_out: frozenset[int]
    rounding: Floats
    reason: str = ""


def constancy_of(flow: DeviationFlow, q: Floats, u: Floats) -> Constancy:
    """Return whether A is constant along the motion from a state (q, u) at t = 0 that satisfies the constraints."""
    path = _Path(flow, q, u, flow.tangents(q, u))
    rounding = path.rounding(q, u)
    here = without_rounding(path.A(q, u), rounding)
    times = _Times.of(eigenvalues(here, rounding)[0], path)
    left_out = path.varying(here, rounding, times.uniform)
    if left_out is None:
        return Constancy(False, frozenset(), rounding, path.reason(here, rounding, times.uniform))
    if path.accelerates(here, rounding, left_out, times):
        return Constancy(False, frozenset(), rounding, path.accelerated() if times.moves else "")
    return Constancy(True, left_out, rounding)


@dataclass(frozen=True)
class _Times:
    """The times for which states move on `uniform`ly, and as A says (`linear`); whether anything `moves` at all."""

    uniform: list[float]
    linear: list[float]
    moves: bool

    @staticmethod
    def of(values: npt.NDArray[np.complex128], path: _Path) -> _Times:
        """Return the times for eigenvalues of A and the speeds, accelerations and rates of states on a path."""
        sizes = np.abs(values)[np.abs(values) > 0.0]
        udot, changing = path.udot, path.changing / np.maximum(1.0, np.abs(path.states))
        fastest = max(float(np.abs(x).max(initial=0.0)) for x in (path.u, changing))
        moves = fastest > _REST * (float(sizes.min()) if len(sizes) else _SLOW)
        natural = max(fastest if moves else 0.0, float(np.sqrt(np.abs(udot).max(initial=0.0)))) or 1.0
        acting = np.unique(np.round(np.log10(sizes[sizes > _SLOW * natural]), 1)) if len(sizes) else np.zeros(0)
        rates = [*(10.0**acting)] or [natural]
        growth = max(float(values.real.max(initial=0.0)), 0.0)
        limit = _GROWTH / growth if growth > 0.0 else np.inf
        scale = 1.0 / (fastest if moves else max(rates))
        return _Times(
            [part * scale for part in _PARTS],
            sorted({min(_PARTS[1] / x, limit) for x in rates}),
            moves,
        )


@dataclass(frozen=True, eq=False)
class _Path:
    """States along the motion from one."""

    flow: DeviationFlow
    q: Floats
    u: Floats
    tangents: Tangents

    @property
    def udot(self) -> Floats:
        """The accelerations (nu) at the start."""
        return self.flow.accelerations(self.q, self.u)

    @property
    def states(self) -> Floats:
        """The declared states (ns) at the start."""
        return self.q[len(self.q) - len(self.flow.mechanism.rates) :]

    @cached_property
    def changing(self) -> Floats:
        """The rates of the declared states (ns) at the start."""
        return self.flow.unbalanced(self.q, self.u)[len(self.u) :]

    def A(self, q: Floats, u: Floats, t: float = 0.0) -> Floats:
        """Return A at a state, in the independent components of the start."""
        return self._matrix(self.flow.known(q, u, t))

    def _matrix(self, known: Sequence[npt.ArrayLike]) -> Floats:
        by_state, _ = self.flow.derivatives(known)
        return by_state[self.tangents.places] @ self.flow.span(known, self.tangents.places)

    def rounding(self, q: Floats, u: Floats, t: float = 0.0) -> Floats:
        """Return by how much rounding of a state and of the parameters changes A, seen at a few states beside it.

        States at which A has no value do not count: a force may end at the state itself.
        """
        rng, here = np.random.default_rng(_SEED), self.A(q, u, t)
        found = np.zeros_like(here)
        for _ in range(_SAMPLES):
            with suppress(*UNDEFINED, np.linalg.LinAlgError):
                change = np.abs(self._matrix(self._rounded(q, u, t, rng)) - here)
                found = np.maximum(found, np.where(np.isfinite(change).all(), change, 0.0))
        return least_rounding(here, _SAFETY * (found + EPSILON * np.abs(here)))

    def _rounded(self, q: Floats, u: Floats, t: float, rng: np.random.Generator) -> tuple[npt.ArrayLike, ...]:
        """Return the arguments of programs at a state with all numbers rounded in the last place, up or down."""

        def rounded(values: npt.ArrayLike) -> Floats:
            numbers = np.asarray(values, dtype=float)
            return numbers * (1.0 + EPSILON * rng.choice([-1.0, 1.0], numbers.shape))

        angles = np.array([speed.unit == "rad/s" for speed in self.flow.mechanism.speeds], dtype=bool)
        turned = EPSILON * rng.choice([-1.0, 1.0], angles.shape) * angles
        parameters = rounded(self.flow.parameters)
        chosen = self.flow.mechanism.parameters.places_from(Source.CHOSEN)
        parameters[chosen] = np.array(self.flow.parameters)[chosen]
        beside = displaced(self.flow.mechanism, rounded(q), turned)
        return self.flow.known(beside, rounded(u), t, parameters)

    def along(self, sigma: Floats, du: Floats, t: float) -> tuple[Floats, Floats] | None:
        """Return A and its rounding at time t in the closed state nearest to the displaced one; None without any.

        `sigma` (nu, or nu + ns) are deviations of coordinates, and of states behind them.
        """
        rows = ConstraintRows(self.flow.mechanism, self.flow.parameters, range(len(self.flow.mechanism.rows)), t)
        try:
            q = closed_near(rows, displaced(self.flow.mechanism, self.q, sigma))
            if q is None:
                return None
            u = self.flow.completed(q, self.u + du, t, self.tangents.places)
            found = self.A(q, u, t), self.rounding(q, u, t)
        except (*UNDEFINED, np.linalg.LinAlgError):
            return None
        return found if np.isfinite(found).all() else None

    # --- uniformly --------------------------------------------------------------------------------------------------

    def varying(self, here: Floats, rounding: Floats, times: Sequence[float]) -> frozenset[int] | None:
        """Return states whose rates change while all moves on uniformly; None where others depend on them."""
        seen, allowed = [here], rounding
        changing: set[int] = set()
        for t in times:
            there = self.along(np.concatenate([self.u, self.changing]) * t, np.zeros_like(self.u), t)
            if there is None:
                return None
            seen.append(there[0])
            allowed = np.maximum(allowed, there[1])
            changing |= set(np.flatnonzero(_changed_elements(here, rounding, *there).any(axis=1)).tolist())
        kept = [k for k in range(len(here)) if k not in changing]
        depending = np.ix_(kept, sorted(changing))
        depends = any((np.abs(A) > _CLOSURE * allowed)[depending].any() for A in seen)
        return None if depends or (changing and not kept) else frozenset(changing)

    def reason(self, here: Floats, rounding: Floats, times: Sequence[float]) -> str:
        """Return the variables that change and on which A depends, in words."""
        moving = []  # deviations of which each alone changes A
        for places in (list(free.u) for body in self.flow.mechanism.bodies for free in body.free_steps):
            alone = np.zeros_like(self.u)
            alone[places] = self.u[places]
            if alone.any() and any(self._differs(here, rounding, alone * t, t) for t in times):
                moving += places
        size = len(self.u)
        for k in np.flatnonzero(self.changing).tolist():
            alone = np.zeros(size + len(self.changing))
            alone[size + k] = self.changing[k]
            if any(self._differs(here, rounding, alone * t, t) for t in times):
                moving.append(size + k)
        if not moving and any(self._differs(here, rounding, np.zeros_like(self.u), t) for t in times):
            masses = [body.name for body in self.flow.mechanism.bodies if varies_with_time(body)]
            why = f", as the mass of {masses[0]} does," if masses else ""
            return f"A depends on time{why or ','} and has no eigenvalues that tell how small motions go on; {_ADVICE}"
        named = moving or [k for k in range(len(self.u)) if abs(self.u[k]) > _REST * np.abs(self.u).max()]
        return self._refused(self._name_moving(named))

    def _differs(self, here: Floats, rounding: Floats, sigma: Floats, t: float) -> bool:
        there = self.along(sigma, np.zeros_like(self.u), t)
        return there is None or bool(_changed_elements(here, rounding, *there).any())

    # --- as A says --------------------------------------------------------------------------------------------------

    def accelerates(self, here: Floats, rounding: Floats, left_out: frozenset[int], times: _Times) -> bool:
        """Return whether A changes on the way that the state takes by its accelerations."""
        from scipy.linalg import expm  # scipy takes longer to import than most answers take

        keep = [k for k in range(len(here)) if k not in left_out]
        kept, size = np.ix_(keep, keep), len(self.u)
        # x' = A x + x'(0) from x(0) = 0, as one homogeneous system
        whole = np.zeros((len(here) + 1,) * 2)
        rates = np.concatenate([self.u, self.udot, self.changing])
        whole[:-1, :-1], whole[:-1, -1] = here, rates[self.tangents.places]
        for t in times.linear:
            z = self.tangents.X @ expm(whole * t)[:-1, -1]
            there = self.along(np.concatenate([z[:size], z[2 * size :]]), z[size : 2 * size], t)
            if there is None:
                return True
            noise, change = _CLOSURE * np.maximum(rounding, there[1])[kept], (there[0] - here)[kept]
            sizes = np.abs(here[kept])  # a change counts beside the largest of its row or column
            rows, columns = (sizes.max(axis=axis, initial=0.0, keepdims=True) for axis in (1, 0))
            if (np.abs(change) > _MISSED * np.maximum(rows, columns) + noise).any():
                return True
            if _changes_eigenvalues(here[kept], change, noise):
                return True
        return False

    def accelerated(self) -> str:
        """Return which speeds and states change."""
        udot, mechanism = self.udot, self.flow.mechanism
        places = [k for k in range(len(udot)) if abs(udot[k]) > _REST * np.abs(udot).max()]
        told = [f"{mechanism.speeds[k].name}' = {udot[k]:.6g}" for k in places]
        states = zip(mechanism.coordinates[len(self.q) - len(self.changing) :], self.changing.tolist(), strict=True)
        told += [f"{state.name}' = {rate:.6g}" for state, rate in states if rate]
        what = "speeds and states" if any(self.changing) else "speeds"
        return self._refused(f"{what} change ({', '.join(told)}), and A with them{self._angles_advice(places)}")

    # --- words ------------------------------------------------------------------------------------------------------

    def _name_moving(self, places: Sequence[int]) -> str:
        mechanism, told = self.flow.mechanism, []
        for body in mechanism.bodies:
            for free in body.free_steps:
                if set(free.u).isdisjoint(places):
                    continue
                for q, u in free.rate_pairs:
                    told.append(f"{mechanism.coordinates[q].name} ({self.u[u]:.6g} {mechanism.speeds[u].unit})")
                if not free.step.speeds_are_rates:
                    rate = float(np.linalg.norm(self.u[list(free.u)]))
                    told.append(f"the attitude of joint {body.joint_name} ({rate:.6g} rad/s)")
        for k in (k - len(self.u) for k in places if k >= len(self.u)):
            told.append(f"{mechanism.coordinates[k - len(self.changing)].name} ({self.changing[k]:.6g} a second)")
        return f"A depends on what moves: {', '.join(told)}{self._angles_advice(places)}"

    def _angles_advice(self, places: Sequence[int]) -> str:
        """Return that three angles serve where a steady precession seen in a body's axes would not be constant."""
        balls = [
            body.joint_name
            for body in self.flow.mechanism.bodies
            for free in body.free_steps
            if free.step.unit_quaternion and not set(free.u).isdisjoint(places)
        ]
        if not balls:
            return ""
        joints = "joint " + balls[0] if len(balls) == 1 else "joints " + ", ".join(balls)
        return (
            f"; in the axes of a body with a quaternion a steady precession is not constant, in three angles it is: "
            f"declare `angles: zxz` or the like for {joints}"
        )

    def _refused(self, why: str) -> str:
        return f"the state is no equilibrium and no steady motion: {why}; {_ADVICE}"


def displaced(mechanism: Mechanism, q: Floats, sigma: Floats) -> Floats:
    """Return q (nq) displaced by sigma: coordinates by theirs, quaternions turned by the rotation vector.

    sigma is (nu,), or (nu + ns,) with changes of the declared states behind it.
    """
    found = q.copy()
    states = sigma[len(mechanism.speeds) :]
    found[len(q) - len(states) :] += states
    for body in mechanism.bodies:
        for free in body.free_steps:
            found[list(free.q)] = step_displaced(free.step, q[list(free.q)], sigma[list(free.u)])
    return found


def coordinate_bounds(mechanism: Mechanism, parameters: Sequence[float]) -> Floats:
    """Return the least and the largest coordinate of each speed (2, nu), infinite without limits."""
    values = {slot("parameters", k): x for k, x in enumerate(parameters)}
    bounds = np.array([[-np.inf], [np.inf]]).repeat(len(mechanism.speeds), axis=1)
    places = {speed.name: k for k, speed in enumerate(mechanism.speeds)}
    for limit in mechanism.limits:
        for side, node in enumerate((limit.lower, limit.upper)):
            if node is not None and limit.speed in places:
                bounds[side, places[limit.speed]] = evaluate_float([node], values)[0]
    return bounds


def _changed_elements(here: Floats, rounding: Floats, there: Floats, rounding_there: Floats) -> npt.NDArray[np.bool_]:
    """Return which elements of A differ by more than rounding."""
    allowed = _STEADY * np.abs(here) + _CLOSURE * np.maximum(rounding, rounding_there)
    found: npt.NDArray[np.bool_] = np.abs(there - here) > allowed
    return found


def _changes_eigenvalues(A: Floats, change: Floats, noise: Floats) -> bool:
    """Return whether a change of A shows in one of its eigenvalues, however small beside the others it is."""
    from scipy.linalg import eig  # as above

    values, left, right = eig(A, left=True, right=True)
    overlap = np.abs(np.sum(left.conj() * right, axis=0))
    moved = np.abs(np.einsum("ik,ij,jk->k", left.conj(), change, right))
    uncertain = np.einsum("ik,ij,jk->k", np.abs(left), noise, np.abs(right))
    return bool((moved > _MISSED * np.abs(values) * overlap + uncertain)[np.abs(values) > 0.0].any())
