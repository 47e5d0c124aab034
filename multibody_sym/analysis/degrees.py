"""Degrees of expressions that are seen from how they are written: no values are tried, so that what holds is proved."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from multibody_sym.scalars.node import Node
from multibody_sym.scalars.traversal import postorder

Degree = int | None
"""None: no polynomial, or none that is seen."""


def polynomial_degree(nodes: Sequence[Node], variables: Sequence[Node]) -> Degree:
    """Return the largest degree that expressions can have as polynomials of variables; other leaves are constants."""
    return _largest(_degrees(nodes, dict.fromkeys(variables, 1), lambda node: None), nodes)


def wave_degree(nodes: Sequence[Node], angle: Node) -> Degree:
    """Return the largest degree that expressions can have as polynomials of sin and cos of one angle."""

    def of_wave(node: Node) -> Degree:
        return _whole_slope(node.args[0], angle) if node.op in ("sin", "cos") else None

    return _largest(_degrees(nodes, {angle: None}, of_wave), nodes)


def _largest(degrees: Mapping[Node, Degree], nodes: Sequence[Node]) -> Degree:
    found = [degrees[node] for node in nodes]
    return None if None in found else max((x for x in found if x is not None), default=0)


def _degrees(
    nodes: Sequence[Node], known: Mapping[Node, Degree], of_other: Callable[[Node], Degree]
) -> dict[Node, Degree]:
    """Return the degree of each part of expressions; `of_other` tells that of functions whose arguments vary."""
    found: dict[Node, Degree] = {}
    for n in postorder(nodes):
        parts = [found[a] for a in n.args]
        if n in known:
            found[n] = known[n]
        elif not n.args or all(part == 0 for part in parts):
            found[n] = 0
        else:
            polynomial = None if None in parts else _of_operation(n, parts)
            found[n] = of_other(n) if polynomial is None else polynomial
    return found


def _of_operation(n: Node, parts: Sequence[Degree]) -> Degree:
    """Return the degree of a sum, product, quotient by a constant or whole power of polynomials."""
    degrees = [part or 0 for part in parts]
    if n.op in ("add", "neg"):
        return max(degrees)
    if n.op == "mul":
        return sum(degrees)
    if n.op == "div" and degrees[1] == 0:
        return degrees[0]
    exponent = n.args[1].data if n.op == "pow" and n.args[1].op == "number" else None
    return degrees[0] * exponent if isinstance(exponent, int) and exponent > 0 else None


def _whole_slope(argument: Node, angle: Node) -> Degree:
    """Return |k| of k angle + constant with a whole number k, None where the argument is seen to be no such."""
    slopes: dict[Node, float | None] = {}
    for n in postorder([argument]):
        parts = [slopes[a] for a in n.args]
        if n is angle:
            slopes[n] = 1
        elif all(part == 0 for part in parts):
            slopes[n] = 0
        elif None in parts:
            slopes[n] = None
        else:
            slopes[n] = _slope(n, [x or 0 for x in parts])
    slope = slopes[argument]
    return abs(int(slope)) if slope is not None and slope == int(slope) else None


def _slope(n: Node, slopes: Sequence[float]) -> float | None:
    if n.op == "add":
        return sum(slopes)
    if n.op == "neg":
        return -slopes[0]
    constants = [a.shadow for a in n.args]
    if n.op == "mul" and slopes[0] == 0 and constants[0] is not None:
        return slopes[1] * constants[0]
    if n.op == "mul" and slopes[1] == 0 and constants[1] is not None:
        return slopes[0] * constants[1]
    if n.op == "div" and constants[1]:
        return slopes[0] / constants[1]
    return None
