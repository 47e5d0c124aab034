"""Units that people choose to read, such as `mm,deg`: the factor and the text of each in place of an SI unit."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Final, NamedTuple

from multibody_sym.errors import ArgumentError, ExpressionError, InputError, shown
from multibody_sym.expressions.held_digits import MOST, held
from multibody_sym.records import dataclass

if TYPE_CHECKING:  # SI needs none of it
    from multibody_sym.expressions.known_units import Kind
    from multibody_sym.scalars.node import Node

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
        from multibody_sym.expressions.known_units import kind_of

        return self.chosen.get(kind_of(unit)) or self._followed(unit)

    def _followed(self, unit: str) -> _Choice:
        """Return the unit made of chosen ones in place of each of its parts."""
        from multibody_sym.expressions.known_units import kind_of
        from multibody_sym.scalars.node import ONE

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
    from multibody_sym.expressions.known_units import PURE, kind_of
    from multibody_sym.expressions.units import UNITS, parse_unit

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
