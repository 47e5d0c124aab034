"""Inputs that drive motions and constraints, outputs that others name: there they stand for their expressions.

A force follows from the value of an input. What moves as prescribed follows from its first and second derivative too,
which a value does not have.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import Any

from multibody_sym.errors import ModelError, at
from multibody_sym.model.declaration.curves.follow import Follow
from multibody_sym.model.declaration.fields import Names
from multibody_sym.model.declaration.joint import Joint
from multibody_sym.model.declaration.system import System, expressions, with_expressions
from multibody_sym.model.declaration.tables import Constant, Table, tabulated
from multibody_sym.model.mechanism.mass import GROUND
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import Node, as_node, symbol
from multibody_sym.scalars.traversal import leaves


def driving_inputs(system: System) -> tuple[str, ...]:
    """Return the inputs that motions of joints and ground, and constraints, name."""
    nodes = [written.node for part in _driven(system).values() for written in expressions(part)]
    found = {leaf.data for leaf in leaves(nodes, "symbol")}
    return tuple(name for name in system.inputs if name in found)


def with_driving_inputs(system: System) -> System:
    """Return the system with the expressions of inputs in their place where they drive motions and constraints."""
    meant = {symbol(name): expression_of(name, system.inputs[name]) for name in driving_inputs(system)}
    if not meant:
        return system
    changed: dict[str, Any] = {}
    for section, part in _driven(system).items():
        new = {name: with_expressions(element, _put_in(meant)) for name, element in part.items()}
        changed[section] = Names({**getattr(system, section), **new})
    return replace(system, **changed)


def with_named_outputs(system: System, taken: Collection[str]) -> System:
    """Return the system with the expressions of outputs in the place of their names in outputs, stop and ask.

    What is `taken` as a name is none of an output there, nor is in a question the name of an answer to another one.
    Raises ModelError where outputs name each other in a circle.
    """
    known = {symbol(name): node for name, node in system.outputs.items() if name not in taken}
    if not known:
        return system
    meant = _without_names(known)
    answers = {symbol(name) for name in system.ask}

    def own(name: str) -> Callable[[Node], Node]:
        return _put_in({x: node for x, node in meant.items() if x not in answers - {symbol(name)}})

    changed: dict[str, Any] = {
        "outputs": with_expressions(system.outputs, _put_in(meant)),
        "stop": with_expressions(system.stop, _put_in(meant)),
        "ask": Names({name: with_expressions(x, own(name)) for name, x in system.ask.items()}),
    }
    return replace(system, **{key: new for key, new in changed.items() if new != getattr(system, key)})


def _without_names(known: Mapping[Node, Node]) -> dict[Node, Node]:
    """Return expressions of outputs in which no other output is named."""
    found: dict[Node, Node] = {}
    waiting = dict(known)
    while waiting:
        ready = {x: node for x, node in waiting.items() if not waiting.keys() & set(leaves([node], "symbol"))}
        if not ready:
            first = next(iter(waiting))
            with at("outputs", str(first.data)):
                names = ", ".join(str(x.data) for x in waiting)
                raise ModelError(f"outputs name each other, or themselves: {names}; none comes first", number="M110")
        for x, node in ready.items():
            found[x] = _put_in(found)(node)
            del waiting[x]
    return found


def _put_in(meant: Mapping[Node, Node]) -> Callable[[Node], Node]:
    """Return the function that puts expressions in the place of names."""
    return lambda node: as_node(evaluate([node], lambda leaf: meant.get(leaf, leaf))[0])


def expression_of(name: str, given: Node | Table | Constant) -> Node:
    """Return the expression that the input `name` stands for."""
    if isinstance(given, Constant):
        return given.value
    return tabulated(name, given) if isinstance(given, Table) else given


def _is_driven(joint: Joint) -> bool:
    """Return whether time may move a joint: a motion that is prescribed, or a curve."""
    return getattr(joint, "motion", None) is not None or any(isinstance(step, Follow) for step in joint.steps)


def _driven(system: System) -> dict[str, Mapping[str, Any]]:
    """Return what moves as prescribed, by its section of the system: nothing where there are no inputs to drive it."""
    if not system.inputs:
        return {}
    joints = {name: joint for name, joint in system.joints.items() if _is_driven(joint)}
    ground = {name: body for name, body in system.bodies.items() if name == GROUND}
    return {"joints": joints, "bodies": ground, "constraints": system.constraints}
