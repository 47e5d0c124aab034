"""Linearisation about a motion: x' = A x + B w in independent deviations and speeds, by exact derivatives.

In: a System and a state. Out: a Linearization. Steady motions (a bicycle that rolls on) are linearised like equilibria:
A is constant. Where it is not, and the motion repeats itself, Multipliers take the place of eigenvalues.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from sys import float_info
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
import numpy.typing as npt

from multibody_sym.analysis.deviations import NO_EIGENVALUES, DeviationFlow, constancy_of
from multibody_sym.analysis.state_asked_about import (
    begin_at,
    errors_at,
    number_asked,
    verify_keeps_mode,
    verify_no_limit,
    verify_one_valued,
)
from multibody_sym.derivation.routes import verify_formalism
from multibody_sym.dynamics.start.number_checks import blame_numbers, on_numbers
from multibody_sym.dynamics.start.start import Start, verify_regular_start
from multibody_sym.dynamics.start.state import examined_state
from multibody_sym.errors import (
    ArgumentError,
    InputError,
    ModelError,
    NoSolutionError,
    OutputError,
    Where,
    brief,
    short_repr,
)
from multibody_sym.errors import at as under
from multibody_sym.mechanics.changes import Overrides, with_settings
from multibody_sym.mechanics.mechanism import TIME
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.argument_checks import door, flag
from multibody_sym.model.argument_checks import names as listed_names
from multibody_sym.model.fields import Scalar
from multibody_sym.model.system import System
from multibody_sym.motion.runs.held_inputs import positive_time
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.elimination import eigenvalues, without_rounding
from multibody_sym.scalars.node import Node, as_node, symbol
from multibody_sym.scalars.numbers import complexes, floats, verify_finite

if TYPE_CHECKING:
    from scipy.integrate import DOP853

    from multibody_sym.pictures.notebook_figure import ShownFigure

At = Literal["equilibrium"] | Mapping[str, Any] | None
"""Where a system is linearised, beside its start."""

# --- periodic motions: the multipliers by which small deviations grow over one period (Floquet) ----------------------
#
# Where A is not constant its eigenvalues say nothing. The equations of deviations, z' = F(t) z, are integrated beside
# the motion itself; with X spanning the constraints' tangents at the start and P picking the independent components,
# the multipliers are the eigenvalues of P Z(T) X. The motion is stable where none is larger than one.

_RTOL: Final = 1e-10
_REPEATS: Final = 1e-6
_MOST_STEPS: Final = 100_000
"""Steps over a period: about five minutes of a small mechanism."""
_PACE: Final = 1000
"""Steps after each of which it is foreseen how many a period takes."""
_MARGIN: Final = 10
"""How many times the most steps may be foreseen: a start may take shorter ones than the rest of the period."""


@dataclass(frozen=True, eq=False)
class Multipliers:
    """The `multipliers` of small changes of `states` over one `period` (s), the largest first."""

    states: tuple[str, ...]
    period: float
    multipliers: npt.NDArray[np.complex128]

    def as_json(self) -> dict[str, Any]:
        """Return the object that `linearize --period --json` prints."""
        found = [[float(x.real), float(x.imag)] for x in self.multipliers]
        return {"states": list(self.states), "period": self.period, "multipliers": found}


def _follow(solver: DOP853) -> Floats:
    """Return the state at the end of a period. Raises NoSolutionError where steps become too small, or too many."""
    count, before = 0, 0.0
    while solver.status == "running":
        solver.step()
        count += 1
        if count % _PACE == 0 and solver.status == "running":
            foreseen = count + _PACE * (solver.t_bound - solver.t) / max(solver.t - before, float_info.min)
            if count >= _MOST_STEPS or foreseen > _MARGIN * _MOST_STEPS:
                raise NoSolutionError(
                    f"a period of {solver.t_bound:g} s takes too many steps: {count} led to t = {solver.t:.6g} s, as "
                    "the motion, or a small deviation from it, changes that fast; give the shortest time after which "
                    "the motion repeats itself",
                    number="N111",
                )
            before = solver.t
    if solver.status == "failed":
        raise NoSolutionError(
            f"the motion cannot be followed over a period past t = {solver.t:.6g} s: steps became too small, as where "
            "a force or a constraint has no finite slope",
            number="N105",
        )
    return np.asarray(solver.y, dtype=float)


# --- linearisation ---------------------------------------------------------------------------------------------------


_MARGINAL: Final = 1e-9
"""The part of the largest eigenvalue by which the others are stable."""


@dataclass(frozen=True, eq=False)
class Linearization:
    """x' = A x + B w, y = C x + D w for small changes x of `states` (m), w of `inputs` (k) and y of `outputs` (p).

    `A` (m x m), `B` (m x k), `C` (p x m), `D` (p x k). With `dt` (s) of a `discrete` one: x and w of one sample give x
    of the next; w is held between them.

    States are coordinates and speeds by name; of a joint with a quaternion J the deviations `J.rx`, `J.ry`, `J.rz`
    (rad), the rotation vector in the child's axes. `accelerations` (by speed) at the state itself: zero in an
    equilibrium or a steady motion; `steady`: whether A is constant; where it is not, the system is let go from rest,
    and A is that of the start. `left_out`: states that are not among `states`, as nothing depends on them and their
    own rates are not constant. `shifts`: by how much given start values changed to satisfy the constraints. `rounding`
    (m x m): what rounding may make of A. `driving_inputs` move constraints or joints by their rates too and have no
    column in B. `at`: the coordinates and speeds of the state; `input_values`: the inputs there. `units`: the unit of
    each state, input, output, coordinate and speed by name, empty where it is not known.
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
    at: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    driving_inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    C: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    D: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    dt: float | None = None
    input_values: Mapping[str, float] = field(default_factory=dict)

    def __repr__(self) -> str:
        told = f"in {', '.join(brief(self.states))}" if self.states else "without states"
        told += "" if self.dt is None else f", each {self.dt:g} s"
        return f"<Linearization {told}{', by ' + ', '.join(brief(self.inputs)) if self.inputs else ''}>"

    @property
    def eigenvalues(self) -> npt.NDArray[np.complex128]:
        """The eigenvalues of A, the least damped first, without rounding; of samples their factors, the largest first.

        Raises NoSolutionError where A is not constant: its eigenvalues say nothing about the motion then.
        """
        return self._spectrum[0]

    @property
    def eigenvalue_errors(self) -> Floats:
        """By how much rounding may have changed each of the eigenvalues."""
        return self._spectrum[1]

    @cached_property
    def _spectrum(self) -> tuple[npt.NDArray[np.complex128], Floats]:
        if not self.steady:
            raise NoSolutionError(f"{NO_EIGENVALUES}; `A` is that of the state in which it begins", number="N111")
        values, errors = eigenvalues(self.A, np.zeros_like(self.A) if self.rounding is None else self.rounding)
        order = np.lexsort((values.imag, -(values.real if self.dt is None else np.abs(values))))
        return values[order], errors[order]

    @door
    def discrete(self, dt: float | str) -> Linearization:
        """Return x[k+1] = A x[k] + B w[k] for samples each `dt`, between which w is held: exact, by expm.

        `dt`: a time in s, or text such as `10 ms`. Raises InputError for a `dt` that is not positive, or of what is
        discrete already; NoSolutionError where A is not constant.
        """
        step = positive_time("dt", dt)
        self._verify_steady("samples")
        if self.dt is not None:
            raise InputError(f"these are samples each {self.dt:g} s already")
        from scipy.linalg import expm  # scipy takes longer to import than most answers take

        size, count = len(self.states), len(self.inputs)
        whole = np.zeros((size + count,) * 2)
        whole[:size, :size], whole[:size, size:] = self.A, self.B
        found = expm(whole * step)[:size]
        return replace(self, A=found[:, :size], B=found[:, size:], dt=step, rounding=None)

    @door
    def lqr(self, Q: npt.ArrayLike, R: npt.ArrayLike) -> Floats:
        """Return the gains K (k, m) of the law w = -K x with the least sum of x^T Q x + w^T R w: over time, or samples.

        `Q` (m, m), `R` (k, k): symmetric weights of the states and the inputs, Q positive semidefinite, R positive
        definite. Raises InputError for others, NoSolutionError where A is not constant or no law with these weights
        makes the system stable.
        """
        self._verify_steady("law")
        weights = [floats(name, given) for name, given in (("Q", Q), ("R", R))]
        for name, weight, size in zip("QR", weights, (len(self.states), len(self.inputs)), strict=True):
            _verify_weight(name, weight, size)
        from scipy.linalg import solve_continuous_are, solve_discrete_are

        A, B, (of_states, of_inputs) = self.A, self.B, weights
        try:
            if self.dt is None:
                K = np.linalg.solve(of_inputs, B.T @ solve_continuous_are(A, B, of_states, of_inputs))
            else:
                P = solve_discrete_are(A, B, of_states, of_inputs)
                K = np.linalg.solve(of_inputs + B.T @ P @ B, B.T @ P @ A)
        except (np.linalg.LinAlgError, ValueError) as error:
            raise NoSolutionError(f"no law with these weights makes the system stable: {error}") from None
        kept = np.linalg.eigvals(A - B @ K)
        growth = kept.real if self.dt is None else np.abs(kept) - 1.0
        if growth.max(initial=-np.inf) > -_MARGINAL * max(1.0, float(np.abs(kept).max(initial=0.0))):
            least = complex(kept[int(np.argmax(growth))])
            raise NoSolutionError(
                f"no law with these weights makes the system stable: A - B K keeps the eigenvalue {least:.4g}; "
                "give the states that Q leaves out a weight"
            )
        return np.asarray(K)

    @door
    def feedback(self, K: npt.ArrayLike) -> dict[str, Node]:
        """Return the law w = w0 - K (x - x0) of the inputs, by name, as expressions of coordinates and speeds.

        `K` (k x m): a gain for each state and input, as of an LQR. x0 and w0 are those of the state: `inputs=` of
        `simulate` or of `linearize` closes the loop. Raises InputError for another shape, for samples, and for
        deviations of a quaternion, which are no expressions.
        """
        gains, size = np.atleast_2d(floats("K", K)), (len(self.inputs), len(self.states))
        verify_finite("K", gains)
        if gains.shape != size:
            raise InputError(f"K has the shape {gains.shape}, not {size}: a gain for each of {', '.join(self.states)}")
        if self.dt is not None:
            raise InputError("a law of samples is no expression: give a Stepper the inputs of each step")
        turning = next((name for name in self.states if name not in self.at), None)
        if turning is not None:
            raise InputError(f"{turning} is no coordinate: a law of quaternions is for a Stepper, or declare angles")
        off = [symbol(name) - self.at[name] for name in self.states]
        laws = {}
        for name, row in zip(self.inputs, gains.tolist(), strict=True):
            laws[name] = sum((-k * x for k, x in zip(row, off, strict=True)), as_node(self.input_values[name]))
        return laws

    @door
    def response(self, s: npt.ArrayLike) -> npt.NDArray[np.complex128]:
        """Return the transfer matrix C (s - A)^-1 B + D (.., p, k) at complex s (1/s), of samples at z.

        Without declared outputs it is that of the states. At an eigenvalue it is infinite. Raises InputError for what
        are no numbers, NoSolutionError where A is not constant.
        """
        self._verify_steady("response")
        points = complexes("s", s)
        C, D = self._read_outputs
        found = np.empty((points.size, *D.shape), dtype=complex)
        with np.errstate(invalid="ignore"):  # nan in, nan out
            for k, point in enumerate(points.ravel()):
                try:
                    found[k] = C @ np.linalg.solve(point * np.eye(len(self.A)) - self.A, self.B) + D
                except np.linalg.LinAlgError:
                    found[k] = np.inf
        return found.reshape(*points.shape, *D.shape)

    @door
    def transfer_function(self, output: str, input: str) -> tuple[Floats, Floats]:
        """Return numerator and denominator of an output by an input: coefficients of s, the highest power first.

        Raises InputError for unknown names, NoSolutionError where A is not constant. The polynomials of many states are
        worse conditioned than `response`.
        """
        self._verify_steady("transfer function")
        row, column = place_of("output", output, self.outputs or self.states), place_of("input", input, self.inputs)
        C, D = self._read_outputs
        of_poles = np.poly(self.A)
        with_input = np.poly(self.A - np.outer(self.B[:, column], C[row]))
        return np.asarray(with_input + (D[row, column] - 1.0) * of_poles), np.asarray(of_poles)

    def to_control(self) -> Any:
        """Return the `StateSpace` of the package python-control, with these names (`pip install control`).

        Raises NoSolutionError where A is not constant, OutputError where the package is not installed.
        """
        self._verify_steady("linear system")
        try:
            from control import StateSpace
        except ImportError:
            raise OutputError("python-control is not installed: pip install control") from None
        C, D = self._read_outputs
        names = {"states": self.states, "inputs": self.inputs, "outputs": self.outputs or self.states}
        labels = {kind: list(each) for kind, each in names.items()}
        return StateSpace(self.A, self.B, C, D, *([] if self.dt is None else [self.dt]), **labels)

    def _verify_steady(self, what: str) -> None:
        """Raise NoSolutionError where A is not constant: A .. D are those of a moment."""
        if not self.steady:
            message = f"A .. D are those of a moment of a motion, which has no {what}: A changes"
            raise NoSolutionError(message, number="N111")

    @property
    def _read_outputs(self) -> tuple[Floats, Floats]:
        """C and D, of the states where there are no outputs."""
        if self.outputs:
            return self.C, self.D
        return np.eye(len(self.states)), np.zeros((len(self.states), len(self.inputs)))

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
            "at": dict(self.at),
            "units": dict(self.units),
            "driving_inputs": list(self.driving_inputs),
            "outputs": list(self.outputs),
            "C": self.C.tolist(),
            "D": self.D.tolist(),
            "dt": self.dt,
            "input_values": dict(self.input_values),
        }


def place_of(kind: str, name: str, known: Sequence[str]) -> int:
    """Return the place of a name. Raises InputError for an unknown one."""
    if not isinstance(name, str) or name not in known:
        raise InputError(f"there is no {kind} {short_repr(name)}", number="M106", word=str(name), known=known)
    return known.index(name)


def _verify_weight(name: str, weight: Floats, size: int) -> None:
    """Raise InputError for what is no weight Q of states or R of inputs."""
    verify_finite(name, weight)
    if weight.shape != (size, size):
        raise InputError(f"{name} is a symmetric matrix ({size}, {size}), not of the shape {weight.shape}")
    if not np.array_equal(weight, weight.T):
        row, column = np.argwhere(weight != weight.T)[0].tolist()
        values = f"{weight[row, column]:g}, {weight[column, row]:g}"
        raise InputError(f"{name} is not symmetric: [{row}, {column}] and [{column}, {row}] are {values}")
    least = float(np.linalg.eigvalsh(weight).min(initial=np.inf))
    if least <= 0.0 and name == "R":
        raise InputError(f"R is not positive definite: its least eigenvalue is {least:.4g}, and each input has a price")
    if least < -_MARGINAL * float(np.abs(weight).max(initial=0.0)):
        raise InputError(f"{name} has the negative eigenvalue {least:.4g}: a weight of states is positive or zero")


def linearize(
    system: System,
    *,
    at: At = None,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    formalism: str | None = None,
    moving: bool = False,
) -> Linearization:
    """Return the linearisation of a system about its start, in coordinates of its joints, whatever `coordinates` are.

    `at` selects another state: "equilibrium", the first position of rest found from the start, or values of coordinates
    and speeds by name. Constraints are closed around them, and all other values are those of the start.
    Inputs that change with time are held at their values at t = 0. `parameters` to `project` change the system for this
    call. `formalism` None selects the cheapest one. `moving` accepts a motion in which A changes: A to D are then those
    of the moment, and not `steady`, as they are where the system is let go from rest. Outputs that depend on omitted
    states are omitted, too. Friction that begins to slip from rest is linearised as slipping.
    Raises InputError, and NoSolutionError, which names the cause: no start, a singular position, a force or an output
    without a derivative (a kink), or a motion, not let go from rest, in which A is not constant.
    """
    changed = Overrides(parameters, initial, inputs, coordinates, project).of(system)
    return _linearize(changed, formalism, at, flag("moving", moving))


@on_numbers
def _linearize(system: System, formalism: str | None, place: At, moving: bool) -> Linearization:
    flow, begin = flow_at(system, formalism, place)
    mechanism, q, u = flow.mechanism, np.array(begin.q, dtype=float), np.array(begin.u, dtype=float)
    with errors_at(place):
        if place is not None:
            verify_keeps_mode(flow, q, u)
        verify_no_limit(flow, q, u)
        found = _with_outputs(verified_linearization(flow, q, u, moving=moving), flow, q, u)
    names = [*(c.name for c in mechanism.coordinates), *(s.name for s in mechanism.speeds)]
    in_time = tuple(name for name, node in mechanism.inputs.items() if TIME in leaves([node], "slot"))
    at = dict(zip(names, (*begin.q, *begin.u), strict=True))
    values = dict(zip(mechanism.inputs, np.ravel(flow.known(q, u)[4]).tolist(), strict=True))
    return replace(found, shifts=begin.shifts, held_inputs=in_time, at=at, input_values=values)


def period_multipliers(
    system: System,
    period: Any,
    *,
    at: At = None,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    formalism: str | None = None,
) -> Multipliers:
    """Return the multipliers over one period (s) of small deviations from the motion that begins at the start.

    For motions that repeat themselves, in which A is not constant. Inputs that change with time are held. The period is
    given as the `t_end` of a run is: a number, an expression of parameters, or text such as `2*pi*sqrt(l/g)`. All other
    arguments as for `linearize`.
    Raises InputError, and NoSolutionError where there is no start, the motion does not repeat itself, or a period takes
    too many steps.
    """
    with under("period"):
        duration = Scalar("s").accept(period)
    changed = Overrides(parameters, initial, inputs, coordinates, project).of(system)
    return _period_multipliers(with_settings(changed, {"t_end": duration}), formalism, at)


@on_numbers
def _period_multipliers(system: System, formalism: str | None, place: At) -> Multipliers:
    """Return the multipliers over `t_end`, so that the period is checked as a `t_end` is."""
    try:
        flow, begin = flow_at(system, formalism, place)
    except InputError as error:
        if error.where.path == ("simulation", "t_end"):
            error.where = Where(path=("period",))
        raise
    with under("period"):
        period = number_asked(system.simulation.t_end, flow.mechanism, begin)
        if not period > 0.0:
            raise ModelError(f"a period is a positive time, got {period:g}", number="M109")
    with errors_at(place):
        from scipy.integrate import DOP853  # scipy takes longer to import than most linearizations take

        q, u = np.array(begin.q, dtype=float), np.array(begin.u, dtype=float)
        here, tangents = flow.linearized(q, u), flow.tangents(q, u)
        ends = np.cumsum([len(q), len(u)])

        def rates(t: float, y: Floats) -> Floats:
            at, speeds, Z = np.split(y, ends)
            known = flow.known(at, speeds, t)
            by_state, _ = flow.derivatives(known)
            return np.concatenate([*flow.rates(known), np.ravel(by_state @ Z.reshape(tangents.X.shape))])

        first = np.concatenate([q, u, np.ravel(tangents.X)])
        try:
            at, speeds, last = np.split(_follow(DOP853(rates, 0.0, first, period, rtol=_RTOL, atol=_RTOL)), ends)
            known = flow.known(at, speeds, period)
            by_state, _ = flow.derivatives(known)
            there = by_state[tangents.places] @ flow.span(known, tangents.places)
        except UNDEFINED as error:
            raise NoSolutionError(f"the motion cannot be followed over a period ({error})", number="N111") from None
        missed = float(np.abs(there - here.A).max(initial=0.0))
        if missed > _REPEATS * max(1.0, float(np.abs(here.A).max(initial=0.0))):
            raise NoSolutionError(
                f"the motion does not repeat itself after {period:g} s: A differs by {missed:.3g} from that at first",
                number="N111",
            )
        Z = last.reshape(tangents.X.shape)
        values = np.linalg.eigvals(Z[tangents.places]).astype(complex)
        return Multipliers(here.states, period, values[np.lexsort((values.imag, -np.abs(values)))])


def flow_at(system: System, formalism: str | None, place: At) -> tuple[DeviationFlow, Start]:
    """Return the flow in coordinates of joints and its start, or the state at another place, which is regular.

    Raises NoSolutionError, also where slip in space begins: its friction has a direction there, and no slopes.
    """
    verify_formalism(formalism)
    resolved, first = examined_state(system).in_joints
    starting = resolved.mode.directions if resolved.mode is not None else {}
    element = next((x for x in resolved.one_way for part in x.frictions if part.name in starting), None)
    if element is not None:
        raise NoSolutionError(
            f"{element.name} begins to slip in space, and the direction of its friction has no derivative where "
            "nothing slides yet; give it a speed (initial: {u: ..})",
            where=Where(path=element.path),
            number="N111",
        )
    with errors_at(place):
        begin = begin_at(system, resolved, first, place, formalism)
        verify_regular_start(resolved, begin, "the start" if place is None else "the state")
        flow = DeviationFlow(resolved, begin.parameters, formalism)
        if not _has_slopes(flow, begin):
            blame_numbers(system)
            raise _without_slopes(flow, begin)
    return flow, begin


def _without_slopes(flow: DeviationFlow, begin: Start) -> NoSolutionError:
    """Return the error that A has no finite value in a state, with the row or force that has no derivative."""
    row = flow.row_without_slopes(flow.known(begin.q, begin.u))
    if row is not None:
        name = flow.mechanism.rows[row].name
        why = f"what {name} asks of accelerations has no derivative there; choose one beside it"
        where = Where(path=flow.mechanism.row_path(row))
        return NoSolutionError(f"A has no finite value in this state: {why}", where=where, number="N105")
    for load in flow.mechanism.loads:
        if _has_slopes(flow.without(load), begin):
            message = f"A has no finite value in this state: {load.name} has no derivative there; choose one beside it"
            return NoSolutionError(message, where=Where(path=load.path), number="N111")
    return NoSolutionError(
        "A has no finite value in this state: a force or an input has no derivative there", number="N105"
    )


def _has_slopes(flow: DeviationFlow, begin: Start) -> bool:
    known = flow.known(begin.q, begin.u)
    try:
        return all(np.isfinite(x).all() for x in (*flow.derivatives(known), *flow.restrictions(known)))
    except UNDEFINED:
        return False


def _with_outputs(found: Linearization, flow: DeviationFlow, q: Floats, u: Floats) -> Linearization:
    """Return a linearisation with the declared outputs that depend on none of the states that are left out."""
    mechanism = flow.mechanism
    if not mechanism.outputs:
        return replace(found, C=np.zeros((0, len(found.states))), D=np.zeros((0, len(found.inputs))))
    try:
        by_state, by_input = flow.output_slopes(flow.known(q, u))
    except TypeError as error:
        raise ModelError(f"the outputs have no derivatives: {error}", number="M110").under("outputs") from error
    for name, *slopes in zip(mechanism.outputs, by_state, by_input, strict=True):
        if all(np.isfinite(slope).all() for slope in slopes):
            continue
        message = f"C has no value in this state: {name} has no derivative there; choose one beside it"
        raise NoSolutionError(message, where=Where(path=("outputs", name)), number="N111")
    tangents = flow.tangents(q, u)
    C, names = by_state @ tangents.X, flow.state_names(tangents)
    kept, left = ([names.index(name) for name in some] for some in (found.states, found.left_out))
    rows = [k for k in range(len(C)) if not C[k, left].any()]
    columns = [k for k, name in enumerate(mechanism.inputs) if name in found.inputs]
    outputs = tuple(list(mechanism.outputs)[k] for k in rows)
    return replace(found, outputs=outputs, C=C[np.ix_(rows, kept)], D=by_input[np.ix_(rows, columns)])


def verified_linearization(
    flow: DeviationFlow, q: Floats, u: Floats, *, moving: bool = False
) -> Linearization:
    """Return the linearisation without states that move and on which nothing depends.

    Raises NoSolutionError where A has two values, or is not constant and the system moves, unless it may be `moving`.
    """
    verify_one_valued(flow, q, u)
    found = flow.linearized(q, u)
    constancy = constancy_of(flow, q, u)
    if not constancy.constant and constancy.reason and not moving:
        raise NoSolutionError(constancy.reason, number="N111")
    keep = [k for k in range(len(found.states)) if k not in constancy.left_out]
    names, driving = list(flow.mechanism.inputs), flow.mechanism.driving_inputs
    units = MechanismUnits(flow.mechanism)
    return Linearization(
        states=tuple(found.states[k] for k in keep),
        inputs=tuple(name for name in names if name not in driving),
        A=without_rounding(found.A, constancy.rounding)[np.ix_(keep, keep)],
        B=found.B[np.ix_(keep, [k for k, name in enumerate(names) if name not in driving])],
        driving_inputs=driving,
        accelerations=found.accelerations,
        steady=constancy.constant,
        left_out=tuple(found.states[k] for k in sorted(constancy.left_out)),
        rounding=constancy.rounding[np.ix_(keep, keep)],
        # states without a unit of their own are rotation vectors
        units={**dict.fromkeys(found.states, "rad"), **units.outputs, **units.inputs, **units.state},
    )


# ----------------------------------------------------------------------------------------------------------------------
# The response of a linearised system to inputs that oscillate: gain and phase over frequency, as in Bode's plots.


_DECADE: Final = 10.0
_POINTS: Final = 400
"""An even number: the middle, the frequency of a single eigenvalue without damping, is between two."""


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """The `response` (n, p, k) of p `outputs` to k `inputs` at n angular frequencies `omega` (rad/s), complex.

    An input cos(omega t) leads to the output |G| cos(omega t + phase) when all else has died down.
    """

    omega: Floats
    response: npt.NDArray[np.complex128]
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<FrequencyResponse of {', '.join(self.outputs)} by {', '.join(self.inputs)}: {len(self.omega)} points>"

    @property
    def gain(self) -> Floats:
        """|G| (n, p, k), in the unit of the output by that of the input."""
        return np.abs(self.response)

    @property
    def decibels(self) -> Floats:
        """20 log10 |G| (n, p, k)."""
        with np.errstate(divide="ignore"):
            return np.asarray(20.0 * np.log10(self.gain))

    @property
    def phase(self) -> Floats:
        """The angle of G (n, p, k) in rad, without jumps along the frequencies; negative where the output lags."""
        return np.asarray(np.unwrap(np.angle(self.response), axis=0))

    @door
    def plot(self, path: str | os.PathLike[str] | None = None) -> ShownFigure:
        """Return a matplotlib figure of gain and phase, written to `path` if one is given.

        Raises InputError for what is no path, OutputError where matplotlib is missing or the file cannot be written.
        """
        from multibody_sym.pictures.page.files import write_figure
        from multibody_sym.pictures.plots import Panel, Plot, PlottedCurve, figure_of

        pairs = [(i, j) for i in range(len(self.outputs)) for j in range(len(self.inputs))]

        def panel(unit: str, values: Floats) -> Panel:
            curves = (
                PlottedCurve(f"{self.outputs[i]} by {self.inputs[j]}", self.omega, values[:, i, j]) for i, j in pairs
            )
            return Panel(unit, tuple(curves))

        panels = panel("dB", self.decibels), panel("deg", np.degrees(self.phase))
        figure = figure_of(Plot("frequency response", "angular frequency [rad/s]", panels))
        for axis in figure.axes:
            axis.set_xscale("log")
        if path is not None:
            write_figure(figure, path)
        return figure


def bode(
    system: System | Linearization,
    omega: npt.ArrayLike | None = None,
    *,
    inputs: Sequence[str] | str = (),
    outputs: Sequence[str] | str = (),
    at: At = None,
) -> FrequencyResponse:
    """Return the response of a system's outputs to its inputs over angular frequencies `omega` (rad/s).

    `system`: a Linearization, or a System, which is linearised `at` a state as `linearize` does. `inputs` and `outputs`
    by name; all, if none are named; without declared outputs those are the states. Without `omega` frequencies reach
    from a tenth of the slowest eigenvalue to ten times the fastest.
    Raises InputError for unknown names and wrong frequencies, NoSolutionError where A is not constant, and what
    `linearize` raises.
    """
    if isinstance(system, System):
        system = linearize(system, at=at)
    elif at is not None and isinstance(system, Linearization):
        raise InputError("a Linearization has its state: give bode the System to linearise it at another one")
    elif not isinstance(system, Linearization):
        raise ArgumentError(f"bode takes a System or a Linearization, not {short_repr(system)}")
    if not system.inputs or not system.states:
        raise InputError("a response needs an input: declare one (inputs: ..) that no constraint or motion follows")
    every = system.outputs or system.states
    rows = [place_of("output", name, every) for name in listed_names("outputs", outputs) or every]
    columns = [place_of("input", name, system.inputs) for name in listed_names("inputs", inputs) or system.inputs]
    w = _frequencies(system) if omega is None else np.atleast_1d(floats("omega", omega))
    if w.ndim != 1 or not (np.isfinite(w) & (w > 0.0)).all():
        raise InputError("omega is a positive angular frequency in rad/s, or a vector of them")
    points = 1j * w if system.dt is None else np.exp(1j * w * system.dt)
    response = system.response(points)[:, rows][:, :, columns]
    return FrequencyResponse(w, response, tuple(every[k] for k in rows), tuple(system.inputs[k] for k in columns))


def _frequencies(system: Linearization) -> Floats:
    """Return frequencies a decade around the eigenvalues, of samples up to half their frequency."""
    values = np.linalg.eigvals(system.A).astype(complex)
    if system.dt is not None:
        values = np.log(values[values != 0.0]) / system.dt
    sizes = np.abs(values)[np.abs(values) > 0.0]
    low, high = (float(sizes.min()), float(sizes.max())) if len(sizes) else (1.0, 1.0)
    high = high * _DECADE if system.dt is None else np.pi / system.dt
    return np.geomspace(min(low / _DECADE, high / _DECADE), high, _POINTS)
