"""The system of each stage of a motion: which elements act, and what is asked; systems that go on from a later time.

In: a declared system with `then`. Out: one system a stage, which begins at its own t = 0.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Final

from multibody_sym.errors import ModelError, MultibodyError, at
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.model.contacts_and_impacts import Impacts
from multibody_sym.model.fields import Names
from multibody_sym.model.joints import MovingJoint
from multibody_sym.model.settings import Ask
from multibody_sym.model.stages import MOMENTS
from multibody_sym.model.state_words import StateCondition, time_of
from multibody_sym.model.system import System, expressions, t, with_expressions
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO, Node, add, subtract, symbol
from multibody_sym.text.parser import of_run
from multibody_sym.text.printer import text

_KEY: Final = "then"
_END: Final = " at the end of stage "
_ELEMENTS: Final = ("constraints", "contacts", "forces", "joints")
_STARTING: Final = ("contacts", "forces")


def end_questions(
    system: System, number: int, names: Iterable[str] = (), integrals: Iterable[Node] = ()
) -> dict[str, Ask]:
    """Return the questions about the end of a stage by its number: `t`, coordinates and speeds by `names`, `integrals`.

    They are called `at_end(name, number)`. The time after which the next stage begins, or the coordinate with whose
    value it does, needs no question.
    """
    stage = system.then[number - 1]
    values = {**{name: symbol(name) for name in names if name not in (stage.at or {})}, **(stage.initial or {})}
    values.update({text(integral): integral for integral in integrals})
    asked: dict[str, Any] = {"after": stage.after} if stage.after is not None else {"when": stage.moment}
    found = {} if stage.after is not None else {at_end("t", number): Ask(**asked)}
    return {**found, **{at_end(name, number): Ask(value=value, **asked) for name, value in values.items()}}


def integrals_later(system: System, number: int, part: System) -> list[Node]:
    """Return work and impulses of elements that act in a stage, its `part`, which questions of later stages name."""
    last, acting = len(system.then) + 1, {name for key in _ELEMENTS for name in getattr(part, key)}
    later = Names({name: x for name, x in system.ask.items() if (x.stage or last) > number})
    named = leaves([x.node for x in expressions(replace(system, ask=later)) if x.path[0] == "ask"], "quantity")
    return [x for x in named if of_run(x) and x.data[1][0].partition(".")[0] in acting]


def at_end(name: str, number: int) -> str:
    """Return the name of the answer that is a coordinate or speed at the end of a stage."""
    return f"{name}{_END}{number}"


@contextmanager
def in_stage(system: System, number: int) -> Iterator[None]:
    """Give errors about the system of a stage their places in the declared one."""
    try:
        yield
    except MultibodyError as error:
        for each in (error, *error.others):
            each.where = replace(each.where, path=_declared_path(system, number, each.where.path))
        raise


def _declared_path(system: System, number: int, path: tuple[str, ...]) -> tuple[str, ...]:
    section, name, key = (*path[:3], "", "", "")[:3]
    if section == "impact" and number > 1:
        return (_KEY, str(number - 2), *path)
    if section != "ask" or _END not in name:
        return path
    own, follows = name.partition(_END)[0], system.then[number - 1]
    if key == "value":
        return (_KEY, str(number - 1), "initial", own)
    given = next(word for word in MOMENTS if getattr(follows, word) is not None)
    return (_KEY, str(number - 1), given, *path[3:])


def stage_systems(system: System) -> tuple[System, ...]:
    """Return the system of each stage: its elements, impact, outputs and questions; one for a system without stages.

    Raises ModelError for names of no element, for elements that act in no stage, and for absolute coordinates.
    """
    if not system.then:
        return (system,)
    if system.simulation.coordinates == "absolute":
        with at("simulation", "coordinates"):
            raise ModelError("stages begin with coordinates of joints: leave out coordinates: absolute", number="M110")
    with at("ask"):
        _verify_numbers(system)
    absent = [name for stage in system.then for _, name in stage.beginning()]
    found = [_system(system, 1, absent, system.impact)]
    for k, stage in enumerate(system.then):
        with at(_KEY, str(k)):
            for path, name in stage.beginning():
                with at(*path):
                    _verify_begins(system, name, absent, impact=path[0] == "impact")
                absent.remove(name)
            for i, name in enumerate(stage.release or ()):
                with at("release", str(i)):
                    _verify_released(system, name, absent)
                absent.append(name)
        found.append(_system(system, k + 2, absent, stage.impact))
    return tuple(found)


def _system(system: System, number: int, absent: Collection[str], impact: Impacts | None) -> System:
    """Return the system of a stage by its number, without the elements that are absent from it."""
    last = len(system.then) + 1
    parts: dict[str, Any] = {
        key: Names({name: x for name, x in getattr(system, key).items() if name not in absent}) for key in _ELEMENTS
    }
    questions = {name: x for name, x in system.ask.items() if (x.stage or last) == number}
    parts["ask"] = Names({name: replace(x, stage=None) for name, x in questions.items()})
    parts["outputs"] = Names({name: x for name, x in system.outputs.items() if not _names(x, absent)})
    parts["stop"] = Names({name: x for name, x in system.stop.items() if not _names(x, absent)})
    return replace(system, then=(), impact=impact, **parts)


def _names(node: Node | StateCondition, absent: Collection[str]) -> bool:
    """Return whether an expression or a state names an element that is absent."""
    if isinstance(node, StateCondition):
        return any(node.element == name or node.element.startswith(f"{name}.") for name in absent)
    words = (word for leaf in leaves([node], "quantity") for word in leaf.data[1])
    return any(word == name or word.startswith(f"{name}.") for word in words for name in absent)


def _verify_numbers(system: System) -> None:
    last = len(system.then) + 1
    for name, question in system.ask.items():
        if question.stage is not None and question.stage > last:
            with at(name, "stage"):
                raise ModelError(f"there is no stage {question.stage}: `then` makes {last} stages", number="M109")


def _verify_known(system: System, name: str) -> None:
    known = [x for key in _ELEMENTS for x in getattr(system, key)]
    if name not in known:
        message = f"no constraint, joint, contact or force is called {name!r}"
        raise ModelError(message, number="M106", word=name, known=known)


def _verify_begins(system: System, name: str, absent: Collection[str], *, impact: bool) -> None:
    """Raise ModelError for what cannot begin to act in a stage."""
    _verify_known(system, name)
    if not impact and not any(name in getattr(system, key) for key in _STARTING):
        message = f"{name} holds bodies: it begins with an impact, write impact: {{begins: {name}}}"
        raise ModelError(message, number="M110")
    if name not in absent:
        raise ModelError(f"{name} begins in an earlier stage already", number="M110")


def _verify_released(system: System, name: str, absent: Collection[str]) -> None:
    """Raise ModelError for what cannot be released in a stage."""
    _verify_known(system, name)
    if name in absent:
        raise ModelError(f"{name} does not act before: an earlier stage releases it, or a later one begins it",
                         number="M110")
    if name in system.joints and not getattr(system.joints[name], "cut", False):
        child = getattr(system.joints[name], "child", "its body")
        raise ModelError(
            f"{name} has the coordinates of {child}: give {child} a joint to ground of its own (free, planar or "
            f"point), and let {name} be cut: true",
            number="M110",
        )


# ----------------------------------------------------------------------------------------------------------------------
# A system that goes on from a later time: its own time begins there, and so do those of its questions.


def going_on(system: System, begins: Node, start: Mapping[str, Any]) -> System:
    """Return a system at its start at a time of the declared one, with coordinates and speeds by name.

    `begins`: the time (s) that has passed then, with which expressions of t go on, questions and `t_end` too.
    """
    settings = replace(system.simulation, t_end=subtract(system.simulation.t_end, begins))
    plain = replace(system, ask=Names(), simulation=settings)
    own = with_expressions(plain, lambda node: _later(node, begins))
    own = Overrides(initial=start).of(replace(own, ask=in_own_time(system.ask, begins)))
    free = {
        name: replace(joint, initial=replace(joint.initial, known=False))
        for name, joint in own.joints.items()
        if isinstance(joint, MovingJoint) and joint.initial is not None
    }
    return replace(own, joints=Names({**own.joints, **free}))


def in_own_time(questions: Mapping[str, Ask], begins: Node) -> Names:
    """Return questions in the time of a system that goes on; those for a time are answered in the declared one."""
    if begins is ZERO:
        return Names(questions)
    found: dict[str, Ask] = {}
    for name, question in questions.items():
        asked: Ask = with_expressions(question, lambda node: _later(node, begins))
        changes: dict[str, Any] = {}
        if asked.after is not None:
            changes["after"] = subtract(asked.after, begins)
        if (until := time_of(asked.until)) is not None:
            changes["until"] = subtract(until, begins)
        if asked.when is not None and asked.value is None:
            changes["value"] = add(t, begins)
        found[name] = replace(asked, **changes)
    return Names(found)


def _later(node: Node, begins: Node) -> Node:
    """Return an expression of the declared time as one of the time since a later one."""
    later: Node = evaluate([node], lambda leaf: add(t, begins) if leaf == t else leaf)[0]
    return later
