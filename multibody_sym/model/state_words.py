"""Moments: states of unilateral elements that begin (`c sticks`), conditions, values that coordinates reach; stages."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, ClassVar, Final

from multibody_sym.errors import ModelError
from multibody_sym.model.contacts_and_impacts import Impacts, ImpactsField
from multibody_sym.model.fields import Condition, Element, ListOf, MapOf, Scalar, Text, describe, holds
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.sign_changes import is_condition
from multibody_sym.text.printer import text

STRIKES: Final = "strikes"
"""The verb of an element that takes an impulse, whether it bounces or stays: a moment, but no state."""
VERBS: Final[Mapping[str, tuple[str, ...]]] = {
    "sticks": ("stick",),
    "slides": ("slide", "slide+", "slide-"),
    "opens": ("open", "slack", "free"),
    "closes": ("closed", "stick", "slide", "slide+", "slide-", "taut", "lower", "upper"),
    "tautens": ("taut",),
    "slackens": ("slack",),
    "grips": ("grip",),
    "rolls": ("roll",),
    "slips": ("slip", "slip+", "slip-", "slide", "slide+", "slide-"),
    "stops": ("lower", "upper"),
    "frees": ("free",),
    STRIKES: ("impact",),
}
"""The verbs of elements, and the words of the states that each begins.

A rope closes as it becomes taut, a stop as it holds.
"""
_EITHER_WAY: Final[Mapping[str, tuple[str, ...]]] = {"slide": VERBS["slides"], "slip": ("slip", "slip+", "slip-")}
"""Words of states without a direction, and those of runs, which have one."""
WAYS: Final[Mapping[str, str]] = {"+": "forward", "-": "backward"}
"""The signs that end words of states, and their words in sentences: along an axis or tangent, or against it."""
_JOINED: Final = re.compile(r"\s(and|or)\s")
_WORDS: Final = tuple(dict.fromkeys(word for words in VERBS.values() for word in words))
"""The words of states as runs print them, which serve as verbs too."""
_SAID: Final = "|".join(map(re.escape, sorted((*VERBS, *_WORDS), key=len, reverse=True)))
_STATED: Final = re.compile(rf"\s*(\S.*?)\s+({_SAID})\s*")
_STATED_WITHIN: Final = re.compile(rf"(?<![\w.])(?!(?:and|or)\s)([A-Za-z][\w.]*)\s+({_SAID})(?![\w+-])")
"""A state in an expression, where names never stand side by side."""
_TWO_WORDS: Final = re.compile(r"\s*([A-Za-z][\w.]*)\s+(?!and\b|or\b)([A-Za-z]+)\s*")
"""The form of a state, with any second word."""


_WITHOUT_FRICTION: Final = " without friction (static, kinetic)"


@dataclass(frozen=True)
class StateCondition:
    """That an element, or a part of it that rubs, begins to be in a state: `c sticks`, or its word, `c slide+`."""

    element: str
    verb: str

    @property
    def words(self) -> tuple[str, ...]:
        """The words of the states that the verb begins."""
        return VERBS.get(self.verb) or _EITHER_WAY.get(self.verb, (self.verb,))

    def __str__(self) -> str:
        return f"{self.element} {self.verb}"

    def holds(self, words: Mapping[str, str]) -> bool:
        """Return whether it holds where `words` are the states of elements."""
        return words.get(self.element) in self.words

    @property
    def closes(self) -> bool:
        """Whether it is a state in which an element is closed that may be open."""
        return bool({*self.words} & {*VERBS["closes"]})

    @property
    def strikes(self) -> bool:
        """Whether it is an impact, which is no state."""
        return self.words == VERBS[STRIKES]

    def verify(self, known: Mapping[str, Iterable[str]]) -> None:
        """Raise ModelError where no unilateral element has that name, or it is never in such a state.

        `known` are the words of the states in which such elements may be, by their names.
        """
        if self.element not in known and _JOINED.search(self.element):
            raise _joined_error(str(self), f"{self.element.split()[-1]} {self.verb}")
        names = [self.element] if self.element in known else [x for x in known if x.startswith(f"{self.element}.")]
        if not names:
            raise ModelError(
                f"{self.element!r} is no contact, rope that may slacken, stop or friction, which alone have states",
                number="M106",
                word=self.element,
                known=known,
            )
        able = [name for name in names if set(known[name]).intersection(self.words)]
        if not able:
            reason = ""
            if {*self.words} <= {*VERBS["sticks"], *VERBS["slides"]}:
                rolls = any({*VERBS["rolls"]} & {*known[name]} for name in names)
                reason = ": a wheel that rolls has the words rolls, slips" if rolls else _WITHOUT_FRICTION
            fitting = " or ".join(
                f"{name} {verb}"
                for name in names
                for verb, its in VERBS.items()
                if set(known[name]).intersection(its) and not (verb == "slips" and {*VERBS["slides"]} & {*known[name]})
            )
            raise ModelError(f"{str(self)!r}: it has no such state{reason}; say {fitting}", number="M106")
        if names != [self.element]:
            raise ModelError(
                f"{self.element!r} has no state of its own, its parts have; say {able[0]} {self.verb}"
                + (f", or another of {', '.join(able)}" if len(able) > 1 else ""),
                number="M106",
            )


def state_condition(value: Any) -> StateCondition | None:
    """Return the condition of a text of an element and a verb; None for all else."""
    if isinstance(value, StateCondition) or not isinstance(value, str):
        return value if isinstance(value, StateCondition) else None
    if (state := _STATED.fullmatch(value)) is not None:
        return StateCondition(*state.groups())
    if (other := _TWO_WORDS.fullmatch(value)) is not None:
        raise ModelError(
            f"{other[2]!r} is no word for a state of {other[1]}; the words are {', '.join(VERBS)}", number="M106"
        )
    if (state := _STATED_WITHIN.search(value)) is not None:
        raise _joined_error(value, " ".join(state.groups()))
    return None


def state_conditions(stops: Mapping[str, Any]) -> dict[str, StateCondition]:
    """Return the conditions that are states, by name."""
    return {name: x for name, x in stops.items() if isinstance(x, StateCondition)}


def _joined_error(written: str, state: str) -> ModelError:
    return ModelError(
        f"{written!r}: states are not joined with conditions by 'and' and 'or'; name the state alone, such as {state}",
        number="M106",
    )


@dataclass(frozen=True)
class StateField:
    """A state that begins, such as `c sticks`."""

    def accept(self, value: Any) -> StateCondition:
        condition = state_condition(value)
        if condition is None:
            raise ModelError(
                f"expected a state such as c sticks ({', '.join(VERBS)}), got {describe(value)}", number="M103"
            )
        return condition

    def tree(self, value: StateCondition) -> str:
        return str(value)


@dataclass(frozen=True)
class StopCondition(Condition):
    """A comparison, or a state that begins."""

    def accept(self, value: Any) -> Any:
        return state_condition(value) or super().accept(value)

    def tree(self, value: Node | StateCondition) -> str:
        return str(value) if isinstance(value, StateCondition) else super().tree(value)


Moment = Mapping[str, Node] | Node | StateCondition
"""When: a coordinate reaches a value (`{x: 2 m}`), a condition becomes true (`x > 2`), a state begins (`c sticks`)."""


@dataclass(frozen=True)
class MomentField:
    """A moment: `{x: 2 m}`, a condition such as `x > 2 and u < 0`, or a state such as `c sticks`."""

    of_any_unit: ClassVar[bool] = True

    def accept(self, value: Any) -> Moment:
        if isinstance(value, str) and "==" in value:
            raise ModelError(
                f"{value!r} is an equation: a coordinate that reaches a value is {{phi: 0}}, a time is after: 2 s, and "
                "the start needs no moment",
                number="M103",
            )
        if not isinstance(value, Mapping):
            accepted: Moment = StopCondition().accept(value)
            return accepted
        if len(value) != 1:
            raise ModelError("name one coordinate and its value, such as {x: 2 m}")
        return MapOf(Scalar()).accept(value)

    def tree(self, value: Moment) -> Any:
        return MapOf(Scalar()).tree(value) if isinstance(value, Mapping) else StopCondition().tree(value)


def time_of(given: Node | Moment | str | None) -> Node | None:
    """Return a time that is given as such; None for a moment, which a run is to find."""
    return given if isinstance(given, Node) and not is_condition(given) else None


def condition_of(given: Node | Moment | None) -> Node | None:
    """Return the comparison that a moment is; None for another one."""
    return given if isinstance(given, Node) and is_condition(given) else None


def moment_text(moment: Moment) -> str:
    """Return a moment for people."""
    if isinstance(moment, Mapping):
        ((coordinate, value),) = moment.items()
        return f"{coordinate} = {text(value)}"
    return text(moment) if isinstance(moment, Node) else str(moment)


@dataclass(frozen=True)
class TimeOrMoment:
    """A time, such as `2 s`, or a moment; a place where its `measure` is m; or one of `words`."""

    measure: str = "s"
    words: tuple[str, ...] = ()
    of_any_unit: ClassVar[bool] = True

    def accept(self, value: Any) -> Node | Moment | str:
        if value in self.words:
            return str(value)
        equation = isinstance(value, str) and "==" in value
        if equation or isinstance(value, Mapping) or state_condition(value) is not None:
            return MomentField().accept(value)
        node = Scalar().accept(value)
        return MomentField().accept(value) if is_condition(node) else Scalar(self.measure).accept(value)

    def tree(self, value: Node | Moment | str) -> Any:
        if isinstance(value, str):
            return value
        return text(value) if isinstance(value, Node) else MomentField().tree(value)


# ----------------------------------------------------------------------------------------------------------------------
# Stages as they are declared: what a motion goes on with after a time, at a place or at an event.

MOMENTS: Final = ("after", "at", "when")
"""The keys that say when a stage begins, of which each has one."""


@dataclass(frozen=True, kw_only=True)
class Stage(Element):
    """A stage of a motion, which begins `after` a time, `at` a place or `when` something happens.

    It goes on from the coordinates and speeds of the stage before. After its `initial` values an `impact` changes
    speeds; constraints and cut joints that begin with it did not hold before. A stage without any change begins a new
    motion of the same system, such as the way back. Times count from t = 0.
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
