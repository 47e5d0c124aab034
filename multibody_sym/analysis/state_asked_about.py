"""The state that a question is about: the start, the position of rest beside it, or a state with other values.

In: a start, and a place by word or by values. Out: a Start; or the error that says why there is none.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import islice, takewhile
from math import inf, isfinite
from typing import Any, Final

import numpy as np

from multibody_sym.analysis.deviations import DeviationFlow
from multibody_sym.analysis.equilibrium_search import MOST, SECONDS, guesses, keeps_mode, search_from
from multibody_sym.dynamics.closing import ConstraintRows, closed_near
from multibody_sym.dynamics.start.assembly import NotClosedError
from multibody_sym.dynamics.start.parameters import value_or_none
from multibody_sym.dynamics.start.start import Start, start_beside
from multibody_sym.errors import ArgumentError, ModelError, NoSolutionError, Where, at, short_repr
from multibody_sym.mechanics.absolute import unknown_coordinate
from multibody_sym.mechanics.changes import start_value
from multibody_sym.mechanics.mechanism import Coordinate, Mechanism, Speed
from multibody_sym.model.argument_checks import state_by_name
from multibody_sym.model.fields import is_text
from multibody_sym.model.system import System
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node, symbol

REST: Final = "equilibrium"
_POSITIONS: Final = 4
_ALIKE: Final = 1e-9
_MOST_NAMED: Final = 4


def no_equilibrium_error(
    flow: DeviationFlow, rows: ConstraintRows, guesses: Iterable[Floats], *, in_time: bool, one_way: str = ""
) -> NoSolutionError:
    """Return the error for a search that found nothing from guesses (nq): the start, and others with open rows.

    Where all positions accelerate alike it says so, else that there may be others. `one_way`: words on such elements.
    """
    start, *others = islice(guesses, 2 * _POSITIONS)
    rest, found = np.zeros(len(flow.mechanism.speeds)), list[Floats]()
    for guess in (start, *others):
        try:
            q = closed_near(rows, guess) if len(found) < _POSITIONS else None
            if q is not None:
                found.append(flow.unbalanced(q, rest))
        except (*UNDEFINED, np.linalg.LinAlgError):
            continue
    size = max((float(np.abs(x).max(initial=0.0)) for x in found), default=0.0)
    if size > 0.0 and len(found) == _POSITIONS and all((np.abs(x - found[0]) <= _ALIKE * size).all() for x in found):
        pairs = zip(flow.mechanism.rate_units.items(), found[0].tolist(), strict=True)
        moving = [f"{name}' = {x:.6g} {unit}".rstrip() for (name, unit), x in pairs if abs(x) > _ALIKE * size]
        named = ", ".join([*moving[:_MOST_NAMED], *(["..."] if len(moving) > _MOST_NAMED else [])])
        alike = f"in {len(found)} positions the system at rest accelerates alike ({named})"
        return NoSolutionError(f"no position of equilibrium was found: {alike}{one_way}", number="N109")
    inputs = zip(flow.mechanism.inputs, np.ravel(flow.known(start, rest)[4]).tolist(), strict=True)
    acting = ", ".join(f"{name} = {x:.6g}" for name, x in inputs if x)
    where = "near the start" + " in the time of a search" * in_time
    where += f" under {acting}, as at t = 0" if acting else ""
    return NoSolutionError(
        f"no position of equilibrium was found {where}{one_way}; give other initial coordinates", number="N109"
    )


def tried_sets_text(mechanism: Mechanism, sets: tuple[int, int], *, in_time: bool) -> str:
    """Return how many `sets` of unilateral elements were tried closed, of how many, and which friction is left out.

    `in_time`: whether the time of a search ended before it had looked everywhere.
    """
    names, (count, every) = _unilateral_names(mechanism), sets
    either = f", and none with {names} closed either" if names else ""
    either += ", each for a part of that time" if in_time and every > 1 else ""
    if count < every:
        either = f"; of {every} sets of {names} that may be closed {count} {'were' if count > 1 else 'was'} tried"
    rubbing = friction_left_out(mechanism)
    rub = f"; friction ({', '.join(rubbing[:_MOST_NAMED])}) is left out: equilibrium --vary NAME tells what it holds"
    return either + (rub if rubbing else "")


def friction_left_out(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the declared elements whose friction is left out; what rolls goes on rolling."""
    rubbing = (x for x in mechanism.one_way if x.frictions and x.path[0] != "constraints")
    return tuple(dict.fromkeys(x.path[-1] for x in rubbing))


def _unilateral_names(mechanism: Mechanism) -> str:
    names = [x.name for x in mechanism.one_way if x.unilateral]
    return ", ".join(names[:_MOST_NAMED]) + (", .." if len(names) > _MOST_NAMED else "")


def begin_at(system: System, resolved: Mechanism, begin: Start, place: Any, formalism: str | None) -> Start:
    """Return the state at a `place` beside a start: None, the word "equilibrium", or values by name.

    `place` may be a run's `final` too. Named coordinates and speeds have these values, and constraints are closed
    around them. Parameters, and lengths of ropes, stay those of the start. Raises InputError with `at` in its path,
    NoSolutionError.
    """
    if place is None:
        return begin
    with at("at"):
        if is_text(place, REST):
            q = zip((c.name for c in resolved.coordinates), _rest_beside(resolved, begin, formalism), strict=True)
            return start_beside(resolved, begin, {**dict(q), **{speed.name: 0.0 for speed in resolved.speeds}})
        if not isinstance(place, Mapping) or not all(isinstance(name, str) for name in place):
            wanted = f"the word {REST} or values by name, such as {{'phi': 0}}"
            raise ArgumentError(f"at is to be {wanted}, got {short_repr(place)}")
        # expressions of parameters, or text with units; of a quaternion all or none
        declared: list[Coordinate | Speed] = [*resolved.coordinates, *resolved.speeds]
        units = {each.name: each.unit for each in declared}
        values = {}
        for name, value in state_by_name("at", place).items():
            with at(name):
                if name not in units:
                    raise unknown_coordinate(name, system, units)
                node = start_value(value, units[name])
                if node is None:
                    raise ModelError("it needs a value; what is not named keeps that of the start", number="M119")
                values[name] = number_asked(node, resolved, begin)
        for places in (places for body in resolved.bodies for places in body.quaternions):
            names = [resolved.coordinates[k].name for k in places]
            given = [name for name in names if name in values]
            if given and len(given) < len(names):
                raise ModelError(f"{', '.join(names)} are one quaternion: give all four or none", number="M110").under(
                    given[0]
                )
        try:
            return start_beside(resolved, begin, values)
        except NotClosedError as error:
            what = ".".join(error.where.path) or "the constraints"
            advice = "name fewer, or give others"
            raise NoSolutionError(f"no state with these values satisfies {what}; {advice}", number="N111") from error


@contextmanager
def errors_at(place: Any) -> Iterator[None]:
    """Let errors say that there is no solution at a given `place`; without a place they are of the start."""
    try:
        yield
    except NoSolutionError as error:
        if place is not None:
            error.where = Where(path=("at",))
        raise


def _rest_beside(resolved: Mechanism, begin: Start, formalism: str | None) -> list[float]:
    """Return the position of equilibrium that is found first from a start. Raises NoSolutionError."""
    until, search = time.process_time() + SECONDS, search_from(resolved, begin, formalism)
    around = islice(guesses(search.places, search.places.start), MOST)
    in_time = takewhile(lambda _: time.process_time() < until, around)
    reached = (search.reached(guess, -inf if number else until) for number, guess in enumerate(in_time))
    found = next((q for q in reached if q is not None and keeps_mode(search, q)), None)
    if found is None:
        late, names = time.process_time() > until, _unilateral_names(resolved)
        states = f", with {names} closed or open as at the start (equilibrium tells where else it rests)"
        again = guesses(search.places, search.places.start)
        raise no_equilibrium_error(search.flow, search.rows, again, in_time=late, one_way=states if names else "")
    return [float(x) for x in found]


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
