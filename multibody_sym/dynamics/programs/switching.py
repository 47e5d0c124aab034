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

from collections.abc import Iterator, Sequence
from functools import reduce
from typing import Final, Literal

from multibody_sym.dynamics.programs.one_way_forces import OneWayForces, side_of
from multibody_sym.kinematics.contacts import gap, reach
from multibody_sym.kinematics.flat_rims import flattened
from multibody_sym.kinematics.relative import separation, slip_velocity
from multibody_sym.model.mechanism.contact_rows import ContactRow
from multibody_sym.model.mechanism.every_mode import has_end, has_rim, sided
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import INACTIVE, STICKS, FrictionPart, OneWay
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import absolute, minimum
from multibody_sym.scalars.limits import length
from multibody_sym.scalars.node import ZERO
from multibody_sym.scalars.vectors import S, dot

Ends = Literal[
    "closes", "opens", "leaves", "lies flat", "turns", "slips", "stops", "stops in space", "moves on", "turns back"
]  # fmt: skip

_STILL: Final = 1e-6
"""The rate (1/s) of r . v / r^2 below which a corner that lies on another body does not move but for rounding."""
_TOLD: Final = {"leaves": "gets past an edge", "turns": "presses on the other side", "stops in space": "stops"}


@dataclass(frozen=True)
class Switching:
    """A switching function: what ends, of which element, and of which of its friction parts or normals."""

    ends: Ends
    element: OneWay
    part: FrictionPart | None = None
    normal: int = 0

    @property
    def limits(self) -> bool:
        """Whether it is one of forces."""
        return self.ends in ("opens", "turns", "slips")

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
    found = [one for element in mechanism.one_way for one in _of(mechanism, element)]
    return tuple(sorted(found, key=lambda one: not one.shortens))


def _of(mechanism: Mechanism, element: OneWay) -> Iterator[Switching]:
    assert mechanism.mode is not None
    sides, slips = mechanism.mode.sides, mechanism.mode.slips
    if element.unilateral:
        active, idle = sides.get(element.name, INACTIVE) != INACTIVE, element.name in mechanism.mode.idle
        if idle and not active:  # it takes no part
            return
        yield Switching("opens" if active and not idle else "closes", element)
        if idle or not active:
            return
        if has_end(element):
            yield Switching("leaves", element)
        if has_rim(element):
            yield Switching("lies flat", element)
    yield from (Switching("turns", element, normal=k) for k in sided(element) if not element.unilateral)
    rubbing = [part for part in element.frictions if part.static is not ZERO or part.enough]
    if not element.unilateral and sides.get(element.name, INACTIVE) == INACTIVE:
        return
    for part in (part for part in rubbing if part.regularised is None):
        if slips.get(part.name, STICKS) != STICKS:
            yield Switching("stops" if len(part.rows) == 1 else "stops in space", element, part)
            if part.name in mechanism.mode.directions:
                yield Switching("moves on", element, part)
                yield Switching("turns back", element, part)
        elif not part.enough and part.name not in mechanism.mode.carried:
            yield Switching("slips", element, part)


@dataclass(frozen=True, eq=False)
class SwitchingValues(OneWayForces):
    """Switching functions over a scalar, from the motion and the multipliers of a mechanism in a mode."""

    def values(self, functions: Sequence[Switching]) -> list[S]:
        """Return the values of switching functions."""
        return [self._value(one) for one in functions]

    def _value(self, one: Switching) -> S:
        mechanism, element, normal = self.motion.mechanism, one.element, one.element.normals
        assert mechanism.mode is not None
        of_normal = {"closes": self.closes, "leaves": self.leaves, "opens": self.opens, "lies flat": self.lies_flat}
        if one.ends in of_normal:
            return of_normal[one.ends](normal[0])
        if one.ends == "turns":
            side, force = self.side(element, normal[one.normal]), self.multiplier(normal[one.normal].name)
            return -side * force if side else absolute(force)
        assert one.part is not None
        if one.ends == "slips":
            return self.slips(element, one.part)
        return self._of_slip(one.ends, one.part, mechanism.mode.slips[one.part.name])

    def side(self, element: OneWay, normal: Row) -> int:
        """Return the sign of the force of a normal row, 0 where it has none yet: it may press either way."""
        return side_of(self.mechanism, element, normal)

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

    def opens(self, row: Row) -> S:
        """Return what becomes positive where a row that acts would have to pull, or to push."""
        return -self.multiplier(row.name)

    def slips(self, element: OneWay, part: FrictionPart) -> S:
        """Return what becomes positive where a part that sticks exceeds its static limit."""
        return -self.room(element, part)

    def _of_slip(self, ends: Ends, part: FrictionPart, sense: int) -> S:
        speeds = [self.row(row).phidot for row in part.rows]
        sliding = next((sliding for _, sliding in self.slidings(part)), None)
        if ends in ("moves on", "turns back"):
            assert sliding is not None
            assert sliding.starts is not None
            ways = zip(speeds, self.motion.state.values(sliding.starts), strict=True)
            return (1 if ends == "moves on" else -1) * sum(v * way for v, way in ways)
        if ends == "stops":
            return -sense * speeds[0]
        return -length(speeds if sliding is None else slip_velocity(sliding, speeds, self.motion))

    def _reach(self, row: Row) -> list[S]:
        return reach(row, self.motion) if isinstance(row, ContactRow) else []
