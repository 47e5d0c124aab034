"""The one-way elements of a system, in the order in which all that follows tells them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from multibody_sym.errors import ModelError, at
from multibody_sym.model.declaration.constraints import Rope, Roughness
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay
from multibody_sym.model.mechanism.rope_rows import MeanTensionRow, RopeSlipRow
from multibody_sym.model.mechanism.rows import RopeRow, Row
from multibody_sym.model.resolution.contacts.elements import contacts
from multibody_sym.model.resolution.one_way.joint_friction import joint_frictions
from multibody_sym.model.resolution.one_way.stops import stops
from multibody_sym.model.resolution.references import References
from multibody_sym.model.resolution.ropes.runs import rope_slips
from multibody_sym.scalars.functions import exp
from multibody_sym.scalars.limits import gripping
from multibody_sym.scalars.node import ZERO, Node, as_node

ROPE_WORDS = ("taut", "slack")


def slackening(references: References) -> frozenset[str]:
    """Return the constraints that hold one way only: ropes that may slacken, as those may that rub on wheels.

    Raises ModelError for a rope that is always taut and is to rebound.
    """
    ropes = {name: x for name, x in references.system.constraints.items() if isinstance(x, Rope)}
    rough = {name for name, pulley in references.system.pulleys.items() if pulley.rough is not None}
    found = frozenset(name for name, rope in ropes.items() if rope.slack or rough.intersection(rope.route[1:-1]))
    for name, rope in ropes.items():
        if name not in found and rope.restitution not in (None, ZERO):
            with at("constraints", name, "restitution"):
                raise ModelError(
                    "a rope that is always taut never goes taut, so it does not rebound; add slack: true", number="M114"
                )
    return found


def one_way_elements(references: References, slack: Sequence[Row]) -> tuple[OneWay, ...]:
    """Return all one-way elements; `slack` are the rows of the ropes that may slacken."""
    found = (*contacts(references), *_ropes(references, slack), *stops(references), *joint_frictions(references))
    smooth = references.system.simulation.friction
    return found if smooth is None else tuple(_smoothed(element, smooth.regularised) for element in found)


def _smoothed(element: OneWay, speed: Node) -> OneWay:
    """Return an element whose friction is smooth below a speed, if it has none of its own and may slip at all."""
    exact = (x.enough or x.regularised is not None for x in element.frictions)
    parts = zip(element.frictions, exact, strict=True)
    smooth = (x if keeps else replace(x, regularised=speed / x.arm) for x, keeps in parts)
    return replace(element, frictions=tuple(smooth))


def _ropes(references: References, rows: Sequence[Row]) -> Iterator[OneWay]:
    for row in rows:
        name = row.name.partition(".")[0]
        with at("constraints", name):
            slips = list(rope_slips(references, row)) if isinstance(row, RopeRow) else []
        means = _means(row, [slip.name for _, slip, _ in slips])
        parts = tuple(
            FrictionPart(part, (slip,), *_limits(rough, slip), normals=(k if means else 0,), wrap=0)
            for k, (part, slip, rough) in enumerate(slips, 1)
        )
        path, rope = ("constraints", name), references.system.constraints[name]
        given = rope.restitution if isinstance(rope, Rope) else None
        yield OneWay(
            row.name,
            "rope",
            path,
            (row, *means),
            frictions=parts,
            restitution=given or ZERO,
            collides=given is not None,
            words=ROPE_WORDS,
            group=name,
        )


def _means(row: Row, slips: Sequence[str]) -> list[Row]:
    """Return rows of what presses on each of several rough wheels; on a single one it is the rope's own multiplier."""
    if len(slips) < 2:
        return []
    parts = [(tuple(slips[:k]), tuple(slips[k + 1 :])) for k in range(len(slips))]
    return [
        MeanTensionRow(f"{slip}.mean", row.name, passed, ahead)
        for slip, (passed, ahead) in zip(slips, parts, strict=True)
    ]


def _limits(rough: Roughness, slip: RopeSlipRow) -> tuple[Node, Node]:
    return _capstan(rough.sticking, slip.wrap), _capstan(rough.sliding, slip.wrap)


def _capstan(coefficient: Node, wrap: Node) -> Node:
    """Return the friction on a wheel over the mean of both tensions: 2 tanh(mu wrap / 2), as T1 = T2 exp(mu wrap)."""
    if coefficient is ZERO:
        return ZERO
    return as_node(gripping(exp(coefficient * wrap)))
