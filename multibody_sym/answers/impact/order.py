"""Under which conditions contacts strike in the order in which they do, and none strikes or closes besides."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

from multibody_sym.algebra.conditions import Condition, within
from multibody_sym.answers.closed_form import ClosedForms
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO, Node


@dataclass(frozen=True)
class Needed:
    """That a term is positive (`strict`) or not negative, or with a `limit` not larger than that; else `broken`."""

    term: Node
    broken: str
    strict: bool = False
    limit: Node | None = None

    def over(self, forms: ClosedForms) -> list[Condition]:
        """Return it as conditions over quotients; raises NoClosedFormError."""
        if self.limit is not None:
            term, limit = forms.of([self.term, self.limit])
            return within(term, limit, self.broken)
        return [Condition(forms.of([self.term])[0], self.strict, self.broken)]


@dataclass(frozen=True)
class Blows:
    """One of several impacts: the elements that are `struck`, by name their `impulses`, and all speeds of opening."""

    struck: tuple[str, ...]
    impulses: Mapping[str, Node]
    before: Mapping[str, Node]
    after: Mapping[str, Node]


@dataclass(frozen=True)
class Order:
    """The elements that touch, by name their restitution and the number of their cluster, and whose turn it is.

    `sample` gives the value of a speed at the start.
    """

    elements: Sequence[OneWay]
    restitution: Mapping[str, Node]
    cluster: Mapping[str, int]
    one_by_one: bool
    sample: Callable[[Node], float]

    def needed(self, blows: Blows) -> Iterator[Needed]:
        """Yield under which conditions these are struck, and so, and no others."""
        if not blows.struck:
            return
        if len(blows.struck) > 1:
            yield from (Needed(blows.impulses[name], f"{name} is not struck") for name in blows.struck)
        lead = min(blows.struck, key=lambda name: self.sample(blows.before[name]))
        if len(blows.struck) == 1 or self.one_by_one:
            yield Needed(-blows.before[lead], f"{lead} separates and nothing strikes", strict=True)
        near = [x.name for x in self.elements if self.cluster[x.name] == self.cluster[lead]]
        for name in near:
            if name not in blows.struck:
                yield from self._beside(blows, name, lead)
            elif name != lead and self.one_by_one:
                yield from self._together(blows, name, lead)
            elif len(blows.struck) > 1 and self.restitution[name] is not ZERO:
                yield Needed(-blows.before[name], f"{name} separates before")

    def finally_open(self, after: Mapping[str, Node], struck: Sequence[str]) -> Iterator[Needed]:
        """Yield that nothing closes in the end."""
        for name, speed in after.items():
            yield Needed(speed, f"{name} closes again" if name in struck else f"{name} is struck too")

    def _together(self, blows: Blows, name: str, lead: str) -> Iterator[Needed]:
        """Yield that what is struck with the fastest closes as fast, or is held as it does not bounce."""
        held = self.restitution[name] is ZERO and self.sample(blows.before[name]) == 0.0
        apart = blows.before[name] if held else blows.before[name] - blows.before[lead]
        for each in (apart, -apart):
            yield Needed(each, f"{name} and {lead} do not strike at once")

    def _beside(self, blows: Blows, name: str, lead: str) -> Iterator[Needed]:
        """Yield that an element is not struck."""
        before, after, e = blows.before[name], blows.after[name], self.restitution[name]
        if self.one_by_one:
            yield Needed(before - blows.before[lead], f"{name} strikes before {lead}", strict=True)
            if e is ZERO and not self.sample(before):
                yield Needed(after, f"{name} is struck too")
        elif self.sample(before) > 0.0:
            yield Needed(before, f"{name} does not separate before", strict=True)
        else:
            yield Needed(after + e * before, f"{name} is struck too")
            yield Needed(-before, f"{name} separates before")
