"""Values: numbers with their closed forms and units."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from multibody_sym.errors import ArgumentError, ExpressionError, InputError, shown
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node
from multibody_sym.text.printer import text

if TYPE_CHECKING:
    from multibody_sym.text.units import Kind


# ----------------------------------------------------------------------------------------------------------------------
# Numbers as text, with the digits that hold.


MOST: Final = 10
"""Digits that are printed of a number without error."""


def held(number: float, error: float = 0.0, most: int = MOST) -> str:
    """Return a number that is off by at most `error` as text, right to half a unit of its last place.

    So many digits, at most `most`, are printed as both ends of number +- error round to alike, but one at least; a
    number within its error of 0 is 0.
    """
    if not error > 0.0:
        return f"{number:.{most}g}"
    if abs(number) <= error:
        return "0"
    low, high = number - error, number + error
    digits = next((n for n in range(most, 0, -1) if f"{low:.{n - 1}e}" == f"{high:.{n - 1}e}"), 1)
    return f"{number:.{digits}g}"


# ----------------------------------------------------------------------------------------------------------------------
# Units that people choose to read, such as `mm,deg`: the factor and the text of each in place of an SI unit.


_PART: Final = re.compile(r"([*/]?)([A-Za-z]+|1)(?:\^\(?([-0-9/]+)\)?)?")


class _Choice(NamedTuple):
    """A chosen unit as it was typed, and its factor to SI; None is one."""

    text: str
    factor: Node | None


@dataclass(frozen=True, eq=False)
class Units:
    """The units in which quantities are told; those that were not chosen stay SI.

    Others follow: with mm and deg speeds are told in mm/s and deg/s, moments in N*mm.
    """

    chosen: Mapping[Kind, _Choice] = field(default_factory=dict)

    def of(self, unit: str) -> str:
        """Return the unit in which what is in an SI unit is told."""
        return self._told(unit).text

    def value(self, number: float, unit: str) -> float:
        """Return a number in an SI unit in the chosen unit."""
        return number / self.size(unit)

    def size(self, unit: str) -> float:
        """Return how large the unit is in which what is in an SI unit is told, in that."""
        factor = self._told(unit).factor
        size = 1.0 if factor is None else factor.shadow
        assert size is not None
        return size

    def said(self, number: float, unit: str, digits: int = MOST, error: float = 0.0) -> str:
        """Return a number in an SI unit, off by at most `error`, as text in the chosen unit."""
        size = self.size(unit)
        return f"{held(number / size, error / size, digits)} {self.of(unit)}".rstrip()

    def named(self, name: str, unit: str) -> str:
        """Return a name with the chosen unit in brackets."""
        return f"{name} [{self.of(unit)}]" if unit else name

    @cached_property
    def _known(self) -> dict[str, _Choice]:
        return {}

    def _told(self, unit: str) -> _Choice:
        if unit not in self._known:
            self._known[unit] = self._found(unit)
        return self._known[unit]

    def _found(self, unit: str) -> _Choice:
        if not unit or not self.chosen:
            return _Choice(unit, None)
        from multibody_sym.text.units import kind_of

        return self.chosen.get(kind_of(unit)) or self._followed(unit)

    def _followed(self, unit: str) -> _Choice:
        """Return the unit made of chosen ones in place of each of its parts."""
        from multibody_sym.scalars.node import ONE
        from multibody_sym.text.units import kind_of

        factor, above, below = ONE, list[str](), list[str]()
        for part, exponent in _parts(unit):
            choice = self.chosen.get(kind_of(part))
            simple = choice is not None and choice.text.isalpha()
            name, size = choice if choice is not None and simple else (part, None)
            factor = factor if size is None else factor * size**exponent
            (above if exponent > 0 else below).append(_raised(name, abs(exponent)))
        return _Choice("/".join(["*".join(above) or "1", *below]), factor)


SI: Final = Units()


def chosen_units(units: str | Sequence[str] | Units | None) -> Units:
    """Return the units of a text such as `mm,deg,kN` or of a list of such names; None chooses none.

    Raises InputError for what is no unit, and for two units of one quantity.
    """
    if units is None:
        return SI
    if isinstance(units, Units):
        return units
    words = units.split(",") if isinstance(units, str) else units
    if not isinstance(words, (list, tuple)) or not all(isinstance(word, str) for word in words):
        raise ArgumentError(f"units: expected a text such as 'mm,deg', got {shown(units)}")
    chosen: dict[Kind, _Choice] = {}
    for word in map(str.strip, words):
        kind, choice = _choice(word)
        if kind in chosen and chosen[kind] != choice:
            raise InputError(
                f"{chosen[kind].text} and {word} are units of one quantity; choose one of them", number="U102"
            )
        chosen[kind] = choice
    return Units(chosen)


def _choice(word: str) -> tuple[Kind, _Choice]:
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


def _parts(unit: str) -> Iterator[tuple[str, Fraction]]:
    """Yield the parts of an SI unit as `Dimension` prints it, each with its exponent."""
    for sign, name, exponent in _PART.findall(unit):
        if name != "1":
            yield name, Fraction(exponent or 1) * (-1 if sign == "/" else 1)


def _raised(name: str, exponent: Fraction) -> str:
    if exponent == 1:
        return name
    return f"{name}^{exponent}" if exponent.denominator == 1 else f"{name}^({exponent})"


# ----------------------------------------------------------------------------------------------------------------------

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
