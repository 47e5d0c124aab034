"""Steps of questions about structures at rest: virtual work of what one support left free, and why a force is open.

In: a solved start at rest. Out: lines.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator
from functools import reduce
from typing import Final

import numpy as np

from multibody_sym.algebra.quotient_functions import exact_solve
from multibody_sym.algebra.quotients import Quotient
from multibody_sym.answers.ask.working import equation, written
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.records import Formula, Line, Sentence
from multibody_sym.derivation.symbolic_start import linear_equations
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import ZERO, Node, add, as_node, multiply, quantity, symbol
from multibody_sym.scalars.rank import CLOSED, rank

_MOST_FREEDOMS: Final = 6
_OF_ROWS: Final = ("multiplier", "tension")


def open_force_lines(solved: SolvedInstant) -> Iterator[Line]:
    """Yield why a force is not unique."""
    count = len(solved.others)
    forces = f"{count} force{'s' if count > 1 else ''}"
    if any(element.frictions for element in solved.mechanism.one_way):
        yield Sentence((f"not unique: equilibrium leaves {forces} open, as contacts that stick share what they bear",))
        return
    yield Sentence((f"not unique: equilibrium leaves {forces} open (statically indeterminate to the degree {count})",))
    yield Sentence(("the deformation decides, which rigid bodies do not have",))


def virtual_work_lines(solved: SolvedInstant, asked: Node) -> Iterator[Line]:
    """Yield the force of a constraint by virtual work: without it a structure of several bodies has one freedom.

    Nothing where several forces are asked for, or constraints depend on each other. Raises NoClosedFormError.
    """
    named = [x for x in leaves([asked], "quantity") if x.data[0] in _OF_ROWS]
    rows = [k for k, row in enumerate(solved.mechanism.rows) if len(named) == 1 and row.name == named[0].data[1][0]]
    speeds = solved.mechanism.speeds
    size = len(speeds)
    if not rows or len(solved.mechanism.rows) != size or not 1 < size <= _MOST_FREEDOMS or solved.forms is None:
        return
    matrix, right = linear_equations(solved.nodes.motion)
    jacobian = [solved.forms.of(map(as_node, row[:size])) for row in matrix[size:]]
    forces = solved.forms.of(map(as_node, right[:size]))
    held = [row for k, row in enumerate(jacobian) if k != rows[0]]
    free = next(k for k in range(size) if _is_regular([[*row[:k], *row[k + 1 :]] for row in held]))
    others = [k for k in range(size) if k != free]
    moved = exact_solve([[row[k] for k in others] for row in held], [-row[free] for row in held])
    ratios = {free: solved.forms.field.constant(1), **dict(zip(others, moved, strict=True))}
    yield Sentence((f"virtual work: without {named[0].data[1][0]} one freedom is left",))
    names = [symbol(f"delta_{_moved(solved, k)}") for k in range(size)]
    for k in others:
        yield equation(names[k], multiply(written(ratios[k]), names[free]))
    work, arm = (reduce(operator.add, (x[k] * ratios[k] for k in range(size))) for x in (forces, jacobian[rows[0]]))
    total = add(written(work), multiply(written(arm), quantity(*named[0].data)))
    yield Formula((symbol("delta_W"), multiply(total, names[free]), ZERO))


def _is_regular(rows: list[list[Quotient]]) -> bool:
    return rank(np.array([[float(x.sample) for x in row] for row in rows]), CLOSED) == len(rows)


def _moved(solved: SolvedInstant, place: int) -> str:
    """Return the name of the coordinate of which a speed is the rate, else the speed's."""
    rates = {u: q for body in solved.mechanism.bodies for q, u in body.rate_pairs}
    return solved.mechanism.coordinates[rates[place]].name if place in rates else solved.mechanism.speeds[place].name
