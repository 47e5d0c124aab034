"""The Programs of a mechanism in all its modes: which rows act, and how they rub, are numbers that a run hands over.

All rows are computed; a solve takes the acting ones, A = H G^-1, and the forces that they exert: A itself where nothing
slides. A sliding part has a multiplier of its own, -mu N along its slip. Reactions, powers and outputs are sums over
all rows, whatever the mode. Multipliers lambda that other rows are defined by stand beside x:

    A x + D lambda = r,   x = C^T lambda    as    [A D] (x, lambda) = r,   (x, lambda) = [C 1]^T lambda
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, reduce
from typing import Final

from multibody_sym.dynamics.formalisms.constrained import PASSES, Sharing
from multibody_sym.dynamics.formalisms.equations import Formalism
from multibody_sym.dynamics.programs.law_rows import Row, RowProgram, column, law_program, row_program
from multibody_sym.dynamics.programs.like_contacts import ContactKind
from multibody_sym.dynamics.programs.mode_values import ModeValues, chosen, is_of_normal
from multibody_sym.dynamics.programs.quantities import Sources, answered, forces_of
from multibody_sym.dynamics.programs.system import energy_program, felt, inputs_program, outputs_program
from multibody_sym.kinematics.motion import Motion, coordinate_rates, motion_of
from multibody_sym.kinematics.rows import RowMotion, row_motions
from multibody_sym.kinematics.state import arrays, slot_state
from multibody_sym.model.mechanism.every_mode import (
    ModeNodes,
    friction_parts,
    functions,
    in_every_mode,
    may_share,
)
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.model.mechanism.parameters import ALPHA, BETA, INDEPENDENT
from multibody_sym.program.program import Program
from multibody_sym.program.rolling.rolled import all_rolled
from multibody_sym.program.statements import Solve
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import absolute, maximum, sqrt, where
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, less_equal, real
from multibody_sym.scalars.rotations import unit_quaternion
from multibody_sym.scalars.vectors import S

_HALF: Final = ONE / 2
_SHORT: Final = real(1e-300)
"""The square of a force that has no direction."""
_SETTLED: Final = real(1e-15)
"""The part of the largest reaction by which rounding changes reactions from pass to pass."""
_NO_END: Final = -ONE
"""The value of a switching function at which a mode does not end."""


def every_mode_programs(declared: Mechanism, formalism: Formalism) -> tuple[dict[str, Program], dict[str, list[int]]]:
    """Return by name the Programs that runs of a mechanism take in any of its modes, by a formalism; `laws` among them.

    `declared` is in no mode; those for runs are of the mechanism `in_every_mode`, by methods that take the derivative
    alone. With them are the places of the entries of matrices of `laws` (see `law_program`).
    """
    known, mechanism = row_program(declared, formalism), in_every_mode(declared)
    laws, places = law_program(declared, known)
    modes = _EveryMode(mechanism, known)

    def motion(_: Trace) -> Motion:
        return motion_of(mechanism, slot_state(mechanism))

    sources = Sources(modes.state_derivative(), energy_program(mechanism), motion)
    missed, normalize = modes.missed(), modes.normalize()
    made = {
        "inputs": inputs_program(mechanism),
        "state_derivative": sources.state_derivative,
        "missed": missed,
        "put_back": modes.put_back(missed),
        "energy": sources.energy,
        "outputs": outputs_program(mechanism, sources),
        "events": modes.events(sources),
    }
    made |= {} if normalize is None else {"normalize": normalize}
    return {**all_rolled(made), "laws": laws}, places


@dataclass(frozen=True, eq=False)
class _Instant:
    """What `rows` tells of a state in a trace: matrices row by row, and vectors by name."""

    known: RowProgram
    values: Mapping[str, Sequence[Node]]

    @cached_property
    def jacobian(self) -> list[Row]:
        return self.known.matrix("jacobian", self.values)

    @cached_property
    def matrix(self) -> list[Row]:
        return self.known.matrix("matrix", self.values)

    @cached_property
    def coupling(self) -> list[Row]:
        """The columns of D of rows that others are defined by, behind those of the speeds."""
        columns = {j: self.known.size + k for k, j in enumerate(self.known.coupled)}
        return [{columns[j]: x for j, x in row.items()} for row in self.known.matrix("coupling", self.values)]

    @property
    def exerting(self) -> list[Row]:
        """[C 1]: what all rows exert, and multipliers that others are defined by."""
        found = self.known.matrix("exerted", self.values)
        for k, j in enumerate(self.known.coupled):
            found[j][self.known.size + k] = ONE
        return found

    @cached_property
    def _inverse(self) -> list[Row]:
        return self.known.matrix("inverse", self.values)

    def unweighted(self, x: Sequence[Node]) -> list[Node]:
        """Return G^-1 x (n)."""
        return [_dot(row, x) for row in self._inverse]


@dataclass(frozen=True)
class _Friction:
    """A part that rubs: the places of its normals, each with its side, and of its tangents with the forces along them.

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

    def along(self, multipliers: Sequence[Node]) -> _Friction:
        """Return the part with the direction of its reaction for sides: |F| = d . F with the direction d of F."""
        F = [multipliers[k] for k in self.normals]
        size = as_node(sqrt(sum((x * x for x in F), _SHORT)))
        return replace(self, sides=[x / size for x in F]) if self.norm else self


@dataclass(frozen=True, eq=False)
class _EveryMode:
    """A mechanism `in_every_mode`, and the Program of all its rows."""

    mechanism: Mechanism
    known: RowProgram

    @cached_property
    def modes(self) -> ModeNodes:
        return ModeNodes(self.mechanism)

    @cached_property
    def values(self) -> ModeValues:
        """What its numbers make of friction."""
        return ModeValues(self._motion)

    @cached_property
    def _acts(self) -> list[Node]:
        rows = enumerate(self.mechanism.rows)
        return [self.modes.acts(row) if k in self.known.may_act else ZERO for k, row in rows]

    @cached_property
    def _places(self) -> Mapping[str, int]:
        return {row.name: k for k, row in enumerate(self.mechanism.rows)}

    @cached_property
    def _motion(self) -> Motion:
        return motion_of(self.mechanism, slot_state(self.mechanism))

    def _rows(self, trace: Trace) -> _Instant:
        """Return all rows at the state of a trace, those of contacts by kinds where they act."""
        return _Instant(self.known, self.known.called(trace, self._given(trace), self._touching))

    @cached_property
    def _touching(self) -> list[Node]:
        """Return 1 for each contact by kinds that acts."""
        elements = self.mechanism.one_way
        return [self.modes.acts(elements[place].normals[0]) for place in self.known.contacts.places]

    def _given(self, trace: Trace) -> list[Sequence[Node]]:
        """Return what Programs of the mechanism in no mode read."""
        return [trace[array.name] if array.size else () for array in self.known.free.inputs]

    def _frictions(self, trace: Trace, speeds: Sequence[Node], limits: Sequence[Node]) -> list[_Friction]:
        """Return what rubs, by `speeds`, phidot of all rows, and `limits`, both coefficients of all parts."""
        found, by_kinds = [], self._forces(trace, speeds, limits)
        for k, (element, part) in enumerate(friction_parts(self.mechanism)):
            tangents = [self._places[row.name] for row in part.rows]
            forces = by_kinds.get(part.name)
            if forces is None:
                forces = self.values.friction(part, [speeds[j] for j in tangents], limits[2 * k : 2 * k + 2])
            normals = element.normals_of(part)
            sides = [ONE if part.norm else self.modes.side(element, row) for row in normals]
            found.append(_Friction([self._places[row.name] for row in normals], sides, tangents, forces, part.norm))
        return found

    def _by_kinds(
        self,
        trace: Trace,
        make: Callable[[ContactKind], Mapping[str, Sequence[Node]]],
        given: Mapping[str, Sequence[Node]],
        gates: Sequence[Node],
    ) -> Iterator[tuple[OneWay, Mapping[str, Sequence[Node]]]]:
        """Yield contacts that are derived by kinds, with what is made of each kind, by name; zeros behind its gate."""
        contacts = self.known.contacts
        found = contacts.scanned(trace, list(map(make, contacts.kinds)), given, gates)
        for k, place in enumerate(contacts.places):
            yield self.mechanism.one_way[place], {name: values[k] for name, values in found.items()}

    def _forces(self, trace: Trace, speeds: Sequence[Node], limits: Sequence[Node]) -> dict[str, Sequence[Node]]:
        """Return for contacts by kinds the forces of friction parts by name, for a unit normal force."""

        def forces(kind: ContactKind) -> dict[str, list[Node]]:
            values, found = ModeValues(kind.motion), list[Node]()
            places = {row.name: k for k, row in enumerate(kind.mechanism.rows)}
            for k, (_, part) in enumerate(friction_parts(kind.mechanism)):
                own = [kind.leaves["rows"][places[row.name]] for row in part.rows]
                found += values.friction(part, own, kind.leaves["limits"][2 * k : 2 * k + 2])
            return {"forces": found}

        known: dict[str, Sequence[Node]] = {}
        for element, values in self._by_kinds(
            trace, forces, {"rows": speeds, "limits": limits}, self._touching
        ):
            left = iter(values["forces"])
            known |= {part.name: [next(left) for _ in part.rows] for part in element.frictions if part.rubs}
        return known

    # --- accelerations ------------------------------------------------------------------------------------------------

    def state_derivative(self) -> Program:
        """Return (t, q, u, ..) -> qdot, udot, multipliers of all rows, report: free motion where none acts."""
        trace, held = Trace("state_derivative", arrays(self.mechanism)), self._held()
        some = self.modes.any_acts
        (free,) = trace.call(self.known.free, self._given(trace))
        found = trace.call_where(some, held, [trace[array.name] for array in trace.inputs])
        accelerations, multipliers, report = found
        udot = self._moving([chosen(some, a, b) for a, b in zip(accelerations, free, strict=True)])
        rates = coordinate_rates(self.mechanism, trace["q"], self._moving(trace["u"]))
        rank, independence, residual = report
        outputs = {
            "qdot": rates,
            "udot": udot,
            "multipliers": multipliers,
            "report": [rank, chosen(some, independence, ONE), residual],
        }
        return trace.finish({name: column(values) for name, values in outputs.items()})

    def _held(self) -> Program:
        """Return (t, q, u, ..) -> udot before speeds are held, multipliers, report, where some row acts.

        A second solve brings back what large accelerations without rows round away (see `formalisms.constrained`).
        """
        trace, sharing = Trace("held", arrays(self.mechanism)), self._sharing
        now, n = self._rows(trace), self.known.size
        gamma, right, free, phidot = (now.values[name] for name in ("gamma", "right", "free", "phidot"))
        more = self._stabilising(now)
        right = _sums(right, more)
        frictions = self._frictions(trace, phidot, now.values["coefficients"])
        frictions = self._along_reactions(trace, now, right, frictions)
        exerted, shared = _with_sliding(now.exerting, frictions), Row()
        if sharing is not None:
            shared = _combination(zip(sharing.forces, exerted, strict=True))
            exerted = [_combination((x, exerted[j]) for j, x in way) for way in sharing.ways]
        begun = [shared.get(k, ZERO) for k in range(n)]
        if not (frictions or sharing or self.known.coupled):
            exerted = []
        first = self._solve(trace, now, [b - _dot(a, begun) for a, b in zip(now.matrix, right, strict=True)], exerted)
        near = _sums(free, now.unweighted(_sums(first.solution[:n], begun)))
        defined = [_dot(d, first.solution) for d in now.coupling]
        missing = [a - _dot(h, near) - d for a, h, d in zip(_sums(gamma, more), now.jacobian, defined, strict=True)]
        second = self._solve(trace, now, missing, exerted)
        udot = _sums(near, now.unweighted(second.solution[:n]))
        taken = _sums(first.multipliers, second.multipliers)
        multipliers = _with_friction(taken if sharing is None else sharing.carried(taken), frictions)
        outputs = {"udot": udot, "multipliers": multipliers, "report": first.report}
        return trace.finish({name: column(values) for name, values in outputs.items()})

    @cached_property
    def _sharing(self) -> Sharing | None:
        return Sharing(self.modes.carried(), self.modes.ways()) if may_share(self.mechanism) else None

    def _solve(
        self,
        trace: Trace,
        now: _Instant,
        right: Sequence[Node],
        exerted: Sequence[Row],
        gate: Node = ONE,
    ) -> Solve:
        """Return [A D] (x, lambda) = r for the rows that act, for none of them where the gate is 0."""
        rows = [a | d for a, d in zip(now.matrix, now.coupling, strict=True)]
        most = self.mechanism.parameters.slot(INDEPENDENT)
        acting = [acts * gate for acts in self._acts]
        return trace.solve(rows, right, self.known.size + len(self.known.coupled), most, acting, exerted)

    def _along_reactions(
        self, trace: Trace, now: _Instant, right: Sequence[Node], frictions: list[_Friction]
    ) -> list[_Friction]:
        """Return friction for reactions that press with their lengths (see `formalisms.constrained`), if any does.

        No rows act any more in a pass after one that has changed reactions by rounding alone.
        """
        if not any(friction.norm for friction in frictions):
            return frictions
        multipliers, turns = [ZERO] * len(right), self.modes.any_length
        for _ in range(PASSES):
            exerted = _with_sliding(now.exerting, [friction.along(multipliers) for friction in frictions])
            found = self._solve(trace, now, right, exerted, turns).multipliers
            change = _largest(x - y for x, y in zip(found, multipliers, strict=True))
            multipliers = [chosen(turns, x, y) for x, y in zip(found, multipliers, strict=True)]
            turns = as_node(where(less_equal(change, _SETTLED * _largest(found)), ZERO, turns))
        return [friction.along(multipliers) for friction in frictions]

    def _stabilising(self, now: _Instant) -> list[Node]:
        """Return Baumgarte's terms of all rows (see `system.stabilised`)."""
        alpha, beta = map(self.mechanism.parameters.slot, (ALPHA, BETA))
        pairs = zip(now.values["phi"], now.values["phidot"], self.mechanism.rows, strict=True)
        return [
            -2 * alpha * phidot - beta**2 * phi if row.is_holonomic else -alpha * phidot for phi, phidot, row in pairs
        ]

    def _moving(self, values: Sequence[Node]) -> list[Node]:
        """Return values of the speeds, zero where they are held."""
        return [chosen(held, ZERO, value) for held, value in zip(self.modes.held(), values, strict=True)]

    # --- positions and speeds -----------------------------------------------------------------------------------------

    def missed(self) -> Program:
        """Return -> phi, residual of the rows that act."""
        trace = Trace("missed", arrays(self.mechanism))
        known: dict[str, dict[str, Node]] = {"phi": {}, "residual": {}}
        for element, values in self._by_kinds(trace, _missed_of_kind, {}, self._touching):
            for level, nodes in values.items():
                known[level] |= zip((row.name for row in element.rows), nodes, strict=True)
        left = [k for k, row in enumerate(self.mechanism.rows) if row.name not in known["phi"]]
        rows = tuple(self.mechanism.rows[k] for k in left)
        others = row_motions(replace(self._motion, mechanism=replace(self.mechanism, rows=rows)))
        for level, nodes in _missed(others, [self._acts[k] for k in left]).items():
            known[level] |= zip((row.name for row in rows), nodes, strict=True)
        return trace.finish(
            {name: column(values[row.name] for row in self.mechanism.rows) for name, values in known.items()}
        )

    def put_back(self, missed: Program) -> Program:
        """Return both corrections: that of u for phidot where that of q leads, with H where it starts."""
        trace = Trace("put_back", arrays(self.mechanism))
        now, holonomic = self._rows(trace), [k for k, row in enumerate(self.mechanism.rows) if row.is_holonomic]
        change = self._correction(trace, now, holonomic, [-now.values["phi"][k] for k in holonomic])
        of_q = coordinate_rates(self.mechanism, trace["q"], change)
        given = {array.name: trace[array.name] for array in missed.inputs}
        given["q"] = tuple(as_node(x) + dx for x, dx in zip(given["q"], of_q, strict=True))
        residual = trace.call(missed, list(given.values()))[1]
        restricting = [k for k, row in enumerate(self.mechanism.rows) if row.restricts]
        of_u = self._correction(trace, now, restricting, [-residual[k] for k in restricting])
        return trace.finish({"of_q": column(of_q), "of_u": column(of_u)})

    def _correction(self, trace: Trace, now: _Instant, places: Sequence[int], wanted: Sequence[Node]) -> list[Node]:
        """Return the least change of the speeds that changes rows as wanted: of all by mass, or of those not held.

        Rows that define forces restrict nothing: without them so many fewer are independent.
        """
        held, some = self.modes.held(), self.modes.any_held
        matrix = []
        for k in places:
            row, by_mass = now.jacobian[k], now.matrix[k]
            least = sum((absolute(h) * held[j] for j, h in row.items()), ZERO)
            moving = {j: chosen(held[j], ZERO, felt(h, least)) for j, h in row.items()}
            either = sorted({*moving, *by_mass})
            matrix.append({j: chosen(some, moving.get(j, ZERO), by_mass.get(j, ZERO)) for j in either})
        acting = [self._acts[k] for k in places]
        every = zip(self._acts, self.mechanism.rows, strict=True)
        defining = sum((acts for acts, row in every if not row.restricts), ZERO)
        most = self.mechanism.parameters.slot(INDEPENDENT) - defining
        found = trace.solve(matrix, wanted, len(held), most, acting)
        pairs = zip(self._moving(found.solution), now.unweighted(found.solution), strict=True)
        return [chosen(some, a, b) for a, b in pairs]

    def normalize(self) -> Program | None:
        """Return -> q with unit quaternions, deviation; those of what stands still stay as they are."""
        trace, held = Trace("normalize", arrays(self.mechanism)), self.modes.held()
        q, deviation = list(trace["q"]), ZERO
        for body in self.mechanism.bodies:
            for free in body.free_steps:
                if not free.step.unit_quaternion:
                    continue
                stands = reduce(lambda a, b: a * b, [held[k] for k in free.u])
                unit, off = unit_quaternion([q[k] for k in free.q])
                deviation = as_node(maximum(deviation, chosen(stands, ZERO, off)))
                q[free.q[0] : free.q[-1] + 1] = [chosen(stands, q[k], x) for k, x in zip(free.q, unit, strict=True)]
        if deviation is ZERO:
            return None
        return trace.finish({"q": ((len(q),), q), "deviation": ((), [deviation])})

    # --- where a mode ends --------------------------------------------------------------------------------------------

    def events(self, sources: Sources) -> Program:
        """Return -> values: those of `quantities.events`, then the `functions`, negative where a mode does not end."""
        mechanism = self.mechanism
        trace = Trace("events", (*arrays(mechanism), forces_of(mechanism)))
        asked = [*mechanism.stops.values(), *mechanism.kinks, *mechanism.fades]
        values = answered(trace, sources, asked)
        known = self._functions(trace)
        values += [as_node(known[name]) for name in functions(mechanism)]
        return trace.finish({"values": ((len(values),), values)})

    def _functions(self, trace: Trace) -> dict[str, Node]:
        """Return the switching functions by name, those of friction and ends of contacts by kinds where they touch."""
        found: dict[str, Node] = {}
        given = {"rows": trace["multipliers"]}
        for make, gates in ((_ends_of_normal, ()), (_ends_of_touching, self._touching)):
            for element, values in self._by_kinds(trace, make, given, gates):
                of_normal = make is _ends_of_normal
                names = [
                    name
                    for name in functions(replace(self.mechanism, one_way=(element,)))
                    if is_of_normal(name) == of_normal
                ]
                found |= zip(names, values["values"], strict=True)
        left = [element for k, element in enumerate(self.mechanism.one_way) if k not in self.known.contacts.places]
        others = replace(self._motion, mechanism=replace(self.mechanism, one_way=tuple(left)))
        found |= ModeValues(others).functions(trace["multipliers"])
        return {name: chosen(self.modes.watched(name), value, _NO_END) for name, value in found.items()}


def _missed(rows: Sequence[RowMotion], acts: Sequence[Node]) -> dict[str, list[Node]]:
    """Return phi and phidot of the rows that act, zeros for the others."""
    pairs = list(zip(rows, acts, strict=True))
    return {
        "phi": [chosen(acting, row.phi if row.holonomic else ZERO, ZERO) for row, acting in pairs],
        "residual": [chosen(acting, row.phidot, ZERO) for row, acting in pairs],
    }


def _missed_of_kind(kind: ContactKind) -> dict[str, list[Node]]:
    return _missed(row_motions(kind.motion), list(map(ModeNodes(kind.mechanism).acts, kind.mechanism.rows)))


def _ends_of_normal(kind: ContactKind) -> dict[str, list[Node]]:
    """Return when a contact closes or opens."""
    values = ModeValues(kind.motion).functions(kind.leaves["rows"])
    return {"values": [as_node(x) for name, x in values.items() if is_of_normal(name)]}


def _ends_of_touching(kind: ContactKind) -> dict[str, list[Node]]:
    """Return when else the mode of a contact that touches ends."""
    values = ModeValues(kind.motion).functions(kind.leaves["rows"])
    return {"values": [as_node(x) for name, x in values.items() if not is_of_normal(name)]}


def _with_sliding(exerted: Sequence[Row], frictions: Sequence[_Friction]) -> list[Row]:
    """Return what the rows exert: normals bring friction along where something slides."""
    found = [dict(row) for row in exerted]
    for normal, tangent, force in (each for friction in frictions for each in friction.by_sides()):
        for k, x in exerted[tangent].items():
            found[normal][k] = found[normal].get(k, ZERO) + force * x
    return found


def _with_friction(multipliers: Sequence[Node], frictions: Sequence[_Friction]) -> list[Node]:
    """Return the multipliers of all rows with those of what slides."""
    found = list(multipliers)
    for normal, tangent, force in (each for friction in frictions for each in friction.by_sides()):
        found[tangent] = found[tangent] + force * multipliers[normal]
    return found


def _sums(a: Sequence[Node], b: Sequence[Node]) -> list[Node]:
    return [x + y for x, y in zip(a, b, strict=True)]


def _largest(values: Iterable[Node]) -> Node:
    return as_node(reduce(maximum, map(absolute, values)))


def _combination(parts: Iterable[tuple[S, Row]]) -> Row:
    """Return the sum of rows, each times its factor."""
    found: Row = {}
    for factor, row in parts:
        for k, x in row.items():
            found[k] = found.get(k, ZERO) + factor * x
    return found


def _dot(row: Row, x: Sequence[Node]) -> Node:
    return sum((a * x[k] for k, a in sorted(row.items())), ZERO)
