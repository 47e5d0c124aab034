"""The state that a question is about: the start, the position of rest beside it, or where some values are others."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import islice, takewhile
from math import inf, isfinite
from typing import Any, Final

from multibody_sym.analysis.none_found import none_found, stood
from multibody_sym.analysis.resting.closings import stands
from multibody_sym.analysis.resting.search import MOST, SECONDS, guesses, search_from
from multibody_sym.dynamics.start.assembly import NotClosedError
from multibody_sym.dynamics.start.start import Start, start_beside
from multibody_sym.dynamics.start.undefined import value_or_none
from multibody_sym.errors import ArgumentError, ModelError, NoSolutionError, Where, at, shown
from multibody_sym.model.declaration.doors import state_by_name
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import Coordinate, Mechanism, Speed
from multibody_sym.model.resolution.absolute import unknown_coordinate
from multibody_sym.model.resolution.changes import start_value
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.scalars.traversal import leaves

REST: Final = "equilibrium"


def begin_at(system: System, resolved: Mechanism, begin: Start, place: Any, formalism: str | None) -> Start:
    """Return the state at a `place` beside a start: None, the word "equilibrium", or values by name.

    `place` may be a run's `final` too. Named coordinates and speeds have these values, and constraints are closed
    around them. Parameters, and lengths of ropes, stay those of the start. Raises InputError with `at` in its path,
    NoSolutionError.
    """
    if place is None:
        return begin
    with at("at"):
        if place == REST:
            return start_beside(resolved, begin, _at_rest(resolved, rest_beside(resolved, begin, formalism).tolist()))
        if not isinstance(place, Mapping) or not all(isinstance(name, str) for name in place):
            wanted = f"the word {REST} or values by name, such as {{'phi': 0}}"
            raise ArgumentError(f"at is to be {wanted}, got {shown(place)}")
        values = _values(system, resolved, begin, state_by_name("at", place))
        _verify_whole(resolved, values)
        return _closed_around(resolved, begin, values)


def _closed_around(resolved: Mechanism, begin: Start, values: Mapping[str, float]) -> Start:
    try:
        return start_beside(resolved, begin, values)
    except NotClosedError as error:
        what = ".".join(error.where.path) or "the constraints"
        advice = "name fewer, or give others"
        raise NoSolutionError(f"no state with these values satisfies {what}; {advice}", number="N111") from error


@contextmanager
def told_of(place: Any) -> Iterator[None]:
    """Let errors say that there is no solution at a `place` that is asked for; without one they are of the start."""
    try:
        yield
    except NoSolutionError as error:
        if place is not None:
            error.where = Where(path=("at",))
        raise


def rest_beside(resolved: Mechanism, begin: Start, formalism: str | None) -> Floats:
    """Return the position of equilibrium that is found first from a start. Raises NoSolutionError."""
    until, search = time.process_time() + SECONDS, search_from(resolved, begin, formalism)
    around = islice(guesses(search.places, search.places.start), MOST)
    in_time = takewhile(lambda _: time.process_time() < until, around)
    reached = (search.reached(guess, -inf if number else until) for number, guess in enumerate(in_time))
    found = next((q for q in reached if q is not None and stands(search, q)), None)
    if found is None:
        late = time.process_time() > until
        tried = guesses(search.places, search.places.start)
        raise none_found(search.flow, search.rows, tried, in_time=late, one_way=stood(resolved))
    return found


def _at_rest(resolved: Mechanism, q: list[float]) -> dict[str, float]:
    names = (coordinate.name for coordinate in resolved.coordinates)
    return {**dict(zip(names, q, strict=True)), **{speed.name: 0.0 for speed in resolved.speeds}}


def _values(system: System, resolved: Mechanism, begin: Start, place: Mapping[str, Any]) -> dict[str, float]:
    """Return the values in numbers: expressions of parameters, or text with units."""
    declared: list[Coordinate | Speed] = [*resolved.coordinates, *resolved.speeds]
    units = {each.name: each.unit for each in declared}
    found = {}
    for name, value in place.items():
        with at(name):
            if name not in units:
                raise unknown_coordinate(name, system, units)
            node = start_value(value, units[name])
            if node is None:
                raise ModelError("it needs a value; what is not named keeps that of the start", number="M119")
            found[name] = number_asked(node, resolved, begin)
    return found


def number_asked(node: Node, resolved: Mechanism, begin: Start) -> float:
    """Return the finite value of an expression of parameters, which are those of the start. Raises ModelError."""
    entries = zip(resolved.parameters, begin.parameters, strict=True)
    known = {symbol(entry.name): x for entry, x in entries if entry.value is not None}
    for leaf in leaves([node], "symbol", "declared"):
        if leaf not in known:
            raise ModelError(f"{leaf} is no parameter; here an expression names parameters only", number="M106")
    number = value_or_none(node, known)
    if number is None or not isfinite(number):
        raise ModelError("the expression has no finite value", number="M119")
    return number


def _verify_whole(resolved: Mechanism, values: Mapping[str, float]) -> None:
    """Raise ModelError for a part of a quaternion."""
    for places in (places for body in resolved.bodies for places in body.quaternions):
        names = [resolved.coordinates[k].name for k in places]
        given = [name for name in names if name in values]
        if given and len(given) < len(names):
            raise ModelError(
                f"{', '.join(names)} are one quaternion: give all four or none", number="M110"
            ).under(given[0])
