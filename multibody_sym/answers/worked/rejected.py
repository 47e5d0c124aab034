"""Assumptions that are rejected, as lines: what is assumed, what follows from it, and why that cannot be."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import sympy

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.worked.alternatives import Part, Refuted, parts_at_rest, refuted
from multibody_sym.answers.worked.equations import Equations
from multibody_sym.answers.worked.exactly import shown
from multibody_sym.answers.worked.grips import gripping_ratio, is_grip
from multibody_sym.answers.worked.record import Formula, Line, Quantity, Sentence, WorkedStep
from multibody_sym.dynamics.derivation.notation import Notation
from multibody_sym.kinematics.rows import coefficients, row_motion
from multibody_sym.model.mechanism.contact_rows import ContactRow, TurningRow
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.scalars import limits
from multibody_sym.scalars.node import ZERO, as_node
from multibody_sym.scalars.vectors import apply, negate


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
        if not isinstance(row, ContactRow):
            moving = [k for k, x in enumerate(moved.jacobian) if as_node(x) is not ZERO]
            names = [coordinate_of(equations.mechanism, k) for k in moving]
            if len(names) > 1:
                return "forward" if slip > 0 else "backward"
            return f"so that {names[0]} {'grows' if slip > 0 else 'falls'}"
        if isinstance(row, TurningRow):
            return "forward" if slip > 0 else "backward"
        first, second = (skin.place.body for skin in row.skins)
        index, sign = (first, slip) if first >= 0 else (second, -slip)
        world = apply(equations.actions.motion.rotation(index), moved.of_body[index][0])
        vector = equations.exactly.quotients(world if sign > 0 else negate(world))
        words = equations.words.of(vector)[1]
        return "".join(word if isinstance(word, str) else self.notation.text(word) for word in words)


def coordinate_of(mechanism: Mechanism, speed: int) -> str:
    """Return the name of the coordinate of which a speed is the rate, or its own."""
    pairs = (pair for body in mechanism.bodies for pair in body.rate_pairs)
    return next((mechanism.coordinates[q].name for q, u in pairs if u == speed), mechanism.speeds[speed].name)
