"""Forces of contacts and stops that are not unique at an instant, and sums of friction that are."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

from multibody_sym.answers.cut_free.records import Values
from multibody_sym.dynamics.constraints.redundancy import idle_combinations
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.programs.one_way_forces import OneWayForces
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.kinematics.motion import Motion
from multibody_sym.model.mechanism.one_way import PRESSING, OneWay, component_names
from multibody_sym.numerics.dependence import NEGLIGIBLE

Component = tuple[str, str]
"""An element and a component of its force."""


def open_forces(motion: Motion, ambiguous: Collection[str]) -> frozenset[Component]:
    """Return the components whose rows are among those that are ambiguous, friction also by what presses."""
    found: set[Component] = set()
    acting = {row.name for row in motion.mechanism.rows}
    for element in motion.mechanism.one_way:
        if element.kind not in ("contact", "stop"):
            continue
        pressed = element.normals[0].name in ambiguous
        found |= {(element.name, PRESSING[element.kind])} if pressed else set()
        for part in (part for part in element.frictions if part.rubs):
            names = component_names(element, part)
            for name, row in zip(names, part.rows, strict=True):
                if row.name in ambiguous or (pressed and row.name not in acting):
                    found.add((element.name, name))
    return frozenset(found)


def sums(instant: Instant, several: Collection[Component], touching: Motion) -> Values:
    """Return by contact the friction of all its corners together, where that is unique and single ones are not.

    `touching` is the motion of the mechanism with the rows of all that touches and sticks.
    """
    mechanism = instant.motion.mechanism
    groups = {e.group: [x for x in mechanism.one_way if x.group == e.group] for e in mechanism.one_way}
    asked = {
        name: corners
        for name, corners in groups.items()
        if len(corners) > 1 and any((corner.name, "friction") in several for corner in corners)
    }
    if not asked:
        return {}
    dynamics = composite_body(touching.mechanism, touching.state)
    names, idle = dynamics.row_names, idle_combinations(dynamics)
    acting = OneWayForces(instant.motion, instant.multipliers)
    found = {}
    for name, corners in asked.items():
        rows = set(_rows(corner for corner in corners if (corner.name, "friction") in several))
        left = (sum(share for row, share in zip(names, each, strict=True) if row in rows) for each in idle)
        if rows <= set(names) and all(abs(float(x)) <= NEGLIGIBLE for x in left):
            found[name] = {"friction": float(acting.asked(name, "friction"))}
    return found


def _rows(corners: Iterable[OneWay]) -> Iterator[str]:
    """Yield the rows of what rubs first at each corner."""
    for corner in corners:
        yield from (row.name for part in corner.frictions[:1] for row in part.rows)
