"""What may the expressions of a system and its questions say: which names, which quantities, in which dimensions?"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from functools import cached_property
from typing import Final

from multibody_sym.errors import ExpressionError, ModelError, MultibodyError, at, join_errors
from multibody_sym.mechanics.law_elements import PRESSING, LawElement, exerted_by
from multibody_sym.mechanics.mechanism import NORMAL, Coordinate, Mechanism, Speed
from multibody_sym.mechanics.modes import possible_words
from multibody_sym.mechanics.references import BARE
from multibody_sym.mechanics.ropes import run_names, tension_names
from multibody_sym.mechanics.spanning_tree import coordinate_names, ground_moves, rate_names, speed_names
from multibody_sym.model.bodies import GROUND, OWN_POINTS
from multibody_sym.model.constraints import (
    Coupler,
    Distance,
    Gear,
    PrescribedMotion,
    Rope,
    VelocityConstraint,
    row_names,
)
from multibody_sym.model.contacts_and_impacts import contact_names
from multibody_sym.model.fields import AXES, QUATERNION, Element, dimension_of_unit, fields_of
from multibody_sym.model.forces import Damper, SpringDamper, Torque
from multibody_sym.model.joints import Foot, MovingJoint
from multibody_sym.model.parameters import Tabled, input_dimensions, unit_text
from multibody_sym.model.settings import FORCED, MOMENTUM, Ask, Equation
from multibody_sym.model.state_words import Moment, StateCondition
from multibody_sym.model.steps import PARAMETER
from multibody_sym.model.system import RESERVED, System, Written, expressions, expressions_in, verify_symbol
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node, as_node, named_nodes, symbol
from multibody_sym.text.parser import OWN_CENTRE, QUANTITIES, SYSTEM, WEIGHT, component_kind, of_run
from multibody_sym.text.printer import AT, COMPONENTS, FORCE_NAMES, text
from multibody_sym.text.units import (
    DIMENSIONLESS,
    LENGTH,
    TIME,
    Dimension,
    Measured,
    given_in,
    infer_dimension,
    rate_unit,
)

# ----------------------------------------------------------------------------------------------------------------------
# The dimensions of a system's expressions: one check for each of them, with all units of the model.
#
# Units are checked in models that give units to parameters or inputs. There coordinates and speeds have the units of
# their joints and the time is in s; elsewhere a number may be in any unit.

_ALONG: Final = {"m": dimension_of_unit("N"), "rad": dimension_of_unit("N*m")}
"""The dimension of a force along a coordinate, by the coordinate's unit."""
_RATES: Final = {"'": 1, "''": 2}
_OWN: Final = {"span": LENGTH, "span_rate": LENGTH.times(TIME, -1), "place": LENGTH, "arc": LENGTH}
"""The dimensions of the names that laws of forces have of their own."""


@dataclass(frozen=True, eq=False)
class Dimensions:
    """The dimensions of a system's names and quantities, as far as known."""

    system: System

    def verify(self, written: Written) -> None:
        """Raise ModelError or ExpressionError where an expression contradicts itself, or is in a wrong unit."""
        found, unit = infer_dimension(written.node, self.of_leaf), self._unit(written)
        if found is None or unit is None or not found.certain:
            return
        if found.dimension not in (DIMENSIONLESS, dimension_of_unit(unit)):  # a pure number fits everywhere
            raise ModelError(
                f"the expression is a quantity in {found.dimension}; here one in {unit or 'no unit'} is wanted"
                + self._given_in(written.node),
                number="M105",
            )

    def _given_in(self, node: Node) -> str:
        """Return the units in which parameters of an expression are given, of which one may be wrong."""
        given = ((leaf.data, self._given.get(leaf.data)) for leaf in leaves([node], "symbol"))
        units = ", ".join(f"{name} in {unit}" for name, unit in given if unit not in (None, DIMENSIONLESS))
        return f" ({units})" if units else ""

    def verify_elements(self) -> None:
        """Raise ModelError where a number has another unit than its element's joint or coordinate asks for.

        So it is where factors that tie joints to each other have other units than these.
        """
        for (section, name), units in self._of_elements.items():
            element = getattr(self.system, section)[name]
            with at(section, name):
                for key, unit in units.items():
                    element.verify_unit(key, unit)
        for name, element in self.system.constraints.items():
            if isinstance(element, (Gear, Coupler)):
                with at("constraints", name):
                    infer_dimension(self._tied(element), self.of_leaf)
        for name, given in self.system.inputs.items():
            if isinstance(given, Tabled):
                self._verify_table(name, given)

    def _verify_table(self, name: str, table: Tabled) -> None:
        """Raise ModelError where arguments of a table are in another unit than the expression that they belong to."""
        found = [self._followed(of, self.of_leaf) for of in table.arguments]
        units = [None if x is None or not x.certain else unit_text(x.dimension) for x in found]
        with at("inputs", name):
            table.verify_arguments(units)

    # --- names and quantities -------------------------------------------------------------------------------------

    def of_leaf(self, leaf: Node) -> Measured | None:
        """Return the dimension of a name or quantity, None where it is not known."""
        if leaf.op != "quantity":
            return self._of_name(leaf.data) if leaf.op == "symbol" else None
        function, arguments = leaf.data
        if function == PARAMETER:
            return Measured(dimension_of_unit(arguments[1]), numbered=True)  # the x of `x^2/2` may have a factor 1/m
        if function in QUANTITIES:
            return given_in(QUANTITIES[function].dimension) or self._of_asked(function, arguments)
        own = _OWN.get(function) if self._gives_units else None
        return None if own is None else Measured(own)

    def _of_asked(self, function: str, arguments: Sequence[str]) -> Measured | None:
        """Return the dimension of a reaction or a rate, which depends on the component or coordinate."""
        if function == "reaction":
            element, component = arguments
            owner = element.partition(".")[0]
            if component in COMPONENTS or owner in self._contacts:
                return given_in(dimension_of_unit(component_kind(component).unit))
            if component == PRESSING["stop"]:
                return given_in(_ALONG.get(self._units_of_motion.get(self._only_coordinate(owner), "")))
        moving = self._of_name(arguments[0]) if function in _RATES else None
        return None if moving is None else moving.times(Measured(TIME), -_RATES[function])

    def _of_name(self, name: str) -> Measured | None:
        """Return the dimension of a name, or of the expression that it stands for."""
        stack = [name]
        while stack:
            last = stack[-1]
            node = self._expressions.get(last)
            names = [] if node is None or last in self._known else [x.data for x in leaves([node], "symbol")]
            missing = [x for x in names if x in self._expressions and x not in self._known and x not in stack]
            if missing:
                stack.append(missing[0])
                continue
            stack.pop()
            if node is not None and last not in self._known:
                self._known[last] = self._followed(node, self._of_known)
        return self._known.get(name)

    @staticmethod
    def _followed(node: Node, of_leaf: Callable[[Node], Measured | None]) -> Measured | None:
        """Return the dimension of an expression; None if it contradicts itself, which is an error elsewhere."""
        try:
            return infer_dimension(node, of_leaf)
        except ExpressionError:
            return None

    def _of_known(self, leaf: Node) -> Measured | None:
        return self._known.get(leaf.data) if leaf.op == "symbol" else self.of_leaf(leaf)

    @cached_property
    def _known(self) -> dict[str, Measured | None]:
        """Known dimensions of names; those of expressions are added when they are asked for."""
        found: dict[str, Measured | None] = {}
        if self._gives_units:
            found["t"] = Measured(TIME)
            found |= {x: Measured(dimension_of_unit(unit)) for x, unit in self._units_of_motion.items()}
        return found | {name: given_in(dimension) for name, dimension in self._given.items()}

    @cached_property
    def _given(self) -> dict[str, Dimension]:
        stated = {name: x.dimension for name, x in self.system.parameters.items()}
        stated |= {name: x.dimension for name, x in self.system.states.items()}
        found = {name: dimension for name, dimension in stated.items() if dimension is not None}
        return found | input_dimensions(self.system.inputs)

    @cached_property
    def _gives_units(self) -> bool:
        """Whether the model gives units, other than those of angles, so that motion and time have units too."""
        return any(dimension != DIMENSIONLESS for dimension in self._given.values())

    def of_state(self, name: str) -> Dimension | None:
        """Return the dimension of a declared state: stated, or that of its start; None where neither is known."""
        found = self._of_name(name)
        return None if found is None or not found.certain else found.dimension

    def _unit_of_state(self, name: str, key: str) -> str | None:
        """Return the unit of a state's rate or start, None where the state has none."""
        dimension = self._given.get(name) if key == "initial" else self.of_state(name)
        if dimension is None:
            return None
        return rate_unit(str(dimension)) if key == "rate" else str(dimension)

    @cached_property
    def _contacts(self) -> Collection[str]:
        """The names of contacts, those that repeat among them."""
        return contact_names(self.system.contacts).keys() - self.system.joints.keys()

    @cached_property
    def _expressions(self) -> dict[str, Node]:
        """The names that are expressions of others: parameters, inputs, outputs; a coordinate's name stands for it.

        A state without a stated dimension has that of its start.
        """
        parameters = {name: x.value for name, x in self.system.parameters.items()}
        begun = {name: x.initial for name, x in self.system.states.items()}
        found = {**self.system.outputs, **named_nodes(self.system.inputs), **begun, **parameters}
        others = (*self._given, *self._units_of_motion)
        return {name: node for name, node in found.items() if node.shadow is None and name not in others}

    def verify_sides(self, given: Equation, of_answers: Mapping[Node, Measured | None] | None = None) -> None:
        """Raise ModelError where the sides of an equation are certain to be in different units."""
        known = of_answers or {}

        def of_leaf(leaf: Node) -> Measured | None:
            return known[leaf] if leaf in known else self.of_leaf(leaf)

        sides = (given.left, given.left_unit), (given.right, given.right_unit)
        left, right = (
            infer_dimension(x, of_leaf) if unit is None else given_in(dimension_of_unit(unit)) for x, unit in sides
        )
        if left is None or right is None or not left.certain or not right.certain:
            return
        if left.dimension != right.dimension and DIMENSIONLESS not in (left.dimension, right.dimension):
            raise ModelError(
                f"{given}: the left side is a quantity in {left.dimension}, the right one in {right.dimension}"
            )

    # --- what a place wants ---------------------------------------------------------------------------------------

    def _unit(self, written: Written) -> str | None:
        """Return the unit that the place of an expression wants; None where any fits."""
        section, *path = written.path
        if written.unit is not None:
            return written.unit
        if section == "states":
            return self._unit_of_state(path[0], path[1])
        if section == "parameters" and path[0] in self._given:
            return str(self._given[path[0]])
        own = self._of_elements.get((section, path[0]))
        if own is not None:
            return own.get(path[1])
        joint = self.system.joints[path[0]] if section == "joints" else None
        return joint.unit_at(path[1:]) if isinstance(joint, MovingJoint) else None

    @cached_property
    def _of_elements(self) -> dict[tuple[str, str], Mapping[str, str]]:
        system = self.system
        forces = {("forces", name): self._units_of_force(element) for name, element in system.forces.items()}
        driven = {
            ("constraints", name): {"value": unit}
            for name, x in system.constraints.items()
            if isinstance(x, PrescribedMotion) and (unit := self._units_of_motion.get(self._only_coordinate(x.joint)))
        }
        return forces | driven | {("ask", name): self._units_of_question(x) for name, x in system.ask.items()}

    @cached_property
    def _units_of_motion(self) -> dict[str, str]:
        found: dict[str, str] = {}
        for name, joint in self.system.joints.items():
            if isinstance(joint, MovingJoint):
                found |= zip(coordinate_names(name, joint), joint.coordinate_units, strict=True)
                found |= zip(speed_names(name, joint), joint.speed_units, strict=True)
        return found

    def _only_coordinate(self, name: str) -> str:
        """Return the coordinate of a joint that has one, else the empty text."""
        joint = self.system.joints.get(name)
        names = coordinate_names(name, joint) if isinstance(joint, MovingJoint) else []
        return names[0] if len(names) == 1 else ""

    def _units_of_question(self, question: Ask) -> Mapping[str, str]:
        """Return the units of the moments at which a coordinate has a value, and of the ends of a search."""
        found = {} if question.section is None else {"at": "m"}
        for key in ("when", "at", "until"):
            moment = getattr(question, key)
            for name in moment if isinstance(moment, Mapping) else ():
                if name in self._units_of_motion:
                    found[key] = self._units_of_motion[name]
                elif name in self.system.states and (dimension := self.of_state(name)) is not None:
                    found[key] = str(dimension)
        if question.between is not None and question.find in self._given:
            found["between"] = str(self._given[question.find])
        elif question.between is not None and question.find in self._units_of_motion:
            found["between"] = self._units_of_motion[question.find]
        return found

    def _tied(self, element: Gear | Coupler) -> Node:
        """Return the expression that a gear or coupler keeps zero."""
        if isinstance(element, Coupler):
            factors, value = element.joints, -element.value
        else:
            factors, value = dict(zip(element.joints, (as_node(1), -element.ratio), strict=True)), -element.value
        named = ((self._only_coordinate(joint), factor) for joint, factor in factors.items())
        return sum((factor * symbol(q) for q, factor in named if q), value)

    def _units_of_force(self, element: Element) -> Mapping[str, str]:
        """Return the units of those fields of a force that depend on the freedom it acts along."""
        if not isinstance(element, (Torque, SpringDamper, Damper)):
            return {}
        if element.joint is None:
            return element.units()
        joint = self.system.joints.get(element.joint)
        if joint is None:
            return {}
        coordinates, speeds = coordinate_names(element.joint, joint), speed_names(element.joint, joint)
        known = dict(zip(speeds, joint.speed_units, strict=True))
        by_coordinate = {q: f"{unit}/s" for q, unit in zip(coordinates, joint.coordinate_units, strict=True) if unit}
        only = speeds[0] if len(speeds) == 1 else None
        speed = {**by_coordinate, **known}.get(element.freedom or only or "")
        return {} if speed is None else element.units(speed)


# ----------------------------------------------------------------------------------------------------------------------
# The names in expressions, and where they may stand.


def meanings(system: System, coordinates: Iterable[Coordinate], speeds: Iterable[Speed]) -> dict[str, str]:
    """Return the kind of each name in expressions. Raises ModelError where two things, but for outputs, share one."""
    taken = {"t": "the time"}
    declared: list[tuple[str, str, tuple[str, ...]]] = [
        *((name, "a parameter", ("parameters", name)) for name in system.parameters),
        *((c.name, "a coordinate" if c.rate is None else _STATE, _coordinate_path(c, system)) for c in coordinates),
        *((s.name, "a speed", ("joints", s.joint)) for s in speeds),
        *((name, "an input", ("inputs", name)) for name in system.inputs),
        *((name, _OUTPUT, ("outputs", name)) for name in system.outputs if name in system.parameters),
    ]
    for name, what, path in declared:
        with at(*path):
            if name not in RESERVED:
                try:
                    verify_symbol(name)
                except ModelError as error:
                    hint = "; name the joint's coordinates with q:" if what in ("a coordinate", "a speed") else ""
                    raise ModelError(error.message + hint, number=error.number, word=name) from None
            if name in taken or name in RESERVED:
                other = "one already" if taken.get(name) == what else taken.get(name, "reserved")
                message = f"{name!r} cannot be {what}: it is {other}; choose another name"
                raise ModelError(message, number="M108", word=name)
        taken[name] = what
    return taken


def _coordinate_path(coordinate: Coordinate, system: System) -> tuple[str, ...]:
    """Return where the model names a coordinate; the joint itself where it has a name by default."""
    given = getattr(system.joints.get(coordinate.joint), "q", None) or ()
    place = ("q", str(given.index(coordinate.name))) if coordinate.name in given else ()
    return (*coordinate.path, *place[: 1 + (len(given) > 1)])


_MOTION: Final = "motion"
_STATE: Final = "a state"
_ANSWER: Final = "an answer"
_OUTPUT: Final = "an output"
_ONLY_PARAMETERS: Final = ("a parameter",)
_MAY_NAME: Final[Mapping[str, tuple[str, ...]]] = {
    "forces": ("a parameter", "a coordinate", "a speed", _STATE, "an input", "the time"),
    "constraints": ("a parameter", "a coordinate", "an input", "the time"),
    "states": ("a parameter", "a coordinate", "a speed", _STATE, "an input", "the time"),
    "inputs": ("a parameter", "a coordinate", "a speed", _STATE, "the time"),
    "outputs": ("a parameter", "a coordinate", "a speed", _STATE, "an input", "the time", _OUTPUT),
    "stop": ("a parameter", "a coordinate", "a speed", _STATE, "an input", "the time", _OUTPUT),
    "ask": ("a parameter", "a coordinate", "a speed", _STATE, "an input", "the time", "a momentum", _OUTPUT, _ANSWER),
    _MOTION: ("a parameter", "an input", "the time"),
}
_MAY_ASK: Final = ("outputs", "stop", "ask")
_KINDS: Final[Mapping[str, str]] = {
    "moving": "no speed, no state, and no coordinate whose rate is a speed",
    "coordinate": "no coordinate whose rate is a speed",
    "whole": "no body, nor the word system",
    "about": "no point, nor the word com",
    "store": "no body and no force",
    "exerting": "no force, constraint, contact or joint, no body whose mass varies, nor the word weight",
    "freedom": "no coordinate and no speed",
}


def verify_expressions(system: System, names: Mapping[str, str]) -> None:
    dimensions = Dimensions(system)
    vocabulary, adds_up = _vocabulary(system), _adding_outputs(system).difference(names)
    dimensions.verify_elements()
    known_in: dict[str, dict[str, str]] = {}
    for written in _declared_expressions(system):
        path, node, _ = written
        if node.shadow is not None:  # a number names nothing and fits everywhere
            continue
        try:
            allowed = _may_name(system, path)
            question = path[1] if path[0] == "ask" else ""
            known = known_in.get(question) or {**_later_names(system, path), **names}
            known_in[question] = known
            own = path[1] if path[0] in ("parameters", "inputs", "outputs", "ask") else None
            _verify_leaves(node, allowed, known, own, _MASS_HINT if _is_of_mass(path) else "")
            if path[0] == "constraints" or _is_driven(path):
                # an input may name what the motion or constraint that it drives may name
                for driving in leaves([node], "symbol"):
                    if driving.data not in system.inputs:
                        continue
                    nodes = [written.node for written in expressions(system.inputs[driving.data])]
                    for leaf in leaves(nodes, "symbol"):
                        if leaf.data in names and names[leaf.data] not in (*allowed, "an input"):
                            what = f"{driving.data!r} names {leaf.data!r}, {names[leaf.data]}"
                            others = _plurals(tuple(word for word in allowed if word != "an input"))
                            raise ModelError(f"{what}; here an input follows {others} only", number="M113")
            for leaf in _asked_quantities(node):
                _verify_quantity(leaf, path[0], vocabulary)
            _verify_adding(system, path, node, adds_up)
            dimensions.verify(written)
        except (ModelError, ExpressionError) as error:
            every: list[MultibodyError] = []
            for each in (error, *error.others):
                where = replace(each.where, path=tuple(path), column=None)
                number, word = each.number, each.word
                every.append(ModelError(each.message, where=where, number=number, word=word, meant=each.meant))
                every[-1].known = each.known
            raise join_errors(every) from None


def _later_names(system: System, path: Sequence[str]) -> dict[str, str]:
    """Return the names beside those of the motion that an expression at a path may use.

    Those of outputs; in a question those of answers, of extremes that it asks for itself, and of momenta.
    """
    outputs = dict.fromkeys(system.outputs, _OUTPUT)
    if path[0] != "ask":
        return outputs
    question = system.ask[path[1]]
    parts = [f"{name}.{axis}" for name, x in system.ask.items() if x.is_of_points for axis in AXES]
    extremes = () if question.so is None else question.so.extremes
    momenta = [f"{MOMENTUM}{q}" for q, _ in rate_names(system)] if question.is_of_phase_space else ()
    return outputs | dict.fromkeys((*system.ask, *parts, *extremes), _ANSWER) | dict.fromkeys(momenta, "a momentum")


def verify_curves(system: System, names: Mapping[str, str]) -> None:
    """Raise ModelError where the parameter of a curve has the name of something else than a coordinate."""
    for path, node, _ in _declared_expressions(system):
        if node.shadow is not None:
            continue
        for leaf in leaves([node], "quantity"):
            name = leaf.data[1][0] if leaf.data[0] == PARAMETER else ""
            if name in RESERVED or names.get(name, "a coordinate") != "a coordinate":
                what = names.get(name, "reserved")
                error = ModelError(
                    f"{name!r} is {what} of the model and the parameter of this curve; rename one", number="M108"
                )
                raise ModelError(error.message, where=replace(error.where, path=path, column=None), number=error.number)


def _may_name(system: System, path: Sequence[str]) -> tuple[str, ...]:
    if _is_of_mass(path) and system.bodies[path[1]].varying is not None:
        return _MAY_NAME["forces"] if path[-2].endswith("_velocity") else _VARIES_WITH
    if path[0] == "states" and path[-1] == "initial":
        return _ONLY_PARAMETERS
    allowed = _MAY_NAME.get(_MOTION if _is_driven(path) else path[0], _ONLY_PARAMETERS)
    of_speeds = path[0] == "constraints" and isinstance(system.constraints[path[1]], VelocityConstraint)
    return (*allowed, "a speed", _STATE) if of_speeds else allowed


_VARIES_WITH: Final = ("a parameter", "a coordinate", "the time")
_MASS_HINT: Final = (
    "; a mass that varies says how what leaves or joins moves, and com and inertia vary with it only: "
    "mass: {value: m0 - k*t, relative_velocity: [-c, 0, 0]}"
)


def _is_of_mass(path: Sequence[str]) -> bool:
    """Return whether an expression is of a body's mass, centre of mass, inertia, or its shape's sizes."""
    return path[0] == "bodies" and path[2] in ("mass", "com", "inertia", "shape")


def _is_driven(path: Sequence[str]) -> bool:
    """Return whether an expression at a path prescribes a motion: of a joint, of ground, along a curve."""
    return path[2:3] == (_MOTION,) or (path[0] in ("joints", "constraints") and "curve" in path[2:])


def _declared_expressions(system: System) -> Iterator[Written]:
    """Yield the expressions of a system where they are declared: those of feet stand with their curves too."""
    feet = {name for name, joint in system.joints.items() if isinstance(joint, Foot)}
    yield from (each for each in expressions(system) if each.path[0] != "joints" or each.path[1] not in feet)


_CONSTANTS: Final = {"e": "exp(1)", "E": "exp(1)", "PI": "pi", "Pi": "pi"}


def _verify_leaves(
    node: Node, allowed: tuple[str, ...], names: Mapping[str, str], own: str | None, hint: str = ""
) -> None:
    """Raise ModelError where the value of `own` (None: it has no name) names something that it may not."""
    for leaf in leaves([node], "symbol"):
        if leaf.data not in names:
            fitting = [name for name, what in names.items() if what in allowed and name != own]
            none = f"; here an expression names {_plurals(allowed)} only, and there is none that fits"
            told, word = f"{leaf.data!r} is not declared", leaf.data
            if meant := _CONSTANTS.get(word):
                raise ModelError(f"{told}; did you mean {meant}?", number="M107", word=word, meant=meant)
            if word in QUANTITIES:
                form = f"{word}({', '.join(QUANTITIES[word].arguments)})"
                raise ModelError(f"{told}; did you mean {form}?", number="M107", word=word, meant=form)
            # a name such as phi_dot or dphi means a speed
            stems = (word.removesuffix("dot").removesuffix("_"), word.removeprefix("d"), word.removeprefix("v_"))
            if speed := next((f"u_{x}" for x in stems if x != word and f"u_{x}" in names), ""):
                raise ModelError(f"{told}; did you mean {speed}, the speed?", number="M107", word=word, meant=speed)
            raise ModelError(told if fitting else told + none, number="M107", word=word, known=fitting)
        if names[leaf.data] not in allowed:
            may = f"here an expression names {_plurals(allowed)} only"
            varies = hint if allowed == _ONLY_PARAMETERS and names[leaf.data] in _VARIES_WITH else ""
            raise ModelError(f"{leaf.data!r} is {names[leaf.data]}; {may}{varies}", number="M113")


def _vocabulary(system: System) -> dict[str, list[str]]:
    """Return the names that each kind of argument of a quantity may be."""
    bodies = {GROUND: BARE, **system.bodies}
    points = [*bodies, *(f"{name}.{p}" for name, b in bodies.items() for p in (*b.points, *b.frames, *OWN_POINTS))]
    pulling = {name for name, element in system.constraints.items() if isinstance(element, (Rope, Distance))}
    tensions = {
        name: tension_names(system, name) if isinstance(element, Rope) else row_names(name, element)
        for name, element in system.constraints.items()
    }
    varying = {name: body for name, body in system.bodies.items() if body.varying is not None}
    declared = (system.forces, system.constraints, contact_names(system.contacts), system.joints, varying)
    freedoms = [
        x for name, joint in system.joints.items() for x in (*coordinate_names(name, joint), *speed_names(name, joint))
    ]
    return {
        "point": points,
        "body": list(bodies),
        "frame": [*bodies, *(f"{name}.{frame}" for name, body in bodies.items() for frame in body.frames)],
        "rope": [x for name, names in tensions.items() if name in pulling for x in names],
        "axis": list(AXES), "element": list(QUATERNION),
        "coordinate": [q for q, _ in rate_names(system)],
        "moving": [
            *(q for q, _ in rate_names(system)),
            *(speed for name, joint in system.joints.items() for speed in speed_names(name, joint)),
            *system.states,
        ],
        # of momenta, energies, powers and impulses
        "whole": [SYSTEM, *system.bodies],
        "about": [OWN_CENTRE, *points],
        "store": [SYSTEM, *system.bodies, *system.forces],
        "exerting": [WEIGHT, *(name for section in declared for name in section if "#" not in name)],
        "freedom": freedoms,
    }


def _asked_quantities(node: Node) -> list[Node]:
    return [leaf for leaf in leaves([node], "quantity") if leaf.data[0] in QUANTITIES]


def _verify_quantity(leaf: Node, section: str, vocabulary: Mapping[str, list[str]]) -> None:
    function = leaf.data[0]
    if section not in _MAY_ASK:
        name = f"u_{leaf.data[1][0]}"
        speed = f"; here the speed is {name}" if function == "'" and name in vocabulary["freedom"] else ""
        raise ModelError(f"{text(leaf)} can be asked in outputs, stop and ask only{speed}", number="M112")
    if function in ("reaction", "multiplier"):  # see verify_forces
        return
    if not QUANTITIES[function].of_mode:
        _verify_arguments(leaf, vocabulary)
        return
    if section != "ask":
        raise ModelError(f"{text(leaf)} is one of small oscillations: it can be asked in ask only", number="M110")
    if not leaf.data[1][0].isdecimal() or leaf.data[1][0] == "0":
        raise ModelError(f"{text(leaf)}: name a mode by its number; 1 has the lowest frequency", number="M112")


def _verify_arguments(leaf: Node, vocabulary: Mapping[str, Collection[str]]) -> None:
    """Raise ModelError where an argument of a quantity is no name of its kind."""
    function, arguments = leaf.data
    for kind, name in zip(QUANTITIES[function].taking(len(arguments)) or (), arguments, strict=True):
        if name not in vocabulary[kind]:
            runs = sum(kind == "rope" and known.startswith(f"{name}.") for known in vocabulary[kind])
            if runs:
                each = f"{function}({name}, 1) to {function}({name}, {runs})"
                raise ModelError(
                    f"{text(leaf)}: {name!r} has a tension on each side of wheels that turn with it; ask {each}",
                    number="M112",
                )
            what = _KINDS.get(kind, f"no {kind}")
            raise ModelError(f"{text(leaf)}: {name!r} is {what}", number="M106", word=name, known=vocabulary[kind])


def _adding_outputs(system: System) -> set[str]:
    """Return the names of outputs that add up along a run, or name one that does."""
    found = {name for name, node in system.outputs.items() if of_run(node)}
    while more := {
        name
        for name, node in system.outputs.items()
        if name not in found and any(leaf.data in found for leaf in leaves([node], "symbol"))
    }:
        found |= more
    return found


def _verify_adding(system: System, path: Sequence[str], node: Node, adds_up: Collection[str]) -> None:
    """Raise ModelError where a quantity that adds up along a run is asked for at an instant."""
    others = system.ask.keys() - {path[1]} if path[0] == "ask" else ()
    of_outputs = [x for x in leaves([node], "symbol") if x.data in adds_up and x.data not in others]
    adding = [*(x for x in _asked_quantities(node) if QUANTITIES[x.data[0]].of_run), *of_outputs]
    if path[0] == "outputs" or not adding:
        return
    if path[0] != "ask":
        raise ModelError(f"{adding[0]} adds up along a run: it can be asked in outputs and ask only", number="M112")
    question = system.ask[path[1]]
    later = path[2] == "value" and not (question.after is None and question.when is None)
    if not (later or path[2] in ("max", "min")):
        told = f"{{value: {adding[0]}, after: 1 s}}, {{value: {adding[0]}, when: ..}}, max or min"
        raise ModelError(f"{adding[0]} adds up along a run: ask for it at a later moment, {told}", number="M112")


def verify_forces(system: System, elements: Iterable[LawElement], cut: Iterable[str]) -> None:
    """Raise ModelError where an expression asks for a force of an element without one, or for a component it lacks.

    `cut`: the names of the rows that stand for cut joints, which have multipliers as those of constraints have.
    """
    # the elements that exert forces, by the names in expressions: their kind in words, and their components
    one_way = {
        name: (_EXERTING[x.kind], (*rows, *(AT if x.kind == "contact" else ())))
        for x in elements
        for name, rows in exerted_by(x).items()
    }
    ground = [GROUND] if ground_moves(system.bodies) else []
    pulleys = [name for name, pulley in system.pulleys.items() if pulley.is_held]
    joints = dict.fromkeys((*pulleys, *ground, *system.joints), ("a joint", COMPONENTS))
    wires = dict.fromkeys(
        (name for name, joint in system.joints.items() if joint.steps and joint.steps[0].curve is not None),
        ("a joint that guides along a curve", (*COMPONENTS, NORMAL)),
    )
    known = {**one_way, **joints, **wires}
    of_constraints = [
        row
        for name, element in system.constraints.items()
        for row in (run_names(system, name) if isinstance(element, Rope) else row_names(name, element))
    ]
    for written in expressions_in(system, _MAY_ASK):
        for leaf in _asked_quantities(written.node) if written.node.shadow is None else ():
            with at(*written.path):
                if leaf.data[0] == "reaction":
                    _verify_component(leaf, known, of_constraints)
                elif leaf.data[0] == "multiplier":
                    _verify_arguments(leaf, {"constraint": [*of_constraints, *cut]})


_EXERTING: Final = {"contact": "a contact", "stop": "a stop", "friction": "friction"}


def _verify_component(leaf: Node, known: Mapping[str, tuple[str, Sequence[str]]], rows: Sequence[str]) -> None:
    element, component = leaf.data[1]
    if element not in known:
        own = " and ".join(f"multiplier({row})" for row in rows if element in (row, row.partition(".")[0]))
        what = f"a constraint, which exerts {own}" if own else "no joint, contact, stop or friction"
        others = [] if own else list(known)
        raise ModelError(f"{text(leaf)}: {element!r} is {what}", number="M106", word=element, known=others)
    what, components = known[element]
    if component not in FORCE_NAMES:
        message = f"{text(leaf)}: {component!r} is no component"
        meant = next((x for x in components if x == f"f{component}"), None)  # x of a reaction is a force, no moment
        raise ModelError(message, number="M106", word=component, known=list(components), meant=meant)
    if component not in components:
        raise ModelError(f"{text(leaf)}: {element!r} is {what}, which has {', '.join(components)}", number="M112")


def _plurals(words: tuple[str, ...]) -> str:
    return ", ".join(w if w == "the time" else w.removeprefix("a ").removeprefix("an ") + "s" for w in words)


# ----------------------------------------------------------------------------------------------------------------------
# Do questions under `ask` name what there is, and in which order are they answered?


_MEANT: Final = {"maximum": "max", "largest": "max", "minimum": "min", "least": "min", "period": "period_of"}
"""Words that are no keys of questions, and the keys that they mean."""
_UNDEFINED_AT_IMPACTS: Final = ("acceleration", "angular_acceleration", "power")
"""Quantities without a value while speeds jump."""
_TIME: Final = symbol("t")
_VALUE: Final = ("value",)
_MOVING: Final = (_VALUE, ("max",), ("min",), ("when",), ("at",), ("until",), ("formula",))
"""Where the expressions of questions stand that are looked at along the motion."""


def verify_questions(system: System, mechanism: Mechanism) -> None:
    """Raise ModelError, with its path, at the first question that names nothing in a mechanism.

    So for questions that name each other in a circle, and those of an impact that have no answer at its instant.
    """
    dimensions = Dimensions(system)
    for name, question in system.ask.items():
        with at("ask", name):
            for key, word, known in _names_by_key(system, mechanism, question):
                if word not in known:
                    with at(key):
                        kind = _kind_of_source(question) if key == "of" else _ASKED_KINDS[key]
                        raise ModelError(f"no {kind} is called {word!r}", number="M106", word=word, known=[*known])
            for key in ("when", "at", "until"):
                if (moment := getattr(question, key)) is not None:
                    with at(key):
                        _verify_moment(mechanism, moment)
            if question.so is not None:
                with at("so"):
                    dimensions.verify_sides(question.so)
            timed = question.after is not None and _TIME in leaves([question.after], "symbol")
            if timed and "t" not in named_by(question, system.ask, mechanism.symbols):
                with at("after"):
                    raise ModelError("t is the time, which is 0 at the start; write which: 2 s", number="M112")
    taken, needed = {*mechanism.symbols, *map(symbol, system.outputs)}, dict[str, set[str]]()
    if system.impact is not None:
        _verify_about_impact(system.ask, taken)
    for name in in_order(system.ask, taken):
        named = named_by(system.ask[name], system.ask, taken)
        needed[name] = named.union(*(needed[x] for x in named))
        if system.ask[name].so is not None and any(system.ask[x].find is not None for x in needed[name]):
            with at("ask", name), at("so"):
                raise ModelError("it hangs on what is found itself; find one value after the other", number="M112")


_ASKED_KINDS: Final = {
    "section": "body or frame",
    "find": "parameter, coordinate or speed",
    "in": "parameter, coordinate or speed",
    "let": "parameter, coordinate or speed",
    "formula": "coordinate or speed",
    **dict.fromkeys(("period_of", "advance", "action"), "coordinate"),
    **dict.fromkeys((*FORCED, "decrement"), "coordinate"),
    "velocity": "point or body",
    "acceleration": "point or body",
    **dict.fromkeys(("instant_center", "principal_axes"), "body"),
}
"""The kinds of names under the keys of questions."""


def _kind_of_source(question: Ask) -> str:
    """Return the kind of the name under `of`."""
    if _is_forced(question):
        return "input"
    if question.advance is not None:
        return "coordinate"
    return "body" if question.formula is None else "coordinate or speed"


def _is_forced(question: Ask) -> bool:
    """Return whether a question is about the steady motion under an input."""
    return any(getattr(question, key) is not None for key in FORCED)


def _names_by_key(system: System, mechanism: Mechanism, question: Ask) -> Iterator[tuple[str, str, Collection[str]]]:
    """Yield the keys under which a question names something, the names there, and those that exist."""
    moving = [*(c.name for c in mechanism.coordinates), *(s.name for s in mechanism.speeds)]
    coordinates = [c.name for c in mechanism.coordinates if c.rate is None]
    for key in ("decrement", "damping"):
        if getattr(question, key) is not None and key in coordinates:
            message = f"{key} is a coordinate here: for the time at which it has a value write {{when: {{{key}: ..}}}}"
            raise ModelError(message, number="M104")
    rates = [mechanism.coordinates[q].name for body in mechanism.bodies for q, _ in body.rate_pairs]
    kinds = {(*FORCED, "decrement"): coordinates, ("period_of", "action"): rates, ("instant_center",): [*system.bodies]}
    for keys, known in kinds.items():
        yield from ((key, x, known) for key in keys if (x := getattr(question, key)) is not None)
    points = {key: getattr(question, key) for key in ("velocity", "acceleration")}
    if question.of is not None and _is_forced(question):
        yield "of", question.of, [*system.inputs]
    elif question.formula is not None or question.advance is not None:
        named = coordinates if question.formula is None else moving
        yield from ((key, word, named) for key, word in (("advance", question.advance), ("of", question.of)) if word)
    else:
        points = {"of": question.of, **points}
    for key, point in points.items():
        if point is not None and point not in mechanism.markers:
            own = [f"{body}.{x}" for body in system.bodies for x in OWN_POINTS]
            yield key, point, (*mechanism.markers, *(own if point in own else ()))
    bodies = [name for name in system.bodies if name != GROUND]
    yield from (("principal_axes", body, bodies) for body in question.principal_axes or ())
    if question.section is not None:
        frames = (f"{name}.{frame}" for name, body in system.bodies.items() for frame in body.frames)
        yield "section", question.section, [*bodies, *frames]
    varied = {"find": question.find, "in": question.in_, "let": None if question.let is None else question.let.name}
    for key, name in varied.items():
        if name is not None:
            yield key, name, (*system.parameters, *moving, *([str(_TIME.data)] if key == "let" else ()))
    if question.formula is not None and question.of is None:
        yield "formula", text(question.formula), moving


def _verify_moment(mechanism: Mechanism, moment: Moment) -> None:
    if isinstance(moment, StateCondition):
        moment.verify(possible_words(mechanism.one_way))
    elif isinstance(moment, Mapping):
        quaternions = {k for body in mechanism.bodies for places in body.quaternions for k in places}
        names = [c.name for k, c in enumerate(mechanism.coordinates) if k not in quaternions and c.rate is None]
        pairs = [pair for body in mechanism.bodies for pair in body.rate_pairs]
        speeds = {mechanism.speeds[u].name: mechanism.coordinates[q].name for q, u in pairs}
        for coordinate in moment:
            if coordinate not in names:
                meant = _MEANT.get(coordinate) or next(iter(get_close_matches(coordinate, fields_of(Ask), n=1)), None)
                hint = f"; of what questions begin with, did you mean {meant}?" if meant else ""
                if any(c.name == coordinate for c in mechanism.coordinates):
                    hint = f"; of a state or quaternion write a condition: {coordinate} > .."
                if coordinate in speeds:
                    hint = (
                        f": it is the speed of {speeds[coordinate]}, whose moments conditions name, when: "
                        f"{coordinate} < 0 or when: {coordinate} > 0"
                    )
                if coordinate == "t":
                    hint = "; a time stands under after: 2 s, and the start needs no moment"
                message = f"no coordinate is called {coordinate!r}{hint}"
                raise ModelError(message, number="M106", word=coordinate, known=() if hint else names)


def just_after(questions: Mapping[str, Ask], taken: Collection[Node]) -> list[str]:
    """Return the questions about the instant of an impact, in the order in which they name each other.

    These are expressions at no later moment that name no answer about the motion after it.
    """
    found: list[str] = []
    for name in in_order(questions, taken):
        named = named_by(questions[name], questions, taken)
        if _value_at_once(questions[name]) is not None and named.issubset(found):
            found.append(name)
    return found


def _value_at_once(question: Ask) -> Node | None:
    """Return the expression that is asked for at no later moment; None for other questions."""
    return question.value if question.when is None and question.after is None else None


def _verify_about_impact(questions: Mapping[str, Ask], taken: Collection[Node]) -> None:
    """Raise ModelError where a question has no answer at an impact, or about the motion after it."""
    at_impact = just_after(questions, taken)
    for name, question in questions.items():
        with at("ask", name):
            value = _value_at_once(question)
            asked = [] if value is None else leaves([value], "quantity")
            impulses = [leaf for leaf in asked if leaf.data[0] in IMPULSES]
            if name in at_impact:
                for leaf in asked:
                    if QUANTITIES[leaf.data[0]].of_mode:
                        raise ModelError(f"{leaf} is one of small oscillations; ask it without `impact`", number="M110")
                    if leaf.data[0] in _UNDEFINED_AT_IMPACTS:
                        message = f"{leaf.data[0]}(..) has no value in an impact, in which speeds jump"
                        raise ModelError(message, number="M121")
            elif question.find is not None:
                raise ModelError(
                    "a file with an `impact` answers no find; ask for the value itself and vary the parameter: "
                    f"--set {question.find}=..",
                    number="M121",
                )
            elif impulses:
                raise ModelError(
                    f"{impulses[0]} is an impulse here; ask for it alone, and name that answer beside the later ones",
                    number="M121",
                )


IMPULSES: Final = ("reaction", "tension", "multiplier")
"""Quantities that are impulses in an impact."""


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


def named_by(question: Ask, questions: Collection[str], taken: Collection[Node]) -> set[str]:
    """Return the names of answers that the expressions of a question name, which are no names of the model.

    Components, vB.x, belong to the answer vB. A `t` that is asked only at the start, where the time is 0, is an answer.
    """
    written = expressions(question)
    at_start = question.when is None and question.after is None
    moving = [x.node for x in written if x.path in _MOVING and not (at_start and x.path == _VALUE)]
    timed, named = _TIME in leaves(moving, "symbol"), leaves([x.node for x in written], "symbol")
    names = {str(leaf.data) for leaf in named if leaf not in taken or (leaf == _TIME and not timed)}
    return {x if x in questions else x.partition(".")[0] for x in names}.intersection(questions)
