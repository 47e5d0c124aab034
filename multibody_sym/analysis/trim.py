"""Trim: the values of inputs that hold a system in a state that is given in part, so that no speed changes.

In: a System, coordinates and speeds by name and inputs whose values are unknown. Out: a Trim. Accelerations and the
rows of constraints are zero; Newton's method on all unknowns together, with exact derivatives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from typing import Any, Final

import numpy as np

from multibody_sym.analysis.deviations import DeviationFlow, coordinate_bounds, deviation_names, displaced
from multibody_sym.analysis.linearize import flow_at, place_of
from multibody_sym.analysis.state_asked_about import errors_at
from multibody_sym.dynamics.start.number_checks import on_numbers
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.model.argument_checks import names as listed_names
from multibody_sym.model.argument_checks import state_by_name
from multibody_sym.model.system import System, verify_system
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.rank import ROUNDED, least_squares

_PASSES: Final = 100
_LARGEST: Final = 0.3
"""No angle moves by more (rad) in a step, so that the position found is one near the start."""
_SMALL: Final = 1e-12
"""The part of the terms of the equations that is left of them where Newton's method has ended."""
_AT_LIMIT: Final = 1e-9
"""How near (m, rad) a limit a coordinate stands at it."""


@dataclass(frozen=True)
class Trim:
    """The `state`, in which no speed changes, and the `inputs` that hold it, in SI units.

    `linearize(system, at=trim.state, inputs=trim.inputs)` is about this state.
    """

    state: Mapping[str, float]
    inputs: Mapping[str, float]

    def as_json(self) -> dict[str, Any]:
        """Return the same as a JSON object."""
        return {"state": dict(self.state), "inputs": dict(self.inputs)}


def trim(
    system: System,
    at: Mapping[str, Any] | None = None,
    *,
    unknown: Sequence[str] | str = (),
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
) -> Trim:
    """Return the inputs with which no speed changes where the coordinates and speeds named in `at` have these values.

    `unknown` inputs are found, all if none are named; others are as declared at t = 0. Coordinates that `at` does not
    name are found as well, near the start and within the limits of joints; other speeds are zero, or follow from
    constraints. Of more unknowns than equations those of the shortest steps from the start and from zero.
    `parameters` .. `inputs`: what the call changes of the system. Friction has the mode of the start.
    Raises InputError for unknown names, NoSolutionError where nothing holds it.
    """
    verify_system(system)
    names = listed_names("unknown", unknown) or tuple(system.inputs)
    for name in names:
        place_of("input", name, tuple(system.inputs))
    changed = Overrides(parameters, initial, inputs).of(system)
    return _trim(Overrides(inputs=dict.fromkeys(names, 0)).of(changed), at, names)


@on_numbers
def _trim(system: System, at: Mapping[str, Any] | None, names: tuple[str, ...]) -> Trim:
    flow, begin = flow_at(system, None, at)
    mechanism, given = flow.mechanism, [] if at is None else list(state_by_name("at", at))
    held = {
        k
        for body in mechanism.bodies
        for free in body.free_steps
        for k in free.u
        if any(mechanism.coordinates[i].name in given for i in free.q)
    }
    count, bounds = len(mechanism.speeds), coordinate_bounds(mechanism, flow.parameters)
    states = [c.name for c in mechanism.coordinates if c.rate is not None]
    free = [k for k in range(count) if k not in held]
    free += [count + k for k, name in enumerate(states) if name not in given]
    q, asked = np.array(begin.q, dtype=float), [speed.name in given for speed in mechanism.speeds]
    with errors_at(at):
        _verify_within(mechanism, q, bounds, held)
        u = np.where(asked, begin.u, 0.0)
        following = flow.dependent_speeds(q, u, set(np.flatnonzero(asked).tolist()))
        q, u, w = _Search(flow, names, free, following, bounds).run(q, u)
    every = [*(c.name for c in mechanism.coordinates), *(s.name for s in mechanism.speeds)]
    return Trim(dict(zip(every, (*q.tolist(), *u.tolist()), strict=True)), dict(zip(names, w.tolist(), strict=True)))


def _verify_within(mechanism: Mechanism, q: Floats, bounds: Floats, held: Set[int]) -> None:
    """Raise NoSolutionError for a held coordinate past a limit of its joint."""
    for body in mechanism.bodies:
        for place, k in body.rate_pairs:
            low, high = bounds[:, k]
            if k in held and not low <= q[place] <= high:
                coordinate = mechanism.coordinates[place]
                limit = f"{low if q[place] < low else high:.6g} {coordinate.unit}".rstrip()
                message = f"{coordinate.name} = {q[place]:.6g} is past the limit of joint {coordinate.joint}, {limit}"
                raise NoSolutionError(message, number="N109")


@dataclass(frozen=True, eq=False)
class _Search:
    """Newton's method for accelerations and rates of states that are zero.

    The unknowns are deviations `free` of coordinates and, counted behind the speeds, of states, within `bounds` (2, nu)
    of coordinates; and inputs. The speeds `following` follow from the others by the rows.
    """

    flow: DeviationFlow
    names: tuple[str, ...]
    free: list[int]
    following: list[int]
    bounds: Floats

    def run(self, q: Floats, u: Floats) -> tuple[Floats, Floats, Floats]:
        """Return coordinates (nq), speeds and unknown inputs; raises NoSolutionError where none are found."""
        mechanism, places = self.flow.mechanism, [list(self.flow.mechanism.inputs).index(name) for name in self.names]
        count, values, small = len(mechanism.speeds), np.zeros(len(places)), False
        u = self._completed(q, u)
        missed, slopes = self._equations(q, u, values, places)
        values = least_squares(slopes[:, len(self.free) :], -missed, ROUNDED)  # the best inputs at the start
        for _ in range(_PASSES):
            missed, slopes = self._equations(q, u, values, places)
            size = float(np.abs(slopes).max(initial=0.0)) * max(1.0, np.abs(values).max(initial=0.0))
            step = _step_within(slopes, missed, self._room(q, len(values)))
            moved = ((k, x) for k, x in zip(self.free, step, strict=False) if k < count)
            turns = [abs(x) for k, x in moved if mechanism.speeds[k].unit == "rad/s"]
            step *= min(1.0, _LARGEST / max(turns, default=_LARGEST)) if any(turns) else 1.0
            sigma = np.zeros(count + len(mechanism.rates))
            sigma[self.free] = step[: len(self.free)]
            q, values = displaced(mechanism, q, sigma), values + step[len(self.free) :]
            u = self._completed(q, u)
            if small:  # one step more leaves rounding
                return q, u, values
            small = bool(np.abs(missed).max(initial=0.0) <= _SMALL * size)
        raise self._failed(q)

    def _failed(self, q: Floats) -> NoSolutionError:
        inputs = ", ".join(self.names) or "no input"
        room, count = self._room(q, 0), len(self.flow.mechanism.speeds)
        stand = [k for k, x in zip(self.free, np.abs(room).min(axis=0), strict=True) if x <= _AT_LIMIT]
        at_limit = [deviation_names(self.flow.mechanism)[k] for k in stand if k < count]
        within = f" within the limits of {', '.join(at_limit)}" if at_limit else ""
        return NoSolutionError(
            f"no values of {inputs} were found that hold the system there{within}; leave coordinates out of at, or "
            "name more inputs as unknown",
            where=Where(path=("at",)),
            number="N109",
        )

    def _room(self, q: Floats, inputs: int) -> Floats:
        """Return by how much the unknowns, the last of them inputs, may change down and up (2, ..)."""
        room = np.array([[-np.inf], [np.inf]]).repeat(len(self.bounds[0]) + len(self.flow.mechanism.rates), axis=1)
        for body in self.flow.mechanism.bodies:
            for place, k in body.rate_pairs:
                room[:, k] = self.bounds[:, k] - q[place]
        return np.hstack([room[:, self.free], np.array([[-np.inf], [np.inf]]).repeat(inputs, axis=1)])

    def _completed(self, q: Floats, u: Floats) -> Floats:
        """Return speeds with which the rows hold."""
        count = len(u)
        return self.flow.completed(q, u, 0.0, [count + k for k in range(count) if k not in self.following])

    def _equations(self, q: Floats, u: Floats, values: Floats, places: list[int]) -> tuple[Floats, Floats]:
        """Return accelerations, rates of states and phi, and their derivatives by the unknowns.

        Rates are divided by the largest of their derivatives: that of a pressure in Pa is 1e10 times others.
        """
        flow, count = self.flow, len(u)
        t, _, _, parameters, declared, modes = flow.known(q, u)
        inputs = np.array(declared, dtype=float)
        inputs[places] = values
        known = t, q, u, parameters, inputs, modes
        by_state, by_input = flow.derivatives(known)
        columns, following = [k if k < count else count + k for k in self.free], [count + k for k in self.following]
        of_positions, of_speeds = flow.restrictions(known)
        by_free = by_state[count:, columns]
        if following:
            moved = least_squares(of_speeds[:, following], -of_speeds[:, columns], ROUNDED)
            by_free = by_free + by_state[count:, following] @ moved
        of_rows = of_positions[:, columns]
        slopes = np.hstack([by_free, by_input[count:, places]])
        qdot, udot = flow.rates(known)
        missed = np.concatenate([udot, qdot[len(qdot) - (len(slopes) - count) :]])
        sizes = np.ones(len(missed))
        sizes[count:] = np.abs(slopes[count:]).max(axis=1, initial=0.0)
        sizes[sizes == 0.0] = 1.0
        whole = np.vstack([slopes / sizes[:, None], np.hstack([of_rows, np.zeros((len(of_rows), len(places)))])])
        return np.concatenate([missed / sizes, flow.positions(known)]), whole


def _step_within(slopes: Floats, missed: Floats, room: Floats) -> Floats:
    """Return the shortest step of Newton's method within bounds (2, ..): what would pass one ends at it."""
    step, ended = np.zeros(slopes.shape[1]), np.zeros(slopes.shape[1], dtype=bool)
    while True:
        step[~ended] = least_squares(slopes[:, ~ended], -missed - slopes[:, ended] @ step[ended], ROUNDED)
        beyond = ~ended & ((step < room[0]) | (step > room[1]))
        if not beyond.any():
            return step
        step[beyond] = np.clip(step, *room)[beyond]
        ended |= beyond
