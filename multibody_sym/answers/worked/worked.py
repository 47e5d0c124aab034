"""A solved instant step by step, as a book writes it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any, Final

import sympy

from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.instant.loops import MOST_DEPENDENT, InLetters
from multibody_sym.answers.records import (
    Definition,
    Formula,
    Line,
    Quantity,
    Sentence,
    Solution,
    Words,
    Worked,
    WorkedStep,
)
from multibody_sym.answers.worked.actions import Action, gripping_ratio
from multibody_sym.answers.worked.alternatives import rejected_alternatives
from multibody_sym.answers.worked.equations import (
    BodyForce,
    EliminationStep,
    Equations,
    FreeBody,
    HandElimination,
    LinearForm,
    NumberedEquation,
    accelerations_left,
    in_number,
    in_sympy,
    short,
)
from multibody_sym.derivation.free_bodies import FRICTION, MOMENT, NORMAL, force_letters, guide_normal, row_letter
from multibody_sym.derivation.notation import (
    MULTIPLIER,
    NAME,
    Label,
    Notation,
    Symbols,
    latex_name,
    notation_of,
    symbols_of,
)
from multibody_sym.derivation.symbolic_start import SymbolicState
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.errors import ExpressionError
from multibody_sym.mechanics.mechanism import Mechanism, Source, TreeBody
from multibody_sym.mechanics.modes import is_direction
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.references import in_plane
from multibody_sym.mechanics.units import REACTION_UNITS, MechanismUnits
from multibody_sym.model.fields import Point
from multibody_sym.model.parameters import letters_of
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import ZERO, Node, as_node, slot, symbol
from multibody_sym.scalars.sympy_bridge import to_sympy
from multibody_sym.text.printer import COMPONENTS, text
from multibody_sym.text.units import DIMENSIONLESS

# ----------------------------------------------------------------------------------------------------------------------
# What is given: the values of parameters, the coordinates with their directions, and how it all starts.


_AT_REST: Final = 1e-12


def given_lines(solved: SolvedInstant, symbols: Symbols) -> Iterator[Line]:
    """Yield the lines: parameters with values, coordinates with what they count and where they start."""
    mechanism, told = solved.mechanism, MechanismUnits(solved.mechanism)
    values = zip(mechanism.parameters, symbols.parameters, solved.begin.parameters, strict=True)
    for entry, s, value in values:
        if entry.source is Source.DECLARED:
            turned = entry.value is not None and entry.dimension == DIMENSIONLESS and leaves([entry.value], "pi")
            yield Formula((s,), value=Quantity(float(value), "rad" if turned else told.parameters[entry.name]))
        elif is_direction(entry.name):
            yield Formula((s,), value=Quantity(float(value), ""), before=("in the direction of slip",))
    for body in mechanism.bodies:
        if not (body.is_double or body.is_foot):
            yield from _coordinate_lines(solved, symbols, body)


def _coordinate_lines(solved: SolvedInstant, symbols: Symbols, body: TreeBody) -> Iterator[Line]:
    """Yield what each coordinate of a body counts, that of a screw its angle, and how it starts."""
    mechanism, begin = solved.mechanism, solved.begin
    counted: dict[int, str] = {}
    for free in body.free_steps:
        if free.step.curve is not None:
            counted |= dict.fromkeys(free.q, "place on the curve of")
            continue
        turns = bool(free.q) and mechanism.coordinates[free.q[0]].unit == "rad"
        axes, what = (free.step.turns, "angle about") if turns else (free.step.slides, "way along")
        counted |= dict(zip(free.q, (f"{what} {_axis(axis)} of" for axis in axes), strict=False))
    least = _AT_REST * max(map(abs, (1.0, *begin.u)))
    for q, u in body.rate_pairs:
        rate = Quantity(float(begin.u[u]), mechanism.speeds[u].unit)
        how = ("at rest",) if abs(rate.number) <= least else ("moving with ", rate)
        place = Quantity(float(begin.q[q]), mechanism.coordinates[q].unit)
        yield Sentence(
            (symbols.coordinates[q], f": {counted.get(q, 'coordinate of')} {body.name}, at ", place, ", ", *how)
        )


def _axis(axis: Point) -> str:
    texts = [text(x) for x in axis]
    plain = {("1", "0", "0"): "x", ("0", "1", "0"): "y", ("0", "0", "1"): "z"}
    back = {("-1", "0", "0"): "-x", ("0", "-1", "0"): "-y", ("0", "0", "-1"): "-z"}
    key = (texts[0], texts[1], texts[2])
    return plain.get(key) or back.get(key) or f"({', '.join(texts)})"


# ----------------------------------------------------------------------------------------------------------------------
# Accelerations of loops that grow too long to be eliminated, step by step in letters, each with what it stands for.


_OF_DEPENDENT = "from how loops close", "from the rate of that", "from the second rate of that"


class ByLetters:
    """What gives the accelerations of a start: where loops lead, ratios, inertias and loads by their letters.

    `spelling`, `places` and `values` are those of the letters that steps do not have otherwise.
    """

    def __init__(self, found: InLetters, mechanism: Mechanism, symbols: Symbols) -> None:
        every = found.coordinates.all
        found.instant  # noqa: B018 - defines the accelerations
        accelerations = {x.own[2]: symbols.accelerations[x.u] for x in every}
        self._needed = found.needed([node for node in accelerations if found.defined(node)])
        declared = (*mechanism.coordinates, *mechanism.speeds, *mechanism.parameters)
        made = (*symbols.coordinates, *symbols.speeds, *symbols.parameters)
        self._leaves: dict[Node, Any] = {symbol(each.name): s for each, s in zip(declared, made, strict=True)}
        self._leaves.update(accelerations)
        own = [node for node in self._needed if node not in self._leaves]
        self._leaves.update((node, sympy.Symbol(str(node.data), real=True)) for node in own)
        labels = {node: Label(str(node.data), latex_name(str(node.data))) for node in own}
        self.spelling = {self._leaves[node]: label for node, label in labels.items()}
        self.places = {self._leaves[node]: (NAME, k) for k, node in enumerate(own)}
        self.values = {self._leaves[node]: self._needed[node].value for node in own}
        dependent = [every[k].own for k in found.loops.dependent]
        self._says = {x[k]: _OF_DEPENDENT[k] for k in (0, 1) for x in dependent}
        self._says.update((node, self._needed[node].says) for node in own)
        self._says.update((every[k].own[2], "so") for k in found.loops.free)
        self._says.update((x[2], _OF_DEPENDENT[2]) for x in dependent)

    def lines(self) -> Iterator[Line]:
        """Yield what gives each letter, after what it is found from."""
        for node in self._says:
            one = self._needed.get(node)
            sides = self._sides(node, one) if one is not None else ()
            if sides:
                told = tuple(to_sympy(side, self._leaves) for side in sides)
                yield Formula(told, before=(self._says[node],))

    @staticmethod
    def _sides(node: Node, one: Definition) -> tuple[Node, ...]:
        """Return what is equal; nothing for what is told as a number."""
        return (node, one.expression) if one.expression is not None else one.equation or ()


# ----------------------------------------------------------------------------------------------------------------------

_NOT_UNIQUE: Final = 1e-8
_WORDS: Final = {
    "weight": "weight",
    "load": "force",
    "flow": "reactive force of what leaves or joins",
    "spring": "pull of",
    "reaction": "reaction of joint",
    "counter": "reaction of joint",
    "row": "force of",
    "friction": "friction at",
    "T": "tension of",
    "S": "force of rod",
    "N": "normal force at",
    "F": "friction at",
    "M": "friction at",
}


def worked_steps(solved: SolvedInstant, solution: Solution) -> Worked:
    """Return the steps of a solution; where coefficients grow too long in symbols, with numbers in their place.

    Where expressions have no value at the exact start, as a quotient that is 0/0 there, only what is given is told.
    """
    try:
        try:
            return _Work(solved, solution, numbers=False).written()
        except NoClosedFormError:
            return _Work(solved, solution, numbers=True).written()
    except ExpressionError as reason:
        symbols = symbols_of(solved.mechanism)
        why = Sentence((f"the equations are not written out: {reason.message}",))
        steps = WorkedStep("Given", tuple(given_lines(solved, symbols))), WorkedStep("Equations", (why,))
        return Worked(solved.mechanism.name, steps, notation_of(solved.mechanism, symbols))


class _Work:
    """What the steps are made from."""

    def __init__(self, solved: SolvedInstant, solution: Solution, *, numbers: bool) -> None:
        self.solved, self.solution = solved, solution
        self.mechanism = solved.mechanism
        plane = in_plane(solved.system)
        self.equations = Equations(self.mechanism, _with_speeds(solved), plane=plane, numbers=numbers)
        self.symbols, self.exactly = self.equations.symbols, self.equations.exactly
        self.actions, self.words, self.cut = self.equations.actions, self.equations.words, self.equations.cut
        self.elimination, self.reason = self.equations.elimination, self.equations.reason
        self.unknowns = self.equations.unknowns

    @cached_property
    def _lettered(self) -> dict[Any, str]:
        """The forces whose letter tells what they are, with it."""
        rows = zip(self.symbols.multipliers, self.mechanism.rows, strict=True)
        guides = (body for body in enumerate(self.mechanism.bodies))
        normal = {self._own(k)[across] for k, body in guides if (across := guide_normal(body)) is not None}
        found = {s: letter for s, row in rows if (letter := row_letter(row, self.mechanism))}
        found |= dict.fromkeys(normal, NORMAL)
        return found | {each.symbol: each.letter for each in self.actions.further}

    @cached_property
    def _by_letters(self) -> ByLetters | None:
        """What gives the accelerations in letters; None where they are eliminated, or letters too long as well."""
        found = self.solved.lettered.found if self.reason else None
        return None if found is None else ByLetters(found, self.mechanism, self.symbols)

    @cached_property
    def notation(self) -> Notation:
        """How everything is spelt."""
        plain = notation_of(self.mechanism, self.symbols, labels=letters_of(self.solved.system.parameters))
        letters = force_letters(self.mechanism, self.symbols, self.unknowns, self.actions.further)
        places = {each.symbol: (MULTIPLIER, 10_000 + k) for k, each in enumerate(self.actions.further)}
        spelling = {**plain.spelling, **letters, **self._directions}
        if self._by_letters is not None:
            spelling, places = {**self._by_letters.spelling, **spelling}, {**places, **self._by_letters.places}
        return replace(plain, spelling=spelling, places={**plain.places, **places})

    @cached_property
    def _directions(self) -> dict[Any, Label]:
        """How the components of directions are spelt in which something starts to slide in space."""
        entries = zip(self.mechanism.parameters, self.symbols.parameters, strict=True)
        chosen = [s for entry, s in entries if is_direction(entry.name)]
        return {s: Label(f"d{k}", f"d_{{{k}}}") for k, s in enumerate(chosen, 1)}

    @cached_property
    def values(self) -> dict[Any, float]:
        """The numbers of all symbols."""
        given = self.solved.begin
        found = self._numbers_of(self.solved.numbers)
        found.update(self._by_letters.values if self._by_letters is not None else {})
        found.update(zip(self.symbols.parameters, given.parameters, strict=True))
        found.update(zip(self.symbols.coordinates, given.q, strict=True))
        found.update(zip(self.symbols.speeds, given.u, strict=True))
        for e in self.equations.laws:
            s = next(iter(e.left.terms))
            found[s] = _value(e.right.plus(e.left.without(s), -1), found) / float(e.left.terms[s].sample)
        for length in self.equations.lengths:
            sizes = [_value(form, found) for form in self.equations.pressing(length)]
            found[length.symbol] = float(self.exactly.quotients([length.factor])[0].sample) * math.hypot(*sizes)
        return found

    def _numbers_of(self, instant: StateQuantities) -> dict[Any, float]:
        """Return the accelerations, multipliers and reactions of an instant in floats."""
        found = dict(zip(self.symbols.accelerations, map(float, instant.udot), strict=True))
        found.update(zip(self.symbols.multipliers, map(float, instant.multipliers), strict=True))
        found.update((s, float(instant.tensions[asked])) for s, asked in self.actions.tensions.items())
        for index, body in enumerate(self.mechanism.bodies):
            reaction = instant.reactions[body.joint_name]
            found.update((s, float(reaction[c])) for s, c in zip(self._own(index), COMPONENTS, strict=True))
        return found

    def _unsolved(self) -> set[Any]:
        """Return the unknowns that the equations leave open."""
        if not self.reason:
            return set(self.elimination.unsolved(self.unknowns))
        others = [self._numbers_of(other) for other in self.solved.others]
        least = _NOT_UNIQUE * max((abs(self.values[x]) for x in self.unknowns), default=0.0)
        return {
            x for x in self.unknowns for other in others if abs(other.get(x, self.values[x]) - self.values[x]) > least
        }

    def _own(self, index: int) -> tuple[Any, ...]:
        return self.actions.reaction_symbols(index)

    @cached_property
    def _units(self) -> dict[Any, str]:
        told = MechanismUnits(self.mechanism)
        named = zip(self.symbols.accelerations, self.mechanism.speeds, strict=True)
        found = {s: told.accelerations[speed.name] for s, speed in named}
        rows = zip(self.symbols.multipliers, self.mechanism.rows, strict=True)
        found.update((s, told.multipliers[row.name]) for s, row in rows)
        for index in range(len(self.mechanism.bodies)):
            found.update((s, REACTION_UNITS[c]) for s, c in zip(self._own(index), COMPONENTS, strict=True))
        found.update((each.symbol, "N*m" if each.letter == MOMENT else "N") for each in self.actions.further)
        return found

    # --- steps -----------------------------------------------------------------------------------------------------

    def written(self) -> Worked:
        self.exactly.renew()
        steps = [
            WorkedStep("Given", tuple(given_lines(self.solved, self.symbols))),
            WorkedStep("State", tuple(Sentence((line,)) for line in self.solution.found)),
            *(WorkedStep(f"{body.name}, cut free", tuple(self._body(body))) for body in self.cut.bodies),
            WorkedStep("Free directions of joints", tuple(self._formula(e) for e in self.cut.free)),
            WorkedStep("Relations between accelerations", tuple(self._formula(e) for e in self.equations.relations)),
            WorkedStep("Laws of forces", (*map(self._formula, self.equations.laws), *self._lengths(), *self._grips())),
            WorkedStep("Elimination", tuple(self._elimination())),
            WorkedStep("Result", tuple(self._result())),
            WorkedStep("Conditions", tuple(Sentence((line,)) for line in self._conditions())),
            *rejected_alternatives(self.equations, self.notation, self._units),
        ]
        return Worked(self.mechanism.name, tuple(s for s in steps if s.lines), self.notation, self.values)

    def _lengths(self) -> Iterator[Line]:
        """Yield the laws of friction that the length of a vector presses."""
        for length in self.equations.lengths:
            squares = [in_sympy(self.exactly, form) ** 2 for form in self.equations.pressing(length)]
            (factor,) = self.exactly.quotients([length.factor])
            sides = length.symbol, self.exactly.written(factor) * sympy.sqrt(sympy.Add(*squares))
            yield Formula(sides, before=(length.element,))

    def _grips(self) -> Iterator[Line]:
        """Yield how far one tension may exceed the other where a rope grips a rough wheel."""
        places = {each.slip: each for each in self.actions.grips if not each.slides}
        unsolved = self._unsolved()
        for part in (part for element in self.mechanism.one_way for part in element.frictions if not part.enough):
            grip = places.get(part.rows[0].name)
            if grip is None:
                continue
            (most,) = self.exactly.quotients([gripping_ratio(part, self.actions.motion)])
            less, greater = sorted((grip.before, grip.behind), key=lambda s: self.values[s])
            ratio, begin = self.exactly.written(most), f"{part.name} grips as long as"
            if unsolved & {less, greater}:
                words = f"{begin} neither of ", grip.before, " and ", grip.behind, " is more than ", ratio
                yield Sentence((*words, " times the other"))
            else:
                yield Formula((greater, less * ratio), relation="<=", before=(begin,))

    def _conditions(self) -> Iterator[str]:
        """Yield the conditions, with what happens where they fail."""
        for condition in self.solution.conditions:
            broken = self.solution.limits.get(condition)
            yield f"{condition} (else {broken})" if broken else condition

    def _formula(self, e: NumberedEquation) -> Formula:
        return Formula(e.sides(self.exactly), tag=e.tag, before=tuple(e.about))

    def _body(self, body: FreeBody) -> Iterator[Line]:
        told = {x for e in body.equations for x in (*e.left.terms, *e.right.terms)}
        for force in body.forces:
            s = force.action.symbol
            known = self.cut.known.get(s)
            if s is None or s in told or (known is not None and not known.vanishes):
                yield from self._force(force)
        if not body.equations:
            yield Sentence(("neither inertia nor forces: nothing to be written",))
        for e in body.equations:
            yield self._formula(e)

    def _force(self, force: BodyForce) -> Iterator[Line]:
        """Yield what acts: its size, what it is, and its direction."""
        s, action = force.action.symbol, force.action
        turns = all(x.is_zero for x in force.vector)
        size, direction = self.words.turning(force.moment) if turns else self.words.of(force.vector)
        if s is None and direction[0] == "along ":
            yield Sentence((*direction[1:], ": ", self._named(action)))
            return
        known = self.cut.known.get(s)
        if known is not None:
            yield Sentence(tuple(self._driven(force, known)))
            return
        shown_size = self.exactly.written(size)
        words = self._short(direction, action)
        yield Sentence((shown_size if s is None else s * shown_size, f": {self._named(action)}, ", *words))

    def _driven(self, force: BodyForce, known: LinearForm) -> Iterator[Any]:
        """Yield in words what acts along a free direction of a joint: friction by its letter, or what drives."""
        turns = all(x.is_zero for x in force.vector)
        (s, factor), *others = *known.terms.items(), (None, known.rest)
        rubs = s in self.actions.told and not others[1:] and others[0][1].is_zero
        sign = -1 if rubs and factor.sample < 0 else 1
        vector = [x * sign for x in (force.moment if turns else force.vector)]
        size, direction = self.words.turning(vector) if turns else self.words.of(vector)
        yield self._safely(known) * self.exactly.written(size) * sign
        named = f"{self._acting(s)} {self.actions.told[s]}" if rubs else f"drive of joint {force.action.element}"
        yield f": {named}, "
        yield from self._short(direction, force.action)

    def _acting(self, s: Any) -> str:
        letter = self._lettered.get(s, "")
        letter = self.notation.text(s)[:1] if s in self._lettered else ""
        return {FRICTION: "friction of", MOMENT: "friction of", NORMAL: "force of stop"}.get(letter, "force of")

    def _named(self, action: Action) -> str:
        """Return what acts in words."""
        of_symbol = action.kind in ("row", "reaction", "counter") and action.symbol in self._lettered
        letter = self._lettered[action.symbol] if of_symbol else ""
        word = _WORDS.get(letter, _WORDS[action.kind])
        return f"{word} {action.element}".strip()

    def _short(self, direction: Words, action: Action) -> Words:
        """Return a direction, that of a joint's axis by its name where its components are long."""
        if action.symbol not in self.symbols.reactions:
            return short(direction, ("along its line",))
        axis = "xyz"[self.symbols.reactions.index(action.symbol) % 3]
        way = "along" if action.kind == "reaction" else "against"
        return short(direction, (f"{way} {axis} of {action.element}",))

    def _elimination(self) -> Iterator[Line]:
        if self.reason:
            count, kind = (
                len(self.equations.all) + len(self.equations.lengths),
                "" if self.equations.lengths else "linear ",
            )
            yield Sentence((f"{count} {kind}equations for {len(self.unknowns)} unknowns, solved in numbers:",))
            yield Sentence((self.reason,))
            yield from self._by_each_other()
            return
        for found in self.elimination.steps:
            yield from self._found(found)

    def _by_each_other(self) -> Iterator[Line]:
        """Yield what gives the accelerations in letters, else by those that are left, as relations alone give them."""
        if self._by_letters is not None:
            yield from self._by_letters.lines()
            return
        if len(self.equations.relations) > MOST_DEPENDENT:
            return
        accelerations = self.symbols.accelerations
        alone = HandElimination(self.exactly, accelerations, only=accelerations)
        self.exactly.renew()
        try:
            alone.run([e for e in self.equations.relations if set(e.form.terms) <= set(accelerations)])
            told = [(step.unknown, in_sympy(self.exactly, alone.results[step.unknown])) for step in alone.steps]
        except NoClosedFormError:
            return
        if not self.exactly.numbers:
            yield from (Formula(sides, before=("from relations alone",)) for sides in told)

    def _found(self, found: EliminationStep) -> Iterator[Line]:
        value = self._safely(found.value)
        if found.equation.kind == "law" and found.becomes is None:
            return
        if found.becomes is not None:
            changed = accelerations_left(found.becomes, self.symbols.accelerations)
            if len(changed.form.terms) > 1 or any(x in self.symbols.accelerations for x in changed.form.terms):
                sides = self._safely(changed.left), self._safely(changed.right)
                yield Formula(sides, before=(f"({found.equation.tag}) becomes",))
        yield Formula((found.unknown, value), before=(f"from ({found.equation.tag})",))

    def _safely(self, form: LinearForm) -> Any:
        """Return a linear form in sympy, with numbers where its coefficients are too long to be read."""
        try:
            return in_sympy(self.exactly, form)
        except NoClosedFormError:
            parts = [in_number(a) * x for x, a in form.terms.items()]
            return sympy.Add(in_number(form.rest), *parts)

    def _result(self) -> Iterator[Line]:
        unsolved = self._unsolved()
        for x in self.unknowns:
            if x in unsolved:
                yield Sentence((x, " is not unique: constraints depend on each other"))
                continue
            number = 0.0 if abs(self.values[x]) <= self._rounding else self.values[x]
            value = Quantity(number, self._units.get(x, ""))
            sides = (x,) if self.reason else (x, self._safely(self.elimination.results[x]))
            plain = len(sides) == 2 and sides[1].is_number
            yield Formula(sides[:1] if plain else sides, value=value)

    @cached_property
    def _rounding(self) -> float:
        return 1e-12 * max((abs(self.values[x]) for x in self.unknowns), default=0.0)


def _with_speeds(solved: SolvedInstant) -> SymbolicState:
    """Return the start with letters for speeds that follow from others: a book does not write them out."""
    given, mechanism = solved.symbolic, solved.mechanism
    assembled = {speed.name for speed in mechanism.speeds if speed.name in solved.begin.assembled}
    state, u = given.state, list(given.state.u)
    for k, speed in enumerate(mechanism.speeds):
        if speed.name in assembled and symbol(speed.name) in given.letters and leaves([as_node(u[k])], "symbol"):
            u[k] = symbol(speed.name)
    parameters = [state.slots[slot("parameters", k)] for k in range(len(mechanism.parameters))]
    return replace(given, state=state_of(mechanism, Node, ZERO, list(state.q), u, parameters))


def _value(form: LinearForm, values: Mapping[Any, float]) -> float:
    return float(form.rest.sample) + sum(float(a.sample) * values[x] for x, a in form.terms.items())
