"""Values: numbers with their closed forms and units."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from multibody_sym.errors import ArgumentError, ExpressionError, InputError, short_repr
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node
from multibody_sym.text.printer import power_text, text

if TYPE_CHECKING:
    from multibody_sym.text.units import Kind


# ----------------------------------------------------------------------------------------------------------------------
# Numbers as text, with their reliable digits.


DIGITS: Final = 6
"""Digits that commands print of a number, unless others are asked for."""
MOST: Final = 10
"""Digits of a number without error in other texts, as `str` of a value."""


def number_within(number: float, error: float = 0.0, most: int = MOST) -> str:
    """Return a number with an error of at most `error` as text, right to half a unit of its last place.

    It has the digits, at most `most` and at least one, to which both ends of number +- error round alike; a number
    within its error of 0 is 0.
    """
    if not error > 0.0:
        return f"{number:.{most}g}"
    if abs(number) <= error:
        return "0"
    low, high = number - error, number + error
    digits = next((n for n in range(most, 0, -1) if f"{low:.{n - 1}e}" == f"{high:.{n - 1}e}"), 1)
    return f"{number:.{digits}g}"


_DECIMAL: Final = re.compile(r"-?[0-9.]+(e[-+]?[0-9]+)?")


def with_formula(formula: str, number: str) -> str:
    """Return `formula = number`, and the number alone where the formula is one too, or empty."""
    return number if not formula or _DECIMAL.fullmatch(formula) else f"{formula} = {number}"


class Quantity(NamedTuple):
    """A number in an SI unit, empty for a pure number, off by at most `error`."""

    number: float
    unit: str
    error: float = 0.0


# ----------------------------------------------------------------------------------------------------------------------
# How people choose to read numbers: digits, and units such as `mm,deg` with the factor and text of each.


_PART: Final = re.compile(r"([*/]?)([A-Za-z]+|1)(?:\^\(?(-?[0-9]+(?:/[0-9]+(?=\)))?)\)?)?")


class _Choice(NamedTuple):
    """A chosen unit as it was typed, and its factor to SI; None is one."""

    text: str
    factor: Node | None


@dataclass(frozen=True, eq=False)
class Units:
    """The chosen units for quantities; others stay SI, or follow: with mm and deg speeds are in mm/s and deg/s.

    Numbers have at most so many `digits`. Where no unit of angles is chosen these are in rad, as `angles` say: alone,
    in degrees (`deg`), or with degrees beside (`both`).
    """

    chosen: Mapping[Kind, _Choice] = field(default_factory=dict)
    digits: int = DIGITS
    angles: str = ""

    def of(self, unit: str) -> str:
        """Return the display unit of quantities in an SI unit."""
        return self._choice(unit).text

    def value(self, number: float, unit: str) -> float:
        """Return a number in an SI unit as one in the display unit."""
        return number / self.size(unit)

    def size(self, unit: str) -> float:
        """Return the size of the display unit in an SI unit."""
        factor = self._choice(unit).factor
        size = 1.0 if factor is None else factor.shadow
        assert size is not None
        return size

    def said(self, number: float, unit: str, error: float = 0.0, digits: int | None = None) -> str:
        """Return a number in an SI unit, off by at most `error`, as text in the chosen unit; `digits`: fewer."""
        size, most = self.size(unit), self.digits if digits is None else min(digits, self.digits)
        if unit == "rad" and self.angles and self.of(unit) == unit:
            degrees = f"{number_within(number * _DEGREES, error * _DEGREES, most)} deg"
            if self.angles == "deg":
                return degrees
            plain = number_within(number, error, most)
            return f"{plain} rad" if float(plain) == 0.0 else f"{plain} rad ({degrees})"
        return f"{number_within(number / size, error / size, most)} {self.of(unit)}".rstrip()

    def named(self, name: str, unit: str) -> str:
        """Return a name with the chosen unit in brackets."""
        return f"{name} [{self.of(unit)}]" if unit else name

    @cached_property
    def _known(self) -> dict[str, _Choice]:
        return {}

    def _choice(self, unit: str) -> _Choice:
        if unit not in self._known:
            self._known[unit] = self._choose(unit) if unit and self.chosen else _Choice(unit, None)
        return self._known[unit]

    def _choose(self, unit: str) -> _Choice:
        """Return the chosen unit for an SI unit, or the one made of chosen units for its parts."""
        from multibody_sym.scalars.node import ONE
        from multibody_sym.text.units import kind_of

        if (chosen := self.chosen.get(kind_of(unit))) is not None:
            return chosen
        factor, above, below = ONE, list[str](), list[str]()
        for sign, part, digits in _PART.findall(unit):
            if part == "1":
                continue
            exponent = Fraction(digits or 1) * (-1 if sign == "/" else 1)
            choice = self.chosen.get(kind_of(part))
            name, size = choice if choice is not None and choice.text.isalpha() else (part, None)
            factor = factor if size is None else factor * size**exponent
            (above if exponent > 0 else below).append(power_text(name, abs(exponent)))
        return _Choice("/".join(["*".join(above) or "1", *below]), factor)


_DEGREES: Final = 180.0 / math.pi
SI: Final = Units()
_LONG: Final = Units(digits=MOST)


def chosen_units(units: str | Sequence[str] | Units | None) -> Units:
    """Return the units of a text such as `mm,deg,kN` or of a list of such names; None chooses none.

    Raises InputError for a word that is no unit, and for two units of one quantity.
    """
    if units is None:
        return SI
    if isinstance(units, Units):
        return units
    words = units.split(",") if isinstance(units, str) else units
    if not isinstance(words, (list, tuple)) or not all(isinstance(word, str) for word in words):
        raise ArgumentError(f"units: expected a text such as 'mm,deg', got {short_repr(units)}")
    chosen: dict[Kind, _Choice] = {}
    for word in map(str.strip, words):
        kind, choice = _read_choice(word)
        if kind in chosen and chosen[kind] != choice:
            raise InputError(
                f"{chosen[kind].text} and {word} are units of one quantity; choose one of them", number="U102"
            )
        chosen[kind] = choice
    return Units(chosen)


def _read_choice(word: str) -> tuple[Kind, _Choice]:
    from multibody_sym.text.units import PURE, UNITS, kind_of, parse_unit

    known = ", ".join(UNITS)
    if not word:
        raise InputError(f"write units with commas between them, such as mm,deg; known: {known}", number="U102")
    try:
        kind, factor = kind_of(word), parse_unit(word)[0]
    except ExpressionError as error:
        raise InputError(f"{error.message}; known: {known}", number="U102") from None
    if kind == PURE:
        raise InputError(f"{word!r} is a pure number, which has no other unit; known: {known}", number="U102")
    return kind, _Choice(word, factor)


# ----------------------------------------------------------------------------------------------------------------------

@dataclass(frozen=True)
class Value:
    """A number (SI; None for none) and its closed form in the names of the model (None: numbers only).

    It is not `unique` where constraints are redundant and other values serve as well: then there is no number, except
    the one of least norm where it was asked for and is possible. `unit` is empty for pure numbers and unknown units.
    `t` is the time in s of a value at one moment of a motion. The number has at most the error `error`, the time
    `t_error`; 0 is an error below the printed digits.
    """

    value: float | None
    expression: Node | None = None
    unit: str = ""
    unique: bool = True
    t: float | None = None
    error: float = 0.0
    t_error: float = 0.0

    def __str__(self) -> str:
        """Return `formula = number unit`, without a formula that is that number; the number with up to ten digits."""
        return self.told(_LONG)

    def told(self, units: Units = SI) -> str:
        """Return the same with the number in chosen units and its reliable digits; numeric formulas are in SI units."""
        number = "unknown" if self.value is None else units.said(self.value, self.unit, error=self.error)
        if not self.unique:
            return "not unique" if self.value is None else f"{number} (of least norm, not unique)"
        formula = self._formula(units)
        if formula and self.value is None:
            return formula
        when = "" if self.t is None else f" at t = {units.said(self.t, 's', error=self.t_error)}"
        return with_formula(formula, number) + when

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
