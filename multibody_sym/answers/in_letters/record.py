"""What a letter in a formula stands for."""

from __future__ import annotations

from typing import Any

from multibody_sym.expressions.chosen_units import SI, Units
from multibody_sym.expressions.printer import text
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node


@dataclass(frozen=True)
class Definition:
    """A letter that formulas name: its `value` (SI), and what gives it.

    That is an `expression` in parameters and other letters, or an `equation` (left side, right side) that it satisfies,
    with others where they follow from several together. Neither is there for what is told among accelerations as a
    number. `says`: what it is, in words.
    """

    value: float
    expression: Node | None = None
    equation: tuple[Node, Node] | None = None
    unit: str = ""
    says: str = ""

    @property
    def formula(self) -> str:
        """The expression or equation as text; empty where there is neither."""
        if self.expression is not None:
            return text(self.expression)
        return "" if self.equation is None else " = ".join(map(text, self.equation))

    def told(self, units: Units = SI) -> str:
        """Return what follows the letter, for people: `= formula = number unit`, or where an equation gives it."""
        number = units.said(self.value, self.unit)
        if self.equation is not None and self.expression is None:
            return f"= {number}, from {self.formula}"
        return f"= {self.formula} = {number}" if self.formula not in ("", f"{self.value:.10g}") else f"= {number}"

    def as_json(self) -> dict[str, Any]:
        """Return the object that `--json` prints."""
        equation = None if self.expression is not None or self.equation is None else self.formula
        expression = None if self.expression is None else self.formula
        found = {"value": self.value, "expression": expression, "equation": equation, "unit": self.unit}
        return {**found, "says": self.says}
