"""`ask: {section: beam, at: x0, component: moment}`: what a section of a beam transmits, at a place or along it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any, Final, NamedTuple, Self

import numpy as np

from multibody_sym.algebra.quotients import PRECISE, Letter
from multibody_sym.answers.ask.find import polished
from multibody_sym.answers.ask.question import AskedMotion, Question, SingleQuestion
from multibody_sym.answers.ask.varied import roots_near
from multibody_sym.answers.ask.working import Working, equation
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.records import Line, Sentence
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.dynamics.programs.sections import (
    LETTERS,
    UNITS,
    Beam,
    Cut,
    actions_on,
    component_at,
    place_of,
    section_force,
)
from multibody_sym.errors import ModelError, at
from multibody_sym.mechanics.load_records import LineLoad
from multibody_sym.model.bodies import mass_of
from multibody_sym.model.forces import Torque
from multibody_sym.model.settings import GREATEST, Ask
from multibody_sym.model.state_words import time_of
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import ZERO, Node, real, symbol
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value

_WORDS: Final = {"axial": "axial force", "shear": "shear force", "moment": "bending moment"}
_SAME: Final = 1e-9
"""Places nearer than this part of the beam's length are one."""
_ROUNDING: Final = 1e-13
_PARTS: Final = 48
"""Parts of a stretch at whose ends N, V and M are compared."""
_BESIDE_ENDS: Final = 1e-6
"""The part of a stretch beside its ends at which they are looked at, too."""
_PLACES: Final = ("x", "s", "xi")
"""The letters of the place along a beam, in the order of preference: the first that the model does not have."""


class Stretch(NamedTuple):
    """A part of a beam between two places at which something acts (m, with their formulas), and what acts before it."""

    begin: float
    end: float
    first: Node
    last: Node
    cut: Cut


class SectionExtreme(NamedTuple):
    """A `value` of N, V or M at the end of a stretch, or where its derivative (`slope`) vanishes within, at `place`."""

    stretch: Stretch
    place: Value
    value: Value
    slope: Node | None = None

    @property
    def place_text(self) -> str:
        """The place for people."""
        form = self.place.expression
        return f"{self.place.value:.6g} m" if form is None else text(form)

    def is_as_large_as(self, other: SectionExtreme) -> bool:
        """Return whether both are of one size."""
        size = abs(other.value.value or 0.0)
        return abs(abs(self.value.value or 0.0) - size) <= _SAME * size


@dataclass(frozen=True)
class _BeamQuestion(Question):
    """A question about what sections of a beam transmit."""

    is_of_start = True

    beam: str
    component: str

    def unit(self, _motion: AskedMotion) -> str:
        return UNITS[self.component]

    def _cut(self, motion: AskedMotion, working: Working) -> CutBeam | None:
        """Return the beam; None where statics alone does not determine what acts on it."""
        cut = CutBeam(motion.solved, self.beam)
        if cut.undetermined:
            working.notes.append(f"statics alone does not determine {cut.undetermined}")
            return None
        return cut


@dataclass(frozen=True)
class SectionQuestion(_BeamQuestion, SingleQuestion):
    """What the section of a beam transmits `at` a place; without one as a formula of the place."""

    at: Node | None

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        if ask.section is None or ask.component is None or ask.at == GREATEST:
            return None
        return cls(ask.section, ask.component, time_of(ask.at))

    def words(self) -> str:
        where = "along it" if self.at is None else f"at {text(self.at)}"
        return f"{_WORDS[self.component]} of {self.beam} {where}"

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        cut = self._cut(motion, working)
        if cut is None:
            return Value(None, unit=UNITS[self.component])
        working.steps.append(lambda: [Sentence((f"equilibrium of the part with smaller {cut.letter}, on which act",))])
        if self.at is None:
            return self._along(cut, working)
        x, place = motion.solved.number(self.at), self.at
        with at("at"):
            stretch = cut.stretch_at(x)
        found = cut.value(self.component, stretch, place)
        if cut.jumps_at(self.component, stretch, x):
            working.notes.append(f"just behind {text(place)}")
        elif len(cut.stretches) > 1 and place.shadow is None and cut.is_within(stretch, x):
            working.notes.append(f"for {text(stretch.first)} <= {text(place)} <= {text(stretch.last)}")
        working.steps.append(lambda: cut.lines(self.component, stretch, place))
        return found

    def _along(self, cut: CutBeam, working: Working) -> Value:
        """Return the formula of the place, stretch by stretch."""
        place, found = symbol(cut.letter), []
        for stretch in cut.stretches:
            value = cut.value(self.component, stretch, place).expression
            if value is None:
                working.notes.append("it has no formula; ask for it at a place")
                return Value(None, unit=UNITS[self.component])
            found.append((stretch, value))
            working.steps.append(partial(self._lines, cut, stretch, place, value))
        formula = found[-1][1]
        for stretch, value in reversed(found[:-1]):
            formula = value if value == formula else BUILD["where"](BUILD["less"](place, stretch.last), value, formula)
        ends = f"{text(cut.stretches[0].first)} to {text(cut.stretches[-1].last)}"
        working.notes.append(f"{cut.letter} is the place along {self.beam}, from {ends}")
        return Value(None, formula, unit=UNITS[self.component])

    def _lines(self, cut: CutBeam, stretch: Stretch, place: Node, value: Node) -> Iterator[Line]:
        yield from cut.lines(self.component, stretch, place)
        if len(cut.stretches) > 1:
            yield equation(symbol(LETTERS[self.component]), value)


class GreatestSectionQuestion(_BeamQuestion):
    """The N, V or M of a beam that is greatest in size, and its place along the beam (`.at`)."""

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        if ask.section is None or ask.component is None or ask.at != GREATEST:
            return None
        return cls(ask.section, ask.component)

    def words(self) -> str:
        return f"greatest {_WORDS[self.component]} of {self.beam}"

    def answers(self, motion: AskedMotion, working: Working) -> Mapping[str, Value]:
        cut = self._cut(motion, working)
        if cut is None:
            return {"": Value(None, unit=UNITS[self.component])}
        extremes = cut.extremes(self.component)
        best = max(extremes, key=lambda each: abs(each.value.value or 0.0) - _SAME * (each.place.value or 0.0))
        equal = [x for x in extremes if x.is_as_large_as(best) and not cut.is_one_place(x, best)]
        if equal and best.value.value:
            working.notes.append(f"as large in size at {', '.join(dict.fromkeys(x.place_text for x in equal))}")
        working.steps.append(lambda: self._lines(cut, best, extremes))
        return {"": best.value, ".at": best.place}

    def _lines(self, cut: CutBeam, best: SectionExtreme, extremes: Sequence[SectionExtreme]) -> Iterator[Line]:
        letter, kind = LETTERS[self.component], self.component
        slope = {"moment": "the shear force vanishes or jumps", "shear": "no load acts, or a force acts"}
        where = f"it is greatest where {slope.get(kind, 'a force acts')}, or at an end"
        yield Sentence((f"equilibrium of the part with smaller {cut.letter}; {where}",))
        if best.slope is not None:
            yield from cut.lines(kind, best.stretch, symbol(cut.letter))
            yield equation(best.slope, ZERO, f"its derivative by {cut.letter} vanishes")
        told = [(each.value.expression or real(each.value.value or 0.0), each.place_text) for each in extremes]
        for value, place in dict.fromkeys(told):
            yield Sentence((f"{letter} = ", value, f" at {cut.letter} = {place}"))


class CutBeam:
    """A beam of a solved start: its stretches, between the places at which something acts on it."""

    def __init__(self, solved: SolvedInstant, name: str) -> None:
        taken = {str(node.data) for node in solved.mechanism.symbols}
        self.letter = next(letter for letter in _PLACES if letter not in taken)
        self._solved, self._name = solved, name
        self._beam = _beam(solved, name)
        self._actions = actions_on(solved.numbers, self._beam)
        self._verify_places()
        self.stretches = self._stretches()

    @property
    def undetermined(self) -> str:
        """The elements on the beam whose forces are not unique; empty where there are none."""
        others = [actions_on(other, self._beam) for other in self._solved.others]
        names = []
        for k, point in enumerate(self._actions.points):
            size = max(1.0, *(abs(x) for x in point.resultant))
            for other in others:
                if np.abs(np.subtract(other.points[k].resultant, point.resultant)).max() > _SAME * size:
                    names.append(point.name)
        return ", ".join(dict.fromkeys(names))

    def stretch_at(self, x: float) -> Stretch:
        """Return the stretch of a place (m), the one behind it where something acts there. Raises ModelError."""
        near = self._near
        if not self.stretches[0].begin - near <= x <= self.stretches[-1].end + near:
            ends = f"from {self.stretches[0].begin:g} to {self.stretches[-1].end:g} m"
            message = f"{x:g} m is beyond {self._name}, which reaches {ends} along its x axis"
            raise ModelError(message, number="M109")
        return next((each for each in self.stretches if x < each.end - near), self.stretches[-1])

    @property
    def _near(self) -> float:
        return _SAME * (self.stretches[-1].end - self.stretches[0].begin)

    def is_within(self, stretch: Stretch, x: float) -> bool:
        """Return whether a place (m) is at no end of a stretch."""
        return stretch.begin + self._near < x < stretch.end - self._near

    def jumps_at(self, component: str, stretch: Stretch, x: float) -> bool:
        """Return whether N, V or M has another value before the place where a stretch begins."""
        number = self.stretches.index(stretch)
        if number == 0 or abs(x - stretch.begin) > self._near:
            return False
        cuts = (each.cut for each in self.stretches[number - 1 : number + 1])
        before, behind = (float(section_force(self._actions, component, cut, x)) for cut in cuts)
        return abs(behind - before) > _SAME * max(abs(before), abs(behind))

    def value(self, component: str, stretch: Stretch, place: Node) -> Value:
        """Return N, V or M at a place on a stretch, which may be the letter of a place."""

        def ask(instant: StateQuantities) -> Mapping[str, Any]:
            x = self._at(instant, place, stretch)
            return {"": section_force(actions_on(instant, self._beam), component, stretch.cut, x)}

        found = self._with_place(place, stretch).values(ask, {"": UNITS[component]})[""]
        if found.expression is None and found.value is not None and place == symbol(self.letter):
            ends = [section_force(self._actions, component, stretch.cut, x) for x in (stretch.begin, stretch.end)]
            if max(abs(float(x) - found.value) for x in ends) <= _SAME * abs(found.value):
                return replace(found, expression=real(found.value))  # a number of many digits
        return found

    def number(self, component: str, stretch: Stretch, x: float) -> float:
        """Return N, V or M at a place (m) on a stretch as a number."""
        return float(section_force(self._actions, component, stretch.cut, x))

    def is_one_place(self, one: SectionExtreme, other: SectionExtreme) -> bool:
        """Return whether two extremes are at one place."""
        return abs((one.place.value or 0.0) - (other.place.value or 0.0)) <= self._near

    def extremes(self, component: str) -> list[SectionExtreme]:
        """Return N, V or M at the ends of all stretches, and where it is greatest or least within them."""
        found: list[SectionExtreme] = []
        for stretch in self.stretches:
            places = Value(stretch.begin, stretch.first, "m"), Value(stretch.end, stretch.last, "m")
            ends = stretch.first, stretch.last
            begin, end = (
                SectionExtreme(stretch, place, self.value(component, stretch, node))
                for place, node in zip(places, ends, strict=True)
            )
            if found and found[-1].is_as_large_as(begin) and found[-1].value.value == begin.value.value:
                found.pop()
            found += [begin, *self._within(component, stretch), end]
        return found

    def _within(self, component: str, stretch: Stretch) -> Iterator[SectionExtreme]:
        low, high = stretch.begin, stretch.end
        beside = _BESIDE_ENDS * (high - low)
        places = [low, low + beside, *(low + (high - low) * k / _PARTS for k in range(1, _PARTS)), high - beside, high]
        numbers = [self.number(component, stretch, x) for x in places]
        least = _ROUNDING * max(map(abs, numbers))
        turns = [
            k
            for k in range(1, len(places) - 1)
            if (numbers[k] - numbers[k - 1]) * (numbers[k + 1] - numbers[k]) <= 0.0
            and max(abs(numbers[k] - numbers[k - 1]), abs(numbers[k + 1] - numbers[k])) > least
        ]
        for k in turns:
            yield self._turning(component, stretch, places[k - 1], places[k + 1])

    def _turning(self, component: str, stretch: Stretch, low: float, high: float) -> SectionExtreme:
        letter = symbol(self.letter)
        form = self.value(component, stretch, letter).expression
        if form is not None:
            shear = self.value("shear", stretch, letter).expression if component == "moment" else None
            slope, known = shear or derivative(form, letter), self._solved.sample
            x = polished(lambda x: evaluate_float([slope], {**known, letter: x})[0], (low + high) / 2, low, high)
            for root in roots_near(slope, letter, x, self._with_place(letter, stretch)):
                return SectionExtreme(stretch, Value(x, root, "m"), self.value(component, stretch, root), slope)
        from scipy.optimize import minimize_scalar  # scipy takes longer to import than most answers take

        sign = -1.0 if self.number(component, stretch, (low + high) / 2) > self.number(component, stretch, low) else 1.0
        best = minimize_scalar(
            lambda x: sign * self.number(component, stretch, x), bounds=(low, high), method="bounded",
            options={"xatol": _SAME * (high - low)},
        )  # fmt: skip
        value = Value(self.number(component, stretch, best.x), unit=UNITS[component])
        return SectionExtreme(stretch, Value(float(best.x), unit="m", error=_SAME ** 0.5 * (high - low)), value)

    def lines(self, component: str, stretch: Stretch, place: Node) -> Iterator[Line]:
        """Yield what acts on the part that is cut off, and the sum of its moments or forces by element."""

        def ask(instant: StateQuantities) -> Mapping[str, Any]:
            x = self._at(instant, place, stretch)
            acting = actions_on(instant, self._beam).on(stretch.cut, x)
            return {str(k): component_at(component, x, resultant) for k, (_, resultant) in enumerate(acting)}

        terms = self._with_place(place, stretch).values(ask, {})
        cut, points, lines = stretch.cut, self._actions.points, self._actions.lines
        acting = [(points[k].x, points[k].name) for k in cut.points]  # where each begins, in the order of its actions
        acting += [(lines[k].ends[0], lines[k].name) for k in (*cut.wholes, *cut.parts)]
        order = sorted(range(len(terms)), key=lambda k: acting[k][0])
        known = [(acting[k][1], terms[str(k)]) for k in order if terms[str(k)].value]
        along = place == symbol(self.letter)
        inside = len(self.stretches) > 1 and (along or self.is_within(stretch, self._solved.number(place)))
        where = f"for {text(stretch.first)} < {text(place)} < {text(stretch.last)}: " if inside else ""
        yield Sentence((f"{where}{', '.join(dict.fromkeys(name for name, _ in known)) or 'nothing'}",))
        forms = [x.expression for _, x in known if x.expression is not None]
        if len(forms) == len(known) > 1:
            yield equation(symbol(LETTERS[component]), sum(forms, ZERO))

    def _with_place(self, place: Node, stretch: Stretch) -> SolvedInstant:
        """Return the solved start, with the letter of the place in its closed forms where it has that."""
        if place != symbol(self.letter):
            return self._solved
        solved, sample = self._solved, (stretch.begin + stretch.end) / 2
        letter = Letter(place, PRECISE.mpf(sample))
        symbolic = replace(solved.symbolic, letters={**solved.symbolic.letters, place: letter})
        forms = solved.forms
        if forms is not None:
            forms = replace(forms, known={**forms.known, place: forms.field.letter((place, sample), letter)})
        return replace(solved, symbolic=symbolic, forms=forms)

    def _at(self, instant: StateQuantities, place: Node, stretch: Stretch) -> Any:
        if place != symbol(self.letter):
            return self._solved.asked(place)(instant)[""]
        if instant is self._solved.nodes:
            return place
        middle = (stretch.begin + stretch.end) / 2
        return real(middle) if instant is self._solved.slots else middle

    def _verify_places(self) -> None:
        """Raise ModelError where something acts on the beam at no known place."""
        largest = max((abs(x) for each in self._actions.points for x in each.resultant), default=0.0)
        for name, force, moment in self._actions.homeless:
            if max(abs(float(x)) for x in (*force, *moment)) > _SAME * largest:
                declared = self._solved.system.forces.get(name)
                cure = "; give the couple one, at: a point of the body" if isinstance(declared, Torque) else ""
                raise ModelError(f"{name} acts on {self._name} at no one place along it{cure}", number="M112")

    def _stretches(self) -> list[Stretch]:
        solved, beam = self._solved, self._beam
        markers = [m for m in solved.mechanism.markers.values() if m.body == beam.axis.body]
        declared = solved.system.bodies[_body(self._name, solved)].points

        def ask(instant: StateQuantities) -> Mapping[str, Any]:
            every = actions_on(instant, beam)
            places = [point.x for point in every.points]
            places += [x for line in every.lines for x in line.ends]
            places += [place_of(instant, beam, m)[0] for m in markers if m.name.rpartition(".")[2] in declared]
            return {str(k): x for k, x in enumerate(places)}

        places = [(x.value or 0.0, x.expression) for x in solved.values(ask, {}).values()]
        acting = places[: len(self._actions.points) + 2 * len(self._actions.lines)]
        ends = [min(places, key=_first), max(places, key=_first)] if places else []
        near = _SAME * (ends[1][0] - ends[0][0]) if ends else 0.0
        marks: list[tuple[float, Node]] = []
        for value, form in sorted(((x, real(x) if form is None else form) for x, form in [*acting, *ends]), key=_first):
            if not marks or value > marks[-1][0] + near:
                marks.append((value, form))
        if len(marks) < 2:
            message = f"{self._name} has no length along its x axis; give its body the points at which it ends"
            raise ModelError(message, number="M112")
        return [
            Stretch(a, b, first, last, self._cut((a + b) / 2))
            for (a, first), (b, last) in pairwise(marks)
        ]

    def _cut(self, x: float) -> Cut:
        lines = list(enumerate(line.ends for line in self._actions.lines))
        return Cut(
            tuple(k for k, point in enumerate(self._actions.points) if point.x < x),
            tuple(k for k, (_, last) in lines if last < x),
            tuple(k for k, (first, last) in lines if first < x <= last),
        )


def _first(place: tuple[float, Node | None]) -> float:
    return place[0]


def _body(name: str, solved: SolvedInstant) -> str:
    """Return the body of a beam, which is named by it or by a frame of it."""
    return name if name in solved.system.bodies else name.rpartition(".")[0]


def _beam(solved: SolvedInstant, name: str) -> Beam:
    """Return a beam, with its mass along it. Raises ModelError where it is not known how its mass or a load lies."""
    mechanism, system = solved.mechanism, solved.system
    axis, body = mechanism.markers[name], _body(name, solved)
    declared = system.bodies[body]
    length = None
    if declared.shape is not None and declared.shape.kind == "rod" and name == body:
        (length,) = evaluate(declared.shape.sizes[:1], lambda leaf: mechanism.symbols.get(leaf, leaf))
    elif mass_of(declared).mass.shadow != 0.0:
        raise ModelError(
            f"how the mass of {body} lies along it is known of a rod on its x axis: shape: {{rod: l, mass: m}}; "
            "or leave its mass out",
            number="M112",
        ).under("section")
    beam = Beam(axis)
    backwards, across = [], []
    for load in mechanism.loads:
        if not isinstance(load, LineLoad) or load.ends[0].body != axis.body:
            continue
        begin, end = (np.array(place_of(solved.numbers, beam, marker), dtype=float) for marker in load.ends)
        way = end - begin
        if abs(way[0]) <= _SAME * np.abs(way).max():
            across.append(load.name)
        elif np.abs(way[1:]).max() > _SAME * np.abs(way).max():
            first, second = (marker.name for marker in load.ends)
            raise ModelError(
                f"{load.name} acts along a line oblique to {name}: make the arm from {first} to {second} a body of its "
                f"own, joints: {{corner: {{type: weld, parent: {first}, child: arm}}}}, and let {load.name} act on it",
                number="M112",
            ).under("section")
        elif way[0] < 0.0:
            backwards.append(load.name)
    return Beam(axis, length, frozenset(backwards), frozenset(across))
