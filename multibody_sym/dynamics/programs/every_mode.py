"""The Programs of a mechanism in all its modes: which rows act, and how they rub, are numbers that a run hands over.

All rows are computed; a solve takes the acting ones, A = H G^-1, and the forces that they exert: A itself where nothing
slides. A sliding part has a multiplier of its own, -mu N along its slip. Reactions, powers and outputs are sums over
all rows, whatever the mode. Multipliers lambda that define other rows stand beside x:

    A x + D lambda = r,   x = C^T lambda    as    [A D] (x, lambda) = r,   (x, lambda) = [C 1]^T lambda
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, reduce
from typing import Final

from multibody_sym.dynamics.formalisms.constrained import PASSES, Sharing, sums
from multibody_sym.dynamics.formalisms.equations import Formalism
from multibody_sym.dynamics.programs.law_programs import (
    STABILISING,
    Row,
    RowProgram,
    RowValues,
    SlidingForces,
    combination,
    friction_power_program,
    law_program,
    row_program,
    times,
    with_friction,
    with_sliding,
)
from multibody_sym.dynamics.programs.quantities import Sources, choose, column, forces_of, with_quantities
from multibody_sym.dynamics.programs.reactions import SwitchingValues
from multibody_sym.dynamics.programs.repeated_contacts import ContactKind
from multibody_sym.dynamics.programs.system import (
    felt,
    inputs_program,
    normalize_program,
    outputs_program,
    residual_ahead,
    sources_of,
)
from multibody_sym.mechanics.energy import split
from multibody_sym.mechanics.law_elements import FrictionPart, sided_normals
from multibody_sym.mechanics.mechanism import ALPHA, BETA, INDEPENDENT, Mechanism
from multibody_sym.mechanics.modes import (
    ModeNodes,
    friction_parts,
    functions,
    functions_of,
    has_end,
    has_rim,
    in_every_mode,
    may_share,
)
from multibody_sym.mechanics.motion import Motion, arrays, coordinate_rates, motion_of, qdot_of, slot_state
from multibody_sym.mechanics.points import STARTING
from multibody_sym.mechanics.row_kinematics import RowMotion, row_motions
from multibody_sym.mechanics.row_records import Row as DeclaredRow
from multibody_sym.program.loops import all_rolled
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array, Solve
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import absolute, maximum, where
from multibody_sym.scalars.limits import along, length, sliding, towards
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, less_equal, real
from multibody_sym.scalars.vectors import S

# ----------------------------------------------------------------------------------------------------------------------
# Friction and switching functions for the numbers of a mode, in Programs of all modes.


def is_of_normal(function: str) -> bool:
    """Return whether a switching function, by its name, is that of a normal, which is watched in every mode."""
    return function.startswith("normal ")


@dataclass(frozen=True, eq=False)
class ModeValues:
    """The motion of a mechanism `in_every_mode`."""

    motion: Motion

    @cached_property
    def modes(self) -> ModeNodes:
        return ModeNodes(self.motion.mechanism)

    def friction(self, part: FrictionPart, speeds: Sequence[Node], limits: Sequence[Node]) -> list[Node]:
        """Return the force along each row of a part for a unit normal force, zero where it does not slide.

        `speeds` are phidot of its rows, `limits` both its coefficients.
        """
        if part.regularised is not None:
            kinetic, least = self.motion.state.values([part.kinetic, part.regularised])
            return list(map(as_node, sliding(kinetic, speeds, length([*speeds, least]))))
        slip, mu = self.modes.slip(part), choose(self.modes.at_limit(part), *limits)
        if len(part.rows) == 1:
            return [as_node(-slip * mu)]
        ways = self._slip_velocity(part, speeds)
        whole = choose(slip, length(ways), ONE)
        return [choose(slip, -mu * v / whole, ZERO) for v in ways]

    def functions(self, multipliers: Sequence[Node]) -> dict[str, S]:
        """Return the switching functions of all modes by name, for the multipliers of all rows."""
        values = SwitchingValues(self.motion, multipliers)
        found: dict[str, S] = {}
        for element in self.motion.mechanism.one_way:
            normal = element.normals[0]
            if not element.unilateral:
                for k in sided_normals(element):
                    row = element.normals[k]
                    side, force = self.modes.side(element, row), values.multiplier(row.name)
                    found[f"turns {row.name}"] = -towards(side, force)
                continue
            opens, closes = -values.normal(element), values.closes(normal)
            found[f"normal {element.name}"] = choose(self.modes.acts(normal), opens, closes)
            if has_end(element):
                found[f"edge {element.name}"] = values.leaves(normal)
            if has_rim(element):
                found[f"flat {element.name}"] = values.lies_flat(normal)
        for element, part in friction_parts(self.motion.mechanism):
            speeds = [as_node(values.row(row).phidot) for row in part.rows]
            slip, way = self.modes.slip(part), f"slip {part.name}"
            held = -values.room(element, part)
            if len(part.rows) == 1:
                found[way] = choose(slip, -slip * speeds[0], held)
                continue
            found[way] = choose(slip, -length(self._slip_velocity(part, speeds)), held)
            onward = along(self.modes.direction(part), speeds)
            found |= {f"onward {part.name}": onward, f"back {part.name}": -onward}
        return found

    def _slip_velocity(self, part: FrictionPart, speeds: Sequence[Node]) -> list[Node]:
        """Return a vector along the slip in space (see `mechanics.points`)."""
        return [v + real(STARTING) * way for v, way in zip(speeds, self.modes.direction(part), strict=True)]


# ----------------------------------------------------------------------------------------------------------------------
# Contacts by kinds for the numbers of a mode: derived once a kind, and scanned over those that act.
#
# A function here takes a kind and its rows, in whose arrays it reads, and returns values by name.


Named = dict[str, list[Node]]


def pressing_outputs(kind: ContactKind, rows: RowValues) -> Named:
    """Return `gamma` and `right` with Baumgarte's terms, and the elements of `exerted` and `carried` (`exerted_by`)."""
    own, (exerted, carried) = kind.leaves, exerted_by(kind, rows)
    given = zip(kind.mechanism.rows, own["phi"], own["phidot"], strict=True)
    terms = [baumgarte(row, phi, phidot, own[STABILISING]) for row, phi, phidot in given]
    return {
        "gamma": [x + dx for x, dx in zip(own["gamma"], terms, strict=True)],
        "right": [x + dx for x, dx in zip(own["right"], terms, strict=True)],
        "exerted": elements(exerted),
        "carried": elements([carried]),
    }


def exerted_by(kind: ContactKind, rows: RowValues) -> tuple[list[Row], Row]:
    """Return by the speeds of a contact the force of each way in which its rows share, friction included.

    The second result is the force of all its rows with the shares of the mode.
    """
    sliding = with_sliding(rows.matrix("exerted", kind.leaves), _frictions(kind))
    modes = ModeNodes(kind.mechanism)
    ways = [combination((x, sliding[j]) for j, x in way) for way in modes.ways()]
    return ways, combination(zip(modes.carried(), sliding, strict=True))


def right_without_shares(kind: ContactKind, rows: RowValues) -> Named:
    """Return `right` less its part from the motion `near`, that of the shares of all rows."""
    return {"right": _less(kind.leaves["right"], rows.matrix("matrix", kind.leaves), kind.leaves["near"])}


def missing_accelerations(kind: ContactKind, rows: RowValues) -> Named:
    """Return by how much the accelerations `near` are short of `gamma`."""
    return {"missing": _less(kind.leaves["gamma"], rows.matrix("jacobian", kind.leaves), kind.leaves["near"])}


def multipliers(kind: ContactKind, rows: RowValues) -> Named:
    """Return the multipliers of all rows for the sum of both solves, `taken` and `more`, with one number a way."""
    own, modes = kind.leaves, ModeNodes(kind.mechanism)
    taken = [x + y for x, y in zip(own["taken"], own["more"], strict=True)]
    found = Sharing(modes.carried(), modes.ways()).carried(taken)
    return {"multipliers": with_friction(list(map(as_node, found)), _frictions(kind))}


def correction_elements(kind: ContactKind, rows: RowValues) -> Named:
    """Return the `elements` of the rows that correct speeds (see `correcting_rows`)."""
    return {"elements": elements(correcting_rows(kind, rows))}


def correcting_rows(kind: ContactKind, rows: RowValues) -> list[Row]:
    """Return rows of the speeds: of all by mass, or of those not held."""
    own = kind.leaves
    jacobian, by_mass = (rows.matrix(name, own) for name in ("jacobian", "matrix"))
    some = ModeNodes(kind.mechanism).any_held
    return [of_moving(*each, own["held"], some) for each in zip(jacobian, by_mass, strict=True)]


def contact_residuals(kind: ContactKind, rows: RowValues) -> Named:
    """Return the residuals of a contact at a state (see `residuals`)."""
    acts = map(ModeNodes(kind.mechanism).acts, kind.mechanism.rows)
    return residuals(row_motions(kind.motion), list(acts))


def ends_of_normal(kind: ContactKind, rows: RowValues) -> Named:
    """Return the function that ends a mode where a contact closes or opens."""
    values, modes = ModeValues(kind.motion).functions(kind.leaves["rows"]), ModeNodes(kind.mechanism)
    return {"values": [choose(modes.watched(name), x, _NO_END) for name, x in values.items() if is_of_normal(name)]}


def ends_of_touching(kind: ContactKind, rows: RowValues) -> Named:
    """Return the other functions that end a mode of a contact that touches."""
    values = ModeValues(kind.motion).functions(kind.leaves["rows"])
    return {"values": [as_node(x) for name, x in values.items() if not is_of_normal(name)]}


def _frictions(kind: ContactKind) -> list[SlidingForces]:
    """Return the friction where a contact touches."""
    own, values, found = kind.leaves, ModeValues(kind.motion), list[SlidingForces]()
    places = {row.name: k for k, row in enumerate(kind.mechanism.rows)}
    for k, (element, part) in enumerate(friction_parts(kind.mechanism)):
        tangents = [places[row.name] for row in part.rows]
        forces = values.friction(part, [own["phidot"][j] for j in tangents], own["limits"][2 * k : 2 * k + 2])
        normals = [places[row.name] for row in element.normals_of(part)]
        found.append(SlidingForces(normals, [ONE] * len(normals), tangents, forces, norm=False))
    return found


def _less(values: Sequence[Node], rows: Iterable[Row], x: Sequence[Node]) -> list[Node]:
    return [value - times(row, x) for value, row in zip(values, rows, strict=True)]


# --- the same for any row ---------------------------------------------------------------------------------------------


def elements(rows: Iterable[Row]) -> list[Node]:
    """Return the elements of rows one after the other, each row's in the order of its columns."""
    return [row[k] for row in rows for k in sorted(row)]


def baumgarte(row: DeclaredRow, phi: Node, phidot: Node, alpha_beta: Sequence[Node]) -> Node:
    """Return Baumgarte's term of a row (see `system.constrained_motion`)."""
    alpha, beta = alpha_beta
    return -2 * alpha * phidot - beta**2 * phi if row.is_holonomic else -alpha * phidot


def of_moving(row: Row, by_mass: Row, held: Sequence[Node], some: Node) -> Row:
    """Return a row of the speeds that are not held, if `some` are held, else of all of them by mass."""
    least = sum((absolute(h) * held[j] for j, h in row.items()), ZERO)
    moving = {j: choose(held[j], ZERO, felt(h, least)) for j, h in row.items()}
    return {j: choose(some, moving.get(j, ZERO), by_mass.get(j, ZERO)) for j in sorted({*moving, *by_mass})}


def residuals(rows: Sequence[RowMotion], acts: Sequence[Node]) -> Named:
    """Return phi and the `residual` phidot of the rows that act, zeros for the others."""
    pairs = list(zip(rows, acts, strict=True))
    return {
        "phi": [choose(acting, row.gap, ZERO) for row, acting in pairs],
        "residual": [choose(acting, row.phidot, ZERO) for row, acting in pairs],
    }


# ----------------------------------------------------------------------------------------------------------------------

_SETTLED: Final = real(1e-15)
"""From pass to pass rounding changes reactions by this part of the largest."""
_Make = Callable[[ContactKind, RowValues], Mapping[str, Sequence[Node]]]
_OF_ACTING_ROWS: Final[Mapping[_Make, Collection[str]]] = {
    pressing_outputs: ("gamma", "right", "exerted"),
    right_without_shares: ("right",),
    missing_accelerations: ("missing",),
    correction_elements: ("elements",),
}
"""Values of contacts that only solves and contacts read, where they touch."""
_NO_END: Final = -ONE
"""The value of a switching function at which a mode does not end."""


def every_mode_programs(
    declared: Mechanism, formalism: Formalism
) -> tuple[dict[str, Program], dict[str, list[int]], dict[str, Program]]:
    """Return by name the Programs that runs of a mechanism take in any of its modes, by a formalism; `laws` among them.

    `declared` is in no mode; Programs for runs are of the mechanism `in_every_mode`, for methods that take the
    derivative alone. The second result are the places of entries of matrices of `laws` (see `law_program`), the third
    the Programs that a run takes when it is done: `friction_power`, where anything takes or adds energy.
    """
    known, mechanism = row_program(declared, formalism), in_every_mode(declared)
    laws, places = law_program(declared, known)
    modes = _EveryMode(mechanism, known)
    sources = sources_of(mechanism, modes.state_derivative())
    missed, normalize = modes.missed(), normalize_program(mechanism, modes.modes.held())
    every = {
        "inputs": inputs_program(mechanism),
        "state_derivative": sources.state_derivative,
        "missed": missed,
        "put_back": modes.put_back(missed),
        "energy": sources.energy,
        "outputs": outputs_program(mechanism, sources),
        "events": modes.events(sources),
    }
    every |= {} if normalize is None else {"normalize": normalize}
    works = friction_parts(mechanism) or split(mechanism.loads)[1]
    after = all_rolled({"friction_power": friction_power_program(mechanism)}) if works else {}
    return {**all_rolled(every), "laws": laws}, places, after


@dataclass(frozen=True, eq=False)
class _RowsAtState:
    """The outputs of `rows` at a state in a trace: matrices row by row, and vectors by name."""

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
        """The columns of D of rows that define others, behind those of the speeds."""
        columns = {j: self.known.size + k for k, j in enumerate(self.known.coupled)}
        return [{columns[j]: x for j, x in row.items()} for row in self.known.matrix("coupling", self.values)]

    @property
    def exerting(self) -> list[Row]:
        """[C 1]: the forces of all rows, and multipliers that define others."""
        found = self.known.matrix("exerted", self.values)
        for k, j in enumerate(self.known.coupled):
            found[j][self.known.size + k] = ONE
        return found

    @cached_property
    def _inverse(self) -> list[Row]:
        return self.known.matrix("inverse", self.values)

    def unweighted(self, x: Sequence[Node]) -> list[Node]:
        return [times(row, x) for row in self._inverse]


@dataclass(frozen=True)
class _ActingForces:
    """At a state: gamma and the right side with Baumgarte's terms, and the forces of rows without sliding.

    Rows of contacts by kinds carry friction along, and share forces; `carried` are the first forces of each contact.
    """

    gamma: list[Node]
    right: list[Node]
    exerting: list[Row]
    carried: list[Row]


@dataclass(frozen=True, eq=False)
class _EveryMode:
    """A mechanism `in_every_mode`, and the Program of all its rows."""

    mechanism: Mechanism
    known: RowProgram

    @cached_property
    def modes(self) -> ModeNodes:
        return ModeNodes(self.mechanism)

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

    def _rows(self, trace: Trace) -> _RowsAtState:
        """Return all rows at the state of a trace, those of contacts by kinds where they act."""
        return _RowsAtState(self.known, self.known.call(trace, self._given(trace), self._touching))

    @cached_property
    def _touching(self) -> list[Node]:
        """Return 1 for each contact by kinds that acts."""
        elements = self.mechanism.one_way
        return [self.modes.acts(elements[place].normals[0]) for place in self.known.contacts.places]

    @cached_property
    def _others(self) -> list[int]:
        """The rows that belong to no contact by kinds."""
        known = self.known.contacts
        like = {k for number in range(len(known.places)) for k in known.of("rows", number)}
        return [k for k in range(self.known.count) if k not in like]

    @cached_property
    def _other_elements(self) -> Mechanism:
        like = set(self.known.contacts.places)
        left = tuple(element for k, element in enumerate(self.mechanism.one_way) if k not in like)
        return replace(self.mechanism, one_way=left)

    def _given(self, trace: Trace) -> list[Sequence[Node]]:
        return [trace[array.name] if array.size else () for array in self.known.free.inputs]

    def _of_contacts(
        self, trace: Trace, make: _Make, given: Mapping[str, Sequence[Node]]
    ) -> Iterator[dict[str, tuple[Node, ...]]]:
        """Yield for each contact by kinds the values that `make` gives, by name; zeros where it does not touch.

        The ends of normals are also computed of contacts that do not touch.
        """
        contacts = self.known.contacts
        values = [make(*each) for each in zip(contacts.kinds, self.known.rows_of_kinds, strict=True)]
        gates = () if make is ends_of_normal else self._touching
        scanned = contacts.scanned(trace, values, given, gates, _OF_ACTING_ROWS.get(make, ()))
        for k in range(len(contacts.places)):
            yield {name: of_contacts[k] for name, of_contacts in scanned.items()}

    def _at_rows(self, trace: Trace, make: _Make, **given: Sequence[Node]) -> Mapping[str, dict[int, Node]]:
        """Return the values that `make` gives for rows of contacts by kinds, by name and row."""
        found = defaultdict[str, dict[int, Node]](dict)
        for k, values in enumerate(self._of_contacts(trace, make, given)):
            for name, nodes in values.items():
                found[name].update(zip(self.known.contacts.of("rows", k), nodes, strict=True))
        return found

    def _spread(self, number: int, rows: Sequence[Row], nodes: Iterable[Node]) -> list[Row]:
        """Return rows of a contact over all speeds, from the elements `nodes` of the `rows` of its kind."""
        left, speeds = iter(nodes), self.known.contacts.speeds[number]
        return [{speeds[k]: next(left) for k in sorted(row)} for row in rows]

    def _frictions(self, speeds: Sequence[Node], limits: Sequence[Node]) -> list[SlidingForces]:
        """Return the friction beside contacts by kinds, from phidot of all rows and both coefficients of all parts."""
        found, known, values = [], self._other_elements, ModeValues(self._motion)
        left = {part.name for _, part in friction_parts(known)}
        for k, (element, part) in enumerate(friction_parts(self.mechanism)):
            if part.name in left:
                tangents = [self._places[row.name] for row in part.rows]
                forces = values.friction(part, [speeds[j] for j in tangents], limits[2 * k : 2 * k + 2])
                normals = element.normals_of(part)
                sides = [ONE if part.norm else self.modes.side(element, row) for row in normals]
                places = [self._places[row.name] for row in normals]
                found.append(SlidingForces(places, sides, tangents, forces, part.norm))
        return found

    # --- accelerations ------------------------------------------------------------------------------------------------

    def state_derivative(self) -> Program:
        """Return (t, q, u, ..) -> qdot, udot, multipliers of all rows, report: free motion where none acts."""
        trace, held = Trace("state_derivative", arrays(self.mechanism)), self._held()
        some = self.modes.any_acts
        (free,) = trace.call_where(choose(some, ZERO, ONE), self.known.free, self._given(trace))
        found = trace.call_where(some, held, [trace[array.name] for array in trace.inputs])
        accelerations, multipliers, report = found
        udot = self._moving([choose(some, a, b) for a, b in zip(accelerations, free, strict=True)])
        rates = qdot_of(slot_state(self.mechanism), self.mechanism, self._moving(trace["u"]))
        rank, independence, residual = report
        outputs = {
            "qdot": rates,
            "udot": udot,
            "multipliers": multipliers,
            "report": [rank, choose(some, independence, ONE), residual],
        }
        return trace.finish({name: column(values) for name, values in outputs.items()})

    def _held(self) -> Program:
        """Return (t, q, u, ..) -> udot before speeds are held, multipliers, report, where some row acts.

        A second solve restores the rounding of large accelerations without rows (see `formalisms.constrained`).
        """
        trace, n = Trace("held", arrays(self.mechanism)), self.known.size
        now = self._rows(trace)
        pressed = self._pressed(trace, now)
        frictions = self._frictions(now.values["phidot"], now.values["coefficients"])
        frictions = self._along_reactions(trace, now, pressed, frictions)
        exerted, right, begun = with_sliding(pressed.exerting, frictions), pressed.right, [ZERO] * n
        if self._sharing is not None:
            exerted, right, begun = self._shared(trace, now, replace(pressed, exerting=exerted))
        if not (friction_parts(self.mechanism) or self._sharing or self.known.coupled):
            exerted = []
        first = self._solve(trace, now, right, exerted)
        near = sums(now.values["free"], now.unweighted(sums(first.solution[:n], begun)))
        left = self._at_rows(
            trace, missing_accelerations, gamma=pressed.gamma, jacobian=now.values["jacobian"], near=near
        )["missing"]
        for k in self._others:
            left[k] = pressed.gamma[k] - times(now.jacobian[k], near) - times(now.coupling[k], first.solution)
        second = self._solve(trace, now, [left[k] for k in range(self.known.count)], exerted)
        udot = sums(near, now.unweighted(second.solution[:n]))
        multipliers = self._multipliers(trace, now, (first.multipliers, second.multipliers), frictions)
        outputs = {"udot": udot, "multipliers": multipliers, "report": first.report}
        return trace.finish({name: column(values) for name, values in outputs.items()})

    def _pressed(self, trace: Trace, now: _RowsAtState) -> _ActingForces:
        """Return the acting forces, with those that press contacts by kinds."""
        stabilising = [self.mechanism.parameters.slot(name) for name in (ALPHA, BETA)]
        given = {name: now.values[name] for name in ("phi", "phidot", "gamma", "right", "matrix", "exerted")}
        given |= {"limits": now.values["coefficients"], STABILISING: stabilising}
        found = _ActingForces(list(given["gamma"]), list(given["right"]), now.exerting, [])
        known = self.known
        kinds = [exerted_by(*each) for each in zip(known.contacts.kinds, known.rows_of_kinds, strict=True)]
        for k, values in enumerate(self._of_contacts(trace, pressing_outputs, given)):
            rows, carried = kinds[known.contacts.chosen[k]]
            places = known.contacts.of("rows", k)
            own = self._spread(k, rows, values["exerted"])
            for place, gamma, right, row in zip(places, values["gamma"], values["right"], own, strict=True):
                found.gamma[place], found.right[place], found.exerting[place] = gamma, right, row
            found.carried.extend(self._spread(k, [carried], values["carried"]))
        for k in self._others:
            term = baumgarte(self.mechanism.rows[k], given["phi"][k], given["phidot"][k], stabilising)
            found.gamma[k], found.right[k] = found.gamma[k] + term, found.right[k] + term
        return found

    def _shared(
        self, trace: Trace, now: _RowsAtState, pressed: _ActingForces
    ) -> tuple[list[Row], list[Node], list[Node]]:
        """Return the forces of rows that share, the right side beside their first forces, and the sum of these (n)."""
        assert self._sharing is not None
        exerted, right, sliding = list(pressed.exerting), list(pressed.right), pressed.exerting
        for k in self._others:
            exerted[k] = combination((x, sliding[j]) for j, x in self._sharing.ways[k])
        parts = [*pressed.carried, combination((self._sharing.forces[k], sliding[k]) for k in self._others)]
        values = [x for row in parts for x in row.values()]
        sums = Trace("begun", (Array("carried", (len(values),)),))
        left = iter(sums["carried"])
        total = combination((ONE, {k: next(left) for k in row}) for row in parts)
        program = sums.finish({"begun": column(total.get(k, ZERO) for k in range(self.known.size))})
        (begun,) = trace.call_where(self.modes.any_shares, program, [values])
        beside = self._at_rows(
            trace, right_without_shares, right=right, matrix=now.values["matrix"], near=begun
        )["right"]
        for k in range(self.known.count):
            right[k] = beside[k] if k in beside else right[k] - times(now.matrix[k], begun)
        return exerted, right, list(begun)

    def _multipliers(
        self, trace: Trace, now: _RowsAtState, taken: Sequence[Sequence[Node]], frictions: Sequence[SlidingForces]
    ) -> list[Node]:
        """Return the multipliers of all rows from the numbers of each way in both solves."""
        found = sums(*taken)
        if self._sharing is not None:
            found = list(map(as_node, self._sharing.carried(found)))
        found = with_friction(found, frictions)
        given = {"phidot": now.values["phidot"], "limits": now.values["coefficients"]}
        by_kinds = self._at_rows(trace, multipliers, taken=taken[0], more=taken[1], **given)
        return [by_kinds["multipliers"].get(k, x) for k, x in enumerate(found)]

    @cached_property
    def _sharing(self) -> Sharing | None:
        return Sharing(self.modes.carried(), self.modes.ways()) if may_share(self.mechanism) else None

    def _solve(
        self,
        trace: Trace,
        now: _RowsAtState,
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
        self, trace: Trace, now: _RowsAtState, pressed: _ActingForces, frictions: list[SlidingForces]
    ) -> list[SlidingForces]:
        """Return friction for reactions that press with their lengths (see `formalisms.constrained`), if any does.

        No rows act any more in a pass after one that has changed reactions by rounding alone.
        """
        if not any(friction.norm for friction in frictions):
            return frictions
        multipliers, turns = [ZERO] * self.known.count, self.modes.any_length
        for _ in range(PASSES):
            exerted = with_sliding(pressed.exerting, [friction.along(multipliers) for friction in frictions])
            found = self._solve(trace, now, pressed.right, exerted, turns).multipliers
            change = _largest(x - y for x, y in zip(found, multipliers, strict=True))
            multipliers = [choose(turns, x, y) for x, y in zip(found, multipliers, strict=True)]
            turns = as_node(where(less_equal(change, _SETTLED * _largest(found)), ZERO, turns))
        return [friction.along(multipliers) for friction in frictions]

    def _moving(self, values: Sequence[Node]) -> list[Node]:
        return [choose(held, ZERO, value) for held, value in zip(self.modes.held(), values, strict=True)]

    # --- positions and speeds -----------------------------------------------------------------------------------------

    def missed(self) -> Program:
        """Return -> phi, residual of the rows that act."""
        trace = Trace("missed", arrays(self.mechanism))
        known = self._at_rows(trace, contact_residuals)
        rows = tuple(self.mechanism.rows[k] for k in self._others)
        others = row_motions(replace(self._motion, mechanism=replace(self.mechanism, rows=rows)))
        for level, nodes in residuals(others, [self._acts[k] for k in self._others]).items():
            known[level].update(zip(self._others, nodes, strict=True))
        every = range(self.known.count)
        return trace.finish({name: column(values[k] for k in every) for name, values in known.items()})

    def put_back(self, missed: Program) -> Program:
        """Return both corrections: that of u for phidot where that of q leads, with H where it starts."""
        trace = Trace("put_back", arrays(self.mechanism))
        now, holonomic = self._rows(trace), [k for k, row in enumerate(self.mechanism.rows) if row.is_holonomic]
        change = self._least(trace, now, holonomic, now.values["phi"])
        of_q = coordinate_rates(self.mechanism, trace["q"], [-x for x in change])
        restricting = [k for k, row in enumerate(self.mechanism.rows) if row.restricts]
        of_u = self._least(trace, now, restricting, residual_ahead(trace, missed, of_q))
        return trace.finish({"of_q": column(of_q), "of_u": column([-x for x in of_u])})

    def _least(self, trace: Trace, now: _RowsAtState, places: Sequence[int], wanted: Sequence[Node]) -> list[Node]:
        """Return the least speeds that give the rows at `places` the `wanted` rates: by mass, or of those not held.

        Rows that define forces restrict nothing, and are not counted among the independent ones.
        """
        held, some = self.modes.held(), self.modes.any_held
        by_row = {k: of_moving(now.jacobian[k], now.matrix[k], held, some) for k in self._others}
        known, given = self.known, {"jacobian": now.values["jacobian"], "matrix": now.values["matrix"], "held": held}
        kinds = [correcting_rows(*each) for each in zip(known.contacts.kinds, known.rows_of_kinds, strict=True)]
        for k, values in enumerate(self._of_contacts(trace, correction_elements, given)):
            rows = self._spread(k, kinds[known.contacts.chosen[k]], values["elements"])
            by_row |= zip(known.contacts.of("rows", k), rows, strict=True)
        matrix = [by_row[k] for k in places]
        acting = [self._acts[k] for k in places]
        every = zip(self._acts, self.mechanism.rows, strict=True)
        defining = sum((acts for acts, row in every if not row.restricts), ZERO)
        most = self.mechanism.parameters.slot(INDEPENDENT) - defining
        found = trace.solve(matrix, [wanted[k] for k in places], len(held), most, acting)
        pairs = zip(self._moving(found.solution), now.unweighted(found.solution), strict=True)
        return [choose(some, a, b) for a, b in pairs]

    # --- where a mode ends --------------------------------------------------------------------------------------------

    def events(self, sources: Sources) -> Program:
        """Return -> values: those of `quantities.events`, then the `functions`, negative where a mode does not end."""
        mechanism = self.mechanism
        trace = Trace("events", (*arrays(mechanism), forces_of(mechanism)))
        asked = [*mechanism.stops.values(), *mechanism.kinks, *mechanism.fades]
        values = with_quantities(trace, sources, asked)
        known = self._functions(trace)
        values += [as_node(known[name]) for name in functions(mechanism)]
        return trace.finish({"values": column(values)})

    def _functions(self, trace: Trace) -> dict[str, Node]:
        """Return the switching functions by name, those of friction and ends of contacts by kinds where they touch."""
        found: dict[str, Node] = {}

        def watch(values: Mapping[str, S]) -> dict[str, Node]:
            return {name: choose(self.modes.watched(name), value, _NO_END) for name, value in values.items()}

        given = {"rows": trace["multipliers"]}
        for make in (ends_of_normal, ends_of_touching):
            of_normal = make is ends_of_normal
            for place, values in zip(self.known.contacts.places, self._of_contacts(trace, make, given), strict=False):
                own = functions_of(self.mechanism.one_way[place])
                names = [name for name in own if is_of_normal(name) == of_normal]
                ends = dict(zip(names, values["values"], strict=True))
                found |= ends if of_normal else watch(ends)
        others = replace(self._motion, mechanism=self._other_elements)
        return found | watch(ModeValues(others).functions(trace["multipliers"]))


def _largest(values: Iterable[Node]) -> Node:
    return as_node(reduce(maximum, map(absolute, values)))
