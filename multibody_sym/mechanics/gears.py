"""Where do the teeth of two wheels meet, with which force, and which reactions do couplings leave undetermined?

The pitch point and the force there are seen from the body that both axes stay on.

Wheel 1 turns about the axis a1 through C1 and wheel 2 about a2 through C2, positively with their coordinates; rho is
the way from an axis to the pitch point P. A force on wheel 1 across both axes, of moment one about a1:

    parallel axes, D = C2 - C1 across them:  P = C1 + D r1/(r1 + s r2),  F = a1 x D / (r1 (r1 + s r2))
    axes that meet in O, n = a1 x a2:        P = O + (t r2 a1 + r1 a2) e/|n|,  F = e n / (r1 |n|)

|D| = |r1 + s r2|; s = 1 for wheels that touch outside and -1 for one inside the other; t = 1 for axes that turn
oppositely about P, and e tells the side of O on which the wheels are. As a1 . (rho1 x F) = 1 and -a2 . (rho2 x F) =
-ratio, the power of the forces is that of the row q1 = ratio q2 + value. What oblique flanks push the wheels apart with
does no work and is left out.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from math import hypot, isfinite
from typing import Final

from multibody_sym.errors import ExpressionError, ModelError, at
from multibody_sym.mechanics.mechanism import Mechanism, Withheld
from multibody_sym.mechanics.points import as_point
from multibody_sym.mechanics.references import References, in_plane
from multibody_sym.mechanics.row_records import ExpressionRow, GearRow, Marker, VelocityRow
from multibody_sym.mechanics.spanning_tree import body_part
from multibody_sym.model.bodies import Pose, unit_vector
from multibody_sym.model.constraints import CONSTRAINTS, Gear
from multibody_sym.model.fields import Point
from multibody_sym.model.joints import Prismatic
from multibody_sym.model.steps import Step
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float, sqrt
from multibody_sym.scalars.node import Node, as_node, slot
from multibody_sym.scalars.vectors import Vec, add, apply, cross, dot, scale, subtract
from multibody_sym.text.parser import force_name
from multibody_sym.text.printer import COMPONENTS

Floats = tuple[float, ...]
_SAME: Final = 1e-9
_PARALLEL: Final = 1e-9


def gear_row(name: str, element: Gear, zero: Node, references: References) -> GearRow:
    """Return the row of a gear with radii, phi = `zero`.

    Raises ModelError where joints, axes, radii and ratio do not fit together.
    """
    carrier, wheels = _wheels(element, references)
    if any(leaf.data[0] in ("q", "u") for leaf in leaves([element.value], "slot")):
        raise ModelError("with radii it depends on time and parameters only", number="M116").under("value")
    near = None  # the point of the carrier that tells where on their axes the wheels are
    if element.at is not None:
        with at("at"):
            marker = references.marker(element.at)
            if marker.body != references.numbers[carrier]:
                raise ModelError(f"name a point of {carrier}, on which both axes stay", number="M116")
        near = marker.pose.position
    # parameters in numbers, as far as they follow from each other
    values: dict[Node, float] = {}
    declared = {slot("parameters", k): p.value for k, p in enumerate(references.system.parameters.values())}
    for _ in declared:
        ready = {x: v for x, v in declared.items() if x not in values and values.keys() >= set(leaves([v], "slot"))}
        if not ready:
            break
        for x, value in ready.items():
            values[x] = _number(value, values)
    place, force = _Mesh(element, wheels, values, near).met()
    pitch = Marker(f"pitch point of {name}", references.numbers[carrier], Pose(as_point(place)))
    beside = {joint: side * wheel.side for joint, side, wheel in zip(element.joints, (1, -1), wheels, strict=True)}
    in_tree = all(joint in references.carrying for joint in element.joints)
    on = _loaded_bodies(wheels, beside, references)
    return GearRow(name, zero, False, pitch, as_point(force), on, tuple(beside.items()), in_tree)


def _loaded_bodies(
    wheels: Sequence[_Wheel], beside: Mapping[str, int], references: References
) -> tuple[tuple[int, int], ...]:
    """Return the bodies on which the force at the teeth acts, each with its factor.

    These are the wheels. H is that of drives in the joints; the rows of a joint that does not carry its child transmit
    such a drive. There the difference acts between the child and the body that the rows hold it to: parent or double.
    """
    on = dict.fromkeys((wheel.body for wheel in wheels), 0)
    for wheel, factor in zip(wheels, (1, -1), strict=True):
        on[wheel.body] += factor
    for joint, factor in beside.items():
        if joint not in references.carrying:
            parent, child = (marker.body for marker in references.frames(joint))
            held_to = references.doubles.get(joint, parent)
            on[child] = on.get(child, 0) - factor
            on[held_to] = on.get(held_to, 0) + factor
    return tuple((body, factor) for body, factor in on.items() if factor and body >= 0)


@dataclass(frozen=True)
class _Wheel:
    """A wheel: its axis on the carrier, about which it turns positively with its coordinate; its body's number, and
    whether that is the joint's child (1) or parent (-1)."""

    centre: Point
    axis: Vec
    body: int
    side: int


def _wheels(element: Gear, references: References) -> tuple[str, tuple[_Wheel, _Wheel]]:
    """Return the body on which both axes stay, and both wheels."""
    system, ends = references.system, []
    for k, name in enumerate(element.joints):
        steps = system.joints[name].moves
        if len(steps) != 1 or not steps[0].is_hinge:
            with at("joints", k):
                raise ModelError(
                    f"radii are those of wheels, and {name!r} is no revolute joint; leave radii out", number="M110"
                )
        joint = system.joints[name]
        ends.append(tuple(body_part(end, system.bodies)[0] for end in (joint.parent, joint.child)))
    shared = set(ends[0]) & set(ends[1])
    if len(shared) != 1:
        joined = " and ".join(f"{n} joins {a} and {b}" for n, (a, b) in zip(element.joints, ends, strict=True))
        with at("joints"):
            raise ModelError(
                f"both joints of a gear with radii join its wheels to one body, on which both axes stay, but {joined}; "
                "let joints lead from the wheels to the body that carries them, as from sun and planet to the arm",
                number="M116",
            )
    (carrier,) = shared
    wheels = []
    for name, end in zip(element.joints, ends, strict=True):
        frames = references.frames(name)
        carried = carrier == end[0]
        on_carrier, on_wheel = frames if carried else frames[::-1]
        side = 1 if carried else -1  # a wheel that carries the body of its axis turns the other way
        along = apply(on_carrier.pose.rotation, unit_vector(system.joints[name].moves[0].turns[0]))
        wheels.append(_Wheel(on_carrier.pose.position, scale(side, along), on_wheel.body, side))
    return carrier, (wheels[0], wheels[1])


def _number(value: Node, sample: dict[Node, float]) -> float:
    try:
        return float(evaluate_float([value], sample)[0])
    except (ExpressionError, ArithmeticError, ValueError, KeyError):
        return float("nan")


@dataclass(frozen=True)
class _Mesh:
    """Two wheels in the axes of their carrier, with `sample` values of the parameters in their geometry."""

    element: Gear
    wheels: tuple[_Wheel, _Wheel]
    sample: dict[Node, float]
    near: Point | None

    def met(self) -> tuple[Vec, Vec]:
        """Return the pitch point and the force on the first wheel."""
        self._verify_ratio()
        across = cross(*self.axes)
        apart = subtract(self.places[1], self.places[0])
        if hypot(*across) < _PARALLEL:
            return self._side_by_side(apart)
        if abs(dot(across, apart)) > _SAME * max(self.radii):
            with at("radii"):
                raise ModelError(
                    "the axes are neither parallel nor meet: such wheels touch at no pitch point", number="M110"
                )
        return self._bevel()

    @cached_property
    def radii(self) -> Floats:
        assert self.element.radii is not None
        return self._numbers(self.element.radii)

    @cached_property
    def ratio(self) -> float:
        return self._numbers([self.element.ratio])[0]

    @cached_property
    def axes(self) -> list[Floats]:
        return [self._numbers(wheel.axis) for wheel in self.wheels]

    @cached_property
    def places(self) -> list[Floats]:
        return [self._numbers(wheel.centre) for wheel in self.wheels]

    def _numbers(self, values: Sequence[Node]) -> Floats:
        found = tuple(_number(as_node(x), self.sample) for x in values)
        if not all(map(isfinite, found)):
            raise ModelError("its radii, ratio and axes have no values", number="M116")
        return found

    def _verify_ratio(self) -> None:
        first, second = self.radii
        if first <= 0.0 or second <= 0.0:
            with at("radii"):
                raise ModelError(f"radii are positive, and these are {first:g} and {second:g}", number="M109")
        if abs(abs(self.ratio) * first - second) > _SAME * second:
            with at("ratio"):
                raise ModelError(
                    f"the ratio {self.ratio:g} and the radii {first:g} and {second:g} contradict each other: wheels "
                    f"that mesh turn as r2/r1, here -{second / first:g} where they touch outside",
                    number="M116",
                )

    def _side_by_side(self, apart: Vec) -> tuple[Vec, Vec]:
        outside = 1 if self.ratio * dot(*self.axes) < 0.0 else -1
        height = dot(self.axes[0], apart)
        self._verify_apart(hypot(*subtract(apart, scale(height, self.axes[0]))), outside)
        if self.near is None and abs(height) > _SAME * max(self.radii):
            with at("at"):
                raise ModelError(
                    "the joints' points do not lie in one plane across the axes; name a point of the body that carries "
                    "the wheels in the plane in which they touch, at: body.point",
                    number="M116",
                )
        assert self.element.radii is not None
        (first, second), (r1, r2) = self.wheels, self.element.radii
        between = subtract(second.centre, first.centre)
        across = subtract(between, scale(dot(first.axis, between), first.axis))
        both = r1 + outside * r2
        place = add(first.centre, scale(r1 / both, across))
        if self.near is not None:
            place = add(place, scale(dot(first.axis, subtract(self.near, first.centre)), first.axis))
        return place, scale(1 / (r1 * both), cross(first.axis, across))

    def _verify_apart(self, apart: float, outside: int) -> None:
        first, second = self.radii
        wanted = abs(first + outside * second)
        if abs(apart - wanted) > _SAME * (first + second) or wanted == 0.0:
            how = "that touch outside need" if outside > 0 else "inside each other need axes"
            with at("radii"):
                raise ModelError(
                    f"the axes are {apart:g} m apart; wheels of radii {first:g} and {second:g} m {how} {wanted:g} m"
                    f"{'' if outside > 0 else ' apart'} (a negative ratio is that of wheels that touch outside)",
                    number="M109",
                )

    def _bevel(self) -> tuple[Vec, Vec]:
        assert self.element.radii is not None
        (first, second), (r1, r2) = self.wheels, self.element.radii
        normal = cross(first.axis, second.axis)
        square = dot(normal, normal)
        along = dot(cross(subtract(second.centre, first.centre), second.axis), normal) / square
        apex = add(first.centre, scale(along, first.axis))
        opposite = 1 if self.ratio < 0.0 else -1
        way = add(scale(opposite * r2, first.axis), scale(r1, second.axis))
        side = self._side(self._numbers(apex), self._numbers(way))
        length = sqrt(square)
        return add(apex, scale(side / length, way)), scale(side / (r1 * length), normal)

    def _side(self, apex: Floats, way: Floats) -> int:
        """Return on which side of the point in which both axes meet the wheels are."""
        middle = scale(0.5, add(*self.places)) if self.near is None else self._numbers(self.near)
        along = dot(subtract(middle, apex), way)
        if abs(along) <= _SAME * dot(way, way):
            with at("at"):
                raise ModelError(
                    "the axes meet where the joints' points are; name a point of the body that carries the wheels on "
                    "the side on which they touch, at: body.point",
                    number="M116",
                )
        return 1 if along > 0.0 else -1


# ----------------------------------------------------------------------------------------------------------------------
# Where the forces of couplings act, as far as it is declared, and which reactions remain undetermined where it is not.
#
# A row gives a generalised force: the power of its forces in the motions that the joints allow. An expression, a
# coupler, a gear without radii, a constraint of speeds say no more. Their forces may be any on the bodies next to the
# joints that they name which have this power; what the joints transmit on their account is their business.
#
# - Forces between bodies that the named joints join are borne by these joints. From one group of bodies to another
# they take the way through the tree of joints; where a joint on it is part of a closed loop, any way through the loop.
# - Through a joint on the way anything may pass, in a plane model within the plane. Along a freedom that the row does
# not name its forces have no power, so there the joint's reaction is that of its own drives. - With `acts: in_joints`
# the row drives each joint that it names along its freedoms, and everything is determined.


_IN_PLANE: Final = ("fx", "fy", "mz")
_INSTEAD: Final[Mapping[str, str]] = {
    "gear": "give the gear radii: [r1, r2]",
    "gear on a rack": "let the wheel roll on a plane of the rack (type: rolling)",
    "gear between slides": "declare a rope or a rod",
    "velocity": "declare rolling where wheels roll",
}
_ELSE: Final = "declare a rope round the wheel, a rod, a gear with radii"


def with_withheld(resolved: Mechanism, system: System) -> Mechanism:
    """Return a mechanism that knows its undetermined reactions; outputs that name them are left out.

    Raises ModelError where a stop hangs on one.
    """
    found = resolved.relative.withheld if resolved.relative is not None else _withheld_reactions(resolved, system)
    if not found:
        return resolved
    for name, node in resolved.stops.items():
        for joint, component in undetermined_reactions(found, node):
            with at("stop", name):
                because = reasons({joint: found[joint]})[0]
                raise ModelError(f"{force_name(joint, component)} is not determined: {because}", number="M112")
    declared = {**resolved.outputs, **resolved.run_outputs}
    untold = tuple(name for name, node in declared.items() if undetermined_reactions(found, node))
    outputs, of_run = (
        {name: node for name, node in own.items() if name not in untold}
        for own in (resolved.outputs, resolved.run_outputs)
    )
    return replace(resolved, withheld=found, untold=untold, outputs=outputs, run_outputs=of_run)


def undetermined_reactions(withheld: Mapping[str, Withheld], node: Node) -> list[tuple[str, str]]:
    """Return the withheld reactions that an expression names, by joint and component."""
    found = leaves([node], "quantity")
    asked = [leaf.data[1] for leaf in found if leaf.data[0] == "reaction"]
    named = [leaf.data[1][0] for leaf in found if leaf.data[0] in ("power", "work", "impulse")]
    whole = [(joint, part) for joint in named if joint in withheld for part in withheld[joint].components[:1]]
    told = [(joint, part) for joint, part in asked if joint in withheld and part in withheld[joint].components]
    return [*told, *whole]


def reasons(withheld: Mapping[str, Withheld]) -> list[str]:
    """Return the reason for each constraint behind withheld reactions, with the cure."""
    because = {name: kind for each in withheld.values() for name, kind in each.because}
    return [
        f"{name} ({kind}) says nothing of where its force acts; {_INSTEAD.get(kind, _ELSE)}, or acts: in_joints if it "
        "drives each joint along its own axis"
        for name, kind in because.items()
    ]


# --- what a row's force could reach --------------------------------------------------------------------------------


def _withheld_reactions(resolved: Mechanism, system: System) -> dict[str, Withheld]:
    """Return the joints with undetermined components, in the mechanism's order."""
    rows = [row for row in resolved.rows if isinstance(row, (ExpressionRow, VelocityRow)) and row.no_place]
    if not rows:
        return {}
    graph = _Graph.of(resolved, system)
    possible = _IN_PLANE if in_plane(system) else COMPONENTS
    bodies = {body.joint_name: body for body in resolved.bodies}
    reached: dict[str, dict[str, set[str]]] = {}
    for row in rows:
        named = _named_speeds(resolved, row.zero)
        joints = {name for name, body in bodies.items() if named.intersection(body.u)}
        for joint in graph.ways(joints) if joints else ():  # a row that names no coordinate exerts nothing
            # reactions along freedoms that the row does not name are known; a cut joint has no coordinate to name
            if joint in bodies:
                steps = bodies[joint].steps
                free = [k for k, step in enumerate(steps) if step.motion is None]
                pairs = zip(free, bodies[joint].free_steps, strict=True)
                idle = [k for k, moved in pairs if named.isdisjoint(moved.u)]
            else:
                steps = system.joints[joint].steps
                idle = list(range(len(steps)))
            known = _components(steps, idle)
            for component in (c for c in possible if c not in known):
                reached.setdefault(joint, {}).setdefault(component, set()).add(row.name)
    kinds = {}
    names = {element: kind for kind, element in CONSTRAINTS.table.items()}
    for name, constraint in system.constraints.items():
        kinds[name] = names[type(constraint)]
        if isinstance(constraint, Gear):  # wheels alone have radii
            slides = sum(isinstance(system.joints[joint], Prismatic) for joint in constraint.joints)
            kinds[name] = ("gear", "gear on a rack", "gear between slides")[slides]
    return {
        joint: Withheld(
            tuple(c for c in COMPONENTS if c in reached[joint]),
            tuple((name, kind) for name, kind in kinds.items() if any(name in x for x in reached[joint].values())),
        )
        for joint in resolved.joint_names
        if joint in reached
    }


def _named_speeds(resolved: Mechanism, zero: Node) -> set[int]:
    """Return the speeds on which a row with this expression exerts something."""
    found = {leaf.data[1] for leaf in leaves([zero], "slot") if leaf.data[0] == "u"}
    if found:  # a constraint of speeds: coordinates in it only measure
        return found
    coordinates = {leaf.data[1] for leaf in leaves([zero], "slot") if leaf.data[0] == "q"}
    for body in resolved.bodies:
        found.update(u for free in body.free_steps if not coordinates.isdisjoint(free.q) for u in free.u)
    return found


def _components(steps: Sequence[Step], idle: Iterable[int]) -> set[str]:
    """Return the components along those steps that move or turn along an axis of the frame on the parent, whatever the
    others do: translations before all rotations, a first rotation with no translation after it."""
    first_turn = next((k for k, step in enumerate(steps) if step.turns), len(steps))
    last_slide = max((k for k, step in enumerate(steps) if step.slides), default=-1)
    found: set[str] = set()
    for k in idle:
        if steps[k].is_independent and (k < first_turn or k == first_turn > last_slide):
            directions = [(0, axis) for axis in steps[k].slides] + [(3, axis) for axis in steps[k].turns]
            for first, direction in directions:
                axes = [i for i, x in enumerate(direction) if x.shadow is None or x.shadow != 0]
                if len(axes) == 1:  # the direction is x, y or z
                    found.add(COMPONENTS[first + axes[0]])
    return found


@dataclass(frozen=True)
class _Graph:
    """The joints by their bodies, and each body of the tree with the joint that carries it."""

    ends: Mapping[str, tuple[str, str]]
    carriers: Mapping[str, str]

    @classmethod
    def of(cls, resolved: Mechanism, system: System) -> _Graph:
        ends = {
            name: (body_part(joint.parent, system.bodies)[0], body_part(joint.child, system.bodies)[0])
            for name, joint in system.joints.items()
        }
        bodies = (body for body in resolved.bodies if body.name in system.bodies and body.joint_name in ends)
        return cls(ends, {body.name: body.joint_name for body in bodies})

    def ways(self, named: set[str]) -> set[str]:
        """Return the joints through which forces may pass between the bodies next to the named joints."""
        first, *others = self._groups(named)
        between = {joint for other in others for joint in self._path(first, other)} - named
        cut = [name for name in self.ends if name not in self.carriers.values()] if between else []
        loops = [self._path(*self.ends[name]) | {name} for name in cut]
        while True:
            more = {joint for loop in loops if not between.isdisjoint(loop) for joint in loop} - named - between
            if not more:
                return between | named
            between |= more

    def _groups(self, named: set[str]) -> list[str]:
        """Return a body of each group that named joints hold together."""
        heads: dict[str, str] = {}
        for joint in (name for name in self.ends if name in named):
            a, b = (heads.setdefault(body, body) for body in self.ends[joint])
            heads = {body: a if head == b else head for body, head in heads.items()}
        return list(dict.fromkeys(heads.values()))

    def _path(self, a: str, b: str) -> set[str]:
        return self._to_ground(a) ^ self._to_ground(b)

    def _to_ground(self, body: str) -> set[str]:
        found = set()
        while body in self.carriers:
            found.add(self.carriers[body])
            body = self.ends[self.carriers[body]][0]
        return found
