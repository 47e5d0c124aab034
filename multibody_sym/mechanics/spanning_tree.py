"""Which joint carries each body, which joints close loops and are cut, and by which rows do cut joints hold?"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Final

from multibody_sym.errors import ModelError, at, brief
from multibody_sym.mechanics.row_records import AngleRow, Marker, PositionRow, Row
from multibody_sym.model.bodies import GROUND, IDENTITY, Body, unit_vector
from multibody_sym.model.fields import AXES, Point
from multibody_sym.model.joints import Joint, MovingJoint
from multibody_sym.model.system import System, expressions
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import ZERO
from multibody_sym.scalars.vectors import cross, dot

MOST_BODIES: Final = 20_000


@dataclass(frozen=True)
class SpanningTree:
    """The names of the joints that carry bodies, in tree order (parents first), and of those that are cut."""

    carrying: tuple[str, ...]
    cut: tuple[str, ...]


@dataclass(frozen=True)
class _Edge:
    """A joint as an edge of the graph of bodies."""

    name: str
    parent: str
    child: str
    preference: tuple[bool, int]
    place: int


def spanning_tree(system: System) -> SpanningTree:
    """Return the tree of joints that carries every body.

    Where several joints lead to a body one carries it and the others are cut: never a joint marked `cut`, rather one
    whose coordinates have start values or are used than another, rather one with few freedoms, rather one near ground.
    Raises ModelError for unknown bodies, and where a body cannot be reached.
    """
    if len(system.bodies) > MOST_BODIES:
        raise ModelError(f"more than {MOST_BODIES} bodies", number="M109").under("bodies")
    used = used_joints(system)
    edges = []
    for place, (name, joint) in enumerate(system.joints.items()):
        with at("joints", name, "parent"):
            parent, _ = body_part(joint.parent, system.bodies)
        with at("joints", name, "child"):
            child, _ = body_part(joint.child, system.bodies)
            if child == GROUND:
                raise ModelError("ground cannot be a child; swap parent and child", number="M111")
            if child == parent:
                raise ModelError(f"the joint joins {child!r} to itself", number="M111")
        edges.append(_Edge(name, parent, child, (name not in used, len(joint.speed_units)), place))
    kept = [edge for edge in edges if not system.joints[edge.name].cut]
    best: dict[str, tuple[bool, int]] = {}
    for edge in kept:
        best[edge.child] = min(best.get(edge.child, edge.preference), edge.preference)
    carrying = _grow([edge for edge in kept if edge.preference == best[edge.child]])
    if len(carrying) < len({edge.child for edge in kept}):
        carrying = _grow(kept)
    _verify_all_joined(system, kept, carrying)
    # the carrying joints from ground outward, branch by branch, in the order of the file
    leaving: dict[str, list[_Edge]] = {}
    for edge in sorted(carrying.values(), key=lambda edge: -edge.place):
        leaving.setdefault(edge.parent, []).append(edge)
    order: list[str] = []
    stack = list(leaving.get(GROUND, []))
    while stack:
        edge = stack.pop()
        order.append(edge.name)
        stack.extend(leaving.get(edge.child, []))
    return SpanningTree(tuple(order), tuple(edge.name for edge in edges if edge.name not in set(order)))


def body_part(reference: str, bodies: Mapping[str, Body]) -> tuple[str, str]:
    """Split `body.point` into both names (the point empty where there is none); either may contain dots."""
    body, point = reference, ""
    while body not in bodies and body != GROUND:
        body, dot, last = body.rpartition(".")
        point = f"{last}.{point}" if point else last
        if not dot:
            raise _unknown_body(reference, bodies)
    return body, point


def _unknown_body(reference: str, bodies: Mapping[str, Body]) -> ModelError:
    """Return the error for a name that begins with no body: maybe it is a body's point, without the body."""
    first = reference.partition(".")[0]
    owners = [name for name, body in bodies.items() if reference in (*body.points, *body.frames, *body.surfaces)]
    told, known = f"no body is called {first!r}", {**bodies, GROUND: None}
    if len(owners) > 1:
        every = " or ".join(brief([f"{name}.{reference}" for name in owners]))
        return ModelError(f"{told}; a point stands behind its body: {every}", number="M106", word=first)
    meant = f"{owners[0]}.{reference}" if owners else None
    return ModelError(told, number="M106", word=first, known=known, meant=meant)


def coordinate_names(name: str, joint: Joint) -> tuple[str, ...]:
    given = joint.q if isinstance(joint, MovingJoint) else None
    return given or tuple(name + suffix for suffix in joint.coordinate_suffixes)


def letters_of(system: System) -> dict[str, str]:
    """Return the book's letters of parameters and coordinates that have one, by name."""
    found = {name: parameter.label for name, parameter in system.parameters.items() if parameter.label}
    for name, joint in system.joints.items():
        if isinstance(joint, MovingJoint) and joint.q_label is not None:
            found.update(zip(coordinate_names(name, joint), joint.q_label, strict=True))
    return found


def speed_names(name: str, joint: Joint) -> tuple[str, ...]:
    """Return the names of a joint's speeds."""
    coordinates = coordinate_names(name, joint)
    pairs = enumerate(joint.speed_suffixes)
    return tuple(f"u_{coordinates[k]}" if suffix is None else name + suffix for k, suffix in pairs)


def start_names(system: System) -> list[str]:
    """Return the names of what has a value at the start: coordinates and speeds joint by joint, declared states."""
    joints = system.joints.items()
    moving = (x for name, joint in joints for x in (*coordinate_names(name, joint), *speed_names(name, joint)))
    return [*moving, *system.states]


def free_name(wanted: str, taken: Collection[str]) -> str:
    """Return a name that is not taken: the wanted one, or that with a number."""
    plain = wanted.replace(".", "_")
    numbered = (plain, *(f"{plain}_{k}" for k in range(2, len(taken) + 3)))
    return next(name for name in numbered if name not in taken)


def rate_names(system: System) -> list[tuple[str, str]]:
    """Return the names of all coordinates whose rates are speeds, with the names of these."""
    return [pair for name, joint in system.joints.items() for pair in rate_pairs(name, joint)]


def rate_pairs(name: str, joint: Joint) -> list[tuple[str, str]]:
    """Return the names of a joint's coordinates whose rates are speeds, with the names of these."""
    coordinates, speeds = coordinate_names(name, joint), speed_names(name, joint)
    return [(coordinates[q], speeds[u]) for free in joint.free_steps for q, u in free.rate_pairs]


def used_joints(system: System) -> set[str]:
    """Return the joints that start values, forces, constraints or expressions refer to by a coordinate or speed."""
    named = {leaf.data for leaf in leaves([written.node for written in expressions(system)], "symbol")}
    used = set()
    for name, joint in system.joints.items():
        started = isinstance(joint, MovingJoint) and (joint.initial is not None or joint.stops is not None)
        if started or not named.isdisjoint((*coordinate_names(name, joint), *speed_names(name, joint))):
            used.add(name)
    for element in (*system.forces.values(), *system.constraints.values()):
        used.update(filter(None, (getattr(element, "joint", None), *(getattr(element, "joints", None) or ()))))
    return used


def _grow(edges: Iterable[_Edge]) -> dict[str, _Edge]:
    """Return for each body that can be reached the edge that carries it, grown from ground: near bodies first."""
    leaving: dict[str, list[_Edge]] = {}
    for edge in edges:
        leaving.setdefault(edge.parent, []).append(edge)
    carrying: dict[str, _Edge] = {}
    frontier = [(1, edge.preference, edge.place, edge) for edge in leaving.get(GROUND, [])]
    heapq.heapify(frontier)
    while frontier:
        depth, _, _, edge = heapq.heappop(frontier)
        if edge.child not in carrying:
            carrying[edge.child] = edge
            for further in leaving.get(edge.child, []):
                heapq.heappush(frontier, (depth + 1, further.preference, further.place, further))
    return carrying


def _verify_all_joined(system: System, edges: Sequence[_Edge], carrying: Mapping[str, _Edge]) -> None:
    entering = {edge.child: edge for edge in edges}
    for body in system.bodies:
        if body in carrying or body == GROUND:
            continue
        if body not in entering:
            with at("bodies", body):
                cut = next((name for name, joint in system.joints.items() if joint.child.split(".")[0] == body), None)
                if cut is not None:
                    raise ModelError(
                        f"every joint that leads to {body!r} is cut; leave one of them uncut", number="M110"
                    )
                raise ModelError(f"nothing joins {body!r} to the rest; add a joint with child: {body}", number="M111")
        with at("joints", entering[body].name):
            raise ModelError(
                f"{body!r} hangs on a circle of joints that never reaches ground; turn one around", number="M111"
            )


def ground_moves(bodies: Mapping[str, Body]) -> bool:
    """Return whether ground moves. Raises ModelError for a motion of another body, or a joint's name that it takes."""
    for name, body in bodies.items():
        if body.motion is not None and name != GROUND:
            with at("bodies", name, "motion"):
                raise ModelError(
                    "only ground moves by itself; prescribe the motion of the joint that carries the body",
                    number="M111",
                )
    return GROUND in bodies and bodies[GROUND].motion is not None


# ----------------------------------------------------------------------------------------------------------------------
# Cut joints: the rows that stand for a joint which closes a loop, named after it.
#
# A joint that moves along straight directions first and then turns restricts what is left: its child's frame M keeps
# its place along the normals of those directions in the parent's frame F, and M's axes their angles to F's.

_X, _Y, _Z = IDENTITY
_NOT_PARALLEL: Final = 1e-9


def has_rows(joint: Joint) -> bool:
    """Return whether rows without coordinates of their own can stand for a joint.

    Not for screws, motion that is prescribed, motion along directions that have turned, and turns about one axis twice.
    """
    if joint.moves != joint.steps:
        return False
    first_turn = next((k for k, step in enumerate(joint.steps) if step.turns), len(joint.steps))
    straight = not any(step.slides for step in joint.steps[first_turn:])
    turns = [axis for step in joint.steps for axis in step.turns]
    free = all(step.is_independent for step in joint.steps)
    if not straight or not free or len(turns) > 3:
        return False
    sines = [[x.shadow for x in cross(a, b)] for a, b in pairwise(turns)]
    return not any(all(x is not None and abs(x) < _NOT_PARALLEL for x in each) for each in sines)


def cut_rows(name: str, joint: Joint, frames: tuple[Marker, Marker]) -> list[Row]:
    """Return the rows that stand for a joint between frame F of its parent and frame M of its child."""
    moves = [unit_vector(axis) for step in joint.steps for axis in step.slides]
    turns = [unit_vector(axis) for step in joint.steps for axis in step.turns]
    rows: list[Row] = []
    for letter, axis in zip(*_normals(moves, ("x", "y", "z"), "n"), strict=True):
        rows.append(PositionRow(f"{name}.{letter}", frames, axis))
    return rows if len(turns) == 3 else rows + _angle_rows(name, turns, frames)


def welded_rows(name: str, frames: tuple[Marker, Marker]) -> list[Row]:
    """Return the rows that hold frame M in frame F."""
    positions: list[Row] = [
        PositionRow(f"{name}.{letter}", frames, axis) for letter, axis in zip(AXES, IDENTITY, strict=True)
    ]
    return positions + _angle_rows(name, (), frames)


def _angle_rows(name: str, axes: Sequence[Point], frames: tuple[Marker, Marker]) -> list[Row]:
    if not axes:
        pairs = zip(AXES, ((_Z, _Y), (_X, _Z), (_Y, _X)), IDENTITY, strict=True)
        return [AngleRow(f"{name}.r{letter}", frames, pair, shared=axis) for letter, pair, axis in pairs]
    if len(axes) == 1:
        letters, normals = _normals(axes, ("rx", "ry", "rz"), "r")
        return [
            AngleRow(f"{name}.{letter}", frames, (cross(normal, axes[0]), axes[0]), shared=axes[0])
            for letter, normal in zip(letters, normals, strict=True)
        ]
    return [AngleRow(f"{name}.r", frames, (axes[0], axes[1]), dot(axes[0], axes[1]))]


def normals_of(axis: Point) -> tuple[Point, Point]:
    """Return two unit vectors normal to a direction and to each other."""
    first, second = _normals([unit_vector(axis)], AXES, "")[1]
    return first, second


def _normals(axes: Sequence[Point], letters: tuple[str, str, str], other: str) -> tuple[list[str], list[Point]]:
    """Return unit vectors that with `axes` span space, with their names: coordinate axes where they will do."""
    plain = [k for k, unit in enumerate(IDENTITY) if all(dot(unit, axis) is ZERO for axis in axes)]
    if len(plain) == 3 - len(axes):
        return [letters[k] for k in plain], [IDENTITY[k] for k in plain]
    if len(axes) == 2:
        normals = [unit_vector(cross(*axes))]
    else:
        sizes = [abs(float(x.shadow)) if x.shadow is not None else 1.0 for x in axes[0]]
        least = IDENTITY[sizes.index(min(sizes))]  # the coordinate axis along which the first has least
        first = IDENTITY[plain[0]] if plain else unit_vector(cross(axes[0], least))
        normals = [first, unit_vector(cross(axes[0], first))]
    return [f"{other}{k}" for k in range(1, len(normals) + 1)], normals

