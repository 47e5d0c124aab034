"""The names of their own in laws of pulls and potentials: `distance`, `distance_rate`; x, y, z of a place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from multibody_sym.errors import ModelError, at
from multibody_sym.model.declaration.fields import Element
from multibody_sym.model.declaration.forces import Potential, Pull
from multibody_sym.model.declaration.system import System
from multibody_sym.model.declaration.values import AXES
from multibody_sym.model.mechanism.loads import place_leaves, span_leaves
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.scalars.traversal import leaves

_DISTANCE = (symbol("distance"), symbol("distance_rate"))
_AND_NOT_JOINTS = "; rename the latter"
_OR_IN_JOINT = "; rename the latter, or give the potential in the joint (joint: ..) where its coordinates are meant"


def with_own_names(system: System, names: Mapping[str, str]) -> System:
    """Return the system with the own names in laws of pulls and potentials replaced by the leaves that stand for them.

    Raises ModelError where the model calls something else so too.
    """
    changed = {
        name: _replaced(name, element, _own_leaves(name, element), names)
        for name, element in system.forces.items()
        if isinstance(element, (Pull, Potential))
    }
    return replace(system, forces={**system.forces, **changed}) if changed else system


def _own_leaves(name: str, element: Pull | Potential) -> dict[Node, Node]:
    """Return the leaf of each name that an element's law has for itself."""
    if isinstance(element, Pull):
        return dict(zip(_DISTANCE, span_leaves(name), strict=True))
    if element.between is not None:
        return {_DISTANCE[0]: span_leaves(name)[0]}
    if element.on is not None:
        return dict(zip(map(symbol, AXES), place_leaves(name), strict=True))
    return {}


def _replaced(name: str, element: Pull | Potential, own: Mapping[Node, Node], names: Mapping[str, str]) -> Element:
    placed = isinstance(element, Potential) and element.on is not None
    for leaf in leaves([element.value], "symbol"):
        if leaf in own and leaf.data in names:
            with at("forces", name, "value"):
                also, advice = names[leaf.data], _OR_IN_JOINT if placed else _AND_NOT_JOINTS
                what = "of the point" if placed else "of the points"
                raise ModelError(f"{leaf.data!r} is that {what} here and {also} too{advice}", number="M113")
    return element.with_fields({"value": evaluate([element.value], lambda leaf: own.get(leaf, leaf))[0]})
