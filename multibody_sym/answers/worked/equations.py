"""All equations of an instant as a book has them, numbered and eliminated: bodies, relations, laws of forces."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.records import Words
from multibody_sym.answers.worked.actions import Action, Actions, Length
from multibody_sym.answers.worked.elimination import (
    Directions,
    Exactly,
    HandElimination,
    LinearForm,
    NumberedEquation,
    accelerations_left,
    linear,
    short,
)
from multibody_sym.derivation.notation import symbols_of
from multibody_sym.derivation.symbolic_start import SymbolicState
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import accelerations, motion_of, partial_velocities, spread
from multibody_sym.mechanics.row_records import RopeSlipRow
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node, as_node
from multibody_sym.scalars.vectors import UNIT_MATRIX, S, Vec, add, apply, cross, dot, scale, subtract

# ----------------------------------------------------------------------------------------------------------------------
# Bodies cut free at an instant: one equation for each direction that matters, with every force by its letter.


@dataclass(frozen=True)
class SumAxis:
    """A direction (world, over Nodes) along which forces are summed, and what it is called."""

    vector: Vec
    name: Words


@dataclass(frozen=True)
class BodyForce:
    """What acts on a body: `action`, its vector (world, for a unit of its symbol), and its moment."""

    action: Action
    vector: tuple[Quotient, Quotient, Quotient]
    moment: tuple[Quotient, Quotient, Quotient]


@dataclass(frozen=True)
class FreeBody:
    """A body cut free: its forces, those that vanish left out, and its equations."""

    name: str
    forces: tuple[BodyForce, ...]
    equations: tuple[NumberedEquation, ...]


class CutBodies:
    """All bodies of an instant cut free; `known`: reactions along free directions, and those that vanish."""

    def __init__(self, actions: Actions, exactly: Exactly, words: Directions, laws: Sequence[NumberedEquation]) -> None:
        self._laws = laws
        self.actions, self.exactly, self.words, self.plane = actions, exactly, words, words.plane
        self.motion, self.symbols = actions.motion, actions.symbols
        self._partials = partial_velocities(self.motion)
        self._at_rest = accelerations(self.motion, [0] * len(self.symbols.speeds))
        self.known: dict[Any, LinearForm] = {}
        self.free: list[NumberedEquation] = []
        idle = self._idle_feet()
        self._nothing = frozenset(self.known)
        bodies = [index for index in range(len(self.motion.bodies)) if index not in idle]
        for index in bodies:
            self._free_directions(index)
        self.bodies = self._reduced([self._body(index) for index in bodies])

    def _idle_feet(self) -> set[int]:
        """Return the massless bodies that only follow where curves are touched: what makes them follow is no force."""
        rows = {row.name: s for row, s in zip(self.motion.mechanism.rows, self.symbols.multipliers, strict=True)}
        found = set()
        for index, body in enumerate(self.motion.mechanism.bodies):
            if body.is_foot and f"{body.joint_name}.t" in rows:
                found.add(index)
                nothing = (*self.actions.reaction_symbols(index), rows[f"{body.joint_name}.t"])
                self.known.update((s, LinearForm({}, self.exactly.constant(0))) for s in nothing)
        return found

    # --- joints ----------------------------------------------------------------------------------------------------

    def _free_directions(self, index: int) -> None:
        """Read off what a joint transmits along its free directions, A^T R = Q."""
        name = self.motion.mechanism.bodies[index].joint_name
        found = [
            NumberedEquation(linear(terms, force.rest * 0), force, "joint", (name,), tag=k)
            for k, (terms, force) in enumerate(self._freedoms(index))
        ]
        named = {s for e in found for s in e.left.terms}
        alone = [e for e in found if len(e.left.terms) == 1]
        solved = found if len(named) == len(found) else alone
        elimination = HandElimination(self.exactly, (), only=named)
        elimination.run(solved)
        self.known.update(elimination.results)
        for e in found:
            if e not in solved:
                self.free.append(e.changed(lambda form: form.with_all(elimination.results)))

    def _freedoms(self, index: int) -> Iterator[tuple[list[tuple[Any, Quotient]], LinearForm]]:
        """Yield for each freedom of a joint the components along it, with their factors, and what drives it."""
        body, moved = self.motion.mechanism.bodies[index], self.motion.bodies[index]
        R_FB, point = self.actions.joint_axes(index), self.actions.joint_point(index)
        own = self.actions.reaction_symbols(index)
        for k, along, turning in zip(body.u, moved.linear, moved.angular, strict=True):
            direction = [*apply(R_FB, add(along, cross(turning, point))), *apply(R_FB, turning)]
            factors = self.exactly.quotients([*direction, self.actions.of_speed[k]])
            rows = list(self.actions.drives(k))
            driven = zip((s for s, _ in rows), self.exactly.quotients([x for _, x in rows]), strict=True)
            force = linear(driven, factors.pop())
            yield [(s, x) for s, x in zip(own, factors, strict=True) if not x.is_zero], force

    # --- bodies ----------------------------------------------------------------------------------------------------

    def _body(self, index: int) -> FreeBody:
        reference, about = self._reference(index)
        actions = (action for action in self.actions.of_body[index] if action.symbol not in self._nothing)
        forces = [force for action in actions if (force := self._force(index, action, reference))]
        equations = tuple(self._equations(index, forces, reference, about))
        return FreeBody(self.motion.mechanism.bodies[index].name, tuple(forces), equations)

    def _reference(self, index: int) -> tuple[Vec, str]:
        """Return about which point (body axes) moments are taken: a hinge on ground, else the centre of mass."""
        body = self.motion.mechanism.bodies[index]
        slides = any(step.slides for step in body.steps)
        if body.parent < 0 and body.steps and not slides and not body.speeds_in_own_axes:
            return self.actions.joint_point(index), f"about {body.joint_name}"
        return self.motion.masses[index].com, "about the centre of mass"

    def _force(self, index: int, action: Action, reference: Vec) -> BodyForce | None:
        force, moment = action.wrench
        R_WB = self.motion.rotation(index)
        world = [*apply(R_WB, force), *apply(R_WB, subtract(moment, cross(reference, force)))]
        found = self.exactly.quotients(world)
        if all(x.is_zero for x in found):
            return None
        return BodyForce(action, (found[0], found[1], found[2]), (found[3], found[4], found[5]))

    def _equations(
        self, index: int, forces: Sequence[BodyForce], reference: Vec, about: str
    ) -> Iterator[NumberedEquation]:
        inertia, bias = self._inertia(index, reference)
        turns = [SumAxis(axis.vector, (*axis.name, f" {about}")) for axis in self.axes(index, turning=True)]
        for part, axes in enumerate((self.axes(index), turns)):
            for axis in axes:
                unit = self.exactly.quotients(axis.vector)
                left = linear(
                    [(a, _dot(unit, vectors[part])) for a, vectors in inertia.items()], _dot(unit, bias[part])
                )
                right = linear([], unit[0] * 0)
                for force in forces:
                    along = _dot(unit, force.moment if part else force.vector)
                    s = force.action.symbol
                    right = right.plus(LinearForm({}, along) if s is None else linear([(s, along)], along * 0))
                turned = left.vanishes and all(
                    a.sample < 0 for a in (*right.terms.values(), right.rest) if not a.is_zero
                )
                right = right.times(-1) if turned else right
                yield NumberedEquation(left, right, "body", axis.name, about_turning=bool(part))

    def _inertia(self, index: int, reference: Vec) -> tuple[dict[Any, Any], Any]:
        """Return for each acceleration, and for none, the rates of momentum and of its moment about a point (world)."""
        mass, R_WB = self.motion.masses[index], self.motion.rotation(index)
        (a, alpha), w = self._at_rest[index], self.motion.bodies[index].w_WB
        arm = subtract(mass.com, reference)

        def rates(acceleration: Vec, moment: Vec) -> list[list[Quotient]]:
            force = scale(mass.mass, acceleration)
            world = [*apply(R_WB, force), *apply(R_WB, add(moment, cross(arm, force)))]
            found = self.exactly.quotients(world)
            return [found[:3], found[3:]]

        of = {
            self.symbols.accelerations[k]: rates(add(v, cross(turn, mass.com)), apply(mass.inertia, turn))
            for k, (v, turn) in self._partials[index].items()
        }
        turning = add(apply(mass.inertia, alpha), cross(w, apply(mass.inertia, w)))
        return of, rates(add(a, apply(spread(alpha, w), mass.com)), turning)

    # --- directions ------------------------------------------------------------------------------------------------

    def axes(self, index: int, *, turning: bool = False) -> list[SumAxis]:
        """Return the directions along which forces on a body, or moments, are summed (world)."""
        R_WB = self.motion.rotation(index)
        body = self.motion.mechanism.bodies[index]
        if turning:
            if self.plane:
                return [SumAxis(UNIT_MATRIX[2], ("moments",))]
            own = UNIT_MATRIX if body.speeds_in_own_axes else self.actions.joint_axes(index)
            named = zip("xyz", own, strict=True)
            return [SumAxis(apply(R_WB, axis), (f"moments along {letter}",)) for letter, axis in named]
        if self.plane:
            return list(self._in_plane(index))
        frame = zip("xyz", self.actions.joint_axes(index), strict=True)
        return [SumAxis(apply(R_WB, axis), (f"along {letter}",)) for letter, axis in frame]

    def _in_plane(self, index: int) -> Iterator[SumAxis]:
        moved, body = self.motion.bodies[index], self.motion.mechanism.bodies[index]
        R_WB = self.motion.rotation(index)
        slides = [apply(R_WB, v) for v, w in zip(moved.linear, moved.angular, strict=True) if _still(w)]
        contact = self._contact(index)
        if len(slides) == 1 and len(body.u) == 1:
            yield SumAxis(slides[0], ("along ", self.symbols.coordinates[body.q[0]]))
            yield SumAxis(self._upward(cross(UNIT_MATRIX[2], slides[0])), ("across",))
        elif contact is not None:
            yield SumAxis(cross(contact[1], UNIT_MATRIX[2]), (f"along {contact[0]}",))
            yield SumAxis(contact[1], ("normal to it",))
        else:
            for letter, axis in zip("xy", self.actions.joint_axes(index), strict=False):
                along = apply(R_WB, axis)
                words = self.words.of(self.exactly.quotients(along))[1]
                yield SumAxis(along, short(words, (f"along {letter} of {body.joint_name}",)))

    def _upward(self, v: Vec) -> Vec:
        (along,) = self.exactly.quotients([dot(v, self.motion.gravity)])
        return v if along.is_zero or along.sample < 0 else scale(-1, v)

    def _contact(self, index: int) -> tuple[str, Vec] | None:
        """Return the contact along which a body's forces are summed, and its normal: that with ground before others."""
        found = []
        for name, of_body in self.actions.contacts:
            if not _still(of_body[index][0]):
                others = sum(not _still(force) for force, _ in of_body) - 1
                found.append((others, name, apply(self.motion.rotation(index), of_body[index][0])))
        return min(found, key=lambda x: x[0])[1:] if found else None

    # --- what says nothing -----------------------------------------------------------------------------------------

    def _reduced(self, bodies: list[FreeBody]) -> list[FreeBody]:
        """Return bodies without equations that say no more than that reactions vanish, or define a moment of no use."""
        bodies = _each(bodies, lambda form: form.with_all(self.known))
        while vanishing := self._vanishing(bodies):
            for s in vanishing:
                self.known[s] = LinearForm({}, self.exactly.constant(0))
                bodies = _each(bodies, lambda form, s=s: form.without(s))
                self.free = [e.changed(lambda form, s=s: form.without(s)) for e in self.free]
        self.free = [e for e in self.free if not e.form.vanishes]
        bodies = [replace(b, equations=tuple(e for e in b.equations if not e.form.vanishes)) for b in bodies]
        return self._without_idle_moments(bodies)

    def _vanishing(self, bodies: Iterable[FreeBody]) -> set[Any]:
        forms = [e.form for e in (*self.free, *(e for body in bodies for e in body.equations))]
        alone = {next(iter(form.terms)) for form in forms if len(form.terms) == 1 and form.rest.is_zero}
        return alone & set(self.symbols.reactions)

    def _without_idle_moments(self, bodies: list[FreeBody]) -> list[FreeBody]:
        """Return bodies without equations of moments that only tell what keeps a body from turning."""
        moments = {s for k, s in enumerate(self.symbols.reactions) if k % 6 > 2}
        while True:
            uses: dict[Any, int] = {}
            for e in (*self.free, *self._laws, *(e for body in bodies for e in body.equations)):
                for s in e.form.terms:
                    uses[s] = uses.get(s, 0) + 1
            idle = [
                e
                for body in bodies
                for e in body.equations
                if e.about_turning and not e.left.terms and any(uses[s] == 1 for s in moments & e.form.terms.keys())
            ]
            if not idle:
                return bodies
            bodies = [replace(b, equations=tuple(e for e in b.equations if e not in idle)) for b in bodies]


def _each(bodies: Iterable[FreeBody], change: Any) -> list[FreeBody]:
    return [replace(b, equations=tuple(e.changed(change) for e in b.equations)) for b in bodies]


def _dot(a: Sequence[Quotient], b: Sequence[Quotient]) -> Quotient:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _still(v: Sequence[S]) -> bool:
    return all(as_node(x).shadow == 0 if isinstance(x, Node) else x == 0 for x in v)


# ----------------------------------------------------------------------------------------------------------------------

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
        self._aliases: dict[Any, LinearForm] = {}
        laws = self._without_aliases(list(self._laws()))
        self.cut = CutBodies(self.actions, self.exactly, self.words, laws)
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
            self.laws.append(NumberedEquation(LinearForm({x: one}, one * 0), law, "law", (self.actions.told[x],)))
        for number, e in enumerate(self.all, 1):
            e.tag = number
        self.elimination = HandElimination(self.exactly, self.symbols.accelerations)
        self.reason = self._eliminated()

    def pressing(self, length: Length) -> list[LinearForm]:
        """Return the components that do not vanish of a vector whose length presses."""
        places = [self.symbols.multipliers.index(s) for s in length.normals]
        found = [self.normal(place).with_all(self.cut.known) for place in places]
        return [form for form in found if not form.vanishes]

    def _of_one(self) -> Iterator[tuple[Any, LinearForm]]:
        """Yield friction that one component alone presses, with its law for the sign that this has."""
        for length in self.actions.lengths:
            components = self.pressing(length)
            if len(components) < 2:
                (factor,) = self.exactly.quotients([length.factor])
                zero = LinearForm({}, factor * 0)
                sign = self._signs.get(length.symbol, 1)
                yield length.symbol, components[0].times(factor * sign) if components else zero

    @property
    def all(self) -> list[NumberedEquation]:
        """All equations in the order in which they are printed."""
        of_bodies = (e for body in self.cut.bodies for e in body.equations)
        return [*of_bodies, *self.cut.free, *self.relations, *self.laws]

    def _relations(self) -> Iterator[NumberedEquation]:
        """Yield what rows demand of the accelerations."""
        for row, moved in zip(self.mechanism.rows, self.actions.rows, strict=True):
            if moved.kinematic:
                *factors, gamma = self.exactly.quotients([*moved.jacobian, moved.gamma])
                left = linear(zip(self.symbols.accelerations, factors, strict=True), gamma * 0)
                about = (self.actions.element(row.name),)
                equation = NumberedEquation(left, LinearForm({}, gamma), "relation", about)
                found = accelerations_left(equation, self.symbols.accelerations)
                if isinstance(row, RopeSlipRow):  # the mean of how fast both sides run
                    found = found.changed(lambda form: form.times(2))
                if not found.form.vanishes:
                    yield found

    def _laws(self) -> Iterator[NumberedEquation]:
        """Yield what gives forces: friction that slides, springs, parts of reactions that press."""
        zero = self.exactly.constant(0)
        for law in self.actions.laws:
            names = (*(s for s, _ in law.left), *(s for s, _ in law.right))
            *factors, value = self.exactly.quotients([*(x for _, x in (*law.left, *law.right)), law.value])
            left = linear(zip(names[: len(law.left)], factors, strict=False), zero)
            right = linear(zip(names[len(law.left) :], factors[len(law.left) :], strict=True), value)
            yield NumberedEquation(left, right, "law", (law.element,))

    def _without_aliases(self, laws: list[NumberedEquation]) -> list[NumberedEquation]:
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

    def grip(self, slip: str) -> tuple[LinearForm, LinearForm]:
        """Return the greater and the less tension at a rough wheel on which a rope does not slip."""
        one = self.exactly.constant(1)
        (found,) = (each for each in self.actions.grips if each.slip == slip)
        before, behind = (LinearForm({s: one}, one * 0) for s in (found.before, found.behind))
        return (before, behind) if self.result(before.plus(behind, -1)).sample >= 0 else (behind, before)

    def normal(self, row: int) -> LinearForm:
        """Return the multiplier of a row, or the reaction that it is another name of."""
        s = self.symbols.multipliers[row]
        one = self.exactly.constant(1)
        return self._aliases.get(s, LinearForm({s: one}, one * 0))

    def result(self, form: LinearForm) -> Quotient:
        """Return what a linear form of unknowns comes to; raises NoClosedFormError where it is not determined."""
        found = form.with_all(self.elimination.results)
        if found.terms:
            raise NoClosedFormError("not determined")
        return found.rest
