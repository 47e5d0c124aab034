"""The state that a question is about: the start, the position of rest beside it, or a state with other values.

In: a start, and a place by word or by values. Out: a Start; or the error that says why there is none, or why A has two
values there.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from itertools import islice
from math import isfinite
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from multibody_sym.analysis.deviations import DeviationFlow, displaced
from multibody_sym.analysis.equilibrium_search import MOST, SECONDS, guesses, keeps_mode, search_from
from multibody_sym.analysis.positions import Positions
from multibody_sym.dynamics.closing import ConstraintRows, closed_near
from multibody_sym.dynamics.contact.contact_problem import OneWayRows, one_way_rows
from multibody_sym.dynamics.programs.reactions import LawForces
from multibody_sym.dynamics.start.parameters import value_or_none
from multibody_sym.dynamics.start.start import NotClosedError, Start, start_beside
from multibody_sym.errors import ArgumentError, ModelError, NoSolutionError, Where, at, short_repr
from multibody_sym.mechanics.absolute import unknown_coordinate
from multibody_sym.mechanics.changes import start_value
from multibody_sym.mechanics.law_elements import Limit
from multibody_sym.mechanics.mechanism import Coordinate, Mechanism, Speed
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.row_records import Row
from multibody_sym.model.argument_checks import state_by_name
from multibody_sym.model.fields import is_text
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, UNDEFINED, Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node, symbol

REST: Final = "equilibrium"
_POSITIONS: Final = 4
_ALIKE: Final = 1e-9
_MOST_NAMED: Final = 4


def no_equilibrium_error(
    flow: DeviationFlow, rows: ConstraintRows, guesses: Iterable[Floats], *, in_time: bool, one_way: str = ""
) -> NoSolutionError:
    """Return the error for a search that found nothing from guesses (nq): the start, and others with open rows.

    Where all positions accelerate alike it says so, else that there may be others. `one_way`: words on such elements.
    """
    start, *others = islice(guesses, 2 * _POSITIONS)
    rest, found = np.zeros(len(flow.mechanism.speeds)), list[Floats]()
    for guess in (start, *others):
        try:
            q = closed_near(rows, guess) if len(found) < _POSITIONS else None
            if q is not None:
                found.append(flow.unbalanced(q, rest))
        except (*UNDEFINED, np.linalg.LinAlgError):
            continue
    size = max((float(np.abs(x).max(initial=0.0)) for x in found), default=0.0)
    if size > 0.0 and len(found) == _POSITIONS and all((np.abs(x - found[0]) <= _ALIKE * size).all() for x in found):
        pairs = zip(flow.mechanism.rate_units.items(), found[0].tolist(), strict=True)
        moving = [f"{name}' = {x:.6g} {unit}".rstrip() for (name, unit), x in pairs if abs(x) > _ALIKE * size]
        named = ", ".join([*moving[:_MOST_NAMED], *(["..."] if len(moving) > _MOST_NAMED else [])])
        alike = f"in {len(found)} positions the system at rest accelerates alike ({named})"
        return NoSolutionError(f"no position of equilibrium was found: {alike}{one_way}", number="N109")
    inputs = zip(flow.mechanism.inputs, np.ravel(flow.known(start, rest)[4]).tolist(), strict=True)
    acting = ", ".join(f"{name} = {x:.6g}" for name, x in inputs if x)
    where = "near the start" + " in the time of a search" * in_time
    where += f" under {acting}, as at t = 0" if acting else ""
    return NoSolutionError(
        f"no position of equilibrium was found {where}{one_way}; give other initial coordinates", number="N109"
    )


def tried_sets_text(mechanism: Mechanism, sets: tuple[int, int], *, in_time: bool) -> str:
    """Return how many `sets` of unilateral elements were tried closed, of how many, and which friction is left out.

    `in_time`: whether the time of a search ended before it had looked everywhere.
    """
    names, (count, every) = _unilateral_names(mechanism), sets
    either = f", and none with {names} closed either" if names else ""
    either += ", each for a part of that time" if in_time and every > 1 else ""
    if count < every:
        either = f"; of {every} sets of {names} that may be closed {count} {'were' if count > 1 else 'was'} tried"
    rubbing = friction_left_out(mechanism)
    rub = f"; friction ({', '.join(rubbing[:_MOST_NAMED])}) is left out: equilibrium --vary NAME tells what it holds"
    return either + (rub if rubbing else "")


def friction_left_out(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the declared elements whose friction is left out; what rolls goes on rolling."""
    rubbing = (x for x in mechanism.one_way if x.frictions and x.path[0] != "constraints")
    return tuple(dict.fromkeys(x.path[-1] for x in rubbing))


def _unilateral_names(mechanism: Mechanism) -> str:
    names = [x.name for x in mechanism.one_way if x.unilateral]
    return ", ".join(names[:_MOST_NAMED]) + (", .." if len(names) > _MOST_NAMED else "")


def begin_at(system: System, resolved: Mechanism, begin: Start, place: Any, formalism: str | None) -> Start:
    """Return the state at a `place` beside a start: None, the word "equilibrium", or values by name.

    `place` may be a run's `final` too. Named coordinates and speeds have these values, and constraints are closed
    around them. Parameters, and lengths of ropes, stay those of the start. Raises InputError with `at` in its path,
    NoSolutionError.
    """
    if place is None:
        return begin
    with at("at"):
        if is_text(place, REST):
            q = zip((c.name for c in resolved.coordinates), _rest_beside(resolved, begin, formalism), strict=True)
            return start_beside(resolved, begin, {**dict(q), **{speed.name: 0.0 for speed in resolved.speeds}})
        if not isinstance(place, Mapping) or not all(isinstance(name, str) for name in place):
            wanted = f"the word {REST} or values by name, such as {{'phi': 0}}"
            raise ArgumentError(f"at is to be {wanted}, got {short_repr(place)}")
        # expressions of parameters, or text with units; of a quaternion all or none
        declared: list[Coordinate | Speed] = [*resolved.coordinates, *resolved.speeds]
        units = {each.name: each.unit for each in declared}
        values = {}
        for name, value in state_by_name("at", place).items():
            with at(name):
                if name not in units:
                    raise unknown_coordinate(name, system, units)
                node = start_value(value, units[name])
                if node is None:
                    raise ModelError("it needs a value; what is not named keeps that of the start", number="M119")
                values[name] = number_asked(node, resolved, begin)
        for places in (places for body in resolved.bodies for places in body.quaternions):
            names = [resolved.coordinates[k].name for k in places]
            given = [name for name in names if name in values]
            if given and len(given) < len(names):
                raise ModelError(f"{', '.join(names)} are one quaternion: give all four or none", number="M110").under(
                    given[0]
                )
        try:
            return start_beside(resolved, begin, values)
        except NotClosedError as error:
            what = ".".join(error.where.path) or "the constraints"
            advice = "name fewer, or give others"
            raise NoSolutionError(f"no state with these values satisfies {what}; {advice}", number="N111") from error


@contextmanager
def errors_at(place: Any) -> Iterator[None]:
    """Let errors say that there is no solution at a given `place`; without a place they are of the start."""
    try:
        yield
    except NoSolutionError as error:
        if place is not None:
            error.where = Where(path=("at",))
        raise


def _rest_beside(resolved: Mechanism, begin: Start, formalism: str | None) -> list[float]:
    """Return the position of equilibrium that is found first from a start. Raises NoSolutionError."""
    until, search = time.process_time() + SECONDS, search_from(resolved, begin, formalism)
    found = next((q for q in search.reached_in_time(until, MOST, falls=True) if keeps_mode(search, q)), None)
    if found is None:
        late, names = time.process_time() > until, _unilateral_names(resolved)
        states = f", with {names} closed or open as at the start (equilibrium tells where else it rests)"
        again = guesses(search.places, search.places.start)
        raise no_equilibrium_error(search.flow, search.rows, again, in_time=late, one_way=states if names else "")
    return [float(x) for x in found]


def number_asked(node: Node, resolved: Mechanism, begin: Start) -> float:
    """Return the finite value of an expression of parameters, which are those of the start. Raises ModelError."""
    entries = zip(resolved.parameters, begin.parameters, strict=True)
    known = {symbol(entry.name): x for entry, x in entries if entry.value is not None}
    for leaf in leaves([node], "symbol", "declared"):
        if leaf not in known:
            raise ModelError(f"{leaf} is no parameter; here an expression names parameters only", number="M106")
    number = value_or_none(node, known)
    if number is None or not isfinite(number):
        raise ModelError("the expression has no finite value", number="M119")
    return number


# ----------------------------------------------------------------------------------------------------------------------
# Where A has two values: kinks and jumps of forces and outputs, and elements that may act or let go.
#
# In: the flow of deviations and a state. Out: an error that names the force, output or element.


_AT: Final = 1e-9
"""How near a kink a state counts as being at it, in steps of the model's size, 1 rad, and the like a second."""
_STEPS: Final = (1e-4, 1e-5)
"""Such steps to both sides: between them what is continuous changes ten times less."""
_STAYS: Final = 0.5
_ROUNDED: Final = 1e-9
"""The part of slopes and forces that is rounding."""
_NOTHING: Final = 1e-12
"""The same part of the largest."""
_WHY: Final = {
    "force": "neither presses nor lets go",
    "gap": "touches without force",
    "side": "presses on neither side",
    "cone": "is about to slip",
    "slip": "is about to stick or to slip",
}

_PASSED: Final = {
    "force": "would have to hold the other way",
    "gap": "is inside what it touches",
    "side": "presses on the other side",
    "cone": "would slip",
    "slip": "slips the other way",
}


def verify_keeps_mode(flow: DeviationFlow, q: Floats, u: Floats, inputs: Floats | None = None) -> None:
    """Raise NoSolutionError where an element is past a limit of the mode of the start, under declared or given inputs.

    A rope would push, friction exceed its limit or point along the slip.
    """
    here = _Limits(flow, q, u, inputs)
    for limit in filter(here.is_passed, here.of_mode):
        does = f"{limit.element.name} {_PASSED[limit.kind]} in this state, unlike at the start"
        message = f"{does}; give the start another state (initial: ..)"
        raise NoSolutionError(message, where=Where(path=limit.element.path), number="N111")


def verify_no_limit(flow: DeviationFlow, q: Floats, u: Floats) -> None:
    """Raise NoSolutionError where an element is about to act or to let go, to stick or to slip.

    What begins to slip from rest does slip.
    """
    here = _Limits(flow, q, u)
    for limit in filter(here.is_reached, here.of_mode):
        does = f"{limit.element.name} {_WHY[limit.kind]}"
        message = f"A has two values in this state: {does}; choose one beside it"
        raise NoSolutionError(message, where=Where(path=limit.element.path), number="N111")


def verify_one_valued(flow: DeviationFlow, q: Floats, u: Floats) -> None:
    """Raise NoSolutionError where slopes of forces or outputs are others on two sides of a state, in its mode."""
    for kink in _kinks(flow, q, u):
        states = [c.name for c in flow.mechanism.coordinates if c.rate is not None]
        for name, jumps in zip(states, kink.jumps(flow, _state_rates), strict=True):
            if jumps.any():
                raise _at_kink("A", name, ("states", name))
        if kink.jumps(flow, _motion).any():
            load = next((x for x in flow.mechanism.loads if not kink.jumps(flow.without(x), _motion).any()), None)
            raise _at_kink("A", *(("a force or an input", ()) if load is None else (load.name, load.path)))
        for name, jumps in zip(flow.mechanism.outputs, kink.jumps(flow, _outputs), strict=True):
            if jumps.any():
                raise _at_kink("C", name, ("outputs", name))


def _at_kink(matrix: str, name: str, path: tuple[str, ...]) -> NoSolutionError:
    message = f"{matrix} has two values in this state: {name} has a kink or a jump there; choose one beside it"
    return NoSolutionError(message, where=Where(path=path), number="N111")


# --- kinks of expressions: of abs, sign, min, max, where and tables ---------------------------------------------------

Known = Sequence[npt.ArrayLike]


def _motion(flow: DeviationFlow, known: Known) -> Floats:
    """Return the slopes and rates of a motion in a row."""
    return np.concatenate([*map(np.ravel, (*flow.derivatives(known), *flow.restrictions(known))), *flow.rates(known)])


def _state_rates(flow: DeviationFlow, known: Known) -> Floats:
    """Return the slopes and the value of the rate of each declared state in a row of its own."""
    size, count = 2 * len(flow.mechanism.speeds), len(flow.mechanism.rates)
    by_state, by_input = flow.derivatives(known)
    values = flow.rates(known)[0]
    return np.column_stack([by_state[size:], by_input[size:], values[len(values) - count :]])


def _outputs(flow: DeviationFlow, known: Known) -> Floats:
    """Return the slopes and the value of each output in a row of its own."""
    return np.column_stack([*flow.output_slopes(known), flow.outputs(known)])


@dataclass(frozen=True, eq=False)
class _Kink:
    """A kink at or beside a state (q, u): steps dz and dw lead across it, and `beside` of them to it."""

    q: Floats
    u: Floats
    dz: Floats
    dw: Floats
    beside: float

    def jumps(self, flow: DeviationFlow, values: Callable[[DeviationFlow, Known], Floats]) -> npt.NDArray[np.bool_]:
        """Return which values are others on its two sides, however near to it; those that are undefined are not."""
        found = []
        for step in _STEPS:
            sides = [self._beside(flow, values, self.beside + x) for x in (step, -step)]
            with np.errstate(invalid="ignore"):
                found.append((np.abs(sides[0] - sides[1]), np.abs(sides).max(axis=0)))
        (far, _), (near, sizes) = found
        rounded = np.maximum(_ROUNDED * sizes, _NOTHING * sizes.max(initial=0.0))
        jumping: npt.NDArray[np.bool_] = (near > _STAYS * far) & (near > rounded)
        return jumping

    def _beside(
        self, flow: DeviationFlow, values: Callable[[DeviationFlow, Known], Floats], step: float
    ) -> Floats:
        """Return values so many steps from the state, no numbers where they are not defined."""
        size = len(self.u)
        sigma = np.concatenate([self.dz[:size], self.dz[2 * size :]])
        q = displaced(flow.mechanism, self.q, step * sigma)
        *known, inputs, modes = flow.known(q, self.u + step * self.dz[size : 2 * size])
        try:
            return values(flow, (*known, np.asarray(inputs, dtype=float) + step * self.dw, modes))
        except UNDEFINED:
            return np.full_like(values(flow, flow.known(self.q, self.u)), np.nan)


def _kinks(flow: DeviationFlow, q: Floats, u: Floats) -> Iterator[_Kink]:
    """Yield the kinks at a state, each with the way that leads across it."""
    known, tangents, count = flow.known(q, u), flow.tangents(q, u), len(flow.mechanism.rows)
    values, by_state, by_input = flow.bends(known)
    if not len(values):
        return
    units = Positions(flow, ConstraintRows(flow.mechanism, flow.parameters, range(count)), q).sizes
    least = np.where(np.arange(len(units)) < len(u), _AT, EPSILON)
    units = np.where(units > least, units, 1.0)  # of a model at the origin sizes are rounding
    sizes, inputs = np.concatenate([units[: len(u)], units]), np.maximum(1.0, np.abs(np.asarray(known[4], dtype=float)))
    for value, slope, of_input in zip(values.tolist(), by_state, by_input, strict=True):
        dz = tangents.X @ (sizes[tangents.places] ** 2 * (slope @ tangents.X))
        dw = inputs**2 * of_input
        size = float(np.abs(np.concatenate([dz / sizes, dw / inputs])).max(initial=0.0))
        rate = float(slope @ dz + of_input @ dw) / size if size else 0.0
        if rate and abs(value) <= _AT * rate:
            yield _Kink(q, u, dz / size, dw / size, -value / rate)


# --- limits of one-way elements ---------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Limits:
    """The one-way elements of a mechanism in its mode at a state (q, u)."""

    flow: DeviationFlow
    q: Floats
    u: Floats
    inputs: Floats | None = None

    @property
    def of_mode(self) -> Iterable[Limit]:
        """The limits of the mode."""
        return () if self.flow.mechanism.mode is None else self._forces.mode_limits

    def is_passed(self, limit: Limit) -> bool:
        """Return whether a limit of the mode is passed."""
        element, part = limit.element, limit.part
        if limit.kind == "gap":
            return self._rows.standing(element) == "inside"
        if limit.kind == "slip":
            assert part is not None
            if len(part.rows) > 1:  # along its velocity, wherever that goes
                return False
            return bool(self._forces.forward(part, self._rows.phidot) < -self._rows.allowed_speed(part.rows[0]))
        return self._acts(limit) and self._forces.value(limit, self._rows.phidot) < -self._allowed(limit)

    def is_reached(self, limit: Limit) -> bool:
        """Return whether a limit is neither kept nor passed: of motion where accelerations keep to it, too."""
        element, part, forces = limit.element, limit.part, self._forces
        if limit.kind in ("gap", "slip"):
            if element.name in forces.mode.idle or (part is not None and len(part.rows) > 1):
                return False
            row = element.normals[0] if part is None else part.rows[0]
            slow = abs(self._rows.phidot(row)) <= self._rows.allowed_speed(row)
            stands = slow if part is not None else self._rows.standing(element) == "touching"
            return stands and abs(self._acceleration(row)) <= _ROUNDED * self._accelerating / self._length(row)
        return self._acts(limit) and bool(abs(forces.value(limit, self._rows.phidot)) <= self._allowed(limit))

    def _acts(self, limit: Limit) -> bool:
        """Return whether forces depend on a limit of forces: on the side of a reaction alone where something slides."""
        name = limit.element.normals[limit.normal].name
        return limit.kind != "side" or any(x.sliding for x in self._forces.mechanism.rows if x.name == name)

    def _allowed(self, limit: Limit) -> float:
        """Return the part of a force that is rounding."""
        normal = limit.element.normals[limit.normal]
        allowed = _ROUNDED * self._mass * self._accelerating * self._length(normal)
        return allowed if limit.part is None else allowed + _ROUNDED * abs(self._forces.most(limit.element, limit.part))

    def _length(self, row: Row) -> float:
        """Return the length by which moments are forces and angles ways, 1 where they are."""
        return self._rows.scale.length if row.unit == "N*m" else 1.0

    def _acceleration(self, row: Row) -> float:
        """Return the acceleration along a row."""
        moved = self._forces.row(row)
        return float(np.array(moved.jacobian, dtype=float) @ self.flow.accelerations(self.q, self.u) - moved.gamma)

    @cached_property
    def _forces(self) -> LawForces:
        mechanism = self.flow.mechanism
        state = state_of(mechanism, float, 0.0, self.q.tolist(), self.u.tolist(), self.flow.parameters)
        return LawForces(motion_of(mechanism, state), self.flow.multipliers(self.q, self.u, self.inputs).tolist())

    @cached_property
    def _rows(self) -> OneWayRows:
        return one_way_rows(self.flow.mechanism, self._forces.motion)

    @cached_property
    def _mass(self) -> float:
        return sum(float(x.mass) for x in self._forces.motion.masses)

    @cached_property
    def _accelerating(self) -> float:
        """The acceleration (m/s^2) of weight, or that with which bodies become as fast as they are."""
        scale = self._rows.scale
        weight = float(np.linalg.norm(np.array(self._forces.motion.gravity, dtype=float)))
        return max(weight, scale.speed**2 / scale.length)
