"""The Program of what one-way laws ask at an instant: all rows, whether they act or not, in weighted coordinates.

With M = G^T G: A = H G^-1, C = (what a unit multiplier exerts) G^-1, D what rows that define a force have of others,
r = gamma - H M^-1 f; and what decides which rows take part: gaps, rates, ways to edges, coefficients.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import reduce
from typing import Final

from multibody_sym.dynamics.formalisms.block_ldl import block_ldl
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.massless import massless_speeds
from multibody_sym.kinematics.contacts import reach
from multibody_sym.kinematics.energy import kinetic_energy
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.rows import RowMotion, coefficients, row_motions
from multibody_sym.kinematics.state import arrays, slot_state
from multibody_sym.model.mechanism.contact_rows import ContactRow
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.program.program import Program
from multibody_sym.program.rolling.rolled import rolled
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.functions import absolute, minimum, sqrt
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node
from multibody_sym.scalars.vectors import S

_ENDLESS: Final = as_node(1e300)


def every_row(mechanism: Mechanism) -> tuple[Row, ...]:
    """Return a mechanism's rows and those of its one-way elements after them."""
    return (*mechanism.rows, *(row for element in mechanism.one_way for row in element.rows))


def friction_parts(mechanism: Mechanism) -> tuple[tuple[OneWay, FrictionPart], ...]:
    """Return the friction parts that rub, with their elements."""
    pairs = ((element, part) for element in mechanism.one_way for part in element.frictions)
    return tuple((x, part) for x, part in pairs if part.enough or not (part.static is part.kinetic is ZERO))


def law_program(mechanism: Mechanism) -> tuple[Program, dict[str, list[int]]]:
    """Return (t, q, u, ...) -> what laws ask of a mechanism in no mode, and where the entries of its matrices stand.

    `phi`, `phidot` (m; zero where a row has none), `jacobian` H, `matrix` A, `exerted` C (m, n), `coupling` D (m, m),
    `right` r (m) of every row, `driven` (m) how long G M^-1 f is over all that it is joined to: a force, divided by how
    long its row of C is; `coefficients` (parts, 2: static, kinetic), `bounces`, `returns` and `reaches` (elements:
    restitution, normal and tangential, and how far the next end of a face is); `inverse` G^-1 (n, n), `free` M^-1 f
    (n), `energy` (J). Of the matrices H, A, C, D and G^-1 the outputs are the entries that may differ from zero, of C
    those that may differ from A's; their places count row by row.
    """
    trace = Trace("laws", arrays(mechanism))
    state = slot_state(mechanism)
    every = replace(mechanism, rows=every_row(mechanism))
    whole = replace(motion_of(mechanism, state), mechanism=every)
    rows, size = row_motions(whole), len(mechanism.speeds)
    dynamics = (composite_body if massless_speeds(mechanism) else block_ldl)(mechanism, state)
    weighted, free, count = dynamics.factors.weighted, dynamics.bias_acceleration, len(rows)
    units = [[ONE if k == j else ZERO for k in range(size)] for j in range(size)]
    columns = [dynamics.factors.unweighted(unit) for unit in units]
    right = [row.gamma - sum(h * x for h, x in zip(row.jacobian, free, strict=True)) for row in rows]
    parts = [part for _, part in friction_parts(mechanism)]
    elements = mechanism.one_way
    matrix = [weighted(row.jacobian) for row in rows]
    sparse = {
        "jacobian": _entries([row.jacobian for row in rows]),
        "matrix": _entries(matrix),
        "exerted": _entries([weighted(row.forces) for row in rows], beside=matrix),
        "coupling": {k * count + j: as_node(x) for k, row in enumerate(rows) for j, x in sorted(row.coupling.items())},
        "inverse": _entries([[column[k] for column in columns] for k in range(size)]),
    }

    def column(values: Iterable[S]) -> tuple[tuple[int], list[Node]]:
        nodes = [as_node(x) for x in values]
        return (len(nodes),), nodes

    program = trace.finish(
        {
            **{name: column(entries.values()) for name, entries in sparse.items()},
            "phi": column([row.phi if row.holonomic else ZERO for row in rows]),
            "phidot": column([row.phidot if row.kinematic else ZERO for row in rows]),
            "right": column(right),
            "driven": column(_driven(mechanism, rows, columns, dynamics.forcing, free)),
            "coefficients": ((len(parts), 2), [as_node(x) for part in parts for x in _coefficients(part, whole, rows)]),
            "bounces": column([element.restitution for element in elements]),
            "returns": column([element.tangential_restitution for element in elements]),
            "reaches": column([_reach(element, whole) for element in elements]),
            "free": column(free),
            "energy": ((), [as_node(kinetic_energy(whole))]),
        }
    )
    return rolled(program), {name: list(entries) for name, entries in sparse.items()}


def _entries(matrix: Sequence[Sequence[S]], beside: Sequence[Sequence[S]] | None = None) -> dict[int, Node]:
    """Return by their places the entries of a matrix that may differ from zero, or from those of another one."""
    nodes = [as_node(x) for row in matrix for x in row]
    others = [ZERO] * len(nodes) if beside is None else [as_node(x) for row in beside for x in row]
    return {k: node for k, (node, other) in enumerate(zip(nodes, others, strict=True)) if node is not other}


def _driven(
    mechanism: Mechanism,
    rows: Sequence[RowMotion],
    columns: Sequence[Sequence[S]],
    forcing: Sequence[S],
    free: Sequence[S],
) -> list[S]:
    """Return of each row the root of f . M^-1 f over the speeds it is joined to, by masses and by what holds both ways.

    `columns` are those of G^-1, `forcing` is f and `free` M^-1 f.
    """
    own = [_moving(row.jacobian) | _moving(row.forces) for row in rows]
    joined = disjoint([*map(_moving, columns), *own[: len(mechanism.rows)]])
    reached = [sorted(set().union(*(each for each in joined if each & speeds))) for speeds in own]
    return [sqrt(absolute(sum((forcing[k] * free[k] for k in speeds), start=ZERO))) for speeds in reached]


def _moving(values: Sequence[S]) -> set[int]:
    return {k for k, value in enumerate(values) if as_node(value) is not ZERO}


def disjoint(sets: Iterable[set[int]]) -> list[set[int]]:
    """Return the unions of sets that have members in common, which have none in common."""
    found: list[set[int]] = []
    for each in sets:
        apart = [other for other in found if not other & each]
        found = [*apart, each.union(*(other for other in found if other & each))]
    return found


def _coefficients(part: FrictionPart, motion: Motion, rows: Sequence[RowMotion]) -> list[S]:
    """Return the static and the kinetic coefficient; where friction is smooth both are what it has at its speed."""
    static, kinetic = coefficients(motion, part.rows, [part.static, part.kinetic])
    if part.regularised is None:
        return [static, kinetic]
    names = [row.name for row in motion.mechanism.rows]
    square = sum(rows[names.index(row.name)].phidot ** 2 for row in part.rows)
    (least,) = motion.state.values([part.regularised])
    return [kinetic * sqrt(square) / sqrt(square + least * least)] * 2


def _reach(element: OneWay, motion: Motion) -> S:
    """Return how far what may touch is inside the end of a face, negative beyond it."""
    row = element.normals[0] if element.normals else None
    ways = reach(row, motion) if isinstance(row, ContactRow) else []
    return reduce(minimum, ways) if ways else _ENDLESS
