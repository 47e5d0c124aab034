"""System: everything the user declared, and nothing that follows from it; to and from the tree that a file holds."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass, replace
from functools import cache, cached_property
from typing import Any, Final, NamedTuple

from multibody_sym.errors import ModelError, at, nearest
from multibody_sym.model.argument_checks import flag, text
from multibody_sym.model.bodies import Body
from multibody_sym.model.constraints import CONSTRAINTS, Pulley
from multibody_sym.model.contacts_and_impacts import Contact, Impacts, ImpactsField
from multibody_sym.model.fields import (
    Count,
    Element,
    ListOf,
    MapOf,
    Names,
    Point,
    Prose,
    Record,
    Scalar,
    Text,
    Vector,
    describe,
    fields_of,
    fields_tree,
    from_fields,
    holds,
    is_text,
    list_items,
    verify_keys,
)
from multibody_sym.model.forces import FORCES, Friction
from multibody_sym.model.joints import JOINTS, Joint
from multibody_sym.model.parameters import Constant, InputField, Parameter, ParameterField, StateVariable, Table
from multibody_sym.model.settings import Ask, AskField, Settings
from multibody_sym.model.state_words import Stage, StateCondition, StopCondition
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import substitute
from multibody_sym.scalars.node import ZERO, Node, symbol, symbol_with

_MAPS: Final = (
    *("parameters", "bodies", "joints", "forces", "constraints", "pulleys", "contacts"),
    *("states", "inputs", "outputs", "stop", "ask"),
)
_COUNTED: Final = (("bodies", "body"), *((f"{one}s", one) for one in ("joint", "constraint", "contact", "force")))
_SYMBOL: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
RESERVED: Final = ("t", "pi")
t: Final = symbol("t")
"""The time, as expressions name it."""


class Written(NamedTuple):
    """An expression in a system: its path, and the unit of its field (None: any)."""

    path: tuple[str, ...]
    node: Node
    unit: str | None


@dataclass(frozen=True)
class System(Element):
    """A declared multibody system; each field is a key of the model file.

    Symbols made by `multibody_sym.parameters` bring their declarations along; they need not stand in `parameters`.
    """

    name: str = holds(Text(), says="what the system is called", such="pendulum")
    gravity: Point = holds(
        Vector("m/s^2"), (0, 0, 0), says="acceleration of free fall, along the inertial axes", such="[0, -g, 0]"
    )
    parameters: Mapping[str, Parameter] = holds(
        MapOf(ParameterField()), None, says="named numbers, which expressions use", such="{m: 1 kg, l: 0.5 m}"
    )
    bodies: Mapping[str, Body] = holds(
        MapOf(Record(Body)), None, such="{bob: {mass: m, com: [0, -l, 0]}}",
        says="bodies by name; ground is there by itself and may be given points, frames, surfaces, a motion",
    )
    joints: Mapping[str, Joint] = holds(
        MapOf(JOINTS), None, such="{hinge: {type: revolute, parent: ground, child: bob}}",
        says="joints by name: how each body moves relative to another",
    )
    forces: Mapping[str, Element] = holds(
        MapOf(FORCES), None, such="{air: {type: drag, on: bob, linear: c}}",
        says="forces, springs, dampers, motors and friction by name",
    )
    constraints: Mapping[str, Element] = holds(
        MapOf(CONSTRAINTS), None, such="{rod: {type: distance, between: [a, b], value: l}}",
        says="ropes, rods, gears, rolling and other constraints by name",
    )
    pulleys: Mapping[str, Pulley] = holds(
        MapOf(Record(Pulley)), None, says="pulleys by name, which paths of ropes use", such="{P1: {at: ground.top}}"
    )
    contacts: Mapping[str, Contact] = holds(
        MapOf(Record(Contact)), None, keyword=True, such="{c1: {between: [block, ground.table], static: 0.4}}",
        says="contacts by name: bodies that may touch, push and rub",
    )
    impact: Impacts | None = holds(
        ImpactsField(), None, keyword=True, such="{impulse: [0, I, 0], at: coin.edge}",
        says="the impact at the start: one, a map of several, or closing",
    )
    then: tuple[Stage, ...] = holds(
        ListOf(Record(Stage)), (), keyword=True, such="[{at: {phi: 0}, release: [string]}]",
        says="the stages that follow the first one, in their order: when each begins, and what changes then",
    )
    states: Mapping[str, StateVariable] = holds(
        MapOf(Record(StateVariable)), None, keyword=True, such="{p: {rate: (Q - A*u_s)/C, initial: 1 bar}}",
        says="state variables by name, such as a pressure or a current: each has a rate and a value at the start",
    )
    inputs: Mapping[str, Node | Table | Constant] = holds(
        MapOf(InputField()), None, such="{tau: T0*sin(t)}",
        says="inputs by name: expressions of t and parameters, or tables",
    )
    outputs: Mapping[str, Node] = holds(
        MapOf(Scalar()), None, such="{pull: fy(hinge)}",
        says="outputs by name: expressions that runs report; questions may name them",
    )
    stop: Mapping[str, Node | StateCondition] = holds(
        MapOf(StopCondition()), None, says="conditions by name that end a run", such="{fall: y < 0}"
    )
    ask: Mapping[str, Ask] = holds(
        MapOf(AskField()), None, says="questions by name that solve answers", such="{path: {of: block, after: 4 s}}"
    )
    simulation: Settings = holds(
        Record(Settings), None, says="how it is simulated, unless a command says otherwise", such="{t_end: 2 s}"
    )

    description: str | None = holds(
        Prose(), None, keyword=True, says="the statement of the problem: the system and the question",
        such="A block slides down a rough incline.",
    )

    def __post_init__(self) -> None:
        for name in _MAPS:
            if getattr(self, name) is None:
                object.__setattr__(self, name, {})
        if self.simulation is None:
            object.__setattr__(self, "simulation", Settings())
        states = not any(self.gravity is none for none in (None, type(self).gravity, _NO_GRAVITY))
        super().__post_init__()
        if not states:
            object.__setattr__(self, "gravity", _NO_GRAVITY)
        self._collect_declarations()

    def __repr__(self) -> str:
        counted = [(len(getattr(self, several)), one, several) for several, one in _COUNTED]
        parts = [f"{n} {several if n > 1 else one}" for n, one, several in counted if n]
        return f"<System {self.name}: {', '.join(parts) or 'nothing in it'}>"

    @property
    def frictions(self) -> dict[str, Friction]:
        """The friction in joints, by name."""
        return {name: force for name, force in self.forces.items() if isinstance(force, Friction)}

    @cached_property
    def _written(self) -> list[Written]:
        """Its expressions, kept: a dozen places ask a large system for them."""
        return _gather(self, (), None, [])

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields for a pickle or a copy; what follows from them is computed again."""
        return {name: value for name, value in vars(self).items() if name != "_written"}

    def _collect_declarations(self) -> None:
        """Move declarations that symbols carry into `parameters`, leaving plain symbols behind."""
        declared: dict[str, Parameter] = dict(self.parameters)
        written = _gather(self, (), None, [])
        pending = [each.node for each in written]
        declares = False
        while pending:
            carried = leaves(pending, "declared")
            declares = declares or bool(carried)
            pending = []
            for leaf in carried:
                name, parameter = leaf.data
                if declared.setdefault(name, parameter) != parameter:
                    with at("parameters", name):
                        raise ModelError(f"{name} is declared twice, with different values", number="M108")
                pending.append(parameter.value)
        object.__setattr__(self, "parameters", Names(declared))
        if not declares:  # a system from a file, or made from another one
            vars(self)["_written"] = written
            return
        for f in fields(self):
            object.__setattr__(self, f.name, with_expressions(getattr(self, f.name), _without_declarations))


_NO_GRAVITY: Final = (ZERO, ZERO, ZERO)
"""The gravity of a system that states none; compared by identity, so that changed systems keep it."""


def states_gravity(system: System) -> bool:
    """Return whether gravity is declared, if only as none."""
    return system.gravity is not _NO_GRAVITY


def _without_declarations(node: Node) -> Node:
    return substitute(node, {leaf: symbol(leaf.data[0]) for leaf in leaves([node], "declared")})


_PLAIN: Final = (str, int, float, type(None))


def expressions(part: Any, path: tuple[str, ...] = ()) -> list[Written]:
    """Return every expression inside a system, element, map or tuple, with its path and its field's unit."""
    return list(part._written) if isinstance(part, System) and not path else _gather(part, path, None, [])


def expressions_in(system: System, names: Iterable[str]) -> list[Written]:
    """Return every expression inside some fields of a system, field by field."""
    by_field: dict[str, list[Written]] = {}
    for written in expressions(system):
        by_field.setdefault(written.path[0], []).append(written)
    return [written for name in names for written in by_field.get(name, ())]


def _gather(part: Any, path: tuple[str, ...], unit: str | None, found: list[Written]) -> list[Written]:
    """Append the expressions inside a part to `found`, and return it."""
    if isinstance(part, Node):
        found.append(Written(path, part, unit))
    elif isinstance(part, Element):
        for steps, value, field_unit in part.written():
            if isinstance(value, Node):  # most are, in large models
                found.append(Written((*path, *steps), value, field_unit))
            elif not isinstance(value, _PLAIN):
                _gather(value, (*path, *steps), field_unit, found)
    elif isinstance(part, tuple):
        for i, x in enumerate(part):
            _gather(x, (*path, str(i)), unit, found)
    elif isinstance(part, Mapping):
        for name, x in part.items():
            _gather(x, (*path, name), unit, found)
    return found


def with_expressions(part: Any, change: Callable[[Node], Node]) -> Any:
    """Return a system, record, map or tuple with `change` applied to every expression but constants.

    A part without a change is returned itself.
    """
    if isinstance(part, Node):
        return change(part) if part.shadow is None else part
    if isinstance(part, _PLAIN):
        return part
    if isinstance(part, Names):
        content = {name: with_expressions(x, change) for name, x in part.items()}
        return part if all(x is part[name] for name, x in content.items()) else Names(content)
    if type(part) is tuple:
        changed_items = tuple([with_expressions(x, change) for x in part])
        return part if all(a is b for a, b in zip(changed_items, part, strict=True)) else changed_items
    if is_dataclass(part) and not isinstance(part, type):
        changed = {}
        for name in _fields_of(type(part)):
            old = getattr(part, name)
            if (new := with_expressions(old, change)) is not old:
                changed[name] = new
        if not changed:
            return part
        return part.with_fields(changed) if isinstance(part, Element) else replace(part, **changed)
    return part


@cache
def _fields_of(kind: Any) -> tuple[str, ...]:
    return tuple(f.name for f in fields(kind))


def parameters(names: str, values: Any, *, positive: bool = False, units: str | None = None) -> tuple[Node, ...]:
    """Return symbols for parameters declared with sample values.

    `names` are separated by spaces; `values` is a list of numbers, expressions or texts such as `1 kg`, or for one name
    its value; `units`, also separated by spaces, state their dimensions.
    Raises InputError where the counts differ, a name is no symbol, or a value is no number or expression.
    """
    if not isinstance(names, str):
        raise ModelError(f"expected names separated by spaces, got {describe(names)}", number="M103")
    words, positive = names.split(), flag("positive", positive)
    given = list_items(values)
    given = [values] if given is None else given
    unit_words = [""] * len(words) if units is None else text("units", units).split()
    if not len(words) == len(given) == len(unit_words):
        raise ModelError(f"{len(words)} names, {len(given)} values and {len(unit_words)} units do not match")
    symbols = []
    for name, value, unit in zip(words, given, unit_words, strict=True):
        with at("parameters", name):
            verify_symbol(name)
            value = f"{value} {unit}" if unit else value
            parameter = ParameterField().accept({"value": value, "positive": positive})
            symbols.append(symbol_with(name, parameter))
    return tuple(symbols)


def variable(name: str) -> Node:
    """Return the symbol of a coordinate, speed, input or parameter of a system by its name, or of t.

    Raises InputError for what is no name of a symbol.
    """
    if text("name", name) != "t":
        verify_symbol(name)
    return symbol(name)


def verify_symbol(name: str) -> None:
    """Raise ModelError unless `name` can stand in expressions."""
    if not _SYMBOL.fullmatch(name):
        raise ModelError(
            f"{name!r} cannot stand in expressions: use letters, digits and _, a letter first", number="M108"
        )
    if name in RESERVED:
        raise ModelError(f"{name!r} is reserved", number="M108")


def verify_system(value: object) -> None:
    """Raise ModelError unless `value` is a System; people hand over the name of a file."""
    if not isinstance(value, System):
        raise ModelError(f"expected a System, got {describe(value)}; load(...) reads one from a file", number="M103")


# ----------------------------------------------------------------------------------------------------------------------
# Between a System and the plain tree (maps, lists, text) that a model file holds.


VERSION: Final = "1"
VERSION_KEY: Final = "multibody_sym"
REPEAT_KEY: Final = "repeat"


def system_from_tree(tree: Any) -> System:
    """Return the System that a model file's content describes.

    Raises InputError with the path of the field in `where.path`.
    """
    if not isinstance(tree, Mapping):
        raise ModelError(f"a model file is a map, got {describe(tree)}", number="F103")
    known = (VERSION_KEY, *fields_of(System), REPEAT_KEY)
    if VERSION_KEY not in tree:
        verify_keys([key for key in tree if nearest(str(key), known) == VERSION_KEY], known)
    version = tree.get(VERSION_KEY)
    if version != VERSION:
        with at(VERSION_KEY):
            raise ModelError(
                f"a model file says '{VERSION_KEY}: {VERSION}' first, got {describe(version)}", number="F103"
            )
    verify_keys(tree, known)
    content = {key: x for key, x in tree.items() if key not in (VERSION_KEY, REPEAT_KEY)}
    given = tree.get(REPEAT_KEY)
    chains = []
    for index, entry in [] if given is None or is_text(given, "") else _chains_in(given):
        with at(REPEAT_KEY, *index):
            chain = Record(Repeat).accept(entry)
            assert isinstance(chain, Repeat)
            if chain.count > MOST_REPEATS:
                with at("count"):
                    raise ModelError(f"at most {MOST_REPEATS} copies", number="M109")
            chains.append((index, chain))
    for index, chain in chains:
        with at(REPEAT_KEY, *index):
            content = _with_chain(content, chain)
    system = from_fields(System, content)
    assert isinstance(system, System)
    return system


def tree_from_system(system: System) -> dict[str, Any]:
    """Return the content of a model file that describes the System."""
    return {VERSION_KEY: VERSION, **{key: part for key, part in fields_tree(system).items() if part != {}}}


@dataclass(frozen=True)
class AnyMap:
    """A map that is read later, once for each copy; `like` is the field that reads it in full."""

    like: Any

    def accept(self, value: Any) -> Mapping[str, Any]:
        if not isinstance(value, Mapping):
            raise ModelError(f"expected a map, got {describe(value)}", number="M103")
        return value

    def tree(self, value: Mapping[str, Any]) -> Any:
        return value


@dataclass(frozen=True)
class Repeat(Element):
    """A chain of `count` like bodies: each joined by `joint` to the point `parent` of the one before.

    The first is joined to `start`. Bodies are called `<body_name>1`, `<body_name>2`, ..., joints `<joint_name>1`, ...
    """

    count: int = holds(Count(), says="how many copies there are", such="10")
    body: Mapping[str, Any] = holds(
        AnyMap(Record(Body)), says="the body of each copy",
        such="{mass: m, com: [0, -l/2, 0], points: {end: [0, -l, 0]}}",
    )
    joint: Mapping[str, Any] = holds(
        AnyMap(JOINTS), such="{type: revolute, parent: end}",
        says="the joint of each copy, without child; parent names a point of the copy before",
    )
    start: str = holds(Text(), "ground", says="the body or point that carries the first copy", such="ground.top")
    body_name: str = holds(Text(), "body", says="the bodies are called by this name and 1, 2, ..", such="rod")
    joint_name: str = holds(Text(), "joint", says="the joints are called by this name and 1, 2, ..", such="hinge")


MOST_REPEATS: Final = 10_000


def _with_chain(tree: Mapping[str, Any], repeat: Repeat) -> dict[str, Any]:
    """Return a file's content with the bodies and joints of a chain."""
    with at("body"):
        body = Record(Body).accept(repeat.body)
    joint, point = dict(repeat.joint), repeat.joint.get("parent")
    bodies, joints = dict(tree.get("bodies") or {}), dict(tree.get("joints") or {})
    for k in range(1, repeat.count + 1):
        body_name, joint_name = f"{repeat.body_name}{k}", f"{repeat.joint_name}{k}"
        for name, taken in ((body_name, bodies), (joint_name, joints)):
            if name in taken:
                raise ModelError(
                    f"the chain would declare {name!r} a second time; choose another body_name or joint_name",
                    number="M108",
                )
        before = f"{repeat.body_name}{k - 1}" + (f".{point}" if point else "")
        with at("joint"):
            ends = {"parent": repeat.start if k == 1 else before, "child": body_name}
            joints[joint_name] = JOINTS.accept({**joint, **ends})
        bodies[body_name] = body
    return {**tree, "bodies": bodies, "joints": joints}


def _chains_in(value: Any) -> list[tuple[tuple[str, ...], Any]]:
    """Return the chains under `repeat`, one or a list, with their paths there."""
    return [((str(i),), x) for i, x in enumerate(value)] if isinstance(value, list) else [((), value)]


_COPIED: Final = {"bodies": "body", "joints": "joint"}
"""Sections with copies, and their keys in a chain, which are the default names of the copies too."""


def path_in_file(tree: Any, path: tuple[str, ...]) -> tuple[str, ...]:
    """Return the path in a file's content for a path in the system: for a copy, the path in its chain."""
    section, name = (*path[:2], "", "")[:2]
    if section not in _COPIED or not isinstance(tree, Mapping):
        return path
    declared = tree.get(section)
    if isinstance(declared, Mapping) and name in declared:
        return path
    part = _COPIED[section]
    for index, chain in _chains_in(tree.get(REPEAT_KEY)):
        begin = str(chain.get(f"{part}_name", part)) if isinstance(chain, Mapping) else None
        if begin is not None and name.removeprefix(begin).isdecimal() and name.startswith(begin):
            return (REPEAT_KEY, *index, part, *path[2:])
    return path


_IN_DEGREES: Final = re.compile(r"\bdeg\b")


def angles_of(system: System) -> str:
    """Return how angles are printed: in degrees where parameters or starts are, else with these beside (`both`)."""
    given = [parameter.given("value") for parameter in system.parameters.values()]
    starts = (getattr(joint, "initial", None) for joint in system.joints.values())
    given += [start.given("q") for start in starts if start is not None]
    return "deg" if any(_IN_DEGREES.search(str(x)) for x in given) else "both"
