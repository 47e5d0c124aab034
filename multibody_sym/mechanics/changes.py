"""Which systems follow from a declared one: as a call overrides it, of each stage of a motion, from a later time on?

Functions take the options of a call by name, commands hand them on; nothing else changes a declaration. Each stage of a
system with `then` has one of its own, which begins at its own t = 0.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Final, NamedTuple

from multibody_sym.errors import ModelError, MultibodyError, at
from multibody_sym.mechanics.spanning_tree import coordinate_names, speed_names
from multibody_sym.model.argument_checks import flag, state_by_name, values_by_name
from multibody_sym.model.contacts_and_impacts import Impacts
from multibody_sym.model.fields import Names, is_gap, scalar
from multibody_sym.model.joints import Initial, MovingJoint
from multibody_sym.model.parameters import InputField
from multibody_sym.model.run_options import MODEL_OVERRIDES, ModelOptions
from multibody_sym.model.settings import Ask
from multibody_sym.model.state_words import MOMENTS, StateCondition, time_of
from multibody_sym.model.system import System, expressions, t, verify_system, with_expressions
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import substitute
from multibody_sym.scalars.node import ZERO, Node, add, subtract, symbol
from multibody_sym.text.parser import of_run, parse_scalar
from multibody_sym.text.printer import text


@dataclass(frozen=True)
class Overrides:
    """The options that every function takes beside a system, and every command beside a model file.

    None leaves all as declared. `parameters`: values by name (numbers, expressions, or text such as `500 g` or `2*r`);
    `initial`: coordinates and speeds at t = 0 by name, None for one that is to be found, or the `final` of a run;
    `inputs`: expressions or tables by name; `coordinates`: "relative" or "absolute"; `project`: whether all start
    values change, known ones too, as little as constraints need.
    """

    parameters: Mapping[str, Any] | None = None
    initial: Mapping[str, Any] | None = None
    inputs: Mapping[str, Any] | None = None
    coordinates: str | None = None
    project: bool | None = None

    def of(self, system: System) -> System:
        """Return the system, changed. Raises InputError with the option and the name in `where.path`."""
        verify_system(system)
        with at("parameters"):
            changed = with_values(system, self.parameters)
        with at("inputs"):
            changed = with_inputs(changed, self.inputs)
        with at("initial"):
            changed = with_initial(changed, self.initial)
        project = None if self.project is None else flag("project", self.project)
        return with_settings(changed, {"coordinates": self.coordinates, "project": project})


def with_overrides(system: System, options: ModelOptions) -> System:
    """Return the system, changed as a call asks. Raises InputError as `Overrides.of` does."""
    changes: dict[str, Any] = {name: options.get(name) for name in MODEL_OVERRIDES}
    return Overrides(**changes).of(system)


def with_values(system: System, values: Mapping[str, Any] | None) -> System:
    """Return the system with new parameter values: numbers, expressions, or text such as `500 g` or `2*r`.

    Raises InputError for a name that is no parameter and for a value of another dimension.
    """
    verify_system(system)
    given = values_by_name("parameters", values)
    if not given:
        return system
    changed = dict(system.parameters)
    for name, value in given.items():
        with at(name):
            if name not in changed:
                raise ModelError(f"there is no parameter {name!r}", number="M106", word=name, known=changed)
            parameter = changed[name]
            if not isinstance(value, str):
                changed[name] = replace(parameter, value=scalar(value, None))
                continue
            node, dimension = parse_scalar(value)
            if None not in (dimension, parameter.dimension) and dimension != parameter.dimension:
                message = f"'{value}' does not fit: the parameter is a quantity in {parameter.dimension}"
                raise ModelError(message, number="M105")
            new = replace(parameter, value=node, dimension=dimension or parameter.dimension)
            changed[name] = new.declared_as(value)
    return replace(system, parameters=Names(changed))


def with_inputs(system: System, inputs: Mapping[str, Any] | None) -> System:
    """Return the system with other inputs: numbers, expressions, tables. Raises InputError for a name of none."""
    changed: dict[str, Any] = dict(system.inputs)
    for name, value in values_by_name("inputs", inputs).items():
        with at(name):
            if name not in changed:
                raise ModelError(f"there is no input {name!r}", number="M106", word=name, known=changed)
            changed[name] = InputField().accept(value)
    return replace(system, inputs=Names(changed)) if inputs else system


class _Place(NamedTuple):
    """Where a start value stands: under `key` (q, u) of a joint's `initial`, at a `number`, in `unit`."""

    joint: str
    key: str
    number: int
    unit: str


def with_initial(system: System, values: Mapping[str, Any] | None) -> System:
    """Return the system with other start values of coordinates, speeds and states, by name; None: to be found.

    `values` may be the `final` of a run, from which another one goes on; its time is left out: runs begin at t = 0.
    Raises InputError for a name that is neither's, for a value of another dimension, and for a part of a quaternion.
    """
    given = state_by_name("initial", values)
    places: dict[str, _Place] = {}
    for joint, declared in system.joints.items():
        named = ("q", coordinate_names(joint, declared)), ("u", speed_names(joint, declared))
        units = {"q": declared.coordinate_units, "u": declared.speed_units}
        for key, names in named:
            places |= {name: _Place(joint, key, k, units[key][k]) for k, name in enumerate(names)}
    found: dict[str, dict[str, Node | None]] = {}
    states = dict(system.states)
    for name, value in given.items():
        with at(name):
            if name in system.states:
                state = system.states[name]
                if is_gap(value):
                    raise ModelError("a state needs a value at the start: its rate does not tell one", number="M102")
                unit = None if state.dimension is None else str(state.dimension)
                states[name] = replace(state, initial=scalar(value, unit))
                continue
            if name not in places:
                from multibody_sym.mechanics.absolute import unknown_coordinate

                raise unknown_coordinate(name, system, (*places, *system.states))
            found.setdefault(places[name].joint, {})[name] = start_value(value, places[name].unit)
    joints = dict(system.joints)
    for joint, new in found.items():
        with at(next(iter(new))):
            moving = joints[joint]
            assert isinstance(moving, MovingJoint)
            initial, counts = moving.initial or Initial(), (len(moving.coordinate_units), len(moving.speed_units))
            starts = {key: list(initial.values(key, count)) for key, count in zip("qu", counts, strict=True)}
            for name, value in new.items():
                starts[places[name].key][places[name].number] = value
            keys = {places[name].key for name in new}
            changed: dict[str, Any] = {key: values for key, values in starts.items() if key in keys}
            joints[joint] = replace(moving, initial=replace(initial, **changed))
    return replace(system, joints=Names(joints), states=Names(states)) if given else system


def start_value(value: Any, unit: str) -> Node | None:
    """Return a start value in SI units, None where it is to be found; raises InputError for another dimension."""
    return None if is_gap(value) else scalar(value, unit)


def with_settings(system: System, settings: Mapping[str, Any]) -> System:
    """Return the system with those `settings` (keys of `simulation:`) that are not None.

    A new `step` takes the place of tolerances in the file, and new tolerances that of a step.
    """
    given = {name: value for name, value in settings.items() if value is not None}
    if not given:
        return system
    if "step" in given:
        given = {"rtol": None, "atol": None, **given}
    elif "rtol" in given or "atol" in given:
        given = {"step": None, **given}
    with at("simulation"):
        return replace(system, simulation=replace(system.simulation, **given))


# ----------------------------------------------------------------------------------------------------------------------
# The system of each stage of a motion: which elements act, and what is asked.


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
    last = len(system.then) + 1
    for name, question in system.ask.items():
        if question.stage is not None and question.stage > last:
            with at("ask", name, "stage"):
                raise ModelError(f"there is no stage {question.stage}: `then` makes {last} stages", number="M109")
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
    return substitute(node, {t: add(t, begins)})
