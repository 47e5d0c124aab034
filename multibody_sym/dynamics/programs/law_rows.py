"""The Program of what one-way laws ask at an instant: all rows, whether they act or not, in weighted coordinates.

With M = G^T G: A = H G^-1, C = (what a unit multiplier exerts) G^-1, D what rows that define a force have of others,
r = gamma - H M^-1 f; and what decides which rows take part: gaps, rates, ways to edges, coefficients.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from typing import Final

from multibody_sym.dynamics.formalisms.block_ldl import block_ldl
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.equations import Formalism
from multibody_sym.dynamics.formalisms.massless import massless_speeds
from multibody_sym.kinematics.contacts import allowed_past_end, reach
from multibody_sym.kinematics.energy import kinetic_energy
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.rows import RowMotion, acting_rows, coefficients, row_motions
from multibody_sym.kinematics.state import arrays, slot_state
from multibody_sym.model.mechanism.contact_rows import ContactRow
from multibody_sym.model.mechanism.every_mode import every_row, friction_parts
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay
from multibody_sym.program.program import Program
from multibody_sym.program.rolling.rolled import rolled
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import absolute, minimum, sqrt
from multibody_sym.scalars.limits import creeping
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node
from multibody_sym.scalars.vectors import S

_ENDLESS: Final = as_node(1e300)


def law_program(mechanism: Mechanism, known: RowProgram) -> tuple[Program, dict[str, list[int]]]:
    """Return (t, q, u, ...) -> what laws ask of a mechanism in no mode, and where the entries of its matrices stand.

    It is what `row_program` tells, which is `known`, but for gamma and forcing; and `driven` (m) how long G M^-1 f is
    over all that a row is joined to: a force, divided by how long its row of C is; `bounces`, `returns` and `reaches`
    (elements: restitution, normal and tangential, and how far the next end of a face is); `past_ends` (elements: how
    far, in m, beyond that counts as there at most); `energy` (J).
    """
    trace, elements = Trace("laws", arrays(mechanism)), mechanism.one_way
    motion = motion_of(mechanism, slot_state(mechanism))
    outputs = known.called(trace, [trace[array.name] for array in trace.inputs])
    driven = _driven(mechanism, known, outputs)
    del outputs["gamma"], outputs["forcing"]
    program = trace.finish(
        {
            **{name: column(values) for name, values in outputs.items()},
            "coefficients": ((len(outputs["coefficients"]) // 2, 2), outputs["coefficients"]),
            "driven": column(driven),
            "bounces": column([element.restitution for element in elements]),
            "returns": column([element.tangential_restitution for element in elements]),
            "reaches": column([_least(reach, element, motion) for element in elements]),
            "past_ends": column([_least(allowed_past_end, element, motion) for element in elements]),
            "energy": ((), [as_node(kinetic_energy(motion))]),
        }
    )
    return rolled(program), {name: list(places) for name, places in known.places.items()}


@dataclass(frozen=True, eq=False)
class RowProgram:
    """The Program `rows` of all rows of a mechanism in no mode, and the places of what it computes of each matrix.

    `may_act` are the rows that do not vanish identically.
    """

    program: Program
    places: Mapping[str, Sequence[int]]
    count: int
    size: int
    may_act: frozenset[int]

    def called(self, trace: Trace, given: Sequence[Sequence[Node]]) -> dict[str, tuple[Node, ...]]:
        """Return the outputs by name of a call in a trace, for the inputs that every Program of a system has."""
        outputs = trace.call(self.program, given)
        return {output.name: values for output, values in zip(self.program.outputs, outputs, strict=True)}

    def moves(self, row: int) -> set[int]:
        """Return the speeds that a row names or acts on."""
        places = (place for name in ("jacobian", "matrix", "exerted") for place in self.places[name])
        return {place % self.size for place in places if place // self.size == row}

    def columns(self) -> list[set[int]]:
        """Return by column of G^-1 the speeds in it."""
        places = self.places["inverse"]
        return [{place // self.size for place in places if place % self.size == j} for j in range(self.size)]

    @property
    def coupled(self) -> list[int]:
        """The rows whose multipliers others are defined by, in order."""
        return sorted({place % self.count for place in self.places["coupling"]})

    def matrix(self, name: str, outputs: Mapping[str, Sequence[Node]]) -> list[list[Node]]:
        """Return a matrix row by row from what a call gives."""
        width = self.size if name != "coupling" else self.count
        entries = dict(zip(self.places[name], outputs[name], strict=True))
        if name == "exerted":
            entries = dict(zip(self.places["matrix"], outputs["matrix"], strict=True)) | entries
        height = self.size if name == "inverse" else self.count
        return [[entries.get(k * width + j, ZERO) for j in range(width)] for k in range(height)]


def row_program(mechanism: Mechanism, formalism: Formalism | None = None) -> RowProgram:
    """Return (t, q, u, ...) -> all rows of a mechanism in no mode, whether they act or not, and the free motion.

    The formalism of least cost computes it, or the given one.

    `phi`, `phidot` (m; zero where a row has none), `gamma`, `jacobian` H, `matrix` A, `exerted` C (m, n), `coupling` D
    (m, m), `right` r (m) of every row; `coefficients` (parts, 2: static, kinetic) row by row; `inverse` G^-1 (n, n),
    `free` M^-1 f and `forcing` f (n). Of the matrices H, A, C, D and G^-1 the outputs are the entries that may differ
    from zero, of C those that may differ from A's; their places count row by row.
    """
    trace = Trace("rows", arrays(mechanism))
    state = slot_state(mechanism)
    every = replace(mechanism, rows=every_row(mechanism))
    whole = replace(motion_of(mechanism, state), mechanism=every)
    rows, size = row_motions(whole), len(mechanism.speeds)
    dynamics = (formalism or (composite_body if massless_speeds(mechanism) else block_ldl))(mechanism, state)
    weighted, free, count = dynamics.factors.weighted, dynamics.bias_acceleration, len(rows)
    units = [[ONE if k == j else ZERO for k in range(size)] for j in range(size)]
    columns = [dynamics.factors.unweighted(unit) for unit in units]
    parts = [part for _, part in friction_parts(mechanism)]
    matrix = [weighted(row.jacobian) for row in rows]
    sparse = {
        "jacobian": _entries([row.jacobian for row in rows]),
        "matrix": _entries(matrix),
        "exerted": _entries([weighted(row.forces) for row in rows], beside=matrix),
        "coupling": {k * count + j: as_node(x) for k, row in enumerate(rows) for j, x in sorted(row.coupling.items())},
        "inverse": _entries([[column[k] for column in columns] for k in range(size)]),
    }
    right = [row.gamma - sum(h * x for h, x in zip(row.jacobian, free, strict=True)) for row in rows]
    program = trace.finish(
        {
            **{name: column(entries.values()) for name, entries in sparse.items()},
            "phi": column([row.phi if row.holonomic else ZERO for row in rows]),
            "phidot": column([row.phidot if row.kinematic else ZERO for row in rows]),
            "gamma": column([row.gamma for row in rows]),
            "right": column(right),
            "coefficients": column([x for part in parts for x in _coefficients(part, whole, rows)]),
            "free": column(free),
            "forcing": column(dynamics.forcing),
        }
    )
    places = {name: list(entries) for name, entries in sparse.items()}
    return RowProgram(rolled(program), places, count, size, frozenset(acting_rows(rows)))


def column(values: Iterable[S]) -> tuple[tuple[int], list[Node]]:
    """Return values as an output of a Program."""
    nodes = [as_node(x) for x in values]
    return (len(nodes),), nodes


def _entries(matrix: Sequence[Sequence[S]], beside: Sequence[Sequence[S]] | None = None) -> dict[int, Node]:
    """Return by their places the entries of a matrix that may differ from zero, or from those of another one."""
    nodes = [as_node(x) for row in matrix for x in row]
    others = [ZERO] * len(nodes) if beside is None else [as_node(x) for row in beside for x in row]
    return {k: node for k, (node, other) in enumerate(zip(nodes, others, strict=True)) if node is not other}


def _driven(mechanism: Mechanism, known: RowProgram, outputs: Mapping[str, Sequence[Node]]) -> list[S]:
    """Return of each row the root of f . M^-1 f over the speeds it is joined to, by masses and by what holds both ways.

    f is the forcing and M^-1 f the free motion.
    """
    own = [known.moves(k) for k in range(known.count)]
    joined = disjoint([*known.columns(), *own[: len(mechanism.rows)]])
    reached = [sorted(set().union(*(each for each in joined if each & speeds))) for speeds in own]
    f, free = outputs["forcing"], outputs["free"]
    return [sqrt(absolute(sum((f[k] * free[k] for k in speeds), start=ZERO))) for speeds in reached]


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
    velocity = [rows[names.index(row.name)].phidot for row in part.rows]
    return [creeping(kinetic, velocity, *motion.state.values([part.regularised]))] * 2


def _least(measure: Callable[[ContactRow, Motion], list[S]], element: OneWay, motion: Motion) -> S:
    """Return the least of what is measured of a contact."""
    row = element.normals[0] if element.normals else None
    found = measure(row, motion) if isinstance(row, ContactRow) else []
    return reduce(minimum, found) if found else _ENDLESS
