"""Forces as they are seen: strands between points (`_STRANDS`), arrows of loads (`_LAWS`) and of speeds."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise, product
from typing import Any, Final

import numpy as np

from multibody_sym.mechanics.load_records import BodyTorque, JointForce, LineLoad, Load, PointDrag, PointForce, arc_leaf
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion
from multibody_sym.mechanics.points import position, velocity
from multibody_sym.mechanics.ropes import Segment, Wheel, segments, wheel_at
from multibody_sym.mechanics.row_records import Marker, RopeRow
from multibody_sym.model.bodies import GROUND as GROUND_NAME
from multibody_sym.model.constraints import Coupler, Distance, Rope
from multibody_sym.model.fields import Element
from multibody_sym.model.forces import Coulomb, Damper, Gravitation, Potential, Pull, SpringDamper
from multibody_sym.model.system import t
from multibody_sym.pictures.scene.items import (
    GROUND,
    ZERO,
    Anchor,
    ArrowItem,
    Bow,
    Disc,
    Item,
    NamedLength,
    Path,
    PlacedStrand,
    Strand,
    Vector,
    unit,
    vector,
)
from multibody_sym.pictures.scene.joints import PlacedJoint, counts_freely, is_polar, placed_joint, radius_of
from multibody_sym.pictures.scene.letters import (
    driven_by,
    is_letter,
    law_letters,
    letters,
    short_formula,
    speed_letter,
    steady_rate,
    turned_by,
)
from multibody_sym.pictures.scene.masses import jet_of, top
from multibody_sym.pictures.scene.stage import FrameOnBody, PlacedSystem, places, same, surface_items, velocity_of
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import atan2, cos, evaluate, sin
from multibody_sym.scalars.node import ZERO as ZERO_NODE
from multibody_sym.scalars.node import Node, as_node, multiply, real, symbol
from multibody_sym.scalars.vectors import S, Vec, add, cross, dot, scale, subtract
from multibody_sym.text.printer import text

_GAP: Final = 0.2
"""The part of a slider's way that must be left between bars for a spring to be seen there."""
_LEAST: Final = 0.35
"""How long a spring without a length is drawn, in sizes of the whole."""


def strands(stage: PlacedSystem, ropes: Mapping[str, int]) -> Iterator[Strand]:
    """Yield what runs between bodies; `ropes` are the places of the ropes of the mechanism."""
    for group in ("forces", "constraints"):
        elements: Mapping[str, Element] = getattr(stage.system, group)
        for name, element in elements.items():
            kind_of = _STRANDS.get(type(element))
            kind = None if kind_of is None else kind_of(stage, element)
            anchors = () if kind is None else _anchors(stage, element, kind)
            if kind is not None and anchors:
                label = getattr(element, "label", None) or name
                loose = anchor_behind(stage, element) is not None
                shown: dict[str, Any] = {"letters": law_letters(element), "titled": label != name}
                if kind == "spring_damper" and len(found := shown["letters"].split(", ")) == 2:
                    shown["letters"], shown["damping"] = found
                yield Strand(kind, name, label, (group, name), anchors, ropes.get(name), loose, **shown)


def _spring_kind(stage: PlacedSystem, element: Any) -> str:
    stiff, damped = element.stiffness.shadow != 0, element.damping.shadow != 0
    return "spring_damper" if stiff and damped else "spring" if stiff else "damper"


_STRANDS: Final[Mapping[type[Any], Callable[[PlacedSystem, Any], str | None]]] = {
    SpringDamper: _spring_kind,
    Damper: lambda stage, element: "damper",
    Pull: lambda stage, element: "pull",
    Potential: lambda stage, element: None if element.between is None else "potential",
    Gravitation: lambda stage, element: "attraction",
    Coulomb: lambda stage, element: "attraction",
    Distance: lambda stage, element: "rod",
    Rope: lambda stage, element: "rope",
    Coupler: lambda stage, element: "tie",
}
"""The kind of strand that an element is; None for what runs between no points."""


def _anchors(stage: PlacedSystem, element: Any, kind: str) -> tuple[Anchor, ...]:
    """Return the ends of a strand; in a joint those of what slides there, none where it only turns."""
    if isinstance(element, Rope):
        ends = [name for name in element.path if name not in stage.system.pulleys]
        return tuple(_anchor(stage, end) for end in ends)
    if isinstance(element, Coupler):
        places = [placed_joint(stage, name).child for name in element.joints]
        return tuple(place.anchor for place in places) if len(places) > 1 else ()
    if getattr(element, "between", None) is not None:
        central = kind == "attraction"
        return tuple(_anchor(stage, end, central=central) for end in element.between)
    # Where a spring in a slider is fixed: on its parent as far away as it is long, and on its child.
    joint = placed_joint(stage, element.joint)
    if not joint.slides:
        return ()
    behind, axis = anchor_behind(stage, element), unit(stage.vector(joint.joint.steps[0].slides[0]))
    if behind is not None:
        return behind, joint.child.anchor
    way = float(joint.way @ stage.turned(joint.parent.body, joint.parent.turned(axis)))
    first, last = (max(reach, 0.0) for reach in (_reach(stage, joint, 1.0, way), _reach(stage, joint, -1.0, way)))
    if first + last > (1.0 - _GAP) * abs(way):
        first, last = 0.0, 0.0
    return _along(joint.parent, axis, first * np.sign(way)), _along(joint.child, axis, -last * np.sign(way))


def _anchor(stage: PlacedSystem, reference: str, *, central: bool = False) -> Anchor:
    if central and reference in stage.system.bodies:
        return Anchor(stage.number_of(reference), stage.centre(reference))
    place = stage.place(reference)
    return place.anchor


def _along(place: FrameOnBody, axis: Vector, way: float) -> Anchor:
    """Return the place that is so far from a frame along an axis of it."""
    return Anchor(place.body, vector(np.array(place.point) + way * np.array(place.turned(axis))))


def _reach(stage: PlacedSystem, joint: PlacedJoint, side: float, way: float) -> float:
    """Return how far what carries a slider (`side` 1), or slides (-1), reaches towards the other one along the axis."""
    place, reference = (joint.parent, joint.joint.parent) if side > 0.0 else (joint.child, joint.joint.child)
    body = stage.body(reference)
    if stage.is_ground(reference) or stage.declared(body).shape is not None:
        return 0.0
    axis = side * np.sign(way) * np.array(place.turned(unit(stage.vector(joint.joint.steps[0].slides[0]))))
    ways = [float(np.subtract(other, place.point) @ axis) for other in (*places(stage)[body], stage.centre(body))]
    return max((w for w in ways if w < abs(way)), default=0.0)


def anchor_behind(stage: PlacedSystem, element: Any) -> Anchor | None:
    """Return where a spring in a slider that has no length begins on the parent, None for another element.

    The slider's coordinate is zero where both frames coincide: such a spring gets a length to be seen. It ends before
    the next place of a parent that reaches along it.
    """
    if getattr(element, "joint", None) is None or not isinstance(element, (SpringDamper, Damper)):
        return None
    joint = placed_joint(stage, str(element.joint))
    least = _LEAST * stage.lengths.get("size", 1.0)
    rest = stage.number(element.length) if isinstance(element, SpringDamper) else 0.0
    if not joint.slides or abs(rest) >= 0.3 * least:
        return None
    axis, at = np.array(joint.on_parent(joint.slides[0])), np.array(joint.parent.point)
    body = stage.body(joint.joint.parent)
    own = [] if stage.is_ground(joint.joint.parent) else [*places(stage)[body], stage.centre(body)]
    ways = [float((at - place) @ axis) for place in own]
    on_line = [way for way, place in zip(ways, own, strict=True) if same(vector(at - way * axis), place)]
    before = [way for way in on_line if way > 0.01 * least]
    way = min(float(joint.way @ stage.turned(joint.parent.body, vector(axis))), 0.0)  # below what it carries
    return Anchor(joint.parent.body, vector(at + (way - min([least, *(0.6 * way for way in before)])) * axis))


# --- ropes ---------------------------------------------------------------------------------------------------------

Runs = tuple[RopeRow, ...]


def ropes_of(mechanism: Mechanism) -> dict[str, Runs]:
    """Return the runs of each declared rope in their order, those that may go slack too."""
    rows = [*mechanism.rows, *(row for element in mechanism.one_way for row in element.normals)]
    found: dict[str, list[RopeRow]] = {}
    for run in (row.rope_run for row in rows if row.rope_run is not None):
        if run not in found.setdefault(run.told[0], []):
            found[run.told[0]].append(run)
    return {name: tuple(sorted(runs, key=lambda row: row.run)) for name, runs in found.items()}


@dataclass(frozen=True)
class _Meeting:
    """A bend of a rope: its centre, its wheel if it has a radius, and the pieces before and behind it."""

    centre: Vec
    wheel: Wheel | None
    before: Segment | None
    after: Segment | None
    turns: int

    def touches(self, piece: Segment) -> Vec:
        """Return where a piece meets the wheel, or the point."""
        if self.wheel is None:
            return self.centre
        return subtract(self.centre, scale(self.wheel.radius, cross(self.wheel.axis, piece.direction)))

    @property
    def angle(self) -> S:
        """Return around how much of the wheel the rope lies between both pieces, rad."""
        assert self.before is not None
        assert self.after is not None
        assert self.wheel is not None
        a, b = self.before.direction, self.after.direction
        return (0.5 + 2.0 * self.turns) * np.pi + atan2(-dot(a, b), dot(self.wheel.axis, cross(a, b)))


def placed_rope(strand: Strand, runs: Runs, motion: Motion, ends: Sequence[Floats]) -> PlacedStrand:
    """Return a rope in the world; straight from end to end where it has no direction."""
    try:
        bends = _meetings(runs, motion)
    except UNDEFINED:
        return PlacedStrand(strand, np.array([np.array(ends)[[k, k + 1]] for k in range(len(ends) - 1)]))
    pieces = [
        [first.touches(first.after), second.touches(first.after)]
        for first, second in pairwise(bends)
        if first.after is not None
    ]
    bows = [_bow(bend) for bend in bends if bend.before and bend.after]
    wound = []  # a turn around each drum at an end shows that the rope is wound there
    for bend in (bends[0], bends[-1]):
        piece = bend.before or bend.after
        if bend.wheel is not None and piece is not None:
            start, centre = vector(bend.touches(piece)), vector(bend.centre)
            wound.append(Bow(centre, unit(bend.wheel.axis), float(bend.wheel.radius), start, 2.0 * np.pi))
    return PlacedStrand(strand, np.array(pieces), tuple(bows), tuple(wound))


def _meetings(runs: Runs, motion: Motion) -> list[_Meeting]:
    """Return the bends of all runs; where one run ends on a wheel the next begins on it."""
    found: list[_Meeting] = []
    for run in runs:
        pieces, _ = segments(motion, run.path, run.straight)
        for k, bend in enumerate(run.path):
            before = pieces[k - 1] if k else None
            after = pieces[k] if k < len(pieces) else None
            if k == 0 and found:
                last = found.pop()
                found.append(_Meeting(last.centre, last.wheel, last.before, after, bend.turns))
                continue
            wheel = wheel_at(motion, run.path, k)
            found.append(_Meeting(position(motion, bend.at), wheel, before, after, bend.turns))
    return found


def rope_points(runs: Runs, motion: Motion, arc: int) -> list[Vec]:
    """Return points (world) along a rope, the bow on each wheel as `arc` of them, over the scalars of a motion."""
    points = list[Vec]()
    for bend in _meetings(runs, motion):
        if bend.wheel is None or bend.before is None or bend.after is None:
            points += [bend.touches(piece) for piece in (bend.before or bend.after,) if piece is not None]
            continue
        out = subtract(bend.touches(bend.before), bend.centre)
        side = cross(bend.wheel.axis, out)
        for k in range(arc):
            angle = (k / (arc - 1)) * bend.angle
            points.append(add(bend.centre, add(scale(cos(angle), out), scale(sin(angle), side))))
    return points


def _bow(bend: _Meeting) -> Bow:
    """Return the part of the rope on a wheel between two pieces, of no length at a point."""
    assert bend.before is not None
    assert bend.after is not None
    if bend.wheel is None:
        return Bow(vector(bend.centre), (0.0, 0.0, 1.0), 0.0, vector(bend.centre), 0.0)
    axis, start = np.array(bend.wheel.axis, dtype=float), bend.touches(bend.before)
    return Bow(vector(bend.centre), unit(axis), float(bend.wheel.radius), vector(start), float(bend.angle))


# ----------------------------------------------------------------------------------------------------------------------
# Arrows: gravity, forces, torques and given impulses, and what they are at a state. A load is an entry in _LAWS.


_STEEP: Final = 2.0
"""The angle (rad) from x at which the radius of a drum is named."""


@dataclass(frozen=True)
class ArrowLaw:
    """What an arrow is at a state: three expressions along the axes of a body, or one along an axis of it."""

    nodes: tuple[Node, ...]
    body: int
    axis: Vector | None = None
    moves: Marker | None = None

    def vector(self, motion: Motion) -> Floats:
        """Return it in the world (3), zero where it has no value."""
        try:
            if self.moves is not None:
                return -np.array(velocity(motion, self.moves), dtype=float)
            values = np.array(motion.state.values(self.nodes), dtype=float)
        except (*UNDEFINED, KeyError):
            return np.zeros(3)
        own = values if self.axis is None else values[0] * np.array(self.axis)
        return np.asarray(np.array(motion.rotation(self.body), dtype=float) @ own)


    def way(self, motion: Motion) -> Floats:
        """Return the direction in the world (3) in which it counts, zero where it has more than one component."""
        given = [k for k, node in enumerate(self.nodes) if node.shadow != 0]
        if self.moves is not None or len(given) != 1:
            return np.zeros(3)
        sign = -1.0 if text(self.nodes[given[0]]).startswith("-") else 1.0
        own = sign * (np.eye(3)[given[0]] if self.axis is None else np.array(self.axis))
        return np.asarray(np.array(motion.rotation(self.body), dtype=float) @ own)


Arrow = tuple[ArrowItem, ArrowLaw]


def arrow_items(stage: PlacedSystem) -> Iterator[Arrow]:
    """Yield gravity, loads, given impulses and prescribed motions of ground."""
    if np.any(stage.gravity):
        law = ArrowLaw(tuple(stage.mechanism.gravity), GROUND)
        yield _item(stage, "gravity", "gravity", "g", ("gravity",), Anchor(GROUND, ZERO), law)
    threads = {name: thread for thread in threads_of(stage) for name in (thread.force.name, thread.couple.name)}
    for load in stage.mechanism.loads:
        make, thread = _LAWS.get(type(load)), threads.get(load.name)
        if make is None or load.path[0] != "forces" or (thread is not None and thread.couple is load):
            continue
        for arrow, law in make(stage, load):
            yield (arrow if thread is None else replace(arrow, lever=thread.lever)), law
    yield from _impulses(stage)
    motion = stage.declared(GROUND_NAME).motion
    for k, node in enumerate(() if motion is None else (motion.x, motion.y, motion.z)):
        if node.shadow != 0:
            path, law = ("bodies", GROUND_NAME, "motion", "xyz"[k]), constant_law(np.eye(3)[k])
            label = short_formula(node, stage.system.inputs) or f"{'xyz'[k]}(t)"
            yield _item(stage, "motion", GROUND_NAME, label, path, Anchor(GROUND, ZERO), law)


def components(stage: PlacedSystem, values: Sequence[Node]) -> list[tuple[int, str]]:
    """Return the places and letters of the components of a vector if several have a letter each; else none."""
    given = [k for k, node in enumerate(values) if node.shadow != 0]
    found = [(k, speed_letter(stage, values[k])) for k in given]
    distinct = len({letter for _, letter in found}) == len(found) > 1
    return found if distinct and all(letter.isidentifier() for _, letter in found) else []


def _item(
    stage: PlacedSystem, role: Any, name: str, label: str, path: tuple[str, ...], at: Anchor, law: ArrowLaw
) -> Arrow:
    motion = stage.motion
    return ArrowItem(role, name, label, path, at, vector(law.vector(motion)), vector(law.way(motion))), law


def letter_of(name: str, declared: Any, inputs: Mapping[str, Any] | None = None) -> str:
    """Return the letter of a force: its value where that is short, the size of one at an angle, else its name.

    A value that is one of `inputs` is written as that is declared.
    """
    nodes = [node for node in (declared if isinstance(declared, tuple) else (declared,)) if node.shadow != 0]
    found = short_formula(nodes[0], inputs or {}) if len(nodes) == 1 else ""
    if found:
        return found
    turned = turned_by(declared)
    return turned.size if turned is not None and turned.size.isidentifier() else name  # F*cos(a), F*sin(a)


def _marker_anchor(stage: PlacedSystem, marker: Marker) -> Anchor:
    return Anchor(marker.body, vector(stage.motion.point(marker)))


def _force(stage: PlacedSystem, load: PointForce) -> Iterator[Arrow]:
    element = stage.system.forces.get(load.name)
    declared, frame = getattr(element, "value", ()), getattr(element, "frame", None)
    law, label = ArrowLaw(tuple(load.value), load.axes), letter_of(load.name, declared, stage.system.inputs)
    item, law = _item(stage, "force", load.name, label, load.path, _marker_anchor(stage, load.at), law)
    turned = turned_by(declared)
    if turned is not None and "." not in (frame or ""):  # beside the axis of its cosine
        own = stage.poses[load.axes][:, :3].T @ np.array(item.vector)
        axis = np.copysign(1.0, own[turned.cosine]) * np.eye(3)[turned.cosine]
        item = replace(item, angle=turned.angle, beside=Anchor(load.axes, vector(axis)))
    yield item, law


_ROW: Final = 9
"""How many arrows show a distributed load."""


def _row(stage: PlacedSystem, load: LineLoad) -> Iterator[Arrow]:
    """Yield a row of arrows from end to end, as long as the load is there; the longest has the letter."""
    begin, end = (np.array(vector(stage.motion.point(marker))) for marker in load.ends)
    label = letter_of(load.name, getattr(stage.system.forces.get(load.name), "value", ()), stage.system.inputs)
    row = []
    for part in np.linspace(0.0, 1.0, _ROW).tolist():
        known = {arc_leaf(load.name): multiply(real(part), load.length)}
        law = ArrowLaw(tuple(_put_in(node, known) for node in load.value), load.axes)
        at = Anchor(load.ends[0].body, vector(begin + part * (end - begin)))
        row.append(_item(stage, "force", load.name, "", load.path, at, law))
    sizes = [float(np.linalg.norm(item.vector)) for item, _ in row]
    longest = sizes.index(max(sizes))
    for k, (item, law) in enumerate(row):
        share = sizes[k] / sizes[longest] if sizes[longest] > 0.0 else 1.0
        yield replace(item, label=label if k == longest else "", share=share), law


def _put_in(node: Node, known: Mapping[Node, Node]) -> Node:
    found: Node = evaluate([node], lambda leaf: known.get(leaf, leaf))[0]
    return found


def _torque(stage: PlacedSystem, load: BodyTorque) -> Iterator[Arrow]:
    label = letter_of(load.name, getattr(stage.system.forces.get(load.name), "value", ()), stage.system.inputs)
    name = stage.mechanism.bodies[load.body].name if load.body >= 0 else "ground"
    centre = Anchor(load.body, stage.centre(name) if name in stage.system.bodies else ZERO)
    if load.at is not None:
        centre = _marker_anchor(stage, load.at)
    yield _item(stage, "torque", load.name, label, load.path, centre, ArrowLaw(tuple(load.value), load.axes))


def _force_in_joint(stage: PlacedSystem, load: JointForce) -> Iterator[Arrow]:
    """Yield the force or torque in a joint, on its child along the axis of the freedom."""
    element = stage.system.forces.get(load.name)
    if load.joint not in stage.system.joints:
        return
    made = placed_joint(stage, load.joint)
    freedom = getattr(element, "freedom", None)
    steps = [free.step for free in made.joint.free_steps] or list(made.joint.steps)
    names = [name for free in made.joint.free_steps for name in (made.name + f"_{free.step.coordinates[0].letter}",)]
    given = getattr(made.joint, "q", None) or names
    step = next((s for s, n in zip(steps, given, strict=False) if freedom in (n, f"u_{n}")), steps[0])
    axes = step.turns or step.slides
    if not axes:
        return
    law = ArrowLaw((load.value,), made.parent.body, made.on_parent(axes[0]))
    label = letter_of(load.name, getattr(element, "value", ()), stage.system.inputs)
    role, at = "torque" if step.turns else "force", made.child.anchor
    yield _item(stage, role, load.name, label, load.path, at, law)


def _drag(stage: PlacedSystem, load: PointDrag) -> Iterator[Arrow]:
    """Yield the force against a velocity, while that is zero against what sets the body in motion."""
    law, element = ArrowLaw((), -1, moves=load.at), stage.system.forces.get(load.name)
    terms = [(getattr(element, "linear", ZERO_NODE), "v"), (getattr(element, "quadratic", ZERO_NODE), "v^2")]
    parts = [(letters(factor), power) for factor, power in terms if factor.shadow != 0]
    named = parts and all(letter.isidentifier() for letter, _ in parts)
    label = " + ".join(f"{letter}*{power}" for letter, power in parts) if named else load.name
    item, law = _item(stage, "drag", load.name, label, load.path, _marker_anchor(stage, load.at), law)
    body = stage.mechanism.bodies[load.at.body].name
    gas, ahead = jet_of(stage, body, stage.declared(body)), stage.load_on(body)
    if gas is not None:
        ahead = -stage.turned(load.at.body, gas)
    yield replace(item, way=vector(-np.array(unit(ahead)) if np.any(ahead) else ahead)), law


_LAWS: Final[Mapping[type[Load], Callable[[PlacedSystem, Any], Iterator[Arrow]]]] = {
    PointForce: _force,
    LineLoad: _row,
    BodyTorque: _torque,
    JointForce: _force_in_joint,
    PointDrag: _drag,
}
"""The arrow of each kind of load; others run between points and are strands."""


@dataclass(frozen=True)
class Thread:
    """A force and its couple F*r on a round body: they are that of a thread wound on a drum of the radius r about z."""

    force: PointForce
    couple: BodyTorque
    arm: Node
    radius: float
    lever: Vector


def threads_of(stage: PlacedSystem) -> Iterator[Thread]:
    """Yield the threads that are declared as a force at the middle of a round body and a couple."""
    forces = [load for load in stage.mechanism.loads if isinstance(load, PointForce)]
    couples = [load for load in stage.mechanism.loads if isinstance(load, BodyTorque)]
    for force, couple in product(forces, couples):
        letter = letter_of("", getattr(stage.system.forces.get(force.name), "value", ()))
        x, y, z = getattr(stage.system.forces.get(couple.name), "value", (ZERO_NODE,) * 3)
        arm = _factor_beside(z, letter) if x.shadow == y.shadow == 0 and force.at.body == couple.body >= 0 else None
        if arm is None:
            continue
        radius, middle = stage.number(arm), vector(stage.motion.point(force.at))
        forms = [item.form for item in surface_items(stage, stage.mechanism.bodies[couple.body].name)]
        discs = [form for form in forms if isinstance(form, Disc) and same(form.centre, middle)]
        if any(abs(radius) < disc.radius for disc in discs):
            yield Thread(force, couple, arm, abs(radius), (0.0, 0.0, radius))


def _factor_beside(product_of: Node, letter: str) -> Node | None:
    """Return the other factor of a product with a letter, None of another expression."""
    if product_of.op == "neg":
        found = _factor_beside(product_of.args[0], letter)
        return None if found is None else -found
    if product_of.op != "mul" or not letter:
        return None
    first, second = product_of.args
    return second if first == symbol(letter) else first if second == symbol(letter) else None


def drum_items(stage: PlacedSystem) -> Iterator[Item]:
    """Yield the drums on which threads are wound."""
    for thread in threads_of(stage):
        middle, path = vector(stage.motion.point(thread.force.at)), ("forces", thread.couple.name)
        drum = Disc(middle, (0.0, 0.0, 1.0), thread.radius)
        yield Item("drum", thread.couple.name, "", path, thread.couple.body, drum)


def drum_radii(stage: PlacedSystem) -> Iterator[NamedLength]:
    """Yield the radii of the drums on which threads are wound."""
    for thread in threads_of(stage):
        yield radius_of(thread.couple.name, letters(thread.arm), thread.couple.body, ZERO, thread.radius, _STEEP)


def _impulses(stage: PlacedSystem) -> Iterator[Arrow]:
    if stage.system.impact is None:
        return
    for name, impact in stage.system.impact.strikes.items():
        if impact.impulse is not None and impact.at is not None:
            place = stage.place(impact.at)
            axes = stage.place(impact.frame or GROUND_NAME)
            at, path = place.anchor, stage.system.impact.path(name)
            for k, letter in components(stage, impact.impulse):
                part = stage.number(impact.impulse[k]) * np.eye(3)[k]
                own = stage.turned(axes.body, axes.turned(part))
                yield ArrowItem("impulse", name, letter, path, at, vector(own)), constant_law(own)
            if components(stage, impact.impulse):
                continue
            own = stage.turned(axes.body, axes.turned(stage.vector(impact.impulse)))
            letter = letter_of(name, impact.impulse)
            yield ArrowItem("impulse", name, letter, path, at, vector(own)), constant_law(own)


def constant_law(value: Floats) -> ArrowLaw:
    return ArrowLaw(tuple(as_node(float(x)) for x in value), GROUND)


# ----------------------------------------------------------------------------------------------------------------------
# Speeds at the start and given motions as they are seen: arrows along ways, bows about axes.


_SPEED: Final = "v_0"
"""The letter of a speed at the start that has none."""
_SPIN: Final = "omega_0"
"""That of an angular velocity."""
_OVER: Final = 1.3
"""Where the spin of a top is seen, in its heights."""


def speed_items(stage: PlacedSystem) -> Iterator[Arrow]:
    """Yield the speeds at the start and the steady ones of driven joints, with letters of their own or usual ones."""
    for name in stage.system.joints:
        yield from _speeds(_Given(stage, placed_joint(stage, name)))


@dataclass(frozen=True)
class _Given:
    """The speeds that a joint is given: at the start, or a steady one where it is driven."""

    stage: PlacedSystem
    joint: PlacedJoint

    @property
    def driven(self) -> Node | None:
        return driven_by(self.stage, self.joint.name)

    @property
    def nodes(self) -> list[Node]:
        """What is declared, zero for what is not; the rate of a steady motion."""
        if self.driven is not None:
            rate = steady_rate(self.driven)
            return [] if rate is None else [rate]
        initial = getattr(self.joint.joint, "initial", None)
        declared = () if initial is None or initial.u is None else initial.u
        return [ZERO_NODE if node is None else node for node in declared]

    @property
    def path(self) -> Path:
        return "joints", self.joint.name, "initial", "u"

    def arrow(self, letter: str, at: Anchor, world: Floats, *, turning: bool = False) -> Iterator[Arrow]:
        """Yield a speed (3) in the world at a place of a body, nothing where it is zero."""
        if np.any(world):
            item = ArrowItem("velocity", self.joint.name, letter, self.path, at, vector(world), turning=turning)
            yield item, constant_law(world)


def _speeds(given: _Given) -> Iterator[Arrow]:
    stage, made, nodes = given.stage, given.joint, given.nodes
    if given.driven is not None and not nodes and made.joint.kind == "prismatic":
        yield from _drives(given, given.driven)
    if not any(stage.number(node) for node in nodes):
        return
    body = stage.declared(stage.body(made.joint.child))
    particle = body.inertia is None and body.shape is None and stage.is_ground(made.joint.parent)
    if particle and not made.slides and len(made.turns) > 1:
        centre = stage.centre(stage.body(made.joint.child))  # a bob on a string
        yield from given.arrow(_SPEED, Anchor(made.child.body, centre), _velocity(given, centre))
    elif made.joint.kind == "spherical":
        yield from _spins(given, nodes)
    elif made.turns and not made.slides and len(nodes) == 1:
        yield from _turns(given, nodes[0])
    elif made.joint.kind == "planar" and len(nodes) == 3 and speed_letter(stage, nodes[2]):
        yield from _turns(given, nodes[2])
    elif made.joint.kind == "free":
        yield from _free_spins(given, nodes[3:])
    elif made.joint.kind == "custom" and made.slides and made.turns:
        across = len(nodes) == 2 and is_polar(stage, made.joint) and nodes[1].shadow == 0
        swung = list(_swung(given, nodes[0])) if across else []
        end = made.child.anchor
        yield from swung or given.arrow(_SPEED, end, _velocity(given, end.point))
        return
    if made.slides and made.joint.kind in ("point", "planar", "free", "prismatic"):
        yield from _ways(given, nodes[: len(made.slides)])


def _velocity(given: _Given, point: Vector) -> Floats:
    """Return the velocity of a point of the child at the start (3)."""
    return velocity_of(given.stage, replace(given.joint.child, point=point))


def _turns(given: _Given, rate: Node) -> Iterator[Arrow]:
    """Yield the spin of a hinge, or the speed of what it carries where that is given or free."""
    stage, made = given.stage, given.joint
    swung = list(_swung(given, rate))
    if swung:
        yield from swung
        return
    spin = stage.turned(made.parent.body, stage.number(rate) * np.array(made.on_parent(made.turns[-1])))
    at = made.child.anchor
    yield from given.arrow(speed_letter(stage, rate) or _spin_letter(given), at, spin, turning=True)


def _spin_letter(given: _Given) -> str:
    """Return the letter of a spin that has none: omega with the index of its coordinate where several have none."""
    stage, bare = given.stage, []
    for name in stage.system.joints:
        other = _Given(stage, placed_joint(stage, name))
        if other.joint.turns and not other.joint.slides and any(stage.number(node) for node in other.nodes):
            bare += [name] if not speed_letter(stage, other.nodes[-1]) else []
    if len(bare) < 2:
        return "omega" if given.driven is not None else _SPIN
    q: Sequence[str] = getattr(given.joint.joint, "q", None) or ()
    lettered = len(q) == 1 and is_letter(stage.system, q[0])
    return f"omega_{q[0] if lettered else bare.index(given.joint.name) + 1}"


def _spins(given: _Given, nodes: Sequence[Node]) -> Iterator[Arrow]:
    """Yield the angular velocities at a ball joint: about an axis of ground and one of the body by Euler's angles.

    Of components along the axes of the body those that have a letter, and the spin of a top.
    """
    stage, made = given.stage, given.joint
    order: str | None = getattr(made.joint, "angles", None)
    name = stage.body(made.joint.child)
    cone = top(stage, name, stage.declared(name))
    tip = made.child.anchor
    high = np.array(tip.point) if cone is None else np.array(cone.tip) + _OVER * cone.height * np.array(cone.axis)
    over = Anchor(tip.body, vector(high))
    for k, node in enumerate(nodes):
        letter, number = speed_letter(stage, node), stage.number(node)
        axis, own = np.eye(3)["xyz".index(order[k]) if order else k], bool(order) and k == 0
        body, way = (made.parent.body, made.parent.turned(axis)) if own else (made.child.body, vector(axis))
        world = stage.turned(body, way)
        along = cone is not None and abs(float(np.array(cone.axis) @ axis)) > 0.999 and not own
        if order is not None and k == 1:
            continue  # about the line of nodes
        if letter or along or (cone is None and k == 2):
            yield from given.arrow(letter or _SPIN, over if along else tip, number * world, turning=True)


def _free_spins(given: _Given, nodes: Sequence[Node]) -> Iterator[Arrow]:
    """Yield the angular velocities of what flies: those with a letter about axes of the body, else their sum."""
    stage, made = given.stage, given.joint
    if getattr(made.joint, "angles", None):
        return
    at = made.child.anchor
    parts = [stage.number(node) * np.eye(3)[k] for k, node in enumerate(nodes)]
    named = [(speed_letter(stage, node), part) for node, part in zip(nodes, parts, strict=True)]
    if any(letter for letter, _ in named):
        for letter, part in named:
            if letter:
                yield from given.arrow(letter, at, stage.turned(made.child.body, part), turning=True)
        return
    whole = sum(parts, np.zeros(3))
    yield from given.arrow(_SPIN, at, stage.turned(made.child.body, whole), turning=True)


def _ways(given: _Given, speeds: Sequence[Node]) -> Iterator[Arrow]:
    """Yield the speed of what slides or flies, or its components where each has a letter."""
    stage, made = given.stage, given.joint
    at, ways = made.child.anchor, [made.on_parent(axis) for axis in made.slides]
    own = [stage.number(node) * np.array(way) for node, way in zip(speeds, ways, strict=True)]
    parts = components(stage, speeds)
    if parts:
        for k, letter in parts:
            yield from given.arrow(letter, at, stage.turned(made.parent.body, own[k]))
        return
    turned = turned_by(tuple(speeds))
    world = stage.turned(made.parent.body, sum(own, np.zeros(3)))
    for item, law in given.arrow(letter_of(_SPEED, tuple(speeds)), at, world):
        if turned is not None and len(made.slides) == 2:
            axis = np.copysign(1.0, stage.number(speeds[turned.cosine])) * np.array(ways[turned.cosine])
            item = replace(item, angle=turned.angle, beside=Anchor(made.parent.body, vector(axis)))
        yield item, law


def _swung(given: _Given, rate: Node) -> Iterator[Arrow]:
    """Yield the speed v of what turns at v/R and is at R from the axis, and v_0 of a free particle; of another none."""
    stage, made = given.stage, given.joint
    speed, reach = rate.args if rate.op == "div" else (ZERO_NODE, ZERO_NODE)
    about = stage.turned(made.parent.body, np.array(unit(made.on_parent(made.turns[-1]))))
    base, own = stage.world(made.parent.body, made.parent.point), stage.body(made.joint.child)
    ends = [(made.child.body, stage.centre(own))]
    for name, joint in stage.system.joints.items():  # what slides on an arm
        if joint.kind == "prismatic" and stage.body(joint.parent) == own:
            ends.append((stage.number_of(stage.body(joint.child)), placed_joint(stage, name).child.point))
    for body, point in ends:
        arm = stage.world(body, point) - base
        arm = arm - float(arm @ about) * about
        size = float(np.linalg.norm(arm))
        named = letters(reach).isidentifier() and size > 0.0 and abs(size - stage.number(reach)) < 1e-6 * size
        letter = speed_letter(stage, speed) if named else ""
        if letter or (size > 0.0 and counts_freely(stage, own)):
            way = stage.number(rate) * np.cross(about, arm)
            yield from given.arrow(letter or _SPEED, Anchor(body, point), way)
            return


def _drives(given: _Given, driven: Node) -> Iterator[Arrow]:
    """Yield the motion that a slider is given if that is short, or its constant acceleration."""
    stage, made = given.stage, given.joint
    acceleration = derivative(derivative(driven, t), t)
    label, sign = short_formula(driven, stage.system.inputs), 1.0
    if t not in leaves([acceleration], "symbol"):
        label, sign = speed_letter(stage, acceleration), float(np.sign(stage.number(acceleration)))
    if label and sign:
        way = sign * np.array(stage.turned(made.parent.body, made.on_parent(made.slides[0])))
        at, path = made.child.anchor, ("joints", made.name, "motion")
        yield ArrowItem("velocity", made.name, label, path, at, vector(way)), constant_law(way)
