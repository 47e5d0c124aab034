"""Sines over cosines written as tangents."""

from __future__ import annotations

from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import Node


def with_tangents(powers: list[tuple[Node, int]]) -> list[tuple[Node, int]]:
    """Return the factors with sin a / cos a written as tan a."""
    exponents = dict(powers)
    for node, sine in powers:
        if node.op != "sin":
            continue
        cosine = exponents.get(BUILD["cos"](node.args[0]), 0)
        if sine * cosine < 0:
            shared = min(abs(sine), abs(cosine)) * (1 if sine > 0 else -1)
            exponents[node] = sine - shared
            exponents[BUILD["cos"](node.args[0])] = cosine + shared
            exponents[BUILD["tan"](node.args[0])] = shared
    return list(exponents.items())
