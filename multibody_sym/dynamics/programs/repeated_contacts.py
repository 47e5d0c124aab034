"""Contacts by kinds: contacts of a kind differ in the slots and numbers that they name, and in places of their bodies.

A kind is a mechanism of its own: two bodies (one, on ground) whose poses and velocities are given, with one contact
between them. Its rows are derived once, as those of any mechanism, and a scan computes them for each contact. Bodies of
kinds have the axes of the world, so that directions fixed in the world are exact; contacts on them are turned.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from functools import cache, cached_property
from itertools import accumulate, count, pairwise
from typing import Any, Final

import numpy as np

from multibody_sym.dynamics.programs.repeated_bodies import vectors
from multibody_sym.mechanics.law_elements import FrictionPart, LawElement
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.modes import MODES, every_row, in_every_mode, mode_numbers
from multibody_sym.mechanics.motion import BodyMotion, Motion, PlacedMotion, State, accelerations
from multibody_sym.mechanics.row_records import Bent, Level, Marker, Row, Vertex
from multibody_sym.model.bodies import ORIGIN, Pose
from multibody_sym.program.statements import Integers
from multibody_sym.program.trace import Trace
from multibody_sym.program.tree_passes import Places, Result, Values, scan_each
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO, Node, as_node, slot, slots
from multibody_sym.scalars.vectors import UNIT_MATRIX, ZERO_VECTOR, S, add, apply, cross, product, subtract

_FEW: Final = 4
"""Mean number of contacts of a kind from which on they are derived by kinds."""
_MANY: Final = 24
"""Rows of a mechanism beyond which kinds are worth while."""
_IN_TEXT: Final = (0.0, 1.0, -1.0)
_OWN: Final = ("t", "parameters", "inputs")
"""Arrays whose slots the declaration of a contact may name."""
_NUMBERS_OF_BODIES: Final = ("axes", "place", "rates", "bias", "column", "weighted")
"""Arrays of what contacts read of their bodies: a kind that reads none of an array does not have it computed."""
_SPEEDS: Final = 6
"""Speeds of a body whose pose is given: its velocity and angular velocity in world axes."""

Weighted = Callable[[Sequence[S]], Sequence[S]]


@dataclass(frozen=True)
class ContactKind:
    """A kind of contact: its mechanism in every mode, and its motion, over `leaves` by the names of their arrays.

    `ways` are the places of the speeds that carry each body among those that carry the contact, `size` in number; each
    moves its body by `columns` (6), by `weighted` ones (6) where speeds count by mass.
    """

    mechanism: Mechanism
    motion: Motion
    leaves: Mapping[str, tuple[Node, ...]]
    ways: tuple[tuple[int, ...], ...]
    columns: tuple[tuple[tuple[Node, ...], ...], ...]
    weighted: tuple[tuple[tuple[Node, ...], ...], ...]
    size: int

    def by_speeds(self, row: Sequence[S], columns: Sequence[Sequence[Sequence[Node]]]) -> list[Node]:
        """Return the elements (size) of a row (6 for each body) for the speeds that move the bodies by columns."""
        found = [ZERO] * self.size
        for body, (way, each) in enumerate(zip(self.ways, columns, strict=True)):
            own = row[_SPEEDS * body : _SPEEDS * (body + 1)]
            for place, column in zip(way, each, strict=True):
                found[place] = found[place] + sum((as_node(a) * b for a, b in zip(own, column, strict=True)), ZERO)
        return found


@dataclass(frozen=True)
class LikeContacts:
    """The contacts of a mechanism by kinds: `places` of their elements, `speeds` that carry each, the kind `chosen`.

    `atoms` are by array the places of the values for the leaves of each contact's kind, `values` those of the known
    arrays: the numbers of declarations, poses and velocities of bodies, accelerations without udot, columns.
    """

    kinds: tuple[ContactKind, ...]
    places: tuple[int, ...]
    speeds: tuple[tuple[int, ...], ...]
    chosen: tuple[int, ...]
    atoms: Mapping[str, Sequence[Sequence[int]]]
    values: Mapping[str, tuple[Node, ...]]

    def of(self, array: str, number: int) -> Sequence[int]:
        """Return the places of a contact's values in an array."""
        return self.atoms[array][number]

    def reading(self, places: Mapping[str, Sequence[Sequence[int]]]) -> LikeContacts:
        """Return contacts with places in further arrays, by name: those of each, as many for all of a kind."""
        first = [self.chosen.index(kind) for kind in range(len(self.kinds))]
        kinds = []
        for kind, k in zip(self.kinds, first, strict=True):
            own = {name: slots(name, len(of[k])) for name, of in places.items()}
            kinds.append(replace(kind, leaves={**kind.leaves, **own}))
        return replace(self, kinds=tuple(kinds), atoms={**self.atoms, **places})

    def scanned(
        self,
        trace: Trace,
        made: Sequence[Values],
        given: Mapping[str, Sequence[Node]],
        gates: Sequence[Node] = (),
        unread: Collection[str] = (),
    ) -> dict[str, list[tuple[Node, ...]]]:
        """Return by name the values `made` of the kinds for each contact, 0 where its gate is 0; none without kinds.

        `given` are the values of arrays that are not known; gates are slots of one of them. Where they are 0 nobody
        reads the values whose names are `unread`, and they may be anything.
        """
        if not made:
            return {}
        read = {leaf.data[0] for values in made for nodes in values.values() for leaf in leaves(nodes, "slot")}
        read |= {gate.data[0] for gate in gates}
        inputs = {array.name: trace[array.name] for array in trace.inputs}
        arrays = {name: values for name, values in {**inputs, **self.values, **given}.items() if name in read}
        own = [name for name in self.atoms if name in arrays]
        numbers = {name: number for number, name in enumerate(arrays)}
        ends = {name: [0, *accumulate(len(made[kind][name]) for kind in self.chosen)] for name in made[0]}
        found = scan_each(
            trace,
            list(arrays.values()),
            self.chosen,
            [[leaf for name in own for leaf in kind.leaves[name]] for kind in self.kinds],
            [
                Places(
                    tuple(numbers[name] for name in own for _ in kind.leaves[name]),
                    np.hstack([self._tables[name][k] for name in own]),
                )
                for k, kind in enumerate(self.kinds)
            ],
            [Result(name, places[-1], tuple(places[:-1]), unread=name in unread) for name, places in ends.items()],
            made,
            (numbers[gates[0].data[0]], np.array([gate.data[1] for gate in gates])) if gates else None,
        )
        return {name: [found[name][a:b] for a, b in pairwise(places)] for name, places in ends.items()}

    @cached_property
    def _tables(self) -> dict[str, list[Integers]]:
        """The places in each array of the values of each kind's contacts."""
        members = [[k for k, kind in enumerate(self.chosen) if kind == number] for number in range(len(self.kinds))]
        return {
            name: [np.array([of[k] for k in own], dtype=np.int64).reshape(len(own), -1) for own in members]
            for name, of in self.atoms.items()
        }


def like_contacts(mechanism: Mechanism, motion: Motion, weighted: Weighted) -> LikeContacts:
    """Return the contacts of a mechanism in no mode by kinds; none of them where few are alike.

    Arguments: its motion, and what makes of a row (n) one of speeds that count by mass.
    """
    if len(every_row(mechanism)) <= _MANY or not alike_rows(mechanism):
        return _NONE
    bodies, numbers = _Bodies(motion, weighted), list[Node]()
    known: dict[Any, int] = {}
    kinds: list[ContactKind] = []
    found: list[_Local] = []
    chosen = []
    for place in range(len(mechanism.one_way)):
        try:
            local = _Local(mechanism, bodies, place, numbers)
        except _UnlikeError:
            continue
        if local.identity not in known:
            known[local.identity] = len(kinds)
            kinds.append(local.kind(mechanism))
        found.append(local)
        chosen.append(known[local.identity])
    if len(found) < _FEW * max(1, len(kinds)):
        return _NONE
    numbering = _Numbering(mechanism)
    atoms = [
        {**local.atoms, **numbering.atoms(local.place), "speeds": local.speeds} for local in found
    ]
    return LikeContacts(
        tuple(kinds),
        tuple(local.place for local in found),
        tuple(tuple(local.speeds) for local in found),
        tuple(chosen),
        {name: [each[name] for each in atoms] for name in atoms[0]},
        {name: tuple(nodes) for name, nodes in {**bodies.values, "number": numbers}.items()},
    )


_NONE: Final = LikeContacts((), (), (), (), {}, {})


def alike_rows(mechanism: Mechanism) -> int:
    """Return how many rows contacts of few kinds have: their surfaces and the numbers of speeds are of few sorts."""
    if not all(row.restricts for row in every_row(mechanism)):
        return 0
    ways = list[frozenset[int]]()
    for body in mechanism.bodies:
        ways.append(frozenset(body.u) | (ways[body.parent] if body.parent >= 0 else frozenset()))
    kinds, contacts, count = set[Any](), 0, 0
    for element in mechanism.one_way:
        if _may_be_alike(element):
            skins = element.surfaces or ()
            own = [ways[x.place.body] if x.place.body >= 0 else frozenset() for x in skins]
            rows = len(list(element.rows))
            kinds.add((rows, *map(type, skins), *map(len, own), len(own[0] & own[1])))
            contacts, count = contacts + 1, count + rows
    return count if contacts >= _FEW * len(kinds) else 0


def _may_be_alike(element: LawElement) -> bool:
    if any(row.surfaces is None for row in element.rows) or not element.unilateral:
        return False
    skins = element.surfaces or ()
    return len(element.normals) == 1 and not any(isinstance(skin, Bent | Level | Vertex) for skin in skins)


# --- what contacts read of their bodies ---------------------------------------------------------------------------


@dataclass(frozen=True)
class _Body:
    """The numbers of a body that contacts read, by array, and where those that are data begin there."""

    speeds: tuple[int, ...]
    numbers: Mapping[str, tuple[Node, ...]]
    begins: Mapping[str, int]

    @property
    def pattern(self) -> tuple[tuple[float | None, ...], ...]:
        """The numbers that stand in the text of a kind, None for others."""
        return tuple(tuple(x.shadow if _in_text(x) else None for x in nodes) for nodes in self.numbers.values())


class _Bodies:
    """The arrays in which bodies stand, each where a contact first needed it."""

    def __init__(self, motion: Motion, weighted: Weighted) -> None:
        self.motion, self.weighted = motion, weighted
        self.bias = accelerations(motion, [0] * len(motion.state.u))
        self.values: dict[str, list[Node]] = {name: [] for name in _NUMBERS_OF_BODIES}
        self._known: dict[int, _Body] = {}

    def of(self, body: int) -> _Body:
        """Return the numbers of a body that contacts read."""
        if body not in self._known:
            speeds, columns = self._columns(body)
            (rotation, position), moved = self.motion.poses[body], self.motion.bodies[body]
            rates = self._sum_of_columns(body, speeds, columns)
            if rates is None:
                rates = [[*apply(rotation, x)] for x in (moved.v_WB, moved.w_WB)]
            numbers: dict[str, Sequence[Sequence[S]]] = {
                "axes": rotation,
                "place": [position],
                "rates": rates,
                "bias": [apply(rotation, x) for x in self.bias[body]],
                "column": columns,
                "weighted": self._by_mass(speeds, columns),
            }
            nodes = {name: tuple(as_node(x) for each in values for x in each) for name, values in numbers.items()}
            begins = {name: len(values) for name, values in self.values.items()}
            for name, values in nodes.items():
                self.values[name] += [node for node in values if not _in_text(node)]
            self._known[body] = _Body(tuple(speeds), nodes, begins)
        return self._known[body]

    def _columns(self, body: int) -> tuple[list[int], list[list[S]]]:
        """Return the speeds on the way from ground to a body, and how each moves it in world axes (6)."""
        tree, place = self.motion.mechanism.bodies, self.motion.poses[body][1]
        found: list[tuple[int, list[S]]] = []
        number = body
        while number >= 0:
            moved, (rotation, position) = self.motion.bodies[number], self.motion.poses[number]
            own, arm = [], subtract(place, position)
            for speed, linear, angular in zip(tree[number].u, moved.linear, moved.angular, strict=True):
                turning = apply(rotation, angular)
                own.append((speed, [*add(apply(rotation, linear), cross(turning, arm)), *turning]))
            found = own + found
            number = tree[number].parent
        return [speed for speed, _ in found], [column for _, column in found]

    def _sum_of_columns(self, body: int, speeds: Sequence[int], columns: Sequence[Sequence[S]]) -> list[list[S]] | None:
        """Return velocity and angular velocity (3 each) of a body whose speeds move it along fixed directions.

        None of other bodies, and of those with a prescribed motion, whose velocities are known in their own axes.
        """
        bodies, number = self.motion.bodies, body
        while number >= 0:
            if any(x is not ZERO for x in map(as_node, (*bodies[number].given_linear, *bodies[number].given_angular))):
                return None
            number = self.motion.mechanism.bodies[number].parent
        if any(as_node(x).shadow is None for column in columns for x in column):
            return None
        u = [self.motion.state.u[speed] for speed in speeds]
        rates = [sum((column[k] * x for column, x in zip(columns, u, strict=True)), ZERO) for k in range(_SPEEDS)]
        return [rates[:3], rates[3:]]

    def _by_mass(self, speeds: Sequence[int], columns: Sequence[Sequence[S]]) -> list[list[S]]:
        """Return columns (6) for speeds that count by mass: rows of J times G^-1."""
        count = len(self.motion.state.u)
        rows = []
        for k in range(_SPEEDS):
            row: list[S] = [ZERO] * count
            for speed, column in zip(speeds, columns, strict=True):
                row[speed] = as_node(column[k])
            rows.append(self.weighted(row))
        return [[row[speed] for row in rows] for speed in speeds]


# --- contacts in slots of their kinds -----------------------------------------------------------------------------


class _UnlikeError(Exception):
    """A contact names what no kind can: it is derived with its mechanism."""


class _Local:
    """A contact, number `place` of a mechanism's elements, in slots of its kind; its constants are added to `numbers`.

    `speeds` carry it; `atoms` are by array the places of the values for the leaves of its kind.
    """

    def __init__(self, mechanism: Mechanism, bodies: _Bodies, place: int, numbers: list[Node]) -> None:
        element = mechanism.one_way[place]
        if not _may_be_alike(element):
            raise _UnlikeError
        skins = element.surfaces or ()
        self.place = place
        self.slots: dict[Node, Node] = {}
        self.atoms: dict[str, Sequence[int]] = {name: [] for name in _OWN}
        self._bodies = list(dict.fromkeys(skin.place.body for skin in skins if skin.place.body >= 0))
        self.touched = [bodies.of(body) for body in self._bodies]
        self._features: list[Any] = []
        self._read: dict[Any, int] = {}
        own: list[Node] = []
        self._look_at(element, own)
        self.atoms["number"] = range(len(numbers), len(numbers) + len(own))
        numbers += own
        self.speeds = list(dict.fromkeys(speed for body in self.touched for speed in body.speeds))
        for name in bodies.values:
            counts = [sum(not _in_text(x) for x in body.numbers[name]) for body in self.touched]
            ranges = (range(b.begins[name], b.begins[name] + n) for b, n in zip(self.touched, counts, strict=True))
            self.atoms[name] = [k for each in ranges for k in each]

    @property
    def ways(self) -> tuple[tuple[int, ...], ...]:
        """Where the speeds that move each body are among its own."""
        return tuple(tuple(map(self.speeds.index, body.speeds)) for body in self.touched)

    @cached_property
    def identity(self) -> Any:
        """The features that contacts of one kind share."""
        return tuple(self._features), tuple(body.pattern for body in self.touched), self.ways

    def kind(self, mechanism: Mechanism) -> ContactKind:
        self._axes, self._numbers_left = self._local_numbers("axes"), count()
        self._done: dict[Any, Any] = {}
        element = self._renamed(_with_local_names(mechanism.one_way[self.place]))
        numbers = {name: self._local_numbers(name) for name in _NUMBERS_OF_BODIES}
        moved = [_body_motion(*each) for each in zip(*(numbers[x] for x in ("place", "rates", "bias")), strict=True)]
        speeds = [range(_SPEEDS * k, _SPEEDS * (k + 1)) for k in range(len(moved))]
        bodies = (replace(mechanism.bodies[0], name="", parent=-1, q=(), u=tuple(own)) for own in speeds)
        alone = replace(
            mechanism, bodies=tuple(bodies), coordinates=(), speeds=(), loads=(), rows=(), one_way=(element,)
        )
        every = in_every_mode(alone, shares=True)
        numbers_of = (slots(name, len(self.atoms[name])) for name in ("axes", "place", "rates", "number"))
        named = [*self.slots.values(), *(leaf for each in numbers_of for leaf in each)]
        state = State(Node, (), (ZERO,) * (_SPEEDS * len(moved)), {leaf: leaf for leaf in named})
        leaves = {name: slots(name, len(atoms)) for name, atoms in {**self.atoms, **_Numbering(alone).atoms(0)}.items()}
        return ContactKind(
            every,
            PlacedMotion(every, state, tuple(moved), (), ZERO_VECTOR, [(x.R_PB, x.p_PB) for x in moved]),
            {**leaves, "speeds": slots("speeds", len(self.speeds))},
            self.ways,
            tuple(map(_sixes, numbers["column"])),
            tuple(map(_sixes, numbers["weighted"])),
            len(self.speeds),
        )

    def _local_numbers(self, name: str) -> list[list[Node]]:
        """Return the numbers of its bodies, in slots of its kind where they are data."""
        left = (slot(name, k) for k in count())
        return [[x if _in_text(x) else next(left) for x in body.numbers[name]] for body in self.touched]

    def _look_at(self, part: Any, numbers: list[Node]) -> None:
        """Add what tells the kind of a part to the features, and its constants, in the order of `_renamed`."""
        kind = type(part)
        if kind is Node:
            if part.shadow is None:
                self._features.append(self._in_slots(part))
            elif _in_text(part):
                self._features.append(part)
            else:
                self._features.append("number")
                numbers.append(part)
        elif kind is tuple:
            self._features.append(len(part))
            for each in part:
                self._look_at(each, numbers)
        elif not is_dataclass(kind):
            self._features.append(part)
        elif kind is Marker:
            if part.body >= 0 and part.body not in self._bodies:
                raise _UnlikeError
            self._features.append(self._bodies.index(part.body) if part.body >= 0 else -1)
            self._look_at(part.pose, numbers)
        elif part in self._read:  # as the skins of all rows
            self._features.append(("again", self._read[part]))
        else:
            self._read[part] = len(self._read)
            self._features.append(kind)
            for name in _told_by(kind):
                self._look_at(getattr(part, name), numbers)

    def _in_slots(self, node: Node) -> Node:
        """Return an expression that is no constant in slots of its kind."""
        return self._leaf(node) if not node.args else evaluate([node], self._leaf)[0]

    def _renamed(self, part: Any) -> Any:
        if isinstance(part, Node):
            if part.shadow is None:
                return self._in_slots(part)
            return part if _in_text(part) else slot("number", next(self._numbers_left))
        if type(part) is tuple:
            items = tuple(map(self._renamed, part))
            return items if any(new is not old for new, old in zip(items, part, strict=True)) else part
        if isinstance(part, Marker):
            pose = self._renamed(part.pose)
            if part.body < 0:
                return replace(part, name="", pose=pose)
            body = self._bodies.index(part.body)
            x, y, z = vectors(self._axes[body])  # kinds' bodies have world axes
            position = pose.position if pose.position is ORIGIN else apply((x, y, z), pose.position)
            in_world = Pose(position, product((x, y, z), pose.rotation))
            return replace(part, name="", body=body, pose=in_world)
        if not is_dataclass(part) or isinstance(part, type):
            return part
        if part not in self._done:  # as the skins of all rows
            changed = {field.name: self._renamed(getattr(part, field.name)) for field in fields(part)}
            self._done[part] = replace(part, **{name: x for name, x in changed.items() if x is not getattr(part, name)})
        return self._done[part]

    def _leaf(self, leaf: Node) -> Node:
        array = leaf.data[0]
        if array not in _OWN:
            raise _UnlikeError
        if leaf not in self.slots:
            self.slots[leaf] = slot(array, len(self.atoms[array]))
            self.atoms[array] = [*self.atoms[array], leaf.data[1]]
        return self.slots[leaf]


def _in_text(node: Node) -> bool:
    """Return whether a number stands in the text of a kind: others are data."""
    return node.shadow in _IN_TEXT


@cache
def _told_by(kind: type[Any]) -> list[str]:
    """Return the fields that tell what a contact is: its names, and those of its rows and parts, do not."""
    left_out = {"name", "path", "group"} if issubclass(kind, LawElement | FrictionPart | Row) else set()
    return [field.name for field in fields(kind) if field.name not in left_out]


def _with_local_names(element: LawElement) -> LawElement:
    """Return a contact whose names only tell its rows and parts apart."""
    normals = tuple(replace(row, name=f"normal {k}") for k, row in enumerate(element.normals))
    frictions = tuple(
        replace(
            part, name=f"friction {k}", rows=tuple(replace(row, name=f"{k} {j}") for j, row in enumerate(part.rows))
        )
        for k, part in enumerate(element.frictions)
    )
    return replace(element, name="contact", path=("", ""), group="", normals=normals, frictions=frictions)


def _sixes(numbers: Sequence[Node]) -> tuple[tuple[Node, ...], ...]:
    return tuple(tuple(numbers[k : k + _SPEEDS]) for k in range(0, len(numbers), _SPEEDS))


def _body_motion(place: Sequence[Node], rates: Sequence[Node], bias: Sequence[Node]) -> BodyMotion:
    """Return the motion of a body with world axes, from its place, velocities and accelerations without udot."""
    (position,), (v, w), (linear, angular) = map(vectors, (place, rates, bias))
    units, still = UNIT_MATRIX, (ZERO_VECTOR,) * 3
    return BodyMotion(
        units, position, w, v, (*units, *still), (*still, *units), *(ZERO_VECTOR,) * 2, linear, angular, ZERO_VECTOR
    )


class _Numbering:
    """Where the rows, limits of friction and numbers of modes of a mechanism's elements stand in its arrays."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = replace(mechanism, bodies=(), coordinates=(), speeds=())
        self.modes = {name: k for k, name in enumerate(mode_numbers(mechanism, shares=True))}
        elements = mechanism.one_way
        own = len(mechanism.rows)
        self.rows = list(accumulate((len(list(element.rows)) for element in elements), initial=own))
        self.limits = list(accumulate((2 * sum(x.rubs for x in element.frictions) for element in elements), initial=0))

    def atoms(self, place: int) -> dict[str, Sequence[int]]:
        """Return the places in the arrays `rows`, `limits` and `modes` that belong to an element."""
        alone = replace(self.mechanism, rows=(), one_way=(self.mechanism.one_way[place],))
        return {
            "rows": range(*self.rows[place : place + 2]),
            "limits": range(*self.limits[place : place + 2]),
            MODES: [self.modes[name] for name in mode_numbers(alone, shares=True)],
        }
