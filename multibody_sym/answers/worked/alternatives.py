"""The test of a state: other directions of sliding, and sticking, are assumed and lead to contradictions.

A book assumes a direction and may be wrong; with friction not only signs change then. Here each assumption gets its own
equations, and what contradicts it is told with its number.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

import sympy

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.records import Formula, Line, Quantity, Sentence, WorkedStep
from multibody_sym.answers.worked.actions import gripping_ratio, is_grip
from multibody_sym.answers.worked.elimination import Linear, linear, shown
from multibody_sym.answers.worked.equations import Equations, with_parameters
from multibody_sym.derivation.notation import Notation
from multibody_sym.mechanics.law_elements import STICKS, FrictionPart, LawElement
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.modes import in_mode
from multibody_sym.mechanics.row_kinematics import RowMotion, coefficients, row_motion
from multibody_sym.mechanics.row_records import TurningRow
from multibody_sym.records import dataclass
from multibody_sym.scalars import limits
from multibody_sym.scalars.node import ZERO, as_node
from multibody_sym.scalars.vectors import apply, negate

_MOST: Final = 4
_AT_REST: Final = 1e-12


@dataclass(frozen=True)
class Part:
    """Friction of an element that is active, along one row."""

    element: LawElement
    friction: FrictionPart


@dataclass(frozen=True)
class Refuted:
    """An assumption, the `slips` by part, its `equations`, and what contradicts it where one `part` rubs.

    What slides would have the tangential acceleration `left` (over accelerations) = `value`, against the assumption.
    What sticks would need the friction `value`, more than its `limit`; on a rope that grips it would be the greater
    tension `left`, more than the less one allows.
    """

    slips: Mapping[str, int]
    part: Part
    equations: Equations
    left: Linear
    value: Quotient
    limit: Quotient | None = None


def refuted(equations: Equations) -> Iterator[Refuted]:
    """Yield the other assumptions about friction that starts from rest, each with what contradicts it."""
    mode = equations.mechanism.mode
    if mode is None:
        return
    parts = parts_at_rest(equations)
    slips = {part.friction.name: mode.slip(part.friction) for part in parts}
    for tried in _assumptions(slips):
        found = (_contradiction(equations, parts, assumed) for assumed in tried)
        told = next((each for each in found if each is not None), None)
        if told is not None:
            yield told


def parts_at_rest(equations: Equations) -> list[Part]:
    """Return the friction parts in the plane that are pressed and do not slide yet."""
    mode = equations.mechanism.mode
    return [
        Part(element, part)
        for element in (equations.mechanism.one_way if mode is not None else ())
        if mode is not None and (not element.unilateral or mode.acts(element))
        for part in element.frictions
        if len(part.rows) == 1 and not part.enough and _rests(equations, part)
    ]


def _rests(equations: Equations, part: FrictionPart) -> bool:
    (rate,) = equations.exactly.quotients([_moved(equations, part).phidot])
    return abs(float(rate.sample)) <= _AT_REST


def _moved(equations: Equations, part: FrictionPart) -> RowMotion:
    return row_motion(part.rows[0], equations.actions.motion, equations.actions.bias)


def _assumptions(slips: Mapping[str, int]) -> list[list[dict[str, int]]]:
    """Return what else may be assumed: all that slides slides back, or sticks; what sticks slides.

    Each is a list of which the first that is refuted is told: where all that sticks leaves forces open, one of it does.
    """
    sliding = {name: slip for name, slip in slips.items() if slip != STICKS}
    if not sliding:
        return [[{name: slip}] for name in slips for slip in (1, -1)][:_MOST]
    back = {name: -slip for name, slip in sliding.items()}
    return [[back], [dict.fromkeys(sliding, STICKS), *({name: STICKS} for name in sliding)]]


def _contradiction(equations: Equations, parts: list[Part], slips: Mapping[str, int]) -> Refuted | None:
    """Return what contradicts an assumption; None where nothing does, or no closed form tells."""
    mechanism = _assumed(equations.mechanism, slips)
    try:
        other = Equations(mechanism, with_parameters(mechanism, equations.given), plane=equations.words.plane)
        if other.reason:
            return None
        for part in (part for part in parts if part.friction.name in slips):
            found = _judged(other, part, slips)
            if found is not None:
                return found
    except NoClosedFormError:
        pass
    return None


def _assumed(mechanism: Mechanism, slips: Mapping[str, int]) -> Mechanism:
    """Return the mechanism in the mode that slides otherwise."""
    assert mechanism.mode is not None
    added = {row.name for element in mechanism.one_way for row in element.rows}
    bare = replace(mechanism, rows=tuple(row for row in mechanism.rows if row.name not in added), mode=None, held=())
    return in_mode(bare, replace(mechanism.mode, slips={**mechanism.mode.slips, **slips}))


def _judged(other: Equations, part: Part, slips: Mapping[str, int]) -> Refuted | None:
    """Return how one part contradicts what was assumed of it: it moves the other way, or needs too much friction."""
    slip = slips[part.friction.name]
    if slip == STICKS:
        return _too_much(other, part, slips)
    moved = _moved(other, part.friction)
    *factors, gamma = other.exactly.quotients([*moved.jacobian, moved.gamma])
    left = linear(zip(other.symbols.accelerations, factors, strict=True), -gamma).times(
        2 if is_grip(part.friction) else 1
    )
    value = other.result(left)
    return Refuted(slips, part, other, left, value) if float(value.sample) * slip < 0 else None


def _too_much(other: Equations, part: Part, slips: Mapping[str, int]) -> Refuted | None:
    if is_grip(part.friction):
        (ratio,) = other.exactly.quotients([gripping_ratio(part.friction, other.actions.motion)])
        greater, less = other.grip(part.friction.rows[0].name)
        size, limit = other.result(greater), other.result(less) * ratio
        return Refuted(slips, part, other, greater, size, limit) if size.sample > limit.sample else None
    names = [row.name for row in other.mechanism.rows]
    friction = other.symbols.multipliers[names.index(part.friction.rows[0].name)]
    normals = [other.normal(names.index(row.name)) for row in part.element.normals_of(part.friction)]
    static = coefficients(other.actions.motion, part.friction.rows, [part.friction.static])
    (coefficient,) = other.exactly.quotients(static)
    left = Linear({friction: other.exactly.constant(1)}, coefficient * 0)
    value, forces = other.result(left), [other.result(normal) for normal in normals]
    limit = limits.most(coefficient, limits.pressing(forces, [1 if force.sample >= 0 else -1 for force in forces]))
    size = value if value.sample >= 0 else -value
    return Refuted(slips, part, other, left, size, limit) if size.sample > limit.sample else None


# ----------------------------------------------------------------------------------------------------------------------
# Assumptions that are rejected, as lines: what is assumed, what follows from it, and why that cannot be.


def rejected(equations: Equations, notation: Notation, units: Mapping[Any, str]) -> Iterator[WorkedStep]:
    """Yield the steps that reject other assumptions about friction."""
    told = _Rejected(equations, notation, units)
    if equations.reason:
        return
    for number, found in enumerate(refuted(equations), 1):
        yield WorkedStep(f"Other assumption {number}", tuple(told.lines(found)))


class _Rejected:
    """How rejected assumptions are told in the letters of the state that holds."""

    def __init__(self, equations: Equations, notation: Notation, units: Mapping[Any, str]) -> None:
        self.equations, self.notation, self.units = equations, notation, units
        self.parts = {part.friction.name: part for part in parts_at_rest(equations)}

    def lines(self, found: Refuted) -> Iterator[Line]:
        """Yield what is assumed, what follows, and the contradiction."""
        if found.limit is None:
            ways = (f"{name} slides {self._way(self.parts[name], slip)}" for name, slip in found.slips.items())
            yield Sentence((f"Assume that {' and '.join(ways)}, and friction acts against that. Then",))
            unit = min((self.units.get(x, "") for x in found.left.terms), key=lambda unit: (unit != "m/s^2", unit))
            yield self._formula(found, shown(found.equations.exactly, found.left), found.value, unit)
            sign = ">" if found.slips[found.part.friction.name] > 0 else "<"
            yield Sentence((f"and not {sign} 0, as was assumed: a contradiction.",))
            return
        needed, most, unit = self._needed(found)
        yield Sentence((f"Assume that {' and '.join(found.slips)} stick{'s' if len(found.slips) == 1 else ''}. Then",))
        yield self._formula(found, needed, found.value, unit)
        yield Sentence(("is needed, and no more is there than",))
        yield self._formula(found, most, found.limit, unit)
        yield Sentence(("a contradiction.",))

    def _formula(self, found: Refuted, left: Any, value: Quotient, unit: str) -> Formula:
        number = Quantity(float(value.sample), unit)
        try:
            written = found.equations.exactly.written(value)
        except NoClosedFormError:
            return Formula((left,), value=number, assumed=True)
        return Formula((left,) if written.is_number else (left, written), value=number, assumed=True)

    def _needed(self, found: Refuted) -> tuple[Any, Any, str]:
        """Return what would be needed to stick, the most that it can be, and their unit."""
        part = found.part.friction
        if not is_grip(part):
            friction, most = self._symbols(found.part)
            return sympy.Abs(friction), most, self.units.get(friction, "")
        (grip,) = (each for each in self.equations.actions.grips if each.slip == part.rows[0].name)
        (other,) = (each for each in found.equations.actions.grips if each.slip == part.rows[0].name)
        forward = other.before in found.left.terms
        greater, less = (grip.before, grip.behind) if forward else (grip.behind, grip.before)
        (ratio,) = self.equations.exactly.quotients([gripping_ratio(part, self.equations.actions.motion)])
        return greater, less * self.equations.exactly.written(ratio), self.units.get(greater, "")

    def _symbols(self, part: Part) -> tuple[Any, Any]:
        """Return the letter of a part's friction, and the most that it can be, in the letters of the state."""
        equations = self.equations
        names = [row.name for row in equations.mechanism.rows]
        row = part.friction.rows[0].name
        further = [each.symbol for each in equations.actions.further if each.element == part.friction.name]
        friction = equations.symbols.multipliers[names.index(row)] if row in names else further[0]
        static = coefficients(equations.actions.motion, part.friction.rows, [part.friction.static])
        (coefficient,) = equations.exactly.quotients(static)
        normals = [equations.normal(names.index(row.name)) for row in part.element.normals_of(part.friction)]
        forces = [shown(equations.exactly, normal) for normal in normals]
        N = limits.pressing(forces, [int(part.element.unilateral)] * len(forces))
        return friction, limits.most(equations.exactly.written(coefficient), N)

    def _way(self, part: Part, slip: int) -> str:
        """Return where the first of two bodies slides to, or how a joint's coordinate changes."""
        row, equations = part.friction.rows[0], self.equations
        moved = row_motion(row, equations.actions.motion, equations.actions.bias)
        if row.surfaces is None:
            moving = [k for k, x in enumerate(moved.jacobian) if as_node(x) is not ZERO]
            names = [coordinate_of(equations.mechanism, k) for k in moving]
            if len(names) > 1:
                return "forward" if slip > 0 else "backward"
            return f"so that {names[0]} {'grows' if slip > 0 else 'falls'}"
        if isinstance(row, TurningRow):
            return "forward" if slip > 0 else "backward"
        first, second = (skin.place.body for skin in row.surfaces)
        index, sign = (first, slip) if first >= 0 else (second, -slip)
        world = apply(equations.actions.motion.rotation(index), moved.of_body[index][0])
        vector = equations.exactly.quotients(world if sign > 0 else negate(world))
        words = equations.words.of(vector)[1]
        return "".join(word if isinstance(word, str) else self.notation.text(word) for word in words)


def coordinate_of(mechanism: Mechanism, speed: int) -> str:
    """Return the name of the coordinate of which a speed is the rate, or its own."""
    pairs = (pair for body in mechanism.bodies for pair in body.rate_pairs)
    return next((mechanism.coordinates[q].name for q, u in pairs if u == speed), mechanism.speeds[speed].name)
