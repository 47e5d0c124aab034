"""The start over Nodes: as it is declared, what constraints determine in closed form where one is found, else a letter.

A number that came from closing constraints holds for one choice of parameters only, a guess that happens to be right
too. So neither stands in a formula: what was assembled keeps its declared expression only where all rows are satisfied
by it whatever the parameters are, takes the closed form that the rows give, or else keeps its name.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Final

import numpy as np

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.exact_solve import exact_solve
from multibody_sym.algebra.quotient_functions import exact
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Quotient
from multibody_sym.algebra.solving.roots import linear_parts, roots
from multibody_sym.answers.closed_form import ClosedForms, closed_forms, unknowns
from multibody_sym.answers.one_way import Acting
from multibody_sym.answers.symbolic_state import SymbolicState, parameter_letters
from multibody_sym.dynamics.constraints.closing import Rows
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.dynamics.start.constants import measured_rows, seen_axis
from multibody_sym.dynamics.start.start import Start
from multibody_sym.errors import ExpressionError
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.ropes import wrap_angle
from multibody_sym.kinematics.rows import RowMotion, row_motions
from multibody_sym.kinematics.state import state_of
from multibody_sym.kinematics.surface_angles import tangent_angle
from multibody_sym.model.mechanism.mechanism import Coordinate, Mechanism, Speed
from multibody_sym.model.mechanism.modes import with_coefficients
from multibody_sym.model.mechanism.rope_rows import RopeSlipRow
from multibody_sym.model.mechanism.sliding_rows import Sliding, SlidingRow
from multibody_sym.model.mechanism.start_constants import RopeSide, TangentAngle, WrapAngle
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate, evaluate_float, sqrt
from multibody_sym.scalars.node import ZERO, Node, as_node, slot, symbol

_AS_DECLARED: Final = 1e-12
_ASIDE: Final = 1e-12
"""The component of a direction (of length one) beside a tangent up to which it is rounding."""
_SAME_DIRECTION: Final = 1e-9
_WORK: Final = 10_000
_MOST_GUESSES: Final = 4


def declared_state(mechanism: Mechanism, begin: Start) -> SymbolicState:
    """Return the start with coordinates and speeds as declared, in parameters; assembled ones as this module says."""
    found = _SymbolicStart.of(mechanism, begin)
    found.find_positions()
    found.measure()
    found.find_speeds()
    return found.given()


@dataclass
class _SymbolicStart:
    """The start as it becomes known: q (nq) and u (nu) over Nodes, letters by node.

    `guesses` are the declared expressions of what was assembled, by place, where they have the value that was found.
    """

    mechanism: Mechanism
    begin: Start
    parameters: list[Node]
    letters: dict[Node, Letter]
    q: list[Node]
    u: list[Node]
    q_guesses: dict[int, Node]
    u_guesses: dict[int, Node]

    @classmethod
    def of(cls, mechanism: Mechanism, begin: Start) -> _SymbolicStart:
        """Return the start with a letter for everything that was assembled."""
        parameters, letters = parameter_letters(mechanism)
        values = {slot("parameters", i): node for i, node in enumerate(parameters)}
        sample = {node: float(letter.sample) for node, letter in letters.items()}
        assembled = set(begin.assembled)

        def declared(
            named: Sequence[Coordinate | Speed], nodes: Sequence[Node], found: Sequence[float]
        ) -> tuple[list[Node], dict[int, Node]]:
            kept, guesses = list(nodes), {}
            for k, each in enumerate(named):
                agrees = abs(evaluate_float([nodes[k]], sample)[0] - found[k]) <= _AS_DECLARED * max(1.0, abs(found[k]))
                if agrees and each.name in assembled:
                    guesses[k] = nodes[k]
                if not agrees or each.name in assembled:
                    kept[k] = symbol(each.name)
                    letters[kept[k]] = Letter(kept[k], PRECISE.mpf(found[k]))
            return kept, guesses

        initial = [as_node(x) for x in evaluate([c.initial for c in mechanism.coordinates], values)]
        q, q_guesses = declared(mechanism.coordinates, _normalized(mechanism, initial), begin.q)
        speeds = [as_node(x) for x in evaluate([s.initial for s in mechanism.speeds], values)]
        u, u_guesses = declared(mechanism.speeds, speeds, begin.u)
        return cls(mechanism, begin, parameters, letters, q, u, q_guesses, u_guesses)

    def given(self) -> SymbolicState:
        """Return the state as far as it is known."""
        return SymbolicState(self._motion(self.q, self.u).state, self.letters)

    def _motion(self, q: Sequence[Node], u: Sequence[Node]) -> Motion:
        return motion_of(self.mechanism, state_of(self.mechanism, Node, ZERO, list(q), list(u), self.parameters))

    def _field(self, *, expands: bool = False) -> tuple[Field, dict[Node, Quotient]]:
        field = Field(_WORK, expands)
        return field, {node: field.letter(node, letter) for node, letter in self.letters.items()}

    # --- positions ------------------------------------------------------------------------------------------------

    def find_positions(self) -> None:
        """Put declared expressions or closed forms in place of assembled coordinates, where rows confirm all of them.

        Guesses are kept all, or all but one: a guess may be right for one choice of the parameters only.
        """
        unknown = [k for k, c in enumerate(self.mechanism.coordinates) if self.q[k] is symbol(c.name)]
        guessed = list(self.q_guesses)
        dropped: list[tuple[int, ...]] = [(), *((k,) for k in guessed if len(guessed) <= _MOST_GUESSES)]
        for leave in dropped if unknown else ():
            kept = {k: node for k, node in self.q_guesses.items() if k not in leave}
            try:
                confirmed = self._confirmed(kept, [k for k in unknown if k not in kept])
            except (NoClosedFormError, ExpressionError):
                continue
            if confirmed is not None:
                self.q = confirmed
                return

    def _confirmed(self, kept: dict[int, Node], unknown: Sequence[int]) -> list[Node] | None:
        """Return coordinates with which all rows vanish whatever the parameters are, the unknown ones from the rows."""
        q = [kept.get(k, node) for k, node in enumerate(self.q)]
        if unknown:
            from_zero = [ZERO if k in unknown else node for k, node in enumerate(q)]
            closed = self._linear(from_zero, unknown) or self._one_by_one(q, unknown)
            if closed is None:
                return None
            q = [closed.get(k, node) for k, node in enumerate(q)]
        field, known = self._field()
        residuals = exact(field, [as_node(row.phi) for row in self._closing(self._motion(q, self.u))], known)
        return q if all(x.is_zero for x in residuals) else None

    def _linear(self, q: Sequence[Node], unknown: Sequence[int]) -> dict[int, Node] | None:
        """Return the unknown coordinates by one step from where they are zero, which is right for linear rows."""
        places = {i: k for body in self.mechanism.bodies for i, k in body.rate_pairs}
        if not all(k in places for k in unknown):
            return None
        rows = self._closing(self._motion(q, self.u))
        return self._solved(rows, [as_node(row.phi) for row in rows], {k: places[k] for k in unknown}, self.begin.q)

    def _one_by_one(self, q: Sequence[Node], unknown: Sequence[int]) -> dict[int, Node] | None:
        """Return the unknown coordinates each from a row in which no other one is left: a rod, then its slider.

        Where all rows have several, one that a row gives linearly is put into the others first.
        """
        found, places = list(q), list(unknown)
        while places:
            rows = self._residuals(found)
            root = next((x for row in rows for x in self._alone(row, found, places)), None)
            for aside in self._linear_ones(rows, found, places) if root is None else ():
                left = [k for k in places if k != aside[0]]
                held = [aside[1] if k == aside[0] else node for k, node in enumerate(found)]
                root = next((x for row in self._residuals(held) for x in self._alone(row, held, left)), None)
                if root is not None:
                    break
            if root is None:
                return None
            found[root[0]] = root[1]
            places.remove(root[0])
        return {k: found[k] for k in unknown}

    def _residuals(self, q: Sequence[Node]) -> list[Quotient]:
        field, known = self._field(expands=True)
        return exact(field, [as_node(row.phi) for row in self._closing(self._motion(q, self.u))], known)

    def _alone(self, row: Quotient, q: Sequence[Node], places: Sequence[int]) -> Iterator[tuple[int, Node]]:
        """Yield an unknown coordinate with its closed form, where a row has no other one."""
        there = [k for k in places if q[k] in row.symbols]
        if len(there) != 1:
            return
        sample = {node: float(letter.sample) for node, letter in self.letters.items()}
        for root in roots(row, q[there[0]]):
            value = self.begin.q[there[0]]
            if abs(evaluate_float([root], sample)[0] - value) <= _AS_DECLARED * max(1.0, abs(value)):
                yield there[0], root

    @staticmethod
    def _linear_ones(rows: Sequence[Quotient], q: Sequence[Node], places: Sequence[int]) -> Iterator[tuple[int, Node]]:
        """Yield unknown coordinates that stand linearly in a row, with what it says that they are by the others."""
        for row in rows:
            for k in places:
                for slope, constant in linear_parts(row, q[k]) if q[k] in row.symbols else ():
                    yield k, book_form(-constant / slope)

    def _closing(self, motion: Motion) -> list[RowMotion]:
        """Return the rows that restrict positions: all but nonholonomic ones, and ropes that take their length here."""
        measured = measured_rows(self.mechanism)
        return [row for k, row in enumerate(row_motions(motion)) if row.holonomic and k not in measured]

    def measure(self) -> None:
        """Put what they are at the start in place of angles: of tangents, ground's axes on their planes, of wraps."""
        begin, rest = self.begin, [ZERO] * len(self.u)
        there = Rows(self.mechanism, begin.parameters, []).motion(np.array(begin.q), np.zeros(len(begin.u)))
        here = self._motion(self.q, rest)
        for place, entry in enumerate(self.mechanism.parameters):
            if isinstance(entry.measure, TangentAngle):
                angle = tangent_angle(here, entry.measure, seen_axis(there, entry.measure))
                self.parameters[place] = as_node(angle)
            elif isinstance(entry.measure, RopeSide):
                self.parameters[place] = as_node(round(begin.parameters[place]))
            elif isinstance(entry.measure, WrapAngle):
                rows = (row for element in self.mechanism.one_way for row in element.rows)
                slip = next(row for row in rows if row.name == entry.measure.row)
                assert isinstance(slip, RopeSlipRow)
                self.parameters[place] = as_node(wrap_angle(here, slip.rope, slip.bend))

    # --- speeds ---------------------------------------------------------------------------------------------------

    def find_speeds(self) -> None:
        """Put declared expressions or closed forms in place of assembled speeds, as H u = -phi_t gives them."""
        unknown = [k for k, speed in enumerate(self.mechanism.speeds) if self.u[k] is symbol(speed.name)]
        if not unknown:
            return
        try:
            kept = [self.u_guesses.get(k, node) for k, node in enumerate(self.u)]
            field, known = self._field()
            moving = [as_node(row.phidot) for row in row_motions(self._motion(self.q, kept))]
            if len(self.u_guesses) == len(unknown) and all(x.is_zero for x in exact(field, moving, known)):
                self.u = kept
                return
            rows = row_motions(self._motion(self.q, [ZERO if k in unknown else node for k, node in enumerate(self.u)]))
            right = [as_node(row.phidot) for row in rows]
            closed = self._solved(rows, right, {k: k for k in unknown}, self.begin.u)
        except (NoClosedFormError, ExpressionError):
            return
        self.u = [(closed or {}).get(k, node) for k, node in enumerate(self.u)]

    # --- both -----------------------------------------------------------------------------------------------------

    def _solved(
        self, rows: Sequence[RowMotion], missed: Sequence[Node], unknown: dict[int, int], values: Collection[float]
    ) -> dict[int, Node] | None:
        """Return the unknown (place: speed) with J unknown = -missed; None where these are not the values found."""
        if not rows:
            return None
        field, known = self._field()
        matrix = [exact(field, [as_node(row.jacobian[k]) for k in unknown.values()], known) for row in rows]
        found = exact_solve(matrix, [-x for x in exact(field, missed, known)])
        wanted = [list(values)[k] for k in unknown]
        near = (
            abs(float(x.sample) - value) <= _AS_DECLARED * max(1.0, abs(value))
            for x, value in zip(found, wanted, strict=True)
        )
        return dict(zip(unknown, map(book_form, found), strict=True)) if all(near) else None


# --- directions in which slip in space begins ----------------------------------------------------------------------


def with_directions(mechanism: Mechanism, given: SymbolicState) -> SymbolicState:
    """Return a state with formulas in place of the directions in which something begins to slide in space.

    They are along a tangent where nothing leads aside, else those in which it would slide without friction, as far as
    these are the ones that were found; whether they stay so with friction is for `begins_along` to tell. A state
    without such formulas is returned as it is.
    """
    found: dict[Node, Node] = {}
    sample = {node: float(letter.sample) for node, letter in given.letters.items()}
    for sliding in _beginning(mechanism):
        assert sliding.starts is not None
        numbers = evaluate_float(given.state.values(sliding.starts), sample)
        if sorted(map(abs, numbers))[-2] <= _ASIDE:
            formulas = [as_node(round(x)) for x in numbers]
        else:
            formulas = _smooth_direction(mechanism, given, sliding)
        values = evaluate_float(formulas, sample)
        if formulas and max(abs(a - b) for a, b in zip(values, numbers, strict=True)) <= _SAME_DIRECTION:
            found |= dict(zip(sliding.starts, formulas, strict=True))
    if not found:
        return given
    unused = {given.state.slots[leaf] for leaf in found}
    letters = {node: letter for node, letter in given.letters.items() if node not in unused}
    return SymbolicState(replace(given.state, slots={**given.state.slots, **found}), letters)


def begins_along(mechanism: Mechanism, given: SymbolicState, forms: ClosedForms) -> bool:
    """Return whether all that begins to slide in space does so along its direction, whatever the parameters are."""
    acting = Acting.at(Instant(motion_of(mechanism, given.state), *unknowns(mechanism)))
    for sliding in _beginning(mechanism):
        assert sliding.starts is not None
        rates = [as_node(acting.acceleration(row)) for row in sliding.rows]
        pairs = combinations(zip(rates, given.state.values(sliding.starts), strict=True), 2)
        try:
            if not all(x.is_zero for x in forms.of([a * beside - b * along for (a, along), (b, beside) in pairs])):
                return False
        except NoClosedFormError:
            return False
    return True


def _smooth_direction(mechanism: Mechanism, given: SymbolicState, sliding: Sliding) -> list[Node]:
    """Return where something would begin to slide without friction; nothing without a closed form."""

    variant = with_coefficients(mechanism, lambda _: ZERO)
    acting = Acting.at(Instant(motion_of(variant, given.state), *unknowns(variant)))
    try:
        forms = closed_forms(variant, given)
        rates = [book_form(x) for x in forms.of(as_node(acting.acceleration(row)) for row in sliding.rows)]
    except (NoClosedFormError, ExpressionError):
        return []
    length = sqrt(sum((a * a for a in rates), ZERO))
    return [a / length for a in rates]


def _beginning(mechanism: Mechanism) -> Iterator[Sliding]:
    """Yield what begins to slide in space from rest."""
    for row in mechanism.rows:
        for sliding in row.frictions if isinstance(row, SlidingRow) else ():
            if sliding.starts is not None:
                yield sliding


def _normalized(mechanism: Mechanism, q: list[Node]) -> list[Node]:
    """Return coordinates with each quaternion divided by its length."""
    normal = list(q)
    for body in mechanism.bodies:
        for places in body.quaternions:
            length = sqrt(sum((q[k] ** 2 for k in places), ZERO))
            for k in places:
                normal[k] = q[k] / length
    return normal
