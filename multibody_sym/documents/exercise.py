"""Which other numbers may an exercise have: round ones near the declared, for which the answer keeps its form?

In: a System and a seed. Out: the System with other parameters, and the same numbers in its description.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from decimal import Decimal
from random import Random
from typing import Any, Final

from multibody_sym.answers.solve import solve
from multibody_sym.errors import InputError, MultibodyError
from multibody_sym.mechanics.changes import with_values
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves

_TRIES: Final = 30
_LOWEST, _HIGHEST = Decimal("0.6"), Decimal("1.5")
"""The parts of a declared number between which others are."""
_STEPS: Final = tuple(map(Decimal, ("5", "1", "0.5", "0.1")))
"""What numbers are multiples of, in units of the declared number's last place: the first that leaves a choice."""
_FEWEST: Final = 4
_RIGHT_ANGLE: Final = Decimal(90)
_NUMBER: Final = re.compile(r"(-?\d+(?:\.\d+)?)(?: ?([A-Za-z1][\w/*^()-]*))?")


@dataclass(frozen=True)
class _Varied:
    """Parameters that are declared by one text, whose number and unit it is."""

    names: tuple[str, ...]
    number: Decimal
    unit: str

    def drawn(self, random: Random) -> Decimal:
        """Return another number, as round as the declared one as far as that leaves a choice."""
        last = Decimal(1).scaleb(int(self.number.as_tuple().exponent))
        steps = (part * last for part in _STEPS if part <= 1 or self.number % (part * last) == 0)
        return random.choice(next(x for x in map(self._between, steps) if len(x) >= _FEWEST))

    def _between(self, step: Decimal) -> list[Decimal]:
        low, high = sorted((self.number * _LOWEST / step, self.number * _HIGHEST / step))
        every = [k * step for k in range(-int(-low // 1), int(high // 1) + 1)]
        acute = self.unit == "deg" and abs(self.number) < _RIGHT_ANGLE
        return [x for x in every if x != self.number and x and not (acute and abs(x) >= _RIGHT_ANGLE)]

    def text(self, number: Decimal) -> str:
        return f"{number.normalize():f} {self.unit}".strip()

    def said(self, description: str, number: str) -> str:
        """Return a description with another number where it names this one: `6 kg`, `45 and 30 deg`, `mu = 0.1`."""
        old = rf"(?<![\d.]){re.escape(str(self.number))}"
        if self.unit:
            unit = re.escape(self.unit) + r"(?![\w/^])"
            return re.sub(rf"{old}(?=\s+{unit}|(?:,| and| or|,? to)\s+[\d.]+\s+{unit})", number, description)
        named = "|".join(map(re.escape, self.names))
        return re.sub(rf"\b({named}) = {old}(?![\d.]*\d)", rf"\1 = {number}", description)


def other_numbers(system: System, seed: int) -> System:
    """Return the system with other numbers of its parameters; the same for the same seed.

    Numbers of gravity and pure counts stay. Parameters declared by one text, such as two of `1 kg`, stay equal. The
    states of contacts, ropes and friction at the start stay as they are, so that the question keeps its answer's form.
    Raises InputError for a model without such parameters, and where no such numbers were found.
    """
    varied = _varied(system)
    if not varied:
        message = "no parameter has a number that may differ: declare the numbers of the exercise under parameters"
        raise InputError(message, number="M106")
    random, wanted = Random(seed), _kind(system)
    for _ in range(_TRIES):
        drawn = [(each, each.drawn(random)) for each in varied]
        try:
            changed = with_values(system, {name: each.text(x) for each, x in drawn for name in each.names})
            found = _kind(changed)
        except MultibodyError:
            continue
        if found == wanted:
            return replace(changed, description=_described(system.description, drawn))
    message = f"none of {_TRIES} sets of numbers leaves contacts and friction in the states of the declared ones"
    raise InputError(f"{message}; try another seed, or declare numbers farther from where a state ends", number="M106")


def _varied(system: System) -> list[_Varied]:
    falls = {leaf.data for leaf in leaves(system.gravity or (), "symbol")}
    texts: dict[tuple[Decimal, str], list[str]] = {}
    for name, parameter in system.parameters.items():
        given = parameter.given("value")
        typed = None if name in falls or isinstance(given, bool) else _NUMBER.fullmatch(_text_of(given))
        if typed is not None and Decimal(typed[1]) and (typed[2] or "." in typed[1]):
            texts.setdefault((Decimal(typed[1]), typed[2] or ""), []).append(name)
    return [_Varied(tuple(names), *key) for key, names in texts.items()]


def _text_of(given: Any) -> str:
    return str(given).strip() if isinstance(given, (str, int, float)) else ""


def _kind(system: System) -> Any:
    """Return in which states everything is at the start; None where there is no solution in numbers."""
    try:
        found = solve(system)
    except InputError:
        raise
    except MultibodyError:
        return None
    known = tuple(name for name, value in found.answers.items() if value.value is not None)
    struck = {} if found.impact is None else dict(found.impact.states)
    return dict(found.states), struck, found.verdict, known


def _described(description: str | None, drawn: Iterable[tuple[_Varied, Decimal]]) -> str | None:
    """Return a description in which all numbers change at once."""
    if description is None:
        return None
    marks = {}
    for k, (each, number) in enumerate(drawn):  # a number that was put in is not looked at again
        marks[f"\0{k}\0"] = f"{number.normalize():f}"
        description = each.said(description, f"\0{k}\0")
    for mark, told in marks.items():
        description = description.replace(mark, told)
    return description
