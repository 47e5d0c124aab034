"""The parameter vector by name: what the model declares, the start measures, a run chooses; numbers of many bodies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from functools import cached_property
from typing import Final

from multibody_sym.expressions.units import Dimension
from multibody_sym.model.mechanism.start_constants import Measure, RopeLength, RopeSide, TangentAngle
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node, as_node, slot

ARRAY: Final = "parameters"
INDEPENDENT: Final = "most independent rows"
"""How many rows are independent anywhere: all of them, unless the start finds fewer."""
ALPHA, BETA = "Baumgarte alpha", "Baumgarte beta"


class Source(Enum):
    """Who gives a parameter its value."""

    DECLARED = "the model"
    MEASURED = "the start"
    CHOSEN = "the run"
    LITERAL = "a number in the model"


@dataclass(frozen=True)
class ParameterEntry:
    """An entry of the parameter vector; `value` is an expression of entries before it, None if there is no default.

    `measure` is what the start measures; `dimension` is None where no unit was given.
    """

    name: str
    value: Node | None
    positive: bool = False
    source: Source = Source.DECLARED
    measure: Measure | None = None
    dimension: Dimension | None = None


@dataclass(frozen=True)
class ParameterVector:
    """The entries in their order. Those with a blank in their name are not declared: no model can name them."""

    entries: tuple[ParameterEntry, ...]

    def __iter__(self) -> Iterator[ParameterEntry]:
        return iter(self.entries)

    def __len__(self) -> int:
        return len(self.entries)

    def __getitem__(self, place: int) -> ParameterEntry:
        return self.entries[place]

    @cached_property
    def places(self) -> Mapping[str, int]:
        """The place of each entry by its name."""
        return {entry.name: place for place, entry in enumerate(self.entries)}

    def places_from(self, *sources: Source) -> list[int]:
        """Return the places of the entries whose values come from some of the sources."""
        return [place for place, entry in enumerate(self.entries) if entry.source in sources]

    def slot(self, name: str) -> Node:
        """Return the leaf that stands for an entry in expressions."""
        return slot(ARRAY, self.places[name])

    def value(self, values: Sequence[float], name: str) -> float:
        """Return an entry of the vector `values` (np)."""
        return float(values[self.places[name]])

    def with_measured(self, measures: Mapping[str, Measure]) -> ParameterVector:
        """Return the vector with what the start measures of the constraints of these names."""
        added = (
            ParameterEntry(measured_name(name, what), None, _is_positive(what), Source.MEASURED, what)
            for name, what in measures.items()
        )
        return ParameterVector((*self.entries, *added))

    @property
    def constants(self) -> list[Node]:
        """The values of the constant part, which is the last of the vector."""
        return [entry.value for entry in self.entries if entry.source is Source.LITERAL and entry.value is not None]

    def with_constants(self, values: Mapping[str, Node]) -> ParameterVector:
        """Return the vector with a constant part: numbers that the model writes and never names, last of all."""
        added = (ParameterEntry(name, value, source=Source.LITERAL) for name, value in values.items())
        return ParameterVector((*self.entries, *added))

    def with_rows(self, count: int) -> ParameterVector:
        """Return the vector with what a run chooses for rows, if there are any."""
        if not count:
            return self
        independent = ParameterEntry(INDEPENDENT, as_node(count), source=Source.CHOSEN)
        if INDEPENDENT in self.places:
            return ParameterVector(tuple(independent if e.name == INDEPENDENT else e for e in self.entries))
        coefficients = (ParameterEntry(name, None, source=Source.CHOSEN) for name in (ALPHA, BETA))
        return ParameterVector((*self.entries, independent, *coefficients))

    def independent_rows(self, values: Sequence[float]) -> int:
        """Return how many rows are independent anywhere, by the vector `values` (np); 0 where there are no rows."""
        return int(self.value(values, INDEPENDENT)) if INDEPENDENT in self.places else 0

    def changed(self, values: Sequence[float], new: Mapping[str, float]) -> list[float]:
        """Return the vector `values` (np) with `new` values of some entries."""
        found = list(values)
        for name, value in new.items():
            found[self.places[name]] = value
        return found


def measured_name(name: str, measure: Measure) -> str:
    """Return what the entry is called that holds what the start measures of a constraint, or of a part of one."""
    if isinstance(measure, RopeLength):
        return f"length of {name}"
    if isinstance(measure, RopeSide):
        return f"side of {name}"
    return f"angle of {name}.t1" if isinstance(measure, TangentAngle) else f"angle of {name}"


def _is_positive(measure: Measure) -> bool:
    return isinstance(measure, RopeLength) and not measure.winds
