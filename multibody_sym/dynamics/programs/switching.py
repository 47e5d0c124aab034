"""Switching functions of a mode: what becomes positive where the mode ends.

    what ends                                    function
    what is open or slack, or touches and carries
    nothing, closes                              -gap, over a face that ends
    two points are nearest, and perhaps meet     r . v, of one from the other, at corners less what is still
    a closed contact, a taut rope opens          -(normal force, tension)
    a reaction that presses changes its side     -side * reaction, from no side |reaction|
    a closed contact gets past an edge           -(way to the edge)
    a rim that touches has come nearly flat      s . s', s across it and its plane, near s = 0
    what sticks slips                            |l_t| - static * N
    what slides stops, in a line                 -sense * v_t
    what slides stops, in space                  -|v_t|, from rest where its friction has no direction
    what slides from rest in space moves on      v_t along the direction in which it started, beyond a margin
    what slides from rest in space turns back    the same, negative

Those of forces come first, and of slip in space: forces may change where nothing moves, and what slides in space comes
to rest where its friction has no direction, so that they keep steps short.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import reduce
from typing import Final, Literal

from multibody_sym.dynamics.programs.one_way_forces import OneWayForces
from multibody_sym.kinematics.contacts import gap, reach
from multibody_sym.kinematics.flat_rims import flattened
from multibody_sym.kinematics.relative import separation, slip_velocity
from multibody_sym.model.mechanism.contact_rows import ContactRow
from multibody_sym.model.mechanism.every_mode import has_end, has_rim
from multibody_sym.model.mechanism.limits import Limit, limits_in
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import ACTIVE, FrictionPart, Mode, OneWay
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import minimum
from multibody_sym.scalars.limits import OF_FORCES, Kind, along, length
from multibody_sym.scalars.vectors import S, dot

Ends = Literal[
    "closes", "opens", "leaves", "lies flat", "turns", "slips", "stops", "stops in space", "moves on", "turns back"
]  # fmt: skip

ENDS: Final[Mapping[Kind, Ends]] = {
    "force": "opens", "gap": "closes", "side": "turns", "cone": "slips", "slip": "stops"
}  # fmt: skip
_STILL: Final = 1e-6
"""The rate (1/s) of r . v / r^2 below which a corner that lies on another body does not move but for rounding."""
_TOLD: Final = {"leaves": "gets past an edge", "turns": "presses on the other side", "stops in space": "stops"}


@dataclass(frozen=True)
class Switching(Limit):
    """A switching function: what ends where a limit is passed, or near it."""

    ends: Ends = "opens"

    @property
    def limits(self) -> bool:
        """Whether it is one of forces."""
        return self.kind in OF_FORCES

    @property
    def shortens(self) -> bool:
        """Whether it keeps adaptive steps short: beyond the end of slip in space friction would turn round."""
        return self.limits or self.ends == "stops in space"

    @property
    def told(self) -> str:
        """What the element does there, for people."""
        return _TOLD.get(self.ends, self.ends)


def switchings(mechanism: Mechanism) -> tuple[Switching, ...]:
    """Return the switching functions of a mechanism in a mode, those that keep steps short first; none without one."""
    if mechanism.mode is None:
        return ()
    found = [one for element in mechanism.one_way for one in _of(mechanism.mode, element)]
    return tuple(sorted(found, key=lambda one: not one.shortens))


def _of(mode: Mode, element: OneWay) -> Iterator[Switching]:
    if element.unilateral and element.name in mode.idle and not mode.acts(element):  # it takes no part
        return
    for limit in limits_in(mode, element):
        part = limit.part
        in_space = part is not None and limit.kind == "slip" and len(part.rows) > 1
        yield Switching(**vars(limit), ends="stops in space" if in_space else ENDS[limit.kind])
        if limit.kind == "force" and has_end(element):
            yield Switching("gap", element, ends="leaves")
        if limit.kind == "force" and has_rim(element):
            yield Switching("gap", element, ends="lies flat")
        if in_space and part is not None and part.name in mode.directions:
            yield from (Switching("slip", element, part, ends=ends) for ends in ("moves on", "turns back"))


@dataclass(frozen=True, eq=False)
class SwitchingValues(OneWayForces):
    """Switching functions over a scalar, from the motion and the multipliers of a mechanism in a mode."""

    def values(self, functions: Sequence[Switching]) -> list[S]:
        """Return the values of switching functions."""
        return [self._value(one) for one in functions]

    def _value(self, one: Switching) -> S:
        of_normal = {"closes": self.closes, "leaves": self.leaves, "lies flat": self.lies_flat}
        if one.ends in of_normal:
            return of_normal[one.ends](one.element.normals[one.normal])
        if one.ends in ("moves on", "turns back", "stops in space"):
            assert one.part is not None
            return self._in_space(one.ends, one.part)
        return -self.value(one, lambda row: self.row(row).phidot)

    def side(self, element: OneWay, normal: Row) -> int:
        """Return the sign of the force of a normal row, 0 where it has none yet: it may press either way."""
        return ACTIVE if element.unilateral else self.mode.side(element, normal)

    def closes(self, row: Row) -> S:
        """Return what becomes positive where a row touches that does not act."""
        if isinstance(row, ContactRow) and row.tip is not None:
            away, rate = separation(self.motion, row.skins[0].place, row.skins[1].place)
            parting = dot(away, rate)
            return parting - _STILL * dot(away, away) if row.tip.corner else parting
        phi = gap(row.skins, self.motion) if isinstance(row, ContactRow) else self.row(row).phi
        return reduce(minimum, self._reach(row), -phi)

    def leaves(self, row: Row) -> S:
        """Return what becomes positive where what touches gets past an edge."""
        return -reduce(minimum, self._reach(row))

    def lies_flat(self, row: Row) -> S:
        """Return what becomes positive where a rim that touches has come as near to lying flat as it does."""
        assert isinstance(row, ContactRow)
        return flattened(row, self.motion)

    def _in_space(self, ends: Ends, part: FrictionPart) -> S:
        speeds = [self.row(row).phidot for row in part.rows]
        if ends == "stops in space":
            sliding = next((sliding for _, sliding in self.slidings(part)), None)
            return -length(speeds if sliding is None else slip_velocity(sliding, speeds, self.motion))
        return (1 if ends == "moves on" else -1) * along(self.begins(part), speeds)

    def _reach(self, row: Row) -> list[S]:
        return reach(row, self.motion) if isinstance(row, ContactRow) else []
