"""What acts at an instant by element and component: of a solution, and of the end of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from multibody_sym.answers.cut_free.open import Component, open_forces, sums
from multibody_sym.answers.cut_free.records import Values
from multibody_sym.answers.solution import Solution
from multibody_sym.dynamics.programs.one_way_forces import OneWayForces
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.dynamics.programs.tensions import ropes
from multibody_sym.kinematics.motion import motion_of
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.mechanism.rows import RopeRow

if TYPE_CHECKING:  # a figure without reactions needs no run
    from multibody_sym.simulation.trajectory import Trajectory


def values_of(solution: Solution) -> Values:
    """Return the reactions of a solution, nan where it has no value."""
    return {
        name: {part: np.nan if x.value is None else float(x.value) for part, x in parts.items()}
        for name, parts in solution.reactions.items()
    }


def sliding_of(solution: Solution) -> frozenset[str]:
    """Return the elements that slide at a solved start."""
    return frozenset(name for name, word in solution.states.items() if word.startswith("slide"))


def open_of(solution: Solution) -> frozenset[Component]:
    """Return the elements and components of a solution that are not unique."""
    reactions = solution.reactions.items()
    return frozenset((name, part) for name, parts in reactions for part, x in parts.items() if not x.unique)


def at_end(run: Trajectory) -> tuple[Values, frozenset[str], frozenset[Component]]:
    """Return what acts at the end of a run, what slides there, and what of contacts and stops is not unique.

    Where the friction of a contact's corners is not, and their sum is, this is among the values.
    """
    from multibody_sym.simulation.samples import last_part

    part = last_part(run)
    q, u, inputs = (part.arguments[k][-1].tolist() for k in (1, 2, 4))
    known = state_of(part.mechanism, float, float(part.t[-1]), q, u, part.parameters.tolist(), inputs)
    _, udot, multipliers, *_ = part.derivative
    instant = Instant(motion_of(part.mechanism, known), udot[-1].tolist(), multipliers[-1].tolist())
    mode = part.mechanism.mode
    sliding = frozenset(name for name, slip in (mode.slips.items() if mode else ()) if slip)
    several = open_forces(instant.motion, run.redundancy.ambiguous)
    values = _values(run, instant)
    if several:
        told = run.ready.told.mechanism
        begin = state_of(told, float, float(run.problem.t0), run.q[0], run.u[0], part.parameters.tolist())
        values |= sums(instant, several, motion_of(told, begin))
    return values, sliding, several


def _values(run: Trajectory, instant: Instant) -> dict[str, Mapping[str, float]]:
    """Return the forces at an instant; those of joints are what the run tells of them."""
    mechanism, several = instant.motion.mechanism, run.redundancy.ambiguous
    acting = OneWayForces(instant.motion, instant.multipliers)
    found: dict[str, dict[str, Any]] = {
        row.name: {"force": x}
        for row, x in zip(mechanism.rows, instant.multipliers, strict=True)
        if row.name.rpartition(".")[0] not in mechanism.joint_names
    }
    found |= {name: {c: x[-1] for c, x in parts.items()} for name, parts in run.reactions.items()}
    for row in ropes(mechanism):
        found.setdefault(row.told[0], {}).pop("force", None)
        tensions = zip(row.components, (instant.tensions[asked] for asked in row.asked), strict=True)
        found[row.told[0]] |= dict(tensions)
    for element in mechanism.one_way:
        if not isinstance(element.normals[0], RopeRow):
            found[element.name] = acting.of(element)
    return {name: _unique(_floats(parts), several.get(name)) for name, parts in found.items()}


def _unique(parts: dict[str, float], ambiguous: Sequence[str] | None) -> dict[str, float]:
    """Return the forces of an element but its `ambiguous` components; none where it has no components."""
    return {name: x for name, x in parts.items() if ambiguous is None or (ambiguous and name not in ambiguous)}


def _floats(parts: Mapping[str, Any]) -> dict[str, float]:
    return {name: float(x) for name, x in parts.items()}
