"""Ranges of rest: all values of a parameter at which a system can stay at rest, with exact ends and what gives way.

In: a System and names of parameters. Out: RangeOfRest, LeastForMotion.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import field, replace
from typing import Any, Final

from multibody_sym.algebra.book_form import with_doubles
from multibody_sym.algebra.quotient_functions import exact
from multibody_sym.algebra.quotients import Field, NoClosedFormError, Quotient
from multibody_sym.algebra.roots import linear_parts, put_in_place, rate, roots, shortest_node
from multibody_sym.analysis.rest.ends import ExactEnd, fits, open_end, short_number, with_value
from multibody_sym.analysis.rest.ranges import Least, Ranges, RestSearch, causes, first_range, least_ends
from multibody_sym.analysis.rest.statics import Position, RestEnd, start_at_rest
from multibody_sym.derivation.routes import verify_formalism
from multibody_sym.dynamics.start.number_checks import check_numbers, on_numbers
from multibody_sym.errors import (
    ArgumentError,
    ExpressionError,
    ModelError,
    MultibodyError,
    NoSolutionError,
    Where,
    at,
    short_repr,
)
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.forces import verify_kept
from multibody_sym.mechanics.mechanism import Mechanism, ParameterEntry, Source, verify_without_states
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.text.printer import text

Names = tuple[str, ...]
_PURE: Final = "1"
_LOOSE: Final = "nothing holds it"
_ASIDE: Final = 1e-6
"""How far beyond an end (of its size, 1 at least) the reason for the end is sought."""
_SETTLED: Final = 1e-11
"""To which part of it an end without closed form is found."""
_STILL: Final = 1e-9
"""The speed (m/s) and acceleration (m/s^2) of a row at rest that are none."""
_WORK: Final = 30_000
_NEAR: Final = 1e-4
_FLAT: Final = 1e-7
"""To which part a place is known where a value is least: to half the digits of values, some of which are lost."""
_NO_FORM: Final = (NoClosedFormError, ExpressionError, MultibodyError, *UNDEFINED)
_ENDS: Final = ("that holds", "at which rest ends")


@dataclass(frozen=True)
class RestBound:
    """An end of a range of rest: its `value` (SI; None where the range has no end there), and what `gives_way` beyond.

    `expression` is its closed form in the names of the model, `exact` the same with all declared numbers put in; None
    where none was found. Where there is no position beyond, as bodies would cross, `gives_way` says so; nothing gives
    way where the range ends with the values that were looked at. The value is known to within `error`; that of a closed
    form has none. An end that is `open` does not belong to the range: towards it forces grow without bound, or the
    model has no start there.
    """

    value: float | None
    expression: Node | None = None
    exact: Node | None = None
    gives_way: tuple[str, ...] = ()
    error: float = 0.0
    open: bool = False

    def as_json(self) -> dict[str, Any]:
        """Return the object that `--json` prints."""
        return {
            "value": self.value,
            "expression": None if self.expression is None else text(self.expression),
            "exact": None if self.exact is None else text(self.exact),
            "gives_way": list(self.gives_way),
            **({"error": self.error} if self.error else {}),
            **({"open": True} if self.open else {}),
        }


@dataclass(frozen=True)
class RangeOfRest:
    """The values of a `parameter` (of a `unit`) at which rest is possible in the declared position: `ends` of ranges.

    `searched`: the interval of values that were tried, None without bound, a whole turn for angles. Rest is possible:
    some forces that contacts, ropes and friction can exert are in balance; where friction is indeterminate others may
    be too. Where rest is possible at no value, `gives_way` says what gives way at the declared one.
    """

    parameter: str
    ends: tuple[tuple[RestBound, RestBound], ...]
    searched: tuple[float | None, float | None]
    position: Mapping[str, float] = field(default_factory=dict)
    unit: str = ""
    units: Mapping[str, str] = field(default_factory=dict)
    gives_way: tuple[str, ...] = ()

    @property
    def rest(self) -> list[tuple[float | None, float | None]]:
        """The ranges as pairs of numbers (SI), ascending; None where a range has no end."""
        return [(low.value, high.value) for low, high in self.ends]

    def as_json(self) -> dict[str, Any]:
        """Return the object that `equilibrium --vary --json` prints."""
        return {
            "parameter": self.parameter,
            "rest": [list(pair) for pair in self.rest],
            "ends": [[low.as_json(), high.as_json()] for low, high in self.ends],
            "searched": list(self.searched),
            "position": dict(self.position),
            "unit": self.unit,
            "units": dict(self.units),
            **({"gives_way": list(self.gives_way)} if self.gives_way else {}),
        }


def range_of_rest(
    system: System,
    vary: str,
    *,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    formalism: str | None = None,
) -> RangeOfRest:
    """Return all values of the parameter `vary` at which rest is possible in the declared position, at t = 0.

    Speeds of the start are ignored. Positions, masses, forces and coefficients follow the parameter.
    `parameters` to `project` change the system for this call. `formalism` selects the equations of balance.
    Raises InputError, and NoSolutionError where there is no start.
    """
    changed = Overrides(parameters, initial, inputs, coordinates, project).of(system)
    verify_formalism(formalism)
    return _range_of_rest(changed, vary, formalism)


@on_numbers
def _range_of_rest(system: System, vary: str, formalism: str | None) -> RangeOfRest:
    position = rest_position(system, formalism)
    entry = varied_parameter(position.mechanism, vary)
    found = RestSearch(position, entry.name, {}).found()
    gives_way: Names = ()
    if found.against is not None:
        still = position.motion({}, moves=False)
        gives_way = causes(position.statics, found.against, still) if found.against else (_LOOSE,)
    low, high = (None if math.isinf(x) else x for x in found.searched)
    return RangeOfRest(
        entry.name,
        tuple((rest_bound(position, found, a, -1), rest_bound(position, found, b, 1)) for a, b in found.ranges),
        (low, high),
        {c.name: x for c, x in zip(position.mechanism.coordinates, position.begin.q, strict=True)},
        "rad" if found.kind == "angle" else unit_of(entry),
        {c.name: c.unit for c in position.mechanism.coordinates},
        gives_way,
    )


def rest_position(system: System, formalism: str | None) -> Position:
    """Return the declared position of a system, in coordinates of its joints.

    Raises NoSolutionError where a prescribed motion carries elements along, so that speeds of 0 are no rest.
    """
    declared = check_numbers(system)
    verify_kept(declared)
    verify_without_states(declared, "a range of rest is one of forces alone; equilibrium finds the state too")
    resolved = declared.relative or declared
    position = Position(resolved, start_at_rest(resolved, project=system.simulation.project), formalism)
    moved = position.moved({}, moves=False)
    rows = None if moved is None else position.rows(*moved)
    for k, row in enumerate(rows or ()):
        if row.kinematic and max(abs(float(row.phidot)), abs(float(row.gamma))) > _STILL and any(row.forces):
            whole = position.statics.mechanism
            raise NoSolutionError(
                f"{whole.rows[k].name} is carried along by a prescribed motion, and what it holds cannot rest; for "
                "rest beside what moves let the joint's parent be that body",
                where=Where(path=whole.row_path(k)),
                number="N110",
            )
    return position


def varied_parameter(mechanism: Mechanism, name: object, option: str = "vary") -> ParameterEntry:
    """Return the entry of a declared parameter. Raises InputError for another name."""
    entries = {entry.name: entry for entry in mechanism.parameters if entry.source is Source.DECLARED}
    with at(option):
        if not isinstance(name, str):
            raise ArgumentError(f"expected the name of a parameter, got {short_repr(name)}")
        if name not in entries:
            raise ModelError(f"there is no parameter {name!r}", number="M106", word=name, known=entries)
    return entries[name]


def unit_of(entry: ParameterEntry) -> str:
    """Return the unit of a parameter in SI, empty for pure numbers and where it is not known."""
    unit = "" if entry.dimension is None else str(entry.dimension)
    return "" if unit == _PURE else unit


def rest_bound(position: Position, found: Ranges, end: RestEnd, outward: int) -> RestBound:
    """Return an end for people: in closed form where there is one, and what gives way by name; `outward`: which end."""
    if math.isinf(end.value):
        return RestBound(None)
    if not (end.equal or end.limits):
        why = _no_position(position, found, end.value, outward)
        return RestBound(end.value + 0.0, gives_way=why, error=_SETTLED * abs(end.value) if why else 0.0)
    exact = ExactEnd(position.mechanism, found.parameter, end)
    motion = position.motion({found.parameter: end.value}, moves=True)
    named = causes(position.statics, end.limits, motion)
    if not position.has_start({found.parameter: end.value}):
        return RestBound(end.value + 0.0, gives_way=named, error=_SETTLED * abs(end.value), open=True)
    forms = exact.symbolic(), exact.exact()
    pole = open_end(position, found.parameter, end, outward) if forms == (None, None) else None
    value, error = pole or (end.value, _SETTLED * abs(end.value))
    return replace(bound_of(value, forms, exact.sample, named, error), open=pole is not None)


def bound_of(
    value: float, forms: tuple[Node | None, Node | None], sample: Mapping[Node, float], gives_way: Names, error: float
) -> RestBound:
    """Return a bound with the value of its closed form; one without has an `error`."""
    for form in forms:
        if form is not None:
            return RestBound(evaluate_float([form], sample)[0] + 0.0, *forms, gives_way)
    return RestBound(value + 0.0, gives_way=gives_way, error=error)


def _no_position(position: Position, found: Ranges, end: float, outward: int) -> tuple[str, ...]:
    """Return why there is no position beyond an end where forces do not contradict; none where the search ends."""
    beyond = end + outward * _ASIDE * max(abs(end), 1.0)
    if not found.searched[0] <= beyond <= found.searched[1]:
        return ()
    entry = next(entry for entry in position.mechanism.parameters if entry.name == found.parameter)
    if entry.positive and beyond <= 0.0:
        return (f"{entry.name} is declared positive",)
    motion = position.motion({entry.name: beyond}, moves=True)
    if motion is None:
        return ("there is no such position beyond",)
    place = position.crossing(motion)
    return () if place is None else (f"bodies would cross at {place}",)


# --- the least forces that hold and that move, over all values of an angle, with their closed forms ------------------


@dataclass(frozen=True)
class LeastForMotion:
    """The least value of a parameter (`least`, of a `unit`) at which rest ends, over all values of another (`vary`).

    `value` and what gives way there, `at` the other's value (of `vary_unit`), each with its closed form where there is
    one. `holds`, `holds_at`: the least value at which rest is possible, and the other's value; None where 0 holds.
    """

    least: str
    vary: str
    value: RestBound
    at: RestBound
    unit: str = ""
    vary_unit: str = ""
    position: Mapping[str, float] = field(default_factory=dict)
    holds: RestBound | None = None
    holds_at: RestBound | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the object that `equilibrium --least --json` prints."""
        return {
            "parameter": self.vary,
            "least": {"parameter": self.least, **self.value.as_json()},
            "at": self.at.as_json(),
            "holds": None if self.holds is None else self.holds.as_json(),
            "holds_at": None if self.holds_at is None else self.holds_at.as_json(),
            "unit": self.unit,
            "vary_unit": self.vary_unit,
            "position": dict(self.position),
        }


def least_for_motion(
    system: System,
    least: str,
    vary: str,
    *,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    formalism: str | None = None,
) -> LeastForMotion:
    """Return the least value >= 0 of the parameter `least` at which rest ends, over all values of `vary`.

    Where 0 does not hold, also the least value that does. Both are parameters, such as a force and its angle. Otherwise
    as `range_of_rest`. Raises InputError, and NoSolutionError where nothing holds, where rest never ends, or where an
    end falls as far as was looked.
    """
    changed = Overrides(parameters, initial, inputs, coordinates, project).of(system)
    verify_formalism(formalism)
    return _least_for_motion(changed, least, vary, formalism)


@on_numbers
def _least_for_motion(system: System, least: str, vary: str, formalism: str | None) -> LeastForMotion:
    position = rest_position(system, formalism)
    entry, other = varied_parameter(position.mechanism, least, "least"), varied_parameter(position.mechanism, vary)
    holding, moving = least_ends(position, entry.name, other.name)
    if moving is None:
        told = f"where rest is possible at a value of {vary}, it is so at every {least}: nothing moves it"
        raise NoSolutionError(told, number="N110")
    for found in (moving, holding):
        if found is not None and found.falls:
            last = f"{found.end.value:.6g} {unit_of(entry)}".strip()
            place = f"{found.at:.6g} {unit_of(other)}".strip()
            raise NoSolutionError(
                f"the {found.least} {_ENDS[found.side]} has no least value over {found.vary}: it falls as far as was "
                f"looked, to {last} at {found.vary} = {place}; ask for its end at a {found.vary} of yours (vary "
                f"{found.least} alone)",
                number="N110",
            )
    value, at = _bounds(position, moving)
    holds, holds_at = (None, None) if holding is None else _bounds(position, holding)
    return LeastForMotion(
        least,
        vary,
        value,
        at,
        unit_of(entry),
        "rad" if moving.kind == "angle" else unit_of(other),
        {c.name: x for c, x in zip(position.mechanism.coordinates, position.begin.q, strict=True)},
        holds,
        holds_at,
    )


def _bounds(position: Position, found: Least) -> tuple[RestBound, RestBound]:
    """Return a least value and its place for people: with closed forms, and what gives way."""
    exact, is_sharp, forms = _Exact(position, found).forms()
    found = exact.found
    motion = position.motion({found.least: found.end.value, found.vary: found.at}, moves=True)
    gives_way = causes(position.statics, found.end.limits, motion) if found.end.equal or found.end.limits else ()
    sample = exact.end.sample
    error, aside = _SETTLED * abs(found.end.value), (_SETTLED if is_sharp else _FLAT) * max(abs(found.at), 1.0)
    return (
        bound_of(found.end.value, forms[0], sample, gives_way, error),
        bound_of(found.at, forms[1], sample, (), aside),
    )


Forms = tuple[Node | None, Node | None]
"""An expression in the names of the model, and an exact number."""


@dataclass(frozen=True)
class _Exact:
    """The least value in closed form: where A F + B = 0 limits F, F = -B / A is least where A' B = A B'."""

    position: Position
    found: Least

    def forms(self) -> tuple[_Exact, bool, tuple[Forms, Forms]]:
        """Return what was found with its place to the last bits, whether it is, and closed forms of value and place."""
        found = None
        with suppress(*_NO_FORM):
            found = self.sharpened()
        exact = self if found is None else _Exact(self.position, found)
        symbolic, numbers = (exact.closed(numbers=x) for x in (False, True))
        pairs = zip(symbolic, map(short_number, numbers), strict=True)
        value, at = tuple(pairs)
        return exact, found is not None, (value, at)

    @property
    def end(self) -> ExactEnd:
        """The end at the place where it is least."""
        there = with_value(self.position.mechanism, self.found.vary, self.found.at)
        return ExactEnd(there, self.found.least, self.found.end)

    def stationary(self, *, numbers: bool, expands: bool = False) -> Iterator[tuple[Quotient, Quotient]]:
        """Yield F = -B / A, and A' B - A B', which vanishes where F is least."""
        vary = symbol(self.found.vary)
        for equation in self.end.equations(numbers=numbers, kept=vary, expands=expands):
            for slope, constant in linear_parts(equation, symbol(self.found.least)):
                yield -(constant / slope), rate(slope, vary) * constant - slope * rate(constant, vary)

    def sharpened(self) -> Least | None:
        """Return the least value with its place as a root, which values near it tell to half as many digits only.

        None where no equation has that root.
        """
        from scipy.optimize import brentq

        found = self.found
        vary, sample = symbol(found.vary), self.end.sample
        for _, slope in self.stationary(numbers=False):
            node = shortest_node(slope)
            low, high = (found.at + side * _NEAR * max(1.0, abs(found.at)) for side in (-1, 1))

            def steepness(x: float, node: Node = node) -> float:
                return evaluate_float([node], {**sample, vary: x})[0]

            if steepness(low) * steepness(high) < 0.0:
                at = float(brentq(steepness, low, high, xtol=1e-300, rtol=8.9e-16))
                there = first_range(self.position, found.least, {found.vary: at})
                return None if there is None else replace(found, at=at, end=there[found.side])
        return None

    def closed(self, *, numbers: bool) -> Forms:
        """Return the least value and its place as expressions, None where none is found."""
        found: list[Forms] = []
        for expands in (True, False):
            with suppress(*_NO_FORM):
                found += self.candidates(numbers=numbers, expands=expands)
        return min(found, key=_length, default=(None, None))

    def candidates(self, *, numbers: bool, expands: bool) -> Iterator[Forms]:
        """Yield the least value and its place as expressions, of which the value may not be found."""
        vary, least, sample = symbol(self.found.vary), symbol(self.found.least), self.end.sample
        for value, slope in self.stationary(numbers=numbers, expands=expands):
            for place in roots(slope, vary):
                if not fits(place, vary, self.found.at, sample):
                    continue
                found: Node | None = None
                with suppress(*_NO_FORM):
                    found = self.over_symbols(put_in_place(shortest_node(value), vary, place), sample)
                fitting = found is not None and fits(found, least, self.found.end.value, sample)
                yield (with_doubles(found) if fitting and found is not None else None), with_doubles(place)

    def over_symbols(self, node: Node, sample: Mapping[Node, float]) -> Node:
        """Return an expression in its shortest form."""
        over = Field(_WORK)
        letters = {name: over.letter(name, letter) for name, letter in self.end.letters.items() if name in sample}
        return shortest_node(exact(over, [node], letters)[0])


def _length(forms: Forms) -> tuple[int, int]:
    """Return how much of two forms is missing, and how long they are."""
    return sum(form is None for form in forms), sum(len(text(form)) for form in forms if form is not None)
