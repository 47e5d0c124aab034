"""All equations of an instant as a book has them, numbered and eliminated: bodies, relations, laws of forces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.symbolic_state import SymbolicState
from multibody_sym.answers.worked.actions import Actions, Length
from multibody_sym.answers.worked.bodies import CutFree
from multibody_sym.answers.worked.directions import Directions
from multibody_sym.answers.worked.elimination import Elimination, arranged
from multibody_sym.answers.worked.exactly import Equality, Exactly, Linear, linear
from multibody_sym.dynamics.derivation.symbols import symbols_of
from multibody_sym.kinematics.motion import motion_of
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.rope_rows import RopeSlipRow
from multibody_sym.scalars.node import ZERO, Node, slot


class Equations:
    """The equations of a mechanism (in its mode) at a state; `reason` says why elimination was left out, if it was.

    In `numbers` what is given stands in them as numbers. Raises NoClosedFormError where coefficients grow too long.
    """

    def __init__(self, mechanism: Mechanism, given: SymbolicState, *, plane: bool, numbers: bool = False) -> None:
        self.mechanism, self.given = mechanism, given
        self.symbols = symbols_of(mechanism)
        self.exactly = Exactly(mechanism, self.symbols, given, numbers=numbers)
        self.actions = Actions(motion_of(mechanism, given.state), self.symbols)
        gravity = self.exactly.quotients(self.actions.motion.gravity)
        self.words = Directions(self.exactly, gravity, plane=plane)
        self._aliases: dict[Any, Linear] = {}
        laws = self._without_aliases(list(self._laws()))
        self.cut = CutFree(self.actions, self.exactly, self.words, laws)
        self.relations = list(self._relations())
        self.lengths = [length for length in self.actions.lengths if len(self.pressing(length)) > 1]
        self._signs: dict[Any, int] = {}
        self._given = [e.changed(lambda form: form.with_all(self.cut.known)) for e in laws]
        self._solve()
        wrong = {x: -1 for x, law in self._of_one() if not self.reason and self.result(law).sample < 0}
        if wrong:
            self._signs = wrong
            self._solve()

    def _solve(self) -> None:
        """Number the equations and eliminate."""
        one = self.exactly.constant(1)
        self.laws = list(self._given)
        for x, law in self._of_one():
            self.laws.append(Equality(Linear({x: one}, one * 0), law, "law", (self.actions.told[x],)))
        for number, e in enumerate(self.all, 1):
            e.tag = number
        self.elimination = Elimination(self.exactly, self.symbols.accelerations)
        self.reason = self._eliminated()

    def pressing(self, length: Length) -> list[Linear]:
        """Return the components that do not vanish of a vector whose length presses."""
        places = [self.symbols.multipliers.index(s) for s in length.normals]
        found = [self.normal(place).with_all(self.cut.known) for place in places]
        return [form for form in found if not form.vanishes]

    def _of_one(self) -> Iterator[tuple[Any, Linear]]:
        """Yield friction that one component alone presses, with its law for the sign that this has."""
        for length in self.actions.lengths:
            components = self.pressing(length)
            if len(components) < 2:
                (factor,) = self.exactly.quotients([length.factor])
                zero = Linear({}, factor * 0)
                sign = self._signs.get(length.symbol, 1)
                yield length.symbol, components[0].times(factor * sign) if components else zero

    @property
    def all(self) -> list[Equality]:
        """All equations in the order in which they are printed."""
        of_bodies = (e for body in self.cut.bodies for e in body.equations)
        return [*of_bodies, *self.cut.free, *self.relations, *self.laws]

    def _relations(self) -> Iterator[Equality]:
        """Yield what rows demand of the accelerations."""
        for row, moved in zip(self.mechanism.rows, self.actions.rows, strict=True):
            if moved.kinematic:
                *factors, gamma = self.exactly.quotients([*moved.jacobian, moved.gamma])
                left = linear(zip(self.symbols.accelerations, factors, strict=True), gamma * 0)
                about = (self.actions.element(row.name),)
                found = arranged(Equality(left, Linear({}, gamma), "relation", about), self.symbols.accelerations)
                if isinstance(row, RopeSlipRow):  # the mean of how fast both sides run
                    found = found.changed(lambda form: form.times(2))
                if not found.form.vanishes:
                    yield found

    def _laws(self) -> Iterator[Equality]:
        """Yield what gives forces: friction that slides, springs, parts of reactions that press."""
        zero = self.exactly.constant(0)
        for law in self.actions.laws:
            names = (*(s for s, _ in law.left), *(s for s, _ in law.right))
            *factors, value = self.exactly.quotients([*(x for _, x in (*law.left, *law.right)), law.value])
            left = linear(zip(names[: len(law.left)], factors, strict=False), zero)
            right = linear(zip(names[len(law.left) :], factors[len(law.left) :], strict=True), value)
            yield Equality(left, right, "law", (law.element,))

    def _without_aliases(self, laws: list[Equality]) -> list[Equality]:
        """Return the laws without those that give a reaction another name, which is put in for that."""
        aliases = self._aliases
        for law in laws:
            (of, *others), reactions = law.left.terms, set(self.symbols.reactions)
            plain = not others and law.right.rest.is_zero and (law.left.terms[of] - 1).is_zero
            if plain and len(law.right.terms) == 1 and set(law.right.terms) <= reactions:
                aliases[of] = law.right
        left = [law for law in laws if not set(law.left.terms) & set(aliases)]
        return [law.changed(lambda form: form.with_all(aliases)) for law in left]

    def _eliminated(self) -> str:
        """Eliminate, and return why this was left out."""
        if self.exactly.numbers:
            return "formulas would be too long to be read; what is given stands in the equations as numbers"
        if self.lengths:
            return "the length of a vector presses, which is not linear"
        self.exactly.renew()
        try:
            self.elimination.run(self.all)
        except NoClosedFormError as reason:
            return str(reason)
        return ""

    @cached_property
    def unknowns(self) -> list[Any]:
        """The unknowns in the order in which they are told: accelerations, then forces."""
        used = dict.fromkeys(x for e in self.all for x in (*e.left.terms, *e.right.terms))
        used.update(dict.fromkeys(self.actions.tensions))  # one between drums that stand still acts on no body
        forces = [x for x in (*self.symbols.multipliers, *self.symbols.reactions) if x in used]
        further = [each.symbol for each in self.actions.further if each.symbol in used]
        return [*(x for x in self.symbols.accelerations if x in used), *forces, *further]

    def grip(self, slip: str) -> tuple[Linear, Linear]:
        """Return the greater and the less tension at a rough wheel on which a rope does not slip."""
        one = self.exactly.constant(1)
        (found,) = (each for each in self.actions.grips if each.slip == slip)
        before, behind = (Linear({s: one}, one * 0) for s in (found.before, found.behind))
        return (before, behind) if self.result(before.plus(behind, -1)).sample >= 0 else (behind, before)

    def normal(self, row: int) -> Linear:
        """Return the multiplier of a row, or the reaction that it is another name of."""
        s = self.symbols.multipliers[row]
        one = self.exactly.constant(1)
        return self._aliases.get(s, Linear({s: one}, one * 0))

    def result(self, form: Linear) -> Quotient:
        """Return what a linear form of unknowns comes to; raises NoClosedFormError where it is not determined."""
        found = form.with_all(self.elimination.results)
        if found.terms:
            raise NoClosedFormError("not determined")
        return found.rest


def with_parameters(mechanism: Mechanism, given: SymbolicState) -> SymbolicState:
    """Return a state of another mode of the same mechanism as one of this; further parameters are zero."""
    state = given.state
    parameters = [state.slots.get(slot("parameters", k), ZERO) for k in range(len(mechanism.parameters))]
    return replace(given, state=state_of(mechanism, Node, ZERO, list(state.q), list(state.u), parameters))
