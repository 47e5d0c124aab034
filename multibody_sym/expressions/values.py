"""Values: numbers with their closed forms and units."""

from __future__ import annotations

import math
from typing import Any

from multibody_sym.expressions.chosen_units import SI, Units
from multibody_sym.expressions.held_digits import held
from multibody_sym.expressions.printer import text
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.traversal import leaves


@dataclass(frozen=True)
class Value:
    """A number (SI; None where there is none) and its closed form in the names of the model (None: numbers only).

    It is not `unique` where constraints depend on each other and other values would serve as well: then there is none,
    but for that of least norm where this was asked for and is possible. `unit` is empty for pure numbers and where it
    is not known. `t` is the time in s at which it is reached, where it is that of one moment of a motion. The number is
    known to within `error`, the time to within `t_error`; 0 is an error that no printed digit shows.
    """

    value: float | None
    expression: Node | None = None
    unit: str = ""
    unique: bool = True
    t: float | None = None
    error: float = 0.0
    t_error: float = 0.0

    def __str__(self) -> str:
        """Return `formula = number unit`, without the formula where there is none or it is that number."""
        return self.told()

    def told(self, units: Units = SI) -> str:
        """Return the same with the number in chosen units; a formula of numbers alone is one in SI units.

        Of the number the digits are there that hold within its error.
        """
        number = "unknown" if self.value is None else units.said(self.value, self.unit, error=self.error)
        if not self.unique:
            return "not unique" if self.value is None else f"{number} (of least norm, not unique)"
        formula = self._formula(units)
        if formula and self.value is None:
            return formula
        when = "" if self.t is None else f" at t = {units.said(self.t, 's', error=self.t_error)}"
        return number + when if formula in ("", self.digits) else f"{formula} = {number}{when}"

    @property
    def digits(self) -> str:
        """The number (SI) as text, with the digits that hold."""
        return held(self.value or 0.0, self.error)

    def _formula(self, units: Units) -> str:
        if self.expression is None:
            return ""
        fits = units.of(self.unit) == self.unit or leaves([self.expression], "symbol")
        return text(self.expression) if fits else ""

    def as_json(self) -> dict[str, Any]:
        """Return the object that `--json` prints."""
        number = self.value if self.value is not None and math.isfinite(self.value) else None
        expression = None if self.expression is None else text(self.expression)
        when = {} if self.t is None else {"t": self.t}
        error = {"error": self.error} if self.error else {}
        return {"value": number, "expression": expression, "unit": self.unit, **error, **when}
