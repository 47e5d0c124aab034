"""Formulas of a start whose loops leave none in what is given alone: in letters, each with what it stands for.

What is asked for is written in coordinates, speeds, accelerations and forces, as far as it names them. Coordinates
that follow are given by the loops' closure, their speeds and accelerations by its rates, those of the freedoms by the
equation of motion reduced to them, and forces by what then moves.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cached_property
from typing import Any

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.in_letters.coordinates import Coordinates
from multibody_sym.answers.in_letters.loops import Closing, Loops
from multibody_sym.answers.in_letters.places import places_of
from multibody_sym.answers.in_letters.record import Definition
from multibody_sym.answers.in_letters.reduced import Reduced
from multibody_sym.answers.in_letters.start import acceleration_letters, free_name, letters_of_start
from multibody_sym.answers.symbolic_state import SymbolicState
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.dynamics.start.start import Start
from multibody_sym.errors import ExpressionError
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.units import MechanismUnits
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.scalars.traversal import leaves


class InLetters:
    """What is asked for at a start, in letters; `definitions` say what they stand for, by symbol.

    Raises NoClosedFormError where no loop is closed, speeds are no rates of coordinates, or formulas grow too long.
    """

    def __init__(self, mechanism: Mechanism, symbolic: SymbolicState, begin: Start, numbers: Instant) -> None:
        if not mechanism.rows or mechanism.one_way or mechanism.impact is not None:
            raise NoClosedFormError("no loop is closed, or what holds one way only may close it")
        self._taken = {str(name.data) for name in (*mechanism.symbols, *symbolic.letters)}
        names = acceleration_letters(mechanism, self._taken)
        self._taken.update(names)
        self.coordinates = Coordinates(mechanism, symbolic, names)
        if not self.coordinates.plain:
            raise NoClosedFormError("speeds are no rates of coordinates")
        self.letters, self.definitions = letters_of_start(self.coordinates, begin, numbers.udot)
        self._units = MechanismUnits(mechanism)
        self.loops = Loops(self.coordinates, self.letters, begin.assembled, self._name)
        self.reduced = Reduced(self.coordinates, self.letters, self.loops, self._name, self._keep)
        self._of_positions()
        self._of_speeds()

    def _name(self, wanted: str) -> Node:
        found = free_name(wanted, self._taken)
        self._taken.add(found)
        return symbol(found)

    def _keep(self, node: Node, found: Definition) -> None:
        self.definitions[node] = found

    # --- what letters stand for -----------------------------------------------------------------------------------

    def _of_positions(self) -> None:
        wanted = [self.coordinates.all[k] for k in self.loops.dependent]
        wanted = [x for x in wanted if x.own[0] in self.definitions]
        zeros = [x.zero for x in self.loops.closings if x.holonomic]
        for node, (expression, equation) in places_of(self.letters, wanted, zeros).items():
            known = self.definitions[node]
            self._keep(node, Definition(known.value, expression, equation, known.unit))

    def _of_speeds(self) -> None:
        known, every = self.letters.known, self.coordinates.all

        def told(k: int, found: Quotient) -> Quotient:
            x = every[k]
            unit = self.coordinates.mechanism.speeds[x.u].unit
            own = (found - self.letters.of([x.before[1]])[0]) * x.sense
            if found.is_zero:
                known[x.letters[1]] = found
            self._keep(x.own[1], Definition(self.letters.values[x.own[1]], self.letters.written(own), unit=unit))
            return known[x.letters[1]]

        self.loops.solved({i: known[every[i].letters[1]] for i in self.loops.free}, self.loops.drift, told)

    def _of_accelerations(self) -> None:
        """Define the accelerations: those of the freedoms by the reduced equations, the others by theirs."""
        known, every = self.letters.known, self.coordinates.all

        def told(k: int, found: Quotient) -> Quotient:
            x = every[k]
            unit = self._units.accelerations[self.coordinates.mechanism.speeds[x.u].name]
            form = self._form((found - self.letters.of([x.before[2]])[0]) * x.sense)
            if found.is_zero:
                known[x.letters[2]] = found
            self._keep(x.own[2], Definition(self.letters.values[x.own[2]], form, unit=unit))
            return known[x.letters[2]]

        with suppress(NoClosedFormError, ExpressionError):
            self.loops.solved({i: known[every[i].letters[2]] for i in self.loops.free}, self.loops.bias, told)
        self.letters.renew()
        with suppress(NoClosedFormError, ExpressionError):
            for k, x in self.reduced.of_freedoms().items():
                told(k, x)

    def _of_forces(self) -> None:
        """Define the forces of the closings; those that follow from others do not count."""
        letters = self.letters
        letters.renew()
        kept = {x.force for x in self.loops.closings}
        for leaf in leaves(self.loops.multipliers, "symbol"):
            if leaf not in kept and leaf not in letters.known:
                letters.known[leaf] = letters.field.constant(0)

        def told(closing: Closing, found: Quotient) -> Quotient:
            value = float(found.sample)
            form = self.letters.written(found)
            if found.is_zero:
                letters.known[closing.force] = found
            else:
                letters.add(closing.force, value)
                self._keep(closing.force, Definition(value, form, unit=closing.unit, says=closing.says))
            return letters.known[closing.force]

        with suppress(NoClosedFormError, ExpressionError):
            moved = [letters.known[x.letters[2]] for x in self.coordinates.all]
            matrix, forcing = self.reduced.matrix, self.reduced.forcing
            wanted = {
                k: sum((m * a for m, a in zip(matrix[k], moved, strict=True)), -forcing[k])
                for k in self.loops.dependent
            }
            self.loops.forces(wanted, told)

    def _form(self, found: Quotient) -> Node | None:
        try:
            return self.letters.written(found)
        except NoClosedFormError:
            return None

    # --- what is asked for ----------------------------------------------------------------------------------------

    @cached_property
    def instant(self) -> Instant:
        """The start over letters, all of which have their definitions by then."""
        self._of_accelerations()
        self._of_forces()
        return Instant(self.coordinates.motion, self.coordinates.udot, self.loops.multipliers)

    def of(self, asked: Callable[[Instant], Mapping[str, Any]], name: str) -> Node | None:
        """Return what is asked for, in letters all of which are defined; None where it is too long."""
        instant = self.instant
        self.letters.renew()
        try:
            found = self.letters.written(self.letters.of([asked(instant)[name]])[0])
        except (NoClosedFormError, ExpressionError, KeyError):
            return None
        if found in self.definitions:
            alone = self.definitions[found].expression
            if alone is None:
                return None
            found = alone
        return found if self.defined(found) else None

    def defined(self, form: Node) -> bool:
        """Return whether all letters of a form, and of their definitions, are given by something."""
        return all(self.definitions[x].formula or x in self._given for x in self.needed([form]))

    @cached_property
    def _given(self) -> set[Node]:
        """What is told as a number: coordinates, speeds and accelerations of the freedoms."""
        return {node for i in self.loops.free for node in self.coordinates.all[i].own}

    def needed(self, forms: Any) -> dict[Node, Definition]:
        """Return the definitions of all letters that forms name, and of those that these name."""
        found: dict[Node, None] = {}
        waiting = list(leaves(forms, "symbol"))
        while waiting:
            node = waiting.pop()
            if node in found or node not in self.definitions:
                continue
            found[node] = None
            one = self.definitions[node]
            parts = [one.expression] if one.expression is not None else list(one.equation or ())
            waiting += leaves(parts, "symbol")
        return {node: one for node, one in self.definitions.items() if node in found}


class Lettered:
    """The formulas in letters of a start, made when they are first asked for; without a start there are none."""

    def __init__(self, *made_of: Any) -> None:
        self._made_of = made_of

    @cached_property
    def found(self) -> InLetters | None:
        """The formulas; None where no loops are closed, what holds one way only is among them, or all grow too long."""
        try:
            return InLetters(*self._made_of) if self._made_of else None
        except (NoClosedFormError, ExpressionError, *UNDEFINED):
            return None
