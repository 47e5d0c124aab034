"""Which SI units have the results of a mechanism? Empty where one is not known.

Coordinates and speeds have theirs by their joints; what expressions are worth follows from the units that parameters
were declared with. A row's multiplier times the derivative of the row by a coordinate is a force on that coordinate.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field, replace
from functools import cached_property
from typing import Final

from multibody_sym.mechanics.law_elements import exerted_by
from multibody_sym.mechanics.mechanism import NORMAL, Mechanism
from multibody_sym.mechanics.row_records import Row
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import tangents
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import ONE, Node
from multibody_sym.text.parser import component_kind, quantity_known
from multibody_sym.text.printer import COMPONENTS
from multibody_sym.text.units import (
    DIMENSIONLESS,
    ENERGY,
    MASS,
    PURE,
    TIME,
    Dimension,
    InferredUnit,
    Kind,
    Turning,
    infer_units,
    kind_of,
)

REACTION_UNITS: Final[Mapping[str, str]] = {name: component_kind(name).unit for name in (*COMPONENTS, NORMAL)}
"""The unit of each component of a joint's reaction."""
_WITHOUT_ANGLE: Final = (MASS, TIME)


@dataclass(frozen=True, eq=False)
class MechanismUnits:
    """The units of a mechanism's quantities by their names, as texts that `parse_unit` reads."""

    mechanism: Mechanism
    answers: Mapping[str, str] = field(default_factory=dict)
    """The units of answers that expressions may name."""

    @cached_property
    def state(self) -> dict[str, str]:
        """Of each coordinate and speed, measured ones too; a quaternion's is empty."""
        relative = {} if self.mechanism.relative is None else self._declared.state
        symbols = ((name, node) for name, node in self.mechanism.symbols.items() if name.op == "symbol")
        named = {name.data: node for name, node in symbols if node.op != "slot"}
        measured = {name: node for name, node in named.items() if name not in relative}
        found = dict(zip(measured, map(_unit, infer_units(measured.values(), self._leaf)), strict=True))
        coordinates = {c.name: c.unit for c in self.mechanism.coordinates}
        return {**found, **relative, **coordinates, **{s.name: s.unit for s in self.mechanism.speeds}}

    @property
    def accelerations(self) -> dict[str, str]:
        return self.mechanism.rate_units

    @cached_property
    def inputs(self) -> dict[str, str]:
        return dict(zip(self._declared.mechanism.inputs, map(_unit, self._declared._inputs), strict=True))

    @cached_property
    def outputs(self) -> dict[str, str]:
        """Of each output, measured coordinates among them; empty for those that are withheld."""
        asked, untold = self._declared.mechanism, self.mechanism.untold
        declared = {**asked.outputs, **asked.run_outputs}
        found = dict(zip(declared, self.of(declared.values()), strict=True))
        measured = {name: self.state[name] for name in self.mechanism.outputs if name not in found}
        return {**measured, **found, **dict.fromkeys(untold, "")}

    @cached_property
    def parameters(self) -> dict[str, str]:
        entries = self.mechanism.parameters
        return {entry.name: _unit(x) for entry, x in zip(entries, self._parameters, strict=True)}

    @cached_property
    def multipliers(self) -> dict[str, str]:
        return {row.name: _unit(self._multiplier(row)) for row in self.mechanism.rows}

    def of(self, nodes: Iterable[Node]) -> list[str]:
        """Return the unit of each expression, in slots or in the names of the model."""
        return [_unit(x) for x in infer_units(nodes, self._declared._leaf)]

    # --- what is known of leaves ----------------------------------------------------------------------------------

    @cached_property
    def _declared(self) -> MechanismUnits:
        """The units in coordinates of joints, in which expressions are declared."""
        return self if self.mechanism.relative is None else MechanismUnits(self.mechanism.relative, self.answers)

    def _leaf(self, leaf: Node) -> InferredUnit | None:
        leaf = self.mechanism.symbols.get(leaf, leaf)
        if leaf.op == "symbol" and self.answers.get(str(leaf.data)):
            kind = kind_of(self.answers[str(leaf.data)])
            return InferredUnit(kind, firm=kind.angle != 1)  # 30*w/pi is in turns a minute
        if leaf.op == "quantity":
            function, arguments = leaf.data
            if function in ("'", "''", "generalized_momentum"):
                return self._of_speed(function, arguments[0])
            if arguments in self._exerted:
                return self._of_alone(self._exerted[arguments])
            return quantity_known(function, arguments) or self._named_multiplier(arguments)
        return self._slot(*leaf.data) if leaf.op == "slot" else None

    def _of_speed(self, function: str, freedom: str) -> InferredUnit | None:
        """Return the unit of the rate of a freedom, or of its momentum, an energy divided by a speed."""
        place = self.mechanism.speed_place(freedom)
        unit = "" if place is None else self.mechanism.speeds[place].unit
        if not unit:
            return None
        if function == "generalized_momentum":
            return InferredUnit(Kind(ENERGY.times(kind_of(unit).dimension, -1), angle=None), firm=True)
        return InferredUnit(kind_of(f"{unit}^2"))

    def _slot(self, array: str, index: int) -> InferredUnit | None:
        if array == "parameters":
            return self._parameters[index]
        if array == "inputs":
            return self._inputs[index]
        if array == "t":
            return InferredUnit(Kind(TIME), doubtful=True)  # 2*t may be any force that grows
        if array == "q" and self.mechanism.coordinates[index].rate is not None:
            unit = self.mechanism.coordinates[index].unit
            return InferredUnit(kind_of(unit), firm=True) if unit else None
        return InferredUnit(self._moved[array][index])

    @cached_property
    def _moved(self) -> dict[str, list[Kind]]:
        return {
            "q": [kind_of(coordinate.unit) for coordinate in self.mechanism.coordinates],
            "u": [kind_of(speed.unit) for speed in self.mechanism.speeds],
        }

    @cached_property
    def _parameters(self) -> list[InferredUnit | None]:
        """The unit of each parameter, as far as known; an expression of others has theirs."""
        entries, found = self.mechanism.parameters, dict[int, InferredUnit | None]()

        def of_slot(leaf: Node) -> InferredUnit | None:
            return found.get(leaf.data[1]) if leaf.op == "slot" else None

        for k in range(len(entries)):
            stack = [k]
            while stack:
                value = entries[stack[-1]].value
                named = [] if value is None else [leaf.data[1] for leaf in leaves([value], "slot")]
                missing = [j for j in named if j not in found and j not in stack]
                if missing:
                    stack.append(missing[0])
                else:
                    place = stack.pop()
                    entry = entries[place]
                    if entry.dimension is not None:
                        found[place] = _of_dimension(entry.dimension)
                    elif entry.value is not None:
                        (found[place],) = infer_units([entry.value], of_slot)
                    else:
                        found[place] = None if entry.measure is None else InferredUnit(kind_of(entry.measure.unit))
        return [found[k] for k in range(len(entries))]

    @cached_property
    def _inputs(self) -> list[InferredUnit | None]:
        """The unit of each input, as far as known: it may be a force given by motion or time and a plain number."""
        given = self.mechanism.input_dimensions
        found = zip(self.mechanism.inputs, infer_units(self.mechanism.inputs.values(), self._leaf), strict=True)
        firm = ((name, x if x is not None and x.firm else None) for name, x in found)
        return [_of_dimension(given[name]) if name in given else x for name, x in firm]

    @cached_property
    def _exerted(self) -> dict[tuple[str, ...], Row]:
        """The rows of the forces of elements with laws, by name and component."""
        pairs = (pair for element in self.mechanism.one_way for pair in exerted_by(element).items())
        return {(name, component): rows[0] for name, parts in pairs for component, rows in parts.items()}

    def _of_alone(self, row: Row) -> InferredUnit | None:
        """Return the unit of the force of a row that acts in some modes."""
        return MechanismUnits(replace(self.mechanism, rows=(row,)))._multiplier(row)

    # --- multipliers ----------------------------------------------------------------------------------------------

    def _named_multiplier(self, arguments: tuple[str, ...]) -> InferredUnit | None:
        rows = [row for row in self.mechanism.rows if row.name == arguments[0]]
        return self._multiplier(rows[0]) if rows else None

    def _multiplier(self, row: Row) -> InferredUnit | None:
        """Return the unit of a row's multiplier: that of its kind, or of its expression."""
        if row.unit is not None:
            return InferredUnit(kind_of(row.unit)._replace(angle=None), firm=True)
        return self._declared._of_expression(row.name)

    def _of_expression(self, name: str) -> InferredUnit | None:
        """Return work / (q d(zero)/dq) for a coordinate q, power / (u d(zero)/du) for a row of speeds.

        Coordinates that stand alone in it are asked first: a number beside others may carry a unit that nobody wrote.
        """
        row = next(row for row in self.mechanism.rows if row.name == name)
        assert row.expression is not None
        found = self._by_slopes(row.expression, "q" if row.is_holonomic else "u")
        alone = {dimension for slope, dimension in found if slope.shadow is not None}
        told = alone or {dimension for _, dimension in found}
        return InferredUnit(Kind(told.pop(), angle=None), firm=True) if len(told) == 1 else None

    def _by_slopes(self, zero: Node, array: str) -> list[tuple[Node, Dimension]]:
        """Return slopes of a row that are 1, -1 or known expressions, each with the multiplier's dimension by it."""
        named = [leaf for leaf in leaves([zero], "slot") if leaf.data[0] == array]
        moved = [(leaf, self._moved[array][leaf.data[1]]) for leaf in named]
        slopes = [tangents([zero], {leaf: ONE})[0] for leaf, _ in moved]
        work = ENERGY if array == "q" else ENERGY.times(TIME, -1)
        found = []
        for (_, kind), slope, by_slope in zip(moved, slopes, infer_units(slopes, self._leaf), strict=True):
            unit_slope = slope.shadow is not None and abs(slope.shadow) == 1.0
            dimension = DIMENSIONLESS if unit_slope else by_slope and by_slope.kind.dimension
            if dimension is not None and kind != PURE:
                found.append((slope, work.times(kind.dimension, -1).times(dimension, -1)))
        return found


def _of_dimension(declared: Dimension) -> InferredUnit:
    mass, length, time = declared
    angular = declared == DIMENSIONLESS or isinstance(declared, Turning)
    angle = 1 if angular else 0 if declared in _WITHOUT_ANGLE else None
    firm = bool(mass or length or time > 0)  # an angle or 1/s may be in other units after all: 180/pi, turns
    return InferredUnit(Kind(declared, angle), firm)


def _unit(found: InferredUnit | None) -> str:
    return "" if found is None else found.kind.unit
