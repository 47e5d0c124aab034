"""The letters of formulas: what they are worth at the start, and how formulas over them are written."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from typing import Final

from multibody_sym.algebra.book_form import book_form, with_doubles
from multibody_sym.algebra.quotient_functions import exact, with_whole_angles
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Quotient
from multibody_sym.answers.records import Definition
from multibody_sym.derivation.symbolic_start import WORK, SymbolicState
from multibody_sym.dynamics.start.start import Start
from multibody_sym.mechanics.mechanism import Mechanism, TreeBody
from multibody_sym.mechanics.motion import Motion, motion_of, state_of
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.elementary import BUILD, flatten, leaves, postorder
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import ONE, PI, ZERO, Node, as_node, slot, symbol
from multibody_sym.text.printer import text

_WORK: Final = 50_000
_MOST_TERMS: Final = 40
_MOST_OF_LOOP: Final = 30
"""Terms of an equation that closes a loop; of loops in space with as many all that follows grows too long."""
_LONGEST: Final = 400
_ANGLES: Final = 2_000
_AGREEMENT: Final = 1e-9
_TURNING: Final = ("sin", "cos", "tan")
_BESIDE_LETTER: Final = 1e-11
"""The part of a number that is rounding in formulas whose letters are known to a double."""


@dataclass
class Letters:
    """Letters over one field, with their `values` in floats; `shown`: those that stand for others in what is written.

    `known` is what letters are in formulas, `plain` each as itself.
    """

    shown: Mapping[Node, Node]
    known: dict[Node, Quotient] = field(default_factory=dict)
    plain: dict[Node, Quotient] = field(default_factory=dict)
    values: dict[Node, float] = field(default_factory=dict)
    field: Field = field(default_factory=lambda: Field(_WORK, expands=True))

    def add(self, node: Node, value: float, letter: Letter | None = None) -> None:
        """Make a symbol a letter of the field."""
        self.values[node] = value
        self.plain[node] = self.field.letter(node, letter or Letter(node, PRECISE.mpf(value)))
        self.known[node] = self.plain[node]

    def put_in(self, node: Node, stands: Node) -> None:
        """Let a letter be an expression of others, but where formulas are still to be differentiated."""
        self.known[node] = self.of([stands])[0]

    def of(self, nodes: Iterable[object]) -> list[Quotient]:
        """Return expressions over the letters; raises NoClosedFormError where they are too long."""
        return exact(self.field, map(as_node, nodes), self.known)

    def simplified(self, node: Node) -> Node:
        """Return an expression in its book form, over all letters; raises NoClosedFormError where it is too long."""
        (found,) = exact(self.field, [node], self.plain)
        if found.size > _MOST_OF_LOOP:
            raise NoClosedFormError("how a loop closes is too long for formulas in letters")
        return book_form(found)

    def renew(self) -> None:
        """Let as much work be done again."""
        self.field.work = _WORK

    def written(self, found: Quotient) -> Node:
        """Return a quotient as it is told; raises NoClosedFormError where that is too long, or is not its value."""
        if found.size > _MOST_TERMS:
            raise NoClosedFormError("a formula in letters is too long")
        form = _with_plain_sums(put_in(with_doubles(book_form(with_whole_angles(found))), self.shown))
        try:
            again = evaluate_float([form], self.values)[0]
        except (KeyError, *UNDEFINED):
            raise NoClosedFormError("a formula in letters has no value") from None
        if abs(again - float(found.sample)) > _AGREEMENT * abs(again) + _BESIDE_LETTER:
            raise NoClosedFormError("a formula in letters loses too many digits")
        if len(text(form)) > _LONGEST:
            raise NoClosedFormError("a formula in letters is too long")
        return form


def put_in(node: Node, shown: Mapping[Node, Node]) -> Node:
    return as_node(evaluate([node], lambda leaf: shown.get(leaf, leaf))[0])


def quotient_of(node: Node, letters: Mapping[Node, Letter], work: int = WORK) -> Quotient:
    """Return an expression over letters as a quotient. Raises NoClosedFormError where that takes more `work`."""
    field = Field(work)
    return exact(field, [node], {x: field.letter(x, letter) for x, letter in letters.items()})[0]


def _with_plain_sums(form: Node) -> Node:
    """Return a form with sums in their shortest form in angles, and of symbols: psi for phi + psi - phi."""
    made: dict[Node, Node] = {}
    for n in postorder([form]):
        args = [made[a] for a in n.args]
        if n.op in _TURNING:
            args = [_plain(args[0])]
        made[n] = BUILD[n.op](*n.own, *args) if args else n
        if n.op == "add":
            sizes = [x.args[0] if x.op == "neg" else x for x in flatten("add", made[n])]
            if all(x.op == "symbol" for x in sizes) and len(set(sizes)) < len(sizes):
                made[n] = _plain(made[n])
    return made[form]


def _plain(total: Node) -> Node:
    field = Field(_ANGLES)
    named = enumerate(leaves([total], "symbol"))
    try:
        known = {n: field.letter(n, Letter(n, PRECISE.mpf(1) / (k + 3))) for k, n in named}
        return book_form(exact(field, [total], known)[0])
    except NoClosedFormError:
        return total


# ----------------------------------------------------------------------------------------------------------------------
# Letters for coordinates, speeds and accelerations; for what turns in the plane its angle there, from the x-axis.
#
# Loops close by directions. So formulas are found in absolute angles, of whose differences a book writes the sines,
# and told in the coordinates of the model.


TIME: Final = symbol("t")

Rates = tuple[Node, Node, Node]
"""An angle or a way, its rate, and the rate of that."""


@dataclass(frozen=True)
class Absolute:
    """A coordinate of the model (numbers `q`, `u` of it and of its speed), and the letters that stand for it.

    `letters`: of where it leads in the plane, or of itself; `shown`: the same in the names `own` of the model. They are
    `before` + `sense` times its own; `body` is what it moves.
    """

    q: int
    u: int
    body: str
    own: Rates
    letters: Rates
    shown: Rates
    before: Rates
    sense: int


@dataclass
class Coordinates:
    """All coordinates of a mechanism whose speeds are their rates; `names`: those of the accelerations, by speed.

    `q`, `u`, `udot`: coordinates, speeds and accelerations of joints over the letters.
    """

    mechanism: Mechanism
    symbolic: SymbolicState
    names: Sequence[str]
    all: list[Absolute] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.q: list[Node] = [ZERO] * len(self.mechanism.coordinates)
        self.u: list[Node] = [ZERO] * len(self.mechanism.speeds)
        self.udot: list[Node] = [ZERO] * len(self.mechanism.speeds)
        turned: list[tuple[Rates, Rates]] = []
        for body in self.mechanism.bodies:
            turned.append(self._of_body(body, turned[body.parent] if body.parent >= 0 else (_STILL, _STILL)))

    def _of_body(self, body: TreeBody, turned: tuple[Rates, Rates]) -> tuple[Rates, Rates]:
        """Give letters to the coordinates of a body's joint, and return its angle in letters and in names."""
        free = iter(body.free_steps)
        for step, given in zip(body.steps, body.given, strict=True):
            sense = 0  # 1 where it turns about z, -1 about -z
            if len(step.turns) == 1:
                x, y, z = (component.shadow for component in step.turns[0])
                sense = 0 if (x, y) != (0, 0) or z not in (1, -1) else int(z)
            if given is None:
                for i, k in next(free).rate_pairs:
                    turned = self._of_pair(i, k, body.name, sense, turned)
            elif sense:
                moved = _triple(evaluate(given, self._in_time))
                turned = _plus(turned[0], sense, moved), _plus(turned[1], sense, moved)
        return turned

    def _in_time(self, leaf: Node) -> Node:
        return TIME if leaf is slot("t", 0) else as_node(self.symbolic.state.slots.get(leaf, leaf))

    def _of_pair(self, i: int, k: int, body: str, sense: int, turned: tuple[Rates, Rates]) -> tuple[Rates, Rates]:
        """Give letters to a coordinate and its rates, and return the angle of what they turn."""
        names = self.mechanism.coordinates[i].name, self.mechanism.speeds[k].name, self.names[k]
        own = _triple([symbol(name) for name in names])
        if not sense or (sense == 1 and turned[0] == _STILL):
            letters = shown = values = own
            before, sense_here = _STILL, 1
        else:
            letters = _triple([symbol(f"{name}_in_plane") for name in names])
            shown = _plus(turned[1], sense, own)
            values = _triple([sense * (x - y) for x, y in zip(letters, turned[0], strict=True)])
            before, sense_here = turned[0], sense
        self.q[i], self.u[k], self.udot[k] = values
        self.all.append(Absolute(i, k, body, own, letters, shown, before, sense_here))
        return (letters, shown) if sense else turned

    @property
    def plain(self) -> bool:
        """Whether all speeds are the rates of coordinates."""
        return len(self.all) == len(self.q) == len(self.u)

    @property
    def motion(self) -> Motion:
        """The motion of all bodies over the letters and the time."""
        parameters = [self._in_time(slot("parameters", k)) for k in range(len(self.mechanism.parameters))]
        return motion_of(self.mechanism, state_of(self.mechanism, Node, TIME, self.q, self.u, parameters))

    @property
    def in_names(self) -> dict[Node, Node]:
        """What each letter is in the names of the model, at the time 0."""
        pairs = [pair for x in self.all for pair in zip(x.letters, x.shown, strict=True)]
        return {letter: at_start(node) for letter, node in pairs}

    @property
    def rates(self) -> dict[Node, Node]:
        """The rates of the time and of all letters of coordinates."""
        return {TIME: ONE, **{x.letters[0]: x.letters[1] for x in self.all}}


def at_start(node: Node) -> Node:
    """Return an expression at the time 0."""
    return as_node(evaluate([node], lambda leaf: ZERO if leaf is TIME else leaf)[0])


def _plus(rates: Rates, sense: int, more: Rates) -> Rates:
    return _triple([x + sense * y for x, y in zip(rates, more, strict=True)])


def _triple(nodes: Sequence[object]) -> Rates:
    a, b, c = map(as_node, nodes)
    return a, b, c


_STILL: Final[Rates] = (ZERO, ZERO, ZERO)


# ----------------------------------------------------------------------------------------------------------------------
# The letters that a start has: parameters, and coordinates and speeds that are not plainly zero or a parameter.


_ASIDE: Final = 0.001
"""Time (s) at which formulas are looked at before they are differentiated: nothing vanishes there by chance."""


def state_names(mechanism: Mechanism) -> list[str]:
    """Return the names of coordinates and speeds."""
    return [*(x.name for x in mechanism.coordinates), *(x.name for x in mechanism.speeds)]


def acceleration_names(mechanism: Mechanism) -> list[str]:
    """Return a name for each acceleration: the coordinate's of which it is the second derivative, else the speed's."""
    names = [speed.name for speed in mechanism.speeds]
    for body in mechanism.bodies:
        for q, u in body.rate_pairs:
            names[u] = mechanism.coordinates[q].name
    return names


def letters_of_start(
    coordinates: Coordinates, begin: Start, udot: Sequence[float]
) -> tuple[Letters, dict[Node, Definition]]:
    """Return all letters with their values, and those of the state and accelerations with what was declared for them.

    What is declared as zero, right angles or a parameter stands for itself.
    """
    state, mechanism = coordinates.symbolic.state, coordinates.mechanism
    letters = Letters(coordinates.in_names)
    named = {symbol(c.name) for c in mechanism.coordinates} | {symbol(s.name) for s in mechanism.speeds}
    for node, letter in coordinates.symbolic.letters.items():
        if node not in named:
            letters.add(node, float(letter.sample), letter)
    letters.add(TIME, 0.0, Letter(TIME, PRECISE.mpf(_ASIDE)))
    letters.known[TIME] = letters.field.constant(0)
    for x in coordinates.all:
        letters.values.update(zip(x.own, (begin.q[x.q], begin.u[x.u], float(udot[x.u])), strict=True))
    for x in coordinates.all:
        for node, shown in zip(x.letters, x.shown, strict=True):
            letters.add(node, evaluate_float([at_start(shown)], letters.values)[0])
    definitions, plain = dict[Node, Definition](), dict[Node, Node]()
    for x in coordinates.all:
        declared = as_node(state.q[x.q]), as_node(state.u[x.u])
        units = mechanism.coordinates[x.q].unit, mechanism.speeds[x.u].unit
        for k, (node, unit) in enumerate(zip(declared, units, strict=True)):
            size = node.args[0] if node.op == "neg" else node
            right_angles = node.shadow is not None and (2 * node / PI).shadow in range(-8, 9)
            if node is ZERO or right_angles or (size.op == "symbol" and size is not x.own[k]):
                letters.put_in(x.letters[k], x.before[k] + x.sense * node)
                plain[x.own[k]] = node
            else:
                given = None if node is x.own[k] else node
                definitions[x.own[k]] = Definition(letters.values[x.own[k]], given, unit=unit)
    letters.shown = {letter: put_in(shown, plain) for letter, shown in letters.shown.items()}
    return letters, definitions
