"""Seeded random systems and states, drawn from the tables of joints, forces and constraints that the model knows."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.formalisms.equations import massless_speeds
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.mechanics.forces import applied_forces, span
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion, State, motion_of, state_of
from multibody_sym.mechanics.points import direction
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.mechanics.row_records import ContactRow, PlaneSurface, Rim, RopeRow
from multibody_sym.model.bodies import Body, Frame, GroundMotion, Surface, Turn
from multibody_sym.model.constraints import (
    CONSTRAINTS,
    Coupler,
    Distance,
    Expression,
    Gear,
    Line,
    OnCurve,
    Plane,
    PointInPlane,
    PointOnLine,
    PrescribedMotion,
    Pulley,
    Rolling,
    Rope,
    VelocityConstraint,
)
from multibody_sym.model.fields import Choice, Direction, Element, Field, ListOf, OneOf, Scalar, Text, fields_of
from multibody_sym.model.forces import (
    FORCES,
    Coulomb,
    Damper,
    Distributed,
    Drag,
    Force,
    Friction,
    Gravitation,
    Motor,
    Potential,
    Pull,
    SpringDamper,
    Torque,
)
from multibody_sym.model.joints import (
    JOINTS,
    Angles,
    CurveJoint,
    Direct,
    Fixed,
    Initial,
    Joint,
    MovingJoint,
    PointJoint,
)
from multibody_sym.model.parameters import Parameter, Table
from multibody_sym.model.steps import Curve, Follow, Rotate, Translate
from multibody_sym.model.system import System, variable
from multibody_sym.scalars.arrays import UNDEFINED

Random = np.random.Generator


@dataclass(frozen=True)
class Case:
    """A random system with its mechanism and parameter vector."""

    seed: int
    system: System
    mechanism: Mechanism
    parameters: list[float]

    def motion(self, t: float, q: list[float], u: list[float]) -> Motion:
        return motion_of(self.mechanism, self.state(t, q, u))

    def state(self, t: float, q: list[float], u: list[float]) -> State:
        return state_of(self.mechanism, float, t, q, u, self.parameters)


@lru_cache(maxsize=512)
def random_case(
    seed: int, *, bodies: tuple[int, int] = (1, 12), rows: bool = False, extreme: bool = False
) -> Case:
    """Return a random case; `rows` asks for at least one row, and all its rows are independent where it is tried.

    Masses are 1e-3 to 1e3; `extreme` ones 1e-6 to 1e6, with links of no mass at all between bodies that have one.
    """
    rng = np.random.default_rng([seed, rows, 1] if extreme else [seed, rows])
    motions, potentials = (np.random.default_rng([seed, rows, k]) for k in (2, 3))
    while True:
        system = _Builder(rng, int(rng.integers(bodies[0], bodies[1] + 1)), rows, extreme, motions, potentials).system()
        resolved = mechanism(system)
        if not resolved.speeds or massless_speeds(resolved):
            continue
        if not rows or (resolved.rows and len(resolved.rows) < len(resolved.speeds)):
            case = Case(seed, system, resolved, parameter_values(resolved, {}))
            at_rest = case.motion(0.0, random_coordinates(rng, resolved), [0.0] * len(resolved.speeds))
            state = _tried_state(rng, case) if _has_inertia(at_rest) else None
            if state is not None and _independent(case, state):
                return case


def _independent(case: Case, state: tuple[float, list[float], list[float]]) -> bool:
    jacobian = np.array([row.jacobian for row in row_motions(case.motion(*state))], dtype=float)
    if not len(jacobian):
        return True
    lengths = np.linalg.norm(jacobian, axis=1, keepdims=True)
    return bool(lengths.min() > 1e-3 and np.linalg.svd(jacobian / lengths, compute_uv=False)[-1] > 1e-3)


def random_state(rng: Random, case: Case) -> tuple[float, list[float], list[float]]:
    """Return t, q, u at which everything declared has a value."""
    state = _tried_state(rng, case)
    assert state is not None, f"seed {case.seed}: no state at which everything has a value"
    return state


def _tried_state(rng: Random, case: Case) -> tuple[float, list[float], list[float]] | None:
    for _ in range(50):
        u = _floats(rng.uniform(-2, 2, len(case.mechanism.speeds)))
        state = float(rng.uniform(0, 3)), random_coordinates(rng, case.mechanism), u
        try:
            motion = case.motion(*state)
            row_motions(motion)
            applied_forces(motion)
        except UNDEFINED:
            continue
        apart = all(_apart(motion, x) for x in (*case.mechanism.loads, *case.mechanism.rows))
        if apart and _is_regular(motion) and _has_inertia(motion):
            return state
    return None


def _is_regular(motion: Motion) -> bool:
    """Return whether the freedoms of each joint are independent here: no two angles about one axis."""
    freedoms = [np.hstack([body.linear, body.angular]).astype(float) for body in motion.bodies if body.linear]
    return all(np.linalg.svd(freedom, compute_uv=False)[-1] > 0.05 for freedom in freedoms)


def _has_inertia(motion: Motion) -> bool:
    """Return whether the mass matrix is regular here: no massless body at the end of a branch or on a line."""
    if all(mass.mass for mass in motion.masses):
        return True
    matrix = np.array(mass_matrix(motion), dtype=float)
    size = np.sqrt(matrix.diagonal())
    return bool((size > 0).all() and np.linalg.eigvalsh(matrix / np.outer(size, size))[0] > 1e-8)


def _apart(motion: Motion, part: Any) -> bool:
    """Return whether the points that a load or row joins do not coincide, and a disc does not lie flat on its plane."""
    if isinstance(part, ContactRow) and isinstance(part.skins[0], Rim) and isinstance(part.skins[1], PlaneSurface):
        wheel, plane = part.skins
        normal, axis = direction(motion, plane.place, plane.normal), direction(motion, wheel.place, wheel.axis)
        return float(np.linalg.norm(np.cross(normal, axis))) > 1e-2
    markers = [bend.at for bend in part.path] if isinstance(part, RopeRow) else getattr(part, "ends", ())
    return all(span(motion, pair)[0] > 1e-3 for pair in pairwise(markers))


def random_coordinates(rng: Random, resolved: Mechanism) -> list[float]:
    """Return coordinates: angles all round, lengths within a metre, unit quaternions."""
    sizes = {"rad": math.pi, "m": 1.0, "": 1.0}
    q = np.array([rng.uniform(-1, 1) * sizes[c.unit] for c in resolved.coordinates])
    for body in resolved.bodies:
        for places in body.quaternions:
            quaternion = rng.normal(size=4)
            q[list(places)] = quaternion / np.linalg.norm(quaternion)
    return _floats(q)


def _floats(values: Any) -> list[float]:
    return [float(x) for x in values]


@dataclass
class _Builder:
    """Draws one system; planar ones move in the x-y plane, where ropes may run over wheels.

    `motions` draws what is prescribed and `potentials` those, so that the systems without do not depend on them.
    """

    rng: Random
    count: int
    constrained: bool
    extreme: bool
    motions: Random
    potentials: Random

    def __post_init__(self) -> None:
        self.planar = self.rng.random() < (0.5 if self.constrained else 0.25)
        self.prescribes = bool(self.motions.random() < 0.4)
        self.guides = np.random.default_rng(int(deepcopy(self.motions).integers(2**32)))
        self.names = [f"b{k}" for k in range(1, self.count + 1)]
        self.bodies: dict[str, Body] = {"ground": self.ground()}
        self.joints: dict[str, Joint] = {}
        self.parameters: dict[str, Parameter] = {}
        self.coordinates: list[str] = []
        self.speeds: list[str] = []

    def system(self) -> System:
        g = self.parameter("g", 9.81)
        directions: list[list[Any]] = [[0, -g, 0]] if self.planar else [[0, -g, 0], [0.3 * g, 0, -g], [0, 0, 0]]
        for k, name in enumerate(self.names):
            self.add_joint(f"j{k + 1}", self.some(self.parents(k)), name)
        inputs = {f"w{k}": self.input() for k in range(int(self.rng.integers(0, 3)))}
        rows = self.numbered("c", 1, 3) if self.constrained and self.speeds else []
        pulleys = {f"P{k}": self.pulley() for k in range(2)} if self.constrained else {}
        return System(
            "random",
            gravity=self.some(directions),
            parameters=self.parameters,
            bodies=self.shuffled(self.bodies),
            joints=self.shuffled(self.joints),
            forces={**self.elements(FORCES, _FORCES, self.numbered("f", 0, 4), inputs), **self.further_forces(inputs)},
            constraints=self.elements(CONSTRAINTS, _CONSTRAINTS, rows, pulleys),
            pulleys=pulleys,
            inputs=inputs,
            outputs={"energy": "total_energy()"},
        )

    def parents(self, k: int) -> list[str]:
        """Return what may carry body number k: the link before it, where that has no mass to move by itself."""
        before = self.names[:k][-3:]
        return before[-1:] if before and self.bodies[before[-1]].mass is None else ["ground", *before]

    # numbers

    def some(self, choices: Any) -> Any:
        return choices[int(self.rng.integers(len(choices)))]

    def uniform(self, low: float = -1.0, high: float = 1.0) -> float:
        return round(float(self.rng.uniform(low, high)), 3)

    def decades(self, low: float, high: float) -> float:
        return float(f"{10 ** self.rng.uniform(low, high):.4g}")

    def vector(self, size: float = 1.0) -> list[float]:
        x, y, z = (self.uniform(-size, size) for _ in range(3))
        return [x, y, 0.0] if self.planar else [x, y, z]

    def parameter(self, name: str, value: float) -> Any:
        self.parameters[name] = Parameter(value)
        return variable(name)

    def shuffled(self, content: Mapping[str, Any]) -> dict[str, Any]:
        names = list(content)
        self.rng.shuffle(names)
        return {name: content[name] for name in names}

    def expression(self, *, time: bool = False, moving: bool = True, inputs: Mapping[str, Any] | None = None) -> str:
        """Return an expression of a few of the names that may stand where it is used."""
        terms = [f"{self.uniform(-5, 5)}"]
        if moving and self.coordinates:
            terms.append(f"{self.uniform(-5, 5)}*sin({self.some(self.coordinates)})")
            terms.append(f"{self.uniform()}*{self.some(self.speeds)}")
        if time:
            terms.append(f"{self.uniform()}*cos({self.uniform()}*t)")
        if inputs:
            terms.append(f"{self.uniform()}*{self.some(list(inputs))}")
        return " + ".join(terms)

    def input(self) -> str | Table:
        """Return an expression, or a table of one."""
        expression = self.expression(time=True)
        if self.motions.random() < 0.6:
            return expression
        rows = np.column_stack([[-5.0, -2.0, 0.5, 1.0, 4.0], np.round(self.motions.uniform(-5, 5, 5), 2)])
        return Table(rows, expression, "linear" if self.motions.random() < 0.5 else "cubic")

    # bodies and joints

    def ground(self) -> Body:
        points = {"o": [0, 0, 0], "a": self.vector(), "b": self.vector(2)}
        floor = Surface(plane=self.vector(2), normal=[0, 1, 0] if self.planar else self.vector())
        return Body(points=points, frames={"F": self.frame()}, surfaces={"floor": floor}, motion=self.ground_motion())

    def ground_motion(self) -> GroundMotion | None:
        if not self.prescribes or self.motions.random() < 0.4:
            return None
        turns = [Turn("z" if self.planar else [1, 2, 2], self.motion()) for _ in range(int(self.motions.integers(3)))]
        return GroundMotion(self.motion(), y=self.motion(), z=0 if self.planar else self.motion(), turn=turns)

    def motion(self) -> str:
        """Return an expression of t that may prescribe a coordinate; a constant locks it."""
        a, b, c = np.round(self.motions.uniform(-1, 1, 3), 3)
        return f"{a}" if self.motions.random() < 0.3 else f"{a} + {b}*sin({c}*t)"

    def frame(self) -> Frame:
        axis = (lambda: [0, 0, 1]) if self.planar else (lambda: _floats(np.round(self.rng.normal(size=3), 2) + 0.005))
        turns = [Turn(axis(), self.uniform(-3, 3)) for _ in range(int(self.rng.integers(0, 3)))]
        return Frame(self.vector(), turns)

    def body(self, name: str, particle: bool) -> Body:
        if self.extreme and name != self.names[-1] and self.rng.random() < 0.1:
            return Body(points={"a": self.vector(), "b": self.vector()}, frames={"F": self.frame()})
        mass = self.decades(-6, 6) if self.extreme else self.decades(-3, 3)
        if self.rng.random() < 0.3:
            mass = self.parameter(f"m_{name}", mass)
        inertia = None if particle and self.rng.random() < 0.5 else self.inertia(mass)
        points = {"a": self.vector(), "b": self.vector()}
        radius, axis = self.uniform(0.1, 1), [0, 0, 1] if self.planar else self.vector()
        surfaces = {
            "ball": Surface(sphere=radius, centre=self.vector()),
            "rim": Surface(disc=radius, axis=axis, centre=self.vector()),
        }
        frames = {"F": self.frame()}
        return Body(mass, self.vector(0.5), inertia, points=points, frames=frames, surfaces=surfaces)

    def direction(self) -> list[float]:
        """Return a direction, of no particular length."""
        return [self.uniform(0.1, 1), *self.vector()[1:]]

    def inertia(self, mass: Any) -> list[Any]:
        """Return m R diag(b + c, a + c, a + b) R^T: the inertia of some mass distribution."""
        a, b, c = self.rng.uniform(0.01, 0.3, 3) ** 2
        turn, _ = np.linalg.qr(self.rng.normal(size=(3, 3)))
        tensor = np.round(turn @ np.diag([b + c, a + c, a + b]) @ turn.T, 6)
        return [mass * float(tensor[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]

    def add_joint(self, name: str, parent: str, child: str) -> None:
        joint = self.joint(parent, child)
        self.joints[name] = joint
        self.bodies[child] = self.body(child, particle=not _turns(joint))
        self.coordinates += [name + suffix for suffix in joint.coordinate_suffixes]
        for k, suffix in enumerate(joint.speed_suffixes):
            self.speeds.append(f"u_{name}{joint.coordinate_suffixes[k]}" if suffix is None else name + suffix)

    def joint(self, parent: str, child: str) -> Joint:
        """Return a joint of any kind; in a planar system one that stays in the plane."""
        while True:
            kinds = [cls for cls in JOINTS.table.values() if cls not in _APART]
            cls = Fixed if self.rng.random() < 0.03 else self.some(kinds)
            drawn = self.fields(cls)
            if cls is PointJoint and self.guides.random() < 0.6:
                cls, drawn = CurveJoint, self.guide()
            joint: Joint = cls(parent=self.place(parent), child=self.place(child), **drawn)
            if issubclass(cls, MovingJoint):
                joint = replace(joint, motion=self.joint_motion(joint))
                joint = replace(joint, initial=self.initial(joint))
            if not self.planar or _stays_in_plane(joint):
                return joint

    def joint_motion(self, joint: Joint) -> list[str | None] | None:
        if not self.prescribes or self.motions.random() < 0.5:
            return None
        steps = [step for step in joint.steps if step.may_be_prescribed]
        return [self.motion() if self.motions.random() < 0.5 else None for _ in steps]

    def fields(self, cls: type[Joint]) -> dict[str, Any]:
        """Return values for what a kind of joint has besides its ends, names and start."""
        taken = {f.name for f in fields(MovingJoint)}
        return {name: self.content(field) for name, field in fields_of(cls).items() if name not in taken}

    def content(self, field: Field) -> Any:
        if isinstance(field, Direction):
            return self.some(_DIRECTIONS[:4] if self.planar else _DIRECTIONS)
        if isinstance(field, ListOf) and field.least == field.most == 2:
            return self.some([["x", "y"], ["z", "x"], [[1, 2, -2], "y"]])
        if isinstance(field, Choice):
            return self.some(field.words)
        if isinstance(field, Scalar):
            return self.uniform(0.1, 1)
        if isinstance(field, Angles):
            return self.some([None, "zxz", "xyz"])
        if isinstance(field, ListOf):
            return [self.freedom() for _ in range(int(self.rng.integers(1, 4)))]
        if isinstance(field, Text):
            return None
        raise AssertionError(f"no random value for {field}")

    def guide(self) -> dict[str, Any]:
        """Return a smooth curve in a plane or in space, which bends by itself where motion is prescribed.

        It is drawn apart, in the place of some joints of points, so that systems without one do not depend on it.
        """
        a, b, c, d = np.round(self.guides.uniform(0.2, 1, 4), 3)
        sway = f"*(1 + 0.2*sin({d}*t))" if self.prescribes else ""
        lying = Curve(x=f"s + {a}*sin(s){sway}", y=f"{b}*s^2{sway}", parameter="s")
        turns = (None, "tangent", "free")[int(self.guides.integers(3))]
        bent = lying if self.planar or turns == "tangent" else replace(lying, z=f"{c}*cos({d}*s)")
        return {"curve": bent, "turns": turns}

    def freedom(self) -> Direct:
        axis = self.content(Direction())
        return self.some([Direct(translate=axis), Direct(rotate=axis), Direct(rotate=axis, pitch=self.uniform())])

    def initial(self, joint: Joint) -> Initial | None:
        values = [self.uniform() for _ in joint.coordinate_units]
        return self.some([None, Initial(q=values, u=[self.uniform() for _ in joint.speed_units])])

    def place(self, body: str) -> str:
        return self.some([body, f"{body}.a", f"{body}.b", f"{body}.F"])

    def two_places(self) -> list[str]:
        first, second = self.rng.permutation(["ground", *self.names])[:2]
        return [f"{first}.{self.some('ab')}", f"{second}.{self.some('ab')}"]

    def pulley(self) -> Pulley:
        at = self.some(["ground", *self.names]) + "." + self.some("ab")
        return Pulley(at, radius=self.uniform(0.01, 0.05) if self.planar and self.rng.random() < 0.6 else 0)

    def one_freedom(self) -> str | None:
        names = [name for name, joint in self.joints.items() if len(joint.speed_units) == 1]
        return self.some(names) if names else None

    def freedom_of_joint(self) -> tuple[str, str] | None:
        """Return a joint and one of its speeds by name."""
        if not self.speeds:
            return None
        name = self.some(self.speeds)
        bare = name.removeprefix("u_")
        return next(joint for joint in self.joints if bare == joint or bare.startswith(f"{joint}_")), name

    def elements(self, kinds: OneOf, makers: Mapping[type, Any], names: Sequence[str], known: Any) -> dict[str, Any]:
        """Return elements of random kinds; `known` is what their makers choose from besides bodies and joints."""
        drawn = [cls for cls in kinds.table.values() if cls in makers]
        return {name: makers[self.some(drawn)](self, known) for name in names}

    def further_forces(self, inputs: Mapping[str, Any]) -> dict[str, Any]:
        """Return a potential or two for a third of the systems."""
        if self.potentials.random() > 0.35:
            return {}
        self.rng, kept = self.potentials, self.rng
        found = self.elements(FORCES, _POTENTIALS, self.numbered("v", 1, 2), inputs)
        self.rng = kept
        return found

    def numbered(self, prefix: str, least: int, most: int) -> list[str]:
        return [f"{prefix}{k}" for k in range(int(self.rng.integers(least, most + 1)))]


_DIRECTIONS = ("z", "x", "y", [0.6, 0.8, 0], "-y", [0.6, 0, 0.8], [1, 2, -2], [1, 1, 1])


_APART = (Fixed, CurveJoint)
"""Kinds of joints that are drawn apart from the others."""


def _turns(joint: Joint) -> bool:
    return any("rad" in unit for unit in joint.speed_units)


def _stays_in_plane(joint: Joint) -> bool:
    """Return whether all steps rotate about z or translate along x, y."""
    flat = {Translate: lambda axis: axis[2].shadow == 0, Rotate: lambda axis: axis[0].shadow == axis[1].shadow == 0}
    return all(
        step.stays_in_plane if isinstance(step, Follow) else type(step) in flat and flat[type(step)](step.axis)
        for step in joint.steps
    )


def _force(build: _Builder, inputs: Mapping[str, Any]) -> Force:
    value = [build.expression(time=True, inputs=inputs), *build.vector(5)[1:]]
    frame = build.some(["ground", *build.names])
    return Force(build.some(build.names), value, at=build.some([None, "a", "b"]), frame=frame)


def _torque(build: _Builder, inputs: Mapping[str, Any]) -> Torque:
    joint = build.one_freedom()
    if joint and build.rng.random() < 0.5:
        return Torque(build.expression(time=True, inputs=inputs), joint=joint)
    value = [build.uniform(), 0, build.expression(inputs=inputs)]
    on = build.some(build.names)
    if build.bodies[on].inertia is None:  # no couple acts on a particle
        on = next((name for name in build.names if build.bodies[name].inertia is not None), "ground")
    return Torque(value, on=on, frame=build.some(["ground", *build.names]))


def _spring(build: _Builder, inputs: Mapping[str, Any]) -> SpringDamper:
    joint = build.one_freedom()
    where = {"joint": joint} if joint and build.rng.random() < 0.4 else {"between": build.two_places()}
    stiffness: Any = build.decades(0, 3)
    if build.rng.random() < 0.25:
        stiffness = build.expression(time=True, inputs=inputs)
    rest: Any = build.uniform(0, 1) if build.rng.random() < 0.7 else build.expression(time=True, moving=False)
    return SpringDamper(stiffness, damping=build.decades(-2, 1), length=rest, **where)


def _damper(build: _Builder, inputs: Mapping[str, Any]) -> Damper:
    joint = build.one_freedom()
    where = {"joint": joint} if joint and build.rng.random() < 0.5 else {"between": build.two_places()}
    return Damper(build.decades(-2, 1), **where)


def _pull(build: _Builder, inputs: Mapping[str, Any]) -> Pull:
    law = f"{build.uniform(1, 5)}*(distance - {build.uniform()})^3 + {build.uniform(0, 1)}*distance*distance_rate"
    return Pull(build.two_places(), f"{law} + {build.expression(time=True, inputs=inputs)}")


def _potential(build: _Builder, inputs: Mapping[str, Any]) -> Potential:
    joint, k = build.one_freedom(), build.uniform(1, 5)
    kind = build.some(["between", "joint", "on"] if joint else ["between", "on"])
    if kind == "between":
        return Potential(f"{k}*(distance - {build.uniform()})^4 + cos({k}*t)*distance", between=build.two_places())
    if kind == "joint":
        name = joint + build.joints[joint].coordinate_suffixes[0]
        return Potential(f"{k}*sin({name})^2 + {build.uniform()}*{name}*t", joint=joint)
    law = f"{k}*(x^2 + 2*y^2) + {build.uniform()}*x*y" + ("" if build.planar else f" + {build.uniform()}*sin(z)*x")
    return Potential(law, on=build.some(build.names), frame=build.some(["ground", *build.names]))


def _gravitation(build: _Builder, inputs: Mapping[str, Any]) -> Gravitation:
    return Gravitation(build.two_places(), build.uniform(0.1, 1), [build.uniform(0.5, 2), build.uniform(0.5, 2)])


def _coulomb(build: _Builder, inputs: Mapping[str, Any]) -> Coulomb:
    return Coulomb(build.two_places(), [build.uniform(), build.uniform(0.1, 1)], build.uniform(0.1, 1))


def _drag(build: _Builder, inputs: Mapping[str, Any]) -> Drag:
    quadratic = build.some([0, build.uniform(0, 2), build.expression(time=True, inputs=inputs)])
    return Drag(build.some(build.names), build.some([None, "a", "b"]), build.uniform(0, 2), quadratic)


def _motor(build: _Builder, inputs: Mapping[str, Any]) -> Motor | Drag:
    place = build.freedom_of_joint()
    if place is None:
        return _drag(build, inputs)
    voltage = build.expression(time=True, inputs=inputs)
    resistance, constant, gear = build.uniform(0.5, 2), build.uniform(0.1, 1), build.uniform(1, 9)
    return Motor(
        place[0], voltage=voltage, resistance=resistance, constant=constant, gear=gear, freedom=place[1]
    )


def _distance(build: _Builder, pulleys: Mapping[str, Pulley]) -> Distance:
    value = build.some([build.uniform(0.5, 2), f"1 + {build.uniform(0, 1)}*sin(t)"])
    return Distance(build.two_places(), value)


def _rope(build: _Builder, pulleys: Mapping[str, Pulley]) -> Rope:
    start, end = build.two_places()
    between = list(build.rng.permutation(list(pulleys)))[: int(build.rng.integers(0, 3))]
    length = build.some([None, build.uniform(1, 5), f"2 + {build.uniform()}*t"])
    return Rope([start, *map(str, between), end], length=length)


def _expression(build: _Builder, pulleys: Mapping[str, Pulley]) -> Expression:
    names = [str(name) for name in build.rng.permutation(build.coordinates)[:3]]
    linear = " + ".join(f"{build.uniform()}*{name}" for name in names)
    return Expression(f"{linear} + {build.uniform()}*sin({names[0]})*t - {build.uniform()}*t^2")


_POTENTIALS: Mapping[type, Callable[..., Element]] = {
    Potential: _potential,
    Gravitation: _gravitation,
    Coulomb: _coulomb,
}
_FORCES: Mapping[type, Callable[..., Element]] = {
    Force: _force,
    Torque: _torque,
    SpringDamper: _spring,
    Damper: _damper,
    Pull: _pull,
    Drag: _drag,
    Motor: _motor,
}
def _gear(build: _Builder, pulleys: Mapping[str, Pulley]) -> Gear | Expression:
    names = [name for name, joint in build.joints.items() if len(joint.speed_units) == 1]
    if len(names) < 2:
        return _expression(build, pulleys)
    pair = list(map(str, build.rng.permutation(names)[:2]))
    return Gear(pair, build.uniform(0.2, 3), f"{build.uniform()}*t")


def _coupler(build: _Builder, pulleys: Mapping[str, Pulley]) -> Coupler | Expression:
    names = {build.one_freedom() for _ in range(3)} - {None}
    if not names:
        return _expression(build, pulleys)
    return Coupler({name: build.uniform(0.2, 3) for name in sorted(names)}, build.uniform())


def _on_line(build: _Builder, pulleys: Mapping[str, Pulley]) -> PointOnLine | PointInPlane:
    if build.planar:  # where a row out of the plane would vanish, and the case with it
        return _in_plane(build, pulleys)
    point, through = build.two_places()
    return PointOnLine(point, Line(through, build.direction()))


def _in_plane(build: _Builder, pulleys: Mapping[str, Pulley]) -> PointInPlane:
    point, through = build.two_places()
    return PointInPlane(point, Plane(through, build.direction()))


def _rolling(build: _Builder, pulleys: Mapping[str, Pulley]) -> Rolling | Expression:
    if build.planar:
        return _expression(build, pulleys)
    return Rolling(f"{build.some(build.names)}.{build.some(['ball', 'rim'])}", "ground.floor")


def _motion(build: _Builder, pulleys: Mapping[str, Pulley]) -> Element:
    joint = build.one_freedom()
    value = f"{build.uniform()}*sin(2*t) + {build.uniform()}*t^2"
    return PrescribedMotion(joint, value) if joint else _expression(build, pulleys)


def _velocity(build: _Builder, pulleys: Mapping[str, Pulley]) -> VelocityConstraint:
    first, second = (build.some(build.speeds) for _ in range(2))
    turned = build.some(build.coordinates)
    return VelocityConstraint(f"{first}*cos({turned}) - {build.uniform()}*{second}*t + {build.uniform()}*sin(t)")


_CONSTRAINTS: Mapping[type, Callable[..., Element]] = {
    Distance: _distance,
    Rope: _rope,
    Expression: _expression,
    Gear: _gear,
    Coupler: _coupler,
    PointOnLine: _on_line,
    PointInPlane: _in_plane,
    Rolling: _rolling,
    PrescribedMotion: _motion,
    VelocityConstraint: _velocity,
}

elsewhere = {Friction, Distributed}  # tests/dynamics/test_line_loads.py compares those along lines with forces
assert {*_FORCES, *_POTENTIALS} == set(FORCES.table.values()) - elsewhere, "every other kind of force is drawn"
massless = {OnCurve}  # whose speeds these systems do without; tests/dynamics/test_guided_points.py draws it
assert set(_CONSTRAINTS) == set(CONSTRAINTS.table.values()) - massless, "every other kind of constraint is drawn"
