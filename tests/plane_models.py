"""Plane systems as plain numbers: what a brute-force run and a model file are both made of."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

GROUND = -1


@dataclass(frozen=True)
class Place:
    """A point (m) in the axes of a body, given by its number, or of the ground."""

    body: int
    x: float = 0.0
    y: float = 0.0


@dataclass(frozen=True)
class Joint:
    """How a body is carried: a `point`, a `planar` body, on a `slide` at an angle (rad), on a `hinge`.

    A slide or hinge begins at `parent`; `lower` and `upper` are stops, with one coefficient of restitution.
    """

    kind: str
    parent: Place = Place(GROUND)
    angle: float = 0.0
    lower: float | None = None
    upper: float | None = None
    restitution: float = 0.0


@dataclass(frozen=True)
class Body:
    """A body with its centre of mass at (com, 0), a `radius` if it is a disc; q, u are those of its joint."""

    name: str
    mass: float
    inertia: float
    joint: Joint
    q: tuple[float, ...]
    u: tuple[float, ...]
    com: float = 0.0
    radius: float = 0.0


@dataclass(frozen=True)
class Plane:
    """A plane of the ground through (x, y), whose normal has an angle (rad)."""

    name: str
    x: float
    y: float
    angle: float

    @property
    def normal(self) -> tuple[float, float]:
        return math.cos(self.angle), math.sin(self.angle)


@dataclass(frozen=True)
class Contact:
    """Two ends that touch: a place with the radius about it, and a plane or another such place."""

    name: str
    first: Place
    second: Place | Plane
    radii: tuple[float, float]
    static: float
    kinetic: float
    restitution: float
    touches: bool = False


@dataclass(frozen=True)
class Rope:
    """A rope that may go slack, from place to place; places between its ends are the ground's."""

    name: str
    path: tuple[Place, ...]
    length: float
    restitution: float


@dataclass(frozen=True)
class Spring:
    first: Place
    second: Place
    stiffness: float
    damping: float
    length: float


@dataclass(frozen=True)
class Push:
    """A force (N) on the centre of mass and a torque (N m), constant plus amplitude times sin(rate t)."""

    body: int
    force: tuple[float, float]
    torque: float
    amplitude: tuple[float, float]
    rate: float


@dataclass(frozen=True)
class Model:
    name: str
    gravity: float
    bodies: tuple[Body, ...]
    planes: tuple[Plane, ...] = ()
    contacts: tuple[Contact, ...] = ()
    ropes: tuple[Rope, ...] = ()
    springs: tuple[Spring, ...] = ()
    pushes: tuple[Push, ...] = ()
    t_end: float = 1.0


def text(model: Model) -> str:
    """Return the model as a file."""
    return _Writer(model).text()


class _Writer:
    def __init__(self, model: Model) -> None:
        self.model = model
        self.points: dict[int, dict[tuple[float, float], str]] = {}

    def text(self) -> str:
        model = self.model
        parts = ["contacts", *map(self._contact, model.contacts)]
        ropes = ["constraints", *map(self._rope, model.ropes)]
        springs = [self._spring(k, spring) for k, spring in enumerate(model.springs)]
        forces = ["forces", *springs, *(line for k, push in enumerate(model.pushes) for line in self._push(k, push))]
        joints = ["joints", *map(self._joint, model.bodies)]
        bodies = ["bodies", self._ground(), *(self._body(k, body) for k, body in enumerate(model.bodies))]
        lines = ["multibody_sym: 1", f"name: {model.name}", f"gravity: [0, {-model.gravity!r}, 0]"]
        for title, *entries in (bodies, joints, parts, ropes, forces):
            lines += [f"{title}:", *(f"  {entry}" for entry in entries)] if entries else []
        return "\n".join(lines) + "\n"

    def _place(self, place: Place) -> str:
        name = "ground" if place.body == GROUND else self.model.bodies[place.body].name
        if (place.x, place.y) == (0.0, 0.0):
            return name
        known = self.points.setdefault(place.body, {})
        return f"{name}.{known.setdefault((place.x, place.y), f'p{len(known)}')}"

    def _ground(self) -> str:
        planes = [
            f"{p.name}: {{plane: [{p.x!r}, {p.y!r}, 0], normal: [{p.normal[0]!r}, {p.normal[1]!r}, 0]}}"
            for p in self.model.planes
        ]
        return f"ground: {{{self._points(GROUND)}, surfaces: {{{', '.join(planes)}}}}}"

    def _points(self, body: int) -> str:
        points = (f"{name}: [{x!r}, {y!r}, 0]" for (x, y), name in self.points.get(body, {}).items())
        return f"points: {{{', '.join(points)}}}"

    def _body(self, number: int, body: Body) -> str:
        turns = f", inertia: {{Izz: {body.inertia!r}}}" if body.joint.kind != "point" else ""
        rim = f", surfaces: {{rim: {{disc: {body.radius!r}}}}}" if body.radius else ""
        return f"{body.name}: {{mass: {body.mass!r}, com: [{body.com!r}, 0, 0]{turns}{rim}, {self._points(number)}}}"

    def _joint(self, body: Body) -> str:
        joint, name = body.joint, body.name
        q = {"point": "[x{0}, y{0}]", "planar": "[x{0}, y{0}, a{0}]", "slide": "s{0}", "hinge": "a{0}"}[joint.kind]
        kind = {"slide": "prismatic", "hinge": "revolute"}.get(joint.kind, joint.kind)
        axis = f", axis: [{math.cos(joint.angle)!r}, {math.sin(joint.angle)!r}, 0]" if joint.kind == "slide" else ""
        stops = {"lower": joint.lower, "upper": joint.upper}
        limits = ", ".join(f"{side}: {value!r}" for side, value in stops.items() if value is not None)
        limits = f", limits: {{{limits}, restitution: {joint.restitution!r}}}" if limits else ""
        start = f"initial: {{q: {list(body.q)!r}, u: {list(body.u)!r}}}"
        parent = self._place(joint.parent)
        return f"J{name}: {{type: {kind}, parent: {parent}, child: {name}{axis}, q: {q.format(name)}, {start}{limits}}}"

    def _end(self, place: Place | Plane, radius: float) -> str:
        if isinstance(place, Plane):
            return f"ground.{place.name}"
        return f"{self.model.bodies[place.body].name}.rim" if radius else self._place(place)

    def _contact(self, contact: Contact) -> str:
        ends = self._end(contact.first, contact.radii[0]), self._end(contact.second, contact.radii[1])
        rubs = f", static: {contact.static!r}, kinetic: {contact.kinetic!r}" if contact.static else ""
        apart = "" if contact.touches else ", open: true"
        between = f"between: [{', '.join(ends)}]"
        return f"{contact.name}: {{{between}, restitution: {contact.restitution!r}{rubs}{apart}}}"

    def _rope(self, rope: Rope) -> str:
        path = ", ".join(map(self._place, rope.path))
        length = f"length: {rope.length!r}, restitution: {rope.restitution!r}"
        return f"{rope.name}: {{type: rope, path: [{path}], {length}, slack: true}}"

    def _spring(self, number: int, spring: Spring) -> str:
        between = f"{self._place(spring.first)}, {self._place(spring.second)}"
        numbers = f"stiffness: {spring.stiffness!r}, damping: {spring.damping!r}, length: {spring.length!r}"
        return f"f{number}: {{type: spring_damper, between: [{between}], {numbers}}}"

    def _push(self, number: int, push: Push) -> list[str]:
        name = self.model.bodies[push.body].name
        force = ", ".join(
            f'"{constant!r} + {size!r}*sin({push.rate!r}*t)"'
            for constant, size in zip(push.force, push.amplitude, strict=True)
        )
        lines = [f"g{number}: {{type: force, on: {name}, value: [{force}, 0]}}"]
        if push.torque:
            lines.append(f"h{number}: {{type: torque, on: {name}, value: [0, 0, {push.torque!r}]}}")
        return lines


# --- random models ------------------------------------------------------------------------------------------------


def random_model(seed: int) -> Model:
    """Return a random model: 1 to 4 bodies between planes, with contacts, stops, slack ropes, springs and pushes."""
    return _Maker(seed).model()


class _Maker:
    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng([seed, 27])
        self.seed = seed
        pools = (0.0,), (0.0, 0.5), (0.5,), (0.0, 0.5, 1.0), (1.0,)
        self.pool = pools[int(self.rng.choice(5, p=[0.35, 0.2, 0.15, 0.2, 0.1]))]
        self.half = self._choice(0.7, 1.5)
        self.bodies: list[Body] = []
        self.planes = self._planes()
        self.contacts: list[Contact] = []

    def _uniform(self, low: float, high: float) -> float:
        return round(float(self.rng.uniform(low, high)), 4)

    def _chance(self, part: float) -> bool:
        return bool(self.rng.random() < part)

    def _choice(self, *values: float) -> float:
        return float(self.rng.choice(values))

    def _planes(self) -> list[Plane]:
        tilt = self._uniform(-0.5, 0.5) if self._chance(0.5) else 0.0
        planes = [Plane("floor", 0.0, 0.0, math.pi / 2 + tilt)]
        if self._chance(0.7):
            planes.append(Plane("right", self.half, 0.0, math.pi + self._uniform(-0.3, 0.3)))
        if self._chance(0.5):
            planes.append(Plane("left", -self.half, 0.0, self._uniform(-0.3, 0.3)))
        return planes

    def model(self) -> Model:
        for number in range(int(self.rng.choice([1, 2, 3, 4], p=[0.15, 0.25, 0.3, 0.3]))):
            self._add_body(number)
        if not self.bodies:
            self._add_body(0)
        count = len(self.bodies)
        pushes = tuple(self._push(k) for k in range(count) if self._chance(0.35))
        ropes = tuple(self._rope(k) for k in range(2) if self._chance(0.4))
        springs = tuple(self._spring() for _ in range(2) if self._chance(0.3))
        gravity = 9.81 if self._chance(0.85) else 0.0
        t_end = self._uniform(0.7, 2.0)
        parts = tuple(self.bodies), tuple(self.planes), tuple(self.contacts), ropes, springs, pushes
        return Model(f"plane{self.seed}", gravity, *parts, t_end)

    # --- bodies

    def _add_body(self, number: int) -> None:
        kinds = ["point", "disc", "rod", "slider", "arm"]
        kind = str(self.rng.choice(kinds, p=[0.25, 0.35, 0.15, 0.15, 0.1]))
        for _ in range(200):
            body = getattr(self, f"_{kind}")(number)
            if self._is_free(body):
                self.bodies.append(body)
                return

    def _across(self) -> float:
        return self._uniform(-0.8 * self.half, 0.8 * self.half)

    def _point(self, number: int) -> Body:
        q = self._across(), self._uniform(0.2, 1.8)
        u = self._uniform(-3, 3), self._uniform(-2, 2)
        if self._chance(0.4):
            q, u = (x[:2] for x in self._on_floor(0.0, (*u, 0.0)))
        return Body(f"p{number}", self._uniform(0.3, 3), 0.0, Joint("point"), q, u)

    def _disc(self, number: int) -> Body:
        q = self._across(), self._uniform(0.3, 1.8), 0.0
        radius, mass = self._uniform(0.08, 0.3), self._uniform(0.3, 3)
        u = self._uniform(-3, 3), self._uniform(-2, 2), self._uniform(-10, 10)
        if self._chance(0.4):
            q, u = self._on_floor(radius, u)
        return Body(f"d{number}", mass, mass * radius**2 / 2, Joint("planar"), q, u, radius=radius)

    def _on_floor(
        self, height: float, u: tuple[float, float, float]
    ) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Return a place and speeds of what touches the floor: at rest, rolling or sliding."""
        (nx, ny), along = self.planes[0].normal, self._across()
        speed, turning = (0.0, 0.0) if self._chance(0.3) else (u[0], u[2])
        if height and self._chance(0.5):
            turning = -speed / height
        q = ny * along + nx * height, -nx * along + ny * height, 0.0
        return q, (ny * speed, -nx * speed, turning)

    def _rod(self, number: int) -> Body:
        q = self._across(), self._uniform(0.5, 1.8), self._uniform(-1.5, 1.5)
        length, mass = self._uniform(0.3, 0.9), self._uniform(0.5, 3)
        u = self._uniform(-2, 2), self._uniform(-2, 2), self._uniform(-3, 3)
        if self._chance(0.3):
            q, u = self._on_floor(0.0, (u[0], 0.0, 0.0))
            q = *q[:2], self.planes[0].angle - math.pi / 2
        return Body(f"r{number}", mass, mass * length**2 / 12, Joint("planar"), q, u)

    def _slider(self, number: int) -> Body:
        place = Place(GROUND, self._across(), self._uniform(0.4, 1.5))
        ends = self._uniform(-0.6, -0.1), self._uniform(0.1, 0.6)
        joint = Joint("slide", place, self._uniform(-1.5, 1.5), *ends, restitution=self._choice(*self.pool))
        radius = self._uniform(0.08, 0.25) if self._chance(0.5) else 0.0
        mass = self._uniform(0.3, 3)
        q, u = (self._uniform(0.9 * ends[0], 0.9 * ends[1]),), (self._uniform(-3, 3),)
        return Body(f"s{number}", mass, 0.01 * mass, joint, q, u, radius=radius)

    def _arm(self, number: int) -> Body:
        length, mass = self._uniform(0.3, 0.9), self._uniform(0.5, 3)
        before = self.bodies[-1] if self.bodies else None
        if before is not None and before.name[0] == "a" and self._chance(0.6):
            joint = Joint("hinge", Place(len(self.bodies) - 1, 2 * before.com))
        else:
            place = Place(GROUND, self._across(), self._uniform(0.3, 1.2))
            first, second = (self._uniform(-2, -0.5), self._uniform(0.5, 2)) if self._chance(0.7) else (None, None)
            joint = Joint("hinge", place, 0.0, first, second, self._choice(*self.pool))
        q, u = (self._uniform(-0.45, 0.45),), (self._uniform(-4, 4),)
        return Body(f"a{number}", mass, mass * length**2 / 12, joint, q, u, com=length / 2)

    # --- contacts

    def _is_free(self, body: Body) -> bool:
        """Return whether a body is inside the planes and apart from the others; note its contacts if so."""
        number = len(self.bodies)
        all_bodies = [*self.bodies, body]
        new = list[Contact]()
        for place, radius in _ends(number, body):
            x, y = position(all_bodies, place)
            for plane in self.planes:
                gap = (x - plane.x) * plane.normal[0] + (y - plane.y) * plane.normal[1] - radius
                touches = abs(gap) < 1e-12
                if gap < 0.02 and not touches:
                    return False
                if body.joint.kind in ("point", "planar") or self._chance(0.5):
                    new.append(
                        self._contact(f"{body.name}_{plane.name}_{len(new)}", place, plane, (radius, 0.0), touches)
                    )
            for other, known in enumerate(self.bodies):
                if known.joint.kind == body.joint.kind == "slide" or body.joint.parent.body == other:
                    continue
                for there, size in _ends(other, known):
                    gap = math.dist((x, y), position(all_bodies, there)) - radius - size
                    if not radius and not size:
                        continue
                    if gap < 0.02:
                        return False
                    if self._chance(0.8):
                        new.append(self._contact(f"{body.name}_{known.name}_{len(new)}", place, there, (radius, size)))
        if len(self.contacts) + len(new) > 9:
            return False
        self.contacts += new
        return True

    def _contact(
        self, name: str, first: Place, second: Place | Plane, radii: tuple[float, float], touches: bool = False
    ) -> Contact:
        static = self._choice(0, 0.1, 0.3, 0.7, 1.5)
        kinetic = round(0.8 * static, 4) if self._chance(0.2) else static
        return Contact(name, first, second, radii, static, kinetic, self._choice(*self.pool), touches)

    # --- ropes, springs, pushes

    def _some_place(self) -> Place:
        number = int(self.rng.integers(len(self.bodies)))
        ends = _ends(number, self.bodies[number])
        return ends[int(self.rng.integers(len(ends)))][0]

    def _hook(self) -> Place:
        return Place(GROUND, self._uniform(-1.2, 1.2), self._uniform(1.9, 2.5))

    def _rope(self, number: int) -> Rope:
        first, second = self._some_place(), self._some_place()
        if first.body == second.body:
            second = self._hook()
        path = (first, self._hook(), second) if self._chance(0.4) else (first, second)
        places = [position(self.bodies, place) for place in path]
        now = sum(math.dist(a, b) for a, b in itertools.pairwise(places))
        return Rope(f"rope{number}", path, round(now * self._uniform(1.1, 1.5), 4), self._choice(*self.pool))

    def _spring(self) -> Spring:
        first, second = self._some_place(), self._some_place()
        if first.body == second.body:
            second = self._hook()
        damping = self._uniform(0, 2) if self._chance(0.5) else 0.0
        return Spring(first, second, self._uniform(5, 80), damping, self._uniform(0.2, 1))

    def _push(self, body: int) -> Push:
        turns = self.bodies[body].joint.kind in ("planar", "hinge")
        force = self._uniform(-8, 8), self._uniform(-8, 8)
        amplitude = (self._uniform(-15, 15), self._uniform(-15, 15)) if self._chance(0.6) else (0.0, 0.0)
        return Push(body, force, self._uniform(-1, 1) if turns else 0.0, amplitude, self._uniform(2, 15))


def _ends(number: int, body: Body) -> list[tuple[Place, float]]:
    """Return the places of a body that touch others, with the radius about each."""
    if body.name[0] == "r":
        half = math.sqrt(3 * body.inertia / body.mass)
        return [(Place(number, -half), 0.0), (Place(number, half), 0.0)]
    return [(Place(number, 2 * body.com), 0.0)] if body.com else [(Place(number), body.radius)]


def pose(bodies: list[Body] | tuple[Body, ...], number: int) -> tuple[float, float, float]:
    """Return the place and the angle of a body's axes at the start."""
    if number == GROUND:
        return 0.0, 0.0, 0.0
    body = bodies[number]
    if body.joint.kind in ("point", "planar"):
        return (*body.q, 0.0)[:3]
    x, y = position(bodies, body.joint.parent)
    if body.joint.kind == "slide":
        return x + body.q[0] * math.cos(body.joint.angle), y + body.q[0] * math.sin(body.joint.angle), 0.0
    return x, y, pose(bodies, body.joint.parent.body)[2] + body.q[0]


def position(bodies: list[Body] | tuple[Body, ...], place: Place) -> tuple[float, float]:
    """Return where a place of a body is at the start."""
    x, y, angle = pose(bodies, place.body)
    c, s = math.cos(angle), math.sin(angle)
    return x + c * place.x - s * place.y, y + s * place.x + c * place.y
