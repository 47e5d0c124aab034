"""Ends of ranges of rest in closed form: where the conditions that give way there contradict each other no more.

At an end the equations of balance and the limits that meet there are one more than they have unknown forces: what is
left after these are eliminated vanishes, an equation for the parameter alone. Its root is taken if it is the number.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.algebra.book_form import with_doubles
from multibody_sym.algebra.quotient_functions import conditions_left, exact, exact_solve, register_angles, sqrt
from multibody_sym.algebra.quotients import Field, Letter, NoClosedFormError, Quotient
from multibody_sym.algebra.roots import roots
from multibody_sym.analysis.rest.statics import (
    Balance,
    Direction,
    Position,
    RestEnd,
    RestLimit,
    Statics,
    out_of_touch,
    statics,
)
from multibody_sym.derivation.symbolic_start import SymbolicState, declared_state
from multibody_sym.dynamics.start.start import start
from multibody_sym.errors import ExpressionError, MultibodyError
from multibody_sym.mechanics.mechanism import Mechanism, ParameterVector
from multibody_sym.mechanics.motion import motion_of
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.mechanics.state import state_of
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import ZERO, Node, as_node, symbol
from multibody_sym.scalars.rank import rank
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import text

_WORK: Final = 30_000
AGREEMENT: Final = 1e-12
"""How near a closed form must come to the number, relative to it."""
_DEPENDENT: Final = 1e-10
_ALIKE: Final = 1e-9
_LONGEST: Final = 160
_LONGEST_NUMBER: Final = 32


@dataclass(frozen=True)
class ExactEnd:
    """An end of a range of the parameter `name` over Nodes, at its value there."""

    mechanism: Mechanism
    name: str
    end: RestEnd

    @cached_property
    def at_end(self) -> Mechanism:
        """The mechanism with the value of the end."""
        entries = tuple(
            replace(entry, value=as_node(self.end.value)) if entry.name == self.name else entry
            for entry in self.mechanism.parameters
        )
        return replace(self.mechanism, parameters=ParameterVector(entries))

    def symbolic(self) -> Node | None:
        """Return the end in the names of the model, None where there is no closed form."""
        return self._found(numbers=False)

    def exact(self) -> Node | None:
        """Return the end as an exact number, with what is declared of the other parameters put in; None for none."""
        return short_number(self._found(numbers=True))

    def _found(self, *, numbers: bool) -> Node | None:
        try:
            return next(self._roots(numbers), None)
        except (NoClosedFormError, ExpressionError, MultibodyError, *UNDEFINED):
            return None

    def _roots(self, numbers: bool) -> Iterator[Node]:
        for equation in self.equations(numbers=numbers):
            for root in roots(equation, symbol(self.name)):
                if fits(root, symbol(self.name), self.end.value, self.sample):
                    yield with_doubles(root)

    @cached_property
    def sample(self) -> dict[Node, float]:
        """The values of symbols at the end."""
        return {node: float(letter.sample) for node, letter in self._balance[0].letters.items()}

    @property
    def letters(self) -> Mapping[Node, Letter]:
        """The letters of symbols at the end."""
        return self._balance[0].letters

    def equations(self, *, numbers: bool, kept: Node | None = None, expands: bool = False) -> Iterator[Quotient]:
        """Yield what must vanish at the end, over all symbols, or with `numbers` in place of all but it and `kept`.

        Sines of sums of angles are written out if `expands`.
        """
        given, balance = self._balance
        for equal in (self.end.equal, tuple(range(len(balance.right)))):
            field = Field(_WORK, expands)
            known = self._known(field, given, numbers, {symbol(self.name), kept})
            found = self._equations(field, known, balance, equal)
            yield from (equation for equation in found if symbol(self.name) in equation.symbols)

    def _known(
        self, field: Field, given: SymbolicState, numbers: bool, kept: Collection[Node | None]
    ) -> dict[Node, Quotient]:
        """Return what symbols stand for: letters, or the exact values of all that are not `kept`."""
        known = {}
        declared = {symbol(entry.name): entry.value for entry in self.mechanism.parameters}
        for node, letter in given.letters.items():
            value = declared.get(node)
            if numbers and value is not None and node not in kept:
                known[node] = exact(field, [value], {})[0]
            else:
                known[node] = field.letter(node, letter)
        return known

    @cached_property
    def _balance(self) -> tuple[SymbolicState, Balance]:
        """The state over Nodes at the end, at rest, and the conditions there."""
        at_end = self.at_end
        given = declared_state(at_end, start(at_end))
        whole = self._whole
        parameters = [given.state.slots[at_end.parameters.slot(entry.name)] for entry in at_end.parameters]
        rest = [ZERO] * len(at_end.speeds)
        state = state_of(whole.mechanism, Node, ZERO, list(given.state.q), rest, parameters)
        motion = motion_of(whole.mechanism, state)
        balance = whole.balance(motion, self.end.limits, row_motions(motion))
        touching = self._carrying
        return given, replace(
            balance,
            **{
                name: [[x if k in touching else 0 for k, x in enumerate(row)] for row in getattr(balance, name)]
                for name in ("equal", "limits")
            },
        )

    @cached_property
    def _whole(self) -> Statics:
        return statics(self.at_end)

    @cached_property
    def _carrying(self) -> frozenset[int]:
        """The rows that have forces at the end."""
        at_end = self.at_end
        position = Position(at_end, start(at_end))
        motion = position.motion({}, moves=False)
        assert motion is not None
        rows = row_motions(motion)
        return frozenset(range(len(rows))) - (out_of_touch(position.statics, motion, rows) or frozenset())

    def _equations(
        self, field: Field, known: dict[Node, Quotient], balance: Balance, equal: Sequence[int]
    ) -> list[Quotient]:
        """Return what must vanish for some forces to balance at the limits."""
        curves = [limit.curve for limit in self.end.limits if limit.curve is not None]
        aside = _beside_tangents(self.end.limits)
        in_line = len(curves) > 1 and len(aside) == len(curves)
        bare = [k for limit in self.end.limits for k in limit.idle]
        held = [k for k, limit in enumerate(self.end.limits) if in_line or limit.curve is None]
        nothing = [[int(k == place) for k in range(len(balance.equal[0]))] for place in (*bare, *(aside * in_line))]
        matrix = [*(balance.equal[k] for k in equal), *(balance.limits[k] for k in held), *nothing]
        right = [*(balance.right[k] for k in equal), *([0] * (len(held) + len(nothing)))]
        nodes = [[as_node(x) for x in (*row, r)] for row, r in zip(matrix, right, strict=True)]
        register_angles(field, [x for row in nodes for x in row], known)
        rows = [exact(field, row, known) for row in nodes]
        if in_line or not curves:
            left = conditions_left([row[:-1] for row in rows], [row[-1] for row in rows])
            return left if not in_line or len(left) == 1 else []
        together = _together(self.end.limits)
        if together is None:
            return self._turned(field, known, rows, len(equal)) if len(equal) == len(balance.right) else []
        if not together.is_unique(rows):
            return []
        forces = exact_solve([row[:-1] for row in rows], [row[-1] for row in rows])
        return [self._on_curve(field, known, forces, together)]

    def _turned(
        self, field: Field, known: dict[Node, Quotient], rows: Sequence[Sequence[Quotient]], count: int
    ) -> list[Quotient]:
        """Return what must vanish where all that slips turns about one place; `count` of the rows are balances."""
        curves = [limit.curve for limit in self.end.limits if limit.curve is not None]
        along = [limit.along for limit in self.end.limits if limit.curve is not None and limit.along is not None]
        if len(along) < len(curves) or any(len(curve.pressing) > 1 for curve in curves):
            return []
        bare = {k for limit in self.end.limits if limit.idle for k in (limit.terms[0][0], *limit.idle)}
        columns = list(zip(*(row[:-1] for row in rows[:count]), strict=True))
        ways = _turning(columns, [curve.rubbing for curve in curves], bare, along)
        if ways is None:
            return []
        slots = self._balance[0].state.slots
        inside = [as_node(x) for x in evaluate([curve.coefficient for curve in curves], slots)]
        whole = [list(row) for row in rows]
        for curve, way, mu in zip(curves, ways, exact(field, inside, known), strict=True):
            for place, x in zip(curve.rubbing, way, strict=True):
                line = [field.constant(0)] * len(rows[0])
                line[place], line[curve.pressing[0]] = field.constant(1), -(mu * x)
                whole.append(line)
        left = conditions_left([row[:-1] for row in whole], [row[-1] for row in whole])
        return left if len(left) == 1 else []

    def _on_curve(self, field: Field, known: dict[Node, Quotient], forces: list[Quotient], one: _Resultant) -> Quotient:
        """Return t . t - coefficient^2 N . N."""
        inside = as_node(evaluate([one.coefficient], self._balance[0].state.slots)[0])
        coefficient = exact(field, [inside], known)[0]
        nothing = field.constant(0)
        squares = []
        for components in (one.rubbing, one.pressing):
            sums = [sum((forces[k] for k in places), nothing) for places in components]
            squares.append(sum((x * x for x in sums), nothing))
        rubbing, pressing = squares
        return rubbing - coefficient * coefficient * pressing


@dataclass(frozen=True)
class _Resultant:
    """What slips as one: of each component of friction and of the normal force the multipliers that are its sum."""

    rubbing: list[tuple[int, ...]]
    pressing: list[tuple[int, ...]]
    coefficient: Node

    def is_unique(self, rows: Sequence[Sequence[Quotient]]) -> bool:
        """Return whether equations (coefficients, right side) determine all components."""
        matrix = np.array([[float(x.sample) for x in row[:-1]] for row in rows], dtype=float)
        sums = np.zeros((len(self.rubbing) + len(self.pressing), matrix.shape[1]))
        for row, places in zip(sums, (*self.rubbing, *self.pressing), strict=True):
            row[list(places)] = 1.0
        return rank(np.vstack([matrix, sums]), _DEPENDENT) == rank(matrix, _DEPENDENT)


def _together(limits: Sequence[RestLimit]) -> _Resultant | None:
    """Return what slips as one: alone, or all in one direction, as the feet do of what is not turned; None for none.

    Where all slip along d by one coefficient, |sum of t| = sum of mu N, however these are shared.
    """
    curved = [(limit, limit.curve) for limit in limits if limit.curve is not None]
    (_, first), *others = curved
    if not others:
        return _Resultant([(k,) for k in first.rubbing], [(k,) for k in first.pressing], first.coefficient)
    ways = [x.along for x, _ in curved if x.along is not None]
    curves = [curve for _, curve in curved]
    alike = all(x.coefficient == first.coefficient and len(x.pressing) == 1 for x in curves)
    if not alike or len(ways) < len(curves) or np.ptp(np.array(ways), axis=0).max() > _ALIKE:
        return None
    return _Resultant(
        list(zip(*(x.rubbing for x in curves), strict=True)), [tuple(x.pressing[0] for x in curves)], first.coefficient
    )


def _turning(
    columns: Sequence[Sequence[Quotient]],
    rubbing: Sequence[Sequence[int]],
    bare: Collection[int],
    along: Sequence[Direction],
) -> list[list[Quotient]] | None:
    """Return the directions of what slips, None where they are not those `along` which it does in numbers.

    A motion y gives slip E_t^T y, E_t being the columns of friction in the balances. It is the one that leaves all else
    at rest, `bare` multipliers apart, as a foot that something turns about; else the middle of what slips besides.
    """
    nothing = columns[0][0].field.constant(0)
    slips = [k for places in rubbing for k in places]
    held = [column for k, column in enumerate(columns) if k not in bare and k not in slips]
    middle = [
        [sum(parts, nothing) for parts in zip(*(columns[k] for k in places), strict=True)]
        for places in zip(*rubbing, strict=True)
    ]
    still = next((rows for rows in (held, [*held, *middle]) if _leave_one_motion(rows, len(columns[0]))), None)
    if still is None:
        return None
    first, sense = max(((k, x) for k, x in zip(slips, np.ravel(along), strict=True)), key=lambda each: abs(each[1]))
    moves = exact_solve([*still, columns[first]], [*([nothing] * len(still)), nothing + (1 if sense > 0 else -1)])
    ways = []
    for places in rubbing:
        speeds = [sum((a * y for a, y in zip(columns[k], moves, strict=True)), nothing) for k in places]
        length = sqrt(sum((v * v for v in speeds), nothing))
        if length.is_zero:
            return None
        ways.append([v / length for v in speeds])
    found = np.array([[float(x.sample) for x in way] for way in ways])
    return ways if np.abs(found - along).max() <= _ALIKE else None


def _leave_one_motion(rows: Sequence[Sequence[Quotient]], count: int) -> bool:
    """Return whether all of `count` speeds follow from one where the rows times them vanish."""
    return rank(np.array([[float(x.sample) for x in row] for row in rows]).reshape(-1, count), _DEPENDENT) == count - 1


def _beside_tangents(limits: Sequence[RestLimit]) -> list[int]:
    """Return for what slips along one of its two tangents the multiplier along the other, by number."""
    return [
        next(row for row, x in zip(limit.curve.rubbing, limit.along, strict=True) if x == 0.0)
        for limit in limits
        if limit.curve is not None and limit.along is not None and 0.0 in limit.along
    ]


def fits(root: Node, unknown: Node, value: float, sample: Mapping[Node, float]) -> bool:
    """Return whether an expression for a symbol has a value, and what is printed of it too."""
    if len(text(root)) > _LONGEST or unknown in leaves([root], "symbol"):
        return False
    try:
        again = evaluate_float([parse(text(with_doubles(root)))], dict(sample))[0]
    except (ExpressionError, *UNDEFINED):
        return False
    return abs(again - value) <= AGREEMENT * max(abs(value), AGREEMENT)


def short_number(found: Node | None) -> Node | None:
    """Return an expression if it is an exact number that tells more than its decimals."""
    short = found is not None and len(text(found)) <= _LONGEST_NUMBER
    return found if short and found is not None and not leaves([found], "symbol") else None
