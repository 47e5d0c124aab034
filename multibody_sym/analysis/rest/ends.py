"""Ends of ranges of rest: on the circles of friction in space, and in closed form.

In: an end by tangents. Out: the end. At it a motion y of the system begins, with weights w, that no forces z resist:

    E z = r        E^T y + sum of w (mu e_n - d . e_t) + sum of w G = 0        t = mu n d,  |d| = 1,  G z = 0

The parameter is one more unknown: Newton's method begins at the tangents, which need not be many then.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from math import copysign, hypot
from typing import Final

import numpy as np

from multibody_sym.algebra.book_form import with_doubles
from multibody_sym.algebra.quotient_functions import conditions_left, exact, exact_solve, register_angles, sqrt
from multibody_sym.algebra.quotients import Field, Letter, NoClosedFormError, Quotient
from multibody_sym.algebra.roots import has_value, roots
from multibody_sym.analysis.rest.statics import (
    Balance,
    Direction,
    Position,
    RestEnd,
    RestLimit,
    out_of_touch,
    start_at_rest,
    statics,
)
from multibody_sym.derivation.symbolic_start import SymbolicState, declared_state
from multibody_sym.errors import ExpressionError, MultibodyError
from multibody_sym.mechanics.mechanism import Mechanism, ParameterVector
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.linear_inequalities import (
    Conditions,
    ConditionsAt,
    contradiction,
    linear_program,
    nearest,
    nonnegative_least_squares,
)
from multibody_sym.scalars.node import ZERO, Node, as_node, symbol
from multibody_sym.scalars.rank import least_squares, rank
from multibody_sym.text.printer import text

_ONE_WAY: Final = 1.0 - 1e-9
"""The part of the weights of tangents from which on their sum along the plane is that of one direction."""
_NOTHING: Final = 1e-7
"""The part of the largest force that is none."""
_TURNS: Final = 20
_NEAR: Final = 1e-2
"""The part of its size by which an end of tangents may be off the end itself."""
_DONE: Final = 1e-15
_LEFT: Final = 1e-11
"""What may be left of conditions of like size where an end fulfils them."""
_DEPENDENT: Final = 1e-10
_STEP: Final = 1e-6
_ROUNDED: Final = 1e-10
_RESISTED: Final = 1e-9
"""The part of the largest weight of limits up to which no force is missing that keeps a motion from what it goes to."""
_BEYOND: Final = 1e-9
"""The part of the largest force by which friction on a circle may seem to be beyond it."""


def sharpen_end(
    at: Callable[[Sequence[RestLimit]], ConditionsAt], end: RestEnd, limits: Sequence[RestLimit]
) -> RestEnd:
    """Return an end of tangents with its limits gathered, on the circles themselves where that end is found.

    `at` returns the conditions for limits as a function of the parameter.
    """
    one = _gather(at, end, limits)
    if end.choice.directions or not any(limit.along is not None for limit in one.limits):
        return one
    try:
        found = _Newton(at(one.limits), one, at, limits).found()
    except (ArithmeticError, np.linalg.LinAlgError):
        return one
    return found if found is not None and _holds(at(limits)(found.value), limits, found) else one


def _holds(conditions: Conditions | None, limits: Sequence[RestLimit], end: RestEnd) -> bool:
    """Return whether forces on the circles of an end, and within all other limits, balance there."""
    if conditions is None:
        return False
    rows = []
    for limit in end.limits:
        for k in limit.idle and (limit.terms[0][0], *limit.idle):
            rows.append(np.eye(conditions.equal.shape[1])[k])
        if limit.along is not None and limit.curve is not None:
            own = next(row.copy() for row, x in zip(conditions.cone, limits, strict=True) if x.curve == limit.curve)
            own[list(limit.curve.rubbing)] = 0.0
            rows += [np.eye(len(own))[k] - x * own for k, x in zip(limit.curve.rubbing, limit.along, strict=True)]
    equal = np.vstack([conditions.equal, *rows])
    right = np.concatenate([conditions.right, np.zeros(len(rows))])
    whole = Conditions(equal, right, conditions.cone, conditions.nothing)
    return contradiction(whole) is None and not any(beyond(nearest(whole), conditions, limits))


def beyond(forces: Floats, conditions: Conditions, limits: Sequence[RestLimit]) -> Iterator[tuple[str, Direction]]:
    """Yield the friction parts beyond their circles, and their directions, of forces within the tangents."""
    size, seen = float(np.abs(forces).max(initial=0.0)), set[str]()
    for row, limit in zip(conditions.cone, limits, strict=True):
        if limit.along is None or limit.curve is None or limit.part in seen:
            continue
        seen.add(limit.part)
        rubbing = list(limit.curve.rubbing)
        most = float(row @ forces - row[rubbing] @ forces[rubbing])
        x, y = forces[rubbing].tolist()
        if hypot(x, y) > most + _BEYOND * size:
            yield limit.part, (x, y)


def _gather(at: Callable[[Sequence[RestLimit]], ConditionsAt], end: RestEnd, limits: Sequence[RestLimit]) -> RestEnd:
    """Return an end with one limit for each part that gives way: slip along one direction, or no force at all.

    Tangents of one circle that are not one direction meet where there is no force: the contact opens.
    """
    slips: dict[str, list[tuple[RestLimit, float]]] = {}
    found = dict[RestLimit, float]()
    for limit, share in zip(end.limits, end.shares, strict=True):
        if limit.kind == "cone":
            slips.setdefault(limit.part, []).append((limit, share))
        else:
            found[limit] = share
    conditions = at(limits)(end.value) if any(len(several) > 1 for several in slips.values()) else None
    forces = None if conditions is None else np.abs(nearest(conditions))
    for several in slips.values():
        slip, whole = several[0][0], sum(share for _, share in several)
        opened = next((x for x in limits if x.idle and x.terms[0][0] == slip.terms[0][0]), None)
        x = y = 0.0
        for number, (limit, share) in enumerate(several):
            way = limit.along or ((-1.0) ** number, 0.0)  # along a line there are two, each other's opposite
            x, y = x + share * way[0], y + share * way[1]
        length = hypot(x, y)
        bare = forces is not None and forces[slip.terms[0][0]] <= _NOTHING * forces.max()
        if opened is not None and (opened in found or (bare and length < _ONE_WAY * whole)):
            found[opened] = found.get(opened, 0.0) + whole
        elif slip.along is None or not length > 0.0:
            found |= dict(several)
        else:
            found[slip.turned_to(_along_axis(x / length, y / length))] = whole
    return replace(end, limits=tuple(found), shares=tuple(found.values()))


def _along_axis(x: float, y: float) -> Direction:
    """Return a direction, exactly an axis where it is one but for rounding."""
    if min(abs(x), abs(y)) > _ROUNDED:
        return (x, y)
    return (copysign(1.0, x), 0.0) if abs(x) > abs(y) else (0.0, copysign(1.0, y))


@dataclass(frozen=True)
class _Newton:
    """Unknowns are the parameter, z (kept columns), y, weights, and the directions of what slips."""

    at: ConditionsAt
    end: RestEnd
    of: Callable[[Sequence[RestLimit]], ConditionsAt]
    limits: Sequence[RestLimit]

    @cached_property
    def first(self) -> Conditions:
        """The conditions at the end of tangents."""
        return self.conditions(self.end.value)

    def conditions(self, value: float) -> Conditions:
        found = self.at(value)
        if found is None:
            raise ArithmeticError("there are no conditions here")
        return found

    @cached_property
    def slips(self) -> list[int]:
        """The limits that are on a circle, by number."""
        return [k for k, limit in enumerate(self.end.limits) if limit.along is not None]

    @cached_property
    def straight(self) -> list[int]:
        """The other limits, without those of forces that are nothing."""
        return [k for k, x in enumerate(self.end.limits) if x.along is None and not x.idle]

    @cached_property
    def kept(self) -> list[int]:
        """The multipliers that may be forces."""
        gone = {k for x in self.end.limits if x.idle for k in (x.terms[0][0], *x.idle)}
        return [k for k in range(self.first.equal.shape[1]) if k not in gone]

    @cached_property
    def rubbing(self) -> list[list[int]]:
        """For what slips, the places of its two components among the kept multipliers."""
        curves = [self.end.limits[k].curve for k in self.slips]
        return [[self.kept.index(row) for row in curve.rubbing] for curve in curves if curve is not None]

    @cached_property
    def scales(self) -> tuple[Floats, float]:
        """Factors of the equations, and the size of forces."""
        lengths = np.linalg.norm(self.first.equal, axis=1)
        rows = 1.0 / np.where(lengths > 0.0, lengths, 1.0)
        return rows, float(np.abs(rows * self.first.right).max(initial=0.0)) or 1.0

    def parts(self, value: float) -> tuple[Floats, Floats, Floats, Floats]:
        """Return E, r, the rows of straight limits, and those of mu n of what slips, scaled."""
        found, (rows, size) = self.conditions(value), self.scales
        pressing = found.cone[self.slips][:, self.kept]
        for k, places in enumerate(self.rubbing):
            pressing[k, places] = 0.0
        equal = rows[:, None] * found.equal[:, self.kept]
        return equal, rows * found.right / size, found.cone[self.straight][:, self.kept], pressing

    @cached_property
    def begin(self) -> Floats:
        """The unknowns at the end of tangents."""
        E, r, G, C = self.parts(self.end.value)
        weights = np.array([self.end.shares[k] for k in (*self.straight, *self.slips)])
        ways = np.array([self.end.limits[k].along for k in self.slips], dtype=float).reshape(-1, 2)
        pulled = np.vstack([G, C])
        slides = []
        for k, places in enumerate(self.rubbing):
            pulled[len(G) + k, places] -= ways[k]
            slides.append(np.eye(len(self.kept))[places] - np.outer(ways[k], C[k]))
        fixed = np.vstack([E, G, *slides])
        z = least_squares(fixed, np.concatenate([r, np.zeros(len(fixed) - len(r))]))
        y = least_squares(E.T, -pulled.T @ weights)
        length = float(np.linalg.norm(y))
        if not length > 0.0:
            raise ArithmeticError("nothing moves")
        return np.concatenate([[self.end.value], z, y / length, weights / length, ways.ravel()])

    @cached_property
    def places(self) -> list[int]:
        """Where the unknowns after the parameter end: z, y, weights."""
        counts = [1, len(self.kept), len(self.first.equal), len(self.straight) + len(self.slips)]
        return [sum(counts[: k + 1]) for k in range(len(counts))]

    def left(self, X: Floats, parts: tuple[Floats, Floats, Floats, Floats]) -> Floats:
        """Return the residuals of all conditions."""
        E, r, G, C = parts
        _, z, y, weights, ways = np.split(X, self.places)
        ways = ways.reshape(-1, 2)
        moves = E.T @ y + np.vstack([G, C]).T @ weights
        slides = []
        for k, places in enumerate(self.rubbing):
            moves[places] -= weights[len(G) + k] * ways[k]
            slides.append(z[places] - (C[k] @ z) * ways[k])
        whole = [(ways * ways).sum(axis=1) - 1.0, [y @ np.split(self.begin, self.places)[2] - 1.0]]
        return np.concatenate([E @ z - r, moves, G @ z, *slides, *whole])

    def slope(self, X: Floats) -> Floats:
        """Return the derivative of the residuals: of bilinear conditions, and along the parameter by difference."""
        parts = self.parts(float(X[0]))
        step = _STEP * max(abs(float(X[0])), abs(self.end.value)) or _STEP
        ahead, behind = (self.left(X, self.parts(float(X[0]) + sign * step)) for sign in (1.0, -1.0))
        columns = [(ahead - behind) / (2.0 * step)]
        for k in range(1, len(X)):
            unit = np.zeros(len(X))
            unit[k] = 1.0
            # Conditions are at most of second degree: a central difference of any length is exact.
            columns.append((self.left(X + unit, parts) - self.left(X - unit, parts)) / 2.0)
        return np.array(columns).T

    def found(self) -> RestEnd | None:
        """Return the end where Newton's method settles near, with weights that still contradict."""
        X = self.begin.copy()
        size = abs(self.end.value) or 1.0
        for _ in range(_TURNS):
            step = least_squares(self.slope(X), -self.left(X, self.parts(float(X[0]))), _DEPENDENT)
            X += step
            if abs(X[0] - self.end.value) > _NEAR * size:
                return None
            if abs(step[0]) <= _DONE * size and np.abs(step).max() <= _LEFT:
                break
        left = np.abs(self.left(X, self.parts(float(X[0])))).max()
        _, _, _, weights, ways = np.split(X, self.places)
        if left > _LEFT or weights.min(initial=0.0) < -_LEFT:
            return None
        turned = list(self.end.limits)
        for k, (x, y) in zip(self.slips, ways.reshape(-1, 2).tolist(), strict=True):
            turned[k] = turned[k].turned_to(_along_axis(x, y))
        if not self.contradicts(X, turned):
            return None
        return replace(self.end, value=float(X[0]), limits=tuple(turned), on_circles=True)

    def contradicts(self, X: Floats, turned: Sequence[RestLimit]) -> bool:
        """Return whether forces that were taken to be none could not resist the motion y either.

        If one of them can, rest is possible beyond, by other forces.
        """
        gone = [k for k in range(self.first.equal.shape[1]) if k not in self.kept]
        if not gone:
            return True
        _, _, y, weights, _ = np.split(X, self.places)
        in_order = [turned[k] for k in (*self.straight, *self.slips)]
        given = self.of(in_order)(float(X[0]))
        if given is None:
            return False
        pulled = (self.scales[0][:, None] * given.equal).T @ y + given.cone.T @ weights
        against = list(self.limits)  # tangents of circles where the motion pulls most
        for k, limit in enumerate(self.limits):
            if limit.along is not None and limit.curve is not None:
                x, y = pulled[list(limit.curve.rubbing)].tolist()
                size = hypot(x, y)
                against[k] = limit.turned_to((x / size, y / size)) if size > 0.0 else limit
        bounds = self.of(against)(float(X[0]))
        assert bounds is not None
        own = np.array([not row[self.kept].any() for row in bounds.cone], dtype=bool)
        _, left = nonnegative_least_squares(bounds.cone[own][:, gone].T, -pulled[gone])
        return bool(left <= _RESISTED * float(np.abs(weights).max(initial=0.0)))


# --- ends that do not belong to their range of rest: towards them forces grow without bound --------------------------

_WAYS: Final = (1e-4, 1e-5)
"""How far inside an end (of its size, 1 at least) forces are compared, and at twice that."""
_POLE: Final = 1e-2
"""By how much the forces there may differ from those of a pole of first order, of which one is twice the other."""


def open_end(position: Position, name: str, end: RestEnd, outward: int) -> tuple[float, float] | None:
    """Return the pole of the least forces at an end of a range, and its error; None where they stay finite there."""
    found = [end.value]
    for way in _WAYS:
        near = found[-1] - outward * way * max(abs(end.value), 1.0)
        far = 2 * near - found[-1]
        one, two = (_least_force(position, name, end, x) for x in (near, far))
        if one is None or two is None or not abs(one - 2 * two) <= _POLE * one:
            return None
        found.append((one * near - two * far) / (one - two))
    return found[-1], abs(found[-1] - found[-2]) * _WAYS[1] / _WAYS[0]


def _least_force(position: Position, name: str, end: RestEnd, value: float) -> float | None:
    """Return the least size of the largest force that fulfils the conditions at a value, None where none does."""
    conditions = position.conditions({name: value}, position.statics.limits(end.choice), moves=True)
    if conditions is None:
        return None
    cone, equal = conditions.cone, conditions.equal
    n = equal.shape[1]
    one, unit = np.ones((n, 1)), np.eye(n)
    upper = np.block([[-cone, np.zeros((len(cone), 1))], [unit, -one], [-unit, -one]])
    equal = np.hstack([equal, np.zeros((len(equal), 1))])
    cost = np.r_[np.zeros(n), 1.0]
    free = [(None, None)] * len(cost)
    found = linear_program(cost, free, below=(upper, np.zeros(len(upper))), equal=(equal, conditions.right))
    return found.value if found.status == 0 else None


# ----------------------------------------------------------------------------------------------------------------------
# Ends of ranges of rest in closed form: where the conditions that give way there contradict each other no more.
#
# In: an end in floats. Out: its formula. At an end the equations of balance and the limits that meet there are one more
# than their unknown forces: after elimination one equation for the parameter alone is left. Its root is taken if it is
# the number.


_WORK: Final = 30_000
AGREEMENT: Final = 1e-12
"""How near a closed form must come to the number, relative to it."""
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
    def in_balance(self) -> tuple[SymbolicState, Mechanism]:
        """The state over Nodes at the end, at rest, and the mechanism with all that may touch stuck."""
        at_end = self.at_end
        given = declared_state(at_end, start_at_rest(at_end))
        whole = statics(at_end).mechanism
        parameters = [given.state.slots[at_end.parameters.slot(entry.name)] for entry in at_end.parameters]
        rest = [ZERO] * len(at_end.speeds)
        return replace(given, state=state_of(whole, Node, ZERO, list(given.state.q), rest, parameters)), whole

    @cached_property
    def _balance(self) -> tuple[SymbolicState, Balance]:
        """The state over Nodes at the end, at rest, and the conditions there."""
        at_end = self.at_end
        position = Position(at_end, start_at_rest(at_end))
        given, mechanism = self.in_balance
        motion = motion_of(mechanism, given.state)
        balance = statics(at_end).balance(motion, self.end.limits, row_motions(motion))
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
    return has_value(with_doubles(root), value, sample, AGREEMENT, AGREEMENT)


def short_number(found: Node | None) -> Node | None:
    """Return an expression if it is an exact number shorter than its decimals."""
    short = found is not None and len(text(found)) <= _LONGEST_NUMBER
    return found if short and found is not None and not leaves([found], "symbol") else None
