"""Stages as they are declared: what a motion goes on with after a time, at a place or at an event."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from multibody_sym.errors import ModelError
from multibody_sym.model.contacts_and_impacts import Impacts, ImpactsField
from multibody_sym.model.fields import Element, ListOf, MapOf, Scalar, Text, holds
from multibody_sym.model.state_words import Moment, StateCondition, StopCondition, moment_text
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node
from multibody_sym.text.printer import text

MOMENTS: Final = ("after", "at", "when")
"""The keys that say when a stage begins, of which each has one."""


@dataclass(frozen=True, kw_only=True)
class Stage(Element):
    """A stage of a motion, which begins `after` a time, `at` a place or `when` something happens.

    It goes on from the coordinates and speeds of the stage before. Elements under `release` act no more, contacts and
    forces under `begins` act from here on. `initial` replaces coordinates and speeds, by expressions of those before.
    Then an `impact` changes speeds; constraints and cut joints that begin with it did not hold before. A stage without
    any of these begins a new motion of the same system, such as the way back. Times count from t = 0.
    """

    after: Node | None = holds(Scalar("s"), None, says="the time at which the stage begins", such="2 s")
    at: Mapping[str, Node] | None = holds(
        MapOf(Scalar()), None, says="the place at which it begins: a coordinate and its value", such="{phi: 0}"
    )
    when: Node | StateCondition | None = holds(
        StopCondition(), None, such="u_s < 0",
        says="the event with which it begins: a condition comes true, or a state begins",
    )
    impact: Impacts | None = holds(
        ImpactsField(), None, says="the impact at its start, as under impact", such="{begins: stuck}"
    )
    release: tuple[str, ...] | None = holds(
        ListOf(Text(), 1), None, such="[string]",
        says="constraints, cut joints, contacts and forces that act no more",
    )
    begins: tuple[str, ...] | None = holds(
        ListOf(Text(), 1), None, such="[brake]",
        says="contacts and forces that act from here on, and not before",
    )
    initial: Mapping[str, Node] | None = holds(
        MapOf(Scalar()), None, such="{u_y: 0}",
        says="new coordinates and speeds, by expressions of those with which the stage before ends",
    )

    def verify(self) -> None:
        given = [name for name in MOMENTS if getattr(self, name) is not None]
        if len(given) != 1:
            got = f"not of {' and '.join(given)}" if given else "and none is given"
            raise ModelError(f"a stage begins at one of {', '.join(MOMENTS)}, {got}", number="M110")
        if self.at is not None and len(self.at) != 1:
            raise ModelError("name one coordinate and its value, such as {x: 2 m}", number="M103").under("at")

    @property
    def moment(self) -> Moment | None:
        """The place or event at which it begins; None where it begins after a time."""
        return self.at if self.at is not None else self.when

    def words(self) -> str:
        """Return when it begins, and with what, for people."""
        moment = self.moment
        begin = "" if moment is None else f"when {moment_text(moment)}"
        if self.after is not None:
            begin = f"after {text(self.after)}" + (" s" if self.after.shadow is not None else "")
        parts = [f"{name} {', '.join(names)}" for name in ("release", "begins") if (names := getattr(self, name))]
        parts += [f"{name} = {text(value)}" for name, value in (self.initial or {}).items()]
        if self.impact is not None:
            begun = [name for path, name in self.beginning() if path[0] == "impact"]
            parts.append(f"impact with {', '.join(begun)}" if begun else "impact")
        return "; ".join((begin, *parts))

    def beginning(self) -> Iterator[tuple[tuple[str, ...], str]]:
        """Yield what acts from here on and not before: paths in the stage, and names."""
        for k, name in enumerate(self.begins or ()):
            yield ("begins", str(k)), name
        if self.impact is not None:
            for own, impact in self.impact.strikes.items():
                yield from (((*self.impact.path(own), "begins", str(k)), x) for k, x in enumerate(impact.begins or ()))
