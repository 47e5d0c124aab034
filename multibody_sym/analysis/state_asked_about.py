"""The state that a question is about: the start, the position of rest beside it, or where some values are others."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import islice, takewhile
from math import inf, isfinite
from typing import Any, Final

import numpy as np

from multibody_sym.analysis.deviations import Flow
from multibody_sym.analysis.equilibrium_search import MOST, SECONDS, guesses, search_from, stands
from multibody_sym.dynamics.constraints.closing import ConstraintRows, closed_near
from multibody_sym.dynamics.start.assembly import NotClosedError
from multibody_sym.dynamics.start.parameters import value_or_none
from multibody_sym.dynamics.start.start import Start, start_beside
from multibody_sym.errors import ArgumentError, ModelError, NoSolutionError, Where, at, shown
from multibody_sym.mechanics.absolute import unknown_coordinate
from multibody_sym.mechanics.changes import start_value
from multibody_sym.mechanics.mechanism import Coordinate, Mechanism, Speed
from multibody_sym.model.argument_checks import state_by_name
from multibody_sym.model.system import System
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node, symbol

# ----------------------------------------------------------------------------------------------------------------------
# What is said where no position of equilibrium was found: that there may be others, or why there seem to be none.


_POSITIONS: Final = 4
_ALIKE: Final = 1e-9
_MOST_NAMED: Final = 4


def none_found(
    flow: Flow, rows: ConstraintRows, guesses: Iterable[Floats], *, in_time: bool, one_way: str = ""
) -> NoSolutionError:
    """Return the error for a search that found nothing from guesses (nq): the start, and others with open rows.

    `one_way`: what is to be said of what holds one way only, `tried` or `stood`.
    """
    start, *tried = islice(guesses, 2 * _POSITIONS)
    found = list(islice(_accelerations(flow, rows, [start, *tried]), _POSITIONS))
    size = max((float(np.abs(x).max(initial=0.0)) for x in found), default=0.0)
    if size > 0.0 and len(found) == _POSITIONS and all((np.abs(x - found[0]) <= _ALIKE * size).all() for x in found):
        alike = f"in {len(found)} positions the system at rest accelerates alike ({_named(flow, found[0], size)})"
        return NoSolutionError(f"no position of equilibrium was found: {alike}{one_way}", number="N109")
    where = f"near the start{' in the time of a search' if in_time else ''}{_inputs(flow, start)}"
    return NoSolutionError(
        f"no position of equilibrium was found {where}{one_way}; give other initial coordinates", number="N109"
    )


def tried(mechanism: Mechanism, sets: tuple[int, int], *, in_time: bool) -> str:
    """Return how many `sets` of what may close were tried closed, of how many, and where friction is asked about.

    `in_time`: whether the time of a search ended before it had looked everywhere.
    """
    names, (count, every) = _closing(mechanism), sets
    either = f", and none with {names} closed either" if names else ""
    either += ", each for a part of that time" if in_time and every > 1 else ""
    if count < every:
        either = f"; of {every} sets of {names} that may be closed {count} {'were' if count > 1 else 'was'} tried"
    rubbing = left_out(mechanism)
    rub = f"; friction ({', '.join(rubbing[:_MOST_NAMED])}) is left out: equilibrium --vary NAME tells what it holds"
    return either + (rub if rubbing else "")


def left_out(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the declared elements whose friction is left out; what rolls goes on rolling."""
    rubbing = (x for x in mechanism.one_way if x.frictions and x.path[0] != "constraints")
    return tuple(dict.fromkeys(x.path[-1] for x in rubbing))


def stood(mechanism: Mechanism) -> str:
    """Return that what holds one way only was taken as it is at the start."""
    names = _closing(mechanism)
    return f", with {names} closed or open as at the start (equilibrium tells where else it rests)" if names else ""


def _closing(mechanism: Mechanism) -> str:
    """Return the names of what may close."""
    closing = [x.name for x in mechanism.one_way if x.unilateral]
    return ", ".join(closing[:_MOST_NAMED]) + (", .." if len(closing) > _MOST_NAMED else "")


def _accelerations(flow: Flow, rows: ConstraintRows, tried: Iterable[Floats]) -> Iterator[Floats]:
    """Yield the accelerations (nu) at rest in the positions that close the rows."""
    for guess in tried:
        try:
            q = closed_near(rows, guess)
            if q is not None:
                yield flow.accelerations(q, np.zeros(len(rows.mechanism.speeds)))
        except (*UNDEFINED, np.linalg.LinAlgError):
            continue


def _named(flow: Flow, udot: Floats, size: float) -> str:
    pairs = zip(flow.mechanism.speeds, udot.tolist(), strict=True)
    moving = [f"{speed.name}' = {x:.6g} {speed.unit}^2" for speed, x in pairs if abs(x) > _ALIKE * size]
    return ", ".join([*moving[:_MOST_NAMED], *(["..."] if len(moving) > _MOST_NAMED else [])])


def _inputs(flow: Flow, q: Floats) -> str:
    """Return which inputs act, and that they do so as at the start."""
    values = np.ravel(flow.known(q, np.zeros(len(flow.mechanism.speeds)))[4])
    acting = [f"{name} = {x:.6g}" for name, x in zip(flow.mechanism.inputs, values.tolist(), strict=True) if x]
    return f" under {', '.join(acting)}, as at t = 0" if acting else ""


# ----------------------------------------------------------------------------------------------------------------------

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
