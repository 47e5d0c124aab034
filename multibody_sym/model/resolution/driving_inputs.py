"""Inputs that drive motions and constraints: there they stand for their expressions, whose rates count as well.

A force follows from the value of an input. What moves as prescribed follows from its first and second derivative too,
which a value does not have.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from multibody_sym.model.declaration.curves.follow import Follow
from multibody_sym.model.declaration.fields import Names
from multibody_sym.model.declaration.joint import Joint
from multibody_sym.model.declaration.system import System, expressions, with_expressions
from multibody_sym.model.declaration.tables import Constant, Table, interpolated
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
    meant = {symbol(name): expression_of(system.inputs[name]) for name in driving_inputs(system)}
    if not meant:
        return system

    def written_out(node: Node) -> Node:
        return as_node(evaluate([node], lambda leaf: meant.get(leaf, leaf))[0])

    changed: dict[str, Any] = {}
    for section, part in _driven(system).items():
        new = {name: with_expressions(element, written_out) for name, element in part.items()}
        changed[section] = Names({**getattr(system, section), **new})
    return replace(system, **changed)


def expression_of(given: Node | Table | Constant) -> Node:
    """Return the expression that an input stands for."""
    if isinstance(given, Constant):
        return given.value
    return interpolated(given) if isinstance(given, Table) else given


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
