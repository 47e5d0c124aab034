"""Equilibrium by virtual work: positions at which the forces do no work on any admissible displacement.

In such a position a system at rest has no acceleration. With the constraints' tangents X (see `deviations`), xi the
independent deviations, eta the independent speeds, dxi/dt = S eta, and G(xi) the accelerations deta/dt at rest,
equilibria are the roots of G, and one is stable where all eigenvalues of dG/dxi S are real and negative: for forces
with a potential V where the Hessian of V is positive definite on the admissible displacements. Friction has no part.
Where something holds one way only there are equilibria for each set of what is closed (`resting`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any, Final

import numpy as np

from multibody_sym.analysis.all_rest import are_all
from multibody_sym.analysis.none_found import left_out, none_found, tried
from multibody_sym.analysis.resting.closings import Rest, rests
from multibody_sym.analysis.resting.search import guesses
from multibody_sym.analysis.springs_passed import passed
from multibody_sym.dynamics.routes import verify_formalism
from multibody_sym.dynamics.start.examined import examined, on_numbers
from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.resolution.changes import Changes
from multibody_sym.records import dataclass

TOUCHES: Final = "touches"
"""What is said of what touches without force."""
_STILL: Final = 1e-6
"""The part of the largest speed of a start up to which one is none."""


@dataclass(frozen=True)
class Equilibrium:
    """Positions of equilibrium, each with its coordinates by name, and whether they are stable.

    `stable` is None where a position is indifferent, and where it is `one_sided`: beside it a force has no real value.

    `free`: for each position the coordinates along which the positions beside it are equilibria too; `beyond`: the
    springs whose end lies beyond their other end. `complete`: whether it is proved that there are no others;
    `cut_short`: whether the time of the search was up before it found nothing new; `guesses`: how many it tried.
    `speeds_left_out`: speeds of the start, which is taken at rest. `units`: the unit of each coordinate. `closed`: for
    each position the contacts, ropes and stops that press or pull there, with their states, and what touches without
    force, which may leave open whether it is stable. `friction_left_out`: what rubs and might hold other positions.
    `sets`: how many sets of contacts, ropes and stops were tried closed, and how many there are. `errors`: how far the
    coordinates of each position may be off.
    """

    positions: tuple[Mapping[str, float], ...]
    stable: tuple[bool | None, ...]
    free: tuple[tuple[str, ...], ...]
    complete: bool
    beyond: tuple[tuple[str, ...], ...] = ()
    cut_short: bool = False
    guesses: int = 0
    speeds_left_out: tuple[str, ...] = ()
    one_sided: tuple[bool, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    closed: tuple[Mapping[str, str], ...] = ()
    friction_left_out: tuple[str, ...] = ()
    sets: tuple[int, int] = (1, 1)
    errors: tuple[Mapping[str, float], ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return the object that `equilibrium --json` prints."""
        return {
            "positions": [dict(position) for position in self.positions],
            "stable": list(self.stable),
            "free": [list(names) for names in self.free],
            "beyond": [list(names) for names in self.beyond],
            "complete": self.complete,
            "cut_short": self.cut_short,
            "guesses": self.guesses,
            "speeds_left_out": list(self.speeds_left_out),
            "one_sided": list(self.one_sided),
            "units": dict(self.units),
            "closed": [dict(words) for words in self.closed],
            "friction_left_out": list(self.friction_left_out),
            "sets": list(self.sets),
            "errors": [dict(each) for each in self.errors],
        }


def equilibrium(
    system: System,
    *,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    formalism: str | None = None,
) -> Equilibrium:
    """Return the positions of equilibrium that are found from the start and from positions all around it, at t = 0.

    The system is taken at rest: speeds of the start are left out. Positions are told apart by where bodies are.
    `parameters` .. `project`: what the call changes of the system (`Changes`); `formalism` by name, None for the
    cheapest. Raises InputError, and NoSolutionError where there is no start or none is found.
    """
    return _equilibrium(Changes(parameters, initial, inputs, coordinates, project).of(system), formalism)


@on_numbers
def _equilibrium(system: System, formalism: str | None) -> Equilibrium:
    verify_formalism(formalism)
    resolved = examined(system)
    begin = start(resolved, project=system.simulation.project)
    if not resolved.speeds:  # nothing moves: the one position is at rest, whatever acts
        at_rest = Equilibrium(({},), (True,), ((),), True, ((),), one_sided=(False,), closed=({},), errors=({},))
        return replace(at_rest, friction_left_out=left_out(resolved))
    rested = rests(resolved, begin, formalism, project=system.simulation.project)
    found, first = rested.found, rested.first
    if not found:
        around = guesses(first.places, first.places.start)
        one_way = tried(resolved, rested.sets, in_time=rested.cut_short)
        raise none_found(first.flow, first.rows, around, in_time=rested.cut_short, one_way=one_way)
    names = [c.name for c in resolved.coordinates]
    one_sided = tuple(x.search.one_sided(x.q) for x in found)
    return Equilibrium(
        tuple(dict(zip(names, x.search.told(x.q), strict=True)) for x in found),
        tuple(None if edge else x.stable for x, edge in zip(found, one_sided, strict=True)),
        tuple(tuple(names[k] for k in np.flatnonzero(x.free)) for x in found),
        rested.sets[1] == 1 and are_all(first.places, [x.q for x in found], [x.free for x in found]),
        tuple(passed(x.search.places, x.q) for x in found),
        rested.cut_short,
        rested.guesses,
        _moving(system, resolved, begin),
        one_sided,
        {c.name: c.unit for c in resolved.coordinates},
        tuple(_closed(resolved, x) for x in found),
        left_out(resolved),
        rested.sets,
        tuple(dict(zip(names, x.search.errors(x.q), strict=True)) for x in found),
    )


def _closed(resolved: Mechanism, rest: Rest) -> dict[str, str]:
    """Return the state of each element that is closed, and which ones touch without force."""
    words = {x.name: x.words[0] for x in resolved.one_way if x.name in rest.closed}
    return words | dict.fromkeys(rest.touching, TOUCHES)


def _moving(system: System, resolved: Mechanism, begin: Start) -> tuple[str, ...]:
    """Return the speeds of the start that are not zero, in coordinates of joints as they are declared."""
    if resolved.relative is not None:
        begin = start(resolved.relative, project=system.simulation.project)
        resolved = resolved.relative
    size = max(map(abs, begin.u), default=0.0)
    return tuple(s.name for s, u in zip(resolved.speeds, begin.u, strict=True) if abs(u) > _STILL * size)
