"""The dimensions of a system's expressions: one check for each of them, with all that the model tells of units.

Units are checked in models that give units to parameters or inputs. There coordinates and speeds have the units of
their joints and the time is in s; elsewhere a number may be in any unit.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cached_property
from typing import Final

from multibody_sym.errors import ExpressionError, ModelError, at
from multibody_sym.expressions.components import COMPONENTS
from multibody_sym.expressions.quantities import QUANTITIES, component_kind
from multibody_sym.expressions.units import DIMENSIONLESS, LENGTH, TIME, Dimension, Measured, given_in, measured
from multibody_sym.model.declaration.constraints import Coupler, Gear, PrescribedMotion
from multibody_sym.model.declaration.contacts import contact_names
from multibody_sym.model.declaration.curves.curve import PARAMETER
from multibody_sym.model.declaration.fields import Element
from multibody_sym.model.declaration.forces import Damper, SpringDamper, Torque
from multibody_sym.model.declaration.joint import MovingJoint
from multibody_sym.model.declaration.settings import Ask, Equation
from multibody_sym.model.declaration.system import System, Written
from multibody_sym.model.declaration.tables import Table, input_dimensions
from multibody_sym.model.declaration.values import dimension_of_unit
from multibody_sym.model.mechanism.one_way import PRESSING
from multibody_sym.model.resolution.spanning_tree import coordinate_names, speed_names
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node, as_node, symbol
from multibody_sym.scalars.traversal import leaves

_ALONG: Final = {"m": dimension_of_unit("N"), "rad": dimension_of_unit("N*m")}
"""What acts along a coordinate, by the coordinate's unit."""
_RATES: Final = {"'": 1, "''": 2}
_OWN: Final = {"span": LENGTH, "span_rate": LENGTH.times(TIME, -1), "place": LENGTH}
"""The dimensions of the names that a potential has of its own."""


@dataclass(frozen=True, eq=False)
class Dimensions:
    """What is known of the dimensions of a system's names and quantities."""

    system: System

    def verify(self, written: Written) -> None:
        """Raise ModelError or ExpressionError where an expression contradicts itself, or is in a wrong unit."""
        found, unit = measured(written.node, self.of_leaf), self._unit(written)
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
                    measured(self._tied(element), self.of_leaf)
        for name, given in self.system.inputs.items():
            if isinstance(given, Table):
                self._verify_table(name, given)

    def _verify_table(self, name: str, table: Table) -> None:
        """Raise ModelError where arguments of a table are in another unit than the expression that they belong to."""
        argument = self._followed(table.of, self.of_leaf)
        if argument is not None and argument.certain:
            with at("inputs", name):
                table.verify_arguments("" if argument.dimension == DIMENSIONLESS else str(argument.dimension))

    # --- names and quantities -------------------------------------------------------------------------------------

    def of_leaf(self, leaf: Node) -> Measured | None:
        """Return what is known of a name or quantity."""
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
        """Return what is known of a quantity whose dimension depends on what is asked: of reactions and rates."""
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
        """Return what is known of a name; one that is an expression of others has the dimension of that."""
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
        """Return what is known of an expression, nothing of one that contradicts itself, which is refused elsewhere."""
        try:
            return measured(node, of_leaf)
        except ExpressionError:
            return None

    def _of_known(self, leaf: Node) -> Measured | None:
        return self._known.get(leaf.data) if leaf.op == "symbol" else self.of_leaf(leaf)

    @cached_property
    def _known(self) -> dict[str, Measured | None]:
        """What is known of names; those of expressions follow when they are asked for."""
        found: dict[str, Measured | None] = {}
        if self._gives_units:
            found["t"] = Measured(TIME)
            found |= {x: Measured(dimension_of_unit(unit)) for x, unit in self._units_of_motion.items()}
        return found | {name: given_in(dimension) for name, dimension in self._given.items()}

    @cached_property
    def _given(self) -> dict[str, Dimension]:
        """The dimensions of parameters and inputs that the model gives."""
        stated = {name: x.dimension for name, x in self.system.parameters.items()}
        found = {name: dimension for name, dimension in stated.items() if dimension is not None}
        return found | input_dimensions(self.system.inputs)

    @cached_property
    def _gives_units(self) -> bool:
        """Whether the model gives units, other than those of angles, so that motion and time have units too."""
        return any(dimension != DIMENSIONLESS for dimension in self._given.values())

    @cached_property
    def _contacts(self) -> Collection[str]:
        """The names of contacts, those that repeat among them."""
        return contact_names(self.system.contacts).keys() - self.system.joints.keys()

    @cached_property
    def _expressions(self) -> dict[str, Node]:
        """The names that are expressions of others: parameters, inputs, outputs; a coordinate's name stands for it."""
        parameters = {name: x.value for name, x in self.system.parameters.items()}
        inputs = {name: x for name, x in self.system.inputs.items() if isinstance(x, Node)}
        found = {**self.system.outputs, **inputs, **parameters}
        others = (*self._given, *self._units_of_motion)
        return {name: node for name, node in found.items() if node.shadow is None and name not in others}

    def verify_sides(self, given: Equation, of_answers: Mapping[Node, Measured | None] | None = None) -> None:
        """Raise ModelError where the sides of an equation are certain to be in different units."""
        known = of_answers or {}

        def of_leaf(leaf: Node) -> Measured | None:
            return known[leaf] if leaf in known else self.of_leaf(leaf)

        sides = (given.left, given.left_unit), (given.right, given.right_unit)
        left, right = (
            measured(x, of_leaf) if unit is None else given_in(dimension_of_unit(unit)) for x, unit in sides
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
        if section == "parameters" and path[0] in self._given:
            return str(self._given[path[0]])
        own = self._of_elements.get((section, path[0]))
        if own is not None:
            return own.get(path[1])
        joint = self.system.joints[path[0]] if section == "joints" else None
        return joint.unit_at(path[1:]) if isinstance(joint, MovingJoint) else None

    @cached_property
    def _of_elements(self) -> dict[tuple[str, str], Mapping[str, str]]:
        """The units of those fields of forces, constraints and questions that depend on others, by element."""
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
        """The unit of each coordinate and speed of a joint."""
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
        found = {}
        for key in ("when", "at", "until"):
            moment = getattr(question, key)
            for name in moment if isinstance(moment, Mapping) else ():
                if name in self._units_of_motion:
                    found[key] = self._units_of_motion[name]
        if question.between is not None and question.find in self._given:
            found["between"] = str(self._given[question.find])
        elif question.between is not None and question.find in self._units_of_motion:
            found["between"] = self._units_of_motion[question.find]
        return found

    def _tied(self, element: Gear | Coupler) -> Node:
        """Return what stays zero where joints are tied to each other."""
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
