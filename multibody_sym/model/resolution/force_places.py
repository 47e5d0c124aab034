"""Where the forces of couplings act, as far as it is declared, and which reactions remain undetermined where it is not.

A row gives a generalised force: the power of its forces in the motions that the joints allow. An expression, a coupler,
a gear without radii, a constraint of speeds say no more. Their forces may be any on the bodies next to the joints that
they name which have this power; what the joints transmit on their account is their business.

- Forces between bodies that the named joints join are borne by these joints. From one group of bodies to another they
  take the way through the tree of joints; where a joint on it is part of a closed loop, any way through the loop.
- Through a joint on the way anything may pass, in a plane model within the plane. Along a freedom that the row does not
  name its forces have no power, so there the joint's reaction is that of its own drives.
- With `acts: in_joints` the row drives each joint that it names along its freedoms, and everything is determined.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

from multibody_sym.errors import ModelError, at
from multibody_sym.expressions.components import COMPONENTS
from multibody_sym.expressions.quantities import force_name
from multibody_sym.model.declaration.constraints import CONSTRAINTS, Gear
from multibody_sym.model.declaration.joints import Prismatic
from multibody_sym.model.declaration.steps import Step
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import Mechanism, TreeBody, Withheld
from multibody_sym.model.mechanism.rows import ExpressionRow, VelocityRow
from multibody_sym.model.resolution.plane import in_plane
from multibody_sym.model.resolution.spanning_tree import body_part
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.traversal import leaves

_IN_PLANE: Final = ("fx", "fy", "mz")
_INSTEAD: Final[Mapping[str, str]] = {
    "gear": "give the gear radii: [r1, r2]",
    "gear on a rack": "let the wheel roll on a plane of the rack (type: rolling)",
    "gear between slides": "declare a rope or a rod",
    "velocity": "declare rolling where wheels roll",
}
_ELSE: Final = "declare a rope round the wheel, a rod, a gear with radii"


def with_withheld(resolved: Mechanism, system: System) -> Mechanism:
    """Return a mechanism that knows which reactions are undetermined; outputs that name such are left out.

    Raises ModelError where a stop hangs on one.
    """
    found = resolved.relative.withheld if resolved.relative is not None else _withheld(resolved, system)
    if not found:
        return resolved
    for name, node in resolved.stops.items():
        for joint, component in _undetermined(found, node):
            with at("stop", name):
                because = reasons({joint: found[joint]})[0]
                raise ModelError(f"{force_name(joint, component)} is not determined: {because}", number="M112")
    declared = {**resolved.outputs, **resolved.run_outputs}
    untold = tuple(name for name, node in declared.items() if _undetermined(found, node))
    outputs, of_run = (
        {name: node for name, node in own.items() if name not in untold}
        for own in (resolved.outputs, resolved.run_outputs)
    )
    return replace(resolved, withheld=found, untold=untold, outputs=outputs, run_outputs=of_run)


def is_undetermined(withheld: Mapping[str, Withheld], node: Node) -> bool:
    """Return whether an expression names a reaction that is withheld."""
    return bool(_undetermined(withheld, node))


def _undetermined(withheld: Mapping[str, Withheld], node: Node) -> list[tuple[str, str]]:
    found = leaves([node], "quantity")
    asked = [leaf.data[1] for leaf in found if leaf.data[0] == "reaction"]
    named = [leaf.data[1][0] for leaf in found if leaf.data[0] in ("power", "work", "impulse")]
    whole = [(joint, part) for joint in named if joint in withheld for part in withheld[joint].components[:1]]
    told = [(joint, part) for joint, part in asked if joint in withheld and part in withheld[joint].components]
    return [*told, *whole]


def reasons(withheld: Mapping[str, Withheld]) -> list[str]:
    """Return for each constraint behind withheld reactions why they are, and what to declare instead."""
    because = {name: kind for each in withheld.values() for name, kind in each.because}
    return [
        f"{name} ({kind}) says nothing of where its force acts; {_INSTEAD.get(kind, _ELSE)}, or acts: in_joints if it "
        "drives each joint along its own axis"
        for name, kind in because.items()
    ]


# --- what a row's force could reach --------------------------------------------------------------------------------


def _withheld(resolved: Mechanism, system: System) -> dict[str, Withheld]:
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
            told = _told(bodies[joint], named) if joint in bodies else _told_of_cut(system, joint)
            for component in (c for c in possible if c not in told):
                reached.setdefault(joint, {}).setdefault(component, set()).add(row.name)
    kinds = {name: _kind(system, name) for name in system.constraints}
    return {
        joint: Withheld(
            tuple(c for c in COMPONENTS if c in reached[joint]),
            tuple((name, kind) for name, kind in kinds.items() if any(name in x for x in reached[joint].values())),
        )
        for joint in resolved.joint_names
        if joint in reached
    }


def _kind(system: System, name: str) -> str:
    """Return what kind of constraint one is; of gears also whether both joints have wheels, which alone have radii."""
    constraint = system.constraints[name]
    if isinstance(constraint, Gear):
        slides = sum(isinstance(system.joints[joint], Prismatic) for joint in constraint.joints)
        return ("gear", "gear on a rack", "gear between slides")[slides]
    declared = type(constraint)
    return next(kind for kind, element in CONSTRAINTS.table.items() if element is declared)


def _named_speeds(resolved: Mechanism, zero: Node) -> set[int]:
    """Return the speeds on which a row with this expression exerts something."""
    found = {leaf.data[1] for leaf in leaves([zero], "slot") if leaf.data[0] == "u"}
    if found:  # a constraint of speeds: coordinates in it only measure
        return found
    coordinates = {leaf.data[1] for leaf in leaves([zero], "slot") if leaf.data[0] == "q"}
    for body in resolved.bodies:
        found.update(u for free in body.free_steps if not coordinates.isdisjoint(free.q) for u in free.u)
    return found


def _told(body: TreeBody, named: set[int]) -> set[str]:
    """Return the components of a joint's reaction along freedoms that a row does not name."""
    free = [k for k, step in enumerate(body.steps) if step.motion is None]
    idle = [k for k, moved in zip(free, body.free_steps, strict=True) if named.isdisjoint(moved.u)]
    return _components(body.steps, idle)


def _told_of_cut(system: System, joint: str) -> set[str]:
    """Return the same of a joint that is cut: it has no coordinates that a row could name."""
    steps = system.joints[joint].steps
    return _components(steps, range(len(steps)))


def _components(steps: Sequence[Step], idle: Iterable[int]) -> set[str]:
    """Return the components along those steps that move or turn along an axis of the frame on the parent, whatever the
    others do: translations before all rotations, a first rotation with no translation after it."""
    first_turn = next((k for k, step in enumerate(steps) if step.turns), len(steps))
    last_slide = max((k for k, step in enumerate(steps) if step.slides), default=-1)
    found: set[str] = set()
    for k in idle:
        if steps[k].is_independent and (k < first_turn or k == first_turn > last_slide):
            found.update(_along(steps[k]))
    return found


def _along(step: Step) -> Iterator[str]:
    """Yield the components of the reaction along the axes of a step, as far as these are x, y or z."""
    for first, directions in ((0, step.slides), (3, step.turns)):
        for direction in directions:
            sizes = [abs(float(x.shadow)) if x.shadow is not None else 1.0 for x in direction]
            axes = [k for k, size in enumerate(sizes) if size > 0.0]
            if len(axes) == 1:
                yield COMPONENTS[first + axes[0]]


@dataclass(frozen=True)
class _Graph:
    """The joints by their bodies, and each body of the tree with the joint that carries it."""

    ends: Mapping[str, tuple[str, str]]
    carriers: Mapping[str, str]

    @classmethod
    def of(cls, resolved: Mechanism, system: System) -> _Graph:
        """Return the graph of the declared joints, with the mechanism's spanning tree."""
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
