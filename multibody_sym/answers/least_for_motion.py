"""The least forces that hold and that move, over all values of an angle, with their closed forms."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import field, replace
from typing import Any, Final

from multibody_sym.algebra.decimals import with_doubles
from multibody_sym.algebra.quotient_functions import exact
from multibody_sym.algebra.quotients import Field, NoClosedFormError, Quotient
from multibody_sym.algebra.solving.roots import linear_parts, rate, roots, written
from multibody_sym.analysis.rest.causes import causes
from multibody_sym.analysis.rest.least import Least, first_range, least_ends
from multibody_sym.analysis.rest.position import Position
from multibody_sym.answers.exact_rest import ExactEnd, fits, short_number
from multibody_sym.answers.range_of_rest import RestBound, bound_of, rest_position, unit_of, varied
from multibody_sym.dynamics.routes import verify_formalism
from multibody_sym.dynamics.start.examined import on_numbers
from multibody_sym.errors import ExpressionError, MultibodyError, NoSolutionError
from multibody_sym.expressions.printer import text
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.parameters import ParameterEntry, ParameterVector
from multibody_sym.model.resolution.changes import Changes
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import Node, as_node, symbol

_WORK: Final = 30_000
_NEAR: Final = 1e-4
_SETTLED: Final = 1e-11
_FLAT: Final = 1e-7
"""To which part a place is known where a value is least: to half the digits of values, some of which are lost."""
_NO_FORM: Final = (NoClosedFormError, ExpressionError, MultibodyError, *UNDEFINED)


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
    changed = Changes(parameters, initial, inputs, coordinates, project).of(system)
    verify_formalism(formalism)
    return _least_for_motion(changed, least, vary, formalism)


@on_numbers
def _least_for_motion(system: System, least: str, vary: str, formalism: str | None) -> LeastForMotion:
    position = rest_position(system, formalism)
    entry, other = varied(position.mechanism, least, "least"), varied(position.mechanism, vary)
    holding, moving = least_ends(position, entry.name, other.name)
    if moving is None:
        told = f"where rest is possible at a value of {vary}, it is so at every {least}: nothing moves it"
        raise NoSolutionError(told, number="N110")
    for found in (moving, holding):
        if found is not None and found.falls:
            raise NoSolutionError(_falling(found, entry, other), number="N110")
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


def _falling(found: Least, entry: ParameterEntry, other: ParameterEntry) -> str:
    value, at = f"{found.end.value:.6g} {unit_of(entry)}".strip(), f"{found.at:.6g} {unit_of(other)}".strip()
    return (
        f"the {found.least} {_ENDS[found.side]} has no least value over {found.vary}: it falls as far as was looked, "
        f"to {value} at {found.vary} = {at}; ask for its end at a {found.vary} of yours (vary {found.least} alone)"
    )


_ENDS: Final = ("that holds", "at which rest ends")


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
        there = _with_value(self.position.mechanism, self.found.vary, self.found.at)
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
            node = written(slope)
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
            for at in roots(slope, vary):
                if not fits(at, vary, self.found.at, sample):
                    continue
                found: Node | None = None
                with suppress(*_NO_FORM):
                    found = self.over_symbols(_with(written(value), vary, at), sample)
                fitting = found is not None and fits(found, least, self.found.end.value, sample)
                yield (with_doubles(found) if fitting and found is not None else None), with_doubles(at)

    def over_symbols(self, node: Node, sample: Mapping[Node, float]) -> Node:
        """Return an expression in its shortest form."""
        over = Field(_WORK)
        letters = {name: letter for name, letter in self.end.letters.items() if name in sample}
        return written(exact(over, [node], {name: over.letter(name, letter) for name, letter in letters.items()})[0])


def _with_value(mechanism: Mechanism, name: str, value: float) -> Mechanism:
    """Return the mechanism with another value of a parameter."""
    entries = tuple(
        replace(entry, value=as_node(value)) if entry.name == name else entry for entry in mechanism.parameters
    )
    return replace(mechanism, parameters=ParameterVector(entries))


def _with(node: Node, unknown: Node, value: Node) -> Node:
    """Return an expression with another one in place of a symbol."""
    return as_node(evaluate([node], lambda leaf: value if leaf is unknown else leaf)[0])


def _length(forms: Forms) -> tuple[int, int]:
    """Return how much of two forms is missing, and how long they are."""
    return sum(form is None for form in forms), sum(len(text(form)) for form in forms if form is not None)
