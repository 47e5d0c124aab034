"""States over Nodes for closed forms: the start as it is declared, and any state, in the names of the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from multibody_sym.dynamics.book_form import book_form
from multibody_sym.dynamics.exact_solve import exact_solve
from multibody_sym.dynamics.quotient_field import PRECISE, Field, Letter, NoClosedFormError
from multibody_sym.dynamics.quotient_functions import exact
from multibody_sym.dynamics.start import Start
from multibody_sym.kinematics.motion import motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import State, state_of
from multibody_sym.model.mechanism import Coordinate, Mechanism, Speed
from multibody_sym.scalars.functions import evaluate, evaluate_float, sqrt
from multibody_sym.scalars.node import ZERO, Node, as_node, leaves, slot, symbol

_AS_DECLARED: Final = 1e-12
_WORK: Final = 10_000
_ASIDE: Final = Fraction(1, 1009)


@dataclass(frozen=True)
class SymbolicState:
    """A state over Nodes, and for each symbol that occurs in it the letter that stands for it in closed forms."""

    state: State
    letters: Mapping[Node, Letter]

    def translated(self, mechanism: Mechanism, node: Node) -> Node:
        """Return an expression in the names of the model as one in this state's symbols; quantities stay."""
        in_slots = evaluate([node], lambda leaf: mechanism.symbols.get(leaf, leaf))
        return as_node(evaluate(in_slots, lambda leaf: self.state.slots.get(leaf, leaf))[0])


def declared_state(mechanism: Mechanism, begin: Start) -> SymbolicState:
    """Return the start with coordinates and speeds as declared, in parameters; assembled ones keep their names."""
    parameters, letters = _parameters(mechanism)
    values = {slot("parameters", i): node for i, node in enumerate(parameters)}
    sample = {node: float(letter.sample) for node, letter in letters.items()}

    def declared(named: Sequence[Coordinate | Speed], found: Sequence[float]) -> list[Node]:
        nodes = [as_node(x) for x in evaluate([each.initial for each in named], values)]
        kept = _normalized(mechanism, nodes) if named is mechanism.coordinates else nodes
        for k, each in enumerate(named):
            if abs(evaluate_float([kept[k]], sample)[0] - found[k]) > _AS_DECLARED * max(1.0, abs(found[k])):
                kept[k] = symbol(each.name)
                letters[kept[k]] = Letter(kept[k], PRECISE.mpf(found[k]))
        return kept

    q = declared(mechanism.coordinates, begin.q)
    u = declared(mechanism.speeds, begin.u)
    _find_speeds(mechanism, begin, SymbolicState(state_of(mechanism, Node, ZERO, q, u, parameters), letters), u)
    return SymbolicState(state_of(mechanism, Node, ZERO, q, u, parameters), letters)


def _find_speeds(mechanism: Mechanism, begin: Start, given: SymbolicState, u: list[Node]) -> None:
    """Put closed forms in place of assembled speeds that follow from the others by H u = -phi_t, if there are any."""
    unknown = [k for k, speed in enumerate(mechanism.speeds) if u[k] is symbol(speed.name)]
    if not unknown:
        return
    rows = row_motions(motion_of(mechanism, given.state))
    phidot = [as_node(row.phidot) for row in rows]
    at_rest = evaluate(phidot, lambda leaf: ZERO if leaf in {u[k] for k in unknown} else leaf)
    field = Field(_WORK)
    known = {node: field.letter(node, letter) for node, letter in given.letters.items()}
    try:
        matrix = [exact(field, [as_node(row.jacobian[k]) for k in unknown], known) for row in rows]
        found = exact_solve(matrix, [-x for x in exact(field, map(as_node, at_rest), known)])
        nodes = [book_form(x) for x in found]
    except NoClosedFormError:
        return
    for k, x, node in zip(unknown, found, nodes, strict=True):
        if abs(float(x.sample) - begin.u[k]) <= _AS_DECLARED * max(1.0, abs(begin.u[k])):
            u[k] = node


def any_state(mechanism: Mechanism, begin: Start) -> SymbolicState:
    """Return the state in which time, coordinates and speeds keep their names; the sample is near the start."""
    parameters, letters = _parameters(mechanism)
    q = [symbol(c.name) for c in mechanism.coordinates]
    u = [symbol(s.name) for s in mechanism.speeds]
    time = symbol("t")
    for k, (node, value) in enumerate(zip((time, *q, *u), (0.0, *begin.q, *begin.u), strict=True)):
        # a little aside, where nothing vanishes by chance
        aside = PRECISE.mpf(_ASIDE.numerator) / (_ASIDE.denominator + 97 * k)
        letters[node] = Letter(node, PRECISE.mpf(value) + aside)
    return SymbolicState(state_of(mechanism, Node, time, q, u, parameters), letters)


def _parameters(mechanism: Mechanism) -> tuple[list[Node], dict[Node, Letter]]:
    """Return the parameter vector over Nodes (those given by others written out), and the letters of the free ones.

    Lengths of ropes and Baumgarte's coefficients, on which no acceleration depends, are zero.
    """
    entries = mechanism.parameters
    known: dict[Node, Node] = {}
    letters: dict[Node, Letter] = {}
    masses = {body.mass.mass for body in mechanism.bodies}
    waiting = list(range(len(entries)))
    while waiting:
        index = waiting.pop(0)
        place, value = slot("parameters", index), entries[index].value
        needed = leaves([value], "slot") if value is not None else []
        if value is None:
            known[place] = ZERO
        elif not needed:
            known[place] = symbol(entries[index].name)
            sample = exact(Field(_WORK), [value], {})[0].sample
            letters[known[place]] = Letter(known[place], sample, entries[index].positive or place in masses)
        elif all(leaf in known for leaf in needed):
            known[place] = as_node(evaluate([value], known)[0])
        else:
            waiting.append(index)
    return [known[slot("parameters", i)] for i in range(len(entries))], letters


def _normalized(mechanism: Mechanism, q: list[Node]) -> list[Node]:
    """Return coordinates with each quaternion divided by its length."""
    normal = list(q)
    for body in mechanism.bodies:
        length = sqrt(sum((q[k] ** 2 for k in body.quaternion), ZERO))
        for k in body.quaternion:
            normal[k] = q[k] / length
    return normal
