"""Passes along a tree: what each kind of body does, said once over slots, becomes a Scan.

Every value is computed in the first pass in which all it depends on is known; what later passes need of it is kept in a
row of the body. What bodies hand on that is the same constant everywhere, or that nobody reads, is neither stored nor
passed, so that the code of a kind is as small as that of a body written out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.program.loops import array_letters, replace_known
from multibody_sym.program.program import Program
from multibody_sym.program.statements import (
    Array,
    Integers,
    Kernel,
    Loop,
    Progression,
    Window,
    progression,
    progression_through,
)
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.node import ZERO, Node, as_node, slot, slots

_KEPT: Final = "kept"
_LONGEST_HEAD: Final = 3


@dataclass(frozen=True)
class Bodies:
    """The bodies in an order in which parents come first: their `kinds`, and the `atoms` for the leaves of the kind.

    `leaves[kind]` are the slots in which a kind is written; atom j of a body stands for leaf j of its kind, and has the
    same array for all bodies of the kind.
    """

    kinds: tuple[int, ...]
    leaves: tuple[tuple[Node, ...], ...]
    atoms: tuple[tuple[Node, ...], ...]

    def places(self, known: Mapping[Node, tuple[int, int]]) -> list[Places]:
        """Return where the leaves of each kind stand, by the arrays and places of atoms."""
        found = []
        for kind in range(len(self.leaves)):
            table = [[known[x] for x in own] for k, own in zip(self.kinds, self.atoms, strict=True) if k == kind]
            where = np.array([[place for _, place in row] for row in table], dtype=np.int64)
            found.append(Places(tuple(array for array, _ in table[0]), where))
        return found


@dataclass(frozen=True, eq=False)
class Places:
    """Where the leaves of a kind stand: the number of the array of each, and for each of its bodies where there.

    `where` has the shape (bodies of the kind, leaves).
    """

    arrays: tuple[int, ...]
    where: Integers


@dataclass(frozen=True)
class Pass:
    """A pass in which a body reads `slot(name, k)`, k < size: outward what its parent (-1: `root`) hands on.

    Inward (`root` None) it reads the sum of what its children hand on.
    """

    name: str
    parents: tuple[int, ...]
    size: int
    root: tuple[Node, ...] | None = None

    @property
    def branches(self) -> bool:
        """Whether bodies hand on to one that others hand on to as well."""
        return self.root is None and len(set(self.parents)) < len(self.parents)

    @property
    def slots(self) -> tuple[Node, ...]:
        """What a body reads."""
        return slots(self.name, self.size)


@dataclass(frozen=True)
class Result:
    """An array of `size` numbers in which the values of body k begin at `places[k]`; they are added if it `adds`.

    `unread`: nobody reads the values of a body whose gate is closed.
    """

    name: str
    size: int
    places: tuple[int, ...]
    adds: bool = False
    unread: bool = False


Values = Mapping[str, Sequence[Node]]
Step = Callable[[int, Values], Values]
"""What a kind does: from what it reads in every pass to what it hands on in each, and its results, by name."""


def scan_tree(
    trace: Trace,
    given: Sequence[Sequence[Node]],
    bodies: Bodies,
    passes: Sequence[Pass],
    results: Sequence[Result],
    step: Step,
) -> dict[str, tuple[Node, ...]]:
    """Return the results of passes along a tree, one after the other, as one scan.

    The atoms of `bodies` and the leaves of roots are among the elements of the arrays that are `given`.
    """
    known = {atom: (i, k) for i, atoms in enumerate(given) for k, atom in enumerate(atoms)}
    scanner = _Scanner(len(given), bodies.kinds, bodies.leaves, bodies.places(known), results, step, passes, known)
    return scanner.scanned(trace, given)


def scan_each(
    trace: Trace,
    given: Sequence[Sequence[Node]],
    kinds: Sequence[int],
    leaves: Sequence[Sequence[Node]],
    places: Sequence[Places],
    results: Sequence[Result],
    made: Sequence[Values],
    gate: tuple[int, Integers] | None = None,
) -> dict[str, tuple[Node, ...]]:
    """Return what each of many things of some `kinds` has `made`, as one scan.

    `places` tell for each kind where what stands for its leaves is; the gate names the array and the place of an
    element for each thing, which takes no part where that is 0.
    """
    scanner = _Scanner(len(given), kinds, leaves, places, results, lambda kind, _: made[kind], gate=gate)
    return scanner.scanned(trace, given)


class _Scanner:
    """Builds the scan; its arrays are in order: given ones, results, a row of each body for each pass, kept values."""

    def __init__(
        self,
        given: int,
        kinds: Sequence[int],
        leaves: Sequence[Sequence[Node]],
        places: Sequence[Places],
        results: Sequence[Result],
        step: Step,
        passes: Sequence[Pass] = (),
        known: Mapping[Node, tuple[int, int]] | None = None,
        gate: tuple[int, Integers] | None = None,
    ) -> None:
        self.passes, self.results, self.gate = passes, results, gate
        self.of_bodies = np.array(kinds, dtype=np.int64)
        self.leaves, self.places, self.known = leaves, places, known or {}
        names = [p.name for p in passes] or [""]
        self.numbers = {p.name: given + len(results) + i for i, p in enumerate(passes)}
        done = _steady(len(leaves), passes, step)
        self.live = _live(passes, results, done)
        self.kinds = [_Kind(names, self.live, outputs) for outputs in done]
        self.segments = list(map(_segments, leaves, places))
        self.first_result = given
        self.stretches = _stretches(kinds)
        self.rows = np.cumsum([0, *(self.kinds[kind].kept_size for kind in kinds)])

    def scanned(self, trace: Trace, given: Sequence[Sequence[Node]]) -> dict[str, tuple[Node, ...]]:
        """Return the results by name."""
        unread = [k for k, result in enumerate(self.results) if result.unread]
        found = trace.scan(given, [result.size for result in self.results], self.work, self.loops(), unread)
        return {result.name: values for result, values in zip(self.results, found, strict=True)}

    @property
    def work(self) -> list[int]:
        """The sizes of the arrays that only work."""
        kept = int(self.rows[-1])
        return [*((len(self.of_bodies) + 1) * len(self.live[p.name]) for p in self.passes), *([kept] if kept else [])]

    def loops(self) -> list[Loop]:
        """Return a loop for each pass, and one iteration before those that begin at the root."""
        loops = []
        for stage in range(max(1, len(self.passes))):
            if stage < len(self.passes) and self.passes[stage].root is not None:
                loops += self._root(self.passes[stage])
            inward = stage < len(self.passes) and self.passes[stage].root is None
            parts = [self._loop(stage, order[::-1] if inward else order) for order in self.stretches]
            loops += parts[::-1] if inward else parts
        return loops

    def _root(self, given: Pass) -> list[Loop]:
        """Return the iteration that writes row 0, from which the bodies on ground read."""
        live = self.live[given.name]
        if not live:
            return []
        assert given.root is not None
        values = [given.root[k] for k in live]
        atoms = leaves(values, "slot")
        inputs = [Array(f"given_{array_letters(k)}") for k in range(len(atoms))]
        known = dict(zip(atoms, (array.slots[0] for array in inputs), strict=True))
        program = Trace("root", inputs).finish({given.name: ((len(live),), replace_known(values, known))})
        reads = [Window(array, Progression((k,))) for array, k in map(self.known.__getitem__, atoms)]
        written = Window(self.numbers[given.name], Progression((0,)))
        return [Loop(1, (Kernel(program, tuple(reads), (written,)),))]

    def _loop(self, stage: int, order: Integers) -> Loop:
        """Return the loop over some bodies."""
        there, chosen = np.unique(self.of_bodies[order], return_inverse=True)
        kernels = []
        for number, kind in enumerate(there.tolist()):
            turns = np.nonzero(chosen == number)[0]
            kernels.append(self._kernel(kind, stage, turns, order[turns]))
        gate = None if self.gate is None else Window(self.gate[0], progression(self.gate[1][order]))
        return Loop(len(order), tuple(kernels), progression(chosen), gate)

    def _kernel(self, kind: int, stage: int, turns: Integers, members: Integers) -> Kernel:
        """Return the kernel of a kind, which runs for `members` in the iterations `turns`."""
        program = self.kinds[kind].program(stage, self.segments[kind])
        rows = [self._row(array.name, kind, members) for array in program.inputs]
        reads = [Window(number, progression_through(turns, places)) for number, places in rows]
        writes = [self._written(output.name, kind, stage, turns, members) for output in program.outputs]
        return Kernel(program, tuple(reads), tuple(writes))

    def _row(self, name: str, kind: int, members: Integers) -> tuple[int, Integers]:
        """Return the array that the bodies read under a name, and from where on."""
        if name == _KEPT:
            return self.numbers_of_kept, self.rows[members]
        if name in self.numbers:
            given = next(p for p in self.passes if p.name == name)
            row = members if given.root is None else np.array(given.parents, dtype=np.int64)[members]
            return self.numbers[name], (row + 1) * len(self.live[name])
        position = self.leaves[kind].index(self.segments[kind][name][0])
        of_kind = np.cumsum(self.of_bodies == kind)[members] - 1
        return self.places[kind].arrays[position], self.places[kind].where[of_kind, position]

    @property
    def numbers_of_kept(self) -> int:
        """The number of the array of kept values."""
        return self.first_result + len(self.results) + len(self.passes)

    def _written(self, name: str, kind: int, stage: int, turns: Integers, members: Integers) -> Window:
        if name == _KEPT:
            begin = self.kinds[kind].kept_before(stage)
            return Window(self.numbers_of_kept, progression_through(turns, self.rows[members] + begin))
        if name in self.numbers:
            given = self.passes[stage]
            row = members if given.root is not None else np.array(given.parents, dtype=np.int64)[members]
            first = progression_through(turns, (row + 1) * len(self.live[name]))
            return Window(self.numbers[name], first, adds=given.branches)
        number = next(i for i, result in enumerate(self.results) if result.name == name)
        result = self.results[number]
        first = progression_through(turns, np.array(result.places, dtype=np.int64)[members])
        return Window(self.first_result + number, first, result.adds)


def _stretches(kinds: Sequence[int]) -> list[Integers]:
    """Return the bodies in stretches: the first few one by one where that leaves kinds which repeat themselves."""
    order = np.arange(len(kinds))
    for head in range(min(_LONGEST_HEAD, len(kinds) - 1) + 1):
        if 2 * len(progression(kinds[head:]).pattern) <= len(kinds) - head:
            return [order[k : k + 1] for k in range(head)] + [order[head:]]
    return [order] if len(order) else []


def _steady(kinds: int, passes: Sequence[Pass], step: Step) -> list[dict[str, tuple[Node, ...]]]:
    """Return what each kind does, with the constants in place that the root and all kinds hand on alike."""
    handed: dict[str, list[Node | None]] = {}
    for p in passes:
        root = p.root if p.root is not None else (ZERO,) * p.size
        handed[p.name] = [node if node.shadow is not None else None for node in root]
    while True:
        read = {
            p.name: tuple(x if c is None else c for x, c in zip(p.slots, handed[p.name], strict=True)) for p in passes
        }
        done = [
            {name: tuple(map(as_node, values)) for name, values in step(kind, read).items()}
            for kind in range(kinds)
        ]
        before = {name: constants.copy() for name, constants in handed.items()}
        for p in passes:
            for outputs in done:
                for k, value in enumerate(outputs[p.name]):
                    constant = handed[p.name][k]
                    if constant is not None and value.shadow != constant.shadow:
                        handed[p.name][k] = None
        if handed == before:
            return done


def _live(passes: Sequence[Pass], results: Sequence[Result], done: Sequence[Values]) -> dict[str, tuple[int, ...]]:
    """Return the elements of every pass that results depend on."""
    names = {p.name for p in passes}
    found: set[Node] = set()
    roots = [node for outputs in done for result in results for node in outputs.get(result.name, ())]
    while roots:
        new = {leaf for leaf in leaves(roots, "slot") if leaf.data[0] in names} - found
        found |= new
        roots = [outputs[leaf.data[0]][leaf.data[1]] for leaf in new for outputs in done]
    return {name: tuple(sorted(leaf.data[1] for leaf in found if leaf.data[0] == name)) for name in names}


class _Kind:
    """The values of one kind by the pass in which they are computed, and those that later passes need of each."""

    def __init__(self, names: Sequence[str], live: Mapping[str, tuple[int, ...]], outputs: Values) -> None:
        self.names, self.live = names, live
        stages = {name: k for k, name in enumerate(names)}
        passed = {name: [outputs[name][k] for k in elements] for name, elements in live.items()}
        others = {name: list(values) for name, values in outputs.items() if name not in stages and values}
        self.stage: dict[Node, int] = {}
        for node in postorder([node for values in (*passed.values(), *others.values()) for node in values]):
            below = [self.stage[a] for a in node.args]
            self.stage[node] = max(below) if below else stages.get(node.data[0], 0) if node.op == "slot" else 0
        self.outputs: list[dict[str, list[Node]]] = [{} for _ in names]
        for name, values in passed.items():
            if values:
                self.outputs[stages[name]][name] = values
        for name, values in others.items():
            self.outputs[max(self.stage[node] for node in values)][name] = values
        self.kept: list[dict[Node, int]] = [{} for _ in names]
        for stage in range(len(names) - 1, -1, -1):
            self._keep(stage)

    def _keep(self, stage: int) -> None:
        """Find what one pass needs of the ones before."""
        stack = [*self.kept[stage], *(node for values in self.outputs[stage].values() for node in values)]
        seen: set[Node] = set()
        while stack:
            node = stack.pop()
            if node in seen or node.shadow is not None or not node.args:
                continue
            seen.add(node)
            if node.op != "neg" and self.stage[node] < stage:
                self.kept[self.stage[node]].setdefault(node, len(self.kept[self.stage[node]]))
            else:
                stack.extend(node.args)

    @cached_property
    def kept_size(self) -> int:
        """The number of kept values."""
        return self.kept_before(len(self.kept))

    def kept_before(self, stage: int) -> int:
        """Return how many values are kept before a pass."""
        return sum(map(len, self.kept[:stage]))

    def program(self, stage: int, segments: Mapping[str, Sequence[Node]]) -> Program:
        """Return what one pass computes; its inputs are named like passes and segments, its outputs like results."""
        outputs = dict(self.outputs[stage])
        if self.kept[stage]:
            outputs[_KEPT] = list(self.kept[stage])
        known = {
            node: slot(_KEPT, self.kept_before(i) + k) for i in range(stage) for node, k in self.kept[i].items()
        }
        known |= {leaf: slot(name, k) for name, part in segments.items() for k, leaf in enumerate(part)}
        known |= {slot(name, e): slot(name, k) for name, live in self.live.items() for k, e in enumerate(live)}
        shapes = {name: (len(part),) for name, part in segments.items()}
        shapes |= {name: (len(live),) for name, live in self.live.items()}
        shapes[_KEPT] = (self.kept_before(stage),)
        ready = {name: ((len(values),), replace_known(values, known)) for name, values in outputs.items()}
        used = {leaf.data[0] for _, values in ready.values() for leaf in leaves(values, "slot")}
        inputs = [Array(name, shape) for name, shape in shapes.items() if name in used]
        return Trace(f"pass_{stage + 1}", inputs).finish(ready)


def _segments(leaves: Sequence[Node], places: Places) -> dict[str, list[Node]]:
    """Return the leaves of a kind, by names of their own, in groups that all its bodies have one after the other."""
    arrays, where = places.arrays, places.where
    groups: list[list[int]] = []
    for j in sorted(range(len(leaves)), key=lambda j: (arrays[j], where[0, j])):
        last = groups[-1][-1] if groups else j
        if groups and arrays[j] == arrays[last] and (where[:, j] == where[:, last] + 1).all():
            groups[-1].append(j)
        else:
            groups.append([j])
    return {f"given_{array_letters(k)}": [leaves[j] for j in group] for k, group in enumerate(groups)}
