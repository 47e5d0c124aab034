"""The ends of planes, which lie on them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from multibody_sym.dynamics.start.undefined import value_or_none
from multibody_sym.errors import ModelError, at, gathered
from multibody_sym.model.declaration.bodies import Body
from multibody_sym.model.declaration.system import System
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scalars.node import Node

_OFF: Final = 1e-9
"""The part of the length of a plane up to which an end lies on it."""

Values = Mapping[Node, float]


def verify_ends(system: System, known: Values) -> None:
    """Raise ModelError at the ends of planes that do not lie on them, by values of the parameters."""
    wrong = gathered()
    for name, body in system.bodies.items():
        for path, told in _off(body, known):
            with wrong, at("bodies", name, "surfaces", *path):
                raise ModelError(told, number="M114")
    wrong.told()


def _off(body: Body, known: Values) -> Iterator[tuple[tuple[object, ...], str]]:
    """Yield the ends that do not lie on their planes, by their paths, and how far off."""
    for name, surface in body.surfaces.items():
        if surface.between is None or surface.plane is None:
            continue
        found = [_numbers(x, known) for x in (surface.plane, surface.normal, *body.ends(surface.between))]
        given = [x for x in found if x is not None]
        if len(given) < len(found) or not given[1].any():
            continue
        through, normal, *ends = given
        upward, length = normal / np.linalg.norm(normal), float(np.linalg.norm(ends[1] - ends[0]))
        for k, end in enumerate(ends):
            off = float(upward @ (end - through))
            if abs(off) > _OFF * length:
                place = ", ".join(f"{x + 0.0:.6g}" for x in end - off * upward)
                side = "above" if off > 0.0 else "below"
                told = (
                    f"this end lies {abs(off):.3g} m {side} the plane: move it along the normal, to [{place}], or "
                    "correct plane or normal"
                )
                yield (name, "between", k), told


def _numbers(place: Sequence[Node], known: Values) -> Floats | None:
    values = [value_or_none(x, known) for x in place]
    return None if None in values else np.array(values, dtype=float)
