"""What an expression of parameters is worth at their sample values: enough to tell one side from the other."""

from __future__ import annotations

import math
from typing import Final

from multibody_sym.model.mechanism.parameters import ARRAY, ParameterVector
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.traversal import leaves

_DEEPEST: Final = 100
"""How many parameters may follow from one another; a circle of them is told elsewhere."""


def sample_value(node: Node, parameters: ParameterVector, depth: int = 0) -> float:
    """Return the value of an expression of parameters in slots, nan where it has none."""
    if node.shadow is not None:
        return node.shadow
    values = {}
    for leaf in leaves([node], "slot"):
        array, place = leaf.data
        value = parameters[place].value if array == ARRAY else None
        values[leaf] = math.nan if value is None or depth > _DEEPEST else sample_value(value, parameters, depth + 1)
    try:
        return evaluate_float([node], values)[0]
    except UNDEFINED:
        return math.nan
