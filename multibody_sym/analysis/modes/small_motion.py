"""One system's small motions: the state, its matrices, their spectrum, and the record of modes.

In: a System. Out: Modes. First the notes on what small motions and periods leave out: time, and friction that turns.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.algebra.inequalities import Condition, reduced, under_roots
from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.algebra.roots import values_with_shared_roots
from multibody_sym.analysis.deviations import DeviationFlow, deviation_names
from multibody_sym.analysis.linearize import At
from multibody_sym.analysis.modes.formulas import (
    Formulas,
    Vector,
    damped_modes,
    modes_in_numbers,
    polynomial_text,
    shapes_in_numbers,
    state_values,
)
from multibody_sym.analysis.modes.matrices import Matrices, Matrix, matrices, with_momenta_held
from multibody_sym.analysis.modes.record import Mode, Modes, Rows
from multibody_sym.analysis.modes.spectrum import Root, Spectrum, spectrum
from multibody_sym.analysis.modes.state import SteadyState, formulas_of, place_of
from multibody_sym.derivation.symbolic_start import SymbolicState
from multibody_sym.dynamics.start.initial_geometry import fix_directions
from multibody_sym.dynamics.start.start import Start
from multibody_sym.errors import ExpressionError, NoSolutionError
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.modes import mode_words
from multibody_sym.model.system import System, expressions
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.text.values import Value

_TIME: Final = symbol("t")
_MOVING: Final = ("joints", "forces", "constraints", "bodies", "inputs", "gravity", "pulleys", "contacts")
_LATER: Final = (0.137, 1.913, 31.07)
"""Times (s) at which a system is compared with what it is at t = 0."""
_SAME: Final = 1e-9
_REST: Final = 1e-12
"""The part of the largest omega^2 up to which one is zero."""
_AGREEMENT: Final = 1e-7
"""How near a root must come to the square of an eigenvalue, of which rounding takes more where two of them meet."""
_ROUNDED: Final = 1e-11
_WORK_OF_CONDITIONS: Final = 50_000
_STOPPED: Final = "the start moves, but no steady motion was found beside it: its speeds are left out"
_IN_ANGLES: Final = "; those of attitudes are found in angles: declare `angles: zxz` or the like"
_DAMPED: Final = "dampers act: frequencies and shapes are those without them, and eigenvalues those with them"

# --- what small motions and periods leave out of a model -------------------------------------------------------------


def named_with_time(system: System) -> dict[str, list[Node]]:
    """Return the expressions of a model that depend on t, by the place of their element, `forces.drive`."""
    found: dict[str, list[Node]] = {}
    for section in _MOVING:
        for path, node, _ in expressions(getattr(system, section), (section,)):
            if _TIME in leaves([node], "symbol"):
                found.setdefault(".".join(path[:2]), []).append(node)
    return found


def period_of_drive(system: System, parameters: dict[Node, float]) -> float | None:
    """Return the period (s) of all sines and cosines of t in a model, None where they are not of one period."""
    drives = [node for nodes in named_with_time(system).values() for node in nodes]
    waves = [n for n in postorder(drives) if n.op in ("sin", "cos") and _TIME in leaves([n], "symbol")]
    rates = [derivative(wave.args[0], _TIME) for wave in waves]
    try:
        paces = [abs(x) for x in evaluate_float(rates, parameters)] if rates else []
    except (ExpressionError, *UNDEFINED):
        return None
    same = paces and max(paces) - min(paces) <= _SAME * max(paces)
    return 2 * math.pi / paces[0] if same and paces[0] else None


def time_note(system: System, flow: DeviationFlow, begin: Start) -> str | None:
    """Return the note on a state that would not stay as it is, because time moves something."""
    named = named_with_time(system)
    if not named:
        return None
    states = []
    for t in (0.0, *_LATER):
        known = flow.known_at(begin.q, begin.u, t)
        states.append(np.concatenate([flow.rates(known)[1], np.ravel(flow.derivatives(known)[0])]))
    at_first, *later = states
    size = max(1.0, float(np.abs(at_first).max(initial=0.0)))
    if all(np.abs(x - at_first).max(initial=0.0) <= _SAME * size for x in later):
        return None
    names = " and ".join(named)
    return (
        f"{names} {'depends' if len(named) == 1 else 'depend'} on t, and small motions are those of the model as it is "
        "at t = 0; free oscillations are those of the model without it, and simulate follows time"
    )


def friction_notes(flow: DeviationFlow) -> list[str]:
    """Return the notes on friction that acts in the mode of the start, by sliding and sticking elements."""
    mechanism = flow.mechanism
    if mechanism.mode is None:
        return []
    words = mode_words(mechanism.one_way, mechanism.mode)
    parts = dict.fromkeys(name for x in mechanism.one_way for name in (x.name, *(part.name for part in x.frictions)))
    sliding = [name for name in parts if words.get(name, "").startswith(("slide", "slip"))]
    sticking = [name for name in parts if words.get(name, "") in ("stick", "grip")]
    notes = []
    if sliding:
        notes.append(
            f"{', '.join(sliding)}: friction is taken as it pushes while this slides as it does at the start; where it "
            "turns back friction does too, about another place of rest, and the motion ends (simulate)"
        )
    if sticking:
        notes.append(f"{', '.join(sticking)}: it sticks, and small motions are those while it does")
    return notes


# --- small motions ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class SmallMotion:
    """Small motions about a `place`; `mechanism` and `state` for formulas, `matrices` without the `held` coordinates.

    Where there are no formulas `matrices` is None; `reasons` say why, of other missing formulas too. `left_out` are
    notes on parts of the model that do not act in them.
    """

    place: SteadyState
    mechanism: Mechanism
    state: SymbolicState | None
    matrices: Matrices | None
    held: tuple[int, ...]
    reasons: dict[str, None] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()

    @classmethod
    def of(cls, system: System, formalism: str | None = None, at: At = None) -> SmallMotion:
        """Return the small motions of a system. Raises InputError and NoSolutionError."""
        place = place_of(system, formalism, at)
        flow, begin = place.flow, place.begin
        if not place.linear.states:
            raise NoSolutionError("nothing is free to move: there are no small motions", number="N111")
        formal, _ = fix_directions(flow.mechanism, begin.q, begin.u, begin.parameters)
        size = len(formal.speeds)
        tangents = flow.tangents(np.array(begin.q, dtype=float), np.array(begin.u, dtype=float))
        places = [k - size for k in tangents.places if k >= size]
        reasons: dict[str, None] = {}
        state, found = None, None
        held: tuple[int, ...] = ()
        try:
            state = formulas_of(formal, begin, found=place.found or at is not None, places=places)
            found, held = with_momenta_held(matrices(formal, state, places))
        except NoClosedFormError as reason:
            reasons[str(reason)] = None
        except ExpressionError as reason:
            reasons[reason.message] = None
        time = time_note(system, flow, begin)
        left_out = (*([] if time is None else [time]), *friction_notes(flow))
        return cls(place, formal, state, found, held, reasons, left_out)

    # --- formulas -------------------------------------------------------------------------------------------------

    @cached_property
    def formulas(self) -> Formulas:
        """The maker of values over the field of the matrices."""
        assert self.matrices is not None
        return Formulas(self.matrices, self.reasons)

    @cached_property
    def spectrum(self) -> Spectrum | None:
        """The roots of the characteristic polynomial, None where they are not the eigenvalues."""
        given = self.matrices
        if given is None or not given.places:
            return None
        try:
            found = spectrum(given)
        except NoClosedFormError as reason:
            self.reasons[str(reason)] = None
            return None
        values = self.place.linear.eigenvalues
        if given.is_damped:  # those without dampers
            M, G, K = self._in_floats
            size, inverse = len(M), np.linalg.inv(M)
            A = np.block([[np.zeros((size, size)), np.eye(size)], [-inverse @ K, -inverse @ G]])
            values = np.linalg.eigvals(A)
        squares = [complex(root.value) for root in found.roots if not _rests(root, found)]
        known = [-(complex(x) * complex(x)) for x in values]
        largest = max((abs(x) for x in squares), default=0.0)
        missed = [(min((abs(x - y) for y in known), default=math.inf), abs(x)) for x in squares]
        if any(not miss <= _AGREEMENT * own + _ROUNDED * largest for miss, own in missed):
            self.reasons["formulas and eigenvalues are not the same at the declared parameters"] = None
            return None
        return found

    @property
    def _in_floats(self) -> tuple[Floats, Floats, Floats]:
        given = self.matrices
        assert given is not None
        matrices = (given.mass, given.gyroscopic, given.stiffness)
        M, G, K = (np.array([[float(x.sample) for x in row] for row in a]) for a in matrices)
        return M, G, K

    @cached_property
    def swinging(self) -> tuple[Root, ...]:
        """omega^2 of the modes that oscillate, from the smallest on, repeated ones as often as they are."""
        return self._modes_and_squares[1]

    @cached_property
    def modes(self) -> tuple[Mode, ...]:
        """The modes, those that oscillate first."""
        return self._modes_and_squares[0]

    @cached_property
    def _modes_and_squares(self) -> tuple[tuple[Mode, ...], tuple[Root, ...]]:
        given = self.matrices
        if given is not None and len(given.places) == 1 and given.is_damped:
            found, roots = damped_modes(given, self.formulas, self.names[0])
            return tuple(found), tuple(roots)
        if self.spectrum is None:
            return modes_in_numbers(self.place.linear, deviation_names(self.mechanism)), ()
        pairs = [(root, mode) for root in self.spectrum.roots for mode in self._modes(root)]
        order = {"oscillates": 0, "free": 1, "grows": 2, "decays": 3}
        pairs.sort(key=lambda pair: order[pair[1].motion])
        return tuple(mode for _, mode in pairs), tuple(root for root, mode in pairs if mode.motion == "oscillates")

    def _modes(self, root: Root) -> list[Mode]:
        vectors = shapes_in_numbers(*self._in_floats, complex(root.value), root.times)
        return [self._mode(root, *self._shape(root, v)) for v in vectors]

    def _mode(self, root: Root, shape: dict[str, Value], quarter: dict[str, Value]) -> Mode:
        assert self.spectrum is not None
        value = complex(root.value)
        if _rests(root, self.spectrum):
            return Mode("free", shape=shape, quarter=quarter)
        if value.imag:
            rate = complex(np.sqrt(-value))
            swings = Value(abs(rate.imag), None, "rad/s"), Value(2 * np.pi / abs(rate.imag), None, "s")
            return Mode("grows", *swings, Value(abs(rate.real), None, "1/s"), shape, quarter)
        if value.real > 0.0:
            return Mode("oscillates", self.formulas.frequency(root), self.formulas.period(root), None, shape, quarter)
        return Mode("grows", rate=self.formulas.rate(root), shape=shape, quarter=quarter)

    def _shape(self, root: Root, v: Vector) -> tuple[dict[str, Value], dict[str, Value]]:
        given = self.matrices
        assert given is not None
        exactly = not given.is_gyroscopic
        real = self.formulas.shape(root, [float(x.real) for x in v], exactly=exactly)
        quarter = dict(zip(self.names, (Value(float(x.imag)) for x in v), strict=True)) if any(v.imag) else {}
        return dict(zip(self.names, real, strict=True)), quarter

    @property
    def names(self) -> list[str]:
        """The names of the independent deviations."""
        names = deviation_names(self.mechanism)
        return [] if self.matrices is None else [names[k] for k in self.matrices.places]

    # --- stability ------------------------------------------------------------------------------------------------

    @property
    def stable(self) -> bool | None:
        """Whether small motions stay small; None where some move off uniformly."""
        rates = [x.real for x in self.place.linear.eigenvalues]
        motions = {mode.motion for mode in self.modes}
        if "grows" in motions or (self.matrices is None and max(rates, default=0.0) > 0.0):
            return False
        return None if "free" in motions else True

    def conditions(self) -> list[str]:
        """Return the conditions under which motions stay small, or grow where they do, without redundant ones."""
        if self.spectrum is None or self.matrices is None:
            return []
        field = self.matrices.field
        field.work = max(field.work, _WORK_OF_CONDITIONS)
        signs = self.spectrum.signs
        broken = [replace(each, value=-each.value) for each in signs if each.value.sample < 0]
        broken = broken[-1:] if self.matrices.is_gyroscopic else broken  # any of them is enough
        used = [x for a in (self.matrices.mass, self.matrices.rates, self.matrices.stiffness) for row in a for x in row]
        said = [*(broken or signs), *([] if self.matrices.is_gyroscopic else self._written_for()), *under_roots(used)]
        try:
            return [str(each) for each in reduced(said)]
        except NoClosedFormError:
            self.reasons["a condition is too long"] = None
            return []

    def _written_for(self) -> list[Condition]:
        """Return the choices of signs on which formulas rest."""
        return [] if self.matrices is None else [Condition(x, strict=True) for x in self.matrices.field.positive]

    def as_modes(self) -> Modes:
        """Return the record of the small motions."""
        given, place = self.matrices, self.place
        conditions = self.conditions()
        names = self.names or [name for name in deviation_names(self.mechanism) if name in place.linear.states]
        return Modes(
            name=self.mechanism.name,
            coordinates=tuple(names),
            about=place.kind,
            at=state_values(self.mechanism, place.begin, self.state),
            found=place.found,
            mass=self._values(None if given is None else given.mass),
            rates=self._values(None if given is None else given.rates),
            stiffness=self._values(None if given is None else given.stiffness),
            modes=tuple(self._with_shared_roots()),
            stable=self.stable,
            conditions=tuple(dict.fromkeys(conditions)),
            held=tuple(deviation_names(self.mechanism)[k] for k in self.held),
            characteristic="" if self.spectrum is None else polynomial_text(self.spectrum),
            notes=tuple(self._notes()),
            eigenvalues=tuple(complex(x) for x in place.linear.eigenvalues),
            eigenvalue_errors=tuple(float(x) for x in place.linear.eigenvalue_errors),
        )

    def _with_shared_roots(self) -> list[Mode]:
        """Return the modes with one form of each root in their frequencies, periods and rates."""
        if self.matrices is None:
            return list(self.modes)
        letters = {x.node: x for x in self.matrices.field.letters if x.node is not None}
        values = [x for mode in self.modes for x in (mode.frequency, mode.period, mode.rate) if x is not None]
        shared = dict(zip(values, values_with_shared_roots(values, letters), strict=True))

        def of(value: Value | None) -> Value | None:
            return None if value is None else shared[value]

        return [
            replace(mode, frequency=of(mode.frequency), period=of(mode.period), rate=of(mode.rate))
            for mode in self.modes
        ]

    def _values(self, matrix: Matrix | None) -> Rows:
        return () if matrix is None else tuple(tuple(self.formulas.value(x) for x in row) for row in matrix)

    def _notes(self) -> Sequence[str]:
        notes = [*self.left_out]
        if self.matrices is not None and self.matrices.is_damped and len(self.matrices.places) > 1:
            notes.append(_DAMPED)
        if self.matrices is not None and not self.matrices.balanced:
            notes.append("nothing is accelerated here for the declared parameters; formulas hold where that is so")
        if self.matrices is not None and self.matrices.is_gyroscopic and (chosen := reduced(self._written_for())):
            notes.append(f"formulas are written for {' and '.join(map(str, chosen))}")
        if self.place.stopped:
            turning = any(body.quaternions for body in self.mechanism.bodies)
            notes.append(_STOPPED + (_IN_ANGLES if turning else ""))
        return [*notes, *(f"numbers only, where no formula is given: {reason}" for reason in self.reasons)]


def _rests(root: Root, found: Spectrum) -> bool:
    """Return whether omega^2 is zero."""
    size = max(abs(complex(each.value)) for each in found.roots)
    return (root.quotient is not None and root.quotient.is_zero) or abs(complex(root.value)) <= _REST * size
