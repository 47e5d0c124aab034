"""The Program that poses the law problem at an instant: all rows, whether they act or not, in weighted coordinates.

With M = G^T G: A = H G^-1, C = (forces of unit multipliers) G^-1, D the coupling of rows that define a force,
r = gamma - H M^-1 f; and gaps, rates, distances to edges and coefficients, which decide which rows take part.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial, reduce
from itertools import accumulate, pairwise
from typing import Final

from multibody_sym.dynamics.formalisms.articulated_body import tree_dynamics_of
from multibody_sym.dynamics.formalisms.equations import Formalism, coupled_groups
from multibody_sym.dynamics.programs.quantities import column
from multibody_sym.dynamics.programs.reactions import SwitchingValues
from multibody_sym.dynamics.programs.repeated_contacts import LikeContacts, Weighted, like_contacts
from multibody_sym.mechanics.contact_geometry import allowed_past_end, reach
from multibody_sym.mechanics.energy import kinetic_energy, split
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces, carried_by_flows
from multibody_sym.mechanics.law_elements import FrictionPart, LawElement
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.modes import every_row, friction_parts
from multibody_sym.mechanics.motion import Motion, arrays, motion_of, slot_state
from multibody_sym.mechanics.row_kinematics import acting_rows, coefficients, row_motions
from multibody_sym.mechanics.row_records import Row as ConstraintRow
from multibody_sym.program.loops import with_loops
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import absolute, minimum, sqrt
from multibody_sym.scalars.limits import creep_coefficient
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, real
from multibody_sym.scalars.vectors import S, dot

# ----------------------------------------------------------------------------------------------------------------------
# SlidingForces in Programs of all modes: forces and multipliers of rows, with those of sliding parts.
#
# A sliding part exerts its limit along its slip, for a unit of the force that presses it: its normals carry that along.


_SHORT: Final = real(1e-300)
"""The square of a force that has no direction."""

Row = dict[int, Node]
"""The elements of a row of a matrix that may differ from zero, by their columns."""


@dataclass(frozen=True)
class SlidingForces:
    """A friction part: the places of its normals, each with its side, and of its tangents with the forces along them.

    These are for a unit normal force, zero where it does not slide. `norm`: the length of the normals presses.
    """

    normals: list[int]
    sides: list[Node]
    tangents: list[int]
    forces: Sequence[Node]
    norm: bool

    def by_sides(self) -> Iterator[tuple[int, int, Node]]:
        """Yield places of a normal and a tangent, with the force along this for a unit of the normal's multiplier."""
        for normal, side in zip(self.normals, self.sides, strict=True):
            for tangent, force in zip(self.tangents, self.forces, strict=True):
                yield normal, tangent, side * force

    def along(self, multipliers: Sequence[Node]) -> SlidingForces:
        """Return the part with the direction of its reaction for sides: |F| = d . F with the direction d of F."""
        F = [multipliers[k] for k in self.normals]
        size = as_node(sqrt(sum((x * x for x in F), _SHORT)))
        return replace(self, sides=[x / size for x in F]) if self.norm else self


def with_sliding(exerted: Sequence[Row], frictions: Iterable[SlidingForces]) -> list[Row]:
    """Return the forces of rows: those of normals with the friction of sliding parts."""
    found = [dict(row) for row in exerted]
    for normal, tangent, force in (each for friction in frictions for each in friction.by_sides()):
        for k, x in exerted[tangent].items():
            found[normal][k] = found[normal].get(k, ZERO) + force * x
    return found


def with_friction(multipliers: Sequence[Node], frictions: Iterable[SlidingForces]) -> list[Node]:
    """Return the multipliers of all rows with those of sliding parts."""
    found = list(multipliers)
    for normal, tangent, force in (each for friction in frictions for each in friction.by_sides()):
        found[tangent] = found[tangent] + force * multipliers[normal]
    return found


def combination(parts: Iterable[tuple[S, Row]]) -> Row:
    """Return the sum of rows, each times its factor."""
    found: Row = {}
    for factor, row in parts:
        for k, x in row.items():
            found[k] = found.get(k, ZERO) + factor * x
    return found


def times(row: Row, x: Sequence[Node]) -> Node:
    return sum((a * x[k] for k, a in sorted(row.items())), ZERO)


# ----------------------------------------------------------------------------------------------------------------------

_ENDLESS: Final = as_node(1e300)
ROW_ARRAYS: Final = ("phi", "phidot", "gamma", "right", "taken", "more")
"""Arrays in which contacts by kinds may read the values of their rows."""
SPEED_ARRAYS: Final = ("near", "held")
"""... and of the speeds that carry them."""
STABILISING: Final = "stabilising"
"""The array of Baumgarte's alpha and beta."""


def law_program(mechanism: Mechanism, known: RowProgram) -> tuple[Program, dict[str, list[int]]]:
    """Return (t, q, u, ...) -> the law problem of a mechanism in no mode, and the places of its matrices' entries.

    Outputs are those of `row_program`, which is `known`, but for gamma and forcing; and `driven` (m), the length of
    G M^-1 f over all speeds that a row is joined to: a force, divided by the length of its row of C; `bounces`,
    `returns` and `reaches` (elements: restitution, normal and tangential, and the distance of the next end of a face);
    `past_ends` (elements: up to which distance, in m, beyond the end a contact counts); `energy` (J).
    """
    trace, elements = Trace("laws", arrays(mechanism)), mechanism.one_way
    motion = motion_of(mechanism, slot_state(mechanism))
    outputs = known.call(trace, [trace[array.name] for array in trace.inputs], [ONE] * known.gates)
    # the root of f . M^-1 f over the speeds that a row is joined to, by masses and by rows that hold both ways
    joined = coupled_groups([*known.columns(), *known.moves[: len(mechanism.rows)]])
    f, free = outputs["forcing"], outputs["free"]
    powers = [sum((f[k] * free[k] for k in sorted(each)), start=ZERO) for each in joined]
    of_speed = {speed: number for number, each in enumerate(joined) for speed in each}
    reached = [sorted({of_speed[speed] for speed in speeds}) for speeds in known.moves]
    driven = [sqrt(absolute(sum((powers[number] for number in numbers), start=ZERO))) for numbers in reached]
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
            "energy": ((), [kinetic_energy(motion)]),
        }
    )
    return with_loops(program), {name: list(places) for name, places in known.places.items()}


@dataclass(frozen=True, eq=False)
class RowProgram:
    """The Program `rows` of all rows of a mechanism in no mode, and the places of its entries of each matrix.

    `may_act` are the rows that do not vanish identically. `free` computes M^-1 f alone. Where `contacts` are derived by
    kinds, each with `rows_of_kinds`, a call names the contacts that it needs: others have undefined rows. Contacts may
    read the values of their own rows (`ROW_ARRAYS`), elements of their matrices, and values of their speeds.
    """

    program: Program
    free: Program
    contacts: LikeContacts
    rows_of_kinds: Sequence[RowValues]
    places: Mapping[str, Sequence[int]]
    count: int
    size: int
    may_act: frozenset[int]

    @property
    def gates(self) -> int:
        """How many contacts a call may ask for."""
        return len(self.contacts.chosen)

    def call(
        self, trace: Trace, given: Sequence[Sequence[Node]], gates: Sequence[Node]
    ) -> dict[str, tuple[Node, ...]]:
        """Return the outputs by name of a call in a trace, for the inputs that every Program of a system has."""
        outputs = trace.call(self.program, [*given, gates])
        return {output.name: values for output, values in zip(self.program.outputs, outputs, strict=True)}

    @cached_property
    def moves(self) -> list[set[int]]:
        """The speeds that each row names or acts on."""
        found = [set[int]() for _ in range(self.count)]
        for place in (place for name in ("jacobian", "matrix", "exerted") for place in self.places[name]):
            found[place // self.size].add(place % self.size)
        return found

    def columns(self) -> list[set[int]]:
        """Return by column of G^-1 the speeds in it."""
        places = self.places["inverse"]
        return [{place // self.size for place in places if place % self.size == j} for j in range(self.size)]

    @property
    def coupled(self) -> list[int]:
        """The rows whose multipliers define others, in order."""
        return sorted({place % self.count for place in self.places["coupling"]})

    def matrix(self, name: str, outputs: Mapping[str, Sequence[Node]]) -> list[Row]:
        """Return a matrix row by row from the outputs of a call: the elements that may differ from zero."""
        shape = self.size if name == "inverse" else self.count, self.size if name != "coupling" else self.count
        return _by_rows(name, shape, self.places, outputs)


def _by_rows(
    name: str, shape: tuple[int, int], places: Mapping[str, Iterable[int]], elements: Mapping[str, Sequence[Node]]
) -> list[Row]:
    """Return a matrix row by row from its elements, which stand at places; those of C stand beside those of A."""
    height, width = shape
    found: list[Row] = [{} for _ in range(height)]
    for each in ("matrix", name) if name == "exerted" else (name,):
        for place, node in zip(places[each], elements[each], strict=True):
            found[place // width][place % width] = node
    return found


def row_program(mechanism: Mechanism, formalism: Formalism | None = None) -> RowProgram:
    """Return (t, q, u, ...) -> all rows of a mechanism in no mode, whether they act or not, and the free motion.

    The formalism of least cost computes them, or the given one.

    `phi`, `phidot` (m; zero where a row has none), `gamma`, `jacobian` H, `matrix` A, `exerted` C (m, n), `coupling` D
    (m, m), `right` r (m) of every row; `coefficients` (parts, 2: static, kinetic) row by row; `inverse` G^-1 (n, n),
    `free` M^-1 f and `forcing` f (n). Of the matrices H, A, C, D and G^-1 the outputs are the entries that may differ
    from zero, of C those that may differ from A's; their places count row by row.
    """
    state, size, every = slot_state(mechanism), len(mechanism.speeds), every_row(mechanism)
    motion = motion_of(mechanism, state)
    dynamics = (formalism or tree_dynamics_of)(mechanism, state)
    weighted, free = dynamics.factors.weighted, [as_node(x) for x in dynamics.bias_acceleration]
    contacts = like_contacts(mechanism, motion, weighted)
    trace = Trace("rows", (*arrays(mechanism), Array("gates", (len(contacts.chosen),))))
    whole = _AllRows(len(every), size)
    like = {row.name for place in contacts.places for row in mechanism.one_way[place].rows}
    kinds = []
    for kind in contacts.kinds:
        by_speeds = partial(kind.by_speeds, columns=kind.columns)
        by_mass = partial(kind.by_speeds, columns=kind.weighted)
        parts = [part for _, part in friction_parts(kind.mechanism)]
        kinds.append(RowValues.of(kind.motion, parts, by_speeds, by_mass, kind.leaves["speeds"]))
    made = [rows.values for rows in kinds]
    scanned = contacts.scanned(trace, made, {"speeds": free}, trace["gates"], {name for each in made for name in each})
    for k, (chosen, speeds) in enumerate(zip(contacts.chosen, contacts.speeds, strict=True)):
        values = {name: each[k] for name, each in scanned.items()}
        whole.add(kinds[chosen], values, contacts.of("rows", k), speeds, contacts.of("limits", k))
    others = [k for k, row in enumerate(every) if row.name not in like]
    limits = {2 * k + j: part for k, (_, part) in enumerate(friction_parts(mechanism)) for j in range(2)}
    limits = {k: part for k, part in limits.items() if part.rows[0].name not in like}
    alone = replace(motion, mechanism=replace(mechanism, rows=tuple(every[k] for k in others)))
    rows = RowValues.of(alone, list(dict.fromkeys(limits.values())), list, weighted, free)
    whole.add(rows, rows.values, others, range(size), list(limits))
    units = [[ONE if k == j else ZERO for k in range(size)] for j in range(size)]
    columns = [dynamics.factors.unweighted(unit) for unit in units]
    sparse = {**whole.matrices, "inverse": _entries([[column[k] for column in columns] for k in range(size)])}
    program = trace.finish(
        {
            **{name: column(entries.values()) for name, entries in sparse.items()},
            **{name: column(values[k] for k in sorted(values)) for name, values in whole.vectors.items()},
            "free": column(free),
            "forcing": column(dynamics.forcing),
        }
    )
    places = {name: list(entries) for name, entries in sparse.items()}
    of_tree = Trace("free", arrays(mechanism)).finish({"free": column(free)})
    reading, may_act = _with_row_arrays(contacts, kinds), frozenset(whole.may_act)
    return RowProgram(with_loops(program), of_tree, reading, kinds, places, len(every), size, may_act)


def _with_row_arrays(contacts: LikeContacts, kinds: Sequence[RowValues]) -> LikeContacts:
    """Return contacts that may read the known values of their rows and speeds."""
    if not kinds:
        return contacts
    rows = [contacts.of("rows", k) for k in range(len(contacts.chosen))]
    places: dict[str, Sequence[Sequence[int]]] = dict.fromkeys(ROW_ARRAYS, rows)
    places |= dict.fromkeys(SPEED_ARRAYS, contacts.speeds)
    for name in kinds[0].entries:
        ends = accumulate((len(kinds[kind].entries[name]) for kind in contacts.chosen), initial=0)
        places[name] = [range(a, b) for a, b in pairwise(ends)]
    return contacts.reading({**places, STABILISING: [(0, 1)] * len(rows)})


@dataclass(frozen=True, eq=False)
class RowValues:
    """Rows (k) at a state, matrices H, A, C (k, speeds), couplings, vectors (k), two coefficients of each part.

    `acting` are those that do not vanish identically.
    """

    matrices: Mapping[str, list[list[Node]]]
    coupling: Sequence[Mapping[int, S]]
    vectors: Mapping[str, list[Node]]
    acting: Sequence[int]

    @staticmethod
    def of(
        motion: Motion, parts: Iterable[FrictionPart], by_speeds: Weighted, by_mass: Weighted, free: Sequence[Node]
    ) -> RowValues:
        """Return all rows of a mechanism in motion, with `free` M^-1 f.

        `by_speeds` and `by_mass` turn a row's elements for speeds of the motion into those for speeds of the rows.
        """
        rows = row_motions(motion)
        jacobian = [[as_node(x) for x in by_speeds(row.jacobian)] for row in rows]
        matrix = [[as_node(x) for x in by_mass(row.jacobian)] for row in rows]
        exerted = [[as_node(x) for x in by_mass(row.forces)] for row in rows]
        pairs = zip(jacobian, rows, strict=True)
        places = {row.name: k for k, row in enumerate(motion.mechanism.rows)}
        friction_coefficients: list[S] = []  # static and kinetic; of regularised friction twice that at its speed
        for part in parts:
            static, kinetic = coefficients(motion, part.rows, [part.static, part.kinetic])
            if part.regularised is not None:
                velocity = [rows[places[row.name]].phidot for row in part.rows]
                static = kinetic = creep_coefficient(kinetic, velocity, *motion.state.values([part.regularised]))
            friction_coefficients += [static, kinetic]
        right = [row.gamma - sum(h * x for h, x in zip(own, free, strict=True)) for own, row in pairs]
        vectors = {
            "phi": [row.gap for row in rows],
            "phidot": [row.phidot if row.kinematic else ZERO for row in rows],
            "gamma": [row.gamma for row in rows],
            "right": right,
            "coefficients": friction_coefficients,
        }
        return RowValues(
            {"jacobian": jacobian, "matrix": matrix, "exerted": exerted},
            [row.coupling for row in rows],
            {name: list(map(as_node, values)) for name, values in vectors.items()},
            acting_rows(rows),
        )

    @cached_property
    def entries(self) -> dict[str, dict[int, Node]]:
        """The entries of the matrices that may differ from zero, of C those that may from A's, by their places."""
        matrix = self.matrices["matrix"]
        return {name: _entries(x, matrix if name == "exerted" else None) for name, x in self.matrices.items()}

    def matrix(self, name: str, elements: Mapping[str, Sequence[Node]]) -> list[Row]:
        """Return a matrix row by row, of whose entries the values are known."""
        return _by_rows(name, (len(self.coupling), len(self.matrices[name][0])), self.entries, elements)

    @property
    def values(self) -> dict[str, list[Node]]:
        return {**{name: list(entries.values()) for name, entries in self.entries.items()}, **self.vectors}


class _AllRows:
    """The values of all rows (m) of a mechanism: entries of matrices (m, n) by their places, vectors by theirs."""

    def __init__(self, count: int, size: int) -> None:
        self.count, self.size = count, size
        self.matrices: dict[str, dict[int, Node]] = {name: {} for name in ("jacobian", "matrix", "exerted", "coupling")}
        self.vectors: dict[str, dict[int, Node]] = {
            name: {} for name in ("phi", "phidot", "gamma", "right", "coefficients")
        }
        self.may_act: set[int] = set()

    def add(
        self,
        rows: RowValues,
        values: Mapping[str, Sequence[Node]],
        places: Sequence[int],
        speeds: Sequence[int],
        limits: Sequence[int],
    ) -> None:
        """Add rows, which stand at `places`, with the values of matrices over some `speeds` and of vectors."""
        for name, entries in rows.entries.items():
            width = len(speeds)
            own = (places[k // width] * self.size + speeds[k % width] for k in entries)
            self.matrices[name] |= zip(own, values[name], strict=True)
        for k, coupling in zip(places, rows.coupling, strict=True):
            self.matrices["coupling"] |= {k * self.count + places[j]: as_node(x) for j, x in sorted(coupling.items())}
        for name in rows.vectors:
            self.vectors[name] |= zip(limits if name == "coefficients" else places, values[name], strict=True)
        self.may_act |= {places[k] for k in rows.acting}


def _entries(matrix: Sequence[Sequence[S]], beside: Sequence[Sequence[S]] | None = None) -> dict[int, Node]:
    """Return by their places the entries of a matrix that may differ from zero, or from those of another one."""
    nodes = [as_node(x) for row in matrix for x in row]
    others = [ZERO] * len(nodes) if beside is None else [as_node(x) for row in beside for x in row]
    return {k: node for k, (node, other) in enumerate(zip(nodes, others, strict=True)) if node is not other}


def _least(measure: Callable[[ConstraintRow, Motion], list[S]], element: LawElement, motion: Motion) -> S:
    found = [x for row in element.normals[:1] for x in measure(row, motion)]
    return reduce(minimum, found) if found else _ENDLESS


# ----------------------------------------------------------------------------------------------------------------------
# The Program of friction in a mode: forces, and power on all and on each body; and the power of loads.
#
# The normal force N, the force l_t along each of the rows, its power l_t v_t, and that on each body alone: on two
# blocks that stick together these are opposite. Loads: those whose work the potential energy does not hold.


def friction_power_program(mechanism: Mechanism) -> Program:
    """Return (t, q, u, ..., multipliers (ns)) -> normal (parts), force (parts, 2), power (parts), share, loads.

    `share` is the power on each body (parts, bodies), `loads` the power of loads outside the potential energy, mass
    flows included. Parts are those of `friction_parts` of a mechanism in a mode; one that does not act has zeros.
    """
    trace = Trace("friction_power", (*arrays(mechanism), Array("multipliers", (len(mechanism.rows),))))
    motion = motion_of(mechanism, slot_state(mechanism))
    values = SwitchingValues(motion, trace["multipliers"])
    normal, along, power, share = list[S](), list[S](), list[S](), list[S]()
    for element, part in friction_parts(mechanism):
        forces, rows = values.friction(part), [values.row(row) for row in part.rows]
        normal.append(values.pressing(element, part))
        along += (*forces, ZERO)[:2]
        power.append(sum((force * row.phidot for force, row in zip(forces, rows, strict=True)), start=ZERO))
        on_bodies: list[S] = [ZERO] * len(motion.bodies)
        for force, row in zip(forces, rows, strict=True):
            for k, ((f, m), body) in enumerate(zip(row.of_body, motion.bodies, strict=True)):
                on_bodies[k] = on_bodies[k] + force * (dot(f, body.v_WB) + dot(m, body.w_WB))
        share += on_bodies
    working = split(mechanism.loads)[1]
    of_loads = applied_generalized_forces(motion, applied_forces(motion, working, weight=False))
    gained = as_node(carried_by_flows(motion, working))
    loads = sum((force * speed for force, speed in zip(of_loads, motion.state.u, strict=True)), start=gained)
    shapes = {"force": (len(normal), 2), "share": (len(normal), len(motion.bodies))}
    outputs = {"normal": normal, "force": along, "power": power, "share": share, "loads": [loads]}
    return trace.finish(
        {name: (shapes.get(name, (len(own),)), [as_node(x) for x in own]) for name, own in outputs.items()}
    )
