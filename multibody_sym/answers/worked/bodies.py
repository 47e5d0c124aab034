"""Bodies cut free as lines: what acts on each, its equations, their elimination; two- and three-force members."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import combinations
from typing import Any, Final, NamedTuple

import sympy

from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.records import Formula, Line, Sentence, Words
from multibody_sym.answers.worked.actions import Action
from multibody_sym.answers.worked.equations import (
    BodyForce,
    EliminationStep,
    Equations,
    Exactly,
    FreeBody,
    LinearForm,
    NumberedEquation,
    accelerations_left,
    in_number,
    in_sympy,
    short,
)
from multibody_sym.derivation.free_bodies import FRICTION, MOMENT, NORMAL, force_letters, guide_normal, row_letter
from multibody_sym.derivation.notation import MASS, MULTIPLIER, Label, Notation, Symbols, latex_name, notation_of
from multibody_sym.dynamics.programs.quantities import Exertion, StateQuantities
from multibody_sym.mechanics.load_records import JointForce, JointPotential, JointSpring
from multibody_sym.mechanics.points import NO_WRENCH
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import sqrt
from multibody_sym.scalars.vectors import S, apply, cross
from multibody_sym.text.values import Quantity, Value

FORCES: Final[Mapping[str, str]] = {
    "force": "force of",
    "moment": "moment of",
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
IMPULSES: Final[Mapping[str, str]] = {
    **dict.fromkeys(("weight", "load", "flow", "spring"), "impulse"),
    **dict.fromkeys(("reaction", "counter"), "impulse of joint"),
    **dict.fromkeys(("row", "T", "S", "N", "force", "moment"), "impulse of"),
    **dict.fromkeys(("friction", "F", "M"), "impulse of friction at"),
}
"""How the kinds of actions, and forces with a letter, are called; in impacts."""


@dataclass(frozen=True, eq=False)
class BodyLines:
    """How bodies cut free are written; `words`: how actions are called."""

    equations: Equations
    notation: Notation
    words: Mapping[str, str]

    @property
    def symbols(self) -> Symbols:
        """The symbols of the unknowns."""
        return self.equations.symbols

    @property
    def exactly(self) -> Exactly:
        """What writes coefficients."""
        return self.equations.exactly

    @cached_property
    def _driving(self) -> dict[str, list[str]]:
        """The names of the springs and forces in each joint."""
        found: dict[str, list[str]] = {}
        for load in self.equations.mechanism.loads:
            if isinstance(load, (JointSpring, JointForce, JointPotential)):
                found.setdefault(load.joint, []).append(load.name)
        return found

    @cached_property
    def _lettered(self) -> dict[Any, str]:
        """The forces whose letter tells what they are, with it."""
        rows = zip(self.symbols.multipliers, self.equations.mechanism.rows, strict=True)
        guides = (body for body in enumerate(self.equations.mechanism.bodies))
        normals = ((k, across) for k, body in guides if (across := guide_normal(body)) is not None)
        found = {s: letter for s, row in rows if (letter := row_letter(row, self.equations.mechanism))}
        found |= {self.equations.actions.reaction_symbols(k)[across]: NORMAL for k, across in normals}
        return found | {each.symbol: each.letter for each in self.equations.actions.further}

    def formula(self, e: NumberedEquation) -> Formula:
        """Return an equation with its number."""
        return Formula(e.sides(self.exactly), tag=e.tag, before=tuple(e.about))

    def body(self, body: FreeBody, used: Sequence[NumberedEquation] | None = None) -> Iterator[Line]:
        """Yield what acts on a body and its equations, those alone that are `used` where this is given."""
        told = {x for e in body.equations for x in (*e.left.terms, *e.right.terms)}
        for force in body.forces:
            s = force.action.symbol
            known = self.equations.cut.known.get(s)
            if s is None or s in told or (known is not None and not known.vanishes):
                yield from self._force(force)
        if not body.equations:
            yield Sentence(("neither inertia nor forces: nothing to be written",))
        for e in body.equations if used is None else (e for e in body.equations if e in used):
            yield self.formula(e)

    def _force(self, force: BodyForce) -> Iterator[Line]:
        s, action = force.action.symbol, force.action
        turns = all(x.is_zero for x in force.vector)
        size, direction = self.equations.words.turning(force.moment) if turns else self.equations.words.of(force.vector)
        if s is None and direction[0] == "along ":
            yield Sentence((*direction[1:], ": ", self._named(force)))
            return
        known = self.equations.cut.known.get(s)
        if known is not None:
            yield from self._driven(force, known)
            return
        shown_size = self.exactly.written(size)
        words = self._short(direction, action)
        yield Sentence((shown_size if s is None else s * shown_size, f": {self._named(force)}, ", *words))

    def _driven(self, force: BodyForce, known: LinearForm) -> Iterator[Sentence]:
        """Yield what acts along a free direction of a joint: friction by its letter, and what drives."""
        for s, factor in known.terms.items():
            rubs = s in self.equations.actions.told
            named = f"{self._acting(s, force)} {self.equations.actions.told[s]}" if rubs else self._drive(force)
            sign = -1 if rubs and factor.sample < 0 else 1
            yield self._along(force, LinearForm({s: factor}, factor * 0), sign, named)
        if not known.rest.is_zero:
            yield self._along(force, LinearForm({}, known.rest), 1, self._drive(force))

    def _drive(self, force: BodyForce) -> str:
        driving = self._driving.get(force.action.element, [f"joint {force.action.element}"])
        turns = all(x.is_zero for x in force.vector)
        return f"{self.words['moment' if turns else 'force']} {' and '.join(driving)}"

    def _along(self, force: BodyForce, value: LinearForm, sign: int, named: str) -> Sentence:
        turns = all(x.is_zero for x in force.vector)
        vector = [x * sign for x in (force.moment if turns else force.vector)]
        size, direction = self.equations.words.turning(vector) if turns else self.equations.words.of(vector)
        shown = safely(self.exactly, value) * self.exactly.written(size) * sign
        return Sentence((shown, f": {named}, ", *self._short(direction, force.action)))

    def _acting(self, s: Any, force: BodyForce) -> str:
        letter = self.notation.text(s)[:1] if s in self._lettered else ""
        other = self.words["moment" if all(x.is_zero for x in force.vector) else "force"]
        return {FRICTION: "friction of", MOMENT: "friction of", NORMAL: "force of stop"}.get(letter, other)

    def _named(self, force: BodyForce) -> str:
        action, turns = force.action, all(x.is_zero for x in force.vector)
        of_symbol = action.kind in ("row", "reaction", "counter") and action.symbol in self._lettered
        letter = self._lettered[action.symbol] if of_symbol else ""
        word = self.words.get(letter, self.words["moment" if turns and action.kind == "row" else action.kind])
        return f"{word} {action.element}".strip()

    def _short(self, direction: Words, action: Action) -> Words:
        """Return a direction, that of a joint's axis by its name where its components are long."""
        if action.symbol not in self.symbols.reactions:
            return short(direction, ("along its line",))
        axis = "xyz"[self.symbols.reactions.index(action.symbol) % 3]
        way = "along" if action.kind == "reaction" else "against"
        return short(direction, (f"{way} {axis} of {action.element}",))

    def found(self, found: EliminationStep, write: Callable[[Exactly, LinearForm], Any]) -> Iterator[Formula]:
        """Yield an equation as it has become, solved for an unknown."""
        value = write(self.exactly, found.value)
        if found.equation.kind == "law" and found.becomes is None:
            return
        if found.becomes is not None:
            changed = accelerations_left(found.becomes, self.symbols.accelerations)
            if len(changed.form.terms) > 1 or any(x in self.symbols.accelerations for x in changed.form.terms):
                sides = write(self.exactly, changed.left), write(self.exactly, changed.right)
                yield Formula(sides, before=(f"({found.equation.tag}) becomes",))
        yield Formula((found.unknown, value), before=(f"from ({found.equation.tag})",))


def safely(exactly: Exactly, form: LinearForm) -> Any:
    """Return a linear form in sympy, with numbers where its coefficients are too long to be read."""
    try:
        return in_sympy(exactly, form)
    except NoClosedFormError:
        parts = [in_number(a) * x for x, a in form.terms.items()]
        return sympy.Add(in_number(form.rest), *parts)


def mass_lines(equations: Equations) -> list[Formula]:
    """Return the masses that have letters in steps alone, with their numbers."""
    return [Formula((s,), value=Quantity(kg, "kg")) for s, kg in equations.masses.items()]


def forces_spelt(equations: Equations, labels: Mapping[str, str]) -> Notation:
    """Return how all symbols of equations are spelt; `labels`: the letters that the model gives names."""
    mechanism, symbols, further = equations.mechanism, equations.symbols, equations.actions.further
    plain = notation_of(mechanism, symbols, labels=labels)
    letters = force_letters(mechanism, symbols, equations.unknowns, further)
    places = {each.symbol: (MULTIPLIER, 10_000 + k) for k, each in enumerate(further)}
    masses = {s: Label(s.name, latex_name(s.name)) for s in equations.masses}
    spelling = {**plain.spelling, **letters, **masses}
    places |= {s: (MASS, k) for k, s in enumerate(masses)}
    return replace(plain, spelling=spelling, places={**plain.places, **places})


def wording(lines: Sequence[Line], notation: Notation) -> tuple[str, ...]:
    """Return the words and letters of lines, without the numbers of equations."""
    parts = ((*line.before, *line.sides) if isinstance(line, Formula) else line.words for line in lines)
    return tuple(" ".join(notation.text(x) if isinstance(x, sympy.Basic) else str(x) for x in each) for each in parts)


# ----------------------------------------------------------------------------------------------------------------------
# Members of bodies at rest in a plane: on two-force members forces act along one line, on three-force ones they meet.


_NOTHING: Final = 1e-9
"""The part of the largest force on all bodies below which one is none."""
_TWO, _THREE = 2, 3


class PlaneForce(NamedTuple):
    """X and Y (N) of a force in the plane, and its moment m about the origin (N m): its line is x Y - y X = m."""

    X: Any
    Y: Any
    m: Any


class Member(NamedTuple):
    """A body with what acts on it.

    Two `elements` pull or press it along one line with the force `size`, tension positive; the lines of three meet at
    `place`, which is empty where they are parallel. Without an element nothing acts.
    """

    body: str
    elements: tuple[str, ...]
    size: Value | None = None
    place: Mapping[str, Value] | None = None


def members(solved: SolvedInstant) -> Iterator[Member]:
    """Yield the bodies at rest in the plane on which nothing, two or three elements act by forces alone."""
    bodies = [(k, body.name) for k, body in enumerate(solved.mechanism.bodies) if not (body.is_double or body.is_foot)]
    found = {k: _forces(solved.numbers, k) for k, _ in bodies}
    largest = max((math.hypot(f.X, f.Y) for own in found.values() for f in own.values()), default=0.0)
    for k, name in bodies:
        others = ((found[k][each], f) for other in solved.others for each, f in _forces(other, k).items())
        if any(abs(a - b) > _NOTHING * largest for pair in others for a, b in zip(*pair, strict=True)):
            continue  # forces are not unique
        acting = tuple(each for each, f in found[k].items() if math.hypot(f.X, f.Y) > _NOTHING * largest)
        if any(each not in acting and abs(f.m) > _NOTHING * largest for each, f in found[k].items()):
            continue  # a couple
        if not acting:
            if largest > 0.0:
                yield Member(name, ())
        elif len(acting) == _TWO:
            size = _size(solved, k, acting)
            if size is not None:
                yield Member(name, acting, size=size)
        elif len(acting) == _THREE and _has_extent(solved.numbers, k, acting):
            yield Member(name, acting, place=_meeting(solved, k, acting, largest))


def _has_extent(instant: StateQuantities, k: int, acting: tuple[str, ...]) -> bool:
    """Return whether elements act at several places of a body, which is no node."""
    places = [place for each in acting if (place := _place(instant, k, each)) is not None]
    return any(math.dist(places[0], place) > 0.0 for place in places[1:])


def _forces(instant: StateQuantities, k: int) -> dict[str, PlaneForce]:
    """Return what acts on a body by its elements, over the scalar of an instant; normal force and friction as one."""
    found: dict[str, PlaneForce] = {}
    rotation, origin = instant.motion.poses[k]
    for each in instant.exertions:
        if each.of_body[k] is NO_WRENCH:
            continue
        force, moment = (apply(rotation, x) for x in each.of_body[k])
        m = moment[2] + cross(origin, force)[2]
        own = found.get(_name(each), PlaneForce(0, 0, 0))
        found[_name(each)] = PlaneForce(own.X + force[0], own.Y + force[1], own.m + m)
    return found


def _name(each: Exertion) -> str:
    return each.path[1]


def _size(solved: SolvedInstant, k: int, acting: tuple[str, ...]) -> Value | None:
    """Return the force along the line of two, tension positive; None where they act at one place or by a couple."""
    places = [_place(solved.numbers, k, each) for each in acting]
    first, second = places
    if first is None or second is None:
        return None
    way = [b - a for a, b in zip(first, second, strict=True)]
    force, length = _forces(solved.numbers, k)[acting[1]], math.hypot(*way)
    along = force.X * way[0] + force.Y * way[1]
    if abs(abs(along) - length * math.hypot(force.X, force.Y)) > _NOTHING * abs(along) or length == 0.0:
        return None

    def ask(instant: StateQuantities) -> Mapping[str, Any]:
        own, ends = _forces(instant, k)[acting[1]], [_place(instant, k, each) for each in acting]
        (a, b), (c, d) = [end for end in ends if end is not None]
        x, y = c - a, d - b
        return {"": (own.X * x + own.Y * y) / sqrt(x * x + y * y)}

    return solved.values(ask, {"": "N"})[""]


def _meeting(solved: SolvedInstant, k: int, acting: tuple[str, ...], largest: float) -> Mapping[str, Value]:
    """Return where the lines of action of three forces meet (m), by axis; nothing where they are parallel."""
    numbers = _forces(solved.numbers, k)

    def turned(pair: tuple[str, str]) -> float:
        one, other = (numbers[each] for each in pair)
        return float(abs(one.X * other.Y - one.Y * other.X))

    pair = max(combinations(acting, 2), key=turned)
    if turned(pair) <= _NOTHING * largest * largest:
        return {}

    def ask(instant: StateQuantities) -> Mapping[str, Any]:
        one, other = (_forces(instant, k)[each] for each in pair)
        across = one.X * other.Y - other.X * one.Y
        x, y = one.X * other.m - other.X * one.m, one.Y * other.m - other.Y * one.m
        return {"x": x / across, "y": y / across}

    return solved.values(ask, {"x": "m", "y": "m"})


def _place(instant: StateQuantities, k: int, element: str) -> tuple[S, S] | None:
    """Return where an element acts on a body; None where it has no one place."""
    own = {
        marker.pose.position: marker
        for each in instant.exertions
        if _name(each) == element
        for marker in each.points
        if marker.body == k
    }
    if len(own) != 1:
        return None
    rotation, origin = instant.motion.poses[k]
    at = apply(rotation, instant.motion.point(next(iter(own.values()))))
    return origin[0] + at[0], origin[1] + at[1]
