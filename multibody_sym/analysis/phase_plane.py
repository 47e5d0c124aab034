"""The phase plane of one freedom, H(q, p) = E: its fixed points, the separatrix, and curves of constant energy.

    H = (p - b(q))^2/(2 M(q)) + V(q)        p = M u + b

Coordinates on which nothing depends keep their momenta of the start, which stand in V (Routh). Fixed points have p = b
and V' = 0: centres where V'' > 0, saddles where V'' < 0. Curves through saddles separate motions to and fro from those
around or away.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import field
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np

from multibody_sym.derivation.canonical import cyclic_speeds, energy_terms, reduce_energies
from multibody_sym.dynamics.programs.quantities import generalized_momenta
from multibody_sym.dynamics.start.state import examined_state
from multibody_sym.errors import ModelError, NoSolutionError
from multibody_sym.mechanics.energy import split, working_names
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.system import System
from multibody_sym.pictures.phase_portrait import FixedPoint, PhaseCurve, PhasePortrait
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, as_node, quantity, slot

_POINTS: Final = 481
"""Places of the window at which V is known."""
_AROUND: Final = 1.3
"""Parts of pi to both sides that the window of an angle has."""
_BESIDE: Final = 0.75
"""The part of a swing that the window of a length shows beside it where no such energy is reached."""
_LARGEST: Final = 64.0
"""How far beyond its start a motion is followed until it counts as one that goes away, by the size of the start."""
_FAR: Final = 3.0
"""How far such a motion is shown."""
_STEP: Final = 0.01
_LOOKS: Final = 33
_HIGHER: Final = 2.0
"""How far above its energy, by the depth of its well, the window of a length reaches."""
_WIDEST: Final = 5.0
"""How far from the start, by the width of the swing, it reaches at most."""
_NEXT: Final = 8.0
"""How far from the start, by its size, the next saddle is looked for, over which another well lies."""
_OVER: Final = 0.5
"""How far above such a saddle, by its height above the well, the window reaches."""
_RESTS: Final = 3.0
"""So many steps wide is a swing of a start at rest at most."""
_WITHIN: Final = (0.3, 0.6, 0.85)
"""Parts of the way from a centre to the nearest barrier at which closed curves turn."""
_ABOVE: Final = (0.25, 0.7, 1.3)
"""Parts of the deepest well by which curves lie above the highest saddle."""
_APART: Final = 0.06
"""The part of the deepest well by which energies of curves differ at least."""
_SAME: Final = 1e-6
_ROUNDING: Final = 1e-12
"""The part of an energy that it has from rounding."""
_LATER: Final = 1.2345
"""A time (s) at which energies must be what they are at the start."""
_ON_CURVE: Final = 61
"""Points of half a closed curve."""


@dataclass(frozen=True, eq=False)
class PhasePlane:
    """The Hamiltonian of one freedom in floats: nodes M, b, V and V' of its place `at`, other leaves `known`.

    `q0`, `u0` are the start, `units` those of q and p.
    """

    coordinate: str
    is_angle: bool
    at: Node
    nodes: tuple[Node, Node, Node, Node]
    known: dict[Node, float]
    q0: float
    u0: float
    units: tuple[str, str]
    _found: dict[float, tuple[float, float, float, float]] = field(default_factory=dict)

    @classmethod
    def of(cls, system: System, coordinate: str) -> PhasePlane:
        """Return the phase plane of a coordinate.

        Raises ModelError where there is none of this name, NoSolutionError where others move beside it or work is done.
        """
        state = examined_state(system)
        mechanism, begin = state.in_joints
        pairs = {mechanism.coordinates[q].name: (q, u) for body in mechanism.bodies for q, u in body.rate_pairs}
        if coordinate not in pairs:
            message = f"no coordinate is called {coordinate!r}"
            raise ModelError(message, number="M106", word=coordinate, known=[*pairs])
        q, u = pairs[coordinate]
        replaced = [k for k in cyclic_speeds(mechanism) if k != u]
        free = [x.name for k, x in enumerate(mechanism.speeds) if k != u and k not in replaced]
        stored, exerted = ({load.name for load in loads} for loads in split(mechanism.loads))
        working = [*working_names(mechanism), *(x.name for x in state.declared.one_way)]
        _verify_conserved(working, stored - exerted)
        if free or mechanism.rows:
            beside = f"{mechanism.rows[0].name} restricts it" if mechanism.rows else f"{free[0]} is free beside it"
            raise NoSolutionError(f"{coordinate} is not the one freedom left: {beside}", number="N111")
        here = state_of(mechanism, float, 0.0, begin.q, begin.u, begin.parameters)
        momenta = generalized_momenta(motion_of(mechanism, here))
        slots = [slot("momenta", k) for k in replaced]
        left = reduce_energies(energy_terms(mechanism), replaced, slots)
        at, potential = slot("q", q), as_node(left.potential)
        nodes = as_node(left.mass_matrix[0][0]), as_node(left.linear[0]), potential, derivative(potential, at)
        known = {**here.slots, **{x: float(momenta[k]) for x, k in zip(slots, replaced, strict=True)}}
        unit = mechanism.coordinates[q].unit
        (of_momentum,) = MechanismUnits(mechanism).of([quantity("generalized_momentum", (coordinate,))])
        found = cls(coordinate, unit == "rad", at, nodes, known, begin.q[q], begin.u[u], (unit, of_momentum))
        found._verify_still(slot("t", 0))
        return found

    def _verify_still(self, time: Node) -> None:
        """Raise NoSolutionError where energies depend on time."""
        now = self.values(self.q0)
        later = evaluate_float(self.nodes, {**self.known, self.at: self.q0, time: _LATER})
        if any(abs(a - b) > _SAME * (1.0 + abs(a)) for a, b in zip(now, later, strict=True)):
            raise NoSolutionError("the energy depends on time, and no curves are closed", number="N111")

    # --- the energy by the place --------------------------------------------------------------------------------------

    def values(self, q: float) -> tuple[float, float, float, float]:
        """Return M, b, V and V' at a place; V is infinite where it has no value."""
        if q not in self._found:
            try:
                m, b, v, slope = evaluate_float(self.nodes, {**self.known, self.at: q})
                found = (m, b, v, slope) if all(map(math.isfinite, (m, b, v))) and m > 0.0 else _NOWHERE
            except (ValueError, *UNDEFINED):
                found = _NOWHERE
            self._found[q] = found
        return self._found[q]

    def potential(self, q: float) -> float:
        """Return V at a place."""
        return self.values(q)[2]

    @cached_property
    def energy(self) -> float:
        """The value of H at the start."""
        m, _, v, _ = self.values(self.q0)
        return m * self.u0**2 / 2 + v

    @cached_property
    def window(self) -> tuple[float, float]:
        """The least and the largest place that is shown: no further than walls where V is infinite."""
        low, high = self._whole_window
        walls = [q for q, is_wall in self._stops if is_wall]
        low = max((q for q in walls if q < self.q0), default=low)
        return low, min((q for q in walls if q > self.q0), default=high)

    @cached_property
    def _whole_window(self) -> tuple[float, float]:
        if self.is_angle:
            turns = round(self.q0 / (2 * math.pi)) * 2 * math.pi
            return turns - _AROUND * math.pi, turns + _AROUND * math.pi
        size = abs(self.q0) or 1.0
        low, high = (self._beyond(side, self.energy, _LARGEST * size, _STEP * size) for side in (-1.0, 1.0))
        if low is None or high is None:  # it goes away
            return low or self.q0 - _FAR * size, high or self.q0 + _FAR * size
        width = high - low
        saddles = [self._next_saddle(side, _NEXT * size, _STEP * size) for side in (-1.0, 1.0)]
        if width <= _RESTS * _STEP * size and saddles == [None, None]:
            return self.q0 - size, self.q0 + size
        deepest = min(self.potential(q) for q in np.linspace(low, high, _LOOKS).tolist())
        above, reach = self.energy + _HIGHER * (self.energy - deepest), _WIDEST * width
        for saddle in saddles:
            if saddle is not None:
                top = self.potential(saddle)
                above = max(above, top + _OVER * (top - deepest))
                reach = max(reach, _FAR * abs(saddle - self.q0))
        shown = []
        for side, end, saddle in zip((-1.0, 1.0), (low, high), saddles, strict=True):
            beyond = self._beyond(side, above, reach, _STEP * width)
            last = end if saddle is None else saddle
            shown.append(last + side * _BESIDE * max(width, abs(last - self.q0)) if beyond is None else beyond)
        return shown[0], shown[1]

    def _next_saddle(self, side: float, farthest: float, step: float) -> float | None:
        """Return where V is highest before it falls, above the energy of the start, on a side of this; else None."""
        least = self.energy + _ROUNDING * (1.0 + abs(self.energy))
        place, highest = self.q0, self.q0
        while abs(place - self.q0) < farthest:
            place += side * step
            step *= 1.02
            top, here = self.potential(highest), self.potential(place)
            if top < here < math.inf:
                highest = place
            elif top > least and top - here > _SAME * (top - self.energy):
                return highest
        return None

    def _beyond(self, side: float, energy: float, farthest: float, step: float) -> float | None:
        """Return where V comes to an energy on a side of the start, None where it does not within a distance."""
        place = self.q0
        while abs(place - self.q0) < farthest:
            place += side * step
            if self.potential(place) > energy:
                return place
            step *= 1.02
        return None

    @cached_property
    def places(self) -> Floats:
        """Places of the window, fixed points among them."""
        low, high = self.window
        even = np.linspace(low, high, _POINTS)
        return np.unique(np.concatenate((even, [x.q for x in self.fixed_points])))

    @cached_property
    def _stops(self) -> list[tuple[float, bool]]:
        """The places where V' changes its sign, and whether it does so at a wall."""
        low, high = self._whole_window
        found: list[tuple[float, bool]] = []
        for a, b in pairwise(np.linspace(low, high, _POINTS).tolist()):
            first, last = self.values(a)[3], self.values(b)[3]
            if self.potential(a) == math.inf:
                found.append((a, True))
            if not (math.isfinite(first) and math.isfinite(last)) or first * last > 0.0 or first == 0.0 == last:
                continue
            q = _bisected(lambda x: self.values(x)[3], a, b)
            q = 0.0 if abs(q) <= _SAME * (high - low) else q
            if not (found and abs(found[-1][0] - q) <= _SAME * (high - low)):
                found.append((q, not abs(self.values(q)[3]) <= max(abs(first), abs(last))))
        return found

    @cached_property
    def fixed_points(self) -> tuple[FixedPoint, ...]:
        """The fixed points in the window, in the order of places."""
        low, high = self.window
        places = [q for q, is_wall in self._stops if low <= q <= high and not is_wall]
        return tuple(FixedPoint(q, self.values(q)[1], self.potential(q), self._kind(q)) for q in places)

    def _kind(self, q: float) -> str:
        beside = _STEP * (self.window[1] - self.window[0]) / 4
        rise = [self.potential(q + way * beside) - self.potential(q) for way in (-1.0, 1.0)]
        return "centre" if min(rise) > 0.0 else "saddle" if max(rise) < 0.0 else "cusp"

    # --- curves -------------------------------------------------------------------------------------------------------

    def portrait(self) -> PhasePortrait:
        """Return the curves, the fixed points and the motion from the start."""
        curves = [PhaseCurve(part, closed, "orbit") for e in self._levels() for part, closed in self._curves(e)]
        curves += [
            PhaseCurve(part, closed, "separatrix") for e in self._barriers for part, closed in self._curves(e)
        ]
        m, b, _, _ = self.values(self.q0)
        begin = self.q0, m * self.u0 + b
        own = [(part, closed) for part, closed in self._curves(self.energy) if _is_on(begin, part)]
        curves += [PhaseCurve(part, closed, "start") for part, closed in own[:1]]
        shown = tuple(curves), self.fixed_points
        return PhasePortrait(self.coordinate, self.is_angle, self.window, *shown, begin, self.units)

    @cached_property
    def _barriers(self) -> list[float]:
        """The energies of saddles, each once."""
        return _distinct([x.energy for x in self.fixed_points if x.kind == "saddle"], self._depth)

    @cached_property
    def _depth(self) -> float:
        """The height of the highest saddle, or of the motion from the start, above the lowest centre."""
        tops = [x.energy for x in self.fixed_points if x.kind == "saddle"] or [self.energy]
        bottoms = [x.energy for x in self.fixed_points if x.kind == "centre"] or [self.energy]
        return abs(max(tops) - min(bottoms)) or abs(self.energy) or 1.0

    def _levels(self) -> list[float]:
        """Return the energies of curves: closed ones about centres, and those above all saddles."""
        found: list[float] = []
        stops = [self.window[0], *(x.q for x in self.fixed_points), self.window[1]]
        for k, centre in enumerate(self.fixed_points, start=1):
            if centre.kind != "centre":
                continue
            ways = [np.array(_WITHIN) * (stops[side] - centre.q) for side in (k - 1, k + 1)]
            sides = [[self.potential(centre.q + x) for x in way.tolist()] for way in ways]
            found += sides[0] if sides[0][-1] < sides[1][-1] else sides[1]
        if self._barriers:
            found += [self._barriers[-1] + part * self._depth for part in _ABOVE]
        return _distinct(found, self._depth)

    def _curves(self, energy: float) -> Iterator[tuple[Floats, bool]]:
        """Yield the parts of H = E in the window: points (n, 2) of q and p, and whether they close."""
        inside = np.array([self.potential(q) <= energy + 1e-12 * self._depth for q in self.places.tolist()])
        edges = np.flatnonzero(np.diff(np.concatenate(([False], inside, [False])).astype(int)))
        for first, last in zip(edges[::2].tolist(), (edges[1::2] - 1).tolist(), strict=True):
            ends = [self._turn(energy, first, -1), self._turn(energy, last, 1)]
            low, high = (self.places[k] if end is None else end for k, end in zip((first, last), ends, strict=True))
            if not high > low:
                continue
            steps = np.linspace(-math.pi / 2, math.pi / 2, _ON_CURVE)
            way = (low + high) / 2 + (high - low) / 2 * np.sin(steps)
            between = [x.q for x in self.fixed_points if low < x.q < high]
            q = np.unique(np.concatenate((way, between)))
            up, down = (np.array([self._momentum(x, energy, sign) for x in q.tolist()]) for sign in (1.0, -1.0))
            upper, lower = np.column_stack((q, up)), np.column_stack((q, down))[::-1]
            if ends == [None, None]:
                yield upper, False
                yield lower, False
            elif None in ends:
                parts = (lower, upper) if ends[1] is None else (upper, lower)
                yield np.concatenate(parts), False
            else:
                yield np.concatenate((upper, lower[1:])), True

    def _turn(self, energy: float, k: int, side: int) -> float | None:
        """Return where a motion turns beside the place k, None where that is beyond the window."""
        if not 0 <= k + side < len(self.places):
            return None
        inner, outer = float(self.places[k]), float(self.places[k + side])
        return _bisected(lambda q: min(self.potential(q) - energy, 1e300), inner, outer)

    def _momentum(self, q: float, energy: float, sign: float) -> float:
        m, b, v, _ = self.values(q)
        return b + sign * math.sqrt(max(2 * m * (energy - v), 0.0)) if math.isfinite(v) else 0.0


def _verify_conserved(working: Sequence[str], stored: Collection[str]) -> None:
    """Raise NoSolutionError where something may do work: a force, or what is `stored` energy that time changes."""
    if working:
        kept = "the phase plane is that of a conserved energy"
        if working[0] in stored:
            raise NoSolutionError(f"{working[0]} changes with time, and the energy with it: {kept}", number="N111")
        raise NoSolutionError(f"{working[0]} may do work: {kept}; declare forces by a potential", number="N111")


_NOWHERE: Final = (1.0, 0.0, math.inf, math.nan)


def _bisected(f: Callable[[float], float], a: float, b: float) -> float:
    """Return the place between a and b at which a function changes its sign."""
    rises = f(b) > f(a)
    for _ in range(60):
        middle = (a + b) / 2
        if (f(middle) > 0.0) == rises:
            b = middle
        else:
            a = middle
    return (a + b) / 2


def _distinct(energies: Sequence[float], size: float) -> list[float]:
    """Return energies in order, without those that lie close above another one."""
    found: list[float] = []
    for e in sorted(energies):
        if math.isfinite(e) and not (found and e - found[-1] <= _APART * size):
            found.append(e)
    return found


def _is_on(point: tuple[float, float], curve: Floats) -> bool:
    """Return whether a point lies on a curve, by its nearest points."""
    spread = np.ptp(curve, axis=0)
    spread[spread == 0.0] = 1.0
    return bool(np.abs((curve - np.array(point)) / spread).max(axis=1).min() <= 0.1)
