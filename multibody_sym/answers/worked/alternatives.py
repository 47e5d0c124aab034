"""The test of a state: other directions of sliding, and sticking, are assumed and lead to contradictions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

import sympy

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.records import Formula, Line, Sentence, WorkedStep
from multibody_sym.answers.worked.actions import gripping_ratio, is_grip
from multibody_sym.answers.worked.equations import Equations, LinearForm, in_sympy, linear
from multibody_sym.derivation.notation import Notation
from multibody_sym.mechanics.law_elements import STICKS, FrictionPart, LawElement
from multibody_sym.mechanics.modes import in_mode
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.row_kinematics import coefficients, row_motion
from multibody_sym.mechanics.row_records import TurningRow
from multibody_sym.records import dataclass
from multibody_sym.scalars import limits
from multibody_sym.scalars.node import ZERO, Node, as_node, slot
from multibody_sym.scalars.vectors import apply, negate
from multibody_sym.text.values import Quantity

_MOST: Final = 4
_STILL: Final = 1e-12


@dataclass(frozen=True)
class RestingFriction:
    """Friction of an element that is active, along one row."""

    element: LawElement
    friction: FrictionPart

    def pressed(self, equations: Equations) -> tuple[Quotient, list[LinearForm]]:
        """Return the static coefficient and the normal forces among equations."""
        names = [row.name for row in equations.mechanism.rows]
        static = coefficients(equations.actions.motion, self.friction.rows, [self.friction.static])
        (coefficient,) = equations.exactly.quotients(static)
        return coefficient, [equations.normal(names.index(row.name)) for row in self.element.normals_of(self.friction)]


@dataclass(frozen=True)
class Refuted:
    """An assumption, the `slips` by part, its `equations`, and what contradicts it where one `part` rubs.

    What slides would have the tangential acceleration `left` (over accelerations) = `value`, against the assumption.
    What sticks would need the friction `value`, more than its `limit`; on a rope that grips it would be the greater
    tension `left`, more than the less one allows.
    """

    slips: Mapping[str, int]
    part: RestingFriction
    equations: Equations
    left: LinearForm
    value: Quotient
    limit: Quotient | None = None


def parts_at_rest(equations: Equations) -> list[RestingFriction]:
    """Return the friction parts in the plane that are pressed and do not slide yet."""
    mode, motion, found = equations.mechanism.mode, equations.actions.motion, []
    for element in equations.mechanism.one_way if mode is not None else ():
        if mode is None or (element.unilateral and not mode.acts(element)):
            continue
        for part in (part for part in element.frictions if len(part.rows) == 1 and not part.enough):
            speed = row_motion(part.rows[0], motion, equations.actions.bias).phidot
            if abs(float(equations.exactly.quotients([speed])[0].sample)) <= _STILL:
                found.append(RestingFriction(element, part))
    return found


def refuted_assumptions(equations: Equations) -> Iterator[Refuted]:
    """Yield other assumptions about friction that starts from rest, each with what contradicts it.

    All that slides slides back, or sticks; what sticks slides. Where all that sticks leaves forces open, one part does.
    """
    mode = equations.mechanism.mode
    if mode is None:
        return
    parts = parts_at_rest(equations)
    slips = {part.friction.name: mode.slip(part.friction) for part in parts}
    sliding = {name: slip for name, slip in slips.items() if slip != STICKS}
    if sliding:
        back = {name: -slip for name, slip in sliding.items()}
        stuck = [dict.fromkeys(sliding, STICKS), *({name: STICKS} for name in sliding)]
        assumptions = [[back], stuck]
    else:
        assumptions = [[{name: slip}] for name in slips for slip in (1, -1)][:_MOST]
    for tried in assumptions:
        found = (_contradiction(equations, parts, assumed) for assumed in tried)
        first = next((each for each in found if each is not None), None)
        if first is not None:
            yield first


def _contradiction(equations: Equations, parts: list[RestingFriction], slips: Mapping[str, int]) -> Refuted | None:
    """Return what contradicts an assumption; None where nothing does, or no closed form tells."""
    mechanism, state = equations.mechanism, equations.given.state
    assert mechanism.mode is not None
    added = {row.name for element in mechanism.one_way for row in element.rows}
    bare = replace(mechanism, rows=tuple(row for row in mechanism.rows if row.name not in added), mode=None, held=())
    assumed = in_mode(bare, replace(mechanism.mode, slips={**mechanism.mode.slips, **slips}))
    # parameters that this mode has besides are zero
    parameters = [state.slots.get(slot("parameters", k), ZERO) for k in range(len(assumed.parameters))]
    start = state_of(assumed, Node, ZERO, list(state.q), list(state.u), parameters)
    try:
        other = Equations(assumed, replace(equations.given, state=start), plane=equations.words.plane)
        if other.reason:
            return None
        for part in (part for part in parts if part.friction.name in slips):
            sticks = slips[part.friction.name] == STICKS
            found = _too_much(other, part, slips) if sticks else _wrong_way(other, part, slips)
            if found is not None:
                return found
    except NoClosedFormError:
        pass
    return None


def _wrong_way(other: Equations, part: RestingFriction, slips: Mapping[str, int]) -> Refuted | None:
    """Return how a part that was assumed to slide contradicts that: it begins to move the other way."""
    moved = row_motion(part.friction.rows[0], other.actions.motion, other.actions.bias)
    *factors, gamma = other.exactly.quotients([*moved.jacobian, moved.gamma])
    rate = linear(zip(other.symbols.accelerations, factors, strict=True), -gamma)
    left = rate.times(2 if is_grip(part.friction) else 1)
    value = other.result(left)
    return Refuted(slips, part, other, left, value) if float(value.sample) * slips[part.friction.name] < 0 else None


def _too_much(other: Equations, part: RestingFriction, slips: Mapping[str, int]) -> Refuted | None:
    """Return how a part that was assumed to stick contradicts that: it needs too much friction."""
    if is_grip(part.friction):
        (ratio,) = other.exactly.quotients([gripping_ratio(part.friction, other.actions.motion)])
        greater, less = other.grip(part.friction.rows[0].name)
        size, limit = other.result(greater), other.result(less) * ratio
        return Refuted(slips, part, other, greater, size, limit) if size.sample > limit.sample else None
    names = [row.name for row in other.mechanism.rows]
    friction = other.symbols.multipliers[names.index(part.friction.rows[0].name)]
    coefficient, normals = part.pressed(other)
    left = LinearForm({friction: other.exactly.constant(1)}, coefficient * 0)
    value, forces = other.result(left), [other.result(normal) for normal in normals]
    limit = limits.most(coefficient, limits.pressing(forces, [1 if force.sample >= 0 else -1 for force in forces]))
    size = value if value.sample >= 0 else -value
    return Refuted(slips, part, other, left, size, limit) if size.sample > limit.sample else None


# ----------------------------------------------------------------------------------------------------------------------
# Assumptions that are rejected, as lines: what is assumed, what follows from it, and why that cannot be.


def rejected_alternatives(equations: Equations, notation: Notation, units: Mapping[Any, str]) -> Iterator[WorkedStep]:
    """Yield the steps that reject other assumptions about friction."""
    told = _Rejected(equations, notation, units)
    if equations.reason:
        return
    for number, found in enumerate(refuted_assumptions(equations), 1):
        yield WorkedStep(f"Other assumption {number}", tuple(told.lines(found)))


class _Rejected:
    """The letters in which rejected assumptions are printed: those of the state that holds."""

    def __init__(self, equations: Equations, notation: Notation, units: Mapping[Any, str]) -> None:
        self.equations, self.notation, self.units = equations, notation, units
        self.parts = {part.friction.name: part for part in parts_at_rest(equations)}

    def lines(self, found: Refuted) -> Iterator[Line]:
        if found.limit is None:
            ways = (f"{name} slides {self._way(self.parts[name], slip)}" for name, slip in found.slips.items())
            yield Sentence((f"Assume that {' and '.join(ways)}, and friction acts against that. Then",))
            unit = min((self.units.get(x, "") for x in found.left.terms), key=lambda unit: (unit != "m/s^2", unit))
            yield self._formula(found, in_sympy(found.equations.exactly, found.left), found.value, unit)
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
        alone = written.is_number or written == left
        return Formula((left,) if alone else (left, written), value=number, assumed=True)

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

    def _symbols(self, part: RestingFriction) -> tuple[Any, Any]:
        """Return the letter of a part's friction, and the most that it can be, in the letters of the state."""
        equations = self.equations
        names = [row.name for row in equations.mechanism.rows]
        row = part.friction.rows[0].name
        further = [each.symbol for each in equations.actions.further if each.element == part.friction.name]
        friction = equations.symbols.multipliers[names.index(row)] if row in names else further[0]
        coefficient, normals = part.pressed(equations)
        forces = [in_sympy(equations.exactly, normal) for normal in normals]
        N = limits.pressing(forces, [int(part.element.unilateral)] * len(forces))
        return friction, limits.most(equations.exactly.written(coefficient), N)

    def _way(self, part: RestingFriction, slip: int) -> str:
        """Return where the first of two bodies slides to, or how a joint's coordinate changes."""
        row, equations = part.friction.rows[0], self.equations
        moved = row_motion(row, equations.actions.motion, equations.actions.bias)
        if row.surfaces is None:
            moving = [k for k, x in enumerate(moved.jacobian) if as_node(x) is not ZERO]
            if len(moving) > 1:
                return "forward" if slip > 0 else "backward"
            mechanism, (speed,) = equations.mechanism, moving
            pairs = (pair for body in mechanism.bodies for pair in body.rate_pairs)
            rates = (mechanism.coordinates[q].name for q, u in pairs if u == speed)
            return f"so that {next(rates, mechanism.speeds[speed].name)} {'grows' if slip > 0 else 'falls'}"
        if isinstance(row, TurningRow):
            return "forward" if slip > 0 else "backward"
        first, second = (skin.place.body for skin in row.surfaces)
        index, sign = (first, slip) if first >= 0 else (second, -slip)
        world = apply(equations.actions.motion.rotation(index), moved.of_body[index][0])
        vector = equations.exactly.quotients(world if sign > 0 else negate(world))
        words = equations.words.of(vector)[1]
        return "".join(word if isinstance(word, str) else self.notation.text(word) for word in words)
