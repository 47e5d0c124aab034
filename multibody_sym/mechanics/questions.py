"""Do questions under `ask` name what there is, and in which order are they answered?"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from difflib import get_close_matches
from typing import Final

from multibody_sym.errors import ModelError, at
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.modes import possible_words
from multibody_sym.mechanics.vocabulary import Dimensions
from multibody_sym.model.bodies import OWN_POINTS
from multibody_sym.model.fields import fields_of
from multibody_sym.model.settings import Ask
from multibody_sym.model.states import Moment, StateCondition
from multibody_sym.model.system import System, expressions
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.text.parser import QUANTITIES

_MEANT: Final = {"maximum": "max", "largest": "max", "minimum": "min", "least": "min", "period": "period_of"}
"""Words that are no keys of questions, and the keys that they mean."""
_RATES: Final = ("acceleration", "angular_acceleration", "power")
"""Quantities without a value while speeds jump."""
_TIME: Final = symbol("t")
_VALUE: Final = ("value",)
_MOVING: Final = (_VALUE, ("max",), ("min",), ("when",), ("at",), ("until",))
"""Where the expressions of questions stand that are looked at along the motion."""


def verify_questions(system: System, mechanism: Mechanism) -> None:
    """Raise ModelError, with its path, at the first question that names nothing in a mechanism.

    So for questions that name each other in a circle, and those of an impact that have no answer at its instant.
    """
    dimensions = Dimensions(system)
    for name, question in system.ask.items():
        with at("ask", name):
            for key, known in _names_by_key(system, mechanism, question):
                word = getattr(question, key)
                if word not in known:
                    with at(key):
                        raise ModelError(
                            f"no {_KINDS[key]} is called {word!r}", number="M106", word=word, known=[*known]
                        )
            for key in ("when", "at", "until"):
                moment = getattr(question, key)
                if moment is not None:
                    with at(key):
                        _verify_moment(mechanism, moment)
            if question.so is not None:
                with at("so"):
                    dimensions.verify_sides(question.so)
            timed = question.after is not None and _TIME in leaves([question.after], "symbol")
            if timed and "t" not in named_by(question, system.ask, mechanism.symbols):
                with at("after"):
                    raise ModelError("t is the time, which is 0 at the start; write which: 2 s", number="M112")
            if system.impact is not None:
                _verify_at_impact(question)
    taken = {*mechanism.symbols, *map(symbol, system.outputs)}
    needed: dict[str, set[str]] = {}
    for name in in_order(system.ask, taken):
        named = named_by(system.ask[name], system.ask, taken)
        needed[name] = named.union(*(needed[x] for x in named))
        if system.ask[name].find is not None and any(system.ask[x].find is not None for x in needed[name]):
            with at("ask", name), at("so"):
                raise ModelError("it hangs on what is found itself; find one value after the other", number="M112")


_KINDS: Final = {
    "of": "body",
    "find": "parameter, coordinate or speed",
    "formula": "coordinate or speed",
    "period_of": "coordinate",
}
"""The kinds of names under the keys of questions."""


def _names_by_key(system: System, mechanism: Mechanism, question: Ask) -> Iterator[tuple[str, Collection[str]]]:
    """Yield the keys under which a question names something, and the names that exist."""
    moving = [*(c.name for c in mechanism.coordinates), *(s.name for s in mechanism.speeds)]
    if question.of is not None and question.of not in mechanism.markers:
        own = [f"{body}.{point}" for body in system.bodies for point in OWN_POINTS]
        yield "of", (*mechanism.markers, *(own if question.of in own else ()))
    if question.find is not None:
        yield "find", (*system.parameters, *moving)
    if question.formula is not None:
        yield "formula", moving
    if question.period_of is not None:
        yield "period_of", [mechanism.coordinates[q].name for body in mechanism.bodies for q, _ in body.rate_pairs]


def _verify_moment(mechanism: Mechanism, moment: Moment) -> None:
    if isinstance(moment, StateCondition):
        moment.verify(possible_words(mechanism.one_way))
    elif isinstance(moment, Mapping):
        quaternions = {k for body in mechanism.bodies for places in body.quaternions for k in places}
        names = [c.name for k, c in enumerate(mechanism.coordinates) if k not in quaternions]
        for coordinate in moment:
            if coordinate not in names:
                meant = _MEANT.get(coordinate) or next(iter(get_close_matches(coordinate, fields_of(Ask), n=1)), None)
                hint = f"; of what questions begin with, did you mean {meant}?" if meant else ""
                if coordinate == "t":
                    hint = "; a time stands under after: 2 s, and the start needs no moment"
                message = f"no coordinate is called {coordinate!r}{hint}"
                raise ModelError(message, number="M106", word=coordinate, known=() if hint else names)


def _verify_at_impact(question: Ask) -> None:
    """Raise ModelError where a question of an impact has no answer at its instant."""
    if question.value is None or question.when is not None or question.after is not None:
        raise ModelError(
            "an impact is told at its instant; ask for an expression just after it, or simulate what follows",
            number="M121",
        )
    for leaf in leaves([question.value], "quantity"):
        if QUANTITIES[leaf.data[0]].of_mode:
            raise ModelError(f"{leaf} is one of small oscillations; ask it without `impact`", number="M110")
        if leaf.data[0] in _RATES:
            raise ModelError(f"{leaf.data[0]}(..) has no value in an impact, in which speeds jump", number="M121")


def in_order(questions: Mapping[str, Ask], taken: Collection[Node]) -> list[str]:
    """Return the names of questions so that those come first which others name; `taken` are symbols of the model.

    Raises ModelError where questions name each other in a circle.
    """
    needed = {name: named_by(question, questions, taken) for name, question in questions.items()}
    ordered: list[str] = []
    while len(ordered) < len(questions):
        ready = [name for name in questions if name not in ordered and needed[name].issubset(ordered)]
        if not ready:
            circle = [name for name in questions if name not in ordered]
            with at("ask", circle[0]):
                what = (
                    f"the answers of {', '.join(circle)} name each other" if circle[1:] else "the answer names itself"
                )
                raise ModelError(f"{what}: none of them comes first", number="M110")
        ordered += ready
    return ordered


def named_by(question: Ask, questions: Mapping[str, Ask], taken: Collection[Node]) -> set[str]:
    """Return the names of answers that the expressions of a question name, which are no names of the model.

    The time is 0 at the start: a `t` that is asked only there is the answer of this name, if there is one.
    """
    written = expressions(question)
    at_start = question.when is None and question.after is None
    moving = [x.node for x in written if x.path in _MOVING and not (at_start and x.path == _VALUE)]
    timed = _TIME in leaves(moving, "symbol")
    named = leaves([x.node for x in written], "symbol")
    free = [leaf for leaf in named if leaf not in taken or (leaf == _TIME and not timed)]
    return {str(leaf.data) for leaf in free if leaf.data in questions}
