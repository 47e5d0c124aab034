"""Trim: the values of inputs that hold a system at rest in a position that is given in part.

In: a System, coordinates by name and inputs whose values are unknown. Out: a Trim. Accelerations at rest and the rows
of constraints are zero; Newton's method on all unknowns together, with exact derivatives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from multibody_sym.analysis.deviations import DeviationFlow, displaced
from multibody_sym.analysis.linearize import flow_at, place_of
from multibody_sym.analysis.state_asked_about import errors_at
from multibody_sym.dynamics.start.number_checks import on_numbers
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.mechanics.changes import Overrides
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


@dataclass(frozen=True)
class Trim:
    """The `state` in which a system rests, coordinates and zero speeds, and the `inputs` that hold it, in SI units.

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
    """Return the inputs that hold a system at rest where the coordinates named in `at` have these values.

    `unknown` inputs are found, all if none are named; others are as declared at t = 0. Coordinates that `at` does not
    name are found as well, near the start; of more unknowns than equations those of the shortest steps from the start
    and from zero. `parameters` .. `inputs`: what the call changes of the system. Friction has the mode of the start.
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
    count = len(mechanism.speeds)
    states = [c.name for c in mechanism.coordinates if c.rate is not None]
    free = [k for k in range(count) if k not in held]
    free += [count + k for k, name in enumerate(states) if name not in given]
    with errors_at(at):
        q, w = _Search(flow, names, free).run(np.array(begin.q, dtype=float))
    coordinates = (coordinate.name for coordinate in mechanism.coordinates)
    state = {**dict(zip(coordinates, q.tolist(), strict=True)), **{speed.name: 0.0 for speed in mechanism.speeds}}
    return Trim(state, dict(zip(names, w.tolist(), strict=True)))


@dataclass(frozen=True, eq=False)
class _Search:
    """Newton's method for accelerations at rest and rates of states.

    The unknowns are deviations `free` of coordinates and, counted behind the speeds, of states; and inputs.
    """

    flow: DeviationFlow
    names: tuple[str, ...]
    free: list[int]

    def run(self, q: Floats) -> tuple[Floats, Floats]:
        """Return coordinates (nq) and unknown inputs; raises NoSolutionError where none are found."""
        places = [list(self.flow.mechanism.inputs).index(name) for name in self.names]
        speeds, values, small = self.flow.mechanism.speeds, np.zeros(len(places)), False
        missed, slopes = self._equations(q, values, places)
        values = least_squares(slopes[:, len(self.free) :], -missed, ROUNDED)  # the best inputs at the start
        for _ in range(_PASSES):
            missed, slopes = self._equations(q, values, places)
            size = float(np.abs(slopes).max(initial=0.0)) * max(1.0, np.abs(values).max(initial=0.0))
            step = least_squares(slopes, -missed, ROUNDED)
            moved = ((k, x) for k, x in zip(self.free, step, strict=False) if k < len(speeds))
            turns = [abs(x) for k, x in moved if speeds[k].unit == "rad/s"]
            step *= min(1.0, _LARGEST / max(turns, default=_LARGEST)) if any(turns) else 1.0
            sigma = np.zeros(len(speeds) + len(self.flow.mechanism.rates))
            sigma[self.free] = step[: len(self.free)]
            q, values = displaced(self.flow.mechanism, q, sigma), values + step[len(self.free) :]
            if small:  # one step more leaves rounding
                return q, values
            small = bool(np.abs(missed).max(initial=0.0) <= _SMALL * size)
        names = ", ".join(self.names) or "no input"
        raise NoSolutionError(
            f"no values of {names} were found that hold the system at rest there; leave coordinates out of at, or name "
            "more inputs as unknown",
            where=Where(path=("at",)),
            number="N109",
        )

    def _equations(self, q: Floats, values: Floats, places: list[int]) -> tuple[Floats, Floats]:
        """Return accelerations, rates of states and phi, and their derivatives by the unknowns.

        Rates are divided by the largest of their derivatives: that of a pressure in Pa is 1e10 times others.
        """
        flow, count = self.flow, len(self.flow.mechanism.speeds)
        t, _, u, parameters, declared, modes = flow.known(q, np.zeros(count))
        inputs = np.array(declared, dtype=float)
        inputs[places] = values
        known = t, q, u, parameters, inputs, modes
        by_state, by_input = flow.derivatives(known)
        columns = [k if k < count else count + k for k in self.free]
        of_rows = flow.restrictions(known)[0][:, columns]
        slopes = np.hstack([by_state[count:, columns], by_input[count:, places]])
        qdot, udot = flow.rates(known)
        missed = np.concatenate([udot, qdot[len(qdot) - (len(slopes) - count) :]])
        sizes = np.ones(len(missed))
        sizes[count:] = np.abs(slopes[count:]).max(axis=1, initial=0.0)
        sizes[sizes == 0.0] = 1.0
        whole = np.vstack([slopes / sizes[:, None], np.hstack([of_rows, np.zeros((len(of_rows), len(places)))])])
        return np.concatenate([missed / sizes, flow.positions(known)]), whole
