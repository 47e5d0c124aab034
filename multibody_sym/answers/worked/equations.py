"""All equations of an instant as a book has them, numbered, and eliminated by hand."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, Final

import sympy

from multibody_sym.algebra.book_form import book_form, with_doubles
from multibody_sym.algebra.quotient_functions import exact, register_angles, with_whole_angles
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Quotient
from multibody_sym.answers.records import Words
from multibody_sym.answers.worked.actions import Action, Actions, Length
from multibody_sym.derivation.notation import Symbols, symbols_of
from multibody_sym.derivation.symbolic_start import SymbolicState
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion, accelerations, motion_of, partial_velocities, spread
from multibody_sym.mechanics.row_records import ReactionRow, RopeSlipRow
from multibody_sym.mechanics.spanning_tree import free_name
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float, is_zero
from multibody_sym.scalars.node import ZERO, Node, as_node, symbol
from multibody_sym.scalars.sympy_bridge import to_sympy
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

    def __init__(
        self, actions: Actions, exactly: Exactly, words: Directions, laws: Sequence[NumberedEquation], *, rests: bool
    ) -> None:
        self._laws, self._rests = laws, rests
        self.actions, self.exactly, self.words, self.plane = actions, exactly, words, words.plane
        self.motion, self.symbols = actions.motion, actions.symbols
        self._partials = partial_velocities(self.motion)
        self._at_rest = accelerations(self.motion, [0] * len(self.symbols.speeds))
        self.known: dict[Any, LinearForm] = {}
        self.free: list[NumberedEquation] = []
        if rests:
            nothing = LinearForm({}, exactly.constant(0))
            self.known.update(dict.fromkeys(actions.symbols.accelerations, nothing))
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
        if body.parent < 0 and (body.steps or self._rests) and not slides and not body.speeds_in_own_axes:
            return self.actions.joint_point(index), f"about {body.joint_name}"
        if body.steps and not slides and self._is_point(index) and not body.speeds_in_own_axes:
            return self.actions.joint_point(index), f"about {body.joint_name}"
        return self.motion.masses[index].com, "about the centre of mass"

    def _is_point(self, index: int) -> bool:
        return all(is_zero(x) for row in self.motion.masses[index].inertia for x in row)

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
        return bodies if self._rests and self.plane else self._without_idle_moments(bodies)

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
    return all(map(is_zero, v))


# ----------------------------------------------------------------------------------------------------------------------

def _with_lettered_masses(motion: Motion) -> tuple[Motion, dict[Node, float]]:
    """Return a motion in which masses that are given as numbers have letters, and these with their kg.

    Those of points, and of bodies whose inertia names lengths alone.
    """
    mechanism, found, masses = motion.mechanism, dict[Node, float](), []
    declared = (*mechanism.coordinates, *mechanism.speeds, *mechanism.parameters)
    taken = {each.name for each in declared} | {*mechanism.inputs}
    lengths = {symbol(x.name) for x in mechanism.parameters if x.dimension is not None and not x.dimension.mass}
    for body, mass in zip(mechanism.bodies, motion.masses, strict=True):
        node = as_node(mass.mass)
        entries = [as_node(x) for row in mass.inertia for x in row]
        named = leaves(entries, "symbol")
        is_of_lengths = all(map(is_zero, entries)) or (bool(named) and lengths.issuperset(named))
        if node.op in ("number", "real") and node is not ZERO and is_of_lengths:
            letter = symbol(free_name(f"m_{body.name}", taken))
            found[letter] = float(node.data)
            share = letter / node
            first, second, third = (scale(share, row) for row in mass.inertia)
            mass = replace(mass, mass=letter, inertia=(first, second, third))
        masses.append(mass)
    return replace(motion, masses=tuple(masses)), found


class Equations:
    """The equations of a mechanism (in its mode) at a state; `reason` says why elimination was left out, if it was.

    In `numbers` what is given stands in them as numbers. Nothing accelerates where it `rests`. `masses` are those of
    points that are given as numbers, by their symbols.
    Raises NoClosedFormError where coefficients grow too long.
    """

    def __init__(
        self, mechanism: Mechanism, given: SymbolicState, *, plane: bool, numbers: bool = False, rests: bool = False
    ) -> None:
        self.mechanism, self.given = mechanism, given
        self.symbols = symbols_of(mechanism)
        motion, masses = _with_lettered_masses(motion_of(mechanism, given.state))
        letters = {node: Letter(node, PRECISE.mpf(value), True) for node, value in masses.items()}
        lettered = replace(given, letters={**given.letters, **letters})
        self.exactly = Exactly(mechanism, self.symbols, lettered, numbers=numbers)
        self.masses = {self.exactly.named(node): value for node, value in masses.items()}
        self.actions = Actions(motion, self.symbols)
        gravity = self.exactly.quotients(self.actions.motion.gravity)
        self.words = Directions(self.exactly, gravity, plane=plane)
        self._aliases: dict[Any, LinearForm] = {}
        laws = self._without_aliases(list(self._laws()))
        self.cut = CutBodies(self.actions, self.exactly, self.words, laws, rests=rests)
        self.relations = [] if rests else list(self._relations())
        self.lengths = [length for length in self.actions.lengths if len(self.pressing(length)) > 1]
        self._signs: dict[Any, int] = {}
        self._given = [e.changed(lambda form: form.with_all(self.cut.known)) for e in laws]
        self._solve()
        wrong = {x: -1 for x, law in self._of_one() if not self.reason and self.result(law).sample < 0}
        if wrong:
            self._signs = wrong
            self._solve()

    def _solve(self) -> None:
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
            if not others and not law.right.terms and of in self._constants:
                aliases[of] = law.right.times(law.left.rest.field.constant(1) / law.left.terms[of])
            if plain and len(law.right.terms) == 1 and set(law.right.terms) <= reactions:
                aliases[of] = law.right
        left = [law for law in laws if not set(law.left.terms) & set(aliases)]
        return [law.changed(lambda form: form.with_all(aliases)) for law in left]

    @cached_property
    def _constants(self) -> set[Any]:
        """The multipliers that are no forces, but how large friction of a given size is."""
        rows = zip(self.mechanism.rows, self.symbols.multipliers, strict=True)
        return {s for row, s in rows if isinstance(row.plain, ReactionRow) and row.plain.constant is not ZERO}

    def _eliminated(self) -> str:
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


# ----------------------------------------------------------------------------------------------------------------------
# Exact coefficients of equations at an instant: from Nodes in the names of the model to what is printed.


WORK: Final = 200_000
"""How much is done for the equations of one instant, and again for their elimination, in products of terms."""
_ENDLESS: Final = 10**15
_NOTHING: Final = 1e-13
_NEAR: Final = 2e-12


def model_letters(mechanism: Mechanism, symbols: Symbols) -> dict[Node, Any]:
    """Return the symbols in sympy of coordinates, speeds and parameters."""
    declared = (*mechanism.coordinates, *mechanism.speeds, *mechanism.parameters)
    made = (*symbols.coordinates, *symbols.speeds, *symbols.parameters)
    return {symbol(each.name): s for each, s in zip(declared, made, strict=True)}


class Exactly:
    """The field in which the steps are calculated, and how its quotients are written in sympy.

    In `numbers` all that is given is put in as numbers of 12 digits.
    """

    def __init__(self, mechanism: Mechanism, symbols: Symbols, given: SymbolicState, *, numbers: bool) -> None:
        self.numbers = numbers
        self.field = Field(self._work)
        self._known = {node: self.field.letter(node, letter) for node, letter in given.letters.items()}
        self._sample = {node: float(letter.sample) for node, letter in given.letters.items()}
        self._leaves = model_letters(mechanism, symbols)

    def quotients(self, values: Iterable[Any]) -> list[Quotient]:
        """Return values over Nodes as quotients; raises NoClosedFormError where there are none of bearable length."""
        nodes = [as_node(x) for x in values]
        if self.numbers:
            return [self._number(x) for x in evaluate_float(nodes, self._sample)]
        register_angles(self.field, nodes, self._known)
        return exact(self.field, nodes, self._known)

    def _number(self, value: float) -> Quotient:
        return self.field.constant(0 if abs(value) <= _NOTHING else Fraction(f"{value:.12g}"))

    def named(self, node: Node) -> Any:
        """Return the symbol in sympy of a letter that is positive and that the model has not declared."""
        return self._leaves.setdefault(node, sympy.Symbol(str(node.data), positive=True))

    @property
    def letters(self) -> Mapping[Node, Any]:
        """The symbols in sympy of the letters of the model."""
        return self._leaves

    def renew(self) -> None:
        """Let as much work be done again."""
        self.field.work = self._work

    @property
    def _work(self) -> int:
        """How much is done: with numbers, which do not grow, without an end."""
        return _ENDLESS if self.numbers else WORK

    def constant(self, value: int) -> Quotient:
        """Return a whole number."""
        return self.field.constant(value)

    def written(self, quotient: Quotient) -> Any:
        """Return a quotient in sympy; raises NoClosedFormError where it is too long to be read."""
        if self.numbers:
            return in_number(quotient)
        return to_sympy(with_doubles(book_form(with_whole_angles(quotient))), self._leaves)


def in_number(quotient: Quotient) -> Any:
    """Return a quotient's value in sympy, as a decimal of 12 digits."""
    value = Fraction(f"{float(quotient.sample):.12g}")
    near = value if abs(value - round(value)) > _NEAR else Fraction(round(value))
    return sympy.Rational(near.numerator, near.denominator)


@dataclass
class LinearForm:
    """sum terms[x] x + rest, x being symbols of unknowns."""

    terms: dict[Any, Quotient]
    rest: Quotient

    def plus(self, other: LinearForm, factor: Quotient | int = 1) -> LinearForm:
        """Return this plus a multiple of another."""
        terms = dict(self.terms)
        for x, a in other.terms.items():
            total = terms[x] + a * factor if x in terms else a * factor
            if total.is_zero:
                terms.pop(x, None)
            else:
                terms[x] = total
        return LinearForm(terms, self.rest + other.rest * factor)

    def times(self, factor: Quotient | int) -> LinearForm:
        return LinearForm({x: a * factor for x, a in self.terms.items()}, self.rest * factor)

    def with_known(self, x: Any, value: LinearForm) -> LinearForm:
        """Return this with an expression in place of an unknown."""
        factor = self.terms.get(x)
        if factor is None:
            return self
        return LinearForm({y: a for y, a in self.terms.items() if y != x}, self.rest).plus(value, factor)

    def with_all(self, known: Mapping[Any, LinearForm]) -> LinearForm:
        """Return this with expressions in place of all unknowns that are known."""
        found = self
        for x in self.terms:
            found = found.with_known(x, known[x]) if x in known else found
        return found

    def without(self, x: Any) -> LinearForm:
        """Return this without an unknown that vanishes."""
        return LinearForm({y: a for y, a in self.terms.items() if y != x}, self.rest)

    @property
    def vanishes(self) -> bool:
        return not self.terms and self.rest.is_zero


def linear(terms: Iterable[tuple[Any, Quotient]], rest: Quotient) -> LinearForm:
    """Return a linear form of pairs, zeros left out."""
    found = LinearForm({}, rest)
    for x, a in terms:
        if not a.is_zero:
            found = found.plus(LinearForm({x: a}, rest * 0))
    return found


def in_sympy(exactly: Exactly, form: LinearForm) -> Any:
    parts = [exactly.written(a) * x for x, a in form.terms.items()]
    return sympy.Add(exactly.written(form.rest), *parts)


@dataclass
class NumberedEquation:
    """left = right, with the number by which it is named, and where it comes from.

    `kind` is "body", "relation" or "law"; `about` tells the direction or what it says.
    """

    left: LinearForm
    right: LinearForm
    kind: str
    about: tuple[Any, ...] = ()
    tag: int = 0
    about_turning: bool = field(default=False)

    @cached_property
    def form(self) -> LinearForm:
        """Left less right, which is zero."""
        return self.left.plus(self.right, -1)

    def sides(self, exactly: Exactly) -> tuple[Any, Any]:
        return in_sympy(exactly, self.left), in_sympy(exactly, self.right)

    def changed(self, change: Any) -> NumberedEquation:
        return replace(self, left=change(self.left), right=change(self.right))


def unit_sign(values: Sequence[Quotient]) -> list[int]:
    """Return the sign of each value at the sample, 0 where it is zero."""
    return [0 if x.is_zero else 1 if x.sample > 0 else -1 for x in values]


# ----------------------------------------------------------------------------------------------------------------------
# Elimination as it is done by hand: accelerations by each other, friction by its law, then force after force.


@dataclass(frozen=True)
class EliminationStep:
    """One step of an elimination: `unknown` = `value`, from an equation; `becomes` where others have changed it."""

    equation: NumberedEquation
    unknown: Any
    value: LinearForm
    becomes: NumberedEquation | None


@dataclass
class HandElimination:
    """What elimination of `equations` finds: `steps` in their order and `results`, each unknown's value.

    `idle` are equations that follow from others; `only` these unknowns are looked for, where that is given.
    """

    exactly: Exactly
    accelerations: Sequence[Any]
    steps: list[EliminationStep] = field(default_factory=list)
    results: dict[Any, LinearForm] = field(default_factory=dict)
    idle: list[NumberedEquation] = field(default_factory=list)
    only: Collection[Any] | None = None

    def run(self, equations: Sequence[NumberedEquation]) -> None:
        """Eliminate; raises NoClosedFormError where formulas grow too long or equations contradict each other."""
        waiting = list(equations)
        given = {e.tag: e for e in equations}
        while waiting:
            waiting = self._without_idle(waiting)
            chosen = self._pivot(waiting)
            if chosen is None:
                break
            equation, x = chosen
            waiting.remove(equation)
            form = equation.form
            value = form.without(x).times(-(form.rest.field.constant(1) / form.terms[x]))
            changed = None if equation is given[equation.tag] else equation
            self.steps.append(EliminationStep(given[equation.tag], x, value, changed))
            waiting = [
                replace(e, left=e.left.with_known(x, value), right=e.right.with_known(x, value))
                if x in e.left.terms or x in e.right.terms
                else e
                for e in waiting
            ]
        self._put_back()

    def _without_idle(self, waiting: Sequence[NumberedEquation]) -> list[NumberedEquation]:
        left = []
        for e in waiting:
            form = e.form
            if form.terms:
                left.append(e)
                continue
            if not form.rest.is_zero:
                raise NoClosedFormError("the equations contradict each other in symbols")
            self.idle.append(e)
        return left

    def _pivot(self, waiting: Sequence[NumberedEquation]) -> tuple[NumberedEquation, Any] | None:
        """Return the equation and the unknown for which it is solved next."""
        ranked = [
            (self._rank(e, x, a, waiting), i, e, x)
            for i, e in enumerate(waiting)
            for x, a in e.form.terms.items()
            if not a.vanishes and (self.only is None or x in self.only)
        ]
        if not ranked:
            return None
        _, _, equation, x = min(ranked, key=lambda found: found[:2])
        return equation, x

    def _rank(self, e: NumberedEquation, x: Any, a: Quotient, waiting: Sequence[NumberedEquation]) -> tuple[Any, ...]:
        """Return how late a pivot comes.

        Relations between accelerations come first, for the one named last, then laws, then what names one unknown
        force alone, then the force that fills in least; accelerations that are left come last.
        """
        moving = x in self.accelerations
        alone = len(e.form.terms) == 1
        if moving and e.kind == "relation" and all(y in self.accelerations for y in e.form.terms):
            return 0, not _is_unit(a), -self.accelerations.index(x)
        if e.kind == "law" and x in e.left.terms and not moving:
            return 1, 0, 0
        uses = sum(x in other.form.terms for other in waiting)
        filled = (len(e.form.terms) - 1) * (uses - 1)
        return (3 if moving else 2), 0 if alone else 1, filled, not _is_unit(a), a.size

    def _put_back(self) -> None:
        """Find each unknown from what the later ones were found to be."""
        for found in reversed(self.steps):
            value = found.value
            for x in list(value.terms):
                if x in self.results:
                    value = value.with_known(x, self.results[x])
            self.results[found.unknown] = value

    def unsolved(self, unknowns: Collection[Any]) -> list[Any]:
        """Return the unknowns whose value still names others, and those that have none."""
        return [x for x in unknowns if x not in self.results or self.results[x].terms]


def _is_unit(a: Quotient) -> bool:
    return (a - 1).is_zero or (a + 1).is_zero


def accelerations_left(e: NumberedEquation, accelerations: Collection[Any]) -> NumberedEquation:
    """Return an equation with accelerations on the left and all else on the right, with few signs."""
    form = e.form
    zero = form.rest * 0
    left = LinearForm({x: a for x, a in form.terms.items() if x in accelerations}, zero)
    right = LinearForm({x: -a for x, a in form.terms.items() if x not in accelerations}, -form.rest)
    first = next(iter(left.terms.values()), None)
    if first is not None and first.sample < 0:
        left, right = left.times(-1), right.times(-1)
    if not left.terms:
        left, right = right, LinearForm({}, zero)
    return replace(e, left=left, right=right)


# ----------------------------------------------------------------------------------------------------------------------
# Directions in words: up, to the right, or their components.


_LEFT_RIGHT: Final = {(0, 1): "to the right", (0, -1): "to the left"}
_LONGEST: Final = 40


def short(direction: Words, instead: Words) -> Words:
    """Return a direction, or other words where its components are long."""
    return direction if sum(len(str(word)) for word in direction) <= _LONGEST else instead


class Directions:
    """How directions are called, given which way is up (world, the sign of each axis; zeros where there is no up)."""

    def __init__(self, exactly: Exactly, gravity: Sequence[Quotient], *, plane: bool) -> None:
        signs = [-s for s in unit_sign(gravity)]
        self._up = signs if sum(map(abs, signs)) == 1 else [0, 0, 0]
        self._exactly, self.plane = exactly, plane

    def of(self, vector: Sequence[Quotient]) -> tuple[Quotient, Words]:
        """Return a vector's size and direction; the size of one along no axis is 1 and the words hold components."""
        signs = unit_sign(vector)
        along = [k for k in range(3) if signs[k]]
        if len(along) == 1:
            k = along[0]
            return vector[k] * signs[k], (self._word(k, signs[k]),)
        return self._exactly.constant(1), ("along ", *self.components(vector))

    def turning(self, vector: Sequence[Quotient]) -> tuple[Quotient, Words]:
        """Return the size and direction of a moment."""
        size, words = self.of(vector)
        if self.plane and not vector[2].is_zero:
            return size, ("counter-clockwise" if vector[2].sample > 0 else "clockwise",)
        return size, words

    def _word(self, axis: int, sign: int) -> str:
        if self._up[axis]:
            return "up" if sign == self._up[axis] else "down"
        upright = self.plane and axis == 0 and (self._up[1] == 1 or not any(self._up))
        letter = "xyz"[axis]
        return _LEFT_RIGHT[0, sign] if upright else f"along {letter}" if sign > 0 else f"against {letter}"

    def components(self, vector: Sequence[Quotient]) -> Words:
        """Return a vector's components in brackets, two in the plane."""
        shown: list[Any] = ["("]
        for k, x in enumerate(vector[: 2 if self.plane else 3]):
            shown += [", "] if k else []
            shown.append(self._exactly.written(x))
        return (*shown, ")")
