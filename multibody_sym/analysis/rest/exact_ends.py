"""Ends of ranges of rest in closed form: where the conditions that give way there contradict each other no more.

In: an end in floats. Out: its formula. At an end the equations of balance and the limits that meet there are one more
than their unknown forces: after elimination one equation for the parameter alone is left. Its root is taken if it is
the number.
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
from multibody_sym.analysis.rest.statics import Balance, Direction, Position, RestEnd, RestLimit, out_of_touch, statics
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
        return with_value(self.mechanism, self.name, self.end.value)

    def symbolic(self) -> Node | None:
        """Return the end in the names of the model, None where there is no closed form."""
        return self._form(numbers=False)

    def exact(self) -> Node | None:
        """Return the end as an exact number, with the declared values of other parameters put in; None for none."""
        return short_number(self._form(numbers=True))

    def _form(self, *, numbers: bool) -> Node | None:
        try:
            for equation in self.equations(numbers=numbers):
                for root in roots(equation, symbol(self.name)):
                    if fits(root, symbol(self.name), self.end.value, self.sample):
                        return with_doubles(root)
        except (NoClosedFormError, ExpressionError, MultibodyError, *UNDEFINED):
            pass
        return None

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
        declared = {symbol(entry.name): entry.value for entry in self.mechanism.parameters}
        for equal in (self.end.equal, tuple(range(len(balance.right)))):
            field = Field(_WORK, expands)
            known = {}
            for node, letter in given.letters.items():
                value = declared.get(node) if numbers and node not in (symbol(self.name), kept) else None
                known[node] = field.letter(node, letter) if value is None else exact(field, [value], {})[0]
            found = self._equations(field, known, balance, equal)
            yield from (equation for equation in found if symbol(self.name) in equation.symbols)

    @cached_property
    def _balance(self) -> tuple[SymbolicState, Balance]:
        """The state over Nodes at the end, at rest, and the conditions there."""
        at_end = self.at_end
        position = Position(at_end, start(at_end))
        given = declared_state(at_end, position.begin)
        whole = statics(at_end)
        parameters = [given.state.slots[at_end.parameters.slot(entry.name)] for entry in at_end.parameters]
        rest = [ZERO] * len(at_end.speeds)
        state = state_of(whole.mechanism, Node, ZERO, list(given.state.q), rest, parameters)
        motion = motion_of(whole.mechanism, state)
        balance = whole.balance(motion, self.end.limits, row_motions(motion))
        at_values = position.motion({}, moves=False)
        assert at_values is not None
        rows = row_motions(at_values)
        touching = frozenset(range(len(rows))) - (out_of_touch(position.statics, at_values, rows) or frozenset())
        return given, replace(
            balance,
            **{
                name: [[x if k in touching else 0 for k, x in enumerate(row)] for row in getattr(balance, name)]
                for name in ("equal", "limits")
            },
        )

    def _equations(
        self, field: Field, known: dict[Node, Quotient], balance: Balance, equal: Sequence[int]
    ) -> list[Quotient]:
        """Return what must vanish for some forces to balance at the limits."""
        curves = [limit.curve for limit in self.end.limits if limit.curve is not None]
        aside = [  # the multiplier along the other tangent of each part that slips along one
            next(row for row, x in zip(limit.curve.rubbing, limit.along, strict=True) if x == 0.0)
            for limit in self.end.limits
            if limit.curve is not None and limit.along is not None and 0.0 in limit.along
        ]
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
        together = _resultant(self.end.limits)
        if together is None:
            return self._turning(field, known, rows, len(equal)) if len(equal) == len(balance.right) else []
        if not together.is_unique(rows):
            return []
        forces = exact_solve([row[:-1] for row in rows], [row[-1] for row in rows])
        return [self._on_curve(field, known, forces, together)]

    def _turning(
        self, field: Field, known: dict[Node, Quotient], rows: Sequence[Sequence[Quotient]], count: int
    ) -> list[Quotient]:
        """Return what must vanish where all slipping parts turn about one place; `count` of the rows are balances."""
        curves = [limit.curve for limit in self.end.limits if limit.curve is not None]
        along = [limit.along for limit in self.end.limits if limit.curve is not None and limit.along is not None]
        if len(along) < len(curves) or any(len(curve.pressing) > 1 for curve in curves):
            return []
        bare = {k for limit in self.end.limits if limit.idle for k in (limit.terms[0][0], *limit.idle)}
        columns = list(zip(*(row[:-1] for row in rows[:count]), strict=True))
        ways = _slip_directions(columns, [curve.rubbing for curve in curves], bare, along)
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


def with_value(mechanism: Mechanism, name: str, value: float) -> Mechanism:
    """Return the mechanism with another value of a parameter."""
    entries = tuple(
        replace(entry, value=as_node(value)) if entry.name == name else entry for entry in mechanism.parameters
    )
    return replace(mechanism, parameters=ParameterVector(entries))


@dataclass(frozen=True)
class _Resultant:
    """Parts that slip as one: for each component of friction and normal force the multipliers that are its sum."""

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


def _resultant(limits: Sequence[RestLimit]) -> _Resultant | None:
    """Return the parts that slip as one: a single part, or all in one direction, as the feet of a body; None for none.

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


def _slip_directions(
    columns: Sequence[Sequence[Quotient]],
    rubbing: Sequence[Sequence[int]],
    bare: Collection[int],
    along: Sequence[Direction],
) -> list[list[Quotient]] | None:
    """Return the directions of slip, None where they are not the directions `along` in numbers.

    A motion y gives slip E_t^T y, E_t being the columns of friction in the balances. It is the motion that leaves all
    else at rest, `bare` multipliers apart, as a foot about which a body turns; else also the middle of slipping parts.
    """
    nothing = columns[0][0].field.constant(0)
    slips = [k for places in rubbing for k in places]
    held = [column for k, column in enumerate(columns) if k not in bare and k not in slips]
    middle = [
        [sum(parts, nothing) for parts in zip(*(columns[k] for k in places), strict=True)]
        for places in zip(*rubbing, strict=True)
    ]
    count = len(columns[0])
    for still in (held, [*held, *middle]):
        sample = np.array([[float(x.sample) for x in row] for row in still]).reshape(-1, count)
        if rank(sample, _DEPENDENT) == count - 1:  # all speeds follow from one
            break
    else:
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


def fits(root: Node, unknown: Node, value: float, sample: Mapping[Node, float]) -> bool:
    """Return whether an expression for a symbol has a value, and its printed text has it too."""
    if len(text(root)) > _LONGEST or unknown in leaves([root], "symbol"):
        return False
    try:
        again = evaluate_float([parse(text(with_doubles(root)))], dict(sample))[0]
    except (ExpressionError, *UNDEFINED):
        return False
    return abs(again - value) <= AGREEMENT * max(abs(value), AGREEMENT)


def short_number(found: Node | None) -> Node | None:
    """Return an expression if it is an exact number shorter than its decimals."""
    short = found is not None and len(text(found)) <= _LONGEST_NUMBER
    return found if short and found is not None and not leaves([found], "symbol") else None
