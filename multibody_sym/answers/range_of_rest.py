"""Ranges of rest: all values of a parameter at which a system can stay at rest, with exact ends and what gives way."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any, Final

from multibody_sym.analysis.rest.causes import causes
from multibody_sym.analysis.rest.open_ends import open_end
from multibody_sym.analysis.rest.position import Position
from multibody_sym.analysis.rest.ranges import Ranges, ranges_of_rest
from multibody_sym.analysis.rest.rest_ends import RestEnd
from multibody_sym.answers.exact_rest import ExactEnd
from multibody_sym.dynamics.routes import verify_formalism
from multibody_sym.dynamics.start.examined import examined, on_numbers
from multibody_sym.dynamics.start.start import start
from multibody_sym.errors import ArgumentError, ModelError, NoSolutionError, Where, at, shown
from multibody_sym.expressions.printer import text
from multibody_sym.kinematics.masses.rates import verify_kept
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.parameters import ParameterEntry, Source
from multibody_sym.model.resolution.changes import Changes
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node

Names = tuple[str, ...]


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

    `searched`: from where to where values were looked at, None without bound, a whole turn for angles. Rest is
    possible: some forces that contacts, ropes and friction can exert are in balance; where friction is indeterminate
    others may be too. Where it is so at no value, `gives_way` says what does at the declared one.
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

    Speeds of the start are left out. What depends on the parameter moves with it: positions, masses, forces,
    coefficients. `parameters` .. `project`: what the call changes of the system (`Changes`); `formalism`: by whose
    equations forces balance. Raises InputError, and NoSolutionError where there is no start.
    """
    changed = Changes(parameters, initial, inputs, coordinates, project).of(system)
    verify_formalism(formalism)
    return _range_of_rest(changed, vary, formalism)


@on_numbers
def _range_of_rest(system: System, vary: str, formalism: str | None) -> RangeOfRest:
    position = rest_position(system, formalism)
    entry = varied(position.mechanism, vary)
    found = ranges_of_rest(position, entry.name)
    low, high = (None if math.isinf(x) else x for x in found.searched)
    return RangeOfRest(
        entry.name,
        tuple((rest_bound(position, found, a, -1), rest_bound(position, found, b, 1)) for a, b in found.ranges),
        (low, high),
        {c.name: x for c, x in zip(position.mechanism.coordinates, position.begin.q, strict=True)},
        "rad" if found.kind == "angle" else unit_of(entry),
        {c.name: c.unit for c in position.mechanism.coordinates},
        _given_way(position, found),
    )


def _given_way(position: Position, found: Ranges) -> Names:
    """Return what gives way where rest is possible at no value."""
    if not found.against:
        return () if found.against is None else (_LOOSE,)
    return causes(position.statics, found.against, position.motion({}, moves=False))


def rest_position(system: System, formalism: str | None) -> Position:
    """Return the declared position of a system, in coordinates of its joints."""
    declared = examined(system)
    verify_kept(declared)
    resolved = declared.relative or declared
    position = Position(resolved, start(resolved, project=system.simulation.project), formalism)
    _verify_still(position)
    return position


def _verify_still(position: Position) -> None:
    """Raise NoSolutionError where a prescribed motion carries along what would rest, so that speeds of 0 are none."""
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


def varied(mechanism: Mechanism, name: object, option: str = "vary") -> ParameterEntry:
    """Return the entry of a declared parameter. Raises InputError for another name."""
    entries = {entry.name: entry for entry in mechanism.parameters if entry.source is Source.DECLARED}
    with at(option):
        if not isinstance(name, str):
            raise ArgumentError(f"expected the name of a parameter, got {shown(name)}")
        if name not in entries:
            raise ModelError(f"there is no parameter {name!r}", number="M106", word=name, known=entries)
    return entries[name]


def unit_of(entry: ParameterEntry) -> str:
    """Return the unit of a parameter in SI, empty for pure numbers and where it is not known."""
    unit = "" if entry.dimension is None else str(entry.dimension)
    return "" if unit == _PURE else unit


_PURE: Final = "1"
_LOOSE: Final = "nothing holds it"
_ASIDE: Final = 1e-6
"""How far beyond an end (of its size, 1 at least) is looked why it is one."""
_SETTLED: Final = 1e-11
"""To which part of it an end without closed form is found."""
_STILL: Final = 1e-9
"""The speed (m/s) and acceleration (m/s^2) of a row at rest that are none."""


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
