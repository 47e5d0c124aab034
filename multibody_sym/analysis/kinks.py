"""Where A has two values: kinks and jumps of forces and outputs, and elements that may act or let go.

In: the flow of deviations and a state. Out: an error that names the force, output or element.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.analysis.deviations import DeviationFlow, displaced
from multibody_sym.analysis.positions import Positions
from multibody_sym.dynamics.closing import ConstraintRows
from multibody_sym.dynamics.contact.contact_problem import OneWayRows, one_way_rows
from multibody_sym.dynamics.programs.reactions import LawForces
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.mechanics.law_elements import LawElement, Limit
from multibody_sym.mechanics.load_records import Load
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.row_records import Row
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, UNDEFINED, Floats

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
    for element, why in _Limits(flow, q, u, inputs).passed() if flow.mechanism.mode is not None else ():
        message = f"{element.name} {why} in this state, unlike at the start; give the start another state (initial: ..)"
        raise NoSolutionError(message, where=Where(path=element.path), number="N111")


def verify_no_limit(flow: DeviationFlow, q: Floats, u: Floats) -> None:
    """Raise NoSolutionError where an element is about to act or to let go, to stick or to slip.

    What begins to slip from rest does slip.
    """
    for element, why in _Limits(flow, q, u).reached() if flow.mechanism.mode is not None else ():
        message = f"A has two values in this state: {element.name} {why}; choose one beside it"
        raise NoSolutionError(message, where=Where(path=element.path), number="N111")


def verify_one_valued(flow: DeviationFlow, q: Floats, u: Floats) -> None:
    """Raise NoSolutionError where slopes of forces or outputs are others on two sides of a state, in its mode."""
    for kink in _kinks(flow, q, u):
        states = [c.name for c in flow.mechanism.coordinates if c.rate is not None]
        for name, jumps in zip(states, kink.jumps(flow, _state_rates), strict=True):
            if jumps.any():
                raise _at_kink("A", name, ("states", name))
        if kink.jumps(flow, _motion).any():
            load = next((x for x in flow.mechanism.loads if not kink.jumps(_without(flow, x), _motion).any()), None)
            raise _at_kink("A", *(("a force or an input", ()) if load is None else (load.name, load.path)))
        for name, jumps in zip(flow.mechanism.outputs, kink.jumps(flow, _outputs), strict=True):
            if jumps.any():
                raise _at_kink("C", name, ("outputs", name))


def _at_kink(matrix: str, name: str, path: tuple[str, ...]) -> NoSolutionError:
    message = f"{matrix} has two values in this state: {name} has a kink or a jump there; choose one beside it"
    return NoSolutionError(message, where=Where(path=path), number="N111")


def _without(flow: DeviationFlow, load: Load) -> DeviationFlow:
    loads = tuple(x for x in flow.mechanism.loads if x.name != load.name)
    return replace(flow, mechanism=replace(flow.mechanism, loads=loads))


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

    def passed(self) -> Iterator[tuple[LawElement, str]]:
        """Yield the elements that are past a limit of their mode, and past which."""
        for limit in self._forces.mode_limits:
            if self._is_passed(limit):
                yield limit.element, _PASSED[limit.kind]

    def _is_passed(self, limit: Limit) -> bool:
        element, part = limit.element, limit.part
        if limit.kind == "gap":
            return self._rows.standing(element) == "inside"
        if limit.kind == "slip":
            assert part is not None
            if len(part.rows) > 1:  # along its velocity, wherever that goes
                return False
            return bool(self._forces.forward(part, self._rows.phidot) < -self._rows.allowed_speed(part.rows[0]))
        return self._acts(limit) and self._forces.value(limit, self._rows.phidot) < -self._allowed(limit)

    def reached(self) -> Iterator[tuple[LawElement, str]]:
        """Yield the elements that are at a limit of their mode, and at which."""
        for limit in self._forces.mode_limits:
            if self._is_reached(limit):
                yield limit.element, _WHY[limit.kind]

    def _is_reached(self, limit: Limit) -> bool:
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
