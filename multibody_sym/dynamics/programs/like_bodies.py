"""Kinds of bodies: bodies whose declarations, and whose joints' forces, are the same but for the slots they name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any

from multibody_sym.kinematics.state import State
from multibody_sym.model.mechanism.loads import JointForce, JointSpring, Load
from multibody_sym.model.mechanism.mechanism import Mechanism, TreeBody
from multibody_sym.program.passes import Bodies
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import Node, slot


@dataclass(frozen=True)
class Kind:
    """A kind of body as a mechanism of this one body on ground, in slots of its own; `state` has those as values."""

    mechanism: Mechanism
    state: State

    @property
    def body(self) -> TreeBody:
        """The body."""
        return self.mechanism.bodies[0]


@dataclass(frozen=True)
class LikeBodies:
    """The kinds of a mechanism's bodies, and for each body its kind and what its slots stand for (`bodies`)."""

    kinds: tuple[Kind, ...]
    bodies: Bodies


def like_bodies(mechanism: Mechanism) -> LikeBodies | None:
    """Return the kinds of bodies; None where a load acts on more than a joint's own speed."""
    loads = _loads_of_bodies(mechanism)
    if loads is None:
        return None
    numbers: dict[Any, int] = {}
    kinds: list[Kind] = []
    leaves: list[tuple[Node, ...]] = []
    chosen, atoms = [], []
    for body, own in zip(mechanism.bodies, loads, strict=True):
        local = _Local(body)
        renamed, pulling = local.body(body), local.loads(own)
        identity = renamed, pulling, tuple(local.slots.values())
        if identity not in numbers:
            numbers[identity] = len(kinds)
            kinds.append(_kind(mechanism, renamed, pulling, identity[2]))
            leaves.append(identity[2])
        chosen.append(numbers[identity])
        atoms.append(tuple(local.slots))
    return LikeBodies(tuple(kinds), Bodies(tuple(chosen), tuple(leaves), tuple(atoms)))


def _kind(mechanism: Mechanism, body: TreeBody, loads: tuple[Load, ...], leaves: Sequence[Node]) -> Kind:
    alone = replace(mechanism, bodies=(body,), loads=loads, rows=(), coordinates=(), speeds=())
    q, u = ([leaf for leaf in leaves if leaf.data[0] == array] for array in "qu")
    return Kind(alone, State(Node, tuple(q), tuple(u), {leaf: leaf for leaf in leaves}))


def _loads_of_bodies(mechanism: Mechanism) -> list[list[Load]] | None:
    carried = {speed: index for index, body in enumerate(mechanism.bodies) for speed in body.u}
    found: list[list[Load]] = [[] for _ in mechanism.bodies]
    for load in mechanism.loads:
        if not isinstance(load, (JointForce, JointSpring)) or load.rate.op != "slot":
            return None
        found[carried[load.rate.data[1]]].append(replace(load, name="", joint=""))
    return found


class _Local:
    """Renames the slots of one body: its own coordinates and speeds count from 0, then others as they are met."""

    def __init__(self, body: TreeBody) -> None:
        self.slots: dict[Node, Node] = {}
        self.counts: dict[str, int] = {}
        for array, places in (("q", body.q), ("u", body.u)):
            for place in places:
                self._leaf(slot(array, place))

    def body(self, body: TreeBody) -> TreeBody:
        """Return the body as the first on ground."""
        q, u = tuple(range(len(body.q))), tuple(range(len(body.u)))
        renamed = replace(body, name="", joint_name="", parent=-1, q=q, u=u)
        return self._renamed(renamed)  # type: ignore[no-any-return]

    def loads(self, loads: Sequence[Load]) -> tuple[Load, ...]:
        """Return loads on the body's joint."""
        return self._renamed(tuple(loads))  # type: ignore[no-any-return]

    def _renamed(self, part: Any) -> Any:
        if isinstance(part, Node):
            if part.shadow is not None:
                return part
            return self._leaf(part) if not part.args else evaluate([part], self._leaf)[0]
        if type(part) is tuple:
            return tuple(map(self._renamed, part))
        if is_dataclass(part) and not isinstance(part, type):
            return replace(part, **{field.name: self._renamed(getattr(part, field.name)) for field in fields(part)})
        return part

    def _leaf(self, leaf: Node) -> Node:
        """Return the slot of the same array that stands for a leaf; the time stays what it is."""
        if leaf not in self.slots:
            array = leaf.data[0]
            self.slots[leaf] = slot(array, self.counts.setdefault(array, 0))
            self.counts[array] += 1
        return self.slots[leaf]
