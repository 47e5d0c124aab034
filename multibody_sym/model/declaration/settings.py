"""Questions to `solve`, and how a system is simulated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from multibody_sym.errors import ModelError, at
from multibody_sym.expressions.printer import text
from multibody_sym.model.declaration.fields import Element, MapOf, Record, holds
from multibody_sym.model.declaration.states import State, StateCondition, state_condition
from multibody_sym.model.declaration.values import Choice, Flag, Scalar, Text
from multibody_sym.scalars.node import Node

_FORMS: Final = (
    "an expression, {of: body, after: time}, {coordinate: value} or {of: body, at: {coordinate: value}}; "
    "c sticks (a state) may stand for {coordinate: value}"
)


@dataclass(frozen=True, kw_only=True)
class Ask(Element):
    """A question that `solve` answers.

    `value`: an expression at the given instant; `of` and `after`: the path of a body in a time; `when`: the time at
    which a coordinate reaches a value, or (`begins`) at which a state begins; `of` and `at`, or `begins`: the speed of
    a body when it does.
    """

    value: Node | None = holds(Scalar(), None)
    of: str | None = holds(Text(), None)
    after: Node | None = holds(Scalar("s"), None)
    when: Mapping[str, Node] | None = holds(MapOf(Scalar()), None)
    at: Mapping[str, Node] | None = holds(MapOf(Scalar()), None)
    begins: StateCondition | None = holds(State(), None)

    def verify(self) -> None:
        names = ("value", "of", "after", "when", "at", "begins")
        given = tuple(name for name in names if getattr(self, name) is not None)
        if given not in (("value",), ("of", "after"), ("when",), ("of", "at"), ("begins",), ("of", "begins")):
            raise ModelError(f"ask with {_FORMS}")
        for condition in (self.when, self.at):
            if condition is not None and len(condition) != 1:
                raise ModelError("name one coordinate and its value, such as {x: 2 m}")


@dataclass(frozen=True)
class AskField:
    """A question: an expression, `{of: block, after: 4 s}`, `{x: 2 m}` or `c sticks`, `{of: block, at: {x: 2 m}}`."""

    def accept(self, value: Any) -> Ask:
        if isinstance(value, Ask):
            return value
        begins = state_condition(value)
        if begins is not None:
            return Ask(begins=begins)
        if not isinstance(value, Mapping):
            return Ask(value=value)
        if "of" in value:
            given = _known(value, ("of", "after", "at"))
            begins = state_condition(given.get("at"))
            return Ask(**given) if begins is None else Ask(of=given["of"], begins=begins)
        if any(state_condition(given) is not None for given in value.values()):
            raise ModelError(f"{{{', '.join(map(str, value))}}} is no known question; ask with {_FORMS}")
        return Ask(when=value)

    def tree(self, value: Ask) -> Any:
        if value.value is not None:
            return text(value.value)
        if value.when is not None:
            return MapOf(Scalar()).tree(value.when)
        if value.begins is not None and value.of is None:
            return str(value.begins)
        answer: dict[str, Any] = {"of": value.of}
        if value.begins is not None:
            answer["at"] = str(value.begins)
        if value.after is not None:
            answer["after"] = text(value.after)
        if value.at is not None:
            answer["at"] = MapOf(Scalar()).tree(value.at)
        return answer


def _known(value: Mapping[str, Any], keys: tuple[str, ...]) -> dict[str, Any]:
    for key in value:
        if key not in keys:
            with at(key):
                raise ModelError(f"unknown key {key!r}; known: {', '.join(keys)}")
    return dict(value)


@dataclass(frozen=True)
class Baumgarte(Element):
    """Baumgarte's stabilisation: gamma - 2 alpha phidot - beta^2 phi; without alpha it is chosen from the step."""

    alpha: Node | None = holds(Scalar("1/s"), None)
    beta: Node | None = holds(Scalar("1/s"), None)


@dataclass(frozen=True, kw_only=True)
class Stabilisation(Element):
    """How constraints are kept: `projection` after each step, `baumgarte`, or `index_2`, as part of the equations."""

    baumgarte: Baumgarte | None = holds(Record(Baumgarte), None)
    projection: bool | None = holds(Flag(), None)
    index_2: bool | None = holds(Flag(), None)

    def verify(self) -> None:
        chosen = {"baumgarte": self.baumgarte is not None, "projection": self.projection, "index_2": self.index_2}
        if sum(map(bool, chosen.values())) > 1:
            names = [name for name, asked in chosen.items() if asked]
            raise ModelError(f"choose {' or '.join(names)}, not {'both' if len(names) == 2 else 'all of them'}")


@dataclass(frozen=True, kw_only=True)
class SmoothFriction(Element):
    """Friction made smooth: below the speed `regularised` (m/s, or rad/s where things turn) it fades, and all creeps.

    What would stick moves so fast that friction, mu N v / sqrt(v^2 + e^2), is as large as it takes.
    """

    regularised: Node = holds(Scalar("m/s"))

    def verify(self) -> None:
        if self.regularised.shadow is not None and not self.regularised.shadow > 0.0:
            raise ModelError("it is a speed greater than zero").under("regularised")


MULTIPLIERS: Final = ("basic", "minimum_norm")
"""Those of redundant rows are zero; or those of all rows, times the rows' lengths, have the least norm."""


COORDINATES: Final = ("relative", "absolute")


@dataclass(frozen=True, kw_only=True)
class Settings(Element):
    """How a system is simulated, unless the call says otherwise.

    `coordinates` are those of joints from body to body, or of each body, which every joint restricts.
    `project` lets every start value change, known ones too, as little as constraints need.
    `multipliers` says which are taken where rows are redundant and others serve equally well.
    `friction` makes dry friction smooth, which it is not otherwise.
    """

    t_end: Node = holds(Scalar("s"), 10)
    step: Node | None = holds(Scalar("s"), None)
    rtol: Node | None = holds(Scalar(""), None)
    atol: Node | None = holds(Scalar(""), None)
    method: str = holds(Text(), "dormand_prince")
    samples: Node = holds(Scalar(""), 1001)
    coordinates: str = holds(Choice(COORDINATES), COORDINATES[0])
    constraints: Stabilisation | None = holds(Record(Stabilisation), None)
    project: bool = holds(Flag(), False)
    multipliers: str = holds(Choice(MULTIPLIERS), MULTIPLIERS[0])
    friction: SmoothFriction | None = holds(Record(SmoothFriction), None)
