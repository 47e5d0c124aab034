"""Which forces does a section of a beam transmit? By equilibrium of the part that the section cuts off, any scalar.

The beam's axis is x of a frame on a body, y points across it. On the part with smaller x act the forces (X, Y), and the
moments m about the frame's origin, of all that touches it, of its weight and of its inertia:

    N = -sum X        V = sum Y        M = sum (x Y - m)

so that N is positive in tension, dV/dx = -q for a load q against y, and dM/dx = V.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from typing import Final

from multibody_sym.dynamics.programs.quantities import Exertion, StateQuantities
from multibody_sym.mechanics.contact_geometry import touch
from multibody_sym.mechanics.forces import line_integrals
from multibody_sym.mechanics.load_records import LineLoad
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.vectors import S, Vec, add, apply_transposed, cross, scale, subtract

UNITS: Final = {"axial": "N", "shear": "N", "moment": "N*m"}
LETTERS: Final = {"axial": "N", "shear": "V", "moment": "M"}
Resultant = tuple[S, S, S]
"""X and Y along the axes of a beam (N), and the moment about its origin (N m)."""


@dataclass(frozen=True)
class Beam:
    """A beam along x of the marker `axis`; `length`: of the rod, from the body's origin on, over which its mass lies.

    `backwards`: the names of line loads that run against the axis; `across`: of those square to it, on another arm.
    """

    axis: Marker
    length: Node | None = None
    backwards: frozenset[str] = frozenset()
    across: frozenset[str] = frozenset()


@dataclass(frozen=True)
class PointAction:
    """What acts on a beam at one place: of the element `name`, at `x` (m), with its `resultant`."""

    name: str
    x: S
    resultant: Resultant


@dataclass(frozen=True)
class LineAction:
    """What acts along a beam from `x` on over a `length` (m), `forwards` or against its axis.

    `integral` returns the resultant of what acts up to a distance s from x.
    """

    name: str
    x: S
    length: S
    forwards: bool
    integral: Callable[[S], Resultant]

    def up_to(self, x: S) -> Resultant:
        """Return the resultant of what acts at places smaller than one between its ends."""
        if self.forwards:
            return self.integral(x - self.x)
        X, Y, m = self.integral(self.length)
        other = self.integral(self.x - x)
        return X - other[0], Y - other[1], m - other[2]

    @property
    def ends(self) -> tuple[S, S]:
        """Where it begins and ends along the axis."""
        far = self.x + self.length if self.forwards else self.x - self.length
        return (self.x, far) if self.forwards else (far, self.x)


@dataclass(frozen=True)
class Cut:
    """What acts on the part that a section cuts off: `points` and `wholes` with all they have, `parts` up to it."""

    points: tuple[int, ...]
    wholes: tuple[int, ...]
    parts: tuple[int, ...]


@dataclass(frozen=True)
class BeamActions:
    """All that acts on a beam; `homeless`: elements that act on it at no known place, or at several."""

    points: Sequence[PointAction]
    lines: Sequence[LineAction]
    homeless: Sequence[tuple[str, Vec, Vec]]

    def on(self, cut: Cut, x: S) -> list[tuple[str, Resultant]]:
        """Return what acts on the part that a section at x cuts off, by its elements."""
        found = [(self.points[k].name, self.points[k].resultant) for k in cut.points]
        found += [(self.lines[k].name, self.lines[k].integral(self.lines[k].length)) for k in cut.wholes]
        return found + [(self.lines[k].name, self.lines[k].up_to(x)) for k in cut.parts]


def component_at(kind: str, x: S, resultant: Resultant) -> S:
    """Return what a resultant on the part that a section at x cuts off adds to N, V or M of the section."""
    X, Y, m = resultant
    return {"axial": -X, "shear": Y, "moment": x * Y - m}[kind]


def section_force(actions: BeamActions, kind: str, cut: Cut, x: S) -> S:
    """Return N, V or M of a section at x."""
    return reduce(lambda a, b: a + b, (component_at(kind, x, r) for _, r in actions.on(cut, x)), 0)


def actions_on(instant: StateQuantities, beam: Beam) -> BeamActions:
    """Return all that acts on a beam, in the same order at every instant."""
    body, motion = beam.axis.body, instant.motion
    loads = {load.name: load for load in motion.mechanism.loads if isinstance(load, LineLoad)}
    points: list[PointAction] = []
    own = [load for load in loads.values() if load.ends[0].body == body]
    lines = [_of_load(instant, beam, load) for load in own if load.name not in beam.across]
    points += [_at_once(instant, beam, load) for load in own if load.name in beam.across]
    if beam.length is not None:
        lines.append(_of_mass(instant, beam, beam.length))
    homeless = []
    for each in instant.exertions:
        if each.path[0] == "gravity" or (each.path[0] == "forces" and each.path[1] in loads):
            continue
        wrench = each.of_body[body]
        place = _place(instant, beam, each)
        if place is None:
            homeless.append((each.path[1], *wrench))
        else:
            points.append(PointAction(each.path[1], place, _resultant(instant, beam, *wrench)))
    return BeamActions(points, lines, homeless)


def place_of(instant: StateQuantities, beam: Beam, marker: Marker) -> Vec:
    """Return the place of a marker on the body of a beam along the axes of the beam."""
    return _local(instant, beam, subtract(instant.motion.point(marker), instant.motion.point(beam.axis)))


def _local(instant: StateQuantities, beam: Beam, in_body: Vec) -> Vec:
    rows = [instant.motion.state.vector(row) for row in beam.axis.pose.rotation]
    return apply_transposed((rows[0], rows[1], rows[2]), in_body)


def _resultant(instant: StateQuantities, beam: Beam, force: Vec, moment: Vec) -> Resultant:
    """Return a wrench (body axes, about the body's origin) along the axes of a beam, about its origin."""
    about = subtract(moment, cross(instant.motion.point(beam.axis), force))
    X, Y, _ = _local(instant, beam, force)
    return X, Y, _local(instant, beam, about)[2]


def _place(instant: StateQuantities, beam: Beam, each: Exertion) -> S | None:
    """Return where along a beam an element acts on it; None where it has no one place there."""
    motion, body = instant.motion, beam.axis.body
    row = None if each.row is None else motion.mechanism.rows[each.row]
    if row is not None and row.surfaces is not None:
        if not any(skin.place.body == body for skin in row.surfaces):
            return None
        rotation, origin = motion.poses[body]
        where = touch(row.surfaces, motion, instant.bodies).place
        in_body = apply_transposed(rotation, subtract(where, origin))
        return _local(instant, beam, subtract(in_body, motion.point(beam.axis)))[0]
    own = {marker.pose.position: marker for marker in each.points if marker.body == body}
    return place_of(instant, beam, next(iter(own.values())))[0] if len(own) == 1 else None


def _of_load(instant: StateQuantities, beam: Beam, load: LineLoad) -> LineAction:
    motion, forwards = instant.motion, load.name not in beam.backwards
    start = place_of(instant, beam, load.ends[0])
    (length,) = motion.state.values([load.length])

    def integral(s: S) -> Resultant:
        turned = motion.rotation(beam.axis.body)
        f, g = (_local(instant, beam, apply_transposed(turned, x)) for x in line_integrals(load, motion, s))
        return f[0], f[1], cross(start, f)[2] + (g[1] if forwards else -g[1])

    return LineAction(load.name, start[0], length, forwards, integral)


def _at_once(instant: StateQuantities, beam: Beam, load: LineLoad) -> PointAction:
    """Return what a load along a line square to the beam does at the place of that line."""
    motion, turned = instant.motion, instant.motion.rotation(beam.axis.body)
    start, end = (place_of(instant, beam, marker) for marker in load.ends)
    (length,) = motion.state.values([load.length])
    f, g = (_local(instant, beam, apply_transposed(turned, x)) for x in line_integrals(load, motion, length))
    along = scale(1 / length, subtract(end, start))
    return PointAction(load.name, start[0], (f[0], f[1], cross(start, f)[2] + cross(along, g)[2]))


def _of_mass(instant: StateQuantities, beam: Beam, length: Node) -> LineAction:
    """Return the weight and the inertia of a rod along its axis, m/l (g - a) for each metre."""
    motion, body = instant.motion, beam.axis.body
    (whole,) = motion.state.values([length])
    at_origin, alpha = instant.bodies[body]
    omega, along = motion.bodies[body].w_WB, (1, 0, 0)
    density = motion.masses[body].mass / whole
    first = scale(density, subtract(motion.bodies[body].gravity, at_origin))
    second = scale(-density, add(cross(alpha, along), cross(omega, cross(omega, along))))

    def integral(s: S) -> Resultant:
        X, Y, _ = add(scale(s, first), scale(s * s / 2, second))
        return X, Y, s * s / 2 * first[1] + s * s * s / 3 * second[1]

    return LineAction(motion.mechanism.bodies[body].name, 0, whole, True, integral)
