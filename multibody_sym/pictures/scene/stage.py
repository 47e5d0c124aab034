"""PlacedSystem: a system with its mechanism and numbers, from which figures are built; its view, places, surfaces."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field
from functools import cached_property
from itertools import pairwise, permutations
from typing import Any, Final

import numpy as np

from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.dynamics.start.state import closed_at
from multibody_sym.errors import ModelError, NoSolutionError
from multibody_sym.mechanics.load_records import PointForce
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion, motion_of, state_of
from multibody_sym.mechanics.references import BARE, References, moves_in_plane
from multibody_sym.mechanics.row_kinematics import leave_no_freedom, row_motions
from multibody_sym.mechanics.spanning_tree import body_part
from multibody_sym.model.bodies import FROM_AXIS, GROUND, Body, Surface, mass_of
from multibody_sym.model.constraints import (
    Coupler,
    Distance,
    Expression,
    Gear,
    OnCurve,
    PointInPlane,
    PointOnLine,
    PrescribedMotion,
    Rolling,
    Rope,
    VelocityConstraint,
)
from multibody_sym.model.contacts_and_impacts import ENOUGH, Contact, copies
from multibody_sym.model.fields import Element, Point
from multibody_sym.model.joints import Joint
from multibody_sym.model.steps import Curve
from multibody_sym.model.system import System
from multibody_sym.pictures.scene.items import (
    Anchor,
    Bowl,
    Disc,
    Face,
    Form,
    Item,
    Polyline,
    Sphere,
    Symbol,
    Values,
    Vector,
    View,
    across,
    unit,
    vector,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node


@dataclass(frozen=True)
class FrameOnBody:
    """A frame on a body: its position and the directions of its axes (columns), in the body's axes."""

    body: int
    point: Vector
    rotation: Floats

    @property
    def anchor(self) -> Anchor:
        """Its origin."""
        return Anchor(self.body, self.point)

    def turned(self, direction: Values) -> Vector:
        """Return a direction of the frame in the body's axes."""
        return vector(self.rotation @ np.asarray(direction, dtype=float))


@dataclass(frozen=True, eq=False)
class PlacedSystem:
    """A system, its mechanism, and the state (usually the start) that gives numbers to what it declares."""

    system: System
    mechanism: Mechanism
    begin: Start
    lengths: dict[str, float] = field(default_factory=dict)
    ended: list[Floats] = field(default_factory=list)
    """Points in the world of guides that have ends, beside which others need not be drawn further."""

    @cached_property
    def motion(self) -> Motion:
        """The motion of all bodies at the start."""
        begin, mechanism = self.begin, self.mechanism
        return motion_of(mechanism, state_of(mechanism, float, 0.0, begin.q, begin.u, begin.parameters))

    @cached_property
    def poses(self) -> Floats:
        """The poses of the bodies at the start, and of the world (nb + 1, 3, 4)."""
        return poses_of(self.motion)

    @cached_property
    def is_structure(self) -> bool:
        """Whether constraints leave no freedom, and nothing is driven."""
        mechanism = self.mechanism
        if mechanism.drives or mechanism.one_way or len(mechanism.rows) < len(mechanism.speeds):
            return False
        return leave_no_freedom(row_motions(self.motion), len(mechanism.speeds))

    @cached_property
    def known(self) -> Mapping[Node, float]:
        """What each name of the model stands for at the start."""
        found = {}
        for symbol, slot in self.mechanism.symbols.items():
            try:
                found[symbol] = float(self.motion.state.values([slot])[0])
            except (*UNDEFINED, KeyError):
                found[symbol] = math.nan
        return found

    @cached_property
    def references(self) -> References:
        """What references to points and frames stand for, in names."""
        numbers = {name: self.number_of(name) for name in (*self.system.bodies, GROUND)}
        return References(self.system, numbers, {})

    @cached_property
    def numbers(self) -> Mapping[str, int]:
        """The places of the bodies in tree order, by name."""
        return {body.name: k for k, body in enumerate(self.mechanism.bodies)}

    def number_of(self, body: str) -> int:
        """Return the place of a body; a ground at rest is -1."""
        return self.numbers.get(body, -1)

    def number(self, node: Node, otherwise: float = 0.0) -> float:
        """Return the value of an expression at the start, `otherwise` where it has none."""
        if node.shadow is not None:
            return float(node.shadow)
        try:
            found = evaluate_float([node], self.known)[0]
        except (*UNDEFINED, KeyError):
            return otherwise
        return found if math.isfinite(found) else otherwise

    def vector(self, point: Point) -> Vector:
        """Return the values of three expressions."""
        x, y, z = (self.number(node) for node in point)
        return x, y, z

    def place(self, reference: str) -> FrameOnBody:
        marker = self.references.marker(reference)
        rows = [self.vector(row) for row in marker.pose.rotation]
        return FrameOnBody(marker.body, self.vector(marker.pose.position), np.array(rows))

    def axis(self, place: FrameOnBody, axis: Point) -> Vector:
        """Return the unit vector along an axis that is given in a frame, in the axes of its body."""
        return place.turned(unit(self.vector(axis)))

    def body(self, reference: str) -> str:
        """Return the name of the body that a reference leads to."""
        return body_part(reference, self.system.bodies)[0]

    def is_ground(self, reference: str) -> bool:
        return self.body(reference) == GROUND

    def declared(self, body: str) -> Body:
        """Return what is declared of a body, nothing of one that is named only."""
        return self.system.bodies.get(body, BARE)

    def centre(self, body: str) -> Vector:
        """Return the centre of mass of a body, in its axes."""
        return self.vector(mass_of(self.declared(body)).com)

    def world(self, body: int, point: Values) -> Floats:
        return np.asarray(self.poses[body][:, :3] @ np.asarray(point, dtype=float) + self.poses[body][:, 3])

    def turned(self, body: int, direction: Values) -> Floats:
        """Return a direction of a body in the world at the start."""
        return np.asarray(self.poses[body][:, :3] @ np.asarray(direction, dtype=float))

    @cached_property
    def gravity(self) -> Floats:
        return np.array(self.vector(self.system.gravity))

    def load_on(self, body: str) -> Floats:
        """Return the sum of a body's weight and of the forces declared on it at the start (3) (N), in the world."""
        found: Floats = self.number(mass_of(self.declared(body)).mass) * self.gravity
        for load in self.mechanism.loads:
            if isinstance(load, PointForce) and load.path[0] == "forces" and load.at.body == self.number_of(body):
                found = found + np.array(self.motion.rotation(load.axes), dtype=float) @ self.vector_of(load.value)
        return found

    def vector_of(self, value: Point) -> Floats:
        """Return the values of three expressions of the mechanism (3), zero where they have none."""
        try:
            return np.array(self.motion.state.values(value), dtype=float)
        except (*UNDEFINED, KeyError):
            return np.zeros(3)

    def carrying(self, body: str) -> Joint | None:
        """Return the joint whose child a body is: the one of the tree, if there are several."""
        found = [joint for joint in self.system.joints.values() if self.body(joint.child) == body]
        return next((joint for joint in found if not joint.cut), found[0] if found else None)


def poses_of(motion: Motion) -> Floats:
    """Return the poses of the bodies, and of the world at the end (nb + 1, 3, 4)."""
    found = np.zeros((len(motion.bodies) + 1, 3, 4))
    found[-1, :, :3] = np.eye(3)
    for k, (rotation, place) in enumerate(motion.poses):
        found[k, :, :3] = rotation
        found[k, :, 3] = place
    return found


def drawn_start(mechanism: Mechanism, *, project: bool) -> Start:
    """Return the start of a mechanism, with contacts closed that it nearly closes."""
    base = mechanism.relative or mechanism
    begin = start(mechanism, project=project)
    if mechanism.relative is not None or not base.one_way:
        return begin
    try:
        return closed_at(base, begin, project=project)[1]
    except NoSolutionError:
        return begin


# ----------------------------------------------------------------------------------------------------------------------
# Views: the plane of a plane model against gravity, else a look from in front and above.


_AZIMUTHS: Final = (30.0, -60.0, 60.0, -30.0, 45.0, -45.0, 15.0, -15.0)
"""From where space may be seen (deg), the usual ones first: angles that do not hide axes behind each other."""
_ELEVATION: Final = 22.0
_APART: Final = 0.02
"""Places nearer than this part of the whole are one on the page."""
_CLEARLY: Final = 0.8
"""A later azimuth is taken where it is so much less crowded than those before."""
_ALONG: Final = 9
"""At so many places a bar is compared with others."""


def natural_view(stage: PlacedSystem, found: Mapping[str, Sequence[Vector]]) -> tuple[View, bool]:
    """Return the view that a scene is drawn in unless another is asked for, and whether all moves in its plane.

    `found` are the places of each body.
    """
    normal = np.array([0.0, 0.0, 1.0]) if moves_in_plane(stage.system) else _normal(stage)
    if normal is not None:
        # The view against a normal, gravity down where it lies in the plane.
        flat = stage.gravity - (stage.gravity @ normal) * normal
        if np.linalg.norm(flat) > 1e-9 * (1.0 + np.linalg.norm(stage.gravity)):
            up = -flat
        else:
            up = np.array([0.0, 1.0, 0.0]) if abs(normal[1]) < 0.5 else np.array([0.0, 0.0, 1.0])
        upward = np.array(unit(up))
        return View(unit(np.cross(upward, normal)), unit(upward)), True
    size = float(np.linalg.norm(stage.gravity))
    up = np.array([0.0, 0.0, 1.0]) if size == 0.0 else -stage.gravity / size
    bars = np.array([bar for bar in _bars(stage, found) if float(np.linalg.norm(bar[1] - bar[0])) > 0.0])
    views = [turned_view(azimuth, _ELEVATION, up) for azimuth in _AZIMUTHS]
    crowds = [_crowd(view, bars) for view in views] if len(bars) else [0.0]
    return views[next(k for k, crowd in enumerate(crowds) if _CLEARLY * crowd <= min(crowds))], False


def _bars(stage: PlacedSystem, found: Mapping[str, Sequence[Vector]]) -> Iterator[Floats]:
    """Yield the ends (2, 3) in the world of what is long: from place to place of each body, and between bodies."""
    for name in stage.system.bodies:
        first, *others = [stage.world(stage.number_of(name), point) for point in (*found[name], stage.centre(name))]
        for last in others if name != GROUND else ():
            yield np.array([first, last])
    for element in (*stage.system.constraints.values(), *stage.system.forces.values()):
        between = getattr(element, "between", None) or ()
        for one, other in pairwise(stage.place(end) for end in between):
            yield np.array([stage.world(place.body, place.point) for place in (one, other)])


def _crowd(view: View, bars: Floats) -> float:
    """Return how near to each other bars (n, 2, 3) are on the page that are apart in space, and how foreshortened."""
    parts = np.linspace(0.0, 1.0, _ALONG)[:, None]
    places = np.vstack([bar[0] + parts * (bar[1] - bar[0]) for bar in bars])
    of, (i, j) = np.repeat(np.arange(len(bars)), _ALONG), np.triu_indices(len(places), 1)
    i, j = i[of[i] != of[j]], j[of[i] != of[j]]
    size, seen = float(np.linalg.norm(np.ptp(places, axis=0))), view.project(places)
    apart = ((places[i] - places[j]) ** 2).sum(-1) / ((seen[i] - seen[j]) ** 2).sum(-1).clip((_APART * size) ** 2)
    shorter = ((bars[:, 1] - bars[:, 0]) ** 2).sum(-1) / (view.project(bars[:, 1] - bars[:, 0]) ** 2).sum(-1).clip(1e-9)
    return float((apart.mean() if len(apart) else 0.0) + shorter.clip(1.0, 10.0).mean())


def _normal(stage: PlacedSystem) -> Floats | None:
    """Return the axis about which everything turns, along which nothing slides and across which all places lie."""
    axes, ways, places = [], [], []
    for joint in stage.system.joints.values():
        if joint.cut:
            continue
        place = stage.place(joint.parent)
        places.append(stage.world(place.body, place.point))
        for step in joint.steps:
            axes += [stage.turned(place.body, stage.axis(place, axis)) for axis in step.turns]
            ways += [stage.turned(place.body, stage.axis(place, axis)) for axis in step.slides]
    if not axes:
        return None
    normal = axes[0] if axes[0].sum() > 0.0 else -axes[0]
    if np.allclose(normal, (0.0, 1.0, 0.0)):
        normal = -normal  # x to the right and z up are seen against y
    parallel = all(abs(float(axis @ normal)) > 1.0 - 1e-9 for axis in axes)
    level = all(abs(float(way @ normal)) < 1e-9 for way in ways)
    heights = [float(place @ normal) for place in places]
    tilted = abs(float(stage.gravity @ normal)) > 1e-9 * (1.0 + float(np.linalg.norm(stage.gravity)))
    flat = max(heights) - min(heights) < 1e-9 * (1.0 + max(map(abs, heights)))
    return normal if parallel and level and flat and not tilted else None


def turned_view(azimuth: float, elevation: float, up: Sequence[float] | Floats) -> View:
    """Return the view from an azimuth around `up` (deg, 0: x points at the reader) and an elevation above (deg)."""
    axis = np.array(unit(up))
    first = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 0.0, 1.0])
    first = np.array(unit(first - (first @ axis) * axis))
    second = np.cross(axis, first)
    a, e = math.radians(azimuth), math.radians(elevation)
    level = math.cos(a) * first + math.sin(a) * second
    towards = math.cos(e) * level + math.sin(e) * axis
    right = -math.sin(a) * first + math.cos(a) * second
    return View(unit(right), unit(np.cross(towards, right)))


# ----------------------------------------------------------------------------------------------------------------------
# The places of a body that the model names: where joints hold it, where ropes and springs are fixed, its points.


_SAME: Final = 1e-9
"""How far places of a model (m, by its size) may be apart and are drawn as one."""


def places(stage: PlacedSystem) -> dict[str, list[Vector]]:
    """Return by body where it is joined, held and marked, each place once, in the order of the declaration."""
    found: dict[str, list[Vector]] = {GROUND: [], **{name: [] for name in stage.system.bodies}}
    named: list[tuple[str, Vector]] = []
    for reference in references(stage):
        try:
            named.append((stage.body(reference), stage.place(reference).point))
        except ModelError:  # a reference to a surface, which is no place
            continue
    for name, declared in stage.system.bodies.items():
        named += [(name, stage.vector(point)) for point in declared.points.values()]
    for name, place in named:
        if not any(same(place, other) for other in found[name]):
            found[name].append(place)
    return found


def references(stage: PlacedSystem) -> Iterator[str]:
    """Yield what joints, constraints, pulleys and forces name of bodies."""
    system = stage.system
    for joint in system.joints.values():
        yield from (joint.parent, joint.child)
    for element in system.constraints.values():
        yield from ends(element, stage)
    for pulley in system.pulleys.values():
        yield pulley.at or pulley.body or GROUND
    for force in system.forces.values():
        yield from getattr(force, "between", None) or ()


def ends(element: Element, stage: PlacedSystem) -> tuple[str, ...]:
    """Return the points that a constraint holds."""
    match element:
        case Distance():
            return element.between
        case Rope():
            return tuple(name for name in element.path if name not in stage.system.pulleys)
        case PointOnLine():
            return element.point, element.line.through
        case PointInPlane():
            return element.point, element.plane.through
        case OnCurve():
            return (element.point,)
        case Coupler() | Expression() | Gear() | PrescribedMotion() | Rolling() | VelocityConstraint():
            return ()
    raise TypeError(f"no points are known of {type(element).__name__}")


def same(a: Vector, b: Vector) -> bool:
    """Return whether two places are one."""
    return float(np.abs(np.subtract(a, b)).max()) <= _SAME * (1.0 + float(np.abs(a).max()))


# ----------------------------------------------------------------------------------------------------------------------
# Surfaces of bodies and of ground as they are seen. A new kind of surface is one entry in _FORMS.


_SAMPLES: Final = 121


def surface_items(stage: PlacedSystem, name: str) -> Iterator[Item]:
    """Yield the surfaces of a body."""
    body = stage.declared(name)
    for word, surface in body.surfaces.items():
        path = ("bodies", name, "surfaces", word)
        form = _FORMS[surface.kind](stage, body, surface)
        yield Item("surface", f"{name}.{word}", word, path, stage.number_of(name), form, on_ground=name == GROUND)


def is_bead_on_ring(stage: PlacedSystem, name: str) -> bool:
    """Return whether a body is a particle on a ring, its parent: it turns about the axis of that, on its rim."""
    body, joint = stage.declared(name), stage.carrying(name)
    if joint is None or joint.kind != "revolute" or body.com is None or body.inertia is not None or body.points:
        return False
    place, own, parent = stage.place(joint.parent), stage.place(joint.child), stage.body(joint.parent)
    axis = np.array(stage.axis(own, joint.steps[0].turns[0]))
    arm = np.subtract(stage.centre(name), own.point)
    near = 1e-9 * stage.lengths.get("size", 1.0)
    if abs(float(arm @ axis)) > near:
        return False
    for item in surface_items(stage, parent):
        ring = item.form.hollow_disc
        if ring is not None and same(ring.centre, place.point):
            level = abs(float(np.array(ring.axis) @ np.array(stage.axis(place, joint.steps[0].turns[0])))) > 1.0 - 1e-9
            if level and abs(float(np.linalg.norm(arm)) - ring.radius) < near:
                return True
    return False


def is_solid(item: Item) -> bool:
    """Return whether a surface shows the whole of its body: what is round, a bar, or the face of a wedge."""
    return not item.on_ground and item.form.shows_body


def _plane(stage: PlacedSystem, body: Body, surface: Surface) -> Form:
    assert surface.plane is not None
    ends = None if surface.between is None else _ends(stage, body, surface.between)
    return Face(stage.vector(surface.plane), unit(stage.vector(surface.normal)), ends)


def _ends(stage: PlacedSystem, body: Body, places: tuple[object, ...]) -> tuple[Vector, Vector]:
    first, second = body.ends(places)  # type: ignore[arg-type]
    return stage.vector(first), stage.vector(second)


def _revolution(stage: PlacedSystem, body: Body, surface: Surface) -> Form:
    """Return the section through the axis, the profile on both sides; in space the profile to be turned about it."""
    assert surface.revolution is not None
    axis: Floats = np.array(unit(stage.vector(surface.axis)))
    side: Floats = np.array(across(axis))
    centre, reach = stage.vector(surface.centre), _reach(stage)
    ways = np.linspace(-reach, reach, _SAMPLES)
    if not moves_in_plane(stage.system):
        ways = np.linspace(0.0, reach, 25)
        heights = [_value(stage, surface.revolution, FROM_AXIS, way) for way in ways]
        known = [(float(w), h) for w, h in zip(ways, heights, strict=True) if np.isfinite(h)]
        return Bowl(centre, vector(axis), tuple(known))
    heights = [_value(stage, surface.revolution, FROM_AXIS, way) for way in ways]
    if side[0] < 0.0:
        side = -side
    points = [vector(np.array(centre) + way * side + h * axis) for way, h in zip(ways, heights, strict=True)]
    return Polyline(tuple(point for point in points if np.all(np.isfinite(point))))


def _guide(stage: PlacedSystem, body: Body, surface: Surface) -> Form:
    assert surface.guide is not None
    points = curve_points(stage, surface.guide, None, once=surface.outline is not None)
    centre = np.array(stage.vector(surface.centre))
    return Polyline(tuple(vector(centre + point) for point in points), closed=surface.outline is not None)


_FORMS: Final[Mapping[str, Callable[[PlacedSystem, Body, Any], Form]]] = {
    "disc": lambda stage, body, surface: Disc(
        stage.vector(surface.centre), unit(stage.vector(surface.axis)), stage.number(surface.radius), surface.inside
    ),
    "sphere": lambda stage, body, surface: Sphere(
        stage.vector(surface.centre), stage.number(surface.radius), surface.inside
    ),
    "plane": _plane,
    "segment": lambda stage, body, surface: Polyline(_ends(stage, body, surface.segment)),
    "point": lambda stage, body, surface: Symbol("place", stage.vector(surface.point)),
    "revolution": _revolution,
    "curve": _guide,
    "outline": _guide,
}
"""The form of each kind of surface."""


def _reach(stage: PlacedSystem) -> float:
    """Return how far from its middle a curve is drawn that has no ends (m)."""
    return 1.2 * stage.lengths.get("size", 1.0)


def curve_points(stage: PlacedSystem, curve: Curve, near: float | None, *, once: bool = False) -> list[Vector]:
    """Return points of a curve around the parameter `near`, or `once` around; where it is defined, from there on."""
    if curve.unit_of_parameter == "rad":
        middle = np.pi if once or near is None else near
        low, high = middle - np.pi, middle + np.pi
        if not once and near is not None:
            wider = _defined_points(stage, curve, (middle - 2.0 * np.pi, middle + 2.0 * np.pi), near)
            if all(_cusps(*wider)):  # a whole arch
                return _between_cusps(*wider)
    else:
        reach = max(_reach(stage), 1.3 * abs(near or 0.0))
        low, high = -reach, reach
    if once:
        return _defined_points(stage, curve, (low, high), low)[0]
    return _between_cusps(*_defined_points(stage, curve, (low, high), near))


def _defined_points(
    stage: PlacedSystem, curve: Curve, ends: tuple[float, float], near: float | None
) -> tuple[list[Vector], int]:
    """Return points of a curve where it is defined, and how many of them come before the parameter `near`."""
    found: list[Vector] = []
    start = 0
    for way in np.linspace(*ends, _SAMPLES):
        point = [_value(stage, node, curve.leaf, float(way)) for node in curve.place]
        if np.all(np.isfinite(point)):
            found.append(vector(point))
            start += way < (near if near is not None else ends[0])
    return found, start


def _between_cusps(points: list[Vector], start: int) -> list[Vector]:
    """Return the part of a curve around a place of it that ends where the curve turns straight back."""
    before, after = _cusps(points, start)
    return points[max(before, default=0) : min(after, default=len(points) - 1) + 1]


def _cusps(points: list[Vector], start: int) -> tuple[list[int], list[int]]:
    """Return where a curve turns straight back, before a place of it and after."""
    chords = np.diff(np.array(points), axis=0)
    back = [k + 1 for k in range(len(chords) - 1) if float(chords[k] @ chords[k + 1]) < 0.0]
    return [k for k in back if k <= start], [k for k in back if k > start]


def _value(stage: PlacedSystem, node: Node, leaf: Node, value: float) -> float:
    """Return an expression of a leaf at a value of it, nan where it has none."""
    try:
        return float(evaluate_float([node], {**stage.known, leaf: value})[0])
    except (*UNDEFINED, KeyError):
        return float("nan")


# ----------------------------------------------------------------------------------------------------------------------
# Ground where bodies touch it: the supports of a beam, the risers of stairs, what an impact strikes.


_NEAR: Final = 1e-6
"""How near to each other (m, by the size of the whole) places touch."""
_WORLD: Final = -1


def support_items(stage: PlacedSystem, bodies: list[Item]) -> Iterator[Item]:
    """Yield the supports of beams: a pin where a rod that lies on a plane never slips, a roller where that is smooth.

    Their items stand in place of the plane's, whose path they have. `bodies` are the items of bodies.
    """
    for word, surface in stage.declared(GROUND).surfaces.items():
        reference = f"{GROUND}.{word}"
        if surface.kind != "plane" or surface.plane is None or surface.between is not None:
            continue
        contacts = [contact for _, _, contact in copies(stage.system.contacts) if reference in contact.between]
        normal = np.array(unit(stage.vector(surface.normal)))
        places = [place for place in (_place(stage, each, reference) for each in contacts) if place is not None]
        if len(places) < max(len(contacts), 2) or len({body for body, _ in places}) != 1:
            continue
        still = (c.static in (None, ENOUGH) and c.kinetic is None and c.restitution is None for c in contacts)
        if not all(still) or all(c.static is None for c in contacts):
            continue
        if not _lies_still(stage, places[0][0], bodies, normal):
            continue
        for contact, (_, point) in zip(contacts, places, strict=True):
            if abs(float((np.array(point) - stage.vector(surface.plane)) @ normal)) < _NEAR * stage.lengths["size"]:
                sign = Symbol("roller" if contact.static is None else "support", point, along=vector(-normal))
                yield Item("ground", reference, "", ("bodies", GROUND, "surfaces", word), _WORLD, sign, on_ground=True)


def _place(stage: PlacedSystem, contact: Contact, reference: str) -> tuple[int, Vector] | None:
    """Return the body and the place in the world of the point that touches a surface; None of a surface."""
    (end,) = (each for each in contact.between if each != reference)
    try:
        place = stage.place(end)
    except ModelError:
        return None
    return place.body, vector(stage.world(place.body, place.point))


def _lies_still(stage: PlacedSystem, body: int, bodies: list[Item], normal: Floats) -> bool:
    """Return whether a body is a rod along a plane that does not move at the start."""
    lines = [item.form.open_line for item in bodies if item.body == body and item.role == "body"]
    if len(lines) != 1 or lines[0] is None:
        return False
    heights = [float(stage.world(body, point) @ normal) for point in lines[0].points]
    moving = stage.motion.bodies[body]
    still = float(np.abs([*moving.v_WB, *moving.w_WB]).max()) < _NEAR
    return still and float(np.ptp(heights)) < _NEAR * stage.lengths["size"]


def riser_items(stage: PlacedSystem) -> Iterator[Item]:
    """Yield the upright faces of stairs: where a tread, a level segment of ground, ends above the end of the next."""
    down = -np.array([0.0, 1.0, 0.0]) if not np.any(stage.gravity) else np.array(unit(stage.gravity))
    treads = []
    for surface in stage.declared(GROUND).surfaces.values():
        if surface.segment is not None:
            ends = [np.array(stage.vector(end)) for end in stage.declared(GROUND).ends(surface.segment)]
            if abs(float((ends[1] - ends[0]) @ down)) < _NEAR * stage.lengths["size"]:
                treads.append(ends)
    for upper, lower in permutations(treads, 2):
        for top, other in permutations(upper):
            for foot, far in permutations(lower):
                height, onward = float((foot - top) @ down), float((top - other) @ (far - foot))
                aside = float(np.linalg.norm(foot - top - height * down))
                if height > 0.0 and onward > 0.0 and aside < _NEAR * stage.lengths["size"]:
                    # hatched, as all lines of ground are, to the right of its way, where the upper tread is
                    right = float(np.cross(foot - top, other - top)[2]) < 0.0
                    points = (vector(top), vector(foot)) if right else (vector(foot), vector(top))
                    yield Item("surface", "riser", "", ("bodies", GROUND), _WORLD, Polyline(points), on_ground=True)


def struck_items(stage: PlacedSystem) -> Iterator[Item]:
    """Yield what stands still and is struck by a point of a body in a declared impact."""
    for name, impact in (stage.system.impact.strikes if stage.system.impact is not None else {}).items():
        if impact.between is None:
            continue
        first, second = (stage.place(end) for end in impact.between)
        body, still, side = (first, second, -1.0) if second.body == _WORLD else (second, first, 1.0)
        if still.body != _WORLD or body.body == _WORLD:
            continue
        speed = velocity_of(stage, body)
        way = speed if impact.normal is None else side * np.array(stage.vector(impact.normal))
        ahead = unit(-way if float(way @ speed) < 0.0 else way)
        sign = Symbol("struck", still.point, along=ahead)
        assert stage.system.impact is not None
        yield Item("ground", name, "", stage.system.impact.path(name), _WORLD, sign, (_WORLD, body.body), True)


def edge_items(stage: PlacedSystem) -> Iterator[Item]:
    """Yield the edges of ground, such as of a table, that straight surfaces of bodies touch where no plane is."""
    if any(surface.kind == "plane" for surface in stage.declared(GROUND).surfaces.values()):
        return  # the edge is a step of that plane
    for declared, name, contact in copies(stage.system.contacts):
        for end, other in (contact.between, contact.between[::-1]):
            body, word = stage.body(other), other.rpartition(".")[2]
            surface = stage.declared(body).surfaces.get(word)
            point = stage.declared(GROUND).points.get(end.removeprefix(f"{GROUND}."))
            if point is not None and surface is not None and surface.kind in ("plane", "segment") and surface.normal:
                number = stage.number_of(body)
                away = vector(stage.turned(number, unit(stage.vector(surface.normal))))
                if abs(away[2]) < _NEAR:
                    sign = Symbol("struck", stage.vector(point), along=away)
                    yield Item("ground", name, "", ("contacts", declared), _WORLD, sign, (_WORLD, number), True)


def velocity_of(stage: PlacedSystem, place: FrameOnBody) -> Floats:
    """Return the velocity of a place of a body at the start (3), in the world."""
    moving = stage.motion.bodies[place.body]
    own = np.array(moving.v_WB, dtype=float) + np.cross(np.array(moving.w_WB, dtype=float), place.point)
    return stage.turned(place.body, own)
