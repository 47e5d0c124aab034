"""What the numbers of a mode make of friction and of switching functions, in Programs of all modes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Final

from multibody_sym.dynamics.programs.switching import SwitchingValues
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.relative import STARTING
from multibody_sym.model.mechanism.every_mode import ModeNodes, friction_parts, has_end, has_rim
from multibody_sym.model.mechanism.limits import sided
from multibody_sym.model.mechanism.one_way import FrictionPart
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import where
from multibody_sym.scalars.limits import along, length, sliding, towards
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, less, real
from multibody_sym.scalars.vectors import S

_HALF: Final = ONE / 2


def chosen(number: Node, yes: S, no: S) -> Node:
    """Return one of two values by a number that is 1 or 0."""
    return as_node(where(less(_HALF, number), as_node(yes), as_node(no)))


def is_of_normal(function: str) -> bool:
    """Return whether a switching function, by its name, is that of a normal, which every mode watches."""
    return function.startswith("normal ")


@dataclass(frozen=True, eq=False)
class ModeValues:
    """The motion of a mechanism `in_every_mode`."""

    motion: Motion

    @cached_property
    def modes(self) -> ModeNodes:
        """The numbers of the mode."""
        return ModeNodes(self.motion.mechanism)

    def friction(self, part: FrictionPart, speeds: Sequence[Node], limits: Sequence[Node]) -> list[Node]:
        """Return the force along each row of a part for a unit normal force, zero where it does not slide.

        `speeds` are phidot of its rows, `limits` both its coefficients.
        """
        if part.regularised is not None:
            kinetic, least = self.motion.state.values([part.kinetic, part.regularised])
            return list(map(as_node, sliding(kinetic, speeds, length([*speeds, least]))))
        slip, mu = self.modes.slip(part), chosen(self.modes.at_limit(part), *limits)
        if len(part.rows) == 1:
            return [as_node(-slip * mu)]
        ways = self._slip_velocity(part, speeds)
        whole = chosen(slip, length(ways), ONE)
        return [chosen(slip, -mu * v / whole, ZERO) for v in ways]

    def functions(self, multipliers: Sequence[Node]) -> dict[str, S]:
        """Return the switching functions of all modes by name, for the multipliers of all rows."""
        values = SwitchingValues(self.motion, multipliers)
        found: dict[str, S] = {}
        for element in self.motion.mechanism.one_way:
            normal = element.normals[0]
            if not element.unilateral:
                for k in sided(element):
                    row = element.normals[k]
                    side, force = self.modes.side(element, row), values.multiplier(row.name)
                    found[f"turns {row.name}"] = -towards(side, force)
                continue
            opens, closes = -values.normal(element), values.closes(normal)
            found[f"normal {element.name}"] = chosen(self.modes.acts(normal), opens, closes)
            if has_end(element):
                found[f"edge {element.name}"] = values.leaves(normal)
            if has_rim(element):
                found[f"flat {element.name}"] = values.lies_flat(normal)
        for element, part in friction_parts(self.motion.mechanism):
            speeds = [as_node(values.row(row).phidot) for row in part.rows]
            slip, way = self.modes.slip(part), f"slip {part.name}"
            held = -values.room(element, part)
            if len(part.rows) == 1:
                found[way] = chosen(slip * slip, -slip * speeds[0], held)
                continue
            found[way] = chosen(slip, -length(self._slip_velocity(part, speeds)), held)
            onward = along(self.modes.direction(part), speeds)
            found |= {f"onward {part.name}": onward, f"back {part.name}": -onward}
        return found

    def _slip_velocity(self, part: FrictionPart, speeds: Sequence[Node]) -> list[Node]:
        """Return what has the direction of slip in space (see `kinematics.relative`)."""
        return [v + real(STARTING) * way for v, way in zip(speeds, self.modes.direction(part), strict=True)]
