"""The spanning tree of a system's joints: which joint carries each body, and which joints close loops and are cut."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

from multibody_sym.errors import ModelError, at, brief
from multibody_sym.model.declaration.bodies import Body
from multibody_sym.model.declaration.joint import Joint, MovingJoint
from multibody_sym.model.declaration.system import System, expressions
from multibody_sym.model.mechanism.mass import GROUND
from multibody_sym.records import dataclass
from multibody_sym.scalars.traversal import leaves

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
    edges = [_edge(place, name, joint, system, used) for place, (name, joint) in enumerate(system.joints.items())]
    kept = [edge for edge in edges if not system.joints[edge.name].cut]
    carrying = _grown(_preferred(kept))
    if len(carrying) < len({edge.child for edge in kept}):
        carrying = _grown(kept)
    _verify_all_joined(system, kept, carrying)
    order = _depth_first(carrying)
    return SpanningTree(tuple(order), tuple(edge.name for edge in edges if edge.name not in set(order)))


def body_part(reference: str, bodies: Mapping[str, Body]) -> tuple[str, str]:
    """Split `body.point` into both names (the point empty where there is none); either may contain dots."""
    body, point = reference, ""
    while body not in bodies and body != GROUND:
        body, dot, last = body.rpartition(".")
        point = f"{last}.{point}" if point else last
        if not dot:
            raise _no_body(reference, bodies)
    return body, point


def _no_body(reference: str, bodies: Mapping[str, Body]) -> ModelError:
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
    """Return the names of a joint's coordinates."""
    given = joint.q if isinstance(joint, MovingJoint) else None
    return given or tuple(name + suffix for suffix in joint.coordinate_suffixes)


def speed_names(name: str, joint: Joint) -> tuple[str, ...]:
    """Return the names of a joint's speeds."""
    coordinates = coordinate_names(name, joint)
    pairs = enumerate(joint.speed_suffixes)
    return tuple(f"u_{coordinates[k]}" if suffix is None else name + suffix for k, suffix in pairs)


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


def _edge(place: int, name: str, joint: Joint, system: System, used: set[str]) -> _Edge:
    with at("joints", name, "parent"):
        parent, _ = body_part(joint.parent, system.bodies)
    with at("joints", name, "child"):
        child, _ = body_part(joint.child, system.bodies)
        if child == GROUND:
            raise ModelError("ground cannot be a child; swap parent and child", number="M111")
        if child == parent:
            raise ModelError(f"the joint joins {child!r} to itself", number="M111")
    return _Edge(name, parent, child, (name not in used, len(joint.speed_units)), place)


def _preferred(edges: Sequence[_Edge]) -> list[_Edge]:
    """Return the edges without those whose child a more preferred one reaches."""
    best: dict[str, tuple[bool, int]] = {}
    for edge in edges:
        best[edge.child] = min(best.get(edge.child, edge.preference), edge.preference)
    return [edge for edge in edges if edge.preference == best[edge.child]]


def _grown(edges: Iterable[_Edge]) -> dict[str, _Edge]:
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


def _depth_first(carrying: Mapping[str, _Edge]) -> list[str]:
    """Return the carrying joints from ground outward, branch by branch, in the order of the file."""
    leaving: dict[str, list[_Edge]] = {}
    for edge in sorted(carrying.values(), key=lambda edge: -edge.place):
        leaving.setdefault(edge.parent, []).append(edge)
    order: list[str] = []
    stack = list(leaving.get(GROUND, []))
    while stack:
        edge = stack.pop()
        order.append(edge.name)
        stack.extend(leaving.get(edge.child, []))
    return order


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
