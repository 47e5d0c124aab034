"""What is given: the values of parameters, the coordinates with their directions, and how it all starts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from multibody_sym.answers.instant import Solved
from multibody_sym.answers.worked.record import Formula, Line, Quantity, Sentence
from multibody_sym.dynamics.derivation.symbols import Symbols
from multibody_sym.expressions.printer import text
from multibody_sym.expressions.units import DIMENSIONLESS
from multibody_sym.model.declaration.curves.follow import Follow
from multibody_sym.model.declaration.steps import Step
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.mechanism import TreeBody
from multibody_sym.model.mechanism.modes import is_direction
from multibody_sym.model.mechanism.parameters import Source
from multibody_sym.model.mechanism.units import MechanismUnits
from multibody_sym.scalars.traversal import leaves

_AT_REST: Final = 1e-12


def given_lines(solved: Solved, symbols: Symbols) -> Iterator[Line]:
    """Yield the lines: parameters with values, coordinates with what they count and where they start."""
    mechanism, told = solved.mechanism, MechanismUnits(solved.mechanism)
    values = zip(mechanism.parameters, symbols.parameters, solved.begin.parameters, strict=True)
    for entry, s, value in values:
        if entry.source is Source.DECLARED:
            turned = entry.value is not None and entry.dimension == DIMENSIONLESS and leaves([entry.value], "pi")
            yield Formula((s,), value=Quantity(float(value), "rad" if turned else told.parameters[entry.name]))
        elif is_direction(entry.name):
            yield Formula((s,), value=Quantity(float(value), ""), before=("in the direction of slip",))
    for body in mechanism.bodies:
        yield from _coordinates(solved, symbols, body)


def _coordinates(solved: Solved, symbols: Symbols, body: TreeBody) -> Iterator[Line]:
    mechanism, begin = solved.mechanism, solved.begin
    if body.is_double or body.is_foot:
        return
    least = _AT_REST * max(map(abs, (1.0, *begin.u)))
    units = [coordinate.unit for coordinate in mechanism.coordinates]
    counted = {k: words for free in body.free_steps for k, words in _counted(free.step, free.q, units)}
    for q, u in body.rate_pairs:
        rate = Quantity(float(begin.u[u]), mechanism.speeds[u].unit)
        how = ("at rest",) if abs(rate.number) <= least else ("moving with ", rate)
        place = Quantity(float(begin.q[q]), mechanism.coordinates[q].unit)
        yield Sentence(
            (symbols.coordinates[q], f": {counted.get(q, 'coordinate of')} {body.name}, at ", place, ", ", *how)
        )


def _counted(step: Step, places: Sequence[int], units: Sequence[str]) -> Iterator[tuple[int, str]]:
    """Yield what each coordinate of a step counts; that of a screw is its angle."""
    if isinstance(step, Follow):
        yield from ((place, "place on the curve of") for place in places)
        return
    turning = [f"angle about {_axis(axis)} of" for axis in step.turns]
    sliding = [f"way along {_axis(axis)} of" for axis in step.slides]
    words = turning if places and units[places[0]] == "rad" else sliding
    yield from zip(places, words, strict=False)


def _axis(axis: Point) -> str:
    texts = [text(x) for x in axis]
    plain = {("1", "0", "0"): "x", ("0", "1", "0"): "y", ("0", "0", "1"): "z"}
    back = {("-1", "0", "0"): "-x", ("0", "-1", "0"): "-y", ("0", "0", "-1"): "-z"}
    key = (texts[0], texts[1], texts[2])
    return plain.get(key) or back.get(key) or f"({', '.join(texts)})"
