"""The one-way elements of a system, in the order in which all that follows tells them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from multibody_sym.model.declaration.constraints import Rope
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.model.resolution.contacts.elements import contacts
from multibody_sym.model.resolution.one_way.joint_friction import joint_frictions
from multibody_sym.model.resolution.one_way.stops import stops
from multibody_sym.model.resolution.references import References

ROPE_WORDS = ("taut", "slack")


def slackening(references: References) -> frozenset[str]:
    """Return the constraints that hold one way only: ropes that may slacken."""
    constraints = references.system.constraints.items()
    return frozenset(name for name, element in constraints if isinstance(element, Rope) and element.slack)


def one_way_elements(references: References, slack: Sequence[Row]) -> tuple[OneWay, ...]:
    """Return all one-way elements; `slack` are the rows of the ropes that may slacken."""
    return (*contacts(references), *_ropes(slack), *stops(references), *joint_frictions(references))


def _ropes(rows: Sequence[Row]) -> Iterator[OneWay]:
    for row in rows:
        name = row.name.partition(".")[0]
        yield OneWay(row.name, "rope", ("constraints", name), (row,), words=ROPE_WORDS, group=name)
